// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/sweep/warnings.hpp"

#include <fmt/format.h>

#include "analysis/accuracy/companion/measured_error.hpp"
#include "analysis/accuracy/formulas/jumps.hpp"

namespace lobatto {

std::vector<std::string> warnings_of(const SweepStudy& study, const Worst& error) {
    std::vector<std::string> warnings;
    const Scene& scene = study.scene();
    // Which parameters that vary decide the step or the end time: those of the scene count, for all trajectories.
    const bool varies_step = study.starts().varies(VariedName::Role::step, 0);
    for (const SweepStarts::Column& column : study.starts().columns()) {
        if (column.of.role != VariedName::Role::parameter) continue;
        const Parameter& parameter = scene.parameters[column.of.index];
        const bool has_step = !varies_step && scene.run.step.has(parameter.symbol),
                   has_end = scene.run.until.has(parameter.symbol);
        if (has_step || has_end)
            warnings.push_back(fmt::format("{} for all trajectories {} of {} = {:.6g}",
                                           has_step && has_end ? "the step and the end time"
                                           : has_step          ? "the step"
                                                               : "the end time",
                                           has_step && has_end ? "are those" : "is that", parameter.written,
                                           scene.evaluate(parameter.value, parameter.name).to_double()));
    }
    std::vector<double> parameters;
    for (const Parameter& one : scene.parameters) parameters.push_back(scene.evaluate(one.value, one.name).to_double());
    for (const std::string& jump : jumps_of(scene, parameters)) warnings.push_back(jump);
    if (error.index >= 0 && error.value > large_error)
        warnings.push_back(fmt::format(
            "the error of trajectory {}, {}, is {:.2g} of the amplitude; take a smaller step, or more points",
            error.index, study.starts().text_of(error.index), error.value));
    return warnings;
}

}  // namespace lobatto
