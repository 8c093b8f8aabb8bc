// SPDX-License-Identifier: GPL-2.0-or-later
// lobatto run from the outside: what it prints, writes and returns, also when it is interrupted, killed or refused.
#include <doctest/doctest.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <regex>
#include <thread>

#include "runtime/measure/reference.hpp"
#include "tests/support.hpp"
#include "tests/trajectory_table.hpp"

using namespace lobatto;

namespace {

const std::string pendulum = LOBATTO_SOURCE_DIR "/scenes/pendulum.toml";
const std::string oscillator = LOBATTO_SOURCE_DIR "/scenes/harmonic_oscillator.toml";

// A folder for trajectories.
struct Place {
    test::TemporaryFolder folder;
    std::string file(const std::string& name = "run.csv") const { return folder / name; }

    test::Finished run(std::vector<std::string> arguments) const {
        arguments.insert(arguments.begin(), {LOBATTO_PROGRAM, "run"});
        return test::run(arguments);
    }
};

// Starts a run that would take hours, waits until it has written states, sends the signal.
struct Signalled {
    int exit_code = -1;  // 128 + signal when the signal ended it
    std::string err;
};
Signalled signal_long_run(const Place& place, int signal) {
    const std::string out = place.file(), partial = out + ".partial", err = place.file("err");
    const pid_t pid = ::fork();
    if (pid == 0) {
        ::dup2(::open("/dev/null", O_WRONLY), 1);
        ::dup2(::open(err.c_str(), O_WRONLY | O_CREAT, 0600), 2);
        ::execl(LOBATTO_PROGRAM, LOBATTO_PROGRAM, "run", pendulum.c_str(), "--until", "1e9", "--every", "1000", "-o",
                out.c_str(), nullptr);
        ::_exit(127);
    }
    for (int tries = 0; tries < 3000; ++tries) {
        if (std::filesystem::exists(partial) && std::filesystem::file_size(partial) > 10000) break;
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    ::kill(pid, signal);
    int status = 0;
    ::waitpid(pid, &status, 0);
    return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), test::read_file(err)};
}

// Runs into infinity at t = 1.717, the integral of dy / sqrt(2 (y^3 - 1)) from 1 on, y = -x.
const char* const escape =
    "title = \"Escape\"\n"
    "lagrangian = \"x'^2/2 - x^3\"\n"
    "[coordinates]\nx = { position = -1, velocity = 0 }\n"
    "[method]\nfamily = \"lobatto\"\npoints = 4\n"
    "[run]\nstep = 0.1\nuntil = 10\n";

}  // namespace

TEST_CASE("a run says how good it is and where its trajectory is") {
    const Place place;
    const test::Finished first = place.run({pendulum, "-o", place.file()});
    CHECK(first.exit_code == 0);
    CHECK(first.err == "");
    const std::regex table(
        "\\S+scenes/pendulum.toml: kernel [0-9a-f]{16}, (found derived and compiled in the cache|(derived in "
        "0\\.\\d\\d s|found derived in the cache), (compiled in \\d+\\.\\d\\d s|found compiled in the cache))\n"
        "  steps                   2400, h = 0.05, to t = 120\n"
        "  time per step           \\S+ [nu]s\n"
        "  iterations              \\d\\.\\d\\d per step, at most \\d\n"
        "  energy error            \\S+ at most, relative \\S+\n"
        "  symplectic defect       \\S+\n"
        "  position error          \\S+ rad at most, against the exact elliptic solution\n"
        "  measured error          \\S+ of the amplitude at the end \\(\\S+ rad in q\\)\n"
        "  trajectory              \\S+/run.csv, 2401 states\n");
    CHECK_MESSAGE(std::regex_match(first.out, table), first.out);
    const test::Finished second = place.run({pendulum, "-o", place.file("again.csv")});
    CHECK(test::contains(second.out, ", found derived and compiled in the cache\n"));
    CHECK(test::read_file(place.file()) == test::read_file(place.file("again.csv")));
}

TEST_CASE("the trajectory file follows the exact solution and names its columns") {
    const Place place;
    REQUIRE(place.run({pendulum, "-o", place.file(), "--quiet"}).out == "");
    const test::TrajectoryTable table = test::read_trajectory(place.file());
    REQUIRE(table.comments.size() == 6);
    CHECK(table.comments[0] == "lobatto trajectory");
    CHECK(table.comments[1] == "scene: A plane pendulum");
    CHECK(table.comments[2] == "method: Lobatto, 4 points, h = 0.05");
    CHECK(table.comments[3].starts_with("kernel: "));
    CHECK(table.comments[4] == "parameters: m = 1, omega = 6.283185307179586");
    CHECK(table.comments[5] == "columns: t, q [rad], p_q, H");
    CHECK(table.columns == std::vector<std::string>{"t", "q", "p_q", "H"});
    REQUIRE(table.rows.size() == 2401);
    const long double pi = std::acos(-1.0L);
    double largest = 0;
    for (const std::vector<double>& row : table.rows) {
        const PhasePoint exact = pendulum_solution(4 * pi * pi, pi / 2, 0, static_cast<long double>(row[0]));
        largest = std::fmax(largest, std::fabs(row[1] - static_cast<double>(exact.q)));
    }
    CHECK(largest > 1e-8);  // the method's own error; measured 4.4e-8
    CHECK(largest < 1e-7);
}

TEST_CASE("--tolerance takes the place of the scene's, and a loose one costs digits and saves evaluations") {
    const Place place;
    const auto energy_error = [](const Place& in, const std::string& name) {
        const test::TrajectoryTable table = test::read_trajectory(in.file(name));
        double largest = 0;
        for (const std::vector<double>& row : table.rows)
            largest = std::fmax(largest, std::fabs(row[3] / table.rows[0][3] - 1));
        return largest;
    };
    const std::string scene = place.folder / "scene.toml";
    std::string text = test::read_file(pendulum);
    const std::string section = "[method]\n";
    text.insert(text.find(section) + section.size(), "tolerance = 1e-6\n");
    test::write_text(scene, text);
    place.run({pendulum, "-o", place.file("rounding.csv")});
    const std::string option = place.run({pendulum, "--tolerance", "1e-6", "-o", place.file("option.csv")}).out;
    const std::string in_scene = place.run({scene, "-o", place.file("scene.csv")}).out;
    place.run({scene, "--tolerance", "1e-15", "-o", place.file("over.csv")});
    CHECK(test::contains(option, "1.00 per step"));
    CHECK(test::contains(option, "symplectic defect       not exact: steps are iterated to 1e-06 only"));
    // A linear map is not iterated, whatever the tolerance.
    const std::string linear = place.run({oscillator, "--tolerance", "1e-6", "-o", place.file("linear.csv")}).out;
    CHECK(!test::contains(linear, "not exact"));
    CHECK(test::contains(in_scene, "1.00 per step"));
    const double rounding = energy_error(place, "rounding.csv"), loose = energy_error(place, "option.csv");
    CHECK(rounding < 1e-7);        // 6.4e-8, the method's own error
    CHECK(loose > 10 * rounding);  // 7.9e-6
    CHECK(energy_error(place, "scene.csv") == loose);
    CHECK(energy_error(place, "over.csv") == doctest::Approx(rounding).epsilon(1e-3));
}

