// SPDX-License-Identifier: GPL-2.0-or-later
// Links between the documents lead somewhere, as plain Markdown in the repository.
#include <doctest/doctest.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "tests/support.hpp"

using namespace lobatto;

namespace {

namespace fs = std::filesystem;
const fs::path tree = LOBATTO_SOURCE_DIR;

std::vector<fs::path> documents() {
    std::vector<fs::path> all;
    for (const char* name : {"README.md", "CONTRIBUTING.md", "CHANGELOG.md", "LICENSE.md"}) all.push_back(tree / name);
    for (const auto& entry : fs::recursive_directory_iterator(tree / "docs"))
        if (entry.path().extension() == ".md") all.push_back(entry.path());
    return all;
}

// A document without its blocks of code.
std::string prose_of(const fs::path& path) {
    std::string prose;
    bool is_code = false;
    const std::string text = test::read_file(path);
    for (std::size_t at = 0; at < text.size();) {
        const std::size_t end = std::min(text.find('\n', at), text.size());
        const std::string line = text.substr(at, end - at);
        at = end + 1;
        if (line.starts_with("```"))
            is_code = !is_code;
        else if (!is_code)
            prose += line + "\n";
    }
    return prose;
}

// The names that the headings of a document have in links: "## 4. The reduced form" is #4-the-reduced-form.
std::set<std::string> places_in(const fs::path& path) {
    static const std::regex heading("(?:^|\n)#+ +([^\n]+)");
    std::set<std::string> places;
    const std::string prose = prose_of(path);
    for (auto match = std::sregex_iterator(prose.begin(), prose.end(), heading); match != std::sregex_iterator();
         ++match) {
        std::string place;
        for (const char c : match->str(1)) {
            const auto byte = static_cast<unsigned char>(c);
            if (c == ' ')
                place += '-';
            else if (byte >= 0x80 || std::isalnum(byte) != 0 || c == '-' || c == '_')
                place += static_cast<char>(byte < 0x80 ? std::tolower(byte) : byte);
        }
        places.insert(place);
    }
    return places;
}

}  // namespace

TEST_CASE("every link of the documents leads to a file, and to a heading in it") {
    static const std::regex link(R"(\]\(([^)\s]+)\))"), elsewhere("[a-z]+:.*");
    int count = 0;
    for (const fs::path& document : documents()) {
        const std::string prose = prose_of(document);
        for (auto match = std::sregex_iterator(prose.begin(), prose.end(), link); match != std::sregex_iterator();
             ++match) {
            const std::string target = match->str(1);
            if (std::regex_match(target, elsewhere)) continue;
            INFO(document.string() << ": " << target);
            ++count;
            const std::size_t mark = target.find('#');
            const fs::path file = mark == 0 ? document : document.parent_path() / target.substr(0, mark);
            CHECK(fs::exists(file));
            // No link leads out of the repository.
            CHECK_FALSE(fs::relative(file, tree).generic_string().starts_with(".."));
            if (mark != std::string::npos && file.extension() == ".md" && fs::exists(file))
                CHECK(places_in(file).contains(target.substr(mark + 1)));
        }
    }
    CHECK(count > 200);
}
