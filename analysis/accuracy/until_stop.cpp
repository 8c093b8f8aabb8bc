// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/accuracy/until_stop.hpp"

#include <utility>

#include "analysis/kernel/derived_kernel.hpp"
#include "analysis/kernel/kernel_of.hpp"
#include "analysis/motion.hpp"
#include "runtime/stopwatch.hpp"

namespace lobatto {

Scene ending_at_stop(Scene scene) {
    if (!scene.may_end_early()) return scene;
    Scene looking = scene;
    looking.method.numbers = Precision::double_;
    const Kernel kernel = kernel_of(derived_kernel(looking, {}).source, Precision::double_);
    LoadedStepper<double> stepper(kernel);
    TrajectoryRequest request = request_of(looking, steps_of(looking).count, stepper);
    request.events = [](const EventRecords&) {};  // stops are sought with them
    constexpr double longest = 2;                 // seconds
    const Stopwatch watch;
    volatile int is_late = 0;
    request.interrupted = &is_late;
    request.progress = [&](std::int64_t) { is_late = watch.seconds() > longest ? 1 : 0; };
    const TrajectoryResult result = integrate(kernel, request);
    if (result.stop < 0 || result.steps_done == 0) return scene;
    scene.run.until = scene.clock ? GiNaC::numeric(result.time)
                                  : scene.evaluate(scene.run.step, "the step") * GiNaC::numeric(result.steps_done);
    return scene;
}

}  // namespace lobatto
