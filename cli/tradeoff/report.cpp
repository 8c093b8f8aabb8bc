// SPDX-License-Identifier: GPL-2.0-or-later
#include "cli/tradeoff/report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "analysis/tradeoff/exploration.hpp"
#include "analysis/tradeoff/measurement_json.hpp"
#include "runtime/run/output.hpp"

namespace lobatto {

namespace {

constexpr double trusted = Experiment::trusted;

std::string tolerance_text(double tolerance) {
    return tolerance > 0 ? fmt::format("{:.0e}", tolerance) : "rounding";
}

std::string time_a_unit(double seconds, double until) {
    return fmt::format("{:.3g}", seconds / until * 1e9);
}

}  // namespace

std::string reference_text(const Experiment& experiment) {
    const Reference& reference = experiment.reference();
    std::string text = fmt::format("reference: {}; {} differs from it by {:.1e} at most", reference.first,
                                   reference.second, reference.disagreement.back());
    if (experiment.is_chaotic())
        text += fmt::format(
            "\nThe two disagree: beyond t = {:.4g} this motion is not known to {:.0e}. It is chaotic, and errors of "
            "states have no meaning there; look at energy, momenta, and how long a method follows the true motion.",
            reference.trusted_until(trusted), trusted);
    return text;
}

std::vector<Measurement> front_rows_of(const Experiment& experiment) {
    std::vector<Measurement> rows;
    double next = 0.3;                                                 // errors above this are of no use
    if (experiment.is_chaotic() && !experiment.conserves()) next = 1;  // 1/t
    for (const Measurement& m : pareto_front(experiment)) {
        if (experiment.figure(m) > next) continue;
        rows.push_back(m);
        next = experiment.figure(m) / (experiment.is_chaotic() && !experiment.conserves() ? 1.1 : std::sqrt(10));
    }
    return rows;
}

std::string front_table(const Experiment& experiment) {
    const double until = experiment.until();
    const auto optional = [](double value) {
        return std::isfinite(value) ? fmt::format("{:.1e}", value) : std::string("-");
    };
    const bool chaotic = experiment.is_chaotic();
    std::string text = chaotic ? fmt::format("  {:>9}  {:>9}  {:>9}", "energy", "momenta", "followed")
                               : fmt::format("  {:>9}  {:>9}", "error", "energy");
    const std::vector<Measurement> rows = front_rows_of(experiment);
    std::size_t width = 10;
    for (const Measurement& m : rows) width = std::max(width, m.candidate.name().size());
    text += fmt::format("  {:>9}  {:<{}}  {:>10}  {:<13}  {:>8}  {:>9}\n", "ns/unit", "method", width, "step",
                        "precision", "iterate", "gradients");
    for (const Measurement& m : rows) {
        text += chaotic ? fmt::format("  {:>9}  {:>9}  {:>9.4g}", optional(m.energy_error), optional(m.momentum_error),
                                      m.reaches)
                        : fmt::format("  {:>9.1e}  {:>9}", m.error, optional(m.energy_error));
        text += fmt::format("  {:>9}  {:<{}}  {:>10.4g}  {:<13}  {:>8}  {:>9.3g}\n", time_a_unit(m.seconds, until),
                            m.candidate.name(), width, m.step, precision_name(m.candidate.member.precision),
                            tolerance_text(m.candidate.tolerance), m.gradients / until);
    }
    return text;
}

std::string csv_of(const Experiment& experiment) {
    std::string text = csv_header();
    for (const auto& [key, m] : experiment.store().all()) text += csv_row(m);
    return text;
}

std::string json_of(const Experiment& experiment) {
    const Reference& reference = experiment.reference();
    nlohmann::ordered_json measurements = nlohmann::ordered_json::array(), front = measurements;
    for (const auto& [key, m] : experiment.store().all()) measurements.push_back(json_of(m));
    for (const Measurement& m : pareto_front(experiment)) front.push_back(json_of(m));
    const nlohmann::ordered_json json = {{"format", 1},
                                         {"command", "tradeoff"},
                                         {"scene", experiment.scene().name},
                                         {"title", experiment.scene().title},
                                         {"until", experiment.until()},
                                         {"reference",
                                          {{"method", reference.first},
                                           {"check", reference.second},
                                           {"disagreement", reference.disagreement.back()},
                                           {"trusted_until", reference.trusted_until(trusted)},
                                           {"samples", reference.samples},
                                           {"frequency", reference.frequency}}},
                                         {"chaotic", experiment.is_chaotic()},
                                         {"front", front},
                                         {"measurements", measurements}};
    return json.dump() + '\n';
}

}  // namespace lobatto
