// SPDX-License-Identifier: GPL-2.0-or-later
// The characters of a formula, one after the other.
#include "generator/formula/text/token.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

namespace lobatto {
namespace {

bool is_digit(char c) {
    return c >= '0' && c <= '9';
}
bool is_letter(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
}
bool is_name_part(char c) {
    return is_letter(c) || is_digit(c) || c == '_';
}
bool is_blank(char c) {
    return c == ' ' || c == '\t' || c == '\n' || c == '\r';
}

// What people paste or type by habit, and what a formula has in its place.
struct Mend {
    std::string_view characters, mend;
};
constexpr Mend mends[] = {{"−–—", "write - instead"},
                          {"×·⋅∙", "write * instead"},
                          {"÷∕", "write / instead"},
                          {"²", "write ^2 instead"},
                          {"³", "write ^3 instead"},
                          {"⁴", "write ^4 instead"},
                          {"½", "write 1/2 instead"},
                          {"√", "write sqrt(...)"},
                          {"π", "write pi instead"},
                          {"′’‘`´", "write ' instead"},
                          {"″\"\u0307", "write q' for the velocity of q"},
                          {"αβγδεζηθικλμνξρστυφχψωΓΔΘΛΞΠΣΦΨΩ", "write the name of the letter, such as alpha"},
                          {"{", "write ( instead"},
                          {"}", "write ) instead"},
                          {"|", "write abs(...), and for 'or' one if inside another"},
                          {"&", "there is no 'and' in formulas: write one if inside another"},
                          {"\\", "formulas are no LaTeX: write (a)/(b), sqrt(x), alpha"},
                          {"_", "a name begins with a letter"},
                          {"\u00A0", "this is a no-break space: type a plain one"}};

class Lexer {
public:
    Lexer(const Source& source, const Text& text, const std::string& formula)
        : source_(source), text_(text), value_(text.value), formula_(formula) {}

    std::vector<Token> run() {
        std::vector<Token> tokens;
        for (;;) {
            skip_blanks();
            begin_ = next_;
            if (next_ == value_.size()) {
                tokens.push_back({Token::Kind::end, value_.substr(next_), text_.at[next_]});
                return tokens;
            }
            const bool names_file =
                tokens.size() > 1 && tokens.back().is('(') && tokens[tokens.size() - 2].text == "table";
            tokens.push_back(names_file && at(0) == '"' ? read_text() : read_token());
        }
    }

private:
    void skip_blanks() {
        while (is_blank(at(0)) || at(0) == '#')
            next_ = at(0) == '#' ? std::min(value_.find('\n', next_), value_.size()) : next_ + 1;
    }
    char at(std::size_t ahead) const { return next_ + ahead < value_.size() ? value_[next_ + ahead] : '\0'; }
    Token token(Token::Kind kind) const { return {kind, value_.substr(begin_, next_ - begin_), text_.at[begin_]}; }
    [[noreturn]] void fail(std::size_t byte, const std::string& message) const {
        source_.fail(text_.at[byte], message);
    }

    Token read_token() {
        const char c = at(0);
        if (c == '.' && is_digit(at(1))) fail(next_, "a number begins with a digit: write 0.5, not .5");
        if (is_digit(c)) return read_number();
        if (is_letter(c)) return read_name();
        if (c == '*' && at(1) == '*') fail(next_, "'**' is not an operator: write ^ for powers");
        const bool range = c == '.' && at(1) == '.';
        const bool prime = c == '\'' && next_ > 0 && value_[next_ - 1] == ']';
        if (c == '\'' && !prime && value_.substr(0, next_).ends_with("table("))
            fail(next_,
                 "the name of a file stands in double quotes, and the formula around it in three single ones: "
                 "'''table(\"data.csv\", t)'''");
        if (c == '\'' && !prime) fail(next_, "a prime ' belongs directly after the name of a coordinate");
        if (std::string_view("+-*/^()[],=<>").find(c) == std::string_view::npos && !range && !prime) refuse_character();
        next_ += range ? 2 : 1;
        if (prime && at(0) == '\'') fail_acceleration("x[...]''");
        return token(Token::Kind::sign);
    }

    // What stands between quotes.
    Token read_text() {
        const std::size_t end = value_.find_first_of("\"\n", next_ + 1);
        if (end == std::string_view::npos || value_[end] != '"') fail(next_, "these quotes are not closed: add a \"");
        Token file{Token::Kind::text, value_.substr(next_ + 1, end - next_ - 1), text_.at[next_ + 1]};
        next_ = end + 1;
        return file;
    }

    // 12, 0.5, 1.5e-3, not the points of 1..n; the e belongs to the number only when digits follow.
    Token read_number() {
        const auto skip_digits = [&] {
            while (is_digit(at(0))) ++next_;
        };
        skip_digits();
        if (at(0) == '.' && at(1) == '.') return token(Token::Kind::number);  // 1..n
        if (at(0) == '.') ++next_;
        skip_digits();
        if (at(0) == 'e' || at(0) == 'E') {
            const std::size_t sign = at(1) == '+' || at(1) == '-' ? 1 : 0;
            if (is_digit(at(1 + sign))) {
                next_ += 1 + sign;
                skip_digits();
            }
        }
        if (at(0) == '.') {
            while (is_digit(at(0)) || at(0) == '.') ++next_;
            fail(begin_, fmt::format("'{}' is not a number: it has too many points",
                                     value_.substr(begin_, std::min<std::size_t>(next_ - begin_, 40))));
        }
        return token(Token::Kind::number);
    }

    Token read_name() {
        while (is_name_part(at(0)) || (at(0) == '.' && is_letter(at(1)))) ++next_;  // top.x too
        if (at(0) != '\'') return token(Token::Kind::name);
        ++next_;
        Token name = token(Token::Kind::name);
        name.primed = true;
        if (at(0) == '\'') fail_acceleration(fmt::format("{}'", name.text));
        return name;
    }

    [[noreturn]] void fail_acceleration(const std::string& written) const {
        fail(next_, fmt::format("{} is an acceleration; formulas have positions and velocities only", written));
    }

    [[noreturn]] void refuse_character() const {
        const std::string_view character = value_.substr(next_, character_length(value_.substr(next_)));
        const auto found = std::find_if(std::begin(mends), std::end(mends), [&](const Mend& row) {
            return row.characters.find(character) != std::string_view::npos;
        });
        const std::string mend = found == std::end(mends) ? "" : fmt::format(": {}", found->mend);
        fail(next_, fmt::format("unexpected character '{}' in {}{}", character, formula_, mend));
    }

    const Source& source_;
    const Text& text_;
    std::string_view value_;
    const std::string& formula_;
    std::size_t next_ = 0;
    std::size_t begin_ = 0;
};

}  // namespace

std::vector<Token> tokenise(const Source& source, const Text& text, const std::string& formula) {
    return Lexer(source, text, formula).run();
}

bool is_identifier(std::string_view word) {
    return !word.empty() && is_letter(word.front()) && std::all_of(word.begin(), word.end(), is_name_part);
}

}  // namespace lobatto
