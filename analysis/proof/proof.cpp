// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/proof/proof.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <future>

#include "analysis/accuracy/companion/at_rest.hpp"
#include "analysis/accuracy/taken_steps.hpp"
#include "analysis/exact_start.hpp"
#include "analysis/kernel/kernel_of.hpp"
#include "analysis/proof/own_numbers.hpp"
#include "generator/check/check.hpp"
#include "generator/formula/spline.hpp"
#include "generator/mechanics/clock/clock.hpp"
#include "generator/method/splitting.hpp"
#include "generator/pipeline.hpp"
#include "runtime/error.hpp"
#include "runtime/measure/diagnostics.hpp"
#include "runtime/measure/explicit_motion.hpp"
#include "runtime/measure/manifold.hpp"
#include "runtime/measure/promises.hpp"
#include "runtime/measure/symmetry.hpp"
#include "runtime/run/trajectory.hpp"

namespace lobatto {

namespace {

std::string number(double x) {
    return fmt::format("{:.2g}", x);
}

ProofRow row_of(const Check& check) {
    return {check.claim, check.exact ? (check.holds ? "0" : "not 0") : number(check.measured),
            check.exact ? "exact" : number(check.bound), check.holds, check.meaning};
}

ProofRow at_most(const std::string& claim, double measured, double bound, const std::string& meaning) {
    return {claim, number(measured), number(bound), measured <= bound, meaning};
}

// The scene's start, parameters and step in the kernel's number type.
template <class real>
struct Start : StartIn<real> {
    real step;
};

template <class real>
Start<real> start_with_step(const ExactStart& start, const GiNaC::numeric& step, const Kernel& kernel) {
    const real h = number_of<real>(step);
    return {start_in<real>(start, kernel, h), h};
}

constexpr double saturated = 0.03;                  // of the motion: an error that no step of the ladder makes smaller
constexpr double conditioning_slack = 64;           // roundings differ by chance
constexpr double most_conditioned = 0x1p20;         // roundings that equations may lose; a wrong formula leaves 1e18
constexpr double longest_turn = 6.283185307179586;  // h omega of steps that are judged: a period
constexpr std::int64_t short_run = 1000, long_run = 20000;  // steps
constexpr std::size_t tangent_limit = 32;                   // coordinates; beyond, matrices of 2n x 2n take too long

// A check that cannot tell, and why: no failure, and no success either.
ProofRow not_decided(const std::string& claim, const std::string& why) {
    return {claim, "not decided", why, true, ""};
}

// A row that is measured, or where the measurement itself cannot be made, says so.
template <class Measure>
ProofRow decided(const std::string& claim, const Measure& measure) {
    try {
        return measure();
    } catch (const ComputationError& error) {
        return not_decided(claim, error.what());
    }
}

// Checks of formulas at points near the start, if there are any where all of them have values.
template <class Work>
void near_the_start(std::vector<ProofRow>& rows, const std::string& claim, const Work& work) {
    try {
        for (const Check& check : work()) rows.push_back(row_of(check));
    } catch (const DomainError& error) {
        rows.push_back(not_decided(claim, std::string("no value at points near the start: ") + error.what()));
    }
}

// Of whole systems, not of single numbers.
ProofRow not_promised(const std::string& claim, const std::string& why) {
    return {claim, "not promised", why, true, ""};
}

// The states at each hundredth step of a short run, as far as it goes.
using States = std::vector<std::pair<std::vector<double>, std::vector<double>>>;

States states_along(const Kernel& kernel, const Start<double>& start) {
    std::vector<std::pair<std::vector<double>, std::vector<double>>> states;
    TrajectoryRequest request;
    request.parameters = start.parameters;
    request.q = start.q;
    request.p = start.p;
    request.step = start.step;
    request.steps = short_run;
    request.every = short_run / 10;
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

template <class real>
double worst_defect(const Kernel& kernel, const Start<real>& start,
                    const std::vector<std::pair<std::vector<double>, std::vector<double>>>& states) {
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
Return way_and_back(const Kernel& kernel, const Start<real>& start, bool symplectic) {
    Return result;
    // Each step costs a product of 2n x 2n matrices and the solution of N equations with 2n right sides.
    const double products = sizeof(real) == sizeof(double) ? 2e9 : 4e7, rows = 2 * static_cast<double>(start.q.size()),
                 N = kernel->unknowns;
    const auto most = static_cast<std::int64_t>(products / (rows * rows * rows + N * N * (rows + N / 3)));
    for (std::int64_t steps = std::clamp<std::int64_t>(most, 10, short_run); steps > 0; steps /= 2) {
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

// What the compiled steps leave in the equations that they were derived from, whatever iteration found them.
void taken_steps(std::vector<ProofRow>& rows, const Derivation& derivation, const Kernel& kernel,
                 const Kernel& exact_kernel, const Kernel& ensemble, const Start<double>& start,
                 const Start<__float128>& exact) {
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

void momenta(std::vector<ProofRow>& rows, const Kernel& kernel, const Start<double>& start, const Scene& scene) {
    std::vector<std::string> names;
    for (const Coordinate& coordinate : scene.coordinates) names.push_back(coordinate.name);
    std::vector<ProofRow> found;
    constexpr double by_its_forces = 0.1;  // of a change: the steps are a coarse sum
    double worst = 0, bound = 0;
    const std::string meaning = "the momentum that belongs to this symmetry is not conserved";
    for (const Symmetry& symmetry : find_symmetries(kernel, start.parameters, start.q, start.step, names)) {
        const auto [steps, variation, by_motion] =
            momentum_variation(kernel, symmetry, start.parameters, start.q, start.p, start.step, short_run);
        bound = 8 * 0x1p-53 * static_cast<double>(steps);  // each step rounds a few times, at worst always the same way
        if (variation > bound && by_motion > by_its_forces * variation) continue;  // where the motion goes it is none
        worst = std::max(worst, variation);
        constexpr std::size_t longest = 60;  // characters of a momentum
        const std::string momentum =
            symmetry.momentum.size() > longest ? symmetry.momentum.substr(0, longest) + "..." : symmetry.momentum;
        found.push_back(at_most(symmetry.kind + ": " + momentum, variation, bound, meaning));
    }
    if (found.empty()) rows.push_back({"momenta of linear symmetries", "none found", "", true, ""});
    constexpr std::size_t most_rows = 6;
    if (found.size() > most_rows)
        found = {at_most(fmt::format("momenta of {} linear symmetries", found.size()), worst, bound, meaning)};
    rows.insert(rows.end(), found.begin(), found.end());
}

void energy(std::vector<ProofRow>& rows, const Kernel& kernel, const Start<double>& start) {
    const EnergyDrift drift = energy_drift(kernel, start.parameters, start.q, start.p, start.step, long_run);
    const std::string claim = fmt::format("energy drift in {} steps", drift.steps);
    if (!std::isfinite(drift.drift)) {
        rows.push_back({claim, "energy too large", "not judged", true, ""});
        return;
    }
    if (!drift.bounded || drift.chaotic) {
        rows.push_back({claim, drift.bounded ? "too sensitive" : "motion unbounded", "not judged", true, ""});
        return;
    }
    // A steady drift moves the mean by half the swing.
    rows.push_back(
        at_most(claim, drift.drift, drift.swing / 4 + drift.rounding, "the energy drifts: its error grows with time"));
}

ProofRow order(const Convergence& convergence, const Kernel& kernel, const QuadrupleStart& start) {
    const bool holds = bears_out(convergence, kernel->order, kernel->linear != 0);
    const std::string bound = fmt::format("{} {}", kernel->linear ? "at least" : "about", kernel->order);
    const auto is_saturated = [](const ConvergenceRow& row) { return row.error > saturated; };
    if (!convergence.rows.empty() && std::all_of(convergence.rows.begin(), convergence.rows.end(), is_saturated))
        return not_decided("order of convergence", "with all steps the error is as large as the motion");
    if (convergence.below_rounding) return {"order of convergence", "below rounding", "not judged", holds, ""};
    if (!holds && !is_smooth(kernel, start, convergence.duration))
        return not_decided("order of convergence",
                           fmt::format("{:.2f} where {} is promised: the motion is not smooth enough to tell",
                                       convergence.order, kernel->order));
    if (!holds && convergence.settled && convergence.order > kernel->order)
        return not_decided("order of convergence", fmt::format("{:.2f} where {} is promised: the error of this motion "
                                                               "shrinks faster",
                                                               convergence.order, kernel->order));
    // A symmetric method of a lower order would show two less: this is neither that order nor clearly the one promised.
    constexpr int high_order = 12;
    if (!holds && kernel->order > high_order && convergence.order > kernel->order - 1.5)
        return not_decided(
            "order of convergence",
            fmt::format("{:.2f} where {} is promised: rounding leaves a high order too few steps to tell",
                        convergence.order, kernel->order));
    return {"order of convergence", convergence.exact ? "exact" : fmt::format("{:.2f}", convergence.order), bound,
            holds, "the error of this motion does not shrink with the step as the method's order says"};
}

// A start from which differences are smooth: on a knot of measured values their error would be of the first order.
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

// Tangent maps at `states`, and steps back; `smooth`: where differences are taken.
void symplecticity(std::vector<ProofRow>& rows, const Kernel& kernel, const Kernel& exact_kernel,
                   const Start<double>& start, const Start<__float128>& exact,
                   const std::vector<std::pair<std::vector<double>, std::vector<double>>>& states,
                   const QuadrupleStart& smooth, bool forced) {
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
    rows.push_back(decided("tangent map against differences", [&] {
        return at_most("tangent map against differences", tangent_defect(exact_kernel, smooth, start.step), 1e-18,
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

// (D45) On the manifold of the constraints, in differences.
void symplecticity_on_constraints(std::vector<ProofRow>& rows, const Kernel& exact_kernel, const QuadrupleStart& start,
                                  __float128 step, bool forced) {
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

// Steps that cross the knots of a table in a constraint change the energy a little each time.
bool has_tables_in_constraints(const Scene& scene) {
    return std::any_of(scene.constraints.begin(), scene.constraints.end(), [](const Constraint& constraint) {
        return std::any_of(constraint.value.preorder_begin(), constraint.value.preorder_end(), is_table_value);
    });
}

// `unkept_by`: what lets the motion lose its energy; "" where it keeps it.
void energies(std::vector<ProofRow>& rows, const Kernel& kernel, const Kernel& exact_kernel, const Start<double>& start,
              const States& states, const std::string& unkept_by, bool has_knots) {
    const std::string claim = "H in double against quadruple";
    const double defect = energy_defect(kernel, exact_kernel, start.parameters, start.step, states);
    if (std::isnan(defect))
        rows.push_back({claim, "energy too large", "not judged", true, ""});
    else
        rows.push_back(at_most(claim, defect, 1e-10,
                               "terms of the energy cancel and take its digits with them; write the potential without "
                               "differences of nearly equal terms"));
    if (!unkept_by.empty())
        rows.push_back(not_promised("bounded energy error", unkept_by));
    else
        energy(rows, kernel, start);
    if (has_knots && !rows.back().holds)
        rows.back() = not_decided(rows.back().claim, "steps cross knots of measured values");
}

// What steps that are too long do to a motion tells nothing of the kernel. `turned`: h omega.
void excuse_long_steps(std::vector<ProofRow>& rows, std::size_t of_steps, double turned) {
    if (!(turned > longest_turn)) return;
    for (std::size_t i = of_steps; i < rows.size(); ++i)
        if (!rows[i].holds)
            rows[i] = not_decided(rows[i].claim,
                                  fmt::format("the step is too long: h omega = {:.3g}, more than a period", turned));
}

// Nor does rounding that moves a mechanism at rest.
void excuse_rest(std::vector<ProofRow>& rows, std::size_t of_motion, const SystemOutline& system,
                 const Start<double>& start, const States& states) {
    std::vector<std::vector<double>> along;
    for (const auto& [q, p] : states) {
        along.push_back({0});
        for (const std::vector<double>* const part : {&q, &p})
            along.back().insert(along.back().end(), part->begin(), part->end());
    }
    if (!rests_on_constraints(system, along, start.parameters, 0x1p-52)) return;
    for (std::size_t i = of_motion; i < rows.size(); ++i)
        if (!rows[i].holds) rows[i] = not_decided(rows[i].claim, "the motion rests, but for rounding");
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
    taken_steps(rows, derivation, kernel, exact_kernel, ensemble, start, exact);
    const std::size_t of_motion = rows.size();
    say("checking symplecticity and reversal", 0.85);
    const auto states = states_along(kernel, start);
    const bool forced = derivation.system.has_forces();
    if (!scene.constraints.empty())
        symplecticity_on_constraints(rows, exact_kernel, quadruple_start, exact.step, forced);
    else if (with_tangent)
        symplecticity(rows, kernel, exact_kernel, start, exact, states,
                      beside_knots(scene, exact_kernel, quadruple_start, start.step), forced);
    else
        rows.push_back({"symplectic step, reversal", "left out", fmt::format("n > {}", tangent_limit), true, ""});
    const double of_decimals =
        scene.method.family == Family::splitting ? 100 * std::pow(10.0, -splitting_of(scene.method.points).digits) : 0;
    Convergence& convergence = proof.convergence;
    say("measuring the order of convergence", 0.93);
    rows.push_back(decided("order of convergence", [&] {
        if (!scene.tables.empty()) return not_promised("order of convergence", "steps cross knots of measured values");
        convergence = measure_order(exact_kernel, quadruple_start, start.step, of_decimals);
        return order(convergence, exact_kernel, quadruple_start);
    }));
    say("checking momenta and energy over long runs", 0.97);
    momenta(rows, kernel, start, scene);
    const std::string unkept_by = forced ? "forces" : changes_with_time(scene, derivation.system) ? "time" : "";
    energies(rows, kernel, exact_kernel, start, states, unkept_by, has_tables_in_constraints(scene));

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
