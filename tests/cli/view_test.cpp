// SPDX-License-Identifier: GPL-2.0-or-later
// lobatto view: the page, its data and [view]. What browsers make of it: tests/browser/run.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

#include "cli/view/figures.hpp"
#include "cli/view/page.hpp"
#include "generator/scene/scene.hpp"
#include "tests/support.hpp"

using namespace lobatto;

namespace {

const std::string tree = LOBATTO_SOURCE_DIR;

std::string page_of_scene(const std::string& scene, std::vector<std::string> options = {}) {
    const test::TemporaryFolder folder;
    const std::string page = folder / "page.html";
    std::vector<std::string> command{LOBATTO_PROGRAM, "view", scene, "-o", page, "--quiet"};
    command.insert(command.end(), options.begin(), options.end());
    const test::Finished finished = test::run(command);
    INFO(finished.err);
    REQUIRE(finished.exit_code == 0);
    std::ifstream file(page);
    return {std::istreambuf_iterator<char>(file), {}};
}

nlohmann::json data_of(const std::string& page) {
    const std::string begin = "<script type=\"application/json\" id=\"data\">";
    const std::size_t from = page.find(begin) + begin.size();
    return nlohmann::json::parse(page.substr(from, page.find("</script>", from) - from));
}

Scene scene_with(const std::string& view) {
    return read_scene(Source("view.toml",
                             "lagrangian = \"m*q'^2/2 - m*q^2/2\"\n[coordinates]\nq = { position = 1, velocity = 0 }\n"
                             "[parameters]\nm = 1\nl = 2\n[run]\nstep = 0.1\nuntil = 1\n[view]\n" +
                                 view));
}

std::string error_of(const std::string& view) {
    try {
        scene_with(view);
    } catch (const InputError& error) {
        const std::string text = error.what();
        return text.substr(0, text.find('\n'));
    }
    return "no error";
}

}  // namespace

TEST_CASE("the page of a scene carries its motion, and asks nothing of the net") {
    const std::string page = page_of_scene(tree + "/scenes/double_pendulum.toml", {"--until", "5"});
    CHECK(page.starts_with("<!doctype html>"));
    CHECK(page.find("http:") == std::string::npos);
    CHECK(page.find("https:") == std::string::npos);
    CHECK(page.find("default-src 'none'") != std::string::npos);
    const nlohmann::json data = data_of(page);
    REQUIRE(data["runs"].size() == 1);
    const nlohmann::json& run = data["runs"][0];
    CHECK(run["figures"].size() == 4);
    CHECK(run["events"].size() >= 1);
    CHECK(run["event_names"][0] == "a = 0 rising");
    CHECK(data["charts"].size() == 5);  // a, b, H, phase portrait, energy error
    CHECK(data["rate"].get<double>() > 0);
}

TEST_CASE("the energy error on the page is that of the steps, not of the states drawn between them") {
    const test::TemporaryFolder folder;
    const std::string scene = folder / "x.toml";
    test::write_text(scene,
                     "lagrangian = \"q'^2/2 + cos(q)\"\n[coordinates]\nq = { position = 2, velocity = 0 }\n"
                     "[method]\npoints = 8\n[run]\nstep = 0.2\nuntil = 20\n");
    const nlohmann::json energy = data_of(page_of_scene(scene))["runs"][0]["channels"].back();
    CHECK(energy["most"].get<double>() < 1e-11);  // 1e-10 between steps
    CHECK(energy["least"].get<double>() > -1e-11);
}

TEST_CASE("a second call replaces the page of the first, and nothing that Lobatto did not write") {
    const test::TemporaryFolder folder;
    const std::string page = folder / "page.html";
    const std::vector<std::string> command{
        LOBATTO_PROGRAM, "view", tree + "/scenes/kepler.toml", "--until", "5", "--quiet", "-o", page};
    for (int call = 0; call < 2; ++call) {
        const test::Finished finished = test::run(command);
        INFO(finished.err);
        CHECK(finished.exit_code == 0);
    }
    test::write_text(page, "<!doctype html>\n<title>A page of somebody else</title>\n");
    CHECK(test::run(command).exit_code == 2);
}

