// SPDX-License-Identifier: GPL-2.0-or-later
// lobatto sweep from the outside: the grid, the table in both formats, failures, refusals, interruption.
#include <doctest/doctest.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <map>
#include <numbers>
#include <regex>
#include <thread>

#include "runtime/run/output.hpp"
#include "tests/cli/sweep/tables.hpp"
#include "tests/support.hpp"

using namespace lobatto;

namespace {

const std::string pendulum = LOBATTO_SOURCE_DIR "/scenes/pendulum.toml";
const std::string coupled = LOBATTO_SOURCE_DIR "/scenes/henon_heiles.toml";

// A folder for tables.
struct Place {
    test::TemporaryFolder folder;
    std::string file(const std::string& name = "sweep.csv") const { return folder / name; }

    test::Finished lobatto(std::vector<std::string> arguments) const {
        arguments.insert(arguments.begin(), LOBATTO_PROGRAM);
        return test::run(arguments);
    }
    test::Finished sweep(std::vector<std::string> arguments) const {
        arguments.insert(arguments.begin(), "sweep");
        arguments.insert(arguments.end(), {"-o", file()});
        return lobatto(arguments);
    }
    // The table of a sweep that succeeds.
    test::TrajectoryTable table(std::vector<std::string> arguments) const {
        const test::Finished done = sweep(std::move(arguments));
        CHECK(done.err == "");
        CHECK(done.exit_code == 0);
        return test::read_trajectory(file());
    }
};

using Strings = std::vector<std::string>;

// A .npy of one-dimensional records, read by the rules of its format.
test::TrajectoryTable read_npy(const std::string& path) {
    const std::string bytes = test::read_file(path);
    REQUIRE(bytes.size() > 128);
    REQUIRE(bytes.substr(0, 8) == std::string("\x93NUMPY\x01\x00", 8));
    const std::size_t length = static_cast<unsigned char>(bytes[8]) + 256u * static_cast<unsigned char>(bytes[9]);
    REQUIRE((10 + length) % 64 == 0);
    const std::string head = bytes.substr(10, length);
    REQUIRE(head.back() == '\n');
    std::smatch found;
    REQUIRE(std::regex_match(
        head, found, std::regex("\\{'descr': \\[(.*)\\], 'fortran_order': False, 'shape': \\((\\d+),\\), \\} *\n")));
    test::TrajectoryTable table;
    std::vector<bool> whole;
    const std::string fields = found[1];
    const std::regex field("\\((['\"])(.*?)\\1, '<(i8|f8)'\\), ");
    for (std::sregex_iterator i(fields.begin(), fields.end(), field), end; i != end; ++i) {
        table.columns.push_back((*i)[2]);
        whole.push_back((*i)[3] == "i8");
    }
    const std::size_t rows = std::stoul(found[2]);
    REQUIRE(bytes.size() == 10 + length + rows * whole.size() * 8);
    const char* number = bytes.data() + 10 + length;
    for (std::size_t row = 0; row < rows; ++row) {
        table.rows.emplace_back();
        for (const bool is_whole : whole) {
            std::int64_t integer = 0;
            double real = 0;
            std::memcpy(&integer, number, 8);
            std::memcpy(&real, number, 8);
            table.rows.back().push_back(is_whole ? static_cast<double>(integer) : real);
            number += 8;
        }
    }
    return table;
}

// How far a trajectory may be from that of `lobatto run`: 0 when it runs alone in the kernel. Lanes round in another
// order, which a pendulum of 200 steps carries on to less than this.
double tolerance(const std::string& summary) {
    return test::contains(summary, "one trajectory at a time each") ? 0 : 1e-12;
}

// Not a number is the same as itself: the error of a state on the way.
bool same_rows(const std::vector<std::vector<double>>& a, const std::vector<std::vector<double>>& b) {
    const auto same = [](double x, double y) { return x == y || (std::isnan(x) && std::isnan(y)); };
    return std::equal(a.begin(), a.end(), b.begin(), b.end(), [&](const auto& x, const auto& y) {
        return std::equal(x.begin(), x.end(), y.begin(), y.end(), same);
    });
}

}  // namespace

TEST_CASE("what is kept of a trajectory is one row of numbers") {
    // q = A cos 2t with A = 1, 2, 3, p = -2 A sin 2t, H = 2 A^2.
    const Place place;
    const std::string scene = place.file("oscillator.toml");
    test::write_text(scene,
                     "lagrangian = \"q'^2/2 - 2*q^2\"\n[coordinates]\nq = { position = 1, velocity = 0 }\n[method]\n"
                     "points = 8\n[run]\nstep = \"pi/40\"\nuntil = \"2*pi\"\n");
    const test::TrajectoryTable table =
        place.table({scene, "--vary", "q=1:3:3", "--keep",
                     "first(q = 0), first(q = 5), count(q' = 0 rising), max(q), min(q + 1), mean(q^2)", "--keep",
                     "last(p_q), max(H), mean(p_q*q')"});
    CHECK(table.columns[5] == "first(q = 0)");
    for (std::size_t i = 0; i < 3; ++i) {
        const double A = 1 + static_cast<double>(i);
        CHECK(std::fabs(test::column_of(table, "first(q = 0)")[i] - std::numbers::pi / 4) < 1e-13);
        CHECK(std::isnan(test::column_of(table, "first(q = 5)")[i]));
        CHECK(test::column_of(table, "count(q' = 0 rising)")[i] == 2);
        CHECK(std::fabs(test::column_of(table, "max(q)")[i] - A) < 1e-12);
        CHECK(std::fabs(test::column_of(table, "min(q + 1)")[i] - (1 - A)) < 1e-12);
        CHECK(std::fabs(test::column_of(table, "mean(q^2)")[i] - A * A / 2) < 1e-12);
        CHECK(std::fabs(test::column_of(table, "last(p_q)")[i]) < 1e-11);
        CHECK(std::fabs(test::column_of(table, "max(H)")[i] - 2 * A * A) < 1e-11);
        CHECK(std::fabs(test::column_of(table, "mean(p_q*q')")[i] - 2 * A * A) < 1e-11);
        CHECK(test::column_of(table, "t")[i] == 2 * std::numbers::pi);
    }
    const auto refusal = [&](const std::string& keep) {
        const test::Finished done = place.sweep({scene, "--vary", "q=1,2", "--keep", keep});
        CHECK(done.exit_code == 2);
        return done.err;
    };
    CHECK(test::contains(refusal("mode(q)"), "--keep:1:1: what is kept of a trajectory is first(x = 0)"));
    CHECK(test::contains(refusal("max(q), max(r)"), "--keep:1:13: unknown name 'r'"));
    CHECK(test::contains(refusal("first(H = 1)"), "not of H and momenta"));
    CHECK(test::contains(refusal("max(q"), "--keep:1:1"));
}

