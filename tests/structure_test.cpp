// SPDX-License-Identifier: GPL-2.0-or-later
// The direction of the arrows in docs/architecture.md, read off the sources: who may include whom, and under which
// licence.
#include <doctest/doctest.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
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

// "generator/emit/kernel.cpp includes Eigen/Core" for every include of a folder's sources that is not allowed there.
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

namespace {

// Which folders a folder may include besides itself. "analysis/" is analysis and all folders in it.
struct Room {
    std::string folder;
    std::vector<std::string> may_include;
};

// Each stands after those that it may include, so no include goes round in a circle.
const std::vector<Room> rooms = {
    {"generator/formula/text", {}},
    {"generator/formula", {"generator/formula/text"}},
    {"generator/graph", {"generator/formula/"}},
    {"generator/method", {"generator/formula/", "generator/graph"}},
    {"generator/scene/file", {"generator/formula/", "generator/method"}},
    {"generator/scene", {"generator/formula/", "generator/method", "generator/scene/file"}},
    {"generator/scene/bodies", {"generator/formula/", "generator/scene"}},
    {"generator/mechanics/algebra", {"generator/formula/", "generator/graph", "generator/scene"}},
    {"generator/mechanics/repeated",
     {"generator/formula/", "generator/graph", "generator/mechanics/algebra", "generator/scene"}},
    {"generator/mechanics/system",
     {"generator/formula/", "generator/graph", "generator/mechanics/algebra", "generator/mechanics/repeated",
      "generator/scene"}},
    {"generator/mechanics/constraints",
     {"generator/formula/", "generator/graph", "generator/mechanics/system", "generator/scene"}},
    {"generator/mechanics/clock", {"generator/formula/", "generator/mechanics/system", "generator/scene"}},
    {"generator/mechanics/structure",
     {"generator/formula/", "generator/graph", "generator/mechanics/algebra", "generator/mechanics/repeated",
      "generator/mechanics/system", "generator/method", "generator/scene"}},
    {"generator/mechanics",
     {"generator/formula/", "generator/graph", "generator/mechanics/algebra", "generator/mechanics/clock",
      "generator/mechanics/constraints", "generator/mechanics/repeated", "generator/mechanics/structure",
      "generator/mechanics/system", "generator/method", "generator/scene"}},
    {"generator/programs", {"generator/formula/", "generator/graph", "generator/mechanics/", "generator/method"}},
    {"generator/emit", {"generator/formula/", "generator/graph", "generator/mechanics/", "generator/programs"}},
    {"generator/describe",
     {"generator/formula/", "generator/graph", "generator/mechanics/", "generator/method", "generator/programs"}},
    {"generator/check", {"generator/formula/", "generator/mechanics/", "generator/method", "generator/programs"}},
    {"generator/paper", {"generator/formula/", "generator/graph", "generator/mechanics/", "generator/method"}},
    {"generator", {"generator/emit", "generator/formula/", "generator/mechanics/", "generator/programs"}},
    {"runtime", {}},
    {"runtime/kernel/base", {}},
    {"runtime/kernel/iteration", {"runtime/kernel/base"}},
    {"runtime/kernel/steppers", {"runtime/kernel/base", "runtime/kernel/iteration"}},
    {"runtime/kernel", {"runtime/kernel/base", "runtime/kernel/iteration", "runtime/kernel/steppers"}},
    {"runtime/kernel/export", {"runtime/kernel"}},
    {"runtime/files", {"runtime"}},
    {"runtime/build", {"runtime", "runtime/files", "runtime/kernel", "runtime/kernel/base"}},
    {"runtime/run", {"runtime", "runtime/build", "runtime/files", "runtime/kernel", "runtime/kernel/base"}},
    {"runtime/run/ensemble", {"runtime", "runtime/build", "runtime/kernel", "runtime/run"}},
    {"runtime/measure", {"runtime", "runtime/build", "runtime/kernel/base", "runtime/run"}},
    {"analysis/kernel", {"generator/", "runtime/"}},
    {"analysis", {"generator/", "runtime/"}},
    {"analysis/stability", {"analysis", "analysis/kernel", "generator/", "runtime/"}},
    {"analysis/accuracy/formulas", {"analysis", "generator/", "runtime/"}},
    {"analysis/accuracy/companion", {"analysis/accuracy/formulas", "generator/", "runtime/"}},
    {"analysis/accuracy/watch",
     {"analysis/accuracy/companion", "analysis/kernel", "analysis/stability", "generator/", "runtime/"}},
    {"analysis/accuracy",
     {"analysis", "analysis/accuracy/companion", "analysis/accuracy/formulas", "analysis/accuracy/watch",
      "analysis/kernel", "analysis/stability", "generator/", "runtime/"}},
    {"analysis/sweep", {"analysis", "analysis/accuracy/", "analysis/kernel", "generator/", "runtime/"}},
    {"analysis/proof", {"analysis", "analysis/accuracy/", "analysis/kernel", "generator/", "runtime/"}},
    {"analysis/tradeoff",
     {"analysis", "analysis/accuracy/", "analysis/kernel", "analysis/stability", "generator/", "runtime/"}},
    {"library/include/lobatto", {}},
    {"library", {"library/include/lobatto", "analysis/", "generator/", "runtime/"}},
    {"cli/options", {"library", "library/include/lobatto", "analysis/", "generator/", "runtime/"}},
    {"cli/print", {"analysis/", "generator/", "runtime/", "cli/options"}},
    {"cli/table", {"analysis/", "generator/", "runtime/"}},
    {"cli/ranks", {"library", "analysis/", "generator/", "runtime/"}},
    {"cli/paper", {"library", "analysis/", "generator/", "runtime/", "cli/print"}},
    {"cli/tradeoff", {"analysis/", "runtime/", "cli/print"}},
    {"cli/view", {"library", "analysis/", "generator/", "runtime/", "cli/options", "cli/print"}},
    {"cli/plot", {"generator/formula/", "runtime/", "cli/print", "cli/table"}},
    {"cli/commands",
     {"library", "analysis/", "generator/", "runtime/", "cli/options", "cli/paper", "cli/plot", "cli/print",
      "cli/ranks", "cli/table", "cli/tradeoff", "cli/view"}},
    {"cli", {"library", "cli/commands", "cli/print", "runtime/"}},
};

// Whether "analysis/" or "analysis/sweep" names a folder.
bool names(const std::string& allowed, const std::string& folder) {
    return allowed.ends_with('/') ? (folder + '/').starts_with(allowed) : folder == allowed;
}

bool may_include(const Room& room, const std::string& folder) {
    return std::any_of(room.may_include.begin(), room.may_include.end(),
                       [&](const std::string& allowed) { return names(allowed, folder); });
}

}  // namespace

