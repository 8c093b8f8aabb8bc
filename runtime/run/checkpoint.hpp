// SPDX-License-Identifier: MIT
// A run that was stopped, in a file beside its trajectory, so that it can go on as if it never had been.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "runtime/files/checksum.hpp"
#include "runtime/run/trajectory.hpp"

namespace lobatto {

struct Checkpoint {
    std::string run;  // which run it is, in lines "what: value"; a run with other lines cannot go on from here
    Halfway halfway;
    std::vector<Written> files;                            // the run's files at that moment
    std::map<std::string, std::vector<double>> observers;  // what each had saved, by its name
};

// Appears whole or not at all, and is on the disk before the one of before goes. MachineError as PartialFile.
void write_checkpoint(const std::string& path, const Checkpoint& checkpoint);

// Whether a file begins as a checkpoint does: with a checksum on a line of its own.
bool is_checkpoint(const std::string& path);
// Nothing if there is no file. MachineError if the file is damaged, or if another user could have written it: its
// content is copied into the kernel's memory.
std::optional<Checkpoint> read_checkpoint(const std::string& path);

// The first line in which `ours` differs from what stands in the checkpoint, for an error; empty when none does.
std::string difference(const std::string& checkpoint, const std::string& ours);

}  // namespace lobatto
