// SPDX-License-Identifier: GPL-2.0-or-later
// What a run tells of its own error: how its energy swings, how far neighbouring motions part, and by how much the
// polynomials of neighbouring steps miss one another.
#pragma once

#include <complex>
#include <vector>

#include "analysis/stepping.hpp"
#include "generator/method/quadrature.hpp"

namespace lobatto {

// What some states of a run show. Everything is relative to `scale`, 2n: amplitudes of q and p.
struct Evidence {
    double jump = 0;     // (mean of J^b)^(1/b), J = polynomial_defect at a state, b = error_power; 0: no
                         // dense output
    double swing = 0;    // of the energy, largest less smallest, in units of the mean of |p v|; 0: does not tell
    double rate = 0;     // 1/time: the largest |v_k| / scale_k, |p_k'| / scale_{n+k}
    double local = 0;    // the mean difference, at its end, of a step and two of half its length; 0: not looked at
    double certain = 0;  // the least error that the energy at the states, or single steps, leave possible
    double growth = 0;   // how many times further apart than at the start a neighbouring motion gets; 0: not looked at
};

// Of a motion of any kind the error of a run is a (steps) J^b with b = (order + 1)/(degree + 1): one step's error has
// the power order + 1 of the step, J has that of the polynomials' degree + 1. a belongs to the motion and the member:
// `lobatto tradeoff` measures it (Calibration).
double error_power(const Method& method);

// For one member of the family.
class ErrorEstimate {
public:
    explicit ErrorEstimate(const Quadrature& quadrature);

    // Of a run of `steps` steps that takes `duration`, relative to the amplitude: the larger of what its energy or its
    // halves say, and its polynomials; docs/estimate.md shows how near that comes.
    //   Energy: the steps follow a modified energy H + h^p H_p, so H swings as much as h^p H_p does, and angles turn
    // faster by about the same part: swing/4 * rate * duration. (The quarter is measured.)
    //   Halves: the errors of single steps, added, where no energy is conserved, or its quadratic part always (Gauss).
    //   Polynomials: the error of the harmonic oscillation whose polynomials miss one another as much; that of a motion
    // with harmonics is larger.
    // A part `random` of the amplitude, in each step: rounding, or what a tolerance leaves out. Where neighbours part
    // faster than rate * duration, as on chaotic motions, errors do so too. Never less than what is certain.
    double after(double steps, double duration, const Evidence& evidence, double random = 0) const;

    // The harmonic oscillation of amplitude 1 with z = h omega:
    //     jump(z)  = max |P_before(1 + theta) - P(theta)|, theta = 1/4, 1/2, 3/4,
    //                P through the exact values at the control points,
    //     phase(z) = |arccos(a/delta) - z|, the error of its phase in one step (D20).
    double jump(double z) const;
    double phase(double z) const;
    // The error after this many steps of the oscillation with this jump; 0 when none has it.
    double of_oscillation(double steps, double jump) const;

private:
    // The polynomial of a step is sum_j l_j(theta) times the derivative of that order at that point; of splitting
    // methods, positions, velocities and accelerations at the ends.
    struct Datum {
        double point = 0;
        int derivative = 0;
    };
    std::vector<Datum> data_;
    std::vector<std::vector<double>> ahead_, here_;  // l_j(1 + theta), l_j(theta) for each theta
    std::vector<long double> a_, delta_;             // polynomials in z^2
    double phase_of_short_ = 0;                      // phase(shortest)
    int order_ = 0;
    double longest_ = 3;  // the largest z of interest
};

// One step from a state, and two of half its length.
template <class real>
struct Halved {
    std::vector<real> end;  // of the step; empty where it fails, or where nothing can be compared
    double difference = 0;  // of the ends, relative to the amplitude; infinite where only the halves fail
};
// `stepper` is prepared with `step`, and its trajectory is lost.
template <class real>
std::vector<Halved<real>> halved(LoadedStepper<real>& stepper, const States<real>& states,
                                 const std::vector<real>& parameters, real step, const std::vector<double>& scale);

// Above that of the first of them; not a number where there is none.
template <class real>
std::vector<double> energies_of(const LoadedStepper<real>& stepper, const States<real>& states);

// `states` are some of a run, in the order of time, the first its start; `stepper` is prepared with its step, and its
// trajectory is lost. `energies` of theirs above the first one's; none where the motion conserves none. `energy_tells`:
// neither does a quadratic form of the method. Costs two steps a state; three for `local`, which is looked at where the
// energy does not tell; and for `growth` the run once more where that is short (some 0.1 s).
template <class real>
Evidence evidence_of(LoadedStepper<real>& stepper, const States<real>& states, const std::vector<real>& parameters,
                     real step, const std::vector<double>& scale, double power, const std::vector<double>& energies,
                     bool energy_tells);

}  // namespace lobatto
