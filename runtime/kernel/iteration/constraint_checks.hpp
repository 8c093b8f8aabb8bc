// SPDX-License-Identifier: MIT
// Checks that a start keeps the constraints, and the end of a step that Newton's iteration has taken.
#ifndef LOBATTO_KERNEL_CONSTRAINT_CHECKS_HPP
#define LOBATTO_KERNEL_CONSTRAINT_CHECKS_HPP

#include "../base/contract.hpp"
#include "../base/numbers.hpp"
#include "../base/pack.hpp"
#include "constraint_rounding.hpp"
#include "galerkin_newton.hpp"

namespace lobatto {

template <class K>
struct ConstraintChecks : GalerkinNewton<K> {
    using Newton = GalerkinNewton<K>;
    using Newton::n, Newton::active, Newton::constraints, Newton::Z, Newton::r, Newton::coefficients, Newton::step_size,
        Newton::q, Newton::p;
    using typename Newton::real, typename Newton::Arrays;
    static constexpr int multiplier_room = constraints > 0 ? constraints : 1;

private:
    real longest_step{};  // of those that starts were for

    struct Masses {
        real of[K::mass_entries > 0 ? K::mass_entries : 1];
    };
    template <class Use>
    static void each_mass(const Masses& M, const Use& use) {
        for (int e = 0; e < K::mass_entries; ++e)
            if (K::mass_row[e] == K::mass_column[e] && M.of[e] != real(0)) use(K::mass_row[e], fabs(M.of[e]));
    }
    // How far positions go in a step; one that a constraint holds fixed, as far as the others, in the metric of the
    // mass.
    void way_in_step(const real& time, const real& h, const real* at, const real* v, real* way, Masses& M) const {
        real momentum_there[n], moved = real(0);  // sum M_kk (h v_k)^2
        Formulas<K>::legendre(coefficients, time, at, v, momentum_there, M.of);
        each_mass(M, [&](int k, real mass) { moved += mass * (h * v[k]) * (h * v[k]); });
        for (int k = 0; k < n; ++k) way[k] = fabs(h * v[k]);
        each_mass(M, [&](int k, real mass) { way[k] += sqrt(moved / mass); });
    }

    // To half of the digits of their sizes, or to the rounding of their terms.
    bool are_near_zero(const real* phi, const real* size, const real& time, const real* at) const {
        real rounding[multiplier_room] = {};
        raise_to_summands<K>(coefficients, time, at, rounding);
        for (int c = 0; c < constraints; ++c)
            if (!(fabs(phi[c]) <=
                  Limits<real>::root_epsilon * size[c] + real(128) * Limits<real>::epsilon * rounding[c]))
                return false;
        return true;
    }

protected:
    // Whether a start keeps the constraints, to half of the digits; v, mu: its velocity and multipliers. After a switch
    // it is what a whole step has left, however little of that step is to come.
    Status check_constraints(const real* v, const real* mu) {
        if constexpr (constraints > 0) {
            longest_step = maximum(longest_step, fabs(step_size));
            real phi[constraints], phi_t[constraints], G[K::constraint_entries], size[constraints], force[n], way[n];
            Masses M;
            Formulas<K>::constraint(coefficients, this->time(), q, phi, phi_t, G);
            way_in_step(this->time(), longest_step, q, v, way, M);
            for (int c = 0; c < constraints; ++c) size[c] = fabs(longest_step * phi_t[c]);
            for (int k = 0; k < n; ++k) force[k] = real(0);
            for (int e = 0; e < K::constraint_entries; ++e) {
                const int c = K::constraint_row[e], k = K::constraint_column[e];
                size[c] += fabs(G[e]) * (fabs(q[k]) + way[k]);
                force[k] += G[e] * mu[c];
            }
            if (!are_near_zero(phi, size, this->time(), q)) return Status::off_constraints;
            real largest = real(0), apart = real(0), pushed = real(0), Lv[n], Lq[n];
            Formulas<K>::slopes(coefficients, this->time(), q, v, Lv, Lq);
            for (int k = 0; k < n; ++k) {
                largest = maximum(fabs(p[k]), largest);
                apart = maximum(fabs(force[k]), apart);
                pushed = maximum(pushed, fabs(longest_step * Lq[k]));
            }
            const real rounding = real(64) * Limits<real>::epsilon * pushed;  // at rest steps leave that
            if (!(apart <= Limits<real>::root_epsilon * largest + rounding)) return Status::off_constraints;
        }
        return Status::ok;
    }

    // Whether positions at the end of the stages just solved keep the constraints, to half of the digits of the
    // positions, of the way, and of how far the forces of the step move them.
    bool keeps_constraints(const real* q1, const real* v, const real* phi, const real* phi_t, const real* G,
                           const Arrays& a) const {
        real size[multiplier_room], reach[n];
        Masses M;
        for (int c = 0; c < constraints; ++c) size[c] = fabs(step_size * phi_t[c]);
        way_in_step(this->next_time(), step_size, q1, v, reach, M);
        for (int k = 0; k < n; ++k) reach[k] += fabs(q[k]) + fabs(q1[k]);
        each_mass(M, [&](int k, real mass) {
            for (int b = 0; b < active; ++b)
                for (int i = 0; i < r && K::active_index[b] == k; ++i)
                    reach[k] += fabs(step_size * (step_size * K::b[i] * a.g[i * Z + active + b]) / mass);
        });
        for (int e = 0; e < K::constraint_entries; ++e)
            size[K::constraint_row[e]] += fabs(G[e]) * reach[K::constraint_column[e]];
        return are_near_zero(phi, size, this->next_time(), q1);
    }
};

}  // namespace lobatto

#endif
