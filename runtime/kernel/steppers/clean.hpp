// SPDX-License-Identifier: MIT
// Round-off-clean steps of systems with constant mass: what remains of rounding is random, and small.
//
// Three things make errors of rounding grow like a random walk (Brouwer's law: energy like sqrt(N), phase like N^(3/2))
// and not in proportion to the number N of steps; formula numbers (D..) of docs/derivation.md:
//   Coefficients are exactly symplectic as they stand in the machine (D38). On the grid of multiples of 2^(e - digits),
//     |h| < 2^e, gamma_i ~ h c_i; beta_i = h - gamma_i; eta_ij ~ h A_ij / b_j for i <= j, and below the diagonal
//     eta_ij = eta_ji + gamma_i - gamma_j, all without rounding. With impulses f_j = -h b_j W(Q_j), however rounded,
//         Q_i = q + gamma_i (u + f_1) + sum_j eta_ij f_j,   q1 = q + h (u + f_1) + sum_j beta_j f_j,   u1 = u + sum f
//     is symplectic, since eta_ij - eta_ji = gamma_i - gamma_j. (In the nodes f and positions are rounded once.)
//   Fixed-point iterations end when they give the same bits again, when last bits alternate, or after eight that change
//     only last bits. Newton's iteration takes the steps in which iterations do not get there.
//   Position and velocity are sums of two numbers each, and the increments of a step are added without error: products
//     with b_j too, whose rounding is not random where b_j is a simple fraction.
// The scheme is that of Antonana, Makazaga and Murua (Numer. Algorithms 76, 2017) for Gauss' methods, in the form that
// methods for second-order equations take here; error-free sums and products are Knuth's and Dekker's.
#ifndef LOBATTO_KERNEL_CLEAN_HPP
#define LOBATTO_KERNEL_CLEAN_HPP

#include <limits>
#include <type_traits>

#include "../base/contract.hpp"
#include "../base/numbers.hpp"
#include "../base/pack.hpp"
#include "../iteration/convergence.hpp"
#include "../iteration/stage_coefficients.hpp"
#include "../iteration/stage_map.hpp"
#include "separable.hpp"

namespace lobatto {

template <class real>
constexpr bool has_64_bits = std::is_same_v<real, long double>&& std::numeric_limits<real>::digits == 64;

// x = high + low, of half its 64 digits each (Veltkamp).
inline void split(long double x, long double& high, long double& low) {
    const long double shifted = 4294967297.0L * x;  // 2^32 + 1
    high = shifted - (shifted - x);
    low = x - high;
}

// a b = product + error, as long as the error is a normal number.
template <class V>
LOBATTO_INLINE V multiply_with_error(const V& a, const V& b, V& error) {
    using real = real_of<V>;
    const V product = a * b;
    if constexpr (has_fused && sizeof(real) <= 8) {
        error = fused(a, b, -product);
    } else if constexpr (has_64_bits<real>) {  // Dekker's product: the library's fma is slow
        for (int i = 0; i < lanes_of<V>; ++i) {
            real a_high, a_low, b_high, b_low;
            split(lane_of(a, i), a_high, a_low);
            split(lane_of(b, i), b_high, b_low);
            set_lane(error, i,
                     ((a_high * b_high - lane_of(product, i)) + a_high * b_low + a_low * b_high) + a_low * b_low);
        }
    } else {
        for (int i = 0; i < lanes_of<V>; ++i)
            set_lane(error, i, rounded_once(lane_of(a, i), lane_of(b, i), -lane_of(product, i)));
    }
    return product;
}

// A number as the sum of two, the second below the rounding of the first; `add` errs by what the second rounds.
template <class V>
struct TwoFold {
    V value, rest;

