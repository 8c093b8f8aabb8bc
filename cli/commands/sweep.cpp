// SPDX-License-Identifier: GPL-2.0-or-later
// lobatto sweep: one scene, many starts and parameters, one table of what becomes of them.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "analysis/accuracy/companion.hpp"
#include "analysis/accuracy/domains.hpp"
#include "analysis/accuracy/energy_watch.hpp"
#include "analysis/accuracy/ensemble_companion.hpp"
#include "analysis/accuracy/sweep_watch.hpp"
#include "analysis/kernel_of.hpp"
#include "analysis/motion.hpp"
#include "analysis/reductions.hpp"
#include "cli/commands/commands.hpp"
#include "cli/options/method.hpp"
#include "cli/options/output_path.hpp"
#include "cli/options/overrides.hpp"
#include "cli/options/vary.hpp"
#include "cli/print/interruption.hpp"
#include "cli/print/progress.hpp"
#include "cli/print/summary.hpp"
#include "cli/print/sweep_table.hpp"
#include "cli/print/tell.hpp"
#include "generator/mechanics/start.hpp"
#include "generator/pipeline.hpp"
#include "runtime/error.hpp"
#include "runtime/run/ensemble.hpp"
#include "runtime/run/output.hpp"

namespace lobatto {

namespace {

constexpr std::size_t failures_told = 5;
constexpr std::size_t coordinates_told = 3;  // at most, in the summary
constexpr double most_memory = 4e9;          // bytes of kept states
const char* const reason[] = {"reached the end",
                              "not converged",
                              "not finite",
                              "singular Jacobian",
                              "singular mass matrix",
                              "t + h equals t",
                              "not supported by the kernel",
                              "energy off: beyond stability, or past a singularity",
                              "not resolved: the error is as large as the motion",
                              "start off the constraints",
                              "a formula has no value there",
                              "stopped",
                              "impacts accumulate"};
constexpr int departed = 7, unresolved = 8, undefined = 10;

struct SweepOptions {
    std::string scene;
    std::vector<std::string> vary;
    std::vector<std::string> keep;
    std::string output;  // empty: out/NAME.sweep.csv
    std::string format;  // empty: told by the name of the output
    MethodOption method;
    Overrides overrides;
    std::optional<std::int64_t> steps;
    int threads = 0;
    bool unmeasured = false;
    bool beyond_horizon = false;
    bool quiet = false;
};

struct Failure {
    std::int64_t index, steps_done;
    int status;
    double time;
};

std::string counted(std::int64_t count, const std::string& one, const std::string& many) {
    return fmt::format("{} {}", count, count == 1 ? one : many);
}

// "q = 0.5, omega = 2"
std::string values_of(const Grid& grid, std::int64_t trajectory) {
    std::string text;
    for (std::size_t a = 0; a < grid.axes().size(); ++a)
        text += fmt::format("{}{} = {:.6g}", a == 0 ? "" : ", ", grid.axes()[a].name, grid.value(trajectory, a));
    return text;
}

SweepTable::Format format_of(const SweepOptions& options) {
    if (options.format.empty())
        return options.output.ends_with(".npy") ? SweepTable::Format::npy : SweepTable::Format::csv;
    return options.format == "csv" ? SweepTable::Format::csv : SweepTable::Format::npy;
}

// A comma would end the column.
std::string name_of_column(std::string text) {
    std::erase(text, '"');
    std::replace(text.begin(), text.end(), ',', ';');
    return text;
}

// Initial values are written q(0), as other columns hold q at the time t. A name of the scene keeps its column; ours
// gives way to it, as in steps_.
std::vector<Column> columns_of(const Scene& scene, const Grid& grid, bool measures) {
    std::vector<Column> columns;
    const auto own = [&](std::string name, bool whole) {
        const auto taken = [&] {
            const auto is_named = [&](const auto& named) { return named.name == name; };
            return std::any_of(scene.coordinates.begin(), scene.coordinates.end(), is_named) ||
                   std::any_of(scene.parameters.begin(), scene.parameters.end(), is_named);
        };
        while (taken()) name += '_';
        columns.push_back({name, "", whole});
    };
    own("index", true);
    for (const Axis& axis : grid.axes()) {
        if (axis.role == Axis::Role::parameter)
            columns.push_back({axis.name, scene.parameters[axis.index].unit});
        else
            columns.push_back(
                {axis.name + "(0)", axis.role == Axis::Role::position ? scene.coordinates[axis.index].unit : ""});
    }
    own("status", true);
    own("steps", true);
    if (!scene.run.stops.empty()) own("stop", true);
    columns.push_back({"t", ""});
    for (const Reduction& kept : scene.outputs.kept) columns.push_back({name_of_column(kept.text), ""});
    if (!scene.outputs.kept.empty()) {
        if (measures) own("error", false);
        return columns;
    }
    for (const Coordinate& coordinate : scene.coordinates) columns.push_back({coordinate.name, coordinate.unit});
    if (scene.outputs.momenta)
        for (const Coordinate& coordinate : scene.coordinates) columns.push_back({"p_" + coordinate.name, ""});
    if (scene.outputs.energy) own("energy_error", false);
    if (measures) own("error", false);
    return columns;
}

std::vector<std::string> comments_of(const Scene& scene, const KernelSource& source, const EnsembleRequest& request,
                                     const Grid& grid) {
    std::vector<std::string> comments{"lobatto sweep", "scene: " + (scene.title.empty() ? scene.name : scene.title),
                                      fmt::format("method: {}, h = {}", scene.method.name(), exact_text(request.step)),
                                      "kernel: " + source.digest};
    std::vector<std::string> parameters, statuses;
    EnsembleStart first;
    grid.start(0, first);
    for (std::size_t i = 0; i < scene.parameters.size(); ++i) {
        const auto varies = [&](const Axis& axis) { return axis.role == Axis::Role::parameter && axis.index == i; };
        if (std::none_of(grid.axes().begin(), grid.axes().end(), varies))
            parameters.push_back(fmt::format("{} = {}", scene.parameters[i].name, exact_text(first.parameters[i])));
    }
    if (!parameters.empty()) comments.push_back(fmt::format("parameters: {}", fmt::join(parameters, ", ")));
    for (const Axis& axis : grid.axes()) comments.push_back(fmt::format("vary: {} = {}", axis.name, axis.written));
    for (std::size_t i = 0; i < scene.run.stops.size(); ++i)
        comments.push_back(fmt::format("stop {}: {}", i + 1, scene.run.stops[i].text));
    for (int status = 0; status < LOBATTO_STATUSES; ++status)
        if (status != LOBATTO_UNSUPPORTED && status != LOBATTO_STOPPED)
            statuses.push_back(fmt::format("{} {}", status, reason[status]));
    comments.push_back(fmt::format("status: {}", fmt::join(statuses, ", ")));
    return comments;
}

// What is said of a trajectory that has ended.
struct Verdict {
    int status = LOBATTO_OK;
    bool measures = false;
    double error = 0;  // at the end, relative to the amplitude
};

// Judges the trajectories, in their order: by their energies, and by their companions.
class Judges {
public:
    Judges(const SweepOptions& options, const Scene& scene, const Derivation& derivation, const KernelSource& source,
           const Kernel& kernel, const EnsembleRequest& request)
        : watch(derivation, source, kernel, request),
          request_(request),
          domains_(scene, derivation.system),
          accepts_lost_(options.beyond_horizon || derivation.scene.run.beyond_horizon) {
        if (!options.unmeasured) companion_.emplace(derivation, kernel, request);
    }

