// SPDX-License-Identifier: MIT
// p12: t.
// Written by Lobatto from a scene file; edit the scene, not this file. Formula numbers (D..): docs/derivation.md.
//
// Lagrangian   L = sum(i = 1 .. 12, m[i]*(x[i]'^2 + y[i]'^2 + z[i]'^2)/2) + sum(i = 2 .. 12, sum(j = 1 .. i - 1,
//                  m[i]*m[j]/sqrt((x[i] - x[j])^2 + (y[i] - y[j])^2 + (z[i] - z[j])^2)))
// Method       Lobatto, 4 points: order 6, symplectic, symmetric
// Coordinates  q[0] = x_1, q[1] = x_2, q[2] = x_3, q[3] = x_4, q[4] = x_5, q[5] = x_6, q[6] = x_7, q[7] = x_8, q[8] = x_9, q[9] = x_10, q[10] = x_11, q[11] = x_12, q[12] = y_1, q[13] = y_2, q[14] = y_3, q[15] = y_4, q[16] = y_5, q[17] = y_6, q[18] = y_7, q[19] = y_8, q[20] = y_9, q[21] = y_10, q[22] = y_11, q[23] = y_12, q[24] = z_1, q[25] = z_2, q[26] = z_3, q[27] = z_4, q[28] = z_5, q[29] = z_6, q[30] = z_7, q[31] = z_8, q[32] = z_9, q[33] = z_10, q[34] = z_11, q[35] = z_12
// Structure    constant mass matrix: the masses are the same everywhere, so the end of a step needs no equations
// Structure    diagonal mass matrix: no two velocities are multiplied: each momentum is its own mass times velocity
// Structure    repeated terms: 66 of 66 terms of L are one formula, computed in loops over tables
// Structure    no explicit time: nothing depends on the time itself: no formula takes it
// Structure    no forces: all forces come from L, so every step is symplectic
// Structure    constant parameters: m_1, m_2, m_3, m_4, m_5, m_6, m_7, m_8, m_9, m_10, m_11, m_12: numbers in the
//              formulas, not arguments of them
// Operations   66 in all, 101 as derived: 21 additions, 39 multiplications, 3 divisions, 3 functions
#pragma once

#include "kernel.hpp"

namespace lobatto::kernels {

struct p12 {
    using real = double;

    static constexpr const char* name = "p12";
    static constexpr const char* digest = "13523eb23449f252";
    static constexpr const char* method = "Lobatto, 4 points";
    static constexpr lobatto::Form form = lobatto::Form::separable;  // how a step is taken
    static constexpr int coordinates = 36;      // n
    static constexpr int order = 6;             // of accuracy in h
    static constexpr int unknowns = 72;         // of the equations of a step; 0: none to solve
    static constexpr bool any_number = true;    // formulas are templates on the type of numbers: fixed-point iteration first
    static constexpr bool linear = false;       // all second derivatives are constant
    static constexpr bool autonomous = true;    // no formula holds the time
    static constexpr bool has_energy = true;    // asked for by the scene
    static constexpr bool has_tangent = true;   // the derivative of a step
    static constexpr int parameter_count = 0;   // in the order of the scene
    static constexpr int events = 0;            // that are watched for
    static constexpr int event_direction[1] = {};
    static constexpr int points = 4;            // nodes of a step, both ends included
    static constexpr bool is_explicit = false;  // the inner nodes are solved for
    static constexpr bool diagonal_part = false;  // nothing is taken into the stage map
    static constexpr bool neighbours = false;   // coordinates are taken one by one
    static constexpr bool clean = false;        // steps as fast as can be
    static constexpr bool absorbed = false;     // Newton's iteration has its own Jacobians
    static constexpr int entries = 1296;        // of M^-1 V'' that are not identically zero
    static constexpr lobatto::RowOfFull<36> entry_row{};
    static constexpr lobatto::ColumnOfFull<36> entry_column{};
    // Unknowns of coordinate a stand at position[a]; groups are solved by themselves.
    static constexpr int position[36] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20, 21,
        22, 23, 24, 25, 26, 27, 28, 29, 30, 31, 32, 33, 34, 35};
    static constexpr int group_count = 1;       // groups of coupled coordinates
    static constexpr int group_first[2] = {0, 36};
    static constexpr int group_bandwidth[1] = {35};
    static constexpr bool has_remainder = false;  // forces have no function without a part
    static constexpr bool uses_hessian = false;  // second derivatives would cost more than the evaluations they save

