// SPDX-License-Identifier: MIT
// What emitted kernels stand on: elementary functions, small dense solves, and the step loop. C++17, no allocation.
//
// An emitted kernel K is a struct of static functions, the formulas of one scene; Stepper<K> below is its life in time.
// Formula numbers (D..) refer to docs/derivation.md.
#ifndef LOBATTO_KERNEL_HPP
#define LOBATTO_KERNEL_HPP

#include <cmath>
#include <cstdint>
#include <limits>
#ifdef LOBATTO_USE_FLOAT128
#include <quadmath.h>
#endif

namespace lobatto {

// The outcome of preparing or stepping; the same values as lobatto_status in kernel_abi.h.
enum class Status : std::int32_t {
    ok = 0,
    not_converged = 1,
    not_finite = 2,
    singular_jacobian = 3,
    singular_mass = 4,
    time_stands_still = 5
};

// ---------------------------------------------------------------------------------------------------------------------
// Numbers
// ---------------------------------------------------------------------------------------------------------------------

template <class real>
struct Limits {
    static constexpr real epsilon = std::numeric_limits<real>::epsilon();
    static constexpr real smallest = std::numeric_limits<real>::min();
    static constexpr real largest = std::numeric_limits<real>::max();
    static constexpr real root_epsilon = sizeof(real) == 4   ? real(1.0 / 4096)           // 2^-12
                                         : sizeof(real) == 8 ? real(1.0 / 134217728)      // 2^-27
                                                             : real(1.0 / 8589934592.0);  // 2^-33
};

using std::acos;
using std::asin;
using std::atan;
using std::cosh;
using std::exp;
using std::fabs;
using std::log;
using std::pow;
using std::sinh;
using std::sqrt;
using std::tan;
using std::tanh;

#ifdef LOBATTO_USE_FLOAT128
template <>
struct Limits<__float128> {
    static constexpr __float128 epsilon = __float128(1) / (__float128(1ull << 56) * __float128(1ull << 56));  // 2^-112
    static constexpr __float128 smallest = __float128(std::numeric_limits<long double>::min());
    static constexpr __float128 largest = __float128(std::numeric_limits<long double>::max());
    static constexpr __float128 root_epsilon = __float128(1) / __float128(1ull << 57);
};
inline __float128 acos(__float128 x) {
    return acosq(x);
}
inline __float128 asin(__float128 x) {
    return asinq(x);
}
inline __float128 atan(__float128 x) {
    return atanq(x);
}
inline __float128 cos(__float128 x) {
    return cosq(x);
}
inline __float128 cosh(__float128 x) {
    return coshq(x);
}
inline __float128 exp(__float128 x) {
    return expq(x);
}
inline __float128 fabs(__float128 x) {
    return fabsq(x);
}
inline __float128 log(__float128 x) {
    return logq(x);
}
inline __float128 pow(__float128 x, __float128 y) {
    return powq(x, y);
}
inline __float128 sin(__float128 x) {
    return sinq(x);
}
inline __float128 sinh(__float128 x) {
    return sinhq(x);
}
inline __float128 sqrt(__float128 x) {
    return sqrtq(x);
}
inline __float128 tan(__float128 x) {
    return tanq(x);
}
inline __float128 tanh(__float128 x) {
    return tanhq(x);
}
#endif

inline float sin(float x) {
    return std::sin(x);
}
inline float cos(float x) {
    return std::cos(x);
}
inline long double sin(long double x) {
    return std::sin(x);
}
inline long double cos(long double x) {
    return std::cos(x);
}

// Sine and cosine of one argument together.
template <class real>
inline void sincos(real x, real& sine, real& cosine) {
    sine = sin(x);
    cosine = cos(x);
}

// The same for double, up to |x| < 2^19 pi/2: reduction by pi/2 in three parts (33 + 33 + 53 bits, so that k * part is
// exact for |k| < 2^20 in the first two), kept as a sum of two doubles, then the minimax polynomials of degree 13 and
// 14 on
// [-pi/4, pi/4] published with FDLIBM. Measured: at most 0.77 ulp for |x| < 10^4 and 0.87 beyond, but 1.07 at some of
// the doubles nearest the multiples of pi/2. Uses no FMA, so that every processor and compiler gives the same bits.
inline void sincos(double x, double& sine, double& cosine) {
    if (!(fabs(x) < 823549.0)) {
        sine = std::sin(x);
        cosine = std::cos(x);
        return;
    }
    constexpr double shift = 6755399441055744.0;  // 1.5 * 2^52: adding it rounds to an integer
    const double shifted = x * 0.63661977236758134308 + shift;
    const double k = shifted - shift;
    const std::int64_t quadrant = static_cast<std::int64_t>(k);
    const double r1 = x - k * 1.57079632673412561417e+00;  // exact: the part has 33 bits
    const double t = k * 6.07710050630396597660e-11;       // exact: the next 33 bits
    const double r2 = r1 - t;
    const double back = r1 - r2;
    const double lost = (back - t) + (r1 - (r2 + back));       // what r1 - t lost
    const double low = lost - k * 2.02226624879595063154e-21;  // the last 53 bits; the reduced argument is r2 + low
    // Polynomials in Estrin's order: their latency is what a step waits for, and `low` is ready before they are.
    const double z = r2 * r2;
    const double z2 = z * z;
    const double z4 = z2 * z2;
    const double s =
        (8.33333333332248946124e-03 + z * -1.98412698298579493134e-04) +
        (z2 * (2.75573137070700676789e-06 + z * -2.50507602534068634195e-08) + z4 * 1.58969099521155010221e-10);
    const double cube = z * r2;
    const double sixth = cube * 1.66666666666666324348e-01;
    const double sine_reduced = r2 - (sixth - (cube * (z * s) + (low - 0.5 * (z * low))));
    const double c = (4.16666666666666019037e-02 + z * -1.38888888888741095749e-03) +
                     (z2 * (2.48015872894767294178e-05 + z * -2.75573143513906633035e-07) +
                      z4 * (2.08757232129817482790e-09 + z * -1.13596475577881948265e-11));
    const double half = 0.5 * z;
    const double rest = 1.0 - half;
    const double cosine_reduced = rest + (((1.0 - rest) - half) + (z2 * c - low * (r2 - sixth)));
    const bool swap = (quadrant & 1) != 0;
    const double a = swap ? cosine_reduced : sine_reduced;
    const double b = swap ? sine_reduced : cosine_reduced;
    sine = (quadrant & 2) != 0 ? -a : a;
    cosine = ((quadrant + 1) & 2) != 0 ? -b : b;
}

// Sine and cosine alone; for double half of the pair above, so that a lone sine has the same bits.
inline double sin(double x) {
    double sine, cosine;
    sincos(x, sine, cosine);
    return sine;
}
inline double cos(double x) {
    double sine, cosine;
    sincos(x, sine, cosine);
    return cosine;
}

template <class... reals>
inline bool is_finite(reals... x) {
    return ((x - x == reals(0)) && ...);
}

// ---------------------------------------------------------------------------------------------------------------------
// Small dense systems: A X = B with A of size x size and B of size x columns, both row-major and overwritten; X ends in
// B. Gaussian elimination with partial pivoting. False when a pivot is zero or not finite.
// ---------------------------------------------------------------------------------------------------------------------
template <int size, int columns, class real>
inline bool solve(real* A, real* B) {
    for (int k = 0; k < size; ++k) {
        int pivot = k;
        for (int i = k + 1; i < size; ++i) {
            if (fabs(A[i * size + k]) > fabs(A[pivot * size + k])) pivot = i;
        }
        if (pivot != k) {
            for (int j = k; j < size; ++j) {
                const real swapped = A[k * size + j];
                A[k * size + j] = A[pivot * size + j];
                A[pivot * size + j] = swapped;
            }
            for (int j = 0; j < columns; ++j) {
                const real swapped = B[k * columns + j];
                B[k * columns + j] = B[pivot * columns + j];
                B[pivot * columns + j] = swapped;
            }
        }
        const real inverse = real(1) / A[k * size + k];
        if (!is_finite(inverse)) return false;
        for (int i = k + 1; i < size; ++i) {
            const real factor = A[i * size + k] * inverse;
            if (factor == real(0)) continue;
            for (int j = k + 1; j < size; ++j) A[i * size + j] -= factor * A[k * size + j];
            for (int j = 0; j < columns; ++j) B[i * columns + j] -= factor * B[k * columns + j];
        }
    }
    for (int k = size - 1; k >= 0; --k) {
        for (int j = 0; j < columns; ++j) {
            real sum = B[k * columns + j];
            for (int i = k + 1; i < size; ++i) sum -= A[k * size + i] * B[i * columns + j];
            B[k * columns + j] = sum / A[k * size + k];
        }
    }
    return true;
}

// S = M^-1 V'' of one node from its stored entries to a full n x n matrix.
template <class K>
inline void expand_entries(const typename K::real* entries, typename K::real* S) {
    for (int i = 0; i < K::coordinates * K::coordinates; ++i) S[i] = typename K::real(0);
    for (int e = 0; e < K::entries; ++e) S[K::entry_row[e] * K::coordinates + K::entry_column[e]] = entries[e];
}

// What one step adds, in (q, u), from the S of the s nodes: E = T - I with T the tangent map (D24). E: 2n x (2n + 1);
// its last column is the image of the constant acceleration W0 when S does not depend on q, that is, the shift of a
// linear system with forces at q = 0. E is small for a small step and keeps its digits there, T would not.
template <class K>
inline bool increment_of_step(typename K::real h, const typename K::real* S, const typename K::real* W0,
                              typename K::real* E) {
    using real = typename K::real;
    constexpr int n = K::coordinates, s = K::points, m = s - 2, N = n * m, columns = 2 * n + 1;
    real v[n * columns], X[(N > 0 ? N : 1) * columns], J[N > 0 ? N * N : 1];
    const auto unit = [](int k, int column) { return k == column ? real(1) : real(0); };
    // force(node, values): M^-1 (V'' values + V'(0)) for column c of the values
    const auto force = [&](int node, const real* values, int k, int column) {
        real sum = column == 2 * n ? W0[k] : real(0);
        for (int l = 0; l < n; ++l) sum += S[(node * n + k) * n + l] * values[l * columns + column];
        return sum;
    };
    real q0[n * columns];
    for (int k = 0; k < n; ++k)
        for (int c = 0; c < columns; ++c) q0[k * columns + c] = unit(k, c);
    for (int k = 0; k < n; ++k)
        for (int c = 0; c < columns; ++c) v[k * columns + c] = unit(k + n, c) - h * K::b[0] * force(0, q0, k, c);
    for (int i = 0; i < m; ++i)
        for (int k = 0; k < n; ++k)
            for (int c = 0; c < columns; ++c) {
                real sum = q0[k * columns + c] + h * K::c[i + 1] * v[k * columns + c];
                if (c == 2 * n)
                    for (int j = 0; j < m; ++j) sum -= h * h * K::A[i * m + j] * W0[k];
                X[(i * n + k) * columns + c] = sum;
            }
    for (int i = 0; i < m; ++i)
        for (int j = 0; j < m; ++j)
            for (int k = 0; k < n; ++k)
                for (int l = 0; l < n; ++l)
                    J[(i * n + k) * N + j * n + l] =
                        (i == j && k == l ? real(1) : real(0)) + h * h * K::A[i * m + j] * S[((j + 1) * n + k) * n + l];
    if constexpr (N > 0) {
        if (!solve<N, columns>(J, X)) return false;
    }
    real* const dq = E;
    real* const du = E + n * columns;
    real q1[n * columns];
    for (int k = 0; k < n; ++k)
        for (int c = 0; c < columns; ++c) {
            real position = h * v[k * columns + c];
            real rate = -(h * K::b[0] * force(0, q0, k, c));
            for (int j = 0; j < m; ++j) {
                const real w = force(j + 1, X + j * n * columns, k, c);
                position -= h * h * (K::b[j + 1] * (real(1) - K::c[j + 1])) * w;
                rate -= h * K::b[j + 1] * w;
            }
            dq[k * columns + c] = position;
            du[k * columns + c] = rate;
            q1[k * columns + c] = q0[k * columns + c] + position;
        }
    for (int k = 0; k < n; ++k)
        for (int c = 0; c < columns; ++c) du[k * columns + c] -= h * K::b[s - 1] * force(s - 1, q1, k, c);
    return true;
}

// From (q, u) to (q, p): rows of u and columns of u are multiplied by M and M^-1; the identity stays. T: 2n x (2n + 1).
template <class K>
inline void to_momentum(const typename K::Coefficients& k, typename K::real* T) {
    using real = typename K::real;
    constexpr int n = K::coordinates, columns = 2 * n + 1;
    real column[n], image[n];
    for (int c = 0; c < columns; ++c) {
        for (int i = 0; i < n; ++i) column[i] = T[(n + i) * columns + c];
        K::momentum(k, column, image);
        for (int i = 0; i < n; ++i) T[(n + i) * columns + c] = image[i];
    }
    // T M^-1 row by row: M is symmetric, so a row times M^-1 is M^-1 applied to the row.
    for (int r = 0; r < 2 * n; ++r) {
        K::velocity(k, T + r * columns + n, image);
        for (int i = 0; i < n; ++i) T[r * columns + n + i] = image[i];
    }
}

inline float fused(float a, float b, float c) {
    return std::fma(a, b, c);
}
inline double fused(double a, double b, double c) {
    return std::fma(a, b, c);
}
inline long double fused(long double a, long double b, long double c) {
    return std::fma(a, b, c);
}
#ifdef LOBATTO_USE_FLOAT128
inline __float128 fused(__float128 a, __float128 b, __float128 c) {
    return fmaq(a, b, c);
}
#endif

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
                    // tr E + det E, the terms and their rounding, summed without loss (TwoSum).
                    const real terms[6] = {a, d, ad, -bc, fused(a, d, -ad), -fused(b, c, -bc)};
                    real sum = real(0), lost = real(0);
                    for (const real term : terms) {
                        const real next = sum + term, back = next - sum;
                        lost += (sum - (next - back)) + (term - back);
                        sum = next;
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
    real W0[n], entries[K::entries > 0 ? K::entries : 1], S[s * n * n];
    K::node(k, origin, W0, entries);
    for (int i = 0; i < s; ++i) expand_entries<K>(entries, S + i * n * n);
    if (!increment_of_step<K>(h, S, W0, k.Phi_minus_I)) return Status::singular_jacobian;
    to_momentum<K>(k, k.Phi_minus_I);
    real sum = real(0);
    for (int i = 0; i < 2 * n * (2 * n + 1); ++i) sum += k.Phi_minus_I[i] - k.Phi_minus_I[i];
    return sum == real(0) ? Status::ok : Status::not_finite;
}

// (q1, p1) = (q, p) + E (q, p) + shift, E = Phi - I; E: 2n x (2n + 1), the shift its last column.
template <int n, class real>
inline void apply_map(const real* E, const real* q, const real* p, real* q1, real* p1) {
    for (int r = 0; r < 2 * n; ++r) {
        const real* const row = E + r * (2 * n + 1);
        real sum = row[2 * n];
        for (int k = 0; k < n; ++k) sum += row[k] * q[k];
        for (int k = 0; k < n; ++k) sum += row[n + k] * p[k];
        (r < n ? q1[r] : p1[r - n]) = (r < n ? q[r] : p[r - n]) + sum;
    }
}

// ---------------------------------------------------------------------------------------------------------------------
// The step loop
// ---------------------------------------------------------------------------------------------------------------------

// One trajectory of kernel K. Usage: prepare, start, then step as often as wanted. Not thread-safe; copy freely.
template <class K>
struct Stepper {
    using real = typename K::real;
    static constexpr int n = K::coordinates;
    static constexpr int s = K::points;
    static constexpr int N = K::unknowns;
    static constexpr int room = N > 0 ? N : 1;
    static constexpr int iteration_limit = 40;

