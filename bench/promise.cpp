// SPDX-License-Identifier: GPL-2.0-or-later
// Does `lobatto tune` keep its promises? Over the scenes and over targets: the error of what it chose, found in another
// way, and its cost against the best of a search that tries everything (docs/promises.md).
//
//   bench_promise [--budget SECONDS] [--targets 1e-3,1e-6] FILE.csv SCENE...
//   bench_promise --page FILE.csv > docs/promises.md
//
// A row a scene and target is appended to FILE.csv as soon as it is known; rows that are there are not done again.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>

#include "cli/tradeoff/choice.hpp"
#include "runtime/error.hpp"

using namespace lobatto;

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr std::int64_t looks = 1500;  // steps of a choice whose error is checked, evenly spread

// The largest error of a choice over its own steps, against Gauss 10 in long double with shorter and shorter ones.
double checked_error(Laboratory& laboratory, const Candidate& candidate) {
    const Reference& reference = laboratory.reference();
    const std::size_t n = reference.n, columns = 1 + 2 * n;
    const ExactStart exact(laboratory.scene());
    const Kernel kernel = laboratory.workshop().kernel(candidate.member);
    const double h = reference.until / static_cast<double>(candidate.steps);
    LoadedStepper<double> stepper(kernel);
    const StartIn<double> start = start_in<double>(exact, kernel, h);
    const std::int64_t every = std::max<std::int64_t>(1, candidate.steps / looks), rows = candidate.steps / every;
    std::vector<double> records(static_cast<std::size_t>(rows + 1) * columns);
    lobatto_advance call{};
    call.steps = candidate.steps;
    call.record_every = every;
    call.records = records.data();
    call.capacity = rows + 1;
    call.tolerance = candidate.tolerance;
    if (stepper.prepare(start.parameters, h) != LOBATTO_OK || stepper.start(0, start.q, start.p) != LOBATTO_OK ||
        stepper.advance(call) != LOBATTO_OK)
        return infinity;
    using real = long double;
    const Kernel wide_kernel = laboratory.workshop().kernel({Family::gauss, 10, Precision::extended});
    const double radians = h * reference.frequency;
    std::int64_t parts = std::max<std::int64_t>(1, static_cast<std::int64_t>(std::ceil(radians / 0.4)));
    double worst = infinity;
    for (int refinement = 0; refinement < 3; ++refinement, parts *= 2) {
        const real part = static_cast<real>(reference.until) / static_cast<real>(candidate.steps * parts);
        const StartIn<real> wide = start_in<real>(exact, wide_kernel, part);
        LoadedStepper<real> wide_stepper(wide_kernel);
        std::vector<real> wide_records(static_cast<std::size_t>(rows + 1) * columns);
        call.steps = candidate.steps * parts;
        call.record_every = every * parts;
        call.records = wide_records.data();
        call.capacity = rows + 1;
        call.tolerance = 0;
        if (wide_stepper.prepare(wide.parameters, part) != LOBATTO_OK ||
            wide_stepper.start(0, wide.q, wide.p) != LOBATTO_OK || wide_stepper.advance(call) != LOBATTO_OK)
            continue;
        double error = 0;
        for (std::int64_t row = 0; row < rows; ++row)
            for (std::size_t k = 0; k < 2 * n; ++k) {
                const std::size_t at = static_cast<std::size_t>(row) * columns + 1 + k;
                const real difference = static_cast<real>(records[at]) - wide_records[at];
                error = std::max(error, static_cast<double>(std::fabs(difference)) / reference.scale[k]);
            }
        const bool settled = std::fabs(error - worst) < 0.02 * error;
        worst = error;
        if (settled) break;
    }
    return worst;
}

// Everything: all members, steps in ratios of 1.1, tolerances in ratios of 100; a ladder ends when it has reached the
// finest target or is four times slower than another way to the same error.
std::vector<Measurement> brute_force(Laboratory& laboratory, double finest) {
    std::vector<Measurement> all;
    const auto fastest_within = [&](double error) {
        double seconds = infinity;
        for (const Measurement& m : all)
            if (m.complete && m.error <= error) seconds = std::min(seconds, m.seconds);
        return seconds;
    };
    for (const Member& member : family_in(Precision::double_)) laboratory.workshop().order(member);
    const StepLadder ladder(laboratory.reference().samples, 1.1);
    for (const Member& member : family_in(Precision::double_)) {
        const Kernel kernel = laboratory.workshop().kernel(member);
        for (const double tolerance : {0.0, 1e-12, 1e-10, 1e-8, 1e-6, 1e-4}) {
            int slow = 0, no_better = 0;
            double least = infinity;
            const double fewest = laboratory.until() * laboratory.reference().frequency / 4;
            for (std::int64_t steps = ladder.at_least(std::max(1.0, fewest));; steps = ladder.next(steps)) {
                const Measurement m = laboratory.measurer().measure(kernel, {member, steps, tolerance}, false);
                all.push_back(m);
                if (m.seconds > 3) break;
                if (!m.complete) continue;
                slow = m.seconds > 4 * fastest_within(std::min(m.error, 0.1)) ? slow + 1 : 0;
                no_better = m.error > 0.7 * least ? no_better + 1 : 0;
                least = std::min(least, m.error);
                if (m.error < 0.3 * finest || slow >= 6 || (no_better >= 8 && least < 1e-3)) break;
            }
        }
    }
    return all;
}

