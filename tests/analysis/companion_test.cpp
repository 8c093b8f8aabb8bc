// SPDX-License-Identifier: GPL-2.0-or-later
// The measured error of a run: near the true one, and never silent where nothing of the motion is left.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "analysis/accuracy/companion/companion.hpp"
#include "analysis/kernel/kernel_of.hpp"
#include "analysis/motion.hpp"
#include "generator/pipeline.hpp"
#include "tests/analysis/measured_scene.hpp"

using namespace lobatto;
using test::absolute_error, test::MeasuredScene, test::timed_scene;

namespace {

const std::string four = "points = 4", gauss_4 = "family = \"gauss\"\nstages = 4",
                  swinging = "q = { position = 1, velocity = 0 }";

}  // namespace

TEST_CASE("where the step decides the error, the measured one is the true one to a tenth, by any method") {
    // Against the same motion with a step that leaves rounding alone.
    const std::string lagrangian = "x'^2/2 + y'^2/2 - (x^2 + y^2)/2 - x^2*y + y^3/3";
    const std::string coordinates = "x = { position = 0.3, velocity = 0.1 }\ny = { position = 0.1, velocity = 0.3 }";
    const MeasuredScene exact(timed_scene(lagrangian, coordinates, "points = 10", 0.02, 20));
    REQUIRE(exact.run().exit_code == 0);
    const std::vector<double> truth = exact.end();
    struct Row {
        std::string method;
        double step;
    };
    for (const Row& row :
         {Row{"points = 2", 0.02}, Row{"points = 4", 0.2}, Row{"points = 4", 0.5}, Row{"points = 6", 1},
          Row{"family = \"gauss\"\nstages = 2", 0.2}, Row{"family = \"splitting\"\nstages = 11", 0.4}}) {
        const MeasuredScene place(timed_scene(lagrangian, coordinates, row.method, row.step, 20));
        const test::Finished done = place.run();
        CAPTURE(row.method);
        CAPTURE(row.step);
        REQUIRE(done.exit_code == 0);
        const std::vector<double> end = place.end();
        const double error = std::fmax(std::fabs(end[1] - truth[1]), std::fabs(end[2] - truth[2]));
        // Within 2.3 %, the rounding of two digits included. With order 6 in place of 2 Lobatto 2 errs by 29 %.
        CHECK(absolute_error(done.out) > error * 0.9);
        CHECK(absolute_error(done.out) < error * 1.1);
    }
}

TEST_CASE("where rounding decides the error, a companion in finer numbers measures it, and one in double does not") {
    const std::string lagrangian = "x'^2/2 + y'^2/2 - (x^2 + y^2)/2 - x^2*y + y^3/3";
    const std::string coordinates = "x = { position = 0.3, velocity = 0.1 }\ny = { position = 0.1, velocity = 0.3 }";
    const MeasuredScene exact(
        timed_scene(lagrangian, coordinates, "points = 10\nnumbers = \"double-double\"", 0.05, 100));
    REQUIRE(exact.run({"--unmeasured"}).exit_code == 0);
    const std::vector<double> truth = exact.end();
    double worst_finer = 0, worst_double = 0;  // powers of ten between the printed and the true error
    for (const double step : {0.08, 0.05, 0.04, 0.032, 0.025, 0.02, 0.016, 0.0125}) {
        const MeasuredScene place(timed_scene(lagrangian, coordinates, "points = 8", step, 100));
        CAPTURE(step);
        const test::Finished in_double = place.run(), finer = place.run({"--companion", "double-double"});
        REQUIRE(finer.exit_code == 0);
        const std::vector<double> end = place.end();
        const double error = std::fmax(std::fabs(end[1] - truth[1]), std::fabs(end[2] - truth[2]));
        CHECK(error > 1e-16);
        CHECK(error < 1e-12);
        worst_finer = std::fmax(worst_finer, std::fabs(std::log10(absolute_error(finer.out) / error)));
        worst_double = std::fmax(worst_double, std::fabs(std::log10(absolute_error(in_double.out) / error)));
    }
    CHECK(worst_finer < std::log10(1.25));  // the end of the truth is rounded to double, too
    CHECK(worst_double > std::log10(1.25));
}

