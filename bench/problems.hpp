// SPDX-License-Identifier: GPL-2.0-or-later
// The problems of the race, written by hand for the peers: accelerations where the mass matrix is constant, slopes of
// the first-order form (q, p)' = (dH/dp, -dH/dq) for all, each for every number type. Where masses are constant, p are
// velocities: the momenta of unit masses.
#pragma once

#include <array>
#include <cstring>
#include <string>
#include <variant>
#include <vector>

#include "bench/peers/number.hpp"

namespace lobatto::bench {

template <class real, int n>
struct State {
    std::array<real, n> q, p;
};

// For problems with H = sum of m_k p_k^2/2 + V(q): from the acceleration and V. y = (q, p).
template <class Problem, int n>
struct Separable {
    static constexpr bool separable = true, has_pace = false;
    static constexpr int coordinates = n;
    static constexpr double mass(int) { return 1; }
    template <class real>
    static void slope(const real* y, real* dy) {
        for (int k = 0; k < n; ++k) dy[k] = y[n + k];
        Problem::acceleration(y, dy + n);
    }
    template <class real>
    static real energy(const real* q, const real* p) {
        real H = Problem::potential(q);
        for (int k = 0; k < n; ++k) H += real(Problem::mass(k)) * p[k] * p[k] / 2;
        return H;
    }
};

// P1. The pendulum: V = 1 - cos q.
struct Pendulum : Separable<Pendulum, 1> {
    template <class real>
    static void acceleration(const real* q, real* a) {
        a[0] = -sine(q[0]);
    }
    template <class real>
    static real potential(const real* q) {
        return 1 - cosine(q[0]);
    }
};

// P2. Henon and Heiles: V = (x^2 + y^2)/2 + x^2 y - y^3/3.
struct HenonHeiles : Separable<HenonHeiles, 2> {
    template <class real>
    static void acceleration(const real* q, real* a) {
        const real x = q[0], y = q[1];
        a[0] = -(x + 2 * x * y);
        a[1] = (y * y - x * x) - y;
    }
    template <class real>
    static real potential(const real* q) {
        const real x = q[0], y = q[1];
        return (x * x + y * y) / 2 + x * x * y - y * y * y / 3;
    }
};

// P3. The double pendulum, unit masses and lengths, g = 9.81: M = (2, cos d; cos d, 1) with d = q1 - q2.
struct DoublePendulum {
    static constexpr bool separable = false, has_pace = false;
    static constexpr int coordinates = 2;
    static constexpr double mass(int) { return 1; }  // p are momenta
    static constexpr double g = 9.81;
    template <class real>
    static void slope(const real* y, real* dy) {
        // The sine and cosine of the difference from those of the angles, as our kernels take them: fewer functions.
        const real sine_a = sine(y[0]), cosine_a = cosine(y[0]), sine_b = sine(y[1]), cosine_b = cosine(y[1]);
        const real c = cosine_a * cosine_b + sine_a * sine_b, s = sine_a * cosine_b - cosine_a * sine_b;
        const real inverse = 1 / (1 + s * s);  // of det M = 2 - c^2
        dy[0] = (y[2] - c * y[3]) * inverse;
        dy[1] = (2 * y[3] - c * y[2]) * inverse;
        const real coupling = dy[0] * dy[1] * s;
        dy[2] = -coupling - 2 * real(g) * sine_a;
        dy[3] = coupling - real(g) * sine_b;
    }
    template <class real>
    static real energy(const real* q, const real* p) {
        const real c = cosine(q[0] - q[1]), s = sine(q[0] - q[1]);
        const real kinetic = (p[0] * p[0] - 2 * c * p[0] * p[1] + 2 * p[1] * p[1]) / (2 * (1 + s * s));
        return kinetic - real(g) * (2 * cosine(q[0]) + cosine(q[1]));
    }
};

// P4, P6 and P7. Kepler: V = -1/|q|.
struct Kepler : Separable<Kepler, 2> {
    template <class real>
    static void acceleration(const real* q, real* a) {
        // 1/|q|^3 as |q|/|q|^4: root and quotient are computed at the same time.
        const real r2 = q[0] * q[0] + q[1] * q[1], inverse = 1 / r2, inverse2 = inverse * inverse, r = square_root(r2);
        a[0] = -(q[0] * inverse2) * r;
        a[1] = -(q[1] * inverse2) * r;
    }
    template <class real>
    static real potential(const real* q) {
        return -1 / square_root(q[0] * q[0] + q[1] * q[1]);
    }
};

// P5. Fermi, Pasta, Ulam, Tsingou: 32 masses, fixed ends, V = sum of d^2/2 + 0.3 d^4/4 over the 33 springs.
struct Chain : Separable<Chain, 32> {
    static constexpr double beta = 0.3;
    template <class real>
    static void acceleration(const real* q, real* a) {
        constexpr int n = 32;
        real tension[n + 1];
        for (int i = 0; i <= n; ++i) {
            const real d = (i < n ? q[i] : real(0)) - (i > 0 ? q[i - 1] : real(0));
            tension[i] = d + real(beta) * d * d * d;
        }
        for (int i = 0; i < n; ++i) a[i] = tension[i + 1] - tension[i];
    }
    // The same for double with neighbours by shuffles: reloading what was just stored at another alignment costs more
    // than all the rest (Blanes-Moan SRKN11b, AVX-512: 57 ns an evaluation by the compiler's own vectors, 20 ns by
    // these).
    static void acceleration(const double* q, double* a) {
        constexpr int n = 32, width = 4, blocks = n / width;
        typedef double Vector __attribute__((vector_size(width * sizeof(double))));
        Vector position[blocks + 2], tension[blocks + 1];
        position[0] = position[blocks + 1] = Vector{};  // the walls
        std::memcpy(static_cast<void*>(position + 1), q, n * sizeof(double));
        for (int k = 0; k <= blocks; ++k) {
            const Vector d = position[k + 1] - __builtin_shufflevector(position[k], position[k + 1], 3, 4, 5, 6);
            tension[k] = d + beta * (d * d * d);
        }
        for (int k = 0; k < blocks; ++k) {
            const Vector force = __builtin_shufflevector(tension[k], tension[k + 1], 1, 2, 3, 4) - tension[k];
            std::memcpy(a + k * width, &force, sizeof(Vector));
        }
    }
    template <class real>
    static real potential(const real* q) {
        real V = 0, before = 0;
        for (int i = 0; i <= 32; ++i) {
            const real here = i < 32 ? q[i] : real(0), d = here - before, d2 = d * d;
            V += d2 / 2 + real(beta) * d2 * d2 / 4;
            before = here;
        }
        return V;
    }
};

// P8 and P9. Three bodies in a plane, G = 1: V = -sum of m_i m_j / r_ij, q = (x1, y1, x2, y2, x3, y3).
template <const auto& masses>
struct ThreeBodies : Separable<ThreeBodies<masses>, 6> {
    static constexpr bool has_pace = true;
    static constexpr double mass(int k) { return masses[k / 2]; }
    // action(i, j) for each pair of bodies.
    template <class Action>
    static void each_pair(const Action& action) {
        action(0, 1);
        action(1, 2);
        action(2, 0);
    }
    template <class real>
    static void acceleration(const real* q, real* a) {
        for (int k = 0; k < 6; ++k) a[k] = 0;
        each_pair([&](int i, int j) {
            const real x = q[2 * j] - q[2 * i], y = q[2 * j + 1] - q[2 * i + 1];
            const real r2 = x * x + y * y, inverse = 1 / r2, w = inverse * inverse * square_root(r2);
            const real toward = real(masses[j]) * w, back = real(masses[i]) * w;
            a[2 * i] += toward * x;
            a[2 * i + 1] += toward * y;
            a[2 * j] -= back * x;
            a[2 * j + 1] -= back * y;
        });
    }
    template <class real>
    static real potential(const real* q) {
        real V = 0;
        each_pair([&](int i, int j) {
            const real x = q[2 * j] - q[2 * i], y = q[2 * j + 1] - q[2 * i + 1];
            V -= real(masses[i] * masses[j]) / square_root(x * x + y * y);
        });
        return V;
    }
    // The time in which the nearest pair falls together, about: how long a step of the reference may be.
    template <class real>
    static real pace(const real* q) {
        real sum = 0;
        each_pair([&](int i, int j) {
            const real x = q[2 * j] - q[2 * i], y = q[2 * j + 1] - q[2 * i + 1], r2 = x * x + y * y;
            sum += real(masses[i] + masses[j]) / (r2 * square_root(r2));
        });
        return 1 / square_root(sum);
    }
};
inline constexpr std::array pythagorean_masses = {3.0, 4.0, 5.0}, hierarchical_masses = {0.5, 0.5, 0.125};
using Pythagorean = ThreeBodies<pythagorean_masses>;
using Hierarchical = ThreeBodies<hierarchical_masses>;

using AnyProblem = std::variant<Pendulum, HenonHeiles, DoublePendulum, Kepler, Chain, Pythagorean, Hierarchical>;

// What a reference is computed by: a formula; quadruple precision; 80 bits, for ensembles only or for all.
enum class Reference { closed, quadruple, quadruple_for_one, extended };

// The same for what is chosen at run time. Numbers are the nearest doubles of the problem's.
struct Problem {
    std::string name;   // "P1"
    std::string title;  // "pendulum"
    std::string scene;  // file below bench/scenes/
    AnyProblem type;
    double until;  // T
    std::vector<double> q, p;
    double longest_step;  // where the scan of steps begins
    double frequency;     // the highest of small motions: our steps stay within the linear stability limit
    Reference reference = Reference::quadruple_for_one;
    double reference_step = 0;             // where there is a pace, times the pace
    double spread = 1e-3;                  // how far the starts of an ensemble lie apart
    bool positions_only = false;           // are compared, because velocities are large where bodies are close
    double revolutions = 0;                // in T; where steps are counted by revolution
    long most_steps = 200'000;             // of an adaptive method, whose solution has escaped to infinity else
    std::vector<std::string> clocks = {};  // of our steps that follow the motion
    double fewest_chain_steps = 0;         // of them, where their scan begins

    bool is_long() const { return revolutions > 1000; }  // a run takes seconds: fewer settings are tried
};
const std::vector<Problem>& problems();

// Calls action with the problem's type: action(Pendulum()).
template <class Action>
auto with_type_of(const Problem& problem, const Action& action) {
    return std::visit(action, problem.type);
}

}  // namespace lobatto::bench
