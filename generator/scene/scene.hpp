// SPDX-License-Identifier: GPL-2.0-or-later
// A scene: one mechanical system, how to integrate it and what to keep, read from a TOML file (docs/scene_format.md).
#pragma once

#include <ginac/ginac.h>

#include <array>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "generator/formula/names.hpp"
#include "generator/formula/text/source.hpp"
#include "generator/method/method.hpp"

namespace lobatto {

struct Coordinate {
    std::string name;        // an identifier; element 3 of an array x is x_3
    std::string unit;        // "" when none is given
    GiNaC::symbol position;  // prints as name
    GiNaC::symbol velocity;  // prints as name'
    GiNaC::ex force = 0;    // generalised force beside the Lagrangian's own, in positions, velocities, time, parameters
    Position rate_at = {};  // where its initial velocity or momentum stands
    std::string written = name;  // in formulas: x[3]
    Position force_at = {};      // where its first force stands
    bool follows = false;        // its start is left out: its equation tells it

    std::string array() const { return written.substr(0, written.find('[')); }  // x of x[3], and of x
};

struct Parameter {
    std::string name;
    std::string unit;
    GiNaC::ex value;  // exact, free of symbols
    GiNaC::symbol symbol;
    std::string written = name;  // in formulas: m[3]
    bool is_input = false;       // the host program may give it another value before each step
    bool is_side = false;        // of a switch: no value that anyone else gives
};

// An event: the value crosses zero. Located on the step's own polynomial.
struct Event {
    std::string text;   // as written, white space collapsed: "theta = 0 rising"
    GiNaC::ex value;    // left side minus right side, in positions, velocities, time and parameters
    int direction = 0;  // 1: rising only, -1: falling only, 0: both
    Position at = {};
};

struct Run {
    static constexpr double least_error = 1e-28, largest_error = 0.1;  // that can be asked for

    GiNaC::ex step;               // h > 0; in parameters
    Position step_at = {};        // where it is written
    GiNaC::ex until;              // end time, >= 0; in parameters
    double error = 0;             // that is wanted, relative to the amplitude of the motion; 0: nothing is said
    bool beyond_horizon = false;  // goes on when the error is as large as the motion: statistics of chaos
    bool assemble = false;        // a start that does not keep the constraints is moved to the nearest that does
    std::vector<Event> stops;     // a run ends at the first of them
};

// What a sweep keeps of a trajectory: "first(b = pi)", "max(x^2 + y^2)" (analysis/reductions.hpp).
struct Reduction {
    enum class Of { first, count, max, min, mean, last };
    std::string text;  // as written, white space collapsed
    Of of = Of::last;
    Event crossing = {};    // first, count: of this event
    std::size_t event = 0;  // its number, once it is watched
    GiNaC::ex value = 0;    // else: in positions, velocities, time, parameters, and the two below
};

// A column of the trajectory beside the motion itself.
struct Column {
    std::string name;
    std::string unit = {};
    GiNaC::ex value = 0;    // in positions, velocities, time and parameters
    std::string text = {};  // as the scene has it, with its definitions; empty: no formula of the scene
};

// What a kernel computes beside the motion itself; it has no code for anything else.
struct Outputs {
    long every = 1;            // keep each state whose step index is a multiple of this
    GiNaC::ex interval = 0;    // with a clock: the time between two kept states; 0: those at its steps are kept
    bool energy = true;        // a column H in the trajectory file, and what the run says of the energy
    bool momenta = true;       // the columns p_...
    bool multipliers = false;  // columns lambda_... of the constraints
    bool tangent = true;       // the derivative of a step: its symplectic defect, monodromy
    int dense = 0;             // states between two steps, evenly spaced, from the step's own polynomial
    std::vector<Event> events;
    std::vector<Column> columns;        // of eliminated coordinates and of bodies; in files of runs
    std::vector<Reduction> kept;        // by sweeps
    GiNaC::symbol energy_of_kept{"H"};  // in their formulas, and in plots: H, and p_x of the coordinates
    std::vector<GiNaC::symbol> momenta_of_kept;