TEST_CASE("steps of a companion that looks for narrow terms keep all digits of its numbers") {
    // Defect once: they were those of double, so that it ended 1e-16 of the time beside the run. Printed were 1.2e-14
    // for an error of 6e-27, and with a finer companion 7e-15 for one of 6.4e-14.
    const std::string lagrangian = "x'^2/2 - exp(x) - exp(-x)", start = "x = { position = 0.75, velocity = 0 }";
    const MeasuredScene finest(timed_scene(lagrangian, start, "points = 12\nnumbers = \"double-double\"", 0.05, 400));
    REQUIRE(finest.run({"--unmeasured"}).exit_code == 0);
    const double truth = finest.end()[1];
    const MeasuredScene fine(timed_scene(lagrangian, start, "points = 10\nnumbers = \"double-double\"", 0.1, 400));
    CHECK(absolute_error(fine.run().out) < 1e-26);

    const MeasuredScene rough(timed_scene(lagrangian, start, "points = 10", 0.125, 400));
    const std::string table = rough.run({"--companion", "double-double"}).out;
    const double error = std::fabs(rough.end()[1] - truth);
    CHECK(error > 1e-14);
    CHECK(absolute_error(table) == doctest::Approx(error).epsilon(0.1));
}

TEST_CASE("what the tolerance leaves of the equations of a step is measured, too") {
    const std::string lagrangian = "3*x'^2/4 + 0.35*x'*a'*cos(a) + 0.1225*a'^2 + 3.4335*cos(a)",
                      coordinates = "x = { position = 0, velocity = 0 }\na = { position = 2, velocity = 0 }";
    const MeasuredScene exact(timed_scene(lagrangian, coordinates, "points = 12", 0.0125, 60));
    REQUIRE(exact.run({"--unmeasured"}).exit_code == 0);
    const std::vector<double> truth = exact.end();
    struct Row {
        std::string method, tolerance;
        double step;
    };
    // With a companion of the same tolerance the last three errors were printed 12 to 30 times too small.
    for (const Row& row : {Row{"points = 6", "1e-4", 0.05}, Row{"family = \"gauss\"\nstages = 6", "1e-5", 0.04},
                           Row{"points = 8", "1e-5", 0.06}, Row{"points = 8", "1e-5", 0.05}}) {
        const MeasuredScene place(
            timed_scene(lagrangian, coordinates, row.method + "\ntolerance = " + row.tolerance, row.step, 60));
        const test::Finished done = place.run();
        CAPTURE(done.out);
        REQUIRE(done.exit_code == 0);
        const std::vector<double> end = place.end();
        const double of_x = std::fabs(end[1] - truth[1]), of_a = std::fabs(end[2] - truth[2]),
                     printed = absolute_error(done.out);
        const bool is_near_x =
            printed > of_x / 1.3 && printed<of_x * 1.3, is_near_a = printed> of_a / 1.3 && printed < of_a * 1.3;
        CHECK((is_near_x || is_near_a));  // in the coordinate where it is largest, relative to the amplitude
    }
}

TEST_CASE("a force that looks constant at the nodes of steps and of halves of them is told") {
    struct Row {
        std::string method;
        int frequency;
    };
    for (const Row& row : {Row{"points = 2", 520}, Row{"points = 3", 520}, Row{"points = 4", 470},
                           Row{"family = \"gauss\"\nstages = 1", 520}}) {
        test::TemporaryFolder folder;
        test::write_text(folder / "scene.toml",
                         timed_scene("x'^2/2 - x^2/2", "x = { position = 0.1, velocity = 0 }", row.method, 0.1, 20,
                                     fmt::format("[forces]\nx = \"cos(2*pi*{}*t)\"\n", row.frequency)));
        const test::Finished done =
            test::run({LOBATTO_PROGRAM, "run", folder / "scene.toml", "-o", folder / "run.csv", "--quiet"});
        INFO(row.method << done.out << done.err);
        CHECK(done.err.find("the motion is not resolved") != std::string::npos);
    }
}

TEST_CASE("a companion in numbers that it cannot have is refused") {
    const MeasuredScene place(timed_scene("q'^2/2 - q^2/2", swinging, four, 0.1, 10));
    const auto refusal = [&](std::vector<std::string> options) {
        const test::Finished done = place.run(std::move(options));
        CHECK(done.exit_code == 2);
        return done.err;
    };
    CHECK(refusal({"--companion", "decimal"}).find("--companion: unknown numbers; there are \"float\"") !=
          std::string::npos);
    CHECK(refusal({"--companion", "double"}).find("needs finer numbers, such as double-double") != std::string::npos);
    CHECK(refusal({"--companion", "double-double", "--unmeasured"}).find("leave one of the two out") !=
          std::string::npos);
    CHECK(refusal({"--companion", "quadruple", "--splitting", "11"}).find("known to 15 digits, too few") !=
          std::string::npos);
    const MeasuredScene comet(timed_scene("q'^2/2 + r'^2/2 + 1/sqrt(q^2 + r^2)",
                                          "q = { position = 1, velocity = 0 }\nr = { position = 0, velocity = 0.5 }",
                                          "points = 4\nclock = \"auto\"", 0.1, 1));
    CHECK(comet.run({"--companion", "double-double"}).err.find("with a clock the companion has the numbers of the") !=
          std::string::npos);
    // In clean arithmetic, which finer numbers do not need.
    CHECK(place.run({"--companion", "double-double", "--arithmetic", "clean"}).exit_code == 0);
}

