// SPDX-License-Identifier: GPL-2.0-or-later
// Mistakes of newcomers, and what they are told.
#include <doctest/doctest.h>

#include <string>
#include <vector>

#include "tests/support.hpp"

using namespace lobatto;

namespace {

std::string told(const std::string& scene, int exit_code = 2, std::vector<std::string> more = {}) {
    const test::TemporaryFolder folder;
    test::write_text(folder / "scene.toml", scene);
    more.insert(more.begin(), {LOBATTO_PROGRAM, "run", folder / "scene.toml", "-o", folder / "run.csv"});
    const test::Finished finished = test::run(more);
    CHECK(finished.exit_code == exit_code);
    return finished.err;
}

std::string oscillator(const std::string& lagrangian, const std::string& run, const std::string& rest = "",
                       const std::string& first = "") {
    return first + "lagrangian = \"" + lagrangian +
           "\"\n[coordinates]\nx = { position = 1, velocity = 0 }\n[run]\nuntil = 1\n" + run + "\n" + rest;
}

}  // namespace

TEST_CASE("what other programs call otherwise is told by our name") {
    CHECK(test::contains(told(oscillator("xdot^2/2 - x^2/2", "step = 0.1")), "The velocity of x is written x'."));
    CHECK(test::contains(told(oscillator("x_dot^2/2 - x^2/2", "step = 0.1")), "The velocity of x is written x'."));
    CHECK(test::contains(told(oscillator("x'^2/2 - x^2/2", "dt = 0.1")), "unknown key 'dt' in [run]"));
    CHECK(test::contains(told(oscillator("x'^2/2 - x^2/2", "dt = 0.1")), "It is called step."));
    CHECK(test::contains(told(oscillator("x'^2/2 - x^2/2", "step = 0.1\nt_end = 3")), "It is called until."));
    CHECK(test::contains(told(oscillator("x'^2/2 - x^2/2", "step = 0.1\nstart = 5")), "A run begins at t = 0"));
}

TEST_CASE("sections, functions and signs of other languages are told ours") {
    const auto function = [](const std::string& formula) {
        return told(oscillator("x'^2/2 - " + formula, "step = 0.1"));
    };
    CHECK(test::contains(function("np.cos(x)"), "Write cos."));
    CHECK(test::contains(function("math.pow(x, 2)"), "Write x^2."));
    CHECK(test::contains(function("arctan(x)"), "Write atan."));
    CHECK(test::contains(function("diff(x, t)"), "The velocity of x is written x'."));
    CHECK(test::contains(function("|x|"), "unexpected character '|' in the Lagrangian: write abs(...)"));
    CHECK(test::contains(function("\\\\frac{1}{2}*x"), "formulas are no LaTeX"));
    CHECK(test::contains(function("if(x > 0 && x < 1, x, 0)"), "there is no 'and' in formulas"));
    CHECK(test::contains(told(oscillator("x'^2/2 - x*mod(t, 1)", "step = 0.1", "", "time = \"t\"\n")),
                         "for a square wave sign(sin(2*pi*t/T))"));
    CHECK(test::contains(told(oscillator("x'^2/2 - x^2/2", "step = 0.1"), 2, {"--clock", "r^2"}),
                         "a formula stands in the scene, under [method]: clock = \"r^2\""));
    CHECK(test::contains(told("lagrangian = \"x'^2/2 - y^2/2\"\n[coordinates]\nx = { position = 1, velocity = 0 }\n"
                              "y = { position = -1, velocity = 0 }\n[constraints]\nnode = \"x + y = 0\"\n[run]\nstep = "
                              "0.1\nuntil = 1\n"),
                         "write this constraint as y = ..., then y follows from the others"));
    const auto scene = [](const std::string& section) {
        return told(oscillator("x'^2/2 - x^2/2", "step = 0.1", section + "\nk = 1\n"));
    };
    CHECK(test::contains(scene("[params]"), "It is called parameters."));
    CHECK(test::contains(scene("[initial]"), "The start stands under [coordinates]"));
    CHECK(test::contains(told("hamiltonian = \"p^2/2\"\n"), "for H = p^2/(2*m) + V write \"m*x'^2/2 - V\""));
    CHECK(test::contains(told("kinetic = \"x'^2/2\"\n"), "Write lagrangian = \"kinetic energy - potential energy\"."));
}

