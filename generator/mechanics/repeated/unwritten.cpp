// SPDX-License-Identifier: GPL-2.0-or-later
#include "generator/mechanics/repeated/unwritten.hpp"

#include <algorithm>
#include <set>

#include "generator/formula/expansion.hpp"
#include "generator/formula/real.hpp"
#include "generator/mechanics/algebra/constant_part.hpp"
#include "generator/mechanics/algebra/sample.hpp"
#include "generator/mechanics/repeated/elements.hpp"

namespace lobatto {

namespace {

using GiNaC::ex;

bool holds_any(const ex& expression, const std::vector<GiNaC::symbol>& symbols) {
    return std::any_of(symbols.begin(), symbols.end(), [&](const auto& symbol) { return expression.has(symbol); });
}

// A second derivative of a formula, by its slots i and j; the slots that it holds, and those that it changes with.
struct Curvature {
    std::size_t i, j;
    ex value;
    std::vector<std::size_t> holds, changes_with;
};

// Of a coefficient: a number, or a parameter.
cln::cl_R value_of(const ex& coefficient, const Formulas& point) {
    return GiNaC::is_a<GiNaC::symbol>(coefficient) ? point.get(coefficient)
                                                   : float_of(GiNaC::ex_to<GiNaC::numeric>(coefficient));
}

// What holds a root, a table or another piece of the slots is taken to change with all that it holds, as everywhere.
bool is_broken(const ex& value, const std::vector<GiNaC::symbol>& x) {
    for (auto part = value.preorder_begin(); part != value.preorder_end(); ++part)
        if (is_pieced(*part) && holds_any(*part, x)) return true;
    return false;
}

// Coefficients are numbers at run time that may be anything, or factors: no value of them makes a derivative vanish.
bool has_plain_coefficients(const Element& element, const SystemSymbols& symbols) {
    for (std::size_t j = 0; j < element.a.size(); ++j) {
        bool is_parameter = true;
        for (const auto& row : element.coefficients) {
            if (holds_any(row[j], symbols.inputs)) return false;
            is_parameter = is_parameter && GiNaC::is_a<GiNaC::symbol>(row[j]);
        }
        if (!is_parameter && !expanded(element.term.diff(element.a[j]) * element.a[j] - element.term).is_zero())
            return false;
    }
    return !element.term.has(symbols.t) && !holds_any(element.term, symbols.inputs);
}

// The second derivatives of a formula; none where one of them has a part that does not change with the positions.
std::vector<Curvature> curvatures_of(const Element& element) {
    std::vector<Curvature> result;
    const ConstantPart constant_part(element.x);
    for (const auto& [i, j] : pairs_of(element)) {
        Curvature curvature{i, j, element.term.diff(element.x[i]).diff(element.x[j]), {}, {}};
        if (!constant_part.of(curvature.value).is_zero()) return {};
        for (std::size_t c = 0; c < element.x.size(); ++c)
            if (curvature.value.has(element.x[c])) curvature.holds.push_back(c);
        if (is_broken(curvature.value, element.x)) curvature.changes_with = curvature.holds;
        result.push_back(std::move(curvature));
    }
    return result;
}

// Told by values at seeded points: one slot is moved at a time.
void find_changes(const Scene& scene, const SystemSymbols& symbols, const Element& element,
                  std::vector<Curvature>& curvatures) {
    std::vector<ex> values;
    for (const Curvature& curvature : curvatures) values.push_back(curvature.value);
    at_sample_points(scene, [&](NearStart& point) {
        Formulas formulas;
        point.set_all(formulas);
        for (std::size_t c = 0; c < element.x.size(); ++c)
            formulas.set(element.x[c], formulas.get(symbols.q[static_cast<std::size_t>(element.rows.front()[c])]));
        for (std::size_t j = 0; j < element.a.size(); ++j)
            formulas.set(element.a[j], value_of(element.coefficients.front()[j], formulas));
        const std::vector<Id> roots = formulas.convert(values);
        const std::vector<Sized> here = formulas.evaluate_sized(roots);
        for (std::size_t c = 0; c < element.x.size(); ++c) {
            const cln::cl_R before = formulas.get(element.x[c]);
            formulas.set(element.x[c], point.near(before));
            const std::vector<Sized> there = formulas.evaluate_sized(roots);
            formulas.set(element.x[c], before);
            for (std::size_t k = 0; k < curvatures.size(); ++k) {
                auto& changes_with = curvatures[k].changes_with;
                const bool is_known = std::find(changes_with.begin(), changes_with.end(), c) != changes_with.end();
                if (!is_known && !here[k].equals(there[k])) changes_with.push_back(c);
            }
        }
    });
}

// None where the element is to be written out.
std::vector<Curvature> changing_curvatures(const Scene& scene, const SystemSymbols& symbols, const Element& element) {
    if (!has_plain_coefficients(element, symbols)) return {};
    std::vector<Curvature> curvatures = curvatures_of(element);
    try {
        find_changes(scene, symbols, element, curvatures);
    } catch (const DomainError&) {
        return {};
    }
    return curvatures;
}

// The second derivative of one row, where it stands.
struct Contribution {
    std::pair<int, int> place;
    const Element* element;
    const std::vector<int>* row;
    const Curvature* curvature;
};

// The position by which one of the contributions to a place changes and that no other of them holds; -1 where there is
// none. `counts`: n zeros, and left so.
int witness_of(const std::vector<Contribution>& all, std::size_t begin, std::size_t end, std::vector<int>& counts) {
    const auto each = [&](auto&& use) {
        for (std::size_t c = begin; c < end; ++c)
            for (const std::size_t slot : all[c].curvature->holds)
                use(counts[static_cast<std::size_t>((*all[c].row)[slot])]);
    };
    each([](int& count) { ++count; });
    int witness = -1;
    for (std::size_t c = begin; witness < 0 && c < end; ++c)
        for (const std::size_t slot : all[c].curvature->changes_with)
            if (const int variable = (*all[c].row)[slot]; counts[static_cast<std::size_t>(variable)] == 1) {
                witness = variable;
                break;
            }
    each([](int& count) { count = 0; });
    return witness;
}

// False where a place may have no second derivative after all.
bool find_places(Unwritten& unwritten, const std::vector<std::vector<Curvature>>& curvatures, std::size_t n) {
    std::vector<Contribution> all;
    for (std::size_t e = 0; e < unwritten.elements.size(); ++e) {
        const Element& element = unwritten.elements[e];
        for (const std::vector<int>& row : element.rows)
            for (const Curvature& curvature : curvatures[e])
                all.push_back({{row[curvature.i], row[curvature.j]}, &element, &row, &curvature});
    }
    std::stable_sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.place < b.place; });
    std::vector<int> counts(n, 0);
    for (std::size_t begin = 0, end = 0; begin < all.size(); begin = end) {
        while (end < all.size() && all[end].place == all[begin].place) ++end;
        const int witness = witness_of(all, begin, end, counts);
        if (witness < 0) return false;
        unwritten.places.push_back(all[begin].place);
        unwritten.witnesses.push_back(witness);
    }
    return true;
}

}  // namespace

