// SPDX-License-Identifier: GPL-2.0-or-later
// What a scene's system lets the kernel leave out, each finding with its reason.
#include "generator/mechanics/structure/structure.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "generator/formula/expansion.hpp"
#include "generator/graph/notation.hpp"
#include "generator/mechanics/structure/quadratic_part.hpp"
#include "generator/mechanics/structure/routhian.hpp"
#include "generator/mechanics/structure/scaled_mass.hpp"

namespace lobatto {

namespace {

using GiNaC::ex;

class Finder {
public:
    Finder(const Scene& scene, const System& system, const Quadrature& quadrature, Shortcuts shortcuts)
        : scene_(scene),
          system_(system),
          quadrature_(quadrature),
          n_(system.n),
          interior_(n_ * (quadrature.points - 2)) {
        general_.full = shortcuts == Shortcuts::none;
    }

    std::pair<Structure, std::vector<Finding>> run() {
        separable_.is_explicit = quadrature_.is_explicit();
        separable_.clean = scene_.method.arithmetic == StepArithmetic::clean && !general_.full;
        result_.linear = system_.linear && !general_.full && !separable_.clean;
        if (!scene_.is_cut()) result_.closed_solution = find_closed_solution(system_);
        findings_ = elimination_findings(scene_);
        choose_form();
        if (form_ == StepForm::general)
            general();
        else
            separable();
        for (Finding& finding : scene_findings(scene_, system_)) findings_.push_back(std::move(finding));
        findings_.push_back(solution_finding(result_.closed_solution));
        switch (form_) {
            case StepForm::linear_map:
                result_.of_form = LinearMapForm{std::move(separable_)};
                break;
            case StepForm::separable:
                result_.of_form = std::move(separable_);
                break;
            case StepForm::general:
                result_.of_form = std::move(general_);
                break;
        }
        return {std::move(result_), std::move(findings_)};
    }

private:
    void find(const std::string& name, bool holds, const std::string& reason) {
        findings_.push_back({name, holds, reason});
    }
    std::string name(int k) const { return name_of(system_, k); }

    void choose_form() {
        if (general_.full) {
            form_ = StepForm::general;
            find("general path", true,
                 "asked for: no structure is used, and all nodes of a step are solved for with full matrices");
            return;
        }
        const auto& masses = system_.momentum_v.entries();
        const bool only_momenta_move =
            !system_.constant_mass && std::all_of(masses.begin(), masses.end(), [&](const auto& entry) {
                const auto holds = [&](const GiNaC::symbol& one) { return entry.second.has(one); };
                return std::none_of(system_.q.begin(), system_.q.end(), holds) &&
                       std::none_of(system_.v.begin(), system_.v.end(), holds) && !holds(system_.t);
            });
        find(only_momenta_move ? "momenta without positions" : "constant mass matrix", system_.constant_mass,
             system_.separable ? "M is the same everywhere, so the end of a step follows without equations"
             : system_.constant_mass
                 ? "M is the same everywhere, so multipliers are corrected without a matrix of all points of a step"
                 : system_.not_separable + ", so the end of a step is solved for together with its interior points");
        const bool diagonal = std::all_of(system_.mass.entries().begin(), system_.mass.entries().end(),
                                          [](const auto& entry) { return entry.first.first == entry.first.second; });
        separable_.diagonal_mass = system_.separable && diagonal;
        if (separable_.clean) {
            find("round-off-clean arithmetic", true,
                 "asked for: every step is iterated until nothing changes and its increments are added without error, "
                 "so that rounding errors grow like a random walk");
            return;
        }
        const bool polynomial_wanted = scene_.outputs.dense > 0 || !scene_.watched().empty();
        // The inverse of a full mass matrix is written out: few coordinates only, or nothing to solve.
        const bool takes_mass = separable_.diagonal_mass || interior_ <= full_mass_limit;
        if (!system_.separable || (!takes_mass && !separable_.is_explicit))
            form_ = StepForm::general;
        else if (system_.linear && system_.autonomous && system_.inputs.empty() && n_ <= linear_map_limit &&
                 !polynomial_wanted && takes_mass)
            form_ = StepForm::linear_map;
        if (!separable_.is_explicit) return;
        result_.linear = form_ == StepForm::linear_map;
        find("explicit steps", true,
             "asked for: positions and velocities are updated in turn from node to node, without equations");
    }