TEST_CASE("a linear system needs no iteration and conserves its discrete energy") {
    const Place place;
    const test::Finished done = place.run({oscillator, "--until", "50", "-o", place.file()});
    CHECK(done.exit_code == 0);
    CHECK(test::contains(done.out, "  iterations              none: the step is a linear map\n"));
    CHECK(test::contains(done.out, " at most, against the exact solution\n"));
    std::smatch found;
    REQUIRE(std::regex_search(done.out, found, std::regex("discrete energy error   relative (\\S+) at most\n")));
    CHECK(std::stod(found[1]) < 1e-12);  // rounding of 1000 steps; measured 1.7e-13
    REQUIRE(std::regex_search(done.out, found, std::regex("energy error            (\\S+) at most")));
    CHECK(std::stod(found[1]) > 1e-7);  // while the energy itself sways; measured 1.1e-6
}

TEST_CASE("the command line replaces values of the scene, with one kernel for all") {
    const Place place;
    place.run({pendulum, "-o", place.file("first.csv"), "--quiet"});
    const test::Finished done = place.run({pendulum, "-o", place.file(), "--set", "omega=2", "--set", "m=1/4", "--step",
                                           "pi/omega/8", "--until", "2*pi", "--every", "4"});
    CHECK(done.exit_code == 0);
    CHECK(test::contains(done.out, "in the cache\n  steps                   32, h = 0.19635, to t = 6.28319\n"));
    const test::TrajectoryTable table = test::read_trajectory(place.file());
    CHECK(table.comments[4] == "parameters: m = 0.25, omega = 2");
    CHECK(table.rows.size() == 9);
    CHECK(table.rows.front()[3] == doctest::Approx(0.25 * 4));  // H = m omega^2 (1 - cos(pi/2))
    const test::Finished explicit_one = place.run({pendulum, "-o", place.file(), "--points", "2", "--until", "1"});
    CHECK(test::contains(explicit_one.out, "  iterations              none: the step is explicit\n"));
    CHECK(test::read_trajectory(place.file()).comments[2] == "method: Lobatto, 2 points, h = 0.05");
    const test::Finished split = place.run({pendulum, "-o", place.file(), "--splitting", "14", "--until", "1"});
    CHECK(test::contains(split.out, "  iterations              none: the step is explicit\n"));
    CHECK(test::read_trajectory(place.file()).comments[2] == "method: splitting, 14 stages, h = 0.05");
}

TEST_CASE("--set gives another start, as the scene would, with the same kernel and the values of other parameters") {
    const Place place;
    const auto last = [&](const std::string& scene, std::vector<std::string> options) {
        options.insert(options.begin(), {place.file(scene), "-o", place.file()});
        const test::Finished done = place.run(options);
        INFO(done.err);
        CHECK(done.exit_code == 0);
        return test::read_trajectory(place.file()).rows.back();
    };
    const auto bead = [](const std::string& x, const std::string& rate, const std::string& more) {
        return "lagrangian = \"(1 + x^2)*x'^2/2 + m*y'^2/2 - (x - y)^2/2 - k*y^4/4\"\n[coordinates]\nx = " + x +
               "\ny = { position = 0, " + rate + " = 0 }\n[parameters]\nk = 2\nm = 1\n" + more +
               "[run]\nstep = 0.05\nuntil = 5\n";
    };
    for (const std::string more : {"", "[method]\nclock = \"1/(1 + x^2)\"\n"}) {
        test::write_text(place.file("a.toml"), bead("{ position = 1, velocity = 0 }", "velocity", more));
        test::write_text(place.file("b.toml"), bead("{ position = 0.75, velocity = 1.5 }", "velocity", more));
        // The formula of the start takes k from where it is set, on its right.
        CHECK(last("a.toml", {"--set", "x = k/4", "--set", "x'=3/2", "--set", "k=3"}) ==
              last("b.toml", {"--set", "k=3"}));
    }
    test::write_text(place.file("a.toml"), bead("{ position = 1, momentum = 0 }", "momentum", ""));
    test::write_text(place.file("b.toml"), bead("{ position = 1, momentum = 0.5 }", "momentum", ""));
    CHECK(last("a.toml", {"--set", "p_x=0.5"}) == last("b.toml", {}));
    const test::Finished again = place.run({place.file("a.toml"), "--set", "p_x=0.25", "-o", place.file()});
    CHECK(test::contains(again.out, "found derived and compiled in the cache"));
    CHECK(test::contains(place.run({place.file("a.toml"), "--set", "x'=1", "-o", place.file()}).err,
                         "gives initial momenta, not velocities; set p_x instead"));
    // A start that keeps no constraint, and one without a mass.
    const test::Finished off = place.run({LOBATTO_SOURCE_DIR "/scenes/rod_pendulum.toml", "--set", "x=0.5"});
    CHECK(off.exit_code == 2);
    CHECK(test::contains(off.err, "the start does not keep the constraint rod"));
}

TEST_CASE("an end that is no multiple of the step is said, not overrun") {
    const Place place;
    const test::Finished done = place.run({pendulum, "-o", place.file(), "--step", "0.3", "--until", "1"});
    CHECK(done.exit_code == 0);
    CHECK(test::contains(done.out, "  steps                   3, h = 0.3, to t = 0.9\n"));
    CHECK(test::contains(
        done.out, "\nThe end time is not a multiple of the step: the run ends at the last multiple before it.\n"));
    CHECK(
        !test::contains(place.run({pendulum, "-o", place.file(), "--step", "0.1", "--until", "0.3"}).out, "multiple"));
    const test::Finished none = place.run({pendulum, "-o", place.file(), "--until", "0"});
    CHECK(test::contains(none.out, "  steps                   0, h = 0.05, to t = 0\n"));
    CHECK(test::contains(none.out, ", 1 state\n"));
    const test::Finished too_short = place.run({pendulum, "-o", place.file(), "--step", "1000", "--until", "10"});
    CHECK(too_short.exit_code == 2);
    CHECK(test::contains(too_short.err,
                         "--step: the step 1000 is longer than the run, which ends at 10, so that not "
                         "one step would be taken; make the step smaller or the end time later"));
}

TEST_CASE("without -o the trajectory goes to the folder out under the current one") {
    const Place place;
    const std::string command = "cd '" + place.folder.string() + "' && '" LOBATTO_PROGRAM "' run '" + pendulum + "'";
    const test::Finished done = test::run({"sh", "-c", command});
    CHECK(test::contains(done.out, "  trajectory              out/pendulum.csv, 2401 states\n"));
    CHECK(test::read_trajectory(place.folder / "out/pendulum.csv").rows.size() == 2401);
}

