// SPDX-License-Identifier: GPL-2.0-or-later
// docs/map.md keeps its word: every formula has a row, and what a row names exists.
#include <doctest/doctest.h>

#include <filesystem>
#include <regex>
#include <set>
#include <sstream>

#include "tests/support.hpp"

using namespace lobatto;

namespace {

const std::filesystem::path tree = LOBATTO_SOURCE_DIR;

std::set<std::string> formulas_of(const std::string& text, const std::regex& pattern) {
    std::set<std::string> found;
    for (auto match = std::sregex_iterator(text.begin(), text.end(), pattern); match != std::sregex_iterator(); ++match)
        found.insert((*match)[1]);
    return found;
}

}  // namespace

TEST_CASE("docs/map.md leads from every formula to code and a test that exist") {
    const std::regex row(R"(\| (D\d+) \| .+ \| `(.+)`: `(.+)` \| `(.+)`: (.+) \|)");
    std::set<std::string> mapped;
    std::istringstream lines(test::read_file(tree / "docs/map.md"));
    std::smatch match;
    for (std::string line; std::getline(lines, line);) {
        if (!line.starts_with("| D")) continue;
        INFO(line);
        REQUIRE(std::regex_match(line, match, row));
        CHECK(mapped.insert(match[1]).second);
        REQUIRE(std::filesystem::exists(tree / match[2].str()));
        REQUIRE(std::filesystem::exists(tree / match[4].str()));
        const std::string code = test::read_file(tree / match[2].str()), tests = test::read_file(tree / match[4].str());
        CHECK(std::regex_search(code, std::regex("\\b" + match[3].str() + "\\b")));
        CHECK(tests.find("TEST_CASE(\"" + match[5].str() + "\"") != std::string::npos);
    }
    const std::string derivation = test::read_file(tree / "docs/derivation.md");
    CHECK(mapped == formulas_of(derivation, std::regex(R"(\\tag\{(D\d+)\})")));
}

TEST_CASE("every formula number in the code is one of docs/derivation.md") {
    const std::set<std::string> known =
        formulas_of(test::read_file(tree / "docs/derivation.md"), std::regex(R"(\\tag\{(D\d+)\})"));
    for (const char* half : {"generator", "runtime", "analysis"})
        for (const auto& entry : std::filesystem::recursive_directory_iterator(tree / half)) {
            if (!entry.is_regular_file()) continue;
            for (const std::string& formula : formulas_of(test::read_file(entry.path()), std::regex(R"(\((D\d+)\b)"))) {
                INFO(entry.path().string() << " names " << formula);
                CHECK(known.contains(formula));
            }
        }
}
