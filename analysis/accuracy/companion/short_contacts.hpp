// SPDX-License-Identifier: GPL-2.0-or-later
// What lies between two cuts at walls and switches that are near to one another, as a contact that begins and ends
// within a step, or between a cut and the end of a step. In one piece of a step it has the same error in the run and in
// its companion; so the companion takes it in parts, where that matters.
#pragma once

#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

#include "analysis/accuracy/companion/place.hpp"
#include "analysis/accuracy/formulas/pulses.hpp"
#include "runtime/run/trajectory.hpp"

namespace lobatto {

class ShortContacts {
    static constexpr double nearly_whole = 0.999;  // of a step: all but rounding

public:
    // Of a companion for this request, which outlives this. Nothing is looked for in scenes without walls and switches.
    ShortContacts(bool is_cut, const TrajectoryRequest& request) : is_cut_(is_cut), request_(request) {}

    // False: steps are whole again, where parts of them cannot be taken.
    void set_divided(bool is_divided) { is_divided_ = is_divided; }
    bool is_sought() const { return is_cut_ && is_divided_; }
    bool is_any() const { return is_divided_ && !contacts_.empty(); }
    // Whether a step is too long for one that was met.
    bool is_near(double from, double step) const;

    // Around a step that is taken by itself, from place.before. Whether it met one that matters.
    void begin(CompanionPlace& place, double from) const;
    bool is_met(CompanionPlace& place, const std::vector<double>& step);
    // After a step that ends where one of the run does: what is left of it after a cut is then the same piece in both,
    // with the same error, however few derivatives the force has there. It is taken in two, where that matters.
    void divide_rest(CompanionPlace& place, const std::vector<double>& step) const;
    // Of the companion, where it is not divided.
    void set_whole_step(double size) { whole_step_ = std::fabs(size); }
    // The next whole step that nothing cuts tells again what halves of such steps change.
    void look_at_usual_change() { looks_at_usual_ = true; }

private:
    bool is_part(double step) const { return std::fabs(step) < nearly_whole * whole_step_; }
    bool is_notable(const std::vector<double>& change) const;
    std::optional<Pulse> found(CompanionPlace& place, const std::vector<double>& step) const;
    bool matters(CompanionPlace& place, const std::vector<double>& step, const Pulse& contact) const;
    std::vector<double> change_in_parts(CompanionPlace& place, const std::vector<double>& step, int steps,
                                        int parts) const;

    bool is_cut_;
    const TrajectoryRequest& request_;
    bool is_divided_ = true;
    std::vector<Pulse> contacts_;       // in the order of time
    std::vector<double> usual_change_;  // of q and p, where a step that nothing cuts is halved
    bool looks_at_usual_ = true;
    double whole_step_ = 0;
};

}  // namespace lobatto
