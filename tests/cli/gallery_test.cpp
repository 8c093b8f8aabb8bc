// SPDX-License-Identifier: GPL-2.0-or-later
// lobatto gallery from the outside: the same bytes always, and one bad scene does not cost the others.
#include <doctest/doctest.h>

#include "cli/print/gallery_picture.hpp"
#include "tests/support.hpp"

using namespace lobatto;

namespace {

std::string scene_path(const std::string& name) {
    return LOBATTO_SOURCE_DIR "/scenes/" + name + ".toml";
}

test::Finished gallery(const std::string& folder, const std::vector<std::string>& scenes) {
    std::vector<std::string> arguments{LOBATTO_PROGRAM, "gallery", "-o", folder};
    arguments.insert(arguments.end(), scenes.begin(), scenes.end());
    return test::run(arguments);
}

}  // namespace

TEST_CASE("a gallery drawn twice has the same bytes, and its drawings are small and whole") {
    const test::TemporaryFolder cache, one, two;
    const test::EnvironmentVariable variable("LOBATTO_CACHE_DIR", cache.string());
    const std::vector<std::string> scenes{scene_path("pendulum"), scene_path("figure_eight")};
    const test::Finished first = gallery(one.string(), scenes);
    CHECK(first.exit_code == 0);
    CHECK(first.err == "");
    CHECK(test::contains(first.out, "2 of 2 scenes drawn; " + one.string() + "/README.md shows them.\n"));
    CHECK(gallery(two.string(), scenes).exit_code == 0);
    for (const char* name : {"pendulum.svg", "figure_eight.svg"}) {
        const std::string svg = test::read_file(one / name);
        CHECK(svg == test::read_file(two / name));
        CHECK(svg.starts_with("<?xml "));
        CHECK(test::contains(svg, "</svg>"));
        CHECK(
            test::contains(svg, name == std::string("pendulum.svg") ? ">A plane pendulum<" : ">The figure of eight<"));
        CHECK(svg.size() > 8000);
        CHECK(svg.size() < 150000);
    }
    const std::string page = test::read_file(one / "README.md");
    CHECK(test::contains(page, "![A plane pendulum](pendulum.svg)"));
    CHECK(test::contains(page, "![The figure of eight](figure_eight.svg)"));
    // Nothing else is left behind.
    CHECK(std::distance(std::filesystem::directory_iterator(one / ""), std::filesystem::directory_iterator()) == 3);
}

TEST_CASE("a scene that fails is reported without stopping the others") {
    const test::TemporaryFolder cache, folder;
    const test::EnvironmentVariable variable("LOBATTO_CACHE_DIR", cache.string());
    const std::string escape = folder / "escape.toml", wrong = folder / "wrong.toml";
    const std::string rest = "[coordinates]\nx = { position = -1, velocity = 0 }\n[run]\nstep = 0.1\nuntil = 10\n";
    test::write_text(escape, "title = \"Escape\"\nlagrangian = \"x'^2/2 - x^3\"\n" + rest);
    test::write_text(wrong, "title = \"Wrong\"\nlagrangian = \"x'^2/2 - y\"\n" + rest);
    const test::Finished done = gallery(folder / "out", {escape, wrong, scene_path("pendulum")});
    CHECK(done.exit_code == 3);
    CHECK(test::contains(done.err, escape + ": the run stopped in step "));
    CHECK(test::contains(done.err, wrong + ":2:24: unknown name 'y'"));
    CHECK(test::contains(done.out, "1 of 3 scenes drawn; "));
    CHECK(std::filesystem::exists(folder / "out/pendulum.svg"));
    CHECK(!std::filesystem::exists(folder / "out/escape.svg"));
    CHECK(!test::contains(test::read_file(folder / "out/README.md"), "Escape"));
}

TEST_CASE("a gallery overwrites no page and no picture that is not its own") {
    const test::TemporaryFolder folder;
    const auto refused = [&](const std::vector<std::string>& scenes, const std::string& why) {
        const test::Finished done = gallery(folder.string(), scenes);
        CHECK(done.exit_code == 2);
        CHECK_MESSAGE(test::contains(done.err, why), done.err);
    };
    for (const char* name : {"README.md", "pendulum.svg"}) {
        test::write_text(folder / name, "my own work with Lobatto and gnuplot\n");
        const bool is_page = name == std::string("README.md");
        if (!is_page) test::write_text(folder / name, "<svg>mine</svg>");
        const std::string before = test::read_file(folder / name);
        refused({scene_path("pendulum")}, std::string(name) + " is there, and Lobatto did not write it");
        CHECK(test::read_file(folder / name) == before);
        std::filesystem::remove(folder / name);
    }
    refused({scene_path("pendulum"), folder / "pendulum.toml"}, "both pictures would be");
    const std::string wrong = folder / "wrong.toml";
    test::write_text(wrong, "lagrangian = \"x'^2/2\"\n");
    refused({wrong}, wrong + ":1:1: a scene has no coordinates");
}

TEST_CASE("what is drawn is told by the shape of the scene") {
    const auto shape = [](const std::string& name) { return shape_of(read_scene(scene_path(name))); };
    CHECK(shape("pendulum") == Shape::phase);
    CHECK(shape("kepler") == Shape::path);
    CHECK(shape("outer_solar_system") == Shape::path);
    CHECK(shape("double_pendulum") == Shape::path);
    CHECK(shape("swinging_atwood") == Shape::polar);
    CHECK(shape("lagrange_top") == Shape::sphere);
    CHECK(shape("triple_pendulum") == Shape::strobe);
    CHECK(shape("wave_chain") == Shape::waterfall);
    CHECK(shape("toda_lattice") == Shape::series);
}
