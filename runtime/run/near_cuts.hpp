// SPDX-License-Identifier: MIT
// Where walls and switches cut a motion twice within two steps. What lies between such cuts, as a short contact, is
// then one piece of a step, or two: of few nodes, and the same ones for steps of other sizes.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "runtime/kernel/abi.h"

namespace lobatto {

class NearCuts {
public:
    static constexpr double near = 2;       // steps
    static constexpr double one = 0x1p-20;  // of a step: cuts that are nearer are one, as when walls are met at once

    void set_step(double step) { least_ = one * std::fabs(step); }
    // A motion begins: what lies between its start and the first cut is such a piece, too.
    void begin(double time) {
        last_ = time;
        gap_ = std::numeric_limits<double>::infinity();
    }
    // Room for the cuts of a call of `advance`, which may then return early.
    void ask(lobatto_advance& call) {
        call.cuts = room_.data();
        call.cut_capacity = std::ssize(room_);
    }
    // The cuts of a call; those of all calls are told in the order of the motion.
    void observe(const lobatto_advance& call) {
        for (std::int64_t i = 0; i < call.cuts_written; ++i) observe(room_[static_cast<std::size_t>(i)]);
    }
    void observe(double time) {
        const double gap = std::fabs(time - last_);
        if (gap > least_ && gap < gap_) {
            gap_ = gap;
            middle_ = last_ + (time - last_) / 2;
        }
        last_ = time;
    }

    double last() const { return last_; }
    // The shortest time between two cuts, and its middle; infinite before the first cut.
    double gap() const { return gap_; }
    // The end of the motion counts as a cut, too.
    double gap_until(double end) const {
        NearCuts all = *this;
        all.observe(end);
        return all.gap_;
    }
    double middle() const { return middle_; }

private:
    std::array<double, std::size_t{2} * LOBATTO_CUTS_OF_STEP> room_{};
    double last_ = 0, least_ = 0, gap_ = std::numeric_limits<double>::infinity(), middle_ = 0;
};

}  // namespace lobatto
