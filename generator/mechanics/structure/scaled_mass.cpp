// SPDX-License-Identifier: GPL-2.0-or-later
#include "generator/mechanics/structure/scaled_mass.hpp"

#include <algorithm>
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
            if (!is_scaled) return;
            Formulas formulas;
            point.set_all(formulas);
            const std::vector<Id> roots = formulas.convert(differences);
            const std::vector<Sized> nodes = formulas.evaluate_all_sized(roots);
            const std::vector<GiNaC::exset> hidden = formulas.hidden(roots, nodes);
            for (std::size_t i = 0; i < roots.size(); ++i)
                is_scaled = is_scaled && hidden[i].empty() && nodes[static_cast<std::size_t>(roots[i])].vanishes();
        });
    } catch (const DomainError&) {
        return false;
    }
    return is_scaled;
}

bool has_diagonal_mass(const System& system) {
    const auto& entries = system.momentum_v.entries();
    return std::all_of(entries.begin(), entries.end(), [](const auto& e) { return e.first.first == e.first.second; });
}

bool uses_scaled_mass(const Scene& scene, const System& system, const Structure& structure) {
    return structure.form() == StepForm::general && !structure.full() && !structure.looped && !structure.linear &&
           system.constraints.empty() && has_scaled_mass(scene, system);
}

bool has_light_mass(const Scene& scene, const System& system, const Structure& structure) {
    return has_diagonal_mass(system) && uses_scaled_mass(scene, system, structure);
}

}  // namespace lobatto
