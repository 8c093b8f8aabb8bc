// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/accuracy/judged_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "analysis/accuracy/formulas/jumps.hpp"
#include "analysis/accuracy/formulas/stopped_at_formula.hpp"
#include "analysis/kernel/derived_kernel.hpp"
#include "analysis/stability/linear_departure.hpp"
#include "generator/mechanics/clock/automatic_clock.hpp"
#include "generator/mechanics/start.hpp"
#include "runtime/stopwatch.hpp"

namespace lobatto {

namespace {

// Energy errors, relative, that are larger than the errors of positions by so much tell that those have grown since.
constexpr double told_by_energy = 100;
constexpr double notable_jump = 1e-12;  // of the Lagrangian

// Of a motion that may come near a pole.
std::string clock_advice(const Scene& scene) {
    const bool helps = !scene.clock && has_automatic_clock(scene);
    return helps ? ", or clock = \"auto\" under [method], whose steps follow close encounters" : "";
}

// Of steps that became infinite, with a method whose equal steps have a limit of stability.
std::string gauss_advice(const Scene& scene, lobatto_status status) {
    const bool has_limit = scene.method.family != Family::gauss && !scene.clock;
    return status == LOBATTO_NOT_FINITE && has_limit
               ? ", Gauss's method (--stages 2), which stiffness alone does not make unstable"
               : "";
}

// That the error became as large as the motion. Empty: it did not.
std::string loss_of(const Scene& scene, const TrajectoryRequest& request, const std::optional<MeasuredError>& error) {
    if (!error || !error->is_lost()) return "";
    if (error->rests)
        return fmt::format(
            "the run rests where it begins, q = {}, p = {}, but a start that differs by rounding moves away. Either "
            "the equilibrium is unstable (see `lobatto stability`), or the step is too long for it, or each step "
            "changes less than a last digit. So the motion from this start is not known. Start elsewhere, compute in "
            "finer numbers (--numbers double-double), or try a smaller step, such as h = {:.6g}. With --beyond-horizon "
            "the run at rest is accepted.",
            list_text(request.q), list_text(request.p), request.step / 2);
    const std::string clock = clock_advice(scene);
    const char* const why = error->companion_stopped
                                ? "the same run with 2/3 of the step cannot go on there, so the rest is not known"
                                : "there the error becomes as large as the motion itself";
    const std::string chaos =
        error->doubling ? fmt::format(", an earlier end (errors double every {:.3g})", *error->doubling) : "";
    return fmt::format(
        "the run is no longer accurate after t = {:.6g}, q = {}, p = {}: {}. Try a smaller step, such as "
        "h = {:.6g}, more points{}{}, or --beyond-horizon if you need only statistics of the motion.",
        *error->lost_after, list_text(error->lost_q), list_text(error->lost_p), why, request.step / 2, clock, chaos);
}

constexpr double missed = 2;  // times the error wanted

std::vector<std::string> warnings_of(const MeasuredError& error, double wanted, bool ended_by_caller) {
    if (error.is_lost()) return {};
    std::vector<std::string> texts;
    if (error.worst() > large_error)
        texts.push_back(!error.complete && error.at_end > 1
                            ? "the error is as large as the motion at the end, if it keeps growing; take a smaller "
                              "step, or more points"
                            : fmt::format("the error is {:.2g} of the amplitude; take a smaller step, or more points",
                                          error.worst()));
    else if (wanted > 0 && error.at_end > missed * wanted)
        texts.push_back(
            fmt::format("the scene asks for an error of {:.2g}, and it is {:.2g}; `lobatto tune` chooses a step",
                        wanted, error.at_end));
    if (!error.is_known_at_end())
        texts.push_back(fmt::format(
            "the error was measured only to t = {:.4g}, because the companion {}; the error of the rest is not known{}",
            error.until, ended_by_caller ? "was not waited for" : "took longer than the run",
            ended_by_caller ? "" : ". Choose an earlier end, or a larger step"));
    return texts;
}

// That a run which went to its end left the domain of its Lagrangian, or has a wrong energy. Empty: it has not.
std::string departure_of(const PreparedRun& run, const TrajectoryRequest& request, const TrajectoryResult& result,
                         const RunObservers& observers, bool jumps) {
    if (result.status != LOBATTO_OK || result.interrupted) return "";
    if (const std::vector<double>& row = observers.left_domain; !row.empty()) {
        const auto middle = row.begin() + 1 + std::ssize(result.q);
        return fmt::format(
            "the run left the domain of the Lagrangian by t = {:.6g}, q = {}, p = {}: {}, and has no value there. Try "
            "an earlier end, or start elsewhere, or write the formula without it.",
            row[0], list_text({row.begin() + 1, middle}), list_text({middle, row.end()}),
            observers.domains.text(observers.parameters, row.data()));
    }
    const std::string departure = observers.energy.departure(run.outline, run.plain, request, jumps);
    if (run.scene.clock || run.scene.is_cut()) return departure;
    return departure.empty() ? linear_departure(run.outline, run.scene, run.plain, request, result) : departure;
}

// Of a run whose steps failed, that is no longer accurate, or whose energy is no number. Empty: of none.
std::string failure_of(const PreparedRun& run, const TrajectoryRequest& request, const TrajectoryResult& result,
                       const RunObservers& observers, const std::string& departure) {
    const Scene& scene = run.scene;
    if (const std::string why = stopped_at_formula(scene, observers.domains, run.plain, request, result); !why.empty())
        return why;
    if (result.status != LOBATTO_OK)
        return explain_stop(result, request, passing_step(run.plain, request, result),
                            gauss_advice(scene, result.status) + clock_advice(scene));
    if (!departure.empty()) return departure;
    if (!scene.outputs.energy || std::isfinite(result.energy_error_largest)) return "";
    if (std::isfinite(result.energy_start))
        return fmt::format(
            "the energy became infinite or not a number: the motion grows without bound, or has gone where the "
            "Lagrangian is not real. Try a smaller step, such as h = {:.6g}, an earlier end, or start elsewhere.",
            request.step / 2);
    return "the energy of the start is too large for a number, though the motion is not. Try other units, or energy = "
           "false under [output].";
}

}  // namespace

PreparedRun prepare_run(Scene scene, const Overrides& overrides, Shortcuts shortcuts, std::optional<Method> companion) {
    const Stopwatch watch;
    if (scene.clock && scene.method.numbers != Precision::double_)
        fail_at_clock(scene, "with a clock `lobatto run` computes in double, but numbers are \"" +
                                 precision_name(scene.method.numbers) +
                                 "\"; remove the clock, or give --numbers double");
    const Precision numbers = scene.method.numbers;
    const DerivedKernel derived =
        derived_kernel(scene, {numbers, shortcuts, EnergyWatch::can_watch}, nullptr, with_values(scene, overrides));
    const auto source_in = [&](Precision others, const Method& method) {
        Scene beside = scene;
        beside.method = method;
        const bool is_known = method.arithmetic == scene.method.arithmetic;
        const KernelWish wish{others, shortcuts, EnergyWatch::can_watch};
        return derived_kernel(beside, wish, is_known ? derived.derivation.get() : nullptr,
                              with_values(beside, overrides))
            .source;
    };
    KernelSource in_double, in_finer;
    if (numbers != Precision::double_) in_double = source_in(Precision::double_, scene.method);
    if (companion) in_finer = source_in(companion->numbers, *companion);
    const double derivation_seconds = watch.seconds();
    apply(overrides, scene);  // after the derivation: one kernel serves all values
    if (!overrides.set.empty()) check_values(scene);
    const Steps steps = steps_of_run(scene, overrides);
    Compiled compiled;
    const Kernel kernel = kernel_of(derived.source, numbers, &compiled);
    const Kernel plain = numbers == Precision::double_ ? kernel : kernel_of(in_double, Precision::double_);
    std::optional<Kernel> finer;
    if (companion) finer = kernel_of(in_finer, companion->numbers);
    return {scene, derived.outline, derived.from_cache, derived.source, compiled, kernel, plain,
            finer, steps,           derivation_seconds};
}

namespace {

bool has_sine_of(const GiNaC::ex& formula, const GiNaC::symbol& x) {
    if (GiNaC::is_a<GiNaC::function>(formula) && formula.has(x)) {
        const std::string name = GiNaC::ex_to<GiNaC::function>(formula).get_name();
        if ((name == "sin" || name == "cos" || name == "tan") &&
            formula.op(0).diff(x).info(GiNaC::info_flags::integer))  // else a factor such as pi/180 converts it
            return true;
    }
    return std::any_of(formula.begin(), formula.end(), [&](const GiNaC::ex& part) { return has_sine_of(part, x); });
}

// A unit is a word, and converts nothing.
std::vector<std::string> degrees_in_sines(const Scene& scene) {
    std::vector<std::string> texts;
    const auto look_at = [&](const std::string& name, const std::string& unit, const GiNaC::symbol& symbol,
                             const char* value) {
        const bool is_degrees =
            unit == "deg" || unit == "Deg" || unit == "degree" || unit == "degrees" || unit == "\u00b0";
        if (is_degrees && has_sine_of(scene.lagrangian, symbol))
            texts.push_back(
                fmt::format("{0} has the unit {1}, but its sine and cosine take it for radians: units convert "
                            "nothing. Write the {2} as 30*pi/180 for 30 degrees, and unit = \"rad\"",
                            name, unit, value));
    };
    for (const Coordinate& one : scene.coordinates) look_at(one.written, one.unit, one.position, "start");
    for (const Parameter& one : scene.parameters) look_at(one.written, one.unit, one.symbol, "value");
    return texts;
}

// A state right at a jump of L is one on the side from which the motion comes.
std::vector<std::string> starts_at_jumps(const Scene& scene) {
    std::vector<std::string> texts;
    GiNaC::exmap start{{scene.time, 0}};
    for (std::size_t k = 0; k < scene.coordinates.size(); ++k) {
        start[scene.coordinates[k].position] = scene.initial_position[k];
        start[scene.coordinates[k].velocity] = scene.start == Start::velocity ? scene.initial_rate[k] : GiNaC::ex(0);
    }
    const auto at_start = [&](const GiNaC::ex& formula, const std::string& what) {
        return std::fabs(scene.evaluate(scene.along_motion(formula).subs(start).evalf(), what).to_double());
    };
    for (const Switch& one : scene.switches) {
        if (!one.refracts || at_start(one.value, one.text) > 0) continue;
        const GiNaC::ex above = scene.lagrangian.subs(one.side == 1), below = scene.lagrangian.subs(one.side == -1);
        if (at_start(above - below, one.text) > notable_jump * at_start(above, one.text))
            texts.push_back(fmt::format(
                "the start lies right where the Lagrangian jumps, at {} (line {} column {}), and counts as a state on "
                "the side from which the motion comes; start a little beside it if you mean the other side",
                one.text, one.at.line, one.at.column));
    }
    return texts;
}

// What a companion in the run's own numbers says, or a finer one, which sees all rounding; 0: nothing.
double known_error(const PreparedRun& run, const std::optional<MeasuredError>& error) {
    if (run.finer || run.scene.method.numbers != Precision::double_ || !run.scene.constraints.empty())
        return std::numeric_limits<double>::infinity();
    return error && error->is_known_at_end() ? error->worst() : 0;
}

}  // namespace

std::string ends_early(const PreparedRun& run, const TrajectoryResult& result) {
    if (run.steps.reaches_end || result.status != LOBATTO_OK || result.stop >= 0 || result.interrupted) return "";
    return "The end time is not a multiple of the step: the run ends at the last multiple before it.";
}

RunVerdict verdict_of(const PreparedRun& run, const TrajectoryRequest& request, const TrajectoryResult& result,
                      RunObservers& observers, bool accepts_lost) {
    const Scene& scene = run.scene;
    RunVerdict verdict;
    verdict.error = observers.error;
    if (verdict.error && !verdict.error->complete && run.outline.conserves_energy() && result.energy_start != 0 &&
        result.energy_error_largest > told_by_energy * verdict.error->at_end * std::fabs(result.energy_start))
        verdict.error->at_end = std::nan("");
    if (observers.began_unmeasured)
        verdict.warnings.emplace_back(
            "the error is not measured, because an earlier part of the run had no companion, "
            "or one in other numbers");
    else if (observers.companion && !verdict.error && result.status == LOBATTO_OK && !result.interrupted &&
             result.steps_done > 0 && result.stop < 0 && !observers.ended_by_caller)
        verdict.warnings.emplace_back(
            "the error is not measured, because the companion took too long to the first comparison; keep states on "
            "the way (--every)");
    const std::vector<std::string> jumps = jumps_of(scene, request.parameters);
    std::string departure = departure_of(run, request, result, observers, !jumps.empty());
    if (departure.empty() && !accepts_lost && !scene.run.beyond_horizon)
        departure = loss_of(scene, request, verdict.error);
    if (verdict.error && departure.empty())
        for (const std::string& warning : warnings_of(*verdict.error, scene.run.error, observers.ended_by_caller))
            verdict.warnings.push_back(warning);
    if (result.status == LOBATTO_OK && result.steps_done > 1 && !scene.clock && !scene.is_cut())
        for (const std::string& warning : StepJudge::warnings(
                 observers.judge.judge(run.outline, run.plain, request, result), known_error(run, verdict.error)))
            verdict.warnings.push_back(warning);
    if (const std::string text = observers.walls.text(); !text.empty()) verdict.warnings.push_back(text);
    for (const std::string& jump : jumps) verdict.warnings.push_back(jump);
    for (const std::string& text : starts_at_jumps(scene)) verdict.warnings.push_back(text);
    for (const std::string& text : degrees_in_sines(scene)) verdict.warnings.push_back(text);
    if (const std::string text = ConstantMasses(run.outline).complaint(request.parameters); !text.empty())
        verdict.warnings.push_back(text + ". That is allowed, but mostly a mistaken sign in the Lagrangian");
    verdict.failure = failure_of(run, request, result, observers, departure);
    return verdict;
}

}  // namespace lobatto