TEST_CASE("a trajectory that meets a stop ends there, alone, and the others go on") {
    const Place place;
    const std::string scene = place.file("pendulum.toml");
    test::write_text(scene,
                     "lagrangian = \"q'^2/2 + cos(q)\"\n[coordinates]\nq = { position = 0, velocity = 1 }\n[method]\n"
                     "points = 8\n[run]\nstep = 0.1\nuntil = 5\nstop = [\"q = pi\", \"q = -pi\"]\n");
    const test::TrajectoryTable table =
        place.table({scene, "--vary", "q'=1,-2.5,3", "--keep", "first(q = 1)", "--threads", "2"});
    CHECK(test::column_of(table, "stop") == std::vector<double>{0, 2, 1});
    CHECK(test::column_of(table, "status") == std::vector<double>{0, 0, 0});
    // A turn takes 2 K(k) k with k = 2/q'(0).
    CHECK(test::column_of(table, "t")[0] == 5);
    CHECK(std::fabs(test::column_of(table, "t")[1] - 0.8 * std::comp_ellint_1(0.8)) < 1e-12);
    CHECK(std::fabs(test::column_of(table, "t")[2] - 2.0 / 3 * std::comp_ellint_1(2.0 / 3)) < 1e-12);
    for (const double error : test::column_of(table, "error")) CHECK(error < 1e-9);
    // The states at the ends, without --keep.
    const test::TrajectoryTable states = place.table({scene, "--vary", "q'=1,-2.5,3"});
    CHECK(std::fabs(test::column_of(states, "q")[1] + std::numbers::pi) < 1e-13);
    CHECK(std::fabs(test::column_of(states, "p_q")[2] - std::sqrt(5.0)) < 1e-12);
    CHECK(test::column_of(states, "stop") == std::vector<double>{0, 2, 1});
    const test::Finished counted = place.sweep({scene, "--vary", "q'=1,-2.5,3,3.1"});
    CHECK(test::contains(counted.out,
                         "  stopped                 2 by 'q = pi'\n                          1 by 'q = -pi'\n"
                         "                          1 by none\n"));
}

TEST_CASE("a sweep says what it did and where its table is") {
    const Place place;
    const test::Finished done =
        place.sweep({pendulum, "--vary", "q=0:3:40", "--vary", "omega=1,2", "--until", "10", "--threads", "2"});
    CHECK(done.err == "");
    CHECK(done.exit_code == 0);
    const std::regex summary(
        "\\S+scenes/pendulum.toml: kernel [0-9a-f]{16}\n"
        "  trajectories            80\n"
        "  steps                   200 each, h = 0.05, to t = 10\n"
        "  threads                 2, (one trajectory at a time|\\d+ lanes) each\n"
        "  speed                   \\S+ steps per second\n"
        "  time per step           \\S+ [nu]s of a processor, for one trajectory\n"
        "  energy error            \\S+ at most, of trajectory \\d+, q = \\S+, omega = 2\n"
        "    at the end            \\S+ to \\S+, mean \\S+, rms \\S+\n"
        "  measured error          \\S+ of the amplitude at most, of trajectory \\d+, q = \\S+, omega = \\S+\n"
        "  q at the end            \\S+ to \\S+, mean \\S+, rms \\S+\n"
        "  p_q at the end          \\S+ to \\S+, mean \\S+, rms \\S+\n"
        "  table                   \\S+/sweep.csv, 80 rows\n");
    CHECK_MESSAGE(std::regex_match(done.out, summary), done.out);
    CHECK(place.sweep({pendulum, "--vary", "q=1", "--until", "1", "--quiet"}).out == "");
}

TEST_CASE("the grid has all combinations, the last name fastest, both ends exactly") {
    const Place place;
    const test::TrajectoryTable table = place.table(
        {pendulum, "--vary", "q'=-1:2:4", "--vary", "omega=0.1,pi,sqrt(4)", "--vary", "q=1:100:3:log", "--steps", "1"});
    CHECK(table.columns ==
          Strings{"index", "q'(0)", "omega", "q(0)", "status", "steps", "t", "q", "p_q", "energy_error", "error"});
    REQUIRE(table.rows.size() == 36);
    const double velocity[] = {-1, 0, 1, 2}, omega[] = {0.1, 3.141592653589793, 2}, q[] = {1, 10, 100};
    for (std::size_t i = 0; i < 36; ++i) {
        CHECK(table.rows[i][0] == static_cast<double>(i));
        CHECK(table.rows[i][1] == velocity[i / 9]);
        CHECK(table.rows[i][2] == omega[i / 3 % 3]);
        CHECK(table.rows[i][3] == q[i % 3]);
    }
    CHECK(test::contains(
        test::read_file(place.file()),
        "# lobatto sweep\n# scene: A plane pendulum\n# method: Lobatto, 4 points, h = 0.05\n# kernel: "));
    CHECK(test::contains(test::read_file(place.file()),
                         "\n# parameters: m = 1\n# vary: q' = -1:2:4\n# vary: omega = 0.1,pi,sqrt(4)\n# vary: q = "
                         "1:100:3:log\n# status: 0 reached the end, 1 not converged, "));
    CHECK(test::contains(test::read_file(place.file()),
                         "\n# columns: index, q'(0), omega [rad/s], q(0) [rad], status, "));
    // Values are exact before they are rounded: 0.1 + 0.2 is no double sum.
    CHECK(test::column_of(place.table({pendulum, "--vary", "q=0:0.5:6", "--steps", "0"}), "q(0)") ==
          std::vector<double>{0, 0.1, 0.2, 0.3, 0.4, 0.5});
    CHECK(test::column_of(place.table({pendulum, "--vary", "q=-2:-8:3:log", "--steps", "0"}), "q(0)") ==
          std::vector<double>{-2, -4, -8});
    CHECK(test::column_of(place.table({pendulum, "--vary", "q=2:2:1", "--steps", "0"}), "q(0)") ==
          std::vector<double>{2});
    CHECK(test::column_of(place.table({pendulum, "--vary", "q=mod(7, 4),1", "--steps", "0"}), "q(0)") ==
          std::vector<double>{3, 1});
}

