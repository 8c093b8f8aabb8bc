// SPDX-License-Identifier: GPL-2.0-or-later
// The integrator for any potential V(q) derived from its discrete Lagrangian, shared by the files of section 5.
#pragma once

#include <ginac/ginac.h>

#include <string>
#include <vector>

#include "generator/paper/paper.hpp"

namespace lobatto::paper {

struct Integrator {
    GiNaC::ex discrete;            // L_d
    std::vector<GiNaC::ex> inner;  // 2 dL_d/dq_xi + dL_d/dq_1xi and its mirror image
    GiNaC::lst solved;  // q_xi, q_1xi == linear part + (h^2/30m)(V' terms): the inner equations, used as substitutions
    GiNaC::ex left, right;         // dL_d/dq_l, dL_d/dq_r with `solved` injected
    std::vector<GiNaC::ex> full;   // F_L, four residuals in (q_xi, q_1xi, p_jp, q_r)
    GiNaC::matrix jacobian{4, 4};  // dF_L
};

const Integrator& integrator();

void newton(std::vector<Statement>& list);

}  // namespace lobatto::paper
