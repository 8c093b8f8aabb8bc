// SPDX-License-Identifier: GPL-2.0-or-later
// Quadrature rules on [0, 1], Lobatto's, Gauss' and those of splitting methods, and what the variational integrator
// needs of them.
#pragma once

#include <ginac/ginac.h>

#include <vector>

#include "generator/method/method.hpp"

namespace lobatto {

// The paths of Lobatto and Gauss are polynomials. Those of splitting methods are straight from node to node, which may
// stand in any order, and serve systems of constant mass only: their stage map is explicit (D40).
//
// All numbers are exact where the nodes lie in one quadratic field Q(sqrt d): Lobatto with up to 5 points, Gauss with
// up to 3, and splitting methods, all rational; beyond, floats of 150 digits, rounded from 220 so that equal numbers
// are equal; 0, 1/2 and 1 remain exact. The residue of an identity between floats is about 1e-105, not 0: never ask it
// is_zero(). Indices are 0-based here: node i of the code is node i + 1 of docs/derivation.md. (The paper's nodes 0,
// xi, 1 - xi, 1 are nodes 0, 1, 2, 3 of Lobatto with 4 points.)
struct Quadrature {
    Method method;
    bool exact = true;             // numbers in Q(sqrt d), else floats
    int radicand = 1;              // d, 1 when no radical occurs or the numbers are floats
    GiNaC::symbol theta{"theta"};  // time within the step, t = t_0 + h theta

    // The rule with the ends of the step as nodes: what the reduced form of a constant mass matrix needs (D11 ... D17).
    // Lobatto: its s points. Gauss: 0, its s points, 1, the ends with weight 0. Splitting: between any two nodes a
    // drift, the ends perhaps with weight 0.
    int points = 0;            // nodes of this list
    std::vector<GiNaC::ex> c;  // nodes, c_0 = 0, c_{points-1} = 1; ascending but for splitting
    std::vector<GiNaC::ex> b;  // weights, sum 1
    GiNaC::matrix A;           // (points-2) x (points-2), the matrix of the stage map (D12). Lobatto and splitting:
                      // b_j (c_i (1 - c_j) - G_ij) for the interior nodes. Gauss: the square of the collocation matrix.
    GiNaC::matrix E;  // (points-2) x points: E_ij = l_j(1 + c_i) over all nodes of the list: start values from the last
                      // step (D15); not of splitting

    // The Galerkin form: a path through control points, integrated at the quadrature nodes proper.
    std::vector<GiNaC::ex> nodes, weights;  // r each: the nodes that have a weight
    std::vector<GiNaC::ex> control;         // control points, 0 first, 1 last. Lobatto and splitting: c. Gauss with s
                                            // stages: (1 - cos(j pi/s))/2, j = 0 ... s
    std::vector<GiNaC::ex> basis;           // Lagrange polynomials l_j(theta) on the control points, expanded
                                            // (paper: eq:basisFunctions)
    GiNaC::matrix B;                        // r x controls: l_j(nodes_i); Lobatto: the identity; splitting: rows of it
    GiNaC::matrix K;  // controls x controls: the integrals of l_i' l_j', K = D^T diag(weights) D for polynomials
                      // (paper: eq:rigidityKE)
    GiNaC::matrix G;  // inverse of K without its first and last row and column, symmetric

    // Of polynomials; of splitting methods these and `basis` are empty.
    GiNaC::matrix D;                  // r x controls: l_j'(nodes_i)
    GiNaC::matrix extrapolation;      // controls x controls: l_j(1 + control_i): the polynomial carried on into the
                                      // next step
    std::vector<GiNaC::ex> legendre;  // r: the shifted Legendre polynomial of degree r - 1 at the nodes, for Lobatto
                                      // (cyclic coordinates); zeros for Gauss

    // What the fixed-point iteration over the nodes needs, with the Lagrange polynomials l_j on the quadrature nodes.
    GiNaC::matrix integration;  // r x r: the integral of l_j from 0 to nodes_i
    GiNaC::matrix reach;        // (controls - 1) x r: the same to control_i, i = 1, 2, ...
    GiNaC::matrix ahead;        // r x r: l_j(1 + nodes_i)

    int order() const { return method.order(); }
    bool is_explicit() const { return method.family == Family::splitting; }
};

Quadrature quadrature_of(const Method& method);  // std::invalid_argument where there is no such rule

// Exact normal form of a polynomial expression in symbols with coefficients in Q(sqrt d): expanded, radicals collected.
GiNaC::ex expand_exactly(const GiNaC::ex& expression);

}  // namespace lobatto
