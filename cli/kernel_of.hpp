// SPDX-License-Identifier: GPL-2.0-or-later
// Where the two halves meet: what the generator wrote becomes a kernel that the runtime can run.
#pragma once

#include "generator/emit.hpp"
#include "runtime/compile.hpp"
#include "runtime/library.hpp"

namespace lobatto {

// The whole translation unit of a kernel: the support headers, the emitted header, the export.
Translation translation_of(const KernelSource& source, Precision precision);

// Compiles it, or finds it in the cache, and loads it. `source` must have been emitted with this precision, without
// standalone support.
Kernel kernel_of(const KernelSource& source, Precision precision, Compiled* compiled = nullptr);

}  // namespace lobatto
