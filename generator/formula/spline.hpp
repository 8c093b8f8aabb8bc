// SPDX-License-Identifier: GPL-2.0-or-later
// Measured values in formulas: table("torque.csv", t), a cubic spline through the points of a file.
#pragma once

#include <cln/real.h>
#include <ginac/ginac.h>

#include <array>
#include <string>
#include <vector>

namespace lobatto {

// Twice continuously differentiable; the third derivative jumps at its knots but for the second and the last but one
// ("not a knot"). Numbers of 60 digits.
class Spline {
public:
    static constexpr std::size_t most_points = 10000;

    // x ascending, at least two.
    Spline(std::string file, std::vector<cln::cl_R> x, const std::vector<cln::cl_R>& y);

    const std::string& file() const { return file_; }
    const std::vector<cln::cl_R>& x() const { return x_; }
    // On the piece from x[i] on, of powers of u - x[i].
    const std::vector<std::array<cln::cl_R, 4>>& coefficients() const { return coefficients_; }

    bool covers(const cln::cl_R& u) const;
    // A derivative of this order at u, which it covers.
    cln::cl_R operator()(int order, const cln::cl_R& u) const;
    double operator()(int order, double u) const;  // not a number outside

private:
    std::string file_;
    std::vector<cln::cl_R> x_;
    std::vector<std::array<cln::cl_R, 4>> coefficients_;
    std::vector<double> rounded_x_;
    std::vector<std::array<double, 4>> rounded_;
};

// Splines that were read stay until the program ends. They have numbers that follow from their content, so that the
// same scene gives the same text everywhere.
constexpr int most_splines = 1 << 28;
int number_of(Spline spline);
const Spline& spline_of(int number);
std::string spline_name(int number);  // in code: table_1a2b3c4

// The function in expressions: its number, the order of its derivative, and where.
DECLARE_FUNCTION_3P(table_value)
bool is_table_value(const GiNaC::ex& expression);

// The points of a file with two columns, as a spline. Throws InputError with line and column in it.
class Source;
Spline read_spline(const Source& file, const std::string& name);

}  // namespace lobatto
