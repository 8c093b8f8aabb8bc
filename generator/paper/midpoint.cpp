// SPDX-License-Identifier: GPL-2.0-or-later
// The implicit midpoint rule as a variational integrator.
#include "generator/paper/midpoint.hpp"

#include <cmath>
#include <stdexcept>

#include "generator/paper/symbols.hpp"

namespace lobatto::paper {

using GiNaC::ex;
using GiNaC::numeric;

namespace {

GiNaC::symbol named(const char* name) {
    return GiNaC::ex_to<GiNaC::symbol>(symbol(name));
}

double value(const ex& expression, const GiNaC::exmap& point) {
    return GiNaC::ex_to<numeric>(expression.subs(point).evalf()).to_double();
}

}  // namespace

Midpoint::Midpoint(const std::string& potential, double mass, double omega, double step) {
    const ex left = symbol("q_l"), right = symbol("q_r"), h = symbol("h"), velocity = (right - left) / h;
    const ex discrete =
        h * (symbol("m") * velocity * velocity / 2 - read(potential).subs(symbol("q") == (left + right) / 2));
    const GiNaC::exmap numbers{{h, numeric(step)}, {symbol("m"), numeric(mass)}, {symbol("omega"), numeric(omega)}};
    residual_ = (symbol("p_j") + discrete.diff(named("q_l"))).subs(numbers);
    slope_ = residual_.diff(named("q_r"));
    momentum_ = discrete.diff(named("q_r")).subs(numbers);
}

std::vector<Midpoint::State> Midpoint::run(State start, int steps) const {
    std::vector<State> states{start};
    for (int step = 0; step < steps; ++step) {
        const State now = states.back();
        double next = now.q, change = 1;
        GiNaC::exmap point{{symbol("q_l"), numeric(now.q)}, {symbol("p_j"), numeric(now.p)}};
        for (int iteration = 0; std::fabs(change) > 1e-15 * (1 + std::fabs(next)); ++iteration) {
            if (iteration == 20) throw std::logic_error("paper: the midpoint rule did not converge");
            point[symbol("q_r")] = numeric(next);
            change = value(residual_, point) / value(slope_, point);
            next -= change;
        }
        point[symbol("q_r")] = numeric(next);
        states.push_back({next, value(momentum_, point)});
    }
    return states;
}

}  // namespace lobatto::paper
