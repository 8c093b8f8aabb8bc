// SPDX-License-Identifier: GPL-2.0-or-later
// lobatto stability: which steps keep a motion bounded, exactly, and what a scene's step does.
#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <iostream>
#include <optional>

#include "analysis/stability/chart.hpp"
#include "analysis/stability/json.hpp"
#include "cli/commands/commands.hpp"
#include "cli/options/output_path.hpp"
#include "cli/options/settings.hpp"
#include "cli/print/drawing.hpp"
#include "cli/print/stability_text.hpp"
#include "generator/formula/text/source.hpp"
#include "generator/method/splitting_stability.hpp"
#include "library/whole.hpp"

namespace lobatto {

namespace {

std::vector<Method> all_methods() {
    std::vector<Method> methods;
    for (int points = 2; points <= 12; ++points) methods.push_back({Family::lobatto, points});
    for (int stages = 1; stages <= 10; ++stages) methods.push_back({Family::gauss, stages});
    return methods;
}

struct StabilityCommand {
    std::optional<std::string> scene;
    std::string chart;
    api::Settings settings;
    bool json = false;
};

namespace fs = std::filesystem;

// Before anything is computed.
fs::path chart_path(const std::string& given, const std::string& scene) {
    const fs::path path = given;
    if (path.extension() != ".svg" || path.stem().empty())
        throw InputError(fmt::format("--chart {}: the chart is an SVG file; give it a name that ends in .svg", given));
    if (const fs::path folder = path.parent_path(); !folder.empty() && !fs::is_directory(folder))
        throw InputError(fmt::format("--chart {}: there is no folder {}; make it first", given, folder.string()));
    keep_scene(scene, given);
    keep_foreign(given);
    return path;
}

// In words: exact polynomials of coefficients with 15 digits would fill pages.
std::string text_of_splitting(const Method& method) {
    std::string text = fmt::format("{} (order {})\n\nBounded where |trace| < 2 (D36); by h*omega, from 0:\n",
                                   method.name(), method.order());
    for (const UnstableSteps& steps : unstable_steps(quadrature_of(method))) {
        text += fmt::format("  stable   to {:.10f}\n", steps.from);
        if (std::isfinite(steps.to))
            text += fmt::format("  unstable to {:.10f}; growth per step: up to about 1 + {:.2g}\n", steps.to,
                                std::expm1(steps.rate));
        else
            text += "  unstable beyond\n";
    }
    return text;
}

void show_members(const StabilityCommand& options) {
    if (!options.chart.empty() || !options.settings.step.empty() || !options.settings.set.empty())
        throw InputError("--chart, --step and --set belong to a scene; name one");
    const MethodChoice choice = api::method_of(options.settings);
    if (choice.tolerance || !choice.arithmetic.empty() || !choice.numbers.empty() || !choice.clock.empty())
        throw InputError("--tolerance, --arithmetic, --numbers and --clock belong to a scene; name one");
    const std::optional<Method> member = choice.member();
    if (member && member->family == Family::splitting) {
        if (options.json) throw InputError("--json is of Lobatto and Gauss, whose limits are exact; leave it out");
        std::cout << text_of_splitting(*member);
        return;
    }
    const std::vector<Method> methods = member ? std::vector{*member} : all_methods();
    std::vector<Stability> members;
    for (const Method& method : methods) members.push_back(stability(quadrature_of(method)));
    std::cout << (options.json ? json_of(members) : members.size() == 1 ? text_of(members.front()) : text_of(members));
}

void show_scene(const StabilityCommand& options) {
    const fs::path chart = options.chart.empty() ? fs::path() : chart_path(options.chart, *options.scene);
    const StabilityReport report = api::stability_of(api::Scene(*options.scene), options.settings);
    if (!chart.empty())
        draw(chart.has_parent_path() ? chart.parent_path().string() : ".", chart.stem().string(),
             stability_chart(report), 900, 640, "leave --chart out");
    std::cout << (options.json ? json_of(report) : text_of(report));
}

}  // namespace

void add_stability(CommandLine& program) {
    const auto options = std::make_shared<StabilityCommand>();
    Command command = program.command(
        "stability", "Say exactly which steps keep linear motion bounded, and what a scene's step does");
    command.option(
        "SCENE", options->scene,
        "Scene file; it is looked at in double, without a clock (default: none, every member of both families)");
    add_method_options(command, options->settings);
    add_step_option(command, options->settings);
    add_set_option(command, options->settings);
    command.option("--chart", options->chart, "Draw trace and growth, theory and measurement, into this SVG file")
        .shown_as("FILE");
    add_json_option(command, options->json);
    command.footer("Example:\n  lobatto stability scenes/harmonic_oscillator.toml --chart stability.svg");
    command.does([options] { options->scene ? show_scene(*options) : show_members(*options); });
}

}  // namespace lobatto
