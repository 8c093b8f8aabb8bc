// SPDX-License-Identifier: GPL-2.0-or-later
// Speed and accuracy of scenes with a clock, and with constraints: what is measured is the error, and promises are
// kept.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>
#include <numeric>
#include <regex>
#include <sstream>

#include "analysis/tradeoff/choice.hpp"
#include "analysis/tradeoff/method_text.hpp"
#include "generator/mechanics/constraints/impacts.hpp"
#include "generator/pipeline.hpp"
#include "runtime/error.hpp"
#include "runtime/measure/reference.hpp"
#include "tests/support.hpp"

using namespace lobatto;

namespace {

constexpr long double pi = 3.14159265358979323846264338327950288L;

Scene scene_of(const std::string& text) {
    return read_scene(Source("kinds.toml", text));
}

// From the pericentre, with the semi-axis 1: the period is 2 pi.
std::string kepler_text(double e, const std::string& method, int periods) {
    return fmt::format(
        "lagrangian = \"(x'^2 + y'^2)/2 + 1/sqrt(x^2 + y^2)\"\n[coordinates]\nx = {{ position = \"1 - e\", velocity = "
        "0 }}\ny = {{ position = 0, velocity = \"sqrt((1 + e)/(1 - e))\" }}\n[parameters]\ne = {}\n[method]\n{}\n"
        "[run]\nstep = 0.01\nuntil = \"{}*pi\"\n",
        e, method, 2 * periods);
}

// Where that planet is: x, y, x', y'.
std::vector<double> kepler_solution(long double e, long double time) {
    const long double mean = std::remainder(time, 2 * pi);
    long double E = mean < 0 ? -pi : pi;
    for (int i = 0; i < 60; ++i) E -= (E - e * std::sin(E) - mean) / (1 - e * std::cos(E));
    const long double r = 1 - e * std::cos(E), b = std::sqrt(1 - e * e);
    return {static_cast<double>(std::cos(E) - e), static_cast<double>(b * std::sin(E)),
            static_cast<double>(-std::sin(E) / r), static_cast<double>(b * std::cos(E) / r)};
}

const std::string rod =
    "lagrangian = \"(x'^2 + y'^2)/2 - y\"\n[coordinates]\nx = { position = \"sin(1.2)\", velocity = 0 }\n"
    "y = { position = \"-cos(1.2)\", velocity = 0 }\n[constraints]\nrod = \"x^2 + y^2 = 1\"\n[method]\npoints = 5\n"
    "[run]\nstep = 0.1\nuntil = 20\n";

struct Row {
    double time;
    std::vector<double> state;  // positions, momenta
};
std::vector<Row> rows_of(const std::string& path, std::size_t count) {
    std::ifstream file(path);
    std::vector<Row> rows;
    for (std::string line; std::getline(file, line);) {
        std::stringstream cells(line);
        std::vector<double> values;
        for (std::string cell; std::getline(cells, cell, ',');) {
            char* end = nullptr;
            const double value = std::strtod(cell.c_str(), &end);
            if (end != cell.c_str()) values.push_back(value);
        }
        if (values.size() > count) rows.push_back({values[0], {values.begin() + 1, values.begin() + 1 + count}});
    }
    return rows;
}

}  // namespace

