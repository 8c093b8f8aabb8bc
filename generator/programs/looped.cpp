// SPDX-License-Identifier: GPL-2.0-or-later
// The programs of systems whose terms repeat: each formula once, for loops over its rows, and the rest written out.
//
// Of the program element_3_node the inputs are x0, x1, ..., a0, a1, ... of one row and the outputs add to W and S, or
// to g and H.
#include "generator/programs/looped.hpp"
#include "generator/formula/expansion.hpp"

#include <fmt/format.h>

#include "generator/mechanics/algebra/constant_part.hpp"
#include "generator/mechanics/repeated/all_pairs.hpp"
#include "generator/programs/builder.hpp"

namespace lobatto {

namespace {

using GiNaC::ex;

// Of the second derivatives.
std::size_t variables_of(const Derivation& derivation) {
    return static_cast<std::size_t>(derivation.system.n) * (derivation.structure.form() == StepForm::general ? 2 : 1);
}

class LoopedBuilder : public ProgramBuilder {
public:
    explicit LoopedBuilder(const Derivation& derivation)
        : ProgramBuilder(derivation), general_(derivation.structure.form() == StepForm::general) {
        std::size_t e = 0;
        if (general_) {
            for (const auto& [place, value] : d_.structure.routhian().second.entries()) entry_[place] = e++;
        } else {
            for (const auto& place : d_.structure.constant_mass().entries) entry_[place] = e++;
        }
    }

    Programs build() {
        if (!general_) masses();
        written_out();
        for (std::size_t number = 0; number < d_.structure.elements.repeated.size(); ++number)
            element(static_cast<int>(number), d_.structure.elements.repeated[number]);
        symbols_ = before_;
        velocities_as_inputs();
        events();
        return std::move(p_);
    }

private:
    const char* slope() const { return general_ ? "g" : "W"; }
    const char* second() const { return general_ ? "H" : "S"; }

    // One value when all masses are the same formula, else one a coordinate.
    void masses() {
        Ids masses;
        for (std::size_t k = 0; k < n_; ++k) masses.push_back(convert(d_.system.mass(k, k)));
        Program mass{"mass", {}}, inverse{"inverse_mass", {}};
        for (const Id value : masses) {
            mass.outputs.push_back({"", value});
            inverse.outputs.push_back({"", g().power(value, -1)});
            if (std::all_of(masses.begin(), masses.end(), [&](Id other) { return other == masses.front(); })) break;
        }
        p_.programs.push_back(std::move(mass));
        p_.programs.push_back(std::move(inverse));
    }

    // The degree of a term in the velocities among its variables, 0 to 4, or -1.
    static ex energy_of(const ex& term, const std::vector<GiNaC::symbol>& velocities) {
        ex radial = 0;
        for (const auto& velocity : velocities) radial += velocity * term.diff(velocity);
        for (int degree = 0; degree <= 4; ++degree)
            if (expanded(radial - degree * term).is_zero()) return (degree - 1) * term;
        return radial - term;
    }

    // The quadratic part of V depends neither on the variables nor on the time.
    ConstantPart free_of(std::vector<GiNaC::symbol> variables) const {
        variables.push_back(d_.system.t);
        return ConstantPart(variables);
    }

