// SPDX-License-Identifier: GPL-2.0-or-later
#include "cli/view/figures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "generator/scene/time_coordinate.hpp"

namespace lobatto {

namespace {

using GiNaC::ex;
using Place = std::vector<ex>;

constexpr std::size_t profile_from = 8;  // elements of an array
constexpr double hand_distance = 2.4;    // of the pivots of hands of length 1

const ex zero = 0;

DrawnFigure point(const Place& place, int colour, bool trail = true) {
    DrawnFigure drawn{{}, colour};
    drawn.figure.kind = MovingFigure::Kind::point;
    drawn.figure.corners = {place};
    drawn.figure.trail = trail;
    return drawn;
}

DrawnFigure line(const std::vector<Place>& places, int colour = 0, bool closed = false) {
    DrawnFigure drawn{{}, colour};
    drawn.figure.kind = MovingFigure::Kind::line;
    drawn.figure.corners = places;
    drawn.figure.closed = closed;
    return drawn;
}

bool moves(const Scene& scene, const ex& formula) {
    return formula.has(scene.time) ||
           std::any_of(scene.coordinates.begin(), scene.coordinates.end(),
                       [&](const Coordinate& c) { return formula.has(c.position) || formula.has(c.velocity); });
}

// The coordinates of a name: one, or the elements of an array.
std::vector<ex> named(const Scene& scene, const std::string& name) {
    std::vector<std::pair<const Coordinate*, ex>> all;
    for (const Coordinate& coordinate : scene.coordinates) all.emplace_back(&coordinate, coordinate.position);
    for (const Eliminated& x : scene.eliminated)  // in the order of the file
        all.insert(all.begin() + static_cast<std::ptrdiff_t>(x.declared), {&x.coordinate, x.position});
    std::vector<ex> found;
    for (const auto& [coordinate, position] : all)
        if (coordinate->written == name || coordinate->written.starts_with(name + "[")) found.push_back(position);
    return found;
}

// The bodies of x and y, and z.
std::vector<Place> bodies_of_names(const Scene& scene) {
    const std::vector<ex> x = named(scene, "x"), y = named(scene, "y"), z = named(scene, "z");
    if (x.empty() || x.size() != y.size() || (!z.empty() && z.size() != x.size())) return {};
    std::vector<Place> bodies;
    for (std::size_t i = 0; i < x.size(); ++i) {
        bodies.push_back({x[i], y[i]});
        if (!z.empty()) bodies.back().push_back(z[i]);
    }
    return bodies;
}

// Without eliminated coordinates.
bool is_free(const Place& body) {
    return std::all_of(body.begin(), body.end(),
                       [](const ex& component) { return GiNaC::is_a<GiNaC::symbol>(component); });
}

// (a - b)^2 = l^2 of two bodies, or of a body and a place that is fixed: a line between them.
std::vector<DrawnFigure> rods_of(const Scene& scene, const std::vector<Place>& bodies) {
    std::vector<DrawnFigure> rods;
    for (const Constraint& constraint : scene.constraints) {
        std::vector<std::size_t> joined;
        for (std::size_t i = 0; i < bodies.size(); ++i)
            if (is_free(bodies[i]) && std::any_of(bodies[i].begin(), bodies[i].end(),
                                                  [&](const ex& component) { return constraint.value.has(component); }))
                joined.push_back(i);
        if (joined.empty() || joined.size() > 2) continue;
        const Place& one = bodies[joined.front()];
        Place other;
        for (const ex& component : one)
            other.push_back((component - constraint.value.diff(GiNaC::ex_to<GiNaC::symbol>(component)) / 2).expand());
        const auto is_other = [&](const Place& body) {
            return std::equal(other.begin(), other.end(), body.begin(), body.end(),
                              [](const ex& a, const ex& b) { return a.is_equal(b); });
        };
        const bool is_rod = joined.size() == 2 ? is_other(bodies[joined.back()])
                                               : std::none_of(other.begin(), other.end(),
                                                              [&](const ex& part) { return moves(scene, part); }) ||
                                                     std::any_of(bodies.begin(), bodies.end(), is_other);
        if (is_rod) rods.push_back(line({other, one}));
        if (is_rod && joined.size() == 1) {
            rods.push_back(point(other, 0, false));
            rods.back().still = true;
        }
    }
    return rods;
}

void add(std::vector<DrawnFigure>& all, const std::vector<DrawnFigure>& more) {
    all.insert(all.end(), more.begin(), more.end());
}

std::vector<DrawnFigure> free_bodies(const Scene& scene, const std::vector<Place>& bodies) {
    std::vector<DrawnFigure> drawn = rods_of(scene, bodies);
    for (std::size_t i = 0; i < bodies.size(); ++i) {
        drawn.push_back(point(bodies[i], static_cast<int>(i)));
        drawn.back().many = bodies.size() > 4;
    }
    return drawn;
}

// Joined from the origin on, as pendulums are.
std::vector<DrawnFigure> defined_places(const Scene& scene) {
    std::vector<Place> places{{zero, zero}};
    for (const auto& [x, y] : scene.places) places.push_back({x, y});
    std::vector<DrawnFigure> drawn{line(places)};
    for (std::size_t i = 1; i < places.size(); ++i) {
        drawn.push_back(point(places[i], static_cast<int>(i - 1), i + 1 == places.size()));
        drawn.back().many = places.size() > 5;
    }
    return drawn;
}

std::vector<DrawnFigure> hand(const ex& angle, const ex& length, const Place& pivot, int colour) {
    const Place end{pivot[0] + length * GiNaC::sin(angle), pivot[1] - length * GiNaC::cos(angle)};
    DrawnFigure base = point(pivot, colour, false);
    base.still = true;
    return {line({pivot, end}), base, point(end, colour)};
}

std::vector<DrawnFigure> on_sphere(const ex& theta, const ex& phi) {
    const Place place{GiNaC::sin(theta) * GiNaC::cos(phi), GiNaC::sin(theta) * GiNaC::sin(phi), GiNaC::cos(theta)};
    DrawnFigure centre = point({zero, zero, zero}, 0, false);
    centre.still = true;
    return {line({{zero, zero, zero}, place}), centre, point(place, 0)};
}

// An array of many over its index; angles as they are.
std::vector<DrawnFigure> profile(const std::vector<ex>& values) {
    std::vector<Place> places;
    for (std::size_t i = 0; i < values.size(); ++i) places.push_back({ex(static_cast<long>(i + 1)), values[i]});
    std::vector<DrawnFigure> drawn{line(places)};
    drawn.front().profile = true;
    if (values.size() > 64) return drawn;
    for (const Place& place : places) {
        drawn.push_back(point(place, 0, false));
        drawn.back().many = true;
    }
    return drawn;
}

std::vector<DrawnFigure> hands_and_beads(const Scene& scene) {
    std::vector<DrawnFigure> drawn;
    int index = 0;
    for (const Coordinate& coordinate : scene.coordinates) {
        const ex side = GiNaC::numeric(hand_distance) * index;
        if (coordinate.unit == "rad") {
            add(drawn, hand(coordinate.position, 1, {side, zero}, index));
        } else if (coordinate.name == "y" || coordinate.name == "z") {
            drawn.push_back(point({side, coordinate.position}, index));
        } else {
            const ex below = GiNaC::numeric(-index);
            drawn.push_back(point({coordinate.position, below}, index));
        }
        ++index;
    }
    return drawn;
}

// The longest array of coordinates.
std::vector<ex> longest_array(const Scene& scene) {
    std::set<std::string> names;
    for (const Coordinate& coordinate : scene.coordinates)
        if (coordinate.array() != coordinate.written) names.insert(coordinate.array());
    std::vector<ex> longest;
    for (const std::string& name : names)
        if (const std::vector<ex> array = named(scene, name); array.size() > longest.size()) longest = array;
    return longest;
}

double number_of_formula(const Scene& scene, const ex& formula) {
    return scene.evaluate(formula, "a moment of inertia").to_double();
}

// A box with the body's mass and inertia, spread evenly; in a plane a rod.
std::vector<DrawnFigure> body(const Scene& scene, const DrawnBody& drawn, int colour) {
    const double mass = number_of_formula(scene, drawn.mass);
    const auto corner = [&](const std::vector<double>& in_body) {
        Place place = drawn.place;
        for (std::size_t i = 0; i < place.size(); ++i)
            for (std::size_t j = 0; j < place.size(); ++j)
                place[i] += drawn.rotation[i * place.size() + j] * GiNaC::numeric(in_body[j]);
        return place;
    };
    if (drawn.plane) {
        const double half = std::sqrt(3 * std::fabs(number_of_formula(scene, drawn.inertia.front())) / mass);
        return {line({corner({-half, 0}), corner({half, 0})}), point(drawn.place, colour)};
    }
    std::vector<double> moments, half(3);
    for (const ex& moment : drawn.inertia) moments.push_back(number_of_formula(scene, moment));
    const double sum = moments[0] + moments[1] + moments[2];
    for (std::size_t i = 0; i < 3; ++i) half[i] = std::sqrt(std::max(1.5 * (sum - 2 * moments[i]) / mass, 0.0));
    const double largest = *std::max_element(half.begin(), half.end());
    for (double& edge : half) edge = std::max(edge, 0.03 * largest);
    std::vector<DrawnFigure> all;
    const auto at = [&](int a, int b, int c) { return corner({a * half[0], b * half[1], c * half[2]}); };
    for (const int c : {-1, 1})
        all.push_back(line({at(-1, -1, c), at(1, -1, c), at(1, 1, c), at(-1, 1, c)}, colour, true));
    for (const int a : {-1, 1})
        for (const int b : {-1, 1}) all.push_back(line({at(a, b, -1), at(a, b, 1)}, colour));
    all.push_back(point(drawn.place, colour));
    all.push_back(point(at(0, 0, 1), colour + 1));
    all.back().many = true;
    return all;
}

std::vector<DrawnFigure> from_coordinates(const Scene& scene) {
    if (!scene.places.empty()) return defined_places(scene);
    if (const std::vector<Place> bodies = bodies_of_names(scene); !bodies.empty()) return free_bodies(scene, bodies);
    const std::vector<ex> r = named(scene, "r"), theta = named(scene, "theta"), phi = named(scene, "phi");
    if (theta.size() == 1 && phi.size() == 1) return on_sphere(theta.front(), phi.front());
    if (theta.size() == 1 && r.size() == 1) return hand(theta.front(), r.front(), {zero, zero}, 0);
    if (const std::vector<ex> array = longest_array(scene); array.size() >= profile_from) return profile(array);
    return hands_and_beads(scene);
}

}  // namespace

std::vector<DrawnFigure> figures_of(const Scene& scene) {
    std::vector<DrawnFigure> all;
    for (std::size_t b = 0; scene.figures.empty() && b < scene.bodies.size(); ++b)
        add(all, body(scene, scene.bodies[b], static_cast<int>(2 * b)));
    int colour = 0;
    for (const MovingFigure& figure : scene.figures) {
        DrawnFigure drawn{figure, 0};
        drawn.still = true;
        for (const Place& corner : figure.corners)
            for (const ex& component : corner) drawn.still = drawn.still && !moves(scene, component);
        drawn.figure.trail = figure.trail && !drawn.still;
        if (figure.kind == MovingFigure::Kind::point && !drawn.still) drawn.colour = colour++;
        all.push_back(drawn);
    }
    return all.empty() ? from_coordinates(without_time_coordinate(scene)) : all;
}

}  // namespace lobatto
