// SPDX-License-Identifier: GPL-2.0-or-later
// Lobatto quadrature on [0, 1] with s points and what the variational integrator needs of it, exactly, in Q(sqrt d).
#pragma once

#include <ginac/ginac.h>

#include <vector>

namespace lobatto {

// All numbers are exact, of the form a + b sqrt(d) with rational a, b; d = 5 for s = 4, d = 21 for s = 5, no radical
// for s = 2, 3. Indices are 0-based here: node i of the code is node i + 1 of docs/derivation.md. (The paper's nodes 0,
// xi, 1 - xi, 1 are nodes 0, 1, 2, 3 of s = 4.)
struct Quadrature {
    int points = 0;                // s
    int radicand = 1;              // d
    std::vector<GiNaC::ex> c;      // s nodes, 0 = c_0 < ... < c_{s-1} = 1
    std::vector<GiNaC::ex> b;      // s weights, sum 1
    GiNaC::symbol theta{"theta"};  // time within the step, t = t_0 + h theta
    std::vector<GiNaC::ex>
        basis;        // s Lagrange polynomials l_j(theta), expanded: l_j(c_i) = delta_ij   (paper: eq:basisFunctions)
    GiNaC::matrix D;  // s x s: D_ij = l_j'(c_i)
    GiNaC::matrix K;  // s x s: K = D^T diag(b) D    (paper: eq:rigidityKE)
    GiNaC::matrix G;  // (s-2) x (s-2): inverse of the interior block of K, symmetric
    GiNaC::matrix
        A;  // (s-2) x (s-2): b_j (c_i (1 - c_j) - G_ij) for the interior nodes, the matrix of the stage map (D12)
    GiNaC::matrix
        E;  // (s-2) x s: extrapolation, E_ij = l_j(1 + c_i), i interior: start values from the last step (D15)

    int order() const { return 2 * points - 2; }
};

Quadrature lobatto_quadrature(int points);  // 2 <= points <= 5

// Exact normal form of a polynomial expression in symbols with coefficients in Q(sqrt d): expanded, radicals collected.
GiNaC::ex expand_exactly(const GiNaC::ex& expression);

}  // namespace lobatto
