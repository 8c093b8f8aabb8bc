// SPDX-License-Identifier: GPL-2.0-or-later
// What a table says of itself: its columns with their units, the scene, the method, where values come from.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "analysis/sweep/rows.hpp"

namespace lobatto {

// A part of a sweep: part `number` of `of`, counted from 1. Parts are ranges of trajectories, as equal as they can be.
struct Shard {
    std::int64_t number = 1, of = 1;
    std::int64_t trajectories = 0;  // of the whole sweep
    std::string compiled = {};      // names the compiled kernel: other processors and compilers round otherwise

    std::int64_t first() const { return boundary(number - 1); }
    std::int64_t last() const { return boundary(number); }  // one past the last
    bool is_whole() const { return of == 1; }
    bool operator==(const Shard&) const = default;

private:
    std::int64_t boundary(std::int64_t part) const {
        return trajectories / of * part + std::min(part, trajectories % of);
    }
};

std::string lobatto_version();

// The same in all formats: lines of comment of a CSV, a JSON file beside a .npy, attributes of a .h5.
struct TableHead {
    std::string kind;                                        // "sweep", "trajectory"
    std::vector<std::pair<std::string, std::string>> facts;  // {"method", "Lobatto, 4 points"}, in their order
    std::vector<TableColumn> columns;
    std::optional<Shard> shard;  // of a part
    std::string scene_text;      // not in CSV
    std::string version = lobatto_version();

    void add(const std::string& what, const std::string& value) { facts.emplace_back(what, value); }
};

// The lines before the first row of a CSV, and back; nothing where a text begins in another way. `length`: of them.
std::string csv_head(const TableHead& head);
// Begins the last line of a .csv of a shard: how many rows stand above, so that merge knows when some are missing.
inline constexpr std::string_view rows_of_shard = "# rows: ";
std::optional<TableHead> read_csv_head(const std::string& text, std::size_t& length);

// A document of JSON, and back.
std::string json_head(const TableHead& head);
std::optional<TableHead> read_json_head(const std::string& text);

// NumPy's format 1.0, or 2.0 for heads above 64 kB: magic, version, length of the dictionary, the dictionary, blanks
// to a multiple of 64 bytes. Its length is the same for any number of rows.
std::string npy_head(const std::vector<TableColumn>& columns, std::int64_t rows);

// The first thing in which two heads differ, shards aside: "method: A there, B here"; empty: nothing.
std::string difference(const TableHead& there, const TableHead& here);

}  // namespace lobatto
