// SPDX-License-Identifier: GPL-2.0-or-later
#include "generator/mechanics/clock/automatic_clock.hpp"

#include <cln/cln.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "generator/formula/real.hpp"
#include "generator/mechanics/system/system.hpp"
#include "generator/scene/system_reader.hpp"
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

struct SymbolsOfMotion {
    Symbols positions, velocities, all;
};
SymbolsOfMotion symbols_of_motion(const Scene& scene) {
    SymbolsOfMotion symbols;
    for (const Coordinate& coordinate : scene.coordinates) {
        symbols.positions.push_back(coordinate.position);
        symbols.velocities.push_back(coordinate.velocity);
    }
    symbols.all = symbols.positions;
    symbols.all.insert(symbols.all.end(), symbols.velocities.begin(), symbols.velocities.end());
    return symbols;
}

struct Pole {
    ex term;
    GiNaC::numeric degree;  // k of r^-k
};

// Of a term; nothing where it has none. A numerator may change its sign, where a clock would stop: r^d stands for one
// of degree d. So may a factor that holds the time alone: it counts as at the start, or as 1.
std::optional<Pole> pole_of(const ex& term, const Symbols& positions, const GiNaC::symbol& time) {
    GiNaC::numeric largest = 0, above = 0;
    ex constant = 1, numerator = 1, denominator = 1;
    const auto look = [&](const ex& factor) {
        const bool is_power = GiNaC::is_a<GiNaC::power>(factor) && GiNaC::is_a<GiNaC::numeric>(factor.op(1));
        const GiNaC::numeric exponent = is_power ? GiNaC::ex_to<GiNaC::numeric>(factor.op(1)) : 1;
        if (!holds(factor, positions)) {
            const ex at_start = factor.subs(time == 0);
            constant *= at_start.is_zero() ? ex(1) : at_start;
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
    return Pole{constant * (numerator.is_equal(1) ? denominator : ex(GiNaC::pow(denominator, degree / largest))),
                degree};
}

// The terms of L that have one, without velocities; the least degree.
struct Poles {
    std::vector<ex> terms;
    std::optional<GiNaC::numeric> least;
};
Poles poles_of(const Scene& scene) {
    const auto [positions, velocities, motion] = symbols_of_motion(scene);
    Poles poles;
    for (const ex& term : terms_of(scene.lagrangian, motion)) {
        const auto pole = holds(term, velocities) ? std::nullopt : pole_of(term, positions, scene.time);
        if (!pole) continue;
        if (!poles.least || pole->degree < *poles.least) poles.least = pole->degree;
        poles.terms.push_back(pole->term);
    }
    return poles;
}

}  // namespace

namespace {

// T = c B^-m with B free of velocities, and how fast a motion is near it: omega^2 = weight B^-exponent.
struct TimeScale {
    ex strength, weight, base;  // c
    GiNaC::numeric exponent;
};

// The masses, where they are constant, each of one coordinate.
std::optional<std::vector<ex>> masses_of(const Scene& scene, const Symbols& velocities, const Symbols& motion) {
    const SparseMatrix mass = derivative_of(gradient_of(terms_of(scene.lagrangian, motion), velocities), velocities);
    std::vector<ex> masses(velocities.size(), 0);
    for (const auto& [place, value] : mass.entries()) {
        if (place.first != place.second || holds(value, motion) || value.has(scene.time)) return std::nullopt;
        masses[static_cast<std::size_t>(place.first)] = value;
    }
    return masses;
}

// omega^2 = grad T . M^-1 grad T / |T| = m^2 |c| kappa B^-(m + 1), where grad B . M^-1 grad B = kappa B, as for squares
// of distances: kappa = 4 (1/m_i + 1/m_j). So a light body's encounters count as much as those of a heavy one.
std::optional<TimeScale> time_scale_of(const ex& term, const Symbols& positions, const std::vector<ex>& masses) {
    ex strength = 1, base = 0;
    GiNaC::numeric m = 0;
    const auto look = [&](const ex& factor) {
        if (!holds(factor, positions)) {
            strength *= factor;
        } else if (base.is_zero() && GiNaC::is_a<GiNaC::power>(factor) && GiNaC::is_a<GiNaC::numeric>(factor.op(1))) {
            base = factor.op(0);
            m = -GiNaC::ex_to<GiNaC::numeric>(factor.op(1));
        } else {
            base = 1;  // no such term
        }
    };
    if (GiNaC::is_a<GiNaC::mul>(term))
        for (const ex& factor : term) look(factor);
    else
        look(term);
    if (!m.is_positive() || !holds(base, positions)) return std::nullopt;
    ex steep = 0, kappa;
    bool is_first = true;
    for (std::size_t k = 0; k < positions.size(); ++k) {
        if (!base.has(positions[k])) continue;
        if (masses[k].is_zero()) return std::nullopt;
        const ex slope = base.diff(positions[k]);
        if (is_first) {  // from one coefficient of both
            const ex second = slope.diff(positions[k]);
            if (second.is_zero() || holds(second, positions)) return std::nullopt;
            kappa = 0;
            for (std::size_t j = 0; j < positions.size(); ++j)
                if (const ex mixed = slope.diff(positions[j]); !mixed.is_zero() && !masses[j].is_zero())
                    kappa += 2 * mixed * mixed / second / masses[j];
            is_first = false;
        }
        steep += slope * slope / masses[k];
    }
    if (!(steep - kappa * base).expand().normal().is_zero()) return std::nullopt;
    return TimeScale{strength, strength * m * m * kappa, base, m + 1};
}

// Of all terms, or nothing.
std::vector<TimeScale> time_scales_of(const Scene& scene, const std::vector<ex>& terms) {
    const auto [positions, velocities, motion] = symbols_of_motion(scene);
    const auto masses = masses_of(scene, velocities, motion);
    std::vector<TimeScale> scales;
    if (!masses) return scales;
    for (const ex& term : terms) {
        const std::optional<TimeScale> scale = time_scale_of(term, positions, *masses);
        if (!scale) return {};
        scales.push_back(*scale);
    }
    return scales;
}

// Whether the time scales agree with those that U tells, up to one factor: for equal poles, and bodies whose masses are
// not far apart. Then U serves, whose formulas are shorter.
bool agree_with_poles(const Scene& scene, const std::vector<TimeScale>& scales, const GiNaC::numeric& degree) {
    constexpr double apart = 4;
    const double exponent = 1 / degree.to_double() + 0.5;
    double least = HUGE_VAL, most = 0;
    for (const TimeScale& scale : scales) {
        const double strength = std::fabs(scene.value_of(scale.strength).to_double()),
                     weight = std::fabs(scene.value_of(scale.weight).to_double()),
                     ratio = std::pow(strength, exponent) / std::sqrt(weight);
        if (scale.exponent != scales[0].exponent) return false;
        least = std::fmin(least, ratio);
        most = std::fmax(most, ratio);
    }
    return most <= apart * least;
}

// With every number that is a formula of numbers rounded to a double: exact ones of starts with many digits have
// thousands of them.
ex rounded(const ex& expression) {
    if (GiNaC::is_a<GiNaC::symbol>(expression) || expression.info(GiNaC::info_flags::rational)) return expression;
    if (symbols_of(expression).empty())
        return GiNaC::numeric(cln::rational(cln::cl_float(real_value(expression).to_double())));
    if (GiNaC::is_a<GiNaC::add>(expression) || GiNaC::is_a<GiNaC::mul>(expression)) {
        const bool is_sum = GiNaC::is_a<GiNaC::add>(expression);
        ex numbers = is_sum ? 0 : 1, rest = numbers;
        for (const ex& part : expression) {
            ex& side = symbols_of(part).empty() ? numbers : rest;
            const ex next = &side == &rest ? rounded(part) : part;
            side = is_sum ? side + next : side * next;
        }
        return is_sum ? rounded(numbers) + rest : rounded(numbers) * rest;
    }
    if (GiNaC::is_a<GiNaC::power>(expression)) return GiNaC::pow(rounded(expression.op(0)), expression.op(1));
    return expression;
}

}  // namespace

ex automatic_clock(const Scene& scene) {
    GiNaC::exmap start{{scene.time, 0}};
    for (std::size_t k = 0; k < scene.coordinates.size(); ++k)
        start[scene.coordinates[k].position] = symbols_of(scene.initial_position[k]).empty()
                                                   ? ex(scene.value_of(scene.initial_position[k]))
                                                   : scene.initial_position[k];
    const Poles poles = poles_of(scene);
    if (!poles.least)
        fail_at_clock(scene,
                      "clock = \"auto\" looks for terms of the Lagrangian that grow without bound, such as 1/r, and "
                      "there is none; write a formula");
    const auto signed_at_start = [&](const ex& term, const ex& formula) {
        return scene.value_of(term.subs(start)).is_negative() ? ex(-formula) : formula;
    };
    const auto at_start = [&](const ex& formula) { return rounded(formula.subs(start)); };
    std::vector<TimeScale> scales = time_scales_of(scene, poles.terms);
    if (scales.size() == 1) {  // a power of the base itself shares its roots with the potential
        const ex power = GiNaC::pow(scales[0].base, scales[0].exponent / 2);
        return power / at_start(power);
    }
    if (agree_with_poles(scene, scales, *poles.least)) scales.clear();
    ex sum = 0, sum_at_start = 0;
    for (std::size_t i = 0; i < poles.terms.size(); ++i) {
        const ex term =
            scales.empty() ? poles.terms[i] : scales[i].weight * GiNaC::pow(scales[i].base, -scales[i].exponent);
        sum += signed_at_start(poles.terms[i], term);
        sum_at_start += at_start(signed_at_start(poles.terms[i], term));
    }
    const GiNaC::numeric half(1, 2);
    const GiNaC::numeric exponent = scales.empty() ? -(GiNaC::numeric(1) / *poles.least + half) : -half;
    return GiNaC::pow(sum, exponent) / rounded(GiNaC::pow(sum_at_start, exponent));
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
