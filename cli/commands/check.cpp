// SPDX-License-Identifier: GPL-2.0-or-later
// lobatto check: what the generator found in a scene, what it did with it, and what that saved.
#include <fmt/format.h>
#include <fmt/ostream.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <iostream>
#include <thread>

#include "cli/commands/commands.hpp"
#include "cli/options/method.hpp"
#include "cli/options/output_path.hpp"
#include "cli/options/overrides.hpp"
#include "cli/print/interruption.hpp"
#include "cli/print/say.hpp"
#include "cli/print/tell.hpp"
#include "generator/describe/explain.hpp"
#include "library/whole.hpp"
#include "runtime/error.hpp"

namespace lobatto {

namespace {

struct CheckCommand {
    std::string scene;
    MethodOption method;
    bool general = false;
    bool json = false;
    bool watch = false;
};

// A label and a text, the text broken at blanks.
void print_finding(const std::string& label, const std::string& text) {
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
        if (finding.holds == holds) print_finding(finding.name, finding.reason);
}

void print(const Checked& checked) {
    const Derivation& derivation = checked.derivation;
    const Scene& scene = derivation.scene;
    fmt::print(std::cout, "{} ({})\n\n", scene.title, scene.path);
    print_finding("Lagrangian", scene.lagrangian_text.size() <= 400
                                    ? scene.lagrangian_text
                                    : fmt::format("a formula of {} characters", scene.lagrangian_text.size()));
    print_finding("kind", kind_of(derivation));
    print_findings("Found and used", derivation.findings, true);
    print_findings("Looked for, not found", derivation.findings, false);

    fmt::print(std::cout, "\nOne step: {} (order {})\n", scene.method.name(), scene.method.order());
    print_finding("equations", form_of(derivation));
    const auto compared = [](long here, long without) {
        return here == without ? std::string() : fmt::format(" ({} without these findings)", without);
    };
    const int unknowns = unknowns_of(derivation);
    print_finding("unknowns", (unknowns == 0 ? "none" : std::to_string(unknowns)) +
                                  compared(unknowns, unknowns_of(checked.without)));
    if (const std::string solver = solver_text(derivation); !solver.empty()) print_finding("solved", solver);
    const long elimination = elimination_of(derivation);
    if (!derivation.structure.is_explicit())
        print_finding("elimination",
                      (elimination == 0 ? "no multiplications" : fmt::format("about {} multiplications", elimination)) +
                          compared(elimination, elimination_of(checked.without)));

    fmt::print(std::cout, "\nThe kernel\n");
    for (const CheckedOutput& output : checked.outputs)
        print_finding(output.name, !output.asked ? "not requested, left out"
                                   : output.operations == 0
                                       ? output.text
                                       : fmt::format("{}: {} operations", output.text, output.operations));
    // One function serves all points of a step.
    print_finding("operations", fmt::format("{} in all formulas, each counted once{}", checked.operations,
                                            compared(checked.operations, checked.operations_without)));
    print_finding("derived and emitted in", fmt::format("{:.2f} s", checked.seconds));
}

void check(const CheckCommand& options) {
    const api::Scene scene(options.scene);
    Say say;
    say("deriving");
    const Checked checked = api::checked(scene, settings_of(options.method), options.general);
    say.clear();
    if (options.json)
        std::cout << json_of(checked) << '\n';
    else
        print(checked);
}

// The time of its last change, and its size; another one after every save.
std::pair<std::filesystem::file_time_type, std::uintmax_t> state_of(const std::string& path) {
    std::error_code ignored;
    return {std::filesystem::last_write_time(path, ignored), std::filesystem::file_size(path, ignored)};
}

// Again after every save, until it is interrupted. An error is told, and the next save is waited for.
void keep_checking(const CheckCommand& options) {
    constexpr auto pause = std::chrono::milliseconds(100);
    const bool on_terminal = isatty(STDOUT_FILENO) == 1;
    const Interruption interruption;
    while (*interruption.flag() == 0) {
        const auto seen = state_of(options.scene);
        if (on_terminal) fmt::print(std::cout, "\033[2J\033[H");
        try {
            api::guarded([&] { check(options); });
        } catch (const api::InputError& error) {
            tell("{}\n", error.what());
        } catch (const api::ComputationError& error) {
            tell("lobatto: {}\n", error.what());
        }
        if (!std::cout.flush())
            throw MachineError("cannot write to standard output. Is its reader gone, or the disk full?");
        tell("\n(waiting for {} to be saved; Ctrl-C ends)\n\n", options.scene);
        while (*interruption.flag() == 0 && state_of(options.scene) == seen) std::this_thread::sleep_for(pause);
    }
    throw ExitCode{interrupted_exit};
}

}  // namespace

void add_check(CommandLine& program) {
    const auto options = std::make_shared<CheckCommand>();
    Command command =
        program.command("check", "Say in plain words what was found in a scene, and what its kernel leaves out");
    command.option("SCENE", options->scene, "Scene file").required();
    options->method.add_to(command);
    command.flag("--general", options->general,
                 "Turn off all shortcuts that the scene's structure allows, for comparison");
    add_json_option(command, options->json);
    command.flag("--watch", options->watch, "Print again whenever the scene is saved");
    command.footer("Example:\n  lobatto check scenes/two_pendulums.toml");
    command.does([options] { options->watch ? keep_checking(*options) : check(*options); });
}

}  // namespace lobatto