struct Duel {
    double ours = infinity, best = infinity;
    Candidate winner;
};

// The choice and the few fastest of the brute force, timed in turn.
Duel duel(Laboratory& laboratory, const Candidate& choice, const std::vector<Measurement>& all, double target) {
    std::vector<Measurement> reaching;
    for (const Measurement& m : all)
        if (m.complete && m.error <= target) reaching.push_back(m);
    std::sort(reaching.begin(), reaching.end(), [](const auto& a, const auto& b) { return a.seconds < b.seconds; });
    // Those that keep the target at their steps too, not only at the samples.
    std::vector<Measurement> finalists;
    for (std::size_t i = 0; i < reaching.size() && i < 60 && finalists.size() < 8; ++i)
        if (laboratory.measurer().error_on_steps(laboratory.workshop().kernel(reaching[i].candidate.member),
                                                 reaching[i].candidate) <= target)
            finalists.push_back(reaching[i]);
    reaching = finalists;
    Duel result;
    std::vector<double> seconds(reaching.size(), infinity);
    for (int round = 0; round < 9; ++round) {
        const auto time = [&](const Candidate& candidate) {
            return laboratory.measurer().time_once(laboratory.workshop().kernel(candidate.member), candidate).seconds;
        };
        result.ours = std::min(result.ours, time(choice));
        for (std::size_t i = 0; i < reaching.size(); ++i)
            seconds[i] = std::min(seconds[i], time(reaching[i].candidate));
    }
    for (std::size_t i = 0; i < reaching.size(); ++i)
        if (seconds[i] < result.best) result.best = seconds[i], result.winner = reaching[i].candidate;
    return result;
}

std::string candidate_text(const Candidate& candidate) {
    return fmt::format("{} N={} tol={:.0e}", candidate.name(), candidate.steps, candidate.tolerance);
}

bool has_row(const std::string& file, const std::string& begin) {
    std::ifstream in(file);
    for (std::string line; std::getline(in, line);)
        if (line.starts_with(begin)) return true;
    return false;
}

void append(const std::string& file, const std::string& line) {
    std::ofstream(file, std::ios::app) << line << '\n';
    fmt::print(stderr, "{}\n", line);
}

void examine(const std::string& path, const std::vector<double>& targets, double budget, const std::string& file) {
    const Scene scene = read_scene(path);
    std::vector<double> left;
    for (const double target : targets)
        if (!has_row(file, fmt::format("{},{:.0e},", scene.name, target))) left.push_back(target);
    if (left.empty()) return;
    std::vector<std::pair<double, Choice>> choices;
    for (const double target : left) {
        ChoiceRequest request;
        request.error = target;
        request.seconds = budget;
        try {
            choices.emplace_back(target, choose(derive(scene), scene, request));
        } catch (const ComputationError& refusal) {
            std::string why = refusal.what();
            std::replace(why.begin(), why.end(), ',', ';');
            append(file, fmt::format("{},{:.0e},refused,,,,,,{}", scene.name, target, why));
        }
    }
    if (choices.empty()) return;
    LaboratoryRequest wish;
    wish.seconds = 120;
    wish.wanted = 1e-14;
    Laboratory laboratory(derive(scene), scene, wish);
    const std::vector<Measurement> all = brute_force(laboratory, left.back());
    for (const auto& [target, choice] : choices) {
        const Candidate& chosen = choice.measurement.candidate;
        const double error = checked_error(laboratory, chosen);
        const Duel result = duel(laboratory, chosen, all, target);
        append(file,
               fmt::format("{},{:.0e},{:.3g},{:.3g},{:.3g},{:.3g},{:.3g},{:.1f},{} against {}", scene.name, target,
                           choice.measurement.error, error, result.ours, result.best, result.ours / result.best,
                           choice.seconds, candidate_text(chosen), candidate_text(result.winner)));
    }
}

// One row of the file.
struct Row {
    std::string scene, why;
    double target = 0, predicted = 0, error = 0, ratio = 0, seconds = 0;
    bool refused = false;
};

