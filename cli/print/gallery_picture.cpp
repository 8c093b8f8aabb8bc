// SPDX-License-Identifier: GPL-2.0-or-later
// What to draw of a motion, told by the shape of its scene, as a gnuplot script.
#include "cli/print/gallery_picture.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "generator/mechanics/algebra/sample.hpp"

namespace lobatto {

namespace {

constexpr std::size_t most_points = 7000;  // of a picture: some 100 kB
constexpr std::size_t fewest_in_waterfall = 8, lines_in_waterfall = 48;
constexpr double pi = std::numbers::pi;
constexpr const char* colours[] = {"#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#444444"};

// The indices of the coordinates of a name: one, or the elements of an array.
std::vector<int> indices_of(const Scene& scene, const std::string& name) {
    std::vector<int> indices;
    for (std::size_t k = 0; k < scene.coordinates.size(); ++k) {
        const std::string& written = scene.coordinates[k].written;
        if (written == name || written.starts_with(name + "[")) indices.push_back(static_cast<int>(k));
    }
    return indices;
}

std::string label_of(const Coordinate& coordinate, const std::string& name) {
    return coordinate.unit.empty() ? name : fmt::format("{} [{}]", name, coordinate.unit);
}

std::string colour(std::size_t index) {
    return colours[index % std::size(colours)];
}

std::string span(const MotionRows& states) {
    return fmt::format("{:.6g}", states.time(states.count() - 1));
}

// The states of one turn around the middle of the motion, or all of them.
std::size_t one_turn(const MotionRows& states) {
    Range q, p;
    for (std::size_t i = 0; i < states.count(); ++i) {
        q.take(states.q(i, 0));
        p.take(states.p(i, 0));
    }
    const auto angle = [&](std::size_t i) {
        return std::atan2((states.p(i, 0) - (p.low + p.high) / 2) / p.length(),
                          (states.q(i, 0) - (q.low + q.high) / 2) / q.length());
    };
    double turned = 0;
    for (std::size_t i = 1; i < states.count(); ++i) {
        turned += std::remainder(angle(i) - angle(i - 1), 2 * pi);
        if (std::fabs(turned) > 2 * pi) return i + 1;
    }
    return states.count();
}

Picture phase(const Scene& scene, const MotionRows& states, const std::vector<MotionRows>& smaller) {
    const auto curve = [](const MotionRows& of, std::size_t count, const std::string& in, double width) {
        Curve result{{}, in, width};
        for (std::size_t i = 0; i < count; ++i) result.points.push_back({of.q(i, 0), of.p(i, 0)});
        return result;
    };
    const Coordinate& q = scene.coordinates.front();
    const Axes axes{label_of(q, q.name), "momentum p_" + q.name};
    if (smaller.empty())
        return picture_of(scene.title, {curve(states, states.count(), colour(0), 0)}, axes,
                          fmt::format("Momentum over position, from t = {:.4g} to t = {:.4g}.", states.time(0),
                                      states.time(states.count() - 1)));
    std::vector<Curve> curves;
    for (const MotionRows& one : smaller) curves.push_back(curve(one, one_turn(one), "#8fc1de", 1.4));
    curves.push_back(curve(states, one_turn(states), colour(1), 2.2));
    return picture_of(scene.title, curves, axes,
                      "Momentum over position: the scene's motion (orange) and smaller ones.");
}

struct Bodies {
    std::vector<int> x, y, z;
};

std::optional<Bodies> bodies_of(const Scene& scene) {
    Bodies bodies{indices_of(scene, "x"), indices_of(scene, "y"), indices_of(scene, "z")};
    const std::size_t count = bodies.x.size();
    const bool plane = count > 0 && bodies.y.size() == count && bodies.z.empty();
    const bool space = count > 0 && bodies.y.size() == count && bodies.z.size() == count;
    if (!(plane && scene.coordinates.size() == 2 * count) && !(space && scene.coordinates.size() == 3 * count))
        return std::nullopt;
    return bodies;
}

Picture path(const Scene& scene, const MotionRows& states) {
    const auto bodies = bodies_of(scene);
    std::vector<Curve> curves;
    if (!bodies) {
        Curve curve{{}, colour(0), 0, true};
        for (std::size_t i = 0; i < states.count(); ++i) curve.points.push_back({states.q(i, 0), states.q(i, 1)});
        const Coordinate &a = scene.coordinates[0], &b = scene.coordinates[1];
        return picture_of(scene.title, {curve}, {label_of(a, a.written), label_of(b, b.written), a.unit == b.unit},
                          fmt::format("{} over {}, to t = {}.", b.written, a.written, span(states)));
    }
    // Bodies in space are seen along the direction in which they move least.
    std::array<std::pair<std::string, std::vector<int>>, 3> axes{
        {{"x", bodies->x}, {"y", bodies->y}, {"z", bodies->z}}};
    std::string along;
    if (!bodies->z.empty()) {
        const auto extent = [&](const std::vector<int>& of) {
            Range range;
            for (std::size_t i = 0; i < states.count(); ++i)
                for (const int k : of) range.take(states.q(i, k));
            return range.length();
        };
        const auto least = std::min_element(axes.begin(), axes.end(), [&](const auto& a, const auto& b) {
            return extent(a.second) < extent(b.second);
        });
        along = ", seen along " + least->first;
        std::rotate(least, least + 1, axes.end());
    }
    for (std::size_t b = 0; b < bodies->x.size(); ++b) {
        Curve curve{{}, colour(b), 0, true};
        for (std::size_t i = 0; i < states.count(); ++i)
            curve.points.push_back({states.q(i, axes[0].second[b]), states.q(i, axes[1].second[b])});
        curves.push_back(curve);
    }
    const Coordinate& first = scene.coordinates.front();
    return picture_of(
        scene.title, curves, {label_of(first, axes[0].first), label_of(first, axes[1].first), true},
        fmt::format("The {}{}, to t = {}.", curves.size() == 1 ? "orbit" : "orbits", along, span(states)));
}

// Rods from the origin to each body in turn at equal times, the older the paler, and the path of the last body; until
// that is some three times as long as the picture is wide.
Picture strobe(const Scene& scene, const MotionRows& states) {
    Formulas formulas;
    for (const Parameter& parameter : scene.parameters)
        formulas.set(parameter.symbol, float_of(scene.evaluate(parameter.value, "the parameter " + parameter.name)));
    const auto set_state = [&](std::size_t row) {
        formulas.set(scene.time, states.time(row));
        for (int k = 0; k < states.n; ++k)
            formulas.set(scene.coordinates[static_cast<std::size_t>(k)].position, states.q(row, k));
    };
    set_state(0);
    std::vector<GiNaC::ex> values;
    for (const auto& [x, y] : scene.places) {
        values.push_back(x);
        values.push_back(y);
    }
    const std::vector<Id> roots = formulas.convert(values);
    const auto bodies = [&](std::size_t row) {
        set_state(row);
        const std::vector<cln::cl_R> numbers = formulas.evaluate(roots);
        std::vector<Point> points;
        for (std::size_t i = 0; i < numbers.size(); i += 2)
            points.push_back({cln::double_approx(numbers[i]), cln::double_approx(numbers[i + 1])});
        return points;
    };
    constexpr std::size_t rods = 28, most_states = 2000;
    const std::size_t stride = std::max<std::size_t>(1, states.count() / most_states);
    Curve trail{{}, colour(1), 1.6, true};
    double reach = 0, length = 0;
    std::size_t last = 0;  // row
    for (std::size_t row = 0; row < states.count() && length <= 6 * reach; row += stride) {
        const Point end = bodies(row).back();
        reach = std::max(reach, std::hypot(end.x, end.y));
        if (row > 0) length += std::hypot(end.x - trail.points.back().x, end.y - trail.points.back().y);
        trail.points.push_back(end);
        last = row;
    }
    std::vector<Curve> curves;
    for (std::size_t i = 0; i < rods; ++i) {
        const std::size_t row = i * last / (rods - 1);
        const double pale = 0.85 * (1 - static_cast<double>(i) / (rods - 1));
        const auto mix = [&](int full) { return full + static_cast<int>(pale * (255 - full)); };
        Curve curve{
            {{0, 0}}, fmt::format("#{:02x}{:02x}{:02x}", mix(0), mix(114), mix(178)), i + 1 == rods ? 2.2 : 1.2};
        for (const Point& body : bodies(row)) curve.points.push_back(body);
        curves.push_back(curve);
    }
    curves.push_back(trail);
    return picture_of(scene.title, curves, {"x", "y", true},
                      fmt::format("{} pictures, to t = {:.3g}, and the path of the {} (orange).", rods,
                                  states.time(last), scene.places.size() == 1 ? "bob" : "last bob"));
}

Picture polar(const Scene& scene, const MotionRows& states) {
    const int r = indices_of(scene, "r").front(), theta = indices_of(scene, "theta").front();
    Curve curve{{}, colour(0), 0, true};
    for (std::size_t i = 0; i < states.count(); ++i)
        curve.points.push_back(
            {states.q(i, r) * std::sin(states.q(i, theta)), -states.q(i, r) * std::cos(states.q(i, theta))});
    const Coordinate& radius = scene.coordinates[static_cast<std::size_t>(r)];
    return picture_of(scene.title, {curve}, {label_of(radius, "r sin(theta)"), label_of(radius, "-r cos(theta)"), true},
                      fmt::format("The path in the plane, to t = {}.", span(states)));
}

// Whether the potential energy is lower at theta = 0: then that is the lowest point.
bool hangs(const Scene& scene, const Coordinate& theta) {
    Formulas formulas;
    for (const Parameter& parameter : scene.parameters)
        formulas.set(parameter.symbol, float_of(scene.evaluate(parameter.value, "the parameter " + parameter.name)));
    formulas.set(scene.time, 0);
    for (const Coordinate& coordinate : scene.coordinates) {
        formulas.set(coordinate.position, 0);
        formulas.set(coordinate.velocity, 0);
    }
    const auto L_at = [&](const cln::cl_R& angle) {
        formulas.set(theta.position, angle);
        return formulas({scene.lagrangian}).front();
    };
    return L_at(cln::cl_RA("1/10")) > L_at(3);
}

// Seen from 20 degrees above the equator; what lies behind is paler.
Picture sphere(const Scene& scene, const MotionRows& states) {
    const int theta = indices_of(scene, "theta").front(), phi = indices_of(scene, "phi").front();
    const double lift = pi / 9, up = hangs(scene, scene.coordinates[static_cast<std::size_t>(theta)]) ? -1 : 1;
    struct Place {
        Point point;
        bool front;
    };
    const auto place = [&](double polar, double around) {
        const double height = up * std::cos(polar), toward = -std::sin(polar) * std::sin(around);
        return Place{{std::sin(polar) * std::cos(around), height * std::cos(lift) - toward * std::sin(lift)},
                     height * std::sin(lift) + toward * std::cos(lift) >= 0};
    };
    std::vector<Curve> curves{{{}, "#bbbbbb", 1}, {{}, "#dddddd", 1}};
    for (int i = 0; i <= 180; ++i) {
        curves[0].points.push_back({std::cos(i * pi / 90), std::sin(i * pi / 90)});
        curves[1].points.push_back(place(pi / 2, i * pi / 90).point);
    }
    std::vector<Curve> behind, before;
    bool front = false;
    for (std::size_t i = 0; i < states.count(); ++i) {
        const Place here = place(states.q(i, theta), states.q(i, phi));
        if (i == 0 || here.front != front) {
            if (i > 0) (front ? before : behind).back().points.push_back(here.point);
            front = here.front;
            (front ? before : behind).push_back({{}, front ? colour(0) : "#a9cfe5"});
        }
        (front ? before : behind).back().points.push_back(here.point);
    }
    (front ? before : behind).back().dot = true;
    curves.insert(curves.end(), behind.begin(), behind.end());
    curves.insert(curves.end(), before.begin(), before.end());
    return picture_of(scene.title, curves, {"", "", true},
                      fmt::format("The path on the sphere, to t = {}; paler behind it.", span(states)));
}

// The longest array.
std::vector<int> longest_array(const Scene& scene) {
    std::vector<int> longest;
    for (const Coordinate& coordinate : scene.coordinates)
        if (const std::vector<int> array = indices_of(scene, coordinate.array()); array.size() > longest.size())
            longest = array;
    return longest;
}

Picture waterfall(const Scene& scene, const MotionRows& states) {
    const std::vector<int> array = longest_array(scene);
    const std::size_t count = states.count();
    const std::size_t lines = std::min<std::size_t>(lines_in_waterfall, count);
    Range values;
    for (std::size_t i = 0; i < count; ++i)
        for (const int k : array) values.take(states.q(i, k));
    double squares = 0;
    for (std::size_t i = 0; i < count; ++i)
        for (const int k : array) squares += states.q(i, k) * states.q(i, k);
    const double usual = std::sqrt(squares / static_cast<double>(count * array.size())) / values.length();
    // Where all swing at once the first states are followed one by one; a few crests may travel the whole time, and
    // overlap.
    const bool swing = usual > 0.14;
    const std::size_t last = swing ? lines - 1 : count - 1;
    const double between = states.time(last) / static_cast<double>(lines);
    const double scale = 4 * between / values.length();
    std::vector<Curve> curves;
    for (std::size_t line = lines; line-- > 0;) {  // the last one first: earlier ones stand before it
        const std::size_t row = lines > 1 ? line * last / (lines - 1) : 0;
        const double share = static_cast<double>(line) / static_cast<double>(lines);
        Curve curve{{},
                    fmt::format("#{:02x}{:02x}{:02x}", static_cast<int>(213 * share),
                                static_cast<int>(114 - 20 * share), static_cast<int>(178 * (1 - share))),
                    1.2};
        curve.fill = true;
        for (std::size_t k = 0; k < array.size(); ++k)
            curve.points.push_back({static_cast<double>(k + 1), states.time(row) + scale * states.q(row, array[k])});
        curves.push_back(curve);
    }
    const std::string name = scene.coordinates[static_cast<std::size_t>(array.front())].array();
    Axes axes{"index i", "time t"};
    axes.y_is_time = true;
    return picture_of(scene.title, curves, axes, fmt::format("{}[i] at {} times, one above the other.", name, lines));
}

Picture series(const Scene& scene, const MotionRows& states) {
    std::vector<Curve> curves;
    const int shown = std::min<int>(states.n, static_cast<int>(std::size(colours)));
    std::string names;
    std::vector<std::string> units;
    for (int k = 0; k < shown; ++k) {
        const std::string& unit = scene.coordinates[static_cast<std::size_t>(k)].unit;
        if (!unit.empty() && std::find(units.begin(), units.end(), unit) == units.end()) units.push_back(unit);
        Curve curve{{}, colour(static_cast<std::size_t>(k)), 1.4};
        for (std::size_t i = 0; i < states.count(); ++i) curve.points.push_back({states.time(i), states.q(i, k)});
        curves.push_back(curve);
        names += (k == 0 ? "" : ", ") + scene.coordinates[static_cast<std::size_t>(k)].written;
    }
    const std::string label = units.empty() ? "coordinates" : fmt::format("coordinates [{}]", fmt::join(units, ", "));
    return picture_of(scene.title, curves, {"time t", label}, names + " over time.");
}

}  // namespace

Shape shape_of(const Scene& scene) {
    const auto only = [&](const std::vector<std::string>& names) {
        return std::all_of(names.begin(), names.end(),
                           [&](const std::string& name) { return indices_of(scene, name).size() == 1; });
    };
    const std::size_t n = scene.coordinates.size();
    if (!scene.places.empty()) return Shape::strobe;
    if (n == 1) return Shape::phase;
    if (bodies_of(scene)) return Shape::path;
    if (n == 2 && only({"r", "theta"})) return Shape::polar;
    if (n <= 3 && only({"theta", "phi"})) return Shape::sphere;
    if (longest_array(scene).size() >= fewest_in_waterfall) return Shape::waterfall;
    return n == 2 ? Shape::path : Shape::series;
}

namespace {

Picture picture_as(Shape shape, const Scene& scene, const MotionRows& states, const std::vector<MotionRows>& smaller) {
    switch (shape) {
        case Shape::strobe:
            return strobe(scene, states);
        case Shape::phase:
            return phase(scene, states, smaller);
        case Shape::path:
            return path(scene, states);
        case Shape::polar:
            return polar(scene, states);
        case Shape::sphere:
            return sphere(scene, states);
        case Shape::waterfall:
            return waterfall(scene, states);
        case Shape::series:
            return series(scene, states);
    }
    throw std::logic_error("picture_as: no such shape");
}

}  // namespace

Picture picture_of(const Scene& scene, const MotionRows& states, const std::vector<MotionRows>& smaller) {
    const Shape shape = shape_of(scene);
    const bool bodies = shape == Shape::path && scene.coordinates.size() > 3;
    const std::size_t budget = bodies || shape == Shape::strobe || shape == Shape::waterfall ? most_points
                               : shape == Shape::series                                      ? 1800
                               : shape == Shape::phase                                       ? 3000
                                                                                             : 4500;
    // Of a motion too long for a picture its end is cut off; of a driven one, which settles, the beginning.
    MotionRows shown = states;
    const auto row = static_cast<std::ptrdiff_t>(1 + 2 * states.n);
    while (true) {
        Picture picture = picture_as(shape, scene, shown, smaller);
        if (picture.points <= budget || shown.count() < 100) return picture;
        const auto cut = static_cast<std::ptrdiff_t>(shown.count() / 5);
        if (shape == Shape::phase)
            shown.rows.erase(shown.rows.begin(), shown.rows.begin() + cut * row);
        else
            shown.rows.erase(shown.rows.end() - cut * row, shown.rows.end());
    }
}

}  // namespace lobatto
