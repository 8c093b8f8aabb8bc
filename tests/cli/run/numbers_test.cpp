// SPDX-License-Identifier: GPL-2.0-or-later
// lobatto run in other numbers than double: from the scene or the option, with all digits in the file, or refused.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <sstream>

#include "runtime/files/decimal.hpp"
#include "runtime/run/parts.hpp"
#include "tests/support.hpp"
#include "tests/trajectory_table.hpp"

using namespace lobatto;

namespace {

const std::string oscillators = LOBATTO_SOURCE_DIR "/scenes/henon_heiles.toml";
const std::string pendulum = LOBATTO_SOURCE_DIR "/scenes/pendulum.toml";

struct Place {
    test::TemporaryFolder folder;
    std::string file(const std::string& name) const { return folder / name; }
    test::Finished run(std::vector<std::string> arguments) const {
        arguments.insert(arguments.begin(), LOBATTO_PROGRAM);
        return test::run(arguments);
    }
};

// The cells of the last line of a trajectory.
std::vector<std::string> last_row(const std::string& file) {
    std::string text = test::read_file(file);
    text.pop_back();
    std::stringstream line(text.substr(text.rfind('\n') + 1));
    std::vector<std::string> cells;
    for (std::string cell; std::getline(line, cell, ',');) cells.push_back(cell);
    return cells;
}

// Of the ends of two runs, over the largest coordinate.
double distance(const std::vector<std::string>& a, const std::vector<std::string>& b) {
    double worst = 0;
    for (std::size_t i = 1; i < a.size(); ++i) {
        double x[3], y[3];
        REQUIRE(read_decimal(a[i], x, 3));
        REQUIRE(read_decimal(b[i], y, 3));
        worst = std::max(worst, std::fabs(difference(x, y, 3)));
    }
    return worst;
}

}  // namespace

TEST_CASE("in double-double the steps of constant masses are solved to rounding, whatever the tolerance") {
    const Place place;
    const auto table = [&](const std::string& file, std::vector<std::string> tolerance) {
        std::vector<std::string> words{"run", pendulum, "--until", "1", "--numbers", "double-double", "-o", file};
        words.insert(words.end(), tolerance.begin(), tolerance.end());
        const test::Finished finished = place.run(words);
        CHECK_MESSAGE(finished.exit_code == 0, finished.err);
        CHECK(!test::contains(finished.out, "not exact"));
        return last_row(file);
    };
    CHECK(table(place.file("loose.csv"), {"--tolerance", "1e-3"}) == table(place.file("exact.csv"), {}));
}

TEST_CASE("runs in double-double and quadruple agree to 30 digits, and each file reads back to its numbers" *
          doctest::test_suite("slow")) {
    const Place place;
    const auto end_in = [&](const std::string& numbers) {
        const std::string file = place.file(numbers + ".csv");
        const test::Finished finished =
            place.run({"run", oscillators, "--points", "12", "--until", "2", "--numbers", numbers, "-o", file});
        INFO(finished.err);
        REQUIRE(finished.exit_code == 0);
        CHECK(test::contains(test::read_file(file), ", in " + numbers + "\n"));
        CHECK(test::contains(finished.out, "measured error"));
        return last_row(file);
    };
    const auto pair = end_in("double-double"), quadruple = end_in("quadruple");
    CHECK(distance(pair, quadruple) < 1e-30);  // 2e-32; of some 0.3
    CHECK(distance(pair, quadruple) > 0);
    CHECK(distance(end_in("long double"), quadruple) < 1e-18);
    CHECK(distance(end_in("float"), quadruple) < 1e-5);
    for (const std::string& cell : pair) {
        double parts[2];
        REQUIRE(read_decimal(cell, parts, 2));
        CHECK(decimal_text(parts, 2) == cell);
    }
}

