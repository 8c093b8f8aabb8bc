// SPDX-License-Identifier: GPL-2.0-or-later
// What a kernel computes, as programs over one graph (docs/derivation.md): what all forms share.
#include "generator/programs/programs.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

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
        symbols_[d_.system.parameters[i]] = g().input({identifier(name), name, Phase::parameter, value});
    }
    h_ = g().input({"h", "h", Phase::step_size});
    for (std::size_t k = 0; k < n_; ++k) {
        const std::string& name = d_.scene.coordinates[k].name;
        const double value = start_of(d_.scene.initial_position[k], "the initial position of " + name);
        q_.push_back(g().input({at("q", k), name, Phase::step, value}));
        symbols_[d_.system.q[k]] = q_.back();
    }
    if (!d_.system.autonomous) symbols_[d_.system.t] = g().input({"time", d_.system.t.get_name(), Phase::step, 0});
}

Ids ProgramBuilder::times(const IdMatrix& matrix, const Ids& vector) {
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
    for (const Event& event : d_.scene.watched()) values.push_back(convert(event.value));
    if (values.empty()) return;
    program("event", "value", values);
    if (!d_.scene.impacts.empty()) impacts();
    refractions();
}

void ProgramBuilder::refractions() {
    Program program{"refraction", {}};
    std::size_t number = 0;
    for (const Switch& one : d_.scene.switches) {
        if (!one.refracts) continue;
        for (std::size_t k = 0; k < n_; ++k)
            program.outputs.push_back({at("G", number * n_ + k), convert(one.value.diff(d_.system.q[k]))});
        program.outputs.push_back({at("g_t", number), convert(one.value.diff(d_.system.t))});
        ++number;
    }
    if (number > 0) p_.programs.push_back(std::move(program));
}

void ProgramBuilder::impacts() {
    Program impact{"impact", {}}, reset{"reset", {}};
    std::vector<GiNaC::ex> walls;
    for (const Impact& wall : d_.scene.impacts) walls.push_back(wall.when.value);
    std::size_t resets = 0;
    for (std::size_t w = 0; w < walls.size(); ++w) {
        const Impact& wall = d_.scene.impacts[w];
        for (std::size_t k = 0; k < n_; ++k)
            impact.outputs.push_back({at("G", w * n_ + k), convert(walls[w].diff(d_.system.q[k]))});
        impact.outputs.push_back({at("g_t", w), convert(walls[w].diff(d_.system.t))});
        impact.outputs.push_back({at("restitution", w), convert(wall.restitution)});
        impact.outputs.push_back({at("rest", w), convert(wall.rest)});
        if (wall.reset_position.empty()) continue;
        for (std::size_t k = 0; k < n_; ++k) {
            reset.outputs.push_back({at("q1", resets * n_ + k), convert(wall.reset_position[k])});
            reset.outputs.push_back({at("velocity1", resets * n_ + k), convert(wall.reset_velocity[k])});
        }
        ++resets;
    }
    p_.programs.push_back(std::move(impact));
    if (resets > 0) p_.programs.push_back(std::move(reset));
}

Programs build_programs(const Derivation& derivation) {
    if (derivation.structure.looped) return looped_programs(derivation);
    if (!derivation.system.unwritten.empty()) throw std::logic_error("terms that are not written out, and no loops");
    return derivation.structure.form() == StepForm::general ? general_programs(derivation)
                                                            : separable_programs(derivation);
}

namespace {

// What `whole` costs, about, in additions: as one program, or as `part` of each repeated formula, row by row.
double cost_of(const Programs& programs, const Structure& structure, const std::string& whole, LoopPart::Of part) {
    double sum = 0;
    for (const Program& program : programs.programs) {
        if (program.part ? program.part->of != part : program.name != whole) continue;
        std::vector<Id> values;
        for (const Output& output : program.outputs) values.push_back(output.value);
        const Operations operations = count(programs.graph, programs.graph.topological(values));
        const bool repeats = program.part && program.part->element >= 0;
        const double rows =
            repeats ? static_cast<double>(
                          structure.elements.repeated[static_cast<std::size_t>(program.part->element)].rows.size())
                    : 1;
        sum += rows * static_cast<double>(operations.additions + operations.multiplications + 8 * operations.divisions +
                                          16 * operations.functions);
    }
    return sum;
}

// Whether second derivatives save more evaluations than they cost: with them a step takes an evaluation less, about,
// and five products for each of them (measured).
bool hessian_pays(const Programs& programs, const Structure& structure) {
    if (structure.form() == StepForm::general) return false;
    const double evaluation = cost_of(programs, structure, "minus_acceleration", LoopPart::Of::slope),
                 with_slopes = cost_of(programs, structure, "node", LoopPart::Of::node);
    return with_slopes + 5 * static_cast<double>(structure.constant_mass().entries.size()) <= 2 * evaluation;
}

}  // namespace

OptimisedPrograms optimised_programs(const Derivation& derivation) {
    const Structure& structure = derivation.structure;
    OptimisedPrograms result;
    result.programs = build_programs(derivation);
    result.report = optimise(result.programs);
    result.cost_of_node = cost_of(result.programs, structure, "node", LoopPart::Of::node);
    result.uses_hessian = hessian_pays(result.programs, structure);
    return result;
}

}  // namespace lobatto