TEST_CASE("each trajectory of a sweep is that of a run, with momenta of its own parameters" *
          doctest::test_suite("slow")) {
    const Place place;
    // m stands in the momentum of the velocity and in the initial position.
    const std::string scene = place.file("scene.toml");
    test::write_text(scene,
                     "title = \"A swing\"\nlagrangian = \"m*q'^2/2 + m*cos(q)\"\n"
                     "[coordinates]\nq = { position = \"1/(1 + m)\", velocity = \"sqrt(m)\" }\n[parameters]\nm = 1\n"
                     "[run]\nstep = 0.05\nuntil = 10\n");
    const test::Finished done = place.sweep({scene, "--vary", "m=0.3:2.1:9", "--every", "70"});
    CHECK(done.err == "");
    const test::TrajectoryTable table = test::read_trajectory(place.file());
    REQUIRE(table.rows.size() == 9 * 4);
    const std::vector<double> m = test::column_of(table, "m");
    for (std::size_t i = 0; i < 9; ++i) {
        const std::string path = place.file("run.csv");
        REQUIRE(
            place.lobatto({"run", scene, "--quiet", "--set", "m=" + exact_text(m[4 * i]), "--every", "70", "-o", path})
                .err == "");
        const test::TrajectoryTable run = test::read_trajectory(path);
        REQUIRE(run.rows.size() == 4);
        for (std::size_t row = 0; row < 4; ++row) {
            const std::vector<double>&swept = table.rows[4 * i + row], alone = run.rows[row];
            CHECK(swept[3] == std::vector<double>{0, 70, 140, 200}[row]);  // steps
            CHECK(swept[4] == alone[0]);
            for (std::size_t k = 1; k < 3; ++k)
                CHECK(std::fabs(swept[4 + k] - alone[k]) <= tolerance(done.out) * (1 + std::fabs(alone[k])));
            CHECK(std::fabs(swept[7] - (alone[3] - run.rows[0][3])) <= tolerance(done.out));
        }
    }
}

TEST_CASE("a table is the same file for any number of threads, in CSV and in NumPy's format" *
          doctest::test_suite("slow")) {
    const Place place;
    const auto content = [&](const std::string& threads, const std::string& format, const std::string& every) {
        const test::Finished done = place.sweep({coupled, "--vary", "x=0:0.3:17", "--vary", "y=-0.1:0.1:31", "--until",
                                                 "10", "--threads", threads, "--format", format, "--every", every});
        CHECK(done.err == "");
        return test::read_file(place.file());
    };
    for (const char* const every : {"1000000", "3"}) {
        const std::string csv = content("1", "csv", every);
        CHECK(content("2", "csv", every) == csv);
        CHECK(content("3", "csv", every) == csv);
        const test::TrajectoryTable text = test::read_trajectory(place.file());
        const std::string binary = content("1", "binary", every);
        CHECK(content("3", "binary", every) == binary);
        const test::TrajectoryTable array = read_npy(place.file());
        CHECK(array.columns == text.columns);
        CHECK(same_rows(array.rows, text.rows));
        CHECK(text.rows.size() >= 2 * 17 * 31);
    }
}

TEST_CASE("the name of the table tells its format, and without one it goes to the folder out") {
    const Place place;
    const auto in_folder = [&](const std::string& arguments) {
        return test::run({"sh", "-c",
                          "cd '" + place.folder.string() + "' && '" LOBATTO_PROGRAM "' sweep '" + pendulum +
                              "' --vary \"q'=0:1:3\" --steps 2 " + arguments});
    };
    CHECK(test::contains(in_folder("").out, "  table                   out/pendulum.sweep.csv, 3 rows\n"));
    CHECK(test::read_trajectory(place.file("out/pendulum.sweep.csv")).rows.size() == 3);
    CHECK(
        test::contains(in_folder("--format binary").out, "  table                   out/pendulum.sweep.npy, 3 rows\n"));
    CHECK(read_npy(place.file("out/pendulum.sweep.npy")).columns[1] == "q'(0)");
    CHECK(in_folder("-o a.npy").err == "");
    CHECK(read_npy(place.file("a.npy")).rows == read_npy(place.file("out/pendulum.sweep.npy")).rows);
    CHECK(!std::filesystem::exists(place.file("a.npy.partial")));
}

TEST_CASE("names of a scene are varied as it writes them, and columns never share a name") {
    const Place place;
    const std::string scene = place.file("scene.toml");
    test::write_text(scene,
                     "title = \"Masses\"\nlagrangian = \"sum(i = 1 .. 2, m[i]*x[i]'^2/2 - x[i]^4) + index'^2/2 - "
                     "index*steps\"\n[coordinates]\nx = { count = 2, position = 1, momentum = 0 }\n"
                     "index = { position = 0, momentum = 0 }\n[parameters]\nm = [1, 2]\nsteps = 3\n"
                     "[run]\nstep = 0.1\nuntil = 1\n[output]\nmomenta = false\nenergy = false\n");
    const test::TrajectoryTable table = place.table({scene, "--vary", "x[2]=0.5,0.6", "--vary", "p_x_1=1", "--vary",
                                                     "m[1]=3,4", "--vary", "index=7", "--steps", "3"});
    CHECK(table.columns == Strings{"index_", "x[2](0)", "p_x_1(0)", "m[1]", "index(0)", "status", "steps_", "t", "x_1",
                                   "x_2", "index", "error"});
    REQUIRE(table.rows.size() == 4);
    CHECK(table.rows[3][1] == 0.6);
    CHECK(table.rows[3][3] == 4);
    CHECK(table.rows[3][10] == doctest::Approx(7 - 3 * 0.3 * 0.3 / 2));
    CHECK(table.rows[2][8] != table.rows[3][8]);  // m[1] moves x[1] alone
    CHECK(table.rows[2][9] == table.rows[3][9]);
    CHECK(test::contains(place.sweep({scene, "--vary", "x[2]'=1"}).err,
                         "--vary:1:1: " + scene + " gives initial momenta, not velocities; vary p_x_2 instead\n"));
}