    bool measures() const { return companion_.has_value(); }

    Verdict judge(const EnsembleTrajectory& trajectory) {
        Verdict verdict{static_cast<int>(trajectory.status), measures(), std::nan("")};
        if (verdict.status != LOBATTO_OK) return verdict;
        if (watch.departs(trajectory)) verdict.status = departed;
        if (companion_) {
            const EnsembleCompanion::Error error = companion_->of(trajectory);
            verdict.error = error.relative;
            if (error.lost && !accepts_lost_ && verdict.status == LOBATTO_OK) verdict.status = unresolved;
        }
        if (!is_defined(trajectory)) verdict.status = undefined;
        if (verdict.status == LOBATTO_OK) {
            watch.observe(trajectory);
            if (!(verdict.error <= worst_error) && !std::isnan(verdict.error)) {
                worst_error = verdict.error;
                worst = trajectory.index;
            }
        } else {
            ++refused[static_cast<std::size_t>(verdict.status - departed)];
        }
        return verdict;
    }

    SweepWatch watch;
    std::array<std::int64_t, 4> refused{};  // by statuses from `departed` on
    double worst_error = -1;                // of those that are resolved
    std::int64_t worst = -1;

    std::int64_t count_refused() const { return std::accumulate(refused.begin(), refused.end(), std::int64_t(0)); }

private:
    // Whether formulas have values at the start and where states are kept, also those that kernels have lost.
    bool is_defined(const EnsembleTrajectory& trajectory) const {
        EnsembleStart start;
        request_.start(trajectory.index, start);
        return domains_.hold_at_start(request_.time, start.parameters, start.q, start.rate) &&
               domains_.left_at(start.parameters, trajectory.kept) < 0;
    }

