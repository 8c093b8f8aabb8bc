// SPDX-License-Identifier: MIT
// Sines and cosines of a formula's angles from those of angles near them, without reduction of the argument.
//
// By the addition theorems, with delta = x - x0,
//     sin x = sin x0 + (cos x0 sin delta + sin x0 (cos delta - 1)),
//     cos x = cos x0 + (cos x0 (cos delta - 1) - sin x0 sin delta),
// where |delta| <= pi/4, which is as far as the polynomials of base/trigonometry.hpp reach. The error is absolute:
// below 2.1 units of 2^-53 (tests/runtime/kernel/vector_functions_test.cpp). A function of a kernel that holds `angles`
// of them (node or stage, see base/contract.hpp) asks its last argument for each, by its number: AnglesAnew, AnglesKept
// or AnglesNear.
#ifndef LOBATTO_KERNEL_ANGLES_HPP
#define LOBATTO_KERNEL_ANGLES_HPP

#include "numbers.hpp"
#include "pack.hpp"
#include "trigonometry.hpp"

namespace lobatto {

// By the full functions.
struct AnglesAnew {
    template <class T>
    LOBATTO_INLINE void sincos(int, const T& x, T& sine, T& cosine) const {
        lobatto::sincos(x, sine, cosine);
    }
};

template <class T>
struct Angle {
    T x, sine, cosine;
};

// By the full functions; what they gave is kept.
template <class T>
struct AnglesKept {
    Angle<T>* angles;

    LOBATTO_INLINE void sincos(int i, const T& x, T& sine, T& cosine) const {
        lobatto::sincos(x, sine, cosine);
        angles[i] = {x, sine, cosine};
    }
};

namespace functions {

constexpr double near_below = 0.7853981633974483;  // pi/4

// x, in the lanes that are too far from `angle`, takes its place there.
template <class T>
[[gnu::cold]] LOBATTO_APART void recentre(Angle<T>& angle, const T& x) {
    const auto near = fabs(x - angle.x) <= near_below;  // not where one of them is not a number
    T sine, cosine;
    lobatto::sincos(x, sine, cosine);
    angle.x = select(near, angle.x, x);
    angle.sine = select(near, angle.sine, sine);
    angle.cosine = select(near, angle.cosine, cosine);
}

// The sine and cosine of x0 + delta from those of x0.
template <int width>
LOBATTO_INLINE void turn(const Doubles<width>& delta, const Doubles<width>& sine0, const Doubles<width>& cosine0,
                         Doubles<width>& sine, Doubles<width>& cosine) {
    using P = Doubles<width>;
    const P z = delta * delta;
    const P z2 = z * z;
    const P rise = fused(-(z * delta), sine_series(z, z2), delta);  // sin delta
    const P fall = fused(z2, cosine_series(z, z2), z * -0.5);       // cos delta - 1
    sine = sine0 + fused(cosine0, rise, sine0 * fall);
    cosine = cosine0 + fused(-sine0, rise, cosine0 * fall);
}

}  // namespace functions

// From the angles kept, T = Pack<double, width>; where one is beyond pi/4, its place is taken.
template <class T>
struct AnglesNear {
    Angle<T>* angles;

    LOBATTO_INLINE void sincos(int number, const T& x, T& sine, T& cosine) const {
        Angle<T>& near = angles[number];
        T delta = x - near.x;
        if (__builtin_expect(!all(fabs(delta) <= functions::near_below), 0)) {
            functions::recentre(near, x);
            delta = x - near.x;
        }
        using functions::single;
        constexpr int count = T::count;
        Pack<double, T::lanes> one_sine, one_cosine;
        LOBATTO_EACH(
            functions::turn(single(delta, i), single(near.sine, i), single(near.cosine, i), one_sine, one_cosine),
            sine.part[i] = one_sine.part[0], cosine.part[i] = one_cosine.part[0]);
    }
};

// Room for the `count` angles of each of `places`: none where there are none.
template <class T, int places, int count>
struct AngleTable {
    Angle<T> angles[places * count];

    LOBATTO_DEVICE Angle<T>* of(int place) { return angles + place * count; }
};
template <class T, int places>
struct AngleTable<T, places, 0> {};

}  // namespace lobatto

#endif
