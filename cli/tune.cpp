// SPDX-License-Identifier: GPL-2.0-or-later
// lobatto tune: the cheapest method and step that keep a promised accuracy.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>

#include "cli/commands.hpp"
#include "cli/interruption.hpp"
#include "cli/overrides.hpp"
#include "cli/summary.hpp"
#include "cli/tradeoff/search.hpp"
#include "cli/tradeoff/stability_limit.hpp"
#include "runtime/error.hpp"

namespace lobatto {

namespace {

struct TuneOptions {
    std::string scene;
    double error = 0;
    std::string budget = "20s";
    Overrides overrides;
    bool write = false;
};

void tune(const TuneOptions& options) {
    const Scene written = read_scene(options.scene);
    Scene scene = written;
    apply(options.overrides, scene);
    end_of(scene);
    const Interruption interruption;
    LaboratoryRequest request;
    request.reference_precision = Precision::quadruple;
    const double goal = 0.8 * options.error;
    request.wanted = options.error / 100;
    request.first = first_guess(goal, 2);
    request.interrupted = interruption.flag();
    request.say = [](const std::string& what) { fmt::print(stderr, "{}\n", what); };
    Laboratory laboratory(derive(written), scene, request);
    fmt::print("reference {} S={} disagreement {:.2g} omega {:.3g} in {:.2f} s at {:.2f}\n", laboratory.reference().first,
               laboratory.reference().samples, laboratory.reference().disagreement.back(), laboratory.reference().frequency, laboratory.reference().seconds, laboratory.elapsed());
    const Search found = search(laboratory, goal);
    if (!found.best) throw ComputationError(fmt::format("least error {:.2g}", found.least_error));
    for (const Measurement& m : found.by_member)
        fmt::print("{} N={} tol={} error {:.2g} {} it {:.2f}\n", m.candidate.name(), m.candidate.steps, m.candidate.tolerance, m.error,
                   duration(m.seconds), m.iterations);
    fmt::print("{} members, {:.2f} s\n", found.members, laboratory.elapsed());
}

}  // namespace

void add_tune(CLI::App& program) {
    CLI::App* command = program.add_subcommand("tune", "Choose the cheapest method and step for an accuracy");
    const auto options = std::make_shared<TuneOptions>();
    command->add_option("scene", options->scene, "Scene file")->required();
    command->add_option("--error", options->error, "error")->required();
    command->add_option("--until", options->overrides.until, "End time; may use the scene's parameters");
    command->callback([options] { tune(*options); });
}

}  // namespace lobatto
