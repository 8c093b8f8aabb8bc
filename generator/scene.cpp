// SPDX-License-Identifier: GPL-2.0-or-later
// The keys of a scene file and what they mean: a document in, a Scene out. Every key is described in
// docs/scene_format.md.
#include "generator/scene.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "generator/document.hpp"
#include "generator/expression.hpp"
#include "generator/real.hpp"
#include "generator/table.hpp"
#include "generator/token.hpp"

namespace lobatto {
namespace {

constexpr std::size_t most_coordinates = 64, most_parameters = 1000;
constexpr std::size_t longest_name = 64, longest_title = 200, longest_unit = 40;
constexpr long long most_steps = 9'000'000'000'000'000;  // step numbers are exact as doubles up to 2^53

constexpr std::pair<std::string_view, std::string_view> reserved_names[] = {
    {"pi", "the number 3.14159..."}, {"h", "the time step"}, {"t", "the time"}, {"H", "the energy"}};

// The values of the run-time parameters: as given, or else those of the scene.
GiNaC::exmap values_of(const std::vector<Parameter>& parameters, const std::vector<GiNaC::ex>& given) {
    GiNaC::exmap values;
    for (std::size_t k = 0; k < parameters.size(); ++k)
        values[parameters[k].symbol] = real_value(given.empty() ? parameters[k].value : given[k]);
    return values;
}

class Reader {
public:
    explicit Reader(const Source& source)
        : source_(source),
          document_(read_document(source)),
          root_(source, document_.entries, {1, 1}, "a scene",
                {"title", "lagrangian", "coordinates", "parameters", "method", "run", "output"}) {}

    // Parameters before coordinates before formulas: each formula needs the names in it.
    Scene run() {
        scene_.source = source_;
        scene_.path = source_.path();
        scene_.name = identifier_of_file(source_.path());
        scene_.title = scene_.name;
        if (const Entry* title = root_.find("title")) scene_.title = label_of(source_, *title, longest_title);
        read_parameters();
        read_coordinates();
        read_lagrangian();
        read_initial_values();
        read_method();
        read_run();
        read_output();
        refuse_unused();
        return std::move(scene_);
    }

private:
    struct Initial {
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

    // A new name of a coordinate or parameter.
    void declare(const Entry& entry, const std::string& what) {
        const std::string& name = entry.key;
        if (!is_identifier(name) || name.find("__") != std::string::npos)
            fail(entry.at, fmt::format("'{}' cannot be the name of a {}: names are letters, digits and single "
                                       "underscores, and begin with a letter",
                                       name.substr(0, 40), what));
        if (name.size() > longest_name)
            fail(entry.at, fmt::format("a name of {} letters; at most {}", name.size(), longest_name));
        if (find_function(name) != nullptr)
            fail(entry.at, fmt::format("'{}' is the name of a function; give the {} another name", name, what));
        for (const auto& [reserved, meaning] : reserved_names)
            if (name == reserved)
                fail(entry.at, fmt::format("'{}' is {}; give the {} another name", name, meaning, what));
        if (names_.count(name) > 0)
            fail(entry.at, fmt::format("'{}' is both a parameter and a coordinate; rename one", name));
    }

    void read_parameters() {
        const Entry* section = root_.find("parameters");
        if (section == nullptr) return;
        const std::vector<Entry>& entries = table_of(source_, *section, "[parameters] with lines such as m = 1");
        if (entries.size() > most_parameters)
            fail(section->at, fmt::format("{} parameters; at most {}", entries.size(), most_parameters));
        for (const Entry& entry : entries) {
            declare(entry, "parameter");
            const Entry* value = &entry;
            Parameter parameter{entry.key, "", 0, GiNaC::symbol(entry.key)};
            bool constant = false;
            if (entry.value.kind == Value::Kind::table) {
                const Table table(source_, entry.value.entries, entry.at, "parameter " + entry.key,
                                  {"value", "unit", "constant"});
                value = &table.get("value", "a number, for example value = 1");
                if (const Entry* unit = table.find("unit")) parameter.unit = label_of(source_, *unit, longest_unit);
                if (const Entry* flag = table.find("constant")) constant = boolean_of(source_, *flag);
            }
            parameter.value = read_formula(*value, {{}, "the value of " + entry.key, false, false});
            names_[entry.key] = {constant ? parameter.value : GiNaC::ex(parameter.symbol), Name::Role::parameter};
            (constant ? scene_.constants : scene_.parameters).push_back(parameter);
        }
        parameter_values_ = values_of(scene_.parameters, {});
    }

