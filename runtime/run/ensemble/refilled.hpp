// SPDX-License-Identifier: MIT
// Trajectories of an ensemble in lanes that are refilled: each ends at a time of its own, at a stop or where it fails,
// and every state of it may be looked at; or has a clock, and as many steps as it takes. The lanes themselves are
// runtime/kernel/steppers/refilled.hpp and clocked_lanes.hpp.
#pragma once

#include <memory>
#include <vector>

#include "runtime/build/library.hpp"
#include "runtime/run/ensemble/ended.hpp"
#include "runtime/run/ensemble/ensemble.hpp"

namespace lobatto {

class RefilledLanes {
public:
    RefilledLanes(const Kernel& kernel, const EnsembleRequest& request, Shared& shared);

    // Trajectories first, first + 1, ..., last - 1; without those from the first on that an interruption cut short.
    EndedTogether run(std::int64_t first, std::int64_t last);

private:
    struct Lane {
        std::int64_t trajectory = -1;   // its place in the group; -1: none
        LoadedStepper<double> stepper;  // with its parameters, for energies and velocities
        std::unique_ptr<Reducer> reducer;
        std::vector<double> last;  // the last good state: t, q, p
    };

    bool fill(std::size_t lane, std::int64_t number, Ended& ended);
    void advance(std::vector<Ended>& group);
    void look(std::size_t lane, Ended& ended);
    void look_at_arrivals(std::size_t lane, Ended& ended);
    void stop(Lane& lane, const double* row, Ended& ended) const;
    void keep(const Lane& lane, Ended& ended, const double* row, bool is_possible = true) const;
    double energy(const Lane& lane, const double* row) const;

    Kernel kernel_;
    const EnsembleRequest& request_;
    Shared& shared_;
    std::size_t n_;
    std::int64_t columns_, capacity_, event_capacity_;  // of rows
    AlignedMemory memory_;
    std::vector<Lane> lanes_;
    EnsembleStart start_;
    std::vector<double> records_, events_;
    std::vector<std::int32_t> status_;
    std::vector<std::int64_t> steps_done_, iterations_, events_written_, records_written_;
    Chunk chunk_;
};

}  // namespace lobatto
