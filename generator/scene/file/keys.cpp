// SPDX-License-Identifier: GPL-2.0-or-later
#include "generator/scene/file/keys.hpp"

#include <algorithm>
#include <cassert>

#include "generator/method/method.hpp"

namespace lobatto {

namespace {

Key key(const std::string& name, Holds holds, const std::string& help) {
    return {name, holds, help};
}
Key required(Key one) {
    one.required = true;
    return one;
}
Key whole(const std::string& name, long long least, long long most, const std::string& help) {
    Key one = key(name, Holds::whole, help);
    one.least = least;
    one.most = most;
    return one;
}
Key word(const std::string& name, std::vector<std::string> words, const std::string& help) {
    Key one = key(name, Holds::word, help);
    one.words = std::move(words);
    return one;
}
Key section(const std::string& name, const std::string& help, std::vector<Key> keys) {
    Key one = key(name, Holds::table, help);
    one.keys = std::move(keys);
    return one;
}
Key lines(const std::string& name, const std::string& help, std::vector<Key> keys, bool is_short = false) {
    Key one = section(name, help, std::move(keys));
    one.lines = true;
    one.is_short = is_short;
    return one;
}

// Types of numbers by name, and "50 digits".
Key numbers_key() {
    Key one = word("numbers", {}, "The number type of the steps");
    for (const Precision precision : all_precisions) one.words.push_back(precision_name(precision));
    one.pattern = "^(2[0-9]|[3-9][0-9]|1[0-3][0-9]|140) digits$";
    return one;
}

const Key unit_key = {"unit", Holds::text, "The unit, copied to tables and code; nothing is converted"};
const Key count_key = {"count", Holds::formula, "How many elements the array has: a formula in constants"};

std::vector<Key> joint_keys() {
    std::vector<std::string> types;
    for (const auto& [type, keys] : joint_types()) types.push_back(type);
    return {
        required(word("type", types, "What the joint leaves free")),
        required(key("bodies", Holds::texts, "The two bodies; the first may be \"ground\"")),
        key("point", Holds::list, "Where it is, in space"),
        key("axis", Holds::list, "Its direction, in space"),
        key("angle", Holds::formula, "The angle at the start"),
        key("position", Holds::formula, "The way along the axis at the start"),
        key("velocity", Holds::formula, "The rate at the start"),
        key("from", Holds::list, "The end on the first body, in space"),
        key("to", Holds::list, "The end on the second body, in space"),
        key("length", Holds::formula, "The distance; without it that of the two ends"),
        key("constraint", Holds::truth, "True: the second body keeps its coordinates, and equations hold it there")};
}

std::vector<Key> make_keys() {
    return {
        key("title", Holds::text, "The heading of tables, pictures and emitted code"),
        key("time", Holds::text, "The name of the time in formulas, such as \"t\""),
        key("lagrangian", Holds::quoted, "The Lagrangian: kinetic minus potential energy; q' is the velocity of q"),
        lines("coordinates", "Generalised coordinates and how they start",
              {count_key, unit_key, key("position", Holds::formulas, "The position at the start"),
               key("velocity", Holds::formulas, "The velocity at the start"),
               key("momentum", Holds::formulas, "The momentum at the start, instead of the velocity")}),
        lines("parameters", "Numbers that formulas use by name",
              {required(key("value", Holds::formulas, "The value, or a list of them")), unit_key,
               key("constant", Holds::truth, "True: substituted into all formulas before the derivation")},
              true),
        lines("inputs", "Numbers that a host program may change before each step, such as the torque of a motor",
              {required(key("value", Holds::formulas, "The value of runs and sweeps, or a list of them")), unit_key},
              true),
        key("definitions", Holds::names, "Names for formulas, such as r = \"sqrt(x^2 + y^2)\""),
        key("forces", Holds::names, "Generalised forces on coordinates, such as x = \"-c*x'\""),
        lines("constraints", "Holonomic constraints: equations of positions that hold at all times",
              {required(key("equation", Holds::quoted, "Such as \"x^2 + y^2 = l^2\"")), count_key}, true),
        lines("bodies", "Rigid bodies",
              {required(key("mass", Holds::formula, "The mass, above 0")),
               required(key("inertia", Holds::formulas,
                            "Moments of inertia about the centre of mass: three, six, or one in a plane")),
               key("position", Holds::list, "Where the centre of mass is"),
               key("orientation", Holds::list, "The quaternion that turns the body into space, scalar part first"),
               key("angle", Holds::formula, "The angle of a body in a plane"),
               key("velocity", Holds::list, "Of the centre of mass"),
               key("angular_velocity", Holds::formulas, "In the frame of the body")}),
        lines("joints", "Joints between two bodies", joint_keys()),
        lines("impacts", "Walls at which the motion bounces, and resets at times and places",
              {required(key("when", Holds::quoted, "The wall and its side, such as \"y = 0 falling\"")), count_key,
               key("restitution", Holds::formula, "The part of the normal velocity that is given back, 0 to 1"),
               key("rest", Holds::formula, "The run ends at an impact that the motion leaves more slowly than this"),
               key("reset", Holds::names, "Positions and velocities after the impact, such as { \"x'\" = \"-x'\" }"),
               key("passes", Holds::truth,
                   "True: the motion goes on beyond the wall, after the reset; at a time it always does")}),
        section(
            "method", "How it is integrated",
            {word("family", {"lobatto", "gauss", "splitting"}, "The family of methods"),
             whole("points", 2, 12, "Lobatto's quadrature points; the order is 2 points - 2"),
             whole("stages", 1, 35, "Stages of Gauss (1 to 10) or of splitting methods (6, 11, 14, 17, 35)"),
             key("tolerance", Holds::formula, "Where the iteration of a step stops; without it at rounding"),
             word("arithmetic", {"plain", "clean"}, "Clean: rounding errors grow like a random walk"), numbers_key(),
             key("clock", Holds::formula, "The time step's factor, a formula of positions and the time, or \"auto\"")}),
        required(
            section("run", "From the start to the end",
                    {key("step", Holds::formula, "The step"),
                     whole("steps_per_period", 1, most_steps, "Instead of the step, with the period"),
                     key("period", Holds::formula, "The period that has these steps"),
                     required(key("until", Holds::formula, "The end time")),
                     key("error", Holds::formula, "The accepted error, relative to the amplitude of the motion"),
                     key("beyond_horizon", Holds::truth, "True: go on even when the error is as large as the motion"),
                     key("assemble", Holds::truth, "True: take the nearest start that keeps the constraints"),
                     key("stop", Holds::events, "Where the run ends early, such as \"y = 0 falling\"")})),
        section("output", "What is written of a run",
                {key("every", Holds::formula, "Keep every N-th state; with a clock the time between two of them"),
                 key("energy", Holds::truth, "Whether the energy is a column"),
                 key("momenta", Holds::truth, "Whether the momenta are columns"),
                 key("bodies", Holds::truth, "Whether orientations and angular velocities of bodies are columns"),
                 key("columns", Holds::names, "More columns of a run, such as { v = \"x'\" }"),
                 key("multipliers", Holds::truth, "Whether the multipliers of constraints are columns"),
                 key("tangent", Holds::truth, "Whether the derivative of a step is in the kernel"),
                 whole("dense", 0, 100, "States between two steps, on the polynomial of the step"),
                 key("events", Holds::events, "Events whose times are written, such as \"x = 0 rising\""),
                 key("keep", Holds::events, "Numbers that a sweep keeps of each trajectory, such as \"max(x)\"")}),
        lines("view", "Figures of the page of `lobatto view`; plot names its curves",
              {key("point", Holds::place, "A dot that moves"), key("line", Holds::places, "A line through places"),
               key("spring", Holds::places, "A spring between two places"),
               key("circle", Holds::place, "A circle about a place"), key("radius", Holds::formula, "Of the circle"),
               key("trail", Holds::truth, "Whether it leaves a trail"),
               key("closed", Holds::truth, "Whether the line returns to its beginning"), count_key}),
    };
}

}  // namespace

const std::vector<Key>& scene_keys() {
    static const std::vector<Key> keys = make_keys();
    return keys;
}

const std::vector<Key>& keys_of_section(const std::string& section) {
    const auto found =
        std::find_if(scene_keys().begin(), scene_keys().end(), [&](const Key& one) { return one.name == section; });
    assert(found != scene_keys().end());
    return found->keys;
}

const std::vector<std::pair<std::string, std::vector<std::string>>>& joint_types() {
    static const std::vector<std::pair<std::string, std::vector<std::string>>> types = {
        {"ball", {"type", "bodies", "point", "constraint"}},
        {"hinge", {"type", "bodies", "point", "axis", "angle", "velocity", "constraint"}},
        {"slider", {"type", "bodies", "axis", "position", "velocity", "constraint"}},
        {"distance", {"type", "bodies", "from", "to", "length"}}};
    return types;
}

const std::vector<std::string>& figure_shapes() {
    static const std::vector<std::string> shapes = {"point", "line", "spring", "circle"};
    return shapes;
}

std::vector<std::string> names_of(const std::vector<Key>& keys) {
    std::vector<std::string> names;
    for (const Key& one : keys) names.push_back(one.name);
    return names;
}

}  // namespace lobatto
