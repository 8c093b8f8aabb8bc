// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/accuracy/companion/measured_error.hpp"

#include <fmt/format.h>

namespace lobatto {

std::string text_of(const MeasuredError& error, const Scene& scene) {
    const std::string chaos = error.doubling ? fmt::format("; errors double every {:.3g}", *error.doubling) : "";
    if (error.rests && error.is_lost()) return "not known: the run rests, and a start beside it leaves";
    if (error.companion_stopped && error.lost_after)
        return fmt::format("not known after t = {:.4g}, where the same run with 2/3 of the step stops",
                           *error.lost_after);
    if (error.lost_after)
        return fmt::format("as large as the motion itself from t = {:.4g} on{}", *error.lost_after, chaos);
    const std::string place = error.end_is_largest
                                  ? (error.complete ? "at most" : fmt::format("at most, to t = {:.4g}", error.until))
                              : error.complete ? "at the end"
                                               : fmt::format("at t = {:.4g}", error.until);
    std::string text = error.largest > 3 * error.end
                           ? fmt::format("{:.1e} of the amplitude at most; {} {:.1e}", error.largest, place, error.end)
                           : fmt::format("{:.1e} of the amplitude {}", error.end, place);
    const Coordinate& worst = scene.coordinates[error.coordinate];
    if (error.end > 0)
        text +=
            fmt::format(" ({:.1e}{} in {})", error.absolute, worst.unit.empty() ? "" : " " + worst.unit, worst.written);
    if (!error.complete) text += ", not measured beyond";
    if (!error.complete && error.is_known_at_end())
        text += fmt::format("; perhaps {:.0e} at the end", std::fmin(error.at_end, 1));
    return text + chaos;
}

std::string not_measured_at_end(const MeasuredError& error) {
    if (error.complete || error.is_lost() || !error.is_known_at_end()) return "";  // or others say so
    return fmt::format(
        "the error was measured only to t = {:.4g}, where it is {:.1e} of the amplitude; that at the end "
        "is extrapolated",
        error.until, error.end);
}

}  // namespace lobatto
