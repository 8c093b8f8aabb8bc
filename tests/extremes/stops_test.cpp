// SPDX-License-Identifier: GPL-2.0-or-later
// How `lobatto run` stops: why, at which step, time and state, with what advice; what was computed is kept, exit
// code 3.
#include <regex>

#include "tests/extremes/extremes.hpp"
#include "tests/trajectory_table.hpp"

using namespace lobatto;
using namespace lobatto::test;

namespace {

struct Stop {
    std::string lagrangian, coordinates, method, run;
    std::vector<std::string> words;  // of the message
    int states;                      // kept; -1: some
    std::vector<std::string> options{};
};

// Stops with exit code 3, a message with these words, the state, an advice, and the file of what was computed.
bool stops_so(const Stop& stop) {
    const TemporaryFolder folder;
    write_text(folder / "scene.toml", "title = \"T\"\nlagrangian = \"" + stop.lagrangian + "\"\n[coordinates]\n" +
                                          stop.coordinates + "\n[method]\n" + stop.method + "\n[run]\n" + stop.run +
                                          "\n");
    const std::string path = folder / "o.csv";
    std::vector<std::string> command{LOBATTO_PROGRAM, "run", folder / "scene.toml", "-o", path};
    command.insert(command.end(), stop.options.begin(), stop.options.end());
    const Finished done = test::run(command);
    command.push_back("--quiet");
    const Finished quiet = test::run(command);
    bool good = done.exit_code == 3 && quiet.exit_code == 3 && quiet.out.empty();
    for (const std::string& word : stop.words) good = good && done.err.find(word) != std::string::npos;
    const std::regex shape(
        "lobatto: \\S+scene.toml: the run .* t = \\S+ .*q = \\(.*\\), p = \\(.*\\): .*\\. Try .*\\.\\s[^]*");
    const std::size_t prefix = done.err.rfind("lobatto: ");
    const std::string last = prefix == std::string::npos ? "" : done.err.substr(prefix);
    good = good && std::regex_match(last, shape);
    if (stop.states != 0) {
        good = good && last.find(" What was computed is in ") != std::string::npos;
        const TrajectoryTable table = read_trajectory(path);
        good = good && !table.rows.empty() && (stop.states < 0 || std::ssize(table.rows) == stop.states);
    }
    if (!good) MESSAGE(done.exit_code << ", " << quiet.exit_code << ": " << done.out << done.err);
    return good;
}

Extreme stopped(const std::string& claim, const std::string& how, const Stop& stop) {
    return says("stop: " + how, claim, [stop] { return stops_so(stop); });
}

const std::string at_rest = "q = { position = 1, velocity = 0 }";
const std::string four = "points = 4";
const std::string wrong = "the energy, which the motion conserves, is off";

std::string run_of(const std::string& step, const std::string& until) {
    return "step = " + step + "\nuntil = " + until;
}

const Extremes table(
    7, "Stops",
    {
        stopped("pendulum, h omega = 20", "not converged, in its first step, the start kept",
                {"q'^2/2 + cos(q)",
                 "q = { position = 1.5, velocity = 0.25 }",
                 four,
                 run_of("20", "2000"),
                 {"stopped in its first step, at t = 0", "did not converge",
                  "Try a smaller step, such as h = 1.25, with which the motion goes on there"},
                 1}),
        stopped("oscillator, h omega = 3.2: just beyond the stability limit 3.1127", "beyond stability, by the energy",
                {"q'^2/2 - q^2/2",
                 at_rest,
                 four,
                 run_of("3.2", "1000"),
                 {wrong, "Try a smaller step, such as h = 1.6"},
                 313}),
        stopped("oscillator, at twice the limit", "beyond stability",
                {"q'^2/2 - q^2/2", at_rest, four, run_of("6.2", "1000"), {"stable"}, -1}),
        stopped("oscillator, at five times the limit", "beyond stability",
                {"q'^2/2 - q^2/2", at_rest, four, run_of("15.6", "1000"), {"stable"}, -1}),
        stopped("oscillator, at ten times the limit", "beyond stability",
                {"q'^2/2 - q^2/2", at_rest, four, run_of("31", "31000"), {"stable"}, -1}),
        stopped("the same, energy = false", "beyond stability, by the energy",
                {"q'^2/2 - q^2/2", at_rest, four, run_of("6.2", "1000") + "\n[output]\nenergy = false", {wrong}, -1}),
        stopped("the same with friction", "beyond stability, by the growth of a step",
                {"q'^2/2 - q^2/2",
                 at_rest,
                 four,
                 run_of("6.2", "1000") + "\n[forces]\nq = \"-0.001*q'\"",
                 {"a step multiplies the motion by 2.9", "h = 3.1"},
                 -1}),
        stopped("the same, driven in time", "beyond stability, by the growth of a step",
                {"q'^2/2 - q^2/2 + q*cos(t)/10\"\ntime = \"t",
                 at_rest,
                 four,
                 run_of("6.2", "1000"),
                 {"a step multiplies the motion by 2.9"},
                 -1}),
        stopped("stiff pendulum driven in time, h omega = 3.2: beyond the first limit",
                "nothing is left of the motion, by the companion",
                {"q'^2/2 + 100*cos(q) + 5*q*sin(t)\"\ntime = \"t",
                 "q = { position = 0.1, velocity = 0 }",
                 four,
                 run_of("0.32", "400"),
                 {"no longer accurate after t = ", "3.2 is more than 3.113", "h = 0.16"},
                 1251}),
        stopped("three coupled oscillators, at ten times the limit", "beyond stability",
                {"(x'^2 + y'^2 + z'^2)/2 - (x^2 + y^2 + z^2)/2 - (x - y)^2/4 - (y - z)^2/4",
                 "x = { position = 1, velocity = 0 }\ny = { position = 0, velocity = 0 }\nz = { position = 0, velocity "
                 "= 0 }",
                 four,
                 run_of("31", "31000"),
                 {"stable"},
                 -1}),
        stopped("pendulum by Verlet's method, h omega = 30", "beyond stability, by the energy",
                {"q'^2/2 + cos(q)",
                 "q = { position = 1.5, velocity = 0.25 }",
                 "points = 2",
                 run_of("30", "3000"),
                 {wrong},
                 101}),
        stopped("q'' = 24 q, h = 1, 3 points: the determinant 1 - 24 h^2/24 vanishes",
                "singular Jacobian, nothing begun",
                {"q'^2/2 + 12*q^2",
                 at_rest,
                 "points = 3",
                 run_of("1", "10"),
                 {"Jacobian is singular", "a slightly different one"},
                 0}),
        stopped("the same of two coordinates", "singular Jacobian, nothing begun",
                {"(x'^2 + y'^2)/2 + 12*x^2 + 12*y^2",
                 "x = { position = 1, velocity = 0 }\ny = { position = 0, velocity = 1 }",
                 "points = 3",
                 run_of("1", "10"),
                 {"Jacobian is singular", "a slightly different one"},
                 0}),
        stopped("q'' = 4 q^3: at infinity before t = 0.93", "not finite, all steps before it kept",
                {"q'^2/2 + q^4",
                 at_rest,
                 four,
                 run_of("0.01", "3"),
                 {"infinite or not a number", "Try a smaller step, such as h = 0.005"},
                 -1}),
        stopped("Kepler's problem, straight into the centre", "past a singularity, by the energy",
                {"(x'^2 + y'^2)/2 + 1/sqrt(x^2 + y^2)",
                 "x = { position = 1, velocity = 0 }\ny = { position = 0, velocity = 0 }",
                 four,
                 run_of("0.01", "3"),
                 {wrong, "past a singularity"},
                 301}),
        stopped("the same by Gauss with 2 stages", "not converged",
                {"(x'^2 + y'^2)/2 + 1/sqrt(x^2 + y^2)",
                 "x = { position = 1, velocity = 0 }\ny = { position = 0, velocity = 0 }",
                 "family = \"gauss\"\nstages = 2",
                 run_of("0.01", "3"),
                 {"did not converge", "singularity"},
                 -1}),
        stopped("Kepler's ellipse, e = 0.999, h = 0.001", "beyond stability, by the energy",
                {"(x'^2 + y'^2)/2 + 1/sqrt(x^2 + y^2)",
                 "x = { position = 0.001, velocity = 0 }\ny = { position = 0, velocity = \"sqrt(1999)\" }",
                 four,
                 run_of("0.001", "6.283"),
                 {wrong, "beyond the linear stability limit"},
                 6284}),
        stopped("Kepler's ellipse, e = 0.98, from its pericentre, h = 0.006", "past a singularity, by the energy",
                {"(x'^2 + y'^2)/2 + 1/sqrt(x^2 + y^2)",
                 "x = { position = \"1/50\", velocity = 0 }\ny = { position = 0, velocity = \"sqrt(99)\" }",
                 four,
                 run_of("0.006", "12"),
                 {wrong, "The step is too long"},
                 2001}),
        stopped("the pendulum beyond its separatrix, clean, h = 10", "not converged or wrong by the energy",
                {"q'^2/2 + cos(q)",
                 "q = { position = 0, velocity = 3 }",
                 "points = 4\narithmetic = \"clean\"",
                 run_of("10", "10000"),
                 {"step"},
                 -1}),
        stopped("past the end of log q", "past a singularity, by the logarithm",
                {"q'^2/2 - log(q)",
                 "q = { position = 1, velocity = -100 }",
                 four,
                 run_of("0.01", "3"),
                 {"left the domain of the Lagrangian", "a logarithm"},
                 301}),
        stopped("potential of degree 20, h = 5", "not finite",
                {"q'^2/2 - q^20/20", at_rest, "points = 6", run_of("5", "1000"), {"Try a smaller step"}, -1}),
        stopped("pendulum from 1e15 rad: a step is less than the rounding, 0.1 rad", "by the energy, with the reason",
                {"q'^2/2 + cos(q)",
                 "q = { position = 1e15, velocity = 0 }",
                 four,
                 run_of("0.05", "10"),
                 {wrong, "Positions are so large that the potential changes its shape", "nearer to the motion"},
                 201}),
        stopped("pendulum from 1e22 rad", "by the energy, with the reason",
                {"q'^2/2 + cos(q)",
                 "q = { position = 1e22, velocity = 0 }",
                 four,
                 run_of("0.05", "20"),
                 {wrong, "Positions are so large"},
                 -1}),
        stopped("a mass matrix that --set c=1 makes singular", "singular mass matrix, nothing begun",
                {"(x'^2 + 2*c*x'*y' + y'^2)/2 - x^2/2",
                 "x = { position = 1, velocity = 0 }\ny = { position = 1, velocity = 1 }\n[parameters]\nc = 0.5",
                 four,
                 run_of("0.01", "1"),
                 {"mass matrix has no inverse", "none of the masses may vanish"},
                 0,
                 {"--set", "c=1"}}),
        stopped("forces too large for numbers", "not finite, nothing begun",
                {"q'^2/2 - 1e299*q^4",
                 "q = { position = 1e5, velocity = 0 }",
                 four,
                 run_of("0.01", "1"),
                 {"cannot begin", "other units"},
                 0}),
    });

}  // namespace

TEST_CASE("a run that cannot go on, or has gone wrong, says where and why, keeps what it has, and returns 3") {
    table.check();
}