TEST_CASE("wrong values on the command line are refused with exit code 2") {
    const Place place;
    const auto refusal = [&](std::vector<std::string> arguments) {
        arguments.insert(arguments.begin(), pendulum);
        arguments.insert(arguments.end(), {"-o", place.file()});
        const test::Finished done = place.run(arguments);
        CHECK(done.exit_code == 2);
        CHECK(done.out == "");
        CHECK(!std::filesystem::exists(place.file()));
        return done.err;
    };
    CHECK(refusal({"--set", "omgea=2"}) ==
          "--set:1:1: unknown parameter 'omgea'; declared: m, omega; of the start: q, q'. Did you mean 'omega'?\n  1 | "
          "omgea=2\n   "
          " | ^\n");
    CHECK(refusal({"--tolerance", ".5e-6"}) ==
          "lobatto: --tolerance: a number begins with a digit: write 0.5e-6, not .5e-6\n"
          "`lobatto run --help` shows what can be given.\n");
    CHECK(refusal({"--set", "m"}) == "--set:1:1: expected name=value, such as --set m=2\n  1 | m\n    | ^\n");
    for (const std::string value : {"0", "-1e-6", "0.002", "nan"})
        CHECK(test::contains(refusal({"--tolerance", value}), "--tolerance: the tolerance is " + value +
                                                                  "; it must be above 0 and at most 0.001; leave it "
                                                                  "out to iterate to rounding\n"));
    CHECK(test::contains(refusal({"--tolerance", "small"}),
                         "--tolerance: a number is wanted, such as 0.25 or 1e-6, not small"));
    CHECK(test::contains(refusal({"--set", "m=2*omega"}), "--set:1:5: unknown name 'omega' in the value of m"));
    CHECK(test::contains(refusal({"--step", "2*"}), "--step:1:3: "));
    const std::string range = " must be 0, or of a size between 1e-300 and 1e300\n";
    CHECK(refusal({"--set", "m=1e400"}) == "--set:1:3: the value of m" + range + "  1 | m=1e400\n    |   ^\n");
    CHECK(test::contains(refusal({"--set", "omega=1e-400"}), "--set:1:7: the value of omega" + range));
    CHECK(test::contains(refusal({"--step", "1e400"}), "--step:1:1: the step" + range));
    CHECK(test::contains(refusal({"--until", "m*1e400"}), "--until:1:1: the end time" + range));
    CHECK(refusal({"--step", "-0.1"}) == "--step: the step must be positive, but is -0.1\n");
    CHECK(refusal({"--until", "-1"}) == "--until: the end time must not be negative, but is -1\n");
    CHECK(refusal({"--until", "1e30"}) ==
          pendulum + ": 2e+31 steps are too many to count; make the step larger or the end time smaller\n");
    CHECK(refusal({"--every", "0"}) ==
          "--every: 0 is not a number of states; give 1 to keep each, 10 to keep every tenth\n");
    for (const std::string number : {"-3", "2.5", "nan"})
        CHECK(
            test::contains(refusal({"--every", number}), "--every: " + number + " is not a number of states; give 1"));
    for (const std::string number : {"1e16", "1e400"})
        CHECK(test::contains(refusal({"--every", number}), "more than a run has steps; at most 9e15"));
    CHECK(test::contains(refusal({"--every", "many"}), "--every: a number is wanted, such as 0.25 or 1e-6, not many"));
    CHECK(test::contains(refusal({"--points", "3.0"}),
                         "--points: a whole number in digits is wanted, at most 2147483647"));
    CHECK(test::contains(refusal({"--points", "13"}), "lobatto: --points: Value 13 not in range"));
    CHECK(test::contains(refusal({"--stages", "11"}), "lobatto: --stages: Value 11 not in range"));
    CHECK(test::contains(refusal({"--splitting", "12"}), "lobatto: --splitting: 12 not in {6,11,14,17,35}"));
    CHECK(test::contains(refusal({"--splitting", "11", "--points", "4"}), "excludes"));
    CHECK(refusal({"--splitting", "11", "--tolerance", "1e-9"}) ==
          pendulum + ": splitting methods iterate nothing; leave out --tolerance\n");
    CHECK(refusal({"--splitting", "11", "--arithmetic", "clean"}) ==
          pendulum +
              ": splitting methods have no clean arithmetic; choose another method (--points 8), or plain arithmetic "
              "(--arithmetic plain)\n");
    CHECK(refusal({"--splitting", "11", "--general"}) ==
          pendulum +
              ": splitting methods have no general path; leave out --general, or choose another method (--points 4)\n");
}

TEST_CASE("a splitting method refuses masses that vary, and number types with more digits than its coefficients") {
    const Place place;
    const std::string folded = std::string(LOBATTO_SOURCE_DIR) + "/scenes/double_pendulum.toml";
    const test::Finished refused = place.run({folded, "-o", place.file(), "--splitting", "11"});
    CHECK(refused.exit_code == 2);
    CHECK(test::contains(refused.err, "double_pendulum.toml:"));
    CHECK(test::contains(refused.err,
                         "splitting methods need a constant mass matrix and forces without velocities, but "));
    CHECK(test::contains(refused.err, "; choose Lobatto (--points 4) or Gauss (--stages 3)"));
    const auto emitted = [&](const char* stages, const char* precision) {
        return test::run({LOBATTO_PROGRAM, "emit", pendulum, "--splitting", stages, "--numbers", precision, "-o",
                          place.file("emitted"), "--no-support"});
    };
    const test::Finished wide = emitted("11", "long double");
    CHECK(wide.exit_code == 2);
    CHECK(test::contains(wide.err,
                         "the coefficients of splitting, 11 stages are known to 15 digits, too few for numbers in long "
                         "double; choose double, or Lobatto"));
    CHECK(emitted("17", "long double").exit_code == 0);
    CHECK(emitted("35", "quadruple").exit_code == 0);
}

TEST_CASE("a run that stops keeps what was computed, explains itself and returns 3") {
    const Place place;
    const std::string scene = place.file("escape.toml");
    test::write_text(scene, escape);
    const test::Finished done = place.run({scene, "-o", place.file()});
    CHECK(done.exit_code == 3);
    const test::TrajectoryTable table = test::read_trajectory(place.file());
    REQUIRE(table.rows.size() > 10);
    CHECK(table.rows.back()[0] == doctest::Approx(1.6));
    CHECK(table.rows.back()[1] < -10);
    CHECK(test::contains(done.out, " of 100, h = 0.1, to t = "));
    CHECK(test::contains(done.out, "run.csv, " + std::to_string(table.rows.size()) + " states\n"));
    CHECK(done.err.starts_with("lobatto: " + scene + ": the run stopped in step " + std::to_string(table.rows.size()) +
                               ", after t = "));
    CHECK(done.err.ends_with(" What was computed is in " + place.file() + ".\n"));
}

TEST_CASE("a start that is impossible returns 3 and leaves the file of before") {
    const Place place;
    test::write_text(place.file(), "of before\n");
    const test::Finished done = place.run({pendulum, "--set", "m=0", "-o", place.file()});
    CHECK(done.exit_code == 3);
    CHECK(test::contains(done.err, "the mass matrix has no inverse for these parameters"));
    CHECK(test::read_file(place.file()) == "of before\n");
}