    LOBATTO_INLINE void add(const V& x) {
        V error;
        value = add_with_error(value, x, error);
        rest = rest + error;
    }
    LOBATTO_INLINE void add_product(const V& a, const V& b) {
        V error;
        const V product = multiply_with_error(a, b, error);
        add(product);
        rest = rest + error;
    }
    LOBATTO_INLINE TwoFold sum_with(const TwoFold& increment) const {
        V error;
        const V all = add_with_error(value, increment.value, error);
        const V small = error + (increment.rest + rest);
        TwoFold result;
        result.value = all + small;
        result.rest = small - (result.value - all);
        return result;
    }
};

// What an iteration has done to the positions.
template <class real>
struct Change {
    bool none, back;  // the same bits as before; those of before the last change
    real size;        // the largest change, relative to the motion of its coordinate or a thousandth of the largest
    real own;         // relative to the motion of its coordinate alone
};

// A multiple of `unit`, a power of 2, next to x; |x| < unit / epsilon * 2.
template <class real>
real on_grid(real x, real unit) {
    const real half_way = real(1) / Limits<real>::epsilon, units = fabs(x) / unit;  // from there on numbers are whole
    const real rounded = (units < half_way ? (units + half_way) - half_way : units) * unit;
    return x < real(0) ? -rounded : rounded;
}

template <class K>
struct CleanFixedPoint {
    using real = typename K::real;
    static constexpr int n = K::coordinates, s = K::points, m = s - 2, inner_room = m > 0 ? m : 1;
    using Layout = NodeLayout<real, real, m>;
    using V = typename Layout::V;
    static constexpr int width = Layout::width, evaluation_limit = 30, correction_limit = 12, patience = 8;
    static constexpr Convergence<real, 1, NoisyPace> rule{Limits<real>::epsilon};  // noise may stay as it is
    static constexpr int parts = m > 0 ? Layout::parts_of(m) : 1;

    struct Arrays {
        V first[parts * n], X[parts * n], older[parts * n], W[parts * n];
        real flat[parts * width], inverse_scale[n], inverse_own[n], next[s * n];
        real q1[n], q1_rest[n], u1[n], u1_rest[n];
    };

    V eta[inner_room][parts];  // a column for each inner node
    V gamma[parts];            // h c
    V weight[parts];           // -h b; zero in lanes to spare
    V before[s][parts];        // -h^2 A E: from the accelerations of the step before (D15)
    V simple[parts];           // -h^2 A, row sums
    V node_time[parts];
    real impulse[s];  // -h b
    real beta[s];     // h, then h - gamma
    real h{};
    int evaluations{};  // of the last step
    real increment{};   // the last one of the last step, relative

    Status prepare(real step) {
        h = step;
        real power = real(1);
        while (power <= fabs(h) && is_finite(power)) power *= real(2);
        while (power > real(2) * fabs(h) && power > real(0)) power /= real(2);
        const real unit = power * (Limits<real>::epsilon / real(2));
        if (!(unit > real(0)) || !is_finite(power)) return Status::not_finite;
        real g[inner_room], e[inner_room * inner_room];
        for (int i = 0; i < m; ++i) g[i] = on_grid(h * K::c[i + 1], unit);
        for (int i = 0; i < m; ++i)
            for (int j = i; j < m; ++j) e[i * m + j] = on_grid(h * (K::A[i * m + j] / K::b[j + 1]), unit);
        for (int i = 0; i < m; ++i)
            for (int j = 0; j < i; ++j) e[i * m + j] = e[j * m + i] + (g[i] - g[j]);
        for (int j = 0; j < s; ++j) impulse[j] = -h * K::b[j];
        beta[0] = h;
        for (int j = 0; j < m; ++j) beta[j + 1] = h - g[j];
        beta[s - 1] = real(0);
        for (int i = 0; i < parts * width && m > 0; ++i) {
            const int row = i < m ? i : m - 1;
            const auto put = [i](V* values, real x) { set_lane(values[i / width], i % width, x); };
            put(gamma, g[row]);
            put(node_time, h * K::c[row + 1]);
            put(weight, i < m ? impulse[i + 1] : real(0));
            for (int j = 0; j < m; ++j) put(eta[j], e[row * m + j]);
            // Where iterations begin need not be on the grid.
            put(simple, -h * h * stage_coefficients<K>.sum[row]);
            for (int l = 0; l < s; ++l) put(before[l], -h * h * stage_coefficients<K>.before[row][l]);
        }
        return Status::ok;
    }