    // What does not repeat: straight-line code over q, or z.
    void written_out() {
        before_ = symbols_;
        const std::vector<GiNaC::symbol>& variables = general_ ? d_.structure.routhian().z : d_.system.q;
        if (general_)
            for (std::size_t i = 0; i < variables.size(); ++i) {
                const std::size_t k = i % n_;
                const double start = i < n_ ? 0.1 : g().input_of(q_[k]).start;
                symbols_[variables[i]] = g().input({at("z", i), at("z", i), Phase::iterate, start});
            }
        const Elements& elements = d_.structure.elements;
        // The gradient of terms and the forces beside them.
        const auto add_slopes = [&](Program& program, const std::vector<ex>& terms) {
            std::vector<ex> gradient = gradient_of(terms, variables);
            for (const auto& [acted_on, force] : elements.other_forces)
                gradient[static_cast<std::size_t>(acted_on)] += general_ ? force : -force;
            for (std::size_t i = 0; i < gradient.size(); ++i)
                if (!gradient[i].is_zero())
                    program.outputs.push_back({at(slope(), i), convert(gradient[i]), Effect::add});
            return gradient;
        };
        const ConstantPart constant_part = free_of(variables);
        Program node = program_of({LoopPart::rest, LoopPart::Of::node}),
                slope_only = program_of({LoopPart::rest, LoopPart::Of::slope}),
                quadratic = program_of({LoopPart::rest, LoopPart::Of::quadratic});
        const SparseMatrix second_derivatives = derivative_of(add_slopes(slope_only, elements.others), variables);
        node.outputs = slope_only.outputs;
        for (const auto& [place, value] : second_derivatives.entries()) {
            const auto known = entry_.find(place);
            if (known == entry_.end()) continue;  // zero after all
            node.outputs.push_back({at(second(), known->second), convert(value), Effect::add});
            if (!d_.structure.absorbed() && !d_.structure.diagonal_part()) continue;
            const ex constant = constant_part.of(value);
            if (!constant.is_zero())
                quadratic.outputs.push_back({at("S0", known->second), convert(constant), Effect::add});
        }
        if (d_.scene.has_energy()) {
            Ids values;
            const std::vector<GiNaC::symbol> velocities(variables.begin(),
                                                        variables.begin() + (general_ ? static_cast<long>(n_) : 0));
            for (const ex& term : elements.others)
                values.push_back(convert(general_ ? energy_of(term, velocities) : term));
            Program energy = program_of({LoopPart::rest, LoopPart::Of::energy});
            energy.outputs.push_back({"sum", g().add(values), Effect::add});
            p_.programs.push_back(std::move(energy));
        }
        p_.programs.push_back(std::move(node));
        p_.programs.push_back(std::move(slope_only));
        p_.programs.push_back(std::move(quadratic));
        if (!d_.structure.neighbours()) return;
        const FixedEnds& fixed_ends = d_.structure.separable().fixed_ends;
        if (!fixed_ends.before && !fixed_ends.behind) return;
        // The same where the fixed ends of a chain are rows.
        Program inside = program_of({LoopPart::inside, LoopPart::Of::slope});
        add_slopes(inside, fixed_ends.others);
        p_.programs.push_back(std::move(inside));
    }

