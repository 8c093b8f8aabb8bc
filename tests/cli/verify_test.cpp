// SPDX-License-Identifier: GPL-2.0-or-later
// lobatto verify from the outside: its table, its verdict, its exit codes.
#include <doctest/doctest.h>

#include <cmath>

#include "tests/support.hpp"

using namespace lobatto::test;

namespace {

Finished verify(const std::vector<std::string>& arguments) {
    std::vector<std::string> command{LOBATTO_PROGRAM, "verify"};
    command.insert(command.end(), arguments.begin(), arguments.end());
    return run(command);
}

std::string scene_text(const std::string& lagrangian, const std::string& coordinates, const std::string& step,
                       const std::string& until = "10") {
    return "title = \"Test\"\nlagrangian = \"" + lagrangian + "\"\n[coordinates]\n" + coordinates +
           "\n[method]\nfamily = \"lobatto\"\npoints = 4\n[run]\nstep = " + step + "\nuntil = " + until + "\n";
}

}  // namespace

TEST_CASE("both scenes of the paper verify, with any number of points") {
    for (const std::string scene : {"pendulum", "harmonic_oscillator"})
        for (const std::string points : {"2", "3", "4", "5"}) {
            const Finished result = verify({LOBATTO_SOURCE_DIR "/scenes/" + scene + ".toml", "--points", points});
            INFO(result.out << result.err);
            CHECK(result.exit_code == 0);
            CHECK(result.err.empty());
            CHECK(!contains(result.out, "FAILED"));
            CHECK(contains(result.out, "order of convergence"));
            CHECK(contains(result.out, "symplectic defect, quadruple"));
            CHECK(contains(result.out, "momenta of linear symmetries "));
        }
}

TEST_CASE("splitting methods verify, to the digits that their coefficients have") {
    const std::vector<std::pair<std::string, std::string>> methods{
        {"6", "4"}, {"11", "6"}, {"14", "6"}, {"17", "8"}, {"35", "10"}};
    for (const auto& method : methods) {
        INFO(method.first);
        const Finished result = verify({LOBATTO_SOURCE_DIR "/scenes/henon_heiles.toml", "--splitting", method.first});
        CHECK(result.exit_code == 0);
        CHECK(contains(result.out, "steps are those of the motion to h^" + method.second));
        CHECK(contains(result.out, "about " + method.second + "  ok"));
    }
}

TEST_CASE("a scene with a symmetry has its momentum in the table") {
    const TemporaryFolder folder;
    write_text(folder / "pair.toml",
               scene_text("x'^2/2 + y'^2 - (x - y)^4/4",
                          "x = { position = 1, velocity = 0 }\ny = { position = 0, velocity = 0.5 }", "0.1"));
    const Finished result = verify({(folder / "pair.toml").string()});
    CHECK(result.exit_code == 0);
    CHECK(contains(result.out, "  translation: p_x + p_y"));
}

TEST_CASE("measured values in a potential verify, also from a start on one of their knots") {
    const TemporaryFolder folder;
    std::string values;
    for (int i = -20; i <= 20; ++i) values += std::to_string(i) + "e-1, " + std::to_string(std::sin(i / 10.0)) + "\n";
    write_text(folder / "sine.csv", values);
    write_text(folder / "pulled.toml",
               "lagrangian = '''(x'^2 + y'^2)/2 - x^2 - table(\"sine.csv\", x)'''\n[coordinates]\n"
               "x = { position = 0.5, velocity = 0.1 }\ny = { position = 0.3, velocity = 0.2 }\n[run]\nstep = 0.01\n"
               "until = 2\n");
    const Finished result = verify({(folder / "pulled.toml").string()});
    INFO(result.out << result.err);
    CHECK(result.exit_code == 0);
    CHECK(contains(result.out, "tangent map against differences"));
}

TEST_CASE("coordinates that a constraint holds at 0 are not accused") {
    const Finished result = verify({LOBATTO_SOURCE_DIR "/scenes/rod_loop.toml"});
    INFO(result.out << result.err);
    CHECK(result.exit_code == 0);
}

TEST_CASE("where a mechanism stands accuses nothing, nor how large the terms of its forces are") {
    const TemporaryFolder folder;
    write_text(
        folder / "far.toml",
        "lagrangian = \"(x'^2 + y'^2)/2 - 9.81*y\"\n[coordinates]\nx = { position = \"1e6 + 0.6\", velocity = 0 }\n"
        "y = { position = -0.8, velocity = 0 }\n[constraints]\nc = \"(x - 1e6)^2 + y^2 = 1\"\n"
        "[run]\nstep = 0.01\nuntil = 1\nassemble = true\n");
    // A circular orbit, and what moves about it: two terms of a force that is far smaller than they are.
    write_text(folder / "near.toml",
               "lagrangian = \"x'^2/2 + GM/(R + x) - GM*R/(2*(R + x)^2)\"\n[parameters]\nR = 1.5e11\nGM = 1.33e20\n"
               "[coordinates]\nx = { position = 1e6, velocity = 0 }\n[method]\npoints = 6\n"
               "[run]\nstep = 1e5\nuntil = 1e7\n");
    for (const char* scene : {"far.toml", "near.toml"}) {
        const Finished result = verify({folder / scene});
        INFO(result.out << result.err);
        CHECK(result.exit_code == 0);
    }
}

