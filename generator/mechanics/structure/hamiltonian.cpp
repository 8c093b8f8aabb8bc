// SPDX-License-Identifier: GPL-2.0-or-later
#include "generator/mechanics/structure/hamiltonian.hpp"

#include <algorithm>
#include <utility>

#include "generator/mechanics/algebra/sample.hpp"

namespace lobatto {

namespace {

using GiNaC::ex;

bool mentions_any(const ex& expression, const std::vector<GiNaC::symbol>& symbols) {
    return std::any_of(symbols.begin(), symbols.end(), [&](const auto& symbol) { return expression.has(symbol); });
}

// Of the scene's quaternions all four coordinates; nothing where one of them is no coordinate.
std::optional<std::vector<std::array<std::size_t, 4>>> quaternions_of(const Scene& scene, const System& system) {
    std::vector<std::array<std::size_t, 4>> result;
    for (const auto& quaternion : scene.quaternions) {
        std::array<std::size_t, 4> places{};
        for (std::size_t k = 0; k < 4; ++k) {
            const auto found = std::find_if(system.q.begin(), system.q.end(),
                                            [&](const auto& q) { return q.is_equal(quaternion[k]); });
            if (found == system.q.end()) return std::nullopt;
            places[k] = static_cast<std::size_t>(found - system.q.begin());
        }
        result.push_back(places);
    }
    return result;
}

// J: M where all quaternions are 1 and all other coordinates 0.
std::optional<SparseMatrix> mass_in_bodies(const System& system, const Hamiltonian& found) {
    GiNaC::exmap drawn;
    for (const auto& q : system.q) drawn[q] = 0;
    for (const auto& quaternion : found.quaternions) drawn[system.q[quaternion[0]]] = 1;
    const std::vector<GiNaC::symbol> motion = system.motion();
    SparseMatrix J(system.n, system.n);
    try {
        for (const auto& [place, value] : system.momentum_v.entries()) {
            const ex here = value.subs(drawn);
            if (mentions_any(here, motion)) return std::nullopt;
            if (!here.is_zero()) J.put(place.first, place.second, here);
        }
    } catch (const std::exception&) {  // no value there
        return std::nullopt;
    }
    return J;
}

// B^T p - J w of all coordinates, n times that of quaternions.
std::vector<ex> differences(const System& system, const Hamiltonian& found, const SparseMatrix& J) {
    std::vector<ex> u = system.momentum, w(system.v.begin(), system.v.end());
    for (const auto& places : found.quaternions) {
        ex square = 0;
        for (const std::size_t place : places) square += system.q[place] * system.q[place];
        for (std::size_t k = 0; k < 4; ++k) {
            ex along_p = 0, along_v = 0;
            for (std::size_t j = 0; j < 4; ++j) {
                const Signed& part = quaternion_product[k][j];
                const ex q = part.sign * system.q[places[part.place]];
                along_p += q * system.momentum[places[j]];
                along_v += q * system.v[places[j]];
            }
            u[places[k]] = along_p;
            w[places[k]] = along_v / square;
        }
    }
    for (const auto& [place, value] : J.entries())
        u[static_cast<std::size_t>(place.first)] -= value * w[static_cast<std::size_t>(place.second)];
    return u;
}

// Whether all vanish identically; formulas that hold what their values do not tell of are not trusted. Of `others` it
// is told one by one.
bool vanish(const Scene& scene, const std::vector<ex>& all, const std::vector<ex>& others,
            std::vector<bool>& vanishes) {
    bool answer = true;
    vanishes.assign(others.size(), true);
    at_sample_points(scene, [&](NearStart& point) {
        Formulas formulas;
        point.set_all(formulas);
        const std::vector<Id> roots = formulas.convert(all), more = formulas.convert(others);
        const std::vector<Sized> nodes = formulas.evaluate_all_sized(roots), values = formulas.evaluate_sized(more);
        const std::vector<GiNaC::exset> hidden = formulas.hidden(roots, nodes);
        for (std::size_t i = 0; i < roots.size(); ++i)
            answer = answer && nodes[static_cast<std::size_t>(roots[i])].vanishes() && hidden[i].empty();
        for (std::size_t i = 0; i < others.size(); ++i) vanishes[i] = vanishes[i] && values[i].vanishes();
    });
    return answer;
}

// N, by Gauss and Jordan without a change of rows: J is positive definite, and what is zero stays so.
void invert(Hamiltonian& found) {
    const int n = found.mass.rows();
    GiNaC::matrix A = found.mass.dense(), N(static_cast<unsigned>(n), static_cast<unsigned>(n));
    for (unsigned k = 0; k < N.rows(); ++k) N(k, k) = 1;
    for (unsigned k = 0; k < N.rows(); ++k) {
        const ex pivot = A(k, k);
        found.pivots.push_back(pivot);
        for (unsigned j = 0; j < N.cols(); ++j) {
            A(k, j) = A(k, j) / pivot;
            N(k, j) = N(k, j) / pivot;
        }
        for (unsigned i = 0; i < N.rows(); ++i) {
            if (i == k || A(i, k).is_zero()) continue;
            const ex factor = A(i, k);
            for (unsigned j = 0; j < N.cols(); ++j) {
                A(i, j) = A(i, j) - factor * A(k, j);
                N(i, j) = N(i, j) - factor * N(k, j);
            }
        }
    }
    found.inverse = SparseMatrix(n, n);
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
            const ex value = N(static_cast<unsigned>(i), static_cast<unsigned>(j));
            if (!value.is_zero()) found.inverse.put(i, j, value);
        }
}

}  // namespace

