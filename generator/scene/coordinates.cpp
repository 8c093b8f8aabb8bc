// SPDX-License-Identifier: GPL-2.0-or-later
// [coordinates] of a scene: names, arrays, and where they start.
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

#include "generator/scene/system_reader.hpp"

namespace lobatto {
namespace {

constexpr std::size_t most_coordinates = 4096;

}  // namespace

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
        // As small as it is: the tails of a Gaussian pulse on a chain.
        value_in_range(source_, entry.value.at, values.back(), label(k), parameter_values_, true);
    }
}

}  // namespace lobatto
