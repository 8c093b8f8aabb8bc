// SPDX-License-Identifier: GPL-2.0-or-later
// lobatto stability from the outside: members, linear scenes, equilibria, motions, charts, mistakes.
#include <doctest/doctest.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "tests/support.hpp"

using namespace lobatto;

namespace {

test::Finished stability(std::vector<std::string> arguments) {
    static const test::TemporaryFolder folder;
    const test::EnvironmentVariable cache("LOBATTO_CACHE_DIR", folder.string());
    arguments.insert(arguments.begin(), {LOBATTO_PROGRAM, "stability"});
    return test::run(arguments);
}

std::string scene_path(const std::string& name) {
    return LOBATTO_SOURCE_DIR "/scenes/" + name + ".toml";
}

nlohmann::json report_of(std::vector<std::string> arguments) {
    arguments.push_back("--json");
    const test::Finished done = stability(arguments);
    CHECK_MESSAGE(done.exit_code == 0, done.err);
    return nlohmann::json::parse(done.out);
}

std::string scene_in(const test::TemporaryFolder& folder, const std::string& lagrangian, const std::string& coordinates,
                     const std::string& more = "") {
    const std::string path = folder / "scene.toml";
    test::write_text(path, more + "title = \"Test\"\nlagrangian = \"" + lagrangian + "\"\n[coordinates]\n" +
                               coordinates + "\n[run]\nstep = 0.1\nuntil = 10\n");
    return path;
}

}  // namespace

TEST_CASE("without a scene every member is listed, for people and for machines") {
    const test::Finished done = stability({});
    CHECK(done.exit_code == 0);
    CHECK(test::contains(done.out, "Lobatto, 4 points  6      1/604800*(h*omega)^6"));
    CHECK(test::contains(done.out, "3.11271764816421725708492043465"));
    CHECK(test::contains(done.out, "Gauss, 10 stages   20"));
    const auto members = report_of({})["members"];
    REQUIRE(members.size() == 21);
    CHECK(members[1]["intervals"][0]["to"]["exact_angle"] == "sqrt(8)");
    CHECK(members[2]["intervals"][0]["to"]["exact_angle"] == "sqrt(42 - 6*sqrt(29))");
    for (const auto& member : members)
        CHECK(member.contains("proof") == member["method"].get<std::string>().starts_with("Gauss"));
}

TEST_CASE("one member alone is shown in full, Gauss's with its proof") {
    const test::Finished lobatto = stability({"--points", "3"});
    CHECK(test::contains(lobatto.out, "  trace = 2*a/delta = (48 - 22*z + z^2)/(24 + z)\n"));
    CHECK(test::contains(lobatto.out, "  stable   to 2.82842712474619009760337744842 = sqrt(8)\n"));
    CHECK(test::contains(lobatto.out, "(1 + (h*omega)^4/2880 + ...), so the motion runs ahead"));
    const test::Finished gauss = stability({"--stages", "2"});
    CHECK(test::contains(gauss.out, "  stable   without end\n"));
    CHECK(test::contains(gauss.out, "4 - trace^2 = z*(2*c/delta)^2"));
    CHECK(test::contains(gauss.out, "No step size is unstable."));
    CHECK(test::contains(gauss.out, "so the motion runs late"));
}

TEST_CASE("a linear scene in a gap of stability is called unstable, at the rate its kernel shows") {
    // h omega = 3.1375, in the gap between sqrt(42 - 6 sqrt(29)) and sqrt(10).
    const auto report = report_of({scene_path("harmonic_oscillator"), "--step", "3.1375/omega"});
    const auto mode = report["points"][0]["modes"][0];
    CHECK(mode["stable"] == false);
    CHECK(mode["rate"].get<double>() == doctest::Approx(0.0250313631).epsilon(1e-6));
    CHECK(report["points"][0]["measured_rate"].get<double>() == doctest::Approx(0.0250313631).epsilon(1e-6));
    // Beyond the gap it is stable again.
    CHECK(report_of({scene_path("harmonic_oscillator"), "--step", "4/omega"})["points"][0]["modes"][0]["stable"] ==
          true);
    const test::Finished text = stability({scene_path("harmonic_oscillator"), "--step", "3.1375/omega"});
    CHECK(test::contains(text.out, "UNSTABLE: grows by 1.0253 per step"));
}

