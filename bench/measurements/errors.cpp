// SPDX-License-Identifier: GPL-2.0-or-later
// How well the error that `lobatto run` measures follows the true one, over the scenes, members and steps
// (docs/errors.md).
//
//   bench_errors [--companion NUMBERS] FILE.csv SCENE...
//   bench_errors --page FILE.csv FINER.csv docs
//
// FINER.csv: by companions in double-double. A scene's rows are appended to FILE.csv when all are known; scenes that
// are there are not measured again.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <map>
#include <sstream>

#include "analysis/accuracy/companion/companion.hpp"
#include "analysis/motion.hpp"
#include "analysis/tradeoff/experiment.hpp"
#include "cli/print/drawing.hpp"
#include "generator/pipeline.hpp"
#include "runtime/error.hpp"
#include "runtime/files/partial_file.hpp"
#include "runtime/run/parts.hpp"

using namespace lobatto;

namespace {

constexpr double seconds_a_scene = 60;  // of which the reference takes a part
constexpr double longest_run = 0.4;     // seconds
constexpr double longest_finer = 0.04;  // with a companion in finer numbers, for which the run waits
constexpr double least = 1e-13;         // smaller errors are the rounding of the states themselves
constexpr double gone = 0.1;            // of the amplitude: such a run is lost, and has to be reported as that
constexpr double fewest_radians = 4;    // h omega of the coarsest steps
constexpr double ratio_of_steps = 1.35;
constexpr double parts[] = {0.05, 0.5, 0.95, 1};

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

// A run to the end, and the errors of its positions there.
struct Row {
    Member member;
    std::int64_t steps = 0;
    double true_error = 0;     // of the position that is worst, relative to its amplitude; not a number: it stopped
    double printed = 0;        // likewise, as the companion finds it
    bool is_reported = false;  // that it is lost: exit code 3
    bool is_warned = false;    // that the error is large
};

// Where the true motion ends: positions, and the amplitude of each.
struct End {
    std::vector<double> high, low, scale;
};

End end_of(const Reference& reference) {
    const auto last = static_cast<std::ptrdiff_t>(reference.samples) * 2 * static_cast<std::ptrdiff_t>(reference.n);
    const auto of = [&](const std::vector<double>& rows, std::ptrdiff_t first) {
        return std::vector<double>(rows.begin() + first, rows.begin() + first + std::ssize(reference.scale) / 2);
    };
    return {of(reference.high, last), of(reference.low, last), of(reference.scale, 0)};
}

// `finer`: of a companion in finer numbers.
Row row_of(const Experiment& experiment, const Kernel& kernel, const std::optional<Kernel>& finer,
           const ExactStart& exact, const Member& member, std::int64_t steps, const End& end, double& seconds) {
    TrajectoryRequest request;
    request.step = experiment.until() / static_cast<double>(steps);
    request.steps = steps;
    const StartIn<double> start = start_in<double>(exact, kernel, request.step);
    request.parameters = start.parameters;
    request.q = start.q;
    request.p = start.p;
    Derivation derivation = experiment.derivation();
    derivation.scene = experiment.scene();
    derivation.scene.method = member.method();
    TrajectoryRequest beside = request;
    if (finer) {
        add_digits(beside, experiment.scene(), *finer);
        beside.whole_step =
            times_fraction(as_parts({experiment.until()}, static_cast<std::size_t>((*finer)->parts)), 1, steps);
    }
    Companion companion(derivation, finer.value_or(kernel), beside, kernel->epsilon);
    request.sink = [&](const Records& records) { companion.observe(records); };
    companion.start();
    const TrajectoryResult result = integrate(kernel, request);
    const std::optional<MeasuredError> measured = companion.finish(result);
    seconds = result.seconds;
    Row row{member,
            steps,
            std::nan(""),
            measured ? measured->at_end : 0,
            measured && measured->is_lost(),
            measured && measured->worst() > large_error};
    if (result.status != LOBATTO_OK) return row;
    row.true_error = 0;
    for (std::size_t i = 0; i < end.high.size(); ++i)
        row.true_error = std::fmax(row.true_error, std::fabs((result.q[i] - end.high[i]) - end.low[i]) / end.scale[i]);
    return row;
}

void measure(const std::string& path, const std::string& file, std::optional<Precision> companion) {
    const Scene scene = read_scene(path);
    if (has(file, scene.name) || !scene.constraints.empty()) return;  // there is no reference with constraints
    ExperimentRequest wish;
    wish.seconds = seconds_a_scene;
    wish.wanted = 1e-15;
    const Derivation derivation = derive(scene);
    const std::vector<Member> list = members(derivation.system.separable);
    wish.first = list;
    wish.tries_clocks = false;
    Experiment experiment(scene, scene, wish);
    const Reference& reference = experiment.reference();
    const ExactStart start(scene);
    const End end = end_of(reference);
    const double uncertainty = reference.disagreement.back();
    std::string rows;
    int count = 0;
    for (const Member& member : list) {
        Member in_finer = member;
        in_finer.precision = companion.value_or(member.precision);
        if (!experiment.kernel_builder().allows(in_finer)) continue;  // coefficients with too few digits
        const Kernel kernel = experiment.kernel_builder().kernel(member);
        std::optional<Kernel> finer;
        if (companion) finer = experiment.kernel_builder().kernel(in_finer);
        double best = std::numeric_limits<double>::infinity();
        int no_better = 0;
        const double coarsest = reference.until * reference.frequency / fewest_radians;
        for (double steps = std::max(1.0, coarsest); steps < 1e6; steps = std::ceil(steps * ratio_of_steps)) {
            double seconds = 0;
            const Row row = row_of(experiment, kernel, finer, start, member, std::llround(steps), end, seconds);
            const bool ended = std::isfinite(row.true_error);
            no_better = ended && row.true_error < 0.7 * best ? 0 : no_better + 1;
            if (ended) best = std::min(best, row.true_error);
            if (ended && row.true_error > 100 * uncertainty) {
                rows +=
                    fmt::format("{},{},{},{},{:.4g},{:.4g},{},{}\n", scene.name, word_of(member.family), member.points,
                                row.steps, row.true_error, row.printed, row.is_reported ? 1 : 0, row.is_warned ? 1 : 0);
                ++count;
            }
            if (seconds > (finer ? longest_finer : longest_run) || (no_better >= 4 && best < 1e-6)) break;
        }
    }
    if (count == 0) rows = scene.name + ",,,,,,,\n";  // this motion has no reference to its end
    std::ofstream(file, std::ios::app) << rows << std::flush;
    fmt::print(stderr, "{}: {} runs in {:.0f} s\n", scene.name, count, experiment.elapsed());
}

using Scenes = std::map<std::string, std::vector<Row>>;

Scenes read(const std::string& path) {
    Scenes result;
    std::ifstream in(path);
    for (std::string line; std::getline(in, line);) {
        std::vector<std::string> cells;
        std::istringstream text(line);
        for (std::string cell; std::getline(text, cell, ',');) cells.push_back(cell);
        if (cells.empty()) continue;
        std::vector<Row>& list = result[cells[0]];
        if (cells.size() < 8) continue;
        list.push_back({{family_of(cells[1]), std::atoi(cells[2].c_str())},
                        std::atoll(cells[3].c_str()),
                        std::strtod(cells[4].c_str(), nullptr),
                        std::strtod(cells[5].c_str(), nullptr),
                        cells[6] == "1",
                        cells[7] == "1"});
    }
    return result;
}

// What is counted of some runs.
struct Tally {
    std::vector<double> ratios;  // true over printed, of runs that were not reported as lost
    int lost = 0, reported = 0;  // runs whose end is elsewhere, and those of them that were reported
    int unreported = 0;          // errors 10 times as large as printed, and more, without a warning

