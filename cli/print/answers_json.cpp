// SPDX-License-Identifier: GPL-2.0-or-later
#include "cli/print/answers_json.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "analysis/tradeoff/measurement_json.hpp"
#include "runtime/measure/diagnostics.hpp"

namespace lobatto {

namespace {

using Answer = nlohmann::ordered_json;

Answer number(double value) {
    return std::isfinite(value) ? Answer(value) : Answer(nullptr);
}

Answer number(const std::optional<double>& value) {
    return value ? number(*value) : Answer(nullptr);
}

Answer answer_of(const std::string& command) {
    return {{"format", 1}, {"command", command}};
}

std::string json_text(const Answer& answer) {
    return answer.dump(-1, ' ', false, Answer::error_handler_t::replace) + "\n";
}

std::string ending_of(const TrajectoryResult& result, const RunVerdict& verdict) {
    if (!verdict.failure.empty()) return "failed";
    if (result.interrupted) return "interrupted";
    return result.stop >= 0 ? "stopped" : "done";
}

Answer measured_of(const MeasuredError& error, const Scene& scene) {
    return {{"at_end", number(error.at_end)},
            {"largest", number(error.largest)},
            {"coordinate", scene.coordinates[error.coordinate].written},
            {"absolute", number(error.absolute)},
            {"until", number(error.until)},
            {"lost_after", number(error.lost_after)},
            {"doubling", number(error.doubling)}};
}

// With what lines of text say beside them.
std::vector<std::string> warnings_of(const PreparedRun& run, const TrajectoryResult& result,
                                     const RunVerdict& verdict) {
    std::vector<std::string> all = verdict.warnings;
    if (verdict.error)
        if (const std::string part = not_measured_at_end(*verdict.error); !part.empty()) all.push_back(part);
    if (const std::string end = ends_early(run, result); !end.empty()) all.push_back(end);
    return all;
}

}  // namespace

std::string json_of_run(const PreparedRun& run, const TrajectoryRequest& request, const TrajectoryResult& result,
                        const RunObservers& observers, const RunVerdict& verdict, std::optional<double> defect,
                        const RunFiles& files) {
    const Scene& scene = run.scene;
    const bool clocked = scene.clock.has_value();
    const std::int64_t steps = clocked ? result.chain_steps : result.steps_done;
    const double H0 = std::fabs(result.energy_start);
    const std::vector<Event> watched = scene.reported();
    Answer answer = answer_of("run");
    answer.update(
        {{"scene", scene.path},
         {"title", scene.title},
         {"method", scene.method.name()},
         {"ending", ending_of(result, verdict)},
         {"failure", verdict.failure.empty() ? Answer(nullptr) : Answer(verdict.failure)},
         {"warnings", warnings_of(run, result, verdict)},
         {"steps", steps},
         {"step", number(request.step)},
         {"time", number(result.time)},
         {"seconds", number(result.seconds)},
         {"seconds_per_step", steps > 0 ? number(result.seconds / static_cast<double>(steps)) : Answer(nullptr)},
         {"iterations", result.iterations},
         {"iterations_most", result.iterations_most},
         {"conserves_energy", run.outline.conserves_energy()},
         {"energy_start", number(result.energy_start)},
         {"energy_error", scene.outputs.energy ? number(result.energy_error_largest) : Answer(nullptr)},
         {"energy_error_relative",
          scene.outputs.energy && H0 > 0 ? number(result.energy_error_largest / H0) : Answer(nullptr)},
         {"discrete_energy_error", number(observers.watch.discrete_error())},
         {"symplectic_defect", number(defect)},
         {"position_error", number(observers.watch.position_error())},
         {"measured_error", verdict.error ? measured_of(*verdict.error, scene) : Answer(nullptr)},
         {"stopped_by",
          result.stop >= 0 ? Answer(watched[static_cast<std::size_t>(result.stop)].text) : Answer(nullptr)}});
    answer["events"] = Answer::array();
    for (std::size_t i = 0; i < watched.size(); ++i)
        answer["events"].push_back(
            {{"event", watched[i].text}, {"count", static_cast<std::int64_t>(observers.counts[1 + i])}});
    answer["state"] = {{"q", Answer::object()}, {"p", Answer::object()}};
    for (std::size_t k = 0; k < result.q.size() && k < scene.coordinates.size(); ++k) {
        answer["state"]["q"][scene.coordinates[k].written] = number(result.q[k]);
        answer["state"]["p"][scene.coordinates[k].written] = number(result.p[k]);
    }
    answer["kernel"] = {{"digest", run.source.digest},
                        {"derivation_seconds", number(run.derivation_seconds)},
                        {"compile_seconds", number(run.compiled.seconds)},
                        {"from_cache", run.compiled.from_cache}};
    answer["files"] = {{"trajectory", files.trajectory},
                       {"events", files.events.empty() ? Answer(nullptr) : Answer(files.events)}};
    return json_text(answer);
}

std::string json_of_proof(const std::string& scene, const Proof& proof) {
    Answer answer = answer_of("verify");
    answer.update({{"scene", scene}, {"title", proof.title}, {"method", proof.method}});
    answer["holds"] = std::all_of(proof.rows.begin(), proof.rows.end(), [](const ProofRow& row) { return row.holds; });
    answer["claims"] = Answer::array();
    for (const ProofRow& row : proof.rows)
        answer["claims"].push_back({{"claim", row.claim},
                                    {"measured", row.measured},
                                    {"bound", row.bound},
                                    {"decided", row.measured != "not decided"},
                                    {"holds", row.holds}});
    answer["convergence"] = Answer::array();
    for (const OrderRow& row : proof.convergence.rows)
        answer["convergence"].push_back({{"step", number(row.step)},
                                         {"error", number(row.error)},
                                         {"order", row.order > 0 ? number(row.order) : Answer(nullptr)}});
    return json_text(answer);
}

std::string json_of_choice(const Choice& choice, const Scene& scene, double error, bool is_written) {
    Answer answer = answer_of("tune");
    answer.update({{"scene", scene.path},
                   {"title", scene.title},
                   {"error", error},
                   {"until", number(choice.until)},
                   {"step", number(choice.step())},
                   {"choice", json_of(choice.measurement)},
                   {"reference", choice.reference},
                   {"uncertainty", number(choice.uncertainty)},
                   {"frequency", number(choice.frequency)},
                   {"stability_limit", number(choice.stability_limit)},
                   {"members", choice.members},
                   {"complete", choice.complete},
                   {"seconds", number(choice.seconds)},
                   {"written", is_written}});
    return json_text(answer);
}

std::string json_of_roundoff(const RoundoffResult& result, const std::string& scene, const std::string& method,
                             double step, const std::string& table) {
    Answer answer = answer_of("roundoff");
    answer.update({{"scene", scene},
                   {"method", method},
                   {"step", number(step)},
                   {"steps", result.steps},
                   {"trajectories", result.trajectories},
                   {"interrupted", result.interrupted},
                   {"lost", result.lost}});
    const std::pair<const char*, const RoundoffGrowth*> kinds[] = {{"plain", &result.plain}, {"clean", &result.clean}};
    for (const auto& [name, growth] : kinds) {
        Answer rows = Answer::array();
        for (const RoundoffRow& row : growth->rows)
            rows.push_back({{"steps", row.steps},
                            {"energy_mean", number(row.energy_mean)},
                            {"energy_rms", number(row.energy_rms)},
                            {"position_rms", number(row.position_rms)}});
        answer[name] = {{"energy_exponent", number(growth->energy_exponent)},
                        {"position_exponent", number(growth->position_exponent)},
                        {"nanoseconds", number(growth->nanoseconds)},
                        {"iterations", number(growth->iterations)},
                        {"rows", rows}};
    }
    answer["table"] = result.plain.rows.empty() ? Answer(nullptr) : Answer(table);
    return json_text(answer);
}

std::string json_of_emitted(const std::string& scene, const std::vector<std::string>& files, const std::string& name,
                            const std::vector<PassReport>& passes) {
    Answer answer = answer_of("emit");
    answer.update({{"scene", scene}, {"name", name}, {"files", files}});
    answer["passes"] = Answer::array();
    for (const PassReport& pass : passes)
        answer["passes"].push_back({{"pass", pass.pass},
                                    {"additions", pass.after.additions},
                                    {"multiplications", pass.after.multiplications},
                                    {"divisions", pass.after.divisions},
                                    {"functions", pass.after.functions},
                                    {"disagreement", number(pass.disagreement)}});
    return json_text(answer);
}

std::string json_of_drawn(const std::string& command, const std::string& page, const std::vector<Drawn>& drawn) {
    Answer answer = answer_of(command);
    answer["page"] = page;
    answer["drawn"] = Answer::array();
    for (const Drawn& one : drawn)
        answer["drawn"].push_back({{"scene", one.scene},
                                   {"title", one.title},
                                   {"note", one.note},
                                   {"file", one.file.empty() ? Answer(nullptr) : Answer(one.file)},
                                   {"failure", one.failure.empty() ? Answer(nullptr) : Answer(one.failure)}});
    return json_text(answer);
}

}  // namespace lobatto
