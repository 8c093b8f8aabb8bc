// SPDX-License-Identifier: GPL-2.0-or-later
// Where a rigid body is, how it moves and its kinetic energy: free, or hung on another one by a joint (D53).
#pragma once

#include <ginac/ginac.h>

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "generator/formula/text/source.hpp"

namespace lobatto {

using Vector = std::array<GiNaC::ex, 3>;
using Matrix = std::array<Vector, 3>;  // rows
using Quaternion = std::array<GiNaC::ex, 4>;

GiNaC::ex dot(const Vector& a, const Vector& b);
// That of a quaternion of any length but 0; that about the third axis.
Matrix rotation_of(const Quaternion& q);
Matrix rotation_in_plane(const GiNaC::ex& angle);
// q' of a body that turns with w, in its own frame.
Quaternion rate_of(const Quaternion& q, const Vector& w);

// Vectors of bodies in a plane have the third component 0, of angular velocities the other two.
struct RigidBody {
    std::string name;
    Position at = {};
    bool plane = false;
    GiNaC::ex mass = 0;
    Matrix inertia = {};  // about the centre of mass, in the frame of the body

    // As it is drawn: where it is while no joint has moved.
    Vector drawn_place = {};
    GiNaC::ex drawn_angle = 0;  // in a plane
    Matrix drawn_rotation = {};
    Quaternion drawn_orientation = {1, 0, 0, 0};  // of length 1
    // 0, 1 and -1 where a formula has this value whatever the parameters.
    std::function<GiNaC::ex(const GiNaC::ex&)> plain = [](const GiNaC::ex& formula) { return formula; };

    // As it moves: x and R lead from its frame to space, v is that of its centre.
    Vector x = {};
    GiNaC::ex angle = 0;  // in a plane
    Matrix R = {};
    Quaternion orientation = {1, 0, 0, 0};  // of length 1, in space; not in a plane
    Vector omega = {};                      // in its own frame
    Vector v = {};
    bool v_in_space = true;    // else in its own frame
    GiNaC::ex stretching = 0;  // rate of the logarithm of the quaternion's length, twice

    Vector velocity_in_space() const;
    Vector velocity_in_body() const;
};

// What a joint leaves free: a turn about a point, a turn about an axis, a way along an axis; a distance.
struct Joint {
    enum class Type { ball, hinge, slider, distance };
    std::string name;
    Position at = {};
    Type type = Type::ball;
    std::optional<std::size_t> first;  // none: the ground
    std::size_t second = 0;
    bool closes = false;         // a loop: by constraints
    bool asked_for = false;      // these constraints, though there is no loop
    Vector point = {}, to = {};  // in space, as drawn; a distance leads from the point on the first body
    Vector axis = {};            // of length 1
    std::optional<GiNaC::ex> length;
};

// The motion of a body without joint, of one on a ball joint, and of one on a hinge or slider whose coordinate is s
// with the rate ds. `parent`: nullptr for the ground.
void move_free(RigidBody& body, const Vector& x, const Vector& v, const Quaternion& q, const Quaternion& dq);
void move_free_in_plane(RigidBody& body, const Vector& x, const Vector& v, const GiNaC::ex& angle,
                        const GiNaC::ex& rate);
void hang_on_ball(RigidBody& body, const Joint& joint, const RigidBody* parent, const Quaternion& q,
                  const Quaternion& dq);
void hang_on_hinge(RigidBody& body, const Joint& joint, const RigidBody* parent, const GiNaC::ex& s,
                   const GiNaC::ex& ds);
void hang_on_slider(RigidBody& body, const Joint& joint, const RigidBody* parent, const GiNaC::ex& s,
                    const GiNaC::ex& ds);

// What is 0 while the joint holds. `upright`: the axis of space that is furthest from the joint's own.
std::vector<GiNaC::ex> equations_of(const Joint& joint, const RigidBody* first, const RigidBody& second,
                                    std::size_t upright);

GiNaC::ex kinetic_energy(const RigidBody& body);

}  // namespace lobatto
