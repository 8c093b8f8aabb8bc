// SPDX-License-Identifier: GPL-2.0-or-later
// What a scene's system lets the kernel leave out, each finding with its reason.
#include "generator/mechanics/structure/structure.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>

#include "generator/formula/expansion.hpp"
#include "generator/formula/real.hpp"
#include "generator/formula/spline.hpp"
#include "generator/graph/notation.hpp"
#include "generator/mechanics/algebra/constant_part.hpp"
#include "generator/mechanics/algebra/sample.hpp"
#include "generator/mechanics/structure/routhian.hpp"
#include "generator/mechanics/structure/scaled_mass.hpp"
#include "generator/scene/eliminated.hpp"

namespace lobatto {

namespace {

using GiNaC::ex;

bool has_any(const ex& expression, const std::vector<GiNaC::symbol>& symbols) {
    return std::any_of(symbols.begin(), symbols.end(), [&](const auto& symbol) { return expression.has(symbol); });
}

std::optional<ClosedSolution> closed_solution(const System& system) {
    if (system.n != 1 || !system.separable || !system.autonomous) return std::nullopt;
    const ex q = system.q[0];
    const ex acceleration = expanded(system.gradient[0] / system.mass(0, 0));  // -q''
    for (const auto& [kind, shape] :
         {std::pair<ClosedSolution::Kind, ex>{ClosedSolution::Kind::harmonic, q},
          std::pair<ClosedSolution::Kind, ex>{ClosedSolution::Kind::pendulum, GiNaC::sin(q)}}) {
        const ex omega_squared = expanded(acceleration / shape);
        if (!omega_squared.is_zero() && !has_any(omega_squared, system.q)) return ClosedSolution{kind, omega_squared};
    }
    return std::nullopt;
}

// Couplings between coordinates: who occurs in whose equations.
class Couplings {
public:
    explicit Couplings(std::size_t count) : neighbours_(count) {}
    void add(int a, int b) {
        if (a == b) return;
        neighbours_[static_cast<std::size_t>(a)].insert(b);
        neighbours_[static_cast<std::size_t>(b)].insert(a);
    }

    // Connected components, each in the order of Cuthill and McKee reversed: breadth first from a far end, neighbours
    // with few neighbours first.
    std::vector<Group> groups() const {
        std::vector<Group> result;
        std::vector<bool> known(neighbours_.size(), false);
        for (std::size_t first = 0; first < neighbours_.size(); ++first) {
            if (known[first]) continue;
            Group natural;
            natural.coordinates = breadth_first(static_cast<int>(first));
            for (const int k : natural.coordinates) known[static_cast<std::size_t>(k)] = true;
            Group ordered;
            ordered.coordinates = breadth_first(breadth_first(natural.coordinates.back()).back());
            std::reverse(ordered.coordinates.begin(), ordered.coordinates.end());
            std::sort(natural.coordinates.begin(), natural.coordinates.end());
            natural.bandwidth = bandwidth(natural.coordinates);
            ordered.bandwidth = bandwidth(ordered.coordinates);
            result.push_back(ordered.bandwidth < natural.bandwidth ? ordered : natural);
        }
        return result;
    }

private:
    std::vector<int> breadth_first(int start) const {
        std::vector<int> order{start};
        std::set<int> seen{start};
        for (std::size_t next = 0; next < order.size(); ++next) {
            const auto& here = neighbours_[static_cast<std::size_t>(order[next])];
            std::vector<int> fresh;
            for (const int k : here)
                if (seen.insert(k).second) fresh.push_back(k);
            std::stable_sort(fresh.begin(), fresh.end(), [&](int a, int b) { return degree(a) < degree(b); });
            order.insert(order.end(), fresh.begin(), fresh.end());
        }
        return order;
    }
    std::size_t degree(int k) const { return neighbours_[static_cast<std::size_t>(k)].size(); }
    int bandwidth(const std::vector<int>& order) const {
        std::map<int, int> place;
        for (std::size_t i = 0; i < order.size(); ++i) place[order[i]] = static_cast<int>(i);
        int widest = 0;
        for (const int k : order)
            for (const int other : neighbours_[static_cast<std::size_t>(k)])
                widest = std::max(widest, std::abs(place.at(k) - place.at(other)));
        return widest;
    }

