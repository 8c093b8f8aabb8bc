// SPDX-License-Identifier: GPL-2.0-or-later
// lobatto run: a scene from text to trajectory, and what there is to say about it.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "analysis/columns.hpp"
#include "analysis/exact_start.hpp"
#include "analysis/tradeoff/candidate.hpp"
#include "cli/commands/commands.hpp"
#include "cli/options/output_path.hpp"
#include "cli/options/resume.hpp"
#include "cli/options/settings.hpp"
#include "cli/print/after_a_while.hpp"
#include "cli/print/answers_json.hpp"
#include "cli/print/interruption.hpp"
#include "cli/print/progress.hpp"
#include "cli/print/say.hpp"
#include "cli/print/summary.hpp"
#include "cli/print/tell.hpp"
#include "cli/table/trajectory_output.hpp"
#include "library/opened_run.hpp"
#include "runtime/error.hpp"
#include "runtime/files/decimal.hpp"
#include "runtime/measure/diagnostics.hpp"
#include "runtime/run/output.hpp"

namespace lobatto {

namespace {

struct RunOptions {
    std::string scene;
    std::string output;  // empty: out/NAME.csv
    api::Settings settings;
    Shortcuts shortcuts = Shortcuts::all;
    bool resume = false;
    bool unmeasured = false;
    std::string companion;
    bool beyond_horizon = false;
    bool quiet = false;
    bool json = false;
};

TrajectoryHeader header_of(const Scene& scene, const KernelSource& source, const TrajectoryRequest& request) {
    TrajectoryHeader header;
    header.scene = scene.title.empty() ? scene.name : scene.title;
    const bool whole = !request.whole_q.empty();
    const int parts = whole ? static_cast<int>(request.whole_step.size()) : 1;
    header.method = fmt::format(
        "{}, h = {}{}{}{}", scene.method.name(), decimal_text(whole ? request.whole_step.data() : &request.step, parts),
        request.tolerance > 0 ? fmt::format(", to {}", request.tolerance) : "",
        scene.clock ? ", clock = " + scene.clock->text : "",
        scene.method.numbers == Precision::double_ ? "" : ", in " + precision_name(scene.method.numbers));
    header.kernel = source.digest;
    for (std::size_t i = 0; i < scene.parameters.size(); ++i) {
        if (scene.parameters[i].is_side) continue;
        const double* const value =
            whole ? request.whole_parameters.data() + i * static_cast<std::size_t>(parts) : &request.parameters[i];
        header.parameters.emplace_back(scene.parameters[i].name, decimal_text(value, parts));
    }
    header.columns = {{"t", ""}};
    for (const Coordinate& coordinate : scene.coordinates)
        header.columns.emplace_back(coordinate.name, coordinate.unit);
    if (scene.outputs.momenta)
        for (const Coordinate& coordinate : scene.coordinates) header.columns.emplace_back("p_" + coordinate.name, "");
    const auto beside = names_beside(scene);
    header.columns.insert(header.columns.end(), beside.begin(), beside.end());
    header.beside = static_cast<int>(beside.size());
    header.energy = scene.outputs.energy;
    if (header.energy) header.columns.emplace_back("H", "");
    return header;
}

// Of the file beside it with the events: their numbers, then the state as in the trajectory.
TrajectoryHeader event_header_of(const Scene& scene, TrajectoryHeader header) {
    header.columns.resize(header.columns.size() - static_cast<std::size_t>(header.beside) - (header.energy ? 1 : 0));
    header.beside = 0;
    header.energy = false;
    std::string number = "event";
    while (std::any_of(header.columns.begin(), header.columns.end(), [&](const auto& c) { return c.first == number; }))
        number += '_';
    header.columns.insert(header.columns.begin(), {number, ""});
    for (const Event& event : scene.reported()) header.events.push_back(event.text);
    return header;
}

std::string iterations_text(const lobatto_kernel& kernel, const TrajectoryResult& result, std::int64_t steps) {
    if (kernel.form == LOBATTO_LINEAR_MAP) return "none: the step is a linear map";
    if (kernel.unknowns == 0) return "none: the step is explicit";
    if (kernel.linear != 0) return "none: the equations of a step are linear";
    return fmt::format("{:.2f} per step, at most {}",
                       static_cast<double>(result.iterations) / static_cast<double>(steps), result.iterations_most);
}

// Nothing where the first step has no derivative in this precision.
std::optional<double> defect_of(const Kernel& kernel, Precision numbers, const Scene& scene) {
    try {
        if (has_many_digits(numbers)) {
            TrajectoryRequest request;
            add_digits(request, scene, kernel);
            NumberStepper stepper(kernel);
            stepper.prepare(request.whole_parameters, request.whole_step);
            return symplectic_defect(stepper, request.whole_q, request.whole_p);
        }
        return with_type_of(numbers, [&](auto type) -> std::optional<double> {
            using real = decltype(type);
            const ExactStart exact(scene);
            const auto h = number_of<real>(scene.evaluate(scene.run.step, "the step"));
            const StartIn<real> start = start_in<real>(exact, kernel, h);
            LoadedStepper<real> stepper(kernel);
            stepper.prepare(start.parameters, h);
            return static_cast<double>(symplectic_defect(stepper, start.q, start.p));
        });
    } catch (const ComputationError&) {
        return std::nullopt;
    }
}

// Where the kernel comes from.
std::string origin_text(const PreparedRun& run) {
    if (run.derived_from_cache && run.compiled.from_cache) return "found derived and compiled in the cache";
    const std::string derived = run.derived_from_cache ? "found derived in the cache"
                                                       : fmt::format("derived in {:.2f} s", run.derivation_seconds);
    return derived + (run.compiled.from_cache ? ", found compiled in the cache"
                                              : fmt::format(", compiled in {:.2f} s", run.compiled.seconds));
}

// Of the first step, its equations solved to rounding.
bool has_defect(const PreparedRun& run) {
    return run.kernel.table().has_tangent != 0 && !run.outline.system.has_forces();
}

std::string defect_text(const PreparedRun& run) {
    const std::optional<double> defect = defect_of(run.kernel, run.scene.method.numbers, run.scene);
    return defect && std::isfinite(*defect) ? fmt::format("{:.2g}", *defect)
                                            : "not measured: the first step has no derivative in this precision";
}

bool ends_at_tolerance(const PreparedRun& run, const TrajectoryRequest& request) {
    const bool has_constant_masses = run.source.form != StepForm::general;
    return request.tolerance > 0 && heeds_tolerance(run.scene.method, run.kernel->linear != 0, has_constant_masses);
}

void print_table(const PreparedRun& run, const TrajectoryRequest& request, const TrajectoryResult& result,
                 const Watch& watch) {
    const Scene& scene = run.scene;
    const bool clocked = scene.clock.has_value();
    const std::string of_all =
        clocked || result.steps_done == request.steps || result.stop >= 0 ? "" : fmt::format(" of {}", request.steps);
    const std::int64_t steps = clocked ? result.chain_steps : result.steps_done;
    print_row("steps", fmt::format("{}{}, h = {:.6g}{}, to t = {:.6g}", steps, of_all, request.step,
                                   clocked ? " in the time of the clock " + scene.clock->text : "", result.time));
    if (steps == 0) return;
    const lobatto_kernel& kernel = run.kernel.table();
    print_row("time per step", duration(result.seconds / static_cast<double>(steps)));
    print_row("iterations", iterations_text(kernel, result, steps));
    const bool conserves = run.outline.conserves_energy();
    const std::string at_most = request.dense > 0   ? "at most, at the ends of steps"
                                : request.every > 1 ? "at most, of the states that are kept"
                                                    : "at most";
    if (scene.outputs.energy) {
        const double H0 = std::fabs(result.energy_start);
        const bool relative = conserves && H0 > result.energy_error_largest;
        print_row(conserves ? "energy error" : "energy change",
                  fmt::format("{:.2g} {}{}", result.energy_error_largest, at_most,
                              relative ? fmt::format(", relative {:.2g}", result.energy_error_largest / H0) : ""));
    }
    if (const auto error = conserves ? watch.discrete_error() : std::nullopt)
        print_row("discrete energy error", fmt::format("relative {:.2g} at most", *error));
    if (has_defect(run))
        print_row("symplectic defect",
                  ends_at_tolerance(run, request)
                      ? fmt::format("not exact: steps are iterated to {:.2g} only", request.tolerance)
                  : scene.impacts.empty() ? defect_text(run)
                                          : defect_text(run) + ", of a step without impacts");
    if (const auto error = watch.position_error()) {
        const std::string& unit = scene.coordinates.front().unit;
        print_row("position error",
                  fmt::format("{:.2g}{} {}, against the exact {}solution", *error, unit.empty() ? "" : " " + unit,
                              at_most, watch.is_elliptic() ? "elliptic " : ""));
    }
}

// `counts`: of the states, then of each kind of event.
void print_events(const Scene& scene, const TrajectoryResult& result, const std::vector<double>& counts,
                  const std::string& path) {
    const std::vector<Event> watched = scene.reported();
    const std::size_t stops = scene.outputs.events.size(), impacts = stops + scene.run.stops.size();
    if (result.stop >= 0) {
        const auto number = static_cast<std::size_t>(result.stop);
        print_row("stopped", fmt::format("{} '{}' at t = {:.9g}", number < impacts ? "by" : "at rest on",
                                         watched[number].text, result.time));
    }
    // Of many those that happened.
    const auto print = [&](const char* what, std::size_t first, std::size_t last) {
        constexpr std::size_t many = 10;
        std::vector<std::string> rows;
        std::size_t others = 0;
        for (std::size_t i = first; i < last; ++i)
            if (counts[1 + i] == 0 && last - first > many)
                ++others;
            else
                rows.push_back(fmt::format("{} of '{}'", counts[1 + i], watched[i].text));
        if (others > 0)
            rows.push_back(rows.empty() ? fmt::format("none of {}", others)
                                        : fmt::format("none of the {} others", others));
        for (std::size_t k = 0; k < rows.size(); ++k)
            print_row(k == 0 ? what : "",
                      rows[k] + (last == watched.size() && k + 1 == rows.size() ? ", in " + path : ""));
    };
    print("events", 0, stops);
    print("impacts", impacts, watched.size());
}

// Beside the trajectory: run.csv, run.events.csv. A pipe or a device has no beside: then as without -o.
std::string event_path(const RunOptions& options, const Scene& scene) {
    std::error_code ignored;
    const bool beside = options.output.empty() || (!is_standard_output(options.output) &&
                                                   (!std::filesystem::exists(options.output, ignored) ||
                                                    std::filesystem::is_regular_file(options.output, ignored)));
    std::string path = output_path(beside ? options.output : "", result_name(scene.path) + ".csv");
    for (const TableFormat format : {TableFormat::csv, TableFormat::npy, TableFormat::h5})
        if (const std::string ending = ending_of(format); path.ends_with(ending))
            path.resize(path.size() - ending.size());
    return path + ".events.csv";
}

TableFormat format_of(const RunOptions& options) {
    return options.output.empty() ? TableFormat::csv : table_format(options.output);
}

// The files of a run: its trajectory, its events, and while it goes on its checkpoint.
class Files {
public:
    Files(const RunOptions& options, const PreparedRun& run, const TrajectoryHeader& header,
          const std::optional<Checkpoint>& from)
        : path_(output_path(options.output, result_name(run.scene.path) + ".csv")),
          trajectory_(path_, format_of(options), run.scene, header, from ? from->files[0] : Written()) {
        if (!run.scene.reported().empty()) {
            event_path_ = event_path(options, run.scene);
            events_.emplace(event_path_, event_header_of(run.scene, header), from ? from->files[1] : Written());
        }
        if (keeps_checkpoints() && !from) remove_checkpoint(path_);  // of a run that has just lost its files
    }

