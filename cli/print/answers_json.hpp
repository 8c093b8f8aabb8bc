// SPDX-License-Identifier: GPL-2.0-or-later
// What commands report, for machines: JSON, by the schemas in docs/schemas/. A number that is not
// known or not finite is null.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "analysis/accuracy/judged_run.hpp"
#include "analysis/accuracy/roundoff_growth.hpp"
#include "analysis/proof/proof.hpp"
#include "analysis/tradeoff/choice.hpp"
#include "generator/emit/kernel.hpp"

namespace lobatto {

// Of a run: what `lobatto run` prints. `defect`: its symplectic defect, where it was measured.
struct RunFiles {
    std::string trajectory, events;  // of the events "" where there are none
};
std::string json_of_run(const PreparedRun& run, const TrajectoryRequest& request, const TrajectoryResult& result,
                        const RunObservers& observers, const RunVerdict& verdict, std::optional<double> defect,
                        const RunFiles& files);
std::string json_of_proof(const std::string& scene, const Proof& proof);
std::string json_of_choice(const Choice& choice, const Scene& scene, double error, bool is_written);
std::string json_of_roundoff(const RoundoffResult& result, const std::string& scene, const std::string& method,
                             double step, const std::string& table);
std::string json_of_emitted(const std::string& scene, const std::vector<std::string>& files, const std::string& name,
                            const std::vector<PassReport>& passes);

// A page of motions, or a folder of pictures: what each is of, and where it stands.
struct Drawn {
    std::string scene, title, note, file;
    std::string failure = "";  // why not to trust it
};
std::string json_of_drawn(const std::string& command, const std::string& page, const std::vector<Drawn>& drawn);

}  // namespace lobatto