TEST_CASE("a kernel builder allows what the scene and lobatto run do") {
    const auto member = [](Family family, int points, StepClock clock) {
        return Member{family, points, Precision::double_, StepArithmetic::plain, clock};
    };
    const Scene orbiting = scene_of(kepler_text(0.5, "points = 5", 1));
    const KernelBuilder orbit(orbiting, orbiting, true);
    CHECK(orbit.allows(member(Family::gauss, 4, StepClock::automatic)));
    CHECK(orbit.allows(member(Family::splitting, 11, StepClock::none)));
    CHECK_FALSE(orbit.allows(member(Family::splitting, 11, StepClock::automatic)));
    CHECK_FALSE(orbit.allows(member(Family::gauss, 4, StepClock::of_scene)));
    CHECK_FALSE(
        orbit.allows({Family::lobatto, 8, Precision::double_double, StepArithmetic::plain, StepClock::automatic}));
    CHECK_FALSE(KernelBuilder(orbiting, orbiting, false).allows(member(Family::gauss, 4, StepClock::automatic)));

    const Scene clocked = scene_of(kepler_text(0.5, "points = 5\nclock = \"sqrt(x^2 + y^2)\"", 1));
    const KernelBuilder all(clocked, clocked, true), own(clocked, clocked, false);
    for (const StepClock clock : {StepClock::none, StepClock::automatic, StepClock::of_scene}) {
        CHECK(all.allows(member(Family::lobatto, 8, clock)));
        CHECK(own.allows(member(Family::lobatto, 8, clock)) == (clock == StepClock::of_scene));
    }

    const Scene tied = scene_of(rod);
    const KernelBuilder constrained(tied, tied, true);
    CHECK(constrained.allows(member(Family::lobatto, 8, StepClock::none)));
    CHECK_FALSE(constrained.allows(member(Family::gauss, 8, StepClock::none)));
    CHECK(constrained.clocks().empty());
}

TEST_CASE("other values of the parameters decide where those of the scene allow no start") {
    std::string text = rod;
    text.replace(text.find("= 1\"\n"), 4, "= l^2\"");
    const auto of_length = [&](const char* l) { return scene_of(text + "[parameters]\nl = " + l + "\n"); };
    const KernelBuilder kernels(of_length("2"), of_length("1"), true);
    CHECK(kernels.allows({Family::lobatto, 8, Precision::double_, StepArithmetic::plain, StepClock::none}));
    CHECK_THROWS_AS(KernelBuilder(of_length("2"), of_length("1.5"), true), InputError);
}

TEST_CASE("errors with a clock are those at given times, and at the steps themselves, against Kepler's solution" *
          doctest::test_suite("slow")) {
    const test::TemporaryFolder folder;
    const Scene scene = scene_of(kepler_text(0.9, "points = 5\nclock = \"(x^2 + y^2)^(3/4)\"", 2));
    ExperimentRequest wish;
    wish.seconds = 3600;
    wish.wanted = 1e-11;
    Experiment experiment(scene, scene, wish);
    for (const StepClock clock : {StepClock::automatic, StepClock::of_scene}) {
        const Candidate candidate{{Family::gauss, 5, Precision::double_, StepArithmetic::plain, clock}, 30, 0};
        const Measurement m = experiment.measure(candidate);
        CAPTURE(word_of(clock));
        REQUIRE(m.complete);
        CHECK(m.step == doctest::Approx(experiment.span(clock) / 30));
        CHECK(m.energy_error < 1e-4);
        CHECK(m.defect < 1e-13);
        // A run of the same step, and its error at the end, which is the start again.
        const Kernel kernel = experiment.kernel_builder().kernel(candidate.member);
        const ExactStart exact(scene);
        const StartIn<double> start = start_in<double>(exact, kernel, m.step);
        LoadedStepper<double> stepper(kernel);
        REQUIRE(stepper.prepare(start.parameters, m.step) == LOBATTO_OK);
        REQUIRE(stepper.start(0, start.q, start.p) == LOBATTO_OK);
        lobatto_advance call{};
        std::vector<double> records(5 * 100);
        call.steps = call.record_every = call.chain_records = 1;
        call.records = records.data();
        call.capacity = 100;
        call.interval = call.end = experiment.until();
        REQUIRE(stepper.advance(call) == LOBATTO_OK);
        CHECK(call.chain_steps > 25);
        CHECK(call.chain_steps < 36);
        double worst = 0, at_end = 0;
        for (std::int64_t row = 0; row < call.records_written; ++row) {
            const double* const state = records.data() + row * 5;
            const std::vector<double> solution = kepler_solution(0.9L, state[0]);
            at_end = 0;
            for (std::size_t k = 0; k < 4; ++k)
                at_end = std::fmax(at_end, std::fabs(state[1 + k] - solution[k]) / experiment.reference().scale[k]);
            worst = std::fmax(worst, at_end);
        }
        CHECK(m.error_end == doctest::Approx(at_end).epsilon(1e-3));
        CHECK(experiment.measurer().error_on_steps(kernel, candidate) == doctest::Approx(worst).epsilon(1e-3));
        CHECK(worst > 1e-9);  // it can be told from rounding
    }
}

