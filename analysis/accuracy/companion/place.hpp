// SPDX-License-Identifier: GPL-2.0-or-later
// Where a companion is on its way, and its stepper. Vectors are numbers of the kernel, as sums of doubles.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "runtime/build/number_stepper.hpp"
#include "runtime/run/near_cuts.hpp"
#include "runtime/run/parts.hpp"
#include "runtime/run/trajectory.hpp"

namespace lobatto {

struct CompanionPlace {
    NumberStepper stepper;
    std::vector<double> time, step;  // step: zero before the first
    std::vector<double> q, p;
    Arrivals arrivals;
    lobatto_status status = LOBATTO_OK;
    NearCuts cuts = {};

    struct State {
        std::vector<double> time, step, q, p;
        std::string memory;  // of the stepper: a start may be refused where the motion goes on, as on a wall
        NearCuts cuts;
    };
    State before = {};  // the last step that was taken by itself
    State state() const { return {time, step, q, p, stepper.memory(), cuts}; }
    void go_back(const State& to) {
        time = to.time;
        step = to.step;
        q = to.q;
        p = to.p;
        stepper.restore(to.memory);
        cuts = to.cuts;
        status = LOBATTO_OK;
    }

    // q, p: all digits, and rounded to doubles.
    std::vector<double> row() const {
        std::vector<double> all = q;
        all.insert(all.end(), p.begin(), p.end());
        return all;
    }
    std::vector<double> rounded_row() const { return rounded(row(), stepper.parts()); }

    // Steps of another size begin at this place.
    void set_step(const std::vector<double>& size, const std::vector<double>& parameters) {
        if (size == step || status != LOBATTO_OK) return;
        status = stepper.prepare(parameters, size);
        if (status == LOBATTO_OK) status = stepper.start(time, q, p);
        step = size;
    }
    std::int64_t advance(std::int64_t steps, double tolerance) {
        lobatto_advance call{};
        call.steps = steps;
        call.tolerance = tolerance;
        call.interval = arrivals.interval;
        call.end = arrivals.end;
        cuts.ask(call);
        std::vector<double> none, nothing;
        if (status == LOBATTO_OK) status = stepper.advance(call, none, nothing);
        cuts.observe(call);
        stepper.state(time, q, p);
        return call.steps_done;
    }
};

}  // namespace lobatto