TEST_CASE("titles and labels cannot break out of the page") {
    const test::TemporaryFolder folder;
    const std::string scene = folder / "x.toml";
    std::ofstream(scene) << "title = \"</script><script>alert(1)</script><!--\"\nlagrangian = \"q'^2/2 - q^2/2\"\n"
                            "[coordinates]\nq = { position = 1, velocity = 0, unit = \"<b>m</b>\" }\n"
                            "[run]\nstep = 0.1\nuntil = 1\n";
    const std::string page = page_of_scene(scene);
    CHECK(page.find("alert(1)</script>") == std::string::npos);
    CHECK(page.find("<b>m") == std::string::npos);
    CHECK(page.find("<title>&lt;/script&gt;") != std::string::npos);
    CHECK(data_of(page)["title"] == "</script><script>alert(1)</script><!--");
}

TEST_CASE("sixteen bits and base64 keep a channel to a 65535th of its range") {
    ViewMotion motion;
    motion.times = {0, 1, 2};
    motion.channels = {{-1, 0.25, 3}, {7, 7, 7}};
    const nlohmann::json data = data_of(page_of("title", {motion}, {}, 1));
    const nlohmann::json& channels = data["runs"][0]["channels"];
    CHECK(channels[1] == 7.0);
    CHECK(channels[0]["least"] == -1.0);
    // 0, 65535 * 1.25 / 4 = 20479.7, 65535, as two bytes each, the lower first: 00 00 00 50 ff ff
    CHECK(channels[0]["d"] == "AAAAUP//");
    CHECK(data["runs"][0]["times"] == "AAAAAAAAgD8AAABA");
}

TEST_CASE("ten minutes of motion make a page of at most 3 MB, however many steps they have" *
          doctest::test_suite("slow")) {
    const std::string page = page_of_scene(tree + "/scenes/pleiades.toml", {"--until", "3", "--step", "1e-4"});
    CHECK(page.size() < 3'000'000);
    CHECK(page_of_scene(tree + "/scenes/pendulum.toml", {"--until", "600", "--step", "0.005"}).size() < 3'000'000);
}

TEST_CASE("every scene of the repository has something to look at that moves") {
    for (const auto& entry : std::filesystem::directory_iterator(tree + "/scenes")) {
        if (entry.path().extension() != ".toml") continue;
        CAPTURE(entry.path().string());
        const std::vector<DrawnFigure> figures = figures_of(read_scene(entry.path()));
        CHECK(std::any_of(figures.begin(), figures.end(), [](const DrawnFigure& drawn) { return !drawn.still; }));
    }
}

TEST_CASE("what coordinates tell: bodies with their rods, hands, profiles, boxes") {
    const auto kinds = [](const std::string& name) {
        std::multiset<MovingFigure::Kind> kinds;
        for (const DrawnFigure& drawn : figures_of(read_scene(tree + "/scenes/" + name + ".toml")))
            kinds.insert(drawn.figure.kind);
        return kinds;
    };
    const auto line = MovingFigure::Kind::line, point = MovingFigure::Kind::point;
    CHECK(kinds("rod_double_pendulum") ==
          std::multiset{line, line, point, point, point});  // two rods, a pivot, two bobs
    CHECK(kinds("pendulum") == std::multiset{line, point, point});
    CHECK(kinds("figure_eight") == std::multiset{point, point, point});
    CHECK(kinds("wave_chain").count(line) == 1);
    CHECK(kinds("rigid_top").count(line) == 6);
    CHECK(figures_of(read_scene(tree + "/scenes/outer_solar_system.toml")).front().figure.corners[0].size() == 3);
}

