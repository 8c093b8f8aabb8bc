// SPDX-License-Identifier: GPL-2.0-or-later
#include "generator/mechanics/system/dependence.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "generator/formula/real.hpp"

namespace lobatto {

namespace {

using GiNaC::ex;
using Symbols = std::vector<GiNaC::symbol>;

}  // namespace

void refuse_lagrangian(const Scene& scene, const std::string& reason) {
    scene.source.fail(scene.lagrangian_at, "the Lagrangian " + reason);
}

// What is pieced may jump or bend beyond the sampled points, as x/sqrt(x^2) does: what holds it is taken to depend
// on all that it mentions. Everything else is analytic: constant near a point is constant.
bool Dependence::is_broken(const ex& expression) const {
    for (auto part = expression.preorder_begin(); part != expression.preorder_end(); ++part)
        if (is_pieced(*part) && !motion_.in(*part).empty()) return true;
    return false;
}

// Whether something broken holds positions or velocities.
bool Dependence::is_bent(const ex& expression) const {
    const std::size_t n = system_.q.size();
    for (auto part = expression.preorder_begin(); part != expression.preorder_end(); ++part)
        if (is_pieced(*part))
            for (const std::size_t variable : motion_.in(*part))
                if (variable < 2 * n) return true;
    return false;
}

std::vector<Dependence::Kind> Dependence::of(const std::vector<ex>& expressions) const {
    std::vector<Kind> kinds = sampled(expressions);
    const std::size_t n = system_.q.size();
    for (std::size_t i = 0; i < kinds.size(); ++i) {
        if (!is_broken(expressions[i])) continue;
        kinds[i].zero = false;
        for (const std::size_t variable : motion_.in(expressions[i]))
            (variable < n        ? kinds[i].on_q
             : variable < 2 * n  ? kinds[i].on_v
             : variable == 2 * n ? kinds[i].on_t
                                 : kinds[i].on_inputs) = true;
    }
    return kinds;
}

std::vector<Dependence::Kind> Dependence::sampled(const std::vector<ex>& expressions) const {
    std::vector<Kind> kinds(expressions.size());
    try {
        at_sample_points(scene_, [&](NearStart& point) {
            point.set_all(*formulas_);
            examine(*formulas_, formulas_->convert(expressions), point, kinds);
        });
    } catch (const DomainError& error) {
        const bool has_forces = std::any_of(scene_.coordinates.begin(), scene_.coordinates.end(),
                                            [](const Coordinate& one) { return !one.force.is_zero(); });
        refuse_lagrangian(scene_, fmt::format("{}has no finite real derivatives at or near the start: {}; start away "
                                              "from the singularity, or mend the formula",
                                              has_forces ? "or a force beside it " : "", error.what()));
    }
    return kinds;
}

void Dependence::examine(Formulas& formulas, const std::vector<Id>& roots, NearStart& point,
                         std::vector<Kind>& kinds) const {
    const std::vector<Sized> all = formulas.evaluate_all_sized(roots);
    const auto here = [&](std::size_t i) -> const Sized& { return all[static_cast<std::size_t>(roots[i])]; };
    const auto moved = [&](const Symbols& symbols, bool Kind::*flag) {
        const std::vector<bool> holding = formulas.holding(roots, symbols);
        std::vector<std::size_t> which;
        std::vector<Id> those;
        for (std::size_t i = 0; i < roots.size(); ++i)
            if (holding[i]) {
                which.push_back(i);
                those.push_back(roots[i]);
            }
        if (those.empty()) return;
        std::vector<cln::cl_R> before;
        for (const GiNaC::symbol& symbol : symbols) {
            before.push_back(formulas.get(symbol));
            formulas.set(symbol, point.near(before.back()));
        }
        const std::vector<Sized> there = formulas.evaluate_sized(those);
        for (std::size_t i = 0; i < those.size(); ++i)
            if (!here(which[i]).equals(there[i])) kinds[which[i]].*flag = true;
        for (std::size_t k = 0; k < symbols.size(); ++k) formulas.set(symbols[k], before[k]);
    };
    // What a term depends on counts also where the term is too small to be seen.
    const std::vector<GiNaC::exset> hidden = formulas.hidden(roots, all);
    const auto hides = [&](std::size_t i, const Symbols& symbols) {
        return !hidden[i].empty() &&
               std::any_of(symbols.begin(), symbols.end(), [&](const auto& s) { return hidden[i].contains(s); });
    };
    for (std::size_t i = 0; i < kinds.size(); ++i) {
        if (!here(i).vanishes() || !hidden[i].empty()) kinds[i].zero = false;
        kinds[i].on_q |= hides(i, system_.q);
        kinds[i].on_v |= hides(i, system_.v);
        kinds[i].on_t |= hides(i, {system_.t});
        kinds[i].on_inputs |= hides(i, system_.inputs);
    }
    moved(system_.q, &Kind::on_q);
    moved(system_.v, &Kind::on_v);
    moved({system_.t}, &Kind::on_t);
    if (!system_.inputs.empty()) moved(system_.inputs, &Kind::on_inputs);
}

}  // namespace lobatto
