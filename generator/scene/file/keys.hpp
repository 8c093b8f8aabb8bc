// SPDX-License-Identifier: GPL-2.0-or-later
// The keys of a scene file: the one table that its reader, its JSON schema and the errors about unknown keys use.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace lobatto {

// What stands behind a key.
enum class Holds {
    text,      // one line in quotes
    formula,   // a number, or a formula in quotes
    formulas,  // that, or a list of such
    list,      // a list of formulas
    quoted,    // a formula, an equation or an event in quotes
    events,    // one event in quotes, or a list of such
    texts,     // a list of texts in quotes
    place,     // [x, y] or [x, y, z]: numbers, or formulas in quotes
    places,    // a list of places
    whole,     // a whole number
    truth,     // true or false
    word,      // one of some words in quotes
    names,     // lines of names of one's own with a formula each
    table      // keys of its own
};

struct Key {
    std::string name;
    Holds holds = Holds::text;
    std::string help;  // one sentence without a full stop
    bool required = false;
    std::vector<std::string> words = {};
    std::string pattern = {};       // of other words that will do, a regular expression
    long long least = 0, most = 0;  // of whole numbers
    std::vector<Key> keys = {};     // of a table
    bool lines = false;             // a table of lines with names of one's own, each with these keys
    bool is_short = false;          // a line of it may be a formula, or a list of them, alone
};

// Of a run: step numbers are exact as doubles up to 2^53.
inline constexpr long long most_steps = 9'000'000'000'000'000;

// A scene's: its first keys, and its sections with theirs.
const std::vector<Key>& scene_keys();
// Those of a section, such as "run", or of one of its lines, such as "coordinates". Precondition: there is one.
const std::vector<Key>& keys_of_section(const std::string& section);
// The types of joints, each with the names of its keys.
const std::vector<std::pair<std::string, std::vector<std::string>>>& joint_types();
// What a figure of [view] is: exactly one of these keys, in the order of MovingFigure::Kind.
const std::vector<std::string>& figure_shapes();

// The names alone.
std::vector<std::string> names_of(const std::vector<Key>& keys);

}  // namespace lobatto
