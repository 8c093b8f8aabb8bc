// SPDX-License-Identifier: GPL-2.0-or-later
// docs/coming_from.md: each scene runs, and ends where the page says.
#include <doctest/doctest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support.hpp"

using namespace lobatto;

namespace {

struct Comparison {
    std::string peer, scene;
    std::map<std::string, double> reference;  // columns of the trajectory at its end
    double bound = 0;
};

// A section that shows a scene: its heading, the block, "Reference at the end: x = 1, y = 2. The run is within 1e-9."
std::vector<Comparison> comparisons() {
    const std::string page = test::read_file(std::filesystem::path(LOBATTO_SOURCE_DIR) / "docs/coming_from.md");
    std::vector<Comparison> all;
    for (std::size_t at = page.find("\n## "); at != std::string::npos;) {
        const std::size_t next = page.find("\n## ", at + 1);
        const std::string section = page.substr(at, next - at);
        at = next;
        Comparison one;
        one.peer = section.substr(4, section.find('\n', 1) - 4);
        INFO(one.peer);
        const std::size_t begin = section.find("```toml\n");
        REQUIRE(begin != std::string::npos);
        one.scene = section.substr(begin + 8, section.find("```", begin + 8) - begin - 8);
        const std::string claim = section.substr(section.find("Reference at the end: ", begin));
        const std::regex number(R"((\w+) = (-?[0-9.]+)[,.])"), bound(R"(The\s+run\s+is\s+within\s+([0-9e-]+)\.)");
        std::smatch found;
        REQUIRE(std::regex_search(claim, found, bound));
        one.bound = std::strtod(found.str(1).c_str(), nullptr);
        const std::string values = found.prefix();
        for (auto match = std::sregex_iterator(values.begin(), values.end(), number); match != std::sregex_iterator();
             ++match)
            one.reference[match->str(1)] = std::strtod(match->str(2).c_str(), nullptr);
        REQUIRE(!one.reference.empty());
        all.push_back(one);
    }
    return all;
}

std::vector<std::string> fields_of(const std::string& line) {
    std::vector<std::string> fields;
    std::istringstream stream(line);
    for (std::string field; std::getline(stream, field, ',');) fields.push_back(field);
    return fields;
}

// The last row of a trajectory, by its columns.
std::map<std::string, double> end_of(const std::string& trajectory) {
    std::vector<std::string> names, last;
    std::istringstream lines(trajectory);
    for (std::string line; std::getline(lines, line);) {
        if (line.empty() || line.front() == '#') continue;
        (names.empty() ? names : last) = fields_of(line);
    }
    REQUIRE(names.size() == last.size());
    std::map<std::string, double> row;
    for (std::size_t k = 0; k < names.size(); ++k) row[names[k]] = std::strtod(last[k].c_str(), nullptr);
    return row;
}

}  // namespace

TEST_CASE("each scene of docs/coming_from.md runs and ends where its reference says" * doctest::test_suite("slow")) {
    const std::vector<Comparison> all = comparisons();
    CHECK(all.size() == 6);
    const test::TemporaryFolder folder;
    for (const Comparison& one : all) {
        INFO(one.peer);
        test::write_text(folder / "system.toml", one.scene);
        const test::Finished done =
            test::run({LOBATTO_PROGRAM, "run", folder / "system.toml", "-o", folder / "system.csv", "--quiet"});
        INFO(done.err);
        REQUIRE(done.exit_code == 0);
        CHECK(done.err.empty());  // no warning either
        const std::map<std::string, double> end = end_of(test::read_file(folder / "system.csv"));
        for (const auto& entry : one.reference) {
            const std::string name = entry.first;
            const double value = entry.second;
            INFO(name);
            REQUIRE(end.count(name) == 1);
            CHECK(std::fabs(end.at(name) - value) < one.bound);
        }
    }
}
