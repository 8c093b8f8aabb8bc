// SPDX-License-Identifier: GPL-2.0-or-later
// Random mechanisms as charts: places as functions of coordinates that are free, and the equations that such places
// keep. From a chart come two scenes of one system: places with constraints, and the free coordinates alone.
#pragma once

#include <fmt/format.h>
#include <ginac/ginac.h>

#include <cmath>
#include <random>
#include <regex>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

namespace lobatto::test {

// A parameter of a mechanism, between two values.
struct Range {
    std::string name;
    double low, high;
};

// Two scenes of one system, without their parameters, [method] and [run]. Both have the same curves under [view] plot.
struct Mechanism {
    std::string kind, constrained, minimal;
    std::vector<Range> ranges{};
    bool conserves = true, same_energy = true;  // the energy stays; that of both is the same
};

struct Place {
    std::string name, formula;  // in the free coordinates, parameters and t
};

struct Chart {
    std::vector<std::string> free{};
    std::vector<Place> places{};
    std::vector<std::string> constraints{};
    std::vector<Place> definitions{};  // of both scenes, in the places
    std::string lagrangian{};          // in the places
    std::vector<Place> forces{};       // on places
    std::string more{};                // of both scenes
    bool has_time = false;
};

// Formulas as text, their derivatives and their values at the start, where a free coordinate q is at a_q and moves with
// v_q.
class Calculus {
public:
    std::string slope(const std::string& formula, const std::string& variable) {
        return text(read(formula).diff(symbol(variable)));
    }
    std::string start(const std::string& formula, const std::vector<std::string>& free) {
        return text(at_start(read(formula), free));
    }
    std::string rate_at_start(const std::string& formula, const std::vector<std::string>& free) {
        const GiNaC::ex place = read(formula);
        GiNaC::ex rate = place.diff(symbol("t"));
        for (const std::string& q : free) rate += place.diff(symbol(q)) * symbol("v_" + q);
        return text(at_start(rate, free));
    }

private:
    GiNaC::ex read(const std::string& formula) { return reader_(formula); }
    GiNaC::symbol symbol(const std::string& name) { return GiNaC::ex_to<GiNaC::symbol>(reader_(name)); }
    GiNaC::ex at_start(GiNaC::ex value, const std::vector<std::string>& free) {
        for (const std::string& q : free) value = value.subs(symbol(q) == symbol("a_" + q));
        return value.subs(symbol("t") == 0);
    }
    static std::string text(const GiNaC::ex& value) {
        std::ostringstream out;
        out << value;
        return out.str();
    }
    GiNaC::parser reader_;
};

// "name = text" for each, as lines of a table.
inline std::string lines_of(const std::vector<Place>& places) {
    std::string text;
    for (const Place& place : places) text += fmt::format("{} = \"{}\"\n", place.name, place.formula);
    return text;
}
inline std::string table_of(const std::string& title, const std::string& lines) {
    return lines.empty() ? "" : "[" + title + "]\n" + lines;
}
inline std::string free_coordinates(const std::vector<std::string>& free) {
    std::string text;
    for (const std::string& q : free)
        text += fmt::format("{0} = {{ position = \"a_{0}\", velocity = \"v_{0}\" }}\n", q);
    return text;
}
inline std::string plot_of(const std::vector<std::string>& curves) {
    std::string text;
    for (const std::string& curve : curves) text += fmt::format("{}\"{}\"", text.empty() ? "" : ", ", curve);
    return "[view]\nplot = [" + text + "]\n";
}

inline Mechanism mechanism_of(const std::string& kind, const Chart& chart) {
    Calculus calculus;
    std::string coordinates, constraints, pulls;
    std::vector<std::string> curves;
    for (const Place& place : chart.places) {
        coordinates +=
            fmt::format("{} = {{ position = \"{}\", velocity = \"{}\" }}\n", place.name,
                        calculus.start(place.formula, chart.free), calculus.rate_at_start(place.formula, chart.free));
        curves.push_back(place.name);
        curves.push_back(place.name + "'");
    }
    for (std::size_t c = 0; c < chart.constraints.size(); ++c)
        constraints += fmt::format("hold{} = \"{}\"\n", c + 1, chart.constraints[c]);
    for (const std::string& q : chart.free) {  // of a force on places: its part along each free coordinate
        std::string pull;
        for (const Place& force : chart.forces)
            for (const Place& place : chart.places) {
                if (place.name != force.name) continue;
                const std::string slope = calculus.slope(place.formula, q);
                if (slope != "0") pull += fmt::format("{}({})*({})", pull.empty() ? "" : " + ", force.formula, slope);
            }
        if (!pull.empty()) pulls += fmt::format("{} = \"{}\"\n", q, pull);
    }
    const std::string head =
        fmt::format("{}lagrangian = \"{}\"\n", chart.has_time ? "time = \"t\"\n" : "", chart.lagrangian);
    std::vector<Place> definitions = chart.places;
    definitions.insert(definitions.end(), chart.definitions.begin(), chart.definitions.end());
    Mechanism made{kind, head, head};
    made.constrained += table_of("definitions", lines_of(chart.definitions)) + table_of("coordinates", coordinates) +
                        table_of("constraints", constraints) + table_of("forces", lines_of(chart.forces)) + chart.more +
                        plot_of(curves);
    made.minimal += table_of("definitions", lines_of(definitions)) +
                    table_of("coordinates", free_coordinates(chart.free)) + table_of("forces", pulls) + chart.more +
                    plot_of(curves);
    made.conserves = chart.forces.empty() && chart.more.empty() && !chart.has_time;
    made.same_energy = !chart.has_time;
    return made;
}

// Whole numbers and choices of one seed.
class Dice {
public:
    explicit Dice(std::uint64_t seed) : random_(seed) {}
    int whole(int low, int high) {  // std::uniform_int_distribution is not the same everywhere
        return low + static_cast<int>(random_() % static_cast<std::uint64_t>(high - low + 1));
    }
    bool one_in(int count) { return whole(1, count) == 1; }
    double uniform(double low, double high) {
        return std::round((low + (high - low) * static_cast<double>(random_() >> 11) * 0x1p-53) * 1e4) / 1e4;
    }
    template <class T>
    T any(const std::vector<T>& of) {
        return of[static_cast<std::size_t>(whole(0, static_cast<int>(of.size()) - 1))];
    }

private:
    std::mt19937_64 random_;
};

// Points of mass with constraints.
class ChartAuthor {
public:
    explicit ChartAuthor(std::uint64_t shape) : dice_(shape) {}