    // What the positions of a step are made of before any iteration, and the measures of changes. W: the accelerations
    // of the step before. For a coordinate that hardly moves, the rounding of its neighbours is large beside its own
    // motion.
    void set_out(const real* q, const real* u, const real* u_rest, const real* W, Arrays& a) const {
        if constexpr (m == 0) return;
        real largest_scale = real(0);
        for (int c = 0; c < n; ++c) {
            real rest;
            const real rate = add_with_error(u[c], impulse[0] * W[(s - 1) * n + c], rest);
            rest += u_rest[c];
            for (int p = 0; p < parts; ++p) a.first[p * n + c] = fused(gamma[p], V(rate), gamma[p] * V(rest));
            const real scale = maximum(fabs(q[c]) + fabs(h * rate), Limits<real>::smallest);
            a.inverse_own[c] = real(1) / scale;
            largest_scale = maximum(largest_scale, scale);
        }
        const real most = real(1024) / largest_scale;
        for (int c = 0; c < n; ++c) a.inverse_scale[c] = minimum(a.inverse_own[c], most);
    }

    // The accelerations a.W at the inner nodes of a step, by iterations. W: those of the step before, node-major. False
    // where iterations do not contract.
    template <class Given>
    bool solve(const Given& k, real time, const real* q, const real* q_rest, const real* W, bool has_history,
               Arrays& a) {
        evaluations = 0;
        increment = real(0);
        if constexpr (m == 0) return true;
        for (int c = 0; c < n; ++c)
            for (int p = 0; p < parts; ++p) {
                V Z = a.first[p * n + c];
                if (has_history)
                    for (int l = 0; l < s; ++l) Z = fused(before[l][p], V(W[l * n + c]), Z);
                else
                    Z = fused(simple[p], V(W[(s - 1) * n + c]), Z);
                a.older[p * n + c] = a.X[p * n + c] = V(q[c]) + Z;
            }
        real last = Limits<real>::largest;
        int noisy = 0;  // iterations that changed no more than rounding may
        while (evaluations < evaluation_limit) {
            for (int p = 0; p < parts; ++p)
                Formulas<K>::minus_acceleration(k, V(time) + node_time[p], a.X + p * n, a.W + p * n);
            ++evaluations;
            const Change<real> change = iterate(q, q_rest, a);
            increment = change.size;
            if (change.none || (change.back && rule.is_noise(change.own))) return true;
            noisy += rule.is_noise(change.own) ? 1 : 0;
            if (noisy > patience) return true;  // in a longer cycle
            if (evaluations > rule.judged_after && !rule.contracts(change.size, last)) return false;
            last = change.size;
        }
        return false;
    }

    // The positions that a.W gives, in place of X.
    Change<real> iterate(const real* q, const real* q_rest, Arrays& a) const {
        V worst = V(real(0)), worst_own = V(real(0));
        bool none = true, back = true;
        for (int c = 0; c < n; ++c) {
            for (int p = 0; p < parts; ++p) {
                const V f = weight[p] * a.W[p * n + c];
                lay_flat<1>(&f, 1, a.flat + p * width);
            }
            for (int p = 0; p < parts; ++p) {
                V even = a.first[p * n + c], odd = V(q_rest[c]);
#pragma GCC unroll 16
                for (int j = 0; j < m; ++j) {
                    V& sum = j % 2 == 0 ? even : odd;
                    sum = fused(eta[j][p], V(a.flat[j]), sum);
                }
                const V X = V(q[c]) + (even + odd), old = a.X[p * n + c];
                none = none && all(X == old);
                back = back && all(X == a.older[p * n + c]);
                const V moved = fabs(X - old);
                worst = maximum(worst, moved * V(a.inverse_scale[c]));
                worst_own = maximum(worst_own, moved * V(a.inverse_own[c]));
                a.older[p * n + c] = old;
                a.X[p * n + c] = X;
            }
        }
        return {none, back, largest(worst), largest(worst_own)};
    }