    void read_coordinates() {
        const std::string example = "[coordinates] with lines such as q = { position = 1, velocity = 0 }";
        const Entry& section = root_.get("coordinates", example);
        const std::vector<Entry>& entries = table_of(source_, section, example);
        if (entries.empty())
            fail(section.at, "a scene needs a coordinate; add a line such as q = { position = 1, velocity = 0 }");
        if (entries.size() > most_coordinates)
            fail(section.at, fmt::format("{} coordinates; at most {}", entries.size(), most_coordinates));
        for (const Entry& entry : entries) {
            declare(entry, "coordinate");
            const std::string example_line = entry.key + " = { position = 1, velocity = 0 }";
            const Table table(source_, table_of(source_, entry, example_line), entry.at, "coordinate " + entry.key,
                              {"unit", "position", "velocity", "momentum"});
            Coordinate coordinate{entry.key, "", GiNaC::symbol(entry.key), GiNaC::symbol(entry.key + "'")};
            if (const Entry* unit = table.find("unit")) coordinate.unit = label_of(source_, *unit, longest_unit);
            read_initial_entries(entry, table);
            names_[entry.key] = {coordinate.position, Name::Role::position};
            names_[entry.key + "'"] = {coordinate.velocity, Name::Role::velocity};
            scene_.coordinates.push_back(coordinate);
        }
        refuse_names_of_momenta(entries);
    }

    // The trajectory has a column x and a column p_x for a coordinate x.
    void refuse_names_of_momenta(const std::vector<Entry>& coordinates) const {
        for (const Entry& entry : coordinates) {
            if (!entry.key.starts_with("p_")) continue;
            const auto owner = names_.find(entry.key.substr(2));
            if (owner != names_.end() && owner->second.role == Name::Role::position)
                fail(entry.at, fmt::format("'{}' is the momentum of coordinate {} in the trajectory; give the "
                                           "coordinate another name",
                                           entry.key, owner->first));
        }
    }

    void read_initial_entries(const Entry& coordinate, const Table& table) {
        const Entry& position = table.get("position", "its initial position, for example position = 1");
        const Entry* velocity = table.find("velocity");
        const Entry* momentum = table.find("momentum");
        if (velocity == nullptr && momentum == nullptr)
            fail(table.at(),
                 fmt::format("coordinate {} has no initial velocity or momentum; add velocity = 0 or momentum = 0",
                             coordinate.key));
        if (velocity != nullptr && momentum != nullptr)
            fail(momentum->at,
                 fmt::format("coordinate {} has both a velocity and a momentum; keep one", coordinate.key));
        const Start start = velocity != nullptr ? Start::velocity : Start::momentum;
        if (initial_.empty()) scene_.start = start;
        if (start != scene_.start)
            fail((velocity != nullptr ? velocity : momentum)->at,
                 fmt::format("coordinate {} starts with a {} and the ones before with a {}; give the same for all",
                             coordinate.key, start == Start::velocity ? "velocity" : "momentum",
                             start == Start::velocity ? "momentum" : "velocity"));
        initial_.push_back({&position, velocity != nullptr ? velocity : momentum});
    }

