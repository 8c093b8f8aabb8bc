// SPDX-License-Identifier: MIT
// The processor time of a thread, and how often a computation reports its progress.
#pragma once

#include <ctime>

namespace lobatto {

constexpr double progress_seconds = 0.1;  // between two reports

// Of this thread: other programs on the machine do not count.
inline double processor_seconds() {
    timespec now{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace lobatto
