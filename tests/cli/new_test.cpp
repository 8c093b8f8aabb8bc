// SPDX-License-Identifier: GPL-2.0-or-later
// lobatto new: scenes to begin with.
#include <doctest/doctest.h>

#include "cli/print/embedded.hpp"
#include "generator/scene/scene.hpp"
#include "tests/support.hpp"

using namespace lobatto;

namespace {

test::Finished make(const test::TemporaryFolder& folder, const std::string& kind, const std::string& name) {
    return test::run({LOBATTO_PROGRAM, "new", kind, folder / name});
}

}  // namespace

TEST_CASE("every kind of new scene runs at once, with an error below a millionth of the motion, and has a view") {
    const test::TemporaryFolder folder;
    CHECK(scene_templates.size() == 12);
    for (const EmbeddedText& one : scene_templates) {
        const std::string file(one.name), kind = file.substr(0, file.size() - 5);
        CAPTURE(kind);
        CHECK(make(folder, kind, "my_" + kind).exit_code == 0);
        const std::string scene = folder / ("my_" + file);
        CHECK(read_scene(scene).title.starts_with("My "));
        const test::Finished ran = test::run({LOBATTO_PROGRAM, "run", scene, "-o", folder / (kind + ".csv"), "--json"});
        CHECK(ran.exit_code == 0);
        CHECK(ran.err == "");
        const std::size_t at = ran.out.find("\"at_end\":") + 9;
        CHECK(std::stod(ran.out.substr(at)) < 1e-6);
        CHECK(test::read_file(scene).find("# ") == 0);
    }
}

TEST_CASE("a new scene never replaces a file, and an unknown kind is told with the nearest one") {
    const test::TemporaryFolder folder;
    test::write_text(folder / "mine.toml", "mine");
    const test::Finished there = make(folder, "pendulum", "mine");
    CHECK(there.exit_code == 2);
    CHECK(there.err.find("mine.toml exists") != std::string::npos);
    CHECK(test::read_file(folder / "mine.toml") == "mine");
    const test::Finished unknown = make(folder, "pendulm", "x");
    CHECK(unknown.exit_code == 2);
    CHECK(unknown.err.find("Did you mean 'pendulum'?") != std::string::npos);
    CHECK(make(folder, "pendulum", "a\"b").exit_code == 2);
    CHECK(make(folder, "pendulum", "no/such/folder/x").exit_code == 4);
    for (const char* name : {".toml", "-x", "_", "---"}) CHECK(make(folder, "pendulum", name).exit_code == 2);
    CHECK(make(folder, "pendulum", "a b").out.find("'") != std::string::npos);
    CHECK(test::run({LOBATTO_PROGRAM, "new"}).exit_code == 2);
}

TEST_CASE("new --list has a line for each kind") {
    const test::Finished list = test::run({LOBATTO_PROGRAM, "new", "--list"});
    CHECK(list.exit_code == 0);
    CHECK(std::count(list.out.begin(), list.out.end(), '\n') == static_cast<std::ptrdiff_t>(scene_templates.size()));
    CHECK(list.out.find("  n-body            Bodies that attract one another") != std::string::npos);
}
