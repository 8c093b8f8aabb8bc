// SPDX-License-Identifier: GPL-2.0-or-later
// Numbers of 60 digits as scalars of Eigen's matrices, and decompositions of these, compiled once.
#pragma once

#include <cln/cln.h>

#include <Eigen/Core>
#include <optional>
#include <type_traits>

#include "generator/graph/graph.hpp"

namespace lobatto {

// CLN computes in the shorter of two operands' formats: so every number here has all digits.
struct Wide {
    cln::cl_F value;

    Wide() : Wide(0.0) {}
    // Only numbers turn into a Wide by themselves: the compiler asks this of every expression of a matrix.
    template <class Number>
    requires std::is_arithmetic_v<Number> Wide(Number x) : Wide(cln::cl_R(static_cast<double>(x))) {}
    explicit Wide(const cln::cl_R& x) : value(cln::cl_float(x, cln::float_format(number_digits))) {}
    explicit operator double() const { return cln::double_approx(value); }

    Wide& operator+=(const Wide& x) { return *this = *this + x; }
    Wide& operator-=(const Wide& x) { return *this = *this - x; }
    Wide& operator*=(const Wide& x) { return *this = *this * x; }
    Wide& operator/=(const Wide& x) { return *this = *this / x; }
    friend Wide operator-(const Wide& x) { return Wide(-x.value); }
    friend Wide operator+(const Wide& x, const Wide& y) { return Wide(x.value + y.value); }
    friend Wide operator-(const Wide& x, const Wide& y) { return Wide(x.value - y.value); }
    friend Wide operator*(const Wide& x, const Wide& y) { return Wide(x.value * y.value); }
    friend Wide operator/(const Wide& x, const Wide& y) { return Wide(x.value / y.value); }
    friend bool operator==(const Wide& x, const Wide& y) { return x.value == y.value; }
    friend bool operator<(const Wide& x, const Wide& y) { return x.value < y.value; }
    friend bool operator>(const Wide& x, const Wide& y) { return x.value > y.value; }
    friend bool operator<=(const Wide& x, const Wide& y) { return x.value <= y.value; }
    friend bool operator>=(const Wide& x, const Wide& y) { return x.value >= y.value; }
};

inline Wide abs(const Wide& x) {
    return Wide(cln::abs(x.value));
}
inline Wide sqrt(const Wide& x) {
    return Wide(cln::sqrt(x.value));
}
// What CLN cannot represent it throws.
inline bool isfinite(const Wide&) {
    return true;
}
inline bool isinf(const Wide&) {
    return false;
}
inline bool isnan(const Wide&) {
    return false;
}

}  // namespace lobatto

template <>
struct Eigen::NumTraits<lobatto::Wide> : Eigen::GenericNumTraits<lobatto::Wide> {
    enum {
        IsComplex = 0,
        IsInteger = 0,
        IsSigned = 1,
        RequireInitialization = 1,
        ReadCost = 8,
        AddCost = 80,
        MulCost = 120
    };
    static lobatto::Wide epsilon() { return 1e-58; }
    static lobatto::Wide dummy_precision() { return 1e-50; }
    static int digits10() { return lobatto::number_digits; }
};

namespace lobatto {

using WideMatrix = Eigen::Matrix<Wide, Eigen::Dynamic, Eigen::Dynamic>;

// As those of runtime/measure/linear_algebra.hpp, to 60 digits inside; what they give is rounded to doubles.
std::optional<Eigen::VectorXd> generalised_eigenvalues(const WideMatrix& S, const WideMatrix& M);
std::optional<Eigen::VectorXcd> eigenvalues(const WideMatrix& A);

// A^-1 B; nothing where a pivot of A is at most `threshold` of the largest.
std::optional<WideMatrix> solution(const WideMatrix& A, const WideMatrix& B, double threshold);
// The number of columns less the rank.
int dimension_of_kernel(const WideMatrix& A, double threshold);

}  // namespace lobatto