TEST_CASE("right kernels are not accused where coordinates that constraints join begin at 0" *
          doctest::test_suite("slowest")) {
    const TemporaryFolder folder;
    write_text(folder / "ring.toml",
               "lagrangian = \"(x'^2 + y'^2)/2 - y\"\n[coordinates]\nx = { position = 0, velocity = 1 }\n"
               "y = { position = 0, velocity = 0 }\n[constraints]\nc = \"x^2 + (y - 1)^2 = 1\"\n"
               "[run]\nstep = 0.01\nuntil = 1\n");
    // Three hinged bars, drawn where they start: all angles are 0.
    const std::string bars =
        "[bodies]\na = { mass = 1, inertia = 1, position = [1, 0] }\n"
        "b = { mass = 1, inertia = 1, position = [2, 1], angle = \"pi/2\" }\n"
        "c = { mass = 1, inertia = 1, position = [1, 2] }\n[joints]\n"
        "A = { type = \"hinge\", bodies = [\"ground\", \"a\"], point = [0, 0], velocity = 1 }\n"
        "B = { type = \"hinge\", bodies = [\"a\", \"b\"], point = [2, 0], velocity = -1 }\n"
        "C = { type = \"hinge\", bodies = [\"b\", \"c\"], point = [2, 2], velocity = 1 }\n"
        "D = { type = \"hinge\", bodies = [\"ground\", \"c\"], point = [0, 2] }\n[run]\nuntil = 1\nstep = ";
    write_text(folder / "bars.toml", bars + "0.01\n");
    write_text(folder / "short.toml", bars + "0.0005\n");
    for (const char* scene : {"ring.toml", "bars.toml", "short.toml"}) {
        const Finished result = verify({folder / scene});
        INFO(result.out << result.err);
        CHECK(result.exit_code == 0);
        CHECK(!contains(result.out, "FAILED"));
    }
}

TEST_CASE("what forces and time take away is not promised, the rest is checked, for Gauss too") {
    const TemporaryFolder folder;
    write_text(folder / "driven.toml",
               "title = \"Test\"\ntime = \"t\"\nlagrangian = \"q'^2/2 + cos(q)*(1 + cos(t)/4)\"\n[coordinates]\n"
               "q = { position = 1, velocity = 0.5 }\n[forces]\nq = \"-q'/8\"\n[method]\nfamily = \"gauss\"\nstages = "
               "2\n[run]\nstep = 0.1\nuntil = 10\n");
    const Finished result = verify({(folder / "driven.toml").string()});
    INFO(result.out << result.err);
    CHECK(result.exit_code == 0);
    CHECK(contains(result.out, "driven.toml: Test (Gauss, 2 stages)\n"));
    CHECK(contains(result.out, "steps and back, quadruple"));
    CHECK(contains(result.out, "not promised      forces  ok\n"));
    CHECK(!contains(result.out, "symplectic defect"));
    CHECK(!contains(result.out, "energy drift"));
}

