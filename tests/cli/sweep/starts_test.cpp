// SPDX-License-Identifier: GPL-2.0-or-later
// What the trajectories of a sweep begin with: files, draws, lists that run together, settings of the method.
#include <doctest/doctest.h>
#include <sys/stat.h>

#include <array>
#include <cmath>
#include <cstring>

#include "tests/cli/sweep/tables.hpp"

using namespace lobatto;
using test::column_of;
using test::pendulum_file;

namespace {

const std::vector<std::string> shortly = {"--until", "1"};

std::vector<std::string> with(std::vector<std::string> words, const std::vector<std::string>& more = shortly) {
    words.insert(words.end(), more.begin(), more.end());
    return words;
}

// An array of NumPy as it writes it.
std::string npy_of(const std::string& description, const std::string& shape, const std::string& numbers) {
    std::string head = "{'descr': " + description + ", 'fortran_order': False, 'shape': " + shape + ", }";
    while ((10 + head.size() + 1) % 64 != 0) head += ' ';
    head += '\n';
    std::string file("\x93NUMPY\x01\x00", 8);
    file += static_cast<char>(head.size() & 0xff);
    file += static_cast<char>(head.size() >> 8);
    return file + head + numbers;
}

template <class T>
std::string bytes_of(const std::vector<T>& values) {
    return {reinterpret_cast<const char*>(values.data()), sizeof(T) * values.size()};
}

}  // namespace

TEST_CASE("starts come from the columns of a CSV, of NumPy's records and of its arrays, and all give the same rows") {
    const test::SweepFolder place;
    test::write_text(place.file("starts.csv"), "# a comment\nq,q',omega\n1,0.5,6\n -2 , 0,7.5\n0.25,1e-3,5\n");
    const test::TrajectoryTable table = place.table(with({"--starts", place.file("starts.csv")}));
    CHECK(column_of(table, "q(0)") == std::vector<double>{1, -2, 0.25});
    CHECK(column_of(table, "q'(0)") == std::vector<double>{0.5, 0, 1e-3});
    CHECK(column_of(table, "omega") == std::vector<double>{6, 7.5, 5});
    // What lists that run together give.
    const test::TrajectoryTable zipped =
        place.table(with({"--zip", "--vary", "q=1,-2,0.25", "--vary", "q'=0.5,0,1e-3", "--vary", "omega=6,7.5,5"}));
    CHECK(zipped.rows == table.rows);
    CHECK(zipped.columns == table.columns);

    std::string records;
    for (const auto& [q, v, omega] : std::vector<std::array<double, 3>>{{1, 0.5, 6}, {-2, 0, 7.5}, {0.25, 1e-3, 5}}) {
        records += bytes_of<double>({q, v});
        records += bytes_of<float>({static_cast<float>(omega)});  // exact as floats too
    }
    test::write_text(place.file("records.npy"),
                     npy_of("[('q', '<f8'), (\"q'\", '<f8'), ('omega', '<f4')]", "(3,)", records));
    CHECK(place.table(with({"--starts", place.file("records.npy")})).rows == table.rows);

    test::write_text(place.file("states.npy"),
                     npy_of("'<f8'", "(3, 2)", bytes_of<double>({1, 0.5, -2, 0, 0.25, 1e-3})));
    test::write_text(place.file("states.csv"), "q(0),q'(0)\n1,0.5\n-2,0\n0.25,1e-3\n");
    const test::TrajectoryTable states = place.table(with({"--starts", place.file("states.npy")}));
    CHECK(states.rows == place.table(with({"--starts", place.file("states.csv")})).rows);
    test::write_text(place.file("whole.npy"), npy_of("[('q', '<i4'), (\"q'\", '|b1')]", "(2,)",
                                                     std::string("\xfe\xff\xff\xff\x01\x03\x00\x00\x00\x00", 10)));
    const test::TrajectoryTable whole = place.table(with({"--starts", place.file("whole.npy")}));
    CHECK(column_of(whole, "q(0)") == std::vector<double>{-2, 3});
    CHECK(column_of(whole, "q'(0)") == std::vector<double>{1, 0});

    // Each start with each value; the values run fastest.
    const test::TrajectoryTable both = place.table(with({"--starts", place.file("starts.csv"), "--vary", "m=1,2"}));
    CHECK(column_of(both, "q(0)") == std::vector<double>{1, 1, -2, -2, 0.25, 0.25});
    CHECK(column_of(both, "m") == std::vector<double>{1, 2, 1, 2, 1, 2});
}