TEST_CASE("[view] draws what it names, arrays too") {
    const Scene scene = scene_with(
        "\"bead[i]\" = { point = [\"i*q\", 0], count = 3, trail = false }\nspan = { spring = [[0, 0], [\"q\", \"l\"]] "
        "}\n"
        "disc = { circle = [0, \"q\"], radius = \"l/4\" }\nplot = [\"q\", \"q' + H\"]");
    REQUIRE(scene.figures.size() == 5);
    CHECK(scene.figures[2].written == "bead[3]");
    CHECK(scene.figures[2].corners[0][0].is_equal(3 * scene.coordinates[0].position));
    CHECK_FALSE(scene.figures[2].trail);
    CHECK(scene.figures[4].trail);
    CHECK(scene.plots[1].text == "q' + H");
}

TEST_CASE("mistakes in [view] are told with their place and their mend") {
    CHECK(error_of("rod = { lin = [[0, 0], [1, 1]] }") ==
          "view.toml:11:9: unknown key 'lin' in figure rod; known: point, line, spring, circle, radius, trail, closed, "
          "count. Did you mean 'line'?");
    CHECK(error_of("rod = { trail = true }") ==
          "view.toml:11:1: figure rod has no shape; add one of point, line, spring and circle, as in { line = [[0, 0], "
          "[\"l*sin(q)\", \"-l*cos(q)\"]] }");
    CHECK(error_of("rod = { line = [0, 0] }") ==
          "view.toml:11:17: a place is [x, y] or [x, y, z]: numbers, or formulas in quotes");
    CHECK(error_of("rod = { line = [[0, 0], [1, 1, 1]] }") ==
          "view.toml:11:25: one place of this figure lies in the plane, another in space");
    CHECK(error_of("rod = { line = [[0, 0], [\"k\", 1]] }")
              .starts_with("view.toml:11:27: unknown name 'k' in the figure rod"));
    CHECK(error_of("disc = { circle = [0, 0] }") ==
          "view.toml:11:1: a circle, and nothing else, has a radius, as in radius = 1");
    CHECK(error_of("rod = { line = [[0, 0], [1, 1]], trail = true }") ==
          "view.toml:11:34: points and circles leave trails; a line does not");
    CHECK(error_of("plot = \"q\"") == "view.toml:11:8: plot must be a list of formulas such as [\"theta\", \"H\"]");
    CHECK(error_of("q = { point = [0, 0] }").starts_with("view.toml:11:1: "));
}

TEST_CASE("a scene stands beside itself by another method; wrong options are told") {
    const nlohmann::json data =
        data_of(page_of_scene(tree + "/scenes/pendulum.toml", {"--until", "5", "--beside", "points=2 step=0.1"}));
    REQUIRE(data["runs"].size() == 2);
    CHECK(data["runs"][1]["label"] == "Lobatto, 2 points");
    CHECK(data["runs"][1]["note"] == "h = 0.1");
    const nlohmann::json splitting = data_of(page_of_scene(
        tree + "/scenes/pendulum.toml", {"--until", "5", "--tolerance", "1e-9", "--beside", "splitting=11"}));
    REQUIRE(splitting["runs"].size() == 2);  // it iterates nothing, so that the tolerance is of the other alone
    CHECK(splitting["runs"][1]["label"].get<std::string>().starts_with("splitting"));
    const auto refused = [](const std::string& beside) {
        const test::TemporaryFolder folder;
        const test::Finished finished = test::run(
            {LOBATTO_PROGRAM, "view", tree + "/scenes/pendulum.toml", "-o", folder / "x.html", "--beside", beside});
        CHECK(finished.exit_code == 2);
        CHECK_FALSE(std::filesystem::exists(folder / "x.html"));
        return finished.err;
    };
    CHECK(refused("point=2").find("--beside: 'point=2' is not known; write points=2") != std::string::npos);
    CHECK(refused("points=two").find("--beside: points needs a whole number") != std::string::npos);
    CHECK(refused("points=2 points=3").find("--beside: points is given twice") != std::string::npos);
    CHECK(refused("").find("--beside: write what differs") != std::string::npos);
    CHECK(refused("step=0").find("--step: the step must be positive, but is 0") != std::string::npos);
    CHECK(refused("points=40").find("--beside: there is no method lobatto with 40") != std::string::npos);
}

