// SPDX-License-Identifier: GPL-2.0-or-later
// --vary: names of a scene with many values each, and the grid of trajectories they make.
#pragma once

#include <ginac/ginac.h>

#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "generator/mechanics/system.hpp"
#include "generator/scene/scene.hpp"
#include "runtime/run/ensemble.hpp"

namespace lobatto {

// The values of one name: a list, or from `given[0]` to `given[1]`, both included.
struct Axis {
    enum class Role { position, rate, parameter };
    enum class Spacing { list, linear, logarithmic };
    Role role = Role::position;
    std::size_t index = 0;  // among the coordinates, or the parameters
    std::string name;       // as written: q, q', p_q, m[2]
    std::string written;    // its values as written: 0:3:1000
    Spacing spacing = Spacing::list;
    std::vector<GiNaC::numeric> given;
    std::vector<double> values;

    std::int64_t count() const { return std::ssize(values); }
    GiNaC::numeric exact(std::int64_t i) const;
};

// All combinations of the values; the last axis runs fastest.
class Grid {
public:
    // `arguments` of --vary: NAME=FROM:TO:COUNT, NAME=FROM:TO:COUNT:log or NAME=a,b,c. `scene` outlives the grid.
    // Throws InputError with the place in the argument.
    Grid(const Scene& scene, const std::vector<std::string>& arguments);

    const std::vector<Axis>& axes() const { return axes_; }
    std::int64_t count() const { return count_; }
    double value(std::int64_t trajectory, std::size_t axis) const;

    // Parameters, positions and rates of a trajectory; formulas of the scene that hold a varied parameter follow it.
    // What has no value is not a number. Thread-safe.
    void start(std::int64_t trajectory, EnsembleStart& start) const;

private:
    // An initial value that depends on a varied parameter.
    struct Dependent {
        bool position;
        std::size_t coordinate;
    };
    std::int64_t place(std::int64_t trajectory, std::size_t axis) const;
    void assemble(const std::vector<GiNaC::ex>& parameters, EnsembleStart& start) const;

    const Scene& scene_;
    std::vector<Axis> axes_;
    std::vector<std::int64_t> stride_;  // of each axis
    std::int64_t count_ = 1;
    EnsembleStart base_;
    std::vector<Dependent> dependents_;
    std::optional<System> assembled_;  // of a scene whose starts are moved onto its constraints
    mutable std::mutex algebra_;       // formulas are not made for several threads
};

}  // namespace lobatto
