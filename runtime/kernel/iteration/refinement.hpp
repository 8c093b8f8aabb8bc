// SPDX-License-Identifier: MIT
// The stage equations of one separable system in DoubleDouble, by iterative refinement: solved in double, then
// corrected by their residual in DoubleDouble (J. H. Wilkinson 1963).
//
// Formula numbers (D..) refer to docs/derivation.md. With X the solution in double and the residual (D51)
//     r = P (q + h c v) - h^2 P A (W(X) - D X) - X,
// computed in DoubleDouble, the correction d solves d = r - h^2 P A (S - D) d, S = dW/dq. It is as small as rounding of
// double, so that double is enough for it, and W(X + d) = W(X) + S d errs by d^2, which is rounding of DoubleDouble. So
// a step evaluates forces in DoubleDouble once, as a rule.
#ifndef LOBATTO_KERNEL_REFINEMENT_HPP
#define LOBATTO_KERNEL_REFINEMENT_HPP

#include <type_traits>

#include "../base/contract.hpp"
#include "../base/double_double.hpp"
#include "../base/numbers.hpp"
#include "../base/pack.hpp"
#include "fixed_point.hpp"

namespace lobatto {

// A table of a kernel, rounded to double.
template <int count>
struct RoundedTable {
    double values[count > 0 ? count : 1]{};
    constexpr explicit RoundedTable(const DoubleDouble* from) {
        for (int i = 0; i < count; ++i) values[i] = from[i].high;
    }
    constexpr double operator[](int i) const { return values[i]; }
};

// The kernel K in double.
template <class K>
struct Rounded : K {
    using real = double;
    using Values = typename K::template CoefficientsOf<double>;
    struct Coefficients : Values {
        double constant_part[K::entries > 0 ? K::entries : 1];  // of S
    };
    static constexpr RoundedTable<K::points> c{K::c}, b{K::b};
    static constexpr RoundedTable<(K::points - 2) * (K::points - 2)> A{K::A};
    static constexpr RoundedTable<(K::points - 2) * K::points> E{K::E};

    static Coefficients rounded(const typename K::Coefficients& k) {
        Coefficients result{};
        if constexpr (K::diagonal_part) {
            DoubleDouble part[K::entries];
            K::quadratic_part(k, part);
            for (int e = 0; e < K::entries; ++e) result.constant_part[e] = part[e].high;
        }
        if constexpr (!std::is_empty_v<Values>) {
            constexpr int size = sizeof(Values) / sizeof(double);
            static_assert(sizeof(k) == size * sizeof(DoubleDouble));
            const auto* const from = reinterpret_cast<const DoubleDouble*>(&k);
            auto* const to = reinterpret_cast<double*>(static_cast<Values*>(&result));
            for (int i = 0; i < size; ++i) to[i] = from[i].high;
        }
        return result;
    }
    static void quadratic_part(const Coefficients& k, double* S) {
        for (int e = 0; e < K::entries; ++e) S[e] = k.constant_part[e];
    }
};

template <class K>
struct Refinement {
    using Rough = Rounded<K>;
    using Iteration = FixedPoint<Rough>;
    using Fine = FixedPoint<K>;
    using V = typename Iteration::V;
    static constexpr int n = Iteration::n, s = Iteration::s, m = Iteration::m, parts = Iteration::parts,
                         width = Iteration::width, entries = Iteration::entries;
    static constexpr bool absorbs = Iteration::absorbs;
    static constexpr int refinement_limit = 3, correction_limit = 24;
    static constexpr double small = 0x1p-48;  // of a position: a correction whose square is rounding

    Iteration rough;
    typename Rough::Coefficients coefficients{};

    void prepare(const typename K::Coefficients& k, DoubleDouble step) {
        coefficients = Rough::rounded(k);
        rough.prepare(coefficients, step.high);
    }

