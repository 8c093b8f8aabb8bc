// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/gradients.hpp"

#include <string>

namespace lobatto {

double gradients_of(const lobatto_kernel& kernel, double iterations, double steps) {
    if (kernel.form == LOBATTO_LINEAR_MAP) return 0;
    const bool is_lobatto = std::string(kernel.method).starts_with("Lobatto");
    if (kernel.form == LOBATTO_SEPARABLE && kernel.unknowns == 0 && !is_lobatto)
        return steps * kernel.nodes;  // explicit
    const bool ends_apart = kernel.form == LOBATTO_SEPARABLE && is_lobatto;
    return iterations * (kernel.nodes - (ends_apart ? 2 : 0)) + (ends_apart ? steps : 0);
}

}  // namespace lobatto
