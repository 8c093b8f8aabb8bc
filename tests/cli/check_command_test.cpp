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

TEST_CASE("check says what it found, what that saves, and what it looked for in vain") {
    const test::Finished done = check(scene_path("pendulum"));
    CHECK(done.err == "");
    CHECK(done.exit_code == 0);
    const std::string text = std::regex_replace(done.out, std::regex("\\d\\.\\d\\d s"), "TIME s");
    CHECK(text ==
          "A plane pendulum (" + scene_path("pendulum") +
              ")\n"
              "\n"
              "  Lagrangian                  m*q'^2/2 - m*omega^2*(1 - cos(q))\n"
              "  kind                        Kinetic minus potential energy, with constant masses.\n"
              "\n"
              "Found and used\n"
              "  constant mass matrix        M is the same everywhere, so the end of a step follows "
              "without equations\n"
              "  no explicit time            t appears nowhere, so no formula takes it\n"
              "  no forces                   all forces come from L, so every step is symplectic\n"
              "  solution in closed form     q'' = -w2*sin(q), by Jacobi elliptic functions with w2 = "
              "omega^2\n"
              "\n"
              "Looked for, not found\n"
              "  linear system               d2V/dqdq = m*omega^2*cos(q) depends on the position\n"
              "  cyclic coordinates          a force acts on every coordinate\n"
              "  quadratic part absorbed     V has no quadratic part\n"
              "\n"
              "One step: Lobatto, 4 points (order 6)\n"
              "  equations                   for the positions at the 2 points inside the step; its end "
              "follows from them\n"
              "  unknowns                    2 (3 without these findings)\n"
              "  solved                      by fixed-point iteration over all points at once; where it does not "
              "converge, by\n"
              "                              Newton's iteration: 2 equations, as a full matrix\n"
              "  elimination                 about 6 multiplications (18 without these findings)\n"
              "\n"
              "The kernel\n"
              "  energy                      H at every kept state: 7 operations\n"
              "  momenta                     columns p_... of the trajectory\n"
              "  tangent                     the derivative of a step, from the matrix of its equations\n"
              "  dense                       not requested, left out\n"
              "  events                      not requested, left out\n"
              "  operations                  16 in all formulas, each counted once (24 without these "
              "findings)\n"
              "  derived and emitted in      TIME s\n");
}

TEST_CASE("the kind of a Lagrangian is named, with what is unusual in it") {
    const test::TemporaryFolder folder;
    const auto kind = [&](const std::string& lagrangian, const std::string& more = "") {
        const std::string two = "x = { position = 1, velocity = 0.1 }\ny = { position = 0, velocity = 0.5 }\n";
        return report_of(temporary_scene(folder, lagrangian, two, more)).at("kind").get<std::string>();
    };
    CHECK(kind("(x'^2 + y'^2)/2 - x^4 - y^4") == "Kinetic minus potential energy, with constant masses.");
    CHECK(kind("(x'^2 + y'^2)/2 - x^4*cos(t)", "time = \"t\"\n") ==
          "Kinetic minus potential energy, with constant masses; t appears explicitly.");
    CHECK(kind("(x'^2 + (1 + x^2)*y'^2)/2 - x^4") ==
          "Quadratic in the velocities, with masses that depend on the position.");
    CHECK(kind("(x'^2 + y'^2)/2 + x*y' - y*x'") ==
          "Quadratic in the velocities, with constant masses, and with terms linear in the velocities, as in "
          "magnetic fields and rotating frames.");
    // No value at rest.
    CHECK(kind("y'^2/2 + (1 + y^2)*x'^2/2 - 1e-70/x'") == "Not quadratic in the velocities, as in relativity.");
    CHECK(kind("-sqrt(1 - x'^2 - y'^2) - x^2") == "Not quadratic in the velocities, as in relativity.");
    CHECK(report_of(scene_path("driven_damped_pendulum")).at("kind") ==
          "Kinetic minus potential energy, with constant masses; t appears explicitly; forces outside L act on theta.");
}