TEST_CASE("an interrupted run keeps what was computed, says so and returns 130") {
    for (const int signal : {SIGINT, SIGTERM}) {
        const Place place;
        const Signalled run = signal_long_run(place, signal);
        CHECK(run.exit_code == 130);
        CHECK(run.err.starts_with("lobatto: interrupted at t = "));
        CHECK(run.err.ends_with("; what was computed is in " + place.file() +
                                ". The same command with --resume continues from there.\n"));
        const test::TrajectoryTable table = test::read_trajectory(place.file());
        CHECK(table.rows.size() > 100);
        CHECK(!std::filesystem::exists(place.file() + ".partial"));
    }
}

TEST_CASE("kill -9 leaves readable rows beside the file of before") {
    const Place place;
    test::write_text(place.file(), "# lobatto, of before\n");
    CHECK(signal_long_run(place, SIGKILL).exit_code == 128 + SIGKILL);
    CHECK(test::read_file(place.file()) == "# lobatto, of before\n");
    const test::TrajectoryTable table = test::read_trajectory(place.file() + ".partial");
    REQUIRE(table.rows.size() > 100);
    for (const std::vector<double>& row : table.rows) REQUIRE(row.size() == 4);
    CHECK(table.rows[7][0] == doctest::Approx(7 * 1000 * 0.05).epsilon(1e-14));
    CHECK(place.run({pendulum, "-o", place.file()}).exit_code == 0);  // what is left does not stand in the way
    CHECK(test::read_trajectory(place.file()).rows.size() == 2401);
}

TEST_CASE("a machine that refuses to write is an error of exit code 4") {
    const Place place;
    const test::Finished missing = place.run({pendulum, "-o", place.file("none/run.csv")});
    CHECK(missing.exit_code == 4);
    CHECK(missing.err == "lobatto: cannot write results to " + place.file("none/run.csv") +
                             ": No such file or directory. Create its folder first, or choose another place with -o\n");
    const test::Finished full = place.run({pendulum, "-o", "/dev/full", "--quiet"});
    CHECK(full.exit_code == 4);
    CHECK(full.err ==
          "lobatto: cannot write the trajectory to /dev/full: No space left on device. Free some space, or choose "
          "another place with -o\n");
}

TEST_CASE("a reader that goes away does not cost the trajectory") {
    const Place place;
    const test::Finished done =
        test::run({"sh", "-c", "'" LOBATTO_PROGRAM "' run '" + pendulum + "' -o '" + place.file() + "' | true"});
    CHECK(done.err == "");
    CHECK(test::read_trajectory(place.file()).rows.size() == 2401);
    // Rows to a pipe that closes.
    const test::Finished head = test::run(
        {"sh", "-c",
         "'" LOBATTO_PROGRAM "' run '" + pendulum + "' --quiet --until 1e5 -o /dev/stdout | head -7 | tail -1"});
    CHECK(head.out == "t,q,p_q,H\n");
    const std::string gone =
        "lobatto: cannot write the trajectory to standard output: Broken pipe. Its reader has gone\n";
    CHECK(head.err == gone);
    // Nor is the error lost when there is more to say on the same pipe.
    const test::Finished talkative =
        test::run({"sh", "-c",
                   "{ '" LOBATTO_PROGRAM "' run '" + pendulum +
                       "' --until 1e5 -o /dev/stdout; echo $? >&2; } | head -1 > /dev/null"});
    CHECK(talkative.err == gone + "4\n");
}

TEST_CASE("a run keeps only what the scene asks for") {
    const Place place;
    const auto scene_with = [&](const std::string& output) {
        const std::string path = place.file("scene.toml");
        test::write_text(path,
                         "title = \"Two\"\nlagrangian = \"(a'^2 + b'^2)/2 - a^2 - b^4 - a*b\"\n"
                         "[coordinates]\na = { position = 1, velocity = 0 }\nb = { position = 0, velocity = 1 }\n"
                         "[run]\nstep = 0.1\nuntil = 1\n[output]\n" +
                             output);
        return path;
    };
    const test::Finished bare =
        place.run({scene_with("momenta = false\nenergy = false\ntangent = false\n"), "-o", place.file()});
    CHECK(bare.err == "");
    CHECK(test::read_trajectory(place.file()).columns == std::vector<std::string>{"t", "a", "b"});
    CHECK(!test::contains(bare.out, "energy"));
    CHECK(!test::contains(bare.out, "symplectic"));
    const test::TrajectoryTable kept = test::read_trajectory(place.file());
    const test::Finished full = place.run({scene_with(""), "-o", place.file()});
    const test::TrajectoryTable all = test::read_trajectory(place.file());
    CHECK(all.columns == std::vector<std::string>{"t", "a", "b", "p_a", "p_b", "H"});
    CHECK(test::contains(full.out, "  energy error "));
    CHECK(test::contains(full.out, "  symplectic defect "));
    REQUIRE(kept.rows.size() == all.rows.size());
    for (std::size_t i = 0; i < kept.rows.size(); ++i)
        for (std::size_t k = 0; k < 3; ++k) CHECK(kept.rows[i][k] == all.rows[i][k]);
}

TEST_CASE("states between steps lie on the motion, and those at steps are unchanged") {
    const Place place;
    const std::string scene = place.file("scene.toml");
    const std::string text = test::read_file(pendulum);
    test::write_text(scene, text);
    REQUIRE(place.run({scene, "--until", "2", "-o", place.file("steps.csv"), "--quiet"}).err == "");
    test::write_text(scene, std::regex_replace(text, std::regex("every = 1"), "dense = 3"));
    const test::Finished done = place.run({scene, "--until", "2", "-o", place.file()});
    CHECK(done.err == "");
    CHECK(test::contains(done.out, ", 161 states\n"));
    const test::TrajectoryTable steps = test::read_trajectory(place.file("steps.csv")),
                                dense = test::read_trajectory(place.file());
    REQUIRE(steps.rows.size() == 41);
    REQUIRE(dense.rows.size() == 161);
    const long double pi = std::acos(-1.0L);
    double largest = 0;
    for (std::size_t i = 0; i < dense.rows.size(); ++i) {
        if (i % 4 == 0) CHECK(dense.rows[i][1] == steps.rows[i / 4][1]);
        const PhasePoint exact = pendulum_solution(4 * pi * pi, pi / 2, 0, static_cast<long double>(dense.rows[i][0]));
        largest = std::fmax(largest, std::fabs(dense.rows[i][1] - static_cast<double>(exact.q)));
    }
    CHECK(place.run({scene, "--every", "2", "-o", place.file()}).err ==
          "--every: the scene asks for states between two steps (dense = 3), so all steps are kept\n");
    CHECK(largest > 1e-7);  // the cubic's own error, h^4 q''''/384 and more: a straight line has 8e-3
    CHECK(largest < 1e-4);
}

