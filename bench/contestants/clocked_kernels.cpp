// SPDX-License-Identifier: GPL-2.0-or-later
#include "bench/contestants/clocked_kernels.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <memory>

#include "analysis/gradients.hpp"
#include "bench/contestants/kernels.hpp"
#include "runtime/error.hpp"

namespace lobatto::bench {

namespace {

// To T in steps of h in the time of the clock; the last state is that at T.
Effort run_chain(LoadedStepper<double>& stepper, double until, double tolerance, std::int64_t most_steps,
                 Trajectory& trajectory) {
    if (stepper.start(0, trajectory.q, trajectory.p) != LOBATTO_OK) return {};
    std::int64_t steps = 0, iterations = 0, arrived = 0;
    while (arrived == 0) {
        lobatto_advance call{};
        call.steps = 1;
        call.tolerance = tolerance;
        call.interval = call.end = until;
        if (stepper.advance(call) != LOBATTO_OK) return {};
        steps += call.chain_steps;
        iterations += call.iterations;
        arrived = call.steps_done;
        if (arrived == 0 && steps >= most_steps) return {};
    }
    double time;
    stepper.state(time, trajectory.q, trajectory.p);
    const double evaluations =
        gradients_of(stepper.kernel().table(), static_cast<double>(iterations), static_cast<double>(steps));
    return {true, static_cast<long>(steps), static_cast<long>(evaluations)};
}

// The same of trajectories side by side: a lane takes the next one when one has ended.
Effort run_chains(const lobatto_kernel& kernel, double h, double until, double tolerance, std::int64_t most_steps,
                  std::vector<Trajectory>& trajectories) {
    const auto lanes = static_cast<std::size_t>(kernel.lanes), n = static_cast<std::size_t>(kernel.coordinates);
    const auto alignment = static_cast<std::size_t>(kernel.ensemble_alignment);
    const std::size_t bytes = (static_cast<std::size_t>(kernel.ensemble_bytes) + alignment - 1) / alignment * alignment;
    const std::unique_ptr<void, void (*)(void*)> ensemble(std::aligned_alloc(alignment, bytes), std::free);
    kernel.refilled_prepare(ensemble.get(), &h);
    std::vector<double> rows(lanes * (1 + 2 * n));
    std::vector<std::int32_t> status(lanes, LOBATTO_UNSUPPORTED);
    std::vector<std::int64_t> done(lanes), iterations(lanes), written(lanes), steps(lanes), steps_of(lanes);
    std::vector<Trajectory*> in_lane(lanes, nullptr);
    lobatto_refilled_advance call{};
    call.steps = call.capacity = 1;
    call.tolerance = tolerance;
    call.interval = call.end = until;
    call.records = rows.data();
    call.status = status.data();
    call.steps_done = done.data();
    call.iterations = iterations.data();
    call.records_written = written.data();
    call.chain_steps = steps.data();
    Effort all{true, 0, 0};
    std::size_t next = 0, ended = 0;
    while (ended < trajectories.size()) {
        for (std::size_t lane = 0; lane < lanes; ++lane) {
            if (in_lane[lane] != nullptr || next == trajectories.size()) continue;
            Trajectory& start = trajectories[next++];
            const double time = 0;
            status[lane] = kernel.refilled_fill(ensemble.get(), static_cast<std::int32_t>(lane), nullptr, &time,
                                                start.q.data(), start.p.data());
            if (status[lane] != LOBATTO_OK) return {};
            in_lane[lane] = &start;
            steps_of[lane] = 0;
        }
        kernel.refilled_advance(ensemble.get(), &call);
        for (std::size_t lane = 0; lane < lanes; ++lane) {
            if (in_lane[lane] == nullptr) continue;
            steps_of[lane] += steps[lane];
            if (status[lane] != LOBATTO_OK || steps_of[lane] > most_steps) return {};
            all.steps += static_cast<long>(steps[lane]);
            all.evaluations += static_cast<long>(
                gradients_of(kernel, static_cast<double>(iterations[lane]), static_cast<double>(steps[lane])));
            if (done[lane] == 0) continue;
            const double* const row = rows.data() + lane * (1 + 2 * n) + 1;
            in_lane[lane]->q.assign(row, row + n);
            in_lane[lane]->p.assign(row + n, row + 2 * n);
            in_lane[lane] = nullptr;
            status[lane] = LOBATTO_UNSUPPORTED;
            ++ended;
        }
    }
    return all;
}

// How long T lasts in the time of the clock: with steps a quarter as long each until that no longer changes.
double span_of(const Problem& problem, const Kernel& kernel) {
    constexpr double settled = 1e-3, most = 30;  // times the fewest steps
    const std::vector<double> masses = masses_of(problem);
    LoadedStepper<double> stepper(kernel);
    double before = 0;
    for (double h = problem.until / 16; h > 1e-9 * problem.until; h /= 4) {
        std::vector<Trajectory> start = {{problem.q, problem.p}};
        change_momenta(masses, start, std::multiplies<>());
        if (stepper.prepare({}, h) != LOBATTO_OK) continue;
        const auto most_steps = static_cast<std::int64_t>(most * problem.fewest_chain_steps);
        const Effort effort = run_chain(stepper, problem.until, 0, most_steps, start.front());
        const double span = effort.good ? h * static_cast<double>(effort.steps) : 0;
        if (static_cast<double>(effort.steps) > problem.fewest_chain_steps &&
            std::fabs(span - before) < h + settled * span)
            return span;
        before = span;
    }
    throw ComputationError(problem.name + ": no step of its clock brings the scene to the end");
}

Contestant contestant_of(const Problem& problem, const std::string& clock, Method method, double tolerance,
                         const Kernel& kernel, double span, std::int64_t together) {
    const auto stepper = std::make_shared<LoadedStepper<double>>(kernel);
    const auto run = [stepper, tolerance, span, until = problem.until, masses = masses_of(problem)](
                         double setting, std::vector<Trajectory>& trajectories) -> Effort {
        change_momenta(masses, trajectories, std::multiplies<>());
        const lobatto_kernel& table = stepper->kernel().table();
        if (stepper->prepare({}, span / setting) != LOBATTO_OK) return {};
        const auto most = static_cast<std::int64_t>(4 * setting);  // other trajectories of an ensemble take others
        const Effort effort = table.lanes > 0 ? run_chains(table, span / setting, until, tolerance, most, trajectories)
                                              : one_by_one(trajectories, [&](Trajectory& trajectory) {
                                                    return run_chain(*stepper, until, tolerance, most, trajectory);
                                                });
        change_momenta(masses, trajectories, std::divides<>());
        return effort;
    };
    const std::string name =
        fmt::format("{}, clock {}{}", method.name(), clock, tolerance > 0 ? fmt::format(", to {:.0e}", tolerance) : "");
    Contestant contestant{name, method.order(), true, true, Ladder::steps, run};
    contestant.fewest_steps = problem.fewest_chain_steps;
    contestant.cold_start = [&problem, method, together, clock] {
        return cold_start_seconds(problem, method, together, clock);
    };
    return contestant;
}

std::vector<Method> methods_with_clock(bool few) {
    if (few) return {{Family::lobatto, 9}, {Family::lobatto, 12}, {Family::gauss, 8}};
    std::vector<Method> methods;
    for (const int points : {5, 6, 7, 8, 9, 10, 11, 12}) methods.push_back({Family::lobatto, points});
    for (const int stages : {4, 5, 6, 7, 8, 9, 10}) methods.push_back({Family::gauss, stages});
    return methods;
}

}  // namespace

Contestants clocked_contestants(const Problem& problem, bool few, std::int64_t together) {
    Contestants contestants;
    const std::vector<double> all = {0, 1e-13, 1e-12, 1e-11, 1e-10, 1e-9, 1e-8, 1e-7}, some = {0, 1e-12, 1e-10, 1e-8};
    for (const std::string& clock : problem.clocks) {
        const std::vector<Method> methods = methods_with_clock(few);
        const std::vector<Kernel> kernels = kernels_of(problem, methods, together, clock);
        const double span = span_of(problem, kernels_of(problem, {methods.back()}, 0, clock).front());
        for (std::size_t i = 0; i < methods.size(); ++i)
            for (const double tolerance : few ? some : all)
                contestants.push_back(contestant_of(problem, clock, methods[i], tolerance, kernels[i], span, together));
    }
    return contestants;
}

}  // namespace lobatto::bench
