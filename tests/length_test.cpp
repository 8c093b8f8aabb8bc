// SPDX-License-Identifier: GPL-2.0-or-later
// No function of more than 80 lines, no class of more than 400: read off the sources, by their braces.
#include <doctest/doctest.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

namespace {

namespace fs = std::filesystem;

constexpr long longest_function = 80, longest_class = 400;

// What is longer still, and how long it may be until it is split.
struct Longer {
    const char* head;
    long lines;
};
constexpr Longer longer[] = {{"& problems()", 120}};  // the race's, one after another

// Comments, texts and directives become blanks; line ends stay.
std::string code_of(const std::string& text) {
    std::string code = text;
    const auto blank = [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end && i < code.size(); ++i)
            if (code[i] != '\n') code[i] = ' ';
        return end;
    };
    bool begins_line = true;
    for (std::size_t i = 0; i < code.size();) {
        const char c = code[i];
        const bool in_number = c == '\'' && i > 0 && std::isalnum(static_cast<unsigned char>(code[i - 1])) != 0;
        std::size_t end = i + 1;
        if (c == '#' && begins_line) {
            do end = std::min(text.find('\n', end + 1), text.size());
            while (text[end - 1] == '\\' && end < text.size());
            const bool is_other_branch = text.compare(i, 4, "#els") == 0 || text.compare(i, 4, "#eli") == 0;
            if (is_other_branch) end = std::min(text.find("\n#endif", i), text.size());
            blank(i, end);
        } else if (text.compare(i, 2, "//") == 0) {
            end = blank(i, std::min(text.find('\n', i), text.size()));
        } else if (text.compare(i, 2, "/*") == 0) {
            end = blank(i, std::min(text.find("*/", i), text.size() - 2) + 2);
        } else if (text.compare(i, 2, "R\"") == 0) {
            const std::string mark = ")" + text.substr(i + 2, text.find('(', i) - i - 2) + "\"";
            end = blank(i, text.find(mark, i) + mark.size());
        } else if ((c == '"' || c == '\'') && !in_number) {
            while (end < text.size() && text[end] != c) end += text[end] == '\\' ? 2 : 1;
            end = blank(i, end + 1);
        }
        for (; i < end && i < code.size(); ++i)
            begins_line = code[i] == '\n' || (begins_line && code[i] == ' ' && end == i + 1);
    }
    return code;
}

enum class Kind { space, type, function, inner };

// What a brace opens, told by the text before it and by what stands around it.
Kind kind_of(std::string_view head, Kind around) {
    if (around == Kind::function || around == Kind::inner) return Kind::inner;
    const auto skip = [&](std::size_t count) {
        head.remove_prefix(std::min(count, head.size()));
        head.remove_prefix(std::min(head.find_first_not_of(" \n"), head.size()));
    };
    for (const std::string_view access : {"public:", "private:", "protected:"})
        if (head.starts_with(access)) skip(access.size());
    while (head.starts_with("template")) {
        std::size_t end = head.find('<') + 1;
        for (int depth = 1; depth > 0 && end < head.size(); ++end) depth += (head[end] == '<') - (head[end] == '>');
        skip(end);
    }
    const auto begins = [&](std::string_view word) { return head.starts_with(word); };
    if (begins("namespace") || begins("inline namespace") || begins("extern ")) return Kind::space;
    if (begins("class ") || begins("struct ") || begins("union ") || begins("enum ")) return Kind::type;
    return head.find(')') != std::string_view::npos && !head.ends_with('=') ? Kind::function : Kind::inner;
}

struct Part {
    Kind kind;
    long first, last;  // lines
    std::string head;
};

std::vector<Part> parts_of(const std::string& text) {
    const std::string code = code_of(text);
    std::vector<Part> open, closed;
    std::size_t begin = 0;
    long line = 1;
    for (std::size_t i = 0; i < code.size(); ++i) {
        if (code[i] == '\n') ++line;
        if (code[i] != '{' && code[i] != '}' && code[i] != ';') continue;
        const std::size_t first = std::min(code.find_first_not_of(" \n", begin), i);
        std::size_t last = i;
        while (last > first && std::isspace(static_cast<unsigned char>(code[last - 1])) != 0) --last;
        if (code[i] == '{') {
            const std::string head = code.substr(first, last - first);
            const long height = std::count(head.begin(), head.end(), '\n');
            open.push_back({kind_of(head, open.empty() ? Kind::space : open.back().kind), line - height, 0, head});
        } else if (code[i] == '}') {
            REQUIRE_FALSE(open.empty());
            closed.push_back(open.back());
            closed.back().last = line;
            open.pop_back();
        }
        begin = i + 1;
    }
    CHECK(open.empty());
    return closed;
}

}  // namespace

TEST_CASE("parts of a source and their lines are told by braces") {
    const std::vector<Part> parts = parts_of(
        "#define BRACE {\nnamespace a {\n// }\nstruct B {\n    int c{1'000};\n};\ntemplate <class T>\nint d(T e,\n     "
        " "
        "char f = '}') {\n    const auto g = R\"({)\";\n    if (e) {\n    }\n    return 0;\n}\n}\n");
    std::vector<long> functions, types;
    for (const Part& part : parts) {
        if (part.kind == Kind::function) functions.insert(functions.end(), {part.first, part.last});
        if (part.kind == Kind::type) types.insert(types.end(), {part.first, part.last});
    }
    CHECK(functions == std::vector<long>{7, 14});
    CHECK(types == std::vector<long>{4, 6});
}

TEST_CASE("no function is longer than 80 lines, no class longer than 400") {
    int functions = 0;
    for (const char* half : {"generator", "runtime", "analysis", "library", "cli", "bench", "python"})
        for (const auto& entry : fs::recursive_directory_iterator(fs::path(LOBATTO_SOURCE_DIR) / half)) {
            const std::string extension = entry.path().extension();
            if (extension != ".cpp" && extension != ".hpp" && extension != ".h") continue;
            std::ostringstream text;
            text << std::ifstream(entry.path()).rdbuf();
            INFO(entry.path().string());
            for (const Part& part : parts_of(text.str())) {
                if (part.kind != Kind::function && part.kind != Kind::type) continue;
                functions += part.kind == Kind::function ? 1 : 0;
                INFO("line " << part.first << ": " << part.head);
                long most = part.kind == Kind::function ? longest_function : longest_class;
                for (const Longer& one : longer)
                    if (part.head.find(one.head) != std::string::npos) most = one.lines;
                CHECK(part.last - part.first < most);
            }
        }
    CHECK(functions > 3000);
}