    // nodes on [0, 1]: 0; 1/2 - sqrt(5)/10; sqrt(5)/10 + 1/2; 1
    static constexpr real c[4] = {0.0, 0.276393202250021, 0.7236067977499789, 1.0};
    // their weights: 1/12; 5/12; 5/12; 1/12
    static constexpr real b[4] = {0.08333333333333333, 0.4166666666666667, 0.4166666666666667, 0.08333333333333333};
    // stage map A_ij over the interior nodes, row-major: 1/60; 11/120 - sqrt(5)/24; sqrt(5)/24 + 11/120; 1/60
    static constexpr real A[4] = {0.016666666666666666, -0.0015028323958245708, 0.1848361657291579,
        0.016666666666666666};
    // extrapolation from the nodes of one step to the interior nodes of the next, row-major: sqrt(5) - 3; 5*sqrt(5) -
    //     9; 5 - 4*sqrt(5); 8 - 2*sqrt(5); -sqrt(5) - 3; 4*sqrt(5) + 5; -5*sqrt(5) - 9; 2*sqrt(5) + 8
    static constexpr real E[8] = {-0.7639320225002103, 2.1803398874989486, -3.9442719099991588, 3.5278640450004204,
        -5.23606797749979, 13.94427190999916, -20.18033988749895, 12.47213595499958};
    // element_1 = a0/sqrt((x0 - x1)^2 + (x2 - x3)^2 + (x4 - x5)^2) for 66 rows of x (numbers in q): which ones.
    static constexpr int element_1_x[396] = {0, 1, 12, 13, 24, 25, 1, 2, 13, 14, 25, 26, 2, 3, 14, 15, 26, 27, 3, 4, 15,
        16, 27, 28, 4, 5, 16, 17, 28, 29, 5, 6, 17, 18, 29, 30, 6, 7, 18, 19, 30, 31, 7, 8, 19, 20, 31, 32, 8, 9, 20,
        21, 32, 33, 9, 10, 21, 22, 33, 34, 10, 11, 22, 23, 34, 35, 0, 2, 12, 14, 24, 26, 1, 3, 13, 15, 25, 27, 2, 4, 14,
        16, 26, 28, 3, 5, 15, 17, 27, 29, 4, 6, 16, 18, 28, 30, 5, 7, 17, 19, 29, 31, 6, 8, 18, 20, 30, 32, 7, 9, 19,
        21, 31, 33, 8, 10, 20, 22, 32, 34, 9, 11, 21, 23, 33, 35, 0, 3, 12, 15, 24, 27, 1, 4, 13, 16, 25, 28, 2, 5, 14,
        17, 26, 29, 3, 6, 15, 18, 27, 30, 4, 7, 16, 19, 28, 31, 5, 8, 17, 20, 29, 32, 6, 9, 18, 21, 30, 33, 7, 10, 19,
        22, 31, 34, 8, 11, 20, 23, 32, 35, 0, 4, 12, 16, 24, 28, 1, 5, 13, 17, 25, 29, 2, 6, 14, 18, 26, 30, 3, 7, 15,
        19, 27, 31, 4, 8, 16, 20, 28, 32, 5, 9, 17, 21, 29, 33, 6, 10, 18, 22, 30, 34, 7, 11, 19, 23, 31, 35, 0, 5, 12,
        17, 24, 29, 1, 6, 13, 18, 25, 30, 2, 7, 14, 19, 26, 31, 3, 8, 15, 20, 27, 32, 4, 9, 16, 21, 28, 33, 5, 10, 17,
        22, 29, 34, 6, 11, 18, 23, 30, 35, 0, 6, 12, 18, 24, 30, 1, 7, 13, 19, 25, 31, 2, 8, 14, 20, 26, 32, 3, 9, 15,
        21, 27, 33, 4, 10, 16, 22, 28, 34, 5, 11, 17, 23, 29, 35, 0, 7, 12, 19, 24, 31, 1, 8, 13, 20, 25, 32, 2, 9, 14,
        21, 26, 33, 3, 10, 15, 22, 27, 34, 4, 11, 16, 23, 28, 35, 0, 8, 12, 20, 24, 32, 1, 9, 13, 21, 25, 33, 2, 10, 14,
        22, 26, 34, 3, 11, 15, 23, 27, 35, 0, 9, 12, 21, 24, 33, 1, 10, 13, 22, 25, 34, 2, 11, 14, 23, 26, 35, 0, 10,
        12, 22, 24, 34, 1, 11, 13, 23, 25, 35, 0, 11, 12, 23, 24, 35};
    static constexpr real element_1_a[66] = {-2.0, -6.0, -12.0, -20.0, -30.0, -42.0, -56.0, -72.0, -90.0, -110.0,
        -132.0, -3.0, -8.0, -15.0, -24.0, -35.0, -48.0, -63.0, -80.0, -99.0, -120.0, -4.0, -10.0, -18.0, -28.0, -40.0,
        -54.0, -70.0, -88.0, -108.0, -5.0, -12.0, -21.0, -32.0, -45.0, -60.0, -77.0, -96.0, -6.0, -14.0, -24.0, -36.0,
        -50.0, -66.0, -84.0, -7.0, -16.0, -27.0, -40.0, -55.0, -72.0, -8.0, -18.0, -30.0, -44.0, -60.0, -9.0, -20.0,
        -33.0, -48.0, -10.0, -22.0, -36.0, -11.0, -24.0, -12.0};

