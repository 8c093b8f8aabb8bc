// SPDX-License-Identifier: GPL-2.0-or-later
// What there is to know of the stability of a scene's steps: exact_number, and measured on its kernel.
#include "analysis/stability/report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "analysis/kernel/kernel_of.hpp"
#include "analysis/motion.hpp"
#include "analysis/stability/linearisation.hpp"
#include "generator/formula/limits.hpp"
#include "generator/mechanics/modified_energy.hpp"
#include "generator/pipeline.hpp"
#include "runtime/error.hpp"
#include "runtime/measure/monodromy.hpp"

namespace lobatto {

namespace {

using Eigen::VectorXd;

constexpr std::int64_t states_looked_at = 200;
constexpr int most_starts = 24;                   // of the search for equilibria
constexpr std::size_t most_for_eigenvalues = 64;  // coordinates: matrices of twice as many rows
constexpr std::size_t most_reported_coordinates = 1024;
constexpr std::int64_t most_steps = 10'000'000;  // of a run to look at, times coordinates
constexpr int fewest_parts = 8;                  // of a step: shorter ones stand for the motion itself
constexpr int most_parts = 16384;                // over the coordinates squared
constexpr double thrown = 1000;                  // times as far as anything before

std::vector<double> plain(const VectorXd& values) {
    return {values.begin(), values.end()};
}

GiNaC::numeric exact_number(double x) {
    return GiNaC::numeric(cln::rational(cln::cl_DF(x)));
}

// To the rounding of a frequency.
bool is_limit(const Stability& member, double z) {
    return std::any_of(member.limits.begin(), member.limits.end(), [&](const RealRoot& limit) {
        const double there = limit.approximation(20).to_double();
        return std::fabs(z - there) <= 1e-14 * there;
    });
}

std::vector<Mode> modes_of(const Stability& member, const VectorXd& squared, double h) {
    std::vector<Mode> modes;
    for (const double value : squared) {
        const double z = h * h * value;
        if (!std::isfinite(z))
            throw ComputationError(fmt::format(
                "the squared frequency {:.3g} times the squared step leaves the range of numbers; choose other units",
                value));
        modes.push_back({value, z, rate_of_step(member, exact_number(z)), is_limit(member, z)});
    }
    return modes;
}

// `free`: directions along which nothing pulls.
PointReport point_report(const StabilityReport& report, const LinearSystem& system, const VectorXd& q, int free) {
    PointReport point;
    point.q = q;
    point.obstacle = system.obstacle();
    double expected = 0;
    if (const auto squared = system.squared_frequencies()) {
        point.modes = modes_of(report.member, *squared, report.step);
        for (Mode& mode : *point.modes) mode.free = mode.squared_frequency == 0 && free-- > 0;
        const double lowest = squared->minCoeff();
        point.exact_rate = lowest < 0 ? report.step * std::sqrt(-lowest) : 0;
        expected = largest_rate(report, *point.modes, 1);
    } else {
        point.exact_rate = report.step * system.rate();
    }
    point.kernel_rate = measured_rate_at(report, q, report.step, expected);
    return point;
}

// Of values near an origin.
struct Extent {
    cln::cl_R origin = 0;
    double low = std::numeric_limits<double>::infinity(), high = -low;
    void take(const cln::cl_R& value) {
        low = std::fmin(low, cln::double_approx(value - origin));
        high = std::fmax(high, cln::double_approx(value - origin));
    }
};

struct State {
    double time = 0;
    VectorXd q, p;
};

std::vector<State> states_along(const StabilityReport& report, TrajectoryRequest request, std::int64_t& done) {
    std::vector<State> states;
    const Eigen::Index n = report.kernel->coordinates;
    request.every = std::max<std::int64_t>(1, request.steps / states_looked_at);
    request.dense = 0;
    request.sink = [&](const Records& records) {
        for (std::int64_t i = 0; i < records.count; ++i) {
            const double* const row = records.rows + i * records.columns;
            states.push_back(
                {row[0], Eigen::Map<const VectorXd>(row + 1, n), Eigen::Map<const VectorXd>(row + 1 + n, n)});
        }
    };
    done = integrate(report.kernel, request).steps_done;  // as far as it goes
    if (states.size() > 1) states.pop_back();             // a step that fails may come after the last
    return states;
}

// How fast the motion is at a state, and oscillates near it: unknown at a singularity.
struct Pace {
    double speed = 0;  // of the fastest coordinate
    std::optional<double> frequency;
};

Pace pace_at(const LoadedStepper<double>& stepper, Linearisation& linearisation, const State& state) {
    std::vector<double> velocity;
    if (stepper.velocity(state.time, plain(state.q), plain(state.p), velocity) != LOBATTO_OK) return {};
    const Eigen::Map<const VectorXd> v(velocity.data(), state.q.size());
    Pace pace{v.cwiseAbs().maxCoeff(), {}};
    try {
        pace.frequency = linearisation.at(state.time, state.q, v).largest_frequency();
    } catch (const DomainError&) {
    }
    return pace;
}

// Steps beyond the first limit of the method may throw the motion far away. What follows says nothing of it. From when
// on it was left out.
std::optional<double> leave_out_what_is_thrown(const StabilityReport& report, Linearisation& linearisation,
                                               std::vector<State>& states) {
    if (report.member.limits.empty()) return std::nullopt;
    const double limit = report.member.limits.front().approximation(20).to_double();
    const auto size = [](const State& state) { return state.q.cwiseAbs().maxCoeff(); };
    double extent = size(states.front());
    const auto goes_far = [&](const State& state) { return !(size(state) <= thrown * extent); };
    if (std::none_of(states.begin(), states.end(), goes_far)) return std::nullopt;
    LoadedStepper<double> stepper(report.kernel);
    stepper.prepare(report.parameters, report.step);
    for (const State& state : states) {
        const Pace pace = pace_at(stepper, linearisation, state);
        extent = std::fmax(extent, std::fmax(size(state), report.step * pace.speed));
        const double omega = pace.frequency.value_or(0), angle = report.step * omega, from = state.time;
        if (angle * angle <= limit) continue;
        // Forces as large as there lead no farther than this, whatever they do.
        const auto is_thrown = [&](const State& later) {
            const double turns = omega * (later.time - from);
            return !(size(later) <= thrown * extent * (1 + turns * turns));
        };
        const auto first = std::find_if(states.begin(), states.end(), is_thrown);
        if (first == states.end()) return std::nullopt;
        const double time = first->time;
        states.erase(first, states.end());
        return time;
    }
    return std::nullopt;
}

// Into how many parts a step of this h omega is divided to stand for the motion itself: those of methods with a limit
// are below it.
int parts_of(const StabilityReport& report, double angle) {
    const int n = report.kernel->coordinates;
    int parts = fewest_parts;
    while (!report.member.limits.empty() && angle > parts && parts < most_parts / (n * n)) parts *= 2;
    return parts;
}

TrajectoryReport trajectory_report(const StabilityReport& report, Linearisation& linearisation,
                                   const std::vector<State>& states) {
    TrajectoryReport result;
    result.states = std::ssize(states);
    LoadedStepper<double> stepper(report.kernel), finer(report.kernel);
    stepper.prepare(report.parameters, report.step);
    for (const State& state : states) {
        const double angle = [&] {
            const Pace pace = pace_at(stepper, linearisation, state);
            if (pace.frequency) ++result.frequencies_at;
            return report.step * pace.frequency.value_or(0);
        }();
        if (angle * angle > result.largest_z) {
            result.largest_z = angle * angle;
            result.largest_z_time = state.time;
        }
        if (state.q.size() > static_cast<Eigen::Index>(most_for_eigenvalues)) continue;
        const std::vector<double> q = plain(state.q), p = plain(state.p);
        const auto values = step_eigenvalues(stepper, report.step, state.time, q, p);
        const int parts = parts_of(report, angle);
        finer.prepare(report.parameters, report.step / parts);
        const auto exact = step_eigenvalues(finer, report.step / parts, state.time, q, p, parts);
        if (!values || !exact) continue;
        ++result.looked_at;
        const double rate = std::log(std::abs(values->front())), exact_rate = std::log(std::abs(exact->front()));
        if (rate > 1e-6) ++result.parting;
        if (rate > result.rate) {
            result.rate = rate;
            result.exact_rate = exact_rate;
            result.time = state.time;
        }
        if (rate - exact_rate > result.excess) {
            result.excess = rate - exact_rate;
            result.excess_time = state.time;
        }
    }
    return result;
}

std::optional<EnergyReport> energy_report(const StabilityReport& report, const std::vector<State>& states) {
    const System& system = report.derivation.system;
    const Scene& scene = report.derivation.scene;
    if (!has_modified_energy(system, report.member.method) || states.empty()) return std::nullopt;
    EnergyReport result;
    result.order = report.member.method.order();
    const auto modified = [&] {
        const DerivationLimits limits(scene.path, "deriving the modified energy");
        return modified_energy(system, report.member.method);
    }();
    if (!modified) {
        result.too_long = true;
        return result;
    }
    Formulas formulas;
    for (const Parameter& parameter : scene.parameters)
        formulas.set(parameter.symbol, float_of(scene.evaluate(parameter.value, "the parameter " + parameter.name)));
    const auto set = [&](const State& state) {
        for (std::size_t k = 0; k < modified->p.size(); ++k) {
            formulas.set(system.q[k], float_of(exact_number(state.q(static_cast<Eigen::Index>(k)))));
            formulas.set(modified->p[k], float_of(exact_number(state.p(static_cast<Eigen::Index>(k)))));
        }
    };
    set(states.front());
    const std::vector<Id> ids = formulas.convert({modified->energy, modified->term});
    const double power = std::pow(report.step, modified->order);
    Extent plain_energy, corrected;
    for (const State& state : states) {
        set(state);
        const std::vector<cln::cl_R> values = formulas.evaluate(ids);
        // Their differences matter, not their sizes: taken at 60 digits.
        if (&state == &states.front()) plain_energy.origin = corrected.origin = values[0];
        plain_energy.take(values[0]);
        corrected.take(values[0] + cln::rational(cln::cl_DF(power)) * values[1]);
        result.size = std::fmax(result.size, std::fabs(cln::double_approx(values[0])));
    }
    result.variation = plain_energy.high - plain_energy.low;
    result.modified_variation = corrected.high - corrected.low;
    return result;
}

constexpr double eigenvalue_floor = 1e-6;  // of double eigenvalues, the root of rounding
constexpr double left_of_start = 8;        // over the steps: what a measurement may be off by

long measured_steps(const StabilityReport& report, double expected) {
    const long n = report.kernel->coordinates, enough = std::max(1L << 9, (1L << 16) / (n * n)),
               most = std::max(enough, (1L << 24) / (n * n));
    const double wanted = expected > 0 ? 8 * left_of_start / expected : 0;
    return wanted < static_cast<double>(most) ? std::max(enough, std::lround(wanted) / 16 * 16) : most;
}

Scene with_tangent(Scene scene) {
    Outputs outputs;
    outputs.energy = outputs.momenta = false;
    outputs.tangent = scene.coordinates.size() <= most_for_eigenvalues;
    scene.outputs = outputs;
    return scene;
}

StabilityReport begin(Scene scene, const Overrides& overrides, TrajectoryRequest& request) {
    if (scene.coordinates.size() > most_reported_coordinates)
        throw InputError(fmt::format("{}: the frequencies of {} coordinates would take too long; at most {} are judged",
                                     scene.path, scene.coordinates.size(), most_reported_coordinates));
    scene = with_tangent(std::move(scene));
    Derivation derivation = derive(scene);
    Kernel kernel = kernel_of(emit(derivation), Precision::double_);
    apply(overrides, derivation.scene);  // after the derivation: one kernel serves all values
    const Steps steps = steps_of(derivation.scene, overrides);
    LoadedStepper<double> stepper(kernel);
    request = request_of(derivation.scene, steps.count, stepper);
    StabilityReport report{std::move(derivation), std::move(kernel), request.parameters, request.step, {}, {}, {}, {}};
    report.member = stability(report.derivation.quadrature);
    return report;
}

}  // namespace

std::optional<MeasuredRate> measured_rate_at(const StabilityReport& report, const VectorXd& q, double step,
                                             double expected) {
    LoadedStepper<double> stepper(report.kernel);
    if (stepper.prepare(report.parameters, step) != LOBATTO_OK) return std::nullopt;
    if (report.kernel->linear != 0) {
        const long steps = measured_steps(report, expected);
        const auto rate = measured_rate(stepper, step, steps);
        if (!rate) return std::nullopt;
        return MeasuredRate{*rate, left_of_start / static_cast<double>(steps)};
    }
    if (q.size() > static_cast<Eigen::Index>(most_for_eigenvalues)) return std::nullopt;
    const std::vector<double> position = plain(q),
                              momentum = stepper.momentum(0, position, std::vector<double>(position.size()));
    const auto values = step_eigenvalues(stepper, step, 0, position, momentum);
    if (!values) return std::nullopt;
    return MeasuredRate{std::log(std::abs(values->front())), eigenvalue_floor};
}

double largest_rate(const StabilityReport& report, const std::vector<Mode>& modes, double factor) {
    double largest = 0;
    for (const Mode& mode : modes) {
        const double angle = factor * std::sqrt(std::fabs(mode.z));
        largest = std::fmax(largest, rate_of_step(report.member, exact_number(std::copysign(angle * angle, mode.z))));
    }
    return largest;
}

StabilityReport stability_report(Scene scene, const Overrides& overrides) {
    TrajectoryRequest request;
    StabilityReport report = begin(std::move(scene), overrides, request);
    const System& system = report.derivation.system;
    Linearisation linearisation(report.derivation.scene, system);
    const VectorXd start = Eigen::Map<const VectorXd>(request.q.data(), system.n);
    if (system.linear) {
        const VectorXd rest = VectorXd::Zero(system.n);
        report.points.push_back(point_report(report, linearisation.at(0, start, rest), start, system.n));
        return report;
    }
    const std::int64_t steps = request.steps;
    request.steps = std::min(steps, most_steps / system.n);
    std::int64_t done = 0;
    std::vector<State> states = states_along(report, request, done);
    const std::optional<double> thrown_at = leave_out_what_is_thrown(report, linearisation, states);
    if (system.autonomous && system.n <= static_cast<int>(most_for_eigenvalues)) {
        std::vector<VectorXd> starts{start};
        for (std::size_t i = 0; i < most_starts; ++i) starts.push_back(states[i * states.size() / most_starts].q);
        starts.emplace_back(VectorXd::Zero(system.n));
        for (const Equilibrium& equilibrium : linearisation.equilibria(starts))
            report.points.push_back(
                point_report(report, equilibrium.system, equilibrium.q, linearisation.free_directions(equilibrium.q)));
    }
    report.trajectory = trajectory_report(report, linearisation, states);
    report.trajectory->thrown_at = thrown_at;
    report.trajectory->steps = steps;
    report.trajectory->most_steps = request.steps;
    report.trajectory->steps_done = done;
    report.energy = energy_report(report, states);
    return report;
}

}  // namespace lobatto
