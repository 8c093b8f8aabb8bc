// SPDX-License-Identifier: GPL-2.0-or-later
// Writes docs/choosing.md and its pictures from measurements on this machine: which member of the family for what.
//
//   bench_choosing FOLDER [SCENE...]
//
// What is measured is kept in FOLDER and not measured again, so that an interrupted call goes on where it was. With
// names of scenes only those are measured, and no page is written.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <limits>
#include <set>

#include "analysis/tradeoff/search.hpp"
#include "cli/print/drawing.hpp"
#include "cli/tradeoff/pictures.hpp"
#include "cli/tradeoff/report.hpp"
#include "generator/pipeline.hpp"
#include "runtime/files/partial_file.hpp"

using namespace lobatto;

namespace {

const std::string docs = LOBATTO_SOURCE_DIR "/docs", folder = docs + "/choosing";
constexpr double reference_seconds = 60;  // of which the reference takes a part
constexpr double targets[] = {1e-3, 1e-6, 1e-9, 1e-12};

struct Example {
    const char *scene, *about;
};
constexpr Example examples[] = {{"pendulum", "one angle, cheap forces"},
                                {"henon_heiles", "two coordinates, smooth and weakly nonlinear"},
                                {"kepler", "an ellipse of eccentricity 0.6: fast and slow in turn"},
                                {"double_pendulum", "a mass matrix that depends on the angles"},
                                {"stiff_fput", "stiff springs, fast and slow frequencies"}};

using Filter = std::function<bool(const Candidate&)>;

const Measurement* fastest(const Experiment& experiment, double target, const Filter& filter) {
    const Measurement* best = nullptr;
    for (const auto& [key, m] : experiment.store().all())
        if (m.complete && m.error <= target && filter(m.candidate) && (best == nullptr || m.seconds < best->seconds))
            best = &m;
    return best;
}

double least_error(const Experiment& experiment, const Filter& filter) {
    double least = std::numeric_limits<double>::infinity();
    for (const auto& [key, m] : experiment.store().all())
        if (m.complete && filter(m.candidate)) least = std::min(least, m.error);
    return least;
}

Filter in(Precision precision) {
    return [=](const Candidate& c) { return c.member.precision == precision; };
}

// The double members of which `claim` holds.
Filter doubles(const std::function<bool(const Member&)>& claim) {
    return [=](const Candidate& c) { return c.member.precision == Precision::double_ && claim(c.member); };
}

std::string error_text(double error) {
    return std::isfinite(error) ? fmt::format("{:.0e}", error) : "–";
}

std::string ratio_text(const Measurement* a, const Measurement* b) {
    return a != nullptr && b != nullptr ? fmt::format("{:.2f}", a->seconds / b->seconds) : "–";
}

struct Tables {
    std::string winners, gauss, high, types, stiff, pictures;
};

// What each member takes for each error, so that no table has a gap for want of a measurement: the coarsest steps that
// reach it; then the fastest few with looser iterations. Runs of more than half a second are not begun.
void measure_all(Experiment& experiment) {
    KernelBuilder& kernel_builder = experiment.kernel_builder();
    const auto say = [&](const Member& member) {
        experiment.request().say(
            fmt::format("{} in {}", Candidate{member, 0, 0}.name(), precision_name(member.precision)));
    };
    std::vector<std::pair<Member, std::vector<double>>> wishes;
    const std::vector<double> all(std::begin(targets), std::end(targets));
    for (const Member& member : family_in(Precision::double_, experiment.derivation().system.separable))
        wishes.emplace_back(member, all);
    for (const int points : {4, 6, 8, 9})
        wishes.push_back({{Family::lobatto, points, Precision::single}, {1e-3, 1e-9}});
    for (const int points : {9, 12}) wishes.push_back({{Family::lobatto, points, Precision::extended}, {1e-12, 1e-17}});
    wishes.push_back({{Family::lobatto, 12, Precision::quadruple}, {1e-12, 1e-20}});
    for (const auto& [member, goals] : wishes) kernel_builder.order(member);
    std::vector<std::vector<Measurement>> reached(std::size(targets));
    for (const auto& [member, goals] : wishes) {
        say(member);
        for (const double goal : goals) {
            const Attempt crossing = cross(experiment, member, goal);
            const auto place = std::find(std::begin(targets), std::end(targets), goal);
            if (crossing.measurement && member.precision == Precision::double_)
                reached[static_cast<std::size_t>(place - std::begin(targets))].push_back(*crossing.measurement);
        }
    }
    for (std::size_t i = 0; i < reached.size(); ++i) {
        std::sort(reached[i].begin(), reached[i].end(),
                  [](const Measurement& a, const Measurement& b) { return a.seconds < b.seconds; });
        for (std::size_t k = 0; k < std::min<std::size_t>(4, reached[i].size()); ++k) {
            say(reached[i][k].candidate.member);
            polish(experiment, reached[i][k], targets[i]);
        }
    }
}

// Steps that pass over the fast oscillations of stiff springs: what energy is left.
constexpr double long_steps[] = {0.5, 1, 2, 2.8, 4, 8, 16};

std::string stiff_rows(Experiment& experiment) {
    const double radians = experiment.until() * experiment.reference().frequency;
    const StepLadder ladder(experiment.reference().samples, 1.1);
    std::string rows;
    for (const Member& member : {Member{Family::lobatto, 2}, Member{Family::lobatto, 4}, Member{Family::lobatto, 8},
                                 Member{Family::gauss, 1}, Member{Family::gauss, 3}, Member{Family::gauss, 7}}) {
        rows += fmt::format("| {} |", Candidate{member, 0, 0}.name());
        for (const double step : long_steps) {
            const Measurement m = experiment.measure({member, ladder.at_least(radians / step), 0});
            rows += m.complete && m.energy_error < 10 ? fmt::format(" {:.0e} |", m.energy_error) : " fails |";
        }
        rows += '\n';
    }
    return rows;
}

void measure(const Example& example, const std::string& kept, bool draws, Tables& tables) {
    const Scene scene = read_scene(fmt::format("{}/scenes/{}.toml", LOBATTO_SOURCE_DIR, example.scene));
    ExperimentRequest request;
    request.seconds = reference_seconds;
    request.store = fmt::format("{}/{}.jsonl", kept, example.scene);
    const Derivation derivation = derive(scene);
    request.first = family_in(Precision::double_, derivation.system.separable);
    request.say = [&](const std::string& what) { fmt::print(stderr, "{}: {}\n", scene.name, what); };
    request.tries_clocks = false;
    Experiment experiment(scene, scene, request);
    measure_all(experiment);
    if (std::string(example.scene) == "stiff_fput") tables.stiff = stiff_rows(experiment);
    const double until = experiment.until(), omega = experiment.reference().frequency;

    const auto any = [](const Member&) { return true; };
    const auto is_gauss = [](const Member& m) { return m.family == Family::gauss; };
    const auto is_lobatto = [](const Member& m) { return m.family == Family::lobatto; };
    std::string winners = fmt::format("| `{}`: {} |", example.scene, example.about),
                gauss = fmt::format("| `{}` |", example.scene), high = gauss;
    for (const double target : targets) {
        const Measurement* best = fastest(experiment, target, doubles(any));
        winners += best == nullptr ? " – |"
                                   : fmt::format(" {}, hω = {:.2g}: {:.3g} |", best->candidate.name(),
                                                 until / static_cast<double>(best->candidate.steps) * omega,
                                                 best->seconds / until * 1e9);
        gauss += fmt::format(" {} |", ratio_text(fastest(experiment, target, doubles(is_gauss)),
                                                 fastest(experiment, target, doubles(is_lobatto))));
        high += fmt::format(
            " {} |", ratio_text(fastest(experiment, target, doubles([](const Member& m) { return m.order() <= 6; })),
                                fastest(experiment, target, doubles([](const Member& m) { return m.order() >= 18; }))));
    }
    tables.winners += winners + '\n';
    tables.gauss += gauss + '\n';
    tables.high += high + '\n';
    tables.types += fmt::format(
        "| `{}` | {} | {} | {} | {} | {} | {} | {} |\n", example.scene,
        ratio_text(fastest(experiment, 1e-3, in(Precision::single)), fastest(experiment, 1e-3, in(Precision::double_))),
        error_text(least_error(experiment, in(Precision::single))),
        error_text(least_error(experiment, in(Precision::double_))),
        error_text(least_error(experiment, in(Precision::extended))),
        error_text(least_error(experiment, in(Precision::quadruple))),
        ratio_text(fastest(experiment, 1e-12, in(Precision::extended)),
                   fastest(experiment, 1e-12, in(Precision::double_))),
        ratio_text(fastest(experiment, 1e-12, in(Precision::quadruple)),
                   fastest(experiment, 1e-12, in(Precision::double_))));

    if (!draws) return;
    const std::string own = folder + "/" + example.scene;
    std::filesystem::create_directories(own);
    draw_pictures(experiment, own);
    std::filesystem::rename(own + "/work_precision.svg", own + ".svg");
    std::filesystem::remove_all(own);
    tables.pictures += fmt::format("![{0}](choosing/{0}.svg)\n", example.scene);
}

constexpr const char* page_text =
    R"(# Choosing a method

Nobody has to: `lobatto tune SCENE --error 1e-8` chooses, and `lobatto tradeoff SCENE` shows the whole trade on your machine. This page says what they find. Its
tables and pictures are written by a command, which takes some ten minutes, measures on the machine it runs on, and goes on where it was when it is called again:

    ninja -C build/release bench_choosing && build/release/bench_choosing choosing

Errors are the largest on the way to the scene's end, relative to the amplitude of the motion; times are nanoseconds of processor time per unit of the scene's time, on
one core that was not alone. ω is the largest frequency of the motion.

## Which member for which accuracy

The fastest in double precision for an error, its step in units of 1/ω, and the cost per unit of time:

{head}{winners}
- Read along a row: nine more digits cost two to six times as much, not a thousand times. Accuracy is cheap once the order is high.
- Take **Lobatto with 8 to 10 points, hω near 2,** when you do not want to think; iterate to a tolerance a hundredth of the error wanted, or to rounding when
  energies matter for long times.
- Low orders (Störmer–Verlet is Lobatto 2) win only where a few per cent of error is enough, or where the force has no smooth derivatives.

{pictures}
## What high orders are good for

How many times longer the best of order up to 6 takes than the best of order 18 to 22 (–: one of the two does not reach this error, or not within half a second):

{head}{high}
## When Gauss beats Lobatto

The best Gauss against the best Lobatto, ratio of times (below 1: Gauss is faster; –: one of the two does not reach this error, or not within half a second):

{head}{gauss}
Lobatto reuses the gradient at the end of a step and has a node less to solve for; of the same order, it is ahead where the mass is constant. With a mass matrix that depends on the
position all nodes are solved for, and Gauss is ahead.

Gauss is stable for every step, Lobatto up to a limit (`lobatto stability`). Steps that pass over the fast oscillations of `stiff_fput`, whose stiff springs hold most of ω, and the largest energy error to the scene's
end, relative to the energy of motion (fails: the step's equations have no solution, or the energy grows tenfold):

| hω | {long_steps} |
|---|{dashes}
{stiff}

## Number types

What float saves at an error of 1e-3, the least error each type reaches within half a second, and how many times longer wider types take for 1e-12:

| scene | float : double at 1e-3 | least, float | double | long double | __float128 | long double : double | __float128 : double |
|---|---|---|---|---|---|---|---|
{types}
float is for ensembles, where twice as many trajectories fit into a register, and errors of 1e-4 will do; one trajectory gains little or nothing. long double costs some 10 to 50
times (no vector registers) and gives three more digits; __float128 is for references.

Double-double has 31 digits at three to four times the time of double, as it computes in the same vector registers; it is in the table below. `lobatto tune` takes it where double cannot reach the error: of `henon_heiles` 1e-20 to t = 20 needs Lobatto 12 with 24 steps in 20 units of time.

## Which numbers for which error

`bench/ladder` measures the whole ladder: `henon_heiles` to t = 100 by Lobatto with 12 points, nanoseconds of processor
time per unit of the scene's time (least of five runs), and the error at the end that the run measures:

| numbers | h = 2 | h = 1 | h = 0.5 | h = 0.25 | least error | for errors from |
|---|---|---|---|---|---|---|
| float | 100, 2e-06 | | | | 2e-06 | 1e-4 |
| double | 134, 5e-13 | 179, 7e-16 | | | 7e-16 | 1e-14 |
| long double | 1.87e+03, 5e-13 | 2.91e+03, 6e-18 | | | 6e-18 | 1e-17 |
| double-double | 412, 5e-13 | 702, 3e-20 | 1.27e+03, 1e-27 | 2.18e+03, 2e-30 | 2e-30 | 1e-29 |
| quadruple | 1.90e+05, 5e-13 | 1.15e+05, 3e-20 | 1.68e+05, 1e-27 | 2.70e+05, 8e-33 | 8e-33 | 1e-32 |
| 50 digits | 3.54e+05, 5e-13 | 5.30e+05, 3e-20 | 8.40e+05, 1e-27 | 1.38e+06, 2e-34 | 9e-50 with h = 0.05, 4.42e+06 | any |

- **Double-double is the rung above double.** At the same step it takes 3 to 4 times the time of double (the aim was at
  most 12), and a hundredth or less of that of quadruple (the aim was an eighth). It is faster than long double, too,
  which gives three digits more than double and costs 14 to 16 times as much.
- Its floor of rounding is 2e-30 after 100 units of time. Below that take quadruple for three digits more, or as many
  digits as you like: `"50 digits"` takes 2 to 5 times the time of quadruple, 3,000 times that of double, and
  went down to 9e-50.
- **Float is for ensembles.** Of 8192 stars (6 points, h = 0.5) a step of one takes 7.4 ns in float and 25 ns in double:
  3.4 times the throughput (the aim was 1.8), as twice as many lanes fit into a register and fewer iterations reach
  rounding. One trajectory gains a quarter.

## Clocks and constraints

Where the Lagrangian has poles, `tune` and `tradeoff` also try `clock = "auto"`, and where the scene has a clock, that
one and equal steps. Errors are compared at the same physical times. Nanoseconds per unit of time for Kepler's problem
with e = 0.9 over ten revolutions, by `lobatto tradeoff` (`scenes/kepler.toml` with x = 0.1, y' = sqrt(19) and
until = 20*pi):

| | 1e-3 | 1e-6 | 1e-9 |
|---|---|---|---|
| `clock = "auto"` | 863 | 1,170 | 1,450 |
| equal steps | 1,260 | 2,050 | 2,820 |

The Pythagorean problem to t = 10 takes 0.2 ms for 1e-9 with a clock, 11 ms in equal steps. With e = 0.99 an error of
1e-9 is below the rounding of plain arithmetic; `tune` takes clean arithmetic then, in equal steps. A clock computes in
double.

With constraints the family is Lobatto's: `rod_double_pendulum` takes 9 points and 27 steps per unit of time for 1e-9 to
t = 50. Positions and momenta count in the error, as ever; where walls throw the motion back, positions alone.

## The error of a run

`lobatto run` measures its error, by a second run beside it: [how, and how well](errors.md).
)";

std::string page(const Tables& tables) {
    std::string dashes;
    for (std::size_t i = 0; i < std::size(long_steps); ++i) dashes += "---|";
    const std::string head = "| scene | 1e-3 | 1e-6 | 1e-9 | 1e-12 |\n|---|---|---|---|---|\n";
    return fmt::format(page_text, fmt::arg("head", head), fmt::arg("winners", tables.winners),
                       fmt::arg("pictures", tables.pictures), fmt::arg("long_steps", fmt::join(long_steps, " | ")),
                       fmt::arg("dashes", dashes), fmt::arg("stiff", tables.stiff), fmt::arg("high", tables.high),
                       fmt::arg("gauss", tables.gauss), fmt::arg("types", tables.types));
}

}  // namespace

int main(int argc, char** argv) {
    if (argc < 2) {
        fmt::print(stderr, "bench_choosing FOLDER [SCENE...]\n");
        return 2;
    }
    const std::string kept = argv[1];
    const std::set<std::string> some(argv + 2, argv + argc);
    try {
        std::filesystem::create_directories(kept);
        std::filesystem::create_directories(folder);
        Tables tables;
        for (const Example& example : examples)
            if (some.empty() || some.count(example.scene) != 0) measure(example, kept, some.empty(), tables);
        if (!some.empty()) return 0;
        PartialFile file(docs + "/choosing.md", "the page");
        file.write(page(tables));
        file.finish();
        return 0;
    } catch (const std::exception& error) {
        fmt::print(stderr, "{}\n", error.what());
        return 4;
    }
}
