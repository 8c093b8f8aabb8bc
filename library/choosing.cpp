// SPDX-License-Identifier: GPL-2.0-or-later
// What accuracy costs, the cheapest method and step that keep a promise, and what is proved of a scene.
#include <fmt/format.h>

#include "analysis/accuracy/until_stop.hpp"
#include "analysis/tradeoff/exploration.hpp"
#include "generator/mechanics/constraints/impacts.hpp"
#include "library/whole.hpp"
#include "runtime/error.hpp"

namespace lobatto::api {

namespace {

constexpr double least_budget = 1, most_budget = 86400;  // seconds

Settings settings_of(const FoundChoice& found, const Settings& given) {
    Settings settings = given;
    const lobatto::Choice& choice = found.choice;
    const Candidate& candidate = choice.measurement.candidate;
    const int points = candidate.member.points;
    switch (candidate.member.family) {
        case Family::lobatto:
            settings.points = points;
            break;
        case Family::gauss:
            settings.stages = points;
            break;
        case Family::splitting:
            settings.splitting = points;
            break;
    }
    if (candidate.tolerance > 0) settings.tolerance = candidate.tolerance;
    settings.arithmetic = candidate.member.arithmetic == StepArithmetic::clean ? "clean" : "plain";
    settings.numbers = precision_name(candidate.member.precision);
    if (choice.clock != (found.scene.clock ? found.scene.clock->text : "")) {
        settings.clock = word_of(candidate.member.clock);
        settings.every.reset();  // it would have another meaning: all steps are kept
    }
    settings.step = fmt::format("{}", choice.step());
    settings.until = fmt::format("{}", choice.until);
    return settings;
}

// The method and its step are what is looked for.
void refuse_method(const Settings& settings) {
    const bool names_method = settings.points || settings.stages || settings.splitting || settings.tolerance ||
                              !settings.arithmetic.empty() || !settings.numbers.empty() || !settings.clock.empty() ||
                              !settings.step.empty();
    if (names_method)
        throw lobatto::InputError(
            "tune chooses the method, its numbers, the clock and the step; leave them out of the settings");
}

}  // namespace

void check_budget(double seconds, const std::string& written) {
    if (!(seconds >= least_budget && seconds <= most_budget))
        throw lobatto::InputError(fmt::format(
            "--budget: {} is {}; give 1s to 24h, as in --budget 30s", written,
            seconds > most_budget ? "too much" : "too little for one measurement, which needs a compiled kernel"));
}

ChangedScene measurable(const Scene& scene, const Settings& settings, const std::string& command) {
    ChangedScene scenes{scene.parts().scene, scene.parts().scene};
    refuse_jumps(scenes.written, command);
    apply(overrides_of(settings), scenes.changed);
    scenes.changed = ending_at_stop(std::move(scenes.changed));
    return scenes;
}

Explored explored(const ChangedScene& scene, const ExperimentRequest& request) {
    Explored found;
    try {
        found.experiment = std::make_unique<Experiment>(scene.written, scene.changed, request);
        found.unmeasured = explore(*found.experiment);
    } catch (const Interrupted&) {
        found.interrupted = true;
    } catch (const lobatto::ComputationError& failure) {
        throw lobatto::ComputationError(fmt::format("{}: {}", scene.changed.path, failure.what()));
    }
    return found;
}

FoundChoice choice_for(const Scene& scene, const Settings& settings, const ChoiceRequest& request) {
    if (!(request.error >= Run::least_error && request.error <= Run::largest_error))
        throw lobatto::InputError(
            fmt::format("an error of {:.3g} cannot be promised; it is relative to the amplitude of the motion, at most "
                        "{} and at least {:.0e}",
                        request.error, Run::largest_error, Run::least_error));
    check_budget(request.seconds, fmt::format("{}s", request.seconds));
    refuse_method(settings);
    ChangedScene scenes = measurable(scene, settings, "lobatto tune");
    try {
        lobatto::Choice choice = choose(scenes.written, scenes.changed, request);
        return {std::move(scenes.changed), std::move(choice)};
    } catch (const lobatto::ComputationError& failure) {
        throw lobatto::ComputationError(fmt::format("{}: {}", scene.path(), failure.what()));
    }
}

Choice tune(const Scene& scene, double error, const Settings& settings, double budget,
            const std::function<bool(const std::string&)>& progress) {
    return in_algebra([&] {
        ChoiceRequest request;
        request.error = error;
        request.seconds = budget;
        volatile int is_interrupted = 0;
        request.interrupted = &is_interrupted;
        if (progress)
            request.say = [&](const std::string& what) {
                if (!ask(progress, what)) is_interrupted = 1;
            };
        try {
            const FoundChoice chosen = choice_for(scene, settings, request);
            const lobatto::Choice& found = chosen.choice;
            Choice choice;
            choice.settings = settings_of(chosen, settings);
            choice.method = found.measurement.candidate.member.method().name();
            choice.step = found.step();
            choice.until = found.until;
            choice.predicted_error = found.measurement.error;
            choice.seconds = found.measurement.seconds;
            choice.complete = found.complete;
            return choice;
        } catch (const Interrupted&) {
            throw ComputationError(scene.path() + ": the search was ended; nothing was chosen");
        }
    });
}

std::vector<Claim> verify(const Scene& scene, const Settings& settings,
                          const std::function<bool(const std::string&)>& progress) {
    return in_algebra([&] {
        std::vector<Claim> claims;
        const auto say = [&](const std::string& what, double) {
            if (progress && !ask(progress, what)) throw ComputationError(scene.path() + ": verify was ended");
        };
        for (const ProofRow& row : proof_of(scene, settings, say).rows)
            claims.push_back({row.claim, row.measured, row.bound, row.holds, row.meaning});
        return claims;
    });
}

}  // namespace lobatto::api
