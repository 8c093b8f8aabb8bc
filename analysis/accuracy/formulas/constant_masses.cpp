// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/accuracy/formulas/constant_masses.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace lobatto {

namespace {

constexpr std::size_t most_together = 64;  // coordinates; of more their own masses alone are looked at
constexpr double least_pivot = 1e-12;      // in size, relative to the mass before the elimination

std::string not_positive(const std::string& coordinate) {
    return fmt::format(
        "the kinetic energy is negative for some velocities, that of {} among them: the terms between coordinates "
        "outweigh their masses",
        coordinate);
}

}  // namespace

ConstantMasses::ConstantMasses(const Outline& outline) {
    if (!outline.system.constraints.empty() || outline.system.momentum_v.holds_any(outline.system.motion())) return;
    std::vector<GiNaC::symbol> parameters;
    for (const Parameter& parameter : outline.scene.parameters) parameters.push_back(parameter.symbol);
    for (const Coordinate& coordinate : outline.scene.coordinates) coordinates_.push_back(coordinate.written);
    const Tape::Variables variables(parameters);
    for (const auto& [place, value] : outline.system.momentum_v.entries())
        if (const std::optional<Tape> tape = Tape::of(value, variables))
            entries_.push_back({static_cast<std::size_t>(place.first), static_cast<std::size_t>(place.second), *tape});
}

std::string ConstantMasses::complaint(const std::vector<double>& parameters) const {
    const std::size_t n = coordinates_.size();
    const bool together = n <= most_together;
    std::vector<double> own(n), M(together ? n * n : 0);
    for (const Entry& entry : entries_) {
        const double value = entry.value(parameters);
        if (entry.row == entry.column) own[entry.row] = value;
        if (together) M[entry.row * n + entry.column] = M[entry.column * n + entry.row] = value;
    }
    for (std::size_t k = 0; k < n; ++k)
        if (own[k] < 0)
            return fmt::format("the mass of {} is negative: its momentum falls as its velocity grows", coordinates_[k]);
    // M = L D L^T: it is positive where D is.
    for (std::size_t k = 0; together && k < n; ++k) {
        const double pivot = M[k * n + k];
        if (pivot < -least_pivot * own[k]) return not_positive(coordinates_[k]);
        if (!(pivot > least_pivot * own[k])) {
            const bool is_coupled =
                std::any_of(&M[k * n + k] + 1, &M[k * n] + n, [](double entry) { return entry != 0; });
            return is_coupled && own[k] == 0 ? not_positive(coordinates_[k]) : "";  // else singular, which others tell
        }
        for (std::size_t i = k + 1; i < n; ++i) {
            const double factor = M[i * n + k] / pivot;
            for (std::size_t j = k + 1; factor != 0 && j < n; ++j) M[i * n + j] -= factor * M[k * n + j];
        }
    }
    return "";
}

}  // namespace lobatto