TEST_CASE("slips of a blackboard are told how they are written") {
    CHECK(test::contains(told(oscillator("v^2/2 - x^2/2", "step = 0.1")), "The velocity of x is written x'."));
    CHECK(test::contains(told(oscillator("x'^2/2 - e^x", "step = 0.1")), "Write exp(...)."));
    CHECK(test::contains(told(oscillator("(x'^2 + y'^2)/2", "step = 0.1")),
                         "A coordinate y needs a line y = { position = ..., velocity = ... } under [coordinates]."));
    CHECK(test::contains(told("definitions = { foot = \"2*x\" }\n" +
                              oscillator("x'^2/2 - x^2/2", "step = 0.1\n[forces]\nfoot = \"-fot'\"")),
                         "Did you mean 'foot''?"));
    CHECK(test::contains(told("L = \"x'^2/2\"\n[coordinates]\nx = { position = 1, velocity = 0 }\n"),
                         "Write lagrangian = \"...\"."));
    const std::string plane =
                          "[coordinates]\nx = { position = 0, velocity = 1 }\ny = { position = -1, velocity = 0 }\n",
                      steps = "[run]\nstep = 0.1\nuntil = 1\n";
    CHECK(test::contains(told("lagrangian = \"(x'^2 + y'^2)/2 + l*(x^2 + y^2 - 1)\"\n" + plane +
                              "l = { position = 0, velocity = 0 }\n" + steps),
                         "write its condition as an equation under [constraints]"));
    CHECK(test::contains(told("lagrangian = \"sqrt(x'^2 + y'^2)\"\n" + plane + steps), "Take its square"));
    CHECK(test::contains(told("lagrangian = \"(x'^2 + y'^2)/2\"\n" + plane + steps +
                              "[impacts]\n\"hit[i,j]\" = { when = \"x = y\", count = 2 }\n"),
                         "scene.toml:9:1: an array of impacts has one index"));
    const std::string degrees =
        "lagrangian = \"x'^2/2 + cos(x)\"\n[coordinates]\n"
        "x = { position = 30, velocity = 0, unit = \"deg\" }\n";
    CHECK(test::contains(told(degrees + steps, 0), "take it for radians"));
}

TEST_CASE("what stands in the wrong place is told where it belongs") {
    CHECK(test::contains(told(oscillator("x'^2/2 - x^2/2", "step = 0.1", "[output]\nevents = [\"x == 0\"]\n")),
                         "write one =, not =="));
    CHECK(test::contains(told(oscillator("x'^2/2 - E*x", "step = 0.1", "[parameters]\nE = \"cos(t)\"\n")),
                         "formulas of other names stand under [definitions]"));
    const std::string without_quotes = told(oscillator("x'^2/2 - x^2/2", "step = 0.1", "", "time = t\n"));
    CHECK(test::contains(without_quotes, "expected 'true'; a formula must stand in quotes"));
    CHECK(test::contains(told("lagrangian = \"sum(i = 1 .. n, x[i]'^2)\"\n[coordinates]\n"
                              "x = { count = \"n\", position = 1, velocity = 0 }\n[parameters]\nn = 8\n[run]\n"
                              "step = 0.1\nuntil = 1\n"),
                         "such as n = { value = 8, constant = true }"));
    CHECK(test::contains(told(oscillator("x'*1 - x^2/2", "step = 0.1")),
                         "it is linear in the velocities, as phase-space and guiding-centre Lagrangians are"));
}

TEST_CASE("keys, options and quotes in the wrong place are told the right one") {
    const std::string good = "x'^2/2 - x^2/2";
    CHECK(test::contains(told(oscillator(good, "step = 0.1\nevents = [\"x = 0\"]")), "It belongs into [output]."));
    CHECK(test::contains(told(oscillator(good, "step = 0.1", "[method]\nsplitting = 11\n")),
                         "Write family = \"splitting\", and this number as stages."));
    CHECK(test::contains(told(oscillator(good, "step = 0.1\nstop = \"x < 0\"")), "an event is written a = b falling"));
    CHECK(test::contains(told(oscillator(good, "step = 0.1"), 2, {"--set", "p_x=2"}),
                         "gives initial velocities, not momenta; set x' instead"));
    CHECK(test::contains(told(oscillator(good, "step = 0.1"), 2, {"--set", "xx=2"}),
                         "has no run-time parameters; of the start: x, x'."));
    CHECK(test::contains(told(oscillator(good, "step = 0.1"), 2, {"--vary", "x=2"}), "`lobatto sweep` has it"));
    CHECK(test::contains(told(oscillator(good, "step = 0.1", "[output]\nkeep = \"max(x) - min(x)\"\n")),
                         "what is kept of a trajectory is first(x = 0) or count(x = 0 rising) of an event"));
    CHECK(test::contains(told(oscillator(good + " + x*table('a.csv', x)", "step = 0.1")),
                         "'''table(\"data.csv\", t)'''"));
}

TEST_CASE("blanks beside the equals sign of --set do no harm; a missing folder is told at once") {
    const std::string scene = oscillator("x'^2/2 - k*x^2/2", "step = 0.1", "[parameters]\nk = 1\n");
    CHECK(told(scene, 0, {"--set", "k = 2"}).empty());
    const test::TemporaryFolder folder;
    test::write_text(folder / "scene.toml", scene);
    const test::Finished finished =
        test::run({LOBATTO_PROGRAM, "run", folder / "scene.toml", "-o", folder / "no/run.csv"});
    CHECK(finished.exit_code == 4);
    CHECK(test::contains(finished.err, "Create its folder first"));
    CHECK(finished.out.empty());
}