    void add(const Row& row) {
        const bool is_lost = row.true_error > gone;
        lost += is_lost ? 1 : 0;
        reported += is_lost && (row.is_reported || row.is_warned) ? 1 : 0;
        if (row.is_reported || row.true_error < least) return;
        const double ratio = row.true_error / std::fmax(row.printed, 1e-16);
        if (ratio > 10 && !row.is_warned) ++unreported;
        if (!is_lost) ratios.push_back(ratio);
    }
    double share(double from, double to) const {
        const auto count = std::count_if(ratios.begin(), ratios.end(), [&](double x) { return x >= from && x <= to; });
        return 100.0 * static_cast<double>(count) / static_cast<double>(std::max<std::size_t>(1, ratios.size()));
    }
};

std::string table_row(const std::string& name, Tally tally) {
    std::sort(tally.ratios.begin(), tally.ratios.end());
    std::string text = fmt::format("| {} | {} |", name, tally.ratios.size());
    for (const double part : parts)
        text += tally.ratios.empty()
                    ? " – |"
                    : fmt::format(" {:.2g} |", tally.ratios[static_cast<std::size_t>(
                                                   std::lround(part * static_cast<double>(tally.ratios.size() - 1)))]);
    return text + fmt::format(" {} | {} | {} |\n", tally.lost, tally.reported, tally.unreported);
}

// Of the rows of one member in one scene: whether rounding decides each. It does from the first small error on that
// shrinks less than with half of the order.
std::vector<bool> decided_by_rounding(const std::vector<Row>& rows) {
    std::vector<bool> result;
    const Row* before = nullptr;
    bool is_rounding = false;
    for (const Row& row : rows) {
        if (before != nullptr && std::isfinite(row.true_error)) {
            const double steps = static_cast<double>(before->steps) / static_cast<double>(row.steps);
            const double half_order = quadrature_of(row.member.method()).order() / 2.0;
            is_rounding = is_rounding ||
                          (row.true_error < 1e-7 && row.true_error > before->true_error * std::pow(steps, half_order));
        }
        before = &row;
        result.push_back(is_rounding);
    }
    return result;
}

constexpr const char* header =
    "| runs | 5 % | 50 % | 95 % | largest | lost | of these reported | unreported |\n"
    "|---|---|---|---|---|---|---|---|---|\n";

// All runs, and of them those whose error the step decides, and those where rounding does.
struct Summary {
    Tally all, by_steps, by_rounding;

