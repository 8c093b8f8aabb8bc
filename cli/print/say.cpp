// SPDX-License-Identifier: GPL-2.0-or-later
#include "cli/print/say.hpp"
#include "cli/print/tell.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>

namespace lobatto {

Say::Say(double seconds)
    : on_terminal_(isatty(STDERR_FILENO) == 1), seconds_(seconds), start_(std::chrono::steady_clock::now()) {}

void Say::operator()(const std::string& what) {
    if (!on_terminal_) return;
    shown_ = true;
    const double left = seconds_ - std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
    tell("\r\033[K{} ...{}", what, seconds_ > 0 && left > 1 ? fmt::format(" ({:.0f} s left at most)", left) : "");
    std::fflush(stderr);
}

void Say::clear() {
    if (shown_) tell("\r\033[K");
    shown_ = false;
}

}  // namespace lobatto
