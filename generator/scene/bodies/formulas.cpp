// SPDX-License-Identifier: GPL-2.0-or-later
// The formulas of [bodies] and [joints], which become starts, kinetic energy, constraints, and values of names.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "generator/formula/real.hpp"
#include "generator/scene/bodies/reader.hpp"

namespace lobatto {
namespace {

using GiNaC::ex;

Vector vector_of(const std::vector<ex>& components) {
    return {components[0], components[1], components.size() > 2 ? components[2] : ex(0)};
}

}  // namespace

void SystemReader::Bodies::read() {
    for (Line& line : lines_) read_body(line);
    for (JointLine& line : joints_) read_joint(line);
    for (Line& line : lines_) move(line);
    for (const JointLine& line : joints_)
        if (line.constrains()) add_equations(line);
    for (const Line& line : lines_) {
        give_values(line.body);
        draw(line.body);
        show(line);
        reader_.kinetic_energy_ += moving(line.body, kinetic_energy(line.body), true).expression;
        reader_.kinetic_text_ += fmt::format("{}T({})", reader_.kinetic_text_.empty() ? "" : " + ", line.body.name);
    }
}

// 0, 1 or -1 where the expression is that whatever the parameters: at the scene's values, and at others.
ex SystemReader::Bodies::plain(const ex& expression) const {
    if (GiNaC::is_a<GiNaC::numeric>(expression)) return expression;
    std::vector<GiNaC::exmap> points{reader_.parameter_values_};
    for (int point = 1; point <= 2; ++point) {
        GiNaC::exmap elsewhere;
        for (const auto& [symbol, value] : reader_.parameter_values_) {
            const long k = static_cast<long>(elsewhere.size());
            elsewhere[symbol] = value * GiNaC::numeric(7 * point + k + 1, 7 * point + k) +
                                GiNaC::numeric(point + 1, 11 * point + 3 * k + 7);
        }
        points.push_back(elsewhere);
    }
    try {
        for (const int number : {0, 1, -1}) {
            const auto is_number = [&](const GiNaC::exmap& point) {
                return real_value(expression - number, point).is_zero();  // a sum that cancels is exactly 0
            };
            if (std::all_of(points.begin(), points.end(), is_number)) return number;
        }
    } catch (const NoValue&) {
    }
    return expression;
}

ex SystemReader::Bodies::formula(const Entry& entry, const std::string& owner, bool positive) {
    GiNaC::numeric value = 0;
    const std::string what = fmt::format("the {} of {}", entry.key, owner);
    const ex expression = reader_.read_formula(entry, {&reader_.names_, what, false, {}}, &value);
    if (positive && !value.is_positive())
        fail(entry.value.at, fmt::format("{} is {:.6g}; it must be positive", what, value.to_double()));
    if (positive) reader_.require(expression, false, what + " is not positive", entry.value.at);
    return expression;
}

std::vector<ex> SystemReader::Bodies::components(const Entry* entry, const std::string& owner, std::size_t count,
                                                 const ex& otherwise) {
    if (entry == nullptr) return std::vector<ex>(count, otherwise);
    const std::vector<Value>& items = entry->value.items;
    if (entry->value.kind != Value::Kind::list || items.size() != count)
        fail(entry->value.at,
             fmt::format("the {} of {} is a list of {} formulas such as [{}], not {}", entry->key, owner, count,
                         count == 2   ? "0, 1"
                         : count == 3 ? "0, 0, 1"
                                      : "1, 0, 0, 0",
                         entry->value.kind != Value::Kind::list ? entry->value.kind_name()
                                                                : fmt::format("of {}", items.size())));
    std::vector<ex> result;
    for (const Value& item : items) result.push_back(formula({entry->key, item.at, item}, owner));
    return result;
}

void SystemReader::Bodies::read_body(Line& line) {
    line.body.plain = [this](const ex& expression) { return plain(expression); };
    line.body.mass = formula(line.table.get("mass", "for example mass = 1"), line.body.name, true);
    line.body.inertia = read_inertia(*line.table.find("inertia"), line.body.name);
    if (line.joint) refuse_velocities(line);
    read_place(line);
    read_orientation(line);
}

void SystemReader::Bodies::read_place(Line& line) {
    const std::size_t dimension = line.body.plane ? 2 : 3;
    const auto vector = [&](const std::string& key) {
        return vector_of(components(line.table.find(key), line.body.name, dimension, 0));
    };
    line.body.drawn_place = vector("position");
    line.velocity = vector("velocity");
}

void SystemReader::Bodies::read_orientation(Line& line) {
    RigidBody& body = line.body;
    const Entry *orientation = line.table.find("orientation"), *angle = line.table.find("angle"),
                *turning = line.table.find("angular_velocity");
    if (body.plane && orientation != nullptr)
        fail(orientation->at, fmt::format("{} has one moment of inertia, so it moves in a plane: write angle = 0 "
                                          "instead of an orientation",
                                          body.name));
    if (!body.plane && angle != nullptr)
        fail(angle->at,
             fmt::format("{} turns in space: write orientation = [1, 0, 0, 0], a quaternion, instead of an angle",
                         body.name));
    if (body.plane) {
        if (angle != nullptr) body.drawn_angle = formula(*angle, body.name);
        body.drawn_rotation = rotation_in_plane(body.drawn_angle);
        line.turning = {0, 0, turning != nullptr ? formula(*turning, body.name) : ex(0)};
        return;
    }
    line.turning = vector_of(components(turning, body.name, 3, 0));
    const std::vector<ex> q =
        orientation != nullptr ? components(orientation, body.name, 4, 0) : std::vector<ex>{1, 0, 0, 0};
    const ex square = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
    const double length = std::sqrt(number(square));
    if (length == 0)
        fail(orientation->value.at, fmt::format("the orientation of {} is a quaternion of length 0; [1, 0, 0, 0] turns "
                                                "nothing, [\"cos(a/2)\", 0, 0, \"sin(a/2)\"] by a about z",
                                                body.name));
    for (std::size_t k = 0; k < 4; ++k) line.orientation[k] = length == 1 ? q[k] : q[k] / sqrt(square);
    body.drawn_orientation = line.orientation;
    body.drawn_rotation = rotation_of(line.orientation);
}

// One moment in a plane; three principal moments; or xx, yy, zz, xy, xz, yz.
Matrix SystemReader::Bodies::read_inertia(const Entry& entry, const std::string& name) {
    if (entry.value.kind != Value::Kind::list) return {{{0, 0, 0}, {0, 0, 0}, {0, 0, formula(entry, name, true)}}};
    const std::size_t count = entry.value.items.size();
    if (count != 3 && count != 6)
        fail(entry.value.at, fmt::format("the inertia of {} has {} values; in space it has three principal moments, or "
                                         "six values xx, yy, zz, xy, xz, yz; in a plane it is one number",
                                         name, count));
    const std::vector<ex> v = components(&entry, name, count, 0);
    const bool full = count == 6;
    const ex xy = full ? v[3] : 0, xz = full ? v[4] : 0, yz = full ? v[5] : 0;
    const Matrix inertia = {{{v[0], xy, xz}, {xy, v[1], yz}, {xz, yz, v[2]}}};
    refuse_inertia(entry, name, inertia);
    return inertia;
}

// I is positive definite, and so is tr(I)/2 - I, the moments of the mass itself, but for flat bodies.
void SystemReader::Bodies::refuse_inertia(const Entry& entry, const std::string& name, const Matrix& I) {
    const ex trace = I[0][0] + I[1][1] + I[2][2];
    Matrix E;
    for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j < 3; ++j) E[i][j] = (i == j ? trace / 2 : ex(0)) - I[i][j];
    // Of all orders, in units of the trace: those of a flat body are 0, but for rounding of what is written.
    const auto minors_of = [&](const Matrix& m) {
        std::vector<ex> minors = {m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
                                  m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
                                  m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0])};
        minors[0] = minors[0] / pow(trace, 3);
        for (std::size_t i = 0; i < 3; ++i) {
            const std::size_t j = (i + 1) % 3;
            minors.push_back(m[i][i] / trace);
            minors.push_back((m[i][i] * m[j][j] - m[i][j] * m[i][j]) / pow(trace, 2));
        }
        return minors;
    };
    const auto require = [&](const ex& value, bool may_vanish, const std::string& complaint) {
        const double here = number(value);
        if (!(may_vanish ? here >= 0 : here > 0)) fail(entry.value.at, complaint);
        reader_.require(value, may_vanish, complaint, entry.value.at);
    };
    const std::string not_positive = fmt::format("the inertia of {} is not positive: every moment of inertia is", name);
    const std::string impossible =
        fmt::format("no body has the inertia of {}: each principal moment is at most the sum of the other two", name);
    require(trace, false, not_positive);
    for (const ex& minor : minors_of(I)) require(minor, false, not_positive);
    for (const ex& minor : minors_of(E)) require(minor + GiNaC::numeric(1, 1000000000000), true, impossible);
}

