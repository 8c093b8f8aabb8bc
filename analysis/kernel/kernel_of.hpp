// SPDX-License-Identifier: GPL-2.0-or-later
// Where the two halves meet: what the generator wrote becomes a kernel that the runtime can run.
#pragma once

#include <cstdint>

#include "generator/emit/kernel.hpp"
#include "runtime/build/compile.hpp"
#include "runtime/build/library.hpp"

namespace lobatto {

// The whole translation unit of a kernel: the support headers, the emitted header, the export.
// `together` > 0: with ensembles, for so many trajectories on each thread; that takes longer to compile.
// `refilled`: of trajectories that end at times of their own, or are looked at after every step.
Translation translation_of(const KernelSource& source, Precision precision, std::int64_t together = 0,
                           bool refilled = false);

// In one translation unit a header's guard is a warning and its include of another part is a missing file.
void append_part(std::string& whole, const std::string& text);

// Compiles it, or finds it in the cache, and loads it. `source` must have been emitted with this precision, without
// standalone support.
Kernel kernel_of(const KernelSource& source, Precision precision, Compiled* compiled = nullptr);
// The same for ensembles, of which a thread has `together` trajectories: its table has lanes, where they are worth it.
Kernel ensemble_kernel_of(const KernelSource& source, Precision precision, std::int64_t together,
                          Compiled* compiled = nullptr, bool refilled = false);

}  // namespace lobatto
