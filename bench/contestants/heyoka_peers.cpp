// SPDX-License-Identifier: GPL-2.0-or-later
// heyoka's Taylor integrators as contestants, default and with fast math; ensembles run in its batch mode, four and
// eight side by side. Written for the C++ interface of heyoka 7. Built only where CMake finds heyoka.
#include <heyoka/heyoka.hpp>

#include <array>
#include <chrono>
#include <cmath>
#include <map>
#include <memory>

#include "bench/contestants/contestant.hpp"

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
        const expression c = cos(q1 - q2), s = sin(q1 - q2), determinant = 1. + pow(s, 2.);
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
            tension.push_back(d + Chain::beta * d * pow(d, 2.));
        }
        Equations all;
        for (std::size_t i = 0; i < n; ++i) all.push_back(prime(q[i]) = p[i]);
        for (std::size_t i = 0; i < n; ++i) all.push_back(prime(p[i]) = tension[i + 1] - tension[i]);
        return all;
    }
    if (problem.q.size() == 6) {
        const std::array<double, 3>& m = problem.name == "P9" ? hierarchical_masses : pythagorean_masses;
        const char* const axes[2] = {"x", "y"};
        std::array<std::array<expression, 2>, 3> q, v, a;
        Equations all;
        for (int i = 0; i < 3; ++i)
            for (int c = 0; c < 2; ++c) {
                q[i][c] = expression(axes[c] + std::to_string(i));
                v[i][c] = expression(std::string("v") + axes[c] + std::to_string(i));
            }
        for (int i = 0; i < 3; ++i)
            for (int j = i + 1; j < 3; ++j) {
                const expression x = q[j][0] - q[i][0], y = q[j][1] - q[i][1];
                const expression w = pow(pow(x, 2.) + pow(y, 2.), -1.5), d[2] = {x * w, y * w};
                for (int c = 0; c < 2; ++c) {
                    a[i][c] += m[j] * d[c];
                    a[j][c] -= m[i] * d[c];
                }
            }
        for (int i = 0; i < 3; ++i)
            for (int c = 0; c < 2; ++c) all.push_back(prime(q[i][c]) = v[i][c]);
        for (int i = 0; i < 3; ++i)
            for (int c = 0; c < 2; ++c) all.push_back(prime(v[i][c]) = a[i][c]);
        return all;
    }
    const auto [x, y, u, v] = make_vars("x", "y", "u", "v");
    if (problem.name == "P2")
        return {prime(x) = u, prime(y) = v, prime(u) = -x - 2. * x * y, prime(v) = pow(y, 2.) - pow(x, 2.) - y};
    const expression factor = pow(pow(x, 2.) + pow(y, 2.), -1.5);
    return {prime(x) = u, prime(y) = v, prime(u) = -x * factor, prime(v) = -y * factor};
}

// The integrators of one problem by tolerance: each is compiled once.
template <class Integrator>
using Compiled = std::map<double, std::unique_ptr<Integrator>>;

Contestant taylor(const Problem& problem, bool fast_math, std::size_t lanes) {
    using Single = heyoka::taylor_adaptive<double>;
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
            (*batch)[tolerance] = std::make_unique<Batch>(equations_of(problem), std::vector<double>(size * lanes, 1.),
                                                          static_cast<std::uint32_t>(lanes), kw::tol = tolerance,
                                                          kw::fast_math = fast_math);
        }
        return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    };
    const auto run = [=, until = problem.until](double tolerance, std::vector<Trajectory>& trajectories) {
        Effort effort{true, 0, 0};
        const auto count = [&](const auto& result) {
            effort.good = effort.good && std::get<0>(result) == heyoka::taylor_outcome::time_limit;
            effort.steps += static_cast<long>(std::get<3>(result));
        };
        if (trajectories.size() == 1) {
            Single& integrator = *single->at(tolerance);
            integrator.set_time(0.);
            join(trajectories[0], integrator.get_state_data());
            count(integrator.propagate_until(until));
            split(integrator.get_state_data(), trajectories[0]);
            return effort;
        }
        Batch& integrator = *batch->at(tolerance);
        double* const state = integrator.get_state_data();  // component by component, each with its lanes
        std::vector<double> y(size);
        for (std::size_t first = 0; first + lanes <= trajectories.size(); first += lanes) {
            integrator.set_time(std::vector<double>(lanes, 0.));
            for (std::size_t lane = 0; lane < lanes; ++lane) {
                join(trajectories[first + lane], y.data());
                for (std::size_t k = 0; k < size; ++k) state[k * lanes + lane] = y[k];
            }
            integrator.propagate_until(std::vector<double>(lanes, until));
            for (std::size_t lane = 0; lane < lanes; ++lane) {
                for (std::size_t k = 0; k < size; ++k) y[k] = state[k * lanes + lane];
                split(y.data(), trajectories[first + lane]);
                count(integrator.get_propagate_res()[lane]);
            }
        }
        return effort;
    };
    const std::string method = fast_math ? "heyoka, fast math" : "heyoka";
    Contestant contestant{
        lanes == 4 ? method + ", batches of 4" : method, 0, false, false, Ladder::tolerance, run, prepare};
    contestant.ratio = std::exp(2);  // an order each
    return contestant;
}

}  // namespace

Contestants heyoka_peers(const Problem& problem, int trajectories) {
    Contestants all = {taylor(problem, false, 8), taylor(problem, true, 8)};
    if (trajectories > 1)
        for (const bool fast_math : {false, true}) all.push_back(taylor(problem, fast_math, 4));
    return all;
}

}  // namespace lobatto::bench
