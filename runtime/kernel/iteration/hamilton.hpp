// SPDX-License-Identifier: MIT
// Iterations over nodes (iteration/galerkin.hpp) where V = dH/dP(Q, P) and F = -dH/dQ + forces are formulas (D62): no
// matrix is formed. One takes F, then P, then V; V is projected to be orthogonal to pi, and kappa absorbs the
// corresponding momentum, at the middle of the step.
#ifndef LOBATTO_KERNEL_HAMILTON_HPP
#define LOBATTO_KERNEL_HAMILTON_HPP

#include "../base/contract.hpp"
#include "../base/numbers.hpp"
#include "../base/pack.hpp"

namespace lobatto {

// Of a GalerkinFixedPoint. Arrays: its own, with P.
template <class Fixed>
struct HamiltonIteration {
    using T = typename Fixed::Number;
    using V = typename Fixed::V;
    using Arrays = typename Fixed::Arrays;
    using K = typename Fixed::Kernel;
    static constexpr int n = Fixed::n, parts = Fixed::parts;

    // Momenta at the nodes from predicted velocities, and the middle of the step.
    template <class Given, class Time>
    LOBATTO_INLINE static void begin(const Fixed& f, const Given& k, const Time& time, const T* q, Arrays& a) {
#pragma GCC unroll 8
        for (int part = 0; part < parts; ++part)
            Formulas<K>::momentum(k, V(time) + f.node_time[part], a.Q + part * n, a.v + part * n, a.P + part * n);
#pragma GCC unroll 8
        for (int c = 0; c < n; ++c)
            a.middle[c] = fused(T(real_of<T>(0.5)), Fixed::over_nodes(f.weight, a.v + c, n), q[c]);
    }

    // The new velocities, in place of Lv; the largest of what they lost, relative.
    template <class Given, class Time>
    LOBATTO_INLINE static T velocities(const Fixed& f, const Given& k, const Time& time, const T* p, T* kappa,
                                       Arrays& a) {
#pragma GCC unroll 8
        for (int part = 0; part < parts; ++part)
            Formulas<K>::force(k, V(time) + f.node_time[part], a.Q + part * n, a.v + part * n, a.P + part * n,
                               a.F + part * n);
#pragma GCC unroll 8
        for (int c = 0; c < n; ++c) {
            T* const flat = a.flat + c * parts * Fixed::width;
            lay_flat<parts>(a.F + c, n, flat);
#pragma GCC unroll 8
            for (int part = 0; part < parts; ++part) {
                V target = Fixed::sum_of(V(p[c]), f.momentum_map, part, flat);
                if constexpr (Fixed::has_kappa()) target = fused(f.legendre[part], V(kappa[c]), target);
                a.P[part * n + c] = target;
            }
        }
#pragma GCC unroll 8
        for (int part = 0; part < parts; ++part)
            Formulas<K>::velocity(k, V(time) + f.node_time[part], a.Q + part * n, a.P + part * n, a.Lv + part * n);
        if constexpr (Fixed::has_kappa())
            return correct(f, k, time, kappa, a);
        else
            return T(real_of<T>(0));
    }

private:
    template <class Given, class Time>
    LOBATTO_INLINE static T correct(const Fixed& f, const Given& k, const Time& time, T* kappa, Arrays& a) {
        T lost[n], d[n], worst = T(real_of<T>(0));
#pragma GCC unroll 8
        for (int c = 0; c < n; ++c) {
            lost[c] = -Fixed::over_nodes(f.on_legendre, a.Lv + c, n);
            worst = maximum(worst, fabs(lost[c]) * a.inverse_scale[c]);
        }
        Formulas<K>::momentum(k, time, a.middle, lost, d);
#pragma GCC unroll 8
        for (int c = 0; c < n; ++c) {
            kappa[c] += d[c];
#pragma GCC unroll 8
            for (int part = 0; part < parts; ++part) {
                a.Lv[part * n + c] = fused(f.legendre[part], V(lost[c]), a.Lv[part * n + c]);
                a.P[part * n + c] = fused(f.legendre[part], V(d[c]), a.P[part * n + c]);
            }
        }
        return worst;
    }
};

}  // namespace lobatto

#endif
