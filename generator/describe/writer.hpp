// SPDX-License-Identifier: GPL-2.0-or-later
// A derivation as a list of numbered formulas, while it is written: its symbols under names that people know, its
// formulas in sections.
#pragma once

#include <fmt/format.h>

#include <map>
#include <set>
#include <string>
#include <vector>

#include "generator/describe/describe.hpp"
#include "generator/mechanics/derivation.hpp"

namespace lobatto {

constexpr std::size_t largest_full_matrix = 12;  // rows; beyond, its entries that are not zero are listed

class DescriptionWriter {
public:
    using Names = std::vector<std::string>;

    explicit DescriptionWriter(const Derivation& derivation);

protected:
    std::string name(std::size_t k) const { return d_.scene.coordinates[k].name; }

    // A symbol of the derivation under a name that no other symbol has.
    void rename(const GiNaC::symbol& symbol, std::string wish) {
        while (!taken_.insert(wish).second) wish += "_";
        display_[symbol] = GiNaC::symbol(wish);
        names_[symbol] = wish;
    }
    std::string name_of(const GiNaC::symbol& symbol) const { return names_.at(symbol); }
    Names names_of(const std::vector<GiNaC::symbol>& symbols) const {
        Names names;
        for (const auto& symbol : symbols) names.push_back(name_of(symbol));
        return names;
    }
    GiNaC::ex shown(const GiNaC::ex& expression) const {
        return expression.subs(display_, GiNaC::subs_options::no_pattern);
    }

    // W, or W_x and W_y.
    Names by_coordinate(const std::string& letter) const {
        Names names;
        for (std::size_t k = 0; k < n_; ++k) names.push_back(n_ == 1 ? letter : letter + "_" + name(k));
        return names;
    }
    static unsigned at(std::size_t index) { return static_cast<unsigned>(index); }
    static Names numbered(const std::string& letter, std::size_t count) {
        Names names;
        for (std::size_t i = 1; i <= count; ++i) names.push_back(fmt::format("{}_{}", letter, i));
        return names;
    }

    void section(const std::string& title) { result_.sections.push_back({title, {}}); }
    void scalar(const std::string& id, const std::string& number, const std::string& paper, const std::string& meaning,
                const std::string& left, const GiNaC::ex& value) {
        add({id, number, paper, meaning, {left}, {}, {value}});
    }
    void vector(const std::string& id, const std::string& number, const std::string& paper, const std::string& meaning,
                const Names& left, const std::vector<GiNaC::ex>& values) {
        add({id, number, paper, meaning, left, {values.size()}, values});
    }
    void matrix(const std::string& id, const std::string& number, const std::string& paper, const std::string& meaning,
                const std::string& left, const GiNaC::matrix& value) {
        std::vector<GiNaC::ex> values;
        for (unsigned i = 0; i < value.rows(); ++i)
            for (unsigned j = 0; j < value.cols(); ++j) values.push_back(value(i, j));
        add({id, number, paper, meaning, {left}, {value.rows(), value.cols()}, values});
    }
    // A matrix of many rows as a list of the entries that are not zero.
    void matrix(const std::string& id, const std::string& number, const std::string& meaning, const std::string& left,
                const SparseMatrix& value) {
        if (static_cast<std::size_t>(value.rows()) <= largest_full_matrix) {
            matrix(id, number, "", meaning, left, value.dense());
            return;
        }
        Names names;
        std::vector<GiNaC::ex> values;
        for (const auto& [place, entry] : value.entries()) {
            names.push_back(fmt::format("{}_{}_{}", left, place.first + 1, place.second + 1));
            values.push_back(entry);
        }
        vector(id, number, "", meaning + "; all other entries are 0", names, values);
    }
    // Labels of the paper belong to four points and one coordinate.
    void add(Formula formula) {
        if (!is_paper_scheme_) formula.paper.clear();
        for (GiNaC::ex& value : formula.values) value = shown(value);
        result_.sections.back().formulas.push_back(std::move(formula));
    }

    GiNaC::symbol momentum_symbol(std::size_t k) { return symbol_among(p_, k, by_coordinate("p")[k]); }
    GiNaC::symbol acceleration_symbol(std::size_t k) { return symbol_among(accelerations_, k, name(k) + "''"); }
    GiNaC::symbol multiplier_symbol(std::size_t c) {
        return symbol_among(multipliers_, c, "lambda_" + d_.system.constraints[c].name);
    }
    using Symbols = std::map<std::size_t, GiNaC::symbol>;
    GiNaC::symbol symbol_among(Symbols& symbols, std::size_t k, const std::string& wish) {
        const auto [place, is_new] = symbols.try_emplace(k);
        if (is_new) rename(place->second, wish);
        return place->second;
    }

    const Derivation& d_;
    std::size_t n_, s_, controls_;
    bool lobatto_, general_, written_out_, is_paper_scheme_;
    std::set<std::string> taken_;
    GiNaC::exmap display_;
    std::map<GiNaC::ex, std::string, GiNaC::ex_is_less> names_;
    Symbols p_, accelerations_, multipliers_;
    Description result_;
};

// The sections of a description.
class Describer : DescriptionWriter {
public:
    using DescriptionWriter::DescriptionWriter;

    Description run();

private:
    // The system and its quadrature (system_formulas.cpp).
    void facts();
    void quadrature();
    // As decimals, which the coefficients are.
    void straight_path();
    // (D25, D44) d/dt dL/dv - dL/dq - F, and what constraints add.
    void equations_of_motion();
    void separable_system();
    void general_system();
    // (D44)
    void constraints();
    void second_derivatives(const std::string& id, const std::string& what, const std::string& left,
                            const SparseMatrix& value);
    // (D29): the gradient of R, and with it the velocities of the cyclic coordinates.
    void routhian();

    // The equations of a step (step_formulas.cpp).
    void discrete_equations();
    void full_system();
    void reduced_system();
    // (D20) and the energy that it conserves, (D21).
    void propagation_of_one();

    // Those of any Lagrangian (general_formulas.cpp).
    // (D28, D30) in positions and velocities at the nodes, which have names of their own: written out in the control
    // points alone they would be too long to read.
    void general_equations();
    // (D30) in blocks: one entry for all coordinates together.
    void general_step();
    using Blocks = std::map<std::string, std::vector<GiNaC::symbol>>;  // "g_v": at node 1, 2 ...
    void name_blocks(const std::vector<std::string>& letters, Blocks& node);
    // The derivatives of the slopes by the positions, and the equation of kappa with its row and column.
    void add_second_derivatives(const GiNaC::ex& h, Blocks& node, GiNaC::matrix& J) const;
    GiNaC::ex add_multiplier(const GiNaC::ex& h, Blocks& node, GiNaC::matrix& J) const;
};

}  // namespace lobatto