std::vector<Row> rows_of(const std::string& path) {
    std::ifstream in(path);
    std::vector<Row> rows;
    for (std::string line; std::getline(in, line);) {
        std::vector<std::string> cells;
        std::istringstream text(line);
        for (std::string cell; std::getline(text, cell, ',');) cells.push_back(cell);
        if (cells.size() < 9) continue;
        const auto number = [&](std::size_t i) { return std::strtod(cells[i].c_str(), nullptr); };
        Row row{cells[0], cells[8], number(1), number(2), number(3), number(6), number(7), cells[2] == "refused"};
        rows.push_back(row);
    }
    std::stable_sort(rows.begin(), rows.end(), [](const Row& a, const Row& b) {
        return std::pair(a.scene, -a.target) < std::pair(b.scene, -b.target);
    });
    return rows;
}

std::string page_of(const std::vector<Row>& rows) {
    int promises = 0, kept = 0, cheap = 0;
    double worst = 0;
    std::vector<double> ratios;
    std::string table, refusals;
    for (const Row& row : rows) {
        if (row.refused) {
            refusals += fmt::format("| {} | {:.0e} | {} |\n", row.scene, row.target, row.why);
            continue;
        }
        ++promises;
        kept += row.error <= row.target ? 1 : 0;
        cheap += row.ratio <= 1.3 ? 1 : 0;
        worst = std::max(worst, row.error / row.target);
        ratios.push_back(row.ratio);
        table += fmt::format("| {} | {:.0e} | {:.1e} | {:.1e} | {:.2f} | {:.1f} | {} |\n", row.scene, row.target,
                             row.predicted, row.error, row.ratio, row.seconds, row.why);
    }
    std::sort(ratios.begin(), ratios.end());
    const auto part = [&](double share) {
        return ratios.empty() ? 0 : ratios[static_cast<std::size_t>(share * static_cast<double>(ratios.size() - 1))];
    };
    return fmt::format(
        R"(# The promises of `lobatto tune`

What was chosen for each scene and each error was run again and compared, at its own steps, with Gauss 10 in long double with short steps; and it was timed in turn with the fastest that a search
through the whole family finds (21 members, steps in ratios of 1.1, six tolerances; the error kept at the steps). Kernels that were in the cache cost nothing. Written by

    ninja -C build/release bench_promise
    build/release/bench_promise promises.csv scenes/*.toml && build/release/bench_promise --page promises.csv > docs/promises.md

| | |
|---|---|
| promises given | {promises} of {all} |
| kept | {kept}: {percent:.0f} of 100 |
| largest error, in units of the promised one | {worst:.2f} |
| cost, in units of the best of the whole search: median, nine tenths, most | {median:.2f}, {most:.2f}, {all_most:.2f} |
| within 1.3 of the best | {cheap}: {cheap_percent:.0f} of 100 |

| scene | error asked for | predicted | found | cost : best | seconds | chosen, against the best found |
|---|---|---|---|---|---|---|
{table}
Not promised, and why:

| scene | error asked for | answer |
|---|---|---|
{refusals})",
        fmt::arg("promises", promises), fmt::arg("all", rows.size()), fmt::arg("kept", kept),
        fmt::arg("percent", 100.0 * kept / std::max(promises, 1)), fmt::arg("worst", worst),
        fmt::arg("median", part(0.5)), fmt::arg("most", part(0.9)), fmt::arg("all_most", part(1)),
        fmt::arg("cheap", cheap), fmt::arg("cheap_percent", 100.0 * cheap / std::max(promises, 1)),
        fmt::arg("table", table), fmt::arg("refusals", refusals));
}

}  // namespace

int main(int argc, char** argv) {
    std::vector<double> targets = {1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12};
    double budget = 20;
    std::vector<std::string> words;
    for (int i = 1; i < argc; ++i) {
        const std::string word = argv[i];
        if (word == "--page" && i + 1 < argc) {
            fmt::print("{}", page_of(rows_of(argv[i + 1])));
            return 0;
        }
        if (word == "--budget" && i + 1 < argc) {
            budget = std::strtod(argv[++i], nullptr);
        } else if (word == "--targets" && i + 1 < argc) {
            targets.clear();
            std::istringstream list(argv[++i]);
            for (std::string number; std::getline(list, number, ',');)
                targets.push_back(std::strtod(number.c_str(), nullptr));
        } else {
            words.push_back(word);
        }
    }
    if (words.size() < 2) {
        fmt::print(stderr, "bench_promise [--budget SECONDS] [--targets 1e-3,1e-6] FILE.csv SCENE...\n");
        return 2;
    }
    for (std::size_t i = 1; i < words.size(); ++i) {
        try {
            examine(words[i], targets, budget, words.front());
        } catch (const std::exception& error) {
            fmt::print(stderr, "{}: {}\n", words[i], error.what());
        }
    }
    return 0;
}