    const EnsembleRequest& request_;
    Domains domains_;
    std::optional<EnsembleCompanion> companion_;
    bool accepts_lost_;
};

// The states of one trajectory, each `every`-th and the last (0: the last alone); only the last of them can be one at
// which it failed.
void write(SweepTable& table, const Scene& scene, const Grid& grid, const EnsembleRequest& request, std::int64_t every,
           const EnsembleTrajectory& trajectory, const Verdict& verdict) {
    const Records& kept = trajectory.kept;
    const int numbers = scene.outputs.momenta ? kept.columns : 1 + (kept.columns - 1) / 2;
    for (std::int64_t i = 0; i < kept.count; ++i) {
        const bool last = i + 1 == kept.count;
        if (!last && (every == 0 || i * request.every % every != 0)) continue;
        table.add(trajectory.index);
        for (std::size_t a = 0; a < grid.axes().size(); ++a) table.add(grid.value(trajectory.index, a));
        table.add(static_cast<std::int64_t>(last ? verdict.status : LOBATTO_OK));
        table.add(last ? trajectory.steps_done : i * request.every);
        if (const std::size_t stops = scene.run.stops.size(); stops > 0) {
            const auto first = static_cast<std::int64_t>(scene.outputs.events.size()) - 1;
            table.add(last && trajectory.stop >= 0 ? trajectory.stop - first : std::int64_t(0));
        }
        if (!scene.outputs.kept.empty()) {
            table.add(kept.rows[i * kept.columns]);
            for (std::size_t k = 0; k < scene.outputs.kept.size(); ++k)
                table.add(k < trajectory.reduced->size() ? (*trajectory.reduced)[k] : std::nan(""));
            if (verdict.measures) table.add(verdict.error);
            table.end_row();
            continue;
        }
        for (int column = 0; column < numbers; ++column) table.add(kept.rows[i * kept.columns + column]);
        if (scene.outputs.energy) table.add(kept.energy[i] - trajectory.energy_start);
        if (verdict.measures) table.add(last ? verdict.error : std::nan(""));
        table.end_row();
    }
}

std::string failures_text(const Scene& scene, const Grid& grid, const EnsembleResult& result, const Judges& judges,
                          const std::vector<Failure>& failures) {
    std::vector<std::string> reasons;
    std::int64_t failed = 0;
    for (std::size_t status = 1; status < result.count_of.size(); ++status) {
        if (result.count_of[status] == 0) continue;
        failed += result.count_of[status];
        reasons.push_back(fmt::format("{} {}", result.count_of[status], reason[status]));
    }
    for (const int status : {departed, unresolved, undefined}) {
        const std::int64_t count = judges.refused[static_cast<std::size_t>(status - departed)];
        if (count > 0) reasons.push_back(fmt::format("{} {}", count, reason[status]));
        failed += count;
    }
    std::string text = fmt::format("{}: {} of {} failed: {}. The others went on. {}:", scene.path, failed,
                                   counted(result.trajectories, "trajectory", "trajectories"), fmt::join(reasons, ", "),
                                   failed > std::ssize(failures) ? "The first of them" : "They are");
    for (const Failure& failure : failures) {
        text += fmt::format("\n  trajectory {}, {}: {}", failure.index, values_of(grid, failure.index),
                            reason[failure.status]);
        if (failure.status < departed)
            text += fmt::format(" in step {}, after t = {:.6g}", failure.steps_done + 1, failure.time);
    }
    return text + "\nTry a smaller --step, or leave these values out.";
}

std::string spread_text(const Spread& spread) {
    return fmt::format("{:.6g} to {:.6g}, mean {:.6g}, rms {:.6g}", spread.least, spread.largest, spread.mean,
                       spread.rms);
}

void print_table(const Derivation& derivation, const Scene& scene, const Grid& grid, const EnsembleRequest& request,
                 const EnsembleResult& result, const Judges& judges, int kernel_lanes) {
    const std::int64_t failed = result.trajectories - result.count_of[LOBATTO_OK] + judges.count_refused();
    const std::string of_all = result.interrupted ? fmt::format(" of {}", request.count) : "";
    print_row("trajectories", fmt::format("{}{}{}", result.trajectories, of_all,
                                          failed == 0 ? "" : fmt::format(", {} failed", failed)));
    print_row("steps", fmt::format("{} each, h = {:.6g}, to t = {:.6g}", request.steps, request.step,
                                   static_cast<double>(request.steps) * request.step));
    print_row("threads",
              fmt::format("{}, {} each", result.threads,
                          kernel_lanes == 0 ? "one trajectory at a time" : counted(result.lanes, "lane", "lanes")));
    if (result.steps_done > 0) {
        const auto steps = static_cast<double>(result.steps_done);
        print_row("speed", fmt::format("{:.3g} steps per second", steps / result.seconds));
        print_row("time per step", duration(result.processor_seconds / steps) + " of a processor, for one trajectory");
    }
    if (scene.outputs.energy && result.energy_error_index >= 0) {
        const bool conserves = derivation.conserves_energy();
        print_row(conserves ? "energy error" : "energy change",
                  fmt::format("{:.2g} at most, of trajectory {}, {}", result.energy_error_largest,
                              result.energy_error_index, values_of(grid, result.energy_error_index)));
        print_row("  at the end",
                  fmt::format("{:.2g} to {:.2g}, mean {:.2g}, rms {:.2g}", result.energy_error.least,
                              result.energy_error.largest, result.energy_error.mean, result.energy_error.rms));
    }
    if (judges.worst >= 0)
        print_row("measured error", fmt::format("{:.1e} of the amplitude at most, of trajectory {}, {}",
                                                judges.worst_error, judges.worst, values_of(grid, judges.worst)));
    if (failed == result.trajectories || scene.coordinates.size() > coordinates_told) return;
    for (std::size_t k = 0; k < scene.coordinates.size(); ++k)
        print_row(scene.coordinates[k].name + " at the end", spread_text(result.q[k]));
    for (std::size_t k = 0; k < scene.coordinates.size() && scene.outputs.momenta; ++k)
        print_row("p_" + scene.coordinates[k].name + " at the end", spread_text(result.p[k]));
}

// A name has one value or many.
void refuse_both(const SweepOptions& options) {
    const auto name_of = [](const std::string& argument) { return argument.substr(0, argument.find('=')); };
    for (const std::string& set : options.overrides.set)
        for (const std::string& varied : options.vary)
            if (name_of(set) == name_of(varied))
                throw InputError(fmt::format("--set: '{}' is varied too; leave one of both out", name_of(set)));
}

// The one step size and number of steps of all trajectories.
Steps steps_of(const SweepOptions& options, Scene& scene) {
    if (options.steps && scene.clock)
        throw InputError(
            "--steps: with a clock nobody knows beforehand how many steps a trajectory takes; give the end time with "
            "--until");
    if (!options.steps) return steps_of(scene, options.overrides);
    if (*options.steps < 0) throw InputError(fmt::format("--steps: {} is not a number of steps", *options.steps));
    scene.run.until = scene.run.step * GiNaC::numeric(static_cast<long>(*options.steps));
    return steps_of(scene, options.overrides);
}

void refuse_too_much(const Grid& grid, const Kernel& kernel, const EnsembleRequest& request) {
    const double steps = static_cast<double>(request.count) * static_cast<double>(request.steps);
    if (steps > 9e18)
        throw InputError(fmt::format(
            "--vary: {} of {} steps are {:.3g} steps, too many to count; vary less, or make the end time smaller",
            counted(request.count, "trajectory", "trajectories"), request.steps, steps));
    const double memory = memory_of(kernel, request);
    if (grid.count() > 0 && memory > most_memory)
        throw InputError(fmt::format(
            "--every: the states that trajectories keep while they wait for their turn would need {:.3g} GB of memory; "
            "give a larger number of steps, or fewer --threads",
            memory / 1e9));
}

// Which parameters that vary decide the step or the end time: those of the scene count, for all trajectories.
void print_fixed_times(const Scene& scene, const Grid& grid) {
    for (const Axis& axis : grid.axes()) {
        if (axis.role != Axis::Role::parameter) continue;
        const Parameter& parameter = scene.parameters[axis.index];
        if (scene.run.step.has(parameter.symbol) || scene.run.until.has(parameter.symbol))
            fmt::print("The step and the end time are those of {} = {:.6g} for all trajectories.\n", parameter.written,
                       scene.evaluate(parameter.value, parameter.name).to_double());
    }
}

// The first prime number from here on: a motion with so many steps in its period, or a part of them, is rare.
std::int64_t prime_from(std::int64_t number) {
    const auto is_prime = [](std::int64_t candidate) {
        for (std::int64_t factor = 2; factor <= candidate / factor; ++factor)
            if (candidate % factor == 0) return false;
        return true;
    };
    while (!is_prime(number)) ++number;
    return number;
}

// How often states are kept: as often as is asked for, and some 61 times for the companions to be compared with.
std::int64_t looked_at(std::int64_t every, std::int64_t steps, bool unmeasured) {
    constexpr std::int64_t comparisons = 61, most_tried = 1000;  // no part of times that one writes
    if (unmeasured || steps == 0) return every;
    if (every == 0 || every > steps)
        return prime_from(std::max(fewest_driven_steps, (steps + comparisons - 1) / comparisons));
    const std::int64_t wanted = std::min(comparisons * every / steps, every / fewest_driven_steps);
    for (std::int64_t parts = std::max<std::int64_t>(1, wanted); parts <= std::min(every, wanted + most_tried); ++parts)
        if (every % parts == 0) return every / parts;
    return every;
}

// Of so many states one is kept, 0: the last alone. With a clock --every is the time between them.
std::int64_t states_kept(const SweepOptions& options, const Scene& scene) {
    const std::int64_t every = options.overrides.every.value_or(0);
    return scene.clock ? std::min<std::int64_t>(every, 1) : every;
}

EnsembleRequest request_of(const SweepOptions& options, const Scene& scene, const Grid& grid, const Steps& steps) {
    EnsembleRequest request;
    request.count = grid.count();
    request.start = [&](std::int64_t index, EnsembleStart& start) { grid.start(index, start); };
    request.from_velocities = scene.start == Start::velocity;
    request.step = scene.evaluate(scene.run.step, "the step").to_double();
    request.steps = steps.count;
    request.tolerance = scene.method.tolerance;
    request.arrivals = arrivals_of(scene, steps.count);
    request.arrivals.keeps_chain = false;
    request.every = looked_at(states_kept(options, scene), steps.count, options.unmeasured);
    request.threads = options.threads;
    request.stops = !scene.run.stops.empty();
    return request;
}

void sweep(const SweepOptions& options) {
    Scene scene = read_scene(options.scene, options.keep);
    if (!scene.outputs.kept.empty() && options.overrides.every)
        throw InputError("--every: what is kept of a trajectory is one row; leave out --every, or --keep");
    scene.outputs.watch_kept();
    options.method.apply(scene);
    MethodOption::require_double(scene, "sweep");
    const Scene as_written = scene;  // one kernel serves all values
    scene.outputs.dense = 0;
    apply(options.overrides, scene);
    refuse_both(options);
    const Grid grid(scene, options.vary);
    const Steps steps = steps_of(options, scene);

    Derivation derivation = derive(as_written);
    if (!options.overrides.set.empty()) check_domains(scene, derivation.system);
    if (EnergyWatch::can_watch(derivation) || !scene.outputs.kept.empty()) derivation.scene.outputs.energy = true;
    const KernelSource source = emit(derivation);
    EnsembleRequest request = request_of(options, scene, grid, steps);
    // With more than two coordinates one register of each value is enough for all threads (ensemble_lanes), so that no
    // number of them changes what a trajectory becomes.
    // Stops, impacts and what is kept are of single trajectories.
    const bool is_alone = !scene.outputs.kept.empty() || !scene.run.stops.empty() || scene.is_cut();
    const std::int64_t together = scene.coordinates.size() > 2 ? std::min<std::int64_t>(request.count, 8)
                                                               : request.count / thread_count(options.threads);
    const Kernel kernel =
        is_alone ? kernel_of(source, Precision::double_) : ensemble_kernel_of(source, Precision::double_, together);
    if (!scene.outputs.kept.empty()) request.reducer = [&scene] { return std::make_unique<Reductions>(scene); };
    refuse_too_much(grid, kernel, request);

    const SweepTable::Format format = format_of(options);
    const std::string path = output_path(
        options.output, result_name(scene.path) + (format == SweepTable::Format::npy ? ".sweep.npy" : ".sweep.csv"));
    keep_scene(scene.path, path);
    keep_foreign(path);
    SweepTable table(path, format, comments_of(scene, source, request, grid),
                     columns_of(scene, grid, !options.unmeasured));
    std::vector<Failure> failures;
    Judges judges(options, scene, derivation, source, kernel, request);
    Verdict verdict;
    request.counts = [&](const EnsembleTrajectory& trajectory) {
        verdict = judges.judge(trajectory);
        return verdict.status == LOBATTO_OK;
    };
    request.sink = [&](const EnsembleTrajectory& trajectory) {
        if (trajectory.status != LOBATTO_OK) verdict = judges.judge(trajectory);
        write(table, scene, grid, request, states_kept(options, scene), trajectory, verdict);
        if (verdict.status == LOBATTO_OK || failures.size() == failures_told) return;
        const double time = trajectory.kept.rows[(trajectory.kept.count - 1) * trajectory.kept.columns];
        failures.push_back({trajectory.index, trajectory.steps_done, verdict.status, time});
    };
    EnsembleResult result;
    {
        Progress progress(request.count * request.steps);
        if (!options.quiet) request.progress = [&](std::int64_t done) { progress.show(done); };
        const Interruption interruption;
        request.interrupted = interruption.flag();
        result = integrate(kernel, request);
    }
    table.finish();
    if (const std::string warning = judges.watch.warning(); !warning.empty()) tell("lobatto: warning: {}.\n", warning);

    if (judges.worst_error > large_error)
        tell(
            "lobatto: warning: the error of trajectory {}, {}, is {:.2g} of the amplitude; take a smaller step, or "
            "more points.\n",
            judges.worst, values_of(grid, judges.worst), judges.worst_error);
    if (!options.quiet) {
        fmt::print("{}: kernel {}\n", scene.path, source.digest);
        print_table(derivation, scene, grid, request, result, judges, kernel->lanes);
        print_row("table", fmt::format("{}, {}", path, counted(table.rows(), "row", "rows")));
        if (!steps.reaches_end)
            fmt::print("The end time is not a multiple of the step: the runs end at the last multiple before it.\n");
        print_fixed_times(scene, grid);
    }
    const bool failed = result.count_of[LOBATTO_OK] < result.trajectories || judges.count_refused() > 0;
    if (result.interrupted) {
        tell("lobatto: interrupted after {} of {} trajectories; what was computed is in {}.\n", result.trajectories,
             request.count, path);
        if (failed) tell("{}\n", failures_text(scene, grid, result, judges, failures));
        throw ExitCode{interrupted_exit};
    }
    if (failed)
        throw ComputationError(failures_text(scene, grid, result, judges, failures) +
                               fmt::format(" What was computed is in {}.", path));
}

}  // namespace

void add_sweep(CommandLine& program) {
    Command command = program.command(
        "sweep", "Run a scene from many starts and with many parameters at once; write what becomes of them");
    const auto options = std::make_shared<SweepOptions>();
    command.option("scene", options->scene, "Scene file").required();
    command
        .option("--vary", options->vary,
                "Values of an initial position, velocity or momentum or of a parameter: NAME=FROM:TO:COUNT, both "
                "ends included; NAME=FROM:TO:COUNT:log, in equal ratios; NAME=a,b,c. Repeated: all combinations")
        .required()
        .one_value_each();
    command
        .option("--keep", options->keep,
                "One row for each trajectory, of what is listed: first(EVENT), count(EVENT), max, min, mean or "
                "last(FORMULA); in formulas also H and momenta p_x. Instead of [output] keep")
        .one_value_each();
    command.option("-o,--output", options->output, "Table (default: out/NAME.sweep.csv)");
    command
        .option("--format", options->format,
                "csv, or binary: an array of NumPy (default: binary when the table is named .npy)")
        .one_of(std::vector<std::string>{"csv", "binary"});
    options->method.add_to(command);
    add_step_option(command, options->overrides);
    const Option until = add_until_option(command, options->overrides);
    command.option("--steps", options->steps, "Number of steps, instead of an end time").excludes(until);
    command.option("--every", options->overrides.every,
                   "Keep the start, every EVERY-th state and the last one (default: the last one alone)");
    add_set_option(command, options->overrides);
    command.option("--threads", options->threads, "Threads that compute (default: as many as the machine runs)")
        .between(1, 1024);
    command.flag("--unmeasured", options->unmeasured,
                 "do not measure errors by companions, which take 3/2 of the sweep's time");
    command.flag("--beyond-horizon", options->beyond_horizon,
                 "trajectories of which nothing is left are no failures: for the statistics of chaos");
    command.flag("--quiet", options->quiet, "Print nothing but errors");
    command.footer(
        "Example:\n  lobatto sweep scenes/pendulum.toml --vary q=0:3:1000 --vary omega=1,2,5 --until 10 -o table.npy");
    command.does([options] { sweep(*options); });
}

}  // namespace lobatto