TEST_CASE("a file of starts that makes no sense is refused with its place") {
    const test::SweepFolder place;
    const auto csv = [&](const std::string& text) {
        test::write_text(place.file("s.csv"), text);
        const std::string said = place.refusal("no.csv", {"--starts", place.file("s.csv")});
        CHECK_FALSE(std::filesystem::exists(place.file("no.csv")));
        CHECK_FALSE(std::filesystem::exists(place.file("no.csv.partial")));
        return said.substr(said.find("s.csv") == std::string::npos ? 0 : said.find("s.csv"));
    };
    CHECK(csv("q,r\n1,2\n").starts_with("s.csv: unknown column 'r'; what can be varied: m, omega, q, q'"));
    CHECK(csv("q,p_q\n1,2\n").starts_with("s.csv: " + pendulum_file + " gives initial velocities, not momenta"));
    CHECK(csv("q,q\n1,2\n").starts_with("'q' is varied twice"));
    CHECK(csv("step\n1\n") ==
          "s.csv: 'step' is a setting of the method and no start: `lobatto sweep --vary` varies it\n");
    CHECK(csv("q\n1\nabc\n") == "s.csv:3:1: 'abc' is no finite number, of the column q\n");
    CHECK(csv("q,m\n1,nan\n") == "s.csv:2:3: 'nan' is no finite number, of the column m\n");
    CHECK(csv("q,m\n1\n") == "s.csv:2:2: no value of the column m\n");
    CHECK(csv("q,m\n1,2,3\n") == "s.csv:2:5: more values than the 2 columns that were named\n");
    CHECK(csv("1,2\n3,4\n") ==
          "s.csv:1:1: '1' is a number, but the first line names the columns, such as q,q',omega\n");
    CHECK(csv("q\n") == "s.csv has no row\n");
    CHECK(csv("# nothing\n") == "s.csv: no line with the names of columns, such as q,q',omega\n");
    const auto npy = [&](const std::string& bytes) {
        test::write_text(place.file("s.npy"), bytes);
        const std::string said = place.refusal("no.csv", {"--starts", place.file("s.npy")});
        return said.substr(said.find("s.npy"));
    };
    CHECK(npy("text") == "s.npy: it does not begin as files of NumPy do\n");
    CHECK(npy(npy_of("'<f8'", "(3, 3)", bytes_of<double>(std::vector<double>(9))))
              .starts_with("s.npy: an array without names has two dimensions and 1 or 2 columns, positions and then "
                           "velocities; this one "
                           "has 3 columns."));
    CHECK(npy(npy_of("'>f8'", "(3, 2)", bytes_of<double>(std::vector<double>(6))))
              .starts_with("s.npy: numbers of the type >f8 are not read"));
    CHECK(npy(npy_of("'<f8'", "(3, 2)", bytes_of<double>({1, 2}))) == "s.npy: it is shorter than its head says\n");
    CHECK(npy(npy_of("'<f8'", "(1, 2)", bytes_of<double>({1, std::nan("")}))) ==
          "s.npy: row 0 of the column q' is no finite number\n");
    CHECK(place.refusal("no.csv", {"--starts", place.file("none.csv")}).ends_with("No such file or directory\n"));
    REQUIRE(::mkfifo(place.file("pipe.csv").c_str(), 0600) == 0);
    CHECK(place.refusal("no.csv", {"--starts", place.file("pipe.csv")}).ends_with("is a named pipe; give a file\n"));
    CHECK(place.refusal("no.csv", {"--starts", "starts.txt"}) ==
          "--starts: starts.txt has an ending that is not known; starts are read from .csv and .npy\n");
}

