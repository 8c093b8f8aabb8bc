// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/accuracy/companion/at_rest.hpp"

#include <algorithm>

#include "analysis/accuracy/companion/amplitude.hpp"
#include "analysis/accuracy/formulas/constraint_sizes.hpp"

namespace lobatto {

bool rests_on_constraints(const SystemOutline& system, const std::vector<std::vector<double>>& rows,
                          const std::vector<double>& parameters, double epsilon) {
    if (system.constraints.empty() || rows.empty()) return false;
    const ConstraintSizes constraints(system);
    std::vector<double> least, most, sizes;
    for (const std::vector<double>& row : rows) {
        widen_to(least, most, row.data() + 1, row.size() - 1);
        constraints.widen(sizes, row[0], row.data() + 1, parameters);
    }
    const std::vector<bool> moves = moving(least, most, places_of(least, most, sizes), rounding_of_run(epsilon));
    return std::none_of(moves.begin(), moves.begin() + std::ssize(moves) / 2, [](bool any) { return any; });
}

}  // namespace lobatto
