// SPDX-License-Identifier: GPL-2.0-or-later
// lobatto sweep: one scene, many starts and parameters, one table of what becomes of them.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <filesystem>

#include "analysis/sweep/tally.hpp"
#include "analysis/sweep/warnings.hpp"
#include "cli/commands/commands.hpp"
#include "cli/options/output_path.hpp"
#include "cli/options/settings.hpp"
#include "cli/options/starts.hpp"
#include "cli/print/interruption.hpp"
#include "cli/print/progress.hpp"
#include "cli/print/say.hpp"
#include "cli/print/summary.hpp"
#include "cli/print/sweep_summary.hpp"
#include "cli/print/tell.hpp"
#include "cli/ranks/crew.hpp"
#include "cli/table/resumed_table.hpp"
#include "cli/table/table_file.hpp"
#include "library/opened_sweep.hpp"
#include "runtime/build/sha256.hpp"
#include "runtime/error.hpp"
#include "runtime/run/output.hpp"

namespace lobatto {

namespace {

struct SweepOptions {
    std::string scene;
    StartsOption starts;
    std::vector<std::string> keep;
    std::string output;  // empty: out/NAME.sweep.csv
    std::string format;  // empty: told by the name of the output
    api::Settings settings;
    std::optional<std::int64_t> steps;
    std::string device = "cpu";
    int threads = 0;
    bool resume = false;
    bool unmeasured = false;
    bool beyond_horizon = false;
    bool quiet = false;
    bool json = false;

    TableFormat table_format() const {
        if (format == "csv") return TableFormat::csv;
        if (format == "binary") return TableFormat::npy;
        return output.empty() ? TableFormat::csv : lobatto::table_format(output);
    }
};

TableHead head_of(const SweepStudy& study) {
    const Scene& scene = study.scene();
    const SweepStarts& starts = study.starts();
    const SweepStudy::Setting& first = study.first_setting();
    using Role = VariedName::Role;
    TableHead head;
    head.kind = "sweep";
    head.scene_text = scene.source.content();
    head.columns = study.rows().columns();
    const bool one_member =
        !starts.varies(Role::points, 0) && !starts.varies(Role::stages, 0) && !starts.varies(Role::splitting, 0);
    head.add("scene", scene.title.empty() ? scene.name : scene.title);
    const Precision numbers = scene.method.numbers;
    head.add("method", fmt::format("{}, h {}{}{}", one_member ? scene.method.name() : std::string("varied"),
                                   starts.varies(Role::step, 0) ? "varied" : "= " + exact_text(first.request.step),
                                   scene.clock ? ", clock = " + scene.clock->text : "",
                                   numbers == Precision::double_ ? "" : ", in " + precision_name(numbers)));
    head.add("kernel", first.source->digest);
    EnsembleStart start;
    starts.start(0, start);
    std::vector<std::string> parameters, statuses;
    for (std::size_t i = 0; i < scene.parameters.size(); ++i)
        if (!starts.varies(Role::parameter, i) && !scene.parameters[i].is_side)
            parameters.push_back(fmt::format("{} = {}", scene.parameters[i].name, exact_text(start.parameters[i])));
    if (!parameters.empty()) head.add("parameters", fmt::format("{}", fmt::join(parameters, ", ")));
    for (const std::string& set : study.overrides().set) head.add("set", set);
    for (const auto& [what, text] : starts.sources()) head.add(what, text);
    for (const auto& [number, event] : scene.ends())
        head.add(fmt::format("stop {}", number - scene.outputs.events.size() + 1), event.text);
    for (int status = 0; status < LOBATTO_STATUSES; ++status)
        if (status != LOBATTO_UNSUPPORTED && status != LOBATTO_STOPPED)
            statuses.push_back(fmt::format("{} {}", status, sweep_statuses[static_cast<std::size_t>(status)]));
    head.add("status", fmt::format("{}", fmt::join(statuses, ", ")));
    head.add("until", exact_text(first.scene.evaluate(first.scene.run.until, "the end time").to_double()));
    head.add("sweep", sha256(study.identity()).substr(0, 16));
    return head;
}

api::OpenedSweep study_of(const SweepOptions& options, int threads) {
    api::SweepOptions wish;
    static_cast<api::Settings&>(wish) = options.settings;
    wish.keep = options.keep;
    wish.device = options.device == "cuda"   ? api::Device::cuda
                  : options.device == "auto" ? api::Device::automatic
                                             : api::Device::processor;
    wish.steps = options.steps;
    wish.threads = threads;
    wish.measure = !options.unmeasured;
    wish.beyond_horizon = options.beyond_horizon;
    return api::open_sweep(api::Scene(options.scene), options.starts.request(), wish);
}

// The table, and what is said of what goes into it.
struct Results {
    std::unique_ptr<TableFile> table;
    SweepTally tally;
    std::int64_t next;  // trajectory that is not in it yet

