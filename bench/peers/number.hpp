// SPDX-License-Identifier: GPL-2.0-or-later
// Coefficients as their papers print them, to 113 bits; elementary functions of every number type.
#pragma once

#include <cmath>
#include <string_view>

extern "C" {  // of libquadmath
__float128 sinq(__float128) noexcept;
__float128 cosq(__float128) noexcept;
__float128 sqrtq(__float128) noexcept;
__float128 asinq(__float128) noexcept;
__float128 floorq(__float128) noexcept;
}

namespace lobatto::bench {

// "-0.0317", "7.5e-3" or "7/2400": the value of a decimal number or of a quotient of two integers. Each has a rounding
// error below 1e-33: digits and the powers of ten up to 10^48 are exact, or nearly.
constexpr __float128 exact(std::string_view text) {
    if (const auto slash = text.find('/'); slash != text.npos)
        return exact(text.substr(0, slash)) / exact(text.substr(slash + 1));
    __float128 digits = 0, scale = 1;
    bool negative = false, after_point = false;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const char c = text[i];
        if (c == '-') negative = true;
        if (c == '.') after_point = true;
        if (c == 'e') {
            const bool small = text[i + 1] == '-';
            int exponent = 0;
            for (std::size_t j = i + (small ? 2 : 1); j < text.size(); ++j) exponent = 10 * exponent + (text[j] - '0');
            for (; exponent > 0; --exponent) (small ? scale : digits) *= 10;
            break;
        }
        if (c < '0' || c > '9') continue;
        digits = 10 * digits + (c - '0');
        if (after_point) scale *= 10;
    }
    return (negative ? -digits : digits) / scale;
}

template <class real>
real sine(real x) {
    return std::sin(x);
}
template <>
inline __float128 sine(__float128 x) {
    return sinq(x);
}
template <class real>
real cosine(real x) {
    return std::cos(x);
}
template <>
inline __float128 cosine(__float128 x) {
    return cosq(x);
}
template <class real>
real square_root(real x) {
    return std::sqrt(x);
}
template <>
inline __float128 square_root(__float128 x) {
    return sqrtq(x);
}
template <class real>
real magnitude(real x) {
    return x < 0 ? -x : x;
}

}  // namespace lobatto::bench