TEST_CASE("correct code passes at rest, far from zero and near it, and where energies are too large for numbers") {
    const TemporaryFolder folder;
    struct Motion {
        const char *lagrangian, *position, *step;
        const char* says;
    };
    for (const Motion& motion : std::vector<Motion>{{"q'^2/2 + cos(q)", "\"pi\"", "0.1", "at rest  ok"},
                                                    {"q'^2/2 + cos(q)", "1e6", "0.1", "ok"},
                                                    {"q'^2/2 + cos(q)", "1e-30", "0.1", "ok"},
                                                    {"q'^2/2 + cos(q - 1)", "\"1 + 1e-8\"", "0.01", "ok"},
                                                    {"q'^2/2 - q^2/2", "1e300", "0.1", "energy too large  not judged"},
                                                    {"q'^2/2 - q^2/2", "1", "31", "ok"}}) {
        const std::string start = std::string("q = { position = ") + motion.position + ", velocity = 0 }";
        write_text(folder / "scene.toml", scene_text(motion.lagrangian, start, motion.step));
        const Finished result = verify({(folder / "scene.toml").string()});
        CAPTURE(motion.position);
        CAPTURE(motion.step);
        INFO(result.out << result.err);
        CHECK(result.exit_code == 0);
        CHECK(!contains(result.out, "FAILED"));
        CHECK(contains(result.out, motion.says));
    }
    // The mass of x by itself is 0. Rounding alone moves the radius of a circular orbit, in any units, and the angle of
    // a conical pendulum.
    struct Scene {
        const char *lagrangian, *coordinates, *step, *until = "10";
    };
    for (const Scene& scene : std::vector<Scene>{
             {"x'*y' + x'*y^2 - y^3", "x = { position = 1, velocity = 0.3 }\ny = { position = 0.5, velocity = 1 }",
              "0.1"},
             {"(r'^2 + r^2*a'^2)/2 + 1/r", "r = { position = 1, velocity = 0 }\na = { position = 0, velocity = 1 }",
              "0.1"},
             {"(r'^2 + r^2*a'^2)/2 + 1/r",
              "r = { position = 2, velocity = 0 }\na = { position = 0, velocity = \"2^(-3/2)\" }", "0.1"},
             {"9.1e-31*(r'^2 + r^2*a'^2)/2 + 2.3e-28/r",
              "r = { position = 5.3e-11, velocity = 0 }\na = { position = 0, velocity = "
              "\"sqrt(2.3e-28/9.1e-31/5.3e-11^3)\" }",
              "1e-18", "1e-17"},
             {"(b'^2 + sin(b)^2*a'^2)/2 + cos(b)",
              "b = { position = \"pi/3\", velocity = 0 }\na = { position = 0, velocity = \"sqrt(2)\" }", "0.1"}}) {
        write_text(folder / "scene.toml", scene_text(scene.lagrangian, scene.coordinates, scene.step, scene.until));
        const Finished result = verify({(folder / "scene.toml").string()});
        INFO(result.out << result.err);
        CHECK(result.exit_code == 0);
    }
}

TEST_CASE("right kernels are not accused where forces are hidden at the start, fade, or are a constant in disguise") {
    const TemporaryFolder folder;
    struct Motion {
        const char *lagrangian, *coordinates, *says;
        const char* step = "0.05";
    };
    for (const Motion& motion : std::vector<Motion>{
             // a wall ahead: at the samples near the start nothing depends on x
             {"x'^2/2 - 2*exp(-((x - 5)/0.1)^2)", "x = { position = 4, velocity = 1 }", "symmetries  none found"},
             // a force on y below all numbers of double
             {"x'^2/2 + y'^2/2 - 2*exp(-((x - y - 50)/0.5)^2) - x^2/200",
              "x = { position = 0, velocity = 10 }\ny = { position = 0, velocity = 0 }", "one trajectory, double"},
             // free fall with a total derivative
             {"x'^2/2 - 9.81*x + x^2*x'", "x = { position = 1, velocity = 0.3 }",
              "10.00 where 6 is promised: the error of this motion shrinks faster"},
             // a bond of atoms in metres: the exponential dwarfs all else at most points
             {"1e-26*(x'^2 + y'^2)/2 - 1e-10/3e10*exp(-3e10*(y - x)) - 1e-10*(y - x) - x^2/2",
              "x = { position = 0, velocity = 100 }\ny = { position = 0, velocity = 0 }", "dF_L against central",
              "1e-15"},
             // three masses on springs that fall together
             {"(x'^2 + y'^2 + z'^2)/2 - (x - y)^2 - (y - z)^2*5 + x + y + z",
              "x = { position = 0.3, velocity = 1 }\ny = { position = 0.7, velocity = 0.2 }\nz = { position = 0.1, "
              "velocity = 0.4 }",
              "motion unbounded"}}) {
        write_text(folder / "scene.toml", std::string("lagrangian = \"") + motion.lagrangian + "\"\n[coordinates]\n" +
                                              motion.coordinates + "\n[run]\nstep = " + motion.step +
                                              "\nuntil = \"20*" + motion.step + "\"\n");
        const Finished result = verify({(folder / "scene.toml").string()});
        std::string out = result.out;  // columns are as wide as their longest entry
        for (std::size_t at; (at = out.find("   ")) != std::string::npos;) out.erase(at, 1);
        INFO(motion.lagrangian << "\n" << result.out << result.err);
        CHECK(result.exit_code == 0);
        CHECK(!contains(result.out, "FAILED"));
        CHECK(contains(out, motion.says));
    }
}

