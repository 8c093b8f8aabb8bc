// SPDX-License-Identifier: GPL-2.0-or-later
// What can be varied in a sweep, and one name of it with many values.
#pragma once

#include <ginac/ginac.h>

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "generator/scene/scene.hpp"

namespace lobatto {

// A name that varies: of an initial value, a run-time parameter, or a setting of the method.
struct VariedName {
    enum class Role { position, rate, parameter, step, points, stages, splitting, tolerance };
    Role role = Role::position;
    std::size_t index = 0;  // among the coordinates, or the parameters
    std::string name;       // as written: q, q', p_q, m[2], step

    bool is_setting() const { return role >= Role::step; }
};

// Finds a name in a scene: x[3] and x_3 are the same; names of the scene come before those of settings. What is wrong
// with it goes to `fail`, which throws; `what` it is called there: "name", "column".
VariedName varied_name(const Scene& scene, const std::string& name, const std::string& what,
                       const std::function<void(const std::string&)>& fail);

// The values of one name: a list, or from `given[0]` to `given[1]`, both included.
struct Axis {
    enum class Spacing { list, linear, logarithmic };
    VariedName of;
    std::string written;  // its values as written: 0:3:1000
    Spacing spacing = Spacing::list;
    std::vector<GiNaC::numeric> given;
    std::int64_t count = 0;

    GiNaC::numeric exact(std::int64_t i) const;
};

// The values of an axis, rounded: computed a block at a time, when one of it is asked for. So each of the processes
// that share a sweep computes those of its own trajectories, and no others.
class AxisValues {
public:
    explicit AxisValues(Axis axis);
    const Axis& axis() const { return axis_; }
    // Thread-safe; `algebra` guards the exact values.
    double operator()(std::int64_t i, std::recursive_mutex& algebra) const;

private:
    static constexpr std::int64_t block_size = 1024;
    Axis axis_;
    mutable std::vector<std::unique_ptr<double[]>> blocks_;
    std::unique_ptr<std::atomic<const double*>[]> ready_;  // of them; null: not computed yet
};

// `argument` of --vary: NAME=FROM:TO:COUNT, NAME=FROM:TO:COUNT:log or NAME=a,b,c. Throws InputError with the place in
// the argument.
Axis read_axis(const Scene& scene, const std::string& argument);

}  // namespace lobatto