TEST_CASE("wrong values to vary are refused with exit code 2, and no table is made" * doctest::test_suite("slow")) {
    const Place place;
    const auto refusal = [&](Strings arguments) {
        arguments.insert(arguments.begin(), pendulum);
        const test::Finished done = place.sweep(arguments);
        CHECK(done.exit_code == 2);
        CHECK(done.out == "");
        CHECK(!std::filesystem::exists(place.file()));
        CHECK(!std::filesystem::exists(place.file() + ".partial"));
        return done.err;
    };
    const auto vary = [&](const std::string& argument) { return refusal({"--vary", argument}); };
    CHECK(vary("omgea=1,2") ==
          "--vary:1:1: unknown name 'omgea'; what can be varied: m, omega, q, q', step, points, stages, splitting, "
          "tolerance. Did you mean 'omega'?\n  1 | "
          "omgea=1,2\n    | ^\n");
    CHECK(vary("p_q=1") == "--vary:1:1: " + pendulum +
                               " gives initial velocities, not momenta; vary q' instead\n  1 | p_q=1\n    | ^\n");
    const std::string expected =
        "--vary:1:1: expected NAME=FROM:TO:COUNT or NAME=a,b,c, such as --vary q=0:3:1000\n  1 | ";
    CHECK(vary("q") == expected + "q\n    | ^\n");
    CHECK(vary("=1") == expected + "=1\n    | ^\n");
    const std::string spacing =
        "--vary:1:3: expected FROM:TO:COUNT, FROM:TO:COUNT:log or values with commas, such as 0:3:1000\n  1 | ";
    CHECK(vary("q=0:1") == spacing + "q=0:1\n    |   ^\n");
    CHECK(vary("q=0:1:2:log:3") == spacing + "q=0:1:2:log:3\n    |   ^\n");
    CHECK(vary("q=1:2:3:lin") ==
          "--vary:1:9: 'lin' is no spacing; there is log, or none for equal distances\n  1 | q=1:2:3:lin\n    |        "
          " ^\n");
    const std::string count = "it must be a whole number from 1 to 10000000\n";
    CHECK(test::contains(vary("q=0:1:0"), "--vary:1:7: the number of values is 0; " + count));
    CHECK(test::contains(vary("q=0:1:-3"), "--vary:1:7: the number of values is -3; " + count));
    CHECK(test::contains(vary("q=0:1:2.5"), "--vary:1:7: the number of values is 2.5; " + count));
    CHECK(test::contains(vary("q=0:1:1e8"), "--vary:1:7: the number of values is 100000000; " + count));
    CHECK(
        test::contains(vary("q=-1:2:3:log"),
                       "--vary:1:3: equal ratios lead from -1 to 2 only when both have the same sign and neither is 0; "
                       "leave :log out\n"));
    CHECK(test::contains(vary("q=0:2:3:log"), "--vary:1:3: equal ratios lead from 0 to 2 only"));
    CHECK(test::contains(vary("q=1,,2"), "--vary:1:5: "));
    CHECK(test::contains(vary("q="), "--vary:1:3: "));
    CHECK(test::contains(vary("q=1,2*omega"), "--vary:1:7: unknown name 'omega' in the value of q"));
    CHECK(test::contains(vary("q=1:2*m:3"), "--vary:1:7: unknown name 'm' in the last value of q"));
    CHECK(test::contains(vary("m=1e400,1"),
                         "--vary:1:3: the value of m must be 0, or of a size between 1e-300 and 1e300\n"));
    CHECK(test::contains(refusal({"--vary", "q=1", "--vary", "q=2"}),
                         "--vary:1:1: 'q' is varied twice; give all its values at once\n"));
    CHECK(refusal({"--vary", "q=0:1:1e7", "--vary", "m=1:2:1e6"}) ==
          "--vary: all combinations make 1e+13 trajectories; at most 1e+12: give fewer values\n");
    CHECK(refusal({"--vary", "q=0:1:1e5", "--until", "1e14"}) ==
          "--vary: 100000 trajectories of 2000000000000000 steps are 2e+20 steps, too many to count; vary less, or "
          "make the end time smaller\n");
    CHECK(test::contains(refusal({"--vary", "q=0:1:100", "--until", "1e10", "--every", "1"}),
                         "GB of memory; give a larger number of steps, or fewer --threads\n"));
    CHECK(refusal({"--vary", "q=1", "--every", "0"}) ==
          "--every: 0 is not a number of states; give 1 to keep each, 10 to keep every tenth\n");
    CHECK(refusal({"--vary", "q=1", "--steps", "-1"}) == "--steps: -1 is not a number of steps\n");
    CHECK(refusal({"--vary", "q=1", "--step", "-1"}) == "--step: the step must be positive, but is -1\n");
    CHECK(test::contains(refusal({"--vary", "q=1", "--steps", "2", "--until", "1"}), "--until excludes --steps"));
    CHECK(test::contains(refusal({"--vary", "q=1", "--threads", "0"}), "--threads: Value 0 not in range"));
    CHECK(test::contains(refusal({"--vary", "q=1", "--format", "xml"}), "--format: xml not in {csv,binary}"));
    CHECK(refusal({}) ==
          "nothing is varied: give --vary NAME=FROM:TO:COUNT, --starts FILE, or --random COUNT with --draw\n");
    CHECK(test::contains(refusal({"--vary", "q=1", "--set", "omgea=2"}), "--set:1:1: unknown parameter 'omgea'"));
    CHECK(test::contains(refusal({"--vary", "q=1", "--set", "q =2"}), "'q' is varied too; leave one of both out"));
}

TEST_CASE("trajectories that fail are listed, the others are in the table, the exit code is 3") {
    const Place place;
    const std::string scene = place.file("escape.toml");
    // From x < 0 into infinity; from x > 0 back and forth is impossible too, but later.
    test::write_text(scene,
                     "title = \"Escape\"\nlagrangian = \"m*x'^2/2 - x^3\"\n"
                     "[coordinates]\nx = { position = \"sqrt(m)\", velocity = 0 }\n[parameters]\nm = 1\n"
                     "[run]\nstep = 0.1\nuntil = 1\n");
    const test::Finished done = place.sweep({scene, "--vary", "x=-9:1:11", "--every", "4"});
    CHECK(done.exit_code == 3);
    const test::TrajectoryTable table = test::read_trajectory(place.file());
    const std::vector<double> index = test::column_of(table, "index"), status = test::column_of(table, "status"),
                              t = test::column_of(table, "t"), steps = test::column_of(table, "steps");
    std::map<double, double> end;
    std::int64_t failed = 0;
    for (std::size_t i = 0; i < index.size(); ++i) {
        const bool last = i + 1 == index.size() || index[i + 1] != index[i];
        CHECK(t[i] == doctest::Approx(0.1 * steps[i]));
        if (!last) CHECK(status[i] == 0);
        if (last) end[index[i]] = t[i];
        if (status[i] != 0) ++failed;
        if (status[i] == 0 && last) CHECK(t[i] == doctest::Approx(1));
    }
    CHECK(end.size() == 11);
    CHECK(failed >= 5);
    CHECK(end[0] < end[4]);
    CHECK(end[10] == doctest::Approx(1));
    CHECK(test::contains(done.out, fmt::format("  trajectories            11, {} failed\n", failed)));
    CHECK(done.err.starts_with(fmt::format("lobatto: {}: {} of 11 trajectories failed: ", scene, failed)));
    CHECK(test::contains(done.err, ". The others went on. The first of them:\n  trajectory 0, x = -9: not "));
    CHECK(test::contains(done.err, "\n  trajectory 4, x = -5: not "));
    CHECK(!test::contains(done.err, "trajectory 5,"));  // five are told
    CHECK(done.err.ends_with("\nTry a smaller --step, or leave these values out. What was computed is in " +
                             place.file() + ".\n"));
    // No mass; no place to start from.
    const test::Finished none = place.sweep({scene, "--vary", "m=1,0,-1"});
    CHECK(none.exit_code == 3);
    CHECK(
        none.err ==
        "lobatto: warning: trajectory 2, m = -1: the mass of x is negative: its momentum falls as its velocity grows. "
        "That is allowed, but mostly a value that is not meant.\nlobatto: " +
            scene +
            ": 2 of 3 trajectories failed: 1 singular mass matrix, 1 a formula has no value there. The others went on. "
            "They are:\n"
            "  trajectory 1, m = 0: singular mass matrix in step 1, after t = 0\n"
            "  trajectory 2, m = -1: a formula has no value there\n"
            "Leave these values out. What was computed is in " +
            place.file() + ".\n");
    const test::TrajectoryTable starts = test::read_trajectory(place.file());
    REQUIRE(starts.rows.size() == 3);
    CHECK(test::column_of(starts, "status") == std::vector<double>{0, 4, 10});
    CHECK(std::isnan(test::column_of(starts, "x")[2]));
    const test::Finished all = place.sweep({scene, "--vary", "m=-2,-1"});
    CHECK(test::contains(all.err, ": 2 of 2 trajectories failed: 2 a formula has no value there. They are:\n"));
}

