// SPDX-License-Identifier: GPL-2.0-or-later
// Cyclic coordinates and the Lagrangian without them.
#include "generator/mechanics/structure/routhian.hpp"

#include <algorithm>
#include <set>

#include "generator/mechanics/algebra/sample.hpp"

namespace lobatto {

namespace {

using GiNaC::ex;

constexpr std::size_t most_cyclic = 3;  // formulas of their velocities grow with each of them

bool contains(const std::vector<int>& list, int value) {
    return std::find(list.begin(), list.end(), value) != list.end();
}

// What does not change with the cyclic coordinates may still hold them, as in cos(q)^2 + sin(q)^2: it is that at 0.
ex at_origin(const ex& value, const System& system, const std::vector<int>& cyclic) {
    GiNaC::exmap origin;
    for (const int k : cyclic) origin[system.q[static_cast<std::size_t>(k)]] = 0;
    return value.subs(origin, GiNaC::subs_options::no_pattern);
}

ex at_rest(const ex& value, const System& system, const std::vector<int>& cyclic) {
    GiNaC::exmap rest;
    for (const int k : cyclic)
        rest[system.v[static_cast<std::size_t>(k)]] = rest[system.q[static_cast<std::size_t>(k)]] = 0;
    return value.subs(rest, GiNaC::subs_options::no_pattern);
}

bool has_value_at_rest(const System& system, const std::vector<int>& cyclic) {
    try {
        for (const ex& term : system.terms) at_rest(term, system, cyclic);
        for (const ex& momentum : system.momentum) at_rest(momentum, system, cyclic);
        for (const int i : cyclic)
            for (const int j : cyclic) at_origin(system.momentum_v(i, j), system, cyclic);
        for (const ex& force : system.outer_force) at_origin(force, system, cyclic);
        return true;
    } catch (const std::domain_error&) {  // however small, a term that is infinite there, or 0^0
        return false;
    }
}

// The signs of the pivots of a symmetric matrix, row by row, c x c; 0 from the first on that vanishes.
std::vector<int> pivot_signs(const std::vector<Sized>& entries, std::size_t c) {
    std::vector<cln::cl_R> values;
    for (const Sized& entry : entries) values.push_back(entry.value);
    std::vector<int> signs(c, 0);
    for (std::size_t k = 0; k < c; ++k) {
        const cln::cl_R& pivot = values[k * c + k];
        if (Sized{pivot, entries[k * c + k].size}.vanishes()) break;
        signs[k] = pivot > 0 ? 1 : -1;
        for (std::size_t i = k + 1; i < c; ++i)
            for (std::size_t j = k + 1; j < c; ++j)
                values[i * c + j] = values[i * c + j] - values[i * c + k] * values[k * c + j] / pivot;
    }
    return signs;
}

// Everywhere that is looked at, and always with the same sign.
bool has_definite_inertia(const Scene& scene, const System& system, const std::vector<int>& cyclic) {
    std::vector<ex> entries;
    for (const int i : cyclic)
        for (const int j : cyclic) entries.push_back(system.momentum_v(i, j));
    std::set<int> signs;
    at_sample_points(scene, [&](NearStart& point) {
        Formulas formulas;
        point.set_all(formulas);
        const std::vector<Id> roots = formulas.convert(entries);
        const auto look = [&] {
            for (const int sign : pivot_signs(formulas.evaluate_sized(roots), cyclic.size())) signs.insert(sign);
        };
        look();
        // The other side of the origin: what changes its sign far from the start may do so there.
        for (const GiNaC::symbol& q : system.q) formulas.set(q, -formulas.get(q));
        try {
            look();
        } catch (const DomainError&) {
        }
    });
    return signs.size() <= 1 && signs.count(0) == 0;
}

}  // namespace

std::vector<int> find_cyclic(const Scene& scene, const System& system) {
    std::vector<int> cyclic;
    for (int k = 0; k < system.n; ++k) {
        const auto at = static_cast<std::size_t>(k);
        bool held = !system.force[at].is_zero();
        for (const SparseMatrix* matrix : {&system.momentum_q, &system.force_q})
            for (const auto& [place, value] : matrix->entries()) held = held || place.second == k;
        if (!held) cyclic.push_back(k);
    }
    // Squared at most, all of them together: no mass in which one of them stands holds the velocity of one.
    const auto stands_in_masses = [&](int k) {
        return std::any_of(
            system.momentum_v.entries().begin(), system.momentum_v.entries().end(), [&](const auto& mass) {
                return contains(cyclic, mass.first.first) && mass.second.has(system.v[static_cast<std::size_t>(k)]);
            });
    };
    for (;;) {
        const auto k = std::find_if(cyclic.begin(), cyclic.end(), stands_in_masses);
        if (k == cyclic.end()) break;
        cyclic.erase(k);
    }
    // A force may still hold a cyclic velocity; then its coordinate stays.
    if (cyclic.size() > most_cyclic) cyclic.resize(most_cyclic);
    if (static_cast<int>(cyclic.size()) == system.n) cyclic.pop_back();
    if (cyclic.empty() || !has_value_at_rest(system, cyclic) || !has_definite_inertia(scene, system, cyclic)) return {};
    return cyclic;
}

namespace {

// L + phi . lambda (D44), its slopes and second derivatives.
void add_constraints(const System& system, Routhian& routhian) {
    const int n = system.n, count = static_cast<int>(system.constraints.size());
    SparseMatrix second(2 * n + count, 2 * n + count);
    for (const auto& [place, value] : routhian.second.entries()) second.put(place.first, place.second, value);
    for (const Constraint& constraint : system.constraints)
        routhian.multipliers.emplace_back("lambda_" + constraint.name);
    std::vector<ex> pull(static_cast<std::size_t>(n), ex(0));  // G^T lambda
    for (const auto& [place, slope] : system.constraint_q.entries()) {
        const auto [c, k] = place;
        pull[static_cast<std::size_t>(k)] += slope * routhian.multipliers[static_cast<std::size_t>(c)];
        second.put(n + k, 2 * n + c, slope);
        second.put(2 * n + c, n + k, slope);
    }
    for (int k = 0; k < n; ++k) routhian.gradient[static_cast<std::size_t>(n + k)] += pull[static_cast<std::size_t>(k)];
    const SparseMatrix bend = derivative_of(pull, system.q);
    for (const auto& [place, value] : bend.entries()) {
        const auto row = static_cast<std::size_t>(n + place.first), column = static_cast<std::size_t>(n + place.second);
        second.put(n + place.first, n + place.second, second(row, column) + value);
    }
    for (const Constraint& constraint : system.constraints) routhian.gradient.push_back(constraint.value);
    routhian.z.insert(routhian.z.end(), routhian.multipliers.begin(), routhian.multipliers.end());
    routhian.second = second;
}

int parts_of(const ex& formula) {
    int parts = 1;
    for (const ex& part : formula) parts += parts_of(part);
    return parts;
}

struct SumOfSquares {
    std::vector<ex> squares, solution;  // r . A^-1 r is the sum of these; A^-1 r
};

// Of a definite matrix, by elimination, the simplest pivot first: (P - Q cos(a))^2 / sin(a)^2 keeps its digits where
// the inverse of the matrix, multiplied out, is a difference of large numbers.
SumOfSquares sum_of_squares(GiNaC::matrix A, std::vector<ex> r) {
    const unsigned c = A.rows();
    std::vector<unsigned> order;
    std::vector<bool> done(c, false);
    SumOfSquares found{std::vector<ex>(c), std::vector<ex>(c)};
    for (unsigned step = 0; step < c; ++step) {
        unsigned k = c;
        for (unsigned i = 0; i < c; ++i)
            if (!done[i] && (k == c || parts_of(A(i, i)) < parts_of(A(k, k)))) k = i;
        done[k] = true;
        order.push_back(k);
        found.squares[k] = GiNaC::pow(r[k], 2) / A(k, k);
        for (unsigned i = 0; i < c; ++i) {
            if (done[i]) continue;
            const ex part = A(i, k) / A(k, k);
            r[i] -= part * r[k];
            for (unsigned j = 0; j < c; ++j)
                if (!done[j]) A(i, j) -= part * A(k, j);
        }
    }
    for (auto k = order.rbegin(); k != order.rend(); ++k) {
        ex rest = r[*k];
        for (auto later = order.rbegin(); later != k; ++later) rest -= A(*k, *later) * found.solution[*later];
        found.solution[*k] = rest / A(*k, *k);
    }
    return found;
}

}  // namespace

Routhian reduce(const System& system, const std::vector<int>& cyclic) {
    Routhian routhian;
    routhian.cyclic = cyclic;
    GiNaC::exmap velocities;
    for (const int k : cyclic) routhian.P.emplace_back("P_" + system.q[static_cast<std::size_t>(k)].get_name());
    // L = L_0 + alpha . v + v . I v / 2 in the cyclic v, so v = I^-1 (P - alpha) and R = L_0 - (P - alpha) . v / 2.
    std::vector<ex> terms = system.terms;
    if (!cyclic.empty()) {
        const unsigned c = static_cast<unsigned>(cyclic.size());
        GiNaC::matrix inertia(c, c);
        std::vector<ex> rest;
        const auto index = [&](unsigned i) { return static_cast<std::size_t>(cyclic[i]); };
        for (unsigned i = 0; i < c; ++i) {
            rest.push_back(routhian.P[i] - at_rest(system.momentum[index(i)], system, cyclic));
            for (unsigned j = 0; j < c; ++j)
                inertia(i, j) = at_origin(system.momentum_v(index(i), index(j)), system, cyclic);
        }
        for (ex& term : terms) term = at_rest(term, system, cyclic);
        const SumOfSquares found = sum_of_squares(inertia, rest);
        for (unsigned i = 0; i < c; ++i) {
            terms.push_back(-found.squares[i] / 2);
            velocities[system.v[index(i)]] = found.solution[i];
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
        forces.push_back(
            at_origin(system.outer_force[at], system, cyclic).subs(velocities, GiNaC::subs_options::no_pattern));
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
        if (!system.constraints.empty()) add_constraints(system, routhian);
        return routhian;
    }
    routhian.gradient = gradient_of(terms, routhian.z);
    for (std::size_t k = 0; k < q.size(); ++k) routhian.gradient[v.size() + k] += forces[k];
    routhian.second = derivative_of(routhian.gradient, routhian.z);
    return routhian;
}

}  // namespace lobatto
