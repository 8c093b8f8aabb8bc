// SPDX-License-Identifier: MIT
// Seconds of a clock on the wall, since this was made.
#pragma once

#include <chrono>

namespace lobatto {

class Stopwatch {
public:
    double seconds() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }

private:
    using Clock = std::chrono::steady_clock;
    Clock::time_point start_ = Clock::now();
};

}  // namespace lobatto
