// SPDX-License-Identifier: GPL-2.0-or-later
// The columns of a trajectory beside its state: formulas of the scene, eliminated coordinates, and what bodies do.
#include <doctest/doctest.h>
#include <ginac/ginac.h>

#include <cmath>
#include <sstream>
#include <string>

#include "tests/support.hpp"
#include "tests/trajectory_table.hpp"

using namespace lobatto;

namespace {

using Columns = std::vector<std::string>;

// The table of a run, and the texts of its last row.
struct TableOfRun {
    test::TrajectoryTable table;
    Columns last;
};

TableOfRun table_of_run(const std::string& text, const std::vector<std::string>& more = {}) {
    const test::TemporaryFolder folder;
    test::write_text(folder / "scene.toml", text);
    std::vector<std::string> arguments{LOBATTO_PROGRAM, "run", folder / "scene.toml", "-o", folder / "run.csv"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const test::Finished finished = test::run(arguments);
    CAPTURE(finished.err);
    REQUIRE(finished.exit_code == 0);
    TableOfRun result{test::read_trajectory(folder / "run.csv"), {}};
    std::istringstream lines(test::read_file(folder / "run.csv"));
    std::string line, last, number;
    while (std::getline(lines, line)) last = line;
    for (std::istringstream numbers(last); std::getline(numbers, number, ',');) result.last.push_back(number);
    return result;
}

const std::string circle =
    "lagrangian = \"(x'^2 + y'^2)/2 - y\"\n[coordinates]\nx = { unit = \"m\" }\na = { position = 1, velocity = 0 }\n"
    "y = {}\n[constraints]\nacross = \"x = sin(a)\"\nup = \"y = -cos(a)\"\n[run]\nstep = 0.1\nuntil = 1\n";

}  // namespace

TEST_CASE("eliminated coordinates have columns behind the state") {
    const TableOfRun run = table_of_run(circle);
    CHECK(run.table.columns == Columns{"t", "a", "p_a", "x", "x'", "y", "y'", "H"});
    CHECK(run.table.comments.back() == "columns: t, a, p_a, x [m], x', y, y', H");
    for (const std::vector<double>& row : run.table.rows) {
        CHECK(std::fabs(row[3] - std::sin(row[1])) < 1e-15);
        CHECK(std::fabs(row[6] - std::sin(row[1]) * row[2]) < 1e-15);
    }
    std::string heavy = circle;
    heavy.replace(heavy.find(" - y"), 4, " - y + a'^2");
    CHECK(table_of_run(heavy + "[output]\nmultipliers = true\n").table.columns ==
          Columns{"t", "x", "a", "y", "p_x", "p_a", "p_y", "lambda_across", "lambda_up", "H"});
}

TEST_CASE("a scene names formulas that are columns") {
    const std::string circuit =
        "time = \"s\"\nlagrangian = \"L*q'^2/2 - q^2/(2*C)\"\ndefinitions = { v = \"q/C\" }\n[coordinates]\n"
        "q = { position = 1, velocity = 0 }\n[parameters]\nL = 2\nC = 0.5\n[run]\nstep = 0.1\nuntil = 1\n"
        "[output]\ncolumns = { i = \"q'\", u = \"v*cos(s)\", size = \"abs(q - 0.7)\", depth = \"log(q')\" }\n";
    const TableOfRun run = table_of_run(circuit);
    const double q = std::cos(1.0), i = -std::sin(1.0);  // exactly
    CHECK(test::column_of(run.table, "i").back() == doctest::Approx(i).epsilon(1e-9));
    CHECK(test::column_of(run.table, "u").back() == doctest::Approx(q / 0.5 * std::cos(1.0)).epsilon(1e-9));
    CHECK(test::column_of(run.table, "size").front() == doctest::Approx(0.3).epsilon(1e-9));
    CHECK(test::column_of(run.table, "size").back() == doctest::Approx(0.7 - q).epsilon(1e-9));
    CHECK(std::isnan(test::column_of(run.table, "depth").back()));  // it has no value, and the run goes on
    // A bead on a parabola, of which z is eliminated.
    const TableOfRun rod = table_of_run(
        "lagrangian = \"(x'^2 + z'^2)/2 - z\"\n[coordinates]\nx = { position = 0.6, velocity = 0 }\nz = {}\n"
        "[constraints]\nslope = \"z = x^2\"\n[run]\nstep = 0.05\nuntil = 1\n[output]\n"
        "columns = { speed = \"sqrt(x'^2 + z'^2)\" }\n");
    const double x = test::column_of(rod.table, "x").back(), speed = test::column_of(rod.table, "speed").back();
    CHECK(speed * speed / 2 + x * x == doctest::Approx(0.36).epsilon(1e-8));
    for (const auto& [formula, error] :
         {std::pair("q = \"q'\"", "the table has a column q already; choose another name"),
          std::pair("p_q = \"q'\"", "the table has a column p_q already"),
          std::pair("s = \"q'\"", "the table has a column s already"),
          std::pair("\"a b\" = \"q'\"", "a column has a name of letters, digits and _, such as v, not a b"),
          std::pair("i = \"q' + r\"", "unknown name 'r' in the column i")}) {
        const test::TemporaryFolder folder;
        std::string text = circuit;
        text.replace(text.find("i = \"q'\""), 8, formula);
        test::write_text(folder / "scene.toml", text);
        const test::Finished finished = test::run({LOBATTO_PROGRAM, "run", folder / "scene.toml"});
        CHECK(finished.exit_code == 2);
        CHECK(test::contains(finished.err, error));
    }
}

TEST_CASE("columns have all digits of the numbers") {
    const TableOfRun run = table_of_run(circle, {"--numbers", "double-double", "--until", "0.3"});
    const long digits = GiNaC::Digits;
    GiNaC::Digits = 40;
    const GiNaC::numeric a(run.last[1].c_str()), x(run.last[3].c_str());
    const double off = abs(x - sin(a)).to_double(), beyond = abs(x - GiNaC::numeric(x.to_double())).to_double();
    GiNaC::Digits = digits;
    CHECK(off < 1e-30);
    CHECK(beyond > 1e-22);  // digits that a double does not hold
}

TEST_CASE("bodies have columns of their orientation and angular velocity" * doctest::test_suite("slow")) {
    const std::string top =
        "lagrangian = \"-top.z\"\n[bodies]\ntop = { mass = 1, inertia = [1, 2, 3], position = [0, 0, 1], orientation = "
        "[2, 0, 0, 2], angular_velocity = [0.1, 0.2, 3] }\n[run]\nstep = 0.01\nuntil = 1\n";
    const TableOfRun run = table_of_run(top);
    REQUIRE(run.table.columns.size() == 1 + 14 + 7 + 1);
    CHECK(Columns(run.table.columns.begin() + 15, run.table.columns.end() - 1) ==
          Columns{"top_orientation_1", "top_orientation_2", "top_orientation_3", "top_orientation_4", "top_omega_1",
                  "top_omega_2", "top_omega_3"});
    const std::vector<double>&first = run.table.rows.front(), &last = run.table.rows.back();
    const double half = std::sqrt(0.5);
    const std::vector<double> start{half, 0, 0, half, 0.1, 0.2, 3};
    for (std::size_t k = 0; k < start.size(); ++k) CHECK(std::fabs(first[15 + k] - start[k]) < 4e-15);
    double length = 0, energy = 0;
    for (std::size_t k = 15; k < 19; ++k) length += last[k] * last[k];
    for (std::size_t k = 0; k < 3; ++k) energy += static_cast<double>(k + 1) * last[19 + k] * last[19 + k] / 2;
    CHECK(std::fabs(length - 1) < 1e-15);
    CHECK(std::fabs(energy - (0.005 + 0.04 + 13.5)) < 1e-9);
    CHECK(table_of_run(top + "[output]\nbodies = false\n").table.columns.size() == 1 + 14 + 1);
    CHECK(table_of_run("lagrangian = \"-arm.y\"\n[bodies]\narm = { mass = 1, inertia = 1 }\n[joints]\nswing = { type = "
                       "\"hinge\", bodies = [\"ground\", \"arm\"], point = [0, 1] }\n[run]\nstep = 0.01\nuntil = 1\n")
              .table.columns ==
          Columns{"t", "swing_angle", "p_swing_angle", "arm_x", "arm_y", "arm_angle", "arm_omega", "H"});
}