    void watch_kept();  // makes the events of what is kept events of the kernel
};

// A clock: steps are equally long in a time tau with dt = g(q) dtau (generator/mechanics/clock/clock.hpp).
struct Clock {
    std::string text;                         // as written, white space collapsed: "r^(3/2)"
    GiNaC::ex rate;                           // g, in positions, time and parameters
    std::optional<Position> at;               // in the scene file; nothing: an option asked for it
    GiNaC::symbol energy{"energy_of_start"};  // E; where the time is a coordinate, sigma of (D64), so called
    bool is_automatic = false;         // "auto": g follows from L (generator/mechanics/clock/automatic_clock.hpp)
    bool has_time_coordinate = false;  // the last one (generator/scene/time_coordinate.hpp)
    bool is_applied = false;           // the scene is one in tau
    GiNaC::ex lagrangian;              // then: L(q, dq/dt) in velocities w = dq/dtau
};

// A holonomic constraint: phi(q, t) = 0 at all times.
struct Constraint {
    std::string name;            // an identifier; element 3 of an array link is link_3
    std::string written = name;  // in the scene: link[3]
    std::string text = {};       // of its equation as written, white space collapsed
    GiNaC::ex value = 0;         // phi: left side minus right side, in positions, time and parameters
    Position at = {};
    // Where one side is a coordinate: its number as declared, and the other side.
    std::optional<std::size_t> solved_for = {};
    GiNaC::ex solution = 0;
};

// A coordinate that follows from others: a constraint is an equation for it, x = f(q, t), and f stands in all formulas.
struct Eliminated {
    Coordinate coordinate;
    std::size_t declared = 0;  // its number among all coordinates of the file
    Constraint constraint;
    GiNaC::ex position, velocity;                  // f, and its rate of change
    GiNaC::ex initial_position, initial_velocity;  // as the scene has them, in parameters
};

// What values that are given later must keep, as those of the scene do: a number in parameters that is above 0, or not
// below it.
struct Requirement {
    GiNaC::ex value;
    bool may_vanish = false;
    std::string complaint;  // where it does not hold
    Position at;
};

// A wall: the motion is on the one side of it where `when` has not happened, and is thrown back when it meets it
// (generator/mechanics/constraints/impacts.hpp).
struct Impact {
    std::string name;            // an identifier; element 3 of an array touch is touch_3
    std::string written = name;  // in the scene: touch[3]
    Event when = {};             // free of velocities; with a direction, unless it passes: then 0 is both
    bool passes = false;         // the motion goes on beyond it, after its reset
    GiNaC::ex restitution = 1;   // in parameters
    GiNaC::ex rest = 0;          // in parameters: the run ends where the motion leaves the wall more slowly; 0: never
    // n each, of the state after it in that before it; empty: the momentum jumps instead.
    std::vector<GiNaC::ex> reset_position = {}, reset_velocity = {};
};

// What `lobatto view` draws: at places of one line of [view], which move.
struct MovingFigure {
    enum class Kind { point, line, spring, circle };
    std::string written;  // mass[3]
    Kind kind = Kind::point;
    std::vector<std::vector<GiNaC::ex>> corners;  // 2 or 3 formulas each; of points and circles one
    GiNaC::ex radius = 0;                         // of circles, in the units of the places
    bool trail = false;                           // it leaves a trace: points and circles
    bool closed = false;                          // lines: back to the first corner
};

// A curve over time that `lobatto view` shows.
struct Plot {
    std::string text;  // as written, white space collapsed
    GiNaC::ex value;   // in positions, velocities, time, parameters, H and momenta (Outputs)
};

// A rigid body, for pictures: where its centre is, how it is turned, and its inertia; in a plane the third is 0.
struct DrawnBody {
    std::string name;
    bool plane = false;
    std::vector<GiNaC::ex> place;     // 2 or 3
    std::vector<GiNaC::ex> rotation;  // 2 x 2 or 3 x 3, by rows, from its frame to space
    GiNaC::ex mass;
    std::vector<GiNaC::ex> inertia;  // about its own axes; of a plane body one
};

// Initial rates are given either as velocities or as momenta, for all coordinates.
enum class Start { velocity, momentum };

struct Scene {
    Source source{"", ""};   // the file, for errors found after reading
    Position lagrangian_at;  // where the Lagrangian stands in it
    std::string path;        // as given
    std::string name;        // stem of the file as a C identifier: pendulum
    std::string title;       // one line
    std::vector<Coordinate> coordinates;
    bool has_time = false;              // whether the scene declares the time; else no formula holds it
    GiNaC::symbol time{"t"};            // prints as the name the scene gives it
    std::vector<Parameter> parameters;  // run-time parameters, in the order of the file; then inputs
    std::vector<Parameter> constants;   // declared constant: already substituted everywhere
    std::string lagrangian_text;        // as written, white space collapsed, without comments
    GiNaC::ex lagrangian;               // in position and velocity symbols, time and run-time parameters
    // Where bodies are in a plane, when the scene defines x and y, alone or with one index; in positions, time and
    // run-time parameters. For pictures.
    std::vector<std::pair<GiNaC::ex, GiNaC::ex>> places;
    std::vector<DrawnBody> bodies;
    // Positions that together turn a body, a quaternion of any length (D53).
    std::vector<std::array<GiNaC::symbol, 4>> quaternions;
    std::vector<MovingFigure> figures;        // empty: what the coordinates tell (cli/view/figures.hpp)
    std::vector<Plot> plots;                  // likewise
    std::vector<GiNaC::ex> initial_position;  // in parameters
    std::vector<GiNaC::ex> initial_rate;      // velocities or momenta, in parameters
    Start start = Start::velocity;
    std::vector<Constraint> constraints;
    std::vector<Eliminated> eliminated;
    // Coordinates that have an equation and stay, and why, as "x: its multiplier is asked for".
    std::vector<std::string> not_eliminated;
    std::vector<Impact> impacts;
    std::vector<Switch> switches;  // their sides are the last parameters, with their values at the start
    std::vector<std::string> inputs_without_speed;  // "u in x'": rates of definitions that do not know that u moves
    std::vector<Switch> seen_switches;              // of formulas that only look at the motion: no kernel knows them
    std::vector<TableUse> tables;                   // measured values in any formula
    std::vector<DomainCondition> conditions;        // of all formulas but events and pictures, as written
    std::vector<Requirement> requirements;          // of masses, inertia, lengths, restitutions
    Method method;
    std::optional<Clock> clock;
    Run run;
    Outputs outputs;

