// SPDX-License-Identifier: GPL-2.0-or-later
// The paper's other comparison scheme, from the same derivation: P1 interpolation, one Gauss point, the implicit
// midpoint rule.
#pragma once

#include <ginac/ginac.h>

#include <string>
#include <vector>

namespace lobatto::paper {

// One step of the Galerkin integrator L_d = h L((q_l + q_r)/2, (q_r - q_l)/h) with L = m q'^2/2 - V(q): equations by
// differentiation, solved by Newton on the derived expressions.
class Midpoint {
public:
    // The potential as text in q, m, omega.
    Midpoint(const std::string& potential, double mass, double omega, double step);

    struct State {
        double q = 0, p = 0;
    };
    // The states of `steps` steps, the start included.
    std::vector<State> run(State start, int steps) const;

private:
    GiNaC::ex residual_;  // p_j + dL_d/dq_l, in q_l, q_r, p_j
    GiNaC::ex slope_;     // d(residual)/dq_r
    GiNaC::ex momentum_;  // p_{j+1} = dL_d/dq_r
};

}  // namespace lobatto::paper
