// SPDX-License-Identifier: GPL-2.0-or-later
// What the builders of all forms share: the graph, its inputs, the scene's symbols in it, named values, programs.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "generator/mechanics/derivation.hpp"
#include "generator/programs/programs.hpp"

namespace lobatto {

using Ids = std::vector<Id>;
using IdMatrix = std::vector<Ids>;

class ProgramBuilder {
public:
    explicit ProgramBuilder(const Derivation& derivation);

protected:
    Graph& g() { return p_.graph; }
    static std::string at(const std::string& array, std::size_t index) {
        return array + "[" + std::to_string(index) + "]";
    }
    Id in(const std::string& array, std::size_t index, Phase phase = Phase::step) {
        return g().input({at(array, index), at(array, index), phase});
    }
    Id convert(const GiNaC::ex& expression) { return g().from(expression, symbols_); }
    Id named(const std::string& name, Id value) {
        p_.names.emplace_back(value, name);
        return value;
    }
    Ids times(const IdMatrix& matrix, const Ids& vector);
    void program(const std::string& name, const std::string& array, const Ids& values);
    // The programs event, impact, reset and refraction: what is watched in each step, and what walls and switches do.
    void events();
    void impacts();
    void refractions();
    // Inputs velocity[k] in the place of the scene's velocities.
    void velocities_as_inputs();

    const Derivation& d_;
    std::size_t n_, s_;  // coordinates; nodes of the reduced form
    Programs p_;
    GiNaC::exmap symbols_;  // scene symbols -> inputs: parameters, positions q[k], time
    Id h_ = 0;
    Ids q_, velocity_;
};

Programs separable_programs(const Derivation& derivation);  // and linear maps
Programs general_programs(const Derivation& derivation);

}  // namespace lobatto
