// SPDX-License-Identifier: GPL-2.0-or-later
#include "generator/emit/measured.hpp"

#include <fmt/format.h>

#include <set>

#include "generator/emit/function_text.hpp"
#include "generator/emit/tables.hpp"
#include "generator/formula/spline.hpp"

namespace lobatto {

namespace {

// Which splines occur in what a kernel computes.
std::set<int> splines_of(const Programs& programs) {
    std::set<int> numbers;
    for (Id id = 0; id < programs.graph.size(); ++id)
        if (programs.graph[id].op == Op::table) numbers.insert(programs.graph[id].index / 4);
    return numbers;
}

}  // namespace

std::string measured_values(const Programs& programs, Precision precision) {
    std::string text;
    for (const int number : splines_of(programs)) {
        const Spline& spline = spline_of(number);
        std::vector<cln::cl_R> coefficients;
        for (const auto& piece : spline.coefficients())
            coefficients.insert(coefficients.end(), piece.begin(), piece.end());
        text += fmt::format(
            "\n    // Measured values, {}: knots x, and between them cubic polynomials in u - x[i] (D61).\n"
            "    struct {} {{\n        static constexpr int points = {};\n",
            comment_safe(spline.file()), spline_name(number), spline.x().size());
        text += value_table("x", spline.x(), precision) + value_table("c", coefficients, precision) + "    };\n";
    }
    return text;
}

}  // namespace lobatto
