// SPDX-License-Identifier: GPL-2.0-or-later
// Text that remembers where each of its characters stands in a file, and the one error a wrong scene can cause.
#pragma once

#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace lobatto {

// 1-based; a column counts characters (UTF-8 code points), not bytes.
struct Position {
    int line = 1;
    int column = 1;
};

// What is wrong in the input, ready to print (exit code 2):
//     scenes/pendulum.toml:7:18: unknown name 'l' in the Lagrangian; declared: m, length, g. Did you mean 'length'?
//       7 | lagrangian = "m*l^2*theta'^2/2"
//         |                 ^
class InputError : public std::runtime_error {
public:
    using std::runtime_error::runtime_error;
};

// A file of input, whole, with its name as the user gave it.
class Source {
public:
    Source(std::string path, std::string content);
    // InputError when the file cannot be read or is too large; `what`: "scene", "table".
    static Source read(const std::string& path, const std::string& what = "scene");

    const std::string& path() const { return path_; }
    const std::string& content() const { return content_; }

    // The error above: place, message, the line and a caret under the place.
    [[noreturn]] void fail(Position position, const std::string& message) const;

private:
    std::string path_;
    std::string content_;
};

// Text of a user, safe to print: control characters, invisible marks and bytes that are not UTF-8 become U+FFFD.
std::string printable(std::string_view text);
bool is_printable(std::string_view text);  // nothing to replace
// Bytes of the first character, a code point or a wrong byte; text is not empty.
std::size_t character_length(std::string_view text);

// A string value of a file; at[i] is where byte i of the value stands in the file (size value.size() + 1: one past the
// end too), whatever quoting and escapes the file uses.
struct Text {
    std::string value;
    std::vector<Position> at;
};

}  // namespace lobatto
