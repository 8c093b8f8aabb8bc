// SPDX-License-Identifier: GPL-2.0-or-later
#include "generator/mechanics/structure/quadratic_part.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "generator/formula/real.hpp"
#include "generator/mechanics/algebra/constant_part.hpp"
#include "generator/mechanics/algebra/sample.hpp"
#include "generator/mechanics/repeated/elements.hpp"
#include "generator/mechanics/structure/findings.hpp"

namespace lobatto {
namespace {

using GiNaC::ex;

// Entries of M^-1 V'' from terms that are not written out; their masses are constant.
void add_unwritten(std::map<std::pair<int, int>, double>& curvatures, const System& system, Formulas& start) {
    std::vector<ex> masses;
    for (std::size_t k = 0; k < system.q.size(); ++k) masses.push_back(system.mass(k, k));
    const std::vector<cln::cl_R> mass = start(masses);
    for (const Element& element : system.unwritten.elements) {
        const auto pairs = pairs_of(element);
        std::vector<ex> derivatives;
        for (const auto& [i, j] : pairs) derivatives.push_back(element.term.diff(element.x[i]).diff(element.x[j]));
        at_rows(element, derivatives, system, start, [&](std::size_t r, const std::vector<cln::cl_R>& values) {
            for (std::size_t p = 0; p < pairs.size(); ++p) {
                const int row = element.rows[r][pairs[p].first], column = element.rows[r][pairs[p].second];
                curvatures[{row, column}] += cln::double_approx(values[p] / mass[static_cast<std::size_t>(row)]);
            }
        });
    }
}

// h^2 |A| |entries|, where those of M^-1 V'' stand, at the start; norms of largest row sums.
double contraction_of(const std::vector<ex>& entries, const Scene& scene, const System& system,
                      const Quadrature& quadrature) {
    Formulas formulas;
    for (const Parameter& parameter : scene.parameters)
        formulas.set(parameter.symbol, float_of(scene.evaluate(parameter.value, "the parameter " + parameter.name)));
    for (std::size_t k = 0; k < scene.coordinates.size(); ++k)
        formulas.set(system.q[k], float_of(scene.evaluate(scene.initial_position[k], "the initial position")));
    formulas.set(system.t, cln::cl_float(0, cln::float_format(number_digits)));
    const std::vector<cln::cl_R> values = formulas(entries);
    std::map<std::pair<int, int>, double> curvatures;
    std::size_t e = 0;
    for (const auto& [place, value] : system.hessian.entries()) curvatures[place] += cln::double_approx(values[e++]);
    add_unwritten(curvatures, system, formulas);
    std::map<int, double> rows;
    for (const auto& [place, curvature] : curvatures) rows[place.first] += std::fabs(curvature);
    double largest = 0, stage = 0;
    for (const auto& [row, sum] : rows) largest = std::max(largest, sum);
    for (unsigned i = 0; i < quadrature.A.rows(); ++i) {
        double sum = 0;
        for (unsigned j = 0; j < quadrature.A.cols(); ++j)
            sum += std::fabs(GiNaC::ex_to<GiNaC::numeric>(quadrature.A(i, j).evalf()).to_double());
        stage = std::max(stage, sum);
    }
    const double h = scene.evaluate(scene.run.step, "the step").to_double();
    return h * h * stage * largest;
}

}  // namespace

QuadraticPart find_quadratic_part(const Scene& scene, const System& system, const Quadrature& quadrature) {
    QuadraticPart part{SparseMatrix(system.n, system.n), false, false, ""};
    const auto& curvatures = system.hessian.entries();
    if (std::any_of(curvatures.begin(), curvatures.end(),
                    [&](const auto& entry) { return has_any(entry.second, system.inputs); })) {
        part.reason = "V'' changes with inputs";
        return part;
    }
    std::vector<GiNaC::symbol> variables = system.q;
    variables.push_back(system.t);
    std::vector<ex> whole, rest;
    bool diagonal = true;
    const ConstantPart constant_part(variables);
    for (const auto& [place, value] : system.hessian.entries()) {
        const ex constant = constant_part.of(value);
        if (!constant.is_zero()) {
            part.constant.put(place.first, place.second, constant);
            diagonal = diagonal && place.first == place.second;
        }
        const ex mass = system.mass(static_cast<std::size_t>(place.first), static_cast<std::size_t>(place.first));
        whole.push_back(value / mass);
        rest.push_back((value - constant) / mass);
    }
    if (part.constant.entries().empty()) {
        part.reason = "V has no quadratic part";
        return part;
    }
    double with = 1, without = 1;
    try {
        with = contraction_of(rest, scene, system, quadrature);
        without = contraction_of(whole, scene, system, quadrature);
    } catch (const DomainError&) {  // then as if there were no quadratic part
    }
    part.diagonal = diagonal && with < without;
    part.absorbed = !part.diagonal && with < 0.1;
    part.reason = fmt::format(
        "at the start the rest of V'' is as large without the quadratic part, so nothing is taken out of the "
        "iteration");
    if (part.diagonal)
        part.reason = fmt::format(
            "the constant part of V'' is diagonal and taken into the stage map: at the start an iteration "
            "leaves {:.1g} of the error instead of {:.1g}",
            with, without);
    else if (part.absorbed)
        part.reason = fmt::format(
            "V is nearly quadratic at the start: where the fixed-point iteration does not converge, one constant "
            "matrix serves all iterations, and each leaves {:.1g} of the error",
            with);
    else if (!diagonal)
        part.reason = "the constant part of V'' couples coordinates, and the rest of V'' is not small beside it";
    return part;
}

}  // namespace lobatto
