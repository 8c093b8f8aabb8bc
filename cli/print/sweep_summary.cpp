// SPDX-License-Identifier: GPL-2.0-or-later
#include "cli/print/sweep_summary.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "analysis/accuracy/companion/companion.hpp"
#include "cli/print/summary.hpp"
#include "cli/print/tell.hpp"

namespace lobatto {

namespace {

constexpr std::size_t coordinates_told = 3, settings_told = 40;  // at most

std::string spread_text(const Spread& spread) {
    return fmt::format("{:.6g} to {:.6g}, mean {:.6g}, rms {:.6g}", spread.least, spread.largest, spread.mean,
                       spread.rms);
}

// How many each stop ended: a reaction probability, say.
void print_stops(const Scene& scene, const SweepTally& tally) {
    const auto ends = scene.ends();
    for (std::size_t i = 0; i < ends.size(); ++i) {
        const auto& [number, event] = ends[i];
        print_row(i == 0 ? "stopped" : "",
                  fmt::format("{} by '{}'", tally.count_of_stop(number - scene.outputs.events.size() + 1), event.text));
    }
    if (!ends.empty() && tally.count_of_stop(0) > 0) print_row("", fmt::format("{} by none", tally.count_of_stop(0)));
}

// A row for each setting: a study of convergence.
void print_settings(const SweepStudy& study, const SweepTally& tally) {
    const SweepStarts& starts = study.starts();
    const std::size_t count = tally.settings().size();
    for (std::size_t number = 0; number < std::min(count, settings_told); ++number) {
        const SettingTally& setting = tally.settings()[number];
        if (setting.trajectories == 0) continue;
        // With a clock trajectories are counted by the times at which they are looked at.
        std::string text = study.scene().clock ? counted(setting.steps_done, "state", "states")
                                               : counted(setting.steps_done, "step", "steps");
        if (setting.failed > 0) text += fmt::format(", {} of {} failed", setting.failed, setting.trajectories);
        if (study.scene().outputs.energy && setting.energy_error.index >= 0)
            text += fmt::format(", energy error {:.2g} at most{}", setting.energy_error.value,
                                setting.read_back > 0 ? " of those computed now" : "");
        if (setting.error.index >= 0)
            text += fmt::format(", measured error {:.1e} of the amplitude at most", setting.error.value);
        print_row(starts.text_of(static_cast<std::int64_t>(number) * starts.count_of_setting(), true), text);
    }
    if (count > settings_told) print_row("…", counted(static_cast<std::int64_t>(count), "setting", "settings"));
}

// Where rows of an earlier call do not tell what the sums are of.
std::string of_those(const SweepTally& tally, std::int64_t count) {
    const bool lacks_some = tally.read_back() > 0 && count < tally.trajectories() - tally.failed();
    return lacks_some ? "; of those computed now" : "";
}

void print_state(const Scene& scene, const SweepTally& tally) {
    if (tally.failed() == tally.trajectories() || scene.coordinates.size() > coordinates_told) return;
    const auto print = [&](const std::string& name, const Sums& sums) {
        if (sums.count() > 0)
            print_row(name + " at the end", spread_text(sums.spread()) + of_those(tally, sums.count()));
    };
    for (std::size_t k = 0; k < scene.coordinates.size(); ++k) print(scene.coordinates[k].name, tally.q(k));
    for (std::size_t k = 0; k < scene.coordinates.size() && scene.outputs.momenta; ++k)
        print("p_" + scene.coordinates[k].name, tally.p(k));
}

}  // namespace

void print_sweep(const SweepStudy& study, const SweepTally& tally, const StudyTimes& times, std::int64_t asked) {
    const Scene& scene = study.scene();
    const SweepStarts& starts = study.starts();
    const bool is_one = starts.settings() == 1;
    const std::string of_all = times.interrupted ? fmt::format(" of {}", asked) : "";
    print_row("trajectories", fmt::format("{}{}{}", tally.trajectories(), of_all,
                                          tally.failed() == 0 ? "" : fmt::format(", {} failed", tally.failed())));
    if (is_one) {
        const EnsembleRequest& request = study.first_setting().request;
        print_row("steps", scene.clock
                               ? fmt::format("h = {:.6g} in the time of the clock {}, to t = {:.6g}", request.step,
                                             scene.clock->text, time_after(request, request.steps))
                               : fmt::format("{} each, h = {:.6g}, to t = {:.6g}", request.steps, request.step,
                                             static_cast<double>(request.steps) * request.step));
    }
    if (const CudaDevice* const device = study.device(); device != nullptr)
        print_row("device",
                  fmt::format("{}, {} at a time", device->name(), counted(times.lanes, "trajectory", "trajectories")));
    else if (times.threads > 0)
        print_row("threads",
                  fmt::format("{}, {} each", times.threads,
                              times.lanes == 0 ? "one trajectory at a time" : counted(times.lanes, "lane", "lanes")));
    if (scene.clock && times.steps_done > 0) {
        const auto count = static_cast<double>(times.trajectories);
        print_row("time", duration(times.processor_seconds / count) + " of a processor, for one trajectory");
    } else if (times.steps_done > 0) {
        const auto steps = static_cast<double>(times.steps_done);
        print_row("speed", fmt::format("{:.3g} steps per second", steps / times.seconds));
        if (study.device() == nullptr)
            print_row("time per step",
                      duration(times.processor_seconds / steps) + " of a processor, for one trajectory");
    }
    if (!is_one) {
        print_settings(study, tally);
        return;
    }
    const SettingTally none, &all = tally.settings().empty() ? none : tally.settings().back();
    if (scene.outputs.energy && all.energy_error.index >= 0) {
        const bool conserves = study.first_setting().outline->conserves_energy();
        print_row(conserves ? "energy error" : "energy change",
                  fmt::format("{:.2g} at most, of trajectory {}, {}{}", all.energy_error.value, all.energy_error.index,
                              starts.text_of(all.energy_error.index),
                              tally.read_back() > 0 ? "; of those computed now" : ""));
        const Spread spread = tally.energy_error().spread();
        print_row("  at the end",
                  fmt::format("{:.2g} to {:.2g}, mean {:.2g}, rms {:.2g}{}", spread.least, spread.largest, spread.mean,
                              spread.rms, of_those(tally, tally.energy_error().count())));
    }
    if (all.error.index >= 0)
        print_row("measured error", fmt::format("{:.1e} of the amplitude at most, of trajectory {}, {}",
                                                all.error.value, all.error.index, starts.text_of(all.error.index)));
    if (study.measures() && all.unmeasured > 0 && scene.may_end_early())
        print_row(
            all.error.index >= 0 ? "  not of" : "measured error",
            fmt::format("{}{} could not be followed to the stop in other steps",
                        all.error.index >= 0 ? "" : "none: ", counted(all.unmeasured, "trajectory", "trajectories")));
    print_stops(scene, tally);
    print_state(scene, tally);
}

void print_sweep_notes(const SweepStudy& study) {
    if (study.starts().settings() == 1 && !study.first_setting().steps.reaches_end)
        fmt::print("The end time is not a multiple of the step: the runs end at the last multiple before it.\n");
}

std::string failures_text(const SweepStudy& study, const SweepTally& tally) {
    std::vector<std::string> reasons;
    for (std::size_t status = 1; status < sweep_statuses.size(); ++status)
        if (const std::int64_t count = tally.count_of(static_cast<int>(status)); count > 0)
            reasons.push_back(fmt::format("{} {}", count, sweep_statuses[status]));
    const std::vector<SweepFigures>& first = tally.first_failures();
    std::string text =
        fmt::format("{}: {} of {} failed: {}.{} {}:", study.scene().path, tally.failed(),
                    counted(tally.trajectories(), "trajectory", "trajectories"), fmt::join(reasons, ", "),
                    tally.failed() < tally.trajectories() ? " The others went on." : "",
                    tally.failed() > std::ssize(first) ? "The first of them" : "They are");
    for (const SweepFigures& failure : first) {
        const std::string complaint = study.starts().complaint(failure.index);
        text += fmt::format("\n  trajectory {}, {}: {}", failure.index, study.starts().text_of(failure.index),
                            complaint.empty() ? sweep_statuses[static_cast<std::size_t>(failure.status)] : complaint);
        if (failure.status < departed)
            text += study.scene().clock
                        ? fmt::format(" after t = {:.6g}, the last of its times that it reached", failure.time)
                        : fmt::format(" in step {}, after t = {:.6g}", failure.steps_done + 1, failure.time);
    }
    const auto some = [&](std::initializer_list<int> statuses) {
        return std::any_of(statuses.begin(), statuses.end(), [&](int status) { return tally.count_of(status) > 0; });
    };
    std::string advice;
    if (some({LOBATTO_NOT_CONVERGED, LOBATTO_NOT_FINITE, LOBATTO_SINGULAR_JACOBIAN, LOBATTO_TIME_STANDS_STILL, departed,
              unresolved}))
        advice += "a smaller --step, ";
    if (some({unresolved})) advice += "--beyond-horizon for the statistics of chaos, ";
    if (some({unresolved, LOBATTO_IMPACTS_ACCUMULATE})) advice += "an earlier end, ";
    return text + (advice.empty() ? "\nLeave these values out." : "\nTry " + advice + "or leave these values out.");
}

namespace {

nlohmann::ordered_json json_of(const Worst& worst) {
    if (worst.index < 0 || !std::isfinite(worst.value)) return nullptr;
    return {{"value", worst.value}, {"trajectory", worst.index}};
}

}  // namespace

std::string json_of_sweep(const SweepStudy& study, const SweepTally& tally, const StudyTimes& times,
                          const SweptTable& table) {
    using Json = nlohmann::ordered_json;
    Json json = {{"format", 1},
                 {"command", "sweep"},
                 {"scene", study.scene().path},
                 {"title", study.scene().title},
                 {"ending", times.interrupted    ? "interrupted"
                            : tally.failed() > 0 ? "failed"
                                                 : "done"},
                 {"asked", table.asked},
                 {"trajectories", tally.trajectories()},
                 {"read_back", tally.read_back()},
                 {"failed", tally.failed()}};
    json["failures"] = Json::array();
    for (std::size_t status = 1; status < sweep_statuses.size(); ++status)
        if (const std::int64_t count = tally.count_of(static_cast<int>(status)); count > 0)
            json["failures"].push_back({{"status", status}, {"reason", sweep_statuses[status]}, {"count", count}});
    json["settings"] = Json::array();
    for (const SettingTally& one : tally.settings())
        json["settings"].push_back({{"trajectories", one.trajectories},
                                    {"failed", one.failed},
                                    {"steps", one.steps_done},
                                    {"energy_error", json_of(one.energy_error)},
                                    {"measured_error", json_of(one.error)}});
    json["steps"] = times.steps_done;
    json["seconds"] = times.seconds;
    json["processor_seconds"] = times.processor_seconds;
    json["threads"] = times.threads;
    json["lanes"] = times.lanes;
    json["warnings"] = table.warnings;
    json["table"] = table.path;
    json["rows"] = table.rows;
    return json.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace lobatto
