// SPDX-License-Identifier: GPL-2.0-or-later
// The equations of a step of any Lagrangian.
#include <fmt/format.h>

#include <map>

#include "generator/describe/writer.hpp"

namespace lobatto {

// (D28, D30) in positions and velocities at the nodes, which have names of their own: written out in the control
// points alone they would be too long to read.
void Describer::general_equations() {
    const Discretisation& disc = d_.discretisation();
    const Quadrature& q = d_.quadrature;
    const std::size_t r = q.nodes.size();
    const GiNaC::ex h = disc.h;
    section("The discrete Lagrangian and its equations");
    std::vector<GiNaC::exmap> at_node(r);
    Names position_names, velocity_names;
    std::vector<GiNaC::ex> positions, velocities;
    for (std::size_t i = 0; i < r; ++i) {
        at_node[i][d_.system.t] = disc.t0 + q.nodes[i] * h;
        for (std::size_t k = 0; k < n_; ++k) {
            const std::string place = fmt::format("{}{}_{}", name(k), lobatto_ ? "" : "_at", i + 1);
            const GiNaC::symbol position(place), velocity(place + "'");
            GiNaC::ex value = 0, rise = 0;
            for (std::size_t j = 0; j < controls_; ++j) {
                value += q.B(at(i), at(j)) * disc.Q[j][k];
                rise += q.D(at(i), at(j)) * disc.Q[j][k];
            }
            at_node[i][d_.system.q[k]] = lobatto_ ? value : GiNaC::ex(position);
            at_node[i][d_.system.v[k]] = velocity;
            rename(velocity, velocity.get_name());
            velocity_names.push_back(name_of(velocity));
            velocities.push_back(rise / h);
            if (lobatto_) continue;
            rename(position, position.get_name());
            position_names.push_back(name_of(position));
            positions.push_back(value);
        }
    }
    if (!lobatto_) vector("node_positions", "D28", "", "positions at the nodes", position_names, positions);
    vector("node_velocities", "D28", "", "velocities at the nodes", velocity_names, velocities);
    const auto moved = [&](const GiNaC::ex& expression, std::size_t i) {
        return expression.subs(at_node[i], GiNaC::subs_options::no_pattern);
    };
    GiNaC::ex action = 0;
    for (std::size_t i = 0; i < r; ++i) action += h * q.weights[i] * moved(d_.system.lagrangian, i);
    scalar("discrete_lagrangian", "D30", "", "discrete Lagrangian: the quadrature of L along the interpolated path",
           "L_d", action);
    const auto slopes = [&](std::size_t j, int sign) {
        std::vector<GiNaC::ex> values;
        for (std::size_t k = 0; k < n_; ++k) {
            GiNaC::ex sum = 0;
            for (std::size_t i = 0; i < r; ++i)
                sum += q.weights[i] * (q.D(at(i), at(j)) * moved(d_.system.momentum[k], i) +
                                       h * q.B(at(i), at(j)) * moved(d_.system.force[k], i));
            values.push_back(sign * sum);
        }
        return values;
    };
    std::vector<GiNaC::ex> interior;
    for (std::size_t j = 1; j + 1 < controls_; ++j) {
        const std::vector<GiNaC::ex> more = slopes(j, 1);
        interior.insert(interior.end(), more.begin(), more.end());
    }
    if (!interior.empty())
        vector("interior_equations", "D30", "", "interior discrete Euler-Lagrange equations",
               Names(interior.size(), "0"), interior);
    vector("left_momentum", "D6", "", "momentum at the left end", names_of(disc.p0), slopes(0, -1));
    vector("right_momentum", "D7", "", "momentum at the right end", names_of(disc.p1), slopes(controls_ - 1, 1));
}

void Describer::name_blocks(const std::vector<std::string>& letters, Blocks& node) {
    for (const std::string& letter : letters)
        for (std::size_t i = 1; i <= d_.quadrature.nodes.size(); ++i) {
            node[letter].emplace_back(fmt::format("{}_{}", letter, i));
            rename(node[letter].back(), node[letter].back().get_name());
        }
}

void Describer::add_second_derivatives(const GiNaC::ex& h, Blocks& node, GiNaC::matrix& J) const {
    const Quadrature& q = d_.quadrature;
    for (std::size_t j = 0; j + 1 < controls_; ++j)
        for (std::size_t k = 1; k < controls_; ++k)
            for (std::size_t i = 0; i < q.nodes.size(); ++i) {
                const GiNaC::ex Dj = q.D(at(i), at(j)), Dk = q.D(at(i), at(k)), Bj = q.B(at(i), at(j)),
                                Bk = q.B(at(i), at(k));
                J(at(j), at(k - 1)) += q.weights[i] * (Dj * Dk / h * node["H_vv"][i] + Dj * Bk * node["H_vq"][i] +
                                                       Bj * Dk * node["H_qv"][i] + h * Bj * Bk * node["H_qq"][i]);
            }
}

GiNaC::ex Describer::add_multiplier(const GiNaC::ex& h, Blocks& node, GiNaC::matrix& J) const {
    const Quadrature& q = d_.quadrature;
    const std::size_t unknowns = controls_ - 1;
    GiNaC::ex condition = 0;
    for (std::size_t i = 0; i < q.nodes.size(); ++i) {
        const GiNaC::ex weight = q.weights[i] * q.legendre[i];
        condition += h * weight * node["g_P"][i];
        for (std::size_t j = 0; j < unknowns; ++j) {
            J(at(j), at(unknowns)) +=
                weight * (q.D(at(i), at(j)) * node["H_vP"][i] + h * q.B(at(i), at(j)) * node["H_qP"][i]);
            J(at(unknowns), at(j)) +=
                weight * (q.D(at(i), at(j + 1)) * node["H_Pv"][i] + h * q.B(at(i), at(j + 1)) * node["H_Pq"][i]);
        }
        J(at(unknowns), at(unknowns)) += h * weight * q.legendre[i] * node["H_PP"][i];
    }
    return condition;
}

// (D30) in blocks: one entry for all coordinates together.
void Describer::general_step() {
    const Quadrature& q = d_.quadrature;
    const std::size_t r = q.nodes.size(), unknowns = controls_ - 1;
    const bool multiplier = lobatto_ && !d_.structure.routhian().cyclic.empty();
    section("The step: all positions but the first, in blocks of all coordinates");
    Blocks node;
    name_blocks({"g_v", "g_q", "g_P", "H_vv", "H_vq", "H_vP", "H_qv", "H_qq", "H_qP", "H_Pv", "H_Pq", "H_PP"}, node);
    const GiNaC::symbol h = written_out_ ? d_.discretisation().h : GiNaC::symbol("h"), left("p_0");
    rename(left, "p_0");
    const auto slope = [&](std::size_t j) {
        GiNaC::ex sum = 0;
        for (std::size_t i = 0; i < r; ++i)
            sum += q.weights[i] * (q.D(at(i), at(j)) * node["g_v"][i] + h * q.B(at(i), at(j)) * node["g_q"][i]);
        return sum;
    };
    const bool constrained = !d_.system.constraints.empty();
    if (constrained) name_blocks({"lambda", "phi", "G", "GT"}, node);
    const auto pull = [&](std::size_t j) -> GiNaC::ex {
        return constrained ? h * q.weights[j] * node["GT"][j] * node["lambda"][j] : GiNaC::ex(0);
    };
    std::vector<GiNaC::ex> residual;
    Names names;
    for (std::size_t j = 0; j < unknowns; ++j) {
        residual.push_back(slope(j) + (j == 0 ? GiNaC::ex(left) : GiNaC::ex(0)) + pull(j));
        names.push_back(fmt::format("R_{}", j + 1));
    }
    for (std::size_t j = 0; j < unknowns && constrained; ++j) {
        residual.push_back(node["phi"][j + 1]);
        names.push_back(fmt::format("R_phi_{}", j + 2));
    }
    const std::size_t size = constrained ? 2 * unknowns : unknowns + (multiplier ? 1 : 0);
    GiNaC::matrix J(at(size), at(size));
    for (std::size_t j = 0; j < unknowns && constrained; ++j) {
        J(at(j), at(unknowns + j)) = h * q.weights[j] * node["GT"][j];
        J(at(unknowns + j), at(j)) = node["G"][j + 1];
    }
    add_second_derivatives(h, node, J);
    if (multiplier) {
        residual.push_back(add_multiplier(h, node, J));
        names.push_back("R_kappa");
    }
    vector("step_equations", "D30", "",
           "R = 0: g_v and g_q are momentum and force at the nodes" +
               std::string(multiplier    ? ", g_P the negative velocity of the cyclic coordinates"
                           : constrained ? ", GT = G^T, lambda the multipliers of the constraints"
                                         : ""),
           names, residual);
    matrix("step_jacobian", "D30", "",
           "its Jacobian: H are the second derivatives at the nodes" +
               std::string(constrained ? ", those of phi times lambda among H_qq" : "") + "; columns: positions 2 to " +
               std::to_string(controls_) +
               (multiplier    ? ", kappa"
                : constrained ? fmt::format(", lambda_1 to lambda_{}", unknowns)
                              : ""),
           "J", J);
    vector("arrival_momentum", "D30", "", "arrival, explicit: the momentum after the step", {"p_1"},
           {slope(controls_ - 1) + pull(controls_ - 1)});
    if (constrained)
        vector("hidden_constraint", "D46", "", fmt::format("where lambda_{} keeps the velocity on the constraints", r),
               {"0"}, {node["G"].back() * GiNaC::symbol("v_1") + GiNaC::symbol("phi_t")});
}

}  // namespace lobatto
