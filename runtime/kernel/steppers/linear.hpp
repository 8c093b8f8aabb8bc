// SPDX-License-Identifier: MIT
// Linear maps: the step of a linear system as one affine map.
//
// Formula numbers (D..) refer to docs/derivation.md.
#ifndef LOBATTO_KERNEL_LINEAR_HPP
#define LOBATTO_KERNEL_LINEAR_HPP

#include <type_traits>

#include "../base/contract.hpp"
#include "../base/numbers.hpp"
#include "../base/pack.hpp"
#include "../iteration/lane_state.hpp"
#include "../iteration/tangent.hpp"

namespace lobatto {

// Moves the entries of E = Phi - I (2 x 2, rows of three: q, p, shift) by at most two units in the last place each, so
// that det Phi = 1 + tr E + det E is 1 to far below the rounding of the entries (D20). A determinant of 1 + e
// multiplies the conserved energy by 1 + e in every step.
template <class real>
inline void round_to_unit_determinant(real* E) {
    const int places[4] = {0, 1, 3, 4};
    real candidates[4][5], best[4] = {E[0], E[1], E[3], E[4]}, least = Limits<real>::largest;
    for (int e = 0; e < 4; ++e) {
        const real entry = best[e];
        // A unit in the last place, or half of one just above a power of two.
        real unit = fabs(entry) * Limits<real>::epsilon * real(0.5);
        while (unit > real(0) && entry + unit == entry) unit += unit;
        for (int j = 0; j < 5; ++j) candidates[e][j] = entry + real(j % 2 == 0 ? j / 2 : -(j + 1) / 2) * unit;
    }
    for (const real a : candidates[0])
        for (const real b : candidates[1])
            for (const real c : candidates[2])
                for (const real d : candidates[3]) {
                    const real ad = a * d, bc = b * c;
                    // tr E + det E, the terms and their rounding, summed without loss.
                    const real terms[6] = {a, d, ad, -bc, rounded_once(a, d, -ad), -rounded_once(b, c, -bc)};
                    real sum = real(0), lost = real(0), error;
                    for (const real term : terms) {
                        sum = add_with_error(sum, term, error);
                        lost += error;
                    }
                    const real defect = fabs(sum + lost);
                    if (defect < least) {
                        least = defect;
                        best[0] = a;
                        best[1] = b;
                        best[2] = c;
                        best[3] = d;
                    }
                }
    for (int e = 0; e < 4; ++e) E[places[e]] = best[e];
}

// The affine map of one step of a linear system, in (q, p), from the constant S = M^-1 V'' and W(0) (D20, n > 1).
template <class K>
inline Status linear_map(typename K::Coefficients& k, typename K::real h) {
    using real = typename K::real;
    constexpr int n = K::coordinates, s = K::points;
    const real origin[n] = {};
    real W0[n], entries[K::entries > 0 ? K::entries : 1];
    K::node(k, origin, W0, entries);
    if constexpr (K::is_explicit) {
        for (int i = 0; i < 2 * n * (2 * n + 1); ++i) k.Phi_minus_I[i] = real(0);
        for (int i = 0; i < s; ++i) {
            kick_increment<K>(-h * K::b[i], entries, W0, k.Phi_minus_I);
            if (i < s - 1) drift_increment<K>(h * K::drift_length[i], k.Phi_minus_I);
        }
    } else {
        real S[s * n * n];
        for (int i = 0; i < s; ++i) expand_entries<K>(entries, S + i * n * n);
        if (!increment_of_step<K>(h, S, W0, k.Phi_minus_I)) return Status::singular_jacobian;
    }
    to_momentum<K>(k, k.Phi_minus_I);
    return is_finite(not_finite_part(k.Phi_minus_I, 2 * n * (2 * n + 1))) ? Status::ok : Status::not_finite;
}

// (q1, p1) = (q, p) + E (q, p) + shift, E = Phi - I; E: 2n x (2n + 1), the shift its last column.
template <int n, class given, class number>
LOBATTO_DEVICE inline void apply_map(const given* E, const number* q, const number* p, number* q1, number* p1) {
    for (int r = 0; r < 2 * n; ++r) {
        const given* const row = E + r * (2 * n + 1);
        number sum = row[2 * n];
        for (int k = 0; k < n; ++k) sum += row[k] * q[k];
        for (int k = 0; k < n; ++k) sum += row[n + k] * p[k];
        (r < n ? q1[r] : p1[r - n]) = (r < n ? q[r] : p[r - n]) + sum;
    }
}

// (D21) H_d(z) = 1/2 ((p - w_p).q1 - (q - w_q).p1) for z = (q, p), the step z1 = z + E z + w and the shift w: conserved
// exactly where Phi = 1 + E is symplectic, whether or not the map has a fixed point. In increments d = E z + w, so that
// p.q and q.p do not have to cancel.
template <int n, class given, class number>
LOBATTO_DEVICE inline number discrete_energy(const given* E, const number* q, const number* p) {
    number value = number(0);
    for (int k = 0; k < n; ++k) {
        const given *const row_q = E + k * (2 * n + 1), *const row_p = E + (n + k) * (2 * n + 1);
        const given w_q = row_q[2 * n], w_p = row_p[2 * n];
        number d_q = number(w_q), d_p = number(w_p);
        for (int j = 0; j < n; ++j) d_q += row_q[j] * q[j] + row_q[n + j] * p[j];
        for (int j = 0; j < n; ++j) d_p += row_p[j] * q[j] + row_p[n + j] * p[j];
        value += (p[k] * d_q - q[k] * d_p) + (w_q * (p[k] + d_p) - w_p * (q[k] + d_q));
    }
    return value * number(0.5);
}

// The stepper of an affine map: the whole step is K::propagate.
template <class K>
struct Stepper<K, Form::linear_map, Stepping::solved> : ConstantMass<K> {
    using typename ConstantMass<K>::real;
    using ConstantMass<K>::n, ConstantMass<K>::coefficients, ConstantMass<K>::q, ConstantMass<K>::momentum;
    static constexpr int N = 0;
    static constexpr int nodes = K::points;
    // Of a few coordinates and more, the rows of Phi - I lie in lanes, column after column.
    static constexpr int width = native_lanes<real>, rows = (2 * n + width - 1) / width * width;
    static constexpr bool in_lanes = n >= 4 && width > 1;
    real p[n]{};  // momentum
    std::conditional_t<in_lanes, real[(2 * n + 1) * rows], Nothing> columns{};

