// SPDX-License-Identifier: GPL-2.0-or-later
// Repeated terms of a sum: one formula, written once, and the table of what it is applied to.
//
// Two terms are the same formula when their graphs, in canonical order, differ only in inputs and constants.
#include "generator/mechanics/repeated/elements.hpp"

#include <algorithm>
#include <exception>
#include <map>
#include <string>

#include "generator/formula/expansion.hpp"
#include "generator/formula/spline.hpp"
#include "generator/formula/switch.hpp"
#include "generator/graph/graph.hpp"
#include "generator/mechanics/repeated/all_pairs.hpp"

namespace lobatto {

namespace {

using GiNaC::ex;

// What stands at the leaves of one term, in the order of its graph.
struct Leaves {
    std::string shape;             // the graph with # for coefficients and the number of the slot for variables
    std::vector<int> variables;    // by slot
    std::vector<Id> coefficients;  // constants and parameters, in order
};

class Shapes {
public:
    Shapes(const SystemSymbols& symbols, const std::vector<GiNaC::symbol>& variables) {
        for (std::size_t i = 0; i < variables.size(); ++i) input(variables[i], static_cast<int>(i));
        for (const auto& parameter : symbols.parameters) input(parameter, coefficient);
        input(symbols.t, time);
    }

    Id convert(const ex& term) { return graph_.from(term, inputs_); }

    Leaves leaves(Id root) const {
        Leaves result;
        visit(root, result);
        return result;
    }

    // The graph as a formula again, its leaves replaced: slots by x, coefficients one after the other.
    ex formula(Id root, const std::vector<GiNaC::symbol>& x, const std::vector<ex>& coefficients) const {
        std::map<int, std::size_t> slots;
        std::size_t next = 0;
        return rebuild(root, x, coefficients, slots, next);
    }
    ex leaf(Id id) const {
        return graph_.is_constant(id) ? ex(GiNaC::numeric(graph_.constant_of(id).value))
                                      : ex(symbols_[static_cast<std::size_t>(graph_[id].index)]);
    }

    // An order of coefficients that does not depend on when they were met: parameters as declared, then numbers by
    // size.
    bool precedes(Id a, Id b) const {
        const bool number_a = graph_.is_constant(a), number_b = graph_.is_constant(b);
        if (number_a != number_b) return number_b;
        return number_a ? graph_.constant_of(a).value < graph_.constant_of(b).value : graph_[a].index < graph_[b].index;
    }

private:
    static constexpr int coefficient = -1, time = -2;

    void input(const GiNaC::symbol& symbol, int meaning) {
        const std::string name = "x" + std::to_string(symbols_.size());
        inputs_[symbol] = graph_.input({name, name, Phase::iterate});
        symbols_.push_back(symbol);
        meanings_.push_back(meaning);
    }
    int meaning(Id id) const {
        return graph_.is_constant(id) ? coefficient : meanings_[static_cast<std::size_t>(graph_[id].index)];
    }

    void visit(Id id, Leaves& leaves) const {
        const Node& node = graph_[id];
        if (node.op == Op::constant || node.op == Op::input) {
            const int variable = meaning(id);
            if (variable == coefficient) {
                leaves.shape += '#';
                leaves.coefficients.push_back(id);
            } else if (variable == time) {
                leaves.shape += 't';
            } else {
                std::size_t slot = 0;
                while (slot < leaves.variables.size() && leaves.variables[slot] != variable) ++slot;
                if (slot == leaves.variables.size()) leaves.variables.push_back(variable);
                leaves.shape += 'x' + std::to_string(slot);
            }
            return;
        }
        leaves.shape += std::to_string(static_cast<int>(node.op)) + '^' + std::to_string(node.index) + '(';
        for (const Id operand : node.operands) {
            visit(operand, leaves);
            leaves.shape += ',';
        }
        leaves.shape += ')';
    }

