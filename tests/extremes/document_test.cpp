// SPDX-License-Identifier: GPL-2.0-or-later
// docs/extremes.md lists the rows that the tests check, all of them and nothing else.
#include "tests/extremes/extremes.hpp"

using namespace lobatto::test;

// LOBATTO_REFRESH=1 lobatto_tests -tc="docs/extremes.md*" writes it anew.
TEST_CASE("docs/extremes.md is the table that the tests check") {
    const std::string path = LOBATTO_SOURCE_DIR "/docs/extremes.md";
    std::string text = read_file(path);
    const std::string mark = "<!-- from here on written by tests/extremes/document_test.cpp -->\n";
    const std::size_t end = text.find(mark);
    REQUIRE(end != std::string::npos);
    std::string expected = text.substr(0, end + mark.size());
    for (const auto& [number, part] : Extremes::parts()) expected += part->markdown();
    if (std::getenv("LOBATTO_REFRESH") != nullptr) write_text(path, text = expected);
    CHECK(Extremes::parts().size() == 12);
    CHECK_MESSAGE(text == expected, "LOBATTO_REFRESH=1 lobatto_tests -tc=\"docs/extremes.md*\" writes it anew");
}
