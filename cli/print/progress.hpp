// SPDX-License-Identifier: GPL-2.0-or-later
// A progress bar for people who wait: only on a terminal, only after a second.
#pragma once

#include <cstdint>

#include "runtime/stopwatch.hpp"

namespace lobatto {

class Progress {
public:
    explicit Progress(std::int64_t total);
    ~Progress();  // leaves no trace on the terminal
    Progress(const Progress&) = delete;
    Progress& operator=(const Progress&) = delete;

    void show(std::int64_t done);

private:
    std::int64_t total_;
    bool on_terminal_;
    bool shown_ = false;
    Stopwatch watch_;
};

}  // namespace lobatto