    Mechanism rods() {
        const int count = dice_.whole(1, 4);
        const bool is_chain = dice_.one_in(2), is_shaken = dice_.one_in(3), grows = dice_.one_in(4),
                   is_root = dice_.one_in(3);
        chart_.has_time = is_shaken || grows;
        const std::string grown = grows ? "*(1 + d*sin(w*t))" : "";
        std::vector<std::string> x{is_shaken ? "A*sin(w*t)" : "0"}, y{is_shaken ? "A*cos(w*t)/2" : "0"};
        std::vector<std::string> X = x, Y = y;  // the same in the names of places
        for (int i = 1; i <= count; ++i) {
            const auto parent = static_cast<std::size_t>(is_chain ? i - 1 : dice_.whole(0, i - 1));
            const std::string q = fmt::format("q{}", i), l = fmt::format("l{}{}", i, grown);
            chart_.free.push_back(q);
            x.push_back(fmt::format("{} + {}*sin({})", x[parent], l, q));
            y.push_back(fmt::format("{} - {}*cos({})", y[parent], l, q));
            X.push_back(fmt::format("X{}", i));
            Y.push_back(fmt::format("Y{}", i));
            chart_.places.push_back({X.back(), x.back()});
            chart_.places.push_back({Y.back(), y.back()});
            const std::string dx = fmt::format("{} - ({})", X.back(), X[parent]),
                              dy = fmt::format("{} - ({})", Y.back(), Y[parent]);
            chart_.constraints.push_back(is_root ? fmt::format("hypot({}, {}) = {}", dx, dy, l)
                                                 : fmt::format("({})^2 + ({})^2 = ({})^2", dx, dy, l));
            ranges_.push_back({"a_" + q, -3, 3});
            ranges_.push_back({"v_" + q, -1.5, 1.5});
            ranges_.push_back({fmt::format("l{}", i), 0.3, 1.5});
            add_point({X.back(), Y.back()});
        }
        return finish("rods");
    }

