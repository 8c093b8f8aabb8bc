// SPDX-License-Identifier: GPL-2.0-or-later
// What is being done right now, on one line of the terminal that is written over; nothing where no one watches.
#pragma once

#include <string>

#include "runtime/stopwatch.hpp"

namespace lobatto {

class Say {
public:
    // `seconds`: that all may take, of which it tells how many are left; 0: not known.
    explicit Say(double seconds = 0);
    ~Say() { clear(); }
    Say(const Say&) = delete;
    Say& operator=(const Say&) = delete;

    // `done`: the part of all work that is behind, 0 where it is not known; tells about how long the rest takes.
    void operator()(const std::string& what, double done = 0);
    void clear();

private:
    bool on_terminal_;
    bool shown_ = false;
    double seconds_;
    Stopwatch watch_;
};

}  // namespace lobatto