    ex rebuild(Id id, const std::vector<GiNaC::symbol>& x, const std::vector<ex>& coefficients,
               std::map<int, std::size_t>& slots, std::size_t& next) const {
        const Node& node = graph_[id];
        if (node.op == Op::constant || node.op == Op::input) {
            const int variable = meaning(id);
            if (variable == coefficient) return coefficients[next++];
            if (variable == time) return symbols_.back();
            return x[slots.emplace(variable, slots.size()).first->second];
        }
        GiNaC::exvector operands;
        for (const Id operand : node.operands) operands.push_back(rebuild(operand, x, coefficients, slots, next));
        switch (node.op) {
            case Op::add:
                return GiNaC::add(operands);
            case Op::multiply:
                return GiNaC::mul(operands);
            case Op::power:
                return GiNaC::pow(operands[0], node.index);
            case Op::raise:
                return GiNaC::pow(operands[0], operands[1]);
            case Op::sqrt:
                return GiNaC::sqrt(operands[0]);
            case Op::sin:
                return GiNaC::sin(operands[0]);
            case Op::cos:
                return GiNaC::cos(operands[0]);
            case Op::tan:
                return GiNaC::tan(operands[0]);
            case Op::exp:
                return GiNaC::exp(operands[0]);
            case Op::log:
                return GiNaC::log(operands[0]);
            case Op::sinh:
                return GiNaC::sinh(operands[0]);
            case Op::cosh:
                return GiNaC::cosh(operands[0]);
            case Op::tanh:
                return GiNaC::tanh(operands[0]);
            case Op::asin:
                return GiNaC::asin(operands[0]);
            case Op::acos:
                return GiNaC::acos(operands[0]);
            case Op::atan:
                return GiNaC::atan(operands[0]);
            case Op::atan2:
                return GiNaC::atan2(operands[0], operands[1]);
            case Op::positive_part:
                return positive_part(operands[0]);
            case Op::table:
                return table_value(node.index / 4, node.index % 4, operands[0]);
            default:
                throw std::logic_error("an operation that no formula has");
        }
    }

    Graph graph_;
    GiNaC::exmap inputs_;
    std::vector<GiNaC::symbol> symbols_;
    std::vector<int> meanings_;  // variable number, coefficient or time, by input
};

// Sorts terms by their formula into families, and makes an element of each family that has enough rows.
class Families {
public:
    Families(const SystemSymbols& symbols, const std::vector<GiNaC::symbol>& variables)
        : shapes_(symbols, variables), velocities_(static_cast<int>(variables.size()) - symbols.n) {}

    // acted_on: the coordinate of a force, -1 for a term of the Lagrangian. source: its number, terms first, then
    // forces.
    void add(const ex& term, int acted_on, std::size_t source) {
        const Id root = shapes_.convert(term);
        Leaves leaves = shapes_.leaves(root);
        int target = -1;
        if (acted_on >= 0) {
            target = 0;
            const auto count = static_cast<int>(leaves.variables.size());
            while (target < count && leaves.variables[static_cast<std::size_t>(target)] != acted_on) ++target;
            if (target == count) leaves.variables.push_back(acted_on);
        }
        // Velocities, the first of the variables where there are any, are another family: they count in the energy.
        std::string key = std::to_string(target) + ":";
        for (const int variable : leaves.variables) key += variable < velocities_ ? 'v' : 'q';
        key += ":" + leaves.shape;
        Family& family = families_[key];
        family.target = target;
        family.rows.push_back({root, std::move(leaves), source});
    }

    Elements elements(const std::vector<ex>& terms, const std::vector<std::pair<int, ex>>& forces) {
        Elements result;
        for (auto& [key, family] : families_) {
            sort(family.rows);
            if (family.rows.size() < fewest_rows) {
                for (const Row& row : family.rows) {
                    if (row.source < terms.size())
                        result.others.push_back(terms[row.source]);
                    else
                        result.other_forces.push_back(forces[row.source - terms.size()]);
                }
                continue;
            }
            Element element = element_of(family);
            // Two formulas of the same variables, row by row, are one.
            const auto twin = std::find_if(result.repeated.begin(), result.repeated.end(), [&](const Element& other) {
                return element.target < 0 && other.target < 0 && other.rows == element.rows;
            });
            if (twin == result.repeated.end())
                result.repeated.push_back(std::move(element));
            else
                add_to(*twin, element);
        }
        for (Element& element : result.repeated) split_products(element);
        return result;
    }

private:
    struct Row {
        Id root;
        Leaves leaves;
        std::size_t source;  // in terms, then forces
    };
    struct Family {
        int target = -1;  // which variable of a row the force acts on
        std::vector<Row> rows;
    };

    // How far the variables of a row are from its first.
    static std::vector<int> distances(const Row& row) {
        std::vector<int> result;
        for (const int variable : row.leaves.variables) result.push_back(variable - row.leaves.variables.front());
        return result;
    }

