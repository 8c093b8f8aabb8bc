// SPDX-License-Identifier: GPL-2.0-or-later
#include "bench/report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "runtime/build/compiler.hpp"

namespace lobatto::bench {

namespace {

bool is_ours(const Lane& lane) {
    return lane.contestant.ours;
}
bool is_peer(const Lane& lane) {
    return !lane.contestant.ours;
}
bool is_symplectic_peer(const Lane& lane) {
    return !lane.contestant.ours && lane.contestant.symplectic;
}

std::string milliseconds(double time) {
    return std::isfinite(time) ? fmt::format("{:.3g}", time * 1e3) : "–";
}

// One row of a table: "a / b / c" of each race, from cell(race, target) -> text.
template <class Cell>
void print_row(const std::string& label, const std::vector<Race>& races, const Cell& cell) {
    fmt::print("| {} |", label);
    for (const Race& race : races) {
        for (std::size_t i = 0; i < targets.size(); ++i) fmt::print("{}{}", i == 0 ? " " : " / ", cell(race, i));
        fmt::print(" |");
    }
    fmt::print("\n");
}

// Time of the best of `chosen` over ours, and the geometric mean of these ratios.
template <class Choice>
void print_ratios(const std::string& label, const std::vector<Race>& races, const Choice& chosen) {
    double logarithms = 0, count = 0;
    print_row(label, races, [&](const Race& race, std::size_t i) -> std::string {
        const Lane* peer = fastest_of(race, i, chosen);
        const Lane* ours = fastest_of(race, i, is_ours);
        if (peer == nullptr || ours == nullptr) return "–";
        const double ratio = seconds(*peer, i) / seconds(*ours, i);
        logarithms += std::log(ratio);
        ++count;
        return fmt::format("{:.2f}", ratio);
    });
    if (count > 0) fmt::print("| … geometric mean | {:.2f} |\n", std::exp(logarithms / count));
}

// The names of all methods, in the order of their first appearance.
std::vector<std::string> methods_of(const std::vector<Race>& races) {
    std::vector<std::string> names;
    for (const Race& race : races)
        for (const Lane& lane : race.lanes)
            if (is_peer(lane) && std::find(names.begin(), names.end(), lane.contestant.method) == names.end())
                names.push_back(lane.contestant.method);
    return names;
}

std::string full_name(const Contestant& contestant) {
    std::string name = contestant.method;
    if (contestant.order > 0)
        name += fmt::format(" ({}{})", contestant.order, contestant.symplectic ? ", symplectic" : "");
    return name;
}

std::string first_line_about(const std::string& file, const std::string& key) {
    std::ifstream stream(file);
    for (std::string line; std::getline(stream, line);)
        if (line.starts_with(key)) return line.substr(line.find(':') + 2);
    return "unknown";
}

void write_line(std::ofstream& file, const Race& race, const Lane& lane, const Measurement& m,
                const std::string& target) {
    const std::string ensemble = race.trajectories > 1 ? fmt::format(" x {}", race.trajectories) : "";
    file << fmt::format("{}{},{},\"{}\",{},{},{},{:.4f},{:.6e},{:.3e},{:.3e},{},{}\n", race.problem->name, ensemble,
                        target, lane.contestant.method, setting_text(*race.problem, lane.contestant, m.setting),
                        lane.contestant.order, lane.contestant.symplectic ? 1 : 0, m.compile_seconds, m.seconds,
                        m.error, m.energy_error, m.steps, m.evaluations);
}

}  // namespace

void print_machine() {
    const Compiler compiler = find_compiler(false);
    fmt::print(
        "Processor: {}. Kernels: {}, with the flags of `lobatto run` ({}; P3's kernels with --param "
        "max-completely-peeled-insns=60 besides).\n",
        first_line_about("/proc/cpuinfo", "model name"), compiler.words.front(),
        fmt::join(compile_arguments(compiler, "kernel.cpp", "kernel.so", Translation{}), " "));
    fmt::print("Peers: " LOBATTO_BENCH_COMPILER ", " LOBATTO_BENCH_FLAGS ".\n");
}

void print_tables(const std::vector<Race>& races) {
    if (races.empty()) return;
    const int trajectories = races.front().trajectories;
    const bool with_ours = std::any_of(races.front().lanes.begin(), races.front().lanes.end(), is_ours);
    if (trajectories == 1)
        fmt::print("\n## One trajectory, milliseconds\n\n| method (order) |");
    else
        fmt::print("\n## Ensemble of {}, milliseconds per trajectory\n\n| method (order) |", trajectories);
    for (const Race& race : races) fmt::print(" {} {} |", race.problem->name, race.problem->title);
    fmt::print("\n|---|");
    for (std::size_t i = 0; i < races.size(); ++i) fmt::print("---|");
    fmt::print("\n");
    print_row("error below", races, [](const Race&, std::size_t i) { return fmt::format("{:.0e}", targets[i]); });
    if (with_ours)
        print_row("**Lobatto, ours**", races, [](const Race& race, std::size_t i) {
            const Lane* ours = fastest_of(race, i, is_ours);
            return ours == nullptr ? "–" : fmt::format("**{}**", milliseconds(seconds(*ours, i)));
        });
    for (const std::string& method : methods_of(races)) {
        const auto named = [&](const Lane& lane) { return lane.contestant.method == method; };
        std::string label = method;
        for (const Race& race : races)
            for (const Lane& lane : race.lanes)
                if (named(lane)) label = full_name(lane.contestant);
        print_row(label, races, [&](const Race& race, std::size_t i) {
            const Lane* lane = fastest_of(race, i, named);
            return lane == nullptr ? "–" : milliseconds(seconds(*lane, i));
        });
    }
    if (!with_ours) return;
    print_ratios("best symplectic peer / ours", races, is_symplectic_peer);
    print_ratios("best peer / ours", races, is_peer);

    fmt::print(
        "\n| ours | error below | method | h | error | energy error | ns a step | cold start, s | first of all |\n"
        "|---|---|---|---|---|---|---|---|---|\n");
    for (const Race& race : races)
        for (std::size_t i = 0; i < targets.size(); ++i) {
            const Lane* ours = fastest_of(race, i, is_ours);
            if (ours == nullptr) continue;
            const Measurement& m = *ours->best[i];
            const Lane* peer = fastest_of(race, i, is_peer);
            fmt::print("| {} | {:.0e} | {} | {:.4g} | {:.1e} | {:.1e} | {:.0f} | {:.2f} | {} |\n", race.problem->name,
                       targets[i], ours->contestant.method, race.problem->until / m.setting, m.error, m.energy_error,
                       m.seconds * 1e9 / static_cast<double>(m.steps), m.compile_seconds,
                       peer == nullptr || m.seconds < seconds(*peer, i) ? "yes" : "no: " + peer->contestant.method);
        }
}

void write_csv(const std::string& path, const std::vector<Race>& races) {
    std::ofstream file(path);
    file << "problem,target,method,setting,order,symplectic,compile_s,processor_s,error,energy_error,steps,"
            "evaluations\n";
    for (const Race& race : races)
        for (const Lane& lane : race.lanes) {
            for (const Measurement& m : lane.scan) write_line(file, race, lane, m, "");
            for (std::size_t i = 0; i < targets.size(); ++i)
                if (lane.best[i]) write_line(file, race, lane, *lane.best[i], fmt::format("{:.0e}", targets[i]));
        }
}

}  // namespace lobatto::bench
