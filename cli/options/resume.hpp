// SPDX-License-Identifier: GPL-2.0-or-later
// Takes a stopped run up again: its files, its checkpoint beside them, and whether they belong to the run at hand.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "generator/scene/scene.hpp"
#include "runtime/build/library.hpp"
#include "runtime/run/checkpoint.hpp"
#include "runtime/run/output.hpp"

namespace lobatto {

// A text that identifies a run: two runs with the same text have the same bytes. `object`: the compiled kernel.
std::string identity_of(const Scene& scene, const TrajectoryRequest& request, const TrajectoryHeader& header,
                        const std::string& object);

inline std::string checkpoint_path(const std::string& trajectory) {
    return trajectory + ".checkpoint";
}
// InputError where a file that is no checkpoint of ours stands in the place of one.
void keep_strangers(const std::string& trajectory);
void remove_checkpoint(const std::string& trajectory);

// The checkpoint beside the trajectory; nothing when there is none. InputError when it is another run's, MachineError
// when it cannot be used. `files`, `observers`: how many files the run has, and which observers.
std::optional<Checkpoint> checkpoint_of(const std::string& trajectory, const std::string& run, const Kernel& kernel,
                                        std::size_t files, const std::vector<std::string>& observers);

}  // namespace lobatto
