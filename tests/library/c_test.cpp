// SPDX-License-Identifier: GPL-2.0-or-later
// lobatto.h, called by programs of C99 that have nothing but the header and the shared object.
#include <doctest/doctest.h>

#include <regex>

#include "tests/support.hpp"

using namespace lobatto;

namespace {

// Compiles a program, by default of this folder, and runs it with the paths of scenes.
test::Finished run_c(const std::filesystem::path& source, const std::vector<std::string>& scenes) {
    const test::TemporaryFolder folder;
    const std::string program = folder / "program", libraries = LOBATTO_BUILD_DIR "/library";
    const test::Finished compiled = test::run(
        {"gcc", "-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror", "-I", LOBATTO_SOURCE_DIR "/library/include",
         (std::filesystem::path(LOBATTO_SOURCE_DIR "/tests/library") / source).string(), "-o", program,
         "-L" + libraries, "-llobatto", "-lm", "-Wl,-rpath," + libraries});
    CAPTURE(compiled.err);
    REQUIRE(compiled.exit_code == 0);
    std::vector<std::string> command = {program};
    for (const std::string& scene : scenes) command.push_back(LOBATTO_SOURCE_DIR "/scenes/" + scene + ".toml");
    return test::run(command);
}

}  // namespace

TEST_CASE("from C99 a scene is derived, checked, chosen for and proved, and what is refused says why" *
          doctest::test_suite("slow")) {
    const test::Finished ran = run_c("known.c", {"pendulum", "rod_pendulum"});
    CAPTURE(ran.out);
    REQUIRE(ran.exit_code == 0);
    for (const char* line : {
             "latex: whole, file none\n\\documentclass",
             "json: whole, file none\n{",
             "check: whole, file none\n{",
             "stability: whole, file none\n{",
             "emit: whole, file pendulum.hpp\n// ",
             "plain: whole, file pendulum.hpp\n// ",
             "splitting: status 2, " LOBATTO_SOURCE_DIR "/scenes/pendulum.toml: what is exact here is of Lobatto and "
             "Gauss; choose one (--points 4), or ask for the "
             "limits of the method alone: lobatto stability --splitting 6\n",
             "two methods: status 2, points, stages and splitting name different methods; give one of them\n",
             "no scene: status 2, there is no scene: NULL was given\n",
             "chosen: ",
             "too much: status 2, an error of 0.9 cannot be promised",
             "proof: all hold\n",
             "no scene proved: status 2, there is no scene: NULL was given\n",
             "lobatto stability knows no constraints yet; run, sweep, emit, derive, check, verify, tune and tradeoff "
             "do",
         })
        CHECK_MESSAGE(ran.out.find(line) != std::string::npos, line);
}

TEST_CASE("from C99 a motion tells what it met, what holds it, and what a step does" * doctest::test_suite("slow")) {
    const test::Finished ran = run_c("motion.c", {"bouncing_ball", "rod_pendulum", "pendulum"});
    CAPTURE(ran.out);
    REQUIRE(ran.exit_code == 0);
    CHECK(ran.out.starts_with("met: "));
    CHECK(ran.out.find("unknown: status 2, unknown parameter 'omga'; declared: m, omega. Did you mean 'omega'?\n") !=
          std::string::npos);
    CHECK(ran.out.find("warning: the error is ") != std::string::npos);
}

TEST_CASE("NULL in place of a handle crashes no function of lobatto.h" * doctest::test_suite("slow")) {
    std::string header = test::read_file(LOBATTO_SOURCE_DIR "/library/include/lobatto/lobatto.h");
    header = std::regex_replace(header, std::regex("/\\*[^*]*\\*+(?:[^/*][^*]*\\*+)*/"), "");
    const std::regex declaration("LOBATTO_C_API[^(;]*?(lobatto_\\w+)\\(([^)]*)\\);"), comma(",");
    std::string calls;
    int functions = 0;
    for (std::sregex_iterator at(header.begin(), header.end(), declaration), end; at != end; ++at, ++functions) {
        const std::string name = (*at)[1], parameters = (*at)[2];
        std::string arguments;
        for (std::sregex_token_iterator word(parameters.begin(), parameters.end(), comma, -1), none; word != none;
             ++word) {
            const std::string type = *word;
            if (type == "void") continue;
            const bool is_written = std::regex_search(type, std::regex("\\*\\*|^\\s*(double|size_t)\\*"));
            const bool is_pointer = type.find('*') != std::string::npos;
            arguments += (arguments.empty() ? "" : ", ") + std::string(is_written ? "room" : is_pointer ? "NULL" : "0");
        }
        const std::string call = name + "(" + arguments + ")";
        calls += name.ends_with("_status") ? "    if (" + call + " != 4) return 1;\n" : "    (void)" + call + ";\n";
    }
    REQUIRE(functions > 90);
    const test::TemporaryFolder folder;
    test::write_text(folder / "nothing.c",
                     "#include <lobatto/lobatto.h>\nint main(void) {\n    static double numbers[8];\n"
                     "    void* const room = numbers;\n" +
                         calls + "    return 0;\n}\n");
    const test::Finished ran = run_c(folder / "nothing.c", {});
    CAPTURE(calls);
    CHECK(ran.exit_code == 0);
}
