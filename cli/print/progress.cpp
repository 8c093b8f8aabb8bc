// SPDX-License-Identifier: GPL-2.0-or-later
#include "cli/print/progress.hpp"
#include "cli/print/tell.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <string>

namespace lobatto {

namespace {

std::string time_text(double seconds) {
    const long whole = std::lround(seconds);
    if (whole < 60) return fmt::format("{} s", whole);
    if (whole < 3600) return fmt::format("{} min {:02} s", whole / 60, whole % 60);
    return fmt::format("{} h {:02} min", whole / 3600, whole / 60 % 60);
}

}  // namespace

Progress::Progress(std::int64_t total) : total_(total), on_terminal_(isatty(STDERR_FILENO) == 1) {}

Progress::~Progress() {
    if (shown_) tell("\r\033[K");
}

void Progress::show(std::int64_t done) {
    const double elapsed = watch_.seconds();
    if (!on_terminal_ || elapsed < 1 || done <= 0) return;
    shown_ = true;
    constexpr int width = 40;
    const double fraction = static_cast<double>(done) / static_cast<double>(total_);
    const int filled = static_cast<int>(fraction * width);
    tell("\r\033[K[{:#<{}}{:.<{}}] {:3.0f} %, {} left", "", filled, "", width - filled, std::floor(fraction * 100),
         time_text(elapsed * (1 - fraction) / fraction));
    std::fflush(stderr);
}

}  // namespace lobatto
