// SPDX-License-Identifier: GPL-2.0-or-later
// lobatto tradeoff: what accuracy costs on a scene, measured over the family.
#include <fmt/format.h>

#include "analysis/tradeoff/exploration.hpp"
#include "cli/commands/commands.hpp"
#include "cli/options/budget.hpp"
#include "cli/options/output_path.hpp"
#include "cli/options/settings.hpp"
#include "cli/print/interruption.hpp"
#include "cli/print/say.hpp"
#include "cli/print/summary.hpp"
#include "cli/print/tell.hpp"
#include "cli/tradeoff/page.hpp"
#include "cli/tradeoff/pictures.hpp"
#include "cli/tradeoff/report.hpp"
#include "library/whole.hpp"
#include "runtime/error.hpp"
#include "runtime/files/partial_file.hpp"

namespace lobatto {

namespace {

struct TradeoffOptions {
    std::string scene;
    std::string output;  // a folder; empty: out/NAME.tradeoff
    BudgetOption budget;
    api::Settings settings;
    bool json = false;
};

void write(const std::string& path, const std::string& text) {
    write_whole(path, "the result", text);
}

// "Gauss, 4 stages in double; ..."
std::string names_of(const std::vector<Member>& members) {
    constexpr std::size_t most = 4;
    std::vector<std::string> names;
    for (const Member& member : members)
        if (names.size() < most)
            names.push_back(fmt::format("{} in {}", Candidate{member, 0, 0}.name(), precision_name(member.precision)));
    const std::int64_t others = std::ssize(members) - std::ssize(names);
    return fmt::format("{}{}", fmt::join(names, "; "), others == 0 ? "" : " and " + counted(others, "other", "others"));
}

void tradeoff(const TradeoffOptions& options) {
    const double seconds = options.budget.seconds();
    const api::ChangedScene scenes = api::measurable(api::Scene(options.scene), options.settings, "lobatto tradeoff");
    const Scene& scene = scenes.changed;
    end_of(scene);
    const std::string folder = output_folder(options.output, result_name(scene.path) + ".tradeoff");

    keep_foreign(folder + "/tradeoff.csv", "family,points,precision");
    keep_foreign(folder + "/measurements.jsonl", " to t = ");
    keep_foreign(folder + "/tradeoff.json", "\"command\":\"tradeoff\"");
    for (const char* name : {"report.html", "work_precision.svg", "error.svg", "energy.svg"})
        keep_foreign(folder + "/" + name);
    const Interruption interruption;
    Say say(seconds);
    ExperimentRequest request;
    request.seconds = seconds;
    request.store = folder + "/measurements.jsonl";
    request.first = first_of_tour();
    request.interrupted = interruption.flag();
    request.say = [&](const std::string& what) { say(what); };
    const auto [begun, unmeasured, interrupted] = api::explored(scenes, request);
    say.clear();
    if (interrupted && (!begun || begun->store().all().empty())) {
        tell("lobatto: interrupted before anything was measured; what an earlier run measured is kept.\n");
        throw ExitCode{interrupted_exit};
    }
    Experiment& experiment = *begun;
    if (experiment.store().all().empty())
        throw ComputationError(fmt::format(
            "{}: nothing could be measured within {:.3g} s; give more time with --budget", scene.path, seconds));
    if (!options.json)
        fmt::print(
            "{}: {}{} to t = {:.6g} in {:.1f} s\n{}\n\n{}", scene.path,
            counted(std::ssize(experiment.store().all()), "measurement", "measurements"),
            experiment.store().found() > 0 ? fmt::format(" ({} of an earlier run)", experiment.store().found()) : "",
            experiment.until(), experiment.elapsed(), reference_text(experiment), front_table(experiment));
    if (!options.json && !unmeasured.empty())
        fmt::print("\nNot measured within {:.3g} s: {}. With more time (--budget) they may be better.\n", seconds,
                   names_of(unmeasured));
    write(folder + "/tradeoff.csv", csv_of(experiment));
    const std::string json = json_of(experiment);
    write(folder + "/tradeoff.json", json);
    if (options.json) fmt::print("{}", json);
    if (!interrupted) {
        const std::vector<std::string> pictures = draw_pictures(experiment, folder);
        write(folder + "/report.html", report_page(experiment, folder, pictures, json));
        if (!options.json)
            fmt::print("{}/report.html shows it all; beside it tradeoff.csv, tradeoff.json{}{}\n", folder,
                       pictures.empty() ? "" : " and " + fmt::format("{}", fmt::join(pictures, ".svg, ")),
                       pictures.empty() ? "" : ".svg");
    } else {
        tell("lobatto: interrupted; the measurements are kept, and the same command goes on from them.\n");
        throw ExitCode{interrupted_exit};
    }
}

}  // namespace

void add_tradeoff(CommandLine& program) {
    Command command =
        program.command("tradeoff", "Measure what accuracy costs: the family, steps and number types on a scene");
    const auto options = std::make_shared<TradeoffOptions>();
    command.option("SCENE", options->scene, "Scene file").required();
    command.option("-o,--output", options->output, "Folder of the results (default: out/NAME.tradeoff)")
        .shown_as("FOLDER");
    options->budget.add_to(command);
    add_until_option(command, options->settings);
    add_set_option(command, options->settings);
    add_json_option(command, options->json);
    command.footer("Example:\n  lobatto tradeoff scenes/pendulum.toml --budget 10s");
    command.does([options] { tradeoff(*options); });
}

}  // namespace lobatto
