// SPDX-License-Identifier: GPL-2.0-or-later
// The keys of a scene file and what they mean: a document in, a Scene out. Every key is described in
// docs/scene_format.md.
#include "generator/scene.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <deque>
#include <filesystem>

#include "generator/declarations.hpp"
#include "generator/document.hpp"
#include "generator/expression.hpp"
#include "generator/real.hpp"
#include "generator/suggest.hpp"
#include "generator/table.hpp"
#include "generator/token.hpp"

namespace lobatto {
namespace {

constexpr std::size_t most_coordinates = 4096, most_parameters = 10000, most_events = 100;
constexpr std::size_t longest_title = 200, longest_unit = 40, longest_event = 1000;
constexpr long long most_steps = 9'000'000'000'000'000;  // step numbers are exact as doubles up to 2^53

// The values of the run-time parameters: as given, or else those of the scene.
GiNaC::exmap values_of(const std::vector<Parameter>& parameters, const std::vector<GiNaC::ex>& given) {
    GiNaC::exmap values;
    for (std::size_t k = 0; k < parameters.size(); ++k)
        values[parameters[k].symbol] = real_value(given.empty() ? parameters[k].value : given[k]);
    return values;
}

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

std::string shown(const GiNaC::numeric& number) {
    return fmt::format("{:.6g}", number.to_double());
}

// A key with brackets, "x[i]", stands in quotes, which are not a part of it.
Text text_of_key(const Entry& entry) {
    const bool bare = is_identifier(entry.key);
    Text text{entry.key, {}};
    Position at{entry.at.line, entry.at.column + (bare ? 0 : 1)};
    for (std::size_t i = 0; i <= entry.key.size(); ++i, ++at.column) text.at.push_back(at);
    return text;
}

class Reader {
public:
    explicit Reader(const Source& source)
        : source_(source),
          document_(read_document(source)),
          root_(source, document_.entries, {1, 1}, "a scene",
                {"title", "time", "lagrangian", "coordinates", "parameters", "definitions", "forces", "method", "run",
                 "output"}),
          declarations_(source),
          names_(declarations_.names) {}

    // All names before the formulas they occur in.
    Scene run() {
        scene_.source = source_;
        scene_.path = source_.path();
        scene_.name = identifier_of_file(source_.path());
        scene_.title = scene_.name;
        if (const Entry* title = root_.find("title")) scene_.title = label_of(source_, *title, longest_title);
        read_time();
        read_parameters();
        read_coordinates();
        read_definitions();
        read_lagrangian();
        read_forces();
        read_places();
        read_initial_values();
        read_method();
        read_run();
        read_output();
        refuse_unused();
        return std::move(scene_);
    }

private:
    // The lines of [coordinates]: one coordinate, or an array of them.
    struct Group {
        const Entry* entry;
        std::size_t first, count;
        bool array;
        const Entry* position;
        const Entry* rate;
    };

    [[noreturn]] void fail(Position at, const std::string& message) const { source_.fail(at, message); }

    static std::string identifier_of_file(const std::string& path) {
        std::string name;
        for (const char c : std::filesystem::path(path).stem().string()) {
            const bool fits = is_identifier(std::string("x") + c);
            if (fits && !(c == '_' && name.ends_with('_'))) name += c;
            if (!fits && !name.ends_with('_')) name += '_';
        }
        return is_identifier(name) ? name : "scene_" + name;
    }

