// SPDX-License-Identifier: MIT
// Inverse sine, cosine and tangent of packs, and the angle of a point.
#ifndef LOBATTO_KERNEL_ARC_HPP
#define LOBATTO_KERNEL_ARC_HPP

#include "functions.hpp"
#include "numbers.hpp"
#include "pack.hpp"

namespace lobatto {

namespace functions {

// atan |x| = atan c + atan((|x| - c) / (1 + c |x|)), c = 0, 1/2, 1, 3/2 or infinity; polynomial and constants as
// published with FDLIBM.
template <int width>
LOBATTO_INLINE Doubles<width> atan(const Doubles<width>& x) {
    using P = Doubles<width>;
    const P y = fabs(x);
    P upper = y, lower = 1.0, high = 0.0, low = 0.0;
    const auto from = [&](double bound, const P& numerator, const P& denominator, double angle, double angle_low)
        __attribute__((always_inline)) {
        const Where<width> above = y >= bound;
        upper = select(above, numerator, upper);
        lower = select(above, denominator, lower);
        high = select(above, P(angle), high);
        low = select(above, P(angle_low), low);
    };
    from(0.4375, 2.0 * y - 1.0, 2.0 + y, 4.63647609000806093515e-01, 2.26987774529616870924e-17);
    from(0.6875, y - 1.0, y + 1.0, 7.85398163397448278999e-01, 3.06161699786838301793e-17);
    from(1.1875, y - 1.5, fused(y, P(1.5), P(1.0)), 9.82793723247329054082e-01, 1.39033110312309984516e-17);
    from(2.4375, P(-1.0), y, 1.57079632679489655800e+00, 6.12323399573676603587e-17);
    const P t = upper / lower;
    const P z = t * t;
    const P w = z * z;
    const P w2 = w * w;
    const P tail = fused(w2 * w2,
                         fused(w, P(1.62858201153657823623e-02),
                               fused(z, P(-3.65315727442169155270e-02), P(4.97687799461593236017e-02))),
                         fused(w2,
                               fused(w, fused(z, P(-5.83357013379057348645e-02), P(6.66107313738753120669e-02)),
                                     fused(z, P(-7.69187620504482999495e-02), P(9.09088713343650656196e-02))),
                               fused(w, fused(z, P(-1.11111104054623557880e-01), P(1.42857142725034663711e-01)),
                                     fused(z, P(-1.99999999998764832476e-01), P(3.33333333333329318027e-01)))));
    return with_sign_of(x, high - (fused(t * z, tail, -low) - t));
}

// asin x = x + x R(x^2) for |x| < 1/2, R as published with FDLIBM, else pi/2 - 2 asin sqrt((1 - |x|) / 2).
template <int width>
struct Arc {
    Where<width> large;         // |x| >= 1/2, where the following belong to
    Doubles<width> root;        // sqrt((1 - |x|) / 2), else |x|
    Doubles<width> head, rest;  // root = head + rest, head of 21 bits
    Doubles<width> R;

