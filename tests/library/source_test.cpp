// SPDX-License-Identifier: GPL-2.0-or-later
// A project that takes this tree in as source, by add_subdirectory or FetchContent: what it then has, and what is not
// forced upon it. tests/packages/test_packages.py builds such a project whole, which takes minutes.
#include <doctest/doctest.h>

#include "tests/support.hpp"

namespace {

using namespace lobatto;

// The project of examples/cmake, with one line changed: how it comes by Lobatto.
void write_project(const std::string& folder, const std::string& way) {
    std::filesystem::copy(LOBATTO_SOURCE_DIR "/examples/cmake", folder);
    std::string text = test::read_file(folder + "/CMakeLists.txt");
    const std::string find = "find_package(Lobatto 0.1 REQUIRED)\n";
    REQUIRE(text.find(find) != std::string::npos);
    // Targets of its own, whose names are those of our folders.
    std::string targets;
    for (const char* name :
         {"analysis", "cli", "commands", "generator", "library", "precompiled", "runtime", "tests", "warnings"})
        targets += "add_custom_target(" + std::string(name) + ")\n";
    text.replace(text.find(find), find.size(), targets + way);
    // One file against our header, without what would have to be built for it.
    text +=
        "add_library(reads_header OBJECT control.cpp)\n"
        "target_include_directories(reads_header PRIVATE "
        "$<TARGET_PROPERTY:Lobatto::lobatto,INTERFACE_INCLUDE_DIRECTORIES>)\n"
        "target_compile_features(reads_header PRIVATE "
        "$<TARGET_PROPERTY:Lobatto::lobatto,INTERFACE_COMPILE_FEATURES>)\n";
    test::write_text(folder + "/CMakeLists.txt", text);
}

std::string succeed(const std::vector<std::string>& command) {
    const test::Finished finished = test::run(command);
    INFO(command.front() << ": " << finished.out << finished.err);
    REQUIRE(finished.exit_code == 0);
    return finished.out + finished.err;
}

bool names_target(const std::string& help, const std::string& target) {
    for (const char* before : {"... ", "\n"})  // Make, Ninja
        for (const char* after : {"\n", ":", " ("})
            if (help.find(before + target + after) != std::string::npos) return true;
    return false;
}

}  // namespace

TEST_SUITE("slow") {
    TEST_CASE("a project takes the tree in as source, and gets the program and the library, no tests and no package") {
        const test::TemporaryFolder folder;
        // Without build/: what a release or a clone has.
        const std::string archive = folder / "lobatto.tar.gz";
        succeed({"tar", "-czf", archive, "-C", LOBATTO_SOURCE_DIR, "--exclude=./build", "--exclude=./out",
                 "--exclude=./.git", "."});
        const std::pair<const char*, std::string> ways[] = {
            {"add_subdirectory", "add_subdirectory(" LOBATTO_SOURCE_DIR " lobatto)\n"},
            {"FetchContent", "include(FetchContent)\nFetchContent_Declare(lobatto URL file://" + archive +
                                 " DOWNLOAD_EXTRACT_TIMESTAMP ON)\nFetchContent_MakeAvailable(lobatto)\n"}};
        for (const auto& way : ways)
            for (const char* generator : {"Ninja", "Unix Makefiles"}) {
                INFO(std::string(way.first) << ", " << std::string(generator));
                const std::string project = folder / (std::string(way.first) + " " + generator);
                write_project(project, way.second);
                const std::string build = project + "/build";
                const std::string said = succeed({"cmake", "-S", project, "-B", build, "-G", generator});
                CHECK(said.find("Warning") == std::string::npos);
                const std::string help = succeed({"cmake", "--build", build, "--target", "help"});
                for (const char* wanted : {"lobatto", "liblobatto", "generator"})
                    CHECK_MESSAGE(names_target(help, wanted), std::string(wanted));
                for (const char* unwanted : {"lobatto_tests", "bench_problems", "lobatto_bench", "test"})
                    CHECK_MESSAGE(!names_target(help, unwanted), std::string(unwanted));
                CHECK_FALSE(std::filesystem::exists(build + "/CPackConfig.cmake"));
                succeed({"cmake", "--build", build, "--target", "reads_header"});
            }
    }
}
