// SPDX-License-Identifier: MIT
// Linear symmetries of a kernel's system, found by sampling its slopes, and the momenta that Noether's theorem
// conserves.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "runtime/build/library.hpp"

namespace lobatto {

// The direction B q + d in which moving does not change L, and forces do no work:
// (B q + d) . (dL/dq + F) + (B v) . dL/dv = 0 for all q, v and t. Conserved: p . (B q + d).
struct Symmetry {
    std::vector<double> B;  // n x n, row-major
    std::vector<double> d;  // n
    std::string kind;       // "translation", "rotation in the (x, y) plane", "rotation", "scaling", "linear symmetry"
    std::string momentum;   // "p_x + p_y", "x*p_y - y*p_x"
};

// All of them, as far as slopes sampled around q tell; `names` are those of the coordinates. Their number of entries
// grows with n^2: among more than most_turned coordinates only translations are looked for, among more than 64 nothing.
constexpr int most_turned = 16;
std::vector<Symmetry> find_symmetries(const Kernel& kernel, const std::vector<double>& parameters,
                                      const std::vector<double>& q, double step, const std::vector<std::string>& names);

// How much p . (B q + d) varies over the steps of a run, and how much the slopes at their ends say that the motion
// changes it, h sum |(B q + d) . (dL/dq + F) + (B v) . dL/dv|: what the samples took for a symmetry may be none where
// the motion comes to. Relative to the largest sum of the sizes of its terms.
struct MomentumVariation {
    std::int64_t steps = 0;  // good steps, at most those asked for
    double variation = 0, by_motion = 0;
};
MomentumVariation momentum_variation(const Kernel& kernel, const Symmetry& symmetry,
                                     const std::vector<double>& parameters, const std::vector<double>& q,
                                     const std::vector<double>& p, double step, std::int64_t steps);

}  // namespace lobatto
