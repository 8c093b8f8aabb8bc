// SPDX-License-Identifier: GPL-2.0-or-later
#include "cli/plot/plot_script.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>
#include <utility>

#include "cli/print/drawing.hpp"
#include "generator/formula/text/source.hpp"
#include "runtime/error.hpp"
#include "runtime/run/output.hpp"

namespace lobatto {

namespace {

constexpr std::size_t most_points = 20000;  // of one curve: no screen shows more

// Okabe and Ito's colours, which stay apart for every eye.
const char* const colours[] = {"#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000", "#999999"};

struct Curve {
    std::vector<double> x, y;
    std::string title;
};

bool is_sorted(const std::vector<double>& x) {
    return std::is_sorted(x.begin(), x.end());
}

// Of many points over sorted x, of each short piece the first, the lowest and the highest: the outline stays. Of others
// every so many.
Curve thinned(const Curve& curve) {
    const std::size_t count = curve.x.size();
    if (count <= most_points) return curve;
    Curve thin;
    thin.title = curve.title;
    const auto take = [&](std::size_t i) {
        thin.x.push_back(curve.x[i]);
        thin.y.push_back(curve.y[i]);
    };
    const bool outline = is_sorted(curve.x);
    const std::size_t pieces = outline ? most_points / 3 : most_points;
    for (std::size_t piece = 0; piece < pieces; ++piece) {
        const std::size_t begin = piece * count / pieces, end = (piece + 1) * count / pieces;
        std::size_t low = begin, high = begin;
        for (std::size_t i = begin; outline && i < end; ++i) {
            if (!std::isfinite(curve.y[i])) continue;
            if (!std::isfinite(curve.y[low]) || curve.y[i] < curve.y[low]) low = i;
            if (!std::isfinite(curve.y[high]) || curve.y[i] > curve.y[high]) high = i;
        }
        take(begin);
        if (low != begin) take(std::min(low, high));
        if (high != begin && high != low) take(std::max(low, high));
    }
    take(count - 1);
    return thin;
}

// As a block of data; what is no finite number is a gap.
std::string block_of(const std::string& name, const Curve& curve) {
    std::string text = "$" + name + " << EOD\n";
    for (std::size_t i = 0; i < curve.x.size(); ++i) {
        if (std::isfinite(curve.x[i]) && std::isfinite(curve.y[i])) {
            append_number(text, curve.x[i]);
            text += ',';
            append_number(text, curve.y[i]);
        }
        text += '\n';
    }
    return text + "EOD\n";
}

std::string label_of(const NumberTable::Column& column) {
    return column.unit.empty() ? column.name : fmt::format("{} [{}]", column.name, column.unit);
}

// Whether a curve is flat but for its last digits, as an energy is: then its change is drawn.
bool is_flat(const NumberTable::Column& column) {
    const auto [low, high] = std::minmax_element(column.values.begin(), column.values.end());
    return *high > *low && *high - *low < 1e-3 * std::fabs(column.values.front());
}

std::vector<double> change_of(const std::vector<double>& values) {
    std::vector<double> changes;
    for (const double value : values) changes.push_back(value - values.front());
    return changes;
}

// x and y of one body, or both in one unit that is no angle: then a circle is to look like one.
bool are_lengths(const NumberTable::Column& x, const NumberTable::Column& y) {
    if (!x.unit.empty() || !y.unit.empty()) return x.unit == y.unit && x.unit != "rad";
    const auto is_axis = [](char c) { return c == 'x' || c == 'y' || c == 'z'; };
    return !x.name.empty() && !y.name.empty() && is_axis(x.name.front()) && is_axis(y.name.front()) &&
           x.name.substr(1) == y.name.substr(1) && x.name != y.name;
}

// From the least to the largest of the values that are numbers.
double extent_of(const NumberTable::Column& column) {
    double least = HUGE_VAL, most = -HUGE_VAL;
    for (const double value : column.values) {
        least = std::fmin(least, value);
        most = std::fmax(most, value);
    }
    return most - least;
}

bool is_seen(double value, bool log) {
    return std::isfinite(value) && (!log || value > 0);
}

// Rows of two numbers, and those of them that the axes can show.
std::pair<std::size_t, std::size_t> rows_and_seen(const NumberTable::Column& x, const NumberTable::Column& y,
                                                  const PlotRequest& request) {
    std::size_t rows = 0, seen = 0;
    for (std::size_t i = 0; i < x.values.size(); ++i) {
        if (is_seen(x.values[i], false) && is_seen(y.values[i], false)) ++rows;
        if (is_seen(x.values[i], request.log_x) && is_seen(y.values[i], request.log_y)) ++seen;
    }
    return {rows, seen};
}

// Something of a curve must be seen.
void refuse_empty(const NumberTable& table, const NumberTable::Column& x, const NumberTable::Column& y,
                  const PlotRequest& request) {
    if (rows_and_seen(x, y, request).second > 0) return;
    throw InputError(fmt::format("{}: nothing of {} over {} can be drawn: there is no row with two numbers{}",
                                 table.path, y.name, x.name,
                                 request.log_x || request.log_y ? " above 0, where an axis is logarithmic" : ""));
}

}  // namespace

std::vector<std::string> left_out(const std::vector<NumberTable>& tables, const PlotRequest& request) {
    std::vector<std::string> sentences;
    for (const NumberTable& table : tables)
        for (const std::vector<std::string>& panel : request.y)
            for (const std::string& name : panel) {
                const auto [rows, seen] = rows_and_seen(table.column(request.x), table.column(name), request);
                if (seen < rows)
                    sentences.push_back(
                        fmt::format("{}: {} of {} rows of {} over {} are not drawn: they are not above "
                                    "0, and an axis is logarithmic",
                                    table.path, rows - seen, rows, name, request.x));
            }
    return sentences;
}

std::string plot_script(const std::vector<NumberTable>& tables, const std::vector<NumberTable>& events,
                        const PlotRequest& request, bool in_colour) {
    std::string data, panels;
    std::size_t blocks = 0;
    const auto add = [&](Curve curve) {
        const std::string name = fmt::format("curve{}", ++blocks);
        data += block_of(name, thinned(curve));
        return name;
    };
    for (const std::vector<std::string>& panel : request.y) {
        const bool is_last = &panel == &request.y.back();
        const NumberTable::Column &first_x = tables.front().column(request.x),
                                  &first_y = tables.front().column(panel.front());
        const bool flat = panel.size() == 1 && !request.log_y && is_flat(first_y);
        std::string plotted;
        std::size_t colour = 0;
        for (std::size_t k = 0; k < tables.size(); ++k) {
            const NumberTable::Column& x = tables[k].column(request.x);
            for (const std::string& name : panel) {
                const NumberTable::Column& y = tables[k].column(name);
                refuse_empty(tables[k], x, y, request);
                std::string title = panel.size() > 1 ? y.name : "";
                if (tables.size() > 1)
                    title += (title.empty() ? "" : ", ") + std::filesystem::path(tables[k].path).stem().string();
                const char* const paint = colours[colour++ % std::size(colours)];
                const std::string style = request.points ? fmt::format("points pt 7 ps 0.35 lc rgb \"{}\"", paint)
                                                         : fmt::format("lines lw 1.6 lc rgb \"{}\"", paint);
                plotted += fmt::format("{}${} using 1:2 with {} {}", plotted.empty() ? "" : ", ",
                                       add({x.values, flat ? change_of(y.values) : y.values, title}),
                                       in_colour        ? style
                                       : request.points ? "points"
                                                        : "lines",
                                       title.empty() ? "notitle" : "title " + gnuplot_text(title));
                if (flat || k >= events.size() || !events[k].has(request.x) || !events[k].has(name)) continue;
                const NumberTable& marked = events[k];
                plotted += fmt::format(", ${} using 1:2 with points pt 6 ps 0.9 {} notitle",
                                       add({marked.column(request.x).values, marked.column(name).values, ""}),
                                       in_colour ? fmt::format("lw 1.4 lc rgb \"{}\"", paint) : "");
            }
        }
        // In a phase portrait of two lengths, and in no other picture, both axes have one scale.
        const bool equal = are_lengths(first_x, first_y) && !request.log_x && !request.log_y && in_colour;
        panels += equal ? "set size ratio -1\n" : "set size noratio\n";
        // Numbers beside one another need room: in a narrow picture they stand upright.
        panels += equal && extent_of(first_x) < 0.4 * extent_of(first_y) ? "set xtics rotate by 90 right\n"
                                                                         : "set xtics norotate\n";
        panels += request.y.size() > 1 && !is_last
                      ? "unset xlabel\nset format x \"\"\n"
                      : fmt::format("set xlabel {}\nset format x \"{}\"\n", gnuplot_text(label_of(first_x)),
                                    request.log_x ? "10^%T" : "%.5g");
        panels += fmt::format("set ylabel {}\nplot {}\n",
                              flat                ? gnuplot_text(fmt::format("{0} - {0}(0)", first_y.name))
                              : panel.size() == 1 ? gnuplot_text(label_of(first_y))
                                                  : "''",
                              plotted);
    }
    std::string head = in_colour ? "" : "unset grid\n";  // whose dots would be drawn as marks
    head += "set termoption noenhanced\nset key noenhanced\n";
    if (!request.log_y) head += "set format y \"%.5g\"\n";
    if (request.log_x) head += "set logscale x\nset format x \"10^%T\"\n";
    if (request.log_y) head += "set logscale y\nset format y \"10^%T\"\n";
    head += "set title " + gnuplot_text(tables.front().title) + "\n";
    if (request.y.size() == 1) return data + head + panels;
    std::string body = panels;
    // One title above all panels.
    const std::size_t begin = body.find("plot ");
    const std::size_t second = begin == std::string::npos ? 0 : body.find('\n', begin) + 1;
    body.insert(second, "unset title\n");
    return data + head +
           fmt::format(
               "set key at graph 1,1.02 right bottom horizontal maxrows 1\nset multiplot layout {},1 margins "
               "0.15,0.97,{},{} "
               "spacing 0,{}\n",
               request.y.size(), 0.28 / static_cast<double>(request.y.size()),
               1 - 0.2 / static_cast<double>(request.y.size()), 0.12 / static_cast<double>(request.y.size())) +
           body + "unset multiplot\n";
}

}  // namespace lobatto
