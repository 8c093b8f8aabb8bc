// SPDX-License-Identifier: GPL-2.0-or-later
// A formula cut into numbers, names and signs; a character that has no place in a formula is an error with its mend.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "generator/formula/text/source.hpp"

namespace lobatto {

struct Token {
    enum class Kind {
        number,
        name,
        text,
        sign,
        end
    };  // text: a file, in quotes; sign: one of + - * / ^ ( ) [ ] , = < > .. and the ' after a ]
    Kind kind = Kind::end;
    std::string_view text;  // as written; a name includes its prime
    Position at;
    bool primed = false;  // a name with a prime

    bool is(char c) const { return kind == Kind::sign && text.front() == c; }       // '.' for ..
    std::string_view name() const { return text.substr(0, text.size() - primed); }  // of a name: without its prime
};

// The tokens, the last one of kind end, without comments (# to the end of the line). Throws InputError.
std::vector<Token> tokenise(const Source& source, const Text& text, const std::string& formula);

// Letters, digits and underscores, beginning with a letter.
bool is_identifier(std::string_view word);

}  // namespace lobatto