TEST_CASE("a trajectory that goes on in lanes where alone it cannot has left its Lagrangian, measured or not") {
    const Place place;
    const std::string scene = place.file("escape.toml");
    // To infinity in a finite time.
    test::write_text(scene,
                     "lagrangian = \"(x'^2 + y'^2)/2 - (x^2 + y^2)/2 - x^2*y + y^3/3\"\n[coordinates]\n"
                     "x = { position = -0.52, velocity = -0.3749575 }\ny = { position = -0.31004205, velocity = "
                     "-0.12992165 }\n[method]\nfamily = \"gauss\"\nstages = 3\n[run]\nstep = 0.2\nuntil = 60\n");
    const test::Finished done = place.sweep({scene, "--vary", "x=-0.52453083,-0.52", "--unmeasured"});
    CHECK(done.exit_code == 3);
    CHECK(test::contains(done.err, "2 of 2 trajectories failed"));
}

TEST_CASE("what is kept and has no value is told") {
    const Place place;
    const std::string scene = place.file("falls.toml");
    test::write_text(
        scene,
        "lagrangian = \"x'^2/2 - x^2/2\"\n[coordinates]\nx = { position = 1, velocity = 0 }\n[run]\nstep = 0.1\n"
        "until = 3\n");
    const test::Finished done =
        place.sweep({scene, "--vary", "x=-1,1", "--keep", "last(sqrt(x))", "--keep", "first(x = 5)"});
    CHECK(done.exit_code == 0);
    CHECK(test::contains(done.err, "warning: last(sqrt(x)) has no value in 1 trajectory that reached the end"));
    CHECK(!test::contains(done.err, "first"));
}

TEST_CASE("trajectories that leave their Lagrangian are told from those that stay, also where no energy is asked for" *
          doctest::test_suite("slow")) {
    const Place place;
    const std::string scene = place.file("kepler.toml");
    for (const char* energy : {"true", "false"}) {
        CAPTURE(energy);
        test::write_text(scene, fmt::format("title = \"K\"\nlagrangian = \"(x'^2 + y'^2)/2 + 1/sqrt(x^2 + y^2)\"\n"
                                            "[coordinates]\nx = {{ position = 1, velocity = 0 }}\n"
                                            "y = {{ position = 0, velocity = 1 }}\n"
                                            "[run]\nstep = 0.01\nuntil = 3\n[output]\nenergy = {}\n",
                                            energy));
        const test::Finished done = place.sweep({scene, "--vary", "y'=1,0,0.8"});  // straight into the centre
        CHECK(done.exit_code == 3);
        CHECK(test::contains(done.out, "  trajectories            3, 1 failed\n"));
        CHECK(test::contains(done.err,
                             ": 1 of 3 trajectories failed: 1 energy off: beyond stability, or past a singularity."));
        CHECK(test::contains(done.err,
                             "\n  trajectory 1, y' = 0: energy off: beyond stability, or past a singularity\n"));
        const test::TrajectoryTable table = test::read_trajectory(place.file());
        CHECK(test::column_of(table, "status") == std::vector<double>{0, 7, 0});
    }
    // At rest, and nearly so: no kinetic energy, and nothing wrong.
    test::write_text(scene,
                     "title = \"P\"\nlagrangian = \"q'^2/2 + cos(q)\"\n[coordinates]\nq = { position = 1, velocity "
                     "= 0 }\n[run]\nstep = 0.1\nuntil = 10\n");
    const test::Finished resting = place.sweep({scene, "--vary", "q=0,1e-20,1e-160,2*pi,1"});
    CHECK(resting.exit_code == 0);
    CHECK(resting.err.empty());
    test::write_text(scene,
                     "title = \"S\"\nlagrangian = \"m*x'^2/2 - k*(x - l)^2/2\"\n[coordinates]\nx = { position = 1, "
                     "velocity = 0 }\n[parameters]\nm = 1\nk = 1\nl = 1\n[run]\nstep = 0.05\nuntil = 200\n");
    const test::Finished sprung = place.sweep({scene, "--vary", "x=0.5,1,1.5", "--vary", "l=0.1,1,1000"});
    CHECK(sprung.exit_code == 0);
    CHECK(sprung.err.empty());
    // No energy is kept that would tell; the step does.
    test::write_text(scene,
                     "title = \"D\"\ntime = \"t\"\nlagrangian = \"q'^2/2 + 100*cos(q) + 5*q*sin(t)\"\n[coordinates]\n"
                     "q = { position = 0.1, velocity = 0 }\n[method]\npoints = 4\n[run]\nstep = 0.32\nuntil = 40\n");
    const test::Finished driven = place.sweep({scene, "--vary", "q=0.1,0.2", "--beyond-horizon"});
    CHECK(driven.exit_code == 0);
    CHECK(place.sweep({scene, "--vary", "q=0.1,0.2"}).exit_code == 3);  // nothing of them is left
    CHECK(test::contains(driven.err,
                         "lobatto: warning: the step is beyond the linear stability limit, at most in trajectory "));
    CHECK(place.sweep({scene, "--vary", "q=0.1,0.2", "--step", "0.16"}).err.empty());
}

TEST_CASE("a motion that is looked at after whole periods, at rest, has not left its Lagrangian") {
    // Its period is 1.6, 32 steps: before, all states that were looked at had a kinetic energy of 1e-5 of the largest.
    const Place place;
    const std::string vary = "q=2.4502362559063977", until = "20";
    CHECK(place.sweep({pendulum, "--vary", vary, "--until", until}).exit_code == 0);
    const std::string scene = place.file("pendulum.toml");
    std::string text = test::read_file(pendulum);
    text.replace(text.find("\"pi/2\""), 6, "2.4502362559063977");
    test::write_text(scene, text);
    const test::Finished run = place.lobatto({"run", scene, "--until", until, "-o", place.file("run.csv")});
    CHECK_MESSAGE(run.exit_code == 0, run.err);
}

