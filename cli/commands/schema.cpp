// SPDX-License-Identifier: GPL-2.0-or-later
// lobatto schema: what a scene may hold, for editors.
#include <fmt/format.h>

#include "cli/commands/commands.hpp"
#include "cli/options/output_path.hpp"
#include "generator/scene/file/schema.hpp"
#include "runtime/files/partial_file.hpp"

namespace lobatto {

void add_schema(CommandLine& program) {
    Command command =
        program.command("schema", "Print the JSON schema of scenes, by which editors complete and check them");
    const auto output = std::make_shared<std::string>();
    command.option("-o,--output", *output, "A file for it (default: standard output)").shown_as("FILE");
    command.footer(
        "A scene whose first line is\n  #:schema scene.schema.json\nis completed and checked by editors that know "
        "taplo "
        "(Even Better TOML).\n\nExample:\n  lobatto schema -o scene.schema.json");
    command.does([output] {
        if (output->empty()) {
            fmt::print("{}", scene_schema());
        } else {
            require_ending(*output, ".json");
            keep_foreign(*output, "\"title\": \"a scene of lobatto\"");
            write_whole(*output, "the schema", scene_schema());
        }
    });
}

}  // namespace lobatto
