// SPDX-License-Identifier: GPL-2.0-or-later
#include "bench/clocked_kernels.hpp"

#include <fmt/format.h>

#include <cmath>
#include <memory>

#include "analysis/gradients.hpp"
#include "bench/kernels.hpp"
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
                         const Kernel& kernel, double span) {
    const auto stepper = std::make_shared<LoadedStepper<double>>(kernel);
    const auto run = [stepper, tolerance, span, until = problem.until, masses = masses_of(problem)](
                         double setting, std::vector<Trajectory>& trajectories) -> Effort {
        change_momenta(masses, trajectories, std::multiplies<>());
        if (stepper->prepare({}, span / setting) != LOBATTO_OK) return {};
        const auto most = static_cast<std::int64_t>(4 * setting);  // other trajectories of an ensemble take others
        const Effort effort = one_by_one(trajectories, [&](Trajectory& trajectory) {
            return run_chain(*stepper, until, tolerance, most, trajectory);
        });
        change_momenta(masses, trajectories, std::divides<>());
        return effort;
    };
    const std::string name =
        fmt::format("{}, clock {}{}", method.name(), clock, tolerance > 0 ? fmt::format(", to {:.0e}", tolerance) : "");
    Contestant contestant{name, method.order(), true, true, Ladder::steps, run};
    contestant.fewest_steps = problem.fewest_chain_steps;
    contestant.cold_start = [&problem, method, clock] { return cold_start_seconds(problem, method, 0, clock); };
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

Contestants clocked_contestants(const Problem& problem, bool few) {
    Contestants contestants;
    const std::vector<double> all = {0, 1e-13, 1e-12, 1e-11, 1e-10, 1e-9, 1e-8, 1e-7}, some = {0, 1e-12, 1e-10, 1e-8};
    for (const std::string& clock : problem.clocks) {
        const std::vector<Method> methods = methods_with_clock(few);
        const std::vector<Kernel> kernels = kernels_of(problem, methods, 0, clock);
        const double span = span_of(problem, kernels.back());
        for (std::size_t i = 0; i < methods.size(); ++i)
            for (const double tolerance : few ? some : all)
                contestants.push_back(contestant_of(problem, clock, methods[i], tolerance, kernels[i], span));
    }
    return contestants;
}

}  // namespace lobatto::bench
