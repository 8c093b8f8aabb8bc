// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/proof/motion_claims.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "analysis/accuracy/companion/at_rest.hpp"
#include "runtime/measure/explicit_motion.hpp"
#include "runtime/measure/promises.hpp"
#include "runtime/measure/symmetry.hpp"

namespace lobatto {

namespace {

constexpr double saturated = 0.03;                  // of the motion: an error that no step of the ladder makes smaller
constexpr double longest_turn = 6.283185307179586;  // h omega of steps that are judged: a period
constexpr std::int64_t long_run = 20000;            // steps

void energy(std::vector<ProofRow>& rows, const Kernel& kernel, const StartWithStep<double>& start) {
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

}  // namespace

ProofRow order_row(const MeasuredOrder& convergence, const Kernel& kernel, const QuadrupleStart& start) {
    const bool holds = bears_out(convergence, kernel->order, kernel->linear != 0);
    const std::string bound = fmt::format("{} {}", kernel->linear ? "at least" : "about", kernel->order);
    const auto is_saturated = [](const OrderRow& row) { return row.error > saturated; };
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

void prove_momenta(std::vector<ProofRow>& rows, const Kernel& kernel, const StartWithStep<double>& start,
                   const Scene& scene) {
    std::vector<std::string> names;
    for (const Coordinate& coordinate : scene.coordinates) names.push_back(coordinate.name);
    std::vector<ProofRow> found;
    constexpr double by_its_forces = 0.1;  // of a change: the steps are a coarse sum
    double worst = 0, bound = 0;
    const std::string meaning = "the momentum that belongs to this symmetry is not conserved";
    for (const Symmetry& symmetry : find_symmetries(kernel, start.parameters, start.q, start.step, names)) {
        const auto [steps, variation, by_motion] =
            momentum_variation(kernel, symmetry, start.parameters, start.q, start.p, start.step, steps_of_proof);
        bound = 8 * 0x1p-53 * static_cast<double>(steps);  // each step rounds a few times, at worst always the same way
        if (variation > bound && by_motion > by_its_forces * variation) continue;  // where the motion goes it is none
        worst = std::max(worst, variation);
        constexpr std::size_t longest = 60;  // characters of a momentum
        const std::string momentum =
            symmetry.momentum.size() > longest ? symmetry.momentum.substr(0, longest) + "..." : symmetry.momentum;
        found.push_back(at_most(symmetry.kind + ": " + momentum, variation, bound, meaning));
    }
    if (found.empty()) rows.push_back({"momenta of linear symmetries", "none found", "", true, ""});
    if (std::ssize(names) > most_turned)
        rows.push_back(not_decided("momenta of rotations",
                                   fmt::format("they are looked for among up to {} coordinates", most_turned)));
    constexpr std::size_t most_rows = 6;
    if (found.size() > most_rows)
        found = {at_most(fmt::format("momenta of {} linear symmetries", found.size()), worst, bound, meaning)};
    rows.insert(rows.end(), found.begin(), found.end());
}

void prove_energies(std::vector<ProofRow>& rows, const Kernel& kernel, const Kernel& exact_kernel,
                    const StartWithStep<double>& start, const States& states, const std::string& unkept_by,
                    bool has_knots) {
    const std::string claim = "H in double against quadruple";
    const double defect = energy_defect(kernel, exact_kernel, start.parameters, start.step, states);
    const bool rests =
        std::all_of(states.begin(), states.end(), [&](const auto& one) { return one == states.front(); });
    if (std::isnan(defect))
        rows.push_back({claim, "energy too large", "not judged", true, ""});
    else
        rows.push_back(at_most(claim, defect, 1e-10,
                               "terms of the energy cancel and take its digits with them; write the potential without "
                               "differences of nearly equal terms"));
    if (rests && !rows.back().holds) rows.back() = not_decided(claim, "the motion rests, and H may be rounding alone");
    if (!unkept_by.empty())
        rows.push_back(not_promised("bounded energy error", unkept_by));
    else
        energy(rows, kernel, start);
    if (has_knots && !rows.back().holds)
        rows.back() = not_decided(rows.back().claim, "steps cross knots of measured values");
}

void excuse_long_steps(std::vector<ProofRow>& rows, std::size_t of_steps, double turned) {
    if (!(turned > longest_turn)) return;
    for (std::size_t i = of_steps; i < rows.size(); ++i)
        if (!rows[i].holds)
            rows[i] = not_decided(rows[i].claim,
                                  fmt::format("the step is too long: h omega = {:.3g}, more than a period", turned));
}

void excuse_rest(std::vector<ProofRow>& rows, std::size_t of_motion, const SystemOutline& system,
                 const StartWithStep<double>& start, const States& states) {
    std::vector<std::vector<double>> along;
    for (const auto& [q, p] : states) {
        along.push_back({0});
        for (const std::vector<double>* const part : {&q, &p})
            along.back().insert(along.back().end(), part->begin(), part->end());
    }
    if (!is_at_rest(system, along, start.parameters, 0x1p-52)) return;
    for (std::size_t i = of_motion; i < rows.size(); ++i)
        if (!rows[i].holds) rows[i] = not_decided(rows[i].claim, "the motion rests, but for rounding");
}

}  // namespace lobatto