    // Values of the scene; change them before prepare().
    struct Parameters {
    };
    static real& parameter(Parameters& p, int index) {
        (void)p;
        (void)index;
        static real none = 0;
        return none;
    }

    // What depends on parameters and step size only, computed once by prepare().
    template <class number>
    struct CoefficientsOf {
        number mass[coordinates], inverse_mass[coordinates];
    };
    using Coefficients = CoefficientsOf<real>;

    // The coefficients of these parameters and this step size.
    static Status prepare(const Parameters&, real h, Coefficients& k) {
        k.mass[0] = 1.0;
        k.mass[1] = 2.0;
        k.mass[2] = 3.0;
        k.mass[3] = 4.0;
        k.mass[4] = 5.0;
        k.mass[5] = 6.0;
        k.mass[6] = 7.0;
        k.mass[7] = 8.0;
        k.mass[8] = 9.0;
        k.mass[9] = 10.0;
        k.mass[10] = 11.0;
        k.mass[11] = 12.0;
        k.mass[12] = k.mass[0];
        k.mass[13] = k.mass[1];
        k.mass[14] = k.mass[2];
        k.mass[15] = k.mass[3];
        k.mass[16] = k.mass[4];
        k.mass[17] = k.mass[5];
        k.mass[18] = k.mass[6];
        k.mass[19] = k.mass[7];
        k.mass[20] = k.mass[8];
        k.mass[21] = k.mass[9];
        k.mass[22] = k.mass[10];
        k.mass[23] = k.mass[11];
        k.mass[24] = k.mass[0];
        k.mass[25] = k.mass[1];
        k.mass[26] = k.mass[2];
        k.mass[27] = k.mass[3];
        k.mass[28] = k.mass[4];
        k.mass[29] = k.mass[5];
        k.mass[30] = k.mass[6];
        k.mass[31] = k.mass[7];
        k.mass[32] = k.mass[8];
        k.mass[33] = k.mass[9];
        k.mass[34] = k.mass[10];
        k.mass[35] = k.mass[11];
        k.inverse_mass[0] = k.mass[0];
        k.inverse_mass[1] = 0.5;
        k.inverse_mass[2] = 0.3333333333333333;
        k.inverse_mass[3] = 0.25;
        k.inverse_mass[4] = 0.2;
        k.inverse_mass[5] = 0.16666666666666666;
        k.inverse_mass[6] = 0.14285714285714285;
        k.inverse_mass[7] = 0.125;
        k.inverse_mass[8] = 0.1111111111111111;
        k.inverse_mass[9] = 0.1;
        k.inverse_mass[10] = 0.09090909090909091;
        k.inverse_mass[11] = 0.08333333333333333;
        k.inverse_mass[12] = k.mass[0];
        k.inverse_mass[13] = k.inverse_mass[1];
        k.inverse_mass[14] = k.inverse_mass[2];
        k.inverse_mass[15] = k.inverse_mass[3];
        k.inverse_mass[16] = k.inverse_mass[4];
        k.inverse_mass[17] = k.inverse_mass[5];
        k.inverse_mass[18] = k.inverse_mass[6];
        k.inverse_mass[19] = k.inverse_mass[7];
        k.inverse_mass[20] = k.inverse_mass[8];
        k.inverse_mass[21] = k.inverse_mass[9];
        k.inverse_mass[22] = k.inverse_mass[10];
        k.inverse_mass[23] = k.inverse_mass[11];
        k.inverse_mass[24] = k.mass[0];
        k.inverse_mass[25] = k.inverse_mass[1];
        k.inverse_mass[26] = k.inverse_mass[2];
        k.inverse_mass[27] = k.inverse_mass[3];
        k.inverse_mass[28] = k.inverse_mass[4];
        k.inverse_mass[29] = k.inverse_mass[5];
        k.inverse_mass[30] = k.inverse_mass[6];
        k.inverse_mass[31] = k.inverse_mass[7];
        k.inverse_mass[32] = k.inverse_mass[8];
        k.inverse_mass[33] = k.inverse_mass[9];
        k.inverse_mass[34] = k.inverse_mass[10];
        k.inverse_mass[35] = k.inverse_mass[11];
        for (const real& inverse : k.inverse_mass)
            if (!lobatto::is_finite(inverse)) return Status::singular_mass;
        if (!lobatto::is_finite(h)) return Status::not_finite;
        return Status::ok;
    }

