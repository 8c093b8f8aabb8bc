// SPDX-License-Identifier: GPL-2.0-or-later
// Motions under formulas whose derivatives are known otherwise: atan2, and tables of measured values.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>
#include <string>
#include <vector>

#include "analysis/kernel/kernel_of.hpp"
#include "analysis/motion.hpp"
#include "generator/check/check.hpp"
#include "generator/mechanics/start.hpp"
#include "generator/pipeline.hpp"
#include "generator/programs/programs.hpp"
#include "runtime/run/trajectory.hpp"
#include "tests/analysis/measured_scene.hpp"
#include "tests/support.hpp"

using namespace lobatto;

namespace {

TrajectoryResult run(const Scene& scene) {
    const Kernel kernel = kernel_of(emit(derive(scene)), Precision::double_);
    LoadedStepper<double> stepper(kernel);
    return integrate(kernel, request_of(scene, steps_of(scene, {}).count, stepper));
}
TrajectoryResult run(const std::string& text) {
    return run(read_scene(Source("measured.toml", text)));
}
// In numbers of another type, by the program: the last line of the trajectory.
std::string last_line(const std::string& scene, const std::vector<std::string>& more,
                      const test::TemporaryFolder& folder) {
    std::vector<std::string> command = {LOBATTO_PROGRAM, "run", scene, "--quiet", "-o", (folder / "run.csv").string()};
    command.insert(command.end(), more.begin(), more.end());
    const test::Finished finished = test::run(command);
    REQUIRE_MESSAGE(finished.exit_code == 0, finished.err);
    const std::string text = test::read_file(folder / "run.csv");
    return text.substr(text.rfind('\n', text.size() - 2) + 1);
}

// A planet that is pushed along its orbit by the slope of an angle: F = c (-y, x)/r^2.
std::string pushed(const std::string& potential, const std::string& forces, const std::string& more) {
    return "lagrangian = \"(x'^2 + y'^2)/2 - (x^2 + y^2)/2" + potential +
           "\"\n[coordinates]\nx = { position = -1, velocity = 0.2 }\ny = { position = 0.3, velocity = 0.9 }\n"
           "[parameters]\nc = 0.05\n" +
           forces + "[run]\nstep = 0.1\nuntil = 20\n" + more;
}
const std::string by_hand = "[forces]\nx = \"-c*y/(x^2 + y^2)\"\ny = \"c*x/(x^2 + y^2)\"\n";

// Places 0, 0.1, ..., 2 and the values of a cubic polynomial there.
double cubic(double u) {
    return 1 - 2 * u + u * u * u / 2;
}
void write_cubic(const test::TemporaryFolder& folder) {
    std::string text = "time, torque\n# measured by nobody\n";
    for (int i = 0; i <= 20; ++i) {
        const double u = i / 10.0;
        text += fmt::format("{:.1f}, {:.6f}\n", u, cubic(u));
    }
    test::write_text(folder / "torque.csv", text);
}
std::string scene_with(const std::string& force, const std::string& until = "1.9") {
    return "time = \"t\"\nlagrangian = \"m*q'^2/2 + cos(q)\"\n[coordinates]\nq = { position = 0.4, velocity = 0.5 }\n"
           "[parameters]\nm = 2\n[forces]\nq = '''" +
           force + "'''\n[run]\nstep = 0.1\nuntil = " + until + "\n";
}
std::string refusal_of(const std::string& path) {
    const std::string text = test::message_of<InputError>([&] { static_cast<void>(run(read_scene(path))); });
    return text.substr(0, text.find('\n'));
}

}  // namespace

TEST_CASE("the slope of atan2 is the force c (-y, x)/r^2, also across the cut, in all forms and numbers" *
          doctest::test_suite("slowest")) {
    const test::TemporaryFolder folder;
    for (const char* method : {"[method]\npoints = 6\n", "[method]\nfamily = \"gauss\"\nstages = 3\n",
                               "[method]\nfamily = \"splitting\"\nstages = 17\n"}) {
        CAPTURE(method);
        const TrajectoryResult angle = run(pushed(" + c*atan2(y, x)", "", method)),
                               force = run(pushed("", by_hand, method));
        REQUIRE(angle.status == LOBATTO_OK);
        for (std::size_t k = 0; k < 2; ++k) {
            CHECK(std::fabs(angle.q[k] - force.q[k]) < 1e-13);
            CHECK(std::fabs(angle.p[k] - force.p[k]) < 1e-13);
        }
        CHECK(std::fabs(angle.q[0]) + std::fabs(angle.q[1]) > 0.1);
    }
    // As a velocity-dependent term it needs the general form, and values of atan2 itself: gauge terms move nothing.
    const TrajectoryResult gauge = run(pushed(" + c*(x*y'/(x^2 + y^2) - y*x'/(x^2 + y^2))*atan2(y, 3 + x)", "", "")),
                           by_tangent =
                               run(pushed(" + c*(x*y'/(x^2 + y^2) - y*x'/(x^2 + y^2))*atan(y/(3 + x))", "", ""));
    CHECK(std::fabs(gauge.q[0] - by_tangent.q[0]) < 1e-12);
    test::write_text(folder / "angle.toml",
                     pushed(" + c*atan2(y, x)*atan2(y, 3 + x)", "", "[output]\nenergy = false\n"));
    test::write_text(folder / "tangent.toml",
                     pushed(" + 2*c*atan(y/(hypot(x, y) + x))*atan(y/(3 + x))", "", "[output]\nenergy = false\n"));
    for (const char* numbers : {"double", "float", "long double", "double-double", "quadruple"}) {
        CAPTURE(numbers);
        const auto row_of = [&](const char* name) {
            return last_line(folder / name, {"--numbers", numbers, "--until", "1", "--step", "0.05"}, folder);
        };
        const double digits = std::string(numbers) == "float" ? 1e-4 : 1e-12;
        const std::string angle = row_of("angle.toml"), tangent = row_of("tangent.toml");
        const std::size_t comma = angle.find(',') + 1;
        CHECK(std::fabs(std::stod(angle.substr(comma)) - std::stod(tangent.substr(tangent.find(',') + 1))) < digits);
        if (digits < 1e-5) CHECK(angle.substr(comma, 12) == tangent.substr(tangent.find(',') + 1, 12));
    }
}

