// SPDX-License-Identifier: GPL-2.0-or-later
#include "cli/options/resume.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "generator/formula/text/source.hpp"
#include "runtime/error.hpp"

namespace lobatto {

namespace {

std::string list(const std::vector<double>& values) {
    std::string text;
    for (const double value : values) text += (text.empty() ? "" : " ") + exact_text(value);
    return text;
}

}  // namespace

std::string identity_of(const Scene& scene, const TrajectoryRequest& request, const TrajectoryHeader& header,
                        const std::string& object) {
    const bool whole = !request.whole_q.empty();
    std::string columns;
    for (const Column& column : scene.outputs.columns)
        if (!column.text.empty()) columns += fmt::format("column {}: {}\n", column.name, column.text);
    return fmt::format(
        "# lobatto {}\n{}positions: {}\nmomenta: {}\nsteps: {}\nevery: {}\ndense: {}\ntolerance: {}\ncompiled kernel: "
        "{}\n{}",
        LOBATTO_VERSION, text_of(header), list(whole ? request.whole_q : request.q),
        list(whole ? request.whole_p : request.p), request.steps, request.every, request.dense,
        exact_text(request.tolerance), std::filesystem::path(object).stem().string(), columns);
}

void keep_strangers(const std::string& trajectory) {
    const std::string path = checkpoint_path(trajectory);
    std::error_code none;
    if (std::filesystem::exists(std::filesystem::symlink_status(path, none)) && !is_checkpoint(path))
        throw InputError(
            fmt::format("-o: {} is there, and Lobatto did not write it; a run to {} would put its checkpoint there. "
                        "Move it away, or "
                        "choose another place with -o",
                        path, trajectory));
}

void remove_checkpoint(const std::string& trajectory) {
    std::error_code none;
    if (is_checkpoint(checkpoint_path(trajectory))) std::filesystem::remove(checkpoint_path(trajectory), none);
}

std::optional<Checkpoint> checkpoint_of(const std::string& trajectory, const std::string& run, const Kernel& kernel,
                                        std::size_t files, const std::vector<std::string>& observers) {
    const std::string path = checkpoint_path(trajectory);
    std::optional<Checkpoint> found = read_checkpoint(path);
    if (!found) return found;
    if (const std::string what = difference(found->run, run); !what.empty())
        throw InputError(fmt::format(
            "{} belongs to another run: {}. Give that run's options, or run without --resume to start again", path,
            what));
    const auto n = static_cast<std::size_t>(kernel->coordinates);
    const TrajectoryResult& result = found->halfway.result;
    const bool has_all = std::all_of(observers.begin(), observers.end(),
                                     [&](const std::string& name) { return found->observers.contains(name); });
    if (found->files.size() != files || !has_all || std::ssize(found->halfway.stepper) != kernel->stepper_bytes ||
        result.q.size() != n || result.p.size() != n)
        throw MachineError(
            fmt::format("cannot continue from {}: it is damaged. Run without --resume to start again", path));
    return found;
}

}  // namespace lobatto