TEST_CASE("events go to a file beside the trajectory, each on the exact motion") {
    const Place place;
    const std::string scene = place.file("scene.toml");
    test::write_text(scene, test::read_file(pendulum) + "events = [\"q = 0 rising\", \"q\' = 0\"]\n");
    const test::Finished done = place.run({scene, "--until", "11.9", "-o", place.file()});
    CHECK(done.err == "");
    CHECK(test::contains(done.out, "  events                  10 of 'q = 0 rising'\n"));
    CHECK(test::contains(done.out,
                         "                          20 of 'q' = 0', in " + place.file("run.events.csv") + "\n"));
    const test::TrajectoryTable table = test::read_trajectory(place.file("run.events.csv"));
    CHECK(table.comments[0] == "lobatto events");
    CHECK(table.comments[5] == "event 1: q = 0 rising");
    CHECK(table.comments[6] == "event 2: q' = 0");
    CHECK(table.columns == std::vector<std::string>{"event", "t", "q", "p_q"});
    REQUIRE(table.rows.size() == 30);
    // A swing from 90 degrees takes 4 K(sin 45)/(2 pi) = 1.1803405990161.
    for (std::size_t i = 0, rising = 0; i < table.rows.size(); ++i) {
        const std::vector<double>& row = table.rows[i];
        if (row[0] != 1) continue;
        CHECK(row[1] == doctest::Approx(1.1803405990161 * (0.75 + static_cast<double>(rising++))).epsilon(1e-5));
        CHECK(std::fabs(row[2]) < 1e-12);
        CHECK(row[3] > 0);
    }
}

TEST_CASE("impacts and stops are told, and have their rows beside the trajectory") {
    const Place place;
    const std::string scene = place.file("ball.toml");
    test::write_text(scene,
                     "lagrangian = \"y'^2/2 - 2*y\"\n[coordinates]\ny = { position = 1, velocity = 0 }\n[impacts]\n"
                     "floor = { when = \"y = 0 falling\", restitution = 0.5 }\n[run]\nstep = 0.3\nuntil = 2.9\n"
                     "stop = \"y' = 0 falling\"\n");
    const test::Finished stopped = place.run({scene, "-o", place.file()});
    CHECK(stopped.exit_code == 0);
    CHECK(stopped.out.find("stopped                 by 'y' = 0 falling' at t = 1.5\n") != std::string::npos);
    CHECK(stopped.out.find("impacts                 1 of 'floor: y = 0 falling', in ") != std::string::npos);
    const test::TrajectoryTable states = test::read_trajectory(place.file()),
                                events = test::read_trajectory(place.file("run.events.csv"));
    CHECK(std::fabs(states.rows.back()[0] - 1.5) < 1e-14);
    CHECK(std::fabs(states.rows.back()[1] - 0.25) < 1e-14);
    REQUIRE(events.rows.size() == 2);
    CHECK(events.rows[0][0] == 2);
    CHECK(std::fabs(events.rows[0][1] - 1) < 1e-14);
    CHECK(events.rows[1][0] == 1);

    // Without the stop impacts accumulate at t = 3.
    test::write_text(scene, test::read_file(scene).substr(0, test::read_file(scene).find("until")) + "until = 4\n");
    const test::Finished failed = place.run({scene, "-o", place.file()});
    CHECK(failed.exit_code == 3);
    CHECK(failed.err.find("after t = 2.7") != std::string::npos);
    CHECK(failed.err.find("impacts accumulate") != std::string::npos);
    CHECK(test::read_trajectory(place.file()).rows.size() == 10);
}

TEST_CASE("what a drive or friction does to the energy is called a change, and no symplecticity is promised") {
    const Place place;
    const std::string scene = place.file("scene.toml");
    test::write_text(scene,
                     "title = \"Damped\"\nlagrangian = \"x'^2/2 - x^4/4\"\n"
                     "[coordinates]\nx = { position = 1, velocity = 0 }\n[forces]\nx = \"-x'/10\"\n"
                     "[run]\nstep = 0.1\nuntil = 10\n");
    const test::Finished damped = place.run({scene, "-o", place.file()});
    CHECK(damped.err == "");
    CHECK(std::regex_search(damped.out, std::regex("\n  energy change           0\\.\\d+ at most\n")));
    CHECK(!test::contains(damped.out, "symplectic"));
    test::write_text(scene,
                     "title = \"Driven\"\ntime = \"t\"\nlagrangian = \"x'^2/2 - x^4/4 + x*sin(t)\"\n"
                     "[coordinates]\nx = { position = 1, velocity = 0 }\n[run]\nstep = 0.1\nuntil = 10\n");
    const test::Finished driven = place.run({scene, "-o", place.file()});
    CHECK(driven.err == "");
    CHECK(test::contains(driven.out, "\n  energy change "));
    CHECK(test::contains(driven.out, "\n  symplectic defect "));  // a step is still symplectic
}

TEST_CASE("a motion where rest is impossible has an energy") {
    // A free particle seen from a frame that rotates: from 1/w on whoever rests there moves faster than light.
    const Place place;
    const std::string scene = place.file("scene.toml");
    test::write_text(scene,
                     "lagrangian = \"-sqrt(1 - (x' - w*y)^2 - (y' + w*x)^2)\"\n[coordinates]\nx = { position = 0, "
                     "velocity = 0.3 }\ny = { position = 0, velocity = 0.2 }\n[parameters]\nw = 0.5\n[run]\nstep = "
                     "0.05\nuntil = 10\n");
    const test::Finished finished = place.run({scene, "-o", place.file()});
    CHECK(finished.exit_code == 0);
    CHECK(finished.err == "");
    CHECK(!test::contains(finished.out, "nan"));
    const std::vector<double> last = test::read_trajectory(place.file()).rows.back();
    CHECK(last[1] * last[1] + last[2] * last[2] == doctest::Approx(13).epsilon(1e-9));
}

TEST_CASE("a potential that is below all numbers of double at the start runs") {
    const Place place;
    const std::string scene = place.file("scene.toml");
    test::write_text(scene,
                     "lagrangian = \"x'^2/2 - exp(-x^2)\"\n[coordinates]\nx = { position = -27, velocity = 2 }\n"
                     "[run]\nstep = 0.01\nuntil = 1\n");
    const test::Finished finished = place.run({scene, "-o", place.file()});
    CHECK(finished.err == "");
    CHECK(finished.exit_code == 0);
    CHECK(test::read_trajectory(place.file()).rows.back()[1] == doctest::Approx(-25).epsilon(1e-14));
}

TEST_CASE("the stability limit with friction is that of the frequency, and the advised part of a step is below it") {
    const Place place;
    const std::string scene = place.file("scene.toml");
    test::write_text(scene,
                     "lagrangian = \"x'^2/2 - 100*x^2/2\"\n[coordinates]\nx = { position = 1, velocity = 0 }\n"
                     "[forces]\nx = \"-0.1*x'\"\n[run]\nstep = 0.3\nuntil = 3\n");
    const auto said = [&](const char* h) { return place.run({scene, "--step", h, "-o", place.file()}).err; };
    CHECK(!test::contains(said("0.311"), "beyond the linear stability limit"));
    CHECK(test::contains(said("0.4472"), "h omega = 4.472 is more than 3.113"));
    CHECK(test::contains(said("0.4472"), "Take a step below 0.69 times this one"));
}