TEST_CASE("with constraints the reference is the motion, and errors are those against the pendulum's exact solution") {
    const Scene scene = scene_of(rod);
    ExperimentRequest wish;
    wish.seconds = 3600;
    wish.wanted = 1e-13;
    Experiment experiment(scene, scene, wish);
    const Reference& reference = experiment.reference();
    CHECK(reference.disagreement.back() < 1e-13);
    const auto exact_at = [](double time) {
        const PhasePoint point = pendulum_solution(1, 1.2L, 0, time);
        const double s = static_cast<double>(std::sin(point.q)), c = static_cast<double>(std::cos(point.q)),
                     v = static_cast<double>(point.velocity);
        return std::vector<double>{s, -c, v * c, v * s};
    };
    double apart = 0;
    for (int i = 0; i <= reference.samples; ++i) {
        const std::vector<double> exact = exact_at(reference.time(i));
        for (std::size_t k = 0; k < 4; ++k)
            apart = std::fmax(apart, std::fabs(reference.high[static_cast<std::size_t>(i) * 4 + k] - exact[k]));
    }
    CHECK(apart < 1e-13);
    const Measurement m = experiment.measure({{Family::lobatto, 4}, 200, 0});
    REQUIRE(m.complete);
    const Kernel kernel = experiment.kernel_builder().kernel({Family::lobatto, 4});
    const StartIn<double> start = start_in<double>(ExactStart(scene), kernel, 0.1);
    LoadedStepper<double> stepper(kernel);
    REQUIRE(stepper.prepare(start.parameters, 0.1) == LOBATTO_OK);
    REQUIRE(stepper.start(0, start.q, start.p) == LOBATTO_OK);
    lobatto_advance call{};
    call.steps = 200;
    REQUIRE(stepper.advance(call) == LOBATTO_OK);
    double time = 0, error = 0;
    std::vector<double> q, p;
    stepper.state(time, q, p);
    q.insert(q.end(), p.begin(), p.end());
    const std::vector<double> exact = exact_at(20);
    for (std::size_t k = 0; k < 4; ++k) error = std::fmax(error, std::fabs(q[k] - exact[k]) / reference.scale[k]);
    CHECK(m.error_end == doctest::Approx(error).epsilon(1e-6));
    CHECK(error > 1e-10);
}

TEST_CASE("with walls errors are those of positions, against |cos t| of a spring that a wall throws back") {
    const std::string spring =
        "lagrangian = \"(x'^2 - x^2)/2\"\n[coordinates]\nx = { position = 1, velocity = 0 }\n[impacts]\n"
        "wall = { when = \"x = 0 falling\"";
    const std::string rest = " }\n[method]\npoints = 5\n[run]\nstep = 0.1\nuntil = 10\n";
    const Scene scene = scene_of(spring + rest);
    ExperimentRequest wish;
    wish.seconds = 3600;
    wish.wanted = 1e-14;
    Experiment experiment(scene, scene, wish);
    const Reference& reference = experiment.reference();
    CHECK(reference.disagreement.back() < 1e-14);
    for (int i = 0; i <= reference.samples; ++i)
        CHECK(std::fabs(reference.high[static_cast<std::size_t>(i) * 2] - std::fabs(std::cos(reference.time(i)))) <
              1e-13);
    const Candidate candidate{{Family::lobatto, 3}, 60, 0};
    const Measurement m = experiment.measure(candidate);
    REQUIRE(m.complete);
    const Kernel kernel = experiment.kernel_builder().kernel(candidate.member);
    const StartIn<double> start = start_in<double>(ExactStart(scene), kernel, m.step);
    LoadedStepper<double> stepper(kernel);
    REQUIRE(stepper.prepare(start.parameters, m.step) == LOBATTO_OK);
    REQUIRE(stepper.start(0, start.q, start.p) == LOBATTO_OK);
    double worst = 0, error = 0, time = 0;
    std::vector<double> q, p;
    for (int step = 0; step < 60; ++step) {
        lobatto_advance call{};
        call.steps = 1;
        REQUIRE(stepper.advance(call) == LOBATTO_OK);
        stepper.state(time, q, p);
        error = std::fabs(q[0] - std::fabs(std::cos(time))) / reference.scale[0];
        worst = std::fmax(worst, error);
    }
    CHECK(m.error_end == doctest::Approx(error).epsilon(1e-6));
    CHECK(experiment.measurer().error_on_steps(kernel, candidate) == doctest::Approx(worst).epsilon(1e-6));
    CHECK(error > 1e-9);
    CHECK(test::message_of<InputError>([&] {
              refuse_jumps(scene_of(spring + ", reset = { x = \"x + 1\" }" + rest), "tune");
          }).find("tune compares positions along the motion, and the wall wall moves x") != std::string::npos);
}

