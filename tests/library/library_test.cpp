// SPDX-License-Identifier: GPL-2.0-or-later
// The library as another program uses it: through lobatto.hpp and the shared object alone.
#include <doctest/doctest.h>

#include <lobatto/lobatto.hpp>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <thread>
#include <tuple>

#include "tests/support.hpp"

namespace {

namespace lob = lobatto::api;

const std::string scenes = LOBATTO_SOURCE_DIR "/scenes/";

// The rows of a file that `lobatto run` wrote.
std::vector<std::vector<double>> rows_of(const std::string& path) {
    std::ifstream file(path);
    std::vector<std::vector<double>> rows;
    for (std::string line; std::getline(file, line);) {
        if (line.empty() || line[0] == '#' || std::isalpha(static_cast<unsigned char>(line[0])) != 0) continue;
        std::vector<double> row;
        std::istringstream values(line);
        for (std::string value; std::getline(values, value, ',');) row.push_back(std::stod(value));
        rows.push_back(row);
    }
    return rows;
}

}  // namespace

TEST_CASE("a run of the library is that of the command line, bit for bit, with its error") {
    const lobatto::test::TemporaryFolder folder;
    const std::string file = folder / "run.csv";
    for (const char* name : {"double_pendulum", "kepler", "bouncing_ball"}) {
        CAPTURE(name);
        const lob::Scene scene(scenes + name + ".toml");
        lob::RunOptions options;
        options.until = "3";
        const lob::Trajectory run = lob::run(scene, options);
        REQUIRE(lobatto::test::run({LOBATTO_PROGRAM, "run", scene.path(), "--until", "3", "-o", file, "--quiet"})
                    .exit_code == 0);
        const auto rows = rows_of(file);
        REQUIRE(rows.size() == run.count);
        const std::size_t n = run.coordinates.size();
        for (std::size_t i = 0; i < rows.size(); ++i) {
            CHECK(rows[i][0] == run.t[i]);
            for (std::size_t k = 0; k < n; ++k) CHECK(rows[i][1 + k] == run.q[i * n + k]);
        }
        CHECK(run.error.has_value());
        CHECK(run.steps > 0);
    }
}

TEST_CASE("a stepper takes the same steps as a run, and looks inside the last one") {
    const lob::Scene scene(scenes + "pendulum.toml");
    CHECK(scene.coordinates().front().unit == "rad");
    CHECK(scene.parameters().back().name == "omega");
    lob::Stepper stepper(lob::compile(scene));
    lob::RunOptions options;
    options.until = "1";
    const lob::Trajectory run = lob::run(scene, options);
    stepper.advance(19);
    lob::Stepper before = stepper;
    stepper.step();
    CHECK(stepper.q()[0] == run.q[20]);
    CHECK(stepper.p()[0] == run.p[20]);
    CHECK(stepper.energy() == run.energy[20]);
    // The polynomial inside a step of 4 points has degree 3: measured 5.9e-6 and 6.8e-4.
    before.advance_to(19 * 0.05 + 0.02);
    const auto [q, v] = stepper.at(19 * 0.05 + 0.02);
    CHECK(std::fabs(q[0] - before.q()[0]) < 1e-5);
    CHECK(std::fabs(v[0] - before.velocity()[0]) < 1e-3);
    CHECK(q[0] != run.q[20]);
    CHECK(lobatto::test::message_of<lob::InputError>([&] {
              static_cast<void>(stepper.at(5));
          }).starts_with("at: t = 5 is not inside"));
}

