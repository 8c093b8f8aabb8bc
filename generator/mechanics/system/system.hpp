// SPDX-License-Identifier: GPL-2.0-or-later
// The mechanical system of a scene: L(q, q', t) and forces, their first and second derivatives, and of what kind they
// are.
#pragma once

#include <cln/cln.h>
#include <ginac/ginac.h>

#include <memory>
#include <string>
#include <vector>

#include "generator/mechanics/algebra/sparse.hpp"
#include "generator/mechanics/algebra/symbols.hpp"
#include "generator/mechanics/repeated/unwritten.hpp"
#include "generator/scene/scene.hpp"

namespace lobatto {

class Formulas;

// What is known of a system beside its second derivatives; all that those ask for who only run a kernel.
struct SystemOutline : SystemSymbols {
    GiNaC::ex lagrangian;                 // L(q, v, t)
    std::vector<GiNaC::ex> outer_force;   // n: F_k(q, v, t) of the scene
    bool has_forces() const;              // one of them is not 0
    std::vector<GiNaC::ex> momentum;      // n: p = dL/dv
    SparseMatrix momentum_v;              // n x n: dp/dv, what vanishes identically left out
    std::vector<Constraint> constraints;  // phi(q, t) = 0

    bool autonomous = true;  // neither L nor F nor a constraint depends on the time
    bool linear = false;     // p and f are affine in q and v, with constant coefficients

    std::vector<GiNaC::symbol> motion() const;  // q, v, t and the inputs: all that may change on the way
};

struct System : SystemOutline {
    std::vector<GiNaC::ex> terms;  // L is their sum; a sum of n bodies is n terms
    // Terms of L that are in no derivative below; of systems for kernels only.
    Unwritten unwritten;

    std::vector<GiNaC::ex> force;  // n: f = dL/dq + F
    // n x n each, what vanishes identically left out: dp/dq, df/dv, df/dq.
    SparseMatrix momentum_q, force_v, force_q;

    std::vector<GiNaC::ex> constraint_t;  // dphi/dt at fixed q, one each
    SparseMatrix constraint_q;            // G = dphi/dq, one row each
    // Of each constraint and momentum, what its rounding is measured by (algebra/summands.hpp).
    std::vector<std::vector<GiNaC::ex>> constraint_summands() const, momentum_summands() const;
    // Whether a momentum is 0 at rest and its summands are not, as of exp(v) - v: then it is rounding there.
    bool momenta_cancel() const;

    // A graph that knows the derivatives above; its symbols have values of no meaning.
    std::shared_ptr<const Formulas> formulas;

    // L = 1/2 v^T M v - V(q, t) with a constant M, and forces F(q, t): only interior nodes are implicit (D11 ... D17).
    bool separable = false;
    // The same but for constraints: M is constant, and forces hold no velocity.
    bool constant_mass = false;
    std::string not_separable;  // why not, a clause: "dp_x/dx' = 1 + x^2 depends on the position"

    // Of separable systems only.
    SparseMatrix mass;                // n x n, symmetric: M
    GiNaC::ex potential;              // V = -L(q, 0, t), constant terms kept
    std::vector<GiNaC::ex> gradient;  // n: dV/dq_k - F_k
    SparseMatrix hessian;             // n x n: its derivative in q
};

// Throws InputError when L is degenerate (its second derivatives in the velocities are singular everywhere) or real
// nowhere near the start, naming the direction or the reason. The start itself: generator/mechanics/start.hpp.
System build_system(const Scene& scene);
// The same for a caller that only writes a kernel: terms that repeat often stay `unwritten` where they may.
System build_short_system(const Scene& scene);
// The symbols of a scene, its Lagrangian and forces; nothing is differentiated.
System undifferentiated(const Scene& scene);
// L(q, q', t) + f(t) moves as L does, and a time that drops out need not be known: any moment will do.
Scene without_time(const Scene& scene);

// A direction in words: a' = -1, b' = 1; components that are zero left out.
std::string direction_text(const System& system, const std::vector<cln::cl_R>& direction);

// The gradient of a sum of terms in some variables, and the derivative of vectors, found term by term: each term is
// differentiated only by the variables it holds.
std::vector<GiNaC::ex> gradient_of(const std::vector<GiNaC::ex>& terms, const std::vector<GiNaC::symbol>& variables);
SparseMatrix derivative_of(const std::vector<GiNaC::ex>& vector, const std::vector<GiNaC::symbol>& variables);
// An expression as the terms of its sum; factors free of the given symbols are distributed over inner sums.
std::vector<GiNaC::ex> terms_of(const GiNaC::ex& expression, const std::vector<GiNaC::symbol>& variables);
// Each expression with all the variables at one value.
std::vector<GiNaC::ex> all_at(const std::vector<GiNaC::ex>& expressions, const std::vector<GiNaC::symbol>& variables,
                              const GiNaC::ex& value);

}  // namespace lobatto