TEST_CASE("the step and the end are the same for all, and it is said when a varied parameter stands in them") {
    const Place place;
    const std::string note =
        "lobatto: warning: the step and the end time for all trajectories are those of omega = 6.28319.\n";
    const test::Finished done =
        place.sweep({pendulum, "--vary", "omega=5:7:5", "--step", "pi/omega/10", "--until", "10*pi/omega"});
    CHECK(test::contains(done.out, "  steps                   100 each, h = 0.05, to t = 5\n"));
    CHECK(test::contains(done.err, note));
    CHECK(place.sweep({pendulum, "--vary", "q=1,2", "--step", "pi/omega/10", "--until", "1"}).err.empty());
    CHECK(
        test::contains(place.sweep({pendulum, "--vary", "q=1", "--step", "0.3", "--until", "1"}).out,
                       "\nThe end time is not a multiple of the step: the runs end at the last multiple before it.\n"));
    CHECK(test::contains(place.sweep({pendulum, "--vary", "q=1", "--steps", "1000000"}).out, " to t = 50000\n"));
    CHECK(place.table({pendulum, "--vary", "q=1", "--until", "1", "--points", "2"}).comments[2] ==
          "method: Lobatto, 2 points, h = 0.05");
}

TEST_CASE("an interrupted sweep keeps complete rows, says so and returns 130; a killed one leaves readable rows" *
          doctest::test_suite("slow")) {
    for (const bool binary : {false, true}) {
        for (const int signal : {SIGINT, SIGTERM, SIGKILL}) {
            const Place place;
            const std::string out = place.file(binary ? "a.npy" : "a.csv"), partial = out + ".partial",
                              err = place.file("err");
            // An earlier table of that name stays.
            const bool has_earlier = binary && signal == SIGTERM;
            if (has_earlier)
                REQUIRE(test::run({LOBATTO_PROGRAM, "sweep", pendulum, "--vary", "q=1,2,3", "-o", out}).exit_code == 0);
            const std::string earlier = has_earlier ? test::read_file(out) : "";
            const pid_t pid = ::fork();
            if (pid == 0) {
                ::dup2(::open("/dev/null", O_WRONLY), 1);
                ::dup2(::open(err.c_str(), O_WRONLY | O_CREAT, 0600), 2);
                ::execl(LOBATTO_PROGRAM, LOBATTO_PROGRAM, "sweep", pendulum.c_str(), "--vary", "q=0:3:1000000", "-o",
                        out.c_str(), nullptr);
                ::_exit(127);
            }
            for (int tries = 0; tries < 30000; ++tries) {
                if (std::filesystem::exists(partial) && std::filesystem::file_size(partial) > 10000) break;
                std::this_thread::sleep_for(std::chrono::milliseconds(10));
            }
            ::kill(pid, signal);
            int status = 0;
            ::waitpid(pid, &status, 0);
            if (signal == SIGKILL) {
                CHECK(WIFSIGNALED(status));
                CHECK(!std::filesystem::exists(out));
            } else {
                CHECK(WEXITSTATUS(status) == 130);
                CHECK(std::regex_match(
                    test::read_file(err),
                    std::regex("lobatto: interrupted after \\d+ of 1000000 trajectories; what was "
                               "computed is in \\S+" +
                               std::string(has_earlier ? ", and the earlier \\S+ stays" : "") + "\\.\n")));
                CHECK(std::filesystem::exists(partial) == has_earlier);
                if (has_earlier) CHECK(test::read_file(out) == earlier);
            }
            const std::string path = signal == SIGKILL || has_earlier ? partial : out;
            const test::TrajectoryTable table = binary ? read_npy(path) : test::read_trajectory(path);
            REQUIRE(table.rows.size() > 10);
            for (std::size_t i = 0; i < table.rows.size(); ++i) {
                REQUIRE(table.rows[i].size() == table.columns.size());
                CHECK(table.rows[i][0] == static_cast<double>(i));
                CHECK(table.rows[i][3] == 2400);
            }
        }
    }
}

TEST_CASE("a machine that refuses to write is an error of exit code 4; a reader that goes away ends a sweep" *
          doctest::test_suite("slow")) {
    const Place place;
    const auto to = [&](const std::string& path, const Strings& more = {}) {
        Strings arguments{"sweep", pendulum, "--vary", "q=0:1:10", "--until", "1", "-o", path};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return place.lobatto(arguments);
    };
    const test::Finished missing = to(place.file("none/a.csv"));
    CHECK(missing.exit_code == 4);
    CHECK(missing.err == "lobatto: cannot write results to " + place.file("none/a.csv") +
                             ": No such file or directory. Create its folder first, or choose another place with -o\n");
    const test::Finished full = to("/dev/full");
    CHECK(full.exit_code == 4);
    CHECK(full.err ==
          "lobatto: cannot write the table to /dev/full: No space left on device. Free some space, or choose another "
          "place with -o\n");
    for (const std::string path : {"/dev/stdout", "/dev/null"}) {  // standard output is a file here
        const test::Finished device = to(path, {"--format", "binary"});
        CHECK(device.exit_code == 2);
        CHECK(device.err ==
              "-o: " + path +
                  " is no regular file, but the head of a .npy says how many rows follow and is written last; "
                  "name a file, or take --format csv\n");
    }
    const test::Finished head =
        test::run({"sh", "-c",
                   "'" LOBATTO_PROGRAM "' sweep '" + pendulum +
                       "' --quiet --vary q=0:3:1000000 --until 1 -o /dev/stdout | head -12 | tail -1"});
    CHECK(head.out == "index,q(0),status,steps,t,q,p_q,energy_error,error\n");
    CHECK(head.err == "lobatto: cannot write the table to standard output: Broken pipe. Its reader has gone\n");
}

TEST_CASE("the error of a stopped trajectory is relative to the motion until its stop, and measured there") {
    const test::SweepFolder place;
    test::write_text(place.file("away.toml"),
                     "lagrangian = \"x'^2/2 + x^2/2 + 0.001*x^3\"\n[coordinates]\nx = { position = 0.1, velocity = 0.1 "
                     "}\n[method]\npoints = 2\n[run]\nstep = 0.3\nuntil = 9.6\nstop = \"x = 10\"\n");
    const auto errors = [&](const std::vector<std::string>& more) {
        std::vector<std::string> words{"sweep", place.file("away.toml"), "--vary", "x=0.1,0.09",
                                       "-o",    place.file("away.csv")};
        words.insert(words.end(), more.begin(), more.end());
        const test::Finished done = place.lobatto(words);
        CHECK(done.exit_code == 0);
        std::vector<double> found;
        for (const double error : test::column_of(test::read_trajectory(place.file("away.csv")), "error"))
            if (!std::isnan(error)) found.push_back(error);
        CHECK(!test::contains(done.out, "none: "));
        return found;
    };
    const std::vector<double> late = errors({"--every", "1"}), soon = errors({"--every", "1", "--until", "5"}),
                              last = errors({"--until", "2000"});
    REQUIRE(late.size() == 2);
    REQUIRE(soon.size() == 2);
    REQUIRE(last.size() == 2);
    for (std::size_t i = 0; i < 2; ++i) {
        CHECK(late[i] > 0.01);
        CHECK(late[i] == doctest::Approx(soon[i]).epsilon(0.1));
        CHECK(last[i] == doctest::Approx(soon[i]).epsilon(0.1));
    }
}

