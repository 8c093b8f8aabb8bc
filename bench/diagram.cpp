// SPDX-License-Identifier: GPL-2.0-or-later
// Work-precision diagrams: what each method must pay for which error, through gnuplot.
#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "bench/report.hpp"
#include "cli/print/drawing.hpp"

namespace lobatto::bench {

namespace {

// What no other setting of the same method beats in both error and time, from coarse to fine.
std::vector<const Measurement*> front_of(const Race& race, const std::string& label) {
    std::vector<const Measurement*> all, front;
    for (const Lane& lane : race.lanes)
        if (label == (lane.contestant.ours ? "Lobatto, ours" : lane.contestant.method))
            for (const Measurement& m : lane.scan)
                if (m.error < 1e-1) all.push_back(&m);
    std::sort(all.begin(), all.end(), [](const auto* a, const auto* b) { return a->seconds < b->seconds; });
    for (const Measurement* m : all)
        if (front.empty() || m->error < front.back()->error) front.push_back(m);
    return front;
}

}  // namespace

void draw_diagram(const std::string& folder, const Race& race) {
    std::vector<std::string> labels = {"Lobatto, ours"};
    for (const Lane& lane : race.lanes)
        if (!lane.contestant.ours) labels.push_back(lane.contestant.method);
    const std::vector<const char*> colours = {"#000000", "#0072b2", "#d55e00", "#009e73",
                                              "#cc79a7", "#e69f00", "#56b4e9"};
    std::string data, curves;
    int number = 0;
    for (const std::string& label : labels) {
        const auto front = front_of(race, label);
        if (front.empty()) continue;
        data += fmt::format("$m{} << END\n", number);
        for (const Measurement* m : front) data += fmt::format("{:.4e},{:.4e}\n", m->error, m->seconds * 1e3);
        data += "END\n";
        const bool ours = label == labels.front();
        const int peer = number - 1, round = peer / 6;
        curves += fmt::format("{}$m{} using 1:2 with linespoints lc rgb \"{}\" lw {} dt {} pt {} ps {} title \"{}\"",
                              curves.empty() ? "plot " : ", \\\n     ", number,
                              ours ? colours[0] : colours[1 + peer % 6], ours ? 4 : 1.5,
                              ours || round == 0 ? 1 : 2 + round, ours ? 7 : 4 + peer % 6, ours ? 0.8 : 0.6, label);
        ++number;
    }
    if (curves.empty()) return;
    const std::string script = fmt::format(
        "{}set logscale xy\nset xrange [1e-1:1e-14]\nset format x \"10^{{%T}}\"\nset format y \"%g\"\n"
        "set key outside right center vertical maxrows 20 Left reverse samplen 2 noenhanced\n"
        "set title \"{} ({}){}\" noenhanced\nset xlabel \"error at the end, largest of {}\"\n"
        "set ylabel \"milliseconds{}\"\n{}\n",
        data, race.problem->name, race.problem->title,
        race.trajectories > 1 ? fmt::format(", ensemble of {}", race.trajectories) : "",
        race.problem->positions_only ? "q" : "q and p", race.trajectories > 1 ? " a trajectory" : "", curves);
    draw(folder, fmt::format("{}{}", race.problem->name, race.trajectories > 1 ? "_ensemble" : ""), script, 1000, 560);
}

}  // namespace lobatto::bench
