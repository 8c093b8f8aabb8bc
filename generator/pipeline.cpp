// SPDX-License-Identifier: GPL-2.0-or-later
// The one place that calls the stages in order.
#include "generator/pipeline.hpp"

#include <fmt/format.h>

#include <tuple>

#include "generator/formula/limits.hpp"
#include "generator/mechanics/clock/clock.hpp"
#include "generator/mechanics/constraints/constraints.hpp"
#include "generator/mechanics/constraints/impacts.hpp"
#include "generator/mechanics/start.hpp"
#include "generator/programs/programs.hpp"

namespace lobatto {

namespace {

// Clean steps and those of splitting methods are steps of systems with a constant mass matrix and forces without
// velocities.
void check_method(const Scene& scene, const System& system, Shortcuts shortcuts) {
    if (scene.clock && (scene.method.family == Family::splitting || scene.method.arithmetic == StepArithmetic::clean))
        throw InputError(
            fmt::format("{}: {} no clock; choose Lobatto or Gauss (--points 8){}", scene.path,
                        scene.method.family == Family::splitting ? "splitting methods have" : "clean arithmetic has",
                        scene.method.family == Family::splitting ? "" : " and --arithmetic plain"));
    require_method_of_constraints(scene);
    constexpr int digits_of_tables = 47;  // of the 60 that generator/formula/spline.cpp computes
    if (!scene.tables.empty() && decimals_of(scene.method.numbers) > digits_of_tables)
        throw InputError(
            fmt::format("{}: measured values have too few digits for numbers in {}; choose \"{} digits\" at most",
                        scene.path, precision_name(scene.method.numbers), digits_of_tables));
    if (scene.method.family == Family::splitting) {
        if (shortcuts == Shortcuts::none)
            throw InputError(scene.path +
                             ": splitting methods have no general path; leave out --general, or choose "
                             "another method (--points 4)");
        if (scene.method.arithmetic == StepArithmetic::clean)
            throw InputError(scene.path +
                             ": splitting methods have no clean arithmetic; choose another method (--points 8), or "
                             "plain arithmetic (--arithmetic plain)");
        if (!system.separable)
            scene.source.fail(scene.lagrangian_at,
                              "splitting methods need a constant mass matrix and forces without velocities, but " +
                                  system.not_separable + "; choose Lobatto (--points 4) or Gauss (--stages 3)");
    }
    if (scene.method.arithmetic != StepArithmetic::clean) return;
    if (shortcuts == Shortcuts::none)
        throw InputError(scene.path +
                         ": the general path has no clean arithmetic; leave out --general, or add --arithmetic plain");
    if (!system.separable)
        scene.source.fail(scene.lagrangian_at,
                          "clean arithmetic needs a constant mass matrix and forces without velocities, but " +
                              system.not_separable + "; use plain arithmetic (--arithmetic plain)");
}

Derivation derived(const Scene& scene, Shortcuts shortcuts, System (*system_of)(const Scene&)) {
    Derivation derivation;
    derivation.scene = in_clock_time(scene);
    derivation.system = system_of(derivation.scene);
    check_method(scene, derivation.system, shortcuts);
    check_impacts(derivation.scene, derivation.system);
    check_start(derivation.scene, derivation.system);
    derivation.quadrature = quadrature_of(scene.method);
    std::tie(derivation.structure, derivation.findings) =
        find_structure(derivation.scene, derivation.system, derivation.quadrature, shortcuts);
    return derivation;
}

// Terms that are not written out are in loops, or lost.
bool is_whole(const Derivation& derivation) {
    return derivation.system.unwritten.empty() || derivation.structure.looped;
}

}  // namespace

Derivation derive(const Scene& scene, Shortcuts shortcuts) {
    const DerivationLimits limits(scene.path);
    return derived(scene, shortcuts, build_system);
}

Derivation derive_kernel(const Scene& scene, Shortcuts shortcuts) {
    const DerivationLimits limits(scene.path);
    if (shortcuts == Shortcuts::none) return derived(scene, shortcuts, build_system);
    Derivation derivation = derived(scene, shortcuts, build_short_system);
    return is_whole(derivation) ? derivation : derived(scene, shortcuts, build_system);
}

Derivation with_method(const Derivation& derivation, const Method& method) {
    Derivation other;
    other.scene = derivation.scene;
    other.scene.method = method;
    other.system = derivation.system;
    check_method(other.scene, other.system, derivation.structure.shortcuts());
    other.quadrature = quadrature_of(method);
    std::tie(other.structure, other.findings) =
        find_structure(other.scene, other.system, other.quadrature, derivation.structure.shortcuts());
    if (!is_whole(other)) {
        other.system = build_system(other.scene);
        std::tie(other.structure, other.findings) = find_structure(other.scene, other.system, other.quadrature);
    }
    return other;
}

KernelSource emit(const Derivation& derivation, const EmitOptions& options) {
    const Scene& scene = derivation.scene;
    const DerivationLimits limits(scene.path);
    try {
        return emit_kernel(derivation, optimised_programs(derivation), options);
    } catch (const DomainError& error) {
        scene.source.fail(scene.lagrangian_at,
                          std::string("no kernel can be written for the Lagrangian: ") + error.what());
    }
}

PlainSource emit_plain(Scene scene, Precision precision) {
    refuse_clock(scene, "the plain text");
    refuse_constraints(scene, "the plain text");
    refuse_impacts(scene, "the plain text");
    const auto refuse = [&](const std::string& why) { throw InputError(scene.path + ": " + why); };
    if (precision == Precision::quadruple || precision == Precision::double_double || has_many_digits(precision))
        refuse("the plain text has the functions of the standard library, which knows no numbers in " +
               precision_name(precision) + "; choose --numbers \"long double\"");
    if (scene.method.arithmetic == StepArithmetic::clean)
        refuse("the plain text has no clean arithmetic; add --arithmetic plain");
    if (scene.coordinates.size() > static_cast<std::size_t>(plain_limit))
        refuse(
            fmt::format("the plain text writes every formula out, for at most {} coordinates, but the scene has {}; "
                        "leave out --plain",
                        plain_limit, scene.coordinates.size()));
    scene.outputs.energy = true;
    Derivation derivation = derive(scene);
    const DerivationLimits limits(scene.path);
    // No shortcuts: they are worth their lines only where speed is asked for.
    if (derivation.structure.form() == StepForm::general)
        derivation = derive(scene, Shortcuts::none);
    else
        derivation.structure.iterate();
    derivation.structure.looped = false;
    try {
        return emit_plain(derivation, optimised_programs(derivation), precision);
    } catch (const DomainError& error) {
        scene.source.fail(scene.lagrangian_at,
                          std::string("no kernel can be written for the Lagrangian: ") + error.what());
    }
}

}  // namespace lobatto
