// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/proof/step_claims.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "analysis/accuracy/taken_steps.hpp"
#include "runtime/error.hpp"
#include "runtime/measure/diagnostics.hpp"
#include "runtime/measure/manifold.hpp"
#include "runtime/measure/promises.hpp"
#include "runtime/run/trajectory.hpp"

namespace lobatto {

namespace {

constexpr double conditioning_slack = 64;    // roundings differ by chance
constexpr double most_conditioned = 0x1p20;  // roundings that equations may lose; a wrong formula leaves 1e18

template <class real>
double worst_defect(const Kernel& kernel, const StartWithStep<real>& start, const States& states) {
    LoadedStepper<real> stepper(kernel);
    stepper.prepare(start.parameters, start.step);
    real worst = 0;
    for (const auto& [q, p] : states) {
        const real defect = symplectic_defect<real>(stepper, {q.begin(), q.end()}, {p.begin(), p.end()});
        if (!(defect <= worst)) worst = defect;
    }
    return static_cast<double>(worst);
}

// Over as many steps as rounding allows to say something.
template <class real>
Return way_and_back(const Kernel& kernel, const StartWithStep<real>& start, bool symplectic) {
    Return result;
    // Each step costs a product of 2n x 2n matrices and the solution of N equations with 2n right sides.
    const double products = sizeof(real) == sizeof(double) ? 2e9 : 4e7, rows = 2 * static_cast<double>(start.q.size()),
                 N = kernel->unknowns;
    const auto most = static_cast<std::int64_t>(products / (rows * rows * rows + N * N * (rows + N / 3)));
    for (std::int64_t steps = std::clamp<std::int64_t>(most, 10, steps_of_proof); steps > 0; steps /= 2) {
        result = there_and_back(kernel, start.parameters, start.q, start.p, start.step, steps, symplectic);
        if (result.rounding < 1e-6) break;
    }
    return result;
}

// `conditioned`: how many times as much as its bound the equations of the steps may lose, as quadruple shows.
template <class real>
ProofRow reversal(const std::string& precision, const Return& result, double conditioned) {
    const std::string claim = fmt::format("{} steps and back, {}", result.steps, precision);
    if (std::isinf(result.distance)) return not_decided(claim, "a step fails on the way");
    const double bound = result.rounding * conditioned;
    ProofRow row = at_most(claim, result.distance, bound,
                           "the step is not its own inverse with -h, or so long that it jumps over a singularity");
    if (!row.holds && sizeof(real) > sizeof(double) && result.distance <= most_conditioned * bound)
        return not_decided(claim, fmt::format("the equations of such a step lose {:.0f} digits",
                                              std::ceil(std::log10(result.distance / bound))));
    if (!row.holds) return row;
    if (result.rests) row.bound = "at rest";
    // What is below its bound is no failure, but a bound that large shows nothing.
    else if (!(bound < 1e-6))
        return not_decided(claim, "rounding grows too fast for even one step of this length");
    return row;
}

}  // namespace

States states_along(const Kernel& kernel, const StartWithStep<double>& start) {
    States states;
    TrajectoryRequest request;
    request.parameters = start.parameters;
    request.q = start.q;
    request.p = start.p;
    request.step = start.step;
    request.steps = steps_of_proof;
    request.every = steps_of_proof / 10;
    const std::size_t n = start.q.size();
    request.sink = [&](const Records& records) {
        for (std::int64_t i = 0; i < records.count; ++i) {
            const double* const row = records.rows + i * records.columns + 1;
            states.push_back({{row, row + n}, {row + n, row + 2 * n}});
        }
    };
    const TrajectoryResult result = integrate(kernel, request);
    if (result.steps_done == 0) throw ComputationError(explain_stop(result, request));
    states.pop_back();  // a step that fails may come after the last
    return states;
}

void prove_taken_steps(std::vector<ProofRow>& rows, const Derivation& derivation, const Kernel& kernel,
                       const Kernel& exact_kernel, const Kernel& ensemble, const StartWithStep<double>& start,
                       const StartWithStep<__float128>& exact) {
    constexpr double bound = 64;  // roundings
    const std::string claim = "steps solve the discrete Euler-Lagrange equations: ",
                      meaning =
                          "the steps that were taken do not solve their equations; the step is too long, or the "
                          "kernel is wrong";
    const auto add = [&](const std::string& of, const std::string& what, double most, const std::string& wrong,
                         const auto& measure) {
        rows.push_back(decided(of + what, [&] { return at_most(of + what, measure(), most, wrong); }));
    };
    add(claim, "one trajectory, double", bound, meaning,
        [&] { return trajectory_leaves(derivation, kernel, start.parameters, start.q, start.p, start.step); });
    add(claim, "one trajectory, quadruple", bound, meaning,
        [&] { return trajectory_leaves(derivation, exact_kernel, exact.parameters, exact.q, exact.p, exact.step); });
    if (ensemble->lanes == 0)
        rows.push_back({claim + "ensembles", "no lanes", "as one trajectory", true, ""});
    else
        add(claim, "a lane of an ensemble", bound, meaning,
            [&] { return lane_leaves(derivation, kernel, ensemble, start.parameters, start.q, start.p, start.step); });
    if (kernel->unknowns > 0 && start.q.size() <= tangent_limit)
        add("", "Jacobian of Newton's iteration against differences", 1e-12,
            "the Jacobian is not the derivative of the step's equations",
            [&] { return jacobian_defect(derivation, exact_kernel, exact.parameters, exact.q, exact.p, exact.step); });
}

QuadrupleStart beside_knots(const Scene& scene, const Kernel& kernel, const QuadrupleStart& start, double step) {
    if (scene.tables.empty()) return start;
    constexpr double part = 0.37;  // of a step: where nobody puts a knot
    LoadedStepper<__float128> stepper(kernel);
    lobatto_advance one{};
    one.steps = 1;
    if (stepper.prepare(start.parameters, part * step) != LOBATTO_OK ||
        stepper.start(0, start.q, start.p) != LOBATTO_OK || stepper.advance(one) != LOBATTO_OK)
        return start;
    QuadrupleStart beside = start;
    __float128 time = 0;
    stepper.state(time, beside.q, beside.p);
    return beside;
}

void prove_symplecticity(std::vector<ProofRow>& rows, const Kernel& kernel, const Kernel& exact_kernel,
                         const StartWithStep<double>& start, const StartWithStep<__float128>& exact,
                         const States& states, const QuadrupleStart& smooth, bool forced) {
    const std::string not_symplectic = "the step does not preserve phase-space areas";
    if (forced) {
        rows.push_back(not_promised("symplectic step", "forces"));
    } else {
        rows.push_back(decided("symplectic defect, double", [&] {
            // The equations of a step may take digits; in quadruple they take as many.
            const double conditioned = std::ldexp(worst_defect(exact_kernel, exact, states), 113 - 53);
            return at_most("symplectic defect, double", worst_defect(kernel, start, states),
                           std::fmax(1e-14, conditioning_slack * conditioned), not_symplectic);
        }));
        rows.push_back(decided("symplectic defect, quadruple", [&] {
            return at_most("symplectic defect, quadruple", worst_defect(exact_kernel, exact, states), 1e-30,
                           not_symplectic);
        }));
    }
    rows.push_back(decided("tangent map against differences, beyond rounding", [&] {
        return at_most("tangent map against differences, beyond rounding",
                       tangent_defect(exact_kernel, smooth, start.step), 1e-18,
                       "the tangent map is not the derivative of the step");
    }));
    double conditioned = 1;
    const ProofRow quadruple_row = decided("steps and back, quadruple", [&] {
        const Return result = way_and_back(exact_kernel, exact, !forced);
        const double lost = result.distance / result.rounding;
        if (lost > 1 && lost <= most_conditioned) conditioned = conditioning_slack * lost;
        return reversal<__float128>("quadruple", result, 1);
    });
    rows.push_back(decided("steps and back, double", [&] {
        return reversal<double>("double", way_and_back(kernel, start, !forced), conditioned);
    }));
    rows.push_back(quadruple_row);
}

void prove_symplecticity_on_constraints(std::vector<ProofRow>& rows, const Kernel& exact_kernel,
                                        const QuadrupleStart& start, __float128 step, bool forced) {
    constexpr std::int64_t there = 20;  // steps
    if (forced)
        rows.push_back(not_promised("symplectic step", "forces"));
    else
        rows.push_back(decided("areas on the constraints, quadruple", [&] {
            return at_most("areas on the constraints, quadruple", area_defect(exact_kernel, start, step), 1e-14,
                           "the step does not preserve areas in the phase space that the constraints leave");
        }));
    rows.push_back(decided("steps and back, quadruple", [&] {
        return at_most(fmt::format("{} steps and back, quadruple", there),
                       return_distance(exact_kernel, start, step, there), 1e-20,
                       "the step is not its own inverse with -h, or so long that it jumps over a singularity");
    }));
}

}  // namespace lobatto
