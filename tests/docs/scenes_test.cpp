// SPDX-License-Identifier: GPL-2.0-or-later
// Whoever copies a scene out of a document can run it.
#include <doctest/doctest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "tests/support.hpp"

using namespace lobatto;

namespace {

namespace fs = std::filesystem;

// The blocks of a document that are whole scenes; others show a section of one.
std::vector<std::string> scenes_in(const std::string& page) {
    std::vector<std::string> scenes;
    const std::string begin = "```toml\n";
    for (std::size_t at = page.find(begin); at != std::string::npos; at = page.find(begin, at)) {
        at += begin.size();
        const std::string block = page.substr(at, page.find("```", at) - at);
        if (block.find("[run]") != std::string::npos) scenes.push_back(block);
    }
    return scenes;
}

}  // namespace

TEST_CASE("every whole scene of the documents runs" * doctest::test_suite("slowest")) {
    const fs::path tree = LOBATTO_SOURCE_DIR;
    std::vector<fs::path> documents{tree / "README.md"};
    for (const auto& entry : fs::directory_iterator(tree / "docs"))
        if (entry.path().extension() == ".md" && entry.path().filename() != "coming_from.md")  // which has its own test
            documents.push_back(entry.path());
    const test::TemporaryFolder folder;
    int count = 0;
    for (const fs::path& document : documents)
        for (const std::string& scene : scenes_in(test::read_file(document))) {
            INFO(document.filename().string() << ":\n" << scene);
            test::write_text(folder / "system.toml", scene);
            const test::Finished done =
                test::run({LOBATTO_PROGRAM, "run", folder / "system.toml", "-o", folder / "system.csv", "--quiet"});
            INFO(done.err);
            CHECK(done.exit_code == 0);
            ++count;
        }
    CHECK(count >= 10);
}
