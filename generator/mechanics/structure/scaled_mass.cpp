// SPDX-License-Identifier: GPL-2.0-or-later
#include "generator/mechanics/structure/scaled_mass.hpp"

#include <stdexcept>

#include "generator/mechanics/algebra/sample.hpp"

namespace lobatto {

bool has_scaled_mass(const Scene& scene, const System& system) {
    if (system.n == 1) return true;
    GiNaC::exmap start;
    for (std::size_t k = 0; k < system.q.size(); ++k) {
        start[system.q[k]] = scene.initial_position[k];
        start[system.v[k]] = scene.start == Start::velocity ? scene.initial_rate[k] : GiNaC::ex(0);
    }
    start[system.t] = 0;
    std::vector<GiNaC::ex> differences;
    try {
        const GiNaC::ex& first = system.momentum_v.entries().begin()->second;
        const GiNaC::ex first_there = first.subs(start, GiNaC::subs_options::no_pattern);
        for (const auto& [place, entry] : system.momentum_v.entries())
            differences.push_back(entry * first_there - first * entry.subs(start, GiNaC::subs_options::no_pattern));
    } catch (const std::exception&) {  // a mass has no value at the start, as of 1/x at 0
        return false;
    }
    bool is_scaled = true;
    try {
        at_sample_points(scene, [&](NearStart& point) {
            Formulas formulas;
            point.set_all(formulas);
            for (const Sized& value : formulas.evaluate_sized(formulas.convert(differences)))
                is_scaled = is_scaled && value.vanishes();
        });
    } catch (const DomainError&) {
        return false;
    }
    return is_scaled;
}

}  // namespace lobatto
