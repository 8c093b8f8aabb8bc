// SPDX-License-Identifier: GPL-2.0-or-later
// heyoka's Taylor integrators as contestants, default and with fast math; ensembles run in its batch mode. Written for
// the C++ interface of heyoka 7. Built only where CMake finds heyoka.
#include <heyoka/heyoka.hpp>

#include <chrono>
#include <map>
#include <memory>

#include "bench/contestant.hpp"

namespace lobatto::bench {

namespace {

using heyoka::expression;
using Equations = std::vector<std::pair<expression, expression>>;

Equations equations_of(const Problem& problem) {
    using heyoka::cos, heyoka::make_vars, heyoka::pow, heyoka::prime, heyoka::sin;
    if (problem.name == "P1") {
        const auto [q, p] = make_vars("q", "p");
        return {prime(q) = p, prime(p) = -sin(q)};
    }
    if (problem.name == "P3") {
        const auto [q1, q2, p1, p2] = make_vars("q1", "q2", "p1", "p2");
        const expression c = cos(q1 - q2), s = sin(q1 - q2), determinant = 1. + s * s;
        const expression v1 = (p1 - c * p2) / determinant, v2 = (2. * p2 - c * p1) / determinant;
        return {prime(q1) = v1, prime(q2) = v2, prime(p1) = -v1 * v2 * s - 2. * DoublePendulum::g * sin(q1),
                prime(p2) = v1 * v2 * s - DoublePendulum::g * sin(q2)};
    }
    if (problem.name == "P5") {
        const std::size_t n = problem.q.size();
        std::vector<expression> q, p, tension;
        for (std::size_t i = 0; i < n; ++i) q.emplace_back("q" + std::to_string(i));
        for (std::size_t i = 0; i < n; ++i) p.emplace_back("p" + std::to_string(i));
        for (std::size_t i = 0; i <= n; ++i) {
            const expression d = i == 0 ? q[0] : i == n ? -q[n - 1] : q[i] - q[i - 1];
            tension.push_back(d + Chain::beta * d * d * d);
        }
        Equations all;
        for (std::size_t i = 0; i < n; ++i) all.push_back(prime(q[i]) = p[i]);
        for (std::size_t i = 0; i < n; ++i) all.push_back(prime(p[i]) = tension[i + 1] - tension[i]);
        return all;
    }
    const auto [x, y, u, v] = make_vars("x", "y", "u", "v");
    if (problem.name == "P2")
        return {prime(x) = u, prime(y) = v, prime(u) = -x - 2. * x * y, prime(v) = y * y - x * x - y};
    const expression factor = pow(x * x + y * y, -1.5);
    return {prime(x) = u, prime(y) = v, prime(u) = -x * factor, prime(v) = -y * factor};
}

// The integrators of one problem by tolerance: each is compiled once.
template <class Integrator>
using Compiled = std::map<double, std::unique_ptr<Integrator>>;

Contestant taylor(const Problem& problem, bool fast_math) {
    using ScalarFallback = heyoka::taylor_adaptive<double>;
    using Batch = heyoka::taylor_adaptive_batch<double>;
    namespace kw = heyoka::kw;
    const auto single = std::make_shared<Compiled<Single>>();
    const auto batch = std::make_shared<Compiled<Batch>>();
    const std::size_t size = 2 * problem.q.size();

    const auto prepare = [=, &problem](double tolerance, std::size_t trajectories) {
        const auto start = std::chrono::steady_clock::now();
        if (trajectories == 1) {
            (*single)[tolerance] = std::make_unique<Single>(equations_of(problem), std::vector<double>(size, 1.),
                                                            kw::tol = tolerance, kw::fast_math = fast_math);
        } else {
            (*batch)[tolerance] = std::make_unique<Batch>(
                equations_of(problem), std::vector<double>(size * trajectories, 1.),
                static_cast<std::uint32_t>(trajectories), kw::tol = tolerance, kw::fast_math = fast_math);
        }
        return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    };
    const auto run = [=, until = problem.until](double tolerance, std::vector<Trajectory>& trajectories) {
        const std::size_t lanes = trajectories.size();
        if (lanes == 1) {
            Single& integrator = *single->at(tolerance);
            integrator.set_time(0.);
            join(trajectories[0], integrator.get_state_data());
            const auto result = integrator.propagate_until(until);
            split(integrator.get_state_data(), trajectories[0]);
            return Effort{std::get<0>(result) == heyoka::taylor_outcome::time_limit,
                          static_cast<long>(std::get<3>(result)), 0};
        }
        Batch& integrator = *batch->at(tolerance);
        integrator.set_time(std::vector<double>(lanes, 0.));
        double* const state = integrator.get_state_data();  // component by component, each with its lanes
        std::vector<double> y(size);
        for (std::size_t lane = 0; lane < lanes; ++lane) {
            join(trajectories[lane], y.data());
            for (std::size_t k = 0; k < size; ++k) state[k * lanes + lane] = y[k];
        }
        integrator.propagate_until(std::vector<double>(lanes, until));
        Effort effort{true, 0, 0};
        for (std::size_t lane = 0; lane < lanes; ++lane) {
            for (std::size_t k = 0; k < size; ++k) y[k] = state[k * lanes + lane];
            split(y.data(), trajectories[lane]);
            const auto& result = integrator.get_propagate_res()[lane];
            effort.good = effort.good && std::get<0>(result) == heyoka::taylor_outcome::time_limit;
            effort.steps += static_cast<long>(std::get<3>(result));
        }
        return effort;
    };
    return {fast_math ? "heyoka, fast math" : "heyoka", 0, false, false, Ladder::tolerance, run, prepare};
}

}  // namespace

Contestants heyoka_peers(const Problem& problem) {
    return {taylor(problem, false), taylor(problem, true)};
}

}  // namespace lobatto::bench
