// SPDX-License-Identifier: GPL-2.0-or-later
// lobatto stability: which steps keep a motion bounded, exactly, and what a scene's step does.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <iostream>

#include "cli/commands.hpp"
#include "cli/drawing.hpp"
#include "cli/method_option.hpp"
#include "cli/output_path.hpp"
#include "cli/stability_chart.hpp"
#include "cli/stability_text.hpp"

namespace lobatto {

namespace {

struct StabilityCommand {
    std::string scene, chart;
    MethodOption method;
    Overrides overrides;
    bool json = false;
};

void draw_chart(const StabilityReport& report, const std::string& given) {
    const auto script = stability_chart(report);
    if (!script) {
        if (!given.empty())
            throw InputError(
                fmt::format("{}: there is no chart to draw: no oscillation was found", report.derivation.scene.path));
        return;
    }
    namespace fs = std::filesystem;
    const fs::path path = output_path(given, report.derivation.scene.name + ".stability.svg");
    if (path.extension() != ".svg")
        throw InputError(fmt::format("{}: the chart is an SVG file; give it a name that ends in .svg", given));
    const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
    draw(folder.string(), path.stem().string(), *script, 900, 640, "Install it (apt install gnuplot-nox).");
}

void show(const StabilityCommand& options) {
    Scene scene = read_scene(options.scene);
    options.method.apply(scene);
    const StabilityReport report = stability_report(std::move(scene), options.overrides);
    if (!options.chart.empty()) draw_chart(report, options.chart);
    std::cout << (options.json ? json_of(report.member, &report) : text_of(report));
}

}  // namespace

void add_stability(CLI::App& program) {
    const auto options = std::make_shared<StabilityCommand>();
    CLI::App* command = program.add_subcommand(
        "stability", "Say exactly which steps keep linear motion bounded, and what a scene's step does");
    command->add_option("scene", options->scene, "the scene file")->required();
    options->method.add_to(*command);
    command->add_option("--step", options->overrides.step,
                        "Step h; may use the scene's parameters, as in 2*pi/omega/50");
    command
        ->add_option("--set", options->overrides.set,
                     "Value of a parameter, NAME=VALUE, as in m=2 or omega=2*pi; may be repeated")
        ->allow_extra_args(false);
    command->add_option("--chart", options->chart, "draw trace and growth, theory and measurement, into this SVG file");
    command->add_flag("--json", options->json, "for machines (described in docs/stability.md)");
    command->footer("Example:\n  lobatto stability scenes/harmonic_oscillator.toml --chart stability.svg");
    command->callback([options] { show(*options); });
}

}  // namespace lobatto
