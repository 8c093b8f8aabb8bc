// SPDX-License-Identifier: GPL-2.0-or-later
// The cheapest method and step that keep a promise, for run() and compile(); and what is proved of a scene.
#include <fmt/format.h>

#include "analysis/proof/proof.hpp"
#include "analysis/tradeoff/choice.hpp"
#include "generator/mechanics/constraints/impacts.hpp"
#include "generator/pipeline.hpp"
#include "library/parts.hpp"

namespace lobatto::api {

namespace {

Settings settings_of(const lobatto::Choice& choice, const Settings& given) {
    Settings settings = given;
    const Candidate& candidate = choice.measurement.candidate;
    const int points = candidate.member.points;
    settings.points.reset();
    settings.stages.reset();
    settings.splitting.reset();
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
    settings.step = fmt::format("{}", choice.step());
    settings.until = fmt::format("{}", choice.until);
    return settings;
}

lobatto::Choice chosen(const lobatto::Scene& written, const lobatto::Scene& scene, const ChoiceRequest& request) {
    try {
        return choose(written, scene, request);
    } catch (const Interrupted&) {
        throw ComputationError(scene.path + ": the search was ended; nothing was chosen");
    }
}

}  // namespace

Choice tune(const Scene& scene, double error, const Settings& settings, double budget,
            const std::function<bool(const std::string&)>& progress) {
    return in_algebra([&] {
        if (!(error >= Run::least_error && error <= Run::largest_error))
            throw InputError(
                fmt::format("an error of {:.3g} cannot be promised; it is relative to the amplitude of the motion, at "
                            "most {} and at "
                            "least {:.0e}",
                            error, Run::largest_error, Run::least_error));
        const lobatto::Scene written = scene.parts().scene;
        refuse_jumps(written, "tune");
        lobatto::Scene changed = written;
        apply(overrides_of(settings), changed);
        ChoiceRequest request;
        request.error = error;
        request.seconds = budget;
        request.tries_clocks = false;  // settings have no clock: the scene's own
        volatile int is_interrupted = 0;
        request.interrupted = &is_interrupted;
        if (progress)
            request.say = [&](const std::string& what) {
                if (!progress(what)) is_interrupted = 1;
            };
        const lobatto::Choice found = chosen(written, changed, request);
        Choice choice;
        choice.settings = settings_of(found, settings);
        choice.method = found.measurement.candidate.member.method().name();
        choice.step = found.step();
        choice.until = found.until;
        choice.predicted_error = found.measurement.error;
        choice.seconds = found.measurement.seconds;
        choice.complete = found.complete;
        return choice;
    });
}

std::vector<Claim> verify(const Scene& scene, const Settings& settings) {
    return in_algebra([&] {
        std::vector<Claim> claims;
        for (const ProofRow& row : prove(scene.parts().scene, method_of(settings)).rows)
            claims.push_back({row.claim, row.measured, row.bound, row.holds, row.meaning});
        return claims;
    });
}

}  // namespace lobatto::api
