// SPDX-License-Identifier: GPL-2.0-or-later
// The direction of the arrows in docs/architecture.md, read off the sources: who may include whom, and under which
// licence.
#include <doctest/doctest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>
#include <regex>
#include <set>
#include <string>
#include <vector>

namespace {

namespace fs = std::filesystem;

const fs::path tree = LOBATTO_SOURCE_DIR;

std::vector<fs::path> sources(const std::string& folder) {
    std::vector<fs::path> found;
    for (const auto& entry : fs::recursive_directory_iterator(tree / folder)) {
        const std::string extension = entry.path().extension();
        if (extension == ".cpp" || extension == ".hpp" || extension == ".h") found.push_back(entry.path());
    }
    std::sort(found.begin(), found.end());
    return found;
}

std::vector<std::string> lines(const fs::path& file) {
    std::ifstream stream(file);
    std::vector<std::string> result;
    for (std::string line; std::getline(stream, line);) result.push_back(line);
    return result;
}

std::vector<std::string> includes(const fs::path& file) {
    static const std::regex directive(R"(^\s*#\s*include\s*[<"]([^>"]+)[>"].*)");
    std::vector<std::string> result;
    std::smatch match;
    for (const std::string& line : lines(file))
        if (std::regex_match(line, match, directive)) result.push_back(match[1]);
    return result;
}

// "generator/emit.cpp includes Eigen/Core" for every include of a folder's sources that is not allowed there.
std::vector<std::string> trespasses(const std::string& folder, const std::function<bool(const std::string&)>& allowed) {
    std::vector<std::string> found;
    for (const fs::path& file : sources(folder))
        for (const std::string& name : includes(file))
            if (!allowed(name)) found.push_back(fs::relative(file, tree).string() + " includes " + name);
    return found;
}

bool begins_with_any(const std::string& name, const std::vector<std::string>& beginnings) {
    return std::any_of(beginnings.begin(), beginnings.end(),
                       [&](const std::string& beginning) { return name.starts_with(beginning); });
}

void report(const std::vector<std::string>& violations) {
    for (const std::string& violation : violations) FAIL_CHECK(violation);
}

}  // namespace

TEST_CASE("the generator includes neither Eigen nor cli/, and of runtime/ only the ABI header") {
    REQUIRE(sources("generator").size() > 5);
    report(trespasses("generator", [](const std::string& name) {
        return name == "runtime/kernel_abi.h" ||
               !begins_with_any(name, {"runtime/", "cli/", "tests/", "Eigen", "eigen3", ".."});
    }));
}

TEST_CASE("the runtime includes neither generator/ nor cli/, and none of the generator's libraries") {
    REQUIRE(sources("runtime").size() > 5);
    report(trespasses("runtime", [](const std::string& name) {
        return !begins_with_any(name, {"generator/", "cli/", "tests/", "ginac", "cln", "toml", ".."});
    }));
}

TEST_CASE("what emitted kernels include stands on the C and C++ standard libraries alone") {
    std::set<std::string> allowed = {"cmath", "cstdint", "limits", "type_traits", "utility", "quadmath.h"},
                          parts = {"kernel.hpp"};
    for (const std::string& name : includes(tree / "runtime/kernel.hpp")) parts.insert(name);
    REQUIRE(parts.size() > 5);
    allowed.insert(parts.begin(), parts.end());
    for (const std::string& part : parts)
        for (const std::string& name : includes(tree / "runtime" / part)) {
            INFO("runtime/" << part << " includes " << name);
            CHECK(allowed.contains(name));
        }
    CHECK(includes(tree / "runtime/kernel_abi.h") == std::vector<std::string>{"stdint.h"});
}

TEST_CASE("every source file begins with its licence: MIT in what users ship, GPL elsewhere") {
    const auto check = [](const std::string& folder, const std::string& licence) {
        for (const fs::path& file : sources(folder)) {
            const auto text = lines(file);
            INFO(fs::relative(file, tree).string());
            REQUIRE_FALSE(text.empty());
            CHECK(text.front().substr(text.front().find(' ') + 1) == "SPDX-License-Identifier: " + licence);
        }
    };
    check("generator", "GPL-2.0-or-later");
    check("cli", "GPL-2.0-or-later");
    check("tests", "GPL-2.0-or-later");
    check("runtime", "MIT");
    if (fs::exists(tree / "generated")) check("generated", "MIT");
}
