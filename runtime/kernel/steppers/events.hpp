// SPDX-License-Identifier: MIT
// States between two steps, on the polynomial of the last step: dense output, and where event functions change sign.
#ifndef LOBATTO_KERNEL_EVENTS_HPP
#define LOBATTO_KERNEL_EVENTS_HPP

#include "../base/contract.hpp"
#include "../base/numbers.hpp"

namespace lobatto {

template <class K>
struct Between {
    using real = typename K::real;
    using S = Stepper<K>;
    static constexpr int n = K::coordinates, columns = 1 + 2 * n;

    static real time(const S& stepper, real theta) {
        return stepper.start_time + (real(stepper.steps - 1) + theta) * stepper.step_size;
    }

    // t, q[n], p[n] at t + theta h of the last step.
    static void row(const S& stepper, real theta, real* row) {
        real velocity[n];
        row[0] = time(stepper, theta);
        stepper.polynomial(theta, row + 1, velocity);
        stepper.momentum(row[0], row + 1, velocity, row + 1 + n);
        if constexpr (K::form == Form::general) {  // conserved exactly
            for (int c = 0; c < K::cyclic; ++c) row[1 + n + K::cyclic_index[c]] = stepper.p[K::cyclic_index[c]];
        }
    }
};

template <class K>
struct Events {
    using real = typename K::real;
    using S = Stepper<K>;
    static constexpr int pieces = S::nodes;  // of a step, looked at for one change of sign each
    static constexpr int columns = 1 + Between<K>::columns;
    static constexpr int most = K::events * pieces;  // rows of one step

    // The values of all events at t + theta h of the last step.
    static void values(const S& stepper, real theta, real* value) {
        real q[K::coordinates], velocity[K::coordinates];
        stepper.polynomial(theta, q, velocity);
        Formulas<K>::event(stepper.coefficients, Between<K>::time(stepper, theta), q, velocity, value);
    }

    // Where event e vanishes between a and b, to the rounding of theta: secants, with the value of an end that stays
    // halved (the Illinois method), and every third time the middle.
    static real locate(const S& stepper, int e, real a, real value_a, real b, real value_b) {
        real value[K::events];
        int stays = 0;  // the end that the last secant left in place: -1 is a, 1 is b
        for (int iteration = 1; b - a > Limits<real>::epsilon; ++iteration) {
            const real middle = a + real(0.5) * (b - a);
            real theta = iteration % 3 == 0 ? middle : b - value_b * ((b - a) / (value_b - value_a));
            if (!(theta > a && theta < b)) theta = middle;
            values(stepper, theta, value);
            if (value[e] == real(0)) return theta;
            if ((value[e] > real(0)) == (value_b > real(0))) {
                b = theta;
                value_b = value[e];
                if (stays == -1) value_a *= real(0.5);
                stays = -1;
            } else {
                a = theta;
                value_a = value[e];
                if (stays == 1) value_b *= real(0.5);
                stays = 1;
            }
        }
        return b;
    }

    // Rows of event number, t, q[n], p[n] of the last step, in the order of the motion; how many. Values before are
    // those that the last look ended with: the velocity of two steps' polynomials differs where they meet.
    static int look(S& stepper, real* rows) {
        int count = 0;
        real before[K::events], thetas[most];
        for (int e = 0; e < K::events; ++e) before[e] = stepper.event_values[e];
        real theta_before = real(0);
        for (int piece = 1; piece <= pieces; ++piece) {
            const real theta = real(piece) / real(pieces);
            real after[K::events];
            values(stepper, theta, after);
            for (int e = 0; e < K::events; ++e) {
                const bool rises = before[e] < real(0) && after[e] >= real(0);
                const bool falls = before[e] > real(0) && after[e] <= real(0);
                const int direction = (rises == (stepper.step_size > real(0))) ? 1 : -1;  // with growing time
                real root = theta;
                bool is_root = (rises || falls) && K::event_direction[e] * direction >= 0;
                if (is_root && after[e] != real(0)) {
                    real start[K::events], there[K::events];
                    values(stepper, theta_before, start);
                    const bool has_changed = start[e] == real(0) || (start[e] > real(0)) == (after[e] > real(0));
                    root = has_changed ? theta_before : locate(stepper, e, theta_before, start[e], theta, after[e]);
                    values(stepper, root, there);
                    // At a pole the sign changes through infinity.
                    const bool grows = fabs(there[e]) > fabs(start[e]) && fabs(there[e]) > fabs(after[e]);
                    is_root = has_changed || (is_finite(after[e]) && !grows);
                }
                if (is_root) {
                    int place = count++;
                    for (; place > 0 && thetas[place - 1] > root; --place) {
                        thetas[place] = thetas[place - 1];
                        for (int k = 0; k < columns; ++k) rows[place * columns + k] = rows[(place - 1) * columns + k];
                    }
                    thetas[place] = root;
                    rows[place * columns] = real(e);
                    Between<K>::row(stepper, root, rows + place * columns + 1);
                }
                before[e] = after[e];
            }
            theta_before = theta;
        }
        for (int e = 0; e < K::events; ++e) stepper.event_values[e] = before[e];
        return count;
    }
};

}  // namespace lobatto

#endif