void SystemReader::Bodies::read_joint(JointLine& line) {
    Joint& joint = line.joint;
    const bool plane = lines_[joint.second].body.plane;
    const std::string origin = plane ? "[0, 0]" : "[0, 0, 0]";
    const auto point = [&](const std::string& key, const std::string& which) {
        const Entry& entry = line.table.get(key, fmt::format("{}, {} = {}", which, key, origin));
        return vector_of(components(&entry, joint.name, plane ? 2 : 3, 0));
    };
    if (joint.type == Joint::Type::distance) {
        joint.point = point("from", "the point on the first body");
        joint.to = point("to", "the point on the second body");
        if (const Entry* length = line.table.find("length")) joint.length = formula(*length, joint.name, true);
        return;
    }
    if (joint.type != Joint::Type::slider) joint.point = point("point", "where it is while no joint has moved");
    if (joint.type == Joint::Type::ball) return;
    read_axis(joint, line.table);
    read_start(line);
}

void SystemReader::Bodies::read_axis(Joint& joint, const Table& table) {
    const bool plane = lines_[joint.second].body.plane;
    if (const Entry* given = table.find("axis"); plane && joint.type == Joint::Type::hinge) {
        if (given != nullptr) fail(given->at, "in a plane every hinge turns about z; leave out the axis");
        joint.axis = {0, 0, 1};
        return;
    }
    const Entry& entry = table.get("axis", plane ? "axis = [1, 0]" : "axis = [0, 0, 1]");
    joint.axis = vector_of(components(&entry, joint.name, plane ? 2 : 3, 0));
    const ex square = dot(joint.axis, joint.axis);
    if (number(square) == 0) fail(entry.value.at, fmt::format("the axis of joint {} has length 0", joint.name));
    for (ex& part : joint.axis) part = part / sqrt(square);
}