TEST_CASE("several coordinates are judged by their eigenfrequencies, and the kernel agrees") {
    // Frequencies 1 and sqrt(1.2): at h = 2.86 the faster one is in the gap, the slower one not.
    const auto report = report_of({scene_path("coupled_oscillators"), "--step", "2.86"});
    const auto modes = report["points"][0]["modes"];
    REQUIRE(modes.size() == 2);
    CHECK(modes[0]["squared_frequency"].get<double>() == doctest::Approx(1));
    CHECK(modes[1]["squared_frequency"].get<double>() == doctest::Approx(1.2));
    CHECK(modes[0]["stable"] == true);
    CHECK(modes[1]["stable"] == false);
    const double rate = modes[1]["rate"];
    CHECK(rate > 0.01);
    // 16384 steps; what is left of the start is below 1e-4 of it.
    CHECK(report["points"][0]["measured_rate"].get<double>() == doctest::Approx(rate).epsilon(1e-3));
}

TEST_CASE("a pendulum is linearised where it hangs and where it stands, and along its motion") {
    const test::TemporaryFolder folder;
    // It turns over: both equilibria lie near its motion.
    const auto report =
        report_of({scene_in(folder, "q'^2/2 - 4*(1 - cos(q))", "q = { position = 0, velocity = 4.5 }")});
    std::vector<double> squares;
    for (const auto& point : report["points"]) {
        squares.push_back(point["modes"][0]["squared_frequency"]);
        CHECK(point["measured_rate"].get<double>() ==
              doctest::Approx(point["modes"][0]["rate"].get<double>()).epsilon(1e-9).scale(1));
    }
    REQUIRE(squares.size() == 2);
    CHECK(squares[0] == doctest::Approx(4));
    CHECK(squares[1] == doctest::Approx(-4));
    const auto motion = report["trajectory"];
    CHECK(motion["looked_at"].get<int>() >= 99);
    CHECK(motion["parting"].get<int>() > 10);
    // A step near the top: exp(h omega) with omega = 2.
    CHECK(motion["rate"].get<double>() == doctest::Approx(0.2).epsilon(0.02));
    CHECK(std::fabs(motion["excess"].get<double>()) < 1e-6);
    CHECK(motion["largest_z"].get<double>() == doctest::Approx(0.04).epsilon(0.01));
    // The energy that the steps keep better.
    CHECK(report["energy"]["order"] == 6);
    CHECK(report["energy"]["modified_variation"].get<double>() < 0.2 * report["energy"]["variation"].get<double>());
}

TEST_CASE("a step beyond the first limit somewhere along a motion is named") {
    const test::TemporaryFolder folder;
    const std::string path = scene_in(folder, "q'^2/2 - 450*(1 - cos(q))", "q = { position = 0.05, velocity = 0 }");
    const test::Finished done = stability({path, "--points", "2"});
    CHECK(done.exit_code == 0);
    CHECK(test::contains(done.out, "UNSTABLE: grows by"));
    CHECK(test::contains(done.out, "BEYOND the first limit, 1.06 times"));
}

TEST_CASE("places to which a step throws the motion tell nothing of it") {
    const test::TemporaryFolder folder;
    const std::string path = scene_in(folder, "r'^2/200 + q'^2/10 - 1e6*(r - q)^2/2 + 4*cos(q)",
                                      "r = { position = 0.5, velocity = 0 }\nq = { position = 0.5, velocity = 0 }");
    const test::Finished done = stability({path, "--step", "0.005"});
    CHECK(done.exit_code == 0);
    CHECK(test::contains(done.out, "About the equilibrium r = 0, q = 0, h = 0.005:"));
    CHECK(done.out.find("e+") == std::string::npos);  // once: equilibria at 1e18, with the rounding of cos there
    CHECK(test::contains(done.out, "the motion itself 1"));
    CHECK(test::contains(done.out, " on left out: there the step has thrown the motion away\n"));
}

