// SPDX-License-Identifier: GPL-2.0-or-later
#include "cli/print/say.hpp"
#include "cli/print/tell.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>

namespace lobatto {

Say::Say(double seconds) : on_terminal_(isatty(STDERR_FILENO) == 1), seconds_(seconds) {}

void Say::operator()(const std::string& what, double done) {
    if (!on_terminal_) return;
    shown_ = true;
    const double elapsed = watch_.seconds();
    std::string left;
    if (done > 0 && elapsed * (1 - done) > done)
        left = fmt::format(" (about {:.0f} s left)", elapsed * (1 - done) / done);
    else if (seconds_ - elapsed > 1)
        left = fmt::format(" ({:.0f} s left at most)", seconds_ - elapsed);
    tell("\r\033[K{} ...{}", what, left);
    std::fflush(stderr);
}

void Say::clear() {
    if (shown_) tell("\r\033[K");
    shown_ = false;
}

}  // namespace lobatto