TEST_CASE("a sweep measures the error of every trajectory; what is not resolved is no success and no statistic") {
    const Place place;
    const std::string scene = place.file("oscillator.toml");
    test::write_text(scene,
                     "lagrangian = \"q'^2/2 - w^2*q^2/2\"\n[coordinates]\nq = { position = 1, velocity = 0 }\n"
                     "[parameters]\nw = 1\n[method]\nfamily = \"gauss\"\nstages = 4\n[run]\nstep = 0.1\nuntil = 10\n");
    const test::Finished done = place.sweep({scene, "--vary", "w=1,10,20,50,62.8,100"});
    CHECK(done.exit_code == 3);
    CHECK(test::contains(done.err, "3 of 6 trajectories failed: 3 not resolved: the error is as large as the motion"));
    CHECK(test::contains(done.out, "measured error"));
    const test::TrajectoryTable table = test::read_trajectory(place.file());
    CHECK(test::column_of(table, "status") == std::vector<double>{0, 0, 0, 8, 8, 8});
    const std::vector<double> w = test::column_of(table, "w"), q = test::column_of(table, "q"),
                              error = test::column_of(table, "error");
    for (const std::size_t i : {1, 2}) {
        const double truth = std::fabs(q[i] - std::cos(10 * w[i]));
        CHECK(error[i] > truth / 2);
        CHECK(error[i] < truth * 2);
    }
    // The statistics are of the three that are resolved.
    const double mean = (q[0] + q[1] + q[2]) / 3;
    CHECK_MESSAGE(test::contains(done.out, fmt::format("mean {:.6g}", mean)), done.out);
    CHECK(place.sweep({scene, "--vary", "w=1,50", "--beyond-horizon"}).exit_code == 0);
    const test::Finished unmeasured = place.sweep({scene, "--vary", "w=1,50", "--unmeasured"});
    CHECK(unmeasured.exit_code == 0);
    CHECK(!test::contains(unmeasured.out, "measured error"));
}

TEST_CASE("a sweep warns where its steps end at different times") {
    const Place place;
    const std::string scene = LOBATTO_SOURCE_DIR "/scenes/pendulum.toml";
    const test::Finished differ = place.sweep({scene, "--vary", "step=0.03,0.04", "--until", "1", "--quiet"});
    CHECK(differ.exit_code == 0);
    CHECK(
        differ.err ==
        "lobatto: warning: the end time is not a multiple of every step: trajectories end at the last multiple before "
        "it, from t = 0.99 to t = 1, so part of the differences comes from the end time.\n");
    CHECK(place.sweep({scene, "--vary", "step=0.025,0.05", "--until", "1"}).err.empty());
    CHECK(place.sweep({scene, "--vary", "points=3,4", "--step", "0.03", "--until", "1"}).err.empty());
}

TEST_CASE("a sweep looks at motions on their way, and at pulses between its steps") {
    const Place place;
    // Near the top of its barrier the pendulum is lost at t = 208; at t = 1000 its companion is near it by chance.
    const std::string pendulum = place.file("pendulum.toml");
    test::write_text(pendulum,
                     "lagrangian = \"q'^2/2 + cos(q)\"\n[coordinates]\nq = { position = 1, velocity = 0 }\n"
                     "[method]\nfamily = \"gauss\"\nstages = 4\n[run]\nstep = 0.1\nuntil = 1000\n");
    CHECK(place.sweep({pendulum, "--vary", "q=1,3.1415926,3.5"}).exit_code == 3);
    CHECK(test::column_of(test::read_trajectory(place.file()), "status") == std::vector<double>{0, 8, 0});
    // A kick of 0.1 sqrt(pi) that falls between all nodes; none when it comes after the end.
    const std::string pulse = place.file("pulse.toml");
    test::write_text(pulse,
                     "lagrangian = \"q'^2/2 - q^2/2 + 100*q*exp(-((t - c)/0.001)^2)\"\ntime = \"t\"\n[coordinates]\n"
                     "q = { position = 1, velocity = 0 }\n[parameters]\nc = 5\n[run]\nstep = 0.1\nuntil = 10\n");
    place.sweep({pulse, "--vary", "c=5.015,5.05,20"});
    const test::TrajectoryTable table = test::read_trajectory(place.file());
    const std::vector<double> q = test::column_of(table, "q"), error = test::column_of(table, "error");
    for (const std::size_t i : {0, 1}) {
        CHECK(std::fabs(q[i] - std::cos(10)) < 1e-6);  // not seen
        CHECK(error[i] > 0.1);
        CHECK(error[i] < 0.25);
    }
    CHECK(error[2] < 1e-10);
    // What is looked at does not change what is written.
    REQUIRE(place.sweep({pendulum, "--vary", "q=1,2", "--every", "3000"}).exit_code == 0);
    CHECK(test::column_of(test::read_trajectory(place.file()), "steps") ==
          std::vector<double>{0, 3000, 6000, 9000, 10000, 0, 3000, 6000, 9000, 10000});
}

TEST_CASE("a sweep meets what is narrower than a step, and is not deceived by states after whole periods") {
    const Place place;
    // Driven, so that no energy tells what the well does. Before, the error was said to be 1e-9 where it is 0.1.
    const std::string well = place.file("well.toml");
    test::write_text(well,
                     "lagrangian = \"q'^2/2 - q^2/2 + 0.001*q*cos(t) + 0.05*tanh((q - c)/0.00001)\"\ntime = \"t\"\n"
                     "[coordinates]\nq = { position = 1, velocity = 0 }\n[parameters]\nc = 0.1\n"
                     "[run]\nstep = 0.1\nuntil = 20\n");
    place.sweep({well, "--vary", "q=1,0.05"});
    const std::vector<double> error = test::column_of(test::read_trajectory(place.file()), "error");
    CHECK(!(error[0] < 0.05));
    CHECK(error[1] < 1e-7);
    // 40 steps are one period. Before, the error of q = 0.001 was 0.1, relative to how far rounding moves the states.
    const std::string still = place.file("still.toml");
    test::write_text(still,
                     "lagrangian = \"q'^2/2 + cos(q)\"\n[coordinates]\nq = { position = 1, velocity = 0 }\n"
                     "[run]\nstep = \"2*pi/40\"\nuntil = \"200*pi\"\n");
    for (const char* every : {"1000", "400", "40"}) {
        const test::TrajectoryTable table = place.table({still, "--vary", "q=0.001,0.01", "--every", every});
        const std::vector<double> errors = test::column_of(table, "error"), status = test::column_of(table, "status");
        for (std::size_t i = 0; i < errors.size(); ++i)
            if (!std::isnan(errors[i])) CHECK(errors[i] < 1e-9);
        CHECK(*std::max_element(status.begin(), status.end()) == 0);
    }
}