ex Unwritten::at(const std::pair<int, int>& place, const std::vector<GiNaC::symbol>& q) const {
    GiNaC::exvector sum;
    for (const Element& element : elements)
        for (const auto& [i, j] : pairs_of(element)) {
            const ex value = element.term.diff(element.x[i]).diff(element.x[j]);
            for (std::size_t r = 0; r < element.rows.size(); ++r) {
                const std::vector<int>& row = element.rows[r];
                if (std::pair(row[i], row[j]) != place) continue;
                sum.push_back(of_row(element, value, r, q));
            }
        }
    return GiNaC::add(sum);
}

void at_rows(const Element& element, const std::vector<ex>& formulas, const SystemSymbols& symbols,
             const Formulas& point, const std::function<void(std::size_t, const std::vector<cln::cl_R>&)>& use) {
    Formulas of_row;
    for (const auto& parameter : symbols.parameters) of_row.set(parameter, point.get(parameter));
    std::vector<Id> roots;
    for (std::size_t r = 0; r < element.rows.size(); ++r) {
        for (std::size_t j = 0; j < element.x.size(); ++j)
            of_row.set(element.x[j], point.get(symbols.q[static_cast<std::size_t>(element.rows[r][j])]));
        for (std::size_t j = 0; j < element.a.size(); ++j)
            of_row.set(element.a[j], value_of(element.coefficients[r][j], point));
        if (r == 0) roots = of_row.convert(formulas);
        use(r, of_row.evaluate(roots));
    }
}

Unwritten set_apart(const Scene& scene, const SystemSymbols& symbols, std::vector<ex>& terms) {
    if (terms.size() < fewest_unwritten) return {};
    std::vector<ex> of_positions, others;
    std::vector<GiNaC::symbol> moving = symbols.v;
    moving.push_back(symbols.t);
    moving.insert(moving.end(), symbols.inputs.begin(), symbols.inputs.end());
    const std::set<ex, GiNaC::ex_is_less> set(moving.begin(), moving.end());
    for (const ex& term : terms) {
        const bool moves =
            std::any_of(term.preorder_begin(), term.preorder_end(), [&](const ex& part) { return set.contains(part); });
        if (moves)
            others.push_back(term);
        else
            of_positions.push_back(-term);
    }
    Unwritten result;
    Elements elements = find_elements(symbols, symbols.q, of_positions, {});
    const bool is_large = std::any_of(elements.repeated.begin(), elements.repeated.end(),
                                      [](const Element& element) { return element.rows.size() >= fewest_unwritten; });
    if (!is_large) return {};
    std::vector<std::vector<Curvature>> curvatures;
    for (Element& element : elements.repeated) {
        std::vector<Curvature> of_element = changing_curvatures(scene, symbols, element);
        if (of_element.empty()) {
            for (std::size_t r = 0; r < element.rows.size(); ++r)
                others.push_back(-of_row(element, element.term, r, symbols.q));
            continue;
        }
        result.elements.push_back(std::move(element));
        curvatures.push_back(std::move(of_element));
    }
    if (result.empty()) return {};
    if (!find_places(result, curvatures, symbols.q.size())) return {};
    for (const ex& term : elements.others) others.push_back(-term);
    terms = std::move(others);
    return result;
}

}  // namespace lobatto