    void take(const SweepBlock& block, std::size_t columns, std::size_t n) {
        table->add(block.cells.data(), block.cells.size() / columns);
        for (std::size_t i = 0; i < block.figures.size(); ++i)
            tally.add(block.figures[i], block.states.data() + i * 2 * n);
    }
};

Results results_of(const SweepOptions& options, const SweepStudy& study, const std::string& path, const TableHead& head,
                   std::int64_t first) {
    const std::size_t n = study.rows().coordinates();
    Results results{nullptr, SweepTally(n, study.starts().count_of_setting()), first};
    const TableFormat format = options.table_format();
    if (options.resume) {
        std::vector<double> state(2 * n);
        auto resumed = resume_table(path, format, head, first, [&](const TableCell* row) {
            const SweepFigures figures = study.rows().read(row, state.data());
            results.tally.add(figures, state.data());
        });
        if (!options.quiet && !options.json)
            print_row("resumed",
                      resumed ? fmt::format("after {}", counted(resumed->next - first, "trajectory", "trajectories"))
                              : "nothing was left: from the start");
        if (resumed) {
            results.table = std::move(resumed->table);
            results.next = resumed->next;
            results.tally.mark_read_back();
            return results;
        }
    }
    results.table = std::make_unique<TableFile>(path, format, head);
    return results;
}

// Alone, or with others.
StudyTimes compute(SweepStudy& study, CrewLeader* crew, Results& results, std::int64_t last, bool quiet,
                   std::vector<std::string>& warnings) {
    const std::size_t columns = study.rows().columns().size(), n = study.rows().coordinates();
    const std::int64_t first = results.next;
    const Interruption interruption;
    StudyTimes times;
    Progress progress(static_cast<std::int64_t>(study.steps_of(first, last)));
    if (crew != nullptr) {
        const EnsembleRequest& request = study.first_setting().request;
        const double rows = study.rows().one_row_each()
                                ? 1
                                : static_cast<double>(request.steps) / static_cast<double>(request.every) + 2;
        std::int64_t done = first;
        auto shown = std::chrono::steady_clock::now();
        times = crew->compute(
            first, last,
            [&](const SweepBlock& block) {
                results.take(block, columns, n);
                done = block.last;
            },
            [&] {
                if (quiet || std::chrono::steady_clock::now() - shown < std::chrono::milliseconds(100)) return;
                shown = std::chrono::steady_clock::now();
                progress.show(static_cast<std::int64_t>(study.steps_of(first, done)));
            },
            Interruption::flag(), rows * static_cast<double>(columns));
        warnings = crew->end();
        return times;
    }
    SweepBlock block;
    times = study.compute(
        first, last,
        [&](const EnsembleTrajectory& trajectory, const Verdict& verdict, const EnsembleRequest& request) {
            block.clear();
            block.add(study, trajectory, verdict, request);
            results.take(block, columns, n);
        },
        quiet ? std::function<void(std::int64_t)>() : [&](std::int64_t done) { progress.show(done); },
        Interruption::flag());
    warnings = study.end();
    return times;
}

void sweep(const SweepOptions& options) {
    const std::unique_ptr<Ranks> ranks = join_ranks();
    const int threads = options.threads > 0 || !ranks ? options.threads : ranks->threads();
    if (ranks && ranks->number() > 0) return work_in_crew(*ranks, [&] { return study_of(options, threads); });
    std::optional<CrewLeader> crew;
    if (ranks) crew.emplace(*ranks);

    const bool is_stream = is_standard_output(options.output);
    const bool quiet = options.quiet || options.json || is_stream;
    const auto [number, of] = shard_of(options.starts.shard);
    if (!options.output.empty()) keep_scene(options.scene, options.output);
    const TableFormat format = options.table_format();
    Say say;
    if (!quiet) say("deriving and compiling");
    const api::OpenedSweep study = study_of(options, threads);
    say.clear();
    if (options.json && is_stream) throw InputError("--json: standard output has the table; name a file with -o");
    if (options.resume && is_stream)
        throw InputError("--resume: standard output is not read back; name a file with -o");

    const Shard shard{number, of, study->starts().count(), study->first_setting().compiled};
    TableHead head = head_of(*study);
    if (!shard.is_whole()) head.shard = shard;
    const Scene& scene = study->scene();
    const std::string name =
        result_name(scene.path) + ".sweep" + (shard.is_whole() ? "" : fmt::format(".{}of{}", number, of));
    const std::string path = output_path(options.output, name + ending_of(format));
    keep_scene(scene.path, path);
    keep_foreign(path);
    if (format == TableFormat::npy) keep_foreign(path + ".json");
    if (!quiet) fmt::print("{}: kernel {}\n", scene.path, study->first_setting().source->digest);
    Results results = results_of(options, *study, path, head, shard.first());
    std::vector<std::string> warnings;
    StudyTimes times;
    try {
        times = compute(*study, crew ? &*crew : nullptr, results, shard.last(), quiet, warnings);
    } catch (const MachineError&) {  // what was computed is there for --resume
        results.table->flush();
        throw;
    }
    // What was interrupted takes no earlier table's place.
    const bool is_kept_apart = times.interrupted && !is_stream && std::filesystem::exists(path);
    if (is_kept_apart)
        results.table->flush();
    else
        results.table->finish();
    const std::string written = is_kept_apart ? path + ".partial" : path;

    const SweepTally& tally = results.tally;
    for (std::string& warning : warnings_of(*study, tally.worst_error())) warnings.push_back(std::move(warning));
    for (const std::string& warning : warnings) tell("lobatto: warning: {}.\n", warning);
    const std::int64_t asked = shard.last() - shard.first();
    if (options.json)
        fmt::print("{}", json_of_sweep(*study, tally, times, {asked, written, results.table->rows(), warnings}));
    if (!quiet) {
        print_sweep(*study, tally, times, asked);
        print_row("table", fmt::format("{}, {}", written, counted(results.table->rows(), "row", "rows")));
        print_sweep_notes(*study);
    }
    if (times.interrupted) {
        tell("lobatto: interrupted after {} of {} trajectories; what was computed is in {}{}.\n", tally.trajectories(),
             asked, written, is_kept_apart ? fmt::format(", and the earlier {} stays", path) : "");
        if (tally.failed() > 0) tell("{}\n", failures_text(*study, tally));
        throw ExitCode{interrupted_exit};
    }
    if (tally.failed() > 0)
        throw ComputationError(failures_text(*study, tally) +
                               (is_standard_output(path) ? " What was computed was written."
                                                         : fmt::format(" What was computed is in {}.", path)));
}

}  // namespace

void add_sweep(CommandLine& program) {
    Command command = program.command(
        "sweep", "Run a scene from many starts and with many parameters at once; write what becomes of them");
    const auto options = std::make_shared<SweepOptions>();
    command.option("SCENE", options->scene, "Scene file").required();
    options->starts.add_to(command);
    command
        .option("--keep", options->keep,
                "One row for each trajectory, of what is listed: first(EVENT), count(EVENT), max, min, mean or "
                "last(FORMULA); in formulas also H and momenta p_x. Instead of [output] keep")
        .shown_as("WHAT")
        .one_value_each();
    command
        .option("-o,--output", options->output,
                "Table: .csv, .npy (NumPy) or .h5 (HDF5), or - for standard output (default: out/NAME.sweep.csv)")
        .shown_as("FILE");
    command
        .option("--format", options->format,
                "What the table is: csv, or binary, an array of NumPy (default: as its name ends)")
        .shown_as("FORMAT")
        .one_of(std::vector<std::string>{"csv", "binary"});
    command.flag("--resume", options->resume,
                 "Continue the same sweep where it was interrupted or killed; its table is then the same, byte for "
                 "byte");
    add_method_options(command, options->settings);
    add_step_option(command, options->settings);
    const Option until = add_until_option(command, options->settings);
    command.option("--steps", options->steps, "Number of steps, instead of an end time").shown_as("N").excludes(until);
    command
        .option("--every", options->settings.every,
                "Keep the start, every N-th state and the last one (default: the last one alone)")
        .shown_as("N");
    add_set_option(command, options->settings);
    command
        .option("--device", options->device,
                "What takes the steps: cpu, cuda (an NVIDIA GPU; docs/gpu.md), or auto, the faster of both (default: "
                "cpu)")
        .shown_as("DEVICE")
        .one_of(std::vector<std::string>{"cpu", "cuda", "auto"});
    command.option("--threads", options->threads, "Threads that compute (default: as many as the machine runs)")
        .shown_as("N")
        .between(1, 1024);
    command.flag(
        "--unmeasured", options->unmeasured,
        "Do not measure errors by companions, which take 3/2 of the sweep's time, more at short contacts and pulses");
    command.flag("--beyond-horizon", options->beyond_horizon,
                 "Trajectories of which nothing is left are no failures: for the statistics of chaos");
    command.flag("--quiet", options->quiet, "Print nothing but warnings and errors");
    add_json_option(command, options->json);
    command.footer(
        "Example:\n  lobatto sweep scenes/pendulum.toml --vary q=0:3:1000 --vary omega=1,2,5 --until 10 -o table.npy\n"
        "  lobatto sweep scenes/pendulum.toml --vary step=0.1:0.0125:4:log --random 100 --draw \"q ~ uniform(0, 3)\"");
    command.does([options] { sweep(*options); });
}

}  // namespace lobatto