void SystemReader::Bodies::read_start(JointLine& line) {
    const Entry *start = line.table.find(line.joint.type == Joint::Type::hinge ? "angle" : "position"),
                *rate = line.table.find("velocity");
    for (const Entry* entry : {start, rate}) {
        if (entry == nullptr) continue;
        if (line.joint.closes)
            fail(entry->at,
                 line.joint.asked_for
                     ? fmt::format(
                           "joint {} is a constraint, so that its bodies tell its start in [bodies]; leave out {}",
                           line.joint.name, entry->key)
                     : fmt::format("joint {} closes a loop, so that the other joints tell its start; leave out {}",
                                   line.joint.name, entry->key));
        (entry == start ? line.start : line.rate) = formula(*entry, line.joint.name);
    }
}

void SystemReader::Bodies::refuse_velocities(const Line& line) const {
    const Joint& joint = joints_[*line.joint].joint;
    const bool ball = joint.type == Joint::Type::ball;
    for (const char* const key : {"velocity", "angular_velocity"}) {
        const Entry* const entry = line.table.find(key);
        if (entry == nullptr || (ball && entry->key != "velocity")) continue;
        fail(entry->at, fmt::format("{} hangs on joint {}, which tells its {}: leave it out{}", line.body.name,
                                    joint.name, entry->key == "velocity" ? "velocity" : "angular velocity",
                                    ball ? "" : fmt::format(", and give {} a velocity", joint.name)));
    }
}