TEST_CASE("the unit of a conserved momentum makes no difference to an error") {
    const auto error_with = [](const std::string& mass) {
        const Scene scene = scene_of(
            "lagrangian = \"m*(r'^2 + r^2*a'^2)/2 - m*2*(r - 1)^2\"\n[coordinates]\nr = { position = 1.3, velocity = 0 "
            "}\na = { position = 0, velocity = 0.5 }\n[parameters]\nm = " +
            mass + "\n[run]\nstep = 0.05\nuntil = 10\n");
        ExperimentRequest wish;
        wish.seconds = 3600;
        wish.wanted = 1e-11;
        Experiment experiment(scene, scene, wish);
        return experiment.measure({{Family::lobatto, 6, Precision::double_}, 12, 0}, false).error;
    };
    const double error = error_with("1");
    CHECK(error > 1e-9);
    CHECK(error < 1e-4);
    CHECK(error_with("3e20") == doctest::Approx(error).epsilon(1e-3));
}

TEST_CASE("a clock that tells no times apart is not tried") {
    const Scene scene = scene_of(kepler_text(0.05, "points = 5", 1));
    ExperimentRequest wish;
    wish.seconds = 3600;
    Experiment experiment(scene, scene, wish);
    CHECK(experiment.kernel_builder().clocks().empty());
}

TEST_CASE("a clock is written into a scene, unless its states would be kept at other times") {
    const std::string text = kepler_text(0.9, "points = 5", 1);
    Choice choice;
    choice.measurement.candidate = {
        {Family::gauss, 6, Precision::double_, StepArithmetic::plain, StepClock::automatic}, 30, 1e-9};
    choice.measurement.step = 0.0125;
    choice.until = 2 * static_cast<double>(pi);
    choice.clock = "auto";
    const test::TemporaryFolder folder;
    const std::string path = folder / "orbit.toml";
    test::write_text(path, text);
    write_method(choice, read_scene(path), 1e-6, false);
    const Scene back = read_scene(path);
    REQUIRE(back.clock);
    CHECK(back.clock->is_automatic);
    CHECK(back.evaluate(back.run.step, "step").to_double() == 0.0125);
    CHECK(with_choice(test::read_file(path), choice, 1e-6, false) == test::read_file(path));
    choice.clock.clear();
    choice.measurement.candidate.member.clock = StepClock::none;
    write_method(choice, back, 1e-6, false);
    CHECK_FALSE(read_scene(path).clock);
    const auto refusal = [&](const Scene& scene) {
        return test::message_of<InputError>([&] { write_method(choice, scene, 1e-6, false); });
    };
    // What was written into the file since it was read stays, and so does who may read it.
    const Scene early = read_scene(path);
    const std::string edited = test::read_file(path) + "# edited\n";
    test::write_text(path, edited);
    CHECK(refusal(early).find("the file has changed since it was read, so nothing is written") != std::string::npos);
    CHECK(test::read_file(path) == edited);
    using std::filesystem::perms;
    std::filesystem::permissions(path, perms::owner_read | perms::owner_write);
    test::write_text(path, "\xEF\xBB\xBF" + edited);
    CHECK(refusal(read_scene(path)).empty());
    CHECK(test::read_file(path).starts_with("\xEF\xBB\xBFlagrangian"));
    CHECK(std::filesystem::status(path).permissions() == (perms::owner_read | perms::owner_write));
    // A layout that cannot be written into is not blamed for what would come of it.
    std::string step = text;
    step.replace(step.find("step = "), 7, "step = \"\"\"\n0.1\"\"\" # ");
    test::write_text(path, step);
    CHECK(refusal(read_scene(path)).find("laid out unusually; copy the lines above") != std::string::npos);
    choice.clock = "auto";
    test::write_text(path, text + "[output]\nevery = 10\n");
    CHECK(test::message_of<InputError>([&] {
              write_method(choice, read_scene(path), 1e-6, false);
          }).find("`every` or `dense` in [output] mean something else there") != std::string::npos);
    CHECK(test::read_file(path) == text + "[output]\nevery = 10\n");
}

