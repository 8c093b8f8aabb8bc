// SPDX-License-Identifier: GPL-2.0-or-later
// One table of a scene file: the keys it may have, and its values by type, each mistake with its place and its mend.
#pragma once

#include <string>
#include <vector>

#include "generator/formula/source.hpp"
#include "generator/scene/document.hpp"

namespace lobatto {

class Table {
public:
    // Refuses keys that are not among `keys`.
    Table(const Source& source, const std::vector<Entry>& entries, Position at, std::string name,
          const std::vector<std::string>& keys);

    Position at() const { return at_; }
    const Entry* find(const std::string& key) const;                             // nullptr: not given
    const Entry& get(const std::string& key, const std::string& example) const;  // an error when not given

private:
    const Source& source_;
    const std::vector<Entry>& entries_;
    Position at_;
    std::string name_;
};

// The value of an entry; any other type is an error.
const std::vector<Entry>& table_of(const Source& source, const Entry& entry, const std::string& example);
const Text& formula_of(const Source& source, const Entry& entry);  // a number, or a text that holds a formula
const Text& formula_of(const Source& source, const std::string& key, const Value& value);
long long integer_of(const Source& source, const Entry& entry, long long least, long long most,
                     const std::string& range);
bool boolean_of(const Source& source, const Entry& entry);
// A title or unit: copied to comments, tables and CSV headers, so one line without quotes and backslashes.
std::string label_of(const Source& source, const Entry& entry, std::size_t longest);

}  // namespace lobatto
