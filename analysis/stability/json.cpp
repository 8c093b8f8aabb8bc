// SPDX-License-Identifier: GPL-2.0-or-later
// The stability of a member and of a scene, for machines (docs/stability.md).
#include "analysis/stability/json.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "generator/graph/notation.hpp"
#include "generator/mechanics/modified_energy.hpp"

namespace lobatto {

namespace {

using Json = nlohmann::ordered_json;

constexpr int shown_digits = 30;

Json json_root(const RealRoot& root) {
    Json json{{"z", decimal_of(root, shown_digits)},
              {"angle", decimal_of_square_root(root, shown_digits)},
              {"polynomial", text_of(root.polynomial, "z")}};
    if (const std::string radicals = radicals_of(root); !radicals.empty()) {
        json["exact_z"] = radicals;
        json["exact_angle"] = radicals_of_square_root(root);
    }
    return json;
}

Json number(double value) {
    return std::isfinite(value) ? Json(value) : Json("infinite");
}

Json member_of(const Stability& member) {
    const Propagation& step = member.step;
    Json json;
    json["method"] = member.method.name();
    json["order"] = member.method.order();
    for (const auto& [name, f] : {std::pair{"delta", step.delta}, {"a", step.a}, {"b", step.b}, {"c", step.c}})
        json["step"][name] = text_of(rational_polynomial(f, step.z), "z");
    json["trace"] = {{"numerator", text_of(member.trace_above, "z")},
                     {"denominator", text_of(member.trace_below, "z")}};
    json["intervals"] = Json::array();
    for (std::size_t k = 0; k < member.intervals.size(); ++k) {
        const StabilityInterval& interval = member.intervals[k];
        Json one{{"stable", interval.stable}};
        one["from"] = k > 0 ? json_root(member.limits[k - 1]) : Json("0");
        one["to"] = k < member.limits.size() ? json_root(member.limits[k]) : Json("infinity");
        if (!interval.stable) {
            one["rate"] = number(interval.rate);
            one["at"] = interval.peak ? Json(decimal_of_square_root(*interval.peak, shown_digits)) : Json("infinity");
        }
        json["intervals"].push_back(one);
    }
    json["contacts"] = Json::array();
    for (const Contact& contact : member.contacts) {
        Json one = json_root(contact.z);
        one["identity"] = contact.identity;
        json["contacts"].push_back(one);
    }
    json["phase_error"] = {{"constant", canonical_text(member.phase_error)}, {"order", member.phase_order}};
    if (const auto proof = proof_of_stability(member)) {
        json["proof"] = {{"c", text_of(proof->c, "z")},
                         {"delta", text_of(proof->delta, "z")},
                         {"sturm_chain", Json::array()},
                         {"signs_at_zero", proof->at_zero},
                         {"signs_at_infinity", proof->at_infinity}};
        const SturmChain chain(proof->delta);
        for (const RationalPolynomial& f : chain.polynomials()) json["proof"]["sturm_chain"].push_back(text_of(f, "z"));
    }
    return json;
}

Json point_of(const StabilityReport& report, const PointReport& point) {
    Json json;
    if (!report.derivation.system.linear) json["position"] = std::vector<double>(point.q.begin(), point.q.end());
    if (point.modes) {
        json["modes"] = Json::array();
        for (const Mode& mode : *point.modes)
            json["modes"].push_back({{"squared_frequency", mode.squared_frequency},
                                     {"z", mode.z},
                                     {"stable", mode.stable()},
                                     {"at_limit", mode.at_limit},
                                     {"rate", mode.rate}});
    }
    if (!point.obstacle.empty()) json["obstacle"] = point.obstacle;
    json["exact_rate"] = point.exact_rate;
    if (point.kernel_rate) {
        json["measured_rate"] = point.kernel_rate->value;
        json["measured_floor"] = point.kernel_rate->floor;
    }
    return json;
}

std::string text_of(const Json& json) {
    return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace

std::string json_of(const std::vector<Stability>& members) {
    Json json;
    json["format"] = 1;
    json["members"] = Json::array();
    for (const Stability& member : members) json["members"].push_back(member_of(member));
    return text_of(json);
}

std::string json_of(const StabilityReport& report) {
    Json json;
    json["format"] = 1;
    json["scene"] = report.derivation.scene.name;
    json["title"] = report.derivation.scene.title;
    json["linear"] = report.derivation.system.linear;
    json["step"] = report.step;
    json["member"] = member_of(report.member);
    json["points"] = Json::array();
    for (const PointReport& point : report.points) json["points"].push_back(point_of(report, point));
    if (const auto& motion = report.trajectory)
        json["trajectory"] = {{"steps", motion->steps},
                              {"most_steps", motion->most_steps},
                              {"steps_done", motion->steps_done},
                              {"states", motion->states},
                              {"frequencies_at", motion->frequencies_at},
                              {"looked_at", motion->looked_at},
                              {"largest_z", motion->largest_z},
                              {"largest_z_time", motion->largest_z_time},
                              {"parting", motion->parting},
                              {"rate", motion->rate},
                              {"exact_rate", motion->exact_rate},
                              {"time", motion->time},
                              {"excess", motion->excess},
                              {"excess_time", motion->excess_time}};
    if (const auto& energy = report.energy) {
        json["energy"] = {{"order", energy->order}, {"too_long", energy->too_long}};
        if (!energy->too_long) {
            json["energy"]["variation"] = energy->variation;
            json["energy"]["modified_variation"] = energy->modified_variation;
        }
        if (const auto general = general_modified_energy(report.member.method))
            json["energy"]["term_of_one_coordinate"] = canonical_text(*general);
    }
    return text_of(json);
}

}  // namespace lobatto