    bool has_time_coordinate() const { return clock && clock->has_time_coordinate; }
    std::vector<GiNaC::symbol> inputs() const;

    // All that a kernel looks for in each step: events, then stops, impacts, switches.
    std::vector<Event> watched() const;
    std::vector<Event> reported() const;  // without switches, which are no events
    // Of these, with their numbers, those that may end the run: stops, and walls with `rest`.
    std::vector<std::pair<std::size_t, Event>> ends() const;
    bool may_end_early() const { return !ends().empty(); }
    // Whether kernels compute it: where the scene asks for it, and where it tells how the motion is refracted.
    bool has_energy() const;
    bool is_cut() const { return !impacts.empty() || !switches.empty(); }  // whether steps may be

    // A formula with the sides of switches where the motion is, not where it starts: for evaluation, not derivation.
    GiNaC::ex along_motion(GiNaC::ex formula) const;

    // The value of an expression in the parameters, with the parameters at their scene values unless given, in scene
    // order: 60 decimal digits; throws NoValue when it is not a finite real number.
    GiNaC::numeric value_of(const GiNaC::ex& expression, const std::vector<GiNaC::ex>& parameter_values = {}) const;
    // The same of one that holds the motion too, at the start with these velocities, one for each coordinate.
    GiNaC::numeric value_at_start(const GiNaC::ex& expression, const std::vector<GiNaC::ex>& velocities) const;
    // The same; throws InputError naming `what`.
    GiNaC::numeric evaluate(const GiNaC::ex& expression, const std::string& what,
                            const std::vector<GiNaC::ex>& parameter_values = {}) const;
};

// InputError where the clock stands, or without a place if an option asked for it.
[[noreturn]] void fail_at_clock(const Scene& scene, const std::string& message);

// The parameters and constants of a scene, for further formulas in them.
struct Names;
Names parameter_names(const Scene& scene);

// Throws InputError: what, where, why, how to mend.
// `kept`: instead of [output] keep; an error names the option --keep.
Scene read_scene(const std::string& path, const std::vector<std::string>& kept = {});
Scene read_scene(const Source& source, const std::vector<std::string>& kept = {});

}  // namespace lobatto
