// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/tradeoff/measurement_json.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <utility>

#include "runtime/run/output.hpp"

namespace lobatto {

namespace {

using Column = std::pair<const char*, double Measurement::*>;
constexpr std::array<Column, 11> columns = {{{"error_end", &Measurement::error_end},
                                             {"error", &Measurement::error},
                                             {"reaches", &Measurement::reaches},
                                             {"energy_error", &Measurement::energy_error},
                                             {"drift", &Measurement::drift},
                                             {"momentum_error", &Measurement::momentum_error},
                                             {"symplectic_defect", &Measurement::defect},
                                             {"seconds", &Measurement::seconds},
                                             {"iterations", &Measurement::iterations},
                                             {"gradients", &Measurement::gradients},
                                             {"compile_seconds", &Measurement::compile_seconds}}};

const char* arithmetic_name(const Member& member) {
    return member.arithmetic == StepArithmetic::clean ? "clean" : "plain";
}

}  // namespace

nlohmann::ordered_json json_of(const Measurement& measurement) {
    const Candidate& candidate = measurement.candidate;
    nlohmann::ordered_json json = {{"family", word_of(candidate.member.family)},
                                   {"points", candidate.member.points},
                                   {"precision", precision_name(candidate.member.precision)},
                                   {"arithmetic", arithmetic_name(candidate.member)},
                                   {"clock", word_of(candidate.member.clock)},
                                   {"steps", candidate.steps},
                                   {"step", measurement.step},
                                   {"tolerance", candidate.tolerance},
                                   {"complete", measurement.complete}};
    for (const auto& [name, member] : columns) {
        const double value = measurement.*member;
        if (std::isfinite(value))
            json[name] = value;
        else
            json[name] = nullptr;
    }
    return json;
}

Measurement measurement_of(const nlohmann::json& json) {
    Measurement measurement;
    Candidate& candidate = measurement.candidate;
    candidate.member.family = family_of(json.at("family"));
    candidate.member.points = json.at("points");
    const std::optional<Precision> precision = precision_of(json.at("precision"));
    if (!precision) throw std::invalid_argument("numbers there are not");
    candidate.member.precision = *precision;
    if (json.at("arithmetic") == "clean") candidate.member.arithmetic = StepArithmetic::clean;
    candidate.member.clock = step_clock_of(json.at("clock"));
    candidate.steps = json.at("steps");
    measurement.step = json.at("step");
    candidate.tolerance = json.at("tolerance");
    measurement.complete = json.at("complete");
    for (const auto& [name, member] : columns)
        measurement.*member = json.at(name).is_null() ? std::nan("") : json.at(name).get<double>();
    return measurement;
}

std::string csv_header() {
    std::string text = "family,points,precision,arithmetic,clock,steps,step,tolerance,complete";
    for (const auto& [name, member] : columns) text += fmt::format(",{}", name);
    return text + '\n';
}

std::string csv_row(const Measurement& measurement) {
    const Candidate& candidate = measurement.candidate;
    std::string text = fmt::format(
        "{},{},{},{},{},{},{},{},{}", word_of(candidate.member.family), candidate.member.points,
        precision_name(candidate.member.precision), arithmetic_name(candidate.member), word_of(candidate.member.clock),
        candidate.steps, exact_text(measurement.step), exact_text(candidate.tolerance), measurement.complete ? 1 : 0);
    for (const auto& [name, member] : columns)
        text += "," + (std::isfinite(measurement.*member) ? exact_text(measurement.*member) : std::string());
    return text + '\n';
}

}  // namespace lobatto