    // Beads on y = f(x), which may move, and on curves that close or wind.
    Mechanism curve() {
        const int count = dice_.whole(1, 2), form = dice_.whole(0, 7);
        const bool moves = form < 5 && dice_.one_in(3);
        chart_.has_time = moves || form == 7;
        const std::string lift = moves ? " + A*sin(w*t)" : "";
        const std::vector<std::string> graphs{"c*{0}^2", "c*sin(2*{0})", "c*{0}^3 - {0}", "exp(-c*{0}^2)",
                                              "c*cosh({0})"};
        for (int i = 1; i <= count; ++i) {
            const std::string u = fmt::format("q{}", i), X = fmt::format("X{}", i), Y = fmt::format("Y{}", i),
                              Z = fmt::format("Z{}", i);
            chart_.free.push_back(u);
            std::vector<std::string> point{X, Y};
            if (form < 5) {
                const std::string graph = graphs[static_cast<std::size_t>(form)] + lift;
                places({{X, u}, {Y, fmt::format(fmt::runtime(graph), u)}});
                const std::string right = fmt::format(fmt::runtime(graph), X);
                chart_.constraints.push_back(fmt::format("{} = {}", Y, right));
            } else if (form == 5) {
                places({{X, fmt::format("a*cos({})", u)}, {Y, fmt::format("b*sin({})", u)}});
                chart_.constraints.push_back(fmt::format("({}/a)^2 + ({}/b)^2 = 1", X, Y));
            } else if (form == 6) {  // a helix
                places(
                    {{X, fmt::format("a*cos({})", u)}, {Y, fmt::format("a*sin({})", u)}, {Z, fmt::format("c*{}", u)}});
                chart_.constraints.push_back(fmt::format("{} = a*cos({}/c)", X, Z));
                chart_.constraints.push_back(fmt::format("{} = a*sin({}/c)", Y, Z));
                point.push_back(Z);
            } else {  // a hoop that turns
                places({{X, fmt::format("a*sin({})*cos(w*t)", u)},
                        {Y, fmt::format("a*sin({})*sin(w*t)", u)},
                        {Z, fmt::format("-a*cos({})", u)}});
                chart_.constraints.push_back(fmt::format("{}^2 + {}^2 + {}^2 = a^2", X, Y, Z));
                chart_.constraints.push_back(fmt::format("{}*sin(w*t) = {}*cos(w*t)", X, Y));
                point.push_back(Z);
            }
            ranges_.push_back({"a_" + u, -1.2, 1.2});
            ranges_.push_back({"v_" + u, -1, 1});
            add_point(point);
        }
        return finish("curve");
    }

    Mechanism surface() {
        const int form = dice_.whole(0, 6), count = dice_.one_in(4) ? 2 : 1;
        const bool moves = form < 4 && dice_.one_in(3);
        chart_.has_time = moves;
        const std::vector<std::string> graphs{"c*{0}*{1}", "c*({0}^2 + {1}^2)/2", "c*sin({0})*cos({1})",
                                              "exp(-{0}^2 - {1}^2)"};
        for (int i = 1; i <= count; ++i) {
            const std::string u = fmt::format("q{}", i), v = fmt::format("s{}", i), X = fmt::format("X{}", i),
                              Y = fmt::format("Y{}", i), Z = fmt::format("Z{}", i);
            chart_.free.push_back(u);
            chart_.free.push_back(v);
            if (form < 4) {
                const std::string graph = graphs[static_cast<std::size_t>(form)] + (moves ? " + A*sin(w*t)" : "");
                places({{X, u}, {Y, v}, {Z, fmt::format(fmt::runtime(graph), u, v)}});
                chart_.constraints.push_back(fmt::format("{} = {}", Z, fmt::format(fmt::runtime(graph), X, Y)));
            } else if (form == 4) {
                places({{X, fmt::format("a*cos({0})*cos({1})", u, v)},
                        {Y, fmt::format("a*cos({0})*sin({1})", u, v)},
                        {Z, fmt::format("a*sin({0})", u)}});
                chart_.constraints.push_back(fmt::format("{}^2 + {}^2 + {}^2 = a^2", X, Y, Z));
            } else if (form == 5) {  // a torus
                places({{X, fmt::format("(2 + b*cos({0}))*cos({1})", u, v)},
                        {Y, fmt::format("(2 + b*cos({0}))*sin({1})", u, v)},
                        {Z, fmt::format("b*sin({0})", u)}});
                chart_.constraints.push_back(fmt::format("(sqrt({}^2 + {}^2) - 2)^2 + {}^2 = b^2", X, Y, Z));
            } else {  // a cone, away from its tip
                places({{X, fmt::format("(3 + {0})*cos({1})", u, v)},
                        {Y, fmt::format("(3 + {0})*sin({1})", u, v)},
                        {Z, fmt::format("c*(3 + {0})", u)}});
                chart_.constraints.push_back(fmt::format("{2}^2 = c^2*({0}^2 + {1}^2)", X, Y, Z));
            }
            for (const std::string& q : {u, v}) {
                ranges_.push_back({"a_" + q, -0.8, 0.8});
                ranges_.push_back({"v_" + q, -1, 1});
            }
            add_point({X, Y, Z});
        }
        return finish("surface");
    }

