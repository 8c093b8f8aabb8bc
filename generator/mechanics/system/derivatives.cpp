// SPDX-License-Identifier: GPL-2.0-or-later
// Derivatives of sums, term by term: each term is differentiated only by the variables it holds.
#include <map>

#include "generator/mechanics/system/occurrences.hpp"
#include "generator/mechanics/system/system.hpp"

namespace lobatto {

namespace {

using GiNaC::ex;
using GiNaC::exvector;
using Symbols = std::vector<GiNaC::symbol>;

}  // namespace

ex at(const ex& expression, const Symbols& variables, const Occurrences& occurrences, const ex& value) {
    GiNaC::exmap found;
    for (const std::size_t i : occurrences.in(expression)) found[variables[i]] = value;
    return expression.subs(found, GiNaC::subs_options::no_pattern);
}

ex without(const ex& value, const Symbols& mentioned, const Occurrences& occurrences) {
    for (const ex& place : {ex(0), ex(GiNaC::numeric(1, 2))}) try {
            return at(value, mentioned, occurrences, place);
        } catch (const std::exception&) {
        }
    GiNaC::exmap apart;
    for (const std::size_t i : occurrences.in(value))
        apart[mentioned[i]] = GiNaC::numeric(1, static_cast<long>(apart.size()) + 3);
    return value.subs(apart, GiNaC::subs_options::no_pattern);
}

namespace {

void append_terms(const ex& expression, const Occurrences& occurrences, std::vector<ex>& terms) {
    if (GiNaC::is_a<GiNaC::add>(expression)) {
        for (const ex& term : expression) append_terms(term, occurrences, terms);
        return;
    }
    if (GiNaC::is_a<GiNaC::mul>(expression)) {
        exvector free, bound;
        for (const ex& factor : expression) (occurrences.in(factor).empty() ? free : bound).push_back(factor);
        if (bound.size() == 1 && GiNaC::is_a<GiNaC::add>(bound.front())) {
            std::vector<ex> inner;
            append_terms(bound.front(), occurrences, inner);
            const ex coefficient = GiNaC::mul(free);
            for (const ex& term : inner) terms.push_back(coefficient * term);
            return;
        }
    }
    terms.push_back(expression);
}

ex sum_of(const exvector& terms) {
    return terms.empty() ? ex(0) : ex(GiNaC::add(terms));
}

}  // namespace

std::vector<ex> terms_of(const ex& expression, const Symbols& variables) {
    std::vector<ex> terms;
    append_terms(expression, Occurrences(variables), terms);
    return terms;
}

std::vector<ex> all_at(const std::vector<ex>& expressions, const Symbols& variables, const ex& value) {
    const Occurrences occurrences(variables);
    std::vector<ex> result;
    for (const ex& expression : expressions) result.push_back(at(expression, variables, occurrences, value));
    return result;
}

std::vector<ex> gradient_of(const std::vector<ex>& terms, const Symbols& variables) {
    const Occurrences occurrences(variables);
    std::vector<exvector> parts(variables.size());
    for (const ex& term : terms)
        for (const std::size_t i : occurrences.in(term)) parts[i].push_back(term.diff(variables[i]));
    std::vector<ex> gradient;
    for (const exvector& part : parts) gradient.push_back(sum_of(part));
    return gradient;
}

SparseMatrix derivative_of(const std::vector<ex>& vector, const Symbols& variables) {
    const Occurrences occurrences(variables);
    SparseMatrix result(static_cast<int>(vector.size()), static_cast<int>(variables.size()));
    for (std::size_t k = 0; k < vector.size(); ++k) {
        std::vector<ex> terms;
        append_terms(vector[k], occurrences, terms);
        std::map<std::size_t, exvector> parts;
        for (const ex& term : terms)
            for (const std::size_t i : occurrences.in(term)) parts[i].push_back(term.diff(variables[i]));
        for (const auto& [i, part] : parts) {
            const ex value = sum_of(part);
            if (!value.is_zero()) result.put(static_cast<int>(k), static_cast<int>(i), value);
        }
    }
    return result;
}

}  // namespace lobatto