TEST_CASE("two motions that diverged and meet again by chance are not taken for the same") {
    // The true motion has made a turn less at the end; the companion's is where the run's is, to 2e-5.
    const MeasuredScene place(timed_scene("x'^2/2 + cos(x)",
                                          "x = { position = 3.1415926535905676, velocity = 4.3581281856073072e-10 }",
                                          "points = 9", 0.20696647360042109, 88.788617174580651));
    const test::Finished done = place.run();
    INFO(done.out << done.err);
    CHECK(done.exit_code == 3);
    // Off by a third of the amplitude at the end, where the companion is within a hundredth of the run.
    const MeasuredScene near(timed_scene("x'^2/2 - 0.81795*x^2 - 0.9506*exp(-x^4) + x*cos(1.1811*t)",
                                         "x = { position = 0.2975, velocity = 0.468 }",
                                         "family = \"gauss\"\nstages = 3", 1.1040786199020731, 308.03793495267843));
    const test::Finished warned = near.run();
    INFO(warned.out << warned.err);
    const bool is_lost = warned.exit_code == 3, is_warned = warned.err.find("of the amplitude") != std::string::npos;
    CHECK((is_lost || is_warned));
    // What is largest is not called the error at the end.
    const MeasuredScene drifting(
        "lagrangian = \"x'^2/2 + y'^2 - x^4/4 - x^2*y^2 - y^2/2\"\n[coordinates]\nx = { position = 0.8, "
        "velocity = 0.3 }\ny = { position = -0.2, velocity = 0.5 }\n[method]\npoints = 2\n[run]\n"
        "step = 0.1\nuntil = 400\n");
    CHECK(drifting.run().out.find("6.7e-01 of the amplitude at most (6.0e-01 in x)") != std::string::npos);
}

TEST_CASE("regular motions whose errors jump, and motions at rest, are neither exponential nor lost") {
    const auto kepler = [](const std::string& e, const std::string& until) {
        return MeasuredScene("lagrangian = \"(x'^2 + y'^2)/2 + 1/sqrt(x^2 + y^2)\"\n[parameters]\ne = " + e +
                             "\n[coordinates]\nx = { position = \"1 - e\", velocity = 0 }\n"
                             "y = { position = 0, velocity = \"sqrt((1 + e)/(1 - e))\" }\n[method]\npoints = 9\n"
                             "clock = \"auto\"\n[run]\nstep = \"0.7*(1 - e)^(3/2)\"\nuntil = \"" +
                             until + "\"\n");
    };
    // Defect once: errors were said to double every 1.8 of 10 pi, and every 7.2 of 40 pi.
    for (const std::string until : {"2*pi", "10*pi", "40*pi"})
        CHECK(kepler("0.99", until).run().out.find("double every") == std::string::npos);
    // Defect once: exit code 3, because p_x turns within 1e-8 of the time.
    CHECK(kepler("0.99999", "20*pi").run().exit_code == 0);
    // Defect once: likewise at rest at L4, a stable equilibrium, after roundings had added up to 1e-12.
    const test::Finished resting =
        MeasuredScene(
            "lagrangian = \"(x'^2 + y'^2)/2 + x*y' - y*x' + (x^2 + y^2)/2 + (1 - mu)/r1 + mu/r2\"\n"
            "definitions = { r1 = \"sqrt((x + mu)^2 + y^2)\", r2 = \"sqrt((x - 1 + mu)^2 + y^2)\" }\n[parameters]\n"
            "mu = 0.01\n[coordinates]\nx = { position = \"0.5 - mu\", velocity = 0 }\n"
            "y = { position = \"sqrt(3)/2\", velocity = 0 }\n[method]\npoints = 8\n[run]\nstep = 0.1\nuntil = 3000\n")
            .run();
    CHECK(resting.exit_code == 0);
    CHECK(resting.out.find("measured error          0.0e+00 of the amplitude at the end") != std::string::npos);
    // What is chaotic is told all the same.
    const test::TemporaryFolder folder;
    const test::Finished chaotic = test::run({LOBATTO_PROGRAM, "run", LOBATTO_SOURCE_DIR "/scenes/double_pendulum.toml",
                                              "--until", "60", "-o", folder / "run.csv"});
    CHECK(chaotic.out.find("errors double every 2.") != std::string::npos);
}

