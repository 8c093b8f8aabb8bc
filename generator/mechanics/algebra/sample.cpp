// SPDX-License-Identifier: GPL-2.0-or-later
// Formulas as numbers: 60 digits, at seeded points near a scene's start and away from it.
#include "generator/mechanics/algebra/sample.hpp"

#include <stdexcept>
#include <tuple>

#include "generator/formula/real.hpp"

namespace lobatto {

namespace {

cln::float_format_t format() {
    return cln::float_format(static_cast<std::uintptr_t>(working_digits()));
}

std::size_t index_of(const GiNaC::exmap& inputs, const GiNaC::ex& symbol) {
    return static_cast<std::size_t>(GiNaC::ex_to<GiNaC::numeric>(inputs.at(symbol)).to_int());
}

// |d value / d operand| at a value of an operation with one operand; infinite slopes, of roots and inverse functions at
// the end of their domains, are given as 0.
cln::cl_R slope(const Node& node, const cln::cl_R& x, const cln::cl_R& value) {
    const auto over = [](const cln::cl_R& above, const cln::cl_R& below) {
        return cln::zerop(below) ? cln::cl_R(0) : above / below;
    };
    switch (node.op) {
        case Op::power:
            return over(node.index * value, x);
        case Op::sqrt:
            return over(1, 2 * value);
        case Op::sin:
            return cln::cos(x);
        case Op::cos:
            return cln::sin(x);
        case Op::tan:
            return 1 + cln::square(value);
        case Op::exp:
            return value;
        case Op::log:
            return 1 / x;
        case Op::sinh:
            return cln::sqrt(1 + cln::square(value));
        case Op::cosh:
            return cln::sqrt(cln::max(cln::square(value) - 1, cln::cl_R(0)));
        case Op::tanh:
            return 1 - cln::square(value);
        case Op::asin:
        case Op::acos:
            return over(1, cln::sqrt(cln::max(1 - cln::square(x), cln::cl_R(0))));
        case Op::atan:
            return 1 / (1 + cln::square(x));
        case Op::positive_part:
            return 1;
        case Op::side:
            return 0;
        default:
            throw std::logic_error("slope: not an operation with one operand");
    }
}

// The size of a value from those of its operands: first-order error analysis, each operand in error by its size.
cln::cl_R size_of(const Node& node, const Sized& result, const std::vector<Sized>& operands) {
    cln::cl_R size = cln::abs(result.value);
    switch (node.op) {
        case Op::constant:
        case Op::input:
            return size;
        case Op::add:
            for (const Sized& operand : operands) size = cln::max(size, operand.size);
            return size;
        case Op::multiply:
            for (std::size_t i = 0; i < operands.size(); ++i) {
                cln::cl_R product = operands[i].size;
                for (std::size_t j = 0; j < operands.size(); ++j)
                    if (j != i) product = product * cln::abs(operands[j].value);
                size = cln::max(size, product);
            }
            return size;
        case Op::raise: {  // x^y = exp(y log x)
            const auto& [base, exponent] = std::tie(operands[0], operands[1]);
            if (!cln::plusp(base.value)) return cln::max(size, base.size);
            const cln::cl_R logarithm = cln::abs(cln::ln(cln::cl_float(base.value, format())));
            return cln::max(
                size, size * cln::max(cln::abs(exponent.value) * base.size / base.value, logarithm * exponent.size));
        }
        case Op::table: {
            const cln::cl_R slope =
                node.index % 4 == 3 ? cln::cl_R(0) : apply(Op::table, node.index + 1, {operands[0].value});
            return cln::max(size, operands[0].size * cln::abs(slope));
        }
        case Op::atan2: {
            const cln::cl_R &y = operands[0].value, &x = operands[1].value, r = cln::square(x) + cln::square(y);
            return cln::max(size, (cln::abs(x) * operands[0].size + cln::abs(y) * operands[1].size) / r);
        }
        default:
            return cln::max(size, operands[0].size * cln::abs(slope(node, operands[0].value, result.value)));
    }
}

}  // namespace

cln::cl_R float_of(const GiNaC::numeric& value) {
    return cln::cl_float(cln::the<cln::cl_R>(value.to_cl_N()), format());
}

std::vector<Sized> all_sized(const Graph& graph, const std::vector<cln::cl_R>& inputs, const std::vector<Id>& roots) {
    const std::vector<cln::cl_R> values = graph.evaluate(inputs, roots);
    std::vector<Sized> sized(values.size());
    std::vector<Sized> operands;
    for (const Id id : graph.topological(roots)) {
        operands.clear();
        for (const Id operand : graph[id].operands) operands.push_back(sized[static_cast<std::size_t>(operand)]);
        Sized& here = sized[static_cast<std::size_t>(id)];
        here.value = values[static_cast<std::size_t>(id)];
        here.size = size_of(graph[id], here, operands);
    }
    return sized;
}

std::vector<Sized> sized_values(const Graph& graph, const std::vector<cln::cl_R>& inputs,
                                const std::vector<Id>& roots) {
    const std::vector<Sized> sized = all_sized(graph, inputs, roots);
    std::vector<Sized> result;
    for (const Id root : roots) result.push_back(sized[static_cast<std::size_t>(root)]);
    return result;
}

std::vector<std::set<Id>> hidden_inputs(const Graph& graph, const std::vector<Sized>& sized,
                                        const std::vector<Id>& roots) {
    const auto of = [&](Id id) -> const Sized& { return sized[static_cast<std::size_t>(id)]; };
    std::vector<std::set<Id>> hidden(sized.size());
    for (const Id id : graph.topological(roots))
        for (const Id operand : graph[id].operands) {
            hidden[static_cast<std::size_t>(id)].merge(std::set<Id>(hidden[static_cast<std::size_t>(operand)]));
            const bool is_small =
                graph[id].op == Op::add && !of(operand).vanishes() && Sized{of(operand).value, of(id).size}.vanishes();
            const bool is_flat = (graph[id].op == Op::exp && cln::zerop(of(id).value)) ||
                                 (graph[id].op == Op::tanh && Sized{1 - cln::abs(of(id).value), 1}.vanishes());
            if (!is_small && !is_flat) continue;
            for (const Id below : graph.topological({operand}))
                if (graph[below].op == Op::input) hidden[static_cast<std::size_t>(id)].insert(below);
        }
    std::vector<std::set<Id>> result;
    for (const Id root : roots) result.push_back(hidden[static_cast<std::size_t>(root)]);
    return result;
}

void Formulas::set(const GiNaC::ex& symbol, const cln::cl_R& value) {
    if (!inputs_.contains(symbol)) {
        const std::string name = "x" + std::to_string(inputs_.size());
        inputs_[symbol] = graph_.input({name, name, Phase::iterate});
    }
    const std::size_t index = static_cast<std::size_t>(graph_[static_cast<Id>(index_of(inputs_, symbol))].index);
    if (index >= values_.size()) values_.resize(index + 1);
    values_[index] = value;
}

std::vector<GiNaC::exset> Formulas::hidden(const std::vector<Id>& roots, const std::vector<Sized>& sized) const {
    std::vector<GiNaC::exset> result;
    for (const std::set<Id>& inputs : hidden_inputs(graph_, sized, roots)) {
        result.emplace_back();
        if (inputs.empty()) continue;
        for (const auto& [symbol, id] : inputs_)
            if (inputs.contains(static_cast<Id>(GiNaC::ex_to<GiNaC::numeric>(id).to_int())))
                result.back().insert(symbol);
    }
    return result;
}

std::vector<bool> Formulas::holding(const std::vector<Id>& roots, const std::vector<GiNaC::symbol>& symbols) const {
    std::vector<bool> holds(static_cast<std::size_t>(graph_.size()));
    for (const GiNaC::symbol& symbol : symbols)
        if (inputs_.contains(symbol)) holds[index_of(inputs_, symbol)] = true;
    for (const Id id : graph_.topological(roots))
        for (const Id operand : graph_[id].operands)
            if (holds[static_cast<std::size_t>(operand)]) holds[static_cast<std::size_t>(id)] = true;
    std::vector<bool> result;
    for (const Id root : roots) result.push_back(holds[static_cast<std::size_t>(root)]);
    return result;
}

cln::cl_R Formulas::get(const GiNaC::ex& symbol) const {
    return values_[static_cast<std::size_t>(graph_[static_cast<Id>(index_of(inputs_, symbol))].index)];
}

std::vector<Id> Formulas::convert(const std::vector<GiNaC::ex>& expressions) {
    std::vector<Id> roots;
    for (const GiNaC::ex& expression : expressions) {
        const auto [place, is_new] = converted_.emplace(expression, 0);
        if (is_new) place->second = graph_.from(expression, inputs_);
        roots.push_back(place->second);
    }
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
    return cln::cl_float(cln::cl_RA(cln::cl_I(bits) * 2 + 1) / cln::cl_I(1ul << 30) - 1, format());
}

NearStart::NearStart(const Scene& scene, int attempt)
    : scene_(scene),
      attempt_(attempt),
      noise_(static_cast<std::uint64_t>(attempt) + 1),
      spread_(cln::expt(cln::cl_float(cln::cl_RA("1/2"), format()), attempt / 2)) {}

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
    formulas.set(scene_.time, near(cln::cl_float(0, format())));
}

cln::cl_R Elsewhere::parameter(std::size_t index) {
    return way_ == Way::motion ? NearStart::parameter(index) : 1 + noise() / 2;
}

cln::cl_R Elsewhere::position(std::size_t coordinate) {
    return way_ == Way::parameters ? NearStart::position(coordinate) : motion();
}

cln::cl_R Elsewhere::velocity(std::size_t coordinate) {
    return way_ == Way::parameters ? NearStart::velocity(coordinate) : motion();
}

cln::cl_R Elsewhere::motion() {
    switch (way_) {
        case Way::small:
            return noise() / 1000;
        case Way::large:
            return noise() * 1000000;
        case Way::motion:
            return noise();
        default:
            return 1 + noise() / 2;
    }
}

}  // namespace lobatto