TEST_CASE("numbers stand in the scene, and --numbers takes their place") {
    const Place place;
    std::string text = test::read_file(pendulum);
    text.insert(text.find("[method]\n") + 9, "numbers = \"double-double\"\n");
    const std::string scene = place.file("scene.toml"), csv = place.file("run.csv");
    test::write_text(scene, text);
    REQUIRE(place.run({"run", scene, "--until", "1", "-o", csv}).exit_code == 0);
    CHECK(test::contains(test::read_file(csv), ", in double-double\n"));
    REQUIRE(place.run({"run", scene, "--until", "1", "--numbers", "double", "-o", csv}).exit_code == 0);
    CHECK_FALSE(test::contains(test::read_file(csv), ", in double"));
    for (const std::string command : {"roundoff", "stability"}) {
        CAPTURE(command);
        std::vector<std::string> words = {command, scene};
        const test::Finished refused = place.run(words);
        CHECK(refused.exit_code == 2);
        CHECK(
            test::contains(refused.err, fmt::format("{}: `lobatto {}` computes in double, but numbers are "
                                                    "\"double-double\"; give --numbers double, or leave `numbers` out "
                                                    "under [method]",
                                                    scene, command)));
    }
    test::write_text(scene, text.replace(text.find("double-double"), 13, "half"));
    const test::Finished unknown = place.run({"run", scene, "-o", csv});
    CHECK(unknown.exit_code == 2);
    CHECK(test::contains(unknown.err,
                         "unknown numbers; there are \"float\", \"double\", \"long double\", \"double-double\", "
                         "\"quadruple\" and \"20 digits\" to \"140 digits\""));
}

TEST_CASE("what other numbers cannot do is refused") {
    const Place place;
    const std::string csv = place.file("run.csv"), comet = place.file("comet.toml");
    const test::Finished clean =
        place.run({"run", pendulum, "--arithmetic", "clean", "--numbers", "double-double", "-o", csv});
    CHECK(clean.exit_code == 2);
    CHECK(test::contains(clean.err, "clean arithmetic is for numbers of one machine word"));
    test::write_text(comet,
                     "lagrangian = \"(x'^2 + y'^2)/2 + 1/sqrt(x^2 + y^2)\"\n[coordinates]\n"
                     "x = { position = 0.1, velocity = 0 }\ny = { position = 0, velocity = \"sqrt(19)\" }\n"
                     "[method]\npoints = 8\nclock = \"(x^2 + y^2)^(3/4)\"\n[run]\nstep = 0.5\nuntil = 6\n");
    const test::Finished clocked = place.run({"run", comet, "--numbers", "double-double", "-o", csv});
    CHECK(clocked.exit_code == 2);
    CHECK(test::contains(clocked.err, comet + ":7:9: with a clock `lobatto run` computes in double, but numbers are "
                                              "\"double-double\"; remove the clock, or give --numbers double"));
    const test::Finished asked = place.run({"run", comet, "--clock", "auto", "--numbers", "double-double", "-o", csv});
    CHECK(asked.exit_code == 2);
    CHECK(test::contains(asked.err, comet + ": clock = \"auto\", from an option: with a clock `lobatto run` computes"));
}

