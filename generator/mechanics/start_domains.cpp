// SPDX-License-Identifier: GPL-2.0-or-later
#include "generator/mechanics/start_domains.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string>

#include "generator/graph/notation.hpp"
#include "generator/mechanics/system/system.hpp"
#include "generator/scene/scene.hpp"

namespace lobatto {

namespace {

using GiNaC::ex;

bool value_is(DomainCondition::Kind kind, const cln::cl_R& value) {
    using Kind = DomainCondition::Kind;
    return kind == Kind::any           ? true
           : kind == Kind::nonzero     ? !cln::zerop(value)
           : kind == Kind::nonnegative ? !cln::minusp(value)
           : kind == Kind::positive    ? cln::plusp(value)
                                       : cln::abs(value) <= 1;
}

class StartDomains {
public:
    StartDomains(const Scene& scene, const System& system, Formulas& start)
        : scene_(scene), system_(system), start_(start) {}

    void require_all() {
        std::vector<DomainCondition> conditions;
        for (DomainCondition condition : scene_.conditions) {
            // Kernels need not know all switches that they hold.
            condition.expression = scene_.along_motion(condition.expression);
            condition.exponent = scene_.along_motion(condition.exponent);
            const bool moves = scene_.start == Start::momentum &&
                               std::any_of(system_.v.begin(), system_.v.end(),
                                           [&](const auto& v) { return condition.expression.has(v); });
            if (!moves) conditions.push_back(std::move(condition));  // else velocities are not known yet
        }
        for (const auto& [begin, end] : portions_of(conditions.size())) {
            if (all_hold(conditions, begin, end)) continue;
            for (std::size_t i = begin; i < end; ++i) require_domain(conditions[i]);
        }
    }

private:
    bool holds(const DomainCondition& condition, const Sized& of) {
        const cln::cl_R value = of.vanishes() ? cln::cl_R(0) : of.value;
        if (condition.kind != DomainCondition::Kind::power) return value_is(condition.kind, value);
        const cln::cl_R exponent = start_.evaluate(start_.convert({condition.exponent})).front();
        return value_is(DomainCondition::of_base(exponent == cln::round1(exponent), cln::minusp(exponent)), value);
    }

    bool all_hold(const std::vector<DomainCondition>& conditions, std::size_t begin, std::size_t end) {
        std::vector<ex> expressions;
        for (std::size_t i = begin; i < end; ++i) expressions.push_back(conditions[i].expression);
        try {
            const std::vector<Sized> values = start_.evaluate_sized(start_.convert(expressions));
            for (std::size_t i = begin; i < end; ++i)
                if (!holds(conditions[i], values[i - begin])) return false;
            return true;
        } catch (const DomainError&) {
            return false;
        }
    }

    void require_domain(const DomainCondition& condition) {
        std::string found;
        try {
            const Sized of = start_.evaluate_sized(start_.convert({condition.expression})).front();
            if (holds(condition, of)) return;
            found = of.vanishes() ? "0" : decimal(of.value, 6);
        } catch (const DomainError& error) {
            found = error.what();
        }
        const std::string values = values_in(condition.expression, system_, start_);
        scene_.source.fail(
            condition.at,
            fmt::format("{} has no value at the start: it is of {} = {}{}; start elsewhere, or mend the formula",
                        condition.operation, short_text(condition.expression), found,
                        values.empty() ? "" : ", with " + values));
    }

    const Scene& scene_;
    const System& system_;
    Formulas& start_;
};

}  // namespace

std::string values_in(const ex& expression, const System& system, const Formulas& start) {
    std::string text;
    int shown = 0;
    const auto add = [&](const GiNaC::symbol& symbol) {
        if (!expression.has(symbol) || ++shown > 6) return;
        const cln::cl_R value = start.get(symbol);
        text += fmt::format("{}{} = {}", shown == 1 ? "" : ", ", symbol.get_name(),
                            cln::zerop(value) ? "0" : decimal(value, 6));
    };
    for (const auto* symbols : {&system.q, &system.v})
        for (const auto& symbol : *symbols) add(symbol);
    add(system.t);
    if (shown == 0)
        for (const auto& symbol : system.parameters) add(symbol);
    return text + (shown > 6 ? ", ..." : "");
}

std::vector<std::pair<std::size_t, std::size_t>> portions_of(std::size_t count) {
    constexpr std::size_t portion = 1000;
    std::vector<std::pair<std::size_t, std::size_t>> result;
    for (std::size_t begin = 0; begin < count; begin += portion)
        result.emplace_back(begin, std::min(count, begin + portion));
    return result;
}

void require_domains(const Scene& scene, const System& system, Formulas& start) {
    StartDomains(scene, system, start).require_all();
}

}  // namespace lobatto