    std::vector<std::set<int>> neighbours_;
};

Finding solution_finding(const std::optional<ClosedSolution>& solution) {
    if (!solution)
        return {"solution in closed form", false, "this is neither a harmonic oscillator nor a plane pendulum"};
    const bool is_harmonic = solution->kind == ClosedSolution::Kind::harmonic;
    return {"solution in closed form", true,
            std::string(is_harmonic ? "q'' = -w2*q" : "q'' = -w2*sin(q), by Jacobi elliptic functions") +
                " with w2 = " + canonical_text(solution->omega_squared)};
}

class Finder {
public:
    Finder(const Scene& scene, const System& system, const Quadrature& quadrature, bool general)
        : scene_(scene),
          system_(system),
          quadrature_(quadrature),
          n_(system.n),
          interior_(n_ * (quadrature.points - 2)) {
        general_.full = general;
    }

    std::pair<Structure, std::vector<Finding>> run() {
        separable_.is_explicit = quadrature_.is_explicit();
        separable_.clean = scene_.method.arithmetic == StepArithmetic::clean && !general_.full;
        result_.linear = system_.linear && !general_.full && !separable_.clean;
        result_.closed_solution = closed_solution(system_);
        elimination();
        choose_form();
        if (form_ == Form::general)
            general();
        else
            separable();
        time_and_forces();
        findings_.push_back(solution_finding(result_.closed_solution));
        switch (form_) {
            case Form::linear_map:
                result_.of_form = LinearMapForm{std::move(separable_)};
                break;
            case Form::separable:
                result_.of_form = std::move(separable_);
                break;
            case Form::general:
                result_.of_form = std::move(general_);
                break;
        }
        return {std::move(result_), std::move(findings_)};
    }

private:
    void find(const std::string& name, bool holds, const std::string& reason) {
        findings_.push_back({name, holds, reason});
    }
    std::string name(int k) const { return system_.q[static_cast<std::size_t>(k)].get_name(); }
    // x, y, z and 9 more
    template <class List>
    std::string names(const List& list) const {
        std::string text;
        std::size_t shown = 0;
        for (const int k : list) {
            if (shown == 6 && list.size() > 7) return text + fmt::format(" and {} more", list.size() - shown);
            text += (shown++ == 0 ? "" : ", ") + name(k);
        }
        return text;
    }

    void choose_form() {
        if (general_.full) {
            form_ = Form::general;
            find("general path", true,
                 "asked for: nothing is looked for, all nodes of a step are solved for with full matrices");
            return;
        }
        find("constant mass matrix", system_.constant_mass,
             system_.separable ? "the masses are the same everywhere, so the end of a step needs no equations"
             : system_.constant_mass
                 ? "the masses are the same everywhere, so a step corrects multipliers without a matrix of all its "
                   "points"
                 : system_.not_separable + ", so the end of a step is solved for with the points inside");
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
            form_ = Form::general;
        else if (system_.linear && system_.autonomous && system_.inputs.empty() && n_ <= linear_map_limit &&
                 !polynomial_wanted && takes_mass)
            form_ = Form::linear_map;
        if (!separable_.is_explicit) return;
        result_.linear = form_ == Form::linear_map;
        find("explicit steps", true,
             "asked for: positions and velocities move in turn, straight from node to node, and nothing is solved for");
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
                coupling = fmt::format("L holds {}'*{}' with the factor {}", name(place.first), name(place.second),
                                       canonical_text(value));
        if (n_ > 1)
            find("diagonal mass matrix", separable_.diagonal_mass,
                 separable_.diagonal_mass
                     ? "no two velocities are multiplied: each momentum is its own mass times velocity"
                     : coupling);
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
                 full ? fmt::format("all {} entries of M^-1 V'' occur", n_ * n_)
                      : fmt::format("{} of {} entries of M^-1 V'' are not zero, and only they are computed",
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
             free.empty() ? "no coordinate is without a force"
                          : names(free) + ": without a force, so the motion is uniform and nothing is solved for");
        Couplings couplings(static_cast<std::size_t>(n_));
        for (const auto& [row, column] : separable_.entries) couplings.add(row, column);
        result_.groups = couplings.groups();
        if (!separable_.is_explicit) describe_groups();
        if (form_ == Form::linear_map) return;
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
        if (constrained) constraint_finding();
        if (general_.full) {
            Group all;
            for (int k = 0; k < blocks; ++k) all.coordinates.push_back(k);
            all.bandwidth = blocks - 1;
            result_.groups = {all};
            return;
        }
        linearity();
        find("cyclic coordinates", !cyclic.empty(),
             constrained ? "none is looked for beside constraints"
             : cyclic.empty()
                 ? "every coordinate itself occurs, or its velocity more than squared, or its mass may vanish"
                 : names(cyclic) +
                       ": L holds only the velocity, so the momentum is constant and the motion "
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
                 ? fmt::format("all {} second derivatives of L occur", present)
                 : fmt::format("{} of {} second derivatives of L are not zero, and only they are computed", present,
                               size * size));
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
             scaled ? "all masses change alike: M is one function times a constant matrix, so an "
                      "iteration divides by that function and solves nothing"
             : has_diagonal_mass(system_)
                 ? "each mass changes in its own way; no two velocities are multiplied, so an "
                   "iteration divides by each"
                 : "the masses change in different ways, so an iteration factors M at every node");
    }

