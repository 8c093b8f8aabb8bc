// SPDX-License-Identifier: GPL-2.0-or-later
// Where a motion is between the states that a run kept of it.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "library/include/lobatto/lobatto.hpp"

namespace lobatto::api {

std::pair<std::vector<double>, std::vector<double>> states_at(Stepper stepper, const Trajectory& run,
                                                              const std::vector<double>& times) {
    const std::size_t n = stepper.coordinates();
    if (run.t.empty() || run.q.size() != run.t.size() * n || run.p.size() != run.t.size() * n)
        throw InputError("states_at: the trajectory is of another scene than the stepper, or empty");
    const double first = run.t.front(), last = run.t.back();
    const double rounding = 1e-12 * std::fmax(std::fabs(first), std::fabs(last));
    std::pair<std::vector<double>, std::vector<double>> states;
    const auto keep = [&](const Stepper& here) {
        states.first.insert(states.first.end(), here.q(), here.q() + n);
        const std::vector<double> velocity = here.velocity();
        states.second.insert(states.second.end(), velocity.begin(), velocity.end());
    };
    std::size_t begun = run.t.size();  // the row from which the stepper goes on
    for (const double time : times) {
        if (!(time >= first - rounding && time <= last + rounding))
            throw InputError(fmt::format("t = {:.9g} is outside the trajectory, which leads from {:.9g} to {:.9g}",
                                         time, first, last));
        auto from =
            static_cast<std::size_t>(std::upper_bound(run.t.begin(), run.t.end(), time + rounding) - run.t.begin() - 1);
        if (from + 1 < run.t.size()) from -= from % static_cast<std::size_t>(run.dense + 1);  // the last ends a step
        const bool is_row = time - run.t[from] <= rounding;
        if (begun != from || is_row || stepper.t() > time) {
            stepper.start(run.t[from], run.q.data() + from * n, run.p.data() + from * n);
            begun = from;
        }
        bool goes_on = !is_row;
        while (goes_on && stepper.next_time() <= time + rounding) goes_on = stepper.step();
        if (!goes_on || time - stepper.t() <= rounding) {
            keep(stepper);
        } else {
            Stepper inside = stepper;
            inside.advance_to(time);
            keep(inside);
        }
    }
    return states;
}

}  // namespace lobatto::api