TEST_CASE("between the rows of a run its states are those of steps from the row before") {
    const lob::Scene scene(scenes + "pendulum.toml");
    lob::RunOptions options;
    options.until = "1";
    options.every = 5;
    const lob::Trajectory run = lob::run(scene, options);
    const lob::Stepper stepper(lob::compile(scene));
    const auto [q, v] = lob::states_at(stepper, run, {0, 0.4, 0.42, 0.5, 1, 0.4});
    REQUIRE(q.size() == 6);
    CHECK(q[0] == run.q[0]);
    CHECK(q[3] == run.q[2]);
    CHECK(q[4] == run.q.back());
    lob::Stepper between = stepper;
    between.start(run.t[1], &run.q[1], &run.p[1]);
    between.advance(3);
    CHECK(q[1] == between.q()[0]);
    CHECK(v[1] == between.velocity()[0]);
    CHECK(q[5] == q[1]);
    between.advance_to(0.42);
    CHECK(q[2] == between.q()[0]);
    CHECK(v[2] == between.velocity()[0]);
    // Rows inside steps are those of a polynomial, and no places to go on from.
    options.every.reset();
    std::string text = scene.text();
    const lob::Trajectory plain = lob::run(scene, options);
    const lob::Scene with_dense = lob::Scene::from_text(text.insert(text.find("every = 1"), "dense = 3\n"));
    const lob::Trajectory dense = lob::run(with_dense, options);
    CHECK(dense.dense == 3);
    CHECK(dense.t.size() == 4 * plain.t.size() - 3);
    CHECK(lob::states_at(stepper, dense, {0.02, 0.05, 0.0625, 1}) ==
          lob::states_at(stepper, plain, {0.02, 0.05, 0.0625, 1}));
    CHECK(lobatto::test::message_of<lob::InputError>([&] { static_cast<void>(lob::states_at(stepper, run, {1.5})); }) ==
          "t = 1.5 is outside the trajectory, which leads from 0 to 1");
    const lob::Stepper other(lob::compile(lob::Scene(scenes + "double_pendulum.toml")));
    CHECK(lobatto::test::message_of<lob::InputError>([&] {
              static_cast<void>(lob::states_at(other, run, {0}));
          }).starts_with("states_at: the trajectory is of another scene"));
}

TEST_CASE("advance_to ends at its time exactly, also between steps, and goes on with steps of the usual length") {
    lob::Stepper stepper(lob::compile(lob::Scene(scenes + "pendulum.toml")));
    stepper.advance_to(0.33);
    CHECK(stepper.t() == 0.33);
    const double q = stepper.q()[0];
    stepper.step();
    CHECK(stepper.t() == doctest::Approx(0.38));
    lob::Stepper other(lob::compile(lob::Scene(scenes + "pendulum.toml"), [] {
        lob::Settings settings;
        settings.step = "0.033";
        return settings;
    }()));
    other.advance(10);
    CHECK(std::fabs(other.q()[0] - q) < 1e-7);  // both of order 6
    CHECK(lobatto::test::message_of<lob::InputError>([&] { stepper.advance_to(0.1); }).find("is at t = 0.38") !=
          std::string::npos);
}

TEST_CASE("advance_to is at its time to the last bit, however many steps lead there") {
    const lob::Scene scene = lob::Scene::from_text(
        "lagrangian = \"x'^2/2 - 1e-3*x^4\"\n[coordinates]\nx = { position = 0, velocity = 1 }\n[run]\nstep = "
        "0.015\nuntil = 1\n");
    lob::Stepper stepper(lob::compile(scene));
    stepper.advance_to(0.33);  // 22 steps, whose sum is another number
    CHECK(stepper.t() == 0.33);
    stepper.advance_to(3000.00009);  // not 3000: a rest of 0.6 % of a step, 3e-8 of the way
    CHECK(stepper.t() == 3000.00009);
    lob::Stepper near(lob::compile(scene));
    near.advance_to(3000);
    CHECK(stepper.q()[0] - near.q()[0] == doctest::Approx(0.00009 * near.velocity()[0]).epsilon(0.01));
}

