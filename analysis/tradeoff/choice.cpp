// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/tradeoff/choice.hpp"

#include <fmt/format.h>

#include <cmath>

#include "analysis/stability/limit.hpp"
#include "runtime/error.hpp"

namespace lobatto {

namespace {

constexpr int attempts = 4;
constexpr double safety = 0.8;           // of the promise: what the search aims at
constexpr double reference_part = 0.01;  // of the promise: how well the reference should be known
constexpr double least_part = 0.1;       // and how well it must be

}  // namespace

Choice choose(Derivation derivation, const Scene& scene, const ChoiceRequest& request) {
    double goal = safety * request.error;
    ExperimentRequest wish;
    wish.seconds = request.seconds;
    wish.wanted = reference_part * request.error;
    wish.first = first_guess(goal, 4);
    wish.interrupted = request.interrupted;
    wish.say = request.say;
    Experiment experiment(std::move(derivation), scene, wish);
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
    // Between the samples of the reference the error may be larger: then a smaller one is aimed at.
    Search found;
    double error = 0;
    for (int attempt = 0; attempt < attempts; ++attempt) {
        found = search(experiment, goal);
        if (!found.best) break;
        request.say("checking all steps");
        error = experiment.measurer().error_on_steps(experiment.kernel_builder().kernel(found.best->candidate.member),
                                                     found.best->candidate);
        if (error <= request.error * (1 - uncertainty / request.error)) break;
        goal *= 0.8 * request.error / error;
        if (experiment.left() < 0) {
            found.complete = false;
            break;
        }
    }
    if (!found.best || !(error <= request.error)) {
        const double least = std::fmax(found.least_error, found.best ? error : 0);
        if (!std::isfinite(least))
            throw ComputationError(fmt::format(
                "nothing could be measured within {:.3g} s; give more time with --budget", request.seconds));
        throw ComputationError(fmt::format(
            "an error of {:.2g} to t = {:.6g} is not reached: {:.2g} is the least of the {} members of the family that "
            "were "
            "tried in double precision{}. Ask for a larger error or an earlier end; `lobatto tradeoff` measures long "
            "double "
            "and quadruple too, which `numbers` under [method] chooses",
            request.error, reference.until, least, found.members,
            found.complete ? "" : fmt::format(", and {:.3g} s were not enough for all (--budget)", request.seconds)));
    }
    Choice choice;
    choice.measurement = experiment.measurer().measure(experiment.kernel_builder().kernel(found.best->candidate.member),
                                                       found.best->candidate, true);
    choice.measurement.seconds = std::fmin(choice.measurement.seconds, found.best->seconds);
    choice.measurement.error = std::fmax(choice.measurement.error, error);
    choice.until = reference.until;
    choice.reference = reference.first;
    choice.uncertainty = uncertainty;
    choice.frequency = reference.frequency;
    choice.stability_limit = stability_limit(quadrature_of(found.best->candidate.member.method()));
    choice.members = found.members;
    choice.complete = found.complete;
    choice.seconds = experiment.elapsed();
    return choice;
}

}  // namespace lobatto