    // a.Y the nodes, a.carried what W is there, a.rate as FixedPoint has it. False: not solved.
    bool solve(const typename K::Coefficients& k, Fine& fine, DoubleDouble time, const DoubleDouble* q,
               const DoubleDouble* u, typename Fine::Arrays& a) {
        if (!fine.usable) return false;
        recall(fine);
        double position[n], velocity[n], scale[n];
        for (int c = 0; c < n; ++c) {
            position[c] = q[c].high;
            velocity[c] = u[c].high;
            scale[c] = 1 / (__builtin_fabs(position[c]) + __builtin_fabs(rough.h * velocity[c]) +
                            std::numeric_limits<double>::min());
        }
        V X[parts * n], ignored[parts * n], S[parts * entries], r[parts * n], d[parts * n];
        rough.tolerance = 0;
        const bool found = rough.workspace.with([&](typename Iteration::Arrays& inner) {
            if (!rough.solve(coefficients, time.high, position, velocity, inner)) return false;
            for (int i = 0; i < parts * n; ++i) X[i] = inner.Y[i];
            return true;
        });
        if (!found) return false;
        fine.evaluations = DoubleDouble(rough.evaluations) + 1.0;
        fine.increment = rough.increment;
        for (int p = 0; p < parts; ++p)
            Formulas<Rough>::node(coefficients, V(time.high) + rough.node_time[p], X + p * n, ignored + p * n,
                                  S + p * entries);
        using Wide = typename Fine::V;
        for (int c = 0; c < n; ++c) {
            a.rate[c] = fused(-fine.h * K::b[0], fine.w[c * s + s - 1], u[c]);
            for (int p = 0; p < parts; ++p) {
                const auto& map = fine.map_of(c);
                a.base[p * n + c] = fused(map.on_velocity[p], Wide(a.rate[c]), map.on_position[p] * Wide(q[c]));
                a.X[p * n + c] = of_parts(X[p * n + c], V(0.0));
            }
        }
        for (int turn = 0; turn < refinement_limit; ++turn) {
            evaluate(k, fine, time, a);
            for (int c = 0; c < n; ++c)
                for (int p = 0; p < parts; ++p)
                    r[p * n + c] = high_part(Fine::template sum_of<m>(a.base[p * n + c], fine.map_of(c).inner, p,
                                                                      a.flat + c * parts * width) -
                                             a.X[p * n + c]);
            if (!correct(r, S, d)) return false;
            V worst = V(0.0);
            for (int p = 0; p < parts; ++p)
                for (int c = 0; c < n; ++c) worst = maximum(worst, fabs(d[p * n + c]) * V(scale[c]));
            const double size = largest(worst);
            if (!(size < 1)) return false;
            for (int i = 0; i < parts * n; ++i) a.Y[i] = a.X[i] + of_parts(d[i], V(0.0));
            if (size <= small) {
                settle(S, d, a);
                return true;
            }
            for (int i = 0; i < parts * n; ++i) a.X[i] = a.Y[i];
        }
        return false;
    }

private:
    // The memory of the step before, from that of `fine`.
    void recall(const Fine& fine) {
        rough.has_history = fine.has_history;
        for (int i = 0; i < n * s; ++i) {
            rough.w[i] = fine.w[i].high;
            if constexpr (absorbs) rough.rest[i] = fine.rest[i].high;
        }
    }

    // a.W = W(X), and a.flat = W - D X, node by node.
    LOBATTO_INLINE void evaluate(const typename K::Coefficients& k, const Fine& fine, DoubleDouble time,
                                 typename Fine::Arrays& a) const {
        using Wide = typename Fine::V;
        for (int p = 0; p < parts; ++p) {
            const Wide* const X = a.X + p * n;
            Formulas<K>::minus_acceleration(k, Wide(time) + fine.node_time[p], X, a.W + p * n);
            for (int c = 0; c < n; ++c) {
                Wide r = a.W[p * n + c];
                if constexpr (absorbs) r = fused(-Wide(fine.diagonal[c]), X[c], r);
                lay_flat<1>(&r, 1, a.flat + (c * parts + p) * width);
            }
        }
    }

    // S d, less D d where D is in the map.
    LOBATTO_INLINE void times_hessian(const V* S, const V* d, int p, bool less_diagonal, V* product) const {
        for (int c = 0; c < n; ++c) {
            product[c] = V(0.0);
            if constexpr (absorbs) {
                if (less_diagonal) product[c] = -V(rough.diagonal[c]) * d[p * n + c];
            }
        }
        for (int e = 0; e < K::entries; ++e)
            product[K::entry_row[e]] =
                fused(S[p * entries + e], d[p * n + K::entry_column[e]], product[K::entry_row[e]]);
    }

    // d = r - h^2 P A (S - D) d, by fixed-point iteration.
    bool correct(const V* r, const V* S, V* d) const {
        double flat[n * parts * width];
        for (int i = 0; i < parts * n; ++i) d[i] = r[i];
        double before = std::numeric_limits<double>::max();
        for (int turn = 0; turn < correction_limit; ++turn) {
            for (int p = 0; p < parts; ++p) {
                V product[n];
                times_hessian(S, d, p, true, product);
                for (int c = 0; c < n; ++c) lay_flat<1>(&product[c], 1, flat + (c * parts + p) * width);
            }
            V change = V(0.0), size = V(0.0);
            for (int c = 0; c < n; ++c)
                for (int p = 0; p < parts; ++p) {
                    V next = r[p * n + c];
                    for (int j = 0; j < m; ++j)
                        next = fused(rough.map_of(c).inner[j][p], V(flat[c * parts * width + j]), next);
                    change = maximum(change, fabs(next - d[p * n + c]));
                    size = maximum(size, fabs(next));
                    d[p * n + c] = next;
                }
            const double moved = largest(change);
            if (moved <= 0x1p-50 * largest(size)) return true;
            if (turn > 3 && !(moved < 0.8 * before)) return false;
            before = moved;
        }
        return false;
    }

    // a.carried = W(X) + S d.
    LOBATTO_INLINE void settle(const V* S, const V* d, typename Fine::Arrays& a) const {
        for (int p = 0; p < parts; ++p) {
            V product[n];
            times_hessian(S, d, p, false, product);
            for (int c = 0; c < n; ++c) a.carried[p * n + c] = a.W[p * n + c] + of_parts(product[c], V(0.0));
        }
    }
};

template <class K>
struct RefinementOf<K, DoubleDouble> {
    static constexpr bool exists = true;
    using type = Refinement<K>;
};

}  // namespace lobatto

#endif