TEST_CASE("the stability limit is the same in any unit of mass") {
    const Place place;
    const std::string scene = place.file("scene.toml");
    const auto warns = [&](const char* formula, const char* mass) {
        test::write_text(scene, fmt::format("lagrangian = \"m*({})\"\n[coordinates]\nq = {{ position = 1, velocity = 0 "
                                            "}}\n[parameters]\nm = 1\n[run]\nstep = 0.1\nuntil = 2\n",
                                            formula));
        return test::contains(place.run({scene, "--set", std::string("m=") + mass, "-o", place.file()}).err,
                              "beyond the linear stability limit");
    };
    for (const char* mass : {"1", "1e9", "1e-9"}) {
        CHECK(!warns("q'^2/2 - q^2/2 - q^4/40", mass));
        CHECK(warns("q'^2/2 + 33^2*cos(q)", mass));
    }
}

TEST_CASE("clean steps have the events and the states between steps of plain ones, to rounding") {
    const Place place;
    const std::string scene = place.file("scene.toml");
    test::write_text(scene,
                     "lagrangian = \"(x'^2 + y'^2)/2 + 1/sqrt(x^2 + y^2)\"\n[coordinates]\nx = { position = 0.7, "
                     "velocity = 0 }\ny = { position = 0, velocity = 1.3627 }\n[method]\npoints = 6\n"
                     "[run]\nstep = 0.05\nuntil = 20\n[output]\ndense = 3\nevents = [\"x = 0\", \"y = 0 rising\"]\n");
    const auto tables = [&](const std::string& arithmetic) {
        CHECK(place.run({scene, "--arithmetic", arithmetic, "-o", place.file(), "--quiet"}).err == "");
        return std::pair(test::read_trajectory(place.file()).rows,
                         test::read_trajectory(place.file("run.events.csv")).rows);
    };
    const auto plain = tables("plain"), clean = tables("clean");
    REQUIRE(clean.first.size() == 1601);
    REQUIRE(clean.second.size() == plain.second.size());
    CHECK(clean.second.size() > 6);
    double worst = 0, worst_event = 0;
    for (std::size_t i = 0; i < plain.first.size(); ++i)
        for (std::size_t k = 0; k < plain.first[i].size(); ++k)
            worst = std::fmax(worst, std::fabs(plain.first[i][k] - clean.first[i][k]));
    for (std::size_t i = 0; i < plain.second.size(); ++i)
        for (std::size_t k = 0; k < plain.second[i].size(); ++k)
            worst_event = std::fmax(worst_event, std::fabs(plain.second[i][k] - clean.second[i][k]));
    CHECK(worst < 1e-12);
    CHECK(worst > 0);
    CHECK(worst_event < 1e-12);
}

