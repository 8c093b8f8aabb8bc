// SPDX-License-Identifier: GPL-2.0-or-later
// The stability of a member and of a scene, for people.
#include "cli/print/stability_text.hpp"

#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "generator/describe/describe.hpp"
#include "generator/graph/notation.hpp"
#include "generator/mechanics/modified_energy.hpp"

namespace lobatto {

namespace {

constexpr int shown_digits = 30;
constexpr std::size_t width = 110, most_modes = 12;

std::string row(const std::string& left, const std::string& value) {
    std::string text;
    const std::string indent(2 + left.size() + 3, ' ');
    for (const std::string& line : cut_at_signs(value, width - indent.size()))
        text += (text.empty() ? "  " + left + " = " : indent) + line + "\n";
    return text;
}

std::string polynomial(const GiNaC::ex& f, const Propagation& step) {
    return text_of(rational_polynomial(f, step.z), "z");
}

// 1.0253, or 1 + 4.5e-07 of narrow gaps.
std::string growth_text(double rate) {
    if (std::isinf(rate)) return "without bound";
    if (rate == 0) return "1";
    return std::fabs(rate) < 1e-3 ? fmt::format("1 {} {:.2g}", rate > 0 ? '+' : '-', std::fabs(rate))
                                  : fmt::format("{:.5g}", std::exp(rate));
}

std::string limit_text(const RealRoot& limit) {
    std::string text = decimal_of_square_root(limit, shown_digits);
    const std::string radicals = radicals_of_square_root(limit);
    if (!radicals.empty() && radicals != text) text += " = " + radicals;
    return text;
}

std::string intervals_text(const Stability& member) {
    std::string text;
    for (std::size_t k = 0; k < member.intervals.size(); ++k) {
        const StabilityInterval& interval = member.intervals[k];
        text += fmt::format("  {:<9}{}", interval.stable ? "stable" : "unstable",
                            k < member.limits.size() ? "to " + limit_text(member.limits[k]) : "without end");
        if (!interval.stable)
            text +=
                fmt::format("; growth per step: {}{}", growth_text(interval.rate),
                            interval.peak ? " at " + decimal_of_square_root(*interval.peak, 6) : " as h omega grows");
        text += "\n";
    }
    return text;
}

std::string phase_text(const Stability& member) {
    const GiNaC::numeric& error = member.phase_error;  // one over an integer
    const bool ahead = error.is_positive();
    return fmt::format("  a step turns by h*omega*(1 {} (h*omega)^{}/{} + ...), so the motion runs {}\n",
                       ahead ? "+" : "-", member.phase_order, canonical_text(error.denom()), ahead ? "ahead" : "late");
}

std::string signs_text(const std::vector<int>& signs) {
    std::string text;
    for (const int sign : signs) text += sign > 0 ? "+" : sign < 0 ? "-" : "0";
    return text;
}

std::string proof_text(const ProofOfStability& proof) {
    return fmt::format(
        "  b = -z*c and a^2 - b*c = delta^2 make 4 - trace^2 = z*(2*c/delta)^2, which is not negative for z > 0;\n"
        "  delta, whose coefficients are positive, has no zero there; by Sturm's theorem too: signs of its chain at 0 "
        "{}, at\n"
        "  infinity {}, {} changes each. No step size is unstable.\n",
        signs_text(proof.at_zero), signs_text(proof.at_infinity), changes_of_sign(proof.at_zero));
}

std::string mode_text(const Stability& member, const Mode& mode) {
    if (mode.squared_frequency == 0)
        return fmt::format("  omega = 0              {}",
                           mode.free ? "free: nothing pulls back" : "the linear part says nothing here");
    const double x = std::sqrt(std::fabs(mode.z));
    if (mode.squared_frequency < 0)
        return fmt::format("  omega^2 = {:<12.6g} unstable motion: grows by {:.5g} in a time h, per step by {}",
                           mode.squared_frequency, std::exp(x), growth_text(mode.rate));
    std::string text = fmt::format("  omega = {:<14.6g} h*omega = {:<12.6g} ", std::sqrt(mode.squared_frequency), x);
    if (mode.at_limit) return text + "AT a limit, to rounding: grows in proportion to the number of steps";
    if (mode.rate > 0) return text + fmt::format("UNSTABLE: grows by {} per step", growth_text(mode.rate));
    text += "stable";
    if (member.limits.empty()) return text;
    std::size_t k = 0;
    while (k + 1 < member.limits.size() && member.limits[k].high.to_double() < mode.z) ++k;
    const auto step_at = [&](std::size_t limit) {
        return std::sqrt(member.limits[limit].approximation(20).to_double() / mode.squared_frequency);
    };
    return text + (k == 0 ? fmt::format(" while h < {:.6g}", step_at(0))
                          : fmt::format(" between h = {:.6g} and {:.6g}", step_at(k - 1), step_at(k)));
}

// All, or the ends of a long list and what is unstable.
std::string modes_text(const Stability& member, const std::vector<Mode>& modes) {
    std::string text;
    std::size_t hidden = 0;
    for (std::size_t k = 0; k < modes.size(); ++k) {
        const bool end = k < 3 || k + 3 >= modes.size();
        if (modes.size() > most_modes && !end && modes[k].rate == 0 && !modes[k].at_limit) {
            ++hidden;
            continue;
        }
        if (hidden > 0) text += fmt::format("  ({} stable ones between)\n", hidden);
        hidden = 0;
        text += mode_text(member, modes[k]) + "\n";
    }
    return text;
}

std::string position_text(const StabilityReport& report, const Eigen::VectorXd& q) {
    std::string text;
    for (Eigen::Index k = 0; k < q.size() && k < 6; ++k)
        text += fmt::format("{}{} = {:.6g}", k > 0 ? ", " : "",
                            report.derivation.scene.coordinates[static_cast<std::size_t>(k)].written, q(k));
    return text + (q.size() > 6 ? ", ..." : "");
}

std::string point_text(const StabilityReport& report, const PointReport& point) {
    std::string text;
    if (point.modes)
        text += modes_text(report.member, *point.modes);
    else
        text += fmt::format("  no independent oscillations: {}; the motion itself grows by {} in a time h\n",
                            point.obstacle, growth_text(std::fabs(point.exact_rate) > 1e-12 ? point.exact_rate : 0));
    if (point.kernel_rate)
        text += fmt::format("  measured on the kernel: growth per step {}\n",
                            std::fabs(point.kernel_rate->value) > point.kernel_rate->floor
                                ? growth_text(point.kernel_rate->value)
                                : fmt::format("1, to within {:.1g}", point.kernel_rate->floor));
    return text;
}

std::string trajectory_text(const StabilityReport& report) {
    const TrajectoryReport& motion = *report.trajectory;
    std::string text = fmt::format(
        "\nAlong the motion: {}\n",
        motion.steps_done == motion.steps ? fmt::format("{} steps", motion.steps)
        : motion.steps_done == motion.most_steps
            ? fmt::format("the first {} of {} steps, as many as this command takes", motion.steps_done, motion.steps)
            : fmt::format("it stops after {} of {} steps; lobatto run says why", motion.steps_done, motion.steps));
    if (motion.thrown_at)
        text += fmt::format("  from t = {:.6g} on left out: there the step has thrown the motion away\n",
                            *motion.thrown_at);
    if (motion.largest_z > 0) {
        text += fmt::format("  stiffest at t = {:.6g}: h*omega = {:.6g}", motion.largest_z_time,
                            std::sqrt(motion.largest_z));
        if (!report.member.limits.empty()) {
            const double share =
                std::sqrt(motion.largest_z / report.member.limits.front().approximation(20).to_double());
            text += share < 1 ? fmt::format(", {:.2g} of the first limit", share)
                              : fmt::format(", BEYOND the first limit, {:.3g} times", share);
        }
        text += "\n";
    } else if (motion.frequencies_at > 0) {
        text += "  nothing oscillates: no frequency was met\n";
    }
    if (motion.frequencies_at < motion.states)
        text +=
            fmt::format("  frequencies are known at {} of {} states examined\n", motion.frequencies_at, motion.states);
    if (motion.looked_at == 0) return text;
    text +=
        motion.parting == 0
            ? fmt::format(
                  "  no eigenvalue of a step is above 1 ({} steps examined){}\n", motion.looked_at,
                  report.derivation.system.autonomous ? "" : "; as forces change with time it may grow all the same")
            : fmt::format("  an eigenvalue above 1{}, in {} of {} steps examined{}\n",
                          report.derivation.system.autonomous ? ", so that nearby trajectories diverge" : "",
                          motion.parting, motion.looked_at,
                          report.derivation.system.autonomous
                              ? ""
                              : "; as forces change with time, that says nothing of the whole motion");
    if (motion.parting > 0)
        text += fmt::format("  fastest at t = {:.6g}: {} per step; the motion itself {}\n", motion.time,
                            growth_text(motion.rate), growth_text(motion.exact_rate));
    if (motion.excess > 1e-6)
        text += fmt::format("  the step exceeds the motion most at t = {:.6g}, by a factor {}\n", motion.excess_time,
                            growth_text(motion.excess));
    return text;
}

std::string energy_text(const StabilityReport& report) {
    const EnergyReport& energy = *report.energy;
    if (energy.too_long)
        return fmt::format("\nEnergy: the formula of H_{} (D37) is too long to be written down here\n", energy.order);
    std::string text = fmt::format(
        "\nEnergy that the steps keep, by backward error analysis (D37): H + h^{0}*H_{0} + ...\n", energy.order);
    if (report.derivation.system.n == 1)
        if (const auto general = general_modified_energy(report.member.method))
            text += row(fmt::format("H_{}", energy.order), canonical_text(*general)) +
                    "  (m the mass, V_k the k-th derivative of V)\n";
    return text + fmt::format("  along the motion H varies by {:.2g}, this sum by {:.2g}; rounding is about {:.0e}\n",
                              energy.variation, energy.modified_variation,
                              energy.size * std::numeric_limits<double>::epsilon());
}

std::string left(const std::string& text, std::size_t columns) {
    return text + std::string(text.size() < columns ? columns - text.size() : 1, ' ');
}

}  // namespace

std::string text_of(const std::vector<Stability>& members) {
    std::string text = left("member", 19) + left("order", 7) + left("phase error", 46) +
                       left("first limit of h*omega", 34) + "unstable intervals, last limit\n";
    for (const Stability& member : members) {
        const std::size_t gaps = member.limits.size() / 2;
        text += left(member.method.name(), 19) + left(std::to_string(member.method.order()), 7) +
                left(fmt::format("{}*(h*omega)^{}", canonical_text(member.phase_error), member.phase_order), 46) +
                left(member.limits.empty() ? "none" : decimal_of_square_root(member.limits.front(), shown_digits), 34) +
                (member.limits.empty()
                     ? "none: stable for every step (proved)"
                     : fmt::format("{} and beyond {}", gaps, decimal_of_square_root(member.limits.back(), 10))) +
                "\n";
    }
    return text;
}

std::string text_of(const Stability& member) {
    const Propagation& step = member.step;
    std::string text = fmt::format(
        "{}: order {}\n\n"
        "One step of q'' = -omega^2*q, with z = (h*omega)^2 (D20):\n"
        "  q1 = (a*q0 + h/m*c*p0)/delta, p1 = (m/h*b*q0 + a*p0)/delta\n",
        member.method.name(), member.method.order());
    for (const auto& [name, f] : {std::pair{"delta", step.delta}, {"a", step.a}, {"b", step.b}, {"c", step.c}})
        text += row(name, polynomial(f, step));
    text += row("trace", fmt::format("2*a/delta = ({})/({})", text_of(member.trace_above, "z"),
                                     text_of(member.trace_below, "z")));
    text += "  H_d = (h/m*c*p^2 - m/h*b*q^2)/(2*delta), which the steps conserve exactly (D21)\n";
    text += "\nBounded where |trace| < 2 (D36); by h*omega, from 0:\n" + intervals_text(member);
    if (!member.contacts.empty()) {
        text += fmt::format("  |trace| = 2 without instability at");
        for (const Contact& contact : member.contacts)
            text += fmt::format("{} {}", &contact == &member.contacts.front() ? "" : ",",
                                decimal_of_square_root(contact.z, 10));
        text += "\n";
    }
    if (const auto proof = proof_of_stability(member)) text += "\nProof:\n" + proof_text(*proof);
    return text + "\nPhase:\n" + phase_text(member);
}

std::string text_of(const StabilityReport& report) {
    const Scene& scene = report.derivation.scene;
    std::string text = fmt::format("{}\n\n{}", scene.title.empty() ? scene.name : scene.title, text_of(report.member));
    const bool linear = report.derivation.system.linear;
    if (linear) {
        text += fmt::format("\nThis scene, h = {:.6g}:\n", report.step);
    } else if (report.points.empty()) {
        text += fmt::format("\nThis scene, h = {:.6g}: {}\n", report.step,
                            report.derivation.system.autonomous
                                ? "no equilibrium was found from its start and along its motion"
                                : "its forces change with time; no equilibria are sought");
    }
    for (const PointReport& point : report.points) {
        if (!linear)
            text +=
                fmt::format("\nAbout the equilibrium {}, h = {:.6g}:\n", position_text(report, point.q), report.step);
        text += point_text(report, point);
    }
    if (!linear && !report.points.empty())
        text +=
            "\nEquilibria are sought from the start and from places along the motion; there may be others. Another "
            "start,\nby position = ... in the scene, finds those near it.\n";
    if (report.trajectory) text += trajectory_text(report);
    if (report.energy) text += energy_text(report);
    return text;
}

}  // namespace lobatto
