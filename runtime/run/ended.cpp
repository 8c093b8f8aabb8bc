// SPDX-License-Identifier: MIT
#include "runtime/run/ended.hpp"

#include <algorithm>
#include <cmath>

namespace lobatto {

std::int64_t rows_kept(const EnsembleRequest& request) {
    return request.every == 0 ? 1 : request.steps / request.every + 2;
}

void Ended::keep(const EnsembleRequest& request, const double* row, std::size_t n, double energy) {
    if (energies.empty()) {
        rows.reserve(static_cast<std::size_t>(rows_kept(request)) * (1 + 2 * n));
        energies.reserve(static_cast<std::size_t>(rows_kept(request)));
        energy_start = energy;
    } else if (request.every == 0) {
        rows.clear();
        energies.clear();
    }
    rows.insert(rows.end(), row, row + 1 + 2 * n);
    energies.push_back(energy);
    row_step = steps_done;
    const double error = std::fabs(energy - energy_start);
    if (!(error <= energy_error_largest)) energy_error_largest = error;
}

void Chunk::took(std::int64_t steps, double seconds) {
    constexpr double wanted = 0.02;
    // The clock ticks coarsely against a short chunk: grow at most eightfold at a time.
    const double pace = wanted / std::max(seconds, wanted / 8);
    steps_ = std::max<std::int64_t>(1, std::llround(static_cast<double>(steps) * pace));
}

}  // namespace lobatto
