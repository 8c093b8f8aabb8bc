// SPDX-License-Identifier: GPL-2.0-or-later
#include "generator/mechanics/clock/automatic_clock.hpp"

#include <algorithm>
#include <optional>

#include "generator/mechanics/system/system.hpp"
#include "generator/scene/time_coordinate.hpp"

namespace lobatto {

namespace {

using GiNaC::ex;
using Symbols = std::vector<GiNaC::symbol>;

bool holds(const ex& expression, const Symbols& symbols) {
    return std::any_of(symbols.begin(), symbols.end(), [&](const GiNaC::symbol& s) { return expression.has(s); });
}

// With all positions `scale` times as far: a polynomial in `scale` where it is one in them.
ex at_scale(const ex& expression, const Symbols& positions, const GiNaC::symbol& scale) {
    GiNaC::exmap scaled;
    for (const GiNaC::symbol& q : positions) scaled[q] = scale * q;
    return expression.subs(scaled, GiNaC::subs_options::no_pattern).expand();
}

// The degree of a polynomial in the positions, all of them together; 1 for what is none.
GiNaC::numeric degree_of(const ex& base, const Symbols& positions) {
    const GiNaC::symbol scale("scale");
    const ex whole = at_scale(base, positions, scale);
    return whole.is_polynomial(scale) ? std::max(whole.degree(scale), 1) : 1;
}

// The degree of its lowest terms; 0 for what is none.
GiNaC::numeric least_degree_of(const ex& base, const Symbols& positions) {
    const GiNaC::symbol scale("scale");
    const ex whole = at_scale(base, positions, scale);
    return whole.is_polynomial(scale) ? whole.ldegree(scale) : 0;
}

struct Pole {
    ex term;
    GiNaC::numeric degree;  // k of r^-k
};

// Of a term; nothing where it has none. A numerator may change its sign, where a clock would stop: r^d stands for one
// of degree d.
std::optional<Pole> pole_of(const ex& term, const Symbols& positions) {
    GiNaC::numeric largest = 0, above = 0;
    ex constant = 1, numerator = 1, denominator = 1;
    const auto look = [&](const ex& factor) {
        const bool is_power = GiNaC::is_a<GiNaC::power>(factor) && GiNaC::is_a<GiNaC::numeric>(factor.op(1));
        const GiNaC::numeric exponent = is_power ? GiNaC::ex_to<GiNaC::numeric>(factor.op(1)) : 1;
        if (!holds(factor, positions)) {
            constant *= factor;
        } else if (exponent.is_negative()) {
            denominator *= factor;
            largest = std::max(largest, -exponent * degree_of(factor.op(0), positions));
        } else {
            numerator *= factor;
            above += exponent * least_degree_of(is_power ? factor.op(0) : factor, positions);
        }
    };
    if (GiNaC::is_a<GiNaC::mul>(term))
        for (const ex& factor : term) look(factor);
    else
        look(term);
    const GiNaC::numeric degree = largest - above;
    if (!degree.is_positive()) return std::nullopt;
    return Pole{numerator.is_equal(1) ? term : constant * GiNaC::pow(denominator, degree / largest), degree};
}

// The terms of L that have one, without velocities; the least degree.
struct Poles {
    std::vector<ex> terms;
    std::optional<GiNaC::numeric> least;
};
Poles poles_of(const Scene& scene) {
    Symbols positions, velocities, motion;
    for (const Coordinate& coordinate : scene.coordinates) {
        positions.push_back(coordinate.position);
        velocities.push_back(coordinate.velocity);
    }
    motion = positions;
    motion.insert(motion.end(), velocities.begin(), velocities.end());
    Poles poles;
    for (const ex& term : terms_of(scene.lagrangian, motion)) {
        const auto pole = holds(term, velocities) ? std::nullopt : pole_of(term, positions);
        if (!pole) continue;
        if (!poles.least || pole->degree < *poles.least) poles.least = pole->degree;
        poles.terms.push_back(pole->term);
    }
    return poles;
}

}  // namespace

ex automatic_clock(const Scene& scene) {
    GiNaC::exmap start{{scene.time, 0}};
    for (std::size_t k = 0; k < scene.coordinates.size(); ++k)
        start[scene.coordinates[k].position] = scene.initial_position[k];
    const Poles poles = poles_of(scene);
    if (!poles.least)
        fail_at_clock(scene,
                      "clock = \"auto\" looks for terms of the Lagrangian that grow without bound, such as 1/r, and "
                      "there is none; write a formula");
    ex U = 0;
    for (const ex& term : poles.terms) U += scene.value_of(term.subs(start)).is_negative() ? -term : term;
    return GiNaC::pow(U / U.subs(start), -(GiNaC::numeric(1) / *poles.least + GiNaC::numeric(1, 2)));
}

bool has_automatic_clock(const Scene& scene) {
    return scene.constraints.empty() && !scene.is_cut() && scene.inputs().empty() && poles_of(scene).least.has_value();
}

namespace {

void keep_all_steps(Outputs& outputs) {
    outputs.every = 1;
    outputs.dense = 0;
    outputs.interval = 0;
}

}  // namespace

Scene with_automatic_clock(Scene scene) {
    if (scene.clock && scene.clock->is_automatic) return scene;
    if (!scene.clock) keep_all_steps(scene.outputs);
    scene = without_time_coordinate(std::move(scene));
    scene.clock = Clock();
    scene.clock->text = "auto";
    scene.clock->is_automatic = true;
    add_time_coordinate(scene);
    return scene;
}

Scene with_equal_steps(Scene scene) {
    if (!scene.clock) return scene;
    scene = without_time_coordinate(std::move(scene));
    scene.clock.reset();
    keep_all_steps(scene.outputs);
    return scene;
}

}  // namespace lobatto