TEST_SUITE("slow") {
    TEST_CASE("tune takes a clock where time scales vary, and keeps its promise against Kepler's solution" *
              doctest::test_suite("slowest")) {
        const test::TemporaryFolder folder;
        const std::string path = folder / "orbit.toml";
        test::write_text(path, kepler_text(0.9, "points = 5", 10));
        const test::Finished tuned =
            test::run({LOBATTO_PROGRAM, "tune", path, "--error", "1e-9", "--budget", "1h", "--write"});
        CAPTURE(tuned.out);
        CAPTURE(tuned.err);
        REQUIRE(tuned.exit_code == 0);
        CHECK(tuned.out.find("clock = \"auto\"") != std::string::npos);
        const test::Finished ran = test::run({LOBATTO_PROGRAM, "run", path, "-o", folder / "run.csv"});
        REQUIRE(ran.exit_code == 0);
        const std::vector<Row> rows = rows_of(folder / "run.csv", 4);
        REQUIRE(rows.size() > 50);
        double worst = 0;
        const std::vector<double> amplitude = {1, 1, 2.294, 2.294};
        for (const Row& row : rows) {
            const std::vector<double> exact = kepler_solution(0.9L, row.time);
            for (std::size_t k = 0; k < 4; ++k)
                worst = std::fmax(worst, std::fabs(row.state[k] - exact[k]) / amplitude[k]);
        }
        CHECK(worst <= 1e-9);
        CHECK(worst > 1e-13);
    }

    TEST_CASE("tune keeps its promise on a rod pendulum, against the exact elliptic solution") {
        const test::TemporaryFolder folder;
        const std::string path = folder / "rod.toml";
        test::write_text(path, rod);
        const test::Finished tuned =
            test::run({LOBATTO_PROGRAM, "tune", path, "--error", "1e-8", "--budget", "1h", "--write"});
        CAPTURE(tuned.out);
        CAPTURE(tuned.err);
        REQUIRE(tuned.exit_code == 0);
        REQUIRE(test::run({LOBATTO_PROGRAM, "run", path, "-o", folder / "run.csv"}).exit_code == 0);
        const std::vector<Row> rows = rows_of(folder / "run.csv", 2);
        REQUIRE(rows.size() > 20);
        double worst = 0;
        for (const Row& row : rows) {
            const PhasePoint exact = pendulum_solution(1, 1.2L, 0, row.time);
            const double x = row.state[0] - static_cast<double>(std::sin(exact.q)),
                         y = row.state[1] + static_cast<double>(std::cos(exact.q));
            worst = std::fmax(worst, std::fmax(std::fabs(x), std::fabs(y)) / std::sin(1.2));
        }
        CHECK(worst <= 1e-8);
        CHECK(worst > 1e-12);
    }
}