std::pair<std::optional<Hamiltonian>, std::string> find_hamiltonian(const Scene& scene, const System& system) {
    const auto refused = [](const std::string& reason) { return std::pair(std::optional<Hamiltonian>(), reason); };
    if (!system.constraints.empty()) return refused("constraints are solved for together with the motion");
    if (scene.clock) return refused("the masses change with the clock");
    if (system.n > most_iterated)
        return refused("there are more than " + std::to_string(most_iterated) + " coordinates");
    const auto holds_time = [&](const ex& p) { return p.has(system.t) || mentions_any(p, system.inputs); };
    const auto holds_velocity = [&](const ex& force) { return mentions_any(force, system.v); };
    if (std::any_of(system.momentum.begin(), system.momentum.end(), holds_time))
        return refused("momenta hold the time or inputs");
    if (std::any_of(system.outer_force.begin(), system.outer_force.end(), holds_velocity))
        return refused("forces hold velocities");
    const std::string varies = "in the angular velocities of bodies the masses are not constant";
    Hamiltonian found;
    const auto quaternions = quaternions_of(scene, system);
    if (!quaternions) return refused(varies);
    found.quaternions = *quaternions;
    const std::optional<SparseMatrix> J = mass_in_bodies(system, found);
    if (!J) return refused(varies);
    found.force = all_at(system.force, system.v, 0);
    std::vector<ex> candidates = found.force;
    for (const auto& [place, value] : J->entries()) candidates.push_back(value);
    std::vector<bool> vanishes;
    if (!vanish(scene, differences(system, found, *J), candidates, vanishes)) return refused(varies);
    for (std::size_t k = 0; k < found.force.size(); ++k)
        if (vanishes[k]) found.force[k] = 0;
    found.mass = SparseMatrix(system.n, system.n);
    std::size_t e = found.force.size();
    for (const auto& [place, value] : J->entries())
        if (!vanishes[e++]) found.mass.put(place.first, place.second, value);
    for (std::size_t k = 0; k < found.force.size(); ++k)
        if (found.mass(k, k).is_zero()) return refused("a coordinate has no mass");
    invert(found);
    return {found,
            "in the angular velocities of bodies the masses are constant: iterations take velocities from "
            "momenta by a formula, and factor no matrix"};
}

}  // namespace lobatto
