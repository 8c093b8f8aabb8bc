// SPDX-License-Identifier: GPL-2.0-or-later
// Formulas as numbers: 60 digits, at seeded points near a scene's start.
#include "generator/sample.hpp"

namespace lobatto {

namespace {

const cln::float_format_t format = cln::float_format(number_digits);

std::size_t index_of(const GiNaC::exmap& inputs, const GiNaC::ex& symbol) {
    return static_cast<std::size_t>(GiNaC::ex_to<GiNaC::numeric>(inputs.at(symbol)).to_int());
}

}  // namespace

cln::cl_R float_of(const GiNaC::numeric& value) {
    return cln::cl_float(cln::the<cln::cl_R>(value.to_cl_N()), format);
}

std::vector<Sized> sized_values(const Graph& graph, const std::vector<cln::cl_R>& inputs,
                                const std::vector<Id>& roots) {
    const std::vector<cln::cl_R> values = graph.evaluate(inputs, roots);
    std::vector<cln::cl_R> sizes(values.size());
    for (const Id id : graph.topological(roots)) {
        cln::cl_R& here = sizes[static_cast<std::size_t>(id)];
        here = cln::abs(values[static_cast<std::size_t>(id)]);
        for (const Id operand : graph[id].operands) here = cln::max(here, sizes[static_cast<std::size_t>(operand)]);
    }
    std::vector<Sized> result;
    for (const Id root : roots)
        result.push_back({values[static_cast<std::size_t>(root)], sizes[static_cast<std::size_t>(root)]});
    return result;
}

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

NearStart::NearStart(const Scene& scene, int attempt)
    : scene_(scene),
      attempt_(attempt),
      noise_(static_cast<std::uint64_t>(attempt) + 1),
      spread_(cln::expt(cln::cl_float(cln::cl_RA("1/2"), format), attempt / 2)) {}

cln::cl_R NearStart::near(const cln::cl_R& value) {
    const cln::cl_R size = cln::zerop(value) ? cln::cl_R(1) : cln::abs(value);
    return value + spread_ * size * noise_.next() / 4;
}

cln::cl_R NearStart::parameter(std::size_t index) {
    const Parameter& parameter = scene_.parameters[index];
    const cln::cl_R value = float_of(scene_.evaluate(parameter.value, "the parameter " + parameter.name));
    return attempt_ < 10 ? near(value) : value;
}

cln::cl_R NearStart::position(std::size_t k) {
    return near(
        float_of(scene_.evaluate(scene_.initial_position[k], "the initial position of " + scene_.coordinates[k].name)));
}

cln::cl_R NearStart::velocity(std::size_t k) {
    if (scene_.start == Start::momentum) return spread_ * noise_.next();
    return near(
        float_of(scene_.evaluate(scene_.initial_rate[k], "the initial velocity of " + scene_.coordinates[k].name)));
}

void NearStart::set_all(Formulas& formulas) {
    for (std::size_t i = 0; i < scene_.parameters.size(); ++i) formulas.set(scene_.parameters[i].symbol, parameter(i));
    for (std::size_t k = 0; k < scene_.coordinates.size(); ++k) {
        formulas.set(scene_.coordinates[k].position, position(k));
        formulas.set(scene_.coordinates[k].velocity, velocity(k));
    }
    formulas.set(scene_.time, near(cln::cl_float(0, format)));
}

}  // namespace lobatto
