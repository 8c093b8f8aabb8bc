// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/tradeoff/choice.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "runtime/error.hpp"

namespace lobatto {

namespace {

constexpr int attempts = 4;
constexpr double safety = 0.8;           // of the promise: what the search aims at
constexpr double reference_part = 0.01;  // of the promise: how well the reference should be known
constexpr double least_part = 0.1;       // and how well it must be

// The rungs of the ladder of numbers that are worth a step up: the others cost more and hold less.
constexpr Precision rungs[] = {Precision::double_, Precision::double_double, Precision::quadruple};

// Whether numbers hold an error at all.
bool holds(Precision numbers, double error) {
    return error >= 4 * rounding_of(numbers);
}
Precision first_rung(double error) {
    return *std::find_if(std::begin(rungs), std::end(rungs),
                         [error](Precision numbers) { return holds(numbers, error); });
}

// What was found in one kind of numbers, and its error on all steps.
struct Found {
    Search search;
    double error = 0;
    bool keeps(double wanted) const { return search.best && error <= wanted; }
};

// Between the samples of the reference the error may be larger: then a smaller one is aimed at.
Found find_in(Experiment& experiment, const ChoiceRequest& request, Precision numbers) {
    const double wanted = request.error - experiment.reference().disagreement.back();
    double goal = safety * request.error;
    Found found;
    for (int attempt = 0; attempt < attempts; ++attempt) {
        found.search = search(experiment, goal, numbers);
        if (!found.search.best) break;
        request.say("checking all steps");
        const Candidate& candidate = found.search.best->candidate;
        found.error =
            experiment.measurer().error_on_steps(experiment.kernel_builder().kernel(candidate.member), candidate);
        if (found.error <= wanted) break;
        goal *= 0.8 * request.error / found.error;
        if (experiment.left() < 0) {
            found.search.complete = false;
            break;
        }
    }
    return found;
}

bool is_at_rest(const Reference& reference) {
    const auto width = static_cast<std::ptrdiff_t>(2 * reference.n);  // of a row; each is the one before it
    return std::equal(reference.high.begin() + width, reference.high.end(), reference.high.begin());
}

}  // namespace

Choice choose(const Scene& written, const Scene& scene, const ChoiceRequest& request) {
    ExperimentRequest wish;
    wish.seconds = request.seconds;
    wish.wanted = reference_part * request.error;
    wish.first = first_guess(safety * request.error, 4, first_rung(request.error));
    wish.tries_clocks = request.tries_clocks;
    wish.interrupted = request.interrupted;
    wish.say = request.say;
    Experiment experiment(written, scene, wish);
    const Reference& reference = experiment.reference();
    const double uncertainty = reference.disagreement.back();
    if (!(uncertainty <= least_part * request.error)) {
        const double known = reference.trusted_until(least_part * request.error);
        throw ComputationError(fmt::format(
            "an error of {:.2g} cannot be promised to t = {:.6g}: there two references in {} differ by {:.1g}. {}",
            request.error, reference.until, precision_name(reference.precision), uncertainty,
            (reference.is_late
                 ? fmt::format("The {:.3g} s of the budget do not make them better: give more with --budget",
                               request.seconds)
                 : std::string("It is their rounding, which the motion makes so large: it is chaotic, or "
                               "comes near a singularity")) +
                (known > 0 ? fmt::format(". They agree to t = {:.4g}: try --until {:.4g}", known, known)
                           : std::string())));
    }
    if (is_at_rest(reference))
        throw ComputationError(fmt::format(
            "nothing moves to t = {:.6g}: every step is exact, and there is nothing to choose. Start elsewhere",
            reference.until));
    // Where rounding stands in the way, in numbers with more digits.
    Found best;
    double least = infinity;
    int members = 0;
    bool is_rounding = false;  // in double, whatever the steps
    for (const Precision numbers : rungs) {
        if (!holds(numbers, request.error) || (members > 0 && experiment.left() < 0)) continue;
        best = find_in(experiment, request, numbers);
        members += best.search.members;
        is_rounding = is_rounding || (numbers == Precision::double_ && best.search.is_rounding && !best.search.best);
        least = std::fmin(least, std::fmax(best.search.least_error, best.error));
        if (best.keeps(request.error)) break;
    }
    if (!best.keeps(request.error)) {
        if (!std::isfinite(least))
            throw ComputationError(fmt::format(
                "nothing could be measured within {:.3g} s; give more time with --budget", request.seconds));
        const bool is_late = experiment.left() <= 0 || !best.search.complete;
        throw ComputationError(fmt::format(
            "an error of {:.2g} to t = {:.6g} is not reached: {:.2g} is the least of the {} members of the family that "
            "were tried{}{}. {}sk for a larger error or an earlier end",
            request.error, reference.until, least, members,
            is_rounding ? "; it is rounding in double, which this motion makes so large" : "",
            is_late ? fmt::format(", and {:.3g} s were not enough for all", request.seconds) : "",
            is_late ? "Give more time with --budget, or a" : "A"));
    }
    const Candidate& candidate = best.search.best->candidate;
    Choice choice;
    choice.measurement =
        experiment.measurer().measure(experiment.kernel_builder().kernel(candidate.member), candidate, true);
    choice.measurement.seconds = std::fmin(choice.measurement.seconds, best.search.best->seconds);
    choice.measurement.error = std::fmax(choice.measurement.error, best.error);
    choice.until = reference.until;
    choice.reference = reference.first;
    choice.uncertainty = uncertainty;
    choice.frequency = reference.frequency;
    const StepClock clock = candidate.member.clock;
    choice.stability_limit = experiment.stability_limit_of(candidate.member);
    if (clock != StepClock::none) choice.clock = clock == StepClock::automatic ? "auto" : scene.clock->text;
    choice.members = members;
    choice.complete = best.search.complete;
    choice.seconds = experiment.elapsed();
    return choice;
}

}  // namespace lobatto
