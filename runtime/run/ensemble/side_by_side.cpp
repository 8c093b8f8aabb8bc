// SPDX-License-Identifier: MIT
#include "runtime/run/ensemble/side_by_side.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "runtime/run/parts.hpp"

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

void SingleTrajectory::prepare(const std::vector<double>& parameters, const std::vector<double>& step,
                               std::int32_t* status) {
    cuts_.set_step(step[0]);
    *status = stepper_.prepare(parameters, step[0]);
}

void SingleTrajectory::start(double time, const std::vector<double>& q, const std::vector<double>& p,
                             std::int32_t* status) {
    time_ = time;
    stop_ = -1;
    cuts_.begin(time);
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
    cuts_.ask(call);
    *steps_done = *iterations = 0;
    do {  // a clock, or full rows, may need several calls
        call.steps = steps - *steps_done;
        *status = stepper_.advance(call);
        cuts_.observe(call);
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

NumberTrajectory::NumberTrajectory(const Kernel& kernel, const EnsembleRequest& request)
    : stepper_(kernel), event_rows_(request.stops && kernel->events > 0 ? 2 * kernel->events_of_step : 0) {}

void NumberTrajectory::prepare(const std::vector<double>& parameters, const std::vector<double>& step,
                               std::int32_t* status) {
    cuts_.set_step(step[0]);
    *status = stepper_.prepare(parameters, step);
}

void NumberTrajectory::start(double time, const std::vector<double>& q, const std::vector<double>& p,
                             std::int32_t* status) {
    time_ = as_parts({time}, stepper_.parts());
    stop_ = -1;
    cuts_.begin(time);
    if (*status == LOBATTO_OK) *status = stepper_.start(time_, q, p);
}

void NumberTrajectory::advance(const EnsembleRequest& request, std::int64_t steps, std::int32_t* status,
                               std::int64_t* steps_done, std::int64_t* iterations) {
    lobatto_advance call{};
    call.tolerance = request.tolerance;
    call.event_capacity = event_rows_;
    cuts_.ask(call);
    std::vector<double> records, events;
    *steps_done = *iterations = 0;
    do {  // full rows may need several calls
        call.steps = steps - *steps_done;
        *status = stepper_.advance(call, records, events);
        cuts_.observe(call);
        *steps_done += call.steps_done;
        *iterations += call.iterations;
    } while (*status == LOBATTO_OK && *steps_done < steps);
    if (*status != LOBATTO_STOPPED) return;
    const auto one = static_cast<std::ptrdiff_t>(stepper_.parts()),
               n = static_cast<std::ptrdiff_t>(stepper_.coordinates()) * one;  // row: event number, t, q, p
    stop_ = static_cast<int>(*(events.end() - 2 * n - 2 * one));
    time_.assign(events.end() - 2 * n - one, events.end() - 2 * n);
    stop_q_.assign(events.end() - 2 * n, events.end() - n);
    stop_p_.assign(events.end() - n, events.end());
}

void NumberTrajectory::state(std::vector<double>& q, std::vector<double>& p) {
    if (stop_ >= 0) {
        q = stop_q_;
        p = stop_p_;
    } else {
        stepper_.state(time_, q, p);
    }
}

void NumberTrajectory::energy(const std::vector<double>& q, const std::vector<double>& p,
                              std::vector<double>& energy) const {
    const bool has_one = stepper_.kernel()->has_energy != 0 &&
                         stepper_.energy(time_.data(), q.data(), p.data(), energy.data()) == LOBATTO_OK;
    if (!has_one) std::fill(energy.begin(), energy.end(), no_energy);
}

LaneTrajectories::LaneTrajectories(const Kernel& kernel)
    : kernel_(kernel), memory_(kernel->ensemble_bytes, kernel->ensemble_alignment) {}

const void* LaneTrajectories::numbers(const std::vector<double>& values, std::vector<std::byte>& room) const {
    if (kernel_->real_kind == LOBATTO_DOUBLE) return values.data();
    room.resize(values.size() * static_cast<std::size_t>(kernel_->real_bytes));
    kernel_->from_parts(values.data(), std::ssize(values), room.data());
    return room.data();
}

template <class Read>
void LaneTrajectories::read(std::vector<double>& values, std::vector<std::byte>& room, const Read& read) const {
    if (kernel_->real_kind == LOBATTO_DOUBLE) return read(static_cast<void*>(values.data()));
    room.resize(values.size() * static_cast<std::size_t>(kernel_->real_bytes));
    read(static_cast<void*>(room.data()));
    kernel_->to_parts(room.data(), std::ssize(values), values.data());
}

void LaneTrajectories::prepare(const std::vector<double>& parameters, const std::vector<double>& step,
                               std::int32_t* status) {
    kernel_->ensemble_prepare(memory_.get(), numbers(parameters, room_), numbers(step, more_room_), status);
}

void LaneTrajectories::start(double time, const std::vector<double>& q, const std::vector<double>& p,
                             std::int32_t* status) {
    std::vector<std::byte> room_of_time;
    kernel_->ensemble_start(memory_.get(), numbers({time}, room_of_time), numbers(q, room_), numbers(p, more_room_),
                            status);
}

void LaneTrajectories::advance(const EnsembleRequest& request, std::int64_t steps, std::int32_t* status,
                               std::int64_t* steps_done, std::int64_t* iterations) {
    kernel_->ensemble_advance(memory_.get(), steps, request.tolerance, status, steps_done, iterations);
}

void LaneTrajectories::state(std::vector<double>& q, std::vector<double>& p) {
    read(q, room_, [&](void* positions) {
        read(p, more_room_, [&](void* momenta) { kernel_->ensemble_state(memory_.get(), positions, momenta); });
    });
}

void LaneTrajectories::energy(const std::vector<double>&, const std::vector<double>&,
                              std::vector<double>& energy) const {
    if (kernel_->ensemble_energy == nullptr)
        std::fill(energy.begin(), energy.end(), no_energy);
    else
        read(energy, room_, [&](void* values) { kernel_->ensemble_energy(memory_.get(), values); });
}

}  // namespace lobatto
