// SPDX-License-Identifier: GPL-2.0-or-later
// [forces] and [constraints] of a scene.
#include <fmt/format.h>

#include <algorithm>

#include "generator/formula/text/suggest.hpp"
#include "generator/scene/system_reader.hpp"

namespace lobatto {
namespace {

using GiNaC::ex;

constexpr std::size_t most_constraints = 4096, longest_equation = 1000;

}  // namespace

// x = ..., "x[3]" = ..., or "x[i]" = ... for all elements; or of a definition. Forces on one coordinate add up.
void SystemReader::read_forces() {
    const Entry* section = root_.find("forces");
    if (section == nullptr) return;
    for (const Entry& entry : table_of(source_, *section, "[forces] with lines such as x = \"-c*x'\"")) {
        const Scope in_key{&names_, "[forces]", true, {}};
        const Text key = text_of_key(entry);
        if (const auto name = names_.all.find(entry.key.substr(0, entry.key.find('[')));
            name != names_.all.end() && name->second.role == Name::Role::definition) {
            add_force_along(name->first, entry, {&names_, "the force on " + entry.key, true, {}});
            continue;
        }
        const Subject subject = parse_subject(source_, key, in_key);
        Scope scope{&names_, "the force on " + entry.key, true, {}};
        const Group& group = group_of(subject);
        long first = 1, last = static_cast<long>(group.count);
        if (!subject.indices.empty()) {
            scope.indices = {std::string(subject.indices.front().text)};
        } else if (subject.subscripted) {
            const Scope in_brackets{&names_, fmt::format("the index of {}", subject.name.text), true, {}};
            first = last = evaluate_whole(source_, subject.subscript, in_brackets);
            if (first < 1 || first > static_cast<long>(group.count))
                fail(subject.subscript.at.at,
                     fmt::format("there is no {0}[{1}]: the array has the elements {0}[1] to {0}[{2}]",
                                 subject.name.text, first, group.count));
        }
        const Syntax formula = parse_formula(source_, formula_of(source_, entry), scope);
        for (long k = first; k <= last; ++k) {
            Coordinate& coordinate = scene_.coordinates[group.first + static_cast<std::size_t>(k - 1)];
            const std::vector<long> indices(scope.indices.size(), k);
            if (coordinate.force.is_zero()) coordinate.force_at = entry.value.at;
            coordinate.force += evaluate(source_, formula, scope, indices).expression;
        }
    }
}

// (D66) By virtual work: what moves r by dr moves the coordinates by dq, so the force on q_k is F dr/dq_k. Of a rate w,
// F w is its power, and the force on q_k is F dw/dq_k'.
void SystemReader::add_force_along(const std::string& name, const Entry& entry, const Scope& scope) {
    const Text& key = keys_.emplace_back(text_of_key(entry));
    const Position at = key.at.front();
    const Scope in_key{&names_, fmt::format("the element {} (one line for each)", entry.key), true, {}};
    const Operand along = evaluate(source_, parse_formula(source_, key, in_key), in_key);
    const Operand force = evaluate(source_, parse_formula(source_, formula_of(source_, entry), scope), scope);
    const Arithmetic arithmetic(scope.formula, names_.work);
    if (along.velocities) {
        GiNaC::exmap at_rest;
        for (const Coordinate& coordinate : scene_.coordinates) at_rest[coordinate.velocity] = 0;
        const GiNaC::exset held = symbols_of(along.expression.subs(at_rest));
        for (const Coordinate& coordinate : scene_.coordinates)
            if (held.count(coordinate.position) > 0)
                fail(at, fmt::format("{} is no rate: it holds {} without a velocity; write two lines, one "
                                     "for its rate and one for the rest",
                                     name, coordinate.written));
    }
    bool acts = false;
    for (Coordinate& coordinate : scene_.coordinates) {
        const ex slope = along.expression.diff(along.velocities ? coordinate.velocity : coordinate.position);
        if (slope.is_zero()) continue;
        acts = true;
        if (along.velocities && holds_velocity(slope))
            fail(at, fmt::format("{} is not linear in the velocities, so no force acts along it", name));
        if (coordinate.force.is_zero()) coordinate.force_at = entry.value.at;
        try {
            coordinate.force += arithmetic.multiply(force, operand_of(slope)).expression;
        } catch (const Refusal& refusal) {
            fail(entry.value.at, refusal.what());
        }
    }
    if (!acts) fail(at, fmt::format("{} holds no coordinate, so no force acts along it", name));
}

bool SystemReader::holds_velocity(const ex& expression) const {
    const GiNaC::exset held = symbols_of(expression);
    return std::any_of(scene_.coordinates.begin(), scene_.coordinates.end(),
                       [&](const Coordinate& c) { return held.count(c.velocity) > 0; });
}

const SystemReader::Group& SystemReader::group_of(const Subject& subject) const {
    const std::string name(subject.name.text);
    const auto found =
        std::find_if(groups_.begin(), groups_.end(), [&](const Group& g) { return g.entry->key == name; });
    if (found == groups_.end()) {
        std::vector<std::string> coordinates, known;
        for (const Group& group : groups_) coordinates.push_back(group.entry->key);
        known = coordinates;
        for (const auto& [of, what] : names_.all)
            if (what.role == Name::Role::definition) known.push_back(of);
        fail(subject.name.at,
             fmt::format("'{}' in [forces] is neither a coordinate nor a definition; coordinates: {}.{}",
                         name.substr(0, 40), listing(coordinates), suggestion(name, known)));
    }
    if (found->array && !subject.subscripted)
        fail(subject.name.at,
             fmt::format("{0} is an array: write \"{0}[i]\" for the force on each of its elements, \"{0}[1]\" for "
                         "that on the first",
                         name));
    if (!found->array && subject.subscripted)
        fail(subject.name.at, fmt::format("{0} is a coordinate, not an array: write {0} without brackets", name));
    if (subject.indices.size() > 1)
        fail(subject.indices[1].at, fmt::format("an array has one index: write {}[i]", name));
    return *found;
}

// rod = "x^2 + y^2 = l^2", or "link[i]" = { equation = "...", count = "n" } for i = 1 ... n.
void SystemReader::read_constraints() {
    const Entry* section = root_.find("constraints");
    if (section == nullptr) return;
    const std::string example = "[constraints] with lines such as rod = \"x^2 + y^2 = l^2\"";
    const std::vector<Entry>& entries = table_of(source_, *section, example);
    if (entries.empty())
        fail(section->at, "there is no constraint; add rod = \"x^2 + y^2 = l^2\", or remove the section");
    for (const Entry& entry : entries) read_constraint(entry);
}

SystemReader::ArrayName SystemReader::declare_array(const Entry& entry, const std::string& what,
                                                    const std::string& section) {
    const Subject subject =
        parse_subject(source_, keys_.emplace_back(text_of_key(entry)), {&names_, section, true, {}});
    const std::string name(subject.name.text);
    declarations_.declare(name, subject.name.at, what);
    if (!subject.subscripted) return {name, std::nullopt};
    if (subject.indices.size() != 1)
        fail(entry.at, fmt::format("an array of {0}s has one index without another meaning: write \"{1}[i]\", and for "
                                   "pairs one line for each distance: {1}_1 of i and i + 1, {1}_2 of i and i + 2",
                                   what, name));
    return {name, std::string(subject.indices.front().text)};
}

long SystemReader::count_of(const Entry& entry, const Entry* count, const ArrayName& array, const std::string& what) {
    const auto& [name, index] = array;
    if (count != nullptr && !index)
        fail(count->at, fmt::format("a count makes an array: write \"{}[i]\" = {{ ..., count = ... }}", name));
    if (count == nullptr && index)
        fail(entry.at, fmt::format("how many {}s {}[i] are there? add count = 3", what, name));
    if (count == nullptr) return 1;
    const Scope scope{&names_, "count", false, {}};
    const long n = evaluate_whole(source_, parse_formula(source_, formula_of(source_, *count), scope), scope);
    if (n < 1 || n > static_cast<long>(most_constraints))
        fail(count->value.at, fmt::format("count is {}; at least 1 and at most {}", n, most_constraints));
    declarations_.declare_elements(name, entry.at, static_cast<std::size_t>(n));
    return n;
}

void SystemReader::read_constraint(const Entry& entry) {
    const ArrayName array = declare_array(entry, "constraint", "[constraints]");
    const auto& [name, index] = array;
    const Entry *equation = &entry, *number = nullptr;
    if (entry.value.kind == Value::Kind::table) {
        const Table table(source_, entry.value.entries, entry.at, "constraint " + name, keys_of_section("constraints"));
        equation = &table.get("equation", "for example equation = \"x^2 + y^2 = l^2\"");
        number = table.find("count");
    } else if (index) {
        fail(entry.at, fmt::format("an array of constraints has a count: write \"{}[i]\" = {{ equation = \"...\", "
                                   "count = 3 }}",
                                   name));
    }
    const long count = count_of(entry, number, array, "constraint");
    if (equation->value.kind != Value::Kind::text)
        fail(equation->value.at,
             fmt::format("a constraint must be an equation in quotes such as \"x^2 + y^2 = l^2\", not {}",
                         equation->value.kind_name()));
    Scope scope{&names_, "the constraint " + name, true, {}};
    if (index) scope.indices = {*index};
    const EventSyntax sides = parse_equation(source_, equation->value.text, scope);
    if (sides.direction != 0)
        fail(equation->value.at, "a constraint holds at all times: leave out 'rising' or 'falling'");
    for (long i = 1; i <= count; ++i) {
        const std::vector<long> indices(scope.indices.size(), i);
        const Operand value = evaluate(source_, sides.difference, scope, indices);
        Constraint constraint{index ? element_name(name, static_cast<std::size_t>(i)) : name};
        if (index) constraint.written = fmt::format("{}[{}]", name, i);
        constraint.text = collapsed(equation->value.text.value);
        if (constraint.text.size() > longest_equation)
            fail(equation->value.at,
                 fmt::format("an equation of {} bytes; at most {}", constraint.text.size(), longest_equation));
        constraint.value = value.expression;
        constraint.at = equation->value.at;
        if (value.velocities)
            fail(constraint.at, fmt::format("the constraint {} holds a velocity; a constraint is an equation of "
                                            "positions and the time (holonomic): x = r*th, not x' = r*th'",
                                            constraint.written));
        const GiNaC::exset held = symbols_of(constraint.value);
        if (std::none_of(scene_.coordinates.begin(), scene_.coordinates.end(),
                         [&](const Coordinate& c) { return held.count(c.position) > 0; }))
            fail(constraint.at,
                 fmt::format("the constraint {} holds no coordinate; mend it, or remove it", constraint.written));
        solve_constraint(constraint, sides, scope, indices);
        scene_.constraints.push_back(constraint);
    }
    require_freedom(entry.at, ", or they depend on one another: leave out one that follows from the others");
}

void SystemReader::require_freedom(Position at, const std::string& or_else) const {
    if (scene_.constraints.size() >= scene_.coordinates.size())
        fail(at, fmt::format("{} constraint{} on {} coordinate{} up to here: nothing is left that could move{}",
                             scene_.constraints.size(), scene_.constraints.size() == 1 ? "" : "s",
                             scene_.coordinates.size(), scene_.coordinates.size() == 1 ? "" : "s", or_else));
}

}  // namespace lobatto