    LOBATTO_INLINE explicit Arc(const Doubles<width>& x) {
        using P = Doubles<width>;
        const P y = fabs(x);
        large = y >= 0.5;
        const P z = select(large, fused(y, P(-0.5), P(0.5)), y * y);
        root = select(large, sqrt(z), y);
        head = from_bits(bits(root) & Words<width>(-(std::int64_t(1) << 32)));
        rest = (z - head * head) / (root + head + std::numeric_limits<double>::min());
        const P z2 = z * z;
        const P numerator = fused(z2 * z2, fused(z, P(3.47933107596021167570e-05), P(7.91534994289814532176e-04)),
                                  fused(z2, fused(z, P(-4.00555345006794114027e-02), P(2.01212532134862925881e-01)),
                                        fused(z, P(-3.25565818622400915405e-01), P(1.66666666666666657415e-01))));
        const P denominator = fused(z2,
                                    fused(z2, P(7.70381505559019352791e-02),
                                          fused(z, P(-6.88283971605453293030e-01), P(2.02094576023350569471e+00))),
                                    fused(z, P(-2.40339491173441421878e+00), P(1.0)));
        R = z * (numerator / denominator);
    }
};
constexpr double half_pi = 1.57079632679489655800e+00, half_pi_low = 6.12323399573676603587e-17;

template <int width>
LOBATTO_INLINE Doubles<width> asin(const Doubles<width>& x) {
    using P = Doubles<width>;
    const Arc<width> arc(x);
    const P small = fused(arc.root, arc.R, arc.root);
    const P far = (half_pi_low - 2.0 * arc.rest) - 2.0 * (arc.root * arc.R);
    const P half = 0.5 * half_pi;  // pi/4 twice, so that the first difference is exact
    return with_sign_of(x, select(arc.large, half + ((half - 2.0 * arc.head) + far), small));
}
template <int width>
LOBATTO_INLINE Doubles<width> acos(const Doubles<width>& x) {
    using P = Doubles<width>;
    const Arc<width> arc(x);
    const P t = arc.root * arc.R;
    const P small = half_pi - (x - (half_pi_low - with_sign_of(x, t)));
    const P near_one = 2.0 * (arc.head + (arc.rest + t));
    const P near_minus_one = 2.0 * (half_pi - (arc.root + (t - half_pi_low)));
    return select(arc.large, select(x < 0.0, near_minus_one, near_one), small);
}

// The angle of (x, y), -pi to pi: atan of the smaller over the larger of |x| and |y|, from the axis that is near.
template <int width>
LOBATTO_INLINE Doubles<width> atan2(const Doubles<width>& y, const Doubles<width>& x) {
    using P = Doubles<width>;
    const P up = fabs(y), along = fabs(x);
    const Where<width> steep = up > along, behind = x < 0.0;
    const P near = atan(select(steep, along, up) / select(steep, up, along));
    const P axis = select(steep, P(half_pi), select(behind, P(2.0 * half_pi), P(0.0)));
    const P axis_low = select(steep, P(half_pi_low), select(behind, P(2.0 * half_pi_low), P(0.0)));
    const P turned = select(steep, select(behind, near, -near), select(behind, -near, near));
    return with_sign_of(y, axis + (turned + axis_low));
}

}  // namespace functions

LOBATTO_FUNCTION(asin)
LOBATTO_FUNCTION(acos)
LOBATTO_FUNCTION(atan)

#define LOBATTO_FUNCTION_OF_TWO(type, suffix)                   \
    template <class real>                                       \
    inline Only<real, type> atan2(real y, Only<real, type> x) { \
        return __builtin_atan2##suffix(y, x);                   \
    }
LOBATTO_FUNCTION_OF_TWO(float, f)
LOBATTO_FUNCTION_OF_TWO(double, )
LOBATTO_FUNCTION_OF_TWO(long double, l)
#undef LOBATTO_FUNCTION_OF_TWO
#ifdef LOBATTO_USE_FLOAT128
inline __float128 atan2(__float128 y, __float128 x) {
    return atan2q(y, x);
}
#endif
template <class real, int width>
LOBATTO_INLINE Pack<real, width> atan2(const Pack<real, width>& y, const Pack<real, width>& x) {
    using Numbers = Pack<real, width>;
    constexpr int count = Numbers::count;
    if constexpr (std::is_same_v<real, double>) {
        LOBATTO_PARTS(Numbers, functions::atan2(functions::single(y, i), functions::single(x, i)).part[0]);
    } else if constexpr (std::is_same_v<real, float>) {
        return functions::narrowed(atan2(functions::widened(y), functions::widened(x)));
    } else {
        LOBATTO_PARTS(Numbers, lobatto::atan2(y.part[i], x.part[i]));
    }
}
template <class real, int width>
LOBATTO_INLINE Pack<real, width> atan2(const Pack<real, width>& y, real_of<Pack<real, width>> x) {
    return atan2(y, Pack<real, width>(x));
}
template <class real, int width>
LOBATTO_INLINE Pack<real, width> atan2(real_of<Pack<real, width>> y, const Pack<real, width>& x) {
    return atan2(Pack<real, width>(y), x);
}

}  // namespace lobatto

#endif
