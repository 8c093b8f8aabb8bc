// SPDX-License-Identifier: GPL-2.0-or-later
// How well the errors that `lobatto run` estimates follow the true ones, over the scenes, members and steps
// (docs/estimate.md).
//
//   bench_estimate FILE.csv SCENE...
//   bench_estimate --page FILE.csv docs
//
// A scene's rows are appended to FILE.csv when all are known; scenes that are there are not measured again.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <map>
#include <sstream>

#include "analysis/tradeoff/calibration.hpp"
#include "analysis/tradeoff/experiment.hpp"
#include "cli/print/drawing.hpp"
#include "generator/pipeline.hpp"
#include "runtime/error.hpp"
#include "runtime/run/partial_file.hpp"

using namespace lobatto;

namespace {

constexpr double seconds_a_scene = 60;  // of which the reference takes a part
constexpr double longest_run = 0.4;     // seconds
constexpr double least = 1e-11;         // smaller errors are rounding's
constexpr double fewest_radians = 4;    // h omega of the coarsest steps
constexpr double parts[] = {0.05, 0.1, 0.5, 0.9, 0.95};

std::vector<Member> members(bool is_separable) {
    std::vector<Member> list;
    for (const int points : {2, 3, 4, 6, 8, 10, 12}) list.push_back({Family::lobatto, points});
    for (const int stages : {1, 2, 4, 6, 8, 10}) list.push_back({Family::gauss, stages});
    for (const int stages : sizes_of(Family::splitting))
        if (is_separable) list.push_back({Family::splitting, stages});
    return list;
}

bool has(const std::string& file, const std::string& scene) {
    std::ifstream in(file);
    for (std::string line; std::getline(in, line);)
        if (line.starts_with(scene + ',')) return true;
    return false;
}

void measure(const std::string& path, const std::string& file) {
    const Scene scene = read_scene(path);
    if (has(file, scene.name)) return;
    ExperimentRequest wish;
    wish.seconds = seconds_a_scene;
    wish.wanted = 1e-12;
    const Derivation derivation = derive(scene);
    const std::vector<Member> list = members(derivation.system.separable);
    wish.first = list;
    Experiment experiment(derivation, scene, wish);
    const StepLadder ladder(experiment.reference().samples, 1.35);
    const double until = experiment.until(), uncertainty = experiment.reference().disagreement.back();
    std::string rows;
    int count = 0;
    for (const Member& member : list) {
        double best = std::numeric_limits<double>::infinity();
        int no_better = 0;
        const double coarsest = until * experiment.reference().frequency / fewest_radians;
        for (std::int64_t steps = ladder.at_least(std::max(1.0, coarsest)); steps < 1000000;
             steps = ladder.next(steps)) {
            const Measurement m = experiment.measure({member, steps, 0});
            no_better = m.complete && m.error < 0.7 * best ? 0 : no_better + 1;
            if (m.complete) best = std::min(best, m.error);
            if (m.complete && m.error > 100 * uncertainty && m.error < 0.1) {
                rows += fmt::format("{},{},{},{},{:.4g},{:.4g},{:.4g},{:.4g}\n", scene.name, word_of(member.family),
                                    member.points, steps, m.error, m.jump, m.growth, m.estimate);
                ++count;
            }
            if (m.seconds > longest_run || best < least || (no_better >= 4 && best < 1e-6)) break;
        }
    }
    if (count == 0) rows = scene.name + ",,,,,,,\n";  // nobody knows this motion to its end
    std::ofstream(file, std::ios::app) << rows << std::flush;
    fmt::print(stderr, "{}: {} runs in {:.0f} s\n", scene.name, count, experiment.elapsed());
}

std::map<std::string, std::vector<Measurement>> read(const std::string& path) {
    std::map<std::string, std::vector<Measurement>> result;
    std::ifstream in(path);
    for (std::string line; std::getline(in, line);) {
        std::vector<std::string> cells;
        std::istringstream text(line);
        for (std::string cell; std::getline(text, cell, ',');) cells.push_back(cell);
        if (cells.empty()) continue;
        std::vector<Measurement>& list = result[cells[0]];
        if (cells.size() < 8) continue;
        Measurement m;
        m.candidate.member = {family_of(cells[1]), std::atoi(cells[2].c_str())};
        m.candidate.steps = std::atoll(cells[3].c_str());
        m.complete = true;
        m.error = std::strtod(cells[4].c_str(), nullptr);
        m.jump = std::strtod(cells[5].c_str(), nullptr);
        m.growth = std::strtod(cells[6].c_str(), nullptr);
        m.estimate = std::strtod(cells[7].c_str(), nullptr);
        list.push_back(m);
    }
    return result;
}

std::string row(const std::string& name, std::vector<double> by_run, std::vector<double> by_laws) {
    std::sort(by_run.begin(), by_run.end());
    std::sort(by_laws.begin(), by_laws.end());
    std::string text = fmt::format("| {} | {} |", name, by_run.size());
    for (const auto* list : {&by_run, &by_laws})
        for (const double part : parts) text += list->empty() ? " – |" : fmt::format(" {:.2g} |", part_of(*list, part));
    return text + '\n';
}

std::string page_of(const std::map<std::string, std::vector<Measurement>>& scenes) {
    std::string by_scene, by_member, unknown;
    std::vector<double> all_run, long_run, all_laws;
    std::map<Member, std::vector<double>> member_run, member_laws;
    for (const auto& [scene, list] : scenes) {
        std::vector<Measurement> runs = telling(list, least);
        if (runs.empty()) {
            unknown += (unknown.empty() ? "`" : ", `") + scene + "`";
            continue;
        }
        const Calibration calibration = calibrate(runs);
        for (const Measurement& m : runs)
            if (m.growth == 0) long_run.push_back(m.error / m.estimate);
        std::erase_if(runs, [](const Measurement& m) { return m.growth == 0; });
        const std::vector<double> by_run = calibrate(runs).by_run;
        by_scene += row(fmt::format("`{}`", scene), by_run, calibration.by_laws);
        all_run.insert(all_run.end(), by_run.begin(), by_run.end());
        all_laws.insert(all_laws.end(), calibration.by_laws.begin(), calibration.by_laws.end());
        for (const Measurement& m : runs) {
            member_run[m.candidate.member].push_back(m.error / m.estimate);
            for (const Calibration::Law& law : calibration.laws)
                if (law.member == m.candidate.member && m.jump > 0)
                    member_laws[law.member].push_back(m.error / law.error(m));
        }
    }
    for (const auto& [member, list] : member_run)
        by_member += row(Candidate{member, 0, 0}.name(), list, member_laws[member]);
    const auto share = [&](double from, double to) {
        const auto count = std::count_if(all_run.begin(), all_run.end(), [&](double x) { return x > from && x < to; });
        return 100.0 * static_cast<double>(count) / static_cast<double>(std::max<std::size_t>(1, all_run.size()));
    };
    const auto laws_share = [&](double factor) {
        const auto count =
            std::count_if(all_laws.begin(), all_laws.end(), [&](double x) { return x > 1 / factor && x < factor; });
        return 100.0 * static_cast<double>(count) / static_cast<double>(std::max<std::size_t>(1, all_laws.size()));
    };
    return fmt::format(
        R"(# The error of a run

## How `run` measures it

Beside every run goes a companion, on another processor: the same motion in 3/2 of the steps, from a start that is one unit in the last place away. With a method of order p the difference D of the two is (1 − r^−p)
times the error of the run, r the ratio of the steps; where rounding decides, D is about the error itself. Positions are compared at up to 256 times, each coordinate relative to its own amplitude; the coordinates
of an array share one. `analysis/accuracy/companion.cpp` holds all of it, `tests/analysis/companion_test.cpp` checks it: within a factor of two of the true error with six methods on Hénon–Heiles.

- **Nothing left.** Where a position or a momentum of the two differs by half of its amplitude, nothing of the motion is left: exit code 3, unless `--beyond-horizon` or `beyond_horizon = true` under `[run]` asks for
  the statistics of what follows. Errors that grow exponentially are said to double in a time.
- **Warnings.** Above 3 % of the amplitude, and above twice the error that the scene asks for.
- **Pulses.** A pulse in the explicit time may fall between all nodes of both. The formulas tell where it is: the maximum of u in exp(u), a complex root of u in 1/u, a root of u in tanh(u) or 1/cosh(u). There the
  companion takes steps of half its width, growing to an eighth of the distance.
- **Rounding.** A coordinate that moves by less than 2^−40 of its place, or by less than 10^−10 of what the others move it by in one step, is moved by rounding and tells nothing.
- **Long runs.** Of a run above one second the companion compares what it has reached when the run ends; the rest is extrapolated and said to be. `--unmeasured` runs without it.

The rest of this page is about the estimate that experiments record beside their measured errors, and that `run` printed before it measured. It is written by

    ninja -C build/release bench_estimate
    build/release/bench_estimate estimate.csv scenes/*.toml && build/release/bench_estimate --page estimate.csv docs

## How the estimate is made

It looks at 64 of its states, and at two or three steps from each; and at the few steps in which the motion changes most.

- **Energy.** The steps follow a modified energy H + h^p H_p (nearly) exactly, so H swings by as much as h^p H_p does; and the angles of the motion turn faster by about the same part. With E the range of H
  over the mean of |p·v|, and Ω the fastest rate at which a coordinate or a momentum changes by its amplitude: error = E/4 · Ω · time. The quarter is the only constant fitted, once, for all scenes and members.
- **Halves.** With forces or explicit time there is no such energy, and Gauss conserves its quadratic part whatever the error. There the end of a step is compared with that of two steps of half its length,
  and the differences are added.
- **Polynomials.** The polynomial of a step, carried on into the next, misses that one's by J. One harmonic oscillation has the same J, and its phase error is known exactly (D20). If that is larger,
  it is taken. Alone it will not do: on motions with harmonics it is too small, the more so the higher the order, up to 10⁹ times with 12 points, because the error is made by harmonics that the polynomial does not resolve.
- **Single steps.** Of all kept states it also keeps those after which a position, a momentum or the energy changes most. From each it takes one step and two of half its length: their difference, relative to
  the amplitude, is an error that has been made once, and the estimate is at least that. On ordinary motions it is far below the rest; in a close encounter it decides. Where the difference is more than a tenth of
  what the step moves, or on the straight way from one state to the next a velocity or a force is 100 times as large as at both ends (the step jumps over a singularity), `run` warns that the step does not
  resolve the motion. With `--every` the steps between two kept states are taken again, where these are at most 3·10⁵ steps times numbers of a state.
- **Certain.** An error ε of the amplitude changes the energy by at most ε Σ (|∂H/∂q| A_q + |∂H/∂p| A_p). So the energy error at a state is a lower bound of the error, for Gauss as for Lobatto.
  Energies that are rounding in double, as of small motions, are taken in 60 digits, up to 64 coordinates.
- **Neighbours.** A run that is short (steps times coordinates up to 3·10⁵, some 0.1 s) is done once more from a start 10⁻⁷ beside it. Where the two part faster than Ω · time, as chaotic motions do, errors grow
  likewise. Of longer runs this is not known.

## How `tradeoff` calibrates

One step's error has the power p + 1 of the step, J that of the polynomials' degree + 1. So error = a · steps · J^b with b = (p + 1)/(degree + 1), J the mean over the 64 states to the power b, and a to be measured for
each member on the scene: the median over its runs. It needs no force, no energy and no second run. Linear systems with constant steps have no polynomials (–).

![estimate](choosing/estimate.svg)

## How well

True error over the estimate, for errors from {least:.0e}, or 30 times what rounding leaves, to 0.1: twentieth, tenth, median, nine tenths, nineteen twentieths. Of the calibrated one each run is left out of its own
calibration. Runs too long for a second one are not in the columns of the estimate, but in the line below.

| scene | runs | estimate: 5 % | 10 % | 50 % | 90 % | 95 % | calibrated: 5 % | 10 % | 50 % | 90 % | 95 % |
|---|---|---|---|---|---|---|---|---|---|---|---|
{by_scene}{all}{long}
| member | runs | estimate: 5 % | 10 % | 50 % | 90 % | 95 % | calibrated: 5 % | 10 % | 50 % | 90 % | 95 % |
|---|---|---|---|---|---|---|---|---|---|---|---|
{by_member}
The estimate is within a factor of 10 in {ten:.0f} % of {runs} runs, of 100 in {hundred:.1f} %, of 1000 in {thousand:.1f} %; the calibrated one within 3 in {three:.0f} %, within 10 in {laws_ten:.0f} %.

{unknown}
)",
        fmt::arg("least", least), fmt::arg("by_scene", by_scene), fmt::arg("all", row("all", all_run, all_laws)),
        fmt::arg("long", row("long runs", long_run, {})), fmt::arg("by_member", by_member),
        fmt::arg("ten", share(0.1, 10)), fmt::arg("hundred", share(0.01, 100)),
        fmt::arg("thousand", share(0.001, 1000)), fmt::arg("three", laws_share(3)),
        fmt::arg("laws_ten", laws_share(10)), fmt::arg("runs", all_run.size()),
        fmt::arg("unknown", unknown.empty() ? "" : "Not here, for want of runs with such errors: " + unknown + "."));
}

// How often which ratio: in per cent of the runs, in bins of a quarter of a decade.
void draw_ratios(const std::map<std::string, std::vector<Measurement>>& scenes, const std::string& docs) {
    std::vector<double> by_run, by_laws;
    for (const auto& [scene, list] : scenes) {
        std::vector<Measurement> runs = telling(list, least);
        const Calibration calibration = calibrate(runs);
        by_laws.insert(by_laws.end(), calibration.by_laws.begin(), calibration.by_laws.end());
        for (const Measurement& m : runs)
            if (m.growth > 0) by_run.push_back(m.error / m.estimate);
    }
    const auto shares = [](const std::vector<double>& ratios) {
        std::string text;
        for (int bin = -18; bin <= 18; ++bin) {
            const auto count = std::count_if(ratios.begin(), ratios.end(),
                                             [&](double x) { return std::lround(4 * std::log10(x)) == bin; });
            text += fmt::format("{:.4g},{:.4g}\n", bin / 4.0,
                                100 * static_cast<double>(count) / static_cast<double>(ratios.size()));
        }
        return text;
    };
    draw(docs + "/choosing", "estimate",
         fmt::format(
             "$run << END\n{}END\n$laws << END\n{}END\nset format x \"10^{{%g}}\"\n"
             "set xrange [-4.5:4.5]\nset key inside top right vertical maxrows 2 Left reverse samplen 2\n"
             "set xlabel \"true error / estimated error\"\nset ylabel \"runs, per cent in a quarter of a decade\"\n"
             "plot $laws using 1:2 with histeps ls 2 title \"calibrated\", \\\n"
             "     $run using 1:2 with histeps ls 1 title \"lobatto run\"\n",
             shares(by_run), shares(by_laws)),
         760, 400);
}

}  // namespace

int main(int argc, char** argv) {
    const std::vector<std::string> words(argv + 1, argv + argc);
    try {
        if (words.size() == 3 && words[0] == "--page") {
            const auto scenes = read(words[1]);
            draw_ratios(scenes, words[2]);
            write_whole(words[2] + "/estimate.md", "the page", page_of(scenes));
            return 0;
        }
        if (words.size() < 2) {
            fmt::print(stderr, "bench_estimate FILE.csv SCENE...\nbench_estimate --page FILE.csv docs\n");
            return 2;
        }
        for (std::size_t i = 1; i < words.size(); ++i) {
            try {
                measure(words[i], words[0]);
            } catch (const ComputationError& error) {
                fmt::print(stderr, "{}: {}\n", words[i], error.what());
            }
        }
        return 0;
    } catch (const std::exception& error) {
        fmt::print(stderr, "{}\n", error.what());
        return 4;
    }
}
