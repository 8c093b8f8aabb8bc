// SPDX-License-Identifier: GPL-2.0-or-later
#include "generator/mechanics/derivation.hpp"

#include "generator/formula/limits.hpp"

namespace lobatto {

const Discretisation& Derivation::discretisation() const {
    if (discretisation_) return *discretisation_;
    const DerivationLimits limits(scene.path);
    discretisation_ = std::make_shared<const Discretisation>(discretise(system, quadrature));
    return *discretisation_;
}

}  // namespace lobatto