    // Linkages: four bars, five bars, a crank with a slider, a parallelogram, which has dead points; in points, or four
    // bars in three angles.
    Mechanism loop() {
        const int form = dice_.whole(0, 4);
        chart_.free = {"q1"};
        ranges_ = {{"a_q1", -3, 3}, {"v_q1", -2, 2}, {"a_q2", -0.5, 0.5}, {"v_q2", -1, 1}, {"r", 0.3, 0.9},
                   {"s", 0.3, 0.8}, {"l", 2.2, 3.2}, {"k", 2, 3},         {"f", 2, 3},     {"o", -0.5, 0.5}};
        const std::string px = "r*cos(q1)", py = "r*sin(q1)";
        if (form == 0) {  // P on the crank, S on a line
            places({{"X1", px}, {"Y1", py}, {"X2", "r*cos(q1) + sqrt(l^2 - (r*sin(q1) - o)^2)"}});
            chart_.constraints = {"X1^2 + Y1^2 = r^2", "(X2 - X1)^2 + (Y1 - o)^2 = l^2"};
            add_point({"X1", "Y1"});
            add_point({"X2"});
            return finish("loop");
        }
        if (form == 4) {
            places({{"X1", px}, {"Y1", py}, {"X2", "f + r*cos(q1)"}, {"Y2", py}});
            chart_.constraints = {"X1^2 + Y1^2 = r^2", "(X2 - X1)^2 + (Y2 - Y1)^2 = f^2", "(X2 - f)^2 + Y2^2 = r^2"};
            add_point({"X1", "Y1"});
            add_point({"X2", "Y2"});
            return finish("parallelogram");
        }
        // Q at the distances l from P and k from E: P + m (E - P) + n (E - P) turned by a right angle.
        const bool five = form == 1;
        const std::string ex = five ? "f + s*cos(q2)" : "f", ey = five ? "s*sin(q2)" : "0";
        const std::string dx = fmt::format("({} - {})", ex, px), dy = fmt::format("({} - {})", ey, py);
        const std::string dd = fmt::format("({0}^2 + {1}^2)", dx, dy),
                          m = fmt::format("((l^2 - k^2 + {0})/(2*{0}))", dd),
                          n = fmt::format("sqrt(l^2/{} - {}^2)", dd, m);
        const std::string qx = fmt::format("({} + {}*{} - {}*{})", px, m, dx, n, dy),
                          qy = fmt::format("({} + {}*{} + {}*{})", py, m, dy, n, dx);
        if (form == 3) {  // angles of crank, coupler and rocker
            places({{"A1", "q1"},
                    {"A2", fmt::format("2*atan(({} - {})/({} - {} + l))", qy, py, qx, px)},
                    {"A3", fmt::format("2*atan({}/({} - f + k))", qy, qx)}});
            chart_.constraints = {"r*cos(A1) + l*cos(A2) = f + k*cos(A3)", "r*sin(A1) + l*sin(A2) = k*sin(A3)"};
            chart_.definitions = {{"X", "r*cos(A1) + l/2*cos(A2)"}, {"Y", "r*sin(A1) + l/2*sin(A2)"}};
            chart_.lagrangian =
                "m1*r^2/3*A1'^2/2 + m2*(X'^2 + Y'^2)/2 + m2*l^2/12*A2'^2/2 + m1*k^2/3*A3'^2/2 - g*(m1*r/2*sin(A1) + "
                "m2*Y "
                "+ m1*k/2*sin(A3))";
            if (dice_.one_in(2)) chart_.forces = {{"A1", "-e*A1'"}, {"A3", "-e*A3'/2"}};
            return with_ranges("loop");
        }
        if (five) chart_.free.push_back("q2");
        places({{"X1", px}, {"Y1", py}, {"X2", qx}, {"Y2", qy}});
        chart_.constraints = {"X1^2 + Y1^2 = r^2", "(X2 - X1)^2 + (Y2 - Y1)^2 = l^2"};
        if (five) {
            places({{"X3", ex}, {"Y3", ey}});
            chart_.constraints.push_back("(X2 - X3)^2 + (Y2 - Y3)^2 = k^2");
            chart_.constraints.push_back("(X3 - f)^2 + Y3^2 = s^2");
        } else {
            chart_.constraints.push_back("(X2 - f)^2 + Y2^2 = k^2");
        }
        add_point({"X1", "Y1"});
        add_point({"X2", "Y2"});
        if (five) add_point({"X3", "Y3"});
        return finish("loop");
    }

private:
    void places(const std::vector<Place>& more) { chart_.places.insert(chart_.places.end(), more.begin(), more.end()); }
    void add_point(const std::vector<std::string>& point) { points_.push_back(point); }

