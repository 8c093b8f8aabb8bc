// SPDX-License-Identifier: GPL-2.0-or-later
// Taylor's method: the series of the solution by recurrences between coefficients (automatic differentiation), its
// order and its steps from a tolerance as A. Jorba and M. Zou choose them (Experimental Mathematics 14, 2005, 99-117);
// as in heyoka, for one trajectory and for eight side by side, each with a step of its own.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <type_traits>

#include "bench/peers/nystrom.hpp"

namespace lobatto::bench {

// Eight numbers: those of eight trajectories, or eight of one chain.
typedef double Eight __attribute__((vector_size(8 * sizeof(double))));
typedef std::int64_t EightIntegers __attribute__((vector_size(8 * sizeof(double))));

// Four numbers: those of the pairs of three bodies, and one to spare.
typedef double Four __attribute__((vector_size(4 * sizeof(double))));

inline constexpr int most_orders = 20;  // what a tolerance of 1e-16 asks for

// Coefficients of 1, t, t^2, ... of one variable.
template <class real>
using Series = std::array<real, most_orders + 1>;

// The library's vector functions, where the compiler finds them behind a loop.
#if defined(__GNUC__) && !defined(__clang__)
extern "C" __attribute__((simd("notinbranch"), const)) double sin(double) noexcept;
extern "C" __attribute__((simd("notinbranch"), const)) double cos(double) noexcept;
#endif
template <>
inline Eight sine(Eight x) {
    Eight result;
    for (int i = 0; i < 8; ++i) result[i] = sin(x[i]);
    return result;
}
template <>
inline Eight cosine(Eight x) {
    Eight result;
    for (int i = 0; i < 8; ++i) result[i] = cos(x[i]);
    return result;
}
template <>
inline Eight square_root(Eight x) {
    Eight result;
    for (int i = 0; i < 8; ++i) result[i] = std::sqrt(x[i]);
    return result;
}
template <>
inline Four square_root(Four x) {
    return Four{std::sqrt(x[0]), std::sqrt(x[1]), std::sqrt(x[2]), std::sqrt(x[3])};
}

// The race has this method from both compilers: of functions of one name the linker would keep one.
#ifdef __clang__
inline namespace by_clang {
#else
inline namespace by_gnu {
#endif

// term(0) + ... + term(count - 1), the index known when it is compiled, in four sums that do not wait for each other.
template <int count, class Term>
WRITTEN_OUT inline auto sum_of(const Term& term) {
    using real = decltype(term(std::integral_constant<int, 0>()));
    real sums[4] = {};
    unrolled<count>([&](auto i) WRITTEN_OUT { sums[i % 4] += term(i); });
    return real((sums[0] + sums[1]) + (sums[2] + sums[3]));
}

// Coefficient k of a product, of a square, and of the product without a_0 b_k; the newest coefficients come last, so
// that the others need not wait for them.
template <int k, class real>
WRITTEN_OUT inline real product(const Series<real>& a, const Series<real>& b) {
    if constexpr (k == 0)
        return a[0] * b[0];
    else if constexpr (k == 1)
        return a[0] * b[1] + a[1] * b[0];
    else
        return sum_of<k - 1>([&](auto j) WRITTEN_OUT { return a[j + 1] * b[k - 1 - j]; }) + (a[0] * b[k] + a[k] * b[0]);
}
template <int k, class real>
WRITTEN_OUT inline real square(const Series<real>& a) {
    if constexpr (k == 0) return a[0] * a[0];
    real sum = a[0] * a[k];
    if constexpr (k > 2) sum += sum_of<(k - 1) / 2>([&](auto j) WRITTEN_OUT { return a[j + 1] * a[k - 1 - j]; });
    sum += sum;
    if constexpr (k % 2 == 0) sum += a[k / 2] * a[k / 2];
    return sum;
}
template <int k, class real>
WRITTEN_OUT inline real later_product(const Series<real>& a, const Series<real>& b) {
    if constexpr (k == 0)
        return real{};
    else if constexpr (k == 1)
        return a[1] * b[0];
    else
        return sum_of<k - 1>([&](auto j) WRITTEN_OUT { return a[j + 1] * b[k - 1 - j]; }) + a[k] * b[0];
}

// The type of constants beside a number: Eight and Four take double for each of their parts.
template <class real>
struct ConstantOf {
    using type = real;
};
template <>
struct ConstantOf<Eight> {
    using type = double;
};
template <>
struct ConstantOf<Four> {
    using type = double;
};
template <class real>
using Constant = typename ConstantOf<real>::type;

template <class real, int k>
inline constexpr Constant<real> inverse = Constant<real>(1) / k;

// Coefficient k of sin x and cos x, from those below k and those of x': k s_k = sum of x'_j c_(k-1-j), and likewise.
template <int k, class real>
WRITTEN_OUT inline void sine_and_cosine(const Series<real>& slope, Series<real>& s, Series<real>& c) {
    s[k] = inverse<real, k> * product<k - 1>(slope, c);
    c[k] = -inverse<real, k> * product<k - 1>(slope, s);
}

// Calls action(k) for k = 0 ... order - 1, k known when it is compiled.
template <class Action>
WRITTEN_OUT inline void for_orders(int order, const Action& action) {
    unrolled<most_orders>([&](auto k) WRITTEN_OUT {
        if (k < order) action(k);
    });
}

// The series of a state. y: q, then p; before expand() only its values y[i][0] are known, after it `order` coefficients
// more. real: the number of one trajectory, or those of eight.
template <class Problem, class real>
struct Expansion;

template <class real>
struct Expansion<Pendulum, real> {
    Series<real> y[2], s, c;
    void expand(int order) {
        auto &q = y[0], &p = y[1];
        s[0] = sine(q[0]);
        c[0] = cosine(q[0]);
        for_orders(order, [&](auto k) WRITTEN_OUT {
            if constexpr (k > 0) sine_and_cosine<k>(p, s, c);
            q[k + 1] = inverse<real, k + 1> * p[k];
            p[k + 1] = -inverse<real, k + 1> * s[k];
        });
    }
};

template <class real>
struct Expansion<HenonHeiles, real> {
    Series<real> y[4];
    void expand(int order) {
        auto &x1 = y[0], &x2 = y[1], &p1 = y[2], &p2 = y[3];
        for_orders(order, [&](auto k) WRITTEN_OUT {
            constexpr auto factor = inverse<real, k + 1>;
            x1[k + 1] = factor * p1[k];
            x2[k + 1] = factor * p2[k];
            p1[k + 1] = -factor * (x1[k] + 2 * product<k>(x1, x2));
            p2[k + 1] = factor * ((square<k>(x2) - square<k>(x1)) - x2[k]);
        });
    }
};

template <class real>
struct Expansion<DoublePendulum, real> {
    Series<real> y[4], slope_a, slope_b, slope_d, sine_a, cosine_a, sine_b, cosine_b, s, c, determinant, coupling;
    void expand(int order) {
        auto &a = y[0], &b = y[1], &pa = y[2], &pb = y[3];
        constexpr Constant<real> g = DoublePendulum::g;
        sine_a[0] = sine(a[0]);
        cosine_a[0] = cosine(a[0]);
        sine_b[0] = sine(b[0]);
        cosine_b[0] = cosine(b[0]);
        // Of the difference of the angles.
        s[0] = sine_a[0] * cosine_b[0] - cosine_a[0] * sine_b[0];
        c[0] = cosine_a[0] * cosine_b[0] + sine_a[0] * sine_b[0];
        const real over = 1 / (1 + s[0] * s[0]);
        for_orders(order, [&](auto k) WRITTEN_OUT {
            if constexpr (k > 0) {
                sine_and_cosine<k>(slope_a, sine_a, cosine_a);
                sine_and_cosine<k>(slope_b, sine_b, cosine_b);
                sine_and_cosine<k>(slope_d, s, c);
                determinant[k] = square<k>(s);
            }
            // (1 + s^2) a' = pa - c pb, (1 + s^2) b' = 2 pb - c pa.
            slope_a[k] = over * ((pa[k] - product<k>(c, pb)) - later_product<k>(determinant, slope_a));
            slope_b[k] = over * ((2 * pb[k] - product<k>(c, pa)) - later_product<k>(determinant, slope_b));
            slope_d[k] = slope_a[k] - slope_b[k];
            coupling[k] = product<k>(slope_a, slope_b);
            const real pull = product<k>(coupling, s);
            constexpr auto factor = inverse<real, k + 1>;
            a[k + 1] = factor * slope_a[k];
            b[k + 1] = factor * slope_b[k];
            pa[k + 1] = -factor * (pull + 2 * g * sine_a[k]);
            pb[k + 1] = factor * (pull - g * sine_b[k]);
        });
    }
};

// Coefficient k > 0 of r2 = x^2 + y^2, and of w = r2^(-3/2) by k r2 w' + 3/2 r2' w = 0; over = 1/r2.
template <int k, class real>
WRITTEN_OUT inline void inverse_cube(const Series<real>& x, const Series<real>& y, const real& over, Series<real>& r2,
                                     Series<real>& w) {
    r2[k] = square<k>(x) + square<k>(y);
    const auto term = [&](auto j) WRITTEN_OUT { return -((3 * k - j) * inverse<real, 2 * k>)*r2[k - j] * w[j]; };
    real sum = term(std::integral_constant<int, 0>());
    if constexpr (k > 1)
        sum += sum_of<k - 1>([&](auto j) WRITTEN_OUT { return term(std::integral_constant<int, j + 1>()); });
    w[k] = over * sum;
}

template <class real>
struct Expansion<Kepler, real> {
    Series<real> y[4], r2, w;  // w = |q|^-3
    void expand(int order) {
        auto &x1 = y[0], &x2 = y[1], &p1 = y[2], &p2 = y[3];
        r2[0] = x1[0] * x1[0] + x2[0] * x2[0];
        const real over = 1 / r2[0];
        w[0] = over * over * square_root(r2[0]);
        for_orders(order, [&](auto k) WRITTEN_OUT {
            if constexpr (k > 0) inverse_cube<k>(x1, x2, over, r2, w);
            constexpr auto factor = inverse<real, k + 1>;
            x1[k + 1] = factor * p1[k];
            x2[k + 1] = factor * p2[k];
            p1[k + 1] = -factor * product<k>(w, x1);
            p2[k + 1] = -factor * product<k>(w, x2);
        });
    }
};

// Three bodies. A row is one pair or, of one trajectory in double, all three: lane i is the pair of bodies i and i + 1.
template <const auto& masses, class real>
struct Expansion<ThreeBodies<masses>, real> {
    static constexpr bool side_by_side = std::is_same_v<real, double>;
    using Row = std::conditional_t<side_by_side, Four, real>;
    static constexpr int rows = side_by_side ? 1 : 3;
    Series<real> y[12];  // the bodies' x and y in turn, then their slopes
    Series<Row> dx[rows], dy[rows], r2[rows], w[rows];

    // From body i to the next, coordinate c of both; the lane to spare stands still at a distance of 1.
    template <int k>
    WRITTEN_OUT void subtract(Series<Row>* d, int c) {
        if constexpr (side_by_side)
            d[0][k] = Four{y[2 + c][k], y[4 + c][k], y[c][k], k == 0 && c == 0 ? 1.0 : 0.0} -
                      Four{y[c][k], y[2 + c][k], y[4 + c][k], 0};
        else
            for (int i = 0; i < 3; ++i) d[i][k] = y[2 * ((i + 1) % 3) + c][k] - y[2 * i + c][k];
    }
    template <int k>
    WRITTEN_OUT void pull(const Series<Row>* d, int c) {
        constexpr auto factor = inverse<real, k + 1>;
        real f[3];
        if constexpr (side_by_side) {
            const Four all = product<k>(w[0], d[0]);
            for (int i = 0; i < 3; ++i) f[i] = all[i];
        } else {
            for (int i = 0; i < 3; ++i) f[i] = product<k>(w[i], d[i]);
        }
        using constant = Constant<real>;
        for (int i = 0; i < 3; ++i)
            y[6 + 2 * i + c][k + 1] = (factor * constant(masses[(i + 1) % 3])) * f[i] -
                                      (factor * constant(masses[(i + 2) % 3])) * f[(i + 2) % 3];
    }
    void expand(int order) {
        Row over[rows] = {};
        for_orders(order, [&](auto k) WRITTEN_OUT {
            subtract<k>(dx, 0);
            subtract<k>(dy, 1);
            for (int i = 0; i < rows; ++i) {
                if constexpr (k == 0) {
                    r2[i][0] = dx[i][0] * dx[i][0] + dy[i][0] * dy[i][0];
                    over[i] = 1 / r2[i][0];
                    w[i][0] = over[i] * over[i] * square_root(r2[i][0]);
                } else {
                    inverse_cube<k>(dx[i], dy[i], over[i], r2[i], w[i]);
                }
            }
            for (int c = 0; c < 6; ++c) y[c][k + 1] = inverse<real, k + 1> * y[6 + c][k];
            pull<k>(dx, 0);
            pull<k>(dy, 1);
        });
    }
};

// The chain. A unit is one mass of eight trajectories or, of one trajectory, eight masses in a row; spring u lies
// before unit u.
template <class real>
struct Expansion<Chain, real> {
    static constexpr bool in_rows = sizeof(real) == sizeof(double);
    static constexpr int units = in_rows ? Chain::coordinates / 8 : Chain::coordinates;
    Series<Eight> y[2 * units], d[units + 1], d2[units + 1];  // y as it lies in memory: q, then p

    // What comes before the masses of `here`, and after the springs of `here`.
    static Eight before(Eight previous, Eight here) {
        if constexpr (in_rows) return __builtin_shufflevector(previous, here, 7, 8, 9, 10, 11, 12, 13, 14);
        return previous;
    }
    static Eight after(Eight here, Eight next) {
        if constexpr (in_rows) return __builtin_shufflevector(here, next, 1, 2, 3, 4, 5, 6, 7, 8);
        return next;
    }
    void expand(int order) {
        Series<Eight>*const q = y, *const p = y + units;
        for_orders(order, [&](auto k) WRITTEN_OUT {
            constexpr double factor = 1.0 / (k + 1);
            Eight tension[units + 1];
            for (int u = 0; u <= units; ++u) {
                const Eight wall{}, previous = u > 0 ? q[u - 1][k] : wall, here = u < units ? q[u][k] : wall;
                d[u][k] = here - before(previous, here);
                d2[u][k] = square<k>(d[u]);
                tension[u] = d[u][k] + Chain::beta * product<k>(d2[u], d[u]);
            }
            for (int u = 0; u < units; ++u) {
                q[u][k + 1] = factor * p[u][k];
                p[u][k + 1] = factor * (after(tension[u], tension[u + 1]) - tension[u]);
            }
        });
    }
};

// What the coefficients of an expansion are: of a chain always eight.
template <class Problem, class real>
using Number = std::remove_reference_t<decltype(Expansion<Problem, real>().y[0][0])>;

// One number or all eight.
inline bool any(bool condition) {
    return condition;
}
inline bool any(EightIntegers condition) {
    std::int64_t all = 0;
    for (int i = 0; i < 8; ++i) all |= condition[i];
    return all != 0;
}
inline int count(bool condition) {
    return condition;
}
inline int count(EightIntegers condition) {
    int sum = 0;
    for (int i = 0; i < 8; ++i) sum += condition[i] != 0;
    return sum;
}

// x^(-1/n) to 1 %, from the bits of floating-point numbers; x not negative, 0 for the least number that is not.
inline Eight root_of_inverse(Eight x, int n) {
    const double one = 4503599627370496;  // 2^52
    const Eight logarithm = __builtin_convertvector(std::bit_cast<EightIntegers>(x), Eight) / one - 1023;
    const Eight shifted = 1023 - logarithm / n;
    const Eight floor = __builtin_convertvector(__builtin_convertvector(shifted, EightIntegers), Eight);
    const Eight f = shifted - floor;
    const Eight bits = (floor + f * (0.6565 + 0.3435 * f)) * one;  // 2^f is nearly this
    return std::bit_cast<Eight>(__builtin_convertvector(bits, EightIntegers));
}
inline double root_of_inverse(double x, int n) {
    return root_of_inverse(Eight{} + x, n)[0];
}

// The state by its series at h: even and odd powers apart, what is added to the state rounded once.
template <class Problem, class real, class number>
void advance(Expansion<Problem, real>& x, number h, int order) {
    const number h2 = h * h;
    for (auto& y : x.y) {
        const int even = order - order % 2, odd = order - 1 + order % 2;
        number E = y[even], O = y[odd];
        for (int k = even; (k -= 2) >= 2;) E = E * h2 + y[k];
        for (int k = odd; (k -= 2) >= 1;) O = O * h2 + y[k];
        y[0] += h * O + h2 * E;
    }
}

// Steps of one length.
template <class Problem, class real>
void integrate_taylor_fixed(State<real, Problem::coordinates>& state, real h, long steps, int order) {
    constexpr int n = Problem::coordinates;
    Expansion<Problem, real> x;
    for (int k = 0; k < n; ++k) x.y[k][0] = state.q[k], x.y[n + k][0] = state.p[k];
    for (long i = 0; i < steps; ++i) {
        x.expand(order);
        advance(x, h, order);
    }
    for (int k = 0; k < n; ++k) state.q[k] = x.y[k][0], state.p[k] = x.y[n + k][0];
}

// Element k of (q, p) of a trajectory, in and out.
template <class Problem, class real>
void put(Expansion<Problem, real>& x, int k, [[maybe_unused]] int lane, double value) {
    if constexpr (!std::is_same_v<Number<Problem, real>, Eight>)
        x.y[k][0] = value;
    else if constexpr (std::is_same_v<real, Eight>)
        x.y[k][0][lane] = value;
    else
        x.y[k / 8][0][k % 8] = value;
}
template <class Problem, class real>
double get(const Expansion<Problem, real>& x, int k, [[maybe_unused]] int lane) {
    if constexpr (!std::is_same_v<Number<Problem, real>, Eight>)
        return x.y[k][0];
    else if constexpr (std::is_same_v<real, Eight>)
        return x.y[k][0][lane];
    else
        return x.y[k / 8][0][k % 8];
}

// To the time `until`: one trajectory with real = double, eight with real = Eight. Steps of all trajectories together;
// -1: a step became too short.
template <class Problem, class real>
AdaptiveCount integrate_taylor(Expansion<Problem, real>& x, double until, double tolerance) {
    using number = Number<Problem, real>;
    constexpr bool in_rows = !std::is_same_v<number, real>;  // all parts of a number are of one trajectory
    const int order = std::clamp(static_cast<int>(std::ceil(1 - std::log(tolerance) / 2)), 2, most_orders);
    const double factor = std::exp(-2 - 0.7 / (order - 1));
    const auto largest = [&](int k) {
        number most{};
        for (const auto& y : x.y) {
            const number here = magnitude(y[k]);
            most = here > most ? here : most;
        }
        if constexpr (in_rows) {
            double all = 0;
            for (int i = 0; i < 8; ++i) all = std::max(all, double(most[i]));
            most = number{} + all;
        }
        return most;
    };
    number t{}, lost{};  // the time, and what its roundings have added
    AdaptiveCount counts{0, 0};
    while (any(t < until)) {
        x.expand(order);
        number size = largest(0);
        size = size > 1 ? size : number{} + 1;  // errors relative to large states, absolute beside small ones
        const number last = root_of_inverse(largest(order) / size, order);
        const number before = root_of_inverse(largest(order - 1) / size, order - 1);
        const number left = (until - t) + lost;
        number h = factor * (last < before ? last : before);
        const auto arrives = h >= left;
        h = arrives ? left : h;
        if (any((t < until) & !arrives & !(h > 1e-12 * until))) return {-1, 0};
        advance(x, h, order);
        counts.steps += in_rows ? 1 : count(t < until);
        const number step = h - lost, next = t + step;
        lost = (next - t) - step;
        t = arrives ? number{} + until : next;
    }
    return counts;
}

}  // namespace by_clang or by_gnu
}  // namespace lobatto::bench
