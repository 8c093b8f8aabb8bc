// SPDX-License-Identifier: GPL-2.0-or-later
// Types and keys of the values in a table.
#include "generator/scene/file/table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "generator/formula/text/suggest.hpp"

namespace lobatto {

namespace {

// The section that has a key; empty: none.
std::string section_of(const std::string& key) {
    for (const Key& section : scene_keys())
        for (const Key& one : section.keys)
            if (one.name == key) return section.name;
    return "";
}

// What people of other programs call a section or a key of [run], and keys that stand in the wrong section.
std::string advice_for(const std::string& key, const std::vector<std::string>& known, const std::string& table) {
    static const std::map<std::string, std::string> others{
        {"dt", "step"},     {"h", "step"},         {"timestep", "step"}, {"tend", "until"},
        {"t_end", "until"}, {"tmax", "until"},     {"t_max", "until"},   {"end", "until"},
        {"time", "until"},  {"duration", "until"}, {"t_final", "until"}, {"T", "until"}};
    if (table == "[run]" && (key == "start" || key == "t0" || key == "begin" || key == "t_start"))
        return " A run begins at t = 0: write t + 5 for t in the formulas to begin at 5.";
    static const std::map<std::string, const char*> of_scene{
        {"L", " Write lagrangian = \"...\"."},
        {"Lagrangian", " Write lagrangian = \"...\"."},
        {"kinetic", " Write lagrangian = \"kinetic energy - potential energy\"."},
        {"potential", " Write lagrangian = \"kinetic energy - potential energy\"."},
        {"hamiltonian", " A scene has a Lagrangian, in velocities: for H = p^2/(2*m) + V write \"m*x'^2/2 - V\"."},
        {"params", " It is called parameters."},
        {"constants", " Write a line m = { value = 1, constant = true } under [parameters]."},
        {"initial", " The start stands under [coordinates]: x = { position = 1, velocity = 0 }."},
        {"initial_conditions", " The start stands under [coordinates]: x = { position = 1, velocity = 0 }."},
        {"start", " The start stands under [coordinates]: x = { position = 1, velocity = 0 }."},
        {"variables", " It is called coordinates."},
        {"simulation", " It is called run."}};
    if (const auto found = of_scene.find(key); table == "a scene" && found != of_scene.end()) return found->second;
    if (table == "[method]" && key == "splitting") return " Write family = \"splitting\", and this number as stages.";
    if (const std::string section = section_of(key); table.starts_with('[') && !section.empty())
        return fmt::format(" It belongs into [{}].", section);
    const auto found = others.find(key);
    return table == "[run]" && found != others.end() ? fmt::format(" It is called {}.", found->second)
                                                     : suggestion(key, known);
}

}  // namespace

Table::Table(const Source& source, const std::vector<Entry>& entries, Position at, std::string name,
             const std::vector<Key>& keys, const std::vector<std::string>& allowed)
    : source_(source), entries_(entries), keys_(keys), at_(at), name_(std::move(name)) {
    const std::vector<std::string> known = allowed.empty() ? names_of(keys) : allowed;
    for (const Entry& entry : entries_)
        if (std::find(known.begin(), known.end(), entry.key) == known.end())
            source_.fail(entry.at, fmt::format("unknown key '{}' in {}; known: {}.{}", entry.key.substr(0, 40), name_,
                                               listing(known), advice_for(entry.key, known, name_)));
}

const Entry* Table::find(const std::string& key) const {
    const auto found = std::find_if(entries_.begin(), entries_.end(), [&](const Entry& e) { return e.key == key; });
    return found == entries_.end() ? nullptr : &*found;
}

const Entry& Table::get(const std::string& key, const std::string& example) const {
    if (const Entry* entry = find(key)) return *entry;
    source_.fail(at_, fmt::format("{} has no {}: add {}", name_, key, example));
}

long long Table::whole(const Entry& entry, const std::string& range) const {
    const auto key = std::find_if(keys_.begin(), keys_.end(), [&](const Key& one) { return one.name == entry.key; });
    return integer_of(source_, entry, key->least, key->most, range);
}

namespace {

[[noreturn]] void fail_type(const Source& source, const std::string& key, const Value& value,
                            const std::string& expected) {
    source.fail(value.at, fmt::format("{} must be {}, not {}", key, expected, value.kind_name()));
}
[[noreturn]] void fail_type(const Source& source, const Entry& entry, const std::string& expected) {
    fail_type(source, entry.key, entry.value, expected);
}

}  // namespace

const std::vector<Entry>& table_of(const Source& source, const Entry& entry, const std::string& example) {
    if (entry.value.kind != Value::Kind::table) fail_type(source, entry, "a table such as " + example);
    return entry.value.entries;
}

const Text& formula_of(const Source& source, const Entry& entry) {
    return formula_of(source, entry.key, entry.value);
}

const Text& formula_of(const Source& source, const std::string& key, const Value& value) {
    if (value.kind != Value::Kind::text && value.kind != Value::Kind::integer && value.kind != Value::Kind::real)
        fail_type(source, key, value, "a number or a formula in quotes");
    return value.text;
}

long long integer_of(const Source& source, const Entry& entry, long long least, long long most,
                     const std::string& range) {
    if (entry.value.kind == Value::Kind::real)
        source.fail(entry.value.at, fmt::format("{} must be a whole number, written without a point, not {}", entry.key,
                                                entry.value.text.value));
    if (entry.value.kind != Value::Kind::integer) fail_type(source, entry, "a whole number");
    if (entry.value.integer < least || entry.value.integer > most)
        source.fail(entry.value.at, fmt::format("{} is {}; {}", entry.key, entry.value.integer, range));
    return entry.value.integer;
}

bool boolean_of(const Source& source, const Entry& entry) {
    if (entry.value.kind != Value::Kind::boolean) fail_type(source, entry, "true or false");
    return entry.value.boolean;
}

std::string label_of(const Source& source, const Entry& entry, std::size_t longest) {
    if (entry.value.kind != Value::Kind::text) fail_type(source, entry, "a text in quotes");
    const std::string& text = entry.value.text.value;
    if (text.size() > longest)
        source.fail(entry.value.at, fmt::format("{} has {} bytes; at most {}", entry.key, text.size(), longest));
    if (!is_printable(text) || text.find_first_of("\\\"") != std::string::npos)
        source.fail(entry.value.at,
                    fmt::format("{} must be one line without control characters, quotes and backslashes", entry.key));
    return text;
}

}  // namespace lobatto
