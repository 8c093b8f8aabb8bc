// SPDX-License-Identifier: GPL-2.0-or-later
// What a kernel computes, as programs over one graph (docs/derivation.md): what all forms share.
#include "generator/programs/programs.hpp"

#include "generator/programs/builder.hpp"
#include "generator/programs/identifier.hpp"
#include "generator/programs/looped.hpp"

namespace lobatto {

ProgramBuilder::ProgramBuilder(const Derivation& derivation)
    : d_(derivation),
      n_(static_cast<std::size_t>(derivation.system.n)),
      s_(static_cast<std::size_t>(derivation.quadrature.points)) {
    const auto start_of = [&](const GiNaC::ex& value, const std::string& what) {
        return d_.scene.evaluate(value, what).to_double();
    };
    for (std::size_t i = 0; i < d_.scene.parameters.size(); ++i) {
        const std::string& name = d_.scene.parameters[i].name;
        const double value = start_of(d_.scene.parameters[i].value, "the parameter " + name);
        symbols_[d_.system.parameters[i]] = g().input({identifier(name), name, Stage::parameter, value});
    }
    h_ = g().input({"h", "h", Stage::step_size});
    for (std::size_t k = 0; k < n_; ++k) {
        const std::string& name = d_.scene.coordinates[k].name;
        const double value = start_of(d_.scene.initial_position[k], "the initial position of " + name);
        q_.push_back(g().input({at("q", k), name, Stage::step, value}));
        symbols_[d_.system.q[k]] = q_.back();
    }
    if (!d_.system.autonomous) symbols_[d_.system.t] = g().input({"time", d_.system.t.get_name(), Stage::step, 0});
}

Ids ProgramBuilder::times(const Rows& matrix, const Ids& vector) {
    Ids result;
    for (const Ids& row : matrix) {
        Ids terms;
        for (std::size_t l = 0; l < row.size(); ++l)
            if (!g().is_number(row[l], 0)) terms.push_back(g().multiply({row[l], vector[l]}));
        result.push_back(g().add(terms));
    }
    return result;
}

void ProgramBuilder::program(const std::string& name, const std::string& array, const Ids& values) {
    Program program{name, {}};
    for (std::size_t i = 0; i < values.size(); ++i) program.outputs.push_back({at(array, i), values[i]});
    p_.programs.push_back(std::move(program));
}

void ProgramBuilder::velocities_as_inputs() {
    for (std::size_t k = 0; k < n_; ++k) {
        velocity_.push_back(in("velocity", k));
        symbols_[d_.system.v[k]] = velocity_.back();
    }
}

void ProgramBuilder::events() {
    Ids values;
    for (const Event& event : d_.scene.outputs.events) values.push_back(convert(event.value));
    if (!values.empty()) program("event", "value", values);
}

Programs build_programs(const Derivation& derivation) {
    if (derivation.structure.looped) return looped_programs(derivation);
    return derivation.structure.form == Form::general ? general_programs(derivation) : separable_programs(derivation);
}

}  // namespace lobatto
