// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/accuracy/formulas/domains.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "generator/graph/notation.hpp"

namespace lobatto {

namespace {

using Kind = DomainCondition::Kind;

constexpr std::size_t most_conditions = 4096;
constexpr double rounding = 1e-14;  // of the terms of a sum: what is no more is zero

// Functions of the Lagrangian and of forces whose derivatives are not real either where they are not: kernels stop
// there by themselves. A logarithm's is.
GiNaC::exset kept_operands(const SystemOutline& system) {
    GiNaC::exset kept;
    const auto look_at = [&](const GiNaC::ex& formula) {
        for (auto part = formula.preorder_begin(); part != formula.preorder_end(); ++part) {
            if (GiNaC::is_a<GiNaC::power>(*part) && !part->op(1).info(GiNaC::info_flags::integer))
                kept.insert(part->op(0));
            if (!GiNaC::is_a<GiNaC::function>(*part)) continue;
            const std::string name = GiNaC::ex_to<GiNaC::function>(*part).get_name();
            if (name == "asin" || name == "acos") kept.insert(part->op(0));
        }
    };
    look_at(system.lagrangian);
    for (const GiNaC::ex& force : system.outer_force) look_at(force);
    return kept;
}

}  // namespace

Domains::Domains(const Scene& scene, const SystemOutline& system)
    : n_(scene.coordinates.size()), knows_velocities_(scene.start == Start::velocity) {
    std::vector<GiNaC::symbol> variables;
    GiNaC::exset velocities, moving{scene.time};
    for (const Parameter& parameter : scene.parameters) variables.push_back(parameter.symbol);
    variables.push_back(scene.time);
    for (const Coordinate& coordinate : scene.coordinates) {
        variables.push_back(coordinate.position);
        moving.insert(coordinate.position);
        velocities.insert(coordinate.velocity);
    }
    for (const Coordinate& coordinate : scene.coordinates) variables.push_back(coordinate.velocity);
    const Tape::Variables numbered(variables);
    const auto holds_any = [](const GiNaC::ex& formula, const GiNaC::exset& symbols) {
        return std::any_of(formula.preorder_begin(), formula.preorder_end(),
                           [&](const GiNaC::ex& part) { return symbols.contains(part); });
    };
    const GiNaC::exset kept = kept_operands(system);
    for (const DomainCondition& written : scene.conditions) {
        if (!written.of_motion || conditions_.size() == most_conditions) continue;
        std::optional<Tape> tape = Tape::of(scene.along_motion(written.expression), numbered);
        if (!tape) continue;
        const bool has_velocity = holds_any(written.expression, velocities);
        // Quotients that have no value at a single place have one beside it, as sin(q)/q.
        const bool is_met = written.kind != Kind::nonzero && !has_velocity && holds_any(written.expression, moving),
                   of_way = is_met && !kept.contains(written.expression);
        std::optional<Tape> exponent;
        if (written.kind == Kind::power && !(exponent = Tape::of(written.exponent, numbered))) continue;
        std::optional<Tape> argument;
        if (!written.argument.is_zero()) argument = Tape::of(scene.along_motion(written.argument), numbered);
        watches_ = watches_ || of_way;
        conditions_.push_back({written, std::move(*tape), std::move(exponent), std::move(argument), has_velocity,
                               of_way, is_met && !of_way});
    }
}

bool Domains::holds(const Condition& condition, const std::vector<double>& variables) const {
    const auto [value, size] = condition.tape.sized(variables);
    const double zero = rounding * size;
    Kind kind = condition.written.kind;
    if (kind == Kind::power) {
        const double exponent = (*condition.exponent)(variables);
        kind = DomainCondition::of_base(exponent == std::round(exponent), exponent < 0);
    }
    switch (kind) {
        case Kind::any:
            return true;
        case Kind::nonzero:
            return std::fabs(value) > (size > std::fabs(value) ? zero : 0);
        case Kind::nonnegative:
            return value >= -zero;
        case Kind::positive:
            return value > (size > value ? zero : 0);
        case Kind::within_one:
        case Kind::power:  // is one of the others by now
            break;
    }
    return std::fabs(value) <= 1 + rounding;
}

bool Domains::hold_at_start(double time, const std::vector<double>& parameters, const std::vector<double>& q,
                            const std::vector<double>& rate) const {
    std::vector<double> variables = parameters;
    variables.push_back(time);
    variables.insert(variables.end(), q.begin(), q.end());
    variables.insert(variables.end(), rate.begin(), rate.end());
    return std::all_of(conditions_.begin(), conditions_.end(), [&](const Condition& condition) {
        return (condition.has_velocity && !knows_velocities_) || holds(condition, variables);
    });
}

std::vector<double> Domains::variables_of(const std::vector<double>& parameters, const double* row) const {
    std::vector<double> variables = parameters;
    variables.insert(variables.end(), row, row + 1 + n_);
    variables.resize(variables.size() + n_);
    return variables;
}

std::int64_t Domains::left_at(const std::vector<double>& parameters, const Records& records) const {
    for (std::int64_t i = 0; watches_ && i < records.count; ++i) {
        const std::vector<double> variables = variables_of(parameters, records.rows + i * records.columns);
        for (const Condition& condition : conditions_)
            if (condition.of_way && !holds(condition, variables)) return i;
    }
    return -1;
}

std::string Domains::text(const std::vector<double>& parameters, const double* row) const {
    const std::vector<double> variables = variables_of(parameters, row);
    for (const Condition& condition : conditions_)
        if (condition.of_way && !holds(condition, variables)) return text(condition, variables);
    return "";
}

std::string Domains::text(const Condition& condition, const std::vector<double>& variables) {
    const DomainCondition& written = condition.written;
    std::string operation = written.operation;  // "the table a.csv, which goes from 0 to 2,"
    if (operation.ends_with(',')) operation.pop_back();
    return condition.argument
               ? fmt::format("{}, line {} column {}, is asked for {} = {:.6g}", operation, written.at.line,
                             written.at.column, short_text(written.argument), (*condition.argument)(variables))
               : fmt::format("{}, line {} column {}, is of {} = {:.6g}", operation, written.at.line, written.at.column,
                             short_text(written.expression), condition.tape(variables));
}

std::optional<Domains::NoValue> Domains::no_value_at(const std::vector<double>& parameters,
                                                     const std::vector<double>& row) const {
    const std::vector<double> variables = variables_of(parameters, row.data());
    for (const Condition& condition : conditions_)
        if ((condition.of_way || condition.ends_way) && !holds(condition, variables))
            return NoValue{text(condition, variables), condition.argument.has_value()};
    return std::nullopt;
}

}  // namespace lobatto
