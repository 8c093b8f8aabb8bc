// SPDX-License-Identifier: GPL-2.0-or-later
// lobatto paper: the validation against Dubois and Rojas-Quintero (2025).
#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "cli/commands/commands.hpp"
#include "cli/options/output_path.hpp"
#include "cli/paper/document.hpp"
#include "cli/print/say.hpp"
#include "runtime/error.hpp"
#include "runtime/files/partial_file.hpp"

namespace lobatto {

namespace {

struct PaperOptions {
    std::string folder = "out";
    bool figures = true, json = false;
};

void validate(const PaperOptions& options) {
    output_folder(options.folder + (options.figures ? "/paper" : ""), "");
    const std::string path = options.folder + "/paper.md";
    keep_foreign(path);
    Say now;
    now("checking every formula");
    std::vector<paper::Finding> findings;
    for (const paper::Statement& statement : paper::statements()) findings.push_back(paper::judge(statement));
    const auto say = [&](const std::string& text) {
        if (!options.json) fmt::print("{}", text);
    };
    now.clear();
    say(walk_lines(findings));
    now("running the experiments of the tables", options.figures ? 0.02 : 0.1);

    const std::vector<PaperTable> tables{table_1(), table_2()};
    std::string document = walk_document(findings);
    document +=
        "\n## The experiments\n\n"
        "m = 1, ω = 2π, q(0) = π/2, p(0) = 0, N steps a period (the pendulum's own, 4K(sin(π/4))/ω = 1.1803), double "
        "arithmetic. Lobatto and Simpson are kernels emitted by this program for 4 and 3 points; the implicit midpoint "
        "rule is derived in the same way from linear elements and one Gauss point. The discrete energy is about h·H, "
        "4.9 "
        "for N = 10, so that 1e−14 is some ten units of rounding; for the midpoint rule the row shows H itself, which "
        "it "
        "preserves.\n";
    now.clear();
    for (const PaperTable& table : tables) {
        say(table_lines(table));
        document += table_document(table);
    }

    if (options.figures) {
        constexpr double before = 0.2;  // the part of all work that formulas and tables are
        const std::vector<Figure> figures = draw_figures(
            options.folder + "/paper",
            [&](const std::string& what, double done) { now("drawing " + what, before + (1 - before) * done); });
        now.clear();
        say(growth_lines(figures));
        document += figure_document(figures);
    }
    write_whole(path, "the document", document);
    say(fmt::format(
        "\nWritten: {}{}\n", path,
        options.figures ? fmt::format(", {}/paper/figure1.svg … figure4.svg and their data", options.folder) : ""));
    if (options.json) fmt::print("{}", paper_json(path, findings, tables));

    for (const paper::Finding& finding : findings)
        if (!paper::is_resolved(finding))
            throw ComputationError(
                fmt::format("{}: the printed formula and the derived one differ, and no correction is known: {}",
                            finding.label, finding.demonstration));
    for (const PaperTable& table : tables)
        if (!table.reproduced())
            throw ComputationError(
                fmt::format("{}: a figure differs by more than 1 % from the printed one", table.title));
}

}  // namespace

void add_paper(CommandLine& program) {
    Command command = program.command("paper", "Check every formula, table and figure of the paper behind the method");
    const auto options = std::make_shared<PaperOptions>();
    command.option("-o,--output", options->folder, "Folder for paper.md and paper/figure1.svg … (default: out)")
        .shown_as("FOLDER");
    command.flag("--figures,!--no-figures", options->figures,
                 "Draw the figures with gnuplot (default), or leave them out");
    add_json_option(command, options->json);
    command.footer("Example:\n  lobatto paper -o docs");
    command.does([options] { validate(*options); });
}

}  // namespace lobatto