    // Masses, weight, springs, magnetic terms, friction, drives.
    Mechanism finish(const std::string& kind) {
        const bool swells = dice_.one_in(4), is_damped = dice_.one_in(4), is_driven = dice_.one_in(5),
                   is_magnetic = dice_.one_in(4), is_dry = dice_.one_in(8), has_springs = dice_.one_in(2);
        std::string& L = chart_.lagrangian;
        for (std::size_t i = 0; i < points_.size(); ++i) {
            const std::vector<std::string>& point = points_[i];
            std::string square;
            for (const std::string& x : point) square += fmt::format("{}{}'^2", square.empty() ? "" : " + ", x);
            const std::string mass = i % 2 == 0 ? "m1" : "m2", high = point.back();
            L += fmt::format("{}{}*({}){}/2 - {}*g*{}", i == 0 ? "" : " + ", mass, square,
                             swells && i == 0 ? fmt::format("*(1 + e*{}^2)", high) : "", mass, high);
            if (is_magnetic && point.size() > 1 && i == 0)
                L += fmt::format(" + B*({0}*{1}' - {1}*{0}')/2", point[0], point[1]);
            if (has_springs) L += fmt::format(" - kappa*({} - 0.3)^2/2", point[0]);
            for (const std::string& x : point) {
                std::string force = is_damped ? fmt::format("-e*{}'", x) : "";
                if (is_driven && i == 0 && x == point[0]) {
                    force += (force.empty() ? "" : " + ") + std::string("B*cos(w*t)");
                    chart_.has_time = true;
                }
                if (is_dry && i == 0 && x == point[0])
                    force += fmt::format("{}-e*sign({}')", force.empty() ? "" : " + ", x);
                if (!force.empty()) chart_.forces.push_back({x, force});
            }
        }
        if (has_springs && points_.size() > 1 && points_[0].size() == points_[1].size()) {
            std::string square;
            for (std::size_t k = 0; k < points_[0].size(); ++k)
                square += fmt::format("{}({} - {})^2", k == 0 ? "" : " + ", points_[0][k], points_[1][k]);
            L += fmt::format(" - kappa*(sqrt(0.01 + {}) - 0.5)^2/2", square);
        }
        if (dice_.one_in(5))  // a wall
            chart_.more =
                fmt::format("[impacts]\nwall = {{ when = \"{} = -u falling\", restitution = \"c\" }}\n", points_[0][0]);
        return with_ranges(chart_.more.empty() ? kind : kind + ", wall");
    }
    Mechanism with_ranges(const std::string& kind) {
        Mechanism made = mechanism_of(kind, chart_);
        made.ranges = ranges_;
        for (const Range& range : general()) made.ranges.push_back(range);
        return made;
    }
    static std::vector<Range> general() {
        return {{"m1", 0.3, 3},  {"m2", 0.3, 3},  {"g", 0.5, 5},  {"kappa", 0.5, 10}, {"e", 0.1, 0.5},
                {"B", -1, 1},    {"A", 0.1, 0.5}, {"w", 1, 3},    {"d", 0.05, 0.3},   {"c", 0.3, 0.9},
                {"u", 0.1, 0.8}, {"a", 0.5, 2},   {"b", 0.4, 1.5}};
    }

    Dice dice_;
    Chart chart_;
    std::vector<Range> ranges_;
    std::vector<std::vector<std::string>> points_;
};

}  // namespace lobatto::test