TEST_CASE("a run of which nothing is left returns 3 and says so, also when it is quiet") {
    struct Row {
        std::string lagrangian, coordinates, method;
        double step, until;
    };
    const std::vector<Row> rows = {
        {"q'^2/2 + cos(q)", "q = { position = 3.1415926, velocity = 0 }", gauss_4, 0.1, 1000},
        {"q'^2/2 + cos(q)", "q = { position = \\\"pi\\\", velocity = 0 }", gauss_4, 0.1, 1000},
        {"x'^2/2 + x^2/2 - x^4/4", "x = { position = 1e-9, velocity = 0 }", gauss_4, 0.1, 1000},
        {"q'^2/2 - q^4/4 + q*cos(t^2)", swinging, four, 0.1, 60},
        {"x'^2/2 + y'^2/2 + 1/sqrt(x^2 + y^2)",
         "x = { position = 0.1, velocity = 0 }\ny = { position = 0, velocity = 4.3588989435 }", four, 0.02, 60}};
    for (const Row& row : rows) {
        std::string coordinates = row.coordinates;
        while (coordinates.find('\\') != std::string::npos) coordinates.erase(coordinates.find('\\'), 1);
        const MeasuredScene place(timed_scene(row.lagrangian, coordinates, row.method, row.step, row.until));
        CAPTURE(row.lagrangian);
        CAPTURE(coordinates);
        const test::Finished quiet = place.run({"--quiet"});
        CHECK(quiet.exit_code == 3);
        CHECK(quiet.out == "");
        CHECK(quiet.err.find("the run is no longer accurate after t = ") != std::string::npos);
        CHECK(place.run({"--quiet", "--unmeasured"}).exit_code == 0);
        const test::Finished accepted = place.run({"--beyond-horizon"});
        CHECK(accepted.exit_code == 0);
        CHECK(accepted.out.find("as large as the motion itself from t = ") != std::string::npos);
    }
    // Asked for by the scene; and the same motion where it still is one.
    const std::string top = "q = { position = 3.1415926, velocity = 0 }";
    CHECK(MeasuredScene(timed_scene("q'^2/2 + cos(q)", top, gauss_4, 0.1, 1000, "beyond_horizon = true\n"))
              .run()
              .exit_code == 0);
    CHECK(MeasuredScene(timed_scene("q'^2/2 + cos(q)", top, gauss_4, 0.1, 50)).run().exit_code == 0);
}

TEST_CASE("what a pulse between the nodes does is measured") {
    struct Row {
        const char* lagrangian;
        double fine;  // a step that sees the pulse
    };
    for (const Row& row : {Row{"q'^2/2 - q^2/2 + 100*q*exp(-((t - 5.03)/0.001)^2)", 0.0005},
                           Row{"q'^2/2 - q^2/2 + 30*q/(1 + ((t - 5.03)/0.003)^2)", 0.0005},
                           Row{"q'^2/2 - q^2/2 + 100*q/cosh((t - 7.77)/0.0002)", 0.00005},
                           Row{"q'^2/2 - q^2/2*(1 + 1e4*exp(-((t - 5.03)/0.0003)^2))", 0.0001},
                           Row{"q'^2/2 - q^2/2 + q*exp(-sin(t)^2/1e-4)", 0.001},
                           Row{"q'^2/2 - q^2/2 + 100*q*exp(-((t - 5.03)/0.001)^4)", 0.0005},
                           Row{"q'^2/2 - q^2/2 + 20*q*cos(t - 1.645)^64*(0.5 + 0.5*cos(16*(t - 1.645)))^60"
                               "*(0.5 + 0.5*cos(128*(t - 1.645)))^40",
                               0.0005},
                           Row{"q'^2/2 - q^2/2 + 100*q*2^(-((t - 5.03)/0.001)^2)", 0.0005},
                           Row{"q'^2/2 - q^2/2 + 100*q*(2 + sin(t))^(-((t - 5.03)/0.001)^2)", 0.0005},
                           Row{"q'^2/2 - q^2/2 + 100*q*exp(-((t - 5.03 - q/100)/0.001)^2)", 0.0005},
                           Row{"q'^2/2 - q^2/2 + 100*q*10^(-((t - 5.03 - q/100)/0.001)^2)", 0.0005},
                           Row{"q'^2/2 - q^2/2 + 100*sin(q)*exp(-((t - 5.03)/0.001)^2*(1 + q^2))", 0.0005}}) {
        CAPTURE(row.lagrangian);
        const MeasuredScene coarse(timed_scene(row.lagrangian, swinging, four, 0.1, 10)),
            fine(timed_scene(row.lagrangian, swinging, four, row.fine, 10));
        const test::Finished done = coarse.run({"--beyond-horizon"});
        REQUIRE(done.exit_code == 0);
        REQUIRE(fine.run({"--every", "100"}).exit_code == 0);
        const double error = std::fabs(coarse.end()[1] - fine.end()[1]);
        if (done.out.find("as large as the motion") != std::string::npos) continue;
        // Within 2.3 %, the rounding of two digits included. With order 6 in place of 2 Lobatto 2 errs by 29 %.
        CHECK(absolute_error(done.out) > error * 0.9);
        CHECK(absolute_error(done.out) < error * 1.1);
    }
}