    typename K::Coefficients coefficients{};  // values of stage parameter and step size
    real step_size{};                         // h
    real start_time{};
    std::int64_t steps{};       // since start: the time is start_time + steps * h
    real q[n]{};                // position
    real u[n]{};                // M^-1 p; for a linear system p itself
    real W[s * n]{};            // accelerations M^-1 grad V at the nodes of the last step; the last n at q
    bool has_history{};         // W holds a whole step
    std::int32_t iterations{};  // of the last step
    real increment{};           // last Newton increment of the last step, relative to its displacement
    real Q[room]{};             // interior positions of the last step

    Status prepare(const typename K::Parameters& parameters, real h) {
        step_size = h;
        has_history = false;
        return K::prepare(parameters, h, coefficients);
    }

    Status start(real time, const real* position, const real* momentum) {
        start_time = time;
        steps = 0;
        has_history = false;
        real sum = time;
        for (int k = 0; k < n; ++k) {
            q[k] = position[k];
            sum += position[k] - position[k] + (momentum[k] - momentum[k]);
        }
        if constexpr (K::linear) {
            for (int k = 0; k < n; ++k) u[k] = momentum[k];
        } else {
            K::velocity(coefficients, momentum, u);
            K::acceleration(coefficients, q, W + (s - 1) * n);
            for (int k = 0; k < n; ++k) sum += W[(s - 1) * n + k] - W[(s - 1) * n + k];
        }
        return is_finite(sum) ? Status::ok : Status::not_finite;
    }

