// SPDX-License-Identifier: GPL-2.0-or-later
// lobatto view: a page on which scenes move.
#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <set>
#include <sstream>

#include "cli/commands/commands.hpp"
#include "cli/options/output_path.hpp"
#include "cli/options/settings.hpp"
#include "cli/print/answers_json.hpp"
#include "cli/print/interruption.hpp"
#include "cli/print/progress.hpp"
#include "cli/print/say.hpp"
#include "cli/print/summary.hpp"
#include "cli/print/tell.hpp"
#include "cli/view/motion.hpp"
#include "cli/view/video.hpp"
#include "library/parts.hpp"
#include "runtime/error.hpp"
#include "runtime/files/partial_file.hpp"

namespace lobatto {

namespace {

constexpr std::size_t numbers_on_page = 1'000'000;  // of 16 bits: some 2.7 MB
constexpr std::size_t most_motions = 6;
constexpr double longest_video = 20;  // seconds

struct ViewCommand {
    std::vector<std::string> scenes;
    std::vector<std::string> beside;
    std::string output;  // empty: out/NAME.html
    std::string video;   // empty: none
    api::Settings settings;
    bool quiet = false, json = false;
};

// What differs in one more run of the scene, "points=2 step=0.1": a method, a step.
api::Settings beside_of(const std::string& text) {
    api::Settings beside;
    std::istringstream words(text);
    std::set<std::string> keys;
    for (std::string word; words >> word;) {
        const std::size_t equals = word.find('=');
        const std::string key = word.substr(0, equals),
                          value = equals == std::string::npos ? "" : word.substr(equals + 1);
        const auto number = [&] {
            std::size_t used = 0;
            int count = 0;
            try {
                count = std::stoi(value, &used);
            } catch (const std::exception&) {
                used = 0;
            }
            if (used != value.size() || value.empty())
                throw InputError(
                    fmt::format("--beside: {} needs a whole number, as in points=2, not '{}'", key, value));
            return count;
        };
        if (key == "points")
            beside.points = number();
        else if (key == "stages")
            beside.stages = number();
        else if (key == "splitting")
            beside.splitting = number();
        else if (key == "step" && !value.empty())
            beside.step = value;
        else
            throw InputError(fmt::format(
                "--beside: '{}' is not known; write points=2, stages=1, splitting=11 or step=0.1, with blanks between",
                word));
        if (!keys.insert(key).second) throw InputError(fmt::format("--beside: {} is given twice", key));
    }
    if (keys.empty()) throw InputError("--beside: write what differs, as in \"points=2 step=0.1\"");
    return beside;
}

// The settings of that run.
api::Settings settings_beside(const api::Settings& beside, api::Settings settings, const api::Scene& scene) {
    if (!beside.step.empty()) settings.step = beside.step;
    if (beside.points || beside.stages || beside.splitting) {
        settings.points = beside.points;
        settings.stages = beside.stages;
        settings.splitting = beside.splitting;
        if (settings.splitting) settings.tolerance.reset();  // it iterates nothing
    }
    try {
        api::with_method(scene, settings);
    } catch (const InputError& error) {
        throw InputError(std::string("--beside: ") + error.what());
    }
    return settings;
}

std::vector<Viewed> motions_of(const ViewCommand& options) {
    const std::size_t count = options.scenes.size() * (1 + options.beside.size());
    if (count > most_motions)
        throw InputError(fmt::format("{} motions on one page; at most {}: name fewer scenes", count, most_motions));
    std::vector<Viewed> all;
    std::optional<Progress> progress;
    const auto show_progress = [&](std::int64_t done, std::int64_t steps) {
        if (!progress) progress.emplace(steps);
        progress->show(done);
        if (done >= steps) progress.reset();
    };
    for (const std::string& path : options.scenes) {
        const api::Scene scene(path);
        const auto add = [&](const api::Settings& settings, bool is_alone) {
            progress.reset();
            all.push_back(viewed_motion(scene, settings, is_alone, numbers_on_page / count, show_progress));
        };
        add(options.settings, options.scenes.size() > 1 || options.beside.empty());
        for (const std::string& text : options.beside)
            add(settings_beside(beside_of(text), options.settings, scene), false);
    }
    return all;
}

// Those of all motions, each once.
std::vector<ViewChart> charts_of(const std::vector<Viewed>& all) {
    std::vector<ViewChart> charts;
    for (const Viewed& one : all)
        for (const ViewChart& chart : one.charts)
            if (std::none_of(charts.begin(), charts.end(),
                             [&](const ViewChart& known) { return known.curves == chart.curves; }))
                charts.push_back(chart);
    return charts;
}

void view(const ViewCommand& options) {
    const std::string path = output_path(options.output, result_name(options.scenes.front()) + ".html");
    require_ending(path, ".html");
    for (const std::string& scene : options.scenes) keep_scene(scene, path);
    if (!options.video.empty()) {
        check_video_name(options.video);
        if (is_standard_output(path)) throw InputError("--video: the browser reads the page; name a file with -o");
        if (options.video == path) throw InputError("--video: the page and the video need two names");
        keep_foreign(options.video);
    }
    if (options.json && is_standard_output(path))
        throw InputError("--json: standard output has the page; name a file with -o");
    keep_foreign(path);
    const std::vector<Viewed> all = motions_of(options);
    if (std::any_of(all.begin(), all.end(), [](const Viewed& one) { return one.is_interrupted; }))
        throw ExitCode{interrupted_exit};
    std::vector<ViewMotion> motions;
    for (const Viewed& one : all) motions.push_back(one.motion);
    const double rate = comfortable_rate(motions);
    const std::string page = page_of(all.front().title, motions, charts_of(all), rate);
    write_whole(path, "the page", page);
    if (!options.video.empty()) {
        double end = 0;
        for (const ViewMotion& motion : motions) end = std::max(end, motion.times.back());
        Say say;
        say("drawing the frames of the video");
        write_video(path, options.video, std::min(end / rate, longest_video));
        say.clear();
    }
    if (options.json) {
        std::vector<Drawn> drawn;
        for (std::size_t i = 0; i < all.size(); ++i)
            drawn.push_back({options.scenes[i / (1 + options.beside.size())], all[i].motion.label, all[i].motion.note,
                             "", all[i].failure});
        if (!options.video.empty())
            drawn.push_back({options.scenes.front(), all.front().title, "video", options.video, ""});
        fmt::print("{}", json_of_drawn("view", path, drawn));
    } else if (!options.quiet && !is_standard_output(path)) {
        for (const Viewed& one : all)
            print_row("motion", fmt::format("{}: {}; {}, {}", one.motion.label, one.motion.note,
                                            counted(std::ssize(one.motion.times), "frame", "frames"),
                                            counted(std::ssize(one.motion.figures), "figure", "figures")));
        print_row("page", fmt::format("{}, {} kB: open it in a browser", path, (page.size() + 999) / 1000));
        if (!options.video.empty()) print_row("video", options.video);
    }
    for (const Viewed& one : all) {
        if (one.failure.empty()) continue;
        const std::string which = one.motion.label == one.title ? "" : ", " + one.motion.label + ", " + one.motion.note;
        tell("lobatto: warning: {}{}: {}\n", one.title, which, one.failure);
    }
}

}  // namespace

void add_view(CommandLine& program) {
    Command command = program.command("view", "Run scenes and write a page on which they move");
    const auto options = std::make_shared<ViewCommand>();
    command.option("SCENES", options->scenes, "Scene files; several stand side by side").required();
    command
        .option("--beside", options->beside,
                "The same scene once more, by another method or step: \"points=2 step=0.1\"; may be repeated")
        .shown_as("CHOICE")
        .one_value_each();
    command.option("-o,--output", options->output, "Page (default: out/NAME.html)").shown_as("FILE");
    command
        .option("--video", options->video,
                "Also the first 20 seconds as a video, .mp4 or .gif; needs chromium and ffmpeg")
        .shown_as("FILE");
    add_method_options(command, options->settings);
    add_step_option(command, options->settings);
    add_until_option(command, options->settings);
    add_set_option(command, options->settings);
    command.flag("--quiet", options->quiet, "Print nothing but warnings and errors");
    add_json_option(command, options->json);
    command.footer("Example:\n  lobatto view scenes/double_pendulum.toml --beside points=2 -o pendulum.html");
    command.does([options] { view(*options); });
}

}  // namespace lobatto
