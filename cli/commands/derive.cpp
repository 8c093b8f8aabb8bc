// SPDX-License-Identifier: GPL-2.0-or-later
// lobatto derive: the whole derivation of a scene, for people, for LaTeX or for machines.
#include <iostream>

#include "cli/commands/commands.hpp"

#include "cli/options/output_path.hpp"
#include "cli/options/settings.hpp"
#include "cli/print/say.hpp"
#include "library/whole.hpp"

namespace lobatto {

namespace {

struct DeriveCommand {
    std::string scene;
    api::Settings settings;
    bool latex = false;
    bool json = false;
};

void derive_scene(const DeriveCommand& options) {
    const api::Scene scene(options.scene);
    Say say;
    say("deriving");
    const Description description = api::described(scene, options.settings);
    say.clear();
    std::cout << (options.latex ? latex_of(description) : options.json ? json_of(description) : text_of(description));
}

}  // namespace

void add_derive(CommandLine& program) {
    const auto options = std::make_shared<DeriveCommand>();
    Command command = program.command("derive", "Show how the integrator of a scene follows from its Lagrangian");
    command.option("SCENE", options->scene, "Scene file").required();
    add_method_options(command, options->settings);
    const Option latex = command.flag("--latex", options->latex, "A complete LaTeX document");
    add_json_option(command, options->json).excludes(latex);
    command.footer("Example:\n  lobatto derive scenes/pendulum.toml --latex > pendulum.tex");
    command.does([options] { derive_scene(*options); });
}

}  // namespace lobatto
