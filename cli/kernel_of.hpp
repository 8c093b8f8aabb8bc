// SPDX-License-Identifier: GPL-2.0-or-later
// Where the two halves meet: what the generator wrote becomes a kernel that the runtime can run.
#pragma once

#include "generator/emit.hpp"
#include "runtime/compile.hpp"
#include "runtime/library.hpp"

namespace lobatto {

// The whole translation unit of a kernel: the support headers, the emitted header, the export.
// `side_by_side`: with what ensembles need, which takes longer to compile.
Translation translation_of(const KernelSource& source, Precision precision, bool side_by_side = false);

// Compiles it, or finds it in the cache, and loads it. `source` must have been emitted with this precision, without
// standalone support.
Kernel kernel_of(const KernelSource& source, Precision precision, Compiled* compiled = nullptr);
// The same for ensembles: its table has lanes, where the number type has vector registers.
Kernel ensemble_kernel_of(const KernelSource& source, Precision precision, Compiled* compiled = nullptr);

}  // namespace lobatto
