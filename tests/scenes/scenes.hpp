// SPDX-License-Identifier: GPL-2.0-or-later
// Scenes and kernels that several tests share.
#pragma once

#include <string>

#include "analysis/exact_start.hpp"
#include "analysis/kernel/kernel_of.hpp"
#include "generator/pipeline.hpp"
#include "tests/support.hpp"

namespace lobatto::test {

inline Scene scene_of(const std::string& lagrangian, const std::string& coordinates, int points,
                      const std::string& parameters = "") {
    return read_scene(Source("test.toml", "title = \"Test\"\nlagrangian = \"" + lagrangian + "\"\n[coordinates]\n" +
                                              coordinates + "\n" +
                                              (parameters.empty() ? "" : "[parameters]\n" + parameters + "\n") +
                                              "[method]\nfamily = \"lobatto\"\npoints = " + std::to_string(points) +
                                              "\n[run]\nstep = 0.1\nuntil = 1\n"));
}

inline Scene pendulum_scene(int points) {
    return scene_of("m*q'^2/2 - m*omega^2*(1 - cos(q))", "q = { position = 1.5, velocity = 0.25 }", points,
                    "m = 2\nomega = 1.5");
}

// Two coordinates, a mass matrix that is not diagonal, coupled nonlinearly.
inline Scene coupled_scene(int points) {
    return scene_of("x'^2 + x'*y' + y'^2 - (x^4/4 + y^2/2 + x*y^2/2)",
                    "x = { position = 0.75, velocity = 0 }\ny = { position = 0.25, velocity = 0.5 }", points);
}

inline Kernel kernel_in_own_cache(const Derivation& derivation, Precision precision) {
    EmitOptions options;
    options.precision = precision;
    return kernel_of(emit(derivation, options), precision);
}

}  // namespace lobatto::test