void SystemReader::Bodies::start(const Symbols& symbols, const Starts& starts) {
    for (std::size_t k = 0, g = 0; k < starts.size(); ++g) {
        Group& group = reader_.groups_[symbols.groups[g]];
        for (std::size_t i = 0; i < group.count; ++i) group.starts.push_back(starts[k++]);
    }
}

SystemReader::Bodies::Starts SystemReader::Bodies::starts_of_quaternion(const Line& line) const {
    const Quaternion rate = rate_of(line.orientation, line.turning);
    Starts starts;
    for (std::size_t k = 0; k < 4; ++k) starts.emplace_back(line.orientation[k], rate[k]);
    return starts;
}

void SystemReader::Bodies::move_free_body(Line& line) {
    RigidBody& body = line.body;
    Vector x{0, 0, 0}, v{0, 0, 0};
    Starts places;
    for (std::size_t k = 0; k < line.place.q.size(); ++k) {
        places.emplace_back(body.drawn_place[k], line.velocity[k]);
        x[k] = line.place.q[k];
        v[k] = line.place.v[k];
    }
    start(line.place, places);
    const auto& [q, dq, groups] = line.turn;
    if (body.plane) {
        start(line.turn, {{body.drawn_angle, line.turning[2]}});
        return move_free_in_plane(body, x, v, q[0], dq[0]);
    }
    start(line.turn, starts_of_quaternion(line));
    move_free(body, x, v, {q[0], q[1], q[2], q[3]}, {dq[0], dq[1], dq[2], dq[3]});
}

void SystemReader::Bodies::move_on_joint(Line& line, JointLine& hung) {
    const Joint& joint = hung.joint;
    const RigidBody* const parent = joint.first ? &lines_[*joint.first].body : nullptr;
    if (joint.type == Joint::Type::ball) {
        const auto& [q, dq, groups] = line.turn;
        start(line.turn, starts_of_quaternion(line));
        return hang_on_ball(line.body, joint, parent, {q[0], q[1], q[2], q[3]}, {dq[0], dq[1], dq[2], dq[3]});
    }
    start(hung.coordinate, {{hung.start, hung.rate}});
    const GiNaC::symbol &s = hung.coordinate.q[0], &ds = hung.coordinate.v[0];
    (joint.type == Joint::Type::hinge ? hang_on_hinge : hang_on_slider)(line.body, joint, parent, s, ds);
}

// After the body that it hangs on.
void SystemReader::Bodies::move(Line& line) {
    if (line.moves) return;
    line.moves = true;
    if (!line.joint) return move_free_body(line);
    JointLine& hung = joints_[*line.joint];
    if (hung.joint.first) move(lines_[*hung.joint.first]);
    move_on_joint(line, hung);
}

// Those that the other joints do not keep.
void SystemReader::Bodies::add_equations(const JointLine& line) {
    const Joint& joint = line.joint;
    std::size_t upright = 0;
    for (std::size_t k = 1; k < 3; ++k)
        if (std::fabs(number(joint.axis[k])) < std::fabs(number(joint.axis[upright]))) upright = k;
    const RigidBody* const first = joint.first ? &lines_[*joint.first].body : nullptr;
    const RigidBody& second = lines_[joint.second].body;
    const std::vector<ex> equations = equations_of(joint, first, second, upright);
    reader_.declarations_.declare_elements(joint.name, joint.at, equations.size());
    for (std::size_t k = 1; k <= equations.size(); ++k) {
        Constraint constraint{element_name(joint.name, k), fmt::format("{}[{}]", joint.name, k)};
        constraint.text = fmt::format("joint of {} and {}", first != nullptr ? first->name : "ground", second.name);
        constraint.value = moving(second, equations[k - 1], false).expression;
        constraint.at = joint.at;
        reader_.scene_.constraints.push_back(constraint);
    }
    reader_.require_freedom(joint.at, second.plane ? ", or they depend on one another, as those of a third parallel "
                                                     "crank do: leave out a joint that the others keep"
                                                   : ", or they depend on one another, as those of hinges with "
                                                     "parallel axes do; write plane bodies, or leave out a joint");
}

