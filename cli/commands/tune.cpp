// SPDX-License-Identifier: GPL-2.0-or-later
// lobatto tune: the cheapest method and step that keep a promised accuracy.
#include <fmt/format.h>

#include <cmath>
#include <filesystem>

#include "analysis/tradeoff/method_text.hpp"
#include "cli/commands/commands.hpp"
#include "cli/options/budget.hpp"
#include "cli/options/output_path.hpp"
#include "cli/options/settings.hpp"
#include "cli/print/answers_json.hpp"
#include "cli/print/interruption.hpp"
#include "cli/print/say.hpp"
#include "cli/print/summary.hpp"
#include "cli/print/tell.hpp"
#include "library/whole.hpp"

namespace lobatto {

namespace {

struct TuneOptions {
    std::string scene;
    std::string error;
    BudgetOption budget;
    api::Settings settings;
    bool write = false, json = false;
};

double error_of(const TuneOptions& options) {
    char* rest = nullptr;
    const double error = std::strtod(options.error.c_str(), &rest);
    if (rest == options.error.c_str() || *rest != '\0')
        throw InputError(fmt::format("--error: '{}' is not a number; write 1e-8", options.error));
    return error;
}

void print(const Choice& choice, const Scene& scene, double error) {
    const Measurement& m = choice.measurement;
    fmt::print("{}: error at most {:.2g} to t = {:.6g}, relative to the amplitude of the motion\n\n{}\n", scene.path,
               error, choice.until, method_text(choice));
    print_row("predicted error",
              fmt::format("{:.2g}: measured against {}, which is known to {}", m.error, choice.reference,
                          choice.uncertainty > 0 ? fmt::format("{:.1g}", choice.uncertainty) : "all its digits"));
    print_row("cost", fmt::format("{} to the end, {:.3g} ns and {:.3g} gradients per unit of time", duration(m.seconds),
                                  m.seconds / choice.until * 1e9, m.gradients / choice.until));
    print_row("stability", stability_text(choice));
    if (std::isfinite(m.energy_error))
        print_row("energy error", fmt::format("{:.2g} of the energy of motion", m.energy_error));
    print_row(
        "searched",
        fmt::format("{} in {:.1f} s{}", counted(choice.members, "member of the family", "members of the family"),
                    choice.seconds, choice.complete ? "" : "; with more time (--budget) there may be a faster one"));
}

void tune(const TuneOptions& options) {
    const double error = error_of(options);
    const api::Scene scene(options.scene);
    if (std::error_code none; options.write && !std::filesystem::is_regular_file(options.scene, none))
        throw InputError(fmt::format("--write: {} is no file that can be written; leave --write out", options.scene));
    if (options.write && !options.settings.set.empty())
        throw InputError("--write: the file has other values than --set; change them there, then leave --set out");
    const Interruption interruption;
    Say say(options.budget.seconds());
    ChoiceRequest request;
    request.error = error;
    request.seconds = options.budget.seconds();
    request.interrupted = interruption.flag();
    request.say = [&](const std::string& what) { say(what); };
    try {
        const auto [changed, choice] = api::choice_for(scene, options.settings, request);
        say.clear();
        if (!options.json) print(choice, changed, error);
        if (options.write) write_method(choice, changed, error, !options.settings.until.empty());
        if (options.json)
            fmt::print("{}", json_of_choice(choice, changed, error, options.write));
        else if (options.write)
            fmt::print("\nwritten into {}\n", scene.path());
    } catch (const Interrupted&) {
        say.clear();
        tell("lobatto: interrupted; nothing was chosen.\n");
        throw ExitCode{interrupted_exit};
    }
}

}  // namespace

void add_tune(CommandLine& program) {
    Command command = program.command("tune", "Choose the cheapest method and step that keep a promised accuracy");
    const auto options = std::make_shared<TuneOptions>();
    command.option("SCENE", options->scene, "Scene file").required();
    command.option("--error", options->error, "The largest error to the end, relative to the amplitude of the motion")
        .shown_as("ERROR")
        .required();
    add_until_option(command, options->settings);
    options->budget.add_to(command);
    add_set_option(command, options->settings);
    command.flag("--write", options->write, "Write the method and the step into the scene file");
    add_json_option(command, options->json);
    command.footer("Example:\n  lobatto tune scenes/pendulum.toml --error 1e-8 --until 1000");
    command.does([options] { tune(*options); });
}

}  // namespace lobatto