TEST_CASE("right kernels are not accused where the equations of a step are badly conditioned, or nothing can be told" *
          doctest::test_suite("slowest")) {
    const TemporaryFolder folder;
    struct Motion {
        const char *lagrangian, *start, *method, *step;
        const char* says;
    };
    const char* const gauss_4 = "family = \"gauss\"\nstages = 4";
    for (const Motion& motion : std::vector<Motion>{
             // h omega = 141, 500 and 44
             {"q'^2/2 - 5000*q^2", "q = { position = 1, velocity = 0 }", gauss_4, "1.41", "ok"},
             {"q'^2/2 - 125000*q^2", "q = { position = 1, velocity = 0.3 }", "family = \"gauss\"\nstages = 2", "1",
              "not decided  with all steps the error is as large as the motion"},
             {"x'^2/2 + y'^2/2 - 1000*(x - y)^2 - x^2/2 - y^4/4",
              "x = { position = 1, velocity = 0 }\ny = { position = 0.5, velocity = 0 }", gauss_4, "1", "ok"},
             // and with a nonlinear force: the equations of a step lose digits, or have several solutions
             {"q'^2/2 - (141*q)^2/2 - q^4", "q = { position = 1, velocity = 0 }", "family = \"gauss\"\nstages = 8", "1",
              "not decided  the step is too long: h omega = "},
             {"q'^2/2 + cos(30*q)", "q = { position = 1, velocity = 0 }", "points = 3", "0.5",
              "not decided  the step is too long: h omega = "},
             {"q'^2/2 + cos(100*q)", "q = { position = 1, velocity = 0 }", gauss_4, "0.5", "not decided"},
             {"q'^2/2 - q^4*1000", "q = { position = 1, velocity = 0 }", "points = 6", "0.5", "not decided"},
             {"q'^2/2 - exp(50*q)", "q = { position = 1, velocity = -1 }", gauss_4, "0.1", "not decided"},
             // a stiff direction at rest, whose roundings return larger
             {"x'^2/2 + y'^2/2 - 50000*(x - y)^2 - x^4/4 - y^4/4",
              "x = { position = 1, velocity = 0 }\ny = { position = 1, velocity = 0 }", gauss_4, "0.5",
              "not decided  the equations of such a step lose 1 digits"},
             // an error that the largest of the steps leave by chance
             {"q'^2/2 + cos(q)", "q = { position = 2, velocity = 0 }", "points = 11", "0.1",
              " where 20 is promised: the error of this motion shrinks faster"},
             // a motion whose acceleration has no bound
             {"q'^4/4 - q^2/2", "q = { position = 0.1, velocity = 0.1 }", "points = 4", "0.01",
              "not decided  0.52 where 6 is promised: the motion is not smooth enough to tell"},
             // a mass that vanishes at rest
             {"q'^4/4 - q^2/2", "q = { position = 0.1, velocity = 1 }", "points = 4", "0.01", "ok"}}) {
        write_text(folder / "scene.toml", std::string("lagrangian = \"") + motion.lagrangian + "\"\n[coordinates]\n" +
                                              motion.start + "\n[method]\n" + motion.method +
                                              "\n[run]\nstep = " + motion.step + "\nuntil = 10\n");
        const Finished result = verify({(folder / "scene.toml").string()});
        INFO(motion.lagrangian << "\n" << result.out << result.err);
        CHECK(result.exit_code == 0);
        CHECK(!contains(result.out, "FAILED"));
        CHECK(contains(result.out, motion.says));
    }
}

TEST_CASE("an equilibrium is not accused of the rounding of its energy") {
    const TemporaryFolder folder;
    write_text(folder / "rest.toml",
               scene_text("1e-12*((x'^2 + y'^2)/2 - 5*(1 - cos(x)) - 7*(1 - cos(y)) - 3*x*y)",
                          "x = { position = 0, velocity = 0 }\ny = { position = 0, velocity = 0 }", "0.1"));
    const Finished result = verify({(folder / "rest.toml").string()});
    CHECK_MESSAGE(result.exit_code == 0, result.out);
    CHECK(contains(result.out, "the motion rests"));
}

TEST_CASE("a check that fails ends with exit code 3, the check's name and what it means") {
    const TemporaryFolder folder;
    // 1e9 sqrt(1 + 1e-9 q^2) - 1e9 has seven digits.
    write_text(folder / "lost.toml",
               scene_text("q'^2/2 - 1e9*(sqrt(1 + q^2*1e-9) - 1)", "q = { position = 1, velocity = 0 }", "0.1"));
    const Finished result = verify({(folder / "lost.toml").string()});
    CHECK(result.exit_code == 3);
    CHECK(
        contains(result.err, "lost.toml: the check 'H in double against quadruple' fails: terms of the energy cancel"));
}

TEST_CASE("a step that is not positive and a scene that is missing are mistakes of the input") {
    const TemporaryFolder folder;
    write_text(folder / "back.toml", scene_text("q'^2/2 - q^2/2", "q = { position = 1, velocity = 0 }", "-1"));
    CHECK(verify({(folder / "back.toml").string()}).exit_code == 2);
    CHECK(verify({(folder / "none.toml").string()}).exit_code == 2);
    CHECK(verify({LOBATTO_SOURCE_DIR "/scenes/pendulum.toml", "--points", "13"}).exit_code == 2);
}
