// SPDX-License-Identifier: MIT
#include "runtime/run/side_by_side.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <new>

namespace lobatto {

namespace {

constexpr std::int64_t rows_of_reduction = 1024;

const double no_energy = std::numeric_limits<double>::quiet_NaN();

}  // namespace

SingleTrajectory::SingleTrajectory(const Kernel& kernel, const EnsembleRequest& request) : stepper_(kernel) {
    const auto columns = static_cast<std::size_t>(1 + 2 * kernel->coordinates);
    if (request.reducer) {
        reducer_ = request.reducer();
        records_.resize(rows_of_reduction * columns);
    }
    const bool is_watched = (request.reducer || request.stops) && kernel->events > 0;
    if (is_watched) events_.resize(static_cast<std::size_t>(2 * kernel->events_of_step) * (1 + columns));
}

void SingleTrajectory::prepare(const std::vector<double>& parameters, double step, std::int32_t* status) {
    *status = stepper_.prepare(parameters, step);
}

void SingleTrajectory::start(double time, const std::vector<double>& q, const std::vector<double>& p,
                             std::int32_t* status) {
    time_ = time;
    stop_ = -1;
    if (*status == LOBATTO_OK) *status = stepper_.start(time, q, p);
}

void SingleTrajectory::reduce(const EnsembleStart& start) {
    std::vector<double> row, q, p;
    stepper_.state(time_, q, p);
    row.push_back(time_);
    row.insert(row.end(), q.begin(), q.end());
    row.insert(row.end(), p.begin(), p.end());
    reducer_->begin(stepper_, start);
    reducer_->observe(row.data(), 1);
}

void SingleTrajectory::advance(const EnsembleRequest& request, std::int64_t steps, std::int32_t* status,
                               std::int64_t* steps_done, std::int64_t* iterations) {
    const std::int64_t columns = 1 + 2 * stepper_.kernel()->coordinates;
    lobatto_advance call{};
    call.tolerance = request.tolerance;
    call.interval = request.arrivals.interval;
    call.end = request.arrivals.end;
    if (reducer_) {
        call.record_every = 1;
        call.records = records_.data();
        call.capacity = rows_of_reduction;
        call.chain_records = stepper_.kernel()->clocked;
    }
    if (!events_.empty()) {
        call.events = events_.data();
        call.event_capacity = std::ssize(events_) / (1 + columns);
    }
    *steps_done = *iterations = 0;
    do {  // a clock, or full rows, may need several calls
        call.steps = steps - *steps_done;
        *status = stepper_.advance(call);
        *steps_done += call.steps_done;
        *iterations += call.iterations;
        if (reducer_) {
            reducer_->observe(records_.data(), call.records_written);
            reducer_->observe_events(events_.data(), call.events_written);
        }
        if (*status == LOBATTO_STOPPED) stop_at(events_.data() + (call.events_written - 1) * (1 + columns));
    } while (*status == LOBATTO_OK && *steps_done < steps);
}

// `row`: event number, t, q, p.
void SingleTrajectory::stop_at(const double* row) {
    const std::int64_t n = stepper_.kernel()->coordinates;
    stop_ = static_cast<int>(row[0]);
    time_ = row[1];
    stop_q_.assign(row + 2, row + 2 + n);
    stop_p_.assign(row + 2 + n, row + 2 + 2 * n);
    if (reducer_) reducer_->observe(row + 1, 1);
}

void SingleTrajectory::state(std::vector<double>& q, std::vector<double>& p) {
    if (stop_ >= 0) {
        q = stop_q_;
        p = stop_p_;
    } else {
        stepper_.state(time_, q, p);
    }
}

void SingleTrajectory::energy(const std::vector<double>& q, const std::vector<double>& p,
                              std::vector<double>& energy) const {
    const bool has_one = stepper_.kernel()->has_energy != 0 && stepper_.energy(time_, q, p, energy[0]) == LOBATTO_OK;
    if (!has_one) energy[0] = no_energy;
}

LaneTrajectories::LaneTrajectories(const Kernel& kernel)
    : kernel_(kernel),
      memory_(::operator new (static_cast<std::size_t>(kernel->ensemble_bytes),
                              std::align_val_t{static_cast<std::size_t>(kernel->ensemble_alignment)}),
              Deleter{static_cast<std::size_t>(kernel->ensemble_alignment)}) {}

void LaneTrajectories::Deleter::operator()(void* memory) const {
    ::operator delete (memory, std::align_val_t{alignment});
}

void LaneTrajectories::prepare(const std::vector<double>& parameters, double step, std::int32_t* status) {
    kernel_->ensemble_prepare(memory_.get(), parameters.data(), &step, status);
}

void LaneTrajectories::start(double time, const std::vector<double>& q, const std::vector<double>& p,
                             std::int32_t* status) {
    kernel_->ensemble_start(memory_.get(), &time, q.data(), p.data(), status);
}

void LaneTrajectories::advance(const EnsembleRequest& request, std::int64_t steps, std::int32_t* status,
                               std::int64_t* steps_done, std::int64_t* iterations) {
    kernel_->ensemble_advance(memory_.get(), steps, request.tolerance, status, steps_done, iterations);
}

void LaneTrajectories::state(std::vector<double>& q, std::vector<double>& p) {
    kernel_->ensemble_state(memory_.get(), q.data(), p.data());
}

void LaneTrajectories::energy(const std::vector<double>&, const std::vector<double>&,
                              std::vector<double>& energy) const {
    if (kernel_->ensemble_energy == nullptr)
        std::fill(energy.begin(), energy.end(), no_energy);
    else
        kernel_->ensemble_energy(memory_.get(), energy.data());
}

}  // namespace lobatto
