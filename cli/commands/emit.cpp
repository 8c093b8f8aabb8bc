// SPDX-License-Identifier: GPL-2.0-or-later
// lobatto emit: a scene's kernel as a C++ header, and what each pass saved.
#include <fmt/format.h>
#include <fmt/ostream.h>

#include <algorithm>
#include <filesystem>
#include <iostream>

#include "analysis/kernel/support_text.hpp"
#include "cli/commands/commands.hpp"
#include "cli/options/output_path.hpp"
#include "cli/options/settings.hpp"
#include "cli/print/answers_json.hpp"
#include "cli/print/say.hpp"
#include "generator/emit/header.hpp"
#include "library/whole.hpp"
#include "runtime/build/compiler.hpp"
#include "runtime/error.hpp"
#include "runtime/files/partial_file.hpp"

namespace lobatto {

namespace {

namespace fs = std::filesystem;

struct EmitCommand {
    std::string scene;
    std::string folder;
    api::Settings settings;
    Shortcuts shortcuts = Shortcuts::all;
    bool standalone = false;
    bool no_support = false;
    bool ensemble = false;
    bool plain = false;
    bool json = false;
};

void print_report(const std::vector<PassReport>& report) {
    fmt::print(std::cout, "{:<26}{:>11}{:>17}{:>11}{:>11}{:>8}   largest relative change of a value\n", "pass",
               "additions", "multiplications", "divisions", "functions", "total");
    for (const PassReport& row : report) {
        const Operations& now = row.after;
        const std::string change = &row == &report.front() ? ""
                                   : row.disagreement == 0 ? "0"
                                                           : fmt::format("{:.0e}", row.disagreement);
        const std::string line = fmt::format("{:<26}{:>11}{:>17}{:>11}{:>11}{:>8}   {}", row.pass, now.additions,
                                             now.multiplications, now.divisions, now.functions, now.total(), change);
        fmt::print(std::cout, "{}\n", line.substr(0, line.find_last_not_of(' ') + 1));
    }
    fmt::print(std::cout, "(over all functions of the kernel; each pass keeps all values to 40 digits)\n");
}

void print_use(const KernelSource& source, const EmitCommand& options, const Scene& scene) {
    const Precision numbers = scene.method.numbers;
    const bool quadruple = numbers == Precision::quadruple, hybrid = has_hybrid_stepper(scene);
    const std::string tolerance = tolerance_setting(scene, source.form);
    const std::string include = options.standalone ? "" : options.no_support ? " -I runtime/kernel" : "";
    fmt::print(
        std::cout,
        "\nUse it:\n"
        "  #include \"{0}.hpp\"  // g++ -std={1}17 -O3 -march=native -ffp-contract=off{2} -I {3} program.cpp{4}\n"
        "  lobatto::{5}<lobatto::kernels::{0}> stepper;\n"
        "{8}  stepper.prepare({{}}, h); stepper.start(t, q, p); stepper.step();  // state: stepper.time(), .{6}, "
        ".momentum(p){7}\n",
        source.name, quadruple ? "gnu++" : "c++", include, shell_word(options.folder),
        quadruple                  ? " -lquadmath"
        : has_many_digits(numbers) ? " -lmpfr"
                                   : "",
        hybrid ? "HybridStepper" : "Stepper", hybrid ? "q()" : "q", hybrid ? "; .events()" : "",
        tolerance.empty() ? "" : fmt::format("  stepper.{};\n", tolerance));
    if (options.ensemble)
        fmt::print(std::cout,
                   "Many side by side: lobatto::Ensemble<lobatto::kernels::{}, 8> (docs/library.md, Ensembles)\n",
                   source.name);
}

// The folder, made where it is not there, and the file in it, which must not be the scene.
fs::path path_for(const EmitCommand& options, const std::string& name) {
    std::error_code error;
    fs::create_directories(options.folder, error);
    if (error) fail_to_write("the header", options.folder, error.value());
    const fs::path path = fs::path(options.folder) / (name + ".hpp");
    keep_scene(options.scene, path);
    keep_foreign(path);
    return path;
}

// -o -: the text itself, of one file.
bool is_printed(const EmitCommand& options) {
    if (!is_standard_output(options.folder)) return false;
    if (!options.plain && !options.standalone && !options.no_support)
        throw InputError(
            "-o -: standard output takes one file, but the kernel includes another; add --standalone, --plain or "
            "--no-support, or name a folder");
    if (options.json) throw InputError("-o -: standard output takes the header or the report; leave --json out");
    return true;
}

void write_plain(const PlainSource& source, const EmitCommand& options) {
    const fs::path path = path_for(options, source.name);
    write_whole(path, "the header", source.header);
    if (options.json) {
        fmt::print(std::cout, "{}", json_of_emitted(options.scene, {path.string()}, source.name, {}));
        return;
    }
    fmt::print(std::cout,
               "Wrote {0}, {1} lines\n\nUse it:\n"
               "  #include \"{2}.hpp\"  // g++ -std=c++17 -O2 -I {3} program.cpp\n"
               "  namespace motion = lobatto::plain::{2};\n"
               "  motion::Parameters parameters;\n"
               "  motion::State x = motion::start(parameters);\n"
               "  motion::step(parameters, h, x);  // state: x.t, x.q, x.p; false: the step was not solved\n",
               path.string(), std::count(source.header.begin(), source.header.end(), '\n'), source.name,
               shell_word(options.folder));
}

void emit_scene(const EmitCommand& options) {
    const api::Scene scene(options.scene);
    const api::Settings& settings = options.settings;
    if (options.ensemble && !options.standalone)
        throw InputError(
            "--ensemble: kernel.hpp carries ensembles anyway; leave --ensemble out, or add --standalone for one file");
    const lobatto::Scene& read = scene.parts().scene;
    if (options.ensemble && (read.is_cut() || !read.constraints.empty()))
        throw InputError(
            "--ensemble: walls, switches and constraints are followed by one trajectory at a time; leave it out, and "
            "take one stepper for each");
    const bool printed = is_printed(options);
    if (options.plain) {
        const PlainSource source = api::plainly_emitted(scene, settings);
        if (printed)
            fmt::print(std::cout, "{}", source.header);
        else
            write_plain(source, options);
        return;
    }
    Say say;
    say("deriving");
    const KernelSource source =
        api::emitted(scene, settings, {options.shortcuts, options.standalone, options.ensemble});
    say.clear();
    if (printed) {
        fmt::print(std::cout, "{}", source.header);
        return;
    }
    const fs::path path = path_for(options, source.name);
    if (!options.standalone && !options.no_support) {
        if (source.name == "kernel")
            throw InputError(
                fmt::format("{}: the kernel of this scene and its support header would both be kernel.hpp; "
                            "rename the scene file, or give --standalone or --no-support",
                            options.scene));
        const fs::path support = fs::path(options.folder) / "kernel.hpp";
        keep_scene(options.scene, support);
        keep_foreign(support, "#ifndef lobatto_kernel_");
        write_whole(support, "the header", support_text());
    }
    write_whole(path, "the header", source.header);
    if (options.json) {
        std::vector<std::string> files{path.string()};
        if (!options.standalone && !options.no_support)
            files.push_back((fs::path(options.folder) / "kernel.hpp").string());
        fmt::print(std::cout, "{}", json_of_emitted(options.scene, files, source.name, source.report));
        return;
    }
    print_report(source.report);
    fmt::print(std::cout, "\nWrote {}", path.string());
    if (!options.standalone && !options.no_support)
        fmt::print(std::cout, " and {}", (fs::path(options.folder) / "kernel.hpp").string());
    fmt::print(std::cout, "\n");
    print_use(source, options, api::with_method(scene, settings));
}

}  // namespace

void add_emit(CommandLine& program) {
    const auto options = std::make_shared<EmitCommand>();
    Command command = program.command("emit", "Write the integrator of a scene as a C++ header");
    command.option("SCENE", options->scene, "Scene file").required();
    command
        .option("-o,--output", options->folder,
                "Folder for NAME.hpp and the kernel.hpp that it includes; - prints one file")
        .required()
        .shown_as("FOLDER");
    add_method_options(command, options->settings);
    const Option general = add_general_flag(command, options->shortcuts);
    const Option standalone =
        command.flag("--standalone", options->standalone, "One file that carries kernel.hpp inside");
    const Option no_support =
        command.flag("--no-support", options->no_support, "Do not write kernel.hpp; you provide it with -I")
            .excludes(standalone);
    command
        .flag("--ensemble", options->ensemble, "With --standalone: also lobatto::Ensemble, trajectories side by side")
        .excludes(no_support);
    command
        .flag("--plain", options->plain,
              "The integrator as a textbook prints it: one short C++17 header, to read and to copy; slower")
        .excludes(standalone)
        .excludes(no_support)
        .excludes(general);
    add_json_option(command, options->json);
    command.footer("Example:\n  lobatto emit scenes/pendulum.toml --plain -o kernels");
    command.does([options] { emit_scene(*options); });
}

}  // namespace lobatto
