// SPDX-License-Identifier: GPL-2.0-or-later
// One table of a scene file: the keys it may have, and its values by type, each mistake with its place and its mend.
#pragma once

#include <string>
#include <vector>

#include "generator/formula/text/source.hpp"
#include "generator/scene/file/document.hpp"
#include "generator/scene/file/keys.hpp"

namespace lobatto {

class Table {
public:
    // Refuses keys that are not among `keys`, which outlive the table; or not among those of them that are `allowed`.
    Table(const Source& source, const std::vector<Entry>& entries, Position at, std::string name,
          const std::vector<Key>& keys, const std::vector<std::string>& allowed = {});

    Position at() const { return at_; }
    const Entry* find(const std::string& key) const;                             // nullptr: not given
    const Entry& get(const std::string& key, const std::string& example) const;  // an error when not given
    // The whole number of an entry, which must be within the limits of its key; `range` says them.
    long long whole(const Entry& entry, const std::string& range) const;

private:
    const Source& source_;
    const std::vector<Entry>& entries_;
    const std::vector<Key>& keys_;
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