TEST_CASE("a power whose base has no logarithm is no pulse, and ends no sweep") {
    const MeasuredScene scene(
        timed_scene("q'^2/2 - q^2/2 + q*c^(2*t)", swinging, four, 0.1, 4, "[parameters]\nc = 1\n"));
    const test::Finished done = test::run(
        {LOBATTO_PROGRAM, "sweep", scene.folder / "scene.toml", "--vary", "c=0,0.5", "-o", scene.folder / "table.csv"});
    CHECK(done.exit_code == 3);
    CHECK(test::contains(done.err, "1 of 2 trajectories failed: 1 a formula has no value there"));  // 0^(2 t)
}

TEST_CASE("the error of a contact is measured wherever it falls within a step") {
    int far = 0;
    for (int i = 0; i < 12; ++i) {
        const std::string start = fmt::format("q = {{ position = {}, velocity = -0.19 }}", 0.5 + i * 0.043),
                          lagrangian = "q'^2/2 - q^2/2 - 0.4*max(-q, 0)^2.5", six = "family = \"gauss\"\nstages = 6";
        const MeasuredScene coarse(timed_scene(lagrangian, start, six, 0.1, 3)),
            fine(timed_scene(lagrangian, start, six, 0.003125, 3));
        const test::Finished done = coarse.run({});
        REQUIRE(done.exit_code == 0);
        REQUIRE(fine.run({"--every", "1000", "--unmeasured"}).exit_code == 0);
        const double error = std::fabs(coarse.end()[1] - fine.end()[1]), printed = absolute_error(done.out);
        CAPTURE(error);
        CAPTURE(printed);
        CHECK((error < 1e-13 || printed > error / 4));  // before: 1/6000 in a third of all
        far += error > 1e-11;
    }
    CHECK(far > 6);
}

TEST_CASE("a switch that the time passes twice within a step is measured") {
    for (const char* condition : {"(t - 3.301)^2 < 1e-6", "tanh((t - 3.301)^2) < 1e-6"}) {
        CAPTURE(condition);
        const std::string lagrangian = fmt::format("q'^2/2 - q^2/2 + q*if({}, 100, 0)", condition);
        const MeasuredScene coarse(timed_scene(lagrangian, swinging, "points = 8", 0.2, 20)),
            fine(timed_scene(lagrangian, swinging, "points = 8", 0.001, 20));
        const test::Finished done = coarse.run({"--beyond-horizon"});
        REQUIRE(done.exit_code == 0);
        REQUIRE(fine.run({"--every", "100", "--unmeasured"}).exit_code == 0);
        const double error = std::fabs(coarse.end()[1] - fine.end()[1]);
        CHECK(error > 0.01);  // the run has missed it
        CHECK(absolute_error(done.out) == doctest::Approx(error).epsilon(0.1));
    }
}

