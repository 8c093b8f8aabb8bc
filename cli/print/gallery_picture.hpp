// SPDX-License-Identifier: GPL-2.0-or-later
// What to draw of a motion, told by the shape of its scene, as a gnuplot script.
#pragma once

#include <string>
#include <vector>

#include "cli/print/curves.hpp"
#include "generator/mechanics/derivation.hpp"

namespace lobatto {

// States of a motion, row by row: t, q[n], p[n].
struct MotionRows {
    int n = 0;
    std::vector<double> rows;
    std::size_t count() const { return rows.size() / static_cast<std::size_t>(1 + 2 * n); }
    double at(std::size_t row, int column) const {
        return rows[row * static_cast<std::size_t>(1 + 2 * n) + static_cast<std::size_t>(column)];
    }
    double time(std::size_t row) const { return at(row, 0); }
    double q(std::size_t row, int k) const { return at(row, 1 + k); }
    double p(std::size_t row, int k) const { return at(row, 1 + n + k); }
};

enum class Shape {
    strobe,     // bodies whose places the scene defines, joined as pendulums are, at some times
    phase,      // one coordinate: momentum over position
    path,       // bodies in the plane or in space: x and y (and z), alone or arrays of one length; or two coordinates
    polar,      // r and theta, the angle from the vertical
    sphere,     // theta, the angle from the axis, and phi around it
    waterfall,  // an array of many: its values over the index, at times one above the other
    series      // anything else: coordinates over time
};
Shape shape_of(const Scene& scene);

// `smaller`: motions from starts nearer to the middle, for the shape phase.
Picture picture_of(const Scene& scene, const MotionRows& states, const std::vector<MotionRows>& smaller);

}  // namespace lobatto
