// SPDX-License-Identifier: GPL-2.0-or-later
#include "bench/report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>

#include "runtime/compiler.hpp"

namespace lobatto::bench {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

double seconds(const Lane& lane, std::size_t target) {
    return lane.best[target] ? lane.best[target]->seconds : infinity;
}

// The fastest lane among those chosen; null when none reaches the target.
template <class Choice>
Lane* first(Race& race, std::size_t target, const Choice& chosen) {
    Lane* best = nullptr;
    for (Lane& lane : race.lanes)
        if (chosen(lane.contestant) && seconds(lane, target) < (best == nullptr ? infinity : seconds(*best, target)))
            best = &lane;
    return best;
}
bool is_ours(const Contestant& contestant) {
    return contestant.ours;
}
bool is_peer(const Contestant& contestant) {
    return !contestant.ours;
}
bool is_symplectic_peer(const Contestant& contestant) {
    return !contestant.ours && contestant.symplectic;
}

std::string milliseconds(double time) {
    return std::isfinite(time) ? fmt::format("{:.3g}", time * 1e3) : "–";
}

// One row of a table: "a / b / c" of each race, from cell(race, target) -> text.
template <class Cell>
void print_row(const std::string& label, std::vector<Race>& races, const Cell& cell) {
    fmt::print("| {} |", label);
    for (Race& race : races) {
        for (std::size_t i = 0; i < targets.size(); ++i) fmt::print("{}{}", i == 0 ? " " : " / ", cell(race, i));
        fmt::print(" |");
    }
    fmt::print("\n");
}

// Time of the best of `chosen` over ours, and the geometric mean of these ratios.
template <class Choice>
void print_ratios(const std::string& label, std::vector<Race>& races, const Choice& chosen) {
    double logarithms = 0, count = 0;
    print_row(label, races, [&](Race& race, std::size_t i) -> std::string {
        const Lane* peer = first(race, i, chosen);
        const Lane* ours = first(race, i, is_ours);
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
            if (is_peer(lane.contestant) &&
                std::find(names.begin(), names.end(), lane.contestant.method) == names.end())
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
    fmt::print("Processor: {}. Kernels: {}, with the flags of `lobatto run` ({}).\n",
               first_line_about("/proc/cpuinfo", "model name"), compiler.words.front(),
               fmt::join(compile_arguments(compiler, "kernel.cpp", "kernel.so", false, 3), " "));
    fmt::print("Peers: " LOBATTO_BENCH_COMPILER ", " LOBATTO_BENCH_FLAGS ".\n");
}

void print_tables(std::vector<Race>& races) {
    if (races.empty()) return;
    const int trajectories = races.front().trajectories;
    const bool with_ours = first(races.front(), 0, is_ours) != nullptr;
    if (trajectories == 1)
        fmt::print("\n## One trajectory, milliseconds\n\n| method (order) |");
    else
        fmt::print("\n## Ensemble of {}, milliseconds per trajectory\n\n| method (order) |", trajectories);
    for (const Race& race : races) fmt::print(" {} {} |", race.problem->name, race.problem->title);
    fmt::print("\n|---|");
    for (std::size_t i = 0; i < races.size(); ++i) fmt::print("---|");
    fmt::print("\n");
    print_row("error below", races, [](Race&, std::size_t i) { return fmt::format("{:.0e}", targets[i]); });
    if (with_ours)
        print_row("**Lobatto, ours**", races, [](Race& race, std::size_t i) {
            const Lane* ours = first(race, i, is_ours);
            return ours == nullptr ? "–" : fmt::format("**{}**", milliseconds(seconds(*ours, i)));
        });
    for (const std::string& method : methods_of(races)) {
        const auto named = [&](const Contestant& contestant) { return contestant.method == method; };
        std::string label = method;
        for (const Race& race : races)
            for (const Lane& lane : race.lanes)
                if (named(lane.contestant)) label = full_name(lane.contestant);
        print_row(label, races, [&](Race& race, std::size_t i) {
            const Lane* lane = first(race, i, named);
            return milliseconds(lane == nullptr ? infinity : seconds(*lane, i));
        });
    }
    if (!with_ours) return;
    print_ratios("best symplectic peer / ours", races, is_symplectic_peer);
    print_ratios("best peer / ours", races, is_peer);

    fmt::print(
        "\n| ours | error below | method | h | error | energy error | ns a step | cold start, s | first of all |\n"
        "|---|---|---|---|---|---|---|---|---|\n");
    for (Race& race : races)
        for (std::size_t i = 0; i < targets.size(); ++i) {
            Lane* ours = first(race, i, is_ours);
            if (ours == nullptr) continue;
            const Measurement& m = *ours->best[i];
            const Lane* peer = first(race, i, is_peer);
            fmt::print("| {} | {:.0e} | {} | {:.4g} | {:.1e} | {:.1e} | {:.0f} | {:.2f} | {} |\n", race.problem->name,
                       targets[i], ours->contestant.method, race.problem->until / m.setting, m.error, m.energy_error,
                       m.seconds * 1e9 / static_cast<double>(m.steps), m.compile_seconds,
                       peer == nullptr || m.seconds < seconds(*peer, i) ? "yes" : "no: " + peer->contestant.method);
        }
}

void fill_cold_starts(std::vector<Race>& races) {
    for (Race& race : races) {
        fmt::print(stderr, "{}: cold starts\n", race.problem->name);
        for (Lane& lane : race.lanes) {
            double known = 0;
            for (std::size_t i = 0; i < targets.size(); ++i) {
                if (!lane.contestant.cold_start || first(race, i, is_ours) != &lane) continue;
                if (known == 0) known = lane.contestant.cold_start();
                lane.best[i]->compile_seconds = known;
            }
        }
    }
}

void write_csv(const std::string& path, const std::vector<Race>& races) {
    std::ofstream file(path);
    file << "problem,target,method,setting,order,symplectic,compile_s,wall_s,error,energy_error,steps,evaluations\n";
    for (const Race& race : races)
        for (const Lane& lane : race.lanes) {
            for (const Measurement& m : lane.scan) write_line(file, race, lane, m, "");
            for (std::size_t i = 0; i < targets.size(); ++i)
                if (lane.best[i]) write_line(file, race, lane, *lane.best[i], fmt::format("{:.0e}", targets[i]));
        }
}

}  // namespace lobatto::bench