TEST_CASE("a motion that fails on its way is shown as far as it came, with a warning") {
    const test::TemporaryFolder folder;
    const test::Finished finished = test::run({LOBATTO_PROGRAM, "view", tree + "/scenes/pendulum.toml", "--step", "2.9",
                                               "--until", "100", "-o", folder / "x.html"});
    CHECK(finished.exit_code == 0);
    CHECK(finished.err.find("A plane pendulum: the motion on the page ends early") != std::string::npos);
    CHECK(std::filesystem::exists(folder / "x.html"));
    const test::Finished beside = test::run({LOBATTO_PROGRAM, "view", tree + "/scenes/pendulum.toml", "--until", "100",
                                             "--beside", "points=3 step=2.9", "-o", folder / "y.html"});
    CHECK(beside.err.find("A plane pendulum, Lobatto, 3 points, h = 2.9: the motion on the page ") !=
          std::string::npos);
    CHECK(beside.err.find("Lobatto, 4 points") == std::string::npos);
}

TEST_CASE("a motion too fast for the states that a page has room for is told, with an end that is not") {
    const test::TemporaryFolder folder;
    const auto warning = [&](const std::string& scene, const std::string& until) {
        const test::Finished finished =
            test::run({LOBATTO_PROGRAM, "view", scene, "--until", until, "--quiet", "-o", folder / "x.html"});
        CHECK(finished.exit_code == 0);
        return finished.err;
    };
    const std::string oscillator = tree + "/scenes/harmonic_oscillator.toml", told = warning(oscillator, "1e5");
    const std::string try_this = "Try an earlier end, such as --until ";
    CHECK(told.find("the page has room for one state in 64") != std::string::npos);
    REQUIRE(told.find(try_this) != std::string::npos);
    CHECK(warning(oscillator, std::to_string(std::stod(told.substr(told.find(try_this) + try_this.size())))).empty());
    test::write_text(
        folder / "rotor.toml",
        "lagrangian = \"a'^2/2 + cos(a)/9\"\n[coordinates]\na = { unit = \"rad\", position = 0, velocity = "
        "10 }\n[run]\nstep = 0.02\nuntil = 10\n");
    CHECK(warning(folder / "rotor.toml", "1e4").find("the page has room for") != std::string::npos);
    CHECK(warning(folder / "rotor.toml", "600").empty());
    // A coordinate that rests beside one that moves slowly enough.
    test::write_text(folder / "rests.toml",
                     "lagrangian = \"(x'^2 + y'^2)/2 - x^2/2 - (y - 0.1)^2/2\"\n[coordinates]\n"
                     "x = { position = 1, velocity = 0 }\ny = { position = 0.1, velocity = 0 }\n[run]\nstep = 0.1\n"
                     "until = 10000\n");
    CHECK(warning(folder / "rests.toml", "10000").empty());
}

TEST_CASE("curves of formulas of pieces are on the side where the motion is") {
    const test::TemporaryFolder folder;
    const std::string scene = folder / "pieces.toml";
    std::ofstream(scene) << "lagrangian = \"q'^2/2 - q^2/2 - max(q, 0)^3\"\n[coordinates]\nq = { position = 1, "
                            "velocity = 0 }\n[run]\nstep = 0.1\nuntil = 6\n[view]\nplot = [\"q\", \"max(-q, 0)\"]\n";
    const nlohmann::json channels = data_of(page_of_scene(scene))["runs"][0]["channels"];
    bool is_there = false;
    for (const nlohmann::json& channel : channels)
        is_there = is_there || (channel.is_object() && channel["least"] == 0.0 && channel["most"] > 1.0);
    CHECK(is_there);
}