    // `use` is given a Pack of the type to use and the first coordinate of its lanes.
    template <class Use>
    LOBATTO_INLINE static void over_coordinates(const Use& use) {
        constexpr int lanes = native_lanes<real>;
        int c = 0;
        for (; c + lanes <= n; c += lanes) use(Pack<real, lanes>(), c);
        for (; c < n; ++c) use(Pack<real, 1>(), c);
    }

    // The end of the step from the accelerations a.W at its inner nodes: q, u, their rests and W, of all nodes, move
    // on. False, and nothing has moved, where a number is not finite.
    template <class Given>
    bool finish(const Given& k, real end_time, real* q, real* q_rest, real* u, real* u_rest, real* W, Arrays& a) const {
        real* const next = a.next;
        for (int c = 0; c < n; ++c) {
            for (int p = 0; m > 0 && p < parts; ++p) lay_flat<1>(&a.W[p * n + c], 1, a.flat + p * width);
            next[c] = W[(s - 1) * n + c];
            for (int j = 0; j < m; ++j) next[(j + 1) * n + c] = a.flat[j];
        }
        over_coordinates([&](auto lanes, int c) LOBATTO_FORMULA {
            using L = decltype(lanes);
            TwoFold<L> moved{L(real(0)), L(h) * L::load(u_rest + c)};
            moved.add_product(L(h), L::load(u + c));
            for (int j = 0; j <= m; ++j) {
                L error;
                const L f = multiply_with_error(L(impulse[j]), L::load(next + j * n + c), error);
                moved.add_product(L(beta[j]), f);
                moved.rest = fused(L(beta[j]), error, moved.rest);
            }
            moved = TwoFold<L>{L::load(q + c), L::load(q_rest + c)}.sum_with(moved);
            moved.value.store(a.q1 + c);
            moved.rest.store(a.q1_rest + c);
        });
        Formulas<K>::minus_acceleration(k, end_time, a.q1, next + (s - 1) * n);
        over_coordinates([&](auto lanes, int c) LOBATTO_FORMULA {
            using L = decltype(lanes);
            TwoFold<L> change{L(real(0)), L(real(0))};
            for (int j = 0; j < s; ++j) change.add_product(L(impulse[j]), L::load(next + j * n + c));
            change = TwoFold<L>{L::load(u + c), L::load(u_rest + c)}.sum_with(change);
            change.value.store(a.u1 + c);
            change.rest.store(a.u1_rest + c);
        });
        if (!is_finite(not_finite_part(a.q1, n) + not_finite_part(a.u1, n) + not_finite_part(next + (s - 1) * n, n)))
            return false;
        for (int c = 0; c < n; ++c) {
            q[c] = a.q1[c];
            q_rest[c] = a.q1_rest[c];
            u[c] = a.u1[c];
            u_rest[c] = a.u1_rest[c];
        }
        for (int i = 0; i < s * n; ++i) W[i] = next[i];
        return true;
    }
};

// The stepper of steppers/separable.hpp with clean steps in place of its own.
template <class K>
struct Stepper<K, Form::separable, Stepping::clean> : Stepper<K, Form::separable, Stepping::solved> {
    using Plain = Stepper<K, Form::separable, Stepping::solved>;
    using real = typename K::real;
    using Plain::n, Plain::m, Plain::s, Plain::q, Plain::u, Plain::W, Plain::coefficients, Plain::q_before,
        Plain::u_before, Plain::has_history, Plain::iterations, Plain::increment;
    using FixedPoint = CleanFixedPoint<K>;

    real q_rest[n]{}, u_rest[n]{};  // position and velocity are q + q_rest, u + u_rest
    FixedPoint fixed_point;
    Pause pause;
    Workspace<typename FixedPoint::Arrays> clean_workspace;

    Status prepare(const typename K::Parameters& parameters, real h) {
        const Status status = Plain::prepare(parameters, h);
        return status == Status::ok ? fixed_point.prepare(h) : status;
    }