TEST_CASE("every folder includes only folders that stand before it") {
    std::set<std::string> before;
    for (const Room& room : rooms) {
        for (const Room& other : rooms)
            if (may_include(room, other.folder)) {
                INFO(room.folder << " may include " << other.folder);
                CHECK(before.contains(other.folder));
            }
        before.insert(room.folder);
        int looked_at = 0;
        for (const fs::path& file : sources(room.folder)) {
            if (fs::relative(file.parent_path(), tree) != room.folder) continue;
            ++looked_at;
            for (const std::string& name : includes(file)) {
                fs::path included = tree / name;
                if (!fs::exists(included)) included = (file.parent_path() / name).lexically_normal();
                if (!fs::exists(included)) continue;  // of a library
                const std::string folder = fs::relative(included.parent_path(), tree);
                INFO(fs::relative(file, tree).string() << " includes " << name);
                CHECK((folder == room.folder || may_include(room, folder)));
            }
        }
        INFO(room.folder);
        CHECK(looked_at > 0);
    }
}

TEST_CASE("every folder of sources has its place in that order") {
    for (const char* half : {"generator", "runtime", "analysis", "library", "cli"})
        for (const fs::path& file : sources(half)) {
            const std::string folder = fs::relative(file.parent_path(), tree);
            INFO(folder);
            CHECK(std::any_of(rooms.begin(), rooms.end(), [&](const Room& room) { return room.folder == folder; }));
        }
}

TEST_CASE("the generator knows nothing of the runtime's libraries, and the runtime nothing of the generator's") {
    report(trespasses("generator", [](const std::string& name) {
        return !begins_with_any(name, {"runtime/", "Eigen", "eigen3", "CLI"});
    }));
    report(trespasses("runtime", [](const std::string& name) {
        return !begins_with_any(name, {"generator/", "ginac", "cln", "toml", "CLI"});
    }));
    report(trespasses("analysis", [](const std::string& name) { return !begins_with_any(name, {"CLI"}); }));
}

TEST_CASE("the command line derives, compiles and runs by the library alone, but for the paper's own experiments") {
    int looked_at = 0;
    for (const fs::path& file : sources("cli")) {
        if (file.parent_path().filename() == "paper") continue;
        ++looked_at;
        for (const std::string& name : includes(file)) {
            INFO(fs::relative(file, tree).string() << " includes " << name);
            CHECK_FALSE(begins_with_any(name, {"generator/pipeline.hpp", "analysis/kernel/kernel_of.hpp",
                                               "analysis/kernel/derived_kernel.hpp"}));
        }
    }
    CHECK(looked_at > 40);
    CHECK(fs::exists(tree / "analysis/kernel/kernel_of.hpp"));
}

TEST_CASE("what emitted kernels include stands on the C and C++ standard libraries alone") {
    const std::set<std::string> allowed = {"cmath",   "concepts",   "cstdint", "limits",  "type_traits",
                                           "utility", "quadmath.h", "mpfr.h",  "cstddef", "new"};
    const fs::path kernel = tree / "runtime/kernel";
    REQUIRE(includes(kernel / "kernel.hpp").size() > 5);
    for (const fs::path& file : sources("runtime/kernel"))
        for (const std::string& name : includes(file)) {
            INFO(fs::relative(file, tree).string() << " includes " << name);
            const fs::path part = (file.parent_path() / name).lexically_normal();
            CHECK((allowed.contains(name) || file.filename() == "abi.h" ||
                   (fs::exists(part) && part.string().starts_with(kernel.string()))));
        }
    CHECK(includes(tree / "runtime/kernel/abi.h") == std::vector<std::string>{"stdint.h"});
}

