// SPDX-License-Identifier: GPL-2.0-or-later
// Events, stops and switches of a scene, the walls of [impacts], and what is kept of a motion: `keep`, `columns`.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <set>

#include "generator/formula/real.hpp"
#include "generator/formula/text/token.hpp"
#include "generator/scene/system_reader.hpp"

namespace lobatto {
namespace {

constexpr const char* no_energy_here = "events are of positions, velocities and the time, not of H and momenta";
constexpr std::size_t longest_event = 1000, most_events = 100, most_impacts = 1000;

}  // namespace

std::vector<Event> SystemReader::read_events(const Entry& entry, const std::string& key) {
    if (entry.value.kind == Value::Kind::text) return {read_event(entry.value, key)};
    if (entry.value.kind != Value::Kind::list)
        fail(entry.value.at,
             fmt::format("{} must be a list such as [\"x = 0 rising\"], not {}", key, entry.value.kind_name()));
    if (entry.value.items.size() > most_events)
        fail(entry.value.at, fmt::format("{} events; at most {}", entry.value.items.size(), most_events));
    std::vector<Event> events;
    for (const Value& item : entry.value.items) events.push_back(read_event(item, key));
    return events;
}

Event SystemReader::read_event(const Value& item, const std::string& key) {
    if (item.kind != Value::Kind::text)
        fail(item.at, fmt::format("{} must be a text such as \"x = 0 rising\", not {}",
                                  key == "stop" ? "a stop" : "an event", item.kind_name()));
    Event event;
    event.at = item.text.at.front();
    event.text = collapsed(item.text.value);
    if (event.text.size() > longest_event)
        fail(item.at, fmt::format("an event of {} bytes; at most {}", event.text.size(), longest_event));
    const Scope scope = scope_of(key == "stop" ? "the stop" : "the event", true);
    const EventSyntax crossing = parse_crossing(source_, item.text, scope);
    const Operand value = evaluate(source_, crossing.difference, scope);
    if (!value.moves && !value.velocities)
        fail(item.at, "this event never happens: it holds neither a coordinate nor the time");
    event.value = value.expression;
    event.direction = crossing.direction;
    return event;
}

// floor = { when = "y = 0 falling", restitution = "e" }, or "wall[i]" = { ..., count = 3 }.
void SystemReader::read_impacts() {
    const Entry* section = root_.find("impacts");
    if (section == nullptr) return;
    const std::string example = "[impacts] with lines such as floor = { when = \"y = 0 falling\", restitution = 1 }";
    const std::vector<Entry>& entries = table_of(source_, *section, example);
    if (entries.empty())
        fail(section->at,
             "there is no impact; add floor = { when = \"y = 0 falling\", restitution = 1 }, or remove the section");
    for (const Entry& entry : entries) read_impact(entry);
}

void SystemReader::read_impact(const Entry& entry) {
    const ArrayName array = declare_array(entry, "impact", "[impacts]");
    const auto& [name, index] = array;
    const Table table(source_, table_of(source_, entry, "{ when = \"y = 0 falling\", restitution = 1 }"), entry.at,
                      "impact " + name, keys_of_section("impacts"));
    const Entry& when = table.get("when", "for example when = \"y = 0 falling\"");
    const Entry *restitution = table.find("restitution"), *rest = table.find("rest"), *reset = table.find("reset"),
                *passes = table.find("passes");
    if (when.value.kind != Value::Kind::text)
        fail(when.value.at,
             fmt::format("when must be a text such as \"y = 0 falling\", not {}", when.value.kind_name()));
    if (restitution != nullptr && reset != nullptr) fail(reset->at, "an impact has a restitution or a reset; keep one");
    if (rest != nullptr && reset != nullptr) fail(rest->at, "a reset leaves the wall as it says; leave out rest");
    const long count = count_of(entry, table.find("count"), array, "impact");
    Scope scope = scope_of("the impact " + name, true);
    if (index) scope.indices = {*index};
    const EventSyntax crossing = parse_crossing(source_, when.value.text, scope);
    if (scene_.impacts.size() + static_cast<std::size_t>(count) > most_impacts)
        fail(entry.at, fmt::format("{} impacts up to here; at most {}",
                                   scene_.impacts.size() + static_cast<std::size_t>(count), most_impacts));
    for (long i = 1; i <= count; ++i) {
        const std::vector<long> indices(scope.indices.size(), i);
        const Operand value = evaluate(source_, crossing.difference, scope, indices);
        Impact impact{index ? element_name(name, static_cast<std::size_t>(i)) : name};
        if (index) impact.written = fmt::format("{}[{}]", name, i);
        impact.when = {fmt::format("{}: {}", impact.written, collapsed(when.value.text.value)), value.expression,
                       crossing.direction, when.value.at};
        if (impact.when.text.size() > longest_event)
            fail(when.value.at,
                 fmt::format("an impact of {} bytes; at most {}", impact.when.text.size(), longest_event));
        if (value.velocities)
            fail(when.value.at,
                 fmt::format("the wall {} holds a velocity; a wall is where positions are", impact.written));
        impact.passes = passes_through(impact, passes, reset);
        if (restitution != nullptr) {
            GiNaC::numeric e = 0;
            impact.restitution = read_formula(*restitution, scope_of("the restitution", false), &e);
            if (e.is_negative() || e > 1)
                fail(restitution->value.at,
                     fmt::format("the restitution is {:.6g}; it is the part of the normal velocity that an impact "
                                 "gives back, 0 to 1",
                                 e.to_double()));
            for (const GiNaC::ex& margin : {impact.restitution, 1 - impact.restitution})
                require(margin, true, fmt::format("the restitution of {} is not within 0 to 1", impact.written),
                        restitution->value.at);
        }
        if (rest != nullptr) {
            GiNaC::numeric speed = 0;
            const std::string complaint = fmt::format("rest of {} is negative; it is a speed", impact.written);
            impact.rest = read_formula(*rest, scope_of("rest", false), &speed);
            if (speed.is_negative()) fail(rest->value.at, complaint);
            require(impact.rest, true, complaint, rest->value.at);
        }
        if (reset != nullptr) read_reset(*reset, impact, scope, indices);
        scene_.impacts.push_back(impact);
    }
}

// Whether the motion goes on beyond the wall: where the scene says so, and at a time.
bool SystemReader::passes_through(const Impact& impact, const Entry* passes, const Entry* reset) const {
    const GiNaC::ex& g = impact.when.value;
    const std::string& name = impact.written;
    const bool is_asked = passes != nullptr && boolean_of(source_, *passes);
    const bool is_time = std::none_of(scene_.coordinates.begin(), scene_.coordinates.end(),
                                      [&](const Coordinate& c) { return g.has(c.position); });
    if (is_time && !g.has(scene_.time))
        fail(impact.when.at, fmt::format("{} never happens: it holds neither a coordinate nor the time", name));
    if (is_time && passes != nullptr && !is_asked)
        fail(passes->at, fmt::format("{} holds no coordinate, so the motion always passes it", name));
    if ((is_time || is_asked) && reset == nullptr)
        fail(impact.when.at, fmt::format("the motion passes {0}: say what changes there, as in reset = {{ \"{1}'\" = "
                                         "\"{1}' + 1\" }}",
                                         name, scene_.coordinates.front().written));
    if (!is_time && !is_asked && impact.when.direction == 0)
        fail(impact.when.at,
             fmt::format("from which side does the motion meet {}? add 'falling' where the left side minus the right "
                         "is above 0 before, 'rising' where it is below",
                         name));
    return is_time || is_asked;
}

// reset = { "x'" = "-x'" }: positions and velocities after the impact; those not named stay.
void SystemReader::read_reset(const Entry& entry, Impact& impact, const Scope& scope,
                              const std::vector<long>& indices) {
    for (const Coordinate& coordinate : scene_.coordinates) {
        impact.reset_position.push_back(coordinate.position);
        impact.reset_velocity.push_back(coordinate.velocity);
    }
    for (const Entry& line : table_of(source_, entry, "{ \"x'\" = \"-x'\" }")) {
        const bool is_rate = line.key.ends_with('\'');
        const std::string name = line.key.substr(0, line.key.size() - (is_rate ? 1 : 0));
        const auto found = std::find_if(scene_.coordinates.begin(), scene_.coordinates.end(),
                                        [&](const Coordinate& c) { return c.written == name; });
        if (found == scene_.coordinates.end())
            fail(line.at, fmt::format("a reset gives coordinates and their velocities new values, as in \"{0}'\" = "
                                      "\"-{0}'\"; there is no coordinate '{1}'",
                                      scene_.coordinates.front().written, name.substr(0, 40)));
        const auto k = static_cast<std::size_t>(found - scene_.coordinates.begin());
        (is_rate ? impact.reset_velocity : impact.reset_position)[k] =
            evaluate(source_, parse_formula(source_, formula_of(source_, line), scope), scope, indices).expression;
    }
    bool changes = false;
    for (std::size_t k = 0; k < scene_.coordinates.size(); ++k)
        changes = changes || !impact.reset_position[k].is_equal(scene_.coordinates[k].position) ||
                  !impact.reset_velocity[k].is_equal(scene_.coordinates[k].velocity);
    if (!changes)
        fail(entry.at,
             fmt::format("this reset changes nothing; say what follows an impact, as in {{ \"{0}'\" = \"-{0}'\" }}",
                         scene_.coordinates.front().written));
}

// What a kernel computes of the scene.
GiNaC::exset SystemReader::symbols_of_kernel() const {
    GiNaC::exset all;
    const auto add = [&](const GiNaC::ex& formula) {
        for (const GiNaC::ex& symbol : symbols_of(formula)) all.insert(symbol);
    };
    add(scene_.lagrangian);
    for (const Coordinate& coordinate : scene_.coordinates) add(coordinate.force);
    for (const Constraint& constraint : scene_.constraints) {
        add(constraint.value);
        add(constraint.solution);
    }
    if (scene_.clock) add(scene_.clock->rate);
    for (const Impact& impact : scene_.impacts) {
        add(impact.restitution);
        add(impact.rest);
        for (const auto* formulas : {&impact.reset_position, &impact.reset_velocity})
            for (const GiNaC::ex& formula : *formulas) add(formula);
    }
    for (const Event& event : scene_.watched()) add(event.value);
    for (const Reduction& kept : scene_.outputs.kept) add(kept.crossing.value);
    return all;
}

// The sides of those that a kernel knows become parameters, beside which nothing of the scene is called the same.
void SystemReader::add_switches() {
    GiNaC::exset held = symbols_of_kernel();
    for (auto one = names_.switches.rbegin(); one != names_.switches.rend(); ++one)  // it may hold those before it
        if (held.count(one->side) > 0)
            for (const GiNaC::ex& symbol : symbols_of(one->value)) held.insert(symbol);
    GiNaC::exmap start = parameter_values_;
    for (std::size_t k = 0; k < scene_.coordinates.size(); ++k) {
        const bool is_known = scene_.start == Start::velocity;
        start[scene_.coordinates[k].position] = scene_.initial_position[k].subs(parameter_values_);
        start[scene_.coordinates[k].velocity] =
            is_known ? scene_.initial_rate[k].subs(parameter_values_) : GiNaC::ex(0);
    }
    start[scene_.time] = 0;
    for (Switch& one : names_.switches) {
        if (held.count(one.side) == 0) {
            scene_.seen_switches.push_back(one);
            continue;
        }
        const std::string name = one.side.get_name();
        declarations_.declare(name, one.at, "side of " + one.text);
        const GiNaC::numeric value = value_in_range(source_, one.at, one.value, one.text, start);
        const int side = value.is_positive() ? 1 : -1;
        start[one.side] = side;
        scene_.parameters.push_back({name, "", side, one.side, name, false, true});
        const auto holds = [&](const auto symbol) {
            return std::any_of(scene_.coordinates.begin(), scene_.coordinates.end(),
                               [&](const Coordinate& c) { return one.value.has(c.*symbol); });
        };
        one.refracts = one.may_jump && scene_.lagrangian.has(one.side) && holds(&Coordinate::position) &&
                       !holds(&Coordinate::velocity);
        scene_.switches.push_back(one);
    }
}

namespace {

// Part of a text.
Text piece_of(const Text& text, std::size_t begin, std::size_t end) {
    return {
        text.value.substr(begin, end - begin),
        {text.at.begin() + static_cast<std::ptrdiff_t>(begin), text.at.begin() + static_cast<std::ptrdiff_t>(end) + 1}};
}

// At its commas, but for those within brackets; without the blanks around.
std::vector<Text> pieces_of(const Text& text) {
    std::vector<Text> pieces;
    std::size_t begin = 0;
    int depth = 0;
    for (std::size_t i = 0; i <= text.value.size(); ++i) {
        const char c = i < text.value.size() ? text.value[i] : ',';
        depth += c == '(' || c == '[' ? 1 : c == ')' || c == ']' ? -1 : 0;
        if (c != ',' || (depth > 0 && i < text.value.size())) continue;
        std::size_t end = i;
        while (begin < end && std::isspace(static_cast<unsigned char>(text.value[begin]))) ++begin;
        while (begin < end && std::isspace(static_cast<unsigned char>(text.value[end - 1]))) --end;
        pieces.push_back(piece_of(text, begin, end));
        begin = i + 1;
    }
    return pieces;
}

// Where the bracket at `open` closes; the end of the text where it does not.
std::size_t closing_of(const std::string& text, std::size_t open) {
    int depth = 0;
    for (std::size_t i = open; i < text.size(); ++i) {
        depth += text[i] == '(' ? 1 : text[i] == ')' ? -1 : 0;
        if (depth == 0) return i;
    }
    return text.size();
}

const std::vector<std::pair<std::string, Reduction::Of>> reductions = {
    {"first", Reduction::Of::first}, {"count", Reduction::Of::count}, {"max", Reduction::Of::max},
    {"min", Reduction::Of::min},     {"mean", Reduction::Of::mean},   {"last", Reduction::Of::last}};

}  // namespace

void SystemReader::name_energy_and_momenta() {
    const auto add = [&](const std::string& name, const std::vector<GiNaC::ex>& symbols, bool array = false) {
        if (names_.all.count(name) == 0) names_.add_parameter(name, symbols, array);
    };
    add("H", {scene_.outputs.energy_of_kept});
    std::map<std::string, std::vector<GiNaC::ex>> of_arrays;
    for (const Coordinate& coordinate : scene_.coordinates) {
        const GiNaC::symbol momentum("p_" + coordinate.name);
        scene_.outputs.momenta_of_kept.push_back(momentum);
        add(momentum.get_name(), {momentum});
        if (const std::string array = coordinate.array(); array != coordinate.written)
            of_arrays["p_" + array].emplace_back(momentum);
    }
    for (const auto& [name, momenta] : of_arrays) add(name, momenta, true);
}

void SystemReader::read_columns(const Entry& entry) {
    std::string definitions;
    if (const Entry* section = root_.find("definitions"))
        for (const Entry& line : section->value.entries) definitions += "; " + line.key + " = " + line.value.text.value;
    std::set<std::string> taken = {"H", scene_.has_time ? scene_.time.get_name() : "t"};
    for (const Constraint& constraint : scene_.constraints) taken.insert("lambda_" + constraint.name);
    for (const Coordinate& coordinate : scene_.coordinates)
        for (const char* prefix : {"", "p_"}) taken.insert(prefix + coordinate.name);
    for (const Column& column : scene_.outputs.columns) taken.insert(column.name);
    names_.records = false;  // where a formula has no value the cell is nan, and the motion goes on
    for (const Entry& line : table_of(source_, entry, "columns = { v = \"x'\" }, names with formulas")) {
        if (!is_identifier(line.key))
            fail(line.at, fmt::format("a column has a name of letters, digits and _, such as v, not {}", line.key));
        if (!taken.insert(line.key).second)
            fail(line.at, fmt::format("the table has a column {} already; choose another name", line.key));
        const Scope scope = scope_of("the column " + line.key, true);
        const Operand value = evaluate(source_, parse_formula(source_, formula_of(source_, line), scope), scope);
        const std::string& text = formula_of(source_, line).value;
        scene_.outputs.columns.push_back({line.key, "", value.expression, collapsed(text + definitions)});
    }
    names_.records = true;
}

void SystemReader::read_kept(const std::vector<std::string>& given) {
    const Entry* section = root_.find("output");
    const Entry* entry = nullptr;
    if (section != nullptr)
        for (const Entry& line : section->value.entries)
            if (line.key == "keep") entry = &line;
    if (entry == nullptr && given.empty()) return;
    name_energy_and_momenta();
    for (const std::string& option : given) {
        const Source source("--keep", option);
        Text text{option, {}};
        for (int column = 1; std::ssize(text.at) <= std::ssize(option); ++column) text.at.push_back({1, column});
        for (const Text& piece : pieces_of(text)) read_kept(source, piece);
    }
    if (entry == nullptr || !given.empty()) return;
    if (entry->value.kind == Value::Kind::text) return read_kept(source_, entry->value.text);
    if (entry->value.kind != Value::Kind::list)
        fail(entry->value.at,
             fmt::format("keep must be a text or a list such as [\"first(x = 0)\", \"max(x)\"], not {}",
                         entry->value.kind_name()));
    for (const Value& item : entry->value.items) {
        if (item.kind != Value::Kind::text)
            fail(item.at, fmt::format("what is kept must be a text such as \"max(x)\", not {}", item.kind_name()));
        read_kept(source_, item.text);
    }
}

// first(b = pi), count(y = 0 rising), or max, min, mean, last of a formula.
void SystemReader::read_kept(const Source& source, const Text& text) {
    const std::size_t open = text.value.find('(');
    const std::string name = text.value.substr(0, open == std::string::npos ? text.value.size() : open);
    const auto found = std::find_if(reductions.begin(), reductions.end(),
                                    [&](const auto& reduction) { return reduction.first == name; });
    if (found == reductions.end() || open == std::string::npos || closing_of(text.value, open) + 1 != text.value.size())
        source.fail(text.at.front(),
                    "what is kept of a trajectory is first(x = 0) or count(x = 0 rising) of an event, or max(x), "
                    "min(x), mean(x), last(x) of a formula");
    const Text inner = piece_of(text, open + 1, text.value.size() - 1);
    Reduction kept{collapsed(text.value), found->second};
    if (kept.text.size() > longest_event)
        source.fail(text.at.front(), fmt::format("{} bytes; at most {}", kept.text.size(), longest_event));
    const Scope scope = scope_of("what is kept", true);
    if (kept.of == Reduction::Of::first || kept.of == Reduction::Of::count) {
        const EventSyntax crossing = parse_crossing(source, inner, scope);
        const Operand value = evaluate(source, crossing.difference, scope);
        kept.crossing = {collapsed(inner.value), value.expression, crossing.direction, text.at.front()};
        for (const GiNaC::symbol& symbol : scene_.outputs.momenta_of_kept)
            if (value.expression.has(symbol)) source.fail(inner.at.front(), no_energy_here);
        if (value.expression.has(scene_.outputs.energy_of_kept)) source.fail(inner.at.front(), no_energy_here);
        if (!value.moves && !value.velocities)
            source.fail(inner.at.front(), "this event never happens: it holds neither a coordinate nor the time");
    } else {
        kept.value = evaluate(source, parse_formula(source, inner, scope), scope).expression;
    }
    scene_.outputs.kept.push_back(kept);
}

}  // namespace lobatto
