// SPDX-License-Identifier: MIT
#include "runtime/measure/explicit_motion.hpp"

#include <algorithm>
#include <cmath>

#include "runtime/measure/extrapolation.hpp"
#include "runtime/measure/frequency.hpp"

namespace lobatto {

namespace {

constexpr int frequency_places = 8;
constexpr double roughly = 1e-6, precisely = 1e-20;  // tolerances of a macro step

// What errors of positions and momenta are relative to: the largest of either at the start, or one.
std::vector<__float128> scales_of(const QuadrupleStart& start) {
    std::vector<__float128> scale;
    for (const auto* block : {&start.q, &start.p}) {
        __float128 largest = 0;
        for (const __float128 x : *block) largest = std::max(largest, x < 0 ? -x : x);
        scale.insert(scale.end(), block->size(), largest > 0 ? largest : __float128(1));
    }
    return scale;
}

LoadedStepper<__float128> prepared(const Kernel& kernel, const QuadrupleStart& start, double duration) {
    LoadedStepper<__float128> stepper(kernel);
    stepper.prepare(start.parameters, duration);
    return stepper;
}

}  // namespace

double fastest_oscillation(const Kernel& kernel, const QuadrupleStart& start, double duration) {
    const LoadedStepper<__float128> stepper = prepared(kernel, start, duration);
    const std::vector<__float128> scale = scales_of(start);
    const std::vector<double> rounded(scale.begin(), scale.end());
    Extrapolation<__float128> way(stepper, scale, roughly);
    way.start(0, start.q, start.p);
    double fastest = 0;
    const auto n = std::ssize(start.q);
    for (int place = 0; place <= frequency_places; ++place) {
        const std::vector<__float128>&state = way.state(), q(state.begin(), state.begin() + n),
              p(state.begin() + n, state.end());
        const double frequency = largest_frequency(stepper, way.time(), q, p, rounded);
        if (frequency > fastest) fastest = frequency;
        const double next = duration * (place + 1) / frequency_places;
        if (kernel->constraints > 0 || place == frequency_places || !way.advance_to(next)) break;
    }
    return fastest;
}

bool is_smooth(const Kernel& kernel, const QuadrupleStart& start, double duration) {
    Extrapolation<__float128> way(prepared(kernel, start, duration), scales_of(start), precisely);
    way.start(0, start.q, start.p);
    return kernel->constraints > 0 || way.advance_to(duration);
}

}  // namespace lobatto