    explicit Summary(const Scenes& scenes) {
        for (const auto& [scene, list] : scenes) {
            std::map<Member, std::vector<Row>> rows_of;
            for (const Row& row : list) {
                all.add(row);
                rows_of[row.member].push_back(row);
            }
            for (const auto& [member, rows] : rows_of) {
                const std::vector<bool> rounding = decided_by_rounding(rows);
                for (std::size_t i = 0; i < rows.size(); ++i) (rounding[i] ? by_rounding : by_steps).add(rows[i]);
            }
        }
    }
    std::string rows(const std::string& companion) const {
        std::string text;
        for (const auto& [name, tally] : {std::pair{"all", &all}, {"the step", &by_steps}, {"rounding", &by_rounding}})
            text += fmt::format("| {} | {} | {} | {:.1f} % | {:.2f} % | {} |\n", companion, name, tally->ratios.size(),
                                tally->share(0.5, 2), tally->share(0.1, 10), tally->unreported);
        return text;
    }
};

std::string tables_of(const Scenes& scenes, const Scenes& finer) {
    std::string by_scene, by_member, unknown;
    std::map<Member, Tally> of_member;
    for (const auto& [scene, list] : scenes) {
        if (list.empty()) {
            unknown += (unknown.empty() ? "`" : ", `") + scene + "`";
            continue;
        }
        Tally tally;
        for (const Row& row : list) {
            tally.add(row);
            of_member[row.member].add(row);
        }
        by_scene += table_row(fmt::format("`{}`", scene), tally);
    }
    for (const auto& [member, tally] : of_member) by_member += table_row(Candidate{member, 0, 0}.name(), tally);
    const Summary summary(scenes);
    return fmt::format(
        "| companion in | error decided by | runs | within a factor of 2 | of 10 | unreported "
        "|\n|---|---|---|---|---|---|\n"
        "{}{}\n| scene {}{}{}\n| member {}{}{}",
        summary.rows("double"), Summary(finer).rows("double-double"), header, by_scene, table_row("all", summary.all),
        header, by_member,
        unknown.empty() ? "" : "\nNot in the table, because there is no reference to its end: " + unknown + ".\n");
}

// How often which ratio: in per cent of the runs, in bins of a tenth of a decade.
void draw_ratios(const Scenes& scenes, const std::string& docs) {
    Tally all;
    for (const auto& [scene, list] : scenes)
        for (const Row& row : list) all.add(row);
    std::string text;
    for (int bin = -15; bin <= 15; ++bin) {
        const auto count = std::count_if(all.ratios.begin(), all.ratios.end(),
                                         [&](double x) { return std::lround(10 * std::log10(x)) == bin; });
        text += fmt::format("{:.4g},{:.4g}\n", bin / 10.0,
                            100 * static_cast<double>(count) / static_cast<double>(all.ratios.size()));
    }
    draw(docs + "/choosing", "errors",
         fmt::format("$run << END\n{}END\nset format x \"10^{{%g}}\"\nset xrange [-1.5:1.5]\nunset key\n"
                     "set xlabel \"true error / printed error\"\nset ylabel \"runs, per cent in a tenth of a decade\"\n"
                     "plot $run using 1:2 with histeps ls 1\n",
                     text),
         760, 400);
}

// What the page says of the measurements stands between two marks; the rest is written by hand.
void write_page(const Scenes& scenes, const Scenes& finer, const std::string& docs) {
    const std::string path = docs + "/errors.md", begin = "<!-- measured -->\n", end = "<!-- end -->";
    std::ostringstream text;
    text << std::ifstream(path).rdbuf();
    std::string page = text.str();
    const std::size_t from = page.find(begin), to = page.find(end);
    if (from == std::string::npos || to == std::string::npos) throw InputError(path + ": the marks are missing");
    page.replace(from + begin.size(), to - from - begin.size(), tables_of(scenes, finer));
    write_whole(path, "the page", page);
}

}  // namespace

int main(int argc, char** argv) {
    std::vector<std::string> words(argv + 1, argv + argc);
    try {
        if (words.size() == 4 && words[0] == "--page") {
            const Scenes scenes = read(words[1]);
            draw_ratios(scenes, words[3]);
            write_page(scenes, read(words[2]), words[3]);
            return 0;
        }
        std::optional<Precision> companion;
        if (words.size() > 2 && words[0] == "--companion") {
            companion = precision_of(words[1]);
            if (companion) words.erase(words.begin(), words.begin() + 2);
        }
        if (words.size() < 2) {
            fmt::print(stderr,
                       "bench_errors [--companion NUMBERS] FILE.csv SCENE...\n"
                       "bench_errors --page FILE.csv FINER.csv docs\n");
            return 2;
        }
        for (std::size_t i = 1; i < words.size(); ++i) {
            try {
                measure(words[i], words[0], companion);
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
