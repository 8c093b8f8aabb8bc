// SPDX-License-Identifier: GPL-2.0-or-later
#include "cli/table/table_head.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <sstream>

namespace lobatto {

namespace {

using Json = nlohmann::ordered_json;

// A text of Python; names of columns hold no backslash and no double quote.
std::string quoted(const std::string& name) {
    const char quote = name.find('\'') == std::string::npos ? '\'' : '"';
    return quote + name + quote;
}

std::string shard_text(const Shard& shard) {
    return fmt::format("{}/{} of {} trajectories, compiled kernel {}", shard.number, shard.of, shard.trajectories,
                       shard.compiled);
}

std::optional<Shard> shard_in(const std::string& text) {
    Shard shard;
    char slash = 0;
    std::string of, trajectories, compiled, kernel;
    std::istringstream words(text);
    if (!(words >> shard.number >> slash >> shard.of >> of >> shard.trajectories >> trajectories >> compiled >>
          kernel >> shard.compiled) ||
        slash != '/' || shard.of < 1 || shard.number < 1 || shard.number > shard.of || shard.of > 1'000'000)
        return std::nullopt;
    return shard;
}

// What stands in a head several times is a list.
bool is_list(const std::string& what) {
    return what == "vary" || what == "draw" || what == "keep";
}

std::vector<std::string> split(const std::string& text, const std::string& separator) {
    std::vector<std::string> parts;
    for (std::size_t at = 0; at <= text.size();) {
        const std::size_t end = std::min(text.find(separator, at), text.size());
        parts.push_back(text.substr(at, end - at));
        at = end + separator.size();
    }
    return parts;
}

// The units in "q [rad], p_q": after the names, which are known.
void read_units(const std::string& text, std::vector<TableColumn>& columns) {
    std::size_t at = 0;
    for (std::size_t c = 0; c < columns.size(); ++c) {
        const std::string next = c + 1 < columns.size() ? ", " + columns[c + 1].name : "";
        at = std::min(at + columns[c].name.size(), text.size());
        if (text.compare(at, 2, " [") == 0) {
            const std::size_t end = next.empty() ? text.size() - 1 : std::min(text.find("]" + next, at), text.size());
            columns[c].unit = text.substr(at + 2, end - at - 2);
            at = end + 1;
        }
        at = std::min(at + 2, text.size());
    }
}

}  // namespace

std::string lobatto_version() {
    return LOBATTO_VERSION;
}

std::string csv_head(const TableHead& head) {
    std::string text = fmt::format("# lobatto {}\n", head.kind);
    for (const auto& [what, value] : head.facts) text += fmt::format("# {}: {}\n", what, value);
    if (head.shard) text += fmt::format("# shard: {}\n", shard_text(*head.shard));
    std::string whole;
    for (const TableColumn& column : head.columns)
        if (column.whole) whole += (whole.empty() ? "" : ", ") + column.name;
    if (!whole.empty()) text += fmt::format("# whole numbers: {}\n", whole);
    text += "# columns:";
    const char* separator = " ";
    for (const TableColumn& column : head.columns) {
        text += separator + column.name + (column.unit.empty() ? "" : " [" + column.unit + "]");
        separator = ", ";
    }
    separator = "\n";
    for (const TableColumn& column : head.columns) {
        text += separator + column.name;
        separator = ",";
    }
    return text + '\n';
}

std::optional<TableHead> read_csv_head(const std::string& text, std::size_t& length) {
    TableHead head;
    const std::string begin = "# lobatto ", columns = "columns";
    if (!text.starts_with(begin)) return std::nullopt;
    std::vector<std::string> whole;
    std::string units;
    for (std::size_t at = 0;;) {
        const std::size_t end = text.find('\n', at);
        if (end == std::string::npos) return std::nullopt;
        const std::string line = text.substr(at, end - at);
        at = end + 1;
        if (line.starts_with(begin)) {
            head.kind = line.substr(begin.size());
        } else if (line.starts_with("# ")) {
            const std::size_t colon = line.find(": ");
            if (colon == std::string::npos) return std::nullopt;
            const std::string what = line.substr(2, colon - 2), value = line.substr(colon + 2);
            if (what == "shard")
                head.shard = shard_in(value);
            else if (what == columns)
                units = value;
            else if (what == "whole numbers")
                whole = split(value, ", ");
            else
                head.add(what, value);
        } else {
            for (const std::string& name : split(line, ","))
                head.columns.push_back({name, "", std::find(whole.begin(), whole.end(), name) != whole.end()});
            length = at;
            break;
        }
    }
    read_units(units, head.columns);
    return head;
}

std::string json_head(const TableHead& head) {
    Json json = {{"lobatto", head.version}, {"kind", head.kind}};
    for (const auto& [what, value] : head.facts) {
        if (!is_list(what))
            json[what] = value;
        else
            json[what].push_back(value);
    }
    Json columns = Json::array();
    for (const TableColumn& column : head.columns)
        columns.push_back({{"name", column.name}, {"unit", column.unit}, {"type", column.whole ? "int64" : "float64"}});
    json["columns"] = columns;
    if (head.shard) json["shard"] = shard_text(*head.shard);
    json["scene_text"] = head.scene_text;
    return json.dump(2) + '\n';
}

std::optional<TableHead> read_json_head(const std::string& text) {
    TableHead head;
    try {
        const Json json = Json::parse(text);
        for (const auto& [what, value] : json.items()) {
            if (what == "lobatto")
                head.version = value.get<std::string>();
            else if (what == "kind")
                head.kind = value.get<std::string>();
            else if (what == "shard")
                head.shard = shard_in(value.get<std::string>());
            else if (what == "scene_text")
                head.scene_text = value.get<std::string>();
            else if (what == "columns")
                for (const Json& column : value)
                    head.columns.push_back({column.at("name").get<std::string>(), column.at("unit").get<std::string>(),
                                            column.at("type") == "int64"});
            else if (value.is_array())
                for (const Json& each : value) head.add(what, each.get<std::string>());
            else
                head.add(what, value.get<std::string>());
        }
    } catch (const Json::exception&) {
        return std::nullopt;
    }
    return head;
}

std::string npy_head(const std::vector<TableColumn>& columns, std::int64_t rows) {
    std::string fields;
    for (const TableColumn& column : columns)
        fields += fmt::format("({}, '{}'), ", quoted(column.name), column.whole ? "<i8" : "<f8");
    std::string dictionary = fmt::format("{{'descr': [{}], 'fortran_order': False, 'shape': ({},), }}", fields, rows);
    constexpr std::size_t digits = 20, alignment = 64;
    const std::size_t longest = dictionary.size() - std::to_string(rows).size() + digits + 1;
    const bool large = longest + alignment > 0xffff;
    const std::size_t before = large ? 12 : 10;
    const std::size_t whole = (before + longest + alignment - 1) / alignment * alignment;
    dictionary.resize(whole - before, ' ');
    dictionary.back() = '\n';
    std::string head = "\x93NUMPY";
    head += large ? '\x02' : '\x01';
    head += '\0';
    for (std::size_t byte = 0; byte < before - 8; ++byte)
        head += static_cast<char>(dictionary.size() >> (8 * byte) & 0xff);
    return head + dictionary;
}

std::string difference(const TableHead& there, const TableHead& here) {
    if (there.kind != here.kind) return fmt::format("a {} there, a {} here", there.kind, here.kind);
    const std::size_t count = std::max(there.facts.size(), here.facts.size());
    for (std::size_t i = 0; i < count; ++i) {
        const auto text = [&](const TableHead& head) {
            return i < head.facts.size() ? head.facts[i].first + ": " + head.facts[i].second : std::string("nothing");
        };
        if (text(there) != text(here)) return fmt::format("'{}' there, '{}' here", text(there), text(here));
    }
    for (std::size_t c = 0; c < std::max(there.columns.size(), here.columns.size()); ++c) {
        const auto text = [&](const TableHead& head) {
            return c < head.columns.size() ? head.columns[c].name : std::string("none");
        };
        if (text(there) != text(here)) return fmt::format("the column '{}' there, '{}' here", text(there), text(here));
    }
    return "";
}

}  // namespace lobatto
