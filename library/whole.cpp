// SPDX-License-Identifier: GPL-2.0-or-later
#include "library/whole.hpp"

#include <fmt/format.h>

#include <utility>

#include "analysis/accuracy/until_stop.hpp"
#include "analysis/kernel/support_text.hpp"
#include "generator/mechanics/clock/clock.hpp"
#include "generator/mechanics/constraints/constraints.hpp"
#include "generator/mechanics/constraints/impacts.hpp"
#include "generator/mechanics/start.hpp"
#include "generator/mechanics/system/system.hpp"

namespace lobatto::api {

Checked checked(const Scene& scene, const Settings& settings, Shortcuts shortcuts) {
    refuse_values(settings, "check");
    return check_scene(with_method(scene, settings), shortcuts);
}

Description described(const Scene& scene, const Settings& settings) {
    refuse_values(settings, "derive");
    return describe(derive(with_method(scene, settings)));
}

KernelSource emitted(const Scene& scene, const Settings& settings, const EmitWish& wish) {
    refuse_values(settings, "emit");
    const lobatto::Scene changed = with_method(scene, settings);
    EmitOptions options{changed.method.numbers, {}};
    if (wish.standalone)
        options.support_text = [&](const std::vector<std::string>& parts) {
            return support_text(wish.ensemble ? with_ensemble(parts) : parts);
        };
    return lobatto::emit(derive_kernel(changed, wish.shortcuts), options);
}

PlainSource plainly_emitted(const Scene& scene, const Settings& settings) {
    refuse_values(settings, "emit");
    if (settings.tolerance)
        throw lobatto::InputError("--tolerance: the plain integrator iterates to rounding; leave one of the two out");
    const lobatto::Scene changed = with_method(scene, settings);
    return lobatto::emit_plain(changed, changed.method.numbers);
}

StabilityReport stability_of(const Scene& scene, const Settings& settings) {
    const lobatto::Scene changed = with_method(scene, settings);
    refuse_clock(changed, "lobatto stability");
    refuse_constraints(changed, "lobatto stability");
    refuse_impacts(changed, "lobatto stability");
    MethodChoice::require_double(changed, "stability");
    if (changed.method.family == Family::splitting)
        throw lobatto::InputError(fmt::format(
            "{}: what is exact here is of Lobatto and Gauss; choose one (--points 4), or ask for the limits of the "
            "method alone: lobatto stability --splitting {}",
            changed.path, changed.method.points));
    Overrides overrides = overrides_of(settings);
    if (changed.may_end_early()) {
        lobatto::Scene with_values = changed;
        apply(overrides, with_values);
        with_values = ending_at_stop(std::move(with_values));
        overrides.until = fmt::format("{}", with_values.evaluate(with_values.run.until, "the end time").to_double());
    }
    return stability_report(changed, overrides);
}

lobatto::Scene for_roundoff(const Scene& scene, const Settings& settings) {
    lobatto::Scene changed = with_method(scene, settings);
    refuse_clock(changed, "lobatto roundoff");
    refuse_constraints(changed, "lobatto roundoff");
    refuse_impacts(changed, "lobatto roundoff");
    MethodChoice::require_double(changed, "roundoff");
    if (changed.method.family == Family::splitting)
        throw lobatto::InputError(changed.path +
                                  ": `lobatto roundoff` compares plain arithmetic with clean, which splitting methods "
                                  "do not have; choose Lobatto (--points 8) or Gauss (--stages 4)");
    const System system = build_short_system(changed);
    if (!system.separable)
        throw lobatto::InputError(
            fmt::format("{}: `lobatto roundoff` compares plain arithmetic with clean, which needs a constant mass "
                        "matrix and forces "
                        "without velocities, but {}: there is nothing to compare",
                        changed.path, system.not_separable));
    const Overrides overrides = overrides_of(settings);
    apply(overrides, changed);
    changed.method.arithmetic = StepArithmetic::clean;
    changed.method.tolerance = 0;
    step_of(changed, overrides);  // refuses one that makes no sense
    return changed;
}

RoundoffResult roundoff_of(lobatto::Scene scene, const RoundoffRequest& request) {
    return roundoff_growth(
        std::move(scene), request.steps, request.trajectories, request.reference, request.interrupted,
        request.progress ? request.progress : [](std::int64_t) {});
}

Proof proof_of(const Scene& scene, const Settings& settings, const Heard& say) {
    Settings others = settings;
    others.set.clear();
    others.step.clear();
    refuse_values(others, "verify");
    lobatto::Scene chosen = scene.parts().scene;
    apply(overrides_of(settings), chosen);
    if (!settings.set.empty()) check_values(chosen);
    const std::string path = chosen.path;
    try {
        return prove(
            std::move(chosen), method_of(settings), say ? say : [](const std::string&, double) {});
    } catch (const lobatto::ComputationError& failure) {
        const std::string what = failure.what();
        throw lobatto::ComputationError(what.starts_with(path) ? what : fmt::format("{}: {}", path, what));
    }
}

}  // namespace lobatto::api