TEST_CASE("a stop or event where advance_to ends is not lost") {
    const std::string text =
        "lagrangian = \"x'^2/2 - y'^2/2 + y'*x'\"\n[coordinates]\nx = { position = 0, velocity = 1 }\ny = { position = "
        "0, velocity = 1 }\n[run]\nstep = 0.04\nuntil = 9\n";
    lob::Stepper stopped(lob::compile(lob::Scene::from_text(text + "stop = \"x = 0.7\"\n")));
    stopped.advance_to(0.7);
    CHECK_FALSE(stopped.advance(10));
    CHECK(stopped.t() == doctest::Approx(0.7).epsilon(1e-14));
    lob::Stepper watched(
        lob::compile(lob::Scene::from_text(text + "[output]\nevents = [\"x = 0.7\", \"y = 0.3 rising\"]\n")));
    watched.advance_to(0.3);
    watched.advance_to(0.5);
    watched.advance_to(0.7);
    watched.advance(3);
    const auto hits = watched.take_events();
    REQUIRE(hits.size() == 2);
    CHECK(hits[0].t == doctest::Approx(0.3).epsilon(1e-14));
    CHECK(hits[1].t == doctest::Approx(0.7).epsilon(1e-14));
}

TEST_CASE("a parameter set between steps acts from the next step on, as a fresh start with it would") {
    const lob::Scene scene(scenes + "pendulum.toml");
    lob::Stepper stepper(lob::compile(scene));
    stepper.advance(7);
    lob::Settings settings;
    settings.set = {{"omega", "5"}};
    lob::Stepper fresh(lob::compile(scene, settings));
    fresh.start(stepper.t(), stepper.q(), stepper.p());
    stepper.set("omega", 5);
    stepper.advance(3);
    fresh.advance(3);
    CHECK(stepper.q()[0] == doctest::Approx(fresh.q()[0]).epsilon(1e-14));
    CHECK(stepper.parameter("omega") == 5);
    CHECK(lobatto::test::message_of<lob::InputError>([&] { stepper.set("omga", 1); }) ==
          "unknown parameter 'omga'; declared: m, omega. Did you mean 'omega'?");
}

TEST_CASE("there is no tangent of a step that a wall cuts, and names of elements are known in both forms") {
    const lob::Scene scene = lob::Scene::from_text(
        "lagrangian = \"y'^2/2 - g[1]*y - g[2]*y^2/2\"\n[coordinates]\ny = { position = 1, velocity = 0 }\n"
        "[parameters]\ng = [9.81, 0]\n[impacts]\nfloor = { when = \"y = 0 falling\", restitution = 0.8 }\n"
        "[run]\nstep = 0.1\nuntil = 1\n",
        "ball.toml");
    lob::Stepper stepper(lob::compile(scene));
    CHECK(stepper.parameter("g[1]") == stepper.parameter("g_1"));
    stepper.set("g[2]", 1);
    CHECK(stepper.parameter("g_2") == 1);
    CHECK(stepper.tangent().size() == 4);
    stepper.advance(4);  // to 0.4 of 0.45
    CHECK(lobatto::test::contains(lobatto::test::message_of<lob::ComputationError>([&] { stepper.tangent(); }),
                                  "cuts the step from here"));
}

TEST_CASE("a step with a clock ends at a time of its own, so it has no tangent at one") {
    lob::Settings settings;
    settings.clock = "auto";
    const lob::Stepper stepper(lob::compile(lob::Scene(LOBATTO_SOURCE_DIR "/scenes/kepler.toml"), settings));
    CHECK(lobatto::test::contains(lobatto::test::message_of<lob::InputError>([&] { stepper.tangent(); }),
                                  "tangent: with a clock a step lasts as long as the motion makes it"));
}

TEST_CASE("the tangent of a step is symplectic") {
    lob::Stepper stepper(lob::compile(lob::Scene(scenes + "pendulum.toml")));
    const std::vector<double> T = stepper.tangent();
    REQUIRE(T.size() == 4);
    CHECK(std::fabs(T[0] * T[3] - T[1] * T[2] - 1) < 1e-14);
}