    // Where V has second derivatives, row by row.
    std::vector<std::pair<int, int>> places_of_hessian() const {
        std::vector<std::pair<int, int>> written, places;
        for (const auto& [place, value] : system_.hessian.entries()) written.push_back(place);
        std::set_union(written.begin(), written.end(), system_.unwritten.places.begin(), system_.unwritten.places.end(),
                       std::back_inserter(places));
        return places;
    }

    void separable() {
        std::string coupling;
        for (const auto& [place, value] : system_.mass.entries())
            if (place.first < place.second && coupling.empty())
                coupling = fmt::format("L contains {}'*{}' with the factor {}", name(place.first), name(place.second),
                                       canonical_text(value));
        if (n_ > 1)
            find("diagonal mass matrix", separable_.diagonal_mass,
                 separable_.diagonal_mass ? "each momentum is one mass times its own velocity" : coupling);
        linearity();
        // M^-1 V'' has an entry (i, j) where row i of M^-1 meets column j of V''; for a diagonal mass, where V'' has
        // one.
        const std::vector<std::pair<int, int>> curved = places_of_hessian();
        if (separable_.diagonal_mass) {
            separable_.entries = curved;
        } else {
            std::set<int> columns;
            for (const auto& place : curved) columns.insert(place.second);
            for (int i = 0; i < n_; ++i)
                for (const int j : columns) separable_.entries.emplace_back(i, j);
        }
        const bool full = separable_.entries.size() == static_cast<std::size_t>(n_) * static_cast<std::size_t>(n_);
        if (n_ > 1)
            find("sparse second derivatives", !full,
                 full ? fmt::format("none of the {} entries of M^-1 V'' is always zero", n_ * n_)
                      : fmt::format("{} of {} entries of M^-1 V'' are not always zero, and only they are computed",
                                    separable_.entries.size(), n_ * n_));
        std::set<int> free;
        for (int k = 0; k < n_; ++k) free.insert(k);
        for (const auto& place : curved) {
            free.erase(place.first);
            free.erase(place.second);
        }
        for (int k = 0; k < n_; ++k)
            if (!system_.gradient[static_cast<std::size_t>(k)].is_zero()) free.erase(k);
        if (!separable_.diagonal_mass) free.clear();
        find("cyclic coordinates", !free.empty(),
             !separable_.diagonal_mass ? "not looked for with a mass matrix that is not diagonal"
             : free.empty()            ? "a force acts on every coordinate"
                                       : names_of(system_, {free.begin(), free.end()}) +
                                  ": no force acts on them, so their motion is uniform and needs no equations");
        Couplings couplings(static_cast<std::size_t>(n_));
        for (const auto& [row, column] : separable_.entries) couplings.add(row, column);
        result_.groups = couplings.groups();
        if (!separable_.is_explicit) describe_groups();
        if (form_ == StepForm::linear_map) return;
        repetition();
        absorption();
        neighbourhood();
    }

    void general() {
        const bool constrained = !system_.constraints.empty();
        const std::vector<int> cyclic =
            general_.full || constrained ? std::vector<int>{} : find_cyclic(scene_, system_);
        general_.routhian = reduce(system_, cyclic);
        const int active = static_cast<int>(general_.routhian.active.size()),
                  blocks = active + static_cast<int>(system_.constraints.size());
        if (constrained) findings_.push_back(constraint_finding(scene_, system_));
        if (general_.full) {
            Group all;
            for (int k = 0; k < blocks; ++k) all.coordinates.push_back(k);
            all.bandwidth = blocks - 1;
            result_.groups = {all};
            return;
        }
        linearity();
        find("cyclic coordinates", !cyclic.empty(),
             constrained      ? "not looked for in systems with constraints"
             : cyclic.empty() ? "of each coordinate, L contains the position, or a higher power of the velocity than "
                                "the second, or a mass that may vanish"
                              : names_of(system_, cyclic) +
                                    ": L contains only the velocity, so the momentum is constant and the motion "
                                    "follows from it without equations");
        Couplings couplings(static_cast<std::size_t>(blocks));
        const auto block_of = [&](int slot) { return slot < active ? slot : slot - active; };
        for (const auto& [place, value] : general_.routhian.second.entries())
            if (constrained || (place.first < 2 * active && place.second < 2 * active))
                couplings.add(block_of(place.first), block_of(place.second));
        result_.groups = couplings.groups();
        if (!cyclic.empty() && result_.groups.size() > 1) {  // one multiplier may couple all of them
            Group all;
            for (const Group& group : result_.groups)
                all.coordinates.insert(all.coordinates.end(), group.coordinates.begin(), group.coordinates.end());
            all.bandwidth = active - 1;
            result_.groups = {all};
        }
        const std::size_t size = general_.routhian.z.size();
        const std::size_t present = general_.routhian.second.entries().size();
        find("sparse second derivatives", present < size * size,
             present == size * size
                 ? fmt::format("none of the {} second derivatives of L is always zero", present)
                 : fmt::format("{} of {} second derivatives of L are not always zero, and only they are computed",
                               present, size * size));
        describe_groups();
        if (cyclic.empty() && !constrained) repetition();
        velocities_of_momenta();
        if (!constrained && !result_.looped && !result_.linear) masses();
    }