    // (D3) Hamiltonian H(q, p) = p^T M^-1 p / 2 + V(q); q, p: n.
    template <class given, class number>
    static number energy(const CoefficientsOf<given>& k, const number* q, const number* p) {
        number sum = number(0);
        for (int i = 0; i < coordinates; ++i) sum += p[i] * (real(0.5) * k.inverse_mass[i] * p[i]);
        for (int r = 0; r < 66; ++r) {  // element_1
            const auto x0 = q[element_1_x[r * 6 + 0]];
            const auto x1 = q[element_1_x[r * 6 + 1]];
            const auto x2 = q[element_1_x[r * 6 + 2]];
            const auto x3 = q[element_1_x[r * 6 + 3]];
            const auto x4 = q[element_1_x[r * 6 + 4]];
            const auto x5 = q[element_1_x[r * 6 + 5]];
            const auto a0 = element_1_a[0 + r];
            const auto t1 = x0 - x1;
            const auto t2 = x2 - x3;
            const auto t3 = x4 - x5;
            sum += a0 * lobatto::sqrt(1.0 / (t1 * t1 + t2 * t2 + t3 * t3));
        }
        sum += 0.0;
        return sum;
    }

    // (D2) p = dL/dq' = M q'; n each.
    template <class given, class number>
    static void momentum(const CoefficientsOf<given>& k, const number* velocity, number* p) {
        for (int i = 0; i < coordinates; ++i) p[i] = k.mass[i] * velocity[i];
    }

    // (D2) q' = M^-1 p; n each.
    template <class given, class number>
    static void velocity(const CoefficientsOf<given>& k, const number* p, number* velocity) {
        for (int i = 0; i < coordinates; ++i) velocity[i] = k.inverse_mass[i] * p[i];
    }

