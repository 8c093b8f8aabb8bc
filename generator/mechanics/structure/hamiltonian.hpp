// SPDX-License-Identifier: GPL-2.0-or-later
// Velocities and forces as formulas of positions and momenta, where bodies have a constant mass matrix (D62).
//
// Of a body's quaternion q the quasi-velocities are w = q^-1 q', twice n times (D53), of any other coordinate w = q'.
// In them L = w^T J w / 2 - V(q, t), as a rule with a constant J, and its inverse N is known:
//     q' = B N B^T p,    B^T p = (p . q, p . q i, p . q j, p . q k) for a quaternion.
#pragma once

#include <ginac/ginac.h>

#include <array>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "generator/mechanics/system/system.hpp"

namespace lobatto {

// (q e_k)_j = sign q[place], e_k = 1, i, j, k.
struct Signed {
    std::size_t place;
    int sign;
};
constexpr Signed quaternion_product[4][4] = {{{0, 1}, {1, 1}, {2, 1}, {3, 1}},
                                             {{1, -1}, {0, 1}, {3, 1}, {2, -1}},
                                             {{2, -1}, {3, -1}, {0, 1}, {1, 1}},
                                             {{3, -1}, {2, 1}, {1, -1}, {0, 1}}};

struct Hamiltonian {
    std::vector<std::array<std::size_t, 4>> quaternions;  // coordinates
    SparseMatrix mass, inverse;                           // J and N, symmetric, in parameters
    std::vector<GiNaC::ex> pivots;                        // of J, which must not vanish
    std::vector<GiNaC::ex> force;                         // n: -dV/dq + F
};

// Coordinates of systems whose steps are iterated without Newton, as most_full in runtime/kernel/base/contract.hpp.
constexpr int most_iterated = 16;

// Of a scene with bodies that turn. Nothing where J changes with the motion, where L is not quadratic in the
// velocities, where forces hold them, and where the iteration does not serve; and the reason, a clause.
std::pair<std::optional<Hamiltonian>, std::string> find_hamiltonian(const Scene& scene, const System& system);

}  // namespace lobatto
