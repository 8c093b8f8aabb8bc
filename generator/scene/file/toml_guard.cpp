// SPDX-License-Identifier: GPL-2.0-or-later
// Found by fuzzing, and none of it valid in a scene, but for characters beyond ASCII in quotes and comments:
// - a dotted key of very many parts: toml++ nests a table for each, and destroys them recursively;
// - anything but a key after the [ of a table's header: assumed not to happen, so undefined behaviour;
// - some signs in a list (so that only numbers and texts pass), and a date followed by two blanks: the same;
// - some characters beyond ASCII where white space might stand: the test for white space runs into unreachable code.
#include "generator/scene/file/toml_guard.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "generator/formula/text/cursor.hpp"

namespace lobatto {
namespace {

constexpr int most_parts = 16;             // of a dotted key
constexpr std::size_t longest_word = 200;  // beyond what toml++ looks at before it decides what a value is

bool is_ascii(char c) {
    return static_cast<unsigned char>(c) < 0x80;
}

class Guard {
public:
    explicit Guard(const Source& source) : source_(source), cursor_(source.content()) {}

    void run() {
        while (!cursor_.at_end()) {
            const char c = cursor_.front();
            if (c == '[' && after_equals_) {
                skip_list();
                after_equals_ = false;
                continue;
            }
            if (c == '[') check_bracket();
            if (c == '=') check_value();
            after_equals_ = c == '=' || (after_equals_ && (c == ' ' || c == '\t'));
            first_of_line_ = c == '\n' || (first_of_line_ && (c == ' ' || c == '\t' || c == '\r'));
            count_dots(c);
            if (!is_ascii(c)) fail_character();
            if (c == '"' || c == '\'') {
                skip_string(c);
            } else if (c == '#') {
                while (!cursor_.at_end() && cursor_.front() != '\n') cursor_.advance();
            } else {
                cursor_.advance();
            }
        }
    }

private:
    // [name] at the beginning of a line.
    void check_bracket() const {
        if (!first_of_line_)
            source_.fail(cursor_.position(),
                         "not valid TOML: a key with brackets must stand in quotes, as in \"x[i]\" = ...");
        const std::string_view rest = cursor_.rest();
        const std::size_t inside = std::min(rest.find_first_not_of(" \t", 1), rest.size());
        const char c = inside < rest.size() ? rest[inside] : '\0';
        if (c == '[')
            source_.fail(cursor_.position(), "a list of tables: each table of a scene occurs once; write [name]");
        if (!std::isalnum(static_cast<unsigned char>(c)) && c != '_' && c != '-' && c != '"' && c != '\'')
            source_.fail(cursor_.position(), "not valid TOML: the name of a table must follow [, for example [run]");
    }

    // A list after =: numbers and texts, or lists of them, with commas between them; blanks, line ends and comments
    // anywhere.
    void skip_list(bool is_inner = false) {
        const Position open = cursor_.position();
        bool separated = true;
        for (cursor_.advance();; separated = cursor_.front() == ',', cursor_.skip(",")) {
            skip_blanks_of_list();
            if (cursor_.at_end()) source_.fail(open, "this list is not closed: add a ]");
            if (cursor_.front() == ']') return cursor_.advance();
            if (!separated) source_.fail(cursor_.position(), "a comma is missing before this");
            const char c = cursor_.front();
            if (c == '"' || c == '\'') {
                skip_string(c);
            } else if (c == '[' && !is_inner) {
                skip_list(true);
            } else {
                skip_number();
            }
            skip_blanks_of_list();
        }
    }

    void skip_blanks_of_list() {
        while (cursor_.is_any_of(" \t\r\n#")) {
            if (cursor_.front() == '#') {
                while (!cursor_.at_end() && cursor_.front() != '\n') cursor_.advance();
            } else {
                cursor_.advance();
            }
        }
    }

    void skip_number() {
        if (!cursor_.is_any_of("+-0123456789"))
            source_.fail(cursor_.position(), "a list in a scene holds numbers, and formulas in quotes");
        const Position begin = cursor_.position();
        std::string word;
        for (; cursor_.is_any_of("+-._0123456789abcdefxoABCDEFX"); cursor_.advance()) word += cursor_.front();
        refuse_date(word, begin);
    }

    // It has a colon, or the form 1979-05-27 once underscores are left out, as toml++ does.
    void refuse_date(std::string word, Position at) const {
        std::erase(word, '_');
        const bool date = word.size() >= 10 && word[4] == '-' && word[7] == '-';
        if (date || word.find(':') != std::string::npos) source_.fail(at, "a date or time: no value of a scene is one");
    }

    // No date or time after =.
    void check_value() const {
        const std::string_view rest = cursor_.rest();
        const std::size_t begin = std::min(rest.find_first_not_of(" \t", 1), rest.size());
        const std::string word(
            rest.substr(begin, std::min(rest.find_first_of(" \t\r\n,}#\"'{", begin), begin + longest_word) - begin));
        refuse_date(word, {cursor_.position().line, cursor_.position().column + static_cast<int>(begin)});
    }

    void count_dots(char c) {
        if (c == '=' || c == ',' || c == '#' || c == '\n') dots_ = 0;
        if (c == '.' && ++dots_ >= most_parts)
            source_.fail(cursor_.position(),
                         fmt::format("a key of more than {} parts; keys of a scene have at most 3", most_parts));
    }

    [[noreturn]] void fail_character() const {
        const std::string_view rest = cursor_.rest();
        source_.fail(cursor_.position(), fmt::format("not valid TOML: '{}' cannot stand outside quotes and comments",
                                                     rest.substr(0, character_length(rest))));
    }

    void skip_string(char quote) {
        const bool multiline = cursor_.rest().starts_with(std::string(3, quote));
        const std::string end(multiline ? 3 : 1, quote);
        cursor_.advance(end.size());
        while (!cursor_.at_end() && !cursor_.rest().starts_with(end) && (multiline || cursor_.front() != '\n')) {
            cursor_.advance(quote == '"' && cursor_.front() == '\\' ? 2 : 1);
        }
        for (std::size_t i = 0; i < end.size() && cursor_.front() == quote; ++i) cursor_.advance();
    }

    const Source& source_;
    Cursor cursor_;
    int dots_ = 0;
    bool first_of_line_ = true;
    bool after_equals_ = false;
};

}  // namespace

std::string guarded_toml(const Source& source) {
    std::string text;
    for (Cursor cursor(source.content()); !cursor.at_end(); cursor.advance()) {
        if (!is_ascii(cursor.front()) && character_length(cursor.rest()) == 1)
            source.fail(cursor.position(), "this byte is not UTF-8; save the file with the encoding UTF-8");
        text += is_ascii(cursor.front()) ? cursor.front() : '?';
    }
    Guard(source).run();
    return text;
}

}  // namespace lobatto
