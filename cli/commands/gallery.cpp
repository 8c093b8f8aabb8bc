// SPDX-License-Identifier: GPL-2.0-or-later
// lobatto gallery: every scene run, one picture each, and a page that shows them all.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <string_view>

#include "analysis/motion.hpp"
#include "cli/commands/commands.hpp"
#include "cli/options/output_path.hpp"
#include "cli/print/answers_json.hpp"
#include "cli/print/drawing.hpp"
#include "cli/print/gallery_picture.hpp"
#include "cli/print/progress.hpp"
#include "cli/print/tell.hpp"
#include "library/opened_run.hpp"
#include "runtime/error.hpp"
#include "runtime/files/partial_file.hpp"

namespace lobatto {

namespace {

namespace fs = std::filesystem;

constexpr int wrong_input = 2, some_failed = 3;  // exit codes
constexpr std::int64_t smooth_below = 20000;     // steps up to which states between them make curves smooth
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

// A motion, with what a smaller one is made of.
struct Motion {
    MotionRows states;
    bool is_closed;  // no force, nothing from the time: it goes on for ever as it began
};

Motion motion_of(const api::Scene& scene) {
    api::RunOptions options;
    options.measure = false;
    api::OpenedRun run(scene, options);
    const Outline& outline = run.prepared().outline;
    Motion motion{{static_cast<int>(run.request().q.size()), {}},
                  outline.system.autonomous && !outline.system.has_forces() && !run.scene().is_cut()};
    api::OpenedRun::Listeners listeners;
    listeners.states = [&](const Records& records) {
        motion.states.rows.insert(motion.states.rows.end(), records.rows,
                                  records.rows + records.count * records.columns);
    };
    listeners.events = [](const EventRecords&) {};
    run.go(listeners);
    if (const RunVerdict verdict = run.verdict(); !verdict.failure.empty())
        throw ComputationError(fmt::format("{}: {}", scene.path(), verdict.failure));
    return motion;
}

// The same motion begun nearer to the middle between its ends.
std::vector<MotionRows> smaller_motions(const Scene& scene, const MotionRows& states) {
    double low = states.q(0, 0), high = low;
    for (std::size_t i = 0; i < states.count(); ++i) {
        low = std::min(low, states.q(i, 0));
        high = std::max(high, states.q(i, 0));
    }
    const double middle = (low + high) / 2;
    std::vector<MotionRows> smaller;
    for (const double share : smaller_ones) {
        Scene nearer = scene;
        nearer.start = Start::momentum;
        nearer.initial_position[0] = middle + share * (states.q(0, 0) - middle);
        nearer.initial_rate[0] = share * states.p(0, 0);
        smaller.push_back(motion_of(api::scene_of(nearer)).states);
    }
    return smaller;
}

// The motion alone, with states between its steps where these make curves smooth.
Outputs pictured(const Scene& scene) {
    const bool smooth = steps_of(scene).count < smooth_below && shape_of(scene) != Shape::waterfall;
    Outputs outputs;
    outputs.energy = outputs.tangent = outputs.momenta = false;
    outputs.every = smooth ? 1 : scene.outputs.every;
    outputs.dense = smooth ? 4 : 0;
    return outputs;
}

Picture picture_of_scene(const api::Scene& read) {
    Scene scene = read.parts().scene;
    scene.outputs = pictured(scene);
    scene.run.stops.clear();  // the picture shows where the motion would go
    const Motion motion = motion_of(api::scene_of(scene));
    const bool nested = motion.is_closed && !scene.clock && shape_of(scene) == Shape::phase;
    return picture_of(scene, motion.states, nested ? smaller_motions(scene, motion.states) : std::vector<MotionRows>{});
}

// Pictures have names of their own, and nothing that is not ours stands in their place.
void check_places(const std::vector<std::string>& paths, const std::string& folder) {
    std::map<std::string, std::string> path_of;
    keep_foreign(folder + "/README.md", "`lobatto gallery`");
    for (const std::string& path : paths) {
        const std::string picture = folder + "/" + result_name(path) + ".svg";
        if (const auto [place, is_new] = path_of.try_emplace(picture, path); !is_new)
            throw InputError(fmt::format("{} and {}: both pictures would be {}; draw them into two folders",
                                         place->second, path, picture));
        keep_foreign(picture);
    }
}

// A text that Markdown takes for nothing else.
std::string in_markdown(const std::string& text) {
    std::string safe;
    for (const char c : text) {
        if (std::string_view("\\`*_[]<>").find(c) != std::string_view::npos) safe += '\\';
        safe += c;
    }
    return safe;
}

void gallery(const GalleryCommand& options) {
    const std::vector<std::string> paths = options.scenes.empty() ? all_scenes() : options.scenes;
    output_folder(options.folder, "");
    check_places(paths, options.folder);
    std::string page =
        "# Gallery\n\n"
        "Every scene of this folder's pictures is a short text file; `lobatto gallery` derived, compiled and ran each "
        "and drew\nwhat came out. Click a title for the scene.\n";
    std::size_t failed = 0;
    bool all_are_input = true;  // what failed
    std::vector<Drawn> drawn;
    Progress progress(std::ssize(paths));
    for (const std::string& path : paths) {
        progress.show(&path - paths.data());
        try {
            const api::Scene scene(path);
            const Picture picture = picture_of_scene(scene);
            draw(options.folder, scene.name(), picture.script, picture.width, picture.height);
            const std::string svg = scene.name() + ".svg";
            const auto bytes = fs::file_size(fs::path(options.folder) / svg);
            drawn.push_back({path, scene.title(), picture.caption, (fs::path(options.folder) / svg).generic_string()});
            if (!options.json)
                fmt::print("{:<44}{:>4} kB  {}\n", (fs::path(options.folder) / svg).generic_string(),
                           (bytes + 999) / 1000, picture.caption);
            page += fmt::format("\n## [{0}]({1})\n{2}\n\n![{0}]({3})\n", in_markdown(scene.title()),
                                fs::relative(path, options.folder).generic_string(), picture.caption, svg);
        } catch (const MachineError&) {
            throw;
        } catch (const api::MachineError&) {
            throw;
        } catch (const std::runtime_error& failure) {
            ++failed;
            all_are_input = all_are_input && dynamic_cast<const api::InputError*>(&failure) != nullptr;
            tell("{}\n", failure.what());
        }
    }
    write_whole(options.folder + "/README.md", "the page", page);
    if (options.json)
        fmt::print("{}", json_of_drawn("gallery", options.folder + "/README.md", drawn));
    else
        fmt::print("{} of {} scenes drawn; {}/README.md shows them.\n", paths.size() - failed, paths.size(),
                   options.folder);
    if (failed > 0) throw ExitCode{all_are_input ? wrong_input : some_failed};
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
