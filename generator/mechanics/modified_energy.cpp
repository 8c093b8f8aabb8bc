// SPDX-License-Identifier: GPL-2.0-or-later
// The energy that the steps of a separable system keep better than H: its leading term, by backward error analysis.
#include "generator/mechanics/modified_energy.hpp"

#include <algorithm>
#include <string>

namespace lobatto {

namespace {

using GiNaC::ex;
using GiNaC::numeric;
using GiNaC::symbol;

// Let q(t) be the exact motion over a step, and P the polynomial of degree r with its ends whose slope is the Legendre
// truncation of q': q' - P' is orthogonal to all polynomials of degree below r. With the member's quadrature Q, exact
// for the kinetic energy of such polynomials,
//     L_d[P] - int L = -m/2 int (q' - P')^2 - (Q - int) V(P) - int (V(P) - V(q)),
// and int (V(P) - V(q)) = -int V'(q) (q - P) + ... = int m q'' (q - P) = -m int (q' - P')^2. The step's own path
// differs from P by less than matters, L_d being stationary. So with the leading terms of both errors
//     L_d - int L = h^{2r+1} (kappa/2 m (q^(r+1))^2 - e D^{2r} V(P)),   D = d/dt, P^(k) = q^(k) for k <= r, else 0,
//     kappa = (r!)^2/((2r + 1) ((2r)!)^2),  e = kappa (r!)^2/(2r)! * ((r + 1)/r for Lobatto, -1 for Gauss).
// What is added to the action is taken from the energy: H_2r = e D^{2r} V(P) - kappa/2 m (q^(r+1))^2.
struct Constants {
    int r;  // degree of the path; 2r is the order
    numeric kappa, e;
};

Constants constants_of(const Method& method) {
    const bool lobatto = method.family == Family::lobatto;
    const int r = method.points - (lobatto ? 1 : 0);
    const numeric r_factorial = GiNaC::factorial(numeric(r)), twice = GiNaC::factorial(numeric(2 * r));
    const numeric kappa = r_factorial * r_factorial / (numeric(2 * r + 1) * twice * twice);
    return {r, kappa, kappa * r_factorial * r_factorial / twice * (lobatto ? numeric(r + 1, r) : numeric(-1))};
}

constexpr int highest_degree = 4;  // of the path: beyond, the formula fills pages
constexpr int most_unknowns = 12;  // coordinates times degree

constexpr std::size_t most_nodes = 3000000;  // of formulas

// Adds the nodes of a formula, a part that occurs twice counted twice, as far as `most_nodes`.
void count(const ex& f, std::size_t& nodes) {
    ++nodes;
    for (std::size_t i = 0; i < f.nops() && nodes <= most_nodes; ++i) count(f.op(i), nodes);
}

bool is_too_long(const std::vector<ex>& formulas) {
    std::size_t nodes = 0;
    for (const ex& f : formulas) count(f, nodes);
    return nodes > most_nodes;
}

}  // namespace

bool has_modified_energy(const System& system, const Method& method) {
    const int r = constants_of(method).r;
    return system.separable && system.autonomous && r <= highest_degree && system.n * r <= most_unknowns &&
           std::all_of(system.outer_force.begin(), system.outer_force.end(),
                       [](const ex& force) { return force.is_zero(); });
}

std::optional<ModifiedEnergy> modified_energy(const System& system, const Method& method) {
    const Constants constants = constants_of(method);
    if (!has_modified_energy(system, method)) return std::nullopt;
    const int n = system.n, r = constants.r;
    ModifiedEnergy result;
    result.order = 2 * r;
    const auto size = static_cast<std::size_t>(n);
    for (const symbol& q : system.q) result.p.emplace_back("p_" + q.get_name());
    const GiNaC::matrix mass = system.mass.dense(), inverse = mass.inverse();
    const auto accelerated = [&](const std::vector<ex>& force) {  // M^-1 times it
        std::vector<ex> product(size, 0);
        for (std::size_t k = 0; k < size; ++k)
            for (std::size_t l = 0; l < size; ++l)
                product[k] += inverse(static_cast<unsigned>(k), static_cast<unsigned>(l)) * force[l];
        return product;
    };
    // The time derivatives of q along the exact motion, in q and p; p' = -grad V.
    std::vector<ex> momenta(result.p.begin(), result.p.end());
    const std::vector<ex> velocity = accelerated(momenta);
    result.energy = system.potential;
    for (std::size_t k = 0; k < size; ++k) result.energy += result.p[k] * velocity[k] / 2;
    const auto along_motion = [&](const ex& f) {
        ex rate = 0;
        for (std::size_t k = 0; k < size; ++k)
            rate += f.diff(system.q[k]) * velocity[k] - f.diff(result.p[k]) * system.gradient[k];
        return rate;
    };
    std::vector<std::vector<ex>> q{{system.q.begin(), system.q.end()}, velocity};
    while (static_cast<int>(q.size()) <= r + 1) {
        std::vector<ex> next;
        for (const ex& component : q.back()) next.push_back(along_motion(component));
        if (is_too_long(next)) return std::nullopt;
        q.push_back(next);
    }
    // D^{2r} V(P), in symbols for the derivatives of P.
    std::vector<std::vector<symbol>> P{system.q};
    for (int k = 1; k <= r; ++k) {
        P.emplace_back();
        for (int j = 0; j < n; ++j) P.back().emplace_back("P");
    }
    ex rate = system.potential;
    for (int i = 0; i < 2 * r; ++i) {
        ex next = 0;
        for (int k = 0; k < r; ++k)
            for (std::size_t j = 0; j < size; ++j)
                next += rate.diff(P[static_cast<std::size_t>(k)][j]) * P[static_cast<std::size_t>(k) + 1][j];
        if (is_too_long({next})) return std::nullopt;
        rate = next;
    }
    GiNaC::exmap values;
    for (std::size_t k = 1; k < P.size(); ++k)
        for (std::size_t j = 0; j < size; ++j) values[P[k][j]] = q[k][j];
    ex square = 0;
    for (std::size_t k = 0; k < size; ++k)
        for (std::size_t l = 0; l < size; ++l)
            square += mass(static_cast<unsigned>(k), static_cast<unsigned>(l)) * q.back()[k] * q.back()[l];
    result.term = constants.e * rate.subs(values, GiNaC::subs_options::no_pattern) - constants.kappa / 2 * square;
    return result;
}

std::optional<ex> general_modified_energy(const Method& method) {
    const Constants constants = constants_of(method);
    const int r = constants.r;
    if (r > highest_degree) return std::nullopt;
    std::vector<symbol> V;  // V_0 = V(q) and its derivatives
    for (int k = 0; k <= 2 * r + 1; ++k) V.emplace_back("V_" + std::to_string(k));
    const symbol p("p"), m("m");
    const auto by_position = [&](const ex& f) {
        ex slope = 0;
        for (std::size_t k = 0; k + 1 < V.size(); ++k) slope += f.diff(V[k]) * V[k + 1];
        return slope;
    };
    std::vector<ex> q{0, p / m};
    while (static_cast<int>(q.size()) <= r + 1)
        q.push_back((by_position(q.back()) * p / m - q.back().diff(p) * V[1]).expand());
    std::vector<symbol> P;
    for (int k = 0; k <= r; ++k) P.emplace_back("P");
    ex rate = V[0];
    for (int i = 0; i < 2 * r; ++i) {
        ex next = by_position(rate) * P[1];
        for (std::size_t k = 1; k + 1 < P.size(); ++k) next += rate.diff(P[k]) * P[k + 1];
        rate = next.expand();
    }
    GiNaC::exmap values;
    for (std::size_t k = 1; k < P.size(); ++k) values[P[k]] = q[k];
    const ex term = constants.e * rate.subs(values, GiNaC::subs_options::no_pattern) -
                    constants.kappa / 2 * m * q.back() * q.back();
    return term.expand();
}

}  // namespace lobatto
