// SPDX-License-Identifier: GPL-2.0-or-later
// Whether two walls were met at one time, with the motion on its way to both, at an angle in the metric of the kinetic
// energy for which their order counts (D52): the two corners of a box that falls flat. They act one after another, in
// the order of the scene, and no companion sees it, which keeps the order. At right angles it does not count, nor among
// walls that give all back at an angle of pi over a whole number (the equal balls of a cradle), nor where nothing is
// given back.
#pragma once

#include <string>
#include <vector>

#include "analysis/tape.hpp"
#include "generator/scene/scene.hpp"
#include "runtime/build/library.hpp"
#include "runtime/run/trajectory.hpp"

namespace lobatto {

class WallsTogether {
public:
    // The stepper is prepared.
    WallsTogether(const Scene& scene, const LoadedStepper<double>& stepper, const TrajectoryRequest& request);

    void observe(const EventRecords& records);
    // One sentence without full stop; empty: none were.
    std::string text() const;

    // Time and walls, for a run that goes on.
    std::vector<double> save() const { return found_; }
    void restore(const std::vector<double>& saved) { found_ = saved; }

private:
    struct Wall {
        std::string name;
        int direction;  // of the motion that meets it: -1 falling
        Tape value, restitution;
        std::vector<Tape> slope;  // by time, q
        double farthest;          // the largest value so far
        bool is_reset;            // whatever it does then is not judged
    };
    // Of a wall, where the motion is: its slope by t and q, its rate along the motion, and what an impulse along the
    // slope changes the velocity by.
    struct Push {
        double slope_t, rate;
        std::vector<double> slope, change;
        double rate_of(const std::vector<double>& velocity) const;
    };
    Push push_of(const Wall& wall, const std::vector<double>& variables, const double* row,
                 const std::vector<double>& velocity) const;
    bool touches(Wall& wall, const std::vector<double>& variables, const std::vector<double>& velocity) const;
    void look_at(const double* row);

    LoadedStepper<double> stepper_;
    std::vector<Wall> walls_;
    std::vector<double> parameters_;
    std::size_t n_, first_;  // the number of the first wall among all that is reported
    double step_;
    std::vector<double> found_;  // t and the two walls
};

}  // namespace lobatto
