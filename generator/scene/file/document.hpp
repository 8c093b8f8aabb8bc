// SPDX-License-Identifier: GPL-2.0-or-later
// TOML text to a tree of values that keep the order of the file and know where they stand.
#pragma once

#include <string>
#include <vector>

#include "generator/formula/text/source.hpp"

namespace lobatto {

struct Entry;

struct Value {
    enum class Kind { text, integer, real, boolean, list, table };
    Kind kind = Kind::table;
    Position at;  // of its first character; of a [table]: its bracket
    Text text;    // text: the value; integer, real: the digits as a formula, positions kept
    long long integer = 0;
    bool boolean = false;
    std::vector<Value> items;    // list: texts and numbers
    std::vector<Entry> entries;  // table: in the order of the file

    std::string kind_name() const;  // "a table"
};

struct Entry {
    std::string key;
    Position at;
    Value value;
};

// The root table. Throws InputError for anything that is not TOML.
Value read_document(const Source& source);

}  // namespace lobatto
