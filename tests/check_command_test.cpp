// SPDX-License-Identifier: GPL-2.0-or-later
// lobatto check from the outside: every class of Lagrangian explained in words, and the same for machines.
#include <doctest/doctest.h>

#include <nlohmann/json.hpp>
#include <regex>

#include "tests/support.hpp"

using namespace lobatto;

namespace {

test::Finished check(const std::string& scene, std::vector<std::string> more = {}) {
    more.insert(more.begin(), {LOBATTO_PROGRAM, "check", scene});
    return test::run(more);
}

std::string scene_path(const std::string& name) {
    return LOBATTO_SOURCE_DIR "/scenes/" + name + ".toml";
}

nlohmann::json report_of(const std::string& scene, std::vector<std::string> more = {}) {
    more.push_back("--json");
    const test::Finished done = check(scene, more);
    CHECK_MESSAGE(done.exit_code == 0, done.err);
    return nlohmann::json::parse(done.out);
}

std::string temporary_scene(const test::TemporaryFolder& folder, const std::string& lagrangian,
                            const std::string& coordinates, const std::string& more = "") {
    const std::string path = folder / "scene.toml";
    test::write_text(path, more + "title = \"Test\"\nlagrangian = \"" + lagrangian + "\"\n[coordinates]\n" +
                               coordinates + "[run]\nstep = 0.1\nuntil = 1\n");
    return path;
}

}  // namespace
