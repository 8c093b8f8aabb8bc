// SPDX-License-Identifier: GPL-2.0-or-later
// The discrete action of one step and its slopes, in numbers of 60 digits (D25 ... D30).
//
// The cost grows with the formulas of one node, not with the equations of all of them: large systems are checked too.
#pragma once

#include <vector>

#include "generator/check/point.hpp"

namespace lobatto {

using Symbols = std::vector<GiNaC::symbol>;
using Path = std::vector<Numbers>;  // positions at the control points, controls x coordinates

class DiscreteAction {
public:
    explicit DiscreteAction(const Derivation& derivation);

    Formulas& formulas() { return formulas_; }
    // The step begins at `time` and is `step` long; to be called once the parameters have their values.
    void begin(const cln::cl_R& time, const cln::cl_R& step);
    std::size_t controls() const { return control_.size(); }

    Numbers values_of(const GiNaC::matrix& matrix);
    Numbers values_of(const Symbols& symbols) const;
    void set(const Symbols& symbols, const Numbers& values);

    // L_d of a path.
    cln::cl_R action(const Path& X);
    // (D30) of all coordinates, controls x n: sum_i h b_i (D_ij/h p + B_ij f); with `outer` F alone in place of f, and
    // no p: the virtual work.
    Path slopes(const Path& X, bool outer = false);

protected:
    const cln::cl_R& B(std::size_t i, std::size_t j) const { return B_[i * control_.size() + j]; }
    const cln::cl_R& D(std::size_t i, std::size_t j) const { return D_[i * control_.size() + j]; }
    // (D28); of straight paths positions alone.
    void set_node(std::size_t i, const Path& X, const Symbols& q, const Symbols& v);
    // Straight between control points j and j + 1 (D40); the position is that of the start.
    void set_straight(std::size_t j, const Path& X);

    const Derivation& derivation_;
    const System& system_;
    Formulas formulas_;
    const std::size_t n_;
    bool is_straight_ = false;  // the path, from node to node
    cln::cl_R t0_, h_;
    Numbers control_, nodes_, weights_, legendre_, B_, D_;
    std::vector<Id> lagrangian_, momentum_, force_, outer_force_;
};

}  // namespace lobatto
