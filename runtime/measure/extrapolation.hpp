// SPDX-License-Identifier: MIT
// Hamilton's equations by explicit extrapolation: a second way to the solution, which shares no formula of a step with
// the family.
#pragma once

#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

#include "runtime/build/library.hpp"

namespace lobatto {

// q' = v(t, q, p), p' = dL/dq + F at v, with the kernel's own `velocity` and `slopes`; with constraints also the pull
// G^T lambda of the multipliers that the motion has (D49), so that phi and dphi/dt stay 0 but for the tolerance. By the
// modified midpoint rule of Gragg, extrapolated in the squared step (E. Hairer, S. P. Norsett, G. Wanner, Solving
// Ordinary Differential Equations I, II.9), with 2, 4, 6, ... substeps, until two columns agree.
template <class real>
class Extrapolation {
public:
    // `stepper` is prepared. `scale`: 2n, what an error of each q and p is relative to. `tolerance`: of one macro step.
    Extrapolation(LoadedStepper<real> stepper, std::vector<real> scale, real tolerance);

    void start(real time, const std::vector<real>& q, const std::vector<real>& p);

    // To `time`, which is later; false when the formulas fail or the steps become too short. The first macro step tried
    // is the whole way, later ones go by experience.
    bool advance_to(real time);
    // Called before each macro step, for those who do not wait for ever: it may throw.
    void set_watch(std::function<void()> watch) { watch_ = std::move(watch); }

    real time() const { return time_; }
    const std::vector<real>& state() const { return y_; }  // 2n: q, p
    std::int64_t evaluations() const { return evaluations_; }
    // The least and largest value of each so far, at the start and at the ends of macro steps.
    const std::vector<real>& least() const { return least_; }
    const std::vector<real>& most() const { return most_; }

private:
    bool slope(real time, const std::vector<real>& y, std::vector<real>& f);
    bool midpoint(real H, int substeps, std::vector<real>& end);
    bool macro_step(real H);

    LoadedStepper<real> stepper_;
    std::vector<real> scale_;
    real tolerance_;
    std::size_t n_;
    real time_ = 0, longest_ = 0;  // 0: not known yet
    int columns_ = 0;              // that the last macro step took
    std::vector<real> least_, most_;
    std::vector<real> y_, f0_, q_, p_, v_, Lv_, Lq_, lambda_, phi_, phi_t_, G_;
    std::vector<std::vector<real>> table_;
    std::int64_t evaluations_ = 0;
    std::function<void()> watch_;
};

}  // namespace lobatto