    void read_lagrangian() {
        const Entry& entry = root_.get("lagrangian", "lagrangian = \"...\", the kinetic minus the potential energy");
        if (entry.value.kind != Value::Kind::text)
            fail(entry.value.at,
                 fmt::format("the Lagrangian must be a formula in quotes, not {}", entry.value.kind_name()));
        scene_.lagrangian_at = entry.value.text.at.front();
        scene_.lagrangian = parse_expression(source_, entry.value.text, {names_, "the Lagrangian", true, true}, &used_);
        scene_.lagrangian_text = collapsed(entry.value.text.value);
        for (const Coordinate& coordinate : scene_.coordinates)
            if (!scene_.lagrangian.has(coordinate.velocity))
                fail(entry.value.at,
                     fmt::format(
                         "the Lagrangian is degenerate: the velocity {0}' of coordinate {0} does not occur in it; "
                         "add the kinetic energy of {0}, or remove the coordinate",
                         coordinate.name));
    }

    void read_initial_values() {
        for (std::size_t k = 0; k < initial_.size(); ++k) {
            const std::string& name = scene_.coordinates[k].name;
            scene_.coordinates[k].rate_at = initial_[k].rate->value.at;
            const std::string rate = scene_.start == Start::velocity ? "velocity" : "momentum";
            scene_.initial_position.push_back(
                read_formula(*initial_[k].position, of_parameters("the initial position of " + name)));
            scene_.initial_rate.push_back(
                read_formula(*initial_[k].rate, of_parameters(fmt::format("the initial {} of {}", rate, name))));
        }
    }

    void read_method() {
        const Entry* section = root_.find("method");
        if (section == nullptr) return;
        const Table table(source_, table_of(source_, *section, "[method] with a line points = 4"), section->at,
                          "[method]", {"family", "points"});
        if (const Entry* family = table.find("family")) {
            const Value& value = family->value;
            if (value.kind != Value::Kind::text || value.text.value != "lobatto")
                fail(value.at, "unknown family; there is \"lobatto\"");
        }
        if (const Entry* points = table.find("points"))
            scene_.method.points =
                static_cast<int>(integer_of(source_, *points, 2, 5, "there is Lobatto with 2 to 5 points"));
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
                          "[output]", {"every", "energy"});
        if (const Entry* every = table.find("every"))
            scene_.outputs.every = static_cast<long>(
                integer_of(source_, *every, 1, most_steps,
                           "at least 1 and at most 9e15: states whose step is a multiple of it are kept"));
        if (const Entry* energy = table.find("energy")) scene_.outputs.energy = boolean_of(source_, *energy);
    }

    void refuse_unused() const {
        const Entry* section = root_.find("parameters");
        if (section == nullptr) return;
        for (const Entry& entry : section->value.entries)
            if (used_.count(entry.key) == 0)
                fail(entry.at, fmt::format("parameter {0} occurs in no formula; use it or remove it", entry.key));
    }

    Scope of_parameters(const std::string& formula) const { return {names_, formula, false, false}; }

    // A formula whose value with the parameters of the scene must be a real number that a double can hold.
    GiNaC::ex read_formula(const Entry& entry, const Scope& scope, GiNaC::numeric* value = nullptr) {
        const GiNaC::ex expression = parse_expression(source_, formula_of(source_, entry), scope, &used_);
        const GiNaC::numeric number =
            value_in_range(source_, entry.value.at, expression, scope.formula, parameter_values_);
        if (value != nullptr) *value = number;
        return expression;
    }

    static std::string collapsed(const std::string& text) {
        std::string result;
        for (const char c : text) {
            const bool blank = c == ' ' || c == '\t' || c == '\n' || c == '\r';
            if (!blank) result += c;
            if (blank && !result.empty() && result.back() != ' ') result += ' ';
        }
        if (result.ends_with(' ')) result.pop_back();
        return result;
    }

    static std::string shown(const GiNaC::numeric& number) { return fmt::format("{:.6g}", number.to_double()); }

    const Source& source_;
    const Value document_;
    const Table root_;
    Scene scene_;
    std::map<std::string, Name> names_;
    std::map<std::string, bool> used_;
    GiNaC::exmap parameter_values_;
    std::vector<Initial> initial_;
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

Scene read_scene(const std::string& path) {
    return read_scene(Source::read(path));
}

Scene read_scene(const Source& source) {
    return Reader(source).run();
}

}  // namespace lobatto