    Status start(real time, const real* position, const real* momentum) {
        for (int c = 0; c < n; ++c) q_rest[c] = u_rest[c] = real(0);
        pause = Pause();
        return Plain::start(time, position, momentum);
    }

    Status step() {
        if (this->time_stands_still()) return Status::time_stands_still;
        return clean_workspace.with([this](typename FixedPoint::Arrays& a) { return step_in(a); });
    }

private:
    Status step_in(typename FixedPoint::Arrays& a) {
        const real time = this->time();
        real q_old[n], u_old[n];
        for (int c = 0; c < n; ++c) {
            q_old[c] = q[c];
            u_old[c] = u[c];
        }
        fixed_point.set_out(q, u, u_rest, W, a);
        const auto finish = [&] {
            return fixed_point.finish(coefficients, this->next_time(), q, q_rest, u, u_rest, W, a);
        };
        if (pause.count_down() && fixed_point.solve(coefficients, time, q, q_rest, W, has_history, a) && finish()) {
            pause.succeed();
            iterations = static_cast<std::int32_t>(fixed_point.evaluations);
        } else {
            if (pause.left == 0) pause.fail();
            const Status status =
                this->workspace.with([&](typename Plain::Arrays& plain) { return correct(plain, a); });
            if (status != Status::ok) return status;
            if (!finish()) return Status::not_finite;
        }
        for (int c = 0; c < n; ++c) {
            q_before[c] = q_old[c];
            u_before[c] = u_old[c];
        }
        increment = fixed_point.increment;
        has_history = true;
        ++this->steps;
        return Status::ok;
    }

    // Where iterations do not contract: Newton's iteration for the plain equations, then with its last Jacobian
    // corrections of the clean ones, X -= J^-1 (X - iteration(X)), while they change anything and do not grow.
    Status correct(typename Plain::Arrays& plain, typename FixedPoint::Arrays& a) {
        const Status status = this->solve_from_start(plain);
        if constexpr (m > 0) {
            if (status != Status::ok) return status;
            constexpr int width = FixedPoint::width;
            real last = Limits<real>::largest;
            for (int correction = 0; correction < FixedPoint::correction_limit; ++correction) {
                for (int i = 0; i < m; ++i)
                    Formulas<K>::minus_acceleration(coefficients, this->node_time(i), plain.Q + i * n, plain.W + i * n);
                for (int lane = 0; lane < FixedPoint::parts * width; ++lane)
                    for (int c = 0; c < n; ++c) {
                        const int place = (lane / width) * n + c, i = lane < m ? lane : m - 1;
                        set_lane(a.W[place], lane % width, plain.W[i * n + c]);
                        set_lane(a.X[place], lane % width, plain.Q[i * n + c]);
                        set_lane(a.older[place], lane % width, plain.Q[i * n + c]);
                    }
                ++iterations;
                fixed_point.iterate(q, q_rest, a);
                for (int i = 0; i < m; ++i)
                    for (int c = 0; c < n; ++c)
                        plain.delta[i * n + c] = lane_of(a.X[(i / width) * n + c], i % width) - plain.Q[i * n + c];
                StageEquations<K>::solve_for(plain.matrix, plain.delta, plain.sorted);
                bool changes = false;
                real worst = real(0);
                for (int i = 0; i < m; ++i)
                    for (int c = 0; c < n; ++c) {
                        const real delta = plain.delta[i * n + c], node = plain.Q[i * n + c];
                        if (!is_finite(delta)) return Status::not_finite;
                        changes = changes || node + delta != node;
                        worst = maximum(worst, fabs(delta) * a.inverse_scale[c]);
                    }
                fixed_point.increment = worst;
                if (!changes || (correction > 1 && !(worst < last))) break;
                last = worst;
                for (int i = 0; i < m * n; ++i) plain.Q[i] += plain.delta[i];
            }
        }
        return status;
    }
};

}  // namespace lobatto

#endif