TEST_CASE("what a blow in measured values does is measured, in the time and along the motion") {
    // Knots at every 0.1, and close to the blow at every 0.0002: steps fall beside it.
    const auto table = [](double middle) {
        std::string text;
        for (int i = -20; i <= 130; ++i) {
            const double x = i / 10.0;
            const bool is_near = std::fabs(x - middle) < 0.05;
            for (int j = is_near ? -40 : 0; j <= (is_near ? 40 : 0); ++j) {
                const double at = is_near ? middle + j * 0.0002 : x, u = (at - middle) / 0.001;
                text += fmt::format("{:.17g}, {:.17g}\n", at, std::exp(-u * u));
            }
        }
        return text;
    };
    struct Row {
        std::string lagrangian;
        double middle, fine;
    };
    for (const Row& row : {Row{"q'^2/2 - q^2/2 + 100*q*table(\\\"blow.csv\\\", t)", 3.301, 0.0005},
                           Row{"q'^2/2 - q^2/2 + 0.1*table(\\\"blow.csv\\\", q)", 0.503, 0.00002}}) {
        CAPTURE(row.lagrangian);
        const MeasuredScene coarse(timed_scene(row.lagrangian, swinging, "points = 8", 0.1, 10)),
            fine(timed_scene(row.lagrangian, swinging, "points = 8", row.fine, 10));
        for (const MeasuredScene* place : {&coarse, &fine})
            test::write_text(place->folder / "blow.csv", table(row.middle));
        const test::Finished done = coarse.run({"--beyond-horizon"});
        INFO(done.out << done.err);
        REQUIRE(done.exit_code == 0);
        REQUIRE(fine.run({"--every", "100", "--unmeasured"}).exit_code == 0);
        const double error = std::fabs(coarse.end()[1] - fine.end()[1]);
        CHECK(error > 1e-5);
        CHECK(absolute_error(done.out) > error / 2);  // without looking at the table: 1e-14
        CHECK(absolute_error(done.out) < error * 2);
    }
}

TEST_CASE("the companion's steps end at the points of measured values in time, whether those of the run do or not") {
    const auto place_with = [](double step) {
        auto place = std::make_unique<MeasuredScene>(
            timed_scene("q'^2/2 - q^2/2 + q*table(\\\"force.csv\\\", t)", swinging, "points = 12", step, 2));
        test::write_text(place->folder / "force.csv", "0, 0.1\n0.5, 0.3\n1, -0.2\n1.5, 0.7\n2, 1.9\n");
        return place;
    };
    const auto exact = place_with(0.125);
    REQUIRE(exact->run({"--unmeasured"}).exit_code == 0);
    // Steps that end at t = 1 have errors of rounding. A companion whose steps did not printed 1.5e-8.
    for (const double step : {0.25, 0.5, 1.0}) CHECK(absolute_error(place_with(step)->run().out) < 1e-14);
    const auto across = place_with(0.4);
    const test::Finished done = across->run();
    const double error = std::fabs(across->end()[1] - exact->end()[1]);
    CHECK(error > 1e-8);
    CHECK(absolute_error(done.out) == doctest::Approx(error).epsilon(0.1));
}

TEST_CASE("a pulse far from the start is not taken for nothing, and what rounds to zero is zero") {
    for (const char* lagrangian :
         {"q'^2/2 - q^2/2 + q*exp(-(t - 40)^2)", "q'^2/2 - q^2/2 + q*(1 + tanh((t - 40)/0.01))",
          "q'^2/2 - q^2/2 + exp(-1600)*q", "q'^2/2 - q^2/2 - exp(-(q - 40)^2)"}) {
        const MeasuredScene place(timed_scene(lagrangian, swinging, four, 0.05, 50));
        const test::Finished done = place.run();
        CAPTURE(lagrangian);
        CAPTURE(done.err);
        CHECK(done.exit_code == 0);
        // exp(-(t - 40)^2) kicks q by sqrt(pi) exp(-1/4) cos(50 - 40): far from cos(50).
        const bool is_kicked = std::string(lagrangian).find("t - 40") != std::string::npos;
        CHECK((std::fabs(place.end()[1] - std::cos(50)) > 0.1) == is_kicked);
    }
}

TEST_CASE("a constant smaller than all numbers keeps its digits beside large factors, or is the number nearest to it") {
    // A wall exp(q - 715); exp(-715) by itself is a number of 43 bits.
    const MeasuredScene wall(
        timed_scene("q'^2/2 - exp(-715)*exp(q)", "q = { position = 708, velocity = 0.05 }", four, 0.1, 200)),
        shifted(timed_scene("q'^2/2 - exp(q)", "q = { position = -7, velocity = 0.05 }", four, 0.1, 200)),
        subnormal(timed_scene("q'^2/2 - q^2/2 + 1e-310*q + 4e-324*q", swinging, four, 0.05, 50));
    const test::Finished of_wall = wall.run(), of_shifted = shifted.run(), of_subnormal = subnormal.run();
    const std::string errors = of_wall.err + of_shifted.err + of_subnormal.err;
    CAPTURE(errors);
    CHECK(of_wall.exit_code == 0);
    CHECK(of_subnormal.exit_code == 0);
    CHECK(shifted.end()[1] < -10);
    CHECK(std::fabs(wall.end()[1] - 715 - shifted.end()[1]) < 1e-10);
    CHECK(std::fabs(subnormal.end()[1] - std::cos(50)) < 1e-6);
}

