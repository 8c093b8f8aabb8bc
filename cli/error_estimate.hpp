// SPDX-License-Identifier: GPL-2.0-or-later
// What the polynomials of two neighbouring steps tell of the error of a whole run: the error of the harmonic
// oscillation whose polynomials miss one another as much.
#pragma once

#include <complex>
#include <vector>

#include "generator/quadrature.hpp"

namespace lobatto {

// For one member of the family. With z = h omega an oscillation of amplitude 1 has
//     jump(z)  = max |P_before(1 + theta) - P(theta)|, theta = 1/4, 1/2, 3/4 (polynomial_defect),
//                P through the exact values at the control points,
//     phase(z) = |arccos(a/delta) - z|, the error of its phase in one step (D20).
// From the jump of a step z is found, and from z the error: steps * phase(z). Jumps are of the order of the
// polynomials, errors of that of the method, about twice as high; the oscillation tells how one goes with the other.
class ErrorEstimate {
public:
    explicit ErrorEstimate(const Quadrature& quadrature);

    // Relative to the amplitude, at most 1, after this many steps; rounding is left out.
    double after(double steps, double jump) const;
    double jump(double z) const;
    double phase(double z) const;

private:
    std::vector<double> control_;
    std::vector<std::vector<double>> ahead_, here_;  // l_j(1 + theta), l_j(theta) for each theta
    std::vector<long double> a_, delta_;             // polynomials in z^2
    double longest_ = 3;                             // the largest z of interest
};

// Coefficients of a polynomial, lowest first, and its value.
std::vector<long double> coefficients_of(const GiNaC::ex& polynomial, const GiNaC::symbol& z);
long double value_of(const std::vector<long double>& polynomial, long double z);

}  // namespace lobatto
