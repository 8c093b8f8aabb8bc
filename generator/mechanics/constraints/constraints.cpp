// SPDX-License-Identifier: GPL-2.0-or-later
#include "generator/mechanics/constraints/constraints.hpp"

namespace lobatto {

void require_method_of_constraints(const Scene& scene) {
    if (scene.constraints.empty()) return;
    const auto refuse = [&](const std::string& why) {
        scene.source.fail(scene.constraints.front().at, "constraints need " + why);
    };
    if (scene.method.family != Family::lobatto)
        refuse("a method whose nodes hold both ends of a step, as Lobatto's do (--points 4)");
    if (scene.method.arithmetic == StepArithmetic::clean) refuse("plain arithmetic (--arithmetic plain)");
    if (scene.clock) refuse("equal steps in time; leave out the clock");
}

void refuse_constraints(const Scene& scene, const std::string& what) {
    if (scene.constraints.empty()) return;
    scene.source.fail(scene.constraints.front().at,
                      what +
                          " knows no constraints yet; run, sweep, emit, derive, check, verify, "
                          "tune and tradeoff do");
}

}  // namespace lobatto
