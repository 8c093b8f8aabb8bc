// SPDX-License-Identifier: GPL-2.0-or-later
// [view]: figures that move with the motion, and curves over time.
#include <fmt/format.h>

#include <algorithm>

#include "generator/scene/system_reader.hpp"

namespace lobatto {
namespace {

constexpr std::size_t most_figures = 2000, most_corners = 1000, most_plots = 24;
const std::string figure_example = "{ line = [[0, 0], [\"l*sin(q)\", \"-l*cos(q)\"]] }";

}  // namespace

void SystemReader::read_view() {
    const Entry* section = root_.find("view");
    if (section == nullptr) return;
    const bool records = names_.records;
    names_.records = false;  // of pictures no domain is watched
    for (const Entry& entry : table_of(source_, *section, "[view] with lines such as rod = " + figure_example)) {
        if (entry.key == "plot")
            read_plots(entry);
        else
            read_figure(entry);
    }
    names_.records = records;
}

// plot = ["theta", "p_theta", "H"]
void SystemReader::read_plots(const Entry& entry) {
    if (scene_.outputs.momenta_of_kept.empty()) name_energy_and_momenta();
    if (entry.value.kind != Value::Kind::list || entry.value.items.empty())
        fail(entry.value.at, "plot must be a list of formulas such as [\"theta\", \"H\"]");
    if (entry.value.items.size() > most_plots)
        fail(entry.value.at, fmt::format("{} curves; at most {}", entry.value.items.size(), most_plots));
    const Scope scope = scope_of("the curve", true);
    for (const Value& item : entry.value.items) {
        const Text& text = formula_of(source_, "a curve", item);
        const Operand value = evaluate(source_, parse_formula(source_, text, scope), scope);
        scene_.plots.push_back({collapsed(text.value), value.expression});
    }
}

// rod = { line = [["0", "0"], ["x", "y"]] }, or "mass[i]" = { point = ["x[i]", "y[i]"], count = 3 }.
void SystemReader::read_figure(const Entry& entry) {
    const ArrayName array = declare_array(entry, "figure", "[view]");
    const Table table(source_, table_of(source_, entry, figure_example), entry.at, "figure " + array.name,
                      keys_of_section("view"));
    const Entry* shape = nullptr;
    MovingFigure figure;
    for (std::size_t k = 0; k < figure_shapes().size(); ++k)
        if (const Entry* found = table.find(figure_shapes()[k])) {
            if (shape != nullptr) fail(found->at, fmt::format("figure {} is a {} already", array.name, shape->key));
            shape = found;
            figure.kind = static_cast<MovingFigure::Kind>(k);
        }
    if (shape == nullptr)
        fail(entry.at, fmt::format("figure {} has no shape; add one of point, line, spring and circle, as in {}",
                                   array.name, figure_example));
    const bool has_one = figure.kind == MovingFigure::Kind::point || figure.kind == MovingFigure::Kind::circle;
    figure.trail = has_one;
    if (const Entry* trail = table.find("trail")) figure.trail = boolean_of(source_, *trail);
    if (figure.trail && !has_one) fail(table.find("trail")->at, "points and circles leave trails; a line does not");
    if (const Entry* closed = table.find("closed")) {
        if (figure.kind != MovingFigure::Kind::line) fail(closed->at, "closed is of lines");
        figure.closed = boolean_of(source_, *closed);
    }
    const Entry* radius = table.find("radius");
    if ((figure.kind == MovingFigure::Kind::circle) != (radius != nullptr))
        fail(radius != nullptr ? radius->at : entry.at, "a circle, and nothing else, has a radius, as in radius = 1");

    const Value& places = shape->value;
    if (places.kind != Value::Kind::list || places.items.size() < 2 || places.items.size() > most_corners)
        fail(places.at,
             fmt::format(
                 "{} must be a list of two and more: [\"x\", \"y\"] of a point or circle, [[0, 0], [\"x\", \"y\"]] of "
                 "a line or spring",
                 shape->key));
    const std::vector<Value> one{places};
    const long count = count_of(entry, table.find("count"), array, "figure");
    Scope scope = scope_of("the figure " + array.name, true);
    if (array.index) scope.indices = {*array.index};
    for (long i = 1; i <= count; ++i) {
        const std::vector<long> indices(scope.indices.size(), i);
        figure.written = array.index ? fmt::format("{}[{}]", array.name, i) : array.name;
        figure.corners.clear();
        const auto value_of = [&](const std::string& what, const Value& value) {
            const Text& text = formula_of(source_, what, value);
            return evaluate(source_, parse_formula(source_, text, scope), scope, indices).expression;
        };
        for (const Value& corner : has_one ? one : places.items) {
            const std::size_t dimension = corner.kind == Value::Kind::list ? corner.items.size() : 0;
            if (dimension != 2 && dimension != 3)
                fail(corner.at, "a place is [x, y] or [x, y, z]: numbers, or formulas in quotes");
            if (!figure.corners.empty() && figure.corners.front().size() != dimension)
                fail(corner.at, "one place of this figure lies in the plane, another in space");
            figure.corners.emplace_back();
            for (const Value& component : corner.items) figure.corners.back().push_back(value_of("a place", component));
        }
        if (figure.kind == MovingFigure::Kind::spring && figure.corners.size() != 2)
            fail(places.at, "a spring has two ends");
        if (radius != nullptr) figure.radius = value_of("radius", radius->value);
        scene_.figures.push_back(figure);
    }
    if (scene_.figures.size() > most_figures)
        fail(entry.at, fmt::format("{} figures up to here; at most {}", scene_.figures.size(), most_figures));
}

}  // namespace lobatto