Operand SystemReader::Bodies::moving(const RigidBody& body, const ex& expression, bool velocity) const {
    Operand operand = operand_of(expression);
    if (operand.extent.size > ExpressionLimits::size)
        fail(body.at, fmt::format("the motion of {}, written out, has more than {} operations: too many joints lie "
                                  "between it and the ground",
                                  body.name, ExpressionLimits::size));
    operand.moves = !operand.value && !velocity;
    operand.velocities = !operand.value && velocity;
    return operand;
}

void SystemReader::Bodies::draw(const RigidBody& body) {
    const std::size_t dimension = body.plane ? 2 : 3;
    DrawnBody drawn{body.name, body.plane, {}, {}, body.mass, {}};
    for (std::size_t i = 0; i < dimension; ++i) {
        drawn.place.push_back(body.x[i]);
        for (std::size_t j = 0; j < dimension; ++j) drawn.rotation.push_back(body.R[i][j]);
        if (!body.plane) drawn.inertia.push_back(body.inertia[i][i]);
    }
    if (body.plane) drawn.inertia.push_back(body.inertia[2][2]);
    reader_.scene_.bodies.push_back(drawn);
}

// In columns of the trajectory, what is no coordinate: where it is, if it hangs on a joint, how it is turned, and how
// it turns, in its own frame.
void SystemReader::Bodies::show(const Line& line) {
    const RigidBody& body = line.body;
    std::vector<Column>& columns = reader_.scene_.outputs.columns;
    for (std::size_t k = 0; line.joint && k < (body.plane ? 2 : 3); ++k) {
        std::string name = body.name + "_" + axis_names[k];
        while (reader_.declarations_.is_taken(name)) name += '_';  // by something of the scene's own
        columns.push_back({name, "", body.x[k]});
    }
    if (body.plane) {
        if (line.joint) columns.push_back({body.name + "_angle", "", body.angle});
        columns.push_back({body.name + "_omega", "", body.omega[2]});
        return;
    }
    for (std::size_t k = 0; k < 4; ++k)
        columns.push_back({element_name(body.name + "_orientation", k + 1), "", body.orientation[k]});
    for (std::size_t k = 0; k < 3; ++k)
        columns.push_back({element_name(body.name + "_omega", k + 1), "", body.omega[k]});
}

void SystemReader::Bodies::give_values(const RigidBody& body) {
    const std::size_t dimension = body.plane ? 2 : 3;
    const Vector v = body.velocity_in_space();
    std::map<std::string, Name, std::less<>>& names = reader_.names_.all;
    const auto give = [&](const std::string& part, const std::vector<long>& indices, const ex& value, bool velocity,
                          const std::optional<Operand>& rate = std::nullopt) {
        Name& name = names[body.name + "." + part];
        if (name.definition) name.definition->values[indices] = {true, true, moving(body, value, velocity), rate};
    };
    for (std::size_t i = 0; i < dimension; ++i) {
        give(axis_names[i], {}, body.x[i], false, moving(body, v[i], true));
        for (std::size_t j = 0; j < dimension; ++j) {
            give("R", {static_cast<long>(i + 1), static_cast<long>(j + 1)}, body.R[i][j], false);
            names[body.name + "." + axis_names[i]].row[j] = moving(body, body.R[i][j], false);
        }
        if (!body.plane) give("omega", {static_cast<long>(i + 1)}, body.omega[i], true);
    }
    if (!body.plane) return;
    give("omega", {}, body.omega[2], true);
    give("angle", {}, body.angle, false, moving(body, body.omega[2], true));
}

}  // namespace lobatto