TEST_CASE("a step that leads to where a formula has no value says which, and where") {
    const std::string text =
        "lagrangian = \"x'^2/2 - x^2.5\"\n[coordinates]\nx = { position = 1, velocity = 0 }\n[run]\nstep = 0.1\n"
        "until = 5\n";
    CHECK(test::contains(told(text, 3), "at the end of the step a broken power, line 1 column 25, is of x = -"));
    CHECK(test::contains(told(text, 3), "such as abs(x)^(5/2) for x^(5/2)"));
}

TEST_CASE("a pulse on a chain may have tails below the range of numbers, and momenta of arrays have indices") {
    const test::TemporaryFolder folder;
    test::write_text(folder / "chain.toml",
                     "lagrangian = \"sum(i = 1 .. n, u[i]'^2/2) - sum(i = 1 .. n - 1, (u[i+1] - u[i])^2/2)\"\n"
                     "[coordinates]\nu = { count = \"n\", position = \"exp(-(i - 32)^2)\", velocity = \"i\" }\n"
                     "[parameters]\nn = { value = 64, constant = true }\n[run]\nstep = 0.1\nuntil = 1\n[output]\n"
                     "keep = [\"min(sum(i = 1 .. n, p_u[i]))\", \"max(sum(i = 1 .. n, p_u[i]))\", \"last(p_u[3])\", "
                     "\"last(p_u_3)\"]\n");
    const test::Finished swept =
        test::run({LOBATTO_PROGRAM, "sweep", folder / "chain.toml", "--vary", "u[1]'=1", "-o", folder / "sweep.csv"});
    INFO(swept.err);
    REQUIRE(swept.exit_code == 0);
    const std::string table = test::read_file(folder / "sweep.csv");
    const std::string row = table.substr(table.rfind("\n0,") + 1);
    std::vector<double> numbers;
    for (std::size_t at = 0; at != std::string::npos && at < row.size(); at = row.find(',', at)) {
        if (row[at] == ',') ++at;
        numbers.push_back(std::stod(row.substr(at)));
    }
    REQUIRE(numbers.size() >= 9);
    CHECK(numbers[5] == doctest::Approx(64 * 65 / 2).epsilon(1e-13));
    CHECK(numbers[6] == doctest::Approx(64 * 65 / 2).epsilon(1e-13));
    CHECK(numbers[7] == numbers[8]);
}

TEST_CASE("verify looks at a table where it has values, and judges no energy of an escape in a rotating frame" *
          doctest::test_suite("slow")) {
    const test::TemporaryFolder folder;
    test::write_text(folder / "rho.csv",
                     "100, 6.2\n150, 0.73\n200, -1.35\n300, -3.95\n400, -5.86\n500, -7.5\n700, -10.2\n1000, -12.5\n");
    test::write_text(
        folder / "decay.toml",
        "lagrangian = \"x'^2/2 + 398600/x\"\n[coordinates]\nx = { position = 6700, velocity = 1 }\n[forces]\n"
        "x = '''-1e-6*exp(table(\"rho.csv\", x - 6378))*x' '''\n[run]\nstep = 1\nuntil = 20\n");
    test::write_text(folder / "escape.toml",
                     "lagrangian = \"((x' - y)^2 + (y' + x)^2)/2 + 1/sqrt(x^2 + y^2)\"\n[coordinates]\n"
                     "x = { position = 1, velocity = 0 }\ny = { position = 0, velocity = 1 }\n[method]\npoints = 9\n"
                     "clock = \"auto\"\n[run]\nstep = 0.1\nuntil = 40\n");
    for (const char* scene : {"decay.toml", "escape.toml"}) {
        const test::Finished proof = test::run({LOBATTO_PROGRAM, "verify", folder / scene});
        INFO(scene << proof.out << proof.err);
        CHECK(proof.exit_code == 0);
    }
}

TEST_CASE("verify proves a scene with other values") {
    const test::TemporaryFolder folder;
    test::write_text(folder / "scene.toml", oscillator("m*x'^2/2 - x^4/4", "step = 0.1", "[parameters]\nm = 1\n"));
    const test::Finished with = test::run(
                             {LOBATTO_PROGRAM, "verify", folder / "scene.toml", "--set", "m=3", "--step", "0.05"}),
                         without = test::run({LOBATTO_PROGRAM, "verify", folder / "scene.toml"});
    CHECK(with.exit_code == 0);
    CHECK(without.exit_code == 0);
    CHECK(with.out != without.out);
    CHECK(test::run({LOBATTO_PROGRAM, "verify", folder / "scene.toml", "--set", "m=0"}).exit_code == 2);
}
