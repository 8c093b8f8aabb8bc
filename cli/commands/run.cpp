// SPDX-License-Identifier: GPL-2.0-or-later
// lobatto run: a scene from text to trajectory, and what there is to say about it.
#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <map>
#include <thread>

#include "analysis/accuracy/companion.hpp"
#include "analysis/accuracy/domains.hpp"
#include "analysis/accuracy/energy_watch.hpp"
#include "analysis/accuracy/step_judge.hpp"
#include "analysis/accuracy/watch.hpp"
#include "analysis/exact_start.hpp"
#include "analysis/kernel_of.hpp"
#include "analysis/motion.hpp"
#include "analysis/stability/linear_departure.hpp"
#include "analysis/tradeoff/candidate.hpp"
#include "cli/commands/commands.hpp"
#include "cli/options/method.hpp"
#include "cli/options/output_path.hpp"
#include "cli/options/overrides.hpp"
#include "cli/options/resume.hpp"
#include "cli/print/interruption.hpp"
#include "cli/print/progress.hpp"
#include "cli/print/summary.hpp"
#include "cli/print/tell.hpp"
#include "generator/mechanics/automatic_clock.hpp"
#include "generator/mechanics/start.hpp"
#include "generator/pipeline.hpp"
#include "runtime/error.hpp"
#include "runtime/measure/diagnostics.hpp"
#include "runtime/run/decimal.hpp"
#include "runtime/run/output.hpp"

