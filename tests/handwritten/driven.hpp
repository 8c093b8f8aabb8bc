// SPDX-License-Identifier: GPL-2.0-or-later
// A driven pendulum with friction, L = x'^2/2 + cos x + a x cos(w t), F = -d x', by hand: in the general form, and for
// d = 0 in the separable one with loops.
#pragma once

#include "runtime/kernel/kernel.hpp"
#include "tests/handwritten/tables.hpp"

namespace lobatto {

template <class number>
struct DrivenParameters {
    number a = 0.5, w = 1.5, d = 0;
};

template <class number, class Tables>
struct HandwrittenDriven : HandwrittenKernel, Tables {
    using real = number;
    static constexpr const char* name = "handwritten_driven";
    static constexpr int coordinates = 1, parameter_count = 3;
    static constexpr bool autonomous = false;
    static constexpr int position[1] = {0}, group_count = 1, group_first[2] = {0, 1}, group_bandwidth[1] = {0};
    using Parameters = DrivenParameters<number>;
    static real& parameter(Parameters& p, int i) { return i == 0 ? p.a : i == 1 ? p.w : p.d; }
    using Coefficients = Parameters;
    static Status prepare(const Parameters& p, real, Coefficients& k) {
        k = p;
        return Status::ok;
    }
};

template <class number, class Tables>
struct HandwrittenDrivenGeneral : HandwrittenDriven<number, Tables> {
    using real = number;
    using Coefficients = DrivenParameters<number>;
    static constexpr Form form = Form::general;
    static constexpr int active = 1, cyclic = 0, active_index[1] = {0}, cyclic_index[1] = {0};
    static constexpr int entries = 3, entry_row[3] = {0, 1, 1}, entry_column[3] = {0, 1, 0};
    static constexpr int mass_entries = 1, mass_row[1] = {0}, mass_column[1] = {0};

    static void slope(const Coefficients& k, real time, const real* z, real* g) {
        g[0] = z[0];
        g[1] = -lobatto::sin(z[1]) + k.a * lobatto::cos(k.w * time) - k.d * z[0];
    }
    static void node(const Coefficients& k, real time, const real* z, real* g, real* H) {
        slope(k, time, z, g);
        H[0] = 1;
        H[1] = -lobatto::cos(z[1]);
        H[2] = -k.d;
    }
    static void momentum(const Coefficients&, real, const real*, const real* v, real* p) { p[0] = v[0]; }
    static void legendre(const Coefficients&, real, const real*, const real* v, real* p, real* M) {
        p[0] = v[0];
        M[0] = 1;
    }
    static void slopes(const Coefficients& k, real time, const real* q, const real* v, real* Lv, real* Lq) {
        const real z[2] = {v[0], q[0]};
        real g[2];
        slope(k, time, z, g);
        Lv[0] = g[0];
        Lq[0] = g[1];
    }
    static real energy(const Coefficients& k, real time, const real* q, const real* v) {
        return v[0] * v[0] / 2 - lobatto::cos(q[0]) - k.a * q[0] * lobatto::cos(k.w * time);
    }
};

template <class number, class Tables>
struct HandwrittenDrivenSeparable : HandwrittenDriven<number, Tables> {
    using real = number;
    using Coefficients = DrivenParameters<number>;
    static constexpr Form form = Form::separable;
    static constexpr int unknowns = 2;
    static constexpr bool absorbed = false;
    static constexpr int entries = 1, entry_row[1] = {0}, entry_column[1] = {0};

    static void minus_acceleration(const Coefficients& k, real time, const real* q, real* W) {
        W[0] = lobatto::sin(q[0]) - k.a * lobatto::cos(k.w * time);
    }
    static void node(const Coefficients& k, real time, const real* q, real* W, real* S) {
        minus_acceleration(k, time, q, W);
        S[0] = lobatto::cos(q[0]);
    }
    static void momentum(const Coefficients&, const real* v, real* p) { p[0] = v[0]; }
    static void velocity(const Coefficients&, const real* p, real* v) { v[0] = p[0]; }
    static real energy(const Coefficients& k, real time, const real* q, const real* p) {
        return p[0] * p[0] / 2 - lobatto::cos(q[0]) - k.a * q[0] * lobatto::cos(k.w * time);
    }
};

}  // namespace lobatto