    Status prepare(const typename K::Parameters& parameters, real h) {
        this->step_size = h;
        const Status status = K::prepare(parameters, h, coefficients);
        if constexpr (in_lanes)
            for (int r = 0; r < 2 * n; ++r)
                for (int c = 0; c <= 2 * n; ++c) columns[c * rows + r] = coefficients.Phi_minus_I[r * (2 * n + 1) + c];
        return status;
    }

    Status start(real time, const real* position, const real* momentum) {
        this->start_time = time;
        this->steps = 0;
        for (int k = 0; k < n; ++k) {
            q[k] = position[k];
            p[k] = momentum[k];
        }
        return is_finite(time + not_finite_part(q, n) + not_finite_part(p, n)) ? Status::ok : Status::not_finite;
    }

    Status step() {
        if (this->time_stands_still()) return Status::time_stands_still;
        real q1[n], p1[n];
        if constexpr (in_lanes)
            propagate(columns, q1, p1);
        else
            K::propagate(coefficients, q, p, q1, p1);
        if (!is_finite(not_finite_part(q1, n) + not_finite_part(p1, n))) return Status::not_finite;
        for (int k = 0; k < n; ++k) {
            q[k] = q1[k];
            p[k] = p1[k];
        }
        ++this->steps;
        return Status::ok;
    }

    void momentum(real* momentum) const {
        for (int k = 0; k < n; ++k) momentum[k] = p[k];
    }

    Status residual(real, const real*, const real*, const real*, real*) const { return Status::unsupported; }
    Status jacobian(real, const real*, const real*, const real*, real*) const { return Status::unsupported; }

    // (D20), rows side by side.
    template <class Columns>
    void propagate(const Columns& column, real* q1, real* p1) const {
        using V = Pack<real, width>;
        V sum[rows / width];
        real moved[rows];
        for (int r = 0; r < rows / width; ++r) sum[r] = V::load(column + 2 * n * rows + r * width);
        const auto add = [&](int c, real x) LOBATTO_FORMULA {
#pragma GCC unroll 8
            for (int r = 0; r < rows / width; ++r) sum[r] = fused(V::load(column + c * rows + r * width), V(x), sum[r]);
        };
        for (int c = 0; c < n; ++c) add(c, q[c]);
        for (int c = 0; c < n; ++c) add(n + c, p[c]);
        for (int r = 0; r < rows / width; ++r) sum[r].store(moved + r * width);
        for (int k = 0; k < n; ++k) {
            q1[k] = q[k] + moved[k];
            p1[k] = p[k] + moved[n + k];
        }
    }

    Status tangent(real time, const real* position, const real* momentum, real* q1, real* p1, real* T) const {
        if constexpr (K::has_tangent) {
            Stepper local = *this;
            add_identity<K>(coefficients.Phi_minus_I, T);
            return this->step_from(local, time, position, momentum, q1, p1);
        } else {
            return Status::unsupported;
        }
    }
};

template <class K, class T>
struct LaneStepper<K, T, Form::linear_map, Stepping::solved> : LaneState<K, T, false> {
    using State = LaneState<K, T, false>;
    using State::n, State::q, State::rate;
    using typename State::real, typename State::ActiveMask;
    struct Shared {};  // the map is of a trajectory's parameters

    Shared shared() const { return {}; }
    template <bool>
    LOBATTO_INLINE void take(const Shared&) {}

    void prepare(const ScalarFallback<K>&, int) {}
    void set_tolerance(real) {}
    void start(const ScalarFallback<K>& single, int lane) { this->follow_state(single, lane); }
    void refill(const ScalarFallback<K>& single, int lane) { this->follow_state(single, lane); }
    void follow(const ScalarFallback<K>& single, int lane) { this->follow_state(single, lane); }
    template <class Given, class Time>
    LOBATTO_LANE ActiveMask step(const Given& k, const Time&, ActiveMask active) {
        T q1[n], p1[n];
        K::propagate(k, q[0], rate[0], q1, p1);
        active = active & (not_finite_part(q1, n) + not_finite_part(p1, n) == T(real(0)));
        for (int c = 0; c < n; ++c) {
            q[0][c] = select(active, q1[c], q[0][c]);
            rate[0][c] = select(active, p1[c], rate[0][c]);
        }
        return active;
    }
};

}  // namespace lobatto

#endif
