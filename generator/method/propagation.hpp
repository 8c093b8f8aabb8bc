// SPDX-License-Identifier: GPL-2.0-or-later
// The exact step of a linear system with one coordinate: a continued fraction.
#pragma once

#include <ginac/ginac.h>

#include "generator/method/quadrature.hpp"

namespace lobatto {

// For L = m q'^2/2 - k q^2/2 + f q with z = h^2 k/m, one step is (D20)
//     q1 = (a q0 + (h/m) c p0 + (h^2 f/m) e_q) / delta
//     p1 = ((m/h) b q0 + a p0 + h f e_p) / delta
// with polynomials in z over the rationals, no common factor, a^2 - b c = delta^2 (the paper's eq:symplecticCoeffs,
// with its b and c freed of their factors m/h and h/m).
struct Propagation {
    GiNaC::symbol z{"z"};
    GiNaC::ex delta, a, b, c, e_q, e_p;
};

Propagation propagation(const Quadrature& quadrature);

}  // namespace lobatto
