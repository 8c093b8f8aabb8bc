// SPDX-License-Identifier: GPL-2.0-or-later
// What is being done right now, on one line of the terminal that is written over; nothing where no one watches.
#pragma once

#include <string>

namespace lobatto {

class Say {
public:
    Say();
    ~Say() { clear(); }
    Say(const Say&) = delete;
    Say& operator=(const Say&) = delete;

    void operator()(const std::string& what);
    void clear();

private:
    bool on_terminal_;
    bool shown_ = false;
};

}  // namespace lobatto
