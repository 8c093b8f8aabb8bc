// SPDX-License-Identifier: GPL-2.0-or-later
// lobatto gallery: every scene run, one picture each, and a page that shows them all.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "analysis/kernel/kernel_of.hpp"
#include "analysis/motion.hpp"
#include "cli/commands/commands.hpp"
#include "cli/options/output_path.hpp"
#include "cli/print/answers_json.hpp"
#include "cli/print/drawing.hpp"
#include "cli/print/gallery_picture.hpp"
#include "cli/print/progress.hpp"
#include "cli/print/tell.hpp"
#include "generator/pipeline.hpp"
#include "library/parts.hpp"
#include "runtime/error.hpp"
#include "runtime/files/partial_file.hpp"

namespace lobatto {

namespace {

namespace fs = std::filesystem;

constexpr int some_failed = 3;                // exit code
constexpr std::int64_t smooth_below = 20000;  // steps up to which states between them make curves smooth
constexpr double smaller_ones[] = {0.2, 0.4, 0.6, 0.8};

struct GalleryCommand {
    std::string folder = "docs/gallery";
    std::vector<std::string> scenes;
    bool json = false;
};

std::vector<std::string> all_scenes() {
    std::vector<std::string> scenes;
    std::error_code error;
    for (const auto& entry : fs::directory_iterator("scenes", error))
        if (entry.path().extension() == ".toml") scenes.push_back(entry.path().generic_string());
    if (scenes.empty())
        throw InputError("there is no folder scenes here with scene files; go to the source tree, or name the scenes");
    std::sort(scenes.begin(), scenes.end());
    return scenes;
}

MotionRows run(const std::string& path, const Kernel& kernel, TrajectoryRequest request) {
    MotionRows states;
    states.n = kernel->coordinates;
    request.sink = [&](const Records& records) {
        states.rows.insert(states.rows.end(), records.rows, records.rows + records.count * records.columns);
    };
    const TrajectoryResult result = integrate(kernel, request);
    if (result.status != LOBATTO_OK) throw ComputationError(fmt::format("{}: {}", path, explain_stop(result, request)));
    return states;
}

// The same motion begun nearer to the middle between its ends.
std::vector<MotionRows> smaller_motions(const std::string& path, const Kernel& kernel, const TrajectoryRequest& request,
                                        const MotionRows& states) {
    double low = states.q(0, 0), high = low;
    for (std::size_t i = 0; i < states.count(); ++i) {
        low = std::min(low, states.q(i, 0));
        high = std::max(high, states.q(i, 0));
    }
    const double middle = (low + high) / 2;
    std::vector<MotionRows> smaller;
    for (const double share : smaller_ones) {
        TrajectoryRequest nearer = request;
        nearer.q[0] = middle + share * (request.q[0] - middle);
        nearer.p[0] = share * request.p[0];
        smaller.push_back(run(path, kernel, nearer));
    }
    return smaller;
}

Picture picture_of_scene(Scene& scene) {
    const Steps steps = steps_of(scene);
    const bool smooth = steps.count < smooth_below && shape_of(scene) != Shape::waterfall;
    Outputs outputs;  // the motion alone
    outputs.energy = outputs.tangent = outputs.momenta = false;
    outputs.every = smooth ? 1 : scene.outputs.every;
    outputs.dense = smooth ? 4 : 0;
    scene.outputs = outputs;
    const Derivation derivation = derive(scene);
    const Kernel kernel = kernel_of(emit(derivation), Precision::double_);
    LoadedStepper<double> stepper(kernel);
    const TrajectoryRequest request = request_of(scene, steps.count, stepper);
    const MotionRows states = run(scene.path, kernel, request);
    const auto& forces = derivation.system.outer_force;
    const bool nested =
        !scene.is_cut() && shape_of(scene) == Shape::phase && derivation.system.autonomous && forces.front().is_zero();
    return picture_of(scene, states,
                      nested ? smaller_motions(scene.path, kernel, request, states) : std::vector<MotionRows>{});
}

void gallery(const GalleryCommand& options) {
    const std::vector<std::string> paths = options.scenes.empty() ? all_scenes() : options.scenes;
    output_folder(options.folder, "");
    std::string page =
        "# Gallery\n\n"
        "Every scene of this folder's pictures is a short text file; `lobatto gallery` derived, compiled and ran each "
        "and drew\nwhat came out. Click a title for the scene.\n";
    std::size_t failed = 0;
    std::vector<Drawn> drawn;
    Progress progress(std::ssize(paths));
    for (const std::string& path : paths) {
        progress.show(&path - paths.data());
        try {
            Scene scene = api::Scene(path).parts().scene;
            const Picture picture = picture_of_scene(scene);
            draw(options.folder, scene.name, picture.script, picture.width, picture.height);
            const std::string svg = scene.name + ".svg";
            const auto bytes = fs::file_size(fs::path(options.folder) / svg);
            drawn.push_back({path, scene.title, picture.caption, (fs::path(options.folder) / svg).generic_string()});
            if (!options.json)
                fmt::print("{:<44}{:>4} kB  {}\n", (fs::path(options.folder) / svg).generic_string(),
                           (bytes + 999) / 1000, picture.caption);
            page += fmt::format("\n## [{}]({})\n{}\n\n![{}]({})\n", scene.title,
                                fs::relative(path, options.folder).generic_string(), picture.caption, scene.title, svg);
        } catch (const MachineError&) {
            throw;
        } catch (const api::MachineError&) {
            throw;
        } catch (const std::runtime_error& failure) {
            ++failed;
            tell("{}\n", failure.what());
        }
    }
    write_whole(options.folder + "/README.md", "the page", page);
    if (options.json)
        fmt::print("{}", json_of_drawn("gallery", options.folder + "/README.md", drawn));
    else
        fmt::print("{} of {} scenes drawn; {}/README.md shows them.\n", paths.size() - failed, paths.size(),
                   options.folder);
    if (failed > 0) throw ExitCode{some_failed};
}

}  // namespace

void add_gallery(CommandLine& program) {
    const auto options = std::make_shared<GalleryCommand>();
    Command command = program.command("gallery", "Run scenes and draw one picture of each");
    command.option("SCENES", options->scenes, "Scene files (default: all in the folder scenes)");
    command.option("-o,--output", options->folder, "Folder for the pictures (default: docs/gallery)")
        .shown_as("FOLDER");
    add_json_option(command, options->json);
    command.footer("Example:\n  lobatto gallery -o pictures scenes/kepler.toml scenes/pleiades.toml");
    command.does([options] { gallery(*options); });
}

}  // namespace lobatto
