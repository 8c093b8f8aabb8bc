// SPDX-License-Identifier: GPL-2.0-or-later
// The columns of a trajectory that are formulas: those of the scene, eliminated coordinates, and what bodies do.
#pragma once

#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "analysis/tape.hpp"
#include "generator/scene/scene.hpp"
#include "runtime/run/trajectory.hpp"

namespace lobatto {

// Names and units of all columns between the state and the energy: multipliers first.
std::vector<std::pair<std::string, std::string>> names_beside(const Scene& scene);

// Those that are formulas, in double.
class ColumnFormulas {
public:
    explicit ColumnFormulas(const Scene& scene);  // InputError: one cannot be evaluated along a trajectory

    std::size_t count() const { return tapes_.size(); }
    // Of a kernel's state; a time that is its last coordinate counts once.
    void evaluate(const std::vector<double>& parameters, double time, const std::vector<double>& q,
                  const std::vector<double>& velocity, double* values) const;

private:
    std::ptrdiff_t coordinates_;
    std::vector<Tape> tapes_;
};

// In the numbers of the request's parameters; not numbers where a formula has no value. `algebra` guards formulas where
// several threads derive; it and the scene outlive what is returned.
TrajectoryRequest::Formulas columns_of(const Scene& scene, const TrajectoryRequest& request,
                                       std::recursive_mutex* algebra = nullptr);

}  // namespace lobatto
