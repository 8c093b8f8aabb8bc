// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/accuracy/companion/at_rest.hpp"

#include <algorithm>
#include <cmath>

#include "analysis/accuracy/companion/amplitude.hpp"
#include "analysis/accuracy/formulas/constraint_sizes.hpp"

namespace lobatto {

namespace {

constexpr double nearby = 1e-6;  // of the place: an equilibrium that is unstable is left by more

// The numbers from `begin` on, n of them, stay within this part of where they begin, or of the farthest.
bool stays_within(double part, const std::vector<double>& start, const std::vector<double>& least,
                  const std::vector<double>& most, std::size_t begin) {
    const std::size_t n = start.size() / 2;
    double farthest = 0;
    for (std::size_t i = begin; i < begin + n; ++i) farthest = std::fmax(farthest, std::fabs(start[i]));
    for (std::size_t i = begin; i < begin + n; ++i)
        if (!(most[i] - least[i] <= part * (start[i] != 0 ? std::fabs(start[i]) : farthest))) return false;
    return true;
}

}  // namespace

// Momenta, too: positions far from 0 may be too coarse to move.
bool rests(const std::vector<double>& start, const std::vector<double>& least, const std::vector<double>& most,
           double epsilon) {
    return stays_within(few_roundings * epsilon, start, least, most, 0) &&
           stays_within(few_roundings * epsilon, start, least, most, start.size() / 2);
}

bool rests_beside_companion(const std::vector<double>& start, const std::vector<double>& least,
                            const std::vector<double>& most, const std::vector<double>& least_of_companion,
                            const std::vector<double>& most_of_companion, double epsilon) {
    return rests(start, least, most, epsilon) && stays_within(nearby, start, least_of_companion, most_of_companion, 0);
}

bool is_at_rest(const SystemOutline& system, const std::vector<std::vector<double>>& rows,
                const std::vector<double>& parameters, double epsilon) {
    if (rows.empty()) return false;
    std::vector<double> least, most, sizes;
    for (const std::vector<double>& row : rows) widen_to(least, most, row.data() + 1, row.size() - 1);
    if (system.constraints.empty())  // the start alone is no motion
        return rows.size() > 1 && rests({rows.front().begin() + 1, rows.front().end()}, least, most, epsilon);
    const ConstraintSizes constraints(system);
    for (const std::vector<double>& row : rows) constraints.widen(sizes, row[0], row.data() + 1, parameters);
    const std::vector<bool> moves = moving(least, most, places_of(least, most, sizes), rounding_of_run(epsilon));
    return std::none_of(moves.begin(), moves.begin() + std::ssize(moves) / 2, [](bool any) { return any; });
}

}  // namespace lobatto
