// SPDX-License-Identifier: GPL-2.0-or-later
// The stability chart: the trace with its bounds, and the growth of a step, theory and measurement.
#include "analysis/stability/chart.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace lobatto {

namespace {

constexpr double least_rate = 1e-4, most_rate = 30;  // of the lower panel
constexpr int across = 600;                          // points of the curves

// The first point with an oscillation, of the highest frequency first.
const PointReport* drawn_point(const StabilityReport& report) {
    const PointReport* drawn = nullptr;
    for (const PointReport& point : report.points)
        if (point.modes && point.modes->back().z > 0 &&
            (drawn == nullptr || point.modes->back().z > drawn->modes->back().z))
            drawn = &point;
    return drawn;
}

double stiffness_of(const StabilityReport& report) {
    return report.trajectory ? report.trajectory->largest_z : 0;
}

// One oscillator as fast as the motion ever is; one of h omega = 1, not marked, where it has no frequencies at all.
std::vector<Mode> stiffest_moment(const StabilityReport& report) {
    return {{.z = stiffness_of(report) > 0 ? stiffness_of(report) : 1}};
}

double root_of(const RealRoot& root) {
    return std::sqrt(root.approximation(20).to_double());
}

std::string shade(double begin, double end, double bottom, double top) {
    return fmt::format(
        "set object rectangle from first {:.6g}, first {:.6g} to first {:.6g}, first {:.6g} fillcolor rgb \"#f6e0d4\" "
        "fillstyle solid noborder behind\n",
        begin, bottom, end, top);
}

}  // namespace

std::string stability_chart(const StabilityReport& report) {
    const PointReport* const point = drawn_point(report);
    const Stability& member = report.member;
    const std::vector<Mode> modes = point != nullptr ? *point->modes : stiffest_moment(report);
    const double highest = std::sqrt(modes.back().z);  // h omega of the fastest mode
    const double last = member.limits.empty() ? 4.0 * member.method.points : root_of(member.limits.back());
    const double right = std::max({1.12 * last, 1.2 * highest, 3.5});

    std::vector<double> limits;
    for (const RealRoot& limit : member.limits) limits.push_back(root_of(limit));
    limits.push_back(right);

    std::string trace, theory, measured, marks;
    const auto trace_at = [&](double x) {
        return member.trace(GiNaC::numeric(cln::rational(cln::cl_DF(x * x)))).to_double();
    };
    for (int i = 0; i <= across; ++i) {
        const double x = right * i / across;
        trace += fmt::format("{:.6g},{:.6g}\n", x, trace_at(x));
    }
    // The growth of the fastest mode, and where several have one, of all together: finer inside the gaps.
    const auto rate_at = [&](double x) { return largest_rate(report, modes, x / highest); };
    std::vector<double> places;
    for (int i = 1; i <= across; ++i) places.push_back(right * i / across);
    for (std::size_t k = 0; k + 1 < limits.size(); k += 2)
        for (int i = 0; i <= 40; ++i) {
            const double share = 0.5 - 0.5 * std::cos(i * 3.14159265358979 / 40);
            places.push_back(limits[k] + (limits[k + 1] - limits[k]) * share);
        }
    for (std::size_t k = 0; k + 1 < limits.size(); k += 2)  // the curves rise steeply from zero
        for (const double share : {1e-8, 1e-6, 1e-4, 1 - 1e-4, 1 - 1e-6, 1 - 1e-8})
            places.push_back(limits[k] + (limits[k + 1] - limits[k]) * share);
    std::sort(places.begin(), places.end());
    for (const double x : places) {
        const double rate = rate_at(x);
        theory += rate > 0 ? fmt::format("{:.10g},{:.6g}\n", x, rate) : std::string("\n");
    }
    const auto measure = [&](double x) {
        if (point == nullptr) return;
        const auto rate = measured_rate_at(report, point->q, report.step * x / highest);
        if (rate && rate->value > std::fmax(least_rate, rate->floor))
            measured += fmt::format("{:.10g},{:.6g}\n", x, rate->value);
    };
    for (int i = 1; i <= 60; ++i) measure(right * i / 60);
    for (std::size_t k = 0; k + 1 < limits.size(); k += 2)
        for (const double share : {0.1, 0.3, 0.5, 0.7, 0.9}) measure(limits[k] + (limits[k + 1] - limits[k]) * share);
    for (const Mode& mode : modes)
        if (mode.z > 0 && (point != nullptr || stiffness_of(report) > 0))
            marks += fmt::format("{:.6g},{:.6g}\n", std::sqrt(mode.z), trace_at(std::sqrt(mode.z)));

    std::string script = "$trace << END\n" + trace + "END\n$theory << END\n" + theory + "END\n$measured << END\n" +
                         (measured.empty() ? "-1,1\n" : measured) + "END\n$marks << END\n" +
                         (marks.empty() ? "-1,0\n" : marks) + "END\n";
    script += fmt::format(
        "set multiplot layout 2,1 margins 0.11,0.97,0.11,0.9 spacing 0,0.06\nset xrange [0:{:.6g}]\nset format x \"\"\n"
        "set key outside top center horizontal maxrows 1 reverse Left samplen 2 width 0\n"
        "set ylabel \"trace of a step\"\nset yrange [-3.2:3.2]\nset ytics 1\n",
        right);
    for (std::size_t k = 0; k + 1 < limits.size(); k += 2) script += shade(limits[k], limits[k + 1], -3.2, 3.2);
    script +=
        "plot 2 with lines lc rgb \"#444444\" lw 1.2 dt 2 title \"±2\", -2 with lines lc rgb \"#444444\" lw 1.2 dt 2 "
        "notitle, 2*cos(x) with lines ls 1 title \"exact motion\", $trace using 1:2 with lines ls 2 title \"" +
        member.method.name() + "\", $marks using 1:2 with points ls 4 ps 1.2 title \"this scene's h\"\n";
    script += fmt::format(
        "unset object\nset format x \"%g\"\nset xlabel \"hω{}\"\nset ylabel \"growth of a step, ln\"\nset logscale "
        "y\nset yrange [{:g}:{:g}]\nset ytics autofreq\nset format y \"10^{{%T}}\"\nset key inside top left vertical "
        "maxrows 2\n",
        modes.size() > 1 ? " of the fastest mode" : "", least_rate, most_rate);
    for (std::size_t k = 0; k + 1 < limits.size(); k += 2)
        script += shade(limits[k], limits[k + 1], least_rate, most_rate);
    script += "plot $theory using 1:2 with lines ls 2 title \"theory\"";
    if (point != nullptr) script += ", $measured using 1:2 with points ls 3 ps 0.8 title \"kernel, measured\"";
    script += "\nunset multiplot\n";
    return script;
}

}  // namespace lobatto
