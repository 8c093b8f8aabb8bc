// SPDX-License-Identifier: GPL-2.0-or-later
// lobatto check: what the generator found in a scene, what it did with it, and what that saved.
#include <fmt/format.h>
#include <fmt/ostream.h>

#include <iostream>

#include "analysis/checked_scene.hpp"
#include "cli/commands/commands.hpp"
#include "cli/options/method.hpp"
#include "cli/options/output_path.hpp"
#include "generator/describe/explain.hpp"

namespace lobatto {

namespace {

struct CheckCommand {
    std::string scene;
    MethodOption method;
    bool general = false;
    bool json = false;
};

// A label and a text, the text broken at blanks.
void print_row(const std::string& label, const std::string& text) {
    constexpr std::size_t left = 28, width = 82;
    std::string line;
    std::string head = label;
    const auto flush = [&] {
        fmt::print(std::cout, "  {:<{}}{}\n", head, left, line);
        head.clear();
        line.clear();
    };
    for (std::size_t begin = 0; begin < text.size();) {
        const std::size_t end = std::min(text.find(' ', begin), text.size());
        if (!line.empty() && line.size() + 1 + end - begin > width) flush();
        line += (line.empty() ? "" : " ") + text.substr(begin, end - begin);
        begin = end + 1;
    }
    flush();
}

void print_findings(const std::string& heading, const std::vector<Finding>& findings, bool holds) {
    if (std::none_of(findings.begin(), findings.end(), [&](const Finding& f) { return f.holds == holds; })) return;
    fmt::print(std::cout, "\n{}\n", heading);
    for (const Finding& finding : findings)
        if (finding.holds == holds) print_row(finding.name, finding.reason);
}

void print(const Checked& checked) {
    const Derivation& derivation = checked.derivation;
    const Scene& scene = derivation.scene;
    fmt::print(std::cout, "{} ({})\n\n", scene.title, scene.path);
    print_row("Lagrangian", scene.lagrangian_text.size() <= 400
                                ? scene.lagrangian_text
                                : fmt::format("a formula of {} characters", scene.lagrangian_text.size()));
    print_row("its kind", kind_of(derivation));
    print_findings("Found, and put to use", derivation.findings, true);
    print_findings("Looked for, not found", derivation.findings, false);

    fmt::print(std::cout, "\nA step of {} (order {})\n", scene.method.name(), scene.method.order());
    print_row("its form", form_of(derivation));
    const auto compared = [](long here, long without) {
        return here == without ? std::string() : fmt::format("; {} without what was found", without);
    };
    const int unknowns = unknowns_of(derivation);
    print_row("unknowns",
              (unknowns == 0 ? "none" : std::to_string(unknowns)) + compared(unknowns, unknowns_of(checked.without)));
    if (const std::string solver = solver_text(derivation); !solver.empty()) print_row("solved", solver);
    const long elimination = elimination_of(derivation);
    if (!derivation.structure.is_explicit())
        print_row("elimination", fmt::format("some {} multiplications{}", elimination,
                                             compared(elimination, elimination_of(checked.without))));

    fmt::print(std::cout, "\nThe kernel\n");
    for (const CheckedOutput& output : checked.outputs)
        print_row(output.name, !output.asked ? "not asked for, left out"
                               : output.operations == 0
                                   ? output.text
                                   : fmt::format("{}: {} operations", output.text, output.operations));
    // One function serves all points of a step.
    print_row("operations", fmt::format("{} in all its formulas, each counted once{}", checked.operations,
                                        compared(checked.operations, checked.operations_without)));
    print_row("derived and written in", fmt::format("{:.2f} s", checked.seconds));
}

}  // namespace

void add_check(CommandLine& program) {
    const auto options = std::make_shared<CheckCommand>();
    Command command =
        program.command("check", "Say in plain words what was found in a scene, and what its kernel leaves out");
    command.option("scene", options->scene, "the scene file").required();
    options->method.add_to(command);
    command.flag("--general", options->general, "use nothing of what the scene's structure allows, for comparison");
    add_json_option(command, options->json);
    command.footer("Example:\n  lobatto check scenes/two_pendulums.toml");
    command.does([options] {
        Scene scene = read_scene(options->scene);
        options->method.apply(scene);
        const Checked checked = check_scene(std::move(scene), options->general);
        if (options->json)
            std::cout << json_of(checked) << '\n';
        else
            print(checked);
    });
}

}  // namespace lobatto
