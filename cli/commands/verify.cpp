// SPDX-License-Identifier: GPL-2.0-or-later
// lobatto verify: everything that can be checked of a scene without a paper, as a table.
#include <fmt/format.h>

#include <algorithm>

#include "cli/commands/commands.hpp"
#include "cli/options/output_path.hpp"
#include "cli/options/settings.hpp"
#include "cli/print/answers_json.hpp"
#include "cli/print/say.hpp"
#include "library/whole.hpp"
#include "runtime/error.hpp"

namespace lobatto {

namespace {

struct VerifyOptions {
    std::string scene;
    api::Settings settings;
    bool json = false;
};

void print(const std::vector<ProofRow>& rows, const MeasuredOrder& convergence) {
    std::size_t widest = 0;
    for (const ProofRow& row : rows) widest = std::max(widest, row.claim.size());
    fmt::print("  {:<{}}  {:>16}  {:>10}\n", "claim", widest, "measured", "bound");
    for (const ProofRow& row : rows)
        fmt::print("  {:<{}}  {:>16}  {:>10}  {}\n", row.claim, widest, row.measured, row.bound,
                   row.measured == "not decided" ? ""
                   : row.holds                   ? "ok"
                                                 : "FAILED");
    if (convergence.rows.empty()) return;
    fmt::print("\nThe error over {:.4g} time units, in quadruple precision:\n  {:>12}  {:>12}  {:>6}\n",
               convergence.duration, "step", "error", "order");
    for (const OrderRow& row : convergence.rows)
        fmt::print("  {:>12.6g}  {:>12.3e}  {:>6}\n", row.step, row.error,
                   &row == &convergence.rows.front() ? "" : fmt::format("{:.2f}", row.order));
}

void verify(const VerifyOptions& options) {
    Say say;
    const Proof proof = api::proof_of(api::Scene(options.scene), options.settings,
                                      [&](const std::string& what, double done) { say(what, done); });
    say.clear();
    if (options.json) {
        fmt::print("{}", json_of_proof(options.scene, proof));
    } else {
        fmt::print("{}: {} ({})\n", options.scene, proof.title, proof.method);
        print(proof.rows, proof.convergence);
    }
    for (const ProofRow& row : proof.rows)
        if (!row.holds)
            throw ComputationError(fmt::format("{}: the check '{}' fails: {}.", options.scene, row.claim, row.meaning));
}

}  // namespace

void add_verify(CommandLine& program) {
    Command command =
        program.command("verify", "Check a scene's equations, its emitted code and the promises of its integrator");
    const auto options = std::make_shared<VerifyOptions>();
    command.option("SCENE", options->scene, "Scene file").required();
    add_method_options(command, options->settings);
    add_set_option(command, options->settings);
    add_step_option(command, options->settings);
    add_json_option(command, options->json);
    command.footer("Example:\n  lobatto verify scenes/pendulum.toml --points 3");
    command.does([options] { verify(*options); });
}

}  // namespace lobatto
