// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/tradeoff/calibration.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "analysis/accuracy/error_estimate.hpp"

namespace lobatto {

namespace {

constexpr double largest = 0.1;        // errors above tell nothing: the motion is another one
constexpr double above_rounding = 30;  // times the least error of all runs
constexpr double no_jump = 1e-13;      // rounding
constexpr std::size_t fewest = 3;      // runs of a member
constexpr std::size_t enough = 10;     // ratios worth quoting

double median(std::vector<double> values) {
    std::sort(values.begin(), values.end());
    return part_of(values, 0.5);
}

std::string range_text(const std::vector<double>& ratios) {
    return fmt::format("{:.2g} times the estimate, {:.2g} to {:.2g} times for eight runs of ten", part_of(ratios, 0.5),
                       part_of(ratios, 0.1), part_of(ratios, 0.9));
}

}  // namespace

double part_of(const std::vector<double>& sorted, double part) {
    return sorted.empty()
               ? std::nan("")
               : sorted[static_cast<std::size_t>(std::lround(part * static_cast<double>(sorted.size() - 1)))];
}

double Calibration::Law::error(const Measurement& measurement) const {
    return factor * static_cast<double>(measurement.candidate.steps) * std::pow(measurement.jump, power);
}

std::vector<Measurement> telling(const std::vector<Measurement>& measurements, double least) {
    std::vector<Measurement> runs;
    double rounding = 1;
    for (const Measurement& m : measurements) {
        if (!m.complete || m.candidate.tolerance != 0 || m.candidate.member.precision != Precision::double_ ||
            m.candidate.member.arithmetic != StepArithmetic::plain)
            continue;
        rounding = std::fmin(rounding, m.error);
        runs.push_back(m);
    }
    least = std::fmax(least, above_rounding * rounding);
    std::erase_if(runs, [&](const Measurement& m) { return !(m.error > least && m.error < largest); });
    return runs;
}

Calibration calibrate(const std::vector<Measurement>& runs) {
    Calibration calibration;
    std::map<Member, std::vector<double>> factors;
    for (const Measurement& m : runs) {
        const Member& member = m.candidate.member;
        if (m.estimate > 0) calibration.by_run.push_back(m.error / m.estimate);
        if (m.jump > no_jump)
            factors[member].push_back(m.error / Calibration::Law{member, error_power(member.method()), 1, 1}.error(m));
    }
    for (const auto& [member, values] : factors) {
        if (values.size() < fewest) continue;
        calibration.laws.push_back(
            {member, error_power(member.method()), median(values), static_cast<int>(values.size())});
        for (std::size_t i = 0; i < values.size(); ++i) {
            std::vector<double> others = values;
            others.erase(others.begin() + static_cast<std::ptrdiff_t>(i));
            calibration.by_laws.push_back(values[i] / median(others));
        }
    }
    std::sort(calibration.by_laws.begin(), calibration.by_laws.end());
    std::sort(calibration.by_run.begin(), calibration.by_run.end());
    return calibration;
}

std::string calibration_text(const Calibration& calibration) {
    std::string text;
    if (calibration.by_run.size() >= enough)
        text += fmt::format("The error that `lobatto run` estimates: here the true one is {}.\n",
                            range_text(calibration.by_run));
    if (calibration.by_laws.size() >= enough)
        text += fmt::format(
            "Calibrated for each member (a steps J^b from the jump J of neighbouring steps' polynomials, a and b in "
            "tradeoff.json): {}.\n",
            range_text(calibration.by_laws));
    return text;
}

}  // namespace lobatto