    // What an iteration need not factor.
    void masses() {
        if (n_ == 1 || general_.hamiltonian) return;
        const bool scaled = has_scaled_mass(scene_, system_);
        find("scaled mass matrix", scaled,
             scaled ? "M is one function of the state times a constant matrix, so an iteration divides by "
                      "that function and factors nothing"
             : has_diagonal_mass(system_)
                 ? "M is diagonal and each mass changes in its own way, so an iteration divides by each"
                 : "the entries of M change in different ways, so an iteration factors M at every node");
    }

    void velocities_of_momenta() {
        if (scene_.quaternions.empty() || result_.looped) return;
        auto [hamiltonian, reason] = find_hamiltonian(scene_, system_);
        find("velocities of momenta", hamiltonian.has_value(), reason);
        general_.hamiltonian = std::move(hamiltonian);
    }

    // Second derivatives that cancel between formulas have no place that a loop could add them to.
    bool has_places_of(const Elements& elements) const {
        std::vector<std::pair<int, int>> places = separable_.entries;
        if (form_ == StepForm::general) {
            places.clear();
            for (const auto& [place, value] : general_.routhian.second.entries()) places.push_back(place);
        }
        std::sort(places.begin(), places.end());
        for (const Element& element : elements.repeated)
            for (const auto& [i, j] : pairs_of(element))
                for (const std::vector<int>& row : element.rows)
                    if (!std::binary_search(places.begin(), places.end(), std::pair(row[i], row[j]))) return false;
        return true;
    }

    // Terms of V, or of L, that are one formula of many variables.
    void repetition() {
        const bool general = form_ == StepForm::general;
        if (form_ == StepForm::linear_map || (!general && !separable_.diagonal_mass)) return;
        std::vector<ex> terms;
        std::vector<std::pair<int, ex>> forces;
        for (const ex& term : general ? system_.terms : all_at(system_.terms, system_.v, 0))
            if (!term.is_zero()) terms.push_back(general ? term : -term);
        std::vector<GiNaC::symbol> all = system_.q;
        all.insert(all.end(), system_.v.begin(), system_.v.end());
        for (int k = 0; k < n_; ++k) {
            const ex& force = system_.outer_force[static_cast<std::size_t>(k)];
            if (force.is_zero()) continue;
            for (const ex& term : terms_of(force, all)) forces.emplace_back(general ? n_ + k : k, term);
        }
        const std::size_t count = terms.size() + forces.size();
        if (count < looped_from) return;
        Elements elements = find_elements(system_, general ? general_.routhian.z : system_.q, terms, forces);
        const std::size_t single = elements.others.size() + elements.other_forces.size();
        result_.looped = 4 * single <= count && has_places_of(elements);
        if (result_.looped) result_.elements = std::move(elements);
        const std::size_t formulas = result_.elements.repeated.size();
        find("repeated terms", result_.looped,
             result_.looped ? fmt::format("{} of {} terms of L are {}, computed in loops over tables", count - single,
                                          count, formulas == 1 ? "one formula" : fmt::format("{} formulas", formulas))
                            : fmt::format("of {} terms of L, {} share their formula with no other", count, single));
    }

    void absorption() {
        if (result_.linear || separable_.clean || separable_.is_explicit || interior_ == 0 || !separable_.diagonal_mass)
            return;
        QuadraticPart part = find_quadratic_part(scene_, system_, quadrature_);
        separable_.constant_hessian = std::move(part.constant);
        separable_.diagonal_part = part.diagonal;
        separable_.absorbed = part.absorbed;
        find("quadratic part absorbed", part.diagonal || part.absorbed, part.reason);
    }

