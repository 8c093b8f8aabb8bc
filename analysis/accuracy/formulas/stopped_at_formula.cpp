// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/accuracy/formulas/stopped_at_formula.hpp"

#include <fmt/format.h>

#include <cmath>
#include <optional>
#include <string_view>
#include <vector>

#include "analysis/tape.hpp"
#include "generator/formula/switch.hpp"
#include "generator/mechanics/clock/clock.hpp"

namespace lobatto {

namespace {

// Velocities where a run stopped; nothing where there are none.
std::optional<std::vector<double>> velocity_at_stop(const Kernel& kernel, const TrajectoryRequest& request,
                                                    const TrajectoryResult& result) {
    LoadedStepper<double> stepper(kernel);
    std::vector<double> velocity;
    if (stepper.prepare(request.parameters, request.step) != LOBATTO_OK ||
        stepper.velocity(result.time, result.q, result.p, velocity) != LOBATTO_OK)
        return std::nullopt;
    return velocity;
}

// The clock's rate where a run stopped, 1 without a clock; nothing where it has no value.
std::optional<double> rate_at_stop(const Scene& scene, const TrajectoryRequest& request,
                                   const TrajectoryResult& result) {
    if (!scene.clock) return 1;
    std::vector<GiNaC::symbol> symbols;
    for (const Parameter& parameter : scene.parameters) symbols.push_back(parameter.symbol);
    for (const Coordinate& coordinate : scene.coordinates) symbols.push_back(coordinate.position);
    const std::optional<Tape> rate = Tape::of(in_clock_time(scene).clock->rate, symbols);
    if (!rate) return std::nullopt;
    std::vector<double> variables = request.parameters;
    variables.insert(variables.end(), result.q.begin(), result.q.end());
    return (*rate)(variables);
}

// The number of the step that failed.
std::int64_t failed_step(const Scene& scene, const TrajectoryResult& result) {
    return (scene.clock ? result.chain_steps : result.steps_done) + 1;
}

// t and q after so long with these velocities.
std::vector<double> straight_on(const TrajectoryResult& result, const std::vector<double>& velocity, double time) {
    std::vector<double> ahead{result.time + time};
    for (std::size_t k = 0; k < velocity.size(); ++k) ahead.push_back(result.q[k] + time * velocity[k]);
    return ahead;
}

// Of a step that failed where it would go through a switch that stands in a root, a logarithm or a broken power. Empty:
// it would not, or the power and two of its derivatives are finite there (generator/formula/switch.hpp).
std::string root_at_switch(const Scene& scene, const std::vector<double>& velocity, const TrajectoryRequest& request,
                           const TrajectoryResult& result) {
    std::vector<GiNaC::symbol> symbols{scene.time};
    for (const Coordinate& coordinate : scene.coordinates) symbols.push_back(coordinate.position);
    for (const Coordinate& coordinate : scene.coordinates) symbols.push_back(coordinate.velocity);
    for (const Parameter& parameter : scene.parameters) symbols.push_back(parameter.symbol);
    const auto variables_after = [&](double time) {
        std::vector<double> variables = straight_on(result, velocity, time);
        variables.insert(variables.end(), velocity.begin(), velocity.end());
        variables.insert(variables.end(), request.parameters.begin(), request.parameters.end());
        return variables;
    };
    const auto is_met = [&](const Switch& one) {
        const std::optional<Tape> value = Tape::of(scene.along_motion(one.value), symbols);
        if (!value) return false;
        const double here = (*value)(variables_after(0)), ahead = (*value)(variables_after(2 * request.step));
        return here * ahead <= 0 || std::fabs(here) < 1e-9 * std::fabs(ahead);
    };
    const auto exponent_of = [&](const DomainCondition& condition) {
        const std::optional<Tape> formula = Tape::of(condition.exponent, symbols);
        return formula ? (*formula)(variables_after(0)) : 0;
    };
    const auto is_broken_power = [](const DomainCondition& condition) {
        return condition.kind == DomainCondition::Kind::power || condition.operation == "a broken power";
    };
    const auto what_is_missing = [&](const DomainCondition& condition) -> std::string_view {
        using Kind = DomainCondition::Kind;
        if (condition.expression.has(positive_part(GiNaC::wild())))
            return is_broken_power(condition) && exponent_of(condition) < 2
                       ? "and its second derivative is not finite there. Write an exponent of "
                         "at least 2 (in a force 1), or"
                       : "";
        const double exponent = condition.kind == Kind::power ? exponent_of(condition) : 0.5;
        const bool is_root =
            condition.kind == Kind::nonnegative || condition.kind == Kind::positive || condition.kind == Kind::power;
        return is_root && exponent != std::round(exponent)
                   ? "and has no value beyond it, where a step looks before it is cut. Write"
                   : "";
    };
    for (const DomainCondition& condition : scene.conditions)
        for (const Switch& one : scene.switches) {
            // Of powers in forces no second derivative is asked for.
            if (!condition.expression.has(one.side) || !is_met(one)) continue;
            if (is_broken_power(condition) && !scene.lagrangian.has(one.side)) continue;
            const std::string_view missing = what_is_missing(condition);
            if (missing.empty()) continue;
            return fmt::format(
                "the run stopped in step {}, after t = {:.6g}, from q = {}, p = {}: {}, line {} column {}, holds a "
                "switch, {} a smooth formula that is positive everywhere, such as (sqrt(u^2 + 1e-12) + u)/2 for "
                "max(u, 0).",
                failed_step(scene, result), result.time, list_text(result.q), list_text(result.p), condition.operation,
                condition.at.line, condition.at.column, missing);
        }
    return "";
}

// Of a step that failed because it would go to where a formula has no value. Empty: it would not. `lasts`: the step.
std::string leaves_domain(const Scene& scene, const Domains& domains, const std::vector<double>& velocity, double lasts,
                          const TrajectoryRequest& request, const TrajectoryResult& result) {
    const auto none = domains.no_value_at(request.parameters, straight_on(result, velocity, lasts));
    if (!none) return "";
    const std::string_view advice =
        !none->is_table ? "an earlier end, or a formula that has a value there too, such as abs(x)^(5/2) for x^(5/2)"
        : scene.clock   ? "an earlier end, because steps with a clock go beyond the end of a run, or equal steps "
                          "(--clock none), or measure further"
                        : "an earlier end, or measure further";
    return fmt::format(
        "the run stopped in step {}, after t = {:.6g}, from q = {}, p = {}: at the end of the step {}, and has no "
        "value there. Try {}.",
        failed_step(scene, result), result.time, list_text(result.q), list_text(result.p), none->text, advice);
}

// Of a motion that escapes with a clock whose rate grows with the distance: the clock comes to infinity in a finite
// time of its own, and steps grow beyond all bounds. Empty: it does not.
// `lasts`: a step there.
std::string escape_of(const Scene& scene, const std::vector<double>& velocity, double lasts,
                      const TrajectoryRequest& request, const TrajectoryResult& result) {
    double speed = 0, distance = 0, at_start = 0, outwards = 0;
    const std::size_t moving = velocity.size() - (scene.has_time_coordinate() ? 1 : 0);
    for (std::size_t k = 0; k < moving; ++k) {
        speed = std::hypot(speed, velocity[k]);
        distance = std::hypot(distance, result.q[k]);
        at_start = std::hypot(at_start, request.q[k]);
        outwards += result.q[k] * velocity[k];
    }
    if (!(lasts * speed > distance && distance > 3 * at_start && outwards > 0)) return "";
    return fmt::format(
        "the run stopped after t = {:.6g}, from q = {}, p = {}: a step of the clock {} lasts {:.3g} there, in which "
        "the motion would go {:.2g} times as far as it is from 0. It escapes, and the steps grow beyond all bounds. "
        "Try an earlier end, a smaller step, equal steps (--clock none), or a clock that grows less, such as "
        "r^(3/2)/(1 + sqrt(r)).",
        result.time, list_text(result.q), list_text(result.p), scene.clock->text, lasts, lasts * speed / distance);
}

// Of a start that was refused. Empty: it is behind no wall.
std::string behind_wall(const Scene& scene, const TrajectoryRequest& request, const TrajectoryResult& result) {
    std::vector<GiNaC::symbol> symbols;
    for (const Parameter& parameter : scene.parameters) symbols.push_back(parameter.symbol);
    symbols.push_back(scene.time);
    for (const Coordinate& coordinate : scene.coordinates) symbols.push_back(coordinate.position);
    std::vector<double> values = request.parameters;
    values.push_back(result.time);
    values.insert(values.end(), result.q.begin(), result.q.begin() + std::ssize(scene.coordinates));
    for (const Impact& impact : scene.impacts) {
        const std::optional<Tape> tape = Tape::of(scene.along_motion(impact.when.value), symbols);
        const double value = tape ? (*tape)(values) : 0;
        if (value * impact.when.direction <= 0) continue;  // falling: above zero
        return fmt::format(
            "the run cannot begin at t = {:.6g}, from q = {}, p = {}: the start is behind the wall {} ({}), whose left "
            "side minus its right side is {:.3g} there. Start on its other side.",
            result.time, list_text(result.q), list_text(result.p), impact.written, impact.when.text, value);
    }
    return "";
}

}  // namespace

std::string stopped_at_formula(const Scene& scene, const Domains& domains, const Kernel& kernel,
                               const TrajectoryRequest& request, const TrajectoryResult& result) {
    if (result.status == LOBATTO_OFF_CONSTRAINTS && !result.started) return behind_wall(scene, request, result);
    const bool has_failed = result.status == LOBATTO_NOT_FINITE || result.status == LOBATTO_NOT_CONVERGED ||
                            (scene.clock && result.status == LOBATTO_TIME_STANDS_STILL);
    if (!has_failed || !result.started) return "";
    const std::optional<std::vector<double>> velocity = velocity_at_stop(kernel, request, result);
    if (!velocity) return "";
    const std::optional<double> rate = rate_at_stop(scene, request, result);
    std::string why = scene.switches.empty() ? "" : root_at_switch(scene, *velocity, request, result);
    if (why.empty() && rate) why = leaves_domain(scene, domains, *velocity, request.step * *rate, request, result);
    if (why.empty() && scene.clock && rate)
        why = escape_of(scene, *velocity, std::fabs(request.step * *rate), request, result);
    return why;
}

}  // namespace lobatto
