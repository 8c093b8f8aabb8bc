// SPDX-License-Identifier: GPL-2.0-or-later
// Names and formulas of [parameters], [coordinates], [definitions] and [forces], and the Lagrangian.
#include "generator/scene/system_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

#include "generator/formula/real.hpp"
#include "generator/formula/suggest.hpp"
#include "generator/formula/token.hpp"
#include "generator/scene/file/document.hpp"

namespace lobatto {
namespace {

constexpr std::size_t most_coordinates = 4096, most_parameters = 10000;
constexpr std::size_t longest_unit = 40, most_constraints = 4096, longest_equation = 1000;

// A key with brackets, "x[i]", stands in quotes, which are not a part of it.
Text text_of_key(const Entry& entry) {
    const bool bare = is_identifier(entry.key);
    Text text{entry.key, {}};
    Position at{entry.at.line, entry.at.column + (bare ? 0 : 1)};
    for (std::size_t i = 0; i <= entry.key.size(); ++i, ++at.column) text.at.push_back(at);
    return text;
}

GiNaC::exset symbols_of(const GiNaC::ex& expression) {
    GiNaC::exset symbols;
    for (auto part = expression.preorder_begin(); part != expression.preorder_end(); ++part)
        if (GiNaC::is_a<GiNaC::symbol>(*part)) symbols.insert(*part);
    return symbols;
}

}  // namespace

// On one line, without comments.
std::string collapsed(const std::string& text) {
    std::string result;
    bool comment = false;
    for (const char c : text) {
        comment = c != '\n' && (comment || c == '#');
        const bool blank = comment || c == ' ' || c == '\t' || c == '\n' || c == '\r';
        if (!blank) result += c;
        if (blank && !result.empty() && result.back() != ' ') result += ' ';
    }
    if (result.ends_with(' ')) result.pop_back();
    return result;
}

void SystemReader::read() {
    read_time();
    read_parameters();
    read_coordinates();
    read_bodies_and_definitions();
    read_lagrangian();
    read_forces();
    read_constraints();
    read_impacts();
    names_.records = false;
    read_places();
    names_.records = true;
    read_initial_values();
}

void SystemReader::read_time() {
    const Entry* entry = root_.find("time");
    if (entry == nullptr) return;
    if (entry->value.kind != Value::Kind::text)
        fail(entry->value.at,
             fmt::format("time must be a name in quotes, as in time = \"t\", not {}", entry->value.kind_name()));
    const std::string& name = entry->value.text.value;
    declarations_.declare(name, entry->value.at, "time");
    scene_.has_time = true;
    scene_.time = GiNaC::symbol(name);
    names_.add_time(name, scene_.time);
}

// Inputs are parameters whose values the host program may change before each step.
void SystemReader::read_parameters() {
    read_parameters("parameters", "parameter");
    read_parameters("inputs", "input");
    for (const Parameter& parameter : scene_.parameters)
        parameter_values_[parameter.symbol] = real_value(parameter.value);
}

void SystemReader::read_parameters(const std::string& name, const std::string& what) {
    const Entry* section = root_.find(name);
    if (section == nullptr) return;
    const bool are_inputs = what == "input";
    const std::vector<Entry>& entries =
        table_of(source_, *section, fmt::format("[{}] with lines such as {} = 1", name, are_inputs ? "tau" : "m"));
    std::size_t count = scene_.parameters.size() + scene_.constants.size();
    for (const Entry& entry : entries) {
        declarations_.declare(entry.key, entry.at, what);
        const Entry* value = &entry;
        std::string unit;
        bool constant = false;
        if (entry.value.kind == Value::Kind::table) {
            const Table table(source_, entry.value.entries, entry.at, what + " " + entry.key, keys_of_section(name));
            value = &table.get("value", "a number, for example value = 1");
            if (const Entry* given = table.find("unit")) unit = label_of(source_, *given, longest_unit);
            if (const Entry* flag = are_inputs ? nullptr : table.find("constant"))
                constant = boolean_of(source_, *flag);
        }
        const bool array = value->value.kind == Value::Kind::list;
        const std::vector<Parameter> elements =
            array ? read_elements(entry, *value) : std::vector<Parameter>{read_parameter(entry, *value)};
        count += elements.size();
        if (count > most_parameters)
            fail(entry.at, fmt::format("{} parameters up to here; at most {}", count, most_parameters));
        std::vector<GiNaC::ex> values;
        for (const Parameter& parameter : elements) {
            values.push_back(constant ? parameter.value : GiNaC::ex(parameter.symbol));
            Parameter& added = (constant ? scene_.constants : scene_.parameters).emplace_back(parameter);
            added.unit = unit;
            added.is_input = are_inputs;
        }
        if (are_inputs)
            names_.add_input(entry.key, values, array);
        else
            names_.add_parameter(entry.key, values, array);
    }
}

Parameter SystemReader::read_parameter(const Entry& entry, const Entry& value) {
    Parameter parameter{entry.key, "", 0, GiNaC::symbol(entry.key)};
    parameter.value = read_formula(value, {nullptr, "the value of " + entry.key, false, {}});
    return parameter;
}

// The elements m[1] ... m[n] of a list.
std::vector<Parameter> SystemReader::read_elements(const Entry& entry, const Entry& list) {
    const std::vector<Value>& items = list.value.items;
    if (items.empty()) fail(list.value.at, fmt::format("the list of {} is empty", entry.key));
    declarations_.declare_elements(entry.key, entry.at, items.size());
    std::vector<Parameter> elements;
    for (const Value& item : items) {
        const std::size_t k = elements.size() + 1;
        const std::string name = element_name(entry.key, k), written = fmt::format("{}[{}]", entry.key, k);
        const Entry line{written, item.at, item};
        elements.push_back({name, "", 0, GiNaC::symbol(name), written});
        elements.back().value = read_formula(line, {nullptr, "the value of " + written, false, {}});
    }
    return elements;
}

void SystemReader::read_coordinates() {
    const std::string example = "[coordinates] with lines such as q = { position = 1, velocity = 0 }";
    if (root_.find("coordinates") == nullptr && root_.find("bodies") != nullptr) return;
    const Entry& section = root_.get("coordinates", example);
    const std::vector<Entry>& entries = table_of(source_, section, example);
    if (entries.empty())
        fail(section.at, "a scene needs a coordinate; add a line such as q = { position = 1, velocity = 0 }");
    for (const Entry& entry : entries) read_coordinate(entry);
}

void SystemReader::read_coordinate(const Entry& entry) {
    declarations_.declare(entry.key, entry.at, "coordinate");
    const std::string example_line = entry.key + " = { position = 1, velocity = 0 }";
    const Table table(source_, table_of(source_, entry, example_line), entry.at, "coordinate " + entry.key,
                      keys_of_section("coordinates"));
    std::string unit;
    if (const Entry* given = table.find("unit")) unit = label_of(source_, *given, longest_unit);
    Group group{&entry, scene_.coordinates.size(), 1, false, nullptr, nullptr};
    read_initial_entries(group, table);
    read_count(group, table.find("count"));
    if (group.array) declarations_.declare_elements(entry.key, entry.at, group.count);
    if (group.first + group.count > most_coordinates)
        fail(entry.at,
             fmt::format("{} coordinates up to here; at most {}", group.first + group.count, most_coordinates));
    std::vector<GiNaC::symbol> positions, velocities;
    for (std::size_t k = 1; k <= group.count; ++k) {
        Coordinate coordinate{group.array ? element_name(entry.key, k) : entry.key, unit, {}, {}};
        coordinate.position = GiNaC::symbol(coordinate.name);
        coordinate.velocity = GiNaC::symbol(coordinate.name + "'");
        if (group.array) coordinate.written = fmt::format("{}[{}]", entry.key, k);
        positions.push_back(coordinate.position);
        velocities.push_back(coordinate.velocity);
        scene_.coordinates.push_back(coordinate);
    }
    names_.add_coordinate(entry.key, positions, velocities, group.array);
    groups_.push_back(group);
}

// An array has a count, or lists, all of one length.
void SystemReader::read_count(Group& group, const Entry* count) {
    const std::string& name = group.entry->key;
    if (count != nullptr) {
        const Scope scope{&names_, "count", false, {}};
        const long n = evaluate_whole(source_, parse_formula(source_, formula_of(source_, *count), scope), scope);
        if (n < 1 || n > static_cast<long>(most_coordinates))
            fail(count->value.at, fmt::format("count is {}; at least 1 and at most {}", n, most_coordinates));
        group.count = static_cast<std::size_t>(n);
        group.array = true;
    }
    for (const Entry* list : {group.position, group.rate}) {
        if (list == nullptr || list->value.kind != Value::Kind::list) continue;
        const std::size_t length = list->value.items.size();
        if (length == 0) fail(list->value.at, fmt::format("the list of {} is empty", list->key));
        if (group.array && length != group.count)
            fail(list->value.at,
                 fmt::format("{} has {} values, but {} has {} elements", list->key, length, name, group.count));
        group.count = length;
        group.array = true;
    }
}

// The trajectory has a column x and a column p_x for a coordinate x.
void SystemReader::refuse_names_of_momenta() const {
    std::map<std::string, std::string> coordinates;
    for (const Coordinate& coordinate : scene_.coordinates) coordinates[coordinate.name] = coordinate.written;
    for (const Group& group : groups_)
        for (std::size_t k = group.first; k < group.first + group.count; ++k) {
            const std::string& name = scene_.coordinates[k].name;
            const auto owner = name.starts_with("p_") ? coordinates.find(name.substr(2)) : coordinates.end();
            if (owner != coordinates.end())
                fail(group.entry->at, fmt::format("'{}' is the momentum of coordinate {} in the trajectory; give "
                                                  "the coordinate another name",
                                                  name, owner->second));
        }
}

void SystemReader::read_initial_entries(Group& group, const Table& table) {
    const std::string& name = group.entry->key;
    const Entry* velocity = table.find("velocity");
    const Entry* momentum = table.find("momentum");
    const bool is_empty = table.find("position") == nullptr && velocity == nullptr && momentum == nullptr;
    if (is_empty && root_.find("constraints") != nullptr) return;  // which may be an equation for it
    group.position = &table.get("position", "its initial position, for example position = 1");
    if (velocity == nullptr && momentum == nullptr)
        fail(table.at(),
             fmt::format("coordinate {} has no initial velocity or momentum; add velocity = 0 or momentum = 0", name));
    if (velocity != nullptr && momentum != nullptr)
        fail(momentum->at, fmt::format("coordinate {} has both a velocity and a momentum; keep one", name));
    const Start start = velocity != nullptr ? Start::velocity : Start::momentum;
    if (std::all_of(groups_.begin(), groups_.end(), [](const Group& before) { return before.rate == nullptr; }))
        scene_.start = start;
    if (start != scene_.start)
        fail((velocity != nullptr ? velocity : momentum)->at,
             fmt::format("coordinate {} starts with a {} and the ones before with a {}; give the same for all", name,
                         start == Start::velocity ? "velocity" : "momentum",
                         start == Start::velocity ? "momentum" : "velocity"));
    group.rate = velocity != nullptr ? velocity : momentum;
}

// First all names, then the formulas: they may refer to one another in any order.
void SystemReader::read_definitions() {
    const Entry* section = root_.find("definitions");
    if (section == nullptr) return;
    const std::vector<Entry>& entries =
        table_of(source_, *section, "[definitions] with lines such as r = \"sqrt(x^2 + y^2)\"");
    std::vector<Definition*> definitions;
    for (const Entry& entry : entries) {
        const Subject subject =
            parse_subject(source_, keys_.emplace_back(text_of_key(entry)), {&names_, "[definitions]", true, {}});
        if (subject.subscripted && subject.indices.empty())
            fail(subject.subscript.at.at,
                 "the indices of a definition are names without another meaning, as in \"r[i,j]\"");
        const std::string name(subject.name.text);
        declarations_.declare(name, subject.name.at, "definition");
        const auto definition = std::make_shared<Definition>();
        definition->label = "the definition " + name;
        for (const Token& index : subject.indices) definition->indices.emplace_back(index.text);
        Name& added = names_.all[name];
        added.role = Name::Role::definition;
        added.definition = definition;
        definitions.push_back(definition.get());
        definition_lines_.emplace_back(&added, &entry);
    }
    for (std::size_t k = 0; k < entries.size(); ++k)
        definitions[k]->formula = parse_formula(source_, formula_of(source_, entries[k]),
                                                {&names_, definitions[k]->label, true, definitions[k]->indices});
}

// Bodies bring their kinetic energy.
void SystemReader::read_lagrangian() {
    scene_.lagrangian = kinetic_energy_;
    scene_.lagrangian_text = kinetic_text_;
    if (root_.find("lagrangian") == nullptr && !kinetic_text_.empty()) {
        scene_.lagrangian_at = root_.find("bodies")->at;
        return;
    }
    const Entry& entry = root_.get("lagrangian", "lagrangian = \"...\", the kinetic minus the potential energy");
    if (entry.value.kind != Value::Kind::text)
        fail(entry.value.at,
             fmt::format("the Lagrangian must be a formula in quotes, not {}", entry.value.kind_name()));
    scene_.lagrangian_at = entry.value.text.at.front();
    scene_.lagrangian += parse_expression(source_, entry.value.text, {&names_, "the Lagrangian", true, {}});
    scene_.lagrangian_text += (kinetic_text_.empty() ? "" : " + ") + collapsed(entry.value.text.value);
}

void SystemReader::require_velocities() const {
    const Entry* const entry = root_.find("lagrangian");
    if (entry == nullptr) return;
    const GiNaC::exset symbols = symbols_of(scene_.lagrangian);
    for (const Coordinate& coordinate : scene_.coordinates)
        if (symbols.count(coordinate.velocity) == 0)
            fail(entry->value.at,
                 fmt::format("the Lagrangian is degenerate: the velocity {0}' of coordinate {0} does not occur in it; "
                             "add the kinetic energy of {0}, or remove the coordinate{1}",
                             coordinate.written,
                             scene_.not_eliminated.empty()
                                 ? ""
                                 : ". Equations would give it some, but not all are eliminated. " +
                                       scene_.not_eliminated.front()));
}

// x = ..., "x[3]" = ..., or "x[i]" = ... for all elements; forces on one coordinate add up.
void SystemReader::read_forces() {
    const Entry* section = root_.find("forces");
    if (section == nullptr) return;
    for (const Entry& entry : table_of(source_, *section, "[forces] with lines such as x = \"-c*x'\"")) {
        const Scope in_key{&names_, "[forces]", true, {}};
        const Text key = text_of_key(entry);
        const Subject subject = parse_subject(source_, key, in_key);
        const Group& group = group_of(subject);
        Scope scope{&names_, "the force on " + entry.key, true, {}};
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
        fail(subject.subscript.at.at,
             fmt::format("an array of {}s has one index without another meaning: write \"{}[i]\"", what, name));
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
    const EventSyntax sides = parse_crossing(source_, equation->value.text, scope);
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
                                            "positions and the time (holonomic)",
                                            constraint.written));
        const GiNaC::exset held = symbols_of(constraint.value);
        if (std::none_of(scene_.coordinates.begin(), scene_.coordinates.end(),
                         [&](const Coordinate& c) { return held.count(c.position) > 0; }))
            fail(constraint.at,
                 fmt::format("the constraint {} holds no coordinate; mend it, or remove it", constraint.written));
        solve_constraint(constraint, sides, scope, indices);
        scene_.constraints.push_back(constraint);
    }
    if (scene_.constraints.size() >= scene_.coordinates.size())
        fail(entry.at, fmt::format("{} constraints on {} coordinates up to here: nothing is left that could move",
                                   scene_.constraints.size(), scene_.coordinates.size()));
}