TEST_CASE("a part of an orientation is not varied beside a rate that tells an angular velocity with it") {
    const test::SweepFolder place;
    const auto top = [&](const std::string& turn) {
        test::write_text(
            place.file("top.toml"),
            "lagrangian = \"-9.81*top.z\"\n[bodies]\ntop = { mass = 1, inertia = [0.75, 0.75, 0.5], position "
            "= [0, 0, 0.5]" +
                turn +
                " }\n[joints]\ntip = { type = \"ball\", bodies = [\"ground\", \"top\"], point = [0, 0, 0] }\n"
                "[run]\nstep = 0.05\nuntil = 0.1\n");
        return test::run({LOBATTO_PROGRAM, "sweep", place.file("top.toml"), "--vary", "top.q[2]=0.1,0.2", "-o",
                          place.file("top.csv")});
    };
    const test::Finished turning = top(", angular_velocity = [0, 0, 8]");
    CHECK(turning.exit_code == 2);
    CHECK(test::contains(turning.err, "'top.q[2]' is a part of an orientation, and the rate of top.q[4] would stay"));
    CHECK(top("").exit_code == 0);
}

TEST_CASE("random rows are the same for the same seed, for each setting, and others for other rows") {
    const test::SweepFolder place;
    const std::vector<std::string> drawn = {"--random",           "20",     "--draw",
                                            "q ~ normal(1, 0.1)", "--draw", "omega ~ uniform(5, 7)"};
    const test::TrajectoryTable one = place.table(with(drawn, {"--until", "1", "--seed", "5"}));
    REQUIRE(one.rows.size() == 20);
    CHECK(place.table(with(drawn, {"--until", "1", "--seed", "5", "--threads", "1"})).rows == one.rows);
    CHECK(column_of(place.table(with(drawn, {"--until", "1", "--seed", "6"})), "q(0)")[3] != column_of(one, "q(0)")[3]);
    std::vector<double> q = column_of(one, "q(0)");
    for (const double omega : column_of(one, "omega")) CHECK((omega >= 5 && omega < 7));
    std::sort(q.begin(), q.end());
    CHECK(std::adjacent_find(q.begin(), q.end()) == q.end());
    // Twice as many begin with the same; settings have the same starts, combinations have their own.
    const test::TrajectoryTable settings =
        place.table(with(drawn, {"--until", "1", "--seed", "5", "--vary", "step=0.1,0.05"}));
    const std::vector<double> all = column_of(settings, "q(0)"), first = column_of(one, "q(0)");
    REQUIRE(all.size() == 40);
    for (std::size_t i = 0; i < 20; ++i) {
        CHECK(all[i] == first[i]);
        CHECK(all[20 + i] == first[i]);
        CHECK(column_of(settings, "q")[20 + i] == column_of(one, "q")[i]);  // the scene's own step
    }
    std::vector<double> combined = column_of(place.table(with(drawn, {"--until", "1", "--vary", "m=1,2"})), "q(0)");
    REQUIRE(combined.size() == 40);
    std::sort(combined.begin(), combined.end());
    CHECK(std::adjacent_find(combined.begin(), combined.end()) == combined.end());

    CHECK(place.refusal("no.csv", {"--random", "3"}).starts_with("--random: nothing is drawn; say what"));
    CHECK(place.refusal("no.csv", {"--vary", "m=1", "--draw", "q ~ normal(0, 1)"})
              .starts_with("--draw: say how many rows"));
    CHECK(place.refusal("no.csv", {"--random", "0", "--draw", "q ~ normal(0, 1)"})
              .starts_with("--random: 0 is not a number"));
    CHECK(place.refusal("no.csv", {"--random", "3", "--vary", "q=1,2", "--draw", "q ~ normal(0, 1)"})
              .starts_with("'q' is varied twice"));
}

