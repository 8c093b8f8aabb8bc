// SPDX-License-Identifier: GPL-2.0-or-later
// Values for checks: the symbols of a derivation at a seeded point near the scene's start, expressions at 60 digits.
#include "generator/check_point.hpp"

#include <algorithm>
#include <cmath>

namespace lobatto {

namespace {

const cln::float_format_t format = cln::float_format(number_digits);

cln::cl_R float_of(const GiNaC::numeric& value) {
    return cln::cl_float(cln::the<cln::cl_R>(value.to_cl_N()), format);
}

std::size_t index_of(const GiNaC::exmap& inputs, const GiNaC::ex& symbol) {
    return static_cast<std::size_t>(GiNaC::ex_to<GiNaC::numeric>(inputs.at(symbol)).to_int());
}

}  // namespace

void Formulas::set(const GiNaC::ex& symbol, const cln::cl_R& value) {
    if (!inputs_.contains(symbol)) {
        const std::string name = "x" + std::to_string(inputs_.size());
        inputs_[symbol] = graph_.input({name, name, Stage::iterate});
    }
    const std::size_t index = static_cast<std::size_t>(graph_[static_cast<Id>(index_of(inputs_, symbol))].index);
    if (index >= values_.size()) values_.resize(index + 1);
    values_[index] = value;
}

cln::cl_R Formulas::get(const GiNaC::ex& symbol) const {
    return values_[static_cast<std::size_t>(graph_[static_cast<Id>(index_of(inputs_, symbol))].index)];
}

std::vector<Id> Formulas::convert(const std::vector<GiNaC::ex>& expressions) {
    std::vector<Id> roots;
    for (const GiNaC::ex& expression : expressions) roots.push_back(graph_.from(expression, inputs_));
    return roots;
}

std::vector<cln::cl_R> Formulas::evaluate(const std::vector<Id>& roots) const {
    const std::vector<cln::cl_R> all = graph_.evaluate(values_, roots);
    std::vector<cln::cl_R> values;
    for (const Id root : roots) values.push_back(all[static_cast<std::size_t>(root)]);
    return values;
}

cln::cl_R Noise::next() {
    state_ = state_ * 6364136223846793005u + 1442695040888963407u;
    const auto bits = static_cast<unsigned long>(state_ >> 34);  // 30 bits
    return cln::cl_float(cln::cl_RA(cln::cl_I(bits) * 2 + 1) / cln::cl_I(1ul << 30) - 1, format);
}

Formulas point_near_start(const Derivation& derivation, int attempt) {
    const Scene& scene = derivation.scene;
    const Discretisation& d = derivation.discretisation;
    Formulas formulas;
    Noise noise(static_cast<std::uint64_t>(attempt) + 1);
    const cln::cl_R spread = cln::expt(cln::cl_float(cln::cl_RA("1/2"), format), attempt / 2);
    const auto near = [&](const cln::cl_R& value) {
        const cln::cl_R size = cln::zerop(value) ? cln::cl_R(1) : cln::abs(value);
        return value + spread * size * noise.next() / 4;
    };
    for (const Parameter& parameter : scene.parameters) {
        const cln::cl_R value = float_of(scene.evaluate(parameter.value, "the parameter " + parameter.name));
        formulas.set(parameter.symbol, attempt < 10 ? near(value) : value);
    }
    formulas.set(d.h, near(float_of(scene.evaluate(scene.run.step, "the step"))));
    for (std::size_t k = 0; k < scene.coordinates.size(); ++k) {
        const cln::cl_R start =
            float_of(scene.evaluate(scene.initial_position[k], "the initial position of " + scene.coordinates[k].name));
        formulas.set(derivation.system.q[k], near(start));
        formulas.set(derivation.system.v[k], noise.next());
        for (const auto& positions : {d.Q, d.Q_before})
            for (const auto& position : positions) formulas.set(position[k], near(start));
        formulas.set(d.p0[k], noise.next());
        formulas.set(d.p1[k], noise.next());
    }
    return formulas;
}

double relative_difference(const std::vector<cln::cl_R>& x, const std::vector<cln::cl_R>& y) {
    cln::cl_R size = 0, difference = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
        size = cln::max(size, cln::max(cln::abs(x[i]), cln::abs(y[i])));
        difference = cln::max(difference, cln::abs(x[i] - y[i]));
    }
    return cln::zerop(difference) ? 0 : cln::double_approx(difference / size);
}

}  // namespace lobatto