TEST_CASE("errors of the library have the command line's texts and exit codes") {
    const std::string wrong =
        "lagrangian = \"m*q'^2/2 - k*q\"\n[coordinates]\nq = { position = 1, velocity = 0 }\n[parameters]\nm = 1\n";
    const std::string text =
        lobatto::test::message_of<lob::InputError>([&] { lob::Scene::from_text(wrong, "wrong.toml"); });
    CHECK(text.starts_with("wrong.toml:1:"));
    CHECK(text.find("unknown name 'k'") != std::string::npos);
    CHECK(lobatto::test::message_of<lob::InputError>([] { lob::Scene("/nowhere.toml"); }).find("/nowhere.toml") !=
          std::string::npos);
    lob::RunOptions options;
    options.step = "2.9";
    options.until = "100";
    try {
        lob::run(lob::Scene(scenes + "pendulum.toml"), options);
        FAIL("the step is too long");
    } catch (const lob::RunFailure& failure) {
        CHECK(failure.exit_code() == 3);
        CHECK(std::string(failure.what()).find("did not converge") != std::string::npos);
        CHECK(failure.trajectory().count >= 2);  // what was computed is there
    }
    lob::Stepper stepper(lob::compile(lob::Scene(scenes + "pendulum.toml")));
    const double nothing = std::nan(""), one = 1;
    CHECK(lobatto::test::message_of<lob::InputError>([&] { stepper.start(0, &nothing, &one); }) ==
          "start: the position of q is nan, not a finite number");
    CHECK(lobatto::test::message_of<lob::InputError>([&] { stepper.start_from_velocity(0, &one, &nothing); }) ==
          "start: the velocity of q is nan, not a finite number");
    CHECK(lobatto::test::message_of<lob::InputError>([&] { stepper.start(nothing, &one, &one); }) ==
          "start: nan is no time");
}

TEST_CASE("positions stay in their place where a stepper goes back to a copy") {
    lob::Stepper stepper(lob::compile(lob::Scene(scenes + "pendulum.toml")));
    const double *const q = stepper.q(), *const p = stepper.p(), before = q[0];
    const lob::Stepper saved(stepper);
    stepper.advance(10);
    REQUIRE(q[0] != before);
    stepper = saved;
    CHECK(stepper.q() == q);
    CHECK(stepper.p() == p);
    CHECK(q[0] == before);
    stepper.step();
    CHECK(q[0] == stepper.q()[0]);
}

TEST_CASE("a stepper whose step fails stays where it was") {
    lob::Settings settings;
    settings.step = "2.9";
    lob::Stepper stepper(lob::compile(lob::Scene(scenes + "pendulum.toml"), settings));
    double q = 0, t = 0;
    const std::string text = lobatto::test::message_of<lob::ComputationError>([&] {
        for (int i = 0; i < 50; ++i) {
            q = stepper.q()[0];
            t = stepper.t();
            stepper.step();
        }
    });
    CHECK(text.find("did not converge") != std::string::npos);
    CHECK(stepper.q()[0] == q);
    CHECK(stepper.t() == t);
}

TEST_CASE("a stepper at the end of measured values says so") {
    // Defect once: "the motion runs into a singularity".
    const lobatto::test::TemporaryFolder folder;
    lobatto::test::write_text(folder / "push.csv", "0,1\n0.5,2\n1,1\n1.5,0\n");
    lobatto::test::write_text(
        folder / "pushed.toml",
        "time = \"t\"\nlagrangian = \"x'^2/2 - x^2/2\"\n[coordinates]\nx = { position = 1, velocity = 0 }\n"
        "[forces]\nx = \'\'\'table(\"push.csv\", t)\'\'\'\n[run]\nstep = 0.1\nuntil = 1.5\n");
    lob::Stepper stepper(lob::compile(lob::Scene((folder / "pushed.toml").string())));
    const std::string message = lobatto::test::message_of<lob::ComputationError>([&] { stepper.advance_to(3); });
    CHECK(lobatto::test::contains(message, "at the end of the step the table push.csv, which goes from 0 to 1.5"));
    CHECK(lobatto::test::contains(message, "Try an earlier end, or measure further."));
    CHECK(stepper.t() == doctest::Approx(1.5));
}

