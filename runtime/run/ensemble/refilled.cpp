// SPDX-License-Identifier: MIT
#include "runtime/run/ensemble/refilled.hpp"

#include <algorithm>
#include <cmath>

#include "runtime/run/other_velocity.hpp"
#include "runtime/run/timing.hpp"

namespace lobatto {

namespace {

constexpr std::int64_t rows_of_call = 256;  // of a lane
constexpr std::int64_t events_of_call = 64;

}  // namespace

RefilledLanes::RefilledLanes(const Kernel& kernel, const EnsembleRequest& request, Shared& shared)
    : kernel_(kernel),
      request_(request),
      shared_(shared),
      n_(static_cast<std::size_t>(kernel->coordinates)),
      columns_(1 + 2 * kernel->coordinates),
      capacity_(rows_of_call),
      event_capacity_(std::max<std::int64_t>(events_of_call, kernel->events_of_step)),
      memory_(kernel->ensemble_bytes, kernel->ensemble_alignment) {
    const auto width = static_cast<std::size_t>(kernel->lanes);
    for (std::size_t lane = 0; lane < width; ++lane)
        lanes_.push_back({-1, LoadedStepper<double>(kernel), request.reducer ? request.reducer() : nullptr, {}});
    start_.parameters.resize(static_cast<std::size_t>(kernel->parameters));
    start_.q.resize(n_);
    start_.rate.resize(n_);
    records_.resize(width * static_cast<std::size_t>(capacity_ * columns_));
    const bool is_watched = (request.reducer || request.stops) && kernel->events_of_step > 0;
    if (is_watched) events_.resize(width * static_cast<std::size_t>(event_capacity_ * (1 + columns_)));
    status_.assign(width, LOBATTO_UNSUPPORTED);
    steps_done_.resize(width);
    iterations_.resize(width);
    events_written_.resize(width);
    records_written_.resize(width);
    kernel->refilled_prepare(memory_.get(), &request.step);
}

EndedTogether RefilledLanes::run(std::int64_t first, std::int64_t last) {
    EndedTogether group;
    group.trajectories.resize(static_cast<std::size_t>(last - first));
    std::int64_t next = 0;
    for (Lane& lane : lanes_) lane.trajectory = -1;
    std::fill(status_.begin(), status_.end(), LOBATTO_UNSUPPORTED);
    for (bool goes_on = true; goes_on;) {
        goes_on = false;
        for (std::size_t lane = 0; lane < lanes_.size(); ++lane) {
            while (lanes_[lane].trajectory < 0 && next < last - first) {
                if (fill(lane, first + next, group.trajectories[static_cast<std::size_t>(next)]))
                    lanes_[lane].trajectory = next;
                ++next;
            }
            goes_on = goes_on || lanes_[lane].trajectory >= 0;
        }
        if (!goes_on) break;
        if (shared_.halted.load(std::memory_order_relaxed)) break;
        const double start = processor_seconds();
        advance(group.trajectories);
        group.processor_seconds += processor_seconds() - start;
    }
    for (const Lane& lane : lanes_)  // interrupted
        if (lane.trajectory >= 0) next = std::min(next, lane.trajectory);
    group.trajectories.resize(static_cast<std::size_t>(next));
    return group;
}

// False: it ends where it begins.
bool RefilledLanes::fill(std::size_t lane, std::int64_t number, Ended& ended) {
    Lane& to = lanes_[lane];
    request_.start(request_.first + number, start_);
    lobatto_status status = to.stepper.prepare(start_.parameters, request_.step);
    std::vector<double> p = start_.rate;
    if (request_.from_velocities) {
        if (status == LOBATTO_OK) {
            p = to.stepper.momentum(request_.time, start_.q, start_.rate);
            if (!other_velocity(to.stepper, request_.time, start_.q, start_.rate, p).empty())
                status = LOBATTO_SINGULAR_MASS;
        } else {
            p.assign(n_, no_number);
        }
    } else if (status == LOBATTO_OK && kernel_->clocked != 0 &&
               to.stepper.start(request_.time, start_.q, p) == LOBATTO_OK) {
        double time;  // the kernel knows the momentum of the time
        to.stepper.state(time, start_.q, p);
    }
    if (status == LOBATTO_OK)
        status = static_cast<lobatto_status>(kernel_->refilled_fill(memory_.get(), static_cast<std::int32_t>(lane),
                                                                    start_.parameters.data(), &request_.time,
                                                                    start_.q.data(), p.data()));
    ended.status = status;
    to.last.assign(1, request_.time);
    to.last.insert(to.last.end(), start_.q.begin(), start_.q.end());
    to.last.insert(to.last.end(), p.begin(), p.end());
    keep(to, ended, to.last.data(), status == LOBATTO_OK);
    if (to.reducer && status == LOBATTO_OK) {
        to.reducer->begin(to.stepper, start_);
        to.reducer->observe(to.last.data(), 1);
    }
    const bool goes_on = status == LOBATTO_OK && request_.steps > 0;
    if (!goes_on) {
        if (to.reducer && status == LOBATTO_OK) ended.reduced = to.reducer->values();
        shared_.steps_gone += request_.steps;
    }
    status_[lane] = goes_on ? LOBATTO_OK : LOBATTO_UNSUPPORTED;
    return goes_on;
}

// All lanes, until the first of them ends.
void RefilledLanes::advance(std::vector<Ended>& group) {
    const double begin = processor_seconds();
    lobatto_refilled_advance call{};
    call.steps = kernel_->clocked != 0 ? request_.steps : std::min(capacity_, chunk_.steps());
    for (const Lane& lane : lanes_)
        if (lane.trajectory >= 0 && kernel_->clocked == 0)
            call.steps =
                std::min(call.steps, request_.steps - group[static_cast<std::size_t>(lane.trajectory)].steps_done);
    call.record_every = request_.every;
    call.interval = request_.arrivals.interval;
    call.end = request_.arrivals.end;
    call.tolerance = request_.tolerance;
    call.records = records_.data();
    call.capacity = capacity_;
    if (!events_.empty()) {
        call.events = events_.data();
        call.event_capacity = event_capacity_;
    }
    call.status = status_.data();
    call.steps_done = steps_done_.data();
    call.iterations = iterations_.data();
    call.events_written = events_written_.data();
    call.records_written = records_written_.data();
    kernel_->refilled_advance(memory_.get(), &call);
    std::int64_t most = 0;
    for (std::size_t lane = 0; lane < lanes_.size(); ++lane) {
        if (lanes_[lane].trajectory < 0) continue;
        Ended& ended = group[static_cast<std::size_t>(lanes_[lane].trajectory)];
        kernel_->clocked != 0 ? look_at_arrivals(lane, ended) : look(lane, ended);
        most = std::max(most, steps_done_[lane]);
        shared_.steps_gone += steps_done_[lane];
        if (ended.goes_on() && ended.steps_done < request_.steps) continue;
        if (lanes_[lane].reducer) ended.reduced = lanes_[lane].reducer->values();
        shared_.steps_gone += request_.steps - ended.steps_done;
        lanes_[lane].trajectory = -1;
        status_[lane] = LOBATTO_UNSUPPORTED;
    }
    chunk_.took(std::max<std::int64_t>(most, 1), processor_seconds() - begin);
}

// What the lane has done in the last call.
void RefilledLanes::look(std::size_t number, Ended& ended) {
    Lane& lane = lanes_[number];
    const std::int64_t done = steps_done_[number];
    const auto place = static_cast<std::int64_t>(number);
    const double* const rows = records_.data() + place * capacity_ * columns_;
    const double* const events = events_.empty() ? nullptr : events_.data() + place * event_capacity_ * (1 + columns_);
    if (lane.reducer) {
        lane.reducer->observe(rows, done);
        lane.reducer->observe_events(events, events_written_[number]);
    }
    const std::int64_t before = ended.steps_done;
    ended.iterations += iterations_[number];
    ended.status = static_cast<lobatto_status>(status_[number]);
    for (std::int64_t i = 1; i <= done; ++i) {
        ended.steps_done = before + i;
        const double* const row = rows + (i - 1) * columns_;
        if (ended.steps_done == request_.steps || (request_.every != 0 && ended.steps_done % request_.every == 0))
            keep(lane, ended, row);
    }
    if (done > 0) lane.last.assign(rows + (done - 1) * columns_, rows + done * columns_);
    if (ended.status == LOBATTO_STOPPED)
        stop(lane, events + (events_written_[number] - 1) * (1 + columns_), ended);
    else if (ended.status != LOBATTO_OK && ended.steps_done > ended.row_step)
        keep(lane, ended, lane.last.data());
}

// The same of a lane with a clock: rows are those that are kept.
void RefilledLanes::look_at_arrivals(std::size_t number, Ended& ended) {
    Lane& lane = lanes_[number];
    const std::int64_t done = ended.steps_done + steps_done_[number], steps = request_.steps;
    const double* const rows = records_.data() + static_cast<std::int64_t>(number) * capacity_ * columns_;
    ended.iterations += iterations_[number];
    ended.status = static_cast<lobatto_status>(status_[number]);
    for (std::int64_t i = 0; i < records_written_[number]; ++i) {
        const std::int64_t next = request_.every == 0 ? steps : (ended.row_step / request_.every + 1) * request_.every;
        ended.steps_done = std::min({next, steps, done});  // the last, of a motion that has failed, is where it is
        keep(lane, ended, rows + i * columns_);
    }
    ended.steps_done = done;
}

// `row`: event number, t, q, p.
void RefilledLanes::stop(Lane& lane, const double* row, Ended& ended) const {
    ended.status = LOBATTO_OK;
    ended.stop = static_cast<int>(row[0]);
    if (lane.reducer) lane.reducer->observe(row + 1, 1);
    keep(lane, ended, row + 1);
}

// A row t, q, p.
void RefilledLanes::keep(const Lane& lane, Ended& ended, const double* row, bool is_possible) const {
    const double its_energy = is_possible ? energy(lane, row) : no_number;
    ended.keep(request_, row[0], row + 1, row + 1 + n_, n_, &its_energy);
}

// Of a row t, q, p; not a number without one.
double RefilledLanes::energy(const Lane& lane, const double* row) const {
    double energy = no_number;
    const std::vector<double> q(row + 1, row + 1 + n_), p(row + 1 + n_, row + columns_);
    const bool has_one = kernel_->has_energy != 0 && lane.stepper.energy(row[0], q, p, energy) == LOBATTO_OK;
    return has_one ? energy : no_number;
}

}  // namespace lobatto