    // (D1) At one node: W = M^-1 grad V(q), n, and S = the entries of M^-1 V''(q) listed in entry_row, entry_column.
    template <class given, class number>
    static void node(const CoefficientsOf<given>& k, const number* q, number* W, number* S) {
        for (int i = 0; i < coordinates; ++i) W[i] = number(0);
        for (int e = 0; e < entries; ++e) S[e] = number(0);
        for (int r = 0; r < 66; ++r) {  // element_1
            const int i0 = element_1_x[r * 6 + 0];
            const auto x0 = q[i0];
            const int i1 = element_1_x[r * 6 + 1];
            const auto x1 = q[i1];
            const int i2 = element_1_x[r * 6 + 2];
            const auto x2 = q[i2];
            const int i3 = element_1_x[r * 6 + 3];
            const auto x3 = q[i3];
            const int i4 = element_1_x[r * 6 + 4];
            const auto x4 = q[i4];
            const int i5 = element_1_x[r * 6 + 5];
            const auto x5 = q[i5];
            const auto a0 = element_1_a[0 + r];
            const auto t1 = x0 - x1;
            const auto t2 = t1 * t1;
            const auto t3 = x2 - x3;
            const auto t4 = t3 * t3;
            const auto t5 = x4 - x5;
            const auto t6 = t5 * t5;
            const auto t7 = 1.0 / (t2 + t4 + t6);
            const auto t8 = lobatto::sqrt(t7);
            const auto t9 = a0 * (t7 * t8);
            const auto t10 = -t9;
            const auto t11 = t10 * t1;
            W[i0] += t11;
            W[i1] -= t11;
            const auto t12 = t10 * t3;
            W[i2] += t12;
            W[i3] -= t12;
            const auto t13 = t10 * t5;
            W[i4] += t13;
            W[i5] -= t13;
            const auto t14 = (3.0 * a0) * ((t7 * t7) * t8);
            const auto t15 = t14 * t2 + t10;
            S[i0 * 36 + i0] += t15;
            const auto t16 = -t14;
            const auto t17 = t9 + t16 * t2;
            S[i0 * 36 + i1] += t17;
            const auto t18 = t14 * t1;
            const auto t19 = t18 * t3;
            S[i0 * 36 + i2] += t19;
            const auto t20 = t16 * t1;
            const auto t21 = t20 * t3;
            S[i0 * 36 + i3] += t21;
            const auto t22 = t18 * t5;
            S[i0 * 36 + i4] += t22;
            const auto t23 = t20 * t5;
            S[i0 * 36 + i5] += t23;
            S[i1 * 36 + i0] += t17;
            S[i1 * 36 + i1] += t15;
            S[i1 * 36 + i2] += t21;
            S[i1 * 36 + i3] += t19;
            S[i1 * 36 + i4] += t23;
            S[i1 * 36 + i5] += t22;
            S[i2 * 36 + i0] += t19;
            S[i2 * 36 + i1] += t21;
            const auto t24 = t14 * t4 + t10;
            S[i2 * 36 + i2] += t24;
            const auto t25 = t9 + t16 * t4;
            S[i2 * 36 + i3] += t25;
            const auto t26 = t3 * t5;
            const auto t27 = t26 * t14;
            S[i2 * 36 + i4] += t27;
            const auto t28 = t26 * t16;
            S[i2 * 36 + i5] += t28;
            S[i3 * 36 + i0] += t21;
            S[i3 * 36 + i1] += t19;
            S[i3 * 36 + i2] += t25;
            S[i3 * 36 + i3] += t24;
            S[i3 * 36 + i4] += t28;
            S[i3 * 36 + i5] += t27;
            S[i4 * 36 + i0] += t22;
            S[i4 * 36 + i1] += t23;
            S[i4 * 36 + i2] += t27;
            S[i4 * 36 + i3] += t28;
            const auto t29 = t14 * t6 + t10;
            S[i4 * 36 + i4] += t29;
            const auto t30 = t9 + t16 * t6;
            S[i4 * 36 + i5] += t30;
            S[i5 * 36 + i0] += t23;
            S[i5 * 36 + i1] += t22;
            S[i5 * 36 + i2] += t28;
            S[i5 * 36 + i3] += t27;
            S[i5 * 36 + i4] += t30;
            S[i5 * 36 + i5] += t29;
        }
        for (int i = 0; i < coordinates; ++i) W[i] *= k.inverse_mass[i];
        for (int e = 0; e < entries; ++e) S[e] *= k.inverse_mass[entry_row[e]];
    }

    // (D1) W = M^-1 grad V(q) alone; n.
    template <class given, class number>
    static void minus_acceleration(const CoefficientsOf<given>& k, const number* q, number* W) {
        for (int i = 0; i < coordinates; ++i) W[i] = number(0);
        for (int r = 0; r < 66; ++r) {  // element_1
            const int i0 = element_1_x[r * 6 + 0];
            const auto x0 = q[i0];
            const int i1 = element_1_x[r * 6 + 1];
            const auto x1 = q[i1];
            const int i2 = element_1_x[r * 6 + 2];
            const auto x2 = q[i2];
            const int i3 = element_1_x[r * 6 + 3];
            const auto x3 = q[i3];
            const int i4 = element_1_x[r * 6 + 4];
            const auto x4 = q[i4];
            const int i5 = element_1_x[r * 6 + 5];
            const auto x5 = q[i5];
            const auto a0 = element_1_a[0 + r];
            const auto t1 = x0 - x1;
            const auto t2 = x2 - x3;
            const auto t3 = x4 - x5;
            const auto t4 = 1.0 / (t1 * t1 + t2 * t2 + t3 * t3);
            const auto t5 = -(a0 * (t4 * lobatto::sqrt(t4)));
            const auto t6 = t5 * t1;
            W[i0] += t6;
            W[i1] -= t6;
            const auto t7 = t5 * t2;
            W[i2] += t7;
            W[i3] -= t7;
            const auto t8 = t5 * t3;
            W[i4] += t8;
            W[i5] -= t8;
        }
        for (int i = 0; i < coordinates; ++i) W[i] *= k.inverse_mass[i];
    }
};

}  // namespace lobatto::kernels
