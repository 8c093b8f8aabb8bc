// SPDX-License-Identifier: GPL-2.0-or-later
// Values for checks: the symbols of a derivation at a seeded point near the scene's start, expressions at 60 digits.
#pragma once

#include <cln/cln.h>

#include <vector>

#include "generator/pipeline.hpp"
#include "generator/sample.hpp"

namespace lobatto {

// All symbols of the derivation (parameters, h, positions of both steps, momenta, velocities) at values near the
// scene's. The further `attempt` is from 0, the nearer; from the tenth on the parameters are exactly the scene's.
Formulas point_near_start(const Derivation& derivation, int attempt);

// Calls work(formulas) at two points where everything is real; DomainError when there are none.
template <class Work>
void at_two_points(const Derivation& derivation, const Work& work) {
    int done = 0;
    for (int attempt = 0; done < 2; ++attempt) {
        Formulas formulas = point_near_start(derivation, attempt);
        try {
            work(formulas);
            ++done;
        } catch (const DomainError&) {
            if (attempt == sample_attempts) throw;
        }
    }
}

// The largest |x_i - y_i|, relative to the largest |x_i| or |y_i|.
double relative_difference(const std::vector<cln::cl_R>& x, const std::vector<cln::cl_R>& y);

}  // namespace lobatto
