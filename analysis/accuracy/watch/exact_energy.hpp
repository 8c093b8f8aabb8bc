// SPDX-License-Identifier: GPL-2.0-or-later
// The energy of a state in 60 digits: what of an energy error is the motion's, and what is the rounding of H.
#pragma once

#include <optional>
#include <vector>

#include "generator/mechanics/algebra/sample.hpp"
#include "generator/mechanics/outline.hpp"

namespace lobatto {

class ExactEnergy {
public:
    // Of a system whose formulas hold no time; parameters in the order of the scene. Switches are on the sides where
    // the positions and velocities are.
    ExactEnergy(const Outline& outline, const std::vector<double>& parameters);

    // H = q'.dL/dq' - L at positions and velocities dq/dt, n each.
    struct Energy {
        cln::cl_R value;
        std::optional<cln::cl_R> moving;  // H(q, q') - H(q, 0), the kinetic energy; none where rest is impossible
        cln::cl_R size;  // what the rounding of H is measured against (generator/mechanics/algebra/sample.hpp)
    };
    // None where H is no real number. `same_sides`: switches stay where the last call had them.
    std::optional<Energy> at(const std::vector<double>& q, const std::vector<double>& velocity,
                             bool same_sides = false);

    static constexpr std::size_t most_coordinates = 64;

private:
    const SystemOutline& system_;
    Formulas formulas_;
    std::vector<Id> energy_;
    std::vector<GiNaC::symbol> sides_;  // of switches, and the formulas whose signs they are
    std::vector<Id> switched_;
};

}  // namespace lobatto