    void velocities_of_momenta() {
        if (scene_.quaternions.empty() || result_.looped) return;
        auto [hamiltonian, reason] = find_hamiltonian(scene_, system_);
        find("velocities of momenta", hamiltonian.has_value(), reason);
        general_.hamiltonian = std::move(hamiltonian);
    }

    void elimination() {
        if (!scene_.eliminated.empty()) {
            std::string names;
            for (const Eliminated& x : scene_.eliminated)
                if (names.size() < 200) names += (names.empty() ? "" : ", ") + x.coordinate.written;
            const bool one = scene_.eliminated.size() == 1;
            find("eliminated coordinates", true,
                 fmt::format("{} {} eliminated: {}", names, one ? "is" : "are", equations_of_eliminated(scene_)));
        }
        if (scene_.not_eliminated.empty()) return;
        std::string list;
        for (const std::string& one : scene_.not_eliminated)
            if (list.size() < 400) list += (list.empty() ? "" : "; ") + one;
        find("eliminated coordinates", false, list);
    }

    void constraint_finding() {
        std::string list;
        for (const Constraint& constraint : scene_.constraints)
            if (list.size() < 200) list += (list.empty() ? "" : ", ") + constraint.written;
        const std::size_t count = scene_.constraints.size();
        find("constraints", true,
             fmt::format("{} ({}): {} of {} coordinates are free, and multipliers at the nodes of a step keep the rest",
                         count == 1 ? "one" : std::to_string(count), list, static_cast<std::size_t>(n_) - count, n_));
    }

    // Second derivatives that cancel between formulas have no place that a loop could add them to.
    bool has_places_of(const Elements& elements) const {
        std::vector<std::pair<int, int>> places = separable_.entries;
        if (form_ == Form::general) {
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
        const bool general = form_ == Form::general;
        if (form_ == Form::linear_map || (!general && !separable_.diagonal_mass)) return;
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
                            : fmt::format("of {} terms of L {} are unlike all others", count, single));
    }