TEST_CASE("a wrapped angle is not linear, though its derivatives are constant") {
    const auto end_of = [](const std::string& force) {
        return run("lagrangian = \"q'^2/2\"\n[coordinates]\nq = { position = 3, velocity = 1 }\n[forces]\nq = \"" +
                   force + "\"\n[method]\npoints = 4\n[run]\nstep = 0.05\nuntil = 4\n")
            .q[0];
    };
    const double wrapped = end_of("-atan2(sin(q), cos(q))");
    CHECK(wrapped == doctest::Approx(end_of("-atan2(sin(q), cos(q)) - 1e-14*q^3")).epsilon(1e-9));
    CHECK(wrapped > 3.2);  // beyond the cut at pi it is pushed on; a spring would have pulled it back
}

TEST_CASE("check tells of the jump of atan2, and a motion through the origin ends with its name") {
    const Derivation derivation = derive(read_scene(Source("a.toml", pushed(" + c*atan2(y, x)", "", ""))));
    const auto found = std::find_if(derivation.findings.begin(), derivation.findings.end(),
                                    [](const Finding& finding) { return finding.name == "angles of atan2"; });
    REQUIRE(found != derivation.findings.end());
    CHECK(found->reason == "atan2(y, x) jumps by 2*pi where y passes 0 and x is below 0, and no step is cut there");
    for (const Check& row : check_programs(derivation, optimised_programs(derivation).programs)) {
        CAPTURE(row.claim);
        CHECK(row.holds);
    }
    CHECK_THROWS_WITH(
        [] {
            const Scene scene = read_scene(
                Source("a.toml",
                       "lagrangian = \"q'^2/2 - atan2(q, q^2)\"\n[coordinates]\nq = { position = 0, velocity "
                       "= 1 }\n[run]\nstep = 1\nuntil = 1\n"));
            static_cast<void>(run(scene));
        }(),
        doctest::Contains("a.toml"));
}

TEST_CASE("a table of a cubic polynomial is that polynomial, as a force of the time and in a potential" *
          doctest::test_suite("slowest")) {
    const test::TemporaryFolder folder;
    write_cubic(folder);
    const std::string polynomial = "(1 - 2*t + t^3/2)*0.3";
    test::write_text(folder / "table.toml", scene_with("table(\"torque.csv\", t)*0.3"));
    test::write_text(folder / "polynomial.toml", scene_with(polynomial));
    const TrajectoryResult table = run(read_scene(folder / "table.toml")), exact = run(scene_with(polynomial));
    REQUIRE(table.status == LOBATTO_OK);
    CHECK(std::fabs(table.q[0] - exact.q[0]) < 1e-14);
    CHECK(std::fabs(table.p[0] - exact.p[0]) < 1e-14);
    // In other numbers the values are as exact as these: all digits agree.
    for (const char* numbers : {"float", "long double", "double-double", "quadruple"}) {
        CAPTURE(numbers);
        const std::string one = last_line(folder / "table.toml", {"--numbers", numbers}, folder),
                          other = last_line(folder / "polynomial.toml", {"--numbers", numbers}, folder);
        const std::size_t digits = std::string(numbers) == "float"         ? 6
                                   : std::string(numbers) == "long double" ? 17
                                                                           : 30;
        CHECK(one.substr(one.find(','), digits) == other.substr(other.find(','), digits));
    }
    // In a potential: forces and Jacobians hold its derivatives; with a velocity in the general form.
    for (const char* kinetic : {"q'^2/2", "(1 + q^2)*q'^2/2"}) {
        CAPTURE(kinetic);
        const auto scene = [&](const std::string& potential) {
            return fmt::format(
                "lagrangian = '''{} - {}'''\n[coordinates]\nq = {{ position = 1, velocity = 0.1 }}\n"
                "[run]\nstep = 0.1\nuntil = 1\n",
                kinetic, potential);
        };
        test::write_text(folder / "potential.toml", scene("table(\"torque.csv\", q)"));
        const TrajectoryResult one = run(read_scene(folder / "potential.toml")),
                               other = run(scene("(1 - 2*q + q^3/2)"));
        REQUIRE(one.status == LOBATTO_OK);
        CHECK(std::fabs(one.q[0] - other.q[0]) < 1e-14);
        CHECK(std::fabs(one.p[0] - other.p[0]) < 1e-14);
        const Derivation derivation = derive(read_scene(folder / "potential.toml"));
        for (const Check& row : check_programs(derivation, optimised_programs(derivation).programs)) {
            CAPTURE(row.claim);
            CHECK(row.holds);
        }
    }
}

