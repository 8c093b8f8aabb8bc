// SPDX-License-Identifier: GPL-2.0-or-later
// The method and the step that keep a promise at the least cost, and the promise.
#pragma once

#include <functional>
#include <string>

#include "analysis/tradeoff/search.hpp"

namespace lobatto {

struct Choice {
    Measurement measurement;  // its error is the prediction
    double until = 0;
    std::string clock;           // as a scene has it; empty: none
    std::string reference;       // what it was compared with
    double uncertainty = 0;      // of that
    double frequency = 0;        // the largest of the motion
    double stability_limit = 0;  // of h times it; not a number where none is known: with clocks and constraints
    int members = 0;             // looked at
    bool complete = false;       // whether none of the others can be expected to be faster
    double seconds = 0;          // that the search took

    double step() const { return measurement.step; }
};

struct ChoiceRequest {
    double error = 0;  // the promise: the largest at any time, relative to the amplitude of the motion
    double seconds = 20;
    bool tries_clocks = true;  // else the scene's own steps only
    const volatile int* interrupted = nullptr;
    std::function<void(const std::string&)> say = [](const std::string&) {};
};

// ComputationError: the error cannot be kept, or nobody knows the motion that well; it says what can be promised.
// `written`: the scene as its file has it, which one kernel serves; `scene` with what the command line replaces.
Choice choose(const Scene& written, const Scene& scene, const ChoiceRequest& request);

}  // namespace lobatto
