// SPDX-License-Identifier: MIT
#include "runtime/build/number_stepper.hpp"

#include <cassert>
#include <cstring>

namespace lobatto {

NumberStepper::NumberStepper(Kernel kernel)
    : kernel_(std::move(kernel)),
      parts_(static_cast<std::size_t>(kernel_->parts)),
      n_(static_cast<std::size_t>(kernel_->coordinates)),
      bytes_(static_cast<std::size_t>(kernel_->real_bytes)),
      stepper_(kernel_->stepper_bytes, kernel_->stepper_alignment) {}

NumberStepper::Bytes NumberStepper::numbers(const double* values, std::size_t count) const {
    Bytes result = room(count);
    kernel_->from_parts(values, static_cast<std::int64_t>(count), result.data());
    return result;
}

NumberStepper::Parts NumberStepper::parts_of(const Bytes& numbers, std::size_t count) const {
    Parts result(count * parts_);
    kernel_->to_parts(numbers.data(), static_cast<std::int64_t>(count), result.data());
    return result;
}

lobatto_status NumberStepper::prepare(const Parts& parameters, const Parts& step) {
    const Bytes values = numbers(parameters.data(), parameters.size() / parts_), h = numbers(step.data(), 1);
    return static_cast<lobatto_status>(kernel_->prepare(stepper_.get(), values.data(), h.data()));
}

lobatto_status NumberStepper::start(const Parts& time, const Parts& q, const Parts& p) {
    assert(q.size() == n_ * parts_ && p.size() == n_ * parts_);
    const Bytes t = numbers(time.data(), 1), position = numbers(q.data(), n_), momentum = numbers(p.data(), n_);
    return static_cast<lobatto_status>(kernel_->start(stepper_.get(), t.data(), position.data(), momentum.data()));
}

void NumberStepper::state(Parts& time, Parts& q, Parts& p) const {
    Bytes t = room(1), position = room(n_), momentum = room(n_);
    kernel_->state(stepper_.get(), t.data(), position.data(), momentum.data());
    time = parts_of(t, 1);
    q = parts_of(position, n_);
    p = parts_of(momentum, n_);
}

lobatto_status NumberStepper::evaluate(StateFunction function, const double* time, const double* q, const double* p,
                                       Bytes& value) const {
    const Bytes t = numbers(time, 1), position = numbers(q, n_), momentum = numbers(p, n_);
    return static_cast<lobatto_status>(
        function(stepper_.get(), t.data(), position.data(), momentum.data(), value.data()));
}

lobatto_status NumberStepper::energy(const double* time, const double* q, const double* p, double* energy) const {
    if (kernel_->real_kind == LOBATTO_DOUBLE)
        return static_cast<lobatto_status>(kernel_->energy(stepper_.get(), time, q, p, energy));
    Bytes value = room(1);
    const lobatto_status status = evaluate(kernel_->energy, time, q, p, value);
    kernel_->to_parts(value.data(), 1, energy);
    return status;
}

NumberStepper::Parts NumberStepper::momentum(const Parts& time, const Parts& q, const Parts& velocity) const {
    const Bytes t = numbers(time.data(), 1), position = numbers(q.data(), n_), rate = numbers(velocity.data(), n_);
    Bytes p = room(n_);
    kernel_->momentum(stepper_.get(), t.data(), position.data(), rate.data(), p.data());
    return parts_of(p, n_);
}

lobatto_status NumberStepper::velocity(const Parts& time, const Parts& q, const Parts& p, Parts& velocity) const {
    Bytes rate = room(n_);
    const lobatto_status status = evaluate(kernel_->velocity, time.data(), q.data(), p.data(), rate);
    velocity = parts_of(rate, n_);
    return status;
}

lobatto_status NumberStepper::multipliers(const Parts& time, const Parts& q, const Parts& p, Parts& lambda) const {
    const auto count = static_cast<std::size_t>(kernel_->constraints);
    Bytes values = room(count);
    const lobatto_status status = evaluate(kernel_->multipliers, time.data(), q.data(), p.data(), values);
    lambda = parts_of(values, count);
    return status;
}

lobatto_status NumberStepper::tangent(const Parts& time, const Parts& q, const Parts& p, Parts& T) const {
    const Bytes t = numbers(time.data(), 1), position = numbers(q.data(), n_), momentum = numbers(p.data(), n_);
    Bytes q1 = room(n_), p1 = room(n_), map = room(4 * n_ * n_);
    const auto status = static_cast<lobatto_status>(
        kernel_->tangent(stepper_.get(), t.data(), position.data(), momentum.data(), q1.data(), p1.data(), map.data()));
    T = parts_of(map, 4 * n_ * n_);
    return status;
}

lobatto_status NumberStepper::advance(lobatto_advance& call, Parts& records, Parts& events) {
    const std::size_t columns = 1 + 2 * n_;
    Bytes rows = room(static_cast<std::size_t>(call.capacity) * columns),
          event_rows = room(static_cast<std::size_t>(call.event_capacity) * (1 + columns));
    call.records = rows.data();
    call.events = call.event_capacity > 0 ? event_rows.data() : nullptr;
    const auto status = static_cast<lobatto_status>(kernel_->advance(stepper_.get(), &call));
    records = parts_of(rows, static_cast<std::size_t>(call.records_written) * columns);
    events = parts_of(event_rows, static_cast<std::size_t>(call.events_written) * (1 + columns));
    return status;
}

std::string NumberStepper::memory() const {
    return {static_cast<const char*>(stepper_.get()), static_cast<std::size_t>(kernel_->stepper_bytes)};
}

void NumberStepper::restore(const std::string& memory) {
    assert(std::ssize(memory) == kernel_->stepper_bytes);
    std::memcpy(stepper_.get(), memory.data(), memory.size());
}

}  // namespace lobatto