    real time() const { return start_time + real(steps) * step_size; }

    void momentum(real* p) const {
        if constexpr (K::linear) {
            for (int k = 0; k < n; ++k) p[k] = u[k];
        } else {
            K::momentum(coefficients, u, p);
        }
    }

    // One step. On failure the state is that of the last good step.
    Status step() {
        if (start_time + real(steps + 1) * step_size == time()) return Status::time_stands_still;
        if constexpr (K::linear) {
            real q1[n], p1[n];
            K::propagate(coefficients, q, u, q1, p1);
            return accept(q1, p1, q1);
        } else {
            real v[n], base[(s - 1) * n], nodes[room], W_nodes[room], q1[n], u1[n], W1[n];
            const real* const W0 = W + (s - 1) * n;
            K::drift(coefficients, q, u, W0, v, base);
            if constexpr (N > 0) {
                Status status = Status::not_converged;
                if (has_history) {
                    K::extrapolated_start(coefficients, base, W, nodes);
                    status = newton(v, W0, base, nodes, W_nodes);
                }
                if (status != Status::ok) {
                    K::simple_start(coefficients, base, W0, nodes);
                    status = newton(v, W0, base, nodes, W_nodes);
                }
                if (status != Status::ok) return status;
            }
            K::arrive(coefficients, base, W_nodes, q1);
            K::acceleration(coefficients, q1, W1);
            K::finish(coefficients, v, W_nodes, W1, u1);
            const Status status = accept(q1, u1, W1);
            if (status != Status::ok) return status;
            for (int k = 0; k < n; ++k) W[k] = W0[k];
            for (int i = 0; i < N; ++i) {
                W[n + i] = W_nodes[i];
                Q[i] = nodes[i];
            }
            for (int k = 0; k < n; ++k) W[(s - 1) * n + k] = W1[k];
            has_history = true;
            return Status::ok;
        }
    }

private:
    Status accept(const real* q1, const real* u1, const real* W1) {
        real sum = real(0);
        for (int k = 0; k < n; ++k) sum += (q1[k] - q1[k]) + (u1[k] - u1[k]) + (W1[k] - W1[k]);
        if (!(sum == real(0))) return Status::not_finite;
        for (int k = 0; k < n; ++k) {
            q[k] = q1[k];
            u[k] = u1[k];
        }
        ++steps;
        return Status::ok;
    }