TEST_CASE("events, stops and impacts come out of a stepper") {
    lob::Stepper ball(lob::compile(lob::Scene(scenes + "bouncing_ball.toml")));
    ball.advance(40);
    const auto hits = ball.take_events();
    CHECK(!hits.empty());
    CHECK(ball.take_events().empty());
    const std::string stopping =
        "lagrangian = \"q'^2/2 - q^2/2\"\n[coordinates]\nq = { position = 1, velocity = 0 }\n[run]\nstep = 0.1\nuntil "
        "= 9\nstop = \"q = 0\"\n";
    lob::Stepper stopped(lob::compile(lob::Scene::from_text(stopping)));
    CHECK_FALSE(stopped.advance(30));
    CHECK(std::fabs(stopped.t() - std::acos(-1.0) / 2) < 1e-6);
    CHECK(std::fabs(stopped.q()[0]) < 1e-12);
    const lob::Trajectory run = lob::run(lob::Scene::from_text(stopping));
    CHECK(run.stopped_by == "q = 0");
    CHECK(run.t.back() == stopped.t());
}

TEST_CASE("a sweep of the library gives the states that runs give, whatever the number of threads") {
    const lob::Scene scene(scenes + "double_pendulum.toml");
    lob::Starts starts;
    starts.count = 37;
    const std::string name = scene.coordinates().front().name;
    for (std::size_t i = 0; i < starts.count; ++i) starts.columns[name].push_back(0.1 + 0.02 * static_cast<double>(i));
    lob::SweepOptions options;
    options.until = "2";
    options.threads = 1;
    const lob::Sweep one = lob::sweep(scene, starts, options);
    options.threads = 2;
    const lob::Sweep two = lob::sweep(scene, starts, options);
    REQUIRE(one.count == 37);
    CHECK(one.q == two.q);
    CHECK(one.p == two.p);
    CHECK(one.status == std::vector<int>(37, 0));
    lob::Stepper stepper(lob::compile(scene));
    std::vector<double> q = {starts.columns[name][5], stepper.q()[1]}, v = stepper.velocity();
    stepper.start_from_velocity(0, q.data(), v.data());
    stepper.advance(one.steps[5]);
    CHECK(one.q[10] == doctest::Approx(stepper.q()[0]).epsilon(1e-11));
    starts.columns["tetha"] = starts.columns[name];
    CHECK(lobatto::test::message_of<lob::InputError>([&] {
              lob::sweep(scene, starts, options);
          }).starts_with("unknown column 'tetha'"));
}

TEST_CASE("a sweep keeps what it is asked for in place of states") {
    const lob::Scene scene(scenes + "pendulum.toml");
    lob::Starts starts{3, {{"q", {0.5, 1, 1.5}}}};
    lob::SweepOptions options;
    options.until = "3";
    options.keep = {"max(q)", "count(q = 0 rising)"};
    options.measure = true;
    const lob::Sweep sweep = lob::sweep(scene, starts, options);
    REQUIRE(sweep.kept.size() == 6);
    for (std::size_t i = 0; i < 3; ++i) CHECK(std::fabs(sweep.kept[2 * i] - starts.columns["q"][i]) < 0.05);
    CHECK(sweep.kept[1] >= 2);
    REQUIRE(sweep.error.size() == 3);
    CHECK(sweep.error[0] < 1e-4);
}