TEST_CASE("a well in the way that is narrower than a step is met") {
    // Its passages take 5e-4 of the time; no node of the run falls into it.
    const std::string lagrangian = "q'^2/2 - q^2/2 + 10*exp(-((q - 0.503)/0.0001)^2)";
    const MeasuredScene coarse(timed_scene(lagrangian, swinging, four, 0.1, 10)),
        fine(timed_scene(lagrangian, swinging, four, 0.00001, 10));
    const test::Finished done = coarse.run();
    REQUIRE(done.exit_code == 0);
    REQUIRE(fine.run({"--every", "1000", "--unmeasured"}).exit_code == 0);
    const double error = std::fabs(coarse.end()[1] - fine.end()[1]);
    CHECK(error == doctest::Approx(4.9e-4).epsilon(0.1));
    CHECK(absolute_error(done.out) > error / 2);  // without looking: 9e-12
    CHECK(absolute_error(done.out) < error * 4);
}

TEST_CASE("an oscillation that looks constant at the steps is not taken for a constant") {
    // cos(2 pi 30 t) is 1 at every multiple of 0.1, and at every multiple of 2/3 of that.
    const MeasuredScene place(timed_scene("q'^2/2 - q^2/2 + q*cos(2*pi*30*t)", swinging, "points = 2", 0.1, 20));
    const test::Finished done = place.run({"--beyond-horizon"});
    INFO(done.out << done.err);
    CHECK(place.end()[1] == doctest::Approx(1));  // cos(20) = 0.41 is nearly the truth
    CHECK(done.out.find("as large as the motion itself from t = ") != std::string::npos);
    // Also where every step of the run is compared: cos is 1 at multiples of half of the step.
    const MeasuredScene few(timed_scene("q'^2/2 - q^2/2 + q*cos(2*pi*20*t)", swinging, "points = 2", 0.1, 5));
    CHECK(few.run({"--beyond-horizon"}).out.find("as large as the motion itself from t = ") != std::string::npos);
}

TEST_CASE("an error is extrapolated only where the rest of the run is like what was compared") {
    // Half of the run is compared: the rest is like it, is three times as fast, or loses energy ten times as fast.
    const auto known_at_end = [](const std::string& lagrangian, const std::string& velocity, const std::string& force) {
        const Scene scene = read_scene(
            Source("half.toml", "time = \"t\"\nlagrangian = \"" + lagrangian +
                                    "\"\n[coordinates]\nx = { position = 1, velocity = " + velocity + " }\n" +
                                    (force.empty() ? "" : "[forces]\nx = \"" + force + "\"\n") +
                                    "[method]\npoints = 3\n[run]\nstep = 0.1\nuntil = 40\n[output]\nevery = 10\n"));
        const Derivation derivation = derive(scene);
        const Kernel kernel = kernel_of(emit(derivation), Precision::double_);
        LoadedStepper<double> stepper(kernel);
        TrajectoryRequest request = request_of(scene, 400, stepper);
        Companion companion(derivation, kernel, request, kernel->epsilon);
        int blocks = 0;
        request.sink = [&](const Records& records) {
            for (std::int64_t i = 0; i < records.count; ++i) {
                if (++blocks == 21) companion.compute_here();
                Records one = records;
                one.rows += i * records.columns;
                one.count = 1;
                companion.observe(one);
            }
        };
        const TrajectoryResult result = integrate(kernel, request);
        REQUIRE(result.status == LOBATTO_OK);
        const std::optional<MeasuredError> error = companion.finish(result);
        REQUIRE(error);
        CHECK(error->until == doctest::Approx(20).epsilon(0.1));
        CHECK(!error->complete);
        CHECK(error->end > 0);
        return error->is_known_at_end();
    };
    CHECK(known_at_end("x'^2/2 - x^2/2", "0", ""));
    CHECK(known_at_end("x'^2/2 - x^2/2", "0", "-0.01*x'"));
    CHECK(!known_at_end("x'^2/2 - x^2/2", "0", "-0.15/(1 + exp(25 - t))*x'"));
    CHECK(!known_at_end("x'^2/2 + 10/((x - 40)^2 + 1)", "1.2", ""));
}

TEST_CASE("a run that is not measured says nothing of its error") {
    const MeasuredScene place(timed_scene("q'^2/2 - q^2/2", swinging, four, 0.1, 10));
    CHECK(place.run({"--unmeasured"}).out.find("measured error") == std::string::npos);
    CHECK(place.run().out.find("measured error") != std::string::npos);
}

