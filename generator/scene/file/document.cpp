// SPDX-License-Identifier: GPL-2.0-or-later
// The only file that knows toml++. It gives values with line and column of their beginning; keys come sorted by name,
// so order is restored by position, and the bytes of strings and numbers are found again in the raw text.
#include "generator/scene/file/document.hpp"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <tuple>

#include "generator/formula/text/cursor.hpp"
#include "generator/scene/file/toml_guard.hpp"

namespace lobatto {
namespace {

Position position_of(const toml::source_region& region) {
    return {static_cast<int>(region.begin.line), static_cast<int>(region.begin.column)};
}

// Of the letter after a backslash and what belongs to it.
std::size_t escape_length(char letter) {
    return letter == 'u' ? 5 : letter == 'U' ? 9 : 1;
}

// A string value and the places of all its bytes: walks through quotes, escapes, folded line ends and CRLF beside the
// value as toml++ decoded it from the guarded text, one byte a character there unless it was an escape.
Text locate_string(Cursor& cursor, std::string_view decoded) {
    Text text;
    const char quote = cursor.front();
    assert(quote == '"' || quote == '\'');
    const bool multiline = cursor.rest().starts_with(std::string(3, quote));
    cursor.advance(multiline ? 3 : 1);
    if (multiline) {
        cursor.skip("\r");
        if (cursor.front() == '\n') cursor.advance();
    }
    while (!decoded.empty()) {
        const Position here = cursor.position();
        std::size_t length = 1;
        if (quote == '"' && cursor.front() == '\\') {
            cursor.advance();
            if (cursor.is_any_of(" \t\r\n")) {
                cursor.skip(" \t\r\n");
                continue;
            }
            cursor.advance(escape_length(cursor.front()));
            length = character_length(decoded);
            text.value += decoded.substr(0, length);
        } else {
            if (cursor.front() == '\r') cursor.advance();
            const std::string_view written = cursor.rest().substr(0, character_length(cursor.rest()));
            assert(written.size() > 1 || written.front() == decoded.front());
            text.value += written;
            cursor.advance();
        }
        text.at.resize(text.value.size(), here);
        decoded.remove_prefix(length);
    }
    text.at.push_back(cursor.position());
    return text;
}

// The characters of a number as written, without underscores and the plus sign in front.
Text locate_number(Cursor& cursor) {
    Text text;
    for (; cursor.is_any_of("0123456789abcdefABCDEF_+-.xXoO"); cursor.advance()) {
        const bool leading_plus = cursor.front() == '+' && text.value.empty();
        if (cursor.front() == '_' || leading_plus) continue;
        text.value += cursor.front();
        text.at.push_back(cursor.position());
    }
    text.at.push_back(cursor.position());
    return text;
}

Value convert(const Source& source, Cursor& cursor, const toml::node& node);

std::vector<Entry> convert_entries(const Source& source, Cursor& cursor, const toml::table& table) {
    struct Pending {
        Position at;
        std::string_view key;
        const toml::node* node;
    };
    std::vector<Pending> pending;
    for (const auto& [key, node] : table) pending.push_back({position_of(key.source()), key.str(), &node});
    std::sort(pending.begin(), pending.end(), [](const Pending& a, const Pending& b) {
        return std::tie(a.at.line, a.at.column) < std::tie(b.at.line, b.at.column);
    });
    std::vector<Entry> entries;
    for (const Pending& next : pending)
        entries.push_back({std::string(next.key), next.at, convert(source, cursor, *next.node)});
    return entries;
}

Value convert(const Source& source, Cursor& cursor, const toml::node& node) {
    Value value;
    value.at = position_of(node.source());
    switch (node.type()) {
        case toml::node_type::string:
            value.kind = Value::Kind::text;
            cursor.move_to(value.at);
            value.text = locate_string(cursor, **node.as_string());
            break;
        case toml::node_type::integer:
            value.kind = Value::Kind::integer;
            value.integer = **node.as_integer();
            cursor.move_to(value.at);
            value.text = locate_number(cursor);
            if (value.text.value.find_first_of("xXoObB") != std::string::npos) {
                value.text.value = std::to_string(value.integer);
                value.text.at.assign(value.text.value.size() + 1, value.at);
            }
            break;
        case toml::node_type::floating_point:
            value.kind = Value::Kind::real;
            if (!std::isfinite(**node.as_floating_point()))
                source.fail(value.at, "inf and nan are not numbers a scene can use; write a finite number");
            cursor.move_to(value.at);
            value.text = locate_number(cursor);
            break;
        case toml::node_type::boolean:
            value.kind = Value::Kind::boolean;
            value.boolean = **node.as_boolean();
            break;
        case toml::node_type::array:
            value.kind = Value::Kind::list;
            for (const toml::node& item : *node.as_array()) value.items.push_back(convert(source, cursor, item));
            break;
        default:  // the guard leaves only tables
            assert(node.is_table());
            value.entries = convert_entries(source, cursor, *node.as_table());
            break;
    }
    return value;
}

// toml++ says "Error while parsing X: Y", with "cannot redefine existing string 'x'" for a key that stands twice; the
// most likely reason of some is a formula without quotes.
std::string explanation(std::string_view description) {
    constexpr std::string_view prefix = "Error while parsing ";
    if (description.starts_with(prefix)) description.remove_prefix(prefix.size());
    const std::size_t twice = description.find("cannot redefine existing "), quote = description.find('\'', twice),
                      end = description.find('\'', quote + 1);
    if (twice != std::string_view::npos && quote != std::string_view::npos && end != std::string_view::npos)
        return fmt::format("{} is given twice; keep one", description.substr(quote, end + 1 - quote));
    const bool formula = description.find("could not determine value type") != std::string_view::npos ||
                         description.find("expected digit") != std::string_view::npos ||
                         description.starts_with("boolean");  // a word with f or t
    // Of a word at the end of its line, as the value of time = t, it shows a part of the line's end.
    const auto is_readable = [](unsigned char c) { return c >= ' ' && c < 0x7f; };
    if (!std::all_of(description.begin(), description.end(), is_readable))
        description = description.substr(0, description.find(", saw '"));
    const bool prime = description.find("expected a comment or whitespace, saw") != std::string_view::npos;
    const bool point = description.find("expected decimal digit, saw '.'") != std::string_view::npos;
    return fmt::format("not valid TOML: {}{}", description,
                       point     ? "; a number begins with a digit: write 0.5, not .5"
                       : formula ? "; a formula must stand in quotes"
                       : prime   ? "; a formula with primes stands in double quotes, \"x'^2/2\""
                                 : "");
}

}  // namespace

std::string Value::kind_name() const {
    switch (kind) {
        case Kind::text:
            return "a text";
        case Kind::integer:
            return "a whole number";
        case Kind::real:
            return "a number";
        case Kind::boolean:
            return "true or false";
        case Kind::list:
            return "a list";
        case Kind::table:
            break;
    }
    return "a table";
}

Value read_document(const Source& source) {
    const std::string guarded = guarded_toml(source);
    try {
        const toml::table root = toml::parse(std::string_view(guarded));
        Cursor cursor(source.content());
        Value document;
        document.entries = convert_entries(source, cursor, root);
        return document;
    } catch (const toml::parse_error& error) {
        source.fail(position_of(error.source()), explanation(error.description()));
    }
}

}  // namespace lobatto
