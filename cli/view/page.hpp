// SPDX-License-Identifier: GPL-2.0-or-later
// Motions as one page of HTML that needs nothing else: the data of cli/view/page/page.js.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace lobatto {

// Numbers over the frames of a motion, or one number that stays.
using ViewChannel = std::vector<double>;

struct ViewFigure {
    std::string kind;                              // point, line, spring, circle
    std::vector<std::vector<std::size_t>> places;  // channels of each component
    int colour = 0;
    bool trail = false, closed = false, still = false, many = false;
    std::size_t radius = 0;  // channel, of circles
};

struct ViewCurve {
    std::string name;   // by which charts find it in each motion
    std::string label;  // with its unit
    std::size_t y = 0;  // channel
    bool is_over_time = true;
    std::size_t x = 0;  // else: channel
};

struct ViewEvent {
    double time;
    int kind;
};

struct ViewMotion {
    std::string label, note;
    std::vector<double> times;
    std::vector<ViewChannel> channels;
    std::vector<ViewFigure> figures;
    bool is_profile = false;  // the two axes are of different kinds
    std::vector<ViewCurve> curves;
    std::vector<ViewEvent> events;
    std::vector<std::string> event_names;
};

struct ViewChart {
    std::string title;                // "" where the curves say it
    std::vector<std::string> curves;  // names
    bool phase = false;
};

// `rate`: time of the motion that passes in a second.
std::string page_of(const std::string& title, const std::vector<ViewMotion>& motions,
                    const std::vector<ViewChart>& charts, double rate);

// So much time in a second that what swings fastest takes about two seconds to and fro.
double comfortable_rate(const std::vector<ViewMotion>& motions);

}  // namespace lobatto