TEST_CASE("rounding inside the formulas, which run and companion share, is told") {
    // About a circular orbit: R + x has five digits of x. The motion is A cos(omega t).
    const MeasuredScene place(
        "lagrangian = \"x'^2/2 + GM/(R + x) - GM*R/(2*(R + x)^2)\"\n[parameters]\nR = 1.5e11\n"
        "GM = 1.33e20\nA = 1e-3\n[coordinates]\nx = { position = \"A\", velocity = 0 }\n"
        "[method]\npoints = 6\n[run]\nstep = 1e5\nuntil = 1e7\n");
    const std::string says = "nearly cancel: their rounding is 0.0";
    const test::Finished lost = place.run();
    INFO(lost.out << lost.err);
    CHECK(absolute_error(lost.out) < 1e-6);  // the true one is 6e-6
    CHECK(test::contains(lost.err, says));
    for (const std::vector<std::string>& options :
         {std::vector<std::string>{"--set", "A=1e6"}, {"--companion", "double-double"}, {"--numbers", "double-double"}})
        CHECK_FALSE(test::contains(place.run(options).err, "nearly cancel"));
    // Nothing cancels in a force that hardly changes, and what rests is moved by rounding alone.
    for (const char* lagrangian : {"x'^2/2 - 9.81*x", "x'^2/2 - 9.81*x - 1e-13*x^4",
                                   "(x'^2 + y'^2)/2 - x^2/2 - y*(0.3*cos(x)^2 + 0.3*sin(x)^2 - 0.3)"}) {
        const MeasuredScene other(
            fmt::format("lagrangian = \"{}\"\n[coordinates]\nx = {{ position = 1, velocity = 3 }}\n{}"
                        "[run]\nstep = 0.01\nuntil = 5\n",
                        lagrangian, test::contains(lagrangian, "y'") ? "y = { position = 0, velocity = 0 }\n" : ""));
        CHECK(other.run().err == "");
    }
}

TEST_CASE("a barrier in the way of the last of many coordinates is met") {
    const MeasuredScene place(
        "lagrangian = \"sum(i = 1 .. 17, x[i]'^2/2) - sum(i = 1 .. 15, (x[i+1] - x[i])^4/4 + x[i]^2/2) - "
        "5*exp(-((x[17] - 3.00133)/1e-4)^2) - 0.001*x[17]^2*x[1]^2\"\n[coordinates]\n"
        "x = { count = 17, position = \"0.3*sin(i)\", velocity = \"i/17\" }\n"
        "[method]\npoints = 4\n[run]\nstep = 0.05\nuntil = 8\n");
    const test::Finished done = place.run();
    INFO(done.out << done.err);
    CHECK(done.exit_code == 3);  // it is thrown back, and the run goes through
    CHECK(test::contains(done.out, "as large as the motion itself from t = 3."));
}

TEST_SUITE("slow") {
    const std::string chaotic = "(a'^2 + b'^2 + c'^2)/2 - (a - b)^4/4 - (b - c)^4/4 - a^2 - c^4",
                      chaotic_start =
                          "a = { position = 1, velocity = 0 }\nb = { position = 0.3, velocity = 0 }\n"
                          "c = { position = -0.4, velocity = 0.3 }";

    TEST_CASE("a long run of which the start and the end alone are kept is measured at its end") {
        const MeasuredScene place(
            timed_scene(chaotic, chaotic_start, "points = 3", 0.001, 20000, "[output]\nevery = 10000000000\n"));
        const test::Finished done = place.run();
        INFO(done.out << done.err);
        // A machine that is busy with other things may have had no time for it.
        const bool is_told = test::contains(done.err, "the error is not measured, because the companion took too long");
        CHECK((is_told || done.exit_code == 3));
        CHECK((is_told || test::contains(done.out, "as large as the motion itself from t = 2e+04 on")));
    }

    TEST_CASE("where little of a run was compared, nothing is said of its end") {
        // A pulse makes the companion slow, and the motion is chaotic: its error doubles every 9 units of time.
        const MeasuredScene place(timed_scene(chaotic + " + 0.001*b*exp(-((t - 9000)/1e-5)^2)", chaotic_start, four,
                                              0.001, 10000, "[output]\nevery = 1000\n"));
        const test::Finished done = place.run();
        INFO(done.out << done.err);
        const bool is_lost = done.exit_code == 3 && test::contains(done.out, "as large as the motion itself");
        CHECK((is_lost || test::contains(done.err, "the error of the rest is not known") ||
               test::contains(done.err, "as large as the motion at the end, if it keeps growing")));
    }
}