    bool keeps_checkpoints() const { return trajectory_.can_go_on() && (!events_ || events_->is_regular()); }
    const std::string& path() const { return path_; }
    const std::string& events_path() const { return event_path_; }

    void write(const Records& records) { trajectory_.write(records); }
    void write(const EventRecords& records) { events_->write(records); }
    void checkpoint(const std::string& run, const Halfway& halfway, const RunObservers& observers) {
        Checkpoint checkpoint{run, halfway, {trajectory_.written()}, observers.save()};
        trajectory_.sync();
        if (events_) {
            events_->sync();
            checkpoint.files.push_back(events_->written());
        }
        write_checkpoint(checkpoint_path(path_), checkpoint);
    }
    void finish(bool interrupted) {
        trajectory_.finish();
        if (events_) events_->finish();
        if (keeps_checkpoints() && !interrupted) remove_checkpoint(path_);
    }

private:
    std::string path_, event_path_;
    TrajectoryOutput trajectory_;
    std::optional<TrajectoryFile> events_;
};

// Takes the steps, into the files.
const TrajectoryResult& go_into(Files& files, api::OpenedRun& run, const std::string& identity, bool quiet) {
    api::OpenedRun::Listeners listeners;
    listeners.states = [&](const Records& records) { files.write(records); };
    listeners.events = [&](const EventRecords& records) { files.write(records); };
    if (files.keeps_checkpoints())
        listeners.checkpoint = [&](const Halfway& halfway) { files.checkpoint(identity, halfway, run.observers()); };
    Progress progress(run.request().steps);
    if (!quiet) listeners.progress = [&](std::int64_t done) { progress.show(done); };
    listeners.interrupted = Interruption::flag();
    const TrajectoryResult& result = run.go(listeners);
    files.finish(result.interrupted);
    return result;
}

api::RunOptions wish_of(const RunOptions& options) {
    api::RunOptions wish;
    static_cast<api::Settings&>(wish) = options.settings;
    wish.measure = !options.unmeasured;
    wish.companion = options.companion;
    wish.beyond_horizon = options.beyond_horizon;
    return wish;
}

// Ends the command with the error that the run deserves, if any.
void fail_where_it_failed(const Scene& scene, const TrajectoryResult& result, const RunVerdict& verdict,
                          const Files& files) {
    if (!verdict.failure.empty())
        throw ComputationError(fmt::format("{}: {} What was computed {}.", scene.path, verdict.failure,
                                           is_standard_output(files.path()) ? "was written" : "is in " + files.path()));
    if (result.interrupted) {
        tell("lobatto: interrupted at t = {:.6g}; what was computed is in {}.{}\n", result.time, files.path(),
             files.keeps_checkpoints() ? " The same command with --resume continues from there." : "");
        throw ExitCode{interrupted_exit};
    }
    if (*Interruption::flag() != 0) {
        tell("lobatto: interrupted after the last step; the whole run {}.\n",
             is_standard_output(files.path()) ? "was written" : "is in " + files.path());
        throw ExitCode{interrupted_exit};
    }
}

// What a file of this kind cannot hold, or not go on with.
void refuse_format(const RunOptions& options) {
    const bool is_csv = !is_standard_output(options.output) && format_of(options) == TableFormat::csv;
    if (options.resume && !is_csv)
        throw InputError(fmt::format("--resume: {} cannot be continued, only a .csv can; leave --resume out",
                                     is_standard_output(options.output) ? "standard output" : options.output));
}

// What to say if deriving takes long. Empty: nothing.
std::string on_long_formulas(const Scene& scene) {
    const auto in_space =
        std::count_if(scene.bodies.begin(), scene.bodies.end(), [](const auto& b) { return !b.plane; });
    const auto coordinates = std::ssize(scene.coordinates);  // 7 of a free body, which no joint makes long
    return in_space > 2 && coordinates < 7 * in_space
               ? "lobatto: formulas of bodies in space grow about threefold with each joint of a chain; constraint = "
                 "true in the line of a joint keeps them short (docs/scene_format.md)"
               : "";
}

void run(const RunOptions& options) {
    if (!options.output.empty()) keep_scene(options.scene, options.output);
    refuse_format(options);
    const bool quiet = options.quiet || is_standard_output(options.output);
    if (options.json && is_standard_output(options.output))
        throw InputError("--json: standard output has the trajectory; name a file with -o");
    const api::Scene read(options.scene);
    Say say;
    if (!quiet) say("deriving and compiling");
    std::optional<AfterAWhile> waiting(quiet ? "" : on_long_formulas(read.parts().scene));
    api::OpenedRun opened(read, wish_of(options), options.shortcuts);
    waiting.reset();
    say.clear();
    const PreparedRun& run = opened.prepared();
    const TrajectoryRequest& request = opened.request();
    const RunObservers& observers = opened.observers();
    const Scene& scene = run.scene;
    const std::string path = output_path(options.output, result_name(scene.path) + ".csv");
    const bool has_events = !scene.reported().empty();
    keep_scene(scene.path, path);
    keep_foreign(path);
    if (format_of(options) == TableFormat::npy) keep_foreign(path + ".json");
    if (has_events) {
        keep_scene(scene.path, event_path(options, scene));
        keep_foreign(event_path(options, scene));
    }
    if (!options.resume) keep_strangers(path);
    if (!quiet && !options.json) fmt::print("{}: kernel {}, {}\n", scene.path, run.source.digest, origin_text(run));

    const TrajectoryHeader header = header_of(scene, run.source, request);
    const std::string identity = identity_of(scene, request, header, run.compiled.object);
    std::optional<Checkpoint> from;
    if (options.resume) {
        from = checkpoint_of(path, identity, run.kernel, has_events ? 2 : 1, RunObservers::names);
        if (from) opened.resume(from->halfway, from->observers);
        if (!quiet && !options.json)
            print_row("resumed", from ? fmt::format("at t = {:.6g}, after {} steps", from->halfway.result.time,
                                                    scene.clock ? from->halfway.result.chain_steps
                                                                : from->halfway.result.steps_done)
                                      : "nothing was left: from the start");
    }
    Files files(options, run, header, from);
    const Interruption interruption;
    const TrajectoryResult& result = go_into(files, opened, identity, quiet);
    if (!quiet && !options.companion.empty()) say("measuring the error in " + options.companion);
    const RunVerdict verdict = opened.verdict([] { return *Interruption::flag() == 0; });
    say.clear();
    for (const std::string& warning : verdict.warnings) tell("lobatto: warning: {}.\n", warning);
    if (options.json) {
        const bool is_exact = has_defect(run) && !ends_at_tolerance(run, request) && result.steps_done > 0;
        fmt::print("{}", json_of_run(run, request, result, observers, verdict,
                                     is_exact ? defect_of(run.kernel, scene.method.numbers, scene) : std::nullopt,
                                     {path, has_events ? files.events_path() : ""}));
    } else if (!quiet) {
        print_table(run, request, result, observers.watch);
        if (verdict.error)
            print_row("measured error", text_of(*verdict.error, scene));
        else if (!options.unmeasured && result.stop >= 0 && result.steps_done > 0)
            print_row("measured error", "none: the companion did not come to the stop");
        print_events(scene, result, observers.counts, files.events_path());
        const double states = observers.counts[0];
        print_row("trajectory", fmt::format("{}, {} {}", path, states, states == 1 ? "state" : "states"));
        if (const std::string end = ends_early(run, result); !end.empty()) fmt::print("{}\n", end);
    }
    fail_where_it_failed(scene, result, verdict, files);
}

}  // namespace

void add_run(CommandLine& program) {
    Command command =
        program.command("run", "Derive, compile and run a scene; write its trajectory and say how good it is");
    const auto options = std::make_shared<RunOptions>();
    command.option("SCENE", options->scene, "Scene file").required();
    command
        .option("-o,--output", options->output,
                "Trajectory: .csv, .npy (NumPy) or .h5 (HDF5), or - for standard output (default: out/NAME.csv)")
        .shown_as("FILE");
    add_method_options(command, options->settings);
    add_general_flag(command, options->shortcuts);
    add_step_option(command, options->settings);
    add_until_option(command, options->settings);
    command.option("--every", options->settings.every, "Keep every N-th state; with a clock the time between two")
        .shown_as("N");
    add_set_option(command, options->settings);
    command.flag("--resume", options->resume,
                 "Continue the same run where it was interrupted or killed, in a .csv; its files are then the same, "
                 "byte for byte");
    command.flag("--unmeasured", options->unmeasured,
                 "Do not measure the error by a companion, the same run with 2/3 of the step on another processor");
    command
        .option("--companion", options->companion,
                "Numbers of the companion, such as double-double: the error to two digits where rounding decides it, "
                "too. The run waits for it")
        .shown_as("NUMBERS");
    command.flag(
        "--beyond-horizon", options->beyond_horizon,
        "Continue even when the error is as large as the motion, for the statistics of chaos; else that is an error");
    command.flag("--quiet", options->quiet, "Print nothing but warnings and errors");
    add_json_option(command, options->json);
    command.footer("Example:\n  lobatto run scenes/pendulum.toml --step 0.1 --until 100 -o pendulum.csv");
    command.does([options] { run(*options); });
}

}  // namespace lobatto