TEST_CASE("what was found shrinks the equations of a step, and --general undoes it" * doctest::test_suite("slow")) {
    struct Row {
        const char* scene;
        int unknowns, without;
        const char* method;
    };
    // 256 beads at 2 inner points; theta at 4 points and two multipliers; two coordinates at 2 inner points.
    for (const Row& row : {Row{"wave_chain", 512, 768, "banded matrix"}, Row{"lagrange_top", 6, 12, "full matrix"},
                           Row{"henon_heiles", 4, 6, "full matrix"}, Row{"pendulum", 2, 3, "full matrix"}}) {
        CAPTURE(row.scene);
        const nlohmann::json report = report_of(scene_path(row.scene));
        CHECK(report.at("step").at("unknowns") == row.unknowns);
        CHECK(report.at("step").at("unknowns_without") == row.without);
        CHECK(report.at("step").at("groups").at(0).at("method") == row.method);
        CHECK(report.at("step").at("multiplications") < report.at("step").at("multiplications_without"));
        const nlohmann::json general = report_of(scene_path(row.scene), {"--general"});
        CHECK(general.at("step").at("unknowns") == row.without);
        CHECK(general.at("findings").at(0).at("name") == "general path");
    }
    const nlohmann::json linear = report_of(scene_path("harmonic_oscillator"));
    CHECK(linear.at("step").at("unknowns") == 0);
    CHECK(linear.at("step").at("groups").empty());
}

TEST_CASE("coordinates that do not act on one another are solved each by itself") {
    const test::TemporaryFolder folder;
    const std::string scene =
        temporary_scene(folder, "(x'^2 + y'^2)/2 - x^4 - y^4",
                        "x = { position = 1, velocity = 0 }\ny = { position = 0, velocity = 1 }\n");
    const nlohmann::json groups = report_of(scene).at("step").at("groups");
    REQUIRE(groups.size() == 2);
    CHECK(groups.at(0).at("coordinates") == nlohmann::json{"x"});
    CHECK(groups.at(0).at("unknowns") == 2);
    CHECK(groups.at(1).at("coordinates") == nlohmann::json{"y"});
    const std::string text = check(scene).out;
    CHECK(std::regex_replace(text, std::regex("\\s+"), " ")
              .find("by Newton's iteration: in each of 2 groups 2 equations, as a full matrix") != std::string::npos);
}

TEST_CASE("outputs that are not asked for are left out of the kernel, and what the others add is counted") {
    const nlohmann::json all = report_of(scene_path("pendulum"));
    CHECK(all.at("outputs").at(0) == nlohmann::json{{"name", "energy"}, {"asked", true}, {"operations", 7}});
    const test::TemporaryFolder folder;
    std::string text = test::read_file(scene_path("pendulum"));
    text = std::regex_replace(text, std::regex("energy = true[^\n]*"), "energy = false");
    test::write_text(folder / "scene.toml", text);
    const nlohmann::json less = report_of(folder / "scene.toml");
    CHECK(less.at("outputs").at(0) == nlohmann::json{{"name", "energy"}, {"asked", false}, {"operations", 0}});
    CHECK(less.at("operations").get<long>() == all.at("operations").get<long>() - 7);
}

TEST_CASE("the method on the command line takes the place of the scene's") {
    const nlohmann::json gauss = report_of(scene_path("pendulum"), {"--stages", "3"});
    CHECK(gauss.at("step").at("method") == "Gauss, 3 stages");
    CHECK(gauss.at("step").at("order") == 6);
    CHECK(gauss.at("step").at("unknowns") == 3);
    const nlohmann::json verlet = report_of(scene_path("pendulum"), {"--points", "2"});
    CHECK(verlet.at("step").at("unknowns") == 0);
    CHECK(verlet.at("step").at("form") == "none: the end of a step follows explicitly from its start");
}