TEST_CASE("a sweep that keeps states on the way has those of the command line, also where errors are measured") {
    const lobatto::test::TemporaryFolder folder;
    const std::string file = folder / "sweep.csv";
    for (const char* name : {"double_pendulum", "kepler"}) {
        CAPTURE(name);
        const lob::Scene scene(scenes + name + ".toml");
        const std::string varied = scene.coordinates().front().name;
        REQUIRE(lobatto::test::run({LOBATTO_PROGRAM, "sweep", scene.path(), "--vary", varied + "=0.9,1,1.1", "--until",
                                    "2", "--every", "7", "-o", file, "--quiet"})
                    .exit_code == 0);
        const auto rows = rows_of(file);
        lob::SweepOptions options;
        options.until = "2";
        options.every = 7;
        for (const bool measure : {false, true}) {
            options.measure = measure;
            const lob::Sweep sweep = lob::sweep(scene, {3, {{varied, {0.9, 1, 1.1}}}}, options);
            const std::size_t n = sweep.coordinates.size();
            REQUIRE(sweep.states.first.size() == 4);
            REQUIRE(sweep.states.first[3] == rows.size());
            CHECK(rows.size() > 9);
            for (std::size_t i = 0; i < 3; ++i)
                for (std::size_t row = sweep.states.first[i]; row < sweep.states.first[i + 1]; ++row) {
                    CHECK(rows[row][0] == static_cast<double>(i));
                    CHECK(rows[row][4] == sweep.states.t[row]);  // index, start, status, steps, t
                    for (std::size_t k = 0; k < n; ++k) CHECK(rows[row][5 + k] == sweep.states.q[row * n + k]);
                }
            for (std::size_t k = 0; k < n; ++k) {
                CHECK(sweep.states.q[(sweep.states.first[2] - 1) * n + k] == sweep.q[n + k]);
                CHECK(sweep.states.p[(sweep.states.first[2] - 1) * n + k] == sweep.p[n + k]);
            }
            CHECK(sweep.states.energy_error[sweep.states.first[2]] == 0);
            CHECK(sweep.states.energy_error.back() == sweep.energy_error.back());
        }
    }
    lob::SweepOptions options;
    options.every = 0;
    const lob::Scene pendulum(scenes + "pendulum.toml");
    CHECK(lobatto::test::message_of<lob::InputError>([&] {
              lob::sweep(pendulum, {1, {{"q", {1}}}}, options);
          }).find("0 is not a number of states") != std::string::npos);
    options.every.reset();
    CHECK(lob::sweep(pendulum, {1, {{"q", {1}}}}, options).states.first.empty());
}

TEST_CASE("progress may end a run, and what was computed is there") {
    lob::RunOptions options;
    options.until = "1e6";
    options.measure = false;
    int calls = 0;
    options.progress = [&](double share) {
        CHECK(share <= 1);
        return ++calls < 2;
    };
    options.every = 1000;
    const lob::Trajectory run = lob::run(lob::Scene(scenes + "pendulum.toml"), options);
    CHECK(run.interrupted);
    CHECK(calls == 2);
    CHECK(run.count > 1);
}

TEST_CASE("tune returns settings with which a run keeps the error that was asked for" * doctest::test_suite("slow")) {
    const lob::Scene scene(scenes + "pendulum.toml");
    lob::Settings settings;
    settings.until = "20";
    const lob::Choice choice = lob::tune(scene, 1e-8, settings, 600);  // ends long before, but for a busy machine
    CHECK(choice.predicted_error <= 1e-8);
    lob::RunOptions options;
    static_cast<lob::Settings&>(options) = choice.settings;
    const lob::Trajectory run = lob::run(scene, options);
    REQUIRE(run.error.has_value());
    CHECK(*run.error < 3e-8);
}

namespace {

// Five revolutions with e = 0.9 from the pericentre.
lob::Scene eccentric(const std::string& clock, const std::string& step, const std::string& output = "") {
    return lob::Scene::from_text(
        "lagrangian = \"(x'^2 + y'^2)/2 + 1/sqrt(x^2 + y^2)\"\n[coordinates]\n"
        "x = { position = 0.1, velocity = 0 }\ny = { position = 0, velocity = \"sqrt(19)\" }\n"
        "[method]\npoints = 9\n" +
        clock + "[run]\nstep = " + step + "\nuntil = \"10*pi\"\n" + output);
}

}  // namespace

