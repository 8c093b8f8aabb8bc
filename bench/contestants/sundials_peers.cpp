// SPDX-License-Identifier: GPL-2.0-or-later
// SUNDIALS as contestants: ARKODE's explicit Fehlberg 13-7-8 and CVODE's Adams methods (orders to 12, fixed-point
// iteration).
#include <arkode/arkode_erkstep.h>
#include <cvode/cvode.h>
#include <nvector/nvector_serial.h>
#include <sundials/sundials_context.h>
#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>

#include "bench/contestants/contestant.hpp"

namespace lobatto::bench {

namespace {

template <class Type>
int slope(double, N_Vector y, N_Vector dy, void*) {
    Type::slope(N_VGetArrayPointer(y), N_VGetArrayPointer(dy));
    return 0;
}

// The vector and the context that every solver of SUNDIALS wants.
struct Workspace {
    SUNContext context = nullptr;
    N_Vector y = nullptr;

    explicit Workspace(int size) {
        SUNContext_Create(nullptr, &context);
        y = N_VNew_Serial(size, context);
    }
    ~Workspace() {
        N_VDestroy(y);
        SUNContext_Free(&context);
    }
    Workspace(const Workspace&) = delete;
    Workspace& operator=(const Workspace&) = delete;
};

template <class Type>
Effort run_arkode(double until, long most_steps, double tolerance, std::vector<Trajectory>& trajectories) {
    Workspace work(2 * Type::coordinates);
    double* const y = N_VGetArrayPointer(work.y);
    join(trajectories.front(), y);
    void* memory = ERKStepCreate(slope<Type>, 0, work.y, work.context);
    ERKStepSetTableNum(memory, ARKODE_FEHLBERG_13_7_8);
    ERKStepSStolerances(memory, tolerance, tolerance);
    ERKStepSetMaxNumSteps(memory, most_steps);
    ERKStepSetErrFile(memory, nullptr);
    const Effort all = one_by_one(trajectories, [&](Trajectory& trajectory) {
        join(trajectory, y);
        ERKStepReInit(memory, slope<Type>, 0, work.y);
        ERKStepSetStopTime(memory, until);
        double t = 0;
        Effort effort;
        effort.good = ERKStepEvolve(memory, until, work.y, &t, ARK_NORMAL) >= 0;
        ERKStepGetNumSteps(memory, &effort.steps);
        ERKStepGetNumRhsEvals(memory, &effort.evaluations);
        split(y, trajectory);
        return effort;
    });
    ERKStepFree(&memory);
    return all;
}

template <class Type>
Effort run_cvode(double until, long most_steps, double tolerance, std::vector<Trajectory>& trajectories) {
    Workspace work(2 * Type::coordinates);
    double* const y = N_VGetArrayPointer(work.y);
    join(trajectories.front(), y);
    void* memory = CVodeCreate(CV_ADAMS, work.context);
    CVodeInit(memory, slope<Type>, 0, work.y);
    const SUNNonlinearSolver solver = SUNNonlinSol_FixedPoint(work.y, 0, work.context);
    CVodeSetNonlinearSolver(memory, solver);
    CVodeSStolerances(memory, tolerance, tolerance);
    CVodeSetMaxNumSteps(memory, most_steps);
    CVodeSetErrFile(memory, nullptr);
    const Effort all = one_by_one(trajectories, [&](Trajectory& trajectory) {
        join(trajectory, y);
        CVodeReInit(memory, 0, work.y);
        CVodeSetStopTime(memory, until);
        double t = 0;
        Effort effort;
        effort.good = CVode(memory, until, work.y, &t, CV_NORMAL) >= 0;
        CVodeGetNumSteps(memory, &effort.steps);
        CVodeGetNumRhsEvals(memory, &effort.evaluations);
        split(y, trajectory);
        return effort;
    });
    SUNNonlinSolFree(solver);
    CVodeFree(&memory);
    return all;
}

}  // namespace

Contestants sundials_peers(const Problem& problem) {
    return with_type_of(problem, [&](auto type) -> Contestants {
        using Type = decltype(type);
        const double until = problem.until;
        const long most_steps = problem.most_steps;
        return {{"ARKODE Fehlberg 13-7-8", 8, false, false, Ladder::tolerance,
                 [=](double tolerance, auto& trajectories) {
                     return run_arkode<Type>(until, most_steps, tolerance, trajectories);
                 }},
                {"CVODE Adams", 0, false, false, Ladder::tolerance, [=](double tolerance, auto& trajectories) {
                     return run_cvode<Type>(until, most_steps, tolerance, trajectories);
                 }}};
    });
}

}  // namespace lobatto::bench