TEST_CASE("a motion that leaves a table ends with exit code 3 and its name, one that starts outside with 2") {
    const test::TemporaryFolder folder;
    write_cubic(folder);
    test::write_text(folder / "late.toml", scene_with("table(\"torque.csv\", t)", "3"));
    const test::Finished late = test::run({LOBATTO_PROGRAM, "run", folder / "late.toml", "-o", folder / "late.csv"});
    CHECK(late.exit_code == 3);
    CHECK(late.err.find("torque.csv") != std::string::npos);
    test::write_text(folder / "early.toml", scene_with("table(\"torque.csv\", t - 0.05)"));
    CHECK(refusal_of(folder / "early.toml").find("the table torque.csv, which goes from 0 to 2,") != std::string::npos);
    // Up to its very end it serves.
    test::write_text(folder / "whole.toml", scene_with("table(\"torque.csv\", t)", "2"));
    CHECK(run(read_scene(folder / "whole.toml")).status == LOBATTO_OK);
}

TEST_CASE("check says how smooth a table is") {
    const test::TemporaryFolder folder;
    write_cubic(folder);
    test::write_text(folder / "scene.toml", scene_with("table(\"torque.csv\", t)"));
    const Derivation derivation = derive(read_scene(folder / "scene.toml"));
    const auto found = std::find_if(derivation.findings.begin(), derivation.findings.end(),
                                    [](const Finding& finding) { return finding.name == "measured values"; });
    REQUIRE(found != derivation.findings.end());
    CHECK(found->reason.starts_with(
        "torque.csv: cubic polynomials between 21 knots, smooth to the second derivative (C2)."));
}

TEST_CASE("a step across a knot errs by h^4 where a force is the table, and steps that end at knots keep the order") {
    const test::TemporaryFolder folder;
    // |u| cubed, whose third derivative jumps at 0 alone: knots at -3 ... 3.
    std::string text;
    for (int i = -3; i <= 3; ++i) text += fmt::format("{}, {}\n", i, std::abs(i * i * i));
    test::write_text(folder / "cube.csv", text);
    const auto error_with = [&](double shift, int steps) {
        const std::string scene = fmt::format(
            "time = \"t\"\nlagrangian = \"q'^2/2\"\n[coordinates]\nq = {{ position = 0, velocity = 0 }}\n[forces]\n"
            "q = '''table(\"cube.csv\", t - 1 - {0})'''\n[method]\npoints = 6\n[run]\nstep = \"2/{1}\"\nuntil = 2\n",
            shift, steps);
        test::write_text(folder / "cube.toml", scene);
        const TrajectoryResult coarse = run(read_scene(folder / "cube.toml"));
        REQUIRE(coarse.status == LOBATTO_OK);
        return coarse.p[0];
    };
    // At knots the steps are exact: the integral of polynomials. The table is not |u|^3 itself, so compare two sums.
    CHECK(std::fabs(error_with(0, 2) - error_with(0, 8)) < 1e-14);
    const double exact = error_with(0.1, 20), coarse = error_with(0.1, 3) - exact, fine = error_with(0.1, 6) - exact;
    CHECK(std::fabs(exact - error_with(0.1, 40)) < 1e-14);
    CHECK(std::fabs(coarse) > 1e-6);
    CHECK(std::fabs(fine) < std::fabs(coarse));
}

TEST_CASE("a fast top near its pole keeps its digits without its cyclic coordinates") {
    const test::MeasuredScene top(
        "lagrangian = \"A*(th'^2 + ph'^2*sin(th)^2)/2 + C*(ps' + ph'*cos(th))^2/2 - 9.81*cos(th)\"\n[coordinates]\n"
        "th = { position = 0.003, velocity = 0 }\nph = { position = 0, velocity = 0 }\n"
        "ps = { position = 0, velocity = 30 }\n[parameters]\nA = 1\nC = 0.5\n[run]\nstep = 0.005\nuntil = 1\n");
    const test::Finished reduced = top.run();
    CHECK_MESSAGE(reduced.exit_code == 0, reduced.err);
    const std::vector<double> end = top.end();
    CHECK(top.run({"--general", "--numbers", "quadruple", "--step", "0.001"}).exit_code == 0);
    CHECK(std::abs(end[1] - top.end()[1]) < 1e-13);
}