TEST_CASE("a sweep computes in the numbers that are asked for, with the digits of a run") {
    const Place place;
    const std::string csv = place.file("sweep.csv"), alone = place.file("run.csv");
    const auto sweep = [&](const std::vector<std::string>& more) {
        std::vector<std::string> words{"sweep", oscillators, "--points", "12", "--until", "2", "--vary", "y=0.2,0.3"};
        words.insert(words.end(), more.begin(), more.end());
        words.insert(words.end(), {"-o", csv});
        const test::Finished done = place.run(words);
        REQUIRE_MESSAGE(done.exit_code == 0, done.err);
        return test::read_trajectory(csv);
    };
    const std::vector<std::vector<double>> in_double = sweep({}).rows;
    for (const std::string numbers : {"double-double", "quadruple", "long double"}) {
        CAPTURE(numbers);
        const test::TrajectoryTable table = sweep({"--numbers", numbers});
        CHECK(test::contains(test::read_file(csv), ", in " + numbers + "\n"));
        const std::size_t parts = numbers == "quadruple" ? 3 : 2;
        const auto x = static_cast<std::size_t>(std::find(table.columns.begin(), table.columns.end(), "x") -
                                                table.columns.begin());
        REQUIRE(x + 2 * parts < table.columns.size());
        CHECK(table.columns[x + 1] == "x.rest");
        CHECK(table.columns[x + parts] == "y");
        // The second trajectory is the scene itself: its digits are those of a run.
        REQUIRE(place.run({"run", oscillators, "--points", "12", "--until", "2", "--numbers", numbers, "-o", alone})
                    .exit_code == 0);
        const std::vector<std::string> end = last_row(alone);
        for (std::size_t k = 0; k < 2; ++k) {
            double whole[3];
            REQUIRE(read_decimal(end[1 + k], whole, static_cast<int>(parts)));
            for (std::size_t part = 0; part < parts; ++part) CHECK(table.rows[1][x + k * parts + part] == whole[part]);
        }
        const auto error = table.rows[1].back();
        CHECK(error < 1e-12);  // measured, as without the option
        CHECK(std::fabs(table.rows[0][x] - in_double[0][x]) < 1e-14);
    }
    // Two starts side by side in vector registers.
    const std::vector<std::vector<double>> in_float = sweep({"--numbers", "float"}).rows;
    REQUIRE(in_float.size() == in_double.size());
    for (std::size_t i = 0; i < in_float.size(); ++i)
        for (std::size_t c = 0; c + 2 < in_float[i].size(); ++c)
            CHECK(std::fabs(in_float[i][c] - in_double[i][c]) < 1e-4);
    CHECK(in_float[1].back() > 1e-9);
    CHECK(in_float[1].back() < 1e-3);
}

TEST_CASE("sweeps in other numbers go on where they were stopped, and refuse what is computed in double alone") {
    const Place place;
    const std::string csv = place.file("sweep.csv");
    const std::vector<std::string> words{"sweep", pendulum,    "--vary",        "q=0.1:1:40", "--until",
                                         "2",     "--numbers", "double-double", "-o",         csv};
    REQUIRE(place.run(words).exit_code == 0);
    const std::string whole = test::read_file(csv);
    std::filesystem::rename(csv, csv + ".partial");
    std::filesystem::resize_file(csv + ".partial", whole.size() * 2 / 3);
    std::vector<std::string> again = words;
    again.push_back("--resume");
    const test::Finished resumed = place.run(again);
    REQUIRE_MESSAGE(resumed.exit_code == 0, resumed.err);
    CHECK(test::contains(resumed.out, "resumed"));
    CHECK(test::read_file(csv) == whole);
    const test::Finished kept =
        place.run({"sweep", pendulum, "--vary", "q=0.1,1", "--keep", "max(q)", "--numbers", "float", "-o", csv});
    CHECK(kept.exit_code == 2);
    CHECK(test::contains(kept.err,
                         "what sweeps keep of a trajectory is computed in double, but numbers are \"float\"; leave "
                         "out --keep and `keep`, or give --numbers double"));
}

TEST_CASE("in float twelve points lead where they lead in double, for linear systems and with constraints") {
    const Place place;
    const auto written = [&](const std::string& name, const std::string& lagrangian, const std::string& rest) {
        test::write_text(place.file(name), "lagrangian = \"" + lagrangian + "\"\n" + rest);
        return place.file(name);
    };
    const std::string turning = written("turning.toml", "(x'^2 + y'^2)/2 + 0.4*(x*y' - y*x') - (x^2 + 3*y^2)/2",
                                        "[coordinates]\nx = { position = 1, velocity = 0 }\n"
                                        "y = { position = 0, velocity = 0.2 }\n[run]\nstep = 0.1\nuntil = 20\n"),
                      rod = written("rod.toml", "(x'^2 + y'^2)/2 - 9.81*y",
                                    "[coordinates]\nx = { position = 0.6, velocity = 0 }\n"
                                    "y = { position = -0.8, velocity = 0 }\n[constraints]\nrod = \"x^2 + y^2 = 1\"\n"
                                    "[run]\nstep = 0.05\nuntil = 3\n");
    // Polynomials that float continued over the next step were 10^8 times their rounding away: at t = 20 the first was
    // at 7e12, and the second went over the top.
    for (const std::string& scene : {turning, rod})
        for (const std::string step : {"0.01", "0.05", "0.1"})
            for (const std::string points : {"7", "12"}) {
                CAPTURE(scene);
                CAPTURE(step);
                CAPTURE(points);
                const auto end_in = [&](const std::string& numbers) {
                    const test::Finished done =
                        place.run({"run", scene, "--points", points, "--step", step, "--numbers", numbers,
                                   "--unmeasured", "-o", place.file("run.csv")});
                    CHECK_MESSAGE(done.exit_code == 0, done.err);
                    return last_row(place.file("run.csv"));
                };
                CHECK(distance(end_in("float"), end_in("double")) < 1e-4);
            }
}

