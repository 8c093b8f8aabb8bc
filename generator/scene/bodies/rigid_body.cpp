// SPDX-License-Identifier: GPL-2.0-or-later
#include "generator/scene/bodies/rigid_body.hpp"

namespace lobatto {
namespace {

using GiNaC::ex;

constexpr std::size_t axes = 3;

Vector operator+(const Vector& a, const Vector& b) {
    return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
Vector operator-(const Vector& a, const Vector& b) {
    return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
Vector operator*(const ex& factor, const Vector& a) {
    return {factor * a[0], factor * a[1], factor * a[2]};
}
Vector cross(const Vector& a, const Vector& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
Matrix transposed(const Matrix& a) {
    Matrix result;
    for (std::size_t i = 0; i < axes; ++i)
        for (std::size_t j = 0; j < axes; ++j) result[i][j] = a[j][i];
    return result;
}
Vector operator*(const Matrix& a, const Vector& v) {
    return {dot(a[0], v), dot(a[1], v), dot(a[2], v)};
}
Matrix operator*(const Matrix& a, const Matrix& b) {
    Matrix result;
    const Matrix columns = transposed(b);
    for (std::size_t i = 0; i < axes; ++i)
        for (std::size_t j = 0; j < axes; ++j) result[i][j] = dot(a[i], columns[j]);
    return result;
}

Vector unit(std::size_t k) {
    Vector result{0, 0, 0};
    result[k] = 1;
    return result;
}

Vector plain(const RigidBody& body, const Vector& a) {
    return {body.plain(a[0]), body.plain(a[1]), body.plain(a[2])};
}

ex square(const Quaternion& q) {
    return q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
}

// 2 q^-1 q' of a quaternion of any length (D53).
Quaternion turning(const Quaternion& q, const Quaternion& d) {
    const ex twice = 2 / square(q);
    return {twice * (q[0] * d[0] + q[1] * d[1] + q[2] * d[2] + q[3] * d[3]),
            twice * (q[0] * d[1] - q[1] * d[0] + q[3] * d[2] - q[2] * d[3]),
            twice * (q[0] * d[2] - q[2] * d[0] + q[1] * d[3] - q[3] * d[1]),
            twice * (q[0] * d[3] - q[3] * d[0] + q[2] * d[1] - q[1] * d[2])};
}

Quaternion product(const Quaternion& a, const Quaternion& b) {
    return {
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3], a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1], a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]};
}

void turn(RigidBody& body, const Quaternion& q, const Quaternion& dq) {
    for (std::size_t k = 0; k < q.size(); ++k) body.orientation[k] = q[k] / sqrt(square(q));
    const Quaternion w = turning(q, dq);
    body.R = rotation_of(q);
    body.omega = {w[1], w[2], w[3]};
    body.stretching = w[0];
}

// About an axis of length 1 (O. Rodrigues 1840).
Matrix rotation_about(const Vector& axis, const ex& angle) {
    Matrix result;
    for (std::size_t i = 0; i < axes; ++i) {
        const Vector swept = cross(axis, unit(i));  // row i of [axis x] is its negative
        for (std::size_t j = 0; j < axes; ++j) {
            const ex along = axis[i] * axis[j];
            result[i][j] = along + cos(angle) * (ex(i == j ? 1 : 0) - along) - sin(angle) * swept[j];
        }
    }
    return result;
}

// A point of space as drawn, and a direction, in the frame of a body; of the ground: space.
Vector point_in(const RigidBody* body, const Vector& point) {
    if (body == nullptr) return point;
    return plain(*body, transposed(body->drawn_rotation) * (point - body->drawn_place));
}
Vector direction_in(const RigidBody* body, const Vector& direction) {
    return body == nullptr ? direction : plain(*body, transposed(body->drawn_rotation) * direction);
}
// And back, as the body moves.
Vector point_of(const RigidBody* body, const Vector& point) {
    return body == nullptr ? point : body->x + body->R * point;
}
Vector direction_of(const RigidBody* body, const Vector& direction) {
    return body == nullptr ? direction : body->R * direction;
}

// The velocity of a point of the parent, and the parent's angular velocity, in its frame.
Vector velocity_at(const RigidBody* parent, const Vector& point) {
    return parent == nullptr ? Vector{0, 0, 0} : parent->velocity_in_body() + cross(parent->omega, point);
}
Vector omega_of(const RigidBody* parent) {
    return parent == nullptr ? Vector{0, 0, 0} : parent->omega;
}

// How the body is turned in the frame of its parent, `turned` in space beside how it is drawn.
struct Relative {
    Matrix rotation;
    ex angle = 0;  // in a plane
    Quaternion orientation = {};
};
Relative relative(const RigidBody& body, const RigidBody* parent, const Vector& axis, const ex& turned) {
    if (body.plane) {
        const ex angle = body.drawn_angle - (parent == nullptr ? ex(0) : parent->drawn_angle) + turned;
        return {rotation_in_plane(angle), angle, {}};
    }
    Matrix rotation =
        parent == nullptr ? body.drawn_rotation : transposed(parent->drawn_rotation) * body.drawn_rotation;
    for (Vector& row : rotation) row = plain(body, row);
    if (!turned.is_zero()) rotation = rotation_about(direction_in(parent, axis), turned) * rotation;
    const ex c = cos(turned / 2), s = sin(turned / 2);
    const Quaternion orientation = product({c, axis[0] * s, axis[1] * s, axis[2] * s}, body.drawn_orientation);
    if (parent == nullptr) return {rotation, 0, orientation};
    const Quaternion& d = parent->drawn_orientation;
    return {rotation, 0, product({d[0], -d[1], -d[2], -d[3]}, orientation)};
}

// R and omega of (D55), without the joint's own turn.
void turn_with(RigidBody& body, const RigidBody* parent, const Relative& relative) {
    body.angle = relative.angle + (parent == nullptr ? ex(0) : parent->angle);
    body.R = body.plane          ? rotation_in_plane(body.angle)
             : parent == nullptr ? relative.rotation
                                 : parent->R * relative.rotation;
    if (!body.plane)
        body.orientation =
            parent == nullptr ? relative.orientation : product(parent->orientation, relative.orientation);
    body.omega = transposed(relative.rotation) * omega_of(parent);
}

}  // namespace

ex dot(const Vector& a, const Vector& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

Matrix rotation_of(const Quaternion& q) {
    const ex n = square(q), twice = 2 / n;
    const auto diagonal = [&](std::size_t k) {
        ex sum = q[0] * q[0];
        for (std::size_t i = 1; i <= axes; ++i) sum += (i == k ? q[i] : -q[i]) * q[i];
        return ex(sum / n);
    };
    return {{{diagonal(1), twice * (q[1] * q[2] - q[0] * q[3]), twice * (q[1] * q[3] + q[0] * q[2])},
             {twice * (q[1] * q[2] + q[0] * q[3]), diagonal(2), twice * (q[2] * q[3] - q[0] * q[1])},
             {twice * (q[1] * q[3] - q[0] * q[2]), twice * (q[2] * q[3] + q[0] * q[1]), diagonal(3)}}};
}

Matrix rotation_in_plane(const ex& angle) {
    return {{{cos(angle), -sin(angle), 0}, {sin(angle), cos(angle), 0}, {0, 0, 1}}};
}

Quaternion rate_of(const Quaternion& q, const Vector& w) {
    return {(-q[1] * w[0] - q[2] * w[1] - q[3] * w[2]) / 2, (q[0] * w[0] + q[2] * w[2] - q[3] * w[1]) / 2,
            (q[0] * w[1] + q[3] * w[0] - q[1] * w[2]) / 2, (q[0] * w[2] + q[1] * w[1] - q[2] * w[0]) / 2};
}

Vector RigidBody::velocity_in_space() const {
    return v_in_space ? v : R * v;
}

Vector RigidBody::velocity_in_body() const {
    return v_in_space ? transposed(R) * v : v;
}

void move_free(RigidBody& body, const Vector& x, const Vector& v, const Quaternion& q, const Quaternion& dq) {
    body.x = x;
    body.v = v;
    turn(body, q, dq);
}

void move_free_in_plane(RigidBody& body, const Vector& x, const Vector& v, const ex& angle, const ex& rate) {
    body.x = x;
    body.v = v;
    body.angle = angle;
    body.R = rotation_in_plane(angle);
    body.omega = {0, 0, rate};
}

void hang_on_ball(RigidBody& body, const Joint& joint, const RigidBody* parent, const Quaternion& q,
                  const Quaternion& dq) {
    turn(body, q, dq);
    const Vector there = point_in(parent, joint.point), lever = ex(-1) * point_in(&body, joint.point);
    body.x = point_of(parent, there) + body.R * lever;
    body.v = transposed(body.R) * direction_of(parent, velocity_at(parent, there)) + cross(body.omega, lever);
    body.v_in_space = false;
}

void hang_on_hinge(RigidBody& body, const Joint& joint, const RigidBody* parent, const ex& s, const ex& ds) {
    const Relative turned = relative(body, parent, joint.axis, s);
    turn_with(body, parent, turned);
    body.omega = body.omega + ds * direction_in(&body, joint.axis);
    const Vector there = point_in(parent, joint.point), lever = ex(-1) * point_in(&body, joint.point);
    body.x = point_of(parent, there) + body.R * lever;
    body.v = transposed(turned.rotation) * velocity_at(parent, there) + cross(body.omega, lever);
    body.v_in_space = false;
}

void hang_on_slider(RigidBody& body, const Joint& joint, const RigidBody* parent, const ex& s, const ex& ds) {
    const Relative turned = relative(body, parent, joint.axis, 0);
    turn_with(body, parent, turned);
    const Vector along = direction_in(parent, joint.axis), there = point_in(parent, body.drawn_place) + s * along;
    body.x = point_of(parent, there);
    body.v = transposed(turned.rotation) * (velocity_at(parent, there) + ds * along);
    body.v_in_space = false;
}

// (D56)
std::vector<ex> equations_of(const Joint& joint, const RigidBody* first, const RigidBody& second, std::size_t upright) {
    const Vector start = point_of(first, point_in(first, joint.point));
    const auto on_second = [&](const Vector& point) { return point_of(&second, point_in(&second, point)); };
    if (joint.type == Joint::Type::distance) {
        const Vector way = on_second(joint.to) - start, drawn = joint.to - joint.point;
        return {dot(way, way) - (joint.length ? *joint.length * *joint.length : dot(drawn, drawn))};
    }
    const std::size_t dimension = second.plane ? 2 : 3;
    const Vector side = second.plane ? cross(unit(2), joint.axis) : cross(joint.axis, unit(upright)),
                 other = cross(joint.axis, side);
    const auto turned = [&](const Vector& direction) { return second.R * direction_in(&second, direction); };
    const auto held = [&](const Vector& direction) { return direction_of(first, direction_in(first, direction)); };
    std::vector<ex> equations;
    if (joint.type == Joint::Type::slider) {
        const Vector way = second.x - point_of(first, point_in(first, second.drawn_place));
        equations.push_back(dot(way, held(side)));
        if (second.plane) {
            const ex drawn = second.drawn_angle - (first == nullptr ? ex(0) : first->drawn_angle);
            equations.push_back(second.angle - (first == nullptr ? ex(0) : first->angle) - drawn);
            return equations;
        }
        equations.push_back(dot(way, held(other)));
        equations.push_back(dot(held(side), turned(other)));
    } else {
        const Vector gap = on_second(joint.point) - start;
        equations.assign(gap.begin(), gap.begin() + dimension);
    }
    if (!second.plane && joint.type != Joint::Type::ball)
        for (const Vector& across : {side, other}) equations.push_back(dot(held(joint.axis), turned(across)));
    return equations;
}

// The length of the quaternion has a kinetic energy of its own, which stays 0 (D54).
ex kinetic_energy(const RigidBody& body) {
    const ex mean = body.plane ? ex(0) : (body.inertia[0][0] + body.inertia[1][1] + body.inertia[2][2]) / 3;
    return body.mass * dot(body.v, body.v) / 2 + dot(body.omega, body.inertia * body.omega) / 2 +
           mean * body.stretching * body.stretching / 4;
}

}  // namespace lobatto
