// SPDX-License-Identifier: GPL-2.0-or-later
// [parameters], [inputs] and [definitions] of a scene, and its Lagrangian.
#include "generator/scene/system_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <set>

#include "generator/formula/real.hpp"
#include "generator/formula/text/token.hpp"
#include "generator/scene/file/document.hpp"

namespace lobatto {
namespace {

constexpr std::size_t most_parameters = 10000;

}  // namespace

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
    find_inputs_without_speed();
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
                 "the indices of a definition are names without another meaning, as in \"r[i,j]\"; single ones are "
                 "definitions of their own, such as r1 and r2");
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
    std::set<std::string> used;
    for (const auto& [name, known] : names_.all)
        if (known.used) used.insert(name);
    for (std::size_t k = 0; k < entries.size(); ++k)
        definitions[k]->formula = parse_formula(source_, formula_of(source_, entries[k]),
                                                {&names_, definitions[k]->label, true, definitions[k]->indices});
    for (auto& [name, known] : names_.all)
        known.used = used.contains(name);  // what definitions hold: see refuse_unused
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
    const std::string written = collapsed(entry.value.text.value);
    const bool subtracts = !kinetic_text_.empty() && written.starts_with('-');
    scene_.lagrangian_text += subtracts ? " - " + written.substr(1) : (kinetic_text_.empty() ? "" : " + ") + written;
}

void SystemReader::require_velocities() const {
    const Entry* const entry = root_.find("lagrangian");
    if (entry == nullptr) return;
    const GiNaC::exset symbols = symbols_of(scene_.lagrangian);
    for (const Coordinate& coordinate : scene_.coordinates)
        if (symbols.count(coordinate.velocity) == 0) {
            for (const Constraint& constraint : scene_.constraints)
                if (constraint.value.has(coordinate.position) && !constraint.solved_for)
                    fail(constraint.at,
                         fmt::format("the Lagrangian is degenerate: the velocity {0}' of coordinate {0} does not occur "
                                     "in it; write this constraint as {0} = ..., then {0} follows from the others",
                                     coordinate.written));
            fail(entry->value.at,
                 fmt::format("the Lagrangian is degenerate: the velocity {0}' of coordinate {0} does not occur in it; "
                             "add the kinetic energy of {0}, or remove the coordinate; if {0} is a multiplier, write "
                             "its condition "
                             "as an equation under [constraints]{1}",
                             coordinate.written,
                             scene_.not_eliminated.empty()
                                 ? ""
                                 : ". Equations would give it some, but not all are eliminated. " +
                                       scene_.not_eliminated.front()));
        }
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

void SystemReader::refuse_unused() const {
    // Formulas use names, and what the definitions hold that they use.
    std::set<const Name*> used;
    std::function<void(const Syntax&)> use_names_in;
    const auto use = [&](const Name& name) {
        if (used.insert(&name).second && name.definition) use_names_in(name.definition->formula);
    };
    use_names_in = [&](const Syntax& formula) {
        if (formula.name != nullptr) use(*formula.name);
        for (const Syntax& operand : formula.operands) use_names_in(operand);
    };
    for (const auto& [name, known] : names_.all)
        if (known.used) use(known);
    for (const auto& [name, entry] : definition_lines_)
        if (!used.contains(name))
            fail(entry->at, fmt::format("definition {} occurs in no formula of the scene; use it in one, such as keep "
                                        "in [output], or remove it",
                                        entry->key));
    for (const auto& [name, what] : {std::pair{"parameters", "parameter"}, std::pair{"inputs", "input"}}) {
        const Entry* section = root_.find(name);
        if (section == nullptr) continue;
        for (const Entry& entry : section->value.entries)
            if (!used.contains(&names_.all.at(entry.key)))
                fail(entry.at, fmt::format("{} {} occurs in no formula; use it or remove it", what, entry.key));
    }
}

// Inputs in definitions whose rates were asked for, without the time: these rates do not know that they move.
void SystemReader::find_inputs_without_speed() {
    for (const Parameter& input : scene_.parameters) {
        if (!input.is_input) continue;
        for (const auto& [name, known] : names_.all) {
            if (!known.definition) continue;
            for (const auto& [indices, value] : known.definition->values)
                if (value.rate && value.value.expression.has(input.symbol) &&
                    !value.value.expression.has(scene_.time)) {
                    scene_.inputs_without_speed.push_back(fmt::format("{} in {}'", input.written, name));
                    break;
                }
        }
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