    // The quadratic part of V: worth taking out of the iteration when the rest bends the forces less at the start.
    void absorption() {
        if (result_.linear || separable_.clean || separable_.is_explicit || interior_ == 0 || !separable_.diagonal_mass)
            return;
        separable_.constant_hessian = SparseMatrix(n_, n_);
        const auto& curvatures = system_.hessian.entries();
        if (std::any_of(curvatures.begin(), curvatures.end(),
                        [&](const auto& entry) { return has_any(entry.second, system_.inputs); })) {
            find("quadratic part absorbed", false, "the second derivatives of V change with inputs");
            return;
        }
        std::vector<GiNaC::symbol> variables = system_.q;
        variables.push_back(system_.t);
        std::vector<ex> whole, rest;
        bool diagonal = true;
        const ConstantPart constant_part(variables);
        for (const auto& [place, value] : system_.hessian.entries()) {
            const ex constant = constant_part.of(value);
            if (!constant.is_zero()) {
                separable_.constant_hessian.put(place.first, place.second, constant);
                diagonal = diagonal && place.first == place.second;
            }
            const ex mass = system_.mass(static_cast<std::size_t>(place.first), static_cast<std::size_t>(place.first));
            whole.push_back(value / mass);
            rest.push_back((value - constant) / mass);
        }
        if (separable_.constant_hessian.entries().empty()) {
            find("quadratic part absorbed", false, "V has no quadratic part");
            return;
        }
        double with = 1, without = 1;
        try {
            with = contraction_of(rest);
            without = contraction_of(whole);
        } catch (const DomainError&) {  // then as if there were no quadratic part
        }
        separable_.diagonal_part = diagonal && with < without;
        separable_.absorbed = !separable_.diagonal_part && with < 0.1;
        std::string reason = fmt::format(
            "without its quadratic part V bends the forces as much at the start, so nothing is taken out of the "
            "iteration");
        if (separable_.diagonal_part)
            reason = fmt::format(
                "the constant part of V'' is diagonal and taken into the stage map: at the start an iteration "
                "leaves {:.1g} of the error, not {:.1g}",
                with, without);
        else if (separable_.absorbed)
            reason = fmt::format(
                "V is nearly quadratic at the start, so that where the fixed-point iteration does not contract one "
                "matrix serves "
                "all iterations: one leaves {:.1g} of the error there",
                with);
        else if (!diagonal)
            reason = "the constant part of V'' couples coordinates, and the rest is no small part of the forces";
        find("quadratic part absorbed", separable_.diagonal_part || separable_.absorbed, reason);
    }

    void neighbourhood() {
        if (!result_.looped || result_.linear || separable_.clean) return;
        separable_.neighbours = !general_.full && !separable_.diagonal_part && are_neighbours(result_.elements);
        find("neighbouring coordinates", separable_.neighbours,
             separable_.neighbours ? "formulas go along coordinates that stand side by side: vector lanes hold these"
             : separable_.diagonal_part ? "lanes hold nodes, for which the quadratic part is taken into the stage map"
                                        : "formulas jump from coordinate to coordinate: vector lanes hold nodes");
        if (!separable_.neighbours) return;
        separable_.fixed_ends = fixed_ends_of(result_.elements, system_.q);
        const bool before = separable_.fixed_ends.before, behind = separable_.fixed_ends.behind;
        if (before || behind)
            find("fixed ends", true,
                 (before && behind ? "both ends are"
                  : before         ? name(0) + " is"
                                   : name(static_cast<int>(system_.q.size()) - 1) + " is") +
                     std::string(" held by the formula of neighbours; one loop computes all of them"));
    }

    // h^2 |A| |entries|, where those of M^-1 V'' stand, at the start; norms of largest row sums.
    double contraction_of(const std::vector<ex>& entries) const {
        Formulas formulas;
        for (const Parameter& parameter : scene_.parameters)
            formulas.set(parameter.symbol,
                         float_of(scene_.evaluate(parameter.value, "the parameter " + parameter.name)));
        for (std::size_t k = 0; k < scene_.coordinates.size(); ++k)
            formulas.set(system_.q[k], float_of(scene_.evaluate(scene_.initial_position[k], "the initial position")));
        formulas.set(system_.t, cln::cl_float(0, cln::float_format(number_digits)));
        const std::vector<cln::cl_R> values = formulas(entries);
        std::map<std::pair<int, int>, double> curvatures;
        std::size_t e = 0;
        for (const auto& [place, value] : system_.hessian.entries())
            curvatures[place] += cln::double_approx(values[e++]);
        add_unwritten(curvatures, formulas);
        std::map<int, double> rows;
        for (const auto& [place, curvature] : curvatures) rows[place.first] += std::fabs(curvature);
        double largest = 0, stage = 0;
        for (const auto& [row, sum] : rows) largest = std::max(largest, sum);
        for (unsigned i = 0; i < quadrature_.A.rows(); ++i) {
            double sum = 0;
            for (unsigned j = 0; j < quadrature_.A.cols(); ++j)
                sum += std::fabs(GiNaC::ex_to<GiNaC::numeric>(quadrature_.A(i, j).evalf()).to_double());
            stage = std::max(stage, sum);
        }
        const double h = scene_.evaluate(scene_.run.step, "the step").to_double();
        return h * h * stage * largest;
    }

