// SPDX-License-Identifier: GPL-2.0-or-later
// A scene: one mechanical system, how to integrate it and what to keep, read from a TOML file (docs/scene_format.md).
#pragma once

#include <ginac/ginac.h>

#include <string>
#include <vector>

#include "generator/source.hpp"

namespace lobatto {

struct Coordinate {
    std::string name;        // an identifier
    std::string unit;        // "" when none is given
    GiNaC::symbol position;  // prints as name
    GiNaC::symbol velocity;  // prints as name'
};

struct Parameter {
    std::string name;
    std::string unit;
    GiNaC::ex value;  // exact, free of symbols
    GiNaC::symbol symbol;
};

enum class Family { lobatto };

struct Method {
    Family family = Family::lobatto;
    int points = 4;  // 2 ... 5
};

struct Run {
    GiNaC::ex step;   // h > 0; in parameters
    GiNaC::ex until;  // end time, >= 0; in parameters
};

struct Outputs {
    long every = 1;      // keep each state whose step index is a multiple of this
    bool energy = true;  // a column H in the trajectory file
};

// Initial rates are given either as velocities or as momenta, for all coordinates.
enum class Start { velocity, momentum };

struct Scene {
    Source source{"", ""};   // the file, for errors found after reading
    Position lagrangian_at;  // where the Lagrangian stands in it
    std::string path;        // as given
    std::string name;        // stem of the file as a C identifier: pendulum
    std::string title;       // one line
    std::vector<Coordinate> coordinates;
    std::vector<Parameter> parameters;        // run-time parameters, in the order of the file
    std::vector<Parameter> constants;         // declared constant: already substituted everywhere
    std::string lagrangian_text;              // as written, white space collapsed
    GiNaC::ex lagrangian;                     // in position and velocity symbols and run-time parameters
    std::vector<GiNaC::ex> initial_position;  // in parameters
    std::vector<GiNaC::ex> initial_rate;      // velocities or momenta, in parameters
    Start start = Start::velocity;
    Method method;
    Run run;
    Outputs outputs;

    // The value of an expression in the parameters, with the parameters at their scene values unless given, in scene
    // order: 60 decimal digits; throws InputError naming `what` when it is not a finite real number.
    GiNaC::numeric evaluate(const GiNaC::ex& expression, const std::string& what,
                            const std::vector<GiNaC::ex>& parameter_values = {}) const;
};

// Throws InputError: what, where, why, how to mend.
Scene read_scene(const std::string& path);
Scene read_scene(const Source& source);

}  // namespace lobatto
