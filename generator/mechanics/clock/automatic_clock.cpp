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

// The size of what holds parameters alone. Their values may change after this, and their signs: only masses are
// positive.
ex absolute(const ex& constant, const Symbols& masses) {
    if (GiNaC::is_a<GiNaC::numeric>(constant)) return GiNaC::abs(GiNaC::ex_to<GiNaC::numeric>(constant));
    if (GiNaC::is_a<GiNaC::mul>(constant)) {
        ex product = 1;
        for (const ex& factor : constant) product *= absolute(factor, masses);
        return product;
    }
    if (GiNaC::is_a<GiNaC::power>(constant)) return GiNaC::pow(absolute(constant.op(0), masses), constant.op(1));
    if (symbols_of(constant).empty()) return real_value(constant).is_negative() ? ex(-constant) : constant;
    const bool is_mass =
        std::any_of(masses.begin(), masses.end(), [&](const GiNaC::symbol& mass) { return constant.is_equal(mass); });
    return is_mass ? constant : ex(GiNaC::sqrt(GiNaC::pow(constant, 2)));
}

// A term strength * shape, the shape a formula of positions, of degree -k.
struct Pole {
    ex strength, shape;
    GiNaC::numeric degree;  // k of r^-k
};

// Of a term; nothing where it has none. A numerator may change its sign, where a clock would stop: r^d stands for one
// of degree d. So may a factor that holds the time alone: it counts as at the start, or as 1 if it is 0 there.
std::optional<Pole> pole_of(const Scene& scene, const ex& term, const Symbols& positions) {
    GiNaC::numeric largest = 0, above = 0;
    ex constant = 1, numerator = 1, denominator = 1;
    const auto look = [&](const ex& factor) {
        const bool is_power = GiNaC::is_a<GiNaC::power>(factor) && GiNaC::is_a<GiNaC::numeric>(factor.op(1));
        const GiNaC::numeric exponent = is_power ? GiNaC::ex_to<GiNaC::numeric>(factor.op(1)) : 1;
        if (!holds(factor, positions)) {
            const ex at_start = factor.subs(scene.time == 0);
            const bool vanishes = factor.has(scene.time) && scene.value_of(at_start).is_zero();
            constant *= vanishes ? ex(1) : at_start;
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
    return Pole{constant, numerator.is_equal(1) ? denominator : ex(GiNaC::pow(denominator, degree / largest)), degree};
}

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

// The terms of L that have one, without velocities; the least degree; the other terms.
struct Poles {
    std::vector<Pole> terms;
    std::optional<GiNaC::numeric> least;
    std::vector<ex> others;
    std::optional<std::vector<ex>> masses;
    Symbols positive;  // masses that are parameters
};
Poles poles_of(const Scene& scene) {
    const auto [positions, velocities, motion] = symbols_of_motion(scene);
    Poles poles;
    poles.masses = masses_of(scene, velocities, motion);
    for (const ex& mass : poles.masses.value_or(std::vector<ex>()))
        if (const ex one = mass.is_zero() ? mass : ex(mass / mass.integer_content()); GiNaC::is_a<GiNaC::symbol>(one))
            poles.positive.push_back(GiNaC::ex_to<GiNaC::symbol>(one));
    for (const ex& term : terms_of(scene.lagrangian, motion)) {
        const auto pole = holds(term, velocities) ? std::nullopt : pole_of(scene, term, positions);
        if (!pole) {
            poles.others.push_back(term);
            continue;
        }
        if (!poles.least || pole->degree < *poles.least) poles.least = pole->degree;
        poles.terms.push_back({absolute(pole->strength, poles.positive), pole->shape, pole->degree});
    }
    return poles;
}

}  // namespace

namespace {

// T = c B^-m, c >= 0, with B free of velocities, and how fast a motion is near it: omega^2 = weight B^-exponent.
struct TimeScale {
    ex strength, weight, base;  // c
    GiNaC::numeric exponent;
};

// omega^2 = grad T . M^-1 grad T / |T| = m^2 |c| kappa B^-(m + 1), where grad B . M^-1 grad B = kappa B, as for squares
// of distances: kappa = 4 (1/m_i + 1/m_j). So a light body's encounters count as much as those of a heavy one.
std::optional<TimeScale> time_scale_of(const Pole& pole, const Symbols& positions, const std::vector<ex>& masses) {
    ex strength = pole.strength, base = 0;
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
    if (GiNaC::is_a<GiNaC::mul>(pole.shape))
        for (const ex& factor : pole.shape) look(factor);
    else
        look(pole.shape);
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

// How fast a motion is by each pole, and omega^2 of what is the same everywhere: springs and centrifugal forces, by the
// trace of M^-1 d2L/dq dq, rotating frames and uniform magnetic fields, by (d2L/dq_i dq'_j - d2L/dq_j dq'_i)^2 / m_i
// m_j.
struct TimeScales {
    std::vector<TimeScale> poles;
    ex everywhere = 0;
};

ex everywhere(const Scene& scene, const Poles& poles) {
    const std::vector<ex>& masses = *poles.masses;
    const auto [positions, velocities, motion] = symbols_of_motion(scene);
    const std::vector<ex> slopes = gradient_of(poles.others, positions);
    const auto is_constant = [&, &all = motion](const ex& value) {
        return !holds(value, all) && !value.has(scene.time);
    };
    ex sum = 0;
    for (std::size_t i = 0; i < positions.size(); ++i) {
        if (masses[i].is_zero()) continue;
        const ex spring = slopes[i].diff(positions[i]) / masses[i];
        if (is_constant(spring)) sum += absolute(spring, poles.positive);
        for (std::size_t j = 0; j < i; ++j) {
            if (masses[j].is_zero()) continue;
            const ex turn = slopes[i].diff(velocities[j]) - slopes[j].diff(velocities[i]);
            if (is_constant(turn)) sum += turn * turn / (masses[i] * masses[j]);
        }
    }
    return sum;
}

// Of all poles, or nothing.
TimeScales time_scales_of(const Scene& scene, const Poles& poles) {
    const Symbols positions = symbols_of_motion(scene).positions;
    TimeScales scales;
    if (!poles.masses) return scales;
    for (const Pole& pole : poles.terms) {
        const std::optional<TimeScale> scale = time_scale_of(pole, positions, *poles.masses);
        if (!scale) return {};
        scales.poles.push_back(*scale);
    }
    scales.everywhere = everywhere(scene, poles);
    return scales;
}

// Whether the time scales agree with those that U tells, up to one factor: for equal poles, and bodies whose masses are
// not far apart. Then U serves, whose formulas are shorter.
bool agree_with_poles(const Scene& scene, const std::vector<TimeScale>& scales, const GiNaC::numeric& degree) {
    constexpr double apart = 4;
    const double exponent = 1 / degree.to_double() + 0.5;
    double least = HUGE_VAL, most = 0;
    for (const TimeScale& scale : scales) {
        const double ratio = std::pow(scene.value_of(scale.strength).to_double(), exponent) /
                             std::sqrt(scene.value_of(scale.weight).to_double());
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
    const auto at_start = [&](const ex& formula) { return rounded(formula.subs(start)); };
    const auto [all_scales, everywhere] = time_scales_of(scene, poles);
    std::vector<TimeScale> scales = all_scales;
    if (scales.size() == 1 && everywhere.is_zero()) {  // a power of the base itself shares its roots with the potential
        const ex power = GiNaC::pow(scales[0].base, scales[0].exponent / 2);
        return power / at_start(power);
    }
    if (everywhere.is_zero() && agree_with_poles(scene, scales, *poles.least)) scales.clear();
    ex sum = everywhere, sum_at_start = rounded(everywhere);
    for (std::size_t i = 0; i < poles.terms.size(); ++i) {
        const ex shape = scales.empty() ? poles.terms[i].shape : GiNaC::pow(scales[i].base, -scales[i].exponent);
        const ex size = scene.value_of(shape.subs(start)).is_negative() ? ex(-shape) : shape;
        const ex term = (scales.empty() ? poles.terms[i].strength : scales[i].weight) * size;
        sum += term;
        sum_at_start += at_start(term);
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
