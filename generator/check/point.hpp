// SPDX-License-Identifier: GPL-2.0-or-later
// Values for checks: the symbols of a derivation at a seeded point near the scene's start, expressions at 60 digits.
#pragma once

#include <cln/cln.h>

#include <cmath>
#include <vector>

#include "generator/check/check.hpp"
#include "generator/mechanics/algebra/sample.hpp"
#include "generator/mechanics/derivation.hpp"

namespace lobatto {

using Numbers = std::vector<cln::cl_R>;

// All symbols of the derivation (parameters, h, positions of both steps, momenta, velocities, times) at values near the
// scene's. The further `attempt` is from 0, the nearer; from the tenth on the parameters are exactly the scene's.
Formulas point_near_start(const Derivation& derivation, int attempt);

// Calls work(attempt) until it has succeeded twice; DomainError when it never does.
template <class Work>
void at_two_attempts(const Work& work) {
    int done = 0;
    for (int attempt = 0; done < 2; ++attempt) {
        try {
            work(attempt);
            ++done;
        } catch (const DomainError&) {
            if (attempt == sample_attempts) throw;
        }
    }
}

// Calls work(formulas) at two points where everything is real.
template <class Work>
void at_two_points(const Derivation& derivation, const Work& work) {
    at_two_attempts([&](int attempt) {
        Formulas formulas = point_near_start(derivation, attempt);
        work(formulas);
    });
}

// The largest |x_i - y_i|, relative to the largest |x_i| or |y_i|.
double relative_difference(const Numbers& x, const Numbers& y);

Numbers times(const Numbers& A, const Numbers& x);  // A row by row
// x with A x = y, A row by row: Gaussian elimination, the largest pivot of each column. DomainError when A is singular.
Numbers solve(Numbers A, Numbers y);

// Seeded, each component in the unit of its own value, or of the largest where that is zero.
Numbers seeded_direction(const Numbers& start, Noise& noise);
// (F(x + e d) - F(x - e d)) / 2e at x = start.
template <class Function>
Numbers central_difference(const Numbers& start, const Numbers& direction, const cln::cl_R& e, const Function& F) {
    const auto moved = [&](const cln::cl_R& step) {
        Numbers x = start;
        for (std::size_t i = 0; i < x.size(); ++i) x[i] = x[i] + step * direction[i];
        return F(x);
    };
    Numbers after = moved(e);
    const Numbers before = moved(-e);
    for (std::size_t i = 0; i < after.size(); ++i) after[i] = (after[i] - before[i]) / (2 * e);
    return after;
}

// The relative difference of derivatives and their central differences, difference(e): with e = 1e-20, or with the e
// that suits them better where positions are so large that truncation, or so small that rounding is in the way.
// `sizes` of the functions, if given, tell where their rounding hides all that they change by: DomainError if it always
// does.
template <class Difference>
double difference_defect(const Numbers& derivatives, const Difference& difference,
                         const std::vector<Sized>& sizes = {}) {
    cln::cl_R rounding = 0, most = 0;  // of the functions at 57 digits; of the derivatives
    for (const Sized& size : sizes) rounding = cln::max(rounding, size.size * cln::expt(cln::cl_RA(10), -57));
    for (const cln::cl_R& derivative : derivatives) most = cln::max(most, cln::abs(derivative));
    double least = HUGE_VAL;
    bool is_hidden = !derivatives.empty();
    for (const int digits : {20, 26, 32, 14, 8, 2}) {
        try {
            const cln::cl_R e = cln::cl_float(cln::expt(cln::cl_RA(10), -digits), cln::float_format(number_digits));
            if (!cln::zerop(most) && rounding > e * most) continue;
            is_hidden = false;
            least = std::fmin(least, relative_difference(derivatives, difference(e)));
        } catch (const DomainError&) {
            if (least == HUGE_VAL) throw;
        }
        if (least <= difference_bound) break;
    }
    if (is_hidden) throw DomainError("the derivatives are below the rounding of what they belong to");
    return least;
}

}  // namespace lobatto
