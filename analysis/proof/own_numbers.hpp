// SPDX-License-Identifier: GPL-2.0-or-later
// What is proved of a kernel in the numbers of its scene, where these are neither double nor quadruple.
#pragma once

#include <vector>

#include "analysis/exact_start.hpp"
#include "analysis/proof/proof_row.hpp"
#include "runtime/build/library.hpp"

namespace lobatto {

// Steps against those in quadruple, steps and back, the symplectic defect where the step `is_symplectic` and has a
// tangent map, and the energy. `kernel`: in `numbers`; `quadruple`: in quadruple.
std::vector<ProofRow> prove_numbers(Precision numbers, const Kernel& kernel, const Kernel& quadruple,
                                    const ExactStart& start, const GiNaC::numeric& step, bool is_symplectic);

}  // namespace lobatto
