// SPDX-License-Identifier: GPL-2.0-or-later
// The double pendulum, written by hand in the general form: a mass matrix that depends on positions.
//
// Two points of mass 1 on rods of length 1, g = 1, angles x and y from below; c, s of x - y:
//     L = x'^2 + y'^2/2 + x' y' c + 2 cos x + cos y
#pragma once

#include "runtime/kernel/kernel.hpp"
#include "tests/handwritten/tables.hpp"

namespace lobatto {

template <class number, class Tables>
struct HandwrittenDoublePendulum : HandwrittenKernel, Tables {
    using real = number;
    static constexpr const char* name = "handwritten_double_pendulum";
    static constexpr int coordinates = 2;
    static constexpr int parameter_count = 0;
    static constexpr Form form = Form::general;
    static constexpr bool autonomous = true;
    static constexpr int events = 2;
    static constexpr int event_direction[2] = {1, 0};
    static constexpr int active = 2, cyclic = 0;
    static constexpr int active_index[2] = {0, 1}, cyclic_index[1] = {0};
    static constexpr int position[2] = {0, 1};
    static constexpr int group_count = 1, group_first[2] = {0, 2}, group_bandwidth[1] = {1};
    // z = (x', y', x, y)
    static constexpr int entries = 16;
    static constexpr int entry_row[16] = {0, 0, 1, 1, 0, 0, 1, 1, 2, 3, 2, 3, 2, 3, 2, 3};
    static constexpr int entry_column[16] = {0, 1, 0, 1, 2, 3, 2, 3, 0, 0, 1, 1, 2, 3, 3, 2};
    static constexpr int mass_entries = 4;
    static constexpr int mass_row[4] = {0, 0, 1, 1}, mass_column[4] = {0, 1, 0, 1};

    struct Parameters {};
    static real& parameter(Parameters&, int) {
        static real none = 0;
        return none;
    }
    struct Coefficients {};
    static Status prepare(const Parameters&, real h, Coefficients&) {
        return is_finite(h) ? Status::ok : Status::not_finite;
    }

    static void slope(const Coefficients&, const real* z, real* g) {
        const real c = lobatto::cos(z[2] - z[3]), s = lobatto::sin(z[2] - z[3]);
        g[0] = 2 * z[0] + z[1] * c;
        g[1] = z[1] + z[0] * c;
        g[2] = -z[0] * z[1] * s - 2 * lobatto::sin(z[2]);
        g[3] = z[0] * z[1] * s - lobatto::sin(z[3]);
    }
    static void node(const Coefficients& k, const real* z, real* g, real* H) {
        slope(k, z, g);
        const real c = lobatto::cos(z[2] - z[3]), s = lobatto::sin(z[2] - z[3]);
        H[0] = 2;
        H[1] = H[2] = c;
        H[3] = 1;
        H[4] = H[8] = -z[1] * s;   // x' x
        H[5] = H[9] = z[1] * s;    // x' y
        H[6] = H[10] = -z[0] * s;  // y' x
        H[7] = H[11] = z[0] * s;   // y' y
        H[12] = -z[0] * z[1] * c - 2 * lobatto::cos(z[2]);
        H[13] = -z[0] * z[1] * c - lobatto::cos(z[3]);
        H[14] = H[15] = z[0] * z[1] * c;
    }
    static void slopes(const Coefficients& k, const real* q, const real* v, real* Lv, real* Lq) {
        const real z[4] = {v[0], v[1], q[0], q[1]};
        real g[4];
        slope(k, z, g);
        for (int i = 0; i < 2; ++i) {
            Lv[i] = g[i];
            Lq[i] = g[2 + i];
        }
    }
    static void momentum(const Coefficients&, const real* q, const real* v, real* p) {
        const real c = lobatto::cos(q[0] - q[1]);
        p[0] = 2 * v[0] + v[1] * c;
        p[1] = v[1] + v[0] * c;
    }
    static void legendre(const Coefficients& k, const real* q, const real* v, real* p, real* M) {
        momentum(k, q, v, p);
        M[0] = 2;
        M[1] = M[2] = lobatto::cos(q[0] - q[1]);
        M[3] = 1;
    }
    static real energy(const Coefficients&, const real* q, const real* v) {
        return v[0] * v[0] + v[1] * v[1] / 2 + v[0] * v[1] * lobatto::cos(q[0] - q[1]) - 2 * lobatto::cos(q[0]) -
               lobatto::cos(q[1]);
    }
    // The lower point passes below the upper one, rising in y; the upper rod turns back.
    static void event(const Coefficients&, const real* q, const real* v, real* value) {
        value[0] = q[1];
        value[1] = v[0];
    }
};

}  // namespace lobatto