    void element(int number, const Element& element) {
        const std::string name = element_text(number);
        const auto start_of = [&](int variable) {
            const auto i = static_cast<std::size_t>(variable);
            return general_ && i < n_ ? 0.1 : g().input_of(q_[i % n_]).start;
        };
        for (std::size_t j = 0; j < element.x.size(); ++j)
            symbols_[element.x[j]] = g().input({fmt::format("x{}", j), fmt::format("x{} of {}", j, name),
                                                Phase::iterate, start_of(element.rows.front()[j])});
        for (std::size_t j = 0; j < element.a.size(); ++j)
            symbols_[element.a[j]] =
                g().input({fmt::format("a{}", j), fmt::format("a{} of {}", j, name), Phase::step,
                           d_.scene.evaluate(element.coefficients.front()[j], "a coefficient").to_double()});
        const bool is_force = element.target >= 0;
        const ex term = is_force && !general_ ? -element.term : element.term;
        std::vector<ex> gradient;
        for (const auto& x : element.x) gradient.push_back(is_force ? ex(0) : term.diff(x));
        if (is_force) gradient[static_cast<std::size_t>(element.target)] = term;
        const ConstantPart constant_part = free_of(element.x);
        Program node = program_of({number, LoopPart::Of::node}), slope_only = program_of({number, LoopPart::Of::slope}),
                quadratic = program_of({number, LoopPart::Of::quadratic});
        // Action and reaction: the same value, added and taken away.
        Ids slopes;
        std::vector<bool> taken;
        for (std::size_t j = 0; j < gradient.size(); ++j) {
            std::size_t i = 0;
            while (i < j && (taken[i] || !expanded(gradient[i] + gradient[j]).is_zero())) ++i;
            taken.push_back(i < j);
            slopes.push_back(i < j ? slopes[i] : convert(gradient[j]));
            if (!gradient[j].is_zero())
                slope_only.outputs.push_back(
                    {fmt::format("{}[i{}]", slope(), j), slopes[j], i < j ? Effect::subtract : Effect::add});
        }
        node.outputs = slope_only.outputs;
        const auto pairs = pairs_of(element);
        for (std::size_t column = 0; column < pairs.size(); ++column) {
            const auto [i, j] = pairs[column];
            const std::string place = entry_of_row(d_, number, pairs, column);
            const ex value = gradient[i].diff(element.x[j]);
            node.outputs.push_back({fmt::format("{}[{}]", second(), place), convert(value), Effect::add});
            const ex constant = constant_part.of(value);
            if ((d_.structure.absorbed() || d_.structure.diagonal_part()) && !constant.is_zero())
                quadratic.outputs.push_back({fmt::format("S0[{}]", place), convert(constant), Effect::add});
        }
        if (d_.scene.has_energy() && !is_force) {
            std::vector<GiNaC::symbol> velocities;
            for (std::size_t j = 0; general_ && j < element.x.size(); ++j)
                if (element.rows.front()[j] < static_cast<int>(n_)) velocities.push_back(element.x[j]);
            Program energy = program_of({number, LoopPart::Of::energy});
            energy.outputs.push_back({"sum", convert(general_ ? energy_of(term, velocities) : term), Effect::add});
            p_.programs.push_back(std::move(energy));
        }
        p_.programs.push_back(std::move(node));
        p_.programs.push_back(std::move(slope_only));
        p_.programs.push_back(std::move(quadratic));
        // Coefficients that are parameters are put into an array by prepare().
        Program table = program_of({number, LoopPart::Of::coefficients});
        if (has_parameters(element))
            for (const std::vector<ex>& values : coefficient_tables(element))
                for (const ex& value : values) table.outputs.push_back({"", convert(value)});
        p_.programs.push_back(std::move(table));
    }

    bool general_;
    std::map<std::pair<int, int>, std::size_t> entry_;
    GiNaC::exmap before_;
};

}  // namespace

bool has_full_matrix(const Derivation& derivation) {
    constexpr std::size_t fewest = 32;
    const Structure& structure = derivation.structure;
    const std::size_t variables = variables_of(derivation);
    const std::size_t entries = structure.form() == StepForm::general ? structure.routhian().second.entries().size()
                                                                      : structure.constant_mass().entries.size();
    return variables >= fewest && entries == variables * variables;
}

std::vector<std::vector<ex>> coefficient_tables(const Element& element) {
    std::vector<std::vector<ex>> tables(element.a.size());
    const std::optional<AllPairs> pairs = all_pairs(element);
    for (std::size_t j = 0; j < tables.size(); ++j) {
        if (pairs) {
            tables[j] = pairs->coefficients[j].values;
        } else {
            for (const auto& row : element.coefficients) tables[j].push_back(row[j]);
        }
    }
    return tables;
}

std::string entry_of_row(const Derivation& derivation, int element,
                         const std::vector<std::pair<std::size_t, std::size_t>>& pairs, std::size_t column) {
    const auto [i, j] = pairs[column];
    return has_full_matrix(derivation)
               ? fmt::format("i{} * {} + i{}", i, variables_of(derivation), j)
               : fmt::format("{}_entry[r * {} + {}]", element_text(element), pairs.size(), column);
}

bool has_parameters(const Element& element) {
    for (const auto& row : element.coefficients)
        for (const ex& value : row)
            if (!GiNaC::is_a<GiNaC::numeric>(value)) return true;
    return false;
}

Programs looped_programs(const Derivation& derivation) {
    return LoopedBuilder(derivation).build();
}

}  // namespace lobatto
