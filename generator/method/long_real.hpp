// SPDX-License-Identifier: GPL-2.0-or-later
// Real numbers of 220 digits, with the face of Surd: for rules whose nodes lie in no quadratic field.
#pragma once

#include <cln/cln.h>
#include <ginac/ginac.h>

#include <utility>

namespace lobatto {

struct LongReal {
    static constexpr int digits = 220;  // of every operation
    static constexpr int kept = 150;    // of a result: what rounding spoils is cut off, equal numbers become equal
    static constexpr int noise_digits = 170;  // a difference below 10^-170 is rounding

    cln::cl_F value = to_float(0);

    LongReal() = default;
    LongReal(const GiNaC::numeric& rational) : value(to_float(cln::the<cln::cl_R>(rational.to_cl_N()))) {}
    LongReal(int integer) : value(to_float(integer)) {}
    explicit LongReal(const cln::cl_F& real) : value(real) {}

    static constexpr bool exact = false;
    bool is_zero() const { return is_noise(value); }
    static constexpr int radicand() { return 1; }
    // Integers and halves are recognised and exact.
    GiNaC::ex expression() const {
        const cln::cl_I twice = cln::round1(2 * value);
        if (is_noise(2 * value - twice)) return GiNaC::numeric(twice) / GiNaC::numeric(2);
        return GiNaC::numeric(cln::cl_float(value, cln::float_format(kept)));
    }

    friend LongReal operator+(const LongReal& x, const LongReal& y) { return LongReal(x.value + y.value); }
    friend LongReal operator-(const LongReal& x, const LongReal& y) { return LongReal(x.value - y.value); }
    friend LongReal operator*(const LongReal& x, const LongReal& y) { return LongReal(x.value * y.value); }
    friend LongReal operator/(const LongReal& x, const LongReal& y) { return LongReal(x.value / y.value); }

private:
    static cln::cl_F to_float(const cln::cl_R& x) { return cln::cl_float(x, cln::float_format(digits)); }
    static bool is_noise(const cln::cl_R& x) {
        static const cln::cl_F bound = to_float(cln::expt(cln::cl_RA(10), -noise_digits));
        return cln::abs(x) < bound;
    }
};

inline LongReal root(const LongReal& square) {
    return LongReal(cln::sqrt(square.value));
}

}  // namespace lobatto
