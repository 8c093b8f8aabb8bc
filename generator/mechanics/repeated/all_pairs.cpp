// SPDX-License-Identifier: GPL-2.0-or-later
// Rows that are all pairs of some bodies.
#include "generator/mechanics/repeated/all_pairs.hpp"

#include <map>
#include <utility>

namespace lobatto {

namespace {

// The number of bodies that have so many pairs, or 0.
int bodies_of(std::size_t pairs) {
    std::size_t bodies = 2;
    while (bodies * (bodies - 1) / 2 < pairs) ++bodies;
    return bodies * (bodies - 1) / 2 == pairs ? static_cast<int>(bodies) : 0;
}

// The bodies of each row, told by two variables of which one belongs to the first body and one to the second; empty
// where these are not all pairs.
std::vector<std::pair<int, int>> pairs_told_by(const Element& element, std::size_t first, std::size_t second,
                                               int bodies) {
    int begin_first = element.rows.front()[first], begin_second = element.rows.front()[second];
    for (const std::vector<int>& row : element.rows) {
        begin_first = std::min(begin_first, row[first]);
        begin_second = std::min(begin_second, row[second]);
    }
    std::map<std::pair<int, int>, int> seen;
    std::vector<std::pair<int, int>> pairs;
    for (const std::vector<int>& row : element.rows) {
        const std::pair<int, int> pair{row[first] - begin_first, row[second] - begin_second + 1};
        if (pair.first >= pair.second || pair.second >= bodies || !seen.emplace(pair, 0).second) return {};
        pairs.push_back(pair);
    }
    return pairs;  // as many as there are, each once
}

// Of which body of the pairs a variable is, and where the variables of its kind begin.
std::optional<AllPairs::Variable> variable_of_pairs(const Element& element, std::size_t variable,
                                                    const std::vector<std::pair<int, int>>& pairs) {
    for (const bool of_second : {false, true}) {
        const auto body = [&](std::size_t r) { return of_second ? pairs[r].second : pairs[r].first; };
        const int begin = element.rows[0][variable] - body(0);
        bool holds = true;
        for (std::size_t r = 0; holds && r < pairs.size(); ++r) holds = element.rows[r][variable] == begin + body(r);
        if (holds) return AllPairs::Variable{begin, of_second};
    }
    return std::nullopt;
}

std::optional<AllPairs::Coefficient> coefficient_of_pairs(const Element& element, std::size_t number, int bodies,
                                                          const std::vector<std::pair<int, int>>& pairs) {
    for (const bool of_second : {false, true}) {
        AllPairs::Coefficient result{of_second, std::vector<GiNaC::ex>(static_cast<std::size_t>(bodies - 1))};
        std::vector<bool> known(result.values.size());
        bool holds = true;
        for (std::size_t r = 0; holds && r < pairs.size(); ++r) {
            const auto place = static_cast<std::size_t>(of_second ? pairs[r].second - 1 : pairs[r].first);
            const GiNaC::ex& value = element.coefficients[r][number];
            holds = !known[place] || result.values[place].is_equal(value);
            known[place] = true;
            result.values[place] = value;
        }
        if (holds) return result;
    }
    return std::nullopt;
}

// The bodies of each row; empty where the rows are not all pairs of at least `fewest_bodies`.
std::vector<std::pair<int, int>> pairs_of_bodies(const Element& element) {
    const int bodies = bodies_of(element.rows.size());
    if (bodies < fewest_bodies || element.x.size() < 2) return {};
    // The first variable belongs to one of the two bodies, some other one to the other.
    std::vector<std::pair<int, int>> pairs;
    for (std::size_t other = 1; pairs.empty() && other < element.x.size(); ++other) {
        pairs = pairs_told_by(element, 0, other, bodies);
        if (pairs.empty()) pairs = pairs_told_by(element, other, 0, bodies);
    }
    return pairs;
}

// first[i] second[j] is the number of each pair (i, j).
struct Product {
    std::vector<GiNaC::numeric> first, second;
};
std::optional<Product> product_of(const Element& element, std::size_t coefficient, int bodies,
                                  const std::vector<std::pair<int, int>>& pairs) {
    std::map<std::pair<int, int>, GiNaC::numeric> numbers;
    for (std::size_t r = 0; r < pairs.size(); ++r) {
        const GiNaC::ex& value = element.coefficients[r][coefficient];
        if (!GiNaC::is_a<GiNaC::numeric>(value) || !value.info(GiNaC::info_flags::rational)) return std::nullopt;
        numbers[pairs[r]] = GiNaC::ex_to<GiNaC::numeric>(value);
    }
    const auto last = static_cast<std::size_t>(bodies - 1);
    Product product{std::vector<GiNaC::numeric>(last, 1), std::vector<GiNaC::numeric>(last + 1)};
    for (int j = 1; j < bodies; ++j) product.second[static_cast<std::size_t>(j)] = numbers.at({0, j});
    for (int i = 1; i < bodies - 1; ++i)
        product.first[static_cast<std::size_t>(i)] = numbers.at({i, bodies - 1}) / product.second[last];
    for (const auto& [pair, number] : numbers)
        if (number !=
            product.first[static_cast<std::size_t>(pair.first)] * product.second[static_cast<std::size_t>(pair.second)])
            return std::nullopt;
    return product;
}

}  // namespace

std::vector<std::vector<int>> rows_of(const AllPairs& pairs) {
    std::vector<std::vector<int>> rows;
    for (int body = 0; body < pairs.bodies; ++body)
        for (int other = body + 1; other < pairs.bodies; ++other) {
            rows.emplace_back();
            for (const auto& [begin, of_second] : pairs.variables)
                rows.back().push_back(begin + (of_second ? other : body));
        }
    return rows;
}

std::optional<AllPairs> all_pairs(const Element& element) {
    AllPairs result;
    const std::vector<std::pair<int, int>> pairs = pairs_of_bodies(element);
    if (pairs.empty()) return std::nullopt;
    result.bodies = bodies_of(element.rows.size());
    for (std::size_t j = 0; j < element.x.size(); ++j) {
        const auto variable = variable_of_pairs(element, j, pairs);
        if (!variable) return std::nullopt;
        result.variables.push_back(*variable);
    }
    for (std::size_t j = 0; j < element.a.size(); ++j) {
        auto coefficient = coefficient_of_pairs(element, j, result.bodies, pairs);
        if (!coefficient) return std::nullopt;
        result.coefficients.push_back(std::move(*coefficient));
    }
    return result;
}

void split_products(Element& element) {
    const std::vector<std::pair<int, int>> pairs = pairs_of_bodies(element);
    if (pairs.empty()) return;
    const int bodies = bodies_of(element.rows.size());
    for (std::size_t j = 0, count = element.a.size(); j < count; ++j) {
        if (coefficient_of_pairs(element, j, bodies, pairs)) continue;
        const std::optional<Product> product = product_of(element, j, bodies, pairs);
        if (!product) continue;
        element.a.emplace_back("a" + std::to_string(element.a.size()));
        element.term = element.term.subs(GiNaC::ex(element.a[j]) == element.a[j] * element.a.back(),
                                         GiNaC::subs_options::no_pattern);
        for (std::size_t r = 0; r < pairs.size(); ++r) {
            element.coefficients[r][j] = product->first[static_cast<std::size_t>(pairs[r].first)];
            element.coefficients[r].push_back(product->second[static_cast<std::size_t>(pairs[r].second)]);
        }
    }
}

}  // namespace lobatto