TEST_CASE("a run without shortcuts gives the same motion to rounding") {
    const Place place;
    const auto last = [&](const std::vector<std::string>& more) {
        std::vector<std::string> arguments{pendulum, "--until", "5", "-o", place.file(), "--quiet"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        CHECK(place.run(arguments).err == "");
        return test::read_trajectory(place.file()).rows.back();
    };
    const std::vector<double> with = last({}), without = last({"--general"});
    for (std::size_t k = 0; k < with.size(); ++k) CHECK(with[k] == doctest::Approx(without[k]).epsilon(1e-11));
}

TEST_CASE("a name that leaves no room for the files beside it is refused before anything is written") {
    const Place place;
    const test::Finished done = place.run({pendulum, "-o", place.file(std::string(240, 'a') + ".csv"), "--until", "1"});
    CHECK(done.exit_code == 2);
    CHECK(test::contains(done.err, "the name of this file has 244 bytes, and at most 230 are possible"));
    CHECK(place.run({pendulum, "-o", place.file(std::string(226, 'a') + ".csv"), "--until", "1"}).exit_code == 0);
}

TEST_CASE("files that Lobatto did not write are never touched") {
    const Place place;
    const std::string out = place.file("w.csv");
    const auto refused = [&](const std::string& neighbour, const std::string& content, int code) {
        test::write_text(place.file(neighbour), content);
        const test::Finished done = place.run({pendulum, "-o", out, "--until", "1"});
        CAPTURE(neighbour);
        CHECK(done.exit_code == code);
        CHECK(test::contains(done.err, neighbour + " is there, and Lobatto did not write it"));
        CHECK(test::read_file(place.file(neighbour)) == content);
        std::filesystem::remove(place.file(neighbour));
    };
    for (const std::string& content : {std::string("my notes\n"), std::string(200, 'g'), std::string("{}")}) {
        refused("w.csv.checkpoint", content, 2);
        refused("w.csv.partial", content, 4);
    }
    // The scene itself under such a name.
    for (const char* ending : {".checkpoint", ".partial"}) {
        const std::string scene = place.file(std::string("w.csv") + ending), text = test::read_file(pendulum);
        test::write_text(scene, text);
        const test::Finished done = place.run({scene, "-o", out, "--until", "1"});
        CHECK(done.exit_code == 2);
        CHECK(test::contains(done.err, "the result would overwrite the scene"));
        CHECK(test::read_file(scene) == text);
        std::filesystem::remove(scene);
    }
    refused("w.csv", "time,position\n0,1\n", 2);
    // An array of one's own: nothing beside it says that it is ours.
    const std::string array = place.file("w.npy");
    test::write_text(array, "\x93NUMPY and so on");
    CHECK(place.run({pendulum, "-o", array, "--until", "1"}).exit_code == 2);
    CHECK(test::read_file(array) == "\x93NUMPY and so on");
    std::filesystem::remove(array);
    for (int i = 0; i < 2; ++i) CHECK(place.run({pendulum, "-o", array, "--until", "1"}).exit_code == 0);
    CHECK(test::run({LOBATTO_PROGRAM, "stability", pendulum, "--chart", array}).exit_code == 2);  // no .svg
    test::write_text(place.file("mine.svg"), "<svg/>");
    const test::Finished chart = test::run({LOBATTO_PROGRAM, "stability", pendulum, "--chart", place.file("mine.svg")});
    CHECK(test::contains(chart.err, "mine.svg is there, and Lobatto did not write it"));
    const std::string folder = place.file("results");
    std::filesystem::create_directory(folder);
    for (const auto& [command, result] : {std::pair("roundoff", "roundoff.csv"), {"tradeoff", "tradeoff.csv"}}) {
        test::write_text(folder + "/" + result, "mine");
        const test::Finished done = test::run({LOBATTO_PROGRAM, command, pendulum, "-o", folder});
        CHECK(done.exit_code == 2);
        CHECK(test::contains(done.err, std::string(result) + " is there, and Lobatto did not write it"));
    }
    // Nor under the names that a command chooses itself: of events, of support headers.
    const std::string scene = place.file("events.toml");
    test::write_text(scene,
                     "lagrangian = \"q'^2/2 - q^2/2\"\n[coordinates]\nq = { position = 1, velocity = 0 }\n[run]\n"
                     "step = 0.1\nuntil = 1\n[output]\nevents = [\"q = 0\"]\n");
    test::write_text(place.file("w.events.csv"), "mine");
    test::write_text(place.file("kernel.hpp"), "mine");
    const test::Finished events = place.run({scene, "-o", out, "--until", "1"});
    CHECK(events.exit_code == 2);
    CHECK(test::contains(events.err, "w.events.csv is there, and Lobatto did not write it"));
    CHECK(test::read_file(place.file("w.events.csv")) == "mine");
    const test::Finished emitted = test::run({LOBATTO_PROGRAM, "emit", pendulum, "-o", place.file(".")});
    CHECK(emitted.exit_code == 2);
    CHECK(test::read_file(place.file("kernel.hpp")) == "mine");
    // Files of one's own that only speak of Lobatto, and scenes.
    const auto kept = [&](const std::string& name, const std::string& content, std::vector<std::string> command) {
        test::write_text(place.file(name), content);
        command.insert(command.begin(), LOBATTO_PROGRAM);
        const test::Finished done = test::run(command);
        CAPTURE(done.err);
        CHECK(done.exit_code == 2);
        CHECK(test::read_file(place.file(name)) == content);
    };
    const std::string include = "#include <lobatto/lobatto.hpp>\nclass Arm {};\n";
    kept("pendulum.hpp", include, {"emit", pendulum, "--standalone", "-o", place.file(".")});
    kept("kernel.hpp", include, {"emit", pendulum, "-o", place.file(".")});
    kept("other.toml", test::read_file(pendulum), {"view", pendulum, "-o", place.file("other.toml")});
    kept("notes.html", "<p>on Lobatto", {"view", pendulum, "-o", place.file("notes.html")});
    kept("other.toml", test::read_file(pendulum), {"schema", "-o", place.file("other.toml")});
    kept("s.json", "{\"title\": \"Lobatto\"}", {"schema", "-o", place.file("s.json")});
    kept("n.svg", "<svg><!-- lobatto --></svg>", {"stability", pendulum, "--chart", place.file("n.svg")});
    for (const auto& words : std::vector<std::vector<std::string>>{{"emit", pendulum, "--standalone", "-o", folder},
                                                                   {"emit", pendulum, "-o", folder},
                                                                   {"view", pendulum, "-o", folder + "/p.html"},
                                                                   {"schema", "-o", folder + "/s.json"},
                                                                   {"manual", "-o", folder}}) {
        std::vector<std::string> command = words;
        command.insert(command.begin(), LOBATTO_PROGRAM);
        for (int i = 0; i < 2; ++i) CHECK_MESSAGE(test::run(command).exit_code == 0, words[0]);  // ours may be replaced
    }
    // A whole file takes another name for its own beginning.
    test::write_text(place.file("t.json.partial"), "mine");
    CHECK(place.run({pendulum, "-o", out, "--until", "1"}).exit_code == 0);
}

TEST_CASE("what cannot be told on standard error changes neither the run nor its exit code") {
    const Place place;
    const auto shell = [&](const std::string& arguments, const std::string& streams) {
        return test::run(
                   {"sh", "-c", "'" LOBATTO_PROGRAM "' run " + arguments + " -o '" + place.file() + "' " + streams})
            .exit_code;
    };
    const std::string good = "'" + pendulum + "' --until 1",
                      warned = "'" + pendulum + "' --points 2 --step 0.4 --until 4", wrong = "no-such-scene.toml";
    for (const char* streams : {"2>/dev/full", "2>&-", "2>&- </dev/null", "2>&1 | true"}) {
        CAPTURE(streams);
        const bool piped = std::string(streams).find('|') != std::string::npos;
        CHECK(shell(good, streams) == 0);
        if (!piped) CHECK(shell(wrong, streams) == 2);
        if (!piped) CHECK(shell(warned, streams) == shell(warned, "2>/dev/null"));
    }
    // What is told does not end up in the trajectory.
    CHECK(shell(warned, "2>&-") != 134);
    CHECK(!test::contains(test::read_file(place.file()), "warning"));
}

TEST_CASE("a momentum without an inverse at rest has a velocity where it has one") {
    const Place place;
    for (const char* lagrangian : {"q'^4/4 - q^2/2", "q'^4/4 + q'^6/6 - q^2/2", "(1 + q^2)*q'^4 - q^4"}) {
        const std::string scene = place.file("scene.toml");
        test::write_text(scene,
                         fmt::format("lagrangian = \"{}\"\n[coordinates]\nq = {{ position = 0, velocity = 0.1 }}\n"
                                     "[method]\npoints = 4\n[run]\nstep = 0.001\nuntil = 0.05\n",
                                     lagrangian));
        const test::Finished done = place.run({scene, "-o", place.file(), "--quiet"});
        CAPTURE(lagrangian);
        CAPTURE(done.err);
        CHECK(done.exit_code == 0);
        // It moves with nearly its velocity at first.
        const test::TrajectoryTable table = test::read_trajectory(place.file());
        CHECK(table.rows[10][1] == doctest::Approx(0.001).epsilon(0.05));
    }
}

TEST_CASE("a step too long for a contact is told as that, with a length that would do") {
    const Place place;
    int stopped = 0;
    for (const char* lagrangian :
         {"x'^2/2 - 9.81*x - exp(-x*2000)", "x'^2/2 - 9.81*x - 1e-20/x^8", "x'^2/2 - 9.81*x - exp(-x*300)"}) {
        const std::string scene = place.file("scene.toml");
        test::write_text(scene, fmt::format("lagrangian = \"{}\"\n[coordinates]\nx = {{ position = 1, velocity = 0 }}\n"
                                            "[method]\npoints = 6\n[run]\nstep = 0.05\nuntil = 0.6\n",
                                            lagrangian));
        const test::Finished done = place.run({scene, "-o", place.file(), "--quiet"});
        CAPTURE(lagrangian);
        CAPTURE(done.err);
        if (done.exit_code == 0) continue;  // soft enough
        REQUIRE(done.exit_code == 3);
        const std::string told = "Try a smaller step, such as h = ";
        const std::size_t at = done.err.find(told);
        if (test::contains(done.err, "the run is no longer accurate")) continue;  // it went on, but elsewhere
        ++stopped;
        CHECK(test::contains(done.err, ", with which the motion goes on there"));
        const std::size_t begin = at + told.size();
        const std::string step = done.err.substr(begin, done.err.find(',', begin) - begin);
        CHECK(place.run({scene, "-o", place.file(), "--quiet", "--unmeasured", "--step", step, "--until", "0.5"})
                  .exit_code == 0);
    }
    CHECK(stopped > 0);
}

TEST_CASE("a value that is set is refused where the formula as written has no value for it, though it cancels") {
    const test::TemporaryFolder folder;
    const std::string scene = folder / "scene.toml";
    test::write_text(
        scene,
        "lagrangian = \"x'^2/2 - sqrt(m - 2)^2*x^2/2\"\n[coordinates]\nx = { position = 1, velocity = 0 }\n"
        "[parameters]\nm = 3\n[run]\nstep = 0.1\nuntil = 1\n");
    for (const bool sweeps : {false, true}) {
        const auto with = [&](const std::string& value) {
            std::vector<std::string> words{
                LOBATTO_PROGRAM, sweeps ? "sweep" : "run", scene, "-o", folder / "out.csv", "--set", value};
            if (sweeps) words.insert(words.end(), {"--vary", "x=1,2"});
            return test::run(words);
        };
        CHECK(with("m=2.5").exit_code == 0);
        const test::Finished refused = with("m=1");
        CHECK(refused.exit_code == 2);
        CHECK(test::contains(refused.err, "a square root has no value at the start: it is of m - 2 = -1"));
    }
}

TEST_CASE("a run that leaves the domain of a formula is told, though the formula cancels") {
    const test::TemporaryFolder folder;
    const std::string scene = folder / "scene.toml";
    for (const char* term : {"exp(log(q - 3))", "sqrt(q - 3)^2", "((q - 3)^0.5)^2", "(q - 3)^1.5/(q - 3)^0.5",
                             "9*cos(acos((q - 9)/6))", "q*(q - 3)/(q - 3)"}) {
        test::write_text(scene, std::string("lagrangian = \"q'^2/2 - ") + term +
                                    "\"\n[coordinates]\nq = { position = 4, velocity = 0 }\n[run]\nstep = 0.1\n"
                                    "until = 3\n");
        const test::Finished done = test::run({LOBATTO_PROGRAM, "run", scene, "-o", folder / "out.csv"});
        CAPTURE(term);
        CAPTURE(done.err);
        const bool has_value = std::string(term) == "q*(q - 3)/(q - 3)";  // on both sides of one place
        CHECK(done.exit_code == (has_value ? 0 : 3));
        if (std::string(term) == "exp(log(q - 3))")
            CHECK(test::contains(done.err,
                                 "the run left the domain of the Lagrangian by t = 1.5, q = (2.875), p = (-1.5): a "
                                 "logarithm, line 1 column 28, is of q - 3 = -0.125, and has no value there"));
    }
}

TEST_CASE("a run that leaves the domain of a power is told where the parameter in it asks for a domain") {
    const test::TemporaryFolder folder;
    const std::string scene = folder / "scene.toml";
    test::write_text(
        scene,
        "lagrangian = \"q'^2/2 - q*(q - 3)^n/(q - 3)^n\"\n[coordinates]\nq = { position = 4, velocity = 0 }\n"
        "[parameters]\nn = 2\n[run]\nstep = 0.1\nuntil = 3\n");
    const auto done = [&](const std::string& n) {
        return test::run({LOBATTO_PROGRAM, "run", scene, "--set", "n=" + n, "-o", folder / "out.csv"});
    };
    CHECK(done("2").exit_code == 0);
    const test::Finished left = done("1.5");
    CHECK(left.exit_code == 3);
    CHECK(test::contains(left.err, "a power, line 1 column 33, is of q - 3 = -0.125, and has no value there"));
}

TEST_CASE("a root of abs(u) has no value beyond its switch, which is told; a smooth one goes on") {
    const test::TemporaryFolder folder;
    const auto done = [&](const std::string& size) {
        test::write_text(folder / "scene.toml", "lagrangian = \"x'^2/2 - sqrt(" + size +
                                                    ")\"\n[coordinates]\nx = { position = 1, velocity = 0 }\n"
                                                    "[method]\npoints = 6\n[run]\nstep = 0.05\nuntil = 3\n");
        return test::run({LOBATTO_PROGRAM, "run", folder / "scene.toml", "-o", folder / "out.csv"});
    };
    const test::Finished sharp = done("abs(x)");
    CHECK(sharp.exit_code == 3);
    CHECK(test::contains(sharp.err, "a square root, line 1 column 24, holds a switch, and has no value beyond it"));
    CHECK(done("sqrt(x^2 + 1e-4)").exit_code == 0);
}

TEST_CASE("energies beyond all numbers are told, and are no crash") {
    const test::TemporaryFolder folder;
    test::write_text(
        folder / "scene.toml",
        "lagrangian = \"q'^2/2 - exp(-900)*k*exp(q)\"\n[coordinates]\nq = { position = 600, velocity = 1 }\n"
        "[parameters]\nk = 1e300\n[run]\nstep = 0.1\nuntil = 1\n");
    const test::Finished done = test::run({LOBATTO_PROGRAM, "run", folder / "scene.toml", "-o", folder / "out.csv"});
    INFO(done.err);
    CHECK(done.exit_code == 3);
    CHECK(test::contains(done.err, "the run is wrong from step 1 on"));
}

TEST_CASE("an error above a hundredth of the amplitude is warned of, also with --quiet") {
    const Place place;
    const std::string scene = place.file("kepler.toml");
    test::write_text(scene,
                     "lagrangian = \"(x'^2 + y'^2)/2 + 1/sqrt(x^2 + y^2)\"\n[coordinates]\nx = { position = 0.1, "
                     "velocity = 0 }\ny = { position = 0, velocity = \"sqrt(19)\" }\n[method]\npoints = 5\n[run]\n"
                     "step = 0.02\nuntil = 60\n");
    const test::Finished done = place.run({scene, "-o", place.file("kepler.csv"), "--quiet"});
    CHECK(done.out == "");
    CHECK(test::contains(done.err, "lobatto: warning: "));
    CHECK(test::contains(done.err, "of the amplitude"));
}

TEST_CASE("a stop at the end of a step is the row of that step") {
    const Place place;
    test::write_text(place.file("free.toml"),
                     "lagrangian = \"x'^2/2\"\n[coordinates]\nx = { position = 0, velocity = 1 }\n[run]\n"
                     "step = 0.125\nuntil = 3\nstop = \"x = 1\"\n");
    REQUIRE(place.run({place.file("free.toml"), "-o", place.file()}).exit_code == 0);
    const auto rows = test::read_trajectory(place.file()).rows;
    CHECK(rows.size() == 9);
    CHECK(rows.back()[0] == 1);
    CHECK(rows[rows.size() - 2][0] == 0.875);
}

TEST_CASE("values on the command line decide where those of the scene allow no start") {
    const Place place;
    const auto run = [&](const std::string& text, const std::string& value) {
        test::write_text(place.file("scene.toml"), text);
        return place.run({place.file("scene.toml"), "-o", place.file(), "--set", value});
    };
    const std::string rod =
                          "lagrangian = \"(x'^2 + y'^2)/2 - 9.81*y\"\n[coordinates]\n"
                          "x = { position = 0.6, velocity = 0 }\ny = { position = -0.8, velocity = 0 }\n[constraints]\n"
                          "rod = \"x^2 + y^2 = l^2\"\n[parameters]\nl = 2\n[run]\nstep = 0.01\nuntil = 0.1\n",
                      wall =
                          "lagrangian = \"y'^2/2 - 9.81*y\"\n[coordinates]\ny = { position = 1, velocity = 0 }\n"
                          "[impacts]\nfloor = { when = \"y = b falling\", restitution = 0.5 }\n[parameters]\nb = 2\n"
                          "[run]\nstep = 0.01\nuntil = 0.5\n";
    CHECK(run(rod, "l=1").exit_code == 0);
    CHECK(test::contains(run(rod, "l=1.5").err, "its left side minus its right side is -1.25"));
    CHECK(run(rod, "l=2").exit_code == 2);
    CHECK(run(wall, "b=0.2").exit_code == 0);
    CHECK(run(wall, "b=1.5").exit_code == 2);
    CHECK(run(wall, "b=2").exit_code == 2);
}