TEST_CASE("a sweep of few steps knows the amplitude, also where the motion ends as it began") {
    // In ten steps once around: x(6) = 0.99797722, by steps of 0.001.
    const Place place;
    const std::string scene = place.file("once.toml");
    test::write_text(scene,
                     "lagrangian = \"x'^2/2 - x^2/2 - x^4/40\"\n[coordinates]\nx = { position = 1, velocity = 0 }\n"
                     "[method]\npoints = 3\n[run]\nstep = 0.6\nuntil = 6\n");
    REQUIRE(place.sweep({scene, "--vary", "x=1,1.01"}).exit_code == 0);
    const test::TrajectoryTable table = test::read_trajectory(place.file());
    CHECK(test::column_of(table, "error")[0] == doctest::Approx(3.1e-5).epsilon(0.2));
    const double error = std::fabs(test::column_of(table, "x")[0] - 0.99797722);
    CHECK(test::column_of(table, "error")[0] == doctest::Approx(error).epsilon(0.1));
    CHECK(place.sweep({scene, "--vary", "x=1,1.01", "--points", "2"}).exit_code == 0);
    // Driven, too: a companion looks between two comparisons.
    test::write_text(scene,
                     "time = \"t\"\nlagrangian = \"x'^2/2 - x^2/2 - x^4/40 + 1e-6*x*sin(t)\"\n[coordinates]\n"
                     "x = { position = 1, velocity = 0 }\n[method]\npoints = 3\n[run]\nstep = 0.6\nuntil = 6\n");
    REQUIRE(place.sweep({scene, "--vary", "x=1,1.01"}).exit_code == 0);
    const double driven = test::column_of(test::read_trajectory(place.file()), "error")[0];
    CHECK(driven > 2.5e-5);
    CHECK(driven < 5e-5);
}

TEST_CASE("a trajectory whose formulas have no value, though they cancel, is no success" *
          doctest::test_suite("slow")) {
    const Place place;
    const auto status_of = [&](const std::string& position, const std::string& lagrangian, const std::string& vary) {
        const std::string scene = place.file("scene.toml");
        test::write_text(scene, "lagrangian = \"" + lagrangian + "\"\n[coordinates]\nq = { position = " + position +
                                    ", velocity = 0.5 }\n[parameters]\nm = 3\nk = 1\n[run]\nstep = 0.1\nuntil = 3\n");
        const test::Finished done = place.sweep({scene, "--vary", vary});
        INFO(done.err);
        CHECK(done.exit_code == 3);
        CHECK(test::contains(done.err, "a formula has no value there"));
        return test::column_of(test::read_trajectory(place.file()), "status");
    };
    const std::string plain = "m*q'^2/2 - k*q^2/2";
    for (const char* position : {"\"sqrt(m - 2)^2\"", "\"(m - k)/(m - k)\"", "\"0*log(m - k) + 1\"",
                                 "\"(m - k)*(m - k)^(-1)\"", "\"exp(log(m - k))\""})
        CHECK(status_of(position, plain, "m=1,3") == std::vector<double>{10, 0});
    CHECK(status_of("1", "m*q'^2/2 - k*sqrt(m - 2)^2*q^2/2", "m=1,3") == std::vector<double>{10, 0});
    CHECK(status_of("4", "m*q'^2/2 - k*sqrt(q - 3)^2", "q=2,9") == std::vector<double>{10, 0});
    CHECK(status_of("1", "m*q'^2/2 - k*cos(acos(q/9))", "q=2,10") == std::vector<double>{0, 10});
    // The motion leaves the domain on its way.
    CHECK(status_of("4", "m*q'^2/2 - 3*k*exp(log(q - 3))", "q=3.5,9") == std::vector<double>{10, 0});
}

TEST_CASE("contradictions on the command line are errors") {
    const Place place;
    const auto refused = [&](std::vector<std::string> arguments, const std::string& why) {
        const test::Finished done = place.sweep(std::move(arguments));
        CHECK(done.exit_code == 2);
        CHECK_MESSAGE(test::contains(done.err, why), done.err);
    };
    refused({pendulum, "--vary", "m=1,2", "--set", "m=3"}, "--set: 'm' is varied too; leave one of both out");
    refused({pendulum, "--vary", "q=0:1:1"}, "one value does not lead from 0 to 1");
    refused({pendulum, "--vary", "q=1,2", "--set", "m=1", "--set", "m=2"}, "--set: 'm' is set twice");
    refused({pendulum, "--vary", "q=1,2", "--every", "9000000000000001"}, "at most 9e15");
    refused({"", "--vary", "q=1,2"}, "the scene has an empty name");
    std::filesystem::create_symlink(place.file("a.toml"), place.file("b.toml"));
    std::filesystem::create_symlink(place.file("b.toml"), place.file("a.toml"));
    refused({place.file("a.toml"), "--vary", "q=1,2"}, "its symbolic links lead to one another in a circle");
}

TEST_CASE("two scenes with unusual names do not share a default output") {
    const Place place;
    for (const char* name : {"*.toml", "\u00e4.toml"}) test::write_text(place.file(name), test::read_file(pendulum));
    const test::Finished done = test::run({"sh", "-c",
                                           "cd '" + place.folder.string() +
                                               "' && for s in '*.toml' '\u00e4.toml'; do '" LOBATTO_PROGRAM
                                               "' run \"$s\" --until 1 --quiet; done; ls out"});
    CHECK(done.out == "*.csv\n\u00e4.csv\n");
}

TEST_CASE("sweeps with another kind of step have another digest") {
    const Place place;
    const auto digest = [&](const char* clock) {
        const test::Finished done = place.sweep({LOBATTO_SOURCE_DIR "/scenes/kepler.toml", "--vary", "x=0.4:0.5:2",
                                                 "--until", "1", "--step", "0.1", "--clock", clock});
        REQUIRE_MESSAGE(done.exit_code == 0, done.err);
        const std::string table = test::read_file(place.file()), line = "\n# sweep: ";
        const std::size_t at = table.find(line);
        REQUIRE(at != std::string::npos);
        return table.substr(at + line.size(), 16);
    };
    const std::string none = digest("none");
    CHECK(none == digest("none"));
    CHECK(none != digest("auto"));
}