    // Entries of M^-1 V'' from terms that are not written out; their masses are constant.
    void add_unwritten(std::map<std::pair<int, int>, double>& curvatures, Formulas& start) const {
        std::vector<ex> masses;
        for (std::size_t k = 0; k < system_.q.size(); ++k) masses.push_back(system_.mass(k, k));
        const std::vector<cln::cl_R> mass = start(masses);
        for (const Element& element : system_.unwritten.elements) {
            const auto pairs = pairs_of(element);
            std::vector<ex> derivatives;
            for (const auto& [i, j] : pairs) derivatives.push_back(element.term.diff(element.x[i]).diff(element.x[j]));
            at_rows(element, derivatives, system_, start, [&](std::size_t r, const std::vector<cln::cl_R>& values) {
                for (std::size_t p = 0; p < pairs.size(); ++p) {
                    const int row = element.rows[r][pairs[p].first], column = element.rows[r][pairs[p].second];
                    curvatures[{row, column}] += cln::double_approx(values[p] / mass[static_cast<std::size_t>(row)]);
                }
            });
        }
    }

    void linearity() {
        std::string reason = "all forces are linear, so a step is one matrix: nothing is iterated";
        if (result_.linear && form_ != Form::linear_map)
            reason = "all forces are linear, so one solve a step is exact, its matrix factored once for all steps";
        if (separable_.is_explicit && system_.linear && !result_.linear) return;  // of no use
        if (!result_.linear) reason = curved();
        find("linear system", result_.linear, reason);
    }

    // A second derivative that is not constant: "d2V/dadb = 2*a depends on the position".
    std::string curved() const {
        SparseMatrix hessian = system_.hessian;
        if (const Unwritten& unwritten = system_.unwritten; !unwritten.empty()) {
            const auto& [row, column] = unwritten.places.front();
            hessian.put(row, column,
                        hessian(static_cast<std::size_t>(row), static_cast<std::size_t>(column)) +
                            unwritten.at({row, column}, system_.q));
        }
        const auto blocks =
            system_.separable
                ? std::vector<std::tuple<const SparseMatrix*, bool, bool>>{{&hessian, 0, 0}}
                : std::vector<std::tuple<const SparseMatrix*, bool, bool>>{{&system_.momentum_v, true, true},
                                                                           {&system_.momentum_q, true, false},
                                                                           {&system_.force_v, false, true},
                                                                           {&system_.force_q, false, false}};
        const std::string of = system_.separable ? "V" : "L";
        for (const auto& [matrix, by_velocity, then_velocity] : blocks)
            for (const auto& [place, value] : matrix->entries()) {
                const char* on = has_any(value, system_.q)        ? "position"
                                 : has_any(value, system_.v)      ? "velocity"
                                 : value.has(system_.t)           ? "time"
                                 : has_any(value, system_.inputs) ? "inputs"
                                                                  : nullptr;
                if (on == nullptr) continue;
                const std::string row = name(place.first), column = name(place.second) + (then_velocity ? "'" : "");
                const bool outer =
                    !by_velocity && !system_.outer_force[static_cast<std::size_t>(place.first)].is_zero();
                const std::string text = canonical_text(outer && system_.separable ? -value : value),
                                  formula = text.size() > 80 ? "" : " = " + text;
                const std::string slope = outer ? fmt::format("df_{}/d{}", row, column)
                                                : fmt::format("d2{}/d{}{}d{}", of, row, by_velocity ? "'" : "", column);
                return fmt::format("{}{} depends on the {}", slope, formula, on);
            }
        return "a force depends on the time";
    }

