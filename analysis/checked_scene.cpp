// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/checked_scene.hpp"

#include <fmt/format.h>

#include <map>
#include <nlohmann/json.hpp>

#include "generator/describe/explain.hpp"
#include "generator/emit/tables.hpp"
#include "generator/pipeline.hpp"
#include "runtime/stopwatch.hpp"

namespace lobatto {

namespace {

long operations_of(const KernelSource& source) {
    return source.report.back().after.total();
}

std::vector<CheckedOutput> outputs_of(const Derivation& derivation, long operations) {
    const Outputs& asked = derivation.scene.outputs;
    const auto cost = [&](bool present, auto remove) -> long {
        if (!present) return 0;
        Derivation less = derivation;
        remove(less.scene.outputs);
        return operations - operations_of(emit(less));
    };
    std::string events, stops, impacts;
    for (const Event& stop : derivation.scene.run.stops) stops += (stops.empty() ? "" : ", ") + stop.text;
    for (const Impact& impact : derivation.scene.impacts) impacts += (impacts.empty() ? "" : ", ") + impact.when.text;
    for (const Event& event : asked.events) events += (events.empty() ? "" : ", ") + event.text;
    const std::string tangent =
        !derivation.system.constraints.empty() ? "not computed with constraints"
        : !has_tangent(derivation)             ? fmt::format("not computed beyond {} coordinates", tangent_limit)
        : derivation.structure.is_explicit()   ? "the derivative of a step, one kick and drift after another"
                                               : "the derivative of a step, from the matrix of its equations";
    std::vector<CheckedOutput> all{
        {"energy", asked.energy, "H at every kept state",
         cost(asked.energy, [](Outputs& outputs) { outputs.energy = false; })},
        {"momenta", asked.momenta, "columns p_... of the trajectory", 0},
        {"tangent", asked.tangent, tangent,
         cost(has_tangent(derivation), [](Outputs& outputs) { outputs.tangent = false; })},
        {"dense", asked.dense > 0, fmt::format("{} states inside each step, from the step's polynomial", asked.dense),
         0},
        {"events", !asked.events.empty(), events,
         cost(!asked.events.empty(), [](Outputs& outputs) { outputs.events.clear(); })},
    };
    if (!stops.empty()) all.push_back({"stops", true, stops, 0});
    if (!impacts.empty()) all.push_back({"impacts", true, impacts, 0});
    std::map<std::string, int> places;  // of each text
    for (const Switch& one : derivation.scene.switches) ++places[one.text];
    std::string switches;
    for (const auto& [text, count] : places)
        switches += (switches.empty() ? "" : ", ") + text + (count > 1 ? fmt::format(" ({} times)", count) : "");
    if (!switches.empty())
        all.push_back({"not smooth", true, switches + ": a step ends where it changes, so that the order is kept", 0});
    std::string jumps;
    for (const Switch& one : derivation.scene.switches)
        if (one.refracts && jumps.find(one.text) == std::string::npos) jumps += (jumps.empty() ? "" : ", ") + one.text;
    if (!jumps.empty())
        all.push_back(
            {"refraction", true, jumps + ": where L jumps there, the motion is refracted or reflected (D67)", 0});
    return all;
}

}  // namespace

Checked check_scene(Scene scene, Shortcuts shortcuts) {
    Checked result;
    const Stopwatch watch;
    result.derivation = derive(scene, shortcuts);
    result.operations = operations_of(emit(result.derivation));
    result.seconds = watch.seconds();
    scene.method.arithmetic = StepArithmetic::plain;  // which the general path has alone
    const bool alone =
        shortcuts == Shortcuts::none || result.derivation.structure.is_explicit();  // which have no other path
    result.without = alone ? result.derivation : derive(scene, Shortcuts::none);
    result.operations_without = alone ? result.operations : operations_of(emit(result.without));
    result.outputs = outputs_of(result.derivation, result.operations);
    return result;
}

std::string json_of(const Checked& checked) {
    using Json = nlohmann::ordered_json;
    const Derivation& derivation = checked.derivation;
    const Scene& scene = derivation.scene;
    Json findings = Json::array(), groups = Json::array(), outputs = Json::array();
    for (const Finding& finding : derivation.findings)
        findings.push_back({{"name", finding.name}, {"holds", finding.holds}, {"reason", finding.reason}});
    for (const GroupSolve& solve : solves_of(derivation)) {
        Json names = Json::array();
        for (const int k : solve.coordinates) {
            const auto i = static_cast<std::size_t>(k);
            names.push_back(i < scene.coordinates.size()
                                ? scene.coordinates[i].written
                                : "lambda_" + scene.constraints[i - scene.coordinates.size()].name);
        }
        groups.push_back({{"coordinates", names},
                          {"unknowns", solve.unknowns},
                          {"band", solve.band},
                          {"method", word_of(solve.matrix)}});
    }
    for (const CheckedOutput& output : checked.outputs)
        outputs.push_back({{"name", output.name}, {"asked", output.asked}, {"operations", output.operations}});
    const Json json{{"format", 1},
                    {"command", "check"},
                    {"name", scene.name},
                    {"title", scene.title},
                    {"lagrangian", scene.lagrangian_text},
                    {"kind", kind_of(derivation)},
                    {"findings", findings},
                    {"step",
                     {{"method", scene.method.name()},
                      {"order", scene.method.order()},
                      {"form", form_of(derivation)},
                      {"unknowns", unknowns_of(derivation)},
                      {"unknowns_without", unknowns_of(checked.without)},
                      {"multiplications", elimination_of(derivation)},
                      {"multiplications_without", elimination_of(checked.without)},
                      {"groups", groups}}},
                    {"outputs", outputs},
                    {"operations", checked.operations},
                    {"operations_without", checked.operations_without},
                    {"seconds", checked.seconds}};
    return json.dump(2);
}

}  // namespace lobatto