TEST_CASE("verify goes back from the time that the steps have reached, with all of its digits") {
    const Place place;
    test::write_text(place.file("driven.toml"),
                     "time = \"t\"\nlagrangian = \"x'^2/2 - x^2/2 + x*cos(t)\"\n[coordinates]\n"
                     "x = { position = 1, velocity = 0 }\n[run]\nstep = 0.01\nuntil = 1\n");
    const test::Finished done = place.run({"verify", place.file("driven.toml"), "--numbers", "double-double"});
    CHECK_MESSAGE(done.exit_code == 0, done.out);
    CHECK(test::contains(done.out, "20 steps and back, double-double"));
}

TEST_CASE("verify proves the steps of a scene in its own numbers beside those in double and quadruple" *
          doctest::test_suite("slow")) {
    const Place place;
    for (const std::string numbers : {"double-double", "long double", "float"}) {
        CAPTURE(numbers);
        const test::Finished done = place.run({"verify", oscillators, "--points", "6", "--numbers", numbers});
        CHECK_MESSAGE(done.exit_code == 0, done.out);
        for (const std::string claim : {"20 steps against quadruple, ", "20 steps and back, ", "symplectic defect, "})
            CHECK(test::contains(done.out, claim + numbers));
        CHECK_FALSE(test::contains(done.out, "FAILED"));
    }
}

TEST_CASE("constants of pairs stand beside numbers of any kind, also where Jacobians are in double") {
    const Place place;
    test::write_text(place.file("pairs.toml"),
                     "lagrangian = \"\"\"sum(i = 1 .. n, x[i]'^2)/2 - sum(i = 1 .. n, sum(j = i + 1 .. n, "
                     "i*cos(x[i] - x[j])))\"\"\"\n[coordinates]\nx = { count = \"n\", position = \"0.3*sin(i)\", "
                     "velocity = 0 }\n[parameters]\nn = { value = 12, constant = true }\n[method]\npoints = 10\n[run]\n"
                     "step = 0.01\nuntil = 0.1\n");
    const auto end = [&](const std::string& numbers) {
        const test::Finished done =
            place.run({"run", place.file("pairs.toml"), "--numbers", numbers, "-o", place.file("pairs.csv")});
        REQUIRE_MESSAGE(done.exit_code == 0, done.err);
        return test::read_trajectory(place.file("pairs.csv")).rows.back();
    };
    const std::vector<double> high = end("double-double"), plain = end("double");
    for (std::size_t k = 0; k < plain.size(); ++k) CHECK(std::fabs(high[k] - plain[k]) < 1e-11);
}

TEST_CASE("a closed solution in double is no measure of finer numbers") {
    const Place place;
    const std::string pendulum = LOBATTO_SOURCE_DIR "/scenes/pendulum.toml";
    const auto says = [&](const std::string& numbers) {
        return place.run({"run", pendulum, "--numbers", numbers, "--until", "1", "-o", place.file("run.csv")}).out;
    };
    CHECK(test::contains(says("double"), "position error"));
    CHECK_FALSE(test::contains(says("double-double"), "position error"));
}
