// SPDX-License-Identifier: GPL-2.0-or-later
// What to draw of a scene: its [view], or what the names and kinds of its coordinates tell.
#pragma once

#include <vector>

#include "generator/scene/scene.hpp"

namespace lobatto {

// A figure, and how it looks: things that never move are grey; figures of one colour belong together.
struct DrawnFigure {
    MovingFigure figure;
    int colour = 0;
    bool still = false;
    bool many = false;     // one of many points
    bool profile = false;  // values over an index: the two axes are of different kinds
};

// Those of [view] and of [bodies]. Without either: bodies in the plane or in space (x, y, z, alone or arrays), with the
// rods between them; places that the scene defines; polar and spherical coordinates; the profile of a long array; hands
// for angles; beads on lines for the rest.
std::vector<DrawnFigure> figures_of(const Scene& scene);

}  // namespace lobatto
