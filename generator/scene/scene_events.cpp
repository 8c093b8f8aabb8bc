// SPDX-License-Identifier: GPL-2.0-or-later
// Events and stops of a scene, and the walls of [impacts].
#include <fmt/format.h>

#include <algorithm>

#include "generator/formula/real.hpp"
#include "generator/formula/token.hpp"
#include "generator/scene/scene_system.hpp"

namespace lobatto {
namespace {

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
                      "impact " + name, {"when", "count", "restitution", "reset"});
    const Entry& when = table.get("when", "for example when = \"y = 0 falling\"");
    const Entry *restitution = table.find("restitution"), *reset = table.find("reset");
    if (when.value.kind != Value::Kind::text)
        fail(when.value.at, fmt::format("when must be a text such as \"y = 0 falling\", not {}", when.value.kind_name()));
    if (restitution != nullptr && reset != nullptr)
        fail(reset->at, "an impact has a restitution or a reset; keep one");
    const long count = count_of(entry, table.find("count"), array, "impact");
    Scope scope = scope_of("the impact " + name, true);
    if (index) scope.indices = {*index};
    const EventSyntax crossing = parse_crossing(source_, when.value.text, scope);
    if (crossing.direction == 0)
        fail(when.value.at,
             fmt::format("from which side does the motion meet {}? add 'falling' where the left side minus the right "
                         "is above 0 before, 'rising' where it is below",
                         name));
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
            fail(when.value.at, fmt::format("an impact of {} bytes; at most {}", impact.when.text.size(), longest_event));
        if (value.velocities)
            fail(when.value.at, fmt::format("the wall {} holds a velocity; a wall is where positions are", impact.written));
        if (std::none_of(scene_.coordinates.begin(), scene_.coordinates.end(),
                         [&](const Coordinate& c) { return value.expression.has(c.position); }))
            fail(when.value.at, fmt::format("the wall {} holds no coordinate", impact.written));
        if (restitution != nullptr) {
            GiNaC::numeric e = 0;
            impact.restitution = read_formula(*restitution, scope_of("the restitution", false), &e);
            if (e.is_negative() || e > 1)
                fail(restitution->value.at,
                     fmt::format("the restitution is {:.6g}; it is the part of the normal velocity that an impact "
                                 "gives back, 0 to 1",
                                 e.to_double()));
        }
        if (reset != nullptr) read_reset(*reset, impact, scope, indices);
        scene_.impacts.push_back(impact);
    }
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
}

}  // namespace lobatto
