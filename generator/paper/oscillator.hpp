// SPDX-License-Identifier: GPL-2.0-or-later
// The oscillator's integrator derived from its discrete Lagrangian, shared by the files of section 4.
#pragma once

#include <ginac/ginac.h>

#include <vector>

#include "generator/paper/paper.hpp"
#include "generator/paper/symbols.hpp"

namespace lobatto::paper {

// In q_l, q_xi, q_1xi, q_r, m, h, omega; `border` in q_jm, q_j, q_jp.
struct Oscillator {
    GiNaC::ex discrete;             // L_d = h (K_d - U)
    GiNaC::ex hessian_determinant;  // of d2L_d/d(q_xi, q_1xi)^2
    GiNaC::ex determinant;          // (h^2 omega^2 - 30)(h^2 omega^2 - 10), expanded
    std::vector<GiNaC::ex> inner;   // q_xi, q_1xi in q_l, q_r
    GiNaC::ex reduced;              // L_r(q_l, q_r)
    GiNaC::ex left_momentum;        // -dL_r/dq_l
    GiNaC::ex right_momentum;       // dL_r/dq_r
    GiNaC::ex border;               // dL_r/dq_r(q_jm, q_j) + dL_r/dq_l(q_j, q_jp)
};

const Oscillator& oscillator();

// Its symbols in the paper's notation.
inline GiNaC::ex h() {
    return symbol("h");
}
inline GiNaC::ex m() {
    return symbol("m");
}
inline GiNaC::ex omega() {
    return symbol("omega");
}

// The polynomial in r with these roots and leading coefficient has `sign` on begin < r < end: no root inside, sign at
// the middle.
bool keeps_sign(const GiNaC::ex& polynomial, const GiNaC::ex& leading, const std::vector<GiNaC::ex>& roots,
                const GiNaC::ex& begin, const GiNaC::ex& end, int sign);

void truncation_and_stability(std::vector<Statement>& list);
void symplectic_structure(std::vector<Statement>& list);

}  // namespace lobatto::paper