TEST_CASE("velocities that couple, time, singular places and no equilibrium are each said in words") {
    const test::TemporaryFolder folder;
    const std::string two = "x = { position = 1, velocity = 0 }\ny = { position = 0, velocity = 1 }";
    CHECK(test::contains(
        stability({scene_in(folder, "(x'^2 + y'^2)/2 + (x*y' - y*x') - (x^2 + y^2)/2", two)}).out,
        "no independent oscillations: its velocities couple the coordinates; the motion itself grows by 1 in a "
        "time h\n"
        "  measured on the kernel: growth per step 1, to within 0.0005\n"));
    CHECK(test::contains(
        stability({scene_in(folder, "q'^2/2 + cos(q)*sin(t)", "q = { position = 1, velocity = 0 }", "time = \"t\"\n")})
            .out,
        "its forces change with time; no equilibria are sought\n"));
    CHECK(test::contains(stability({scene_in(folder, "(x'^2 + y'^2)/2 + 1/sqrt(x^2 + y^2)", two)}).out,
                         "no equilibrium was found from its start and along its motion\n"));
    // Friction: both decay by exp(-h/10).
    const test::Finished damped = stability({scene_in(folder, "q'^2/2 - q^2/2",
                                                      "q = { position = 1, velocity = 0 }\n"
                                                      "[forces]\nq = \"-0.2*q'\"")});
    CHECK(test::contains(damped.out,
                         "its forces depend on the velocities; the motion itself grows by 0.99005 in a time h\n"
                         "  measured on the kernel: growth per step 0.99005\n"));
    // Both signs changed: the same oscillator.
    CHECK(test::contains(stability({scene_in(folder, "q^2/2 - q'^2/2", "q = { position = 1, velocity = 0 }")}).out,
                         "omega = 1 "));
    const test::Finished free = stability({scene_in(folder, "q'^2/2 - 3*q", "q = { position = 1, velocity = 0 }")});
    CHECK(test::contains(free.out, "omega = 0              free: nothing pulls back\n"));
    const test::Finished saddle = stability({scene_in(folder, "q'^2/2 + q^2/2", "q = { position = 1, velocity = 0 }")});
    CHECK(test::contains(saddle.out, "unstable motion: grows by 1.1052 in a time h, per step by 1.1052\n"));
    CHECK(test::contains(saddle.out, "measured on the kernel: growth per step 1.1052\n"));
}

TEST_CASE("what the linear part, the limit or a measurement cannot tell is said") {
    const test::TemporaryFolder folder;
    const std::string q = "q = { position = 1, velocity = 0 }";
    const test::Finished quartic = stability({scene_in(folder, "q'^2/2 - q^4/4", q)});
    CHECK(test::contains(quartic.out, "omega = 0              the linear part says nothing here\n"));
    // Nothing holds both together: their centre moves on.
    const test::Finished pair =
        stability({scene_in(folder, "(x'^2 + y'^2)/2 - cosh(x - y)",
                            "x = { position = 1, velocity = 0 }\ny = { position = 0.5, velocity = 0 }")});
    CHECK(test::contains(pair.out, "omega = 0              free: nothing pulls back\n  omega = 1.41421 "));
    const test::Finished held =
        stability({scene_in(folder, "(x'^2 + y'^2)/2 - cosh(x - y) - (x + y)^4",
                            "x = { position = 1, velocity = 0 }\ny = { position = 0.5, velocity = 0 }")});
    CHECK(test::contains(held.out, "omega = 0              the linear part says nothing here\n  omega = 1.41421 "));
    const test::Finished trapped =
        stability({scene_in(folder, "(x'^2 + y'^2)/2 - cosh(x - y) - (x + y)^4*exp(-1e5*(x + y)^2)",
                            "x = { position = 0.001, velocity = 0 }\ny = { position = 0, velocity = 0 }")});
    CHECK(test::contains(trapped.out, "omega = 0              the linear part says nothing here\n  omega = 1.41421 "));
    // On the limit itself states grow in proportion to the number of steps.
    const std::string oscillator = scene_in(folder, "q'^2/2 - q^2/2", q);
    CHECK(test::contains(stability({oscillator, "--points", "2", "--step", "2"}).out,
                         "AT a limit, to rounding: grows in proportion to the number of steps\n"));
    CHECK(report_of({oscillator, "--points", "2", "--step", "2"})["points"][0]["modes"][0]["stable"] == false);
    // A slow growth is measured for as long as it takes.
    const auto slow = report_of({oscillator, "--points", "5", "--step", "3.14146"})["points"][0];
    const double rate = slow["modes"][0]["rate"];
    CHECK(rate > 1e-4);
    CHECK(rate < 2e-3);
    CHECK(slow["measured_rate"].get<double>() == doctest::Approx(rate).epsilon(0.05));
    CHECK(slow["measured_floor"].get<double>() < rate);
    // However slow, it is no free motion.
    CHECK(test::contains(stability({scene_in(folder, "q'^2/2 - 1e-300*q^2/2", q)}).out, "omega = 1e-150 "));
    // Eigenvalues of steps bound no motion whose forces change with time.
    const test::Finished parametric =
        stability({scene_in(folder, "q'^2/2 - (1 + 0.5*cos(2*t))*q^2/2", q, "time = \"t\"\n")});
    CHECK(test::contains(parametric.out, "steps examined); as forces change with time it may grow all the same\n"));
}

