// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/proof/proof.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <future>

#include "analysis/kernel/kernel_of.hpp"
#include "analysis/proof/motion_claims.hpp"
#include "analysis/proof/own_numbers.hpp"
#include "analysis/proof/step_claims.hpp"
#include "generator/formula/spline.hpp"
#include "generator/mechanics/clock/clock.hpp"
#include "generator/method/splitting.hpp"
#include "generator/pipeline.hpp"
#include "runtime/measure/explicit_motion.hpp"

namespace lobatto {

namespace {

// Whether forces or constraints hold measured values: steps that cross their knots change the energy a little each
// time.
bool moves_by_tables(const Scene& scene) {
    const auto holds = [](const GiNaC::ex& formula) {
        return std::any_of(formula.preorder_begin(), formula.preorder_end(), is_table_value);
    };
    return holds(scene.lagrangian) ||
           std::any_of(scene.coordinates.begin(), scene.coordinates.end(),
                       [&](const Coordinate& one) { return holds(one.force); }) ||
           std::any_of(scene.constraints.begin(), scene.constraints.end(),
                       [&](const Constraint& one) { return holds(one.value); });
}

// A clock is another Lagrangian, whose steps are equal.
Scene scene_to_prove(const Scene& chosen) {
    Scene scene = in_clock_time(chosen);
    scene.clock.reset();
    if (chosen.clock && scene.method.numbers != Precision::double_)
        fail_at_clock(chosen, "with a clock `lobatto verify` proves steps in double, but numbers are \"" +
                                  precision_name(scene.method.numbers) +
                                  "\"; remove the clock, or give --numbers double");
    scene.outputs.energy = true;
    scene.outputs.tangent = scene.coordinates.size() <= tangent_limit;
    return scene;
}

// What is proved of steps is proved between impacts; the sides of switches are those of the start.
Derivation without_walls(Derivation derivation) {
    derivation.scene.impacts.clear();
    derivation.scene.run.stops.clear();
    derivation.scene.switches.clear();
    return derivation;
}

}  // namespace

Proof prove(const Scene& written, const MethodChoice& method,
            const std::function<void(const std::string&, double)>& say) {
    say("deriving", 0);
    Scene chosen = written;
    method.apply(chosen);
    const Scene scene = scene_to_prove(chosen);
    const Precision numbers = scene.method.numbers;
    const bool with_tangent = scene.outputs.tangent;
    const ExactStart exact_start(scene);
    const GiNaC::numeric step = scene.evaluate(scene.run.step, "the step");
    if (!step.is_positive())
        throw InputError(fmt::format("{}: the step must be positive, but is {:.6g}", scene.path, step.to_double()));
    const Derivation with_walls = derive(scene), derivation = without_walls(with_walls);
    // Compiled beside one another, and beside the checks that need no kernel.
    const KernelSource in_double = emit(derivation, {Precision::double_, {}}),
                       in_quadruple = emit(derivation, {Precision::quadruple, {}});
    const auto beside = [](auto compile) { return std::async(std::launch::async, compile); };
    std::future<Kernel> exact_kernel_comes = beside([&] { return kernel_of(in_quadruple, Precision::quadruple); }),
                        kernel_comes = beside([&] { return kernel_of(in_double, Precision::double_); });

    Proof proof{scene.title, scene.method.name(), {}, {}};
    std::vector<ProofRow>& rows = proof.rows;
    say("checking quadrature, equations and programs, and compiling", 0.1);
    for (const Check& check : check_quadrature(derivation.quadrature)) rows.push_back(row_of(check));
    near_the_start(rows, "equations", [&] { return check_equations(derivation); });
    near_the_start(rows, "programs",
                   [&] { return check_programs(with_walls, optimised_programs(with_walls).programs); });

    say("compiling", 0.4);
    const Kernel kernel = kernel_comes.get();
    std::future<Kernel> ensemble_comes = beside([&] { return ensemble_kernel_of(in_double, Precision::double_, 64); });
    const Kernel exact_kernel = exact_kernel_comes.get(), ensemble = ensemble_comes.get();
    const auto start = start_with_step<double>(exact_start, step, kernel);
    const auto exact = start_with_step<__float128>(exact_start, step, exact_kernel);
    const QuadrupleStart quadruple_start{exact.parameters, exact.q, exact.p};
    const std::size_t of_steps = rows.size();
    if (chosen.clock)
        rows.push_back({"steps, from here on", "of the clock " + chosen.clock->text, "equal in its time", true, ""});
    if (scene.is_cut()) rows.push_back({"steps, from here on", "without walls", "between impacts", true, ""});
    say("checking steps", 0.7);
    prove_taken_steps(rows, derivation, kernel, exact_kernel, ensemble, start, exact);
    const std::size_t of_motion = rows.size();
    say("checking symplecticity and reversal", 0.85);
    const auto states = states_along(kernel, start);
    const bool forced = derivation.system.has_forces();
    if (!scene.constraints.empty())
        prove_symplecticity_on_constraints(rows, exact_kernel, quadruple_start, exact.step, forced);
    else if (with_tangent)
        prove_symplecticity(rows, kernel, exact_kernel, start, exact, states,
                            beside_knots(scene, exact_kernel, quadruple_start, start.step), forced);
    else
        rows.push_back({"symplectic step, reversal", "left out", fmt::format("n > {}", tangent_limit), true, ""});
    const double of_decimals =
        scene.method.family == Family::splitting ? 100 * std::pow(10.0, -splitting_of(scene.method.points).digits) : 0;
    MeasuredOrder& convergence = proof.convergence;
    say("measuring the order of convergence", 0.93);
    rows.push_back(decided("order of convergence", [&] {
        if (moves_by_tables(scene)) return not_promised("order of convergence", "steps cross knots of measured values");
        convergence = measure_order(exact_kernel, quadruple_start, start.step, of_decimals);
        return order_row(convergence, exact_kernel, quadruple_start);
    }));
    say("checking momenta and energy over long runs", 0.97);
    prove_momenta(rows, kernel, start, scene);
    const std::string unkept_by = forced ? "forces" : changes_with_time(scene, derivation.system) ? "time" : "";
    prove_energies(rows, kernel, exact_kernel, start, states, unkept_by, moves_by_tables(scene));

    if (numbers != Precision::double_ && numbers != Precision::quadruple) {
        say("compiling and checking numbers in " + precision_name(numbers), 0.98);
        const Kernel own = kernel_of(emit(derivation, {numbers, {}}), numbers);
        for (const ProofRow& row :
             prove_numbers(numbers, own, exact_kernel, exact_start, step, !forced && scene.constraints.empty()))
            rows.push_back(row);
    }

    excuse_rest(rows, of_motion, derivation.system, start, states);
    excuse_long_steps(rows, of_steps, start.step * fastest_oscillation(exact_kernel, quadruple_start, 8 * start.step));
    return proof;
}

}  // namespace lobatto
