// SPDX-License-Identifier: GPL-2.0-or-later
// The quadratic part of V (D31): worth taking out of the iteration when the rest bends the forces less at the start.
#pragma once

#include <string>

#include "generator/mechanics/system/system.hpp"
#include "generator/method/quadrature.hpp"
#include "generator/scene/scene.hpp"

namespace lobatto {

struct QuadraticPart {
    SparseMatrix constant;  // the part of V'' that does not depend on q
    bool diagonal = false;  // it is diagonal, and taken into the stage map
    bool absorbed = false;  // Newton's iteration has its Jacobian
    std::string reason;     // a clause
};

// Of a separable system whose mass matrix is diagonal.
QuadraticPart find_quadratic_part(const Scene& scene, const System& system, const Quadrature& quadrature);

}  // namespace lobatto