const SystemReader::Group& SystemReader::group_of(const Subject& subject) const {
    const std::string name(subject.name.text);
    const auto found =
        std::find_if(groups_.begin(), groups_.end(), [&](const Group& g) { return g.entry->key == name; });
    if (found == groups_.end()) {
        std::vector<std::string> known;
        for (const Group& group : groups_) known.push_back(group.entry->key);
        fail(subject.name.at, fmt::format("unknown coordinate '{}' in [forces]; coordinates: {}.{}", name.substr(0, 40),
                                          listing(known), suggestion(name, known)));
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

// Those values that the Lagrangian and the forces asked for.
void SystemReader::read_places() {
    const auto x = names_.all.find("x"), y = names_.all.find("y");
    if (x == names_.all.end() || y == names_.all.end() || !x->second.definition || !y->second.definition) return;
    if (x->second.definition->indices.size() > 1) return;
    const auto& others = y->second.definition->values;
    for (const auto& [subscript, value] : x->second.definition->values)
        if (const auto other = others.find(subscript); other != others.end() && value.complete &&
                                                       other->second.complete && !value.value.velocities &&
                                                       !other->second.value.velocities)
            scene_.places.emplace_back(value.value.expression, other->second.value.expression);
}

void SystemReader::read_initial_values() {
    const std::string rate = scene_.start == Start::velocity ? "velocity" : "momentum";
    std::set<std::size_t> missing;
    for (const Group& group : groups_) {
        for (std::size_t k = 0; k < group.starts.size(); ++k) {
            scene_.initial_position.push_back(group.starts[k].first);
            scene_.initial_rate.push_back(group.starts[k].second);
            scene_.coordinates[group.first + k].rate_at = group.entry->at;
        }
        if (!group.starts.empty()) continue;
        if (group.rate == nullptr) {  // as its equation says, below
            scene_.initial_position.resize(group.first + group.count);
            scene_.initial_rate.resize(group.first + group.count);
            for (std::size_t k = 0; k < group.count; ++k) missing.insert(group.first + k);
            continue;
        }
        read_values(group, *group.position, "position", scene_.initial_position);
        read_values(group, *group.rate, rate, scene_.initial_rate);
        for (std::size_t k = 0; k < group.count; ++k) {
            const Value& given = group.rate->value;
            scene_.coordinates[group.first + k].rate_at =
                given.kind == Value::Kind::list ? given.items[k].at : given.at;
        }
    }
    follow_equations(missing);
}

// One formula for each element, or one for all with the number i of the element.
void SystemReader::read_values(const Group& group, const Entry& entry, const std::string& what,
                               std::vector<GiNaC::ex>& values) {
    const auto label = [&](std::size_t k) {
        return fmt::format("the initial {} of {}", what, scene_.coordinates[group.first + k].written);
    };
    if (entry.value.kind == Value::Kind::list) {
        for (std::size_t k = 0; k < group.count; ++k) {
            const Entry item{fmt::format("{} {}", what, k + 1), entry.value.items[k].at, entry.value.items[k]};
            values.push_back(read_formula(item, {&names_, label(k), false, {}}));
        }
        return;
    }
    if (!group.array) {
        values.push_back(read_formula(entry, {&names_, label(0), false, {}}));
        return;
    }
    if (entry.value.kind == Value::Kind::text && names_.all.count("i") > 0)
        fail(entry.value.at, fmt::format("in the initial {} of an array, i is the number of the element; rename what "
                                         "else is called i",
                                         what));
    Scope scope{&names_, fmt::format("the initial {} of {}[i]", what, group.entry->key), false, {"i"}};
    const Syntax formula = parse_formula(source_, formula_of(source_, entry), scope);
    for (std::size_t k = 0; k < group.count; ++k) {
        values.push_back(evaluate(source_, formula, scope, {static_cast<long>(k + 1)}).expression);
        value_in_range(source_, entry.value.at, values.back(), label(k), parameter_values_);
    }
}

void SystemReader::refuse_unused() const {
    for (const auto& [name, entry] : definition_lines_)
        if (!name->used)
            fail(entry->at, fmt::format("definition {} occurs in no formula; use it or remove it", entry->key));
    for (const auto& [name, what] : {std::pair{"parameters", "parameter"}, std::pair{"inputs", "input"}}) {
        const Entry* section = root_.find(name);
        if (section == nullptr) continue;
        for (const Entry& entry : section->value.entries)
            if (!names_.all.at(entry.key).used)
                fail(entry.at, fmt::format("{} {} occurs in no formula; use it or remove it", what, entry.key));
    }
}

// A formula whose value with the parameters of the scene must be a real number that a double can hold.
GiNaC::ex SystemReader::read_formula(const Entry& entry, const Scope& scope, GiNaC::numeric* value) {
    const GiNaC::ex expression = parse_expression(source_, formula_of(source_, entry), scope);
    const GiNaC::numeric number = value_in_range(source_, entry.value.at, expression, scope.formula, parameter_values_);
    if (value != nullptr) *value = number;
    return expression;
}

}  // namespace lobatto