TEST_CASE("a clock is a setting: the same steps as with the scene's own, and equal ones without") {
    const lob::Scene with = eccentric("clock = \"auto\"\n", "0.02"), without = eccentric("", "0.02");
    lob::RunOptions automatic, equal;
    automatic.clock = "auto";
    equal.clock = "none";
    const auto ends = [](const lob::Scene& scene, const lob::RunOptions& options) {
        const lob::Trajectory run = lob::run(scene, options);
        return std::tuple(run.steps, run.t.back(), run.q[run.q.size() - 2], run.q.back());
    };
    CHECK(ends(without, automatic) == ends(with, {}));
    CHECK(ends(with, automatic) == ends(with, {}));
    CHECK(ends(with, equal) == ends(without, {}));
    CHECK(ends(with, {}) != ends(without, {}));
    CHECK(without.derivation(automatic) == with.derivation());
    CHECK(with.derivation(equal) == without.derivation());

    // What a scene keeps counts steps without a clock, and is a time with one: the other kind of step keeps all.
    const lob::Trajectory all = lob::run(eccentric("clock = \"auto\"\n", "0.02", "[output]\nevery = 3\n"), equal);
    CHECK(all.count == static_cast<std::size_t>(all.steps) + 1);

    // The setting has the same two meanings.
    automatic.every = 0.25;
    const lob::Trajectory kept = lob::run(without, automatic);
    const lob::Trajectory as_written = lob::run(eccentric("clock = \"auto\"\n", "0.02", "[output]\nevery = 0.25\n"));
    CHECK(kept.t == as_written.t);
    CHECK(kept.q == as_written.q);
    equal.every = 0.25;
    CHECK(lobatto::test::message_of<lob::InputError>([&] {
              lob::run(without, equal);
          }).starts_with("--every: 0.25 is not a number of"));
    automatic.every = 0;
    CHECK(lobatto::test::message_of<lob::InputError>([&] { lob::run(without, automatic); }) ==
          "--every: with a clock it is the time from one kept state to the next, above 0, not 0");
}

TEST_CASE("with a clock advance_to goes to any times, and steps go on to those of the scene") {
    const lob::Scene scene = eccentric("clock = \"auto\"\n", "0.02", "[output]\nevery = 0.5\n");
    const lob::Kernel kernel = lob::compile(scene);
    const auto fresh = [&](double t) {
        lob::Stepper stepper(kernel);
        stepper.advance_to(t);
        return std::tuple(stepper.t(), stepper.q()[0], stepper.q()[1], stepper.p()[0]);
    };
    lob::Stepper stepper(kernel);
    for (const double t : {0.3, 1.0, 1.2, 1.2000001, 2.9, 2.95}) {
        CAPTURE(t);
        stepper.advance_to(t);
        CHECK(std::tuple(stepper.t(), stepper.q()[0], stepper.q()[1], stepper.p()[0]) == fresh(t));
        CHECK(stepper.t() == t);
    }
    stepper.step();
    CHECK(stepper.t() == 3);
    stepper.advance(2);
    CHECK(std::tuple(stepper.t(), stepper.q()[0], stepper.q()[1], stepper.p()[0]) == fresh(4));
    CHECK(lobatto::test::message_of<lob::InputError>([&] { stepper.advance_to(3); }).find("is at t = 4 already") !=
          std::string::npos);
}

TEST_CASE("with a clock no stop and no event is lost between the times that are asked for, and none comes early") {
    const double pi = std::acos(-1.0);
    const std::string words = "clock = \"auto\"\n";
    const lob::Kernel kernel = lob::compile(eccentric(words, "0.02", "[output]\nevery = 0.5\nevents = [\"y = 0\"]\n")),
                      stopping = lob::compile(eccentric(words, "0.02\nstop = \"y = 0 falling\"", ""));
    for (const double dt : {0.01, 0.1, 0.25, 0.7, 1.0, 100.0}) {
        CAPTURE(dt);
        lob::Stepper stepper(kernel), ends(stopping);
        std::size_t seen = 0;
        for (int i = 1; i * dt <= 18; ++i) {
            stepper.advance_to(i * dt);
            for (const lob::EventHit& hit : stepper.take_events()) {
                CHECK(hit.t == doctest::Approx(pi * static_cast<double>(++seen)).epsilon(1e-6));
                CHECK(hit.t <= stepper.t());
                CHECK(hit.t > stepper.t() - dt);
            }
        }
        if (dt < 18) CHECK(seen == 5);
        int i = 1;
        while (i < 4000 && ends.advance_to(i * dt)) ++i;
        CHECK(ends.t() == doctest::Approx(pi).epsilon(1e-6));
        CHECK(std::fabs(ends.q()[1]) < 1e-9);
    }
    // A run has the states before its stop, also those in the step of the chain that leads past it.
    const lob::Trajectory run = lob::run(eccentric(words, "0.02\nstop = \"y = 0 falling\"", "[output]\nevery = 0.1\n"));
    REQUIRE(run.count == 33);
    CHECK(run.t[31] == doctest::Approx(3.1));
    CHECK(run.t[32] == doctest::Approx(pi).epsilon(1e-6));
}