TEST_CASE("a force that fades far out is no equilibrium, and a length no angle") {
    const test::TemporaryFolder folder;
    const test::Finished valley =
        stability({scene_in(folder, "(x'^2 + y'^2)/2 - tanh(30*x)^2 - y^2",
                            "x = { position = 0.1, velocity = 0 }\ny = { position = 0.02, velocity = 0 }")});
    CHECK(test::contains(valley.out, "About the equilibrium x = 0, y = 0"));
    CHECK(!test::contains(valley.out, "free: moves on"));
    const test::Finished tweezers =
        stability({scene_in(folder, "1e-15*(x'^2 + z'^2)/2 + 1e-18*exp(-2*x^2/1e-12)/(1 + (z/3e-6)^2)",
                            "x = { position = 1e-7, velocity = 0 }\nz = { position = 2e-7, velocity = 0 }")});
    CHECK(test::contains(tweezers.out, "About the equilibrium x = 0, z = 0"));
    const auto equilibria = [](const std::string& text) {
        int count = 0;
        for (auto at = text.find("About the eq"); at != std::string::npos; at = text.find("About the eq", at + 1))
            ++count;
        return count;
    };
    CHECK(equilibria(tweezers.out) == 1);
    // Where the force is 0 in 60 digits, too.
    const test::Finished far =
        stability({scene_in(folder, "x'^2/2 - tanh(x)^2", "x = { position = 0.1, velocity = 150 }")});
    CHECK(equilibria(far.out) == 1);
    // But a multiple root is one, also where it is no double.
    const test::Finished flat =
        stability({scene_in(folder, "x'^2/2 - (x - 1/3)^4", "x = { position = 0.5, velocity = 0 }")});
    CHECK(test::contains(flat.out, "About the equilibrium x = 0.333333"));
}

TEST_CASE("frequencies are met along a motion whose velocities couple the coordinates, and their absence is said") {
    const test::TemporaryFolder folder;
    // In a rotating frame: two springs of frequency 10, seen at 9 and 11.
    const auto turning =
        report_of({scene_in(folder, "((x' - y)^2 + (y' + x)^2)/2 - 50*(x^2 + y^2) - 1e-6*x^4",
                            "x = { position = 1, velocity = 0 }\ny = { position = 0, velocity = 1 }")});
    CHECK(turning["trajectory"]["largest_z"].get<double>() == doctest::Approx(1.1 * 1.1).epsilon(1e-4));
    CHECK(turning["trajectory"]["frequencies_at"] == turning["trajectory"]["states"]);
    const test::Finished falling =
        stability({scene_in(folder, "q'^2/2 + q^2/2 + q^4/4", "q = { position = 0.0001, velocity = 0 }")});
    CHECK(test::contains(falling.out, "  nothing oscillates: no frequency was met\n"));
}

