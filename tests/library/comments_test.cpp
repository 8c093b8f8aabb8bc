// SPDX-License-Identifier: GPL-2.0-or-later
// The examples in the comments of lobatto.hpp and lobatto.h, as they stand there: compiled together, and run.
#include <doctest/doctest.h>

#include <regex>
#include <sstream>

#include "tests/support.hpp"

namespace {

using namespace lobatto;

// Examples are indented by five blanks behind /// or *, and end where the comment or the indentation does.
std::vector<std::string> examples_of(const std::string& header) {
    std::istringstream lines(test::read_file(LOBATTO_SOURCE_DIR "/library/include/lobatto/" + header));
    const std::regex code(R"(^\s*(///| \*)     (.*)$)");
    std::vector<std::string> examples;
    bool inside = false;
    for (std::string line; std::getline(lines, line);) {
        std::smatch match;
        const bool is_code = std::regex_match(line, match, code);
        if (is_code && !inside) examples.emplace_back();
        if (is_code) examples.back() += match[2].str() + "\n";
        inside = is_code;
    }
    return examples;
}

// What the program of all examples prints. The first one begins it; each of the others goes on from there.
std::string output_of(const std::string& head, const std::vector<std::string>& examples,
                      std::vector<std::string> compiler, const std::string& suffix) {
    const test::TemporaryFolder folder;
    std::string text = head + "int main(void) {\n" + examples.front();
    for (std::size_t i = 1; i < examples.size(); ++i)
        text += "{\n" + examples[i] + "puts(\"-- " + std::to_string(i) + "\");\n}\n";
    const std::string program = folder / "program", source = program + suffix, libraries = LOBATTO_BUILD_DIR "/library";
    test::write_text(source, text + "return 0;\n}\n");
    for (const std::string& word :
         {source, std::string("-o"), program, "-L" + libraries, std::string("-llobatto"), "-Wl,-rpath," + libraries})
        compiler.push_back(word);
    const test::Finished compiled = test::run(compiler);
    INFO(text << compiled.err);
    REQUIRE(compiled.exit_code == 0);
    std::filesystem::copy(LOBATTO_SOURCE_DIR "/scenes/pendulum.toml", folder / "pendulum.toml");
    const test::Finished ran = test::run({"sh", "-c", "cd '" + folder.string() + "' && ./program"});
    INFO(ran.out << ran.err);
    REQUIRE(ran.exit_code == 0);
    CHECK(ran.err.empty());
    return ran.out;
}

const std::string include = "-I" LOBATTO_SOURCE_DIR "/library/include";

}  // namespace

TEST_CASE("the examples in the comments of lobatto.hpp compile without a warning, and do what they say" *
          doctest::test_suite("slow")) {
    const std::vector<std::string> examples = examples_of("lobatto.hpp");
    REQUIRE(examples.size() == 9);
    const std::string said =
        output_of("#include <cstdio>\n#include <fstream>\n#include <lobatto/lobatto.hpp>\n", examples,
                  {"g++", "-std=c++17", "-O0", "-Wall", "-Wextra", "-Werror", "-Wno-unused-variable", include}, ".cpp");
    CHECK(said.starts_with("q = 1.5708 rad\n-- 1\n-- 2\nq = "));
    CHECK(said.find(" after 3, error ") != std::string::npos);
    CHECK(said.find("0: q = 1\n1: q = ") != std::string::npos);  // of the second start, each 20th step of 0.05
    CHECK(said.ends_with("-- 6\n-- 7\n-- 8\n"));                 // all claims hold
}

TEST_CASE("the examples in the comments of lobatto.h compile as C99 without a warning, and do what they say" *
          doctest::test_suite("slow")) {
    const std::vector<std::string> examples = examples_of("lobatto.h");
    REQUIRE(examples.size() == 7);
    const std::string said = output_of("#include <lobatto/lobatto.h>\n#include <stdio.h>\n", examples,
                                       {"gcc", "-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror", include}, ".c");
    CHECK(said.starts_with("q = "));
    CHECK(said.find("61 states, error ") != std::string::npos);
    CHECK(said.find("-- 2\nq = ") != std::string::npos);
    CHECK(said.find("-- 3\n{") != std::string::npos);
    CHECK(said.ends_with("-- 5\n-- 6\n"));
}
