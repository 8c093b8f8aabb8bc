// SPDX-License-Identifier: GPL-2.0-or-later
// Cyclic coordinates and the Lagrangian without them.
#include "generator/routhian.hpp"

#include <algorithm>

namespace lobatto {

namespace {

using GiNaC::ex;

constexpr std::size_t most_cyclic = 3;  // their velocities follow from the inverse of a matrix of formulas

bool contains(const std::vector<int>& list, int value) {
    return std::find(list.begin(), list.end(), value) != list.end();
}

}  // namespace

std::vector<int> find_cyclic(const System& system) {
    std::vector<int> cyclic;
    for (int k = 0; k < system.n; ++k) {
        const auto at = static_cast<std::size_t>(k);
        bool held = !system.force[at].is_zero();
        for (const SparseMatrix* matrix : {&system.momentum_q, &system.force_q})
            for (const auto& [place, value] : matrix->entries()) held = held || place.second == k;
        if (!held) cyclic.push_back(k);
    }
    // Squared at most, all of them together: the second derivatives among them are free of them.
    for (const auto& [place, value] : system.momentum_v.entries())
        if (contains(cyclic, place.first) && contains(cyclic, place.second))
            for (const int k : cyclic)
                if (value.has(system.v[static_cast<std::size_t>(k)])) return {};
    for (const auto& [place, value] : system.momentum_v.entries())
        if (contains(cyclic, place.first) && !contains(cyclic, place.second))
            for (const int k : cyclic)
                if (value.has(system.v[static_cast<std::size_t>(k)])) return {};
    // A force may still hold a cyclic velocity; then its coordinate stays.
    if (cyclic.size() > most_cyclic) cyclic.resize(most_cyclic);
    if (static_cast<int>(cyclic.size()) == system.n) cyclic.pop_back();
    return cyclic;
}

Routhian reduce(const System& system, const std::vector<int>& cyclic) {
    Routhian routhian;
    routhian.cyclic = cyclic;
    GiNaC::exmap at_rest, velocities;
    for (const int k : cyclic) {
        const auto at = static_cast<std::size_t>(k);
        at_rest[system.v[at]] = 0;
        routhian.P.emplace_back("P_" + system.q[at].get_name());
    }
    // L = L_0 + alpha . v + v . I v / 2 in the cyclic v, so v = I^-1 (P - alpha) and R = L_0 - (P - alpha) . v / 2.
    std::vector<ex> terms = system.terms;
    if (!cyclic.empty()) {
        const unsigned c = static_cast<unsigned>(cyclic.size());
        GiNaC::matrix inertia(c, c), rest(c, 1);
        const auto index = [&](unsigned i) { return static_cast<std::size_t>(cyclic[i]); };
        for (unsigned i = 0; i < c; ++i) {
            rest(i, 0) = routhian.P[i] - system.momentum[index(i)].subs(at_rest, GiNaC::subs_options::no_pattern);
            for (unsigned j = 0; j < c; ++j) inertia(i, j) = system.momentum_v(index(i), index(j));
        }
        const GiNaC::matrix velocity = inertia.inverse().mul(rest);
        for (ex& term : terms) term = term.subs(at_rest, GiNaC::subs_options::no_pattern);
        for (unsigned i = 0; i < c; ++i) {
            terms.push_back(-rest(i, 0) * velocity(i, 0) / 2);
            velocities[system.v[index(i)]] = velocity(i, 0);
        }
    }
    std::vector<GiNaC::symbol> v, q;
    std::vector<ex> forces;
    for (int k = 0; k < system.n; ++k) {
        if (contains(cyclic, k)) continue;
        const auto at = static_cast<std::size_t>(k);
        routhian.active.push_back(k);
        v.push_back(system.v[at]);
        q.push_back(system.q[at]);
        forces.push_back(system.outer_force[at].subs(velocities, GiNaC::subs_options::no_pattern));
    }
    routhian.z = v;
    routhian.z.insert(routhian.z.end(), q.begin(), q.end());
    routhian.z.insert(routhian.z.end(), routhian.P.begin(), routhian.P.end());
    if (cyclic.empty()) {  // R = L: the system's own derivatives
        const int n = system.n;
        routhian.gradient = system.momentum;
        routhian.gradient.insert(routhian.gradient.end(), system.force.begin(), system.force.end());
        routhian.second = SparseMatrix(2 * n, 2 * n);
        for (const auto& [matrix, row, column] :
             {std::tuple{&system.momentum_v, 0, 0}, std::tuple{&system.momentum_q, 0, n},
              std::tuple{&system.force_v, n, 0}, std::tuple{&system.force_q, n, n}})
            for (const auto& [place, value] : matrix->entries())
                routhian.second.put(row + place.first, column + place.second, value);
        return routhian;
    }
    routhian.gradient = gradient_of(terms, routhian.z);
    for (std::size_t k = 0; k < q.size(); ++k) routhian.gradient[v.size() + k] += forces[k];
    routhian.second = derivative_of(routhian.gradient, routhian.z);
    return routhian;
}

}  // namespace lobatto
