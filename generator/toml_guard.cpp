// SPDX-License-Identifier: GPL-2.0-or-later
// Found by fuzzing, none of it valid in a scene:
// - a dotted key of very many parts: toml++ nests a table for each, and destroys them recursively;
// - anything but a key after the [ of a table's header: taken for granted, undefined behaviour;
// - a character beyond ASCII outside strings and comments, or where white space may end (after a folded line end): its
// test for
//   white space runs into unreachable code for some of them.
#include "generator/toml_guard.hpp"

#include <fmt/format.h>

#include <cctype>

#include "generator/cursor.hpp"

namespace lobatto {
namespace {

constexpr int most_parts = 16;  // of a dotted key
constexpr std::string_view blanks = " \t\r\n";

bool is_ascii(char c) {
    return static_cast<unsigned char>(c) < 0x80;
}

class Guard {
public:
    explicit Guard(const Source& source) : source_(source), cursor_(source.content()) {}

    void run() {
        while (!cursor_.at_end()) {
            if (first_of_line_ && cursor_.front() == '[') read_header();
            const char c = cursor_.front();
            first_of_line_ = c == '\n' || (first_of_line_ && (c == ' ' || c == '\t' || c == '\r'));
            count_dots(c);
            if (!is_ascii(c)) fail_character("outside quotes and comments");
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
    void read_header() {
        cursor_.skip("[ \t");
        const char c = cursor_.front();
        const bool key = std::isalnum(static_cast<unsigned char>(c)) || cursor_.is_any_of("_-\"'");
        if (!key)
            source_.fail(cursor_.position(), "not valid TOML: the name of a table must follow [, for example [run]");
    }

    void count_dots(char c) {
        if (c == '=' || c == ',' || c == '#' || c == '\n') dots_ = 0;
        if (c == '.' && ++dots_ >= most_parts)
            source_.fail(cursor_.position(),
                         fmt::format("a key of more than {} parts; keys of a scene have at most 3", most_parts));
    }

    [[noreturn]] void fail_character(std::string_view where) const {
        const std::string_view rest = cursor_.rest();
        source_.fail(cursor_.position(), fmt::format("not valid TOML: '{}' cannot stand {}",
                                                     rest.substr(0, character_length(rest)), where));
    }

    void skip_string(char quote) {
        const bool multiline = cursor_.rest().starts_with(std::string(3, quote));
        const std::string end(multiline ? 3 : 1, quote);
        cursor_.advance(end.size());
        while (!cursor_.at_end() && !cursor_.rest().starts_with(end) && (multiline || cursor_.front() != '\n')) {
            const bool escape = quote == '"' && cursor_.front() == '\\';
            cursor_.advance();
            if (!escape) continue;
            const bool folded = cursor_.is_any_of(blanks);
            cursor_.skip(blanks);
            if (!is_ascii(cursor_.front())) fail_character("directly after a backslash");
            if (!folded) cursor_.advance();
        }
        for (std::size_t i = 0; i < end.size() && cursor_.front() == quote; ++i) cursor_.advance();
    }

    const Source& source_;
    Cursor cursor_;
    int dots_ = 0;
    bool first_of_line_ = true;
};

}  // namespace

void refuse_hostile_toml(const Source& source) {
    Guard(source).run();
}

}  // namespace lobatto
