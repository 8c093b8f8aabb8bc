// SPDX-License-Identifier: GPL-2.0-or-later
// Does `lobatto tune` keep its promises? Over the scenes and over targets: the error of what it chose, found in another
// way, and its cost against the best of a search that tries everything (docs/promises.md).
//
//   bench_promise [--budget SECONDS] [--targets 1e-3,1e-6] FILE.csv SCENE...
//   bench_promise --page FILE.csv > docs/promises.md
//
// A row a scene and target is appended to FILE.csv as soon as it is known, and each promise to FILE.csv.choices; what
// is there is not done again.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <optional>
#include <sstream>

#include "analysis/tradeoff/choice.hpp"
#include "generator/pipeline.hpp"
#include "runtime/error.hpp"

using namespace lobatto;

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double surely_dearer = 1.5;  // by count than the fastest by the clock
constexpr std::int64_t looks = 1500;   // steps of a choice whose error is checked, evenly spread

// The largest error of a choice over its own steps, against Gauss 10 in long double with shorter and shorter ones.
double checked_error(Experiment& experiment, const Candidate& candidate) {
    const Reference& reference = experiment.reference();
    const std::size_t n = reference.n, columns = 1 + 2 * n;
    const ExactStart exact(experiment.scene());
    const Kernel kernel = experiment.kernel_builder().kernel(candidate.member);
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
    const Kernel wide_kernel = experiment.kernel_builder().kernel({Family::gauss, 10, Precision::extended});
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

// What a run costs, roughly, without timing it: steps and iterations, each with what it takes, which is timed once for
// each member and tolerance. Steps that Newton's iteration takes cost more.
class Cost {
public:
    explicit Cost(Experiment& experiment) : experiment_(experiment) {}

    // Of the whole motion, in seconds; infinite for one that does not reach the end.
    double of(const Measurement& m) {
        if (!m.complete) return infinity;
        const Price& price = price_of(m.candidate);
        return static_cast<double>(m.candidate.steps) * (price.step + m.iterations * price.iteration);
    }

private:
    struct Price {
        double step = 0, iteration = 0;
    };
    struct Run {
        Measurement measurement;
        double seconds_a_step() const { return measurement.seconds / static_cast<double>(measurement.candidate.steps); }
    };

    // From two runs, with long steps, that need many iterations, and with short ones; each the fastest of many.
    const Price& price_of(const Candidate& like) {
        const std::pair key(like.member, like.tolerance);
        const auto known = prices_.find(key);
        if (known != prices_.end()) return known->second;
        const Kernel kernel = experiment_.kernel_builder().kernel(like.member);
        const double radians = experiment_.until() * experiment_.reference().frequency;
        const StepLadder ladder(experiment_.reference().samples, 1.1);
        std::vector<Run> runs;
        for (const double radians_of_step : {2.0, 1.0, 0.5, 0.25, 0.12, 0.06}) {
            const std::int64_t steps = ladder.at_least(std::max(1.0, radians / radians_of_step));
            const Measurement m = experiment_.measurer().measure(kernel, {like.member, steps, like.tolerance}, false);
            if (!m.complete) continue;
            runs.push_back({m});
            if (m.seconds > 0.3 || runs.front().measurement.iterations > 1.5 * m.iterations) break;
        }
        if (runs.empty()) return prices_[key] = {infinity, 0};
        Run &many = runs.front(), &few = runs.back();
        double spent = 0;
        for (int round = 0; round < 100 && spent < 0.04; ++round)
            for (Run* run : {&many, &few}) {
                const double seconds = experiment_.measurer().time_once(kernel, run->measurement.candidate).seconds;
                run->measurement.seconds = std::min(run->measurement.seconds, seconds);
                spent += seconds;
            }
        const double more = many.measurement.iterations - few.measurement.iterations;
        Price price{few.seconds_a_step(), 0};
        if (more > 0.2) {
            price.iteration = std::clamp((many.seconds_a_step() - few.seconds_a_step()) / more, 0.0,
                                         few.seconds_a_step() / few.measurement.iterations);
            price.step = few.seconds_a_step() - few.measurement.iterations * price.iteration;
        }
        return prices_[key] = price;
    }

    Experiment& experiment_;
    std::map<std::pair<Member, double>, Price> prices_;
};

// Everything: all members, steps in ratios of 1.1, tolerances in ratios of 100; a ladder ends when it has reached the
// finest target or is four times as dear as another way to the same error.
std::vector<Measurement> brute_force(Experiment& experiment, Cost& cost, double finest) {
    std::vector<Measurement> all;
    std::map<double, double> front;  // error, the least cost of one as small: both fall along it
    const auto cheapest_within = [&](double error) {
        const auto next = front.upper_bound(error);
        return next == front.begin() ? infinity : std::prev(next)->second;
    };
    const std::vector<Member> members = family_in(Precision::double_, experiment.derivation().system.separable);
    for (const Member& member : members) experiment.kernel_builder().order(member);
    const StepLadder ladder(experiment.reference().samples, 1.1);
    for (const Member& member : members) {
        const Kernel kernel = experiment.kernel_builder().kernel(member);
        for (const double tolerance : {0.0, 1e-12, 1e-10, 1e-8, 1e-6, 1e-4}) {
            if (tolerance > 0 && !experiment.heeds_tolerance(member)) break;
            int dear = 0, no_better = 0;
            double least = infinity;
            const double fewest = experiment.until() * experiment.reference().frequency / 4;
            for (std::int64_t steps = ladder.at_least(std::max(1.0, fewest));; steps = ladder.next(steps)) {
                const Measurement m = experiment.measurer().measure(kernel, {member, steps, tolerance}, false);
                all.push_back(m);
                const double price = cost.of(m);
                if (m.seconds > 3) break;
                if (!m.complete) continue;
                dear = price > 4 * cheapest_within(std::min(m.error, 0.1)) ? dear + 1 : 0;
                if (price < cheapest_within(m.error)) {
                    auto from = front.insert_or_assign(m.error, price).first;
                    for (++from; from != front.end() && from->second >= price;) from = front.erase(from);
                }
                no_better = m.error > 0.7 * least ? no_better + 1 : 0;
                least = std::min(least, m.error);
                if (m.error < 0.3 * finest || dear >= 6 || (no_better >= 8 && least < 1e-3)) break;
            }
        }
    }
    return all;
}

std::string candidate_text(const Candidate& candidate) {
    return fmt::format("{} N={} tol={:.0e}", candidate.name(), candidate.steps, candidate.tolerance);
}

struct Duel {
    double ours = infinity, best = infinity;
    Candidate winner;
};

// The choice against the fastest of the brute force that keeps the target at its steps too, not only at the samples.
// Those that may be it are timed, in the order of what they cost by count, then it and the choice in turn.
Duel duel(Experiment& experiment, Cost& cost, const Candidate& choice, const std::vector<Measurement>& all,
          double target) {
    std::vector<std::pair<double, const Measurement*>> reaching;
    for (const Measurement& m : all)
        if (m.complete && m.error <= target) reaching.emplace_back(cost.of(m), &m);
    std::sort(reaching.begin(), reaching.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    const auto kernel_for = [&](const Candidate& candidate) {
        return experiment.kernel_builder().kernel(candidate.member);
    };
    const auto shorten = [&](const Candidate& candidate, double& seconds) {
        seconds = std::min(seconds, experiment.measurer().time_once(kernel_for(candidate), candidate).seconds);
    };
    Duel result;
    for (const auto& [price, m] : reaching) {
        if (price > surely_dearer * result.best) break;
        double seconds = infinity;
        for (int round = 0; round < 3; ++round) shorten(m->candidate, seconds);
        if (seconds < result.best &&
            experiment.measurer().error_on_steps(kernel_for(m->candidate), m->candidate) <= target) {
            result.best = seconds;
            result.winner = m->candidate;
        }
    }
    if (result.best == infinity) return result;
    result.best = infinity;
    double spent = 0;
    for (int round = 0; round < 100 && (round < 3 || spent < 0.2); ++round) {
        shorten(choice, result.ours);
        shorten(result.winner, result.best);
        spent += result.ours + result.best;
    }
    return result;
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

// A promise as it was given.
struct Promise {
    double target = 0, predicted = 0, seconds = 0;
    Candidate candidate;
};

std::vector<std::string> cells_of(const std::string& line) {
    std::vector<std::string> cells;
    std::istringstream text(line);
    for (std::string cell; std::getline(text, cell, ',');) cells.push_back(cell);
    return cells;
}

// From FILE.csv.choices, or given now and written there.
std::optional<Promise> promise_for(const Scene& scene, double target, double budget, const std::string& file) {
    const std::string choices = file + ".choices", begin = fmt::format("{},{:.0e},", scene.name, target);
    std::ifstream in(choices);
    for (std::string line; std::getline(in, line);) {
        const std::vector<std::string> cells = cells_of(line);
        if (!line.starts_with(begin) || cells.size() < 8) continue;
        const auto number = [&](std::size_t i) { return std::strtod(cells[i].c_str(), nullptr); };
        const Member member{family_of(cells[2]), static_cast<int>(number(3))};
        return Promise{target, number(6), number(7), {member, static_cast<std::int64_t>(number(4)), number(5)}};
    }
    ChoiceRequest request;
    request.error = target;
    request.seconds = budget;
    request.tries_clocks = false;  // the check below takes equal steps
    try {
        const Choice choice = choose(scene, scene, request);
        const Candidate& c = choice.measurement.candidate;
        append(choices, fmt::format("{}{},{},{},{},{},{:.1f}", begin, word_of(c.member.family), c.member.points,
                                    c.steps, c.tolerance, choice.measurement.error, choice.seconds));
        return Promise{target, choice.measurement.error, choice.seconds, c};
    } catch (const ComputationError& refusal) {
        std::string why = refusal.what();
        std::replace(why.begin(), why.end(), ',', ';');
        append(file, fmt::format("{}refused,,,,,,{}", begin, why));
        return std::nullopt;
    }
}

void examine(const std::string& path, const std::vector<double>& targets, double budget, const std::string& file) {
    const Scene scene = read_scene(path);
    std::vector<Promise> promises;
    for (const double target : targets)
        if (!has_row(file, fmt::format("{},{:.0e},", scene.name, target)))
            if (const auto promise = promise_for(scene, target, budget, file)) promises.push_back(*promise);
    if (promises.empty()) return;
    ExperimentRequest wish;
    wish.seconds = 120;
    wish.wanted = 1e-14;
    wish.tries_clocks = false;
    Experiment experiment(scene, scene, wish);
    Cost cost(experiment);
    const std::vector<Measurement> all = brute_force(experiment, cost, promises.back().target);
    for (const Promise& promise : promises) {
        const double error = checked_error(experiment, promise.candidate);
        const Duel result = duel(experiment, cost, promise.candidate, all, promise.target);
        append(file, fmt::format("{},{:.0e},{:.3g},{:.3g},{:.3g},{:.3g},{:.3g},{:.1f},{} against {}", scene.name,
                                 promise.target, promise.predicted, error, result.ours, result.best,
                                 result.ours / result.best, promise.seconds, candidate_text(promise.candidate),
                                 candidate_text(result.winner)));
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
        const std::vector<std::string> cells = cells_of(line);
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

Each choice was run again. Its states at its own steps were compared with Gauss 10 in long double with short steps. It was timed in turn with the fastest method that a search through the whole family finds (21 members, steps in ratios of 1.1, six tolerances; it must keep the error at its steps). Written by

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
    std::vector<double> targets = {1e-3, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12};
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