TEST_CASE("the work has bounds: a run of too many steps is cut, a formula too long is left out" *
          doctest::test_suite("slowest")) {
    const test::TemporaryFolder folder;
    const auto cut = report_of(
        {scene_in(folder, "q'^2/2 + cos(q)", "q = { position = 1, velocity = 0 }"), "--step", "1e-9", "--points", "2"});
    CHECK(cut["trajectory"]["steps"] == 10'000'000'000);
    CHECK(cut["trajectory"]["steps_done"] == 10'000'000);
    const test::Finished lengthy =
        stability({scene_in(folder,
                            "(x'^2 + y'^2 + z'^2)/2 + 1/sqrt(x^2 + y^2 + z^2)"
                            " + exp(-sqrt(x^2 + y^2 + z^2))*sin(x*y)/sqrt(x^2 + y^2 + z^2)",
                            "x = { position = 1, velocity = 0 }\ny = { position = 0.2, velocity = 1 }\n"
                            "z = { position = 0.1, velocity = 0.3 }"),
                   "--points", "5"});
    CHECK(test::contains(lengthy.out, "Energy: the formula of H_8 (D37) is too long to be written down here\n"));
}

TEST_CASE("the chart is an SVG file, the same bytes on every run, with theory and measurement") {
    const test::TemporaryFolder folder;
    std::string bytes[2];
    for (std::string& text : bytes) {
        const test::Finished done = stability({scene_path("harmonic_oscillator"), "--chart", folder / "chart.svg"});
        CHECK_MESSAGE(done.exit_code == 0, done.err);
        text = test::read_file(folder / "chart.svg");
    }
    CHECK(bytes[0] == bytes[1]);
    CHECK(test::contains(bytes[0], "kernel, measured"));
    CHECK(test::contains(bytes[0], "Lobatto, 4 points"));
    CHECK(!std::filesystem::exists(folder / "chart.gnuplot"));
    // Without an equilibrium the member is drawn, with the stiffest moment of the motion.
    CHECK(stability({scene_path("kepler"), "--chart", folder / "orbit.svg"}).exit_code == 0);
    CHECK(std::filesystem::file_size(folder / "orbit.svg") > 10000);
}

TEST_CASE("mistakes on the command line are refused before anything is computed") {
    const auto refusal = [](const std::vector<std::string>& arguments) {
        const test::Finished done = stability(arguments);
        CHECK(done.exit_code == 2);
        CHECK(done.out == "");
        return done.err;
    };
    const std::string oscillator = scene_path("harmonic_oscillator");
    CHECK(refusal({oscillator, "--chart", "x.png"}) ==
          "--chart x.png: the chart is an SVG file; give it a name that ends in .svg\n");
    CHECK(refusal({oscillator, "--chart", "no/such/x.svg"}) ==
          "--chart no/such/x.svg: there is no folder no/such; make it first\n");
    CHECK(refusal({""}) == "the scene has an empty name: give a file, such as scenes/pendulum.toml\n");
    for (const auto& option : {std::vector<std::string>{"--tolerance", "1e-9"},
                               {"--arithmetic", "clean"},
                               {"--numbers", "float"},
                               {"--clock", "auto"}})
        CHECK(refusal(option) == "--tolerance, --arithmetic, --numbers and --clock belong to a scene; name one\n");
    CHECK(refusal({"--step", "0.1"}) == "--chart, --step and --set belong to a scene; name one\n");
    CHECK(test::contains(refusal({"missing.toml"}), "missing.toml"));
    CHECK(test::contains(refusal({oscillator, "--step", "-1"}), "the step must be positive"));
    CHECK(test::contains(refusal({oscillator, "--points", "13"}), "--points"));
    CHECK(test::contains(refusal({oscillator, "--splitting", "11"}), "lobatto stability --splitting 11"));
    CHECK(refusal({"--splitting", "11", "--json"}) ==
          "--json is of Lobatto and Gauss, whose limits are exact; leave it out\n");
}

// V = x^2/2 + 2 y^2 - x y z: all of the z axis, of which z = 2 and z = -2 are where it becomes unstable.
TEST_CASE("where equilibria form a line, that in which several meet is told once, and no coordinate is turned") {
    const test::TemporaryFolder folder;
    test::write_text(folder / "line.toml",
                     "lagrangian = \"(x'^2 + y'^2 + z'^2)/2 - x^2/2 - 2*y^2 + x*y*z\"\n[coordinates]\n"
                     "x = { position = 0.1, velocity = 0 }\ny = { position = 0.1, velocity = 0 }\n"
                     "z = { position = 0.2, velocity = 0.1 }\n[run]\nstep = 0.3\nuntil = 20\n");
    const test::Finished done = stability({folder / "line.toml"});
    CHECK(done.exit_code == 0);
    const std::string end = "About the equilibrium x = 0, y = 0, z = 2,";
    CHECK(done.out.find(end) != std::string::npos);
    CHECK(done.out.find(end) == done.out.rfind(end));
    CHECK(!test::contains(done.out, "z = 3.14"));
    CHECK(!test::contains(done.out, "z = -1.14"));
}
