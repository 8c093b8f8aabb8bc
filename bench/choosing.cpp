// SPDX-License-Identifier: GPL-2.0-or-later
// Writes docs/choosing.md and its pictures from measurements on this machine: which member of the family for what.
//
//   bench_choosing [SECONDS a scene]
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <limits>
#include <map>

#include "cli/drawing.hpp"
#include "cli/tradeoff/pictures.hpp"
#include "cli/tradeoff/report.hpp"
#include "cli/tradeoff/search.hpp"
#include "runtime/partial_file.hpp"

using namespace lobatto;

namespace {

const std::string docs = LOBATTO_SOURCE_DIR "/docs", folder = docs + "/choosing";
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

const Measurement* fastest(const Laboratory& laboratory, double target, const Filter& filter) {
    const Measurement* best = nullptr;
    for (const auto& [key, m] : laboratory.notebook().all())
        if (m.complete && m.error <= target && filter(m.candidate) && (best == nullptr || m.seconds < best->seconds))
            best = &m;
    return best;
}

double least_error(const Laboratory& laboratory, const Filter& filter) {
    double least = std::numeric_limits<double>::infinity();
    for (const auto& [key, m] : laboratory.notebook().all())
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
    std::string winners, gauss, high, types, estimates, pictures;
};

struct Point {
    double error, estimate;
};

void measure(const Example& example, double seconds, Tables& tables,
             std::map<std::string, std::vector<Point>>& points) {
    const Scene scene = read_scene(fmt::format("{}/scenes/{}.toml", LOBATTO_SOURCE_DIR, example.scene));
    LaboratoryRequest request;
    request.seconds = seconds;
    request.first = first_of_tour();
    request.say = [&](const std::string& what) { fmt::print(stderr, "{}: {}\n", scene.name, what); };
    Laboratory laboratory(derive(scene), scene, request);
    explore(laboratory);
    const double until = laboratory.until(), omega = laboratory.reference().frequency;

    const auto any = [](const Member&) { return true; };
    const auto is_gauss = [](const Member& m) { return m.family == Family::gauss; };
    const auto is_lobatto = [](const Member& m) { return m.family == Family::lobatto; };
    std::string winners = fmt::format("| `{}`: {} |", example.scene, example.about),
                gauss = fmt::format("| `{}` |", example.scene), high = gauss;
    for (const double target : targets) {
        const Measurement* best = fastest(laboratory, target, doubles(any));
        winners += best == nullptr ? " – |"
                                   : fmt::format(" {}, hω = {:.2g}: {:.3g} |", best->candidate.name(),
                                                 until / static_cast<double>(best->candidate.steps) * omega,
                                                 best->seconds / until * 1e9);
        gauss += fmt::format(" {} |", ratio_text(fastest(laboratory, target, doubles(is_gauss)),
                                                 fastest(laboratory, target, doubles(is_lobatto))));
        high += fmt::format(
            " {} |", ratio_text(fastest(laboratory, target, doubles([](const Member& m) { return m.order() <= 6; })),
                                fastest(laboratory, target, doubles([](const Member& m) { return m.order() >= 18; }))));
    }
    tables.winners += winners + '\n';
    tables.gauss += gauss + '\n';
    tables.high += high + '\n';
    tables.types += fmt::format(
        "| `{}` | {} | {} | {} | {} | {} | {} | {} |\n", example.scene,
        ratio_text(fastest(laboratory, 1e-3, in(Precision::single)), fastest(laboratory, 1e-3, in(Precision::double_))),
        error_text(least_error(laboratory, in(Precision::single))),
        error_text(least_error(laboratory, in(Precision::double_))),
        error_text(least_error(laboratory, in(Precision::extended))),
        error_text(least_error(laboratory, in(Precision::quadruple))),
        ratio_text(fastest(laboratory, 1e-12, in(Precision::extended)),
                   fastest(laboratory, 1e-12, in(Precision::double_))),
        ratio_text(fastest(laboratory, 1e-12, in(Precision::quadruple)),
                   fastest(laboratory, 1e-12, in(Precision::double_))));

    std::vector<double> ratios;
    for (const auto& [key, m] : laboratory.notebook().all())
        if (m.complete && m.candidate.tolerance == 0 && m.candidate.member.precision == Precision::double_ &&
            m.estimate > 0 && m.estimate < 1 && m.error > 1e-12 && m.error < 0.1) {
            ratios.push_back(m.error / m.estimate);
            points[example.scene].push_back({m.error, m.estimate});
        }
    std::sort(ratios.begin(), ratios.end());
    if (!ratios.empty())
        tables.estimates +=
            fmt::format("| `{}` | {} | {:.2g} | {:.2g} | {:.2g} |\n", example.scene, ratios.size(),
                        ratios[ratios.size() / 10], ratios[ratios.size() / 2], ratios[ratios.size() * 9 / 10]);
    const std::string own = folder + "/" + example.scene;
    std::filesystem::create_directories(own);
    draw_pictures(laboratory, own);
    std::filesystem::rename(own + "/work_precision.svg", own + ".svg");
    std::filesystem::remove_all(own);
    tables.pictures += fmt::format("![{0}](choosing/{0}.svg)\n", example.scene);
}

void draw_estimates(const std::map<std::string, std::vector<Point>>& points) {
    std::string data, curves;
    int number = 0;
    for (const auto& [scene, list] : points) {
        data += fmt::format("$e{} << END\n", number);
        for (const Point& point : list) data += fmt::format("{:.3e},{:.3e}\n", point.estimate, point.error);
        data += "END\n";
        curves +=
            fmt::format(", \\\n     $e{} using 1:2 with points pt {} ps 0.5 title \"{}\"", number, 4 + number, scene);
        ++number;
    }
    draw(folder, "estimate",
         fmt::format("{}set logscale xy\nset format \"10^{{%T}}\"\nset xrange [1e-14:1]\nset yrange [1e-13:1]\n"
                     "set key outside right center vertical maxrows 20 Left reverse samplen 2 noenhanced\n"
                     "set xlabel \"estimated from the steps' polynomials\"\nset ylabel \"true error\"\n"
                     "plot x with lines ls 1 title \"equal\"{}\n",
                     data, curves),
         960, 520, "The pictures need gnuplot: apt-get install gnuplot-nox.");
}

std::string page(const Tables& tables) {
    const std::string head = "| scene | 1e-3 | 1e-6 | 1e-9 | 1e-12 |\n|---|---|---|---|---|\n";
    return fmt::format(
        R"(# Choosing a method

Nobody has to: `lobatto tune SCENE --error 1e-8` chooses, and `lobatto tradeoff SCENE` shows the whole trade on your machine. This page says what they find. Its
tables and pictures are written by a command, which takes a few minutes and measures on the machine it runs on:

    ninja -C build/release bench_choosing && build/release/bench_choosing

Errors are the largest on the way to the scene's end, relative to the amplitude of the motion; times are nanoseconds of processor time a unit of the scene's time, on
one core that was not alone. ω is the largest frequency of the motion.

## Which member for which accuracy

The fastest in double precision for an error, its step in units of 1/ω, and what a unit of time costs:

{head}{winners}
- Read along a row: nine more digits cost two to four times as much, not a thousand times. Accuracy is cheap once the order is high.
- Take **Lobatto with 8 to 10 points, hω near 2,** when you do not want to think; iterate to a tolerance a hundredth of the error wanted, or to rounding when
  energies matter for long times.
- Low orders (Störmer–Verlet is Lobatto 2) win only where a few per cent of error is enough, or where the force has no smooth derivatives.

{pictures}
## What high orders are good for

How many times longer the best of order up to 6 takes than the best of order 18 to 22:

{head}{high}
## When Gauss beats Lobatto

The best Gauss against the best Lobatto, ratio of times (below 1: Gauss is faster; –: one of the two was not measured at this error):

{head}{gauss}
Lobatto reuses the gradient at the end of a step and has a node less to solve for; of the same order, it is ahead where the mass is constant. With a mass matrix that depends on the
position all nodes are solved for, and the two are close. Gauss is stable for every step, Lobatto up to a limit (`lobatto stability`): a step that passes over fast oscillations needs Gauss.

## Number types

What float saves at an error of 1e-3, the least error each type reaches, and how many times longer wider types take for 1e-12:

| scene | float : double at 1e-3 | least, float | double | long double | __float128 | long double : double | __float128 : double |
|---|---|---|---|---|---|---|---|
{types}
float is for ensembles, where twice as many trajectories fit into a register, and errors of 1e-4 will do; one trajectory gains little or nothing. long double costs some 20 to 50
times (no vector registers) and gives three more digits; __float128 is for references.

## The error that a run estimates

`lobatto run` says what the error probably is, and `lobatto tradeoff` calibrates another estimate: [how, and how well](estimate.md).
)",
        fmt::arg("head", head), fmt::arg("winners", tables.winners), fmt::arg("pictures", tables.pictures),
        fmt::arg("high", tables.high), fmt::arg("gauss", tables.gauss), fmt::arg("types", tables.types));
}

}  // namespace

int main(int argc, char** argv) {
    const double seconds = argc > 1 ? std::strtod(argv[1], nullptr) : 40;
    try {
        std::filesystem::create_directories(folder);
        Tables tables;
        std::map<std::string, std::vector<Point>> points;
        for (const Example& example : examples) measure(example, seconds, tables, points);
        draw_estimates(points);
        PartialFile file(docs + "/choosing.md", "the page");
        file.write(page(tables));
        file.finish();
        return 0;
    } catch (const std::exception& error) {
        fmt::print(stderr, "{}\n", error.what());
        return 4;
    }
}