    void describe_groups() {
        if (n_ == 1 || (form_ == Form::general && general_.routhian.active.size() == 1)) return;
        const std::size_t count = result_.groups.size();
        const auto& in = form_ == Form::general ? general_.routhian.active : std::vector<int>{};
        const auto listed = [&](const Group& group) {
            std::vector<int> coordinates;
            for (const int k : group.coordinates)
                if (in.empty() || k < static_cast<int>(in.size()))  // not a constraint
                    coordinates.push_back(in.empty() ? k : in[static_cast<std::size_t>(k)]);
            return names(coordinates);
        };
        std::string reason;
        if (count == 1) {
            reason = "all coordinates act on one another";
        } else {
            for (std::size_t g = 0; g < count && g < 4; ++g)
                reason += (g == 0 ? "{" : ", {") + listed(result_.groups[g]) + "}";
            reason += count > 4 ? fmt::format(" and {} more", count - 4) : "";
            reason += " do not act on one another: each is solved by itself";
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
             fmt::format("in a good order only coordinates at most {} apart, of {}, act on one another{}", widest,
                         largest, banded ? ": only this band is stored and solved" : ""));
    }

    void time_and_forces() {
        find("no explicit time", system_.autonomous,
             system_.autonomous ? "nothing depends on the time itself: no formula takes it"
                                : "L, a force or an event depends on the time: every formula is given it");
        std::vector<int> driven;
        for (int k = 0; k < n_; ++k)
            if (!system_.outer_force[static_cast<std::size_t>(k)].is_zero()) driven.push_back(k);
        find("no forces", driven.empty(),
             driven.empty() ? "all forces come from L, so every step is symplectic"
                            : "forces beside L act on " + names(driven) + ", so energy is gained or lost");
        if (!system_.inputs.empty()) {
            std::string list;
            for (const GiNaC::symbol& input : system_.inputs) list += (list.empty() ? "" : ", ") + input.get_name();
            find("inputs", true,
                 list + ": a program may change them before each step with set_inputs(), and the energy with them");
        }
        measured_values();
        if (!scene_.constants.empty()) {
            std::string list;
            for (const Parameter& parameter : scene_.constants) list += (list.empty() ? "" : ", ") + parameter.name;
            find("constant parameters", true, list + ": numbers in the formulas, not arguments of them");
        }
    }

    // What is not smooth in them, and not cut at; where atan2 jumps.
    void measured_values() {
        std::set<int> numbers;
        bool has_angle = false;
        const auto look_at = [&](const ex& formula) {
            for (auto part = formula.preorder_begin(); part != formula.preorder_end(); ++part) {
                if (is_table_value(*part)) numbers.insert(GiNaC::ex_to<GiNaC::numeric>(part->op(0)).to_int());
                has_angle = has_angle || is_angle(*part);
            }
        };
        look_at(system_.lagrangian);
        for (const ex& force : system_.outer_force) look_at(force);
        for (const Constraint& constraint : system_.constraints) look_at(constraint.value);
        for (const int number : numbers)
            find(
                "measured values", true,
                fmt::format("{}: cubic polynomials between {} knots, smooth to the second derivative (C2). A step "
                            "across a knot errs by h^4 where a force is this table, by h^3 where a potential is; steps "
                            "that end at knots keep the order of the method",
                            spline_of(number).file(), spline_of(number).x().size()));
        if (has_angle)
            find("angles of atan2", true,
                 "atan2(y, x) jumps by 2*pi where y passes 0 and x is below 0, and no step is cut there");
    }

    const Scene& scene_;
    const System& system_;
    const Quadrature& quadrature_;
    const int n_, interior_;
    Form form_ = Form::separable;
    SeparableForm separable_;  // also what is known of a linear map
    GeneralForm general_;
    Structure result_;
    std::vector<Finding> findings_;
};

}  // namespace

const ConstantMassForm& Structure::constant_mass() const {
    if (form() == Form::linear_map) return std::get<LinearMapForm>(of_form);
    return separable();
}

void Structure::iterate() {
    if (form() != Form::linear_map) return;
    SeparableForm separable;
    static_cast<ConstantMassForm&>(separable) = std::get<LinearMapForm>(of_form);
    of_form = std::move(separable);
}

std::pair<Structure, std::vector<Finding>> find_structure(const Scene& scene, const System& system,
                                                          const Quadrature& quadrature, bool general) {
    return Finder(scene, system, quadrature, general).run();
}

}  // namespace lobatto