    // Whether increments that no longer shrink are the rounding of what they are computed from: positions and
    // accelerations.
    bool is_rounding(const real* base, const real* nodes, const real* W_nodes, const real* S, const real* delta) const {
        for (int i = 0; i < s - 2; ++i) {
            real size[n];
            for (int k = 0; k < n; ++k) size[k] = fabs(W_nodes[i * n + k]);
            for (int e = 0; e < K::entries; ++e)
                size[K::entry_row[e]] += fabs(S[i * K::entries + e] * nodes[i * n + K::entry_column[e]]);
            for (int k = 0; k < n; ++k) {
                const real sum = fabs(nodes[i * n + k]) + fabs(base[i * n + k]) + step_size * step_size * size[k];
                if (!(fabs(delta[i * n + k]) <= real(64) * Limits<real>::epsilon * sum)) return false;
            }
        }
        return true;
    }

    // Newton's iteration for the interior positions (D14). Increments are measured against the displacement within the
    // step, with the rounding of the position as floor. Convergence is quadratic, e_next = C e^2, so the iteration
    // stops as soon as the NEXT increment would be below rounding; the accelerations are then carried to the final
    // positions to first order, which errs by the same e^2.
    Status newton(const real* v, const real* W0, const real* base, real* nodes, real* W_nodes) {
        if constexpr (N > 0) {
            constexpr real tolerance = Limits<real>::root_epsilon;
            constexpr real floor = Limits<real>::epsilon / tolerance;
            real S[(s - 2) * (K::entries > 0 ? K::entries : 1)], delta[room], inverse_scale[n];
            for (int k = 0; k < n; ++k) {
                const real scale = fabs(step_size * v[k]) + fabs(step_size * (step_size * W0[k])) + floor * fabs(q[k]);
                inverse_scale[k] = scale > Limits<real>::smallest ? real(1) / scale : real(0);
            }
            real previous = Limits<real>::largest;
            for (int iteration = 1; iteration <= iteration_limit; ++iteration) {
                for (int i = 0; i < s - 2; ++i)
                    K::node(coefficients, nodes + i * n, W_nodes + i * n, S + i * K::entries);
                iterations = iteration;
                if (!K::correction(coefficients, base, nodes, W_nodes, S, delta)) return Status::singular_jacobian;
                real e = real(0), sum = real(0);
                for (int i = 0; i < s - 2; ++i)
                    for (int k = 0; k < n; ++k) {
                        const real d = fabs(delta[i * n + k]);
                        real relative = d * inverse_scale[k];
                        // A coordinate at rest that only the others move: its own displacement is the measure.
                        if (inverse_scale[k] == real(0) && d > real(0)) relative = d / (d + fabs(nodes[i * n + k]));
                        e = relative > e ? relative : e;
                        sum += relative;
                    }
                for (int i = 0; i < N; ++i) nodes[i] += delta[i];
                increment = e;
                if (!is_finite(sum)) return Status::not_finite;
                const bool next_is_rounding =
                    e <= tolerance ||
                    (iteration > 1 && e < previous && (e / previous) * (e / previous) * e <= Limits<real>::epsilon);
                if (next_is_rounding ||
                    (iteration > 2 && e >= real(0.5) * previous && is_rounding(base, nodes, W_nodes, S, delta))) {
                    K::carry(coefficients, S, delta, W_nodes);
                    return Status::ok;
                }
                previous = e;
            }
            return Status::not_converged;
        } else {
            return Status::ok;
        }
    }
};

}  // namespace lobatto

#endif
