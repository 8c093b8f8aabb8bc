// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/stability/linear_departure.hpp"

#include <fmt/format.h>

#include <cmath>

#include "analysis/stability/linearisation.hpp"
#include "runtime/measure/monodromy.hpp"

namespace lobatto {

namespace {

constexpr std::size_t most_coordinates = 64;
constexpr long steps_measured = 4000;
constexpr double times_too_large = 1000;

// What is measured, a step, of a bounded motion, and of one that grows like t^(2n - 1): between the halves of a
// measurement by 2^(2n - 1).
double floor_of(std::size_t n) {
    return (10 + 2 * std::log(2.0) * static_cast<double>(2 * n - 1)) / steps_measured;
}

}  // namespace

std::string linear_departure(const Outline& outline, const Scene& scene, const Kernel& kernel,
                             const TrajectoryRequest& request, const TrajectoryResult& result) {
    const std::size_t n = scene.coordinates.size();
    const bool energy_tells = outline.conserves_energy();
    LoadedStepper<double> stepper(kernel);
    if (!outline.system.linear || energy_tells || n > most_coordinates ||
        stepper.prepare(request.parameters, request.step) != LOBATTO_OK)
        return "";
    const double too_large = std::log(times_too_large) / static_cast<double>(result.steps_done);  // a step
    const auto measured = measured_rate(stepper, request.step, steps_measured);
    if (!measured || *measured - floor_of(n) < too_large) return "";
    const System system = build_system(outline.scene);
    Linearisation linearisation(scene, system);
    const Eigen::VectorXd origin = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(n));
    const double own = std::fmax(0, std::fabs(request.step) * linearisation.at(request.time, origin, origin).rate());
    const double excess = *measured - own - floor_of(n);
    if (excess < too_large) return "";
    return fmt::format(
        "the run is wrong from about step {:.0f} on, and at its end, t = {:.6g}, q = {}, p = {}: a step multiplies the "
        "motion by {:.4g}, and by itself it grows by {:.4g} in that time. The step is {}. Try a smaller step, such as "
        "h = {:.6g}; `lobatto stability{}` tells the limits.",
        std::ceil(std::log(times_too_large) / excess), result.time, list_text(result.q), list_text(result.p),
        std::exp(*measured), std::exp(own),
        outline.quadrature.method.family == Family::gauss ? "so long for this motion that rounding swamps it"
                                                          : "beyond the stability of the method",
        request.step / 2,
        outline.quadrature.is_explicit() ? fmt::format(" --splitting {}", outline.quadrature.method.points) : "");
}

}  // namespace lobatto
