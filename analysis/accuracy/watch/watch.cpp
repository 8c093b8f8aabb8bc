// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/accuracy/watch/watch.hpp"

#include <cmath>

#include "runtime/measure/reference.hpp"

namespace lobatto {

namespace {

// To long double: a double and what it leaves.
long double nearest(const Scene& scene, const GiNaC::ex& value, const char* what) {
    const GiNaC::numeric exact = scene.evaluate(value, what);
    const double high = exact.to_double();
    return static_cast<long double>(high) + static_cast<long double>((exact - GiNaC::numeric(high)).to_double());
}

}  // namespace

Watch::Watch(const Scene& scene, const std::optional<ClosedSolution>& closed, const LoadedStepper<double>& stepper,
             const std::vector<double>& velocity)
    : between_(scene.outputs.dense) {
    // In double, which the closed forms and the rows are: it would be the rounding of finer numbers.
    if (!scene.is_cut() && decimals_of(scene.method.numbers) <= decimals_of(Precision::double_)) {
        closed_ = closed;
        discrete_ = discrete_energy(stepper);
    }
    if (!closed_) return;
    omega_squared_ = nearest(scene, closed_->omega_squared, "the squared frequency");
    q0_ = nearest(scene, scene.initial_position[0], "the initial position");
    velocity0_ = scene.start == Start::velocity ? nearest(scene, scene.initial_rate[0], "the initial velocity")
                                                : static_cast<long double>(velocity[0]);
}

void Watch::observe(const Records& records) {
    const int n = (records.columns - 1) / 2;
    for (std::int64_t i = 0; i < records.count; ++i, ++seen_) {
        if (seen_ % (between_ + 1) != 0) continue;  // between two steps
        const double* row = records.rows + i * records.columns;
        if (discrete_) {
            const double value = (*discrete_)(row + 1, row + 1 + n);
            if (seen_ == 0) discrete_start_ = value;
            discrete_error_ = std::fmax(discrete_error_, std::fabs(value - discrete_start_));
        }
        if (closed_ && seen_ / (between_ + 1) % stride_ == 0) compare(row[0], row[1]);
    }
}

void Watch::look_at_end(const TrajectoryResult& result) {
    if (closed_) compare(result.time, result.q[0]);
}

std::vector<double> Watch::save() const {
    return {position_error_,
            static_cast<double>(seen_),
            static_cast<double>(compared_),
            static_cast<double>(stride_),
            discrete_start_,
            discrete_error_};
}

void Watch::restore(const std::vector<double>& saved) {
    position_error_ = saved.at(0);
    seen_ = std::llround(saved.at(1));
    compared_ = std::llround(saved.at(2));
    stride_ = std::llround(saved.at(3));
    discrete_start_ = saved.at(4);
    discrete_error_ = saved.at(5);
}

std::optional<double> Watch::discrete_error() const {
    if (!discrete_ || discrete_error_ > std::fabs(discrete_start_))
        return std::nullopt;  // that it is 0 but for rounding
    return discrete_start_ == 0 ? discrete_error_ : discrete_error_ / std::fabs(discrete_start_);
}

std::optional<double> Watch::position_error() const {
    return closed_ ? std::optional(position_error_) : std::nullopt;
}

void Watch::compare(double time, double q) {
    const PhasePoint exact = is_elliptic()
                                 ? pendulum_solution(omega_squared_, q0_, velocity0_, static_cast<long double>(time))
                                 : harmonic_solution(omega_squared_, q0_, velocity0_, static_cast<long double>(time));
    position_error_ = std::fmax(position_error_, static_cast<double>(std::fabs(static_cast<long double>(q) - exact.q)));
    // A closed form costs more than a step: of a long run every 2nd, 4th, 8th ... kept state is compared.
    if (++compared_ % 4096 == 0) stride_ *= 2;
}

}  // namespace lobatto
