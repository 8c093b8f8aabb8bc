// SPDX-License-Identifier: GPL-2.0-or-later
#include "generator/mechanics/clock/automatic_clock.hpp"

#include <algorithm>
#include <optional>

#include "generator/mechanics/system/system.hpp"

namespace lobatto {

namespace {

using GiNaC::ex;
using Symbols = std::vector<GiNaC::symbol>;

bool holds(const ex& expression, const Symbols& symbols) {
    return std::any_of(symbols.begin(), symbols.end(), [&](const GiNaC::symbol& s) { return expression.has(s); });
}

// The degree of a polynomial in the positions, all of them together; 1 for what is none.
GiNaC::numeric degree_of(const ex& base, const Symbols& positions) {
    const GiNaC::symbol scale("scale");
    GiNaC::exmap scaled;
    for (const GiNaC::symbol& q : positions) scaled[q] = scale * q;
    const ex whole = base.subs(scaled, GiNaC::subs_options::no_pattern).expand();
    return whole.is_polynomial(scale) ? GiNaC::numeric(std::max(whole.degree(scale), 1)) : GiNaC::numeric(1);
}

// Of a term: the degree of its pole, r^-k; nothing where it has none.
std::optional<GiNaC::numeric> pole_of(const ex& term, const Symbols& positions) {
    std::optional<GiNaC::numeric> largest;
    const auto look = [&](const ex& factor) {
        if (!GiNaC::is_a<GiNaC::power>(factor) || !GiNaC::is_a<GiNaC::numeric>(factor.op(1))) return;
        const GiNaC::numeric exponent = GiNaC::ex_to<GiNaC::numeric>(factor.op(1));
        if (!exponent.is_negative() || !holds(factor.op(0), positions)) return;
        const GiNaC::numeric k = -exponent * degree_of(factor.op(0), positions);
        if (!largest || k > *largest) largest = k;
    };
    look(term);
    if (GiNaC::is_a<GiNaC::mul>(term))
        for (const ex& factor : term) look(factor);
    return largest;
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
        const auto k = holds(term, velocities) ? std::nullopt : pole_of(term, positions);
        if (!k) continue;
        if (!poles.least || *k < *poles.least) poles.least = k;
        poles.terms.push_back(term);
    }
    return poles;
}

}  // namespace

ex automatic_clock(const Scene& scene) {
    GiNaC::exmap start;
    for (std::size_t k = 0; k < scene.coordinates.size(); ++k)
        start[scene.coordinates[k].position] = scene.initial_position[k];
    const Poles poles = poles_of(scene);
    if (!poles.least)
        fail_at_clock(scene,
                      "clock = \"auto\" looks for terms of the Lagrangian that grow without bound, such as 1/r, and "
                      "there is none; write a formula");
    ex U = 0;
    for (const ex& term : poles.terms)
        U += scene.evaluate(term.subs(start), "the clock at the start").is_negative() ? -term : term;
    return GiNaC::pow(U / U.subs(start), -(GiNaC::numeric(1) / *poles.least + GiNaC::numeric(1, 2)));
}

bool has_automatic_clock(const Scene& scene) {
    const bool conserves = !scene.lagrangian.has(scene.time) && scene.constraints.empty() && !scene.is_cut() &&
                           std::all_of(scene.coordinates.begin(), scene.coordinates.end(),
                                       [](const Coordinate& c) { return c.force.is_zero(); });
    return conserves && poles_of(scene).least.has_value();
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
    scene.clock = Clock();
    scene.clock->text = "auto";
    scene.clock->is_automatic = true;
    return scene;
}

Scene with_equal_steps(Scene scene) {
    if (!scene.clock) return scene;
    scene.clock.reset();
    keep_all_steps(scene.outputs);
    return scene;
}

}  // namespace lobatto