    // Rows of the same distances stand together, most of them first, so that runs of neighbours are long: those of a
    // ring are one run and the row that closes it.
    // NOTE: the order of a sum's terms changes from process to process; that of variables and of values does not.
    void sort(std::vector<Row>& rows) {
        std::map<std::vector<int>, std::size_t> as_far;  // rows, by distances
        for (const Row& row : rows) ++as_far[distances(row)];
        std::stable_sort(rows.begin(), rows.end(), [&](const Row& a, const Row& b) {
            const std::vector<int> far_a = distances(a), far_b = distances(b);
            if (far_a != far_b) {
                const std::size_t many_a = as_far.at(far_a), many_b = as_far.at(far_b);
                return many_a != many_b ? many_a > many_b : far_a < far_b;
            }
            if (a.leaves.variables != b.leaves.variables) return a.leaves.variables < b.leaves.variables;
            return std::lexicographical_compare(a.leaves.coefficients.begin(), a.leaves.coefficients.end(),
                                                b.leaves.coefficients.begin(), b.leaves.coefficients.end(),
                                                [&](Id left, Id right) { return shapes_.precedes(left, right); });
        });
    }

    // Coefficients that are the same in all rows are part of the formula; the others are its a0, a1, ...
    Element element_of(const Family& family) {
        const std::vector<Row>& rows = family.rows;
        Element element;
        element.target = family.target;
        const Leaves& first = rows.front().leaves;
        for (std::size_t j = 0; j < first.variables.size(); ++j) element.x.emplace_back("x" + std::to_string(j));
        std::vector<ex> coefficients;
        std::vector<std::size_t> varying;
        for (std::size_t j = 0; j < first.coefficients.size(); ++j) {
            bool same = true;
            for (const Row& row : rows) same = same && row.leaves.coefficients[j] == first.coefficients[j];
            if (same) {
                coefficients.push_back(shapes_.leaf(first.coefficients[j]));
            } else {
                element.a.emplace_back("a" + std::to_string(element.a.size()));
                coefficients.push_back(element.a.back());
                varying.push_back(j);
            }
        }
        element.term = shapes_.formula(rows.front().root, element.x, coefficients);
        for (const Row& row : rows) {
            element.rows.push_back(row.leaves.variables);
            element.coefficients.emplace_back();
            for (const std::size_t j : varying)
                element.coefficients.back().push_back(shapes_.leaf(row.leaves.coefficients[j]));
        }
        return element;
    }

    static void add_to(Element& twin, const Element& element) {
        GiNaC::exmap renamed;
        for (std::size_t j = 0; j < element.x.size(); ++j) renamed[element.x[j]] = twin.x[j];
        for (const auto& symbol : element.a) {
            twin.a.emplace_back("a" + std::to_string(twin.a.size()));
            renamed[symbol] = twin.a.back();
        }
        twin.term += element.term.subs(renamed, GiNaC::subs_options::no_pattern);
        for (std::size_t r = 0; r < element.rows.size(); ++r)
            twin.coefficients[r].insert(twin.coefficients[r].end(), element.coefficients[r].begin(),
                                        element.coefficients[r].end());
    }