    void read_time() {
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

    void read_parameters() {
        const Entry* section = root_.find("parameters");
        if (section == nullptr) return;
        const std::vector<Entry>& entries = table_of(source_, *section, "[parameters] with lines such as m = 1");
        std::size_t count = 0;
        for (const Entry& entry : entries) {
            declarations_.declare(entry.key, entry.at, "parameter");
            const Entry* value = &entry;
            std::string unit;
            bool constant = false;
            if (entry.value.kind == Value::Kind::table) {
                const Table table(source_, entry.value.entries, entry.at, "parameter " + entry.key,
                                  {"value", "unit", "constant"});
                value = &table.get("value", "a number, for example value = 1");
                if (const Entry* given = table.find("unit")) unit = label_of(source_, *given, longest_unit);
                if (const Entry* flag = table.find("constant")) constant = boolean_of(source_, *flag);
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
                (constant ? scene_.constants : scene_.parameters).push_back(parameter);
                (constant ? scene_.constants : scene_.parameters).back().unit = unit;
            }
            names_.add_parameter(entry.key, values, array);
        }
        parameter_values_ = values_of(scene_.parameters, {});
    }

    Parameter read_parameter(const Entry& entry, const Entry& value) {
        Parameter parameter{entry.key, "", 0, GiNaC::symbol(entry.key)};
        parameter.value = read_formula(value, {nullptr, "the value of " + entry.key, false, {}});
        return parameter;
    }

    // The elements m[1] ... m[n] of a list.
    std::vector<Parameter> read_elements(const Entry& entry, const Entry& list) {
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

    void read_coordinates() {
        const std::string example = "[coordinates] with lines such as q = { position = 1, velocity = 0 }";
        const Entry& section = root_.get("coordinates", example);
        const std::vector<Entry>& entries = table_of(source_, section, example);
        if (entries.empty())
            fail(section.at, "a scene needs a coordinate; add a line such as q = { position = 1, velocity = 0 }");
        for (const Entry& entry : entries) read_coordinate(entry);
        refuse_names_of_momenta();
    }

    void read_coordinate(const Entry& entry) {
        declarations_.declare(entry.key, entry.at, "coordinate");
        const std::string example_line = entry.key + " = { position = 1, velocity = 0 }";
        const Table table(source_, table_of(source_, entry, example_line), entry.at, "coordinate " + entry.key,
                          {"count", "unit", "position", "velocity", "momentum"});
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
    void read_count(Group& group, const Entry* count) {
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
            if (list->value.kind != Value::Kind::list) continue;
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
    void refuse_names_of_momenta() const {
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

    void read_initial_entries(Group& group, const Table& table) {
        const std::string& name = group.entry->key;
        group.position = &table.get("position", "its initial position, for example position = 1");
        const Entry* velocity = table.find("velocity");
        const Entry* momentum = table.find("momentum");
        if (velocity == nullptr && momentum == nullptr)
            fail(table.at(),
                 fmt::format("coordinate {} has no initial velocity or momentum; add velocity = 0 or momentum = 0",
                             name));
        if (velocity != nullptr && momentum != nullptr)
            fail(momentum->at, fmt::format("coordinate {} has both a velocity and a momentum; keep one", name));
        const Start start = velocity != nullptr ? Start::velocity : Start::momentum;
        if (groups_.empty()) scene_.start = start;
        if (start != scene_.start)
            fail((velocity != nullptr ? velocity : momentum)->at,
                 fmt::format("coordinate {} starts with a {} and the ones before with a {}; give the same for all",
                             name, start == Start::velocity ? "velocity" : "momentum",
                             start == Start::velocity ? "momentum" : "velocity"));
        group.rate = velocity != nullptr ? velocity : momentum;
    }

    // First all names, then the formulas: they may refer to one another in any order.
    void read_definitions() {
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

    void read_lagrangian() {
        const Entry& entry = root_.get("lagrangian", "lagrangian = \"...\", the kinetic minus the potential energy");
        if (entry.value.kind != Value::Kind::text)
            fail(entry.value.at,
                 fmt::format("the Lagrangian must be a formula in quotes, not {}", entry.value.kind_name()));
        scene_.lagrangian_at = entry.value.text.at.front();
        scene_.lagrangian = parse_expression(source_, entry.value.text, {&names_, "the Lagrangian", true, {}});
        scene_.lagrangian_text = collapsed(entry.value.text.value);
        const GiNaC::exset symbols = symbols_of(scene_.lagrangian);
        for (const Coordinate& coordinate : scene_.coordinates)
            if (symbols.count(coordinate.velocity) == 0)
                fail(entry.value.at,
                     fmt::format(
                         "the Lagrangian is degenerate: the velocity {0}' of coordinate {0} does not occur in it; "
                         "add the kinetic energy of {0}, or remove the coordinate",
                         coordinate.written));
    }

    static GiNaC::exset symbols_of(const GiNaC::ex& expression) {
        GiNaC::exset symbols;
        for (auto part = expression.preorder_begin(); part != expression.preorder_end(); ++part)
            if (GiNaC::is_a<GiNaC::symbol>(*part)) symbols.insert(*part);
        return symbols;
    }

    // x = ..., "x[3]" = ..., or "x[i]" = ... for all elements; forces on one coordinate add up.
    void read_forces() {
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

    const Group& group_of(const Subject& subject) const {
        const std::string name(subject.name.text);
        const auto found =
            std::find_if(groups_.begin(), groups_.end(), [&](const Group& g) { return g.entry->key == name; });
        if (found == groups_.end()) {
            std::vector<std::string> known;
            for (const Group& group : groups_) known.push_back(group.entry->key);
            fail(subject.name.at, fmt::format("unknown coordinate '{}' in [forces]; coordinates: {}.{}",
                                              name.substr(0, 40), listing(known), suggestion(name, known)));
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

    // The values that the Lagrangian and the forces asked for.
    void read_places() {
        const auto x = names_.all.find("x"), y = names_.all.find("y");
        if (x == names_.all.end() || y == names_.all.end() || !x->second.definition || !y->second.definition) return;
        if (x->second.definition->indices.size() > 1) return;
        for (const auto& [subscript, value] : x->second.definition->values)
            if (const auto other = y->second.definition->values.find(subscript);
                other != y->second.definition->values.end() && value.complete && other->second.complete &&
                !value.value.velocities && !other->second.value.velocities)
                scene_.places.emplace_back(value.value.expression, other->second.value.expression);
    }

    void read_initial_values() {
        const std::string rate = scene_.start == Start::velocity ? "velocity" : "momentum";
        for (const Group& group : groups_) {
            read_values(group, *group.position, "position", scene_.initial_position);
            read_values(group, *group.rate, rate, scene_.initial_rate);
            for (std::size_t k = 0; k < group.count; ++k)
                scene_.coordinates[group.first + k].rate_at =
                    group.rate->value.kind == Value::Kind::list ? group.rate->value.items[k].at : group.rate->value.at;
        }
    }

    // One formula for each element, or one for all with the number i of the element.
    void read_values(const Group& group, const Entry& entry, const std::string& what, std::vector<GiNaC::ex>& values) {
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
            fail(entry.value.at,
                 fmt::format("in the initial {} of an array, i is the number of the element; rename what "
                             "else is called i",
                             what));
        Scope scope{&names_, fmt::format("the initial {} of {}[i]", what, group.entry->key), false, {"i"}};
        const Syntax formula = parse_formula(source_, formula_of(source_, entry), scope);
        for (std::size_t k = 0; k < group.count; ++k) {
            values.push_back(evaluate(source_, formula, scope, {static_cast<long>(k + 1)}).expression);
            value_in_range(source_, entry.value.at, values.back(), label(k), parameter_values_);
        }
    }

    void read_method() {
        const Entry* section = root_.find("method");
        if (section == nullptr) return;
        const Table table(source_, table_of(source_, *section, "[method] with a line points = 4"), section->at,
                          "[method]", {"family", "points", "stages"});
        const Entry *family = table.find("family"), *points = table.find("points"), *stages = table.find("stages");
        if (family != nullptr) {
            const Value& value = family->value;
            const bool text = value.kind == Value::Kind::text;
            if (!text || (value.text.value != "lobatto" && value.text.value != "gauss"))
                fail(value.at, "unknown family; there are \"lobatto\" and \"gauss\"");
            if (value.text.value == "gauss") scene_.method = {Family::gauss, 3};
        }
        const bool gauss = scene_.method.family == Family::gauss;
        if (gauss && points != nullptr) fail(points->at, "Gauss has stages, not points: write stages = 3");
        if (!gauss && stages != nullptr)
            fail(stages->at, "Lobatto has points, not stages: write points = 4, or add family = \"gauss\"");
        if (points != nullptr)
            scene_.method.points =
                static_cast<int>(integer_of(source_, *points, 2, 12, "there is Lobatto with 2 to 12 points"));
        if (stages != nullptr)
            scene_.method.points =
                static_cast<int>(integer_of(source_, *stages, 1, 10, "there is Gauss with 1 to 10 stages"));
    }

    void read_run() {
        const std::string example = "[run] with lines step = 0.05 and until = 10";
        const Entry& section = root_.get("run", example);
        const Table table(source_, table_of(source_, section, example), section.at, "[run]",
                          {"step", "steps_per_period", "period", "until"});
        const Entry* step = table.find("step");
        const Entry* per_period = table.find("steps_per_period");
        const Entry* period = table.find("period");
        if (step == nullptr && per_period == nullptr)
            fail(table.at(), "[run] has no step; add step = 0.05, or steps_per_period and period");
        if (step != nullptr && per_period != nullptr)
            fail(per_period->at, "[run] has both step and steps_per_period; keep one");
        if (step != nullptr && period != nullptr)
            fail(period->at, "period goes with steps_per_period; with step it has no meaning");
        const Entry& length =
            step != nullptr
                ? *step
                : table.get("period", "the period that has these steps, for example period = \"2*pi/omega\"");
        const Scope scope = of_parameters(step != nullptr ? "the step" : "the period");
        GiNaC::numeric h = 0;
        scene_.run.step = read_formula(length, scope, &h);
        if (!h.is_positive())
            fail(length.value.at, fmt::format("{} is {}; it must be positive", scope.formula, shown(h)));
        if (per_period != nullptr) {
            const long long count = integer_of(source_, *per_period, 1, most_steps, "at least 1 and at most 9e15");
            scene_.run.step = scene_.run.step / GiNaC::numeric(static_cast<long>(count));
            h = h / GiNaC::numeric(static_cast<long>(count));
        }
        const Entry& until = table.get("until", "the end time, for example until = 10");
        GiNaC::numeric end = 0;
        scene_.run.until = read_formula(until, of_parameters("the end time"), &end);
        if (end.is_negative())
            fail(until.value.at,
                 fmt::format("the end time is {}; it must not be negative: a run starts at time 0", shown(end)));
        if (end > h * GiNaC::numeric(static_cast<long>(most_steps)))
            fail(until.value.at,
                 fmt::format("the run has {} steps; at most 9e15: make until smaller or the step larger",
                             shown(end / h)));
    }

    void read_output() {
        const Entry* section = root_.find("output");
        if (section == nullptr) return;
        const Table table(source_, table_of(source_, *section, "[output] with a line every = 1"), section->at,
                          "[output]", {"every", "energy", "momenta", "tangent", "dense", "events"});
        Outputs& outputs = scene_.outputs;
        if (const Entry* every = table.find("every"))
            outputs.every = static_cast<long>(
                integer_of(source_, *every, 1, most_steps,
                           "at least 1 and at most 9e15: states whose step is a multiple of it are kept"));
        if (const Entry* energy = table.find("energy")) outputs.energy = boolean_of(source_, *energy);
        if (const Entry* momenta = table.find("momenta")) outputs.momenta = boolean_of(source_, *momenta);
        if (const Entry* tangent = table.find("tangent")) outputs.tangent = boolean_of(source_, *tangent);
        if (const Entry* dense = table.find("dense")) {
            outputs.dense =
                static_cast<int>(integer_of(source_, *dense, 0, 100, "0 to 100 states between two steps are computed"));
            if (outputs.dense > 0 && outputs.every > 1)
                fail(dense->at, "dense fills the time between two steps, so all steps are kept: remove every");
        }
        if (const Entry* events = table.find("events")) read_events(*events);
    }

    void read_events(const Entry& entry) {
        if (entry.value.kind != Value::Kind::list)
            fail(entry.value.at,
                 fmt::format("events must be a list such as [\"x = 0 rising\"], not {}", entry.value.kind_name()));
        if (entry.value.items.size() > most_events)
            fail(entry.value.at, fmt::format("{} events; at most {}", entry.value.items.size(), most_events));
        for (const Value& item : entry.value.items) {
            if (item.kind != Value::Kind::text)
                fail(item.at,
                     fmt::format("an event must be a text such as \"x = 0 rising\", not {}", item.kind_name()));
            Event event;
            event.at = item.text.at.front();
            event.text = collapsed(item.text.value);
            if (event.text.size() > longest_event)
                fail(item.at, fmt::format("an event of {} bytes; at most {}", event.text.size(), longest_event));
            const Scope scope{&names_, "the event", true, {}};
            const Crossing crossing = parse_crossing(source_, item.text, scope);
            const Operand value = evaluate(source_, crossing.difference, scope);
            if (!value.moves && !value.velocities)
                fail(item.at, "this event never happens: it holds neither a coordinate nor the time");
            event.value = value.expression;
            event.direction = crossing.direction;
            scene_.outputs.events.push_back(event);
        }
    }

    void refuse_unused() const {
        for (const auto& [name, entry] : definition_lines_)
            if (!name->used)
                fail(entry->at, fmt::format("definition {} occurs in no formula; use it or remove it", entry->key));
        const Entry* section = root_.find("parameters");
        if (section == nullptr) return;
        for (const Entry& entry : section->value.entries)
            if (!names_.all.at(entry.key).used)
                fail(entry.at, fmt::format("parameter {0} occurs in no formula; use it or remove it", entry.key));
    }

    Scope of_parameters(const std::string& formula) { return {&names_, formula, false, {}}; }

    // A formula whose value with the parameters of the scene must be a real number that a double can hold.
    GiNaC::ex read_formula(const Entry& entry, const Scope& scope, GiNaC::numeric* value = nullptr) {
        const GiNaC::ex expression = parse_expression(source_, formula_of(source_, entry), scope);
        const GiNaC::numeric number =
            value_in_range(source_, entry.value.at, expression, scope.formula, parameter_values_);
        if (value != nullptr) *value = number;
        return expression;
    }

    const Source& source_;
    const Value document_;
    const Table root_;
    Scene scene_;
    Declarations declarations_;
    Names& names_;
    std::deque<Text> keys_;  // of definitions: their indices are read from them
    std::vector<std::pair<const Name*, const Entry*>> definition_lines_;
    GiNaC::exmap parameter_values_;
    std::vector<Group> groups_;
};

}  // namespace

std::string Method::name() const {
    return family == Family::lobatto ? fmt::format("Lobatto, {} points", points)
                                     : fmt::format("Gauss, {} {}", points, points == 1 ? "stage" : "stages");
}

GiNaC::numeric Scene::evaluate(const GiNaC::ex& expression, const std::string& what,
                               const std::vector<GiNaC::ex>& given) const {
    try {
        return real_value(expression, values_of(parameters, given));
    } catch (const NoValue& error) {
        throw InputError(fmt::format("{}: {} has no finite real value: {}", printable(path), what, error.what()));
    }
}

Names parameter_names(const Scene& scene) {
    struct Values {
        std::vector<GiNaC::ex> values;
        bool array = false;
    };
    std::map<std::string, Values> all;
    const auto add = [&](const Parameter& parameter, const GiNaC::ex& value) {
        const std::size_t bracket = parameter.written.find('[');
        Values& values = all[parameter.written.substr(0, bracket)];
        values.values.push_back(value);
        values.array = bracket != std::string::npos;
    };
    for (const Parameter& parameter : scene.parameters) add(parameter, parameter.symbol);
    for (const Parameter& constant : scene.constants) add(constant, constant.value);
    Names names;
    for (const auto& [name, values] : all) names.add_parameter(name, values.values, values.array);
    return names;
}

Scene read_scene(const std::string& path) {
    return read_scene(Source::read(path));
}

Scene read_scene(const Source& source) {
    return Reader(source).run();
}

}  // namespace lobatto
