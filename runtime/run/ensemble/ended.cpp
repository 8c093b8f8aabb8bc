// SPDX-License-Identifier: MIT
#include "runtime/run/ensemble/ended.hpp"

#include <algorithm>
#include <cmath>

#include "runtime/run/parts.hpp"

namespace lobatto {

std::int64_t rows_kept(const EnsembleRequest& request) {
    return request.every == 0 ? 1 : request.steps / request.every + 2;
}

void Ended::keep(const EnsembleRequest& request, double time, const double* q, const double* p, std::size_t n,
                 const double* energy, std::size_t parts) {
    if (energies.empty()) {
        rows.reserve(static_cast<std::size_t>(rows_kept(request)) * (1 + 2 * n));
        energies.reserve(static_cast<std::size_t>(rows_kept(request)));
        energy_start.assign(energy, energy + parts);
    } else if (request.every == 0) {
        for (auto* kept : {&rows, &energies, &whole_rows, &whole_energies}) kept->clear();
    }
    rows.push_back(time);
    for (const double* numbers : {q, p})
        for (std::size_t k = 0; k < n; ++k) rows.push_back(numbers[k * parts]);
    energies.push_back(energy[0]);
    if (parts > 1) {
        const std::vector<double> whole_time = as_parts({time}, parts);
        whole_rows.insert(whole_rows.end(), whole_time.begin(), whole_time.end());
        for (const double* numbers : {q, p}) whole_rows.insert(whole_rows.end(), numbers, numbers + n * parts);
        whole_energies.insert(whole_energies.end(), energy, energy + parts);
    }
    row_step = steps_done;
    const double error = std::fabs(difference(energy, energy_start.data(), parts));
    if (!(error <= energy_error_largest)) energy_error_largest = error;
}

void Chunk::took(std::int64_t steps, double seconds) {
    // The clock ticks coarsely against a short chunk: grow at most eightfold at a time.
    const double pace = wanted_ / std::max(seconds, wanted_ / 8);
    const double least_takes = seconds / static_cast<double>(steps) * static_cast<double>(least_);
    steps_ =
        std::max<std::int64_t>(least_takes < longest ? least_ : 1, std::llround(static_cast<double>(steps) * pace));
}

}  // namespace lobatto