TEST_CASE("no two headers define a type of the same name: the linker would mix them up without a word") {
    static const std::regex definition(R"(^(?:struct|class|enum class) (\w+)(?: :[^:].*)? \{.*)"),
        opening(R"(^namespace (lobatto\S*) \{$)");
    std::map<std::string, std::string> home;  // by namespace and name
    for (const char* half : {"generator", "runtime", "analysis", "library", "cli"})
        for (const fs::path& file : sources(half)) {
            // Kernel headers are compiled into kernels, not into the program.
            if (file.extension() == ".cpp" || file.string().find("runtime/kernel/") != std::string::npos) continue;
            std::string space;
            std::smatch match;
            for (const std::string& line : lines(file)) {
                if (std::regex_match(line, match, opening)) space = match[1];
                if (!std::regex_match(line, match, definition)) continue;
                const std::string name = space + "::" + match[1].str(), here = fs::relative(file, tree);
                const std::string& first = home.emplace(name, here).first->second;
                INFO(name << " is defined in " << first << " and in " << here);
                CHECK(first == here);
            }
        }
    CHECK(home.size() > 200);
}

namespace {

// The functions that begin in the first column of a file, as "name(types of its parameters)".
std::set<std::string> signatures(const fs::path& file, bool only_anonymous) {
    static const std::regex declaration(R"(^[\w:<>,&*\[\] ]+[ &*](\w+)\((.*)\)[^()]*[;{]$)"),
        name(R"([ &*]\w+(?: = .*)?$)");
    std::set<std::string> result;
    std::smatch match;
    bool is_anonymous = false;
    std::string joined;
    for (const std::string& line : lines(file)) {
        if (line == "namespace {") is_anonymous = true;
        if (line == "}  // namespace") is_anonymous = false;
        const bool continues = !joined.empty() && line.starts_with(' ');
        if (!continues && (line.empty() || std::isalpha(static_cast<unsigned char>(line[0])) == 0)) continue;
        joined = continues ? joined + ' ' + line.substr(line.find_first_not_of(' ')) : line;
        if (!joined.ends_with(';') && !joined.ends_with('{')) continue;
        if (joined.size() < 1000 && is_anonymous == only_anonymous && std::regex_match(joined, match, declaration)) {
            std::string types, parameter;
            int depth = 0;
            for (const char c : match[2].str() + ',') {
                depth += (c == '<' || c == '(') - (c == '>' || c == ')');
                if (c == ',' && depth == 0) {
                    types += std::regex_replace(parameter, name, "") + ';';
                    parameter.clear();
                } else if (c != ' ' || !parameter.empty()) {
                    parameter += c;
                }
            }
            result.insert(match[1].str() + '(' + types + ')');
        }
        joined.clear();
    }
    return result;
}

}  // namespace

TEST_CASE(
    "no function of one file hides one of a header: in a folder that is one translation unit it would be called") {
    std::map<std::string, std::string> declared;
    for (const char* half : {"generator", "runtime", "analysis", "library", "cli"})
        for (const fs::path& file : sources(half))
            if (file.extension() == ".hpp" && file.string().find("runtime/kernel/") == std::string::npos)
                for (const std::string& one : signatures(file, false)) declared.emplace(one, fs::relative(file, tree));
    CHECK(declared.contains("print_row(const std::string&;const std::string&;)"));
    CHECK(declared.size() > 500);
    for (const char* half : {"generator", "runtime", "analysis", "library", "cli"})
        for (const fs::path& file : sources(half))
            if (file.extension() == ".cpp")
                for (const std::string& one : signatures(file, true)) {
                    const auto header = declared.find(one);
                    if (header == declared.end()) continue;
                    FAIL_CHECK(one << " of " << fs::relative(file, tree).string() << " hides that of "
                                   << header->second);
                }
}

TEST_CASE("every header states its one idea after the licence, and so does every source without a header of its name") {
    int looked_at = 0;
    for (const char* part : {"generator", "runtime", "analysis", "library", "cli", "bench", "python", "tests"})
        for (const fs::path& file : sources(part)) {
            fs::path header = file;
            if (file.extension() == ".cpp" && fs::exists(header.replace_extension(".hpp"))) continue;
            ++looked_at;
            const auto text = lines(file);
            INFO(fs::relative(file, tree).string());
            REQUIRE(text.size() > 1);
            CHECK((text[1].starts_with("//") || text[1].starts_with(" * ")));
        }
    CHECK(looked_at > 500);
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
    check("analysis", "GPL-2.0-or-later");
    check("library", "GPL-2.0-or-later");
    check("cli", "GPL-2.0-or-later");
    check("tests", "GPL-2.0-or-later");
    check("runtime", "MIT");
    if (fs::exists(tree / "generated")) check("generated", "MIT");
}