    Shapes shapes_;
    int velocities_;                          // how many of the variables
    std::map<std::string, Family> families_;  // by formula
};

}  // namespace

Elements find_elements(const SystemSymbols& symbols, const std::vector<GiNaC::symbol>& variables,
                       const std::vector<ex>& terms, const std::vector<std::pair<int, ex>>& forces) {
    Families families(symbols, variables);
    for (std::size_t i = 0; i < terms.size(); ++i) families.add(terms[i], -1, i);
    for (std::size_t i = 0; i < forces.size(); ++i) families.add(forces[i].second, forces[i].first, terms.size() + i);
    return families.elements(terms, forces);
}

std::vector<RowRun> runs_of(const Element& element) {
    std::vector<RowRun> runs;
    for (std::size_t r = 0; r < element.rows.size(); ++r) {
        bool follows = r > 0;
        for (std::size_t j = 0; follows && j < element.x.size(); ++j)
            follows = element.rows[r][j] == element.rows[r - 1][j] + 1;
        if (follows)
            ++runs.back().count;
        else
            runs.push_back({static_cast<int>(r), 1});
    }
    return runs;
}

bool are_neighbours(const Elements& elements) {
    std::size_t rows = 0, in_runs = 0;
    for (const Element& element : elements.repeated) {
        if (element.target >= 0) return false;
        if (element.x.empty()) continue;
        rows += element.rows.size();
        for (const RowRun& run : runs_of(element)) {
            if (run.count == 1) continue;
            if (run.count >= static_cast<int>(fewest_rows)) in_runs += static_cast<std::size_t>(run.count);
            const std::vector<int>&here = element.rows[static_cast<std::size_t>(run.begin)],
                  &first = element.rows.front();
            for (std::size_t j = 1; j < here.size(); ++j)
                if (here[j] - here[0] != first[j] - first[0]) return false;
        }
    }
    return rows > 0 && 4 * in_runs >= 3 * rows;
}

ex of_row(const Element& element, const ex& formula, std::size_t row, const std::vector<GiNaC::symbol>& variables) {
    GiNaC::exmap values;
    for (std::size_t j = 0; j < element.x.size(); ++j)
        values[element.x[j]] = variables[static_cast<std::size_t>(element.rows[row][j])];
    for (std::size_t j = 0; j < element.a.size(); ++j) values[element.a[j]] = element.coefficients[row][j];
    return formula.subs(values, GiNaC::subs_options::no_pattern);
}

std::vector<std::pair<std::size_t, std::size_t>> pairs_of(const Element& element) {
    std::vector<std::pair<std::size_t, std::size_t>> pairs;
    for (std::size_t i = 0; i < element.x.size(); ++i) {
        if (element.target >= 0 && static_cast<std::size_t>(element.target) != i) continue;
        const ex slope = element.target >= 0 ? element.term : element.term.diff(element.x[i]);
        for (std::size_t j = 0; j < element.x.size(); ++j)
            if (!expanded(slope.diff(element.x[j])).is_zero()) pairs.emplace_back(i, j);
    }
    return pairs;
}

int row_reach(const Elements& elements) {
    int reach = 0;
    for (const Element& element : elements.repeated) {
        if (element.x.empty()) continue;
        for (const RowRun& run : runs_of(element)) {
            if (run.count < static_cast<int>(fewest_rows)) continue;
            const std::vector<int>& row = element.rows[static_cast<std::size_t>(run.begin)];
            const auto [least, most] = std::minmax_element(row.begin(), row.end());
            if (*least != 0) return -1;
            reach = std::max(reach, *most);
        }
    }
    return reach;
}

bool covers(const Element& element, int count) {
    const std::vector<RowRun> runs = runs_of(element);
    const auto [least, most] = std::minmax_element(element.rows.front().begin(), element.rows.front().end());
    return runs.size() == 1 && *least == 0 && *most <= 2 && *most + runs.front().count == count;
}

bool is_one_pass(const Elements& elements, const FixedEnds& fixed_ends, const std::vector<GiNaC::symbol>& q) {
    const auto rests = [&](const ex& term) {
        return std::none_of(q.begin(), q.end(), [&](const GiNaC::symbol& one) { return term.has(one); });
    };
    std::vector<const Element*> formulas;
    for (const Element& element : elements.repeated)
        if (!element.x.empty()) formulas.push_back(&element);
    return formulas.size() == 1 && covers(*formulas.front(), static_cast<int>(q.size())) && row_reach(elements) <= 1 &&
           elements.other_forces.empty() && std::all_of(fixed_ends.others.begin(), fixed_ends.others.end(), rests);
}

FixedEnds fixed_ends_of(const Elements& elements, const std::vector<GiNaC::symbol>& q) {
    FixedEnds fixed_ends;
    fixed_ends.others = elements.others;
    for (std::size_t number = 0; number < elements.repeated.size(); ++number) {
        const Element& element = elements.repeated[number];
        if (element.target >= 0 || element.x.size() != 2 || !element.a.empty()) continue;
        const std::vector<int>& row = element.rows.front();
        if (runs_of(element).size() != 1 || element.rows.size() + 1 != q.size()) continue;
        if (std::min(row[0], row[1]) != 0 || std::max(row[0], row[1]) != 1) continue;
        const std::size_t lower = row[0] == 0 ? 0 : 1, upper = 1 - lower;
        // Whether all terms of one coordinate alone are the formula at its fixed end, which is then taken away.
        const auto hangs = [&](const GiNaC::symbol& end, std::size_t slot) {
            std::vector<ex> rest;
            ex alone = 0;
            for (const ex& term : fixed_ends.others) {
                const bool is_alone = term.has(end) && std::all_of(q.begin(), q.end(), [&](const GiNaC::symbol& other) {
                                          return other == end || !term.has(other);
                                      });
                if (is_alone)
                    alone += term;
                else
                    rest.push_back(term);
            }
            GiNaC::exmap at_wall;
            at_wall[element.x[slot]] = end;
            at_wall[element.x[1 - slot]] = 0;
            try {
                if (alone.is_zero() || !expanded((alone - element.term.subs(at_wall)).diff(end)).is_zero())
                    return false;
            } catch (const std::exception&) {  // the formula has no value at zero
                return false;
            }
            fixed_ends.others = rest;
            return true;
        };
        fixed_ends.element = number;
        fixed_ends.before = hangs(q.front(), upper);
        fixed_ends.behind = hangs(q.back(), lower);
        if (fixed_ends.before || fixed_ends.behind) break;
    }
    return fixed_ends;
}

}  // namespace lobatto
