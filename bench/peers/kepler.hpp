// SPDX-License-Identifier: GPL-2.0-or-later
// Kepler's problem in closed form, by the difference of eccentric anomalies (J. M. A. Danby, Fundamentals of Celestial
// Mechanics, 1988, 6.8): bound orbits from any start, mu = 1.
#pragma once

#include "bench/problems.hpp"

namespace lobatto::bench {

inline State<__float128, 2> kepler_after(const State<__float128, 2>& start, __float128 t) {
    using Quad = __float128;
    const Quad x = start.q[0], y = start.q[1], u = start.p[0], v = start.p[1];
    const Quad r0 = square_root(x * x + y * y), radial = x * u + y * v;
    const Quad a = 1 / (2 / r0 - (u * u + v * v)), root = square_root(a), mean_motion = 1 / (a * root);
    // n t = E + (r v / sqrt a) (1 - cos E) - (1 - r0/a) sin E, from the nearest whole revolution by Newton's iteration
    // with halved steps where it goes astray: the left side rises with E.
    const Quad pi = 2 * asinq(Quad(1)), wanted = mean_motion * t, turns = floorq(wanted / (2 * pi) + Quad(0.5));
    const Quad rest = wanted - 2 * pi * turns, ecosine = 1 - r0 / a, esine = radial / root;
    Quad low = -2 * pi, high = 2 * pi, E = rest;
    for (int iteration = 0; iteration < 200; ++iteration) {
        const Quad error = E + esine * (1 - cosine(E)) - ecosine * sine(E) - rest;
        (error > 0 ? high : low) = E;
        const Quad next = E - error / (1 + esine * sine(E) - ecosine * cosine(E));
        const Quad before = E;
        E = next > low && next < high ? next : (low + high) / 2;
        if (magnitude(E - before) < Quad(1e-33)) break;
    }
    const Quad s = sine(E), c = cosine(E), r = a * (1 + esine * s - ecosine * c);
    const Quad f = 1 - a / r0 * (1 - c), g = (rest - E + s) / mean_motion;
    const Quad slope_f = -root / (r * r0) * s, slope_g = 1 - a / r * (1 - c);
    return {{f * x + g * u, f * y + g * v}, {slope_f * x + slope_g * u, slope_f * y + slope_g * v}};
}

}  // namespace lobatto::bench