TEST_CASE("with a clock a stepper tells where its steps stopped, as a run does") {
    // A fall into the centre; and an escape before the first of the scene's times.
    for (const auto& [speed, until] : {std::pair(0.0, 10.0), {2.2, 1e5}}) {
        const lob::Scene scene = lob::Scene::from_text(
            "time = \"t\"\nlagrangian = \"(x'^2 + y'^2)/2 + (1 + 0.2*sin(t))/r\"\n[definitions]\n"
            "r = \"sqrt(x^2 + y^2)\"\n[coordinates]\nx = { position = 1, velocity = 0 }\n"
            "y = { position = 0, velocity = " +
                std::to_string(speed) +
                " }\n[method]\npoints = 8\n"
                "clock = \"r^(3/2)\"\n[run]\nstep = 0.3\nuntil = " +
                std::to_string(until) + "\n",
            "falls.toml");
        std::string of_run, of_stepper;
        try {
            lob::run(scene);
        } catch (const lob::RunFailure& failure) {
            of_run = failure.what();
        }
        lob::Stepper stepper(lob::compile(scene));
        try {
            while (stepper.step()) {
            }
        } catch (const lob::ComputationError& error) {
            of_stepper = error.what();
        }
        REQUIRE(!of_run.empty());
        const std::size_t words = of_run.find(": ", of_run.find("the run stopped"));
        CHECK(of_stepper.substr(0, words) == of_run.substr(0, words));
    }
}

TEST_CASE("tune of the library chooses a clock where that is cheaper, and a run keeps the promise with it" *
          doctest::test_suite("slowest")) {
    const lob::Scene without = eccentric("", "0.02"), with = eccentric("clock = \"auto\"\n", "0.02");
    lob::Settings each_tenth;
    each_tenth.every = 10;
    const auto settings_for = [&](const lob::Scene& scene) {
        return lob::tune(scene, 1e-8, each_tenth, 600).settings;  // ends long before, but for a busy machine
    };
    lob::RunOptions chosen;
    static_cast<lob::Settings&>(chosen) = settings_for(without);
    CHECK(chosen.clock == "auto");
    CHECK_FALSE(chosen.every);  // it would be a time now
    CHECK(lob::run(without, chosen).error.value() < 2e-8);
    CHECK(settings_for(with).clock.empty());  // its own
    lob::Settings proved;
    proved.clock = "auto";
    for (const lob::Claim& claim : lob::verify(without, proved)) {
        CAPTURE(claim.claim);
        CHECK(claim.holds);
    }
}

TEST_CASE("threads derive, compile and step at once") {
    std::vector<double> ends(4);
    std::vector<std::thread> threads;
    for (std::size_t i = 0; i < ends.size(); ++i)
        threads.emplace_back([&ends, i] {
            lob::Stepper stepper(lob::compile(lob::Scene(scenes + (i % 2 == 0 ? "pendulum.toml" : "kepler.toml"))));
            stepper.advance(100);
            ends[i] = stepper.q()[0];
        });
    for (std::thread& thread : threads) thread.join();
    CHECK(ends[0] == ends[2]);
    CHECK(ends[1] == ends[3]);
}

TEST_CASE("a scene tells its derivation and writes its integrator") {
    const lob::Scene scene(scenes + "pendulum.toml");
    CHECK(scene.derivation().find("D4") != std::string::npos);
    CHECK(scene.derivation_latex().starts_with("\\documentclass"));
    CHECK(scene.emit().first == "pendulum.hpp");
    CHECK(scene.emit_plain().second.find("namespace lobatto::plain::pendulum") != std::string::npos);
}
