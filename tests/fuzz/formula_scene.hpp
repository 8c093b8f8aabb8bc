// SPDX-License-Identifier: GPL-2.0-or-later
// Bytes as the Lagrangian of a scene that declares one of everything a formula may name.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "generator/source.hpp"

namespace lobatto {

inline Source formula_scene(const std::uint8_t* data, std::size_t size) {
    std::string formula(reinterpret_cast<const char*>(data), size);
    for (std::size_t at; (at = formula.find("'''")) != std::string::npos;) formula.erase(at, 1);  // would end the text
    // What stands before the bytes uses all that is declared, so that nothing else is an error.
    return Source(
        "scene.toml",
        "time = \"t\"\nlagrangian = '''\n(q'^2 + sum(i = 1 .. n, x[i]'^2))/2 + 0*k*m[1]*m[2]*r*s[1]*t + "
        "\n" +
            formula +
            "\n'''\n[definitions]\nr = \"sqrt(1 + q^2)\"\n\"s[i]\" = \"x[i] - q\"\n[coordinates]\n"
            "q = { position = 0.3, velocity = 0.2 }\nx = { count = \"n\", position = \"i/3\", velocity = 0 }\n"
            "[parameters]\nn = { value = 2, constant = true }\nk = 1.5\nm = [1, 2]\n[method]\npoints = 3\n"
            "[run]\nstep = 0.1\nuntil = 1\n");
}

}  // namespace lobatto
