// SPDX-License-Identifier: GPL-2.0-or-later
// lobatto roundoff: what rounding does to a scene in long runs, in plain and in clean arithmetic.
#include <fmt/format.h>

#include <cmath>
#include <optional>

#include "analysis/motion.hpp"
#include "cli/commands/commands.hpp"
#include "cli/options/output_path.hpp"
#include "cli/options/settings.hpp"
#include "cli/print/answers_json.hpp"
#include "cli/print/drawing.hpp"
#include "cli/print/interruption.hpp"
#include "cli/print/progress.hpp"
#include "cli/print/tell.hpp"
#include "library/whole.hpp"
#include "runtime/error.hpp"
#include "runtime/files/partial_file.hpp"

namespace lobatto {

namespace {

struct RoundoffCommand {
    std::string scene, output;
    api::Settings settings;
    std::int64_t steps = 100000;
    int trajectories = 16;
    bool no_reference = false, no_picture = false, json = false;
};

const std::string table_head =
    "steps,plain mean of H,plain rms of H,plain rms of q,clean mean of H,clean rms of H,clean rms of q\n";

// Nothing where there is no number.
std::string in_csv(double value) {
    return std::isfinite(value) ? fmt::format("{:.6e}", value) : "";
}

std::string csv_of(const RoundoffResult& result) {
    std::string text = table_head;
    for (std::size_t i = 0; i < result.plain.rows.size(); ++i) {
        const RoundoffRow &plain = result.plain.rows[i], &clean = result.clean.rows[i];
        text +=
            fmt::format("{},{:.6e},{:.6e},{},{:.6e},{:.6e},{}\n", plain.steps, plain.energy_mean, plain.energy_rms,
                        in_csv(plain.position_rms), clean.energy_mean, clean.energy_rms, in_csv(clean.position_rms));
    }
    return text;
}

// Rms errors with Brouwer's laws through the last clean ones. Empty where rounding changes nothing.
std::string script_of(const RoundoffResult& result) {
    const RoundoffRow &last = result.clean.rows.back(), &plain = result.plain.rows.back();
    const bool has_positions = last.position_rms > 0 && plain.position_rms > 0;
    if (!(last.energy_rms > 0 && plain.energy_rms > 0)) return "";
    const auto steps = static_cast<double>(last.steps);
    const auto panel = [&](const char* label, int plain_column, int clean_column, double value, double power,
                           const char* law) {
        return fmt::format(
            "set ylabel \"{}\"\nplot \"roundoff.csv\" skip 1 using 1:{} with linespoints ls 3 title \"plain\", \"\" "
            "skip 1 using 1:{} with linespoints ls 2 title \"clean\", {:.6e}*x**{} with lines ls 1 title \"{}\"\n",
            label, plain_column, clean_column, value / std::pow(steps, power), power, law);
    };
    const std::string energy = panel("energy, rms", 3, 6, last.energy_rms, 0.5, "√N");
    const std::string scales =
        "set logscale xy\nset format y \"10^{%T}\"\nset key inside top left vertical maxrows 3\n";
    const std::string steps_below = "set format x \"10^{%T}\"\nset xlabel \"steps N\"\n";
    if (!has_positions) return scales + steps_below + energy;
    return scales + "set multiplot layout 2,1 margins 0.12,0.97,0.11,0.94 spacing 0,0.08\nset format x \"\"\n" +
           energy + steps_below + panel("position, rms", 4, 7, last.position_rms, 1.5, "N^{3/2}") + "unset multiplot\n";
}

void print(const RoundoffResult& result) {
    const auto known = [](double value) { return std::isfinite(value) ? fmt::format("{:.1e}", value) : "-"; };
    fmt::print("{:>10}  {:^32}  {:^32}\n{:>10}  {:>10} {:>10} {:>10}  {:>10} {:>10} {:>10}\n", "", "plain", "clean",
               "steps", "H, mean", "H, rms", "q, rms", "H, mean", "H, rms", "q, rms");
    for (std::size_t i = 0; i < result.plain.rows.size(); ++i) {
        const RoundoffRow &plain = result.plain.rows[i], &clean = result.clean.rows[i];
        fmt::print("{:>10}  {:>10.1e} {:>10.1e} {:>10}  {:>10.1e} {:>10.1e} {:>10}\n", plain.steps, plain.energy_mean,
                   plain.energy_rms, known(plain.position_rms), clean.energy_mean, clean.energy_rms,
                   known(clean.position_rms));
    }
    const auto exponent = [](double value) {
        return std::isfinite(value) ? fmt::format("N^{:.2f}", value) : std::string("-");
    };
    fmt::print("\n{:>10}  {:>10} {:>10} {:>10}  {:>10} {:>10} {:>10}\n", "growth", "",
               exponent(result.plain.energy_exponent), exponent(result.plain.position_exponent), "",
               exponent(result.clean.energy_exponent), exponent(result.clean.position_exponent));
    fmt::print("{:>10}  {:>32}  {:>32}\n", "a step",
               fmt::format("{:.0f} ns, {:.2f} iterations", result.plain.nanoseconds, result.plain.iterations),
               fmt::format("{:.0f} ns, {:.2f} iterations", result.clean.nanoseconds, result.clean.iterations));
}

void roundoff(const RoundoffCommand& options) {
    Scene scene = api::for_roundoff(api::Scene(options.scene), options.settings);
    const std::string name = scene.method.name(), path = scene.path;
    const double step = step_of(scene).to_double();
    const std::string folder = output_folder(options.output, result_name(scene.path) + "_roundoff"),
                      table = folder + "/roundoff.csv";
    keep_scene(path, table);
    keep_foreign(table, "steps,plain mean of h");
    if (!options.no_picture) keep_foreign(folder + "/roundoff.svg");
    const Interruption interruption;
    std::optional<Progress> progress(std::in_place, options.steps * options.trajectories);
    const RoundoffResult result =
        api::roundoff_of(std::move(scene), {options.steps, options.trajectories, !options.no_reference,
                                            Interruption::flag(), [&](std::int64_t done) { progress->show(done); }});
    progress.reset();
    const auto say = [&](const std::string& text) {
        if (!options.json) fmt::print("{}", text);
    };
    say(fmt::format(
        "{}: {}, h = {:.6g}, {} trajectories.\n{}\n\n", path, name, step, options.trajectories,
        options.no_reference
            ? "The energy against H(0), relative to |H(0)|, or to half of the largest kinetic energy if that is "
              "larger: the method's own error is in it."
            : "What rounding changes, against the same steps in long double: H relative to |H(0)|, or to half of "
              "the largest kinetic energy if that is larger, q to its largest."));
    if (!result.plain.rows.empty()) {
        if (!options.json) print(result);
        write_whole(table, "the table", csv_of(result));
        const std::string script = options.no_picture ? "" : script_of(result);
        if (!script.empty()) draw(folder, "roundoff", script, 900, 640, "leave the picture out with --no-picture");
        say(fmt::format("\n{}{} has all of it.\n", table, script.empty() ? "" : " and roundoff.svg beside it"));
    }
    if (options.json) fmt::print("{}", json_of_roundoff(result, path, name, step, table));
    if (result.interrupted) {
        tell("lobatto: interrupted {}\n", result.plain.rows.empty()
                                              ? "before anything could be told"
                                              : fmt::format("after {} steps of {} trajectories; the table has these",
                                                            result.steps, result.trajectories));
        throw ExitCode{interrupted_exit};
    }
    if (result.lost)
        throw ComputationError(fmt::format(
            "{}: energies are off by as much as the motion has, so this is no measure of rounding: the step is "
            "beyond the stability of the method, or has gone past a singularity. Try a smaller --step",
            path));
}

}  // namespace

void add_roundoff(CommandLine& program) {
    const auto options = std::make_shared<RoundoffCommand>();
    Command command = program.command(
        "roundoff", "Measure how errors of rounding grow in long runs, in plain and in clean arithmetic");
    command.option("SCENE", options->scene, "Scene file").required();
    command.option("--steps", options->steps, "How many (default: 100000)").shown_as("N").between(10, 1000000000);
    command.option("--trajectories", options->trajectories, "Whose mean is taken (default: 16)")
        .shown_as("N")
        .between(2, 1000);
    add_member_options(command, options->settings);
    add_step_option(command, options->settings);
    add_set_option(command, options->settings);
    command.option("-o,--output", options->output, "Folder of the table and the picture (default: out/NAME_roundoff)")
        .shown_as("FOLDER");
    command.flag("--no-reference", options->no_reference,
                 "Without the steps in long double, which take most of the time: energies alone, against H(0)");
    command.flag("--no-picture", options->no_picture, "The table alone, without gnuplot");
    add_json_option(command, options->json);
    command.footer("Example:\n  lobatto roundoff scenes/kepler.toml --steps 200000 --points 6 --step 0.05");
    command.does([options] { roundoff(*options); });
}

}  // namespace lobatto
