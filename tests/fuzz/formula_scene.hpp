// SPDX-License-Identifier: GPL-2.0-or-later
// Bytes as a formula of a scene that declares one of everything a formula may name.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "generator/formula/text/source.hpp"

namespace lobatto {

// Scenes that differ in the ways of the derivation that they take. What stands before the bytes uses all that is
// declared, so that nothing else is an error.
enum class FormulaScene {
    all,         // terms of a Lagrangian of several coordinates, an array, definitions, time
    one,         // of one coordinate: closed solutions, linear maps
    clean,       // two coordinates, round-off-clean arithmetic
    chain,       // the potential between neighbours of a chain: loops over tables
    forced,      // a force
    in_formula,  // a definition, used twice
    whole,       // the whole Lagrangian of two coordinates: masses of any sign, or none
};
constexpr int formula_scenes = 6;  // chosen by length; `whole` by a mark that begins no formula
constexpr char whole_mark = '=';

inline Source formula_scene(FormulaScene kind, const std::uint8_t* data, std::size_t size) {
    std::string formula(reinterpret_cast<const char*>(data), size);
    for (std::size_t at; (at = formula.find("'''")) != std::string::npos;) formula.erase(at, 1);  // would end the text
    formula = "\n" + formula + "\n'''\n";
    const std::string run = "[run]\nstep = 0.1\nuntil = 1\n", start = " = { position = 0.3, velocity = 0.2 }\n",
                      quarter = "r = \"sqrt(1 + q^2)\"\n", parameters = "[parameters]\nk = 1.5\nm = [1, 2]\n";
    switch (kind) {
        case FormulaScene::all:
            return Source("scene.toml",
                          "time = \"t\"\nlagrangian = '''\n(q'^2 + sum(i = 1 .. n, x[i]'^2))/2 + "
                          "0*k*m[1]*m[2]*r*s[1]*t + \n" +
                              formula + "[definitions]\n" + quarter + "\"s[i]\" = \"x[i] - q\"\n[coordinates]\nq" +
                              start + "x = { count = \"n\", position = \"i/3\", velocity = 0 }\n" + parameters +
                              "n = { value = 2, constant = true }\n[method]\npoints = 3\n" + run);
        case FormulaScene::one:
            return Source("scene.toml", "lagrangian = '''\nm[1]*q'^2/2 + 0*k*m[2]*r + \n" + formula +
                                            "[definitions]\n" + quarter + "[coordinates]\nq" + start + parameters +
                                            "[method]\npoints = 4\n" + run);
        case FormulaScene::clean:
            return Source("scene.toml", "lagrangian = '''\nm[1]*q'^2/2 + m[2]*s'^2/2 + 0*k*r + \n" + formula +
                                            "[definitions]\n" + quarter + "[coordinates]\nq" + start + "s" + start +
                                            parameters + "[method]\npoints = 5\narithmetic = \"clean\"\n" + run);
        case FormulaScene::chain:
            return Source("scene.toml",
                          "lagrangian = '''\nsum(i = 1 .. n, x[i]'^2/2) + sum(i = 2 .. n, 0*k*m[1]*s[i] + \n" +
                              formula.substr(0, formula.size() - 5) +
                              "\n)'''\n[definitions]\n\"s[i]\" = \"x[i] - x[i-1]\"\n[coordinates]\n"
                              "x = { count = \"n\", position = \"i/30\", velocity = 0 }\n" +
                              parameters + "n = { value = 12, constant = true }\n[method]\npoints = 4\n" + run);
        case FormulaScene::forced:
            return Source("scene.toml",
                          "time = \"t\"\nlagrangian = \"m[1]*q'^2/2 + m[2]*x[1]'^2/2 + 0*k*r*t\"\n[forces]\nq = '''\n" +
                              formula + "[definitions]\n" + quarter + "[coordinates]\nq" + start +
                              "x = { count = 1, position = 0.4, velocity = 0 }\n" + parameters +
                              "[method]\nfamily = \"gauss\"\nstages = 2\n" + run);
        case FormulaScene::in_formula:
            return Source(
                "scene.toml",
                "lagrangian = \"m[1]*q'^2/2 + m[2]*s'^2*r^2 + 0*k - r/(1 + s^2)\"\n[definitions]\nr = '''\n2 + \n" +
                    formula + "[coordinates]\nq" + start + "s" + start + parameters + "[method]\npoints = 3\n" + run);
        case FormulaScene::whole:
            return Source("scene.toml", "lagrangian = '''\n0*k*m[1]*m[2]*r + \n" + formula + "[definitions]\n" +
                                            quarter + "[coordinates]\nq" + start + "s" + start + parameters +
                                            "[method]\npoints = 3\n" + run);
    }
    return Source("scene.toml", "");
}

}  // namespace lobatto
