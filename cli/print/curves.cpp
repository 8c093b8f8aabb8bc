// SPDX-License-Identifier: GPL-2.0-or-later
#include "cli/print/curves.hpp"

#include <fmt/format.h>

#include <cmath>

#include "cli/print/drawing.hpp"

namespace lobatto {

namespace {

// Fewest points of a polyline that leave it where it is, up to `tolerance` (Ramer, Douglas and Peucker).
std::vector<Point> simplified(const std::vector<Point>& points, double tolerance) {
    if (points.size() < 3) return points;
    std::vector<bool> kept(points.size(), false);
    kept.front() = kept.back() = true;
    std::vector<std::pair<std::size_t, std::size_t>> open{{0, points.size() - 1}};
    while (!open.empty()) {
        const auto [first, last] = open.back();
        open.pop_back();
        const Point a = points[first], b = points[last];
        const double length = std::hypot(b.x - a.x, b.y - a.y);
        double farthest = tolerance;
        std::size_t place = 0;
        for (std::size_t i = first + 1; i < last; ++i) {
            const Point c = points[i];
            const double distance = length > 0
                                        ? std::fabs((b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x)) / length
                                        : std::hypot(c.x - a.x, c.y - a.y);
            // A curve that turns back beyond its end is no straight line.
            const double beyond =
                length > 0 ? std::max(0.0, std::hypot(c.x - (a.x + b.x) / 2, c.y - (a.y + b.y) / 2) - length / 2) : 0;
            if (std::max(distance, beyond) > farthest) {
                farthest = std::max(distance, beyond);
                place = i;
            }
        }
        if (place == 0) continue;
        kept[place] = true;
        open.emplace_back(first, place);
        open.emplace_back(place, last);
    }
    std::vector<Point> result;
    for (std::size_t i = 0; i < points.size(); ++i)
        if (kept[i]) result.push_back(points[i]);
    return result;
}

// Long curves cover themselves.
double line_width(std::size_t points) {
    return points > 3000 ? 0.8 : points > 1000 ? 1.2 : 1.8;
}

}  // namespace

Picture picture_of(const std::string& title, std::vector<Curve> curves, const Axes& axes, const std::string& caption) {
    Range x, y;
    for (const Curve& curve : curves)
        for (const Point& point : curve.points) {
            x.take(point.x);
            y.take(point.y);
        }
    x.widen(axes.y_is_time ? 0 : 0.05);
    y.widen(0.05);
    constexpr double left = 90, right = 25, top = 45, bottom = 100;
    double width = 560, height = 400;  // of the field
    if (axes.equal) {
        const double ratio = std::clamp(y.length() / x.length(), 0.2, 5.0);
        width = std::min(560.0, 520 / ratio);
        height = width * ratio;
        if (width < 320) {  // the caption needs room
            x.widen((320 / width - 1) / 2);
            width = 320;
        }
    } else if (axes.y_is_time) {
        height = 480;
    }
    const double per_x = width / x.length(), per_y = height / y.length();
    for (Curve& curve : curves)
        for (Point& point : curve.points) point = {(point.x - x.low) * per_x, (point.y - y.low) * per_y};
    std::vector<std::vector<Point>> thinned;
    std::size_t count = 0;
    for (const Curve& curve : curves) {
        thinned.push_back(simplified(curve.points, 0.12));  // pixels
        count += thinned.back().size();
    }

    Picture picture{caption, "", static_cast<int>(width + left + right), static_cast<int>(height + top + bottom),
                    count};
    const double page_width = picture.width, page_height = picture.height;
    std::string& script = picture.script;
    for (std::size_t i = 0; i < curves.size(); ++i) {
        script += fmt::format("$curve{} << END\n", i);
        for (const Point& point : thinned[i])
            script += fmt::format("{:.6g},{:.6g}\n", x.low + point.x / per_x, y.low + point.y / per_y);
        script += "END\n";
    }
    script += fmt::format(
        "unset key\nset lmargin at screen {:.6f}\nset rmargin at screen {:.6f}\nset bmargin at screen {:.6f}\nset "
        "tmargin at screen {:.6f}\n",
        left / page_width, 1 - right / page_width, bottom / page_height, 1 - top / page_height);
    script += fmt::format("set xrange [{:.9g}:{:.9g}]\nset yrange [{:.9g}:{:.9g}]\n", x.low, x.high, y.low, y.high);
    script += fmt::format("set label 1 {} at screen {:.6f},{:.6f} left noenhanced font ',17' tc rgb '#222222'\n",
                          gnuplot_text(title), 20 / page_width, 1 - 22 / page_height);
    script += fmt::format("set label 2 {} at screen {:.6f},{:.6f} left noenhanced font ',12' tc rgb '#666666'\n",
                          gnuplot_text(caption), 20 / page_width, 16 / page_height);
    const double middle_x = (left + width / 2) / page_width, middle_y = (bottom + height / 2) / page_height;
    script += fmt::format("set label 3 {} at screen {:.6f},{:.6f} center noenhanced\n", gnuplot_text(axes.x), middle_x,
                          44 / page_height);
    script += fmt::format("set label 4 {} at screen {:.6f},{:.6f} center rotate by 90 noenhanced\n",
                          gnuplot_text(axes.y), 22 / page_width, middle_y);
    script += "set xtics autofreq\nset ytics autofreq\n";
    std::string plot;
    for (std::size_t i = 0; i < curves.size(); ++i) {
        const Curve& curve = curves[i];
        plot += i == 0 ? "plot " : ", \\\n  ";
        if (curve.fill)
            plot += fmt::format("$curve{0} using 1:2 with filledcurves y1={1:.6g} fc rgb '#ffffff', ", i, y.low);
        plot += fmt::format("$curve{} using 1:2 with lines lw {:.3g} lc rgb '{}'", i,
                            curve.width > 0 ? curve.width : line_width(count), curve.colour);
    }
    for (std::size_t i = 0; i < curves.size(); ++i)
        if (curves[i].dot)
            plot += fmt::format(", \\\n  $curve{} using 1:2 every ::{} with points pt 7 ps 0.8 lc rgb '{}'", i,
                                thinned[i].size() - 1, curves[i].colour.substr(0, 7));
    script += plot + "\n";
    return picture;
}

}  // namespace lobatto
