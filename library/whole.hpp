// SPDX-License-Identifier: GPL-2.0-or-later
// Everything that is computed of a scene. lobatto.hpp returns the part whose interface stays stable; the command line
// prints the rest too. Both call these functions, so each operation exists once.
//
// These throw what the parts of the program throw; callers stand in in_algebra() or guarded() (parts.hpp).
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "analysis/accuracy/roundoff_growth.hpp"
#include "analysis/checked_scene.hpp"
#include "analysis/proof/proof.hpp"
#include "analysis/stability/report.hpp"
#include "analysis/tradeoff/choice.hpp"
#include "analysis/tradeoff/experiment.hpp"
#include "generator/describe/describe.hpp"
#include "generator/pipeline.hpp"
#include "library/parts.hpp"

namespace lobatto::api {

Checked checked(const Scene& scene, const Settings& settings, Shortcuts shortcuts = Shortcuts::all);
Description described(const Scene& scene, const Settings& settings);

struct EmitWish {
    Shortcuts shortcuts = Shortcuts::all;
    bool standalone = true;  // carries kernel.hpp inside
    bool ensemble = false;   // that with lobatto::Ensemble
};
KernelSource emitted(const Scene& scene, const Settings& settings, const EmitWish& wish);
PlainSource plainly_emitted(const Scene& scene, const Settings& settings);

StabilityReport stability_of(const Scene& scene, const Settings& settings);

// The scene whose rounding is measured, in clean arithmetic, with the values of settings.
lobatto::Scene for_roundoff(const Scene& scene, const Settings& settings);
// `scene`: of for_roundoff. The rest is that of roundoff_growth().
struct RoundoffRequest {
    std::int64_t steps = 100000;
    int trajectories = 16;
    bool reference = true;
    const volatile int* interrupted = nullptr;
    std::function<void(std::int64_t)> progress;
};
RoundoffResult roundoff_of(lobatto::Scene scene, const RoundoffRequest& request);

// `say` hears what is being checked, and about which part of all work is behind.
using Heard = std::function<void(const std::string&, double)>;
Proof proof_of(const Scene& scene, const Settings& settings, const Heard& say = {});

// A scene as it is written, and with the values of settings.
struct ChangedScene {
    lobatto::Scene written, changed;
};
// For what measures a scene: `command` says that walls have no place there.
ChangedScene measurable(const Scene& scene, const Settings& settings, const std::string& command);
// What accuracy costs, over the family.
struct Explored {
    std::unique_ptr<Experiment> experiment;  // none where it was interrupted before its reference was known
    std::vector<Member> unmeasured = {};     // for want of time
    bool interrupted = false;
};
Explored explored(const ChangedScene& scene, const ExperimentRequest& request);
// Seconds that measuring may take: InputError where they are no time. `written`: as errors show it.
void check_budget(double seconds, const std::string& written);

// The cheapest method and step that keep `request.error` in `request.seconds`; Interrupted where that ended it.
struct FoundChoice {
    lobatto::Scene scene;  // with the values of the settings
    lobatto::Choice choice;
};
FoundChoice choice_for(const Scene& scene, const Settings& settings, const ChoiceRequest& request);

}  // namespace lobatto::api