namespace lobatto {

namespace {

struct RunOptions {
    std::string scene;
    std::string output;  // empty: out/NAME.csv
    MethodOption method;
    bool general = false;
    Overrides overrides;
    bool resume = false;
    bool unmeasured = false;
    bool beyond_horizon = false;
    bool quiet = false;
};

TrajectoryHeader header_of(const Scene& scene, const KernelSource& source, const TrajectoryRequest& request) {
    TrajectoryHeader header;
    header.scene = scene.title.empty() ? scene.name : scene.title;
    const bool whole = !request.whole_q.empty();
    const int parts = whole ? static_cast<int>(request.whole_step.size()) : 1;
    header.method = fmt::format(
        "{}, h = {}{}{}", scene.method.name(), decimal_text(whole ? request.whole_step.data() : &request.step, parts),
        scene.clock ? ", clock = " + scene.clock->text : "",
        scene.method.numbers == Precision::double_ ? "" : ", in " + precision_name(scene.method.numbers));
    header.kernel = source.digest;
    for (std::size_t i = 0; i < scene.parameters.size(); ++i)
        header.parameters.emplace_back(
            scene.parameters[i].name,
            decimal_text(
                whole ? request.whole_parameters.data() + i * static_cast<std::size_t>(parts) : &request.parameters[i],
                parts));
    header.columns = {{"t", ""}};
    for (const Coordinate& coordinate : scene.coordinates)
        header.columns.emplace_back(coordinate.name, coordinate.unit);
    if (scene.outputs.momenta)
        for (const Coordinate& coordinate : scene.coordinates) header.columns.emplace_back("p_" + coordinate.name, "");
    if (scene.outputs.multipliers) {
        header.multipliers = static_cast<int>(scene.constraints.size());
        for (const Constraint& constraint : scene.constraints)
            header.columns.emplace_back("lambda_" + constraint.name, "");
    }
    header.energy = scene.outputs.energy;
    if (header.energy) header.columns.emplace_back("H", "");
    return header;
}

// Of the file beside it with the events: their numbers, then the state as in the trajectory.
TrajectoryHeader event_header_of(const Scene& scene, TrajectoryHeader header) {
    header.columns.resize(header.columns.size() - static_cast<std::size_t>(header.multipliers) -
                          (header.energy ? 1 : 0));
    header.multipliers = 0;
    header.energy = false;
    header.columns.insert(header.columns.begin(), {"event", ""});
    for (const Event& event : scene.reported()) header.events.push_back(event.text);
    return header;
}

double seconds_since(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

std::string iterations_text(const lobatto_kernel& kernel, const TrajectoryResult& result, std::int64_t steps) {
    if (kernel.form == LOBATTO_LINEAR_MAP) return "none: the step is a linear map";
    if (kernel.unknowns == 0) return "none: the step is explicit";
    if (kernel.linear != 0) return "none: the equations of a step are linear";
    return fmt::format("{:.2f} per step, at most {}",
                       static_cast<double>(result.iterations) / static_cast<double>(steps), result.iterations_most);
}

std::string defect_text(const Kernel& kernel, Precision numbers, const Scene& scene) {
    try {
        return with_type_of(numbers, [&](auto type) {
            using real = decltype(type);
            const ExactStart exact(scene);
            const auto h = number_of<real>(scene.evaluate(scene.run.step, "the step"));
            const StartIn<real> start = start_in<real>(exact, kernel, h);
            LoadedStepper<real> stepper(kernel);
            stepper.prepare(start.parameters, h);
            return fmt::format("{:.2g}", static_cast<double>(symplectic_defect(stepper, start.q, start.p)));
        });
    } catch (const ComputationError&) {
        return "not measured: the first step has no derivative in this precision";
    }
}

void print_table(const Derivation& derivation, const Scene& scene, const Kernel& run_kernel,
                 const TrajectoryRequest& request, const TrajectoryResult& result, const Watch& watch) {
    const bool clocked = scene.clock.has_value();
    const std::string of_all =
        clocked || result.steps_done == request.steps || result.stop >= 0 ? "" : fmt::format(" of {}", request.steps);
    const std::int64_t steps = clocked ? result.chain_steps : result.steps_done;
    print_row("steps", fmt::format("{}{}, h = {:.6g}{}, to t = {:.6g}", steps, of_all, request.step,
                                   clocked ? " in the time of the clock " + scene.clock->text : "", result.time));
    if (steps == 0) return;
    const lobatto_kernel& kernel = run_kernel.table();
    print_row("time per step", duration(result.seconds / static_cast<double>(steps)));
    print_row("iterations", iterations_text(kernel, result, steps));
    const bool conserves = derivation.conserves_energy();
    if (scene.outputs.energy) {
        const double H0 = std::fabs(result.energy_start);
        const bool relative = conserves && H0 > result.energy_error_largest;
        print_row(conserves ? "energy error" : "energy change",
                  fmt::format("{:.2g} at most{}", result.energy_error_largest,
                              relative ? fmt::format(", relative {:.2g}", result.energy_error_largest / H0) : ""));
    }
    if (const auto error = conserves ? watch.discrete_error() : std::nullopt)
        print_row("discrete energy error", fmt::format("relative {:.2g} at most", *error));
    if (kernel.has_tangent != 0 &&
        !derivation.system.has_forces())  // of the first step, its equations solved to rounding
        print_row("symplectic defect",
                  request.tolerance > 0 ? fmt::format("not exact: steps are iterated to {:.2g} only", request.tolerance)
                                        : defect_text(run_kernel, scene.method.numbers, scene));
    if (const auto error = watch.position_error()) {
        const std::string& unit = scene.coordinates.front().unit;
        print_row("position error",
                  fmt::format("{:.2g}{} at most, against the exact {}solution", *error, unit.empty() ? "" : " " + unit,
                              watch.is_elliptic() ? "elliptic " : ""));
    }
}

// `counts`: of the states, then of each kind of event.
void print_events(const Scene& scene, const TrajectoryResult& result, const std::vector<double>& counts,
                  const std::string& path) {
    const std::vector<Event> watched = scene.reported();
    if (result.stop >= 0)
        print_row("stopped", fmt::format("by '{}' at t = {:.9g}", watched[static_cast<std::size_t>(result.stop)].text,
                                         result.time));
    const std::size_t stops = scene.outputs.events.size(), impacts = stops + scene.run.stops.size();
    bool is_named = false;
    for (std::size_t i = 0; i < watched.size(); ++i) {
        if (i == impacts) is_named = false;
        if (i >= stops && i < impacts) continue;
        print_row(
            is_named      ? ""
            : i < impacts ? "events"
                          : "impacts",
            fmt::format("{} of '{}'{}", counts[1 + i], watched[i].text, i + 1 < watched.size() ? "" : ", in " + path));
        is_named = true;
    }
}

// Beside the trajectory: run.csv, run.events.csv. A pipe or a device has no beside: then as without -o.
std::string event_path(const RunOptions& options, const Scene& scene) {
    std::error_code ignored;
    const bool beside = options.output.empty() || !std::filesystem::exists(options.output, ignored) ||
                        std::filesystem::is_regular_file(options.output, ignored);
    std::string path = output_path(beside ? options.output : "", result_name(scene.path) + ".csv");
    if (path.ends_with(".csv")) path.resize(path.size() - 4);
    return path + ".events.csv";
}

// A scene, ready to run: its kernel compiled, its start in numbers.
struct Prepared {
    Scene scene;
    Derivation derivation;
    KernelSource source;
    Compiled compiled;
    Kernel kernel;  // in the scene's numbers
    Kernel plain;   // the same in double, for what looks at states in doubles
    Steps steps;
    double derivation_seconds;
};

Prepared prepare(const RunOptions& options) {
    const auto start = std::chrono::steady_clock::now();
    Scene scene = read_scene(options.scene);
    options.method.apply(scene);
    if (scene.clock && scene.method.numbers != Precision::double_)
        scene.source.fail(scene.clock->at, "with a clock `lobatto run` computes in double, but numbers are \"" +
                                               precision_name(scene.method.numbers) +
                                               "\"; remove the clock, or give --numbers double");
    Derivation derivation = derive(scene, options.general);
    if (EnergyWatch::can_watch(derivation)) derivation.scene.outputs.energy = true;
    const Precision numbers = scene.method.numbers;
    const KernelSource source = emit(derivation, {numbers, {}});
    const double derivation_seconds = seconds_since(start);
    apply(options.overrides, scene);  // after the derivation: one kernel serves all values
    if (!options.overrides.set.empty()) check_domains(scene, derivation.system);
    const Steps steps = steps_of(scene, options.overrides);
    Compiled compiled;
    const Kernel kernel = kernel_of(source, numbers, &compiled);
    const Kernel plain = numbers == Precision::double_ ? kernel : kernel_of(emit(derivation), Precision::double_);
    return {scene, derivation, source, compiled, kernel, plain, steps, derivation_seconds};
}

// All that looks at the states of a run, and what each of them has to keep for a later run that goes on.
class Observers {
public:
    static inline const std::vector<std::string> names = {"counts",       "watch",     "step judge",
                                                          "energy watch", "companion", "left domain"};

    // `measures`: whether a companion runs beside it.
    Observers(const Prepared& run, const LoadedStepper<double>& stepper, const TrajectoryRequest& request,
              const std::vector<double>& velocity, bool measures)
        : watch(run.scene, run.derivation.structure, stepper, velocity),
          judge(run.scene),
          energy(run.derivation, run.plain),
          domains(run.scene, run.derivation.system),
          parameters(request.parameters),
          counts(1 + run.scene.reported().size(), 0) {
        if (measures) companion.emplace(run.derivation, run.kernel, request);
    }

    void observe(const Records& records) {
        watch.observe(records);
        judge.observe(records);
        energy.observe(records);
        if (companion) companion->observe(records);
        if (left_domain.empty())
            if (const std::int64_t i = domains.left_at(parameters, records); i >= 0)
                left_domain.assign(records.rows + i * records.columns, records.rows + (i + 1) * records.columns);
        counts[0] += static_cast<double>(records.count);
    }
    void observe(const EventRecords& records) {
        for (std::int64_t i = 0; i < records.count; ++i)
            ++counts[1 + static_cast<std::size_t>(records.rows[i * records.columns])];
    }

    std::map<std::string, std::vector<double>> save() const {
        return {{"counts", counts},
                {"watch", watch.save()},
                {"step judge", judge.save()},
                {"energy watch", energy.save()},
                {"companion", companion ? companion->save() : std::vector<double>()},
                {"left domain", left_domain}};
    }
    void restore(const std::map<std::string, std::vector<double>>& saved) {
        counts = saved.at("counts");
        watch.restore(saved.at("watch"));
        judge.restore(saved.at("step judge"));
        energy.restore(saved.at("energy watch"));
        if (companion) companion->restore(saved.at("companion"));
        left_domain = saved.at("left domain");
    }

    Watch watch;
    StepJudge judge;
    EnergyWatch energy;
    std::optional<Companion> companion;
    Domains domains;
    std::vector<double> parameters;
    std::vector<double> left_domain;  // t, q, p: the first state where a formula has no value
    std::vector<double> counts;       // of the states, and of each kind of event
};

// The files of a run: its trajectory, its events, and while it goes on its checkpoint.
class Files {
public:
    Files(const RunOptions& options, const Prepared& run, const TrajectoryHeader& header,
          const std::optional<Checkpoint>& from)
        : path_(output_path(options.output, result_name(run.scene.path) + ".csv")),
          trajectory_(path_, header, from ? from->files[0] : Written()) {
        if (!run.scene.reported().empty()) {
            event_path_ = event_path(options, run.scene);
            events_.emplace(event_path_, event_header_of(run.scene, header), from ? from->files[1] : Written());
        }
        if (keeps_checkpoints() && !from) remove_checkpoint(path_);  // of a run that has just lost its files
    }

    bool keeps_checkpoints() const { return trajectory_.is_regular() && (!events_ || events_->is_regular()); }
    const std::string& path() const { return path_; }
    const std::string& events_path() const { return event_path_; }

    void write(const Records& records) { trajectory_.write(records); }
    void write(const EventRecords& records) { events_->write(records); }
    void checkpoint(const std::string& run, const Halfway& halfway, const Observers& observers) {
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
    TrajectoryFile trajectory_;
    std::optional<TrajectoryFile> events_;
};

// Takes the steps: records go to the files and the observers.
TrajectoryResult integrate_into(Files& files, Observers& observers, const std::string& identity, const Prepared& run,
                                TrajectoryRequest& request, bool quiet) {
    request.sink = [&](const Records& records) {
        files.write(records);
        observers.observe(records);
    };
    if (!run.scene.reported().empty())
        request.events = [&](const EventRecords& records) {
            files.write(records);
            observers.observe(records);
        };
    if (files.keeps_checkpoints())
        request.checkpoint = [&](const Halfway& halfway) { files.checkpoint(identity, halfway, observers); };
    Progress progress(request.steps);
    if (!quiet) request.progress = [&](std::int64_t done) { progress.show(done); };
    const Interruption interruption;
    request.interrupted = interruption.flag();
    TrajectoryResult result = integrate(run.kernel, request);
    observers.watch.look_at_end(result);
    files.finish(result.interrupted);
    return result;
}

// Of a motion that may come near a pole.
std::string clock_advice(const Scene& scene) {
    const bool helps = !scene.clock && has_automatic_clock(scene);
    return helps ? ", or clock = \"auto\" under [method], whose steps follow close encounters" : "";
}

// That nothing of the motion is left in the result, unless that was accepted. Empty: something is.
std::string loss_of(const RunOptions& options, const Scene& scene, const TrajectoryRequest& request,
                    const std::optional<MeasuredError>& error) {
    if (!error || !error->is_lost() || options.beyond_horizon || scene.run.beyond_horizon) return "";
    const std::string clock = clock_advice(scene);
    const char* const why = error->companion_stopped
                                ? "there the same run with 2/3 of the step cannot go on, and what follows is not known"
                                : "from there on the error is as large as the motion itself, and nothing of it is left";
    const std::string chaos =
        error->doubling ? fmt::format(", an earlier end (errors double every {:.3g})", *error->doubling) : "";
    return fmt::format(
        "the run left its motion by t = {:.6g}, q = {}, p = {}: {}. Try a smaller step, such as h = {:.6g}, more "
        "points{}{}, or --beyond-horizon where the statistics of the motion are what counts.",
        *error->lost_after, list_text(error->lost_q), list_text(error->lost_p), why, request.step / 2, clock, chaos);
}

constexpr double missed = 2;  // times the error wanted

std::vector<std::string> warnings_of(const MeasuredError& error, double wanted) {
    if (error.is_lost()) return {};
    std::vector<std::string> texts;
    if (error.worst() > large_error)
        texts.push_back(
            fmt::format("the error is {:.2g} of the amplitude; take a smaller step, or more points", error.worst()));
    else if (wanted > 0 && error.at_end > missed * wanted)
        texts.push_back(
            fmt::format("the scene asks for an error of {:.2g}, and it is {:.2g}; `lobatto tune` chooses a step",
                        wanted, error.at_end));
    return texts;
}

// That a run which went to its end has left the motion of its Lagrangian. Empty: it has not.
std::string departure_of(const Prepared& run, const TrajectoryRequest& request, const TrajectoryResult& result,
                         const Observers& observers) {
    if (result.status != LOBATTO_OK || result.interrupted) return "";
    if (const std::vector<double>& row = observers.left_domain; !row.empty()) {
        const auto middle = row.begin() + 1 + std::ssize(result.q);
        return fmt::format(
            "the run left its Lagrangian by t = {:.6g}, q = {}, p = {}: {}, and has no value there. Try an earlier "
            "end, "
            "or start elsewhere, or write the formula without it.",
            row[0], list_text({row.begin() + 1, middle}), list_text({middle, row.end()}),
            observers.domains.text(observers.parameters, row.data()));
    }
    const std::string departure = observers.energy.departure(run.derivation, run.plain, request);
    if (run.scene.clock || run.scene.is_cut()) return departure;
    return departure.empty() ? linear_departure(run.derivation, run.scene, run.plain, request, result) : departure;
}

// Ends the command with the error that the run deserves, if any.
void fail_where_it_failed(const Scene& scene, const TrajectoryRequest& request, const TrajectoryResult& result,
                          const std::string& departure, const Files& files, const Kernel& kernel) {
    if (result.status != LOBATTO_OK)
        throw ComputationError(fmt::format(
            "{}: {} What was computed is in {}.", scene.path,
            explain_stop(result, request, passing_step(kernel, request, result), clock_advice(scene)), files.path()));
    if (!departure.empty())
        throw ComputationError(fmt::format("{}: {} What was computed is in {}.", scene.path, departure, files.path()));
    if (scene.outputs.energy && !std::isfinite(result.energy_error_largest))
        throw ComputationError(
            std::isfinite(result.energy_start)
                ? fmt::format("{}: the energy became infinite or not a number: the motion grows without bound, or has "
                              "gone where the Lagrangian is not real. Try a smaller step, such as h = {:.6g}, an "
                              "earlier end, or start elsewhere. What was computed is in {}.",
                              scene.path, request.step / 2, files.path())
                : fmt::format("{}: the energy of the start is too large for a number, though the motion is not. Try "
                              "other units, or energy = false under [output]. What was computed is in {}.",
                              scene.path, files.path()));
    if (result.interrupted) {
        tell("lobatto: interrupted at t = {:.6g}; what was computed is in {}.{}\n", result.time, files.path(),
             files.keeps_checkpoints() ? " The same command with --resume continues from there." : "");
        throw ExitCode{interrupted_exit};
    }
}

void run(const RunOptions& options) {
    const Prepared run = prepare(options);
    const Scene& scene = run.scene;
    LoadedStepper<double> stepper(run.plain);
    TrajectoryRequest request = request_of(scene, run.steps.count, stepper);
    add_digits(request, scene, run.kernel);
    const std::string path = output_path(options.output, result_name(scene.path) + ".csv");
    const bool has_events = !scene.reported().empty();
    keep_scene(scene.path, path);
    keep_foreign(path);
    if (has_events) {
        keep_scene(scene.path, event_path(options, scene));
        keep_foreign(event_path(options, scene));
    }
    if (!options.resume) keep_strangers(path);
    if (!options.quiet)
        fmt::print("{}: kernel {}, derived in {:.2f} s, {}\n", scene.path, run.source.digest, run.derivation_seconds,
                   run.compiled.from_cache ? "found compiled in the cache"
                                           : fmt::format("compiled in {:.2f} s", run.compiled.seconds));

    const TrajectoryHeader header = header_of(scene, run.source, request);
    const std::string identity = identity_of(request, header, run.compiled.object);
    std::vector<double> velocity;
    stepper.velocity(request.time, request.q, request.p, velocity);  // it has one: the start was accepted
    Observers observers(run, stepper, request, velocity, !options.unmeasured);
    std::optional<Checkpoint> from;
    if (options.resume) {
        from = checkpoint_of(path, identity, run.kernel, has_events ? 2 : 1, Observers::names);
        if (from) {
            observers.restore(from->observers);
            request.from = &from->halfway;
        }
        if (!options.quiet)
            print_row("resumed", from ? fmt::format("at t = {:.6g}, after {} steps", from->halfway.result.time,
                                                    from->halfway.result.steps_done)
                                      : "nothing was left: from the start");
    }
    Files files(options, run, header, from);
    if (observers.companion && std::thread::hardware_concurrency() > 1) observers.companion->start();
    const TrajectoryResult result = integrate_into(files, observers, identity, run, request, options.quiet);
    std::optional<MeasuredError> error;
    if (observers.companion) error = observers.companion->finish(result);

    std::string departure = departure_of(run, request, result, observers);
    if (departure.empty()) departure = loss_of(options, scene, request, error);
    std::vector<std::string> warnings;
    if (error && departure.empty()) warnings = warnings_of(*error, scene.run.error);
    if (result.status == LOBATTO_OK && result.steps_done > 1 && !scene.clock && !scene.is_cut())
        for (const std::string& warning :
             StepJudge::warnings(observers.judge.judge(run.derivation, run.plain, request, result)))
            warnings.push_back(warning);
    for (const std::string& warning : warnings) tell("lobatto: warning: {}.\n", warning);
    if (!options.quiet) {
        print_table(run.derivation, scene, run.kernel, request, result, observers.watch);
        if (error) print_row("measured error", text_of(*error, scene));
        print_events(scene, result, observers.counts, files.events_path());
        const double states = observers.counts[0];
        print_row("trajectory", fmt::format("{}, {} {}", path, states, states == 1 ? "state" : "states"));
        if (!run.steps.reaches_end)
            fmt::print("The end time is not a multiple of the step: the run ends at the last multiple before it.\n");
    }
    fail_where_it_failed(scene, request, result, departure, files, run.plain);
}

}  // namespace

void add_run(CommandLine& program) {
    Command command =
        program.command("run", "Derive, compile and run a scene; write its trajectory and say how good it is");
    const auto options = std::make_shared<RunOptions>();
    command.option("scene", options->scene, "Scene file").required();
    command.option("-o,--output", options->output, "Trajectory file (default: out/NAME.csv)");
    options->method.add_to(command);
    command.flag("--general", options->general, "use nothing of what the scene's structure allows, for comparison");
    add_step_option(command, options->overrides);
    add_until_option(command, options->overrides);
    command.option("--every", options->overrides.every, "Keep every EVERY-th state");
    add_set_option(command, options->overrides);
    command.flag(
        "--resume", options->resume,
        "continue the same run where it was interrupted or killed; its files are then the same, byte for byte");
    command.flag("--unmeasured", options->unmeasured,
                 "do not measure the error by a companion, the same run with 2/3 of the step on another processor");
    command.flag("--beyond-horizon", options->beyond_horizon,
                 "go on where nothing of the motion is left, for the statistics of chaos; else that is an error");
    command.flag("--quiet", options->quiet, "Print nothing but warnings and errors");
    command.footer("Example:\n  lobatto run scenes/pendulum.toml --step 0.1 --until 100 -o pendulum.csv");
    command.does([options] { run(*options); });
}

}  // namespace lobatto
