// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/tradeoff/experiment.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "analysis/accuracy/companion/companion.hpp"
#include "analysis/accuracy/formulas/constraint_sizes.hpp"
#include "analysis/stability/limit.hpp"
#include "generator/scene/time_coordinate.hpp"
#include "runtime/build/compiler.hpp"
#include "runtime/build/sha256.hpp"
#include "runtime/error.hpp"
#include "runtime/run/output.hpp"

namespace lobatto {

namespace {

constexpr int few_coordinates = 10, some_coordinates = 20;
constexpr double extended_reach = 3e-13;     // what two references in long double can be asked to agree to
constexpr double reference_share = 0.4;      // of the seconds
constexpr double quadruple_compilation = 2;  // in units of that in long double
constexpr double longest_radians = 4;        // h omega of the coarsest steps tried; Lobatto's limits are near pi
constexpr double clocked_radians = 6;        // likewise with a clock, omega that at the start
constexpr double worth_a_clock = 2;          // between its largest and least rate
constexpr int rate_looks = 60;
constexpr double pilot_radians = 0.1;           // h omega of a pilot run
constexpr int pilots = 6;                       // that are tried, with steps a quarter as long each
constexpr std::int64_t longest_pilot = 200000;  // steps
const std::string measurements_version = "4";   // of what is measured: older stores are begun anew

// A run to the end of which nothing but error and time was asked.
bool knows_errors_only(const Measurement& m) {
    return m.complete && std::isnan(m.energy_error) && std::isnan(m.defect) && std::isnan(m.momentum_error);
}

// In quadruple precision where that is asked for and affordable. Order 22; of large systems the equations of a step are
// large too, and order 10 does.
Member reference_member(const Scene& scene, double wanted) {
    const std::size_t n = scene.coordinates.size();
    return {Family::lobatto, n <= some_coordinates ? 12 : 6,
            n <= few_coordinates && wanted < extended_reach ? Precision::quadruple : Precision::extended};
}

// Of pilot runs, whose end is that of all candidates with this clock.
Member pilot_member(StepClock clock) {
    return {Family::lobatto, 8, Precision::double_, StepArithmetic::plain, clock};
}

// What is measured and on what machine: another text, other measurements.
std::string subject_of(const Scene& scene, const KernelBuilder& kernel_builder, const Member& reference, double until) {
    std::string text =
        measurements_version + kernel_builder.digest(reference) + processor_identity() + exact_text(until);
    if (scene.clock) text += " " + scene.clock->text;
    text += scene.start == Start::momentum ? " momenta" : "";
    for (const auto* values : {&scene.initial_position, &scene.initial_rate})
        for (const GiNaC::ex& value : *values)
            text += " " + exact_text(scene.evaluate(value, "an initial value").to_double());
    for (const Parameter& parameter : scene.parameters)
        text += " " + exact_text(scene.evaluate(parameter.value, "the parameter " + parameter.name).to_double());
    return fmt::format("{} {} to t = {}", scene.name, sha256(text).substr(0, 16), exact_text(until));
}

}  // namespace

double end_of(const Scene& scene) {
    const double until = scene.evaluate(scene.run.until, "the end time").to_double();
    if (!(until > 0))
        throw InputError(
            fmt::format("{}: the end time is {:.6g}, so there is nothing to measure; give `until` in [run], or --until",
                        scene.path, until));
    return until;
}

Experiment::Experiment(const Scene& written, const Scene& scene, ExperimentRequest request)
    : scene_(without_time_coordinate(scene)),
      request_(std::move(request)),
      start_(scene_),
      kernels_(written, scene, request_.tries_clocks),
      conserves_(kernels_.derivation().conserves_energy()) {
    Member reference = reference_member(scene, request_.wanted);
    const double until = end_of(scene);
    kernels_.order(reference);
    for (const Member& member : request_.first)
        if (kernels_.allows(member) && member.clock == StepClock::none) kernels_.order(member);
    if (!request_.store.empty())
        store_ = MeasurementStore(request_.store, subject_of(scene_, kernels_, reference, until));
    ReferenceRequest wish;
    wish.until = until;
    wish.wanted = request_.wanted;
    wish.groups = amplitude_groups(scene_);
    if (!scene_.constraints.empty()) {
        const auto doubles = [](const std::vector<GiNaC::numeric>& values) {
            std::vector<double> rounded;
            for (const GiNaC::numeric& value : values) rounded.push_back(value.to_double());
            return rounded;
        };
        ConstraintSizes(kernels_.derivation().system)
            .widen(wish.places, 0, doubles(start_.q).data(), doubles(start_.parameters));
    }
    wish.is_cut = scene_.is_cut();
    wish.has_walls = !scene_.impacts.empty();
    wish.interrupted = request_.interrupted;
    const auto compute = [&](Precision precision) {
        reference.precision = precision;
        request_.say("compiling the reference in " + precision_name(precision));
        const Kernel exact = kernels_.kernel(reference);
        request_.say("computing the reference in " + precision_name(precision));
        wish.seconds_limit = reference_share * std::max(left(), request_.seconds / 4);
        reference_ = compute_reference(exact, start_, wish);
        measurer_.emplace(reference_, start_, exact, conserves_, request_.interrupted);
    };
    // Rounding may be what makes steps in long double short, or has grown: with more digits, if there is the time.
    const Precision first = reference.precision;
    try {
        compute(first);
    } catch (const TooSlow& late) {
        try {
            compute(first == Precision::extended ? Precision::quadruple : Precision::extended);
        } catch (const TooSlow&) {
            if (first == Precision::extended) throw late;  // what it reaches is the most
            throw;
        }
        reference_.is_late = reference_.is_late || first == Precision::quadruple;
    }
    if (first == Precision::extended && reference_.precision == first &&
        reference_.disagreement.back() > request_.wanted) {
        const bool has_time = left() >= quadruple_compilation * kernels_.compile_seconds(reference);
        reference_.is_late = reference_.is_late || !has_time;
        try {
            if (has_time) compute(Precision::quadruple);
        } catch (const TooSlow&) {
            reference_.is_late = true;
        }
    }
    for (const StepClock clock : kernels_.clocks())
        if (clock == StepClock::automatic && !varies(clock)) kernels_.forget(clock);
    for (const StepClock clock : kernels_.clocks()) kernels_.order(pilot_member(clock));
    for (const StepClock clock : kernels_.clocks()) find_span(clock);
}

double Experiment::rate_at(StepClock clock, const std::vector<GiNaC::ex>& positions, double time) const {
    const Scene& clocked = kernels_.derivation(clock).scene;
    GiNaC::exmap values;
    if (clocked.has_time_coordinate()) values[clocked.coordinates.back().position] = time;
    for (std::size_t k = 0; k < positions.size(); ++k) values[clocked.coordinates[k].position] = positions[k];
    return scene_.evaluate(clocked.clock->rate.subs(values), "the clock").to_double();
}

// Whether it tells times apart: in a pole that the motion keeps away from, as that of a quaternion's length, it does
// not.
bool Experiment::varies(StepClock clock) const {
    const std::size_t n = reference_.n;
    double least = infinity, most = 0;
    for (int look = 0; look <= rate_looks; ++look) {
        const auto row = static_cast<std::size_t>(reference_.samples * look / rate_looks) * 2 * n;
        std::vector<GiNaC::ex> positions;
        for (std::size_t k = 0; k < n; ++k) positions.emplace_back(reference_.high[row + k]);
        const double rate = rate_at(clock, positions, reference_.until * look / rate_looks);
        least = std::fmin(least, rate);
        most = std::fmax(most, rate);
    }
    return most > worth_a_clock * least;
}

// A clock in which the motion takes ever more steps is no choice.
void Experiment::find_span(StepClock clock) {
    request_.say("a first run with a clock");
    const Kernel kernel = kernels_.kernel(pilot_member(clock));
    const double rate = rate_at(clock, scene_.initial_position, 0);
    const double frequency = std::fmax(reference_.frequency_at_start, 1 / until());
    double h = pilot_radians / (frequency * rate);
    for (int pilot = 0; pilot < pilots; ++pilot, h /= 4) {
        check_interruption();
        const StartIn<double> in = start_in<double>(start_, kernel, h);
        LoadedStepper<double> stepper(kernel);
        lobatto_status status = stepper.prepare(in.parameters, h);
        if (status == LOBATTO_OK) status = stepper.start(0, in.q, in.p);
        lobatto_advance call{};
        std::int64_t steps = 0;
        while (status == LOBATTO_OK && call.steps_done == 0 && steps < longest_pilot) {
            call.steps = 1;
            call.interval = call.end = until();
            status = stepper.advance(call);
            steps += call.chain_steps;
        }
        if (status != LOBATTO_OK || call.steps_done == 0) continue;
        measurer_->know_span(clock, h * static_cast<double>(steps));
        radians_[clock] = h * static_cast<double>(steps) * frequency * rate;
        return;
    }
    kernels_.forget(clock);
}

double Experiment::figure(const Measurement& measurement) const {
    if (!is_chaotic()) return measurement.error;
    return std::isfinite(measurement.energy_error) ? measurement.energy_error : 1 / measurement.reaches;
}

double Experiment::fewest_steps(StepClock clock) const {
    return std::max(1.0, clock == StepClock::none ? until() * reference_.frequency / longest_radians
                                                  : radians_.at(clock) / clocked_radians);
}

bool Experiment::heeds_tolerance(const Member& member) const {
    const System& system = kernels_.derivation(member.clock).system;
    return lobatto::heeds_tolerance(member.method(), system.linear, system.separable);
}

double Experiment::stability_limit_of(const Member& member) const {
    const bool is_known = member.clock == StepClock::none && scene_.constraints.empty() && !scene_.is_cut();
    return is_known ? stability_limit(quadrature_of(member.method())) : std::nan("");
}

double Experiment::fewest_stable_steps(const Member& member) const {
    return std::fmax(1.0, until() * reference_.usual_frequency / stability_limit_of(member));
}

double Experiment::elapsed() const {
    return watch_.seconds();
}

void Experiment::check_interruption() const {
    if (request_.interrupted != nullptr && *request_.interrupted != 0) throw Interrupted();
}

Measurement Experiment::measure(const Candidate& candidate, bool all, double limit) {
    check_interruption();
    const Measurement* const known = store_.find(candidate);
    if (known != nullptr && !(all && knows_errors_only(*known))) return *known;
    if (!knows_symmetries_ && candidate.member.precision == Precision::double_ &&
        candidate.member.clock == StepClock::none) {
        knows_symmetries_ = true;
        const Kernel kernel = kernels_.kernel(candidate.member);
        const double step = reference_.until / static_cast<double>(candidate.steps);
        const StartIn<double> start = start_in<double>(start_, kernel, step);
        std::vector<std::string> names;
        for (const Coordinate& coordinate : scene_.coordinates) names.push_back(coordinate.name);
        measurer_->know_symmetries(find_symmetries(kernel, start.parameters, start.q, step, names));
    }
    Measurement measurement = measurer_->measure(kernels_.kernel(candidate.member), candidate, all, limit);
    measurement.compile_seconds = kernels_.compile_seconds(candidate.member);
    if (!measurement.complete && measurement.seconds >= limit) return measurement;
    return store_.add(measurement);
}

Measurement Experiment::time_again(const Measurement& measurement, int repetitions) {
    Measurement better = measurement;
    for (int i = 0; i < repetitions; ++i) {
        check_interruption();
        const Timing timing =
            measurer_->time_once(kernels_.kernel(measurement.candidate.member), measurement.candidate);
        if (timing.complete) better.seconds = std::min(better.seconds, timing.seconds);
    }
    return store_.add(better);
}

}  // namespace lobatto
