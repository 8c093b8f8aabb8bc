// SPDX-License-Identifier: GPL-2.0-or-later
#include "cli/print/say.hpp"
#include "cli/print/tell.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>

namespace lobatto {

Say::Say() : on_terminal_(isatty(STDERR_FILENO) == 1) {}

void Say::operator()(const std::string& what) {
    if (!on_terminal_) return;
    shown_ = true;
    tell("\r\033[K{} ...", what);
    std::fflush(stderr);
}

void Say::clear() {
    if (shown_) tell("\r\033[K");
    shown_ = false;
}

}  // namespace lobatto