    void neighbourhood() {
        if (!result_.looped || result_.linear || separable_.clean) return;
        separable_.neighbours = !general_.full && !separable_.diagonal_part && are_neighbours(result_.elements);
        find("neighbouring coordinates", separable_.neighbours,
             separable_.neighbours ? "formulas link consecutive coordinates, so SIMD lanes hold consecutive coordinates"
             : separable_.diagonal_part
                 ? "SIMD lanes hold nodes, because the quadratic part is taken into the stage map"
                 : "formulas link coordinates that are not consecutive, so SIMD lanes hold nodes");
        if (!separable_.neighbours) return;
        separable_.fixed_ends = fixed_ends_of(result_.elements, system_.q);
        const bool before = separable_.fixed_ends.before, behind = separable_.fixed_ends.behind;
        if (before || behind)
            find("fixed ends", true,
                 (before && behind ? "both ends have"
                  : before         ? name(0) + " has"
                                   : name(static_cast<int>(system_.q.size()) - 1) + " has") +
                     std::string(" the formula of the coordinates between, so one loop computes all of them"));
    }

    void linearity() {
        std::string reason = "all forces are linear, so a step is a product with one matrix, without iteration";
        if (result_.linear && form_ != StepForm::linear_map)
            reason = "all forces are linear, so one solve per step is exact, with a matrix that is factored once";
        if (separable_.is_explicit && system_.linear && !result_.linear) return;  // of no use
        if (!result_.linear) reason = curvature_text(system_);
        find("linear system", result_.linear, reason);
    }

    void describe_groups() {
        if (n_ == 1 || (form_ == StepForm::general && general_.routhian.active.size() == 1)) return;
        const std::size_t count = result_.groups.size();
        const auto& in = form_ == StepForm::general ? general_.routhian.active : std::vector<int>{};
        const auto listed = [&](const Group& group) {
            std::vector<int> coordinates;
            for (const int k : group.coordinates)
                if (in.empty() || k < static_cast<int>(in.size()))  // not a constraint
                    coordinates.push_back(in.empty() ? k : in[static_cast<std::size_t>(k)]);
            return names_of(system_, coordinates);
        };
        std::string reason;
        if (count == 1) {
            reason = "all coordinates are coupled";
        } else {
            for (std::size_t g = 0; g < count && g < 4; ++g)
                reason += (g == 0 ? "{" : ", {") + listed(result_.groups[g]) + "}";
            reason += count > 4 ? fmt::format(" and {} more", count - 4) : "";
            reason += " are not coupled, so each group is solved by itself";
        }
        find("independent groups", count > 1, reason);
        int widest = 0;
        std::size_t largest = 0;
        for (const Group& group : result_.groups) {
            widest = std::max(widest, group.bandwidth);
            largest = std::max(largest, group.coordinates.size());
        }
        if (largest == 1) return;
        const bool banded = 3 * widest + 3 < static_cast<int>(largest);
        find("banded equations", banded,
             banded ? fmt::format("reordered, only coordinates at most {} apart (of {}) are coupled; only this band is "
                                  "stored and solved",
                                  widest, largest)
                    : fmt::format("even reordered, coordinates up to {} apart (of {}) are coupled", widest, largest));
    }

    const Scene& scene_;
    const System& system_;
    const Quadrature& quadrature_;
    const int n_, interior_;
    StepForm form_ = StepForm::separable;
    SeparableForm separable_;  // also what is known of a linear map
    GeneralForm general_;
    Structure result_;
    std::vector<Finding> findings_;
};

}  // namespace

const ConstantMassForm& Structure::constant_mass() const {
    if (form() == StepForm::linear_map) return std::get<LinearMapForm>(of_form);
    return separable();
}

void Structure::iterate() {
    if (form() != StepForm::linear_map) return;
    SeparableForm separable;
    static_cast<ConstantMassForm&>(separable) = std::get<LinearMapForm>(of_form);
    of_form = std::move(separable);
}

std::pair<Structure, std::vector<Finding>> find_structure(const Scene& scene, const System& system,
                                                          const Quadrature& quadrature, Shortcuts shortcuts) {
    return Finder(scene, system, quadrature, shortcuts).run();
}

}  // namespace lobatto
