// SPDX-License-Identifier: MIT
// (D60) Inputs: values of parameters that the caller changes between two steps. Position and momentum go on; what is
// computed anew is what depends on inputs alone, and the forces where the motion is, which the next step begins with.
#ifndef LOBATTO_KERNEL_INPUTS_HPP
#define LOBATTO_KERNEL_INPUTS_HPP

#include "../base/contract.hpp"
#include "../base/numbers.hpp"

namespace lobatto {

// The memory of the step before is of other forces: the iteration begins without it.
template <class K, class S>
Status forget_forces(S& stepper) {
    using real = typename K::real;
    constexpr int n = K::coordinates;
    stepper.has_history = false;
    real* W;
    if constexpr (stepping_of<K>() == Stepping::composition)
        W = stepper.W;
    else
        W = stepper.W + (K::points - 1) * n;
    Formulas<K>::minus_acceleration(stepper.coefficients, stepper.time(), stepper.q, W);
    if constexpr (stepping_of<K>() == Stepping::composition) {
        stepper.ends.of = -1;
        if constexpr (K::neighbours) stepper.neighbours.begin(stepper.q, stepper.u, W);
    } else {
        stepper.is_current = true;
        if constexpr (S::has_fixed_point) stepper.fixed_point.pause = Pause();
        if constexpr (S::along_coordinates)
            stepper.fixed_point.iteration.begin(stepper.q, stepper.u, W);
        else if constexpr (S::has_fixed_point)
            stepper.fixed_point.iteration.begin(stepper.q, W);
    }
    return is_finite(not_finite_part(W, n)) ? Status::ok : Status::not_finite;
}

// The functions of events where the motion is.
template <class K>
Status event_functions(const Stepper<K>& stepper, typename K::real* values) {
    using real = typename K::real;
    real velocity[K::coordinates], momentum[K::coordinates];
    stepper.momentum(momentum);
    const real time = stepper.time();
    const Status status = stepper.velocity(time, stepper.q, momentum, velocity);
    if (status == Status::ok) Formulas<K>::event(stepper.coefficients, time, stepper.q, velocity, values);
    return status;
}

// Before a step: `parameters` with other values of K's inputs; those of other parameters must be the ones of prepare().
// Where it fails, inputs must be set again before the next step.
template <class K>
Status set_inputs(Stepper<K>& stepper, const typename K::Parameters& parameters) {
    using real = typename K::real;
    constexpr int events = K::events > 0 ? K::events : 1;
    [[maybe_unused]] real before[events], after[events];
    [[maybe_unused]] bool is_known = false;
    if constexpr (K::events > 0) is_known = event_functions<K>(stepper, before) == Status::ok;
    Status status = K::set_inputs(parameters, stepper.step_size, stepper.coefficients);
    if constexpr (K::form != Form::general)
        if (status == Status::ok) status = forget_forces<K>(stepper);
    if constexpr (K::events > 0) {
        if (status == Status::ok) status = event_functions<K>(stepper, after);
        for (int e = 0; status == Status::ok && e < K::events; ++e) {
            if (is_known && before[e] == after[e]) continue;
            stepper.event_values[e] = after[e];
            stepper.event_begins[e] = true;
        }
    }
    return status;
}

}  // namespace lobatto

#endif
