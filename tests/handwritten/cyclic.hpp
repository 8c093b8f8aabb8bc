// SPDX-License-Identifier: GPL-2.0-or-later
// Systems with a cyclic coordinate, written by hand in the general form, each with that coordinate eliminated or not.
#pragma once

#include "runtime/kernel/kernel.hpp"
#include "tests/handwritten/tables.hpp"

namespace lobatto {

// What the two systems share: coordinates (x, y), y cyclic; unreduced z = (x', y', x, y), reduced z = (x', x, P).
template <class number, class Tables, bool reduced>
struct HandwrittenPlane : HandwrittenKernel, Tables {
    using real = number;
    static constexpr int coordinates = 2;
    static constexpr Form form = Form::general;
    static constexpr bool autonomous = true;
    static constexpr int active = reduced ? 1 : 2, cyclic = reduced ? 1 : 0;
    static constexpr int active_index[2] = {0, 1}, cyclic_index[1] = {1};
    static constexpr int position[2] = {0, 1};
    static constexpr int group_count = 1, group_first[2] = {0, active}, group_bandwidth[1] = {active - 1};
    static constexpr int entries = 5;  // reduced: vv, qq, qP, Pq, PP; else x'x', y'y', y'x, xy', xx
    static constexpr int entry_row[5] = {0, 1, 1, 2, 2};
    static constexpr int entry_column[5] = {0, 1, 2, 1, 2};
    static constexpr int mass_entries = 2, mass_row[2] = {0, 1}, mass_column[2] = {0, 1};
};

// The spherical pendulum, polar angle x, azimuth y: L = (x'^2 + sin(x)^2 y'^2)/2 + cos x, P = sin(x)^2 y',
// R = x'^2/2 - P^2/(2 sin(x)^2) + cos x.
template <class number, class Tables, bool reduced>
struct HandwrittenSphericalPendulum : HandwrittenPlane<number, Tables, reduced> {
    using real = number;
    static constexpr const char* name = "handwritten_spherical_pendulum";
    static constexpr int parameter_count = 0;

    struct Parameters {};
    static real& parameter(Parameters&, int) {
        static real none = 0;
        return none;
    }
    struct Coefficients {};
    static Status prepare(const Parameters&, real, Coefficients&) { return Status::ok; }

    static void slope(const Coefficients&, const real* z, real* g) {
        const real x = reduced ? z[1] : z[2], s = lobatto::sin(x), c = lobatto::cos(x);
        if (reduced) {
            const real P = z[2];
            g[0] = z[0];
            g[1] = P * P * c / (s * s * s) - s;
            g[2] = -P / (s * s);
        } else {
            g[0] = z[0];
            g[1] = s * s * z[1];
            g[2] = s * c * z[1] * z[1] - s;
            g[3] = 0;
        }
    }
    static void node(const Coefficients& k, const real* z, real* g, real* H) {
        slope(k, z, g);
        const real x = reduced ? z[1] : z[2], s = lobatto::sin(x), c = lobatto::cos(x);
        H[0] = 1;
        if (reduced) {
            const real P = z[2];
            H[1] = -P * P * (s * s + 3 * c * c) / (s * s * s * s) - c;
            H[2] = H[3] = 2 * P * c / (s * s * s);
            H[4] = -1 / (s * s);
        } else {
            H[1] = s * s;
            H[2] = H[3] = 2 * s * c * z[1];
            H[4] = (c * c - s * s) * z[1] * z[1] - c;
        }
    }
    static void momentum(const Coefficients&, const real* q, const real* v, real* p) {
        p[0] = v[0];
        p[1] = lobatto::sin(q[0]) * lobatto::sin(q[0]) * v[1];
    }
    static void legendre(const Coefficients& k, const real* q, const real* v, real* p, real* M) {
        momentum(k, q, v, p);
        M[0] = 1;
        M[1] = lobatto::sin(q[0]) * lobatto::sin(q[0]);
    }
    static void slopes(const Coefficients& k, const real* q, const real* v, real* Lv, real* Lq) {
        momentum(k, q, v, Lv);
        const real s = lobatto::sin(q[0]);
        Lq[0] = s * lobatto::cos(q[0]) * v[1] * v[1] - s;
        Lq[1] = 0;
    }
    static real energy(const Coefficients&, const real* q, const real* v) {
        const real s = lobatto::sin(q[0]);
        return (v[0] * v[0] + s * s * v[1] * v[1]) / 2 - lobatto::cos(q[0]);
    }
};

// A charge in a uniform magnetic field and a harmonic valley: L = (x'^2 + y'^2)/2 + b x y' - k x^2/2, P = y' + b x,
// R = x'^2/2 - (P - b x)^2/2 - k x^2/2. Linear; `frozen` says so to the stepper.
template <class number, class Tables, bool reduced, bool frozen>
struct HandwrittenCharge : HandwrittenPlane<number, Tables, reduced> {
    using real = number;
    static constexpr const char* name = "handwritten_charge";
    static constexpr bool linear = frozen;
    static constexpr int parameter_count = 2;

    struct Parameters {
        real b = 2, k = 1;
    };
    static real& parameter(Parameters& p, int i) { return i == 0 ? p.b : p.k; }
    using Coefficients = Parameters;
    static Status prepare(const Parameters& p, real, Coefficients& k) {
        k = p;
        return Status::ok;
    }
    static void slope(const Coefficients& k, const real* z, real* g) {
        if (reduced) {
            const real v = z[2] - k.b * z[1];  // y'
            g[0] = z[0];
            g[1] = k.b * v - k.k * z[1];
            g[2] = -v;
        } else {
            g[0] = z[0];
            g[1] = z[1] + k.b * z[2];
            g[2] = k.b * z[1] - k.k * z[2];
            g[3] = 0;
        }
    }
    static void node(const Coefficients& k, const real* z, real* g, real* H) {
        slope(k, z, g);
        H[0] = 1;
        H[1] = reduced ? -k.b * k.b - k.k : real(1);
        H[2] = H[3] = k.b;
        H[4] = reduced ? real(-1) : -k.k;
    }
    static void momentum(const Coefficients& k, const real* q, const real* v, real* p) {
        p[0] = v[0];
        p[1] = v[1] + k.b * q[0];
    }
    static void legendre(const Coefficients& k, const real* q, const real* v, real* p, real* M) {
        momentum(k, q, v, p);
        M[0] = M[1] = 1;
    }
    static void slopes(const Coefficients& k, const real* q, const real* v, real* Lv, real* Lq) {
        momentum(k, q, v, Lv);
        Lq[0] = k.b * v[1] - k.k * q[0];
        Lq[1] = 0;
    }
    static real energy(const Coefficients& k, const real* q, const real* v) {
        return (v[0] * v[0] + v[1] * v[1] + k.k * q[0] * q[0]) / 2;
    }
};

}  // namespace lobatto