TEST_CASE("a study of convergence is one command: errors fall as the order says, with steps, points, stages" *
          doctest::test_suite("slow")) {
    const test::SweepFolder place;
    const auto errors = [&](const std::vector<std::string>& words) {
        const test::TrajectoryTable table = place.table(words);
        std::vector<double> error;  // of q, against the last, which is the most accurate
        const std::vector<double> q = column_of(table, "q");
        for (const double value : q) error.push_back(std::fabs(value - q.back()));
        return error;
    };
    // Order 6: 64 times less for half the step. 61 and 63 were measured.
    const std::vector<double> of_steps =
        errors({"--vary", "step=0.05,0.025,0.0125,0.001", "--vary", "q=1", "--until", "2"});
    CHECK(of_steps[0] / of_steps[1] > 50);
    CHECK(of_steps[0] / of_steps[1] < 80);
    CHECK(of_steps[1] / of_steps[2] > 50);
    CHECK(of_steps[1] / of_steps[2] < 80);
    const std::vector<double> of_points =
        errors({"--vary", "points=2,3,4,5,9", "--vary", "q=1", "--until", "2", "--step", "0.02"});
    for (std::size_t i = 0; i < 3; ++i) CHECK(of_points[i] > 20 * of_points[i + 1]);
    const std::vector<double> of_stages =
        errors({"--vary", "stages=1,2,3,8", "--vary", "q=1", "--until", "2", "--step", "0.02"});
    for (std::size_t i = 0; i < 2; ++i) CHECK(of_stages[i] > 20 * of_stages[i + 1]);
    // Each row is that of a sweep with this setting alone.
    const test::TrajectoryTable both = place.table(
        {"--zip", "--vary", "points=4,6,4", "--vary", "step=0.05,0.1,0.1", "--vary", "q=1,2,1.5", "--until", "2"});
    const char* const alone[][3] = {{"4", "0.05", "q=1"}, {"6", "0.1", "q=2"}, {"4", "0.1", "q=1.5"}};
    for (std::size_t i = 0; i < 3; ++i) {
        const auto& [points, step, q] = alone[i];
        const test::TrajectoryTable one =
            place.table({"--points", points, "--step", step, "--vary", q, "--until", "2"});
        for (const char* name : {"q", "p_q", "steps", "error", "energy_error"})
            CHECK(column_of(one, name)[0] == column_of(both, name)[i]);
    }
    const test::TrajectoryTable tolerances =
        place.table({"--vary", "tolerance=1e-3,1e-14", "--vary", "q=1", "--until", "2"});
    CHECK(column_of(tolerances, "q")[0] != column_of(tolerances, "q")[1]);
    CHECK(column_of(tolerances, "q")[0] == doctest::Approx(column_of(tolerances, "q")[1]).epsilon(1e-3));

    const test::Finished said = place.sweep("said.csv", {"--vary", "step=0.1,0.05", "--vary", "q=1,2", "--until", "1"});
    CHECK(said.out.find("\n  step = 0.1              20 steps, energy error ") != std::string::npos);
    CHECK(said.out.find("\n  step = 0.05             40 steps, energy error ") != std::string::npos);
    CHECK(test::read_file(place.file("said.csv")).find("# method: Lobatto, 4 points, h varied\n") != std::string::npos);

    const auto refused = [&](const std::vector<std::string>& words) { return place.refusal("no.csv", words); };
    CHECK(refused({"--vary", "points=4,13"})
              .starts_with("--vary:1:8: points = 13; Lobatto has 2 to 12 points, a whole number"));
    CHECK(refused({"--vary", "step=0.1,0"}).starts_with("--vary:1:6: step = 0; a step must be positive"));
    CHECK(refused({"--vary", "tolerance=1"}).starts_with("--vary:1:11: tolerance = 1; a tolerance must be above 0"));
    CHECK(refused({"--vary", "points=2,3", "--vary", "stages=1,2"}) ==
          "--vary: points and stages are of two families; vary one of both\n");
    CHECK(refused({"--vary", "step=0.1,0.2", "--step", "0.1"}) == "--step: it is varied too; leave one of both out\n");
    CHECK(refused({"--vary", "points=2,3", "--stages", "2"}) ==
          "the method on the command line: it is varied too; leave one of both out\n");
    CHECK(refused({"--vary", "step=0.1:0.2:20000"}).starts_with("--vary: 20000 settings of the method"));
}

TEST_CASE("lists that run together are equally long") {
    const test::SweepFolder place;
    CHECK(place.refusal("no.csv", {"--zip", "--vary", "q=1,2,3", "--vary", "m=1,2"}) ==
          "--zip: lists that run together are equally long, but m has 2 values and q has 3\n");
    CHECK(
        place.refusal("no.csv", {"--zip", "--vary", "q=1,2,3"}).starts_with("--zip: lists that run together are two"));
}
