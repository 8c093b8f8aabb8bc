// SPDX-License-Identifier: MIT
// The host's side of a run: how many steps to ask the kernel for at a time, and what to keep of them.
#include "runtime/run/trajectory.hpp"
#include "runtime/run/parts.hpp"
#include "runtime/run/timing.hpp"
#include "runtime/stopwatch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <limits>
#include <utility>

namespace lobatto {

namespace {

constexpr std::int64_t rows_at_once = 4096;   // the records in memory, however long the run
constexpr double block_seconds = 0.02;        // of a block of steps: an interruption is noticed within about twice this
constexpr double checkpoint_seconds = 0.1;    // between two checkpoints, unless
constexpr double checkpoint_part = 1.0 / 50;  // of the time would go into them

// Watches the kept states go by: their energies, and the sink.
class Keeper {
public:
    using Parts = NumberStepper::Parts;

    // `start`: t, q, p.
    Keeper(const NumberStepper& stepper, const TrajectoryRequest& request, const Parts& start, TrajectoryResult& result)
        : stepper_(stepper), request_(request), result_(result), n_(request.q.size()), parts_(stepper.parts()) {
        energy_start_.resize(parts_);
        energy(start.data(), start.data() + parts_, start.data() + (1 + n_) * parts_, energy_start_.data());
        result_.energy_start = energy_start_[0];
    }

    // `between`: that many of every between + 1 rows lie between two steps.
    void keep(const Parts& whole, std::int64_t count, int between, bool is_stop = false) {
        const std::size_t columns = 1 + 2 * n_;
        energies_.resize(static_cast<std::size_t>(count) * parts_);
        for (std::size_t i = 0; i < static_cast<std::size_t>(count) && has_energy(); ++i) {
            const double* const row = whole.data() + i * columns * parts_;
            double* const H = energies_.data() + i * parts_;
            energy(row, row + parts_, row + (1 + n_) * parts_, H);
            if ((i + 1) % static_cast<std::size_t>(between + 1) != 0) continue;
            result_.energy_error_final = difference(H, energy_start_.data(), parts_);
            const double error = std::fabs(result_.energy_error_final);
            if (!(error <= result_.energy_error_largest)) result_.energy_error_largest = error;
        }
        if (count > 0) last_time_ = whole[static_cast<std::size_t>(count - 1) * columns * parts_];
        if (!has_energy()) result_.energy_error_final = result_.energy_error_largest = std::nan("");
        if (!request_.sink || count == 0) return;
        Records records{whole.data(), has_energy() ? energies_.data() : nullptr, count, static_cast<int>(columns)};
        records.is_stop = is_stop;
        if (parts_ > 1) {
            rows_ = rounded(whole, parts_);
            rounded_energies_ = rounded(energies_, parts_);
            records.whole = records.rows;
            records.whole_energy = records.energy;
            records.parts = static_cast<int>(parts_);
            records.rows = rows_.data();
            if (has_energy()) records.energy = rounded_energies_.data();
        }
        if (request_.columns_beside() > 0) records.beside = beside(whole, count);
        request_.sink(records);
    }

    // But for rounding it is the time of the last row.
    bool has_kept(double time) const { return std::fabs(time - last_time_) <= same_time * std::fabs(time); }
    void keep_last() {
        Parts row, q, p;
        stepper_.state(row, q, p);
        row.insert(row.end(), q.begin(), q.end());
        row.insert(row.end(), p.begin(), p.end());
        keep(row, 1, 0);
    }

private:
    static constexpr double same_time = 0x1p-50;
    bool has_energy() const { return stepper_.kernel()->has_energy != 0; }

    void energy(const double* time, const double* q, const double* p, double* energy) {
        if (stepper_.energy(time, q, p, energy) != LOBATTO_OK) std::fill_n(energy, parts_, std::nan(""));
    }

    // Row by row; not a number where there are none.
    const double* beside(const Parts& whole, std::int64_t count) {
        beside_.clear();
        const auto part = static_cast<std::ptrdiff_t>(n_ * parts_), one = static_cast<std::ptrdiff_t>(parts_);
        for (std::int64_t i = 0; i < count; ++i) {
            const auto begin = whole.begin() + i * (one + 2 * part);
            const Parts time(begin, begin + one), q(begin + one, begin + one + part),
                p(begin + one + part, begin + one + 2 * part);
            Parts values;
            if (request_.multipliers > 0) {
                if (stepper_.multipliers(time, q, p, values) != LOBATTO_OK)
                    std::fill(values.begin(), values.end(), std::nan(""));
                beside_.insert(beside_.end(), values.begin(), values.end());
            }
            if (request_.formulas.count == 0) continue;
            Parts velocity;
            if (stepper_.velocity(time, q, p, velocity) != LOBATTO_OK) velocity.assign(n_ * parts_, std::nan(""));
            values.assign(request_.formulas.count * parts_, 0);
            request_.formulas.evaluate(time, q, velocity, values);
            beside_.insert(beside_.end(), values.begin(), values.end());
        }
        return beside_.data();
    }

    const NumberStepper& stepper_;
    const TrajectoryRequest& request_;
    TrajectoryResult& result_;
    std::size_t n_, parts_;
    double last_time_ = std::nan("");
    Parts energy_start_, energies_, rows_, rounded_energies_, beside_;
};

// Hands out checkpoints, at the right times.
class Checkpoints {
public:
    explicit Checkpoints(const TrajectoryRequest& request) : request_(request) {}

    void look(const NumberStepper& stepper, const TrajectoryResult& result) {
        if (!request_.checkpoint || last_.seconds() < pause_) return;
        const Stopwatch watch;
        request_.checkpoint({result, stepper.memory()});
        last_ = Stopwatch();
        pause_ = std::max(checkpoint_seconds, watch.seconds() / checkpoint_part);
    }
    void at_once(const NumberStepper& stepper, const TrajectoryResult& result) {
        pause_ = 0;
        look(stepper, result);
    }

private:
    const TrajectoryRequest& request_;
    Stopwatch last_;
    double pause_ = checkpoint_seconds;
};

// A call of `advance` but for its steps.
lobatto_advance call_for(const TrajectoryRequest& request, std::int64_t rows, std::int64_t event_rows) {
    lobatto_advance call{};
    call.tolerance = request.tolerance;
    call.record_every = request.every;
    call.capacity = rows;
    call.dense = request.dense;
    call.interval = request.arrivals.interval;
    call.end = request.arrivals.end;
    call.chain_records = request.arrivals.keeps_chain ? 1 : 0;
    call.event_capacity = event_rows;
    return call;
}

void add(TrajectoryResult& result, const lobatto_advance& call) {
    result.steps_done += call.steps_done;
    result.chain_steps += call.chain_steps;
    result.iterations += call.iterations;
    result.iterations_most = std::max(result.iterations_most, call.iterations_most);
    result.increment_largest = std::max(result.increment_largest, call.increment_largest);
    result.increment_failed = call.increment_failed;
}

// The run ends at its last event: that row, without the number of the event.
NumberStepper::Parts stop_at(const NumberStepper::Parts& events, std::size_t parts, std::size_t columns,
                             TrajectoryResult& result) {
    const auto begin = events.end() - static_cast<std::ptrdiff_t>(columns * parts);
    const NumberStepper::Parts row(begin, events.end());
    const std::vector<double> state = rounded(row, parts);
    const auto middle = state.begin() + 1 + std::ssize(result.q);
    result.stop = static_cast<int>(*(begin - static_cast<std::ptrdiff_t>(parts)));
    result.time = state[0];
    result.q.assign(state.begin() + 1, middle);
    result.p.assign(middle, state.end());
    return row;
}

// At the stop that is the last of `events`. With a clock, the step of the chain that leads past it has passed times at
// which states are asked for, too.
void end_at_stop(NumberStepper& stepper, const TrajectoryRequest& request, std::int64_t rows,
                 const NumberStepper::Parts& events, Keeper& keeper, TrajectoryResult& result) {
    result.status = LOBATTO_OK;
    const NumberStepper::Parts stop = stop_at(events, stepper.parts(), 1 + 2 * request.q.size(), result);
    NumberStepper::Parts records, none;
    const double interval = request.arrivals.interval;  // 0: no clock
    const auto next = [&] { return request.time + static_cast<double>(result.steps_done + 1) * interval; };
    while (result.steps_done < request.steps && (result.time - next()) * interval > 0) {
        lobatto_advance call = call_for(request, rows, 0);
        call.steps = 1;
        result.status = stepper.advance(call, records, none);
        if (result.status != LOBATTO_OK) break;
        add(result, call);
        keeper.keep(records, call.records_written, request.dense);
    }
    if (!keeper.has_kept(result.time)) keeper.keep(stop, 1, 0, true);  // a stop at the end of a step is its row
}

constexpr int most_halvings = 14;    // of a step that could not be taken
constexpr double same_place = 0.01;  // of the way

// How many steps to ask for at a time.
class Pace {
public:
    std::int64_t block() const { return block_; }
    // The clock ticks coarsely against a short block: grow at most eightfold at a time.
    void took(double seconds, std::int64_t steps) {
        const double pace = block_seconds / std::max(seconds, block_seconds / 8);
        block_ = std::max<std::int64_t>(1, std::llround(static_cast<double>(steps) * pace));
    }

private:
    std::int64_t block_ = 256;
};

// Rows of records for one call of the kernel: whole steps.
std::int64_t records_of_call(const Kernel& kernel, const TrajectoryRequest& request) {
    const std::int64_t rows_of_step = 1 + request.dense;
    const std::int64_t wanted = request.arrivals.keeps_chain ? rows_at_once : request.steps / request.every;
    return std::clamp<std::int64_t>(wanted, kernel->clocked != 0 ? 2 : 1,
                                    std::max<std::int64_t>(rows_at_once / rows_of_step, 1)) *
           rows_of_step;
}

// Of a motion with a clock, the last state of its chain: one that fails went on from there, not from the last arrival.
class LastOfChain {
public:
    LastOfChain(const Kernel& kernel, const TrajectoryRequest& request)
        : kernel_(kernel),
          request_(request),
          row_(kernel->clocked != 0 && kernel->real_kind == LOBATTO_DOUBLE ? 1 + 2 * request.q.size() : 0) {}

    void ask(lobatto_advance& call) { call.chain = row_.empty() ? nullptr : row_.data(); }
    void look(TrajectoryResult& result) {
        if (row_.empty()) return;
        if (result.status == LOBATTO_OK && stands_still(result)) result.status = LOBATTO_TIME_STANDS_STILL;
        if (result.status == LOBATTO_OK || result.status == LOBATTO_STOPPED) return;
        const auto middle = row_.begin() + 1 + std::ssize(result.q);
        result.time = row_[0];
        result.q.assign(row_.begin() + 1, middle);
        result.p.assign(middle, row_.end());
    }

private:
    static constexpr std::int64_t first_look = std::int64_t(1) << 16, long_run = std::int64_t(1) << 18;
    static constexpr double hopeless = 1e5, shrinks = 0.9, far = 4, deep = 1e-8;

    // A clock that comes to 0 in a finite time lets its steps pass ever less of it. At every doubling of the steps:
    // whether the rest of the way would take more than `hopeless` times as many as the last half of them, or is far
    // more than all that is to come if each doubling passes as much less than the one before as it did three times.
    // Small steps on the way to a near passage do so too, until they have passed it. So the second holds only where
    // steps have become `deep` times as short as the first.
    bool stands_still(const TrajectoryResult& result) {
        if (result.chain_steps < next_look_) return false;
        const double end = time_after(request_, request_.steps), passed = std::fabs(row_[0] - time_looked_),
                     left = std::fabs(end - row_[0]), ratio = passed / std::exchange(passed_before_, passed);
        shrunk_ = ratio < shrinks ? shrunk_ + 1 : 0;
        const bool slows_down = next_look_ > long_run && passed < std::fabs(row_[0] - request_.time) / 4,
                   comes_to_an_end = shrunk_ >= 3 && left > far * passed * ratio / (1 - ratio) &&
                                     passed < deep * first_step() * static_cast<double>(result.chain_steps - looked_);
        time_looked_ = row_[0];
        looked_ = result.chain_steps;
        next_look_ = 2 * result.chain_steps;
        return comes_to_an_end || (slows_down && left > hopeless * passed);
    }

    // The time that the first step of the chain passes.
    double first_step() const {
        LoadedStepper<double> stepper(kernel_);
        std::vector<double> row(row_.size());
        lobatto_advance call{};
        call.steps = 1;
        call.tolerance = request_.tolerance;
        call.interval = std::numeric_limits<double>::infinity();
        call.end = std::nextafter(request_.time, request_.arrivals.end);
        call.chain = row.data();
        const bool begins = stepper.prepare(request_.parameters, request_.step) == LOBATTO_OK &&
                            stepper.start(request_.time, request_.q, request_.p) == LOBATTO_OK;
        if (begins) stepper.advance(call);  // wherever it arrives: the chain takes its step before
        return begins && call.chain_steps > 0 ? std::fabs(row[0] - request_.time) : 0;
    }

    const Kernel& kernel_;
    const TrajectoryRequest& request_;
    std::vector<double> row_;  // t, q, p, of kernels with a clock in double; else empty
    std::int64_t next_look_ = first_look, looked_ = 0;
    double time_looked_ = 0, passed_before_ = 0;
    int shrunk_ = 0;
};

}  // namespace

std::string list_text(const std::vector<double>& values) {
    constexpr std::size_t shown = 16;
    if (values.size() <= shown) return fmt::format("({:.6g})", fmt::join(values, ", "));
    return fmt::format("({:.6g}, ... {} in all)", fmt::join(values.begin(), values.begin() + shown, ", "),
                       values.size());
}

TrajectoryResult integrate(const Kernel& kernel, const TrajectoryRequest& request) {
    TrajectoryResult result;
    result.time = request.time;
    result.q = request.q;
    result.p = request.p;
    NumberStepper stepper(kernel);
    const std::size_t parts = stepper.parts();
    const auto whole = [parts](const std::vector<double>& given, const std::vector<double>& x) {
        return given.empty() ? as_parts(x, parts) : given;
    };
    result.status =
        stepper.prepare(whole(request.whole_parameters, request.parameters), whole(request.whole_step, {request.step}));
    NumberStepper::Parts first = as_parts({request.time}, parts), q = whole(request.whole_q, request.q),
                         p = whole(request.whole_p, request.p);
    if (result.status == LOBATTO_OK) result.status = stepper.start(first, q, p);
    if (result.status != LOBATTO_OK) return result;
    result.started = true;

    first.insert(first.end(), q.begin(), q.end());
    first.insert(first.end(), p.begin(), p.end());
    Keeper keeper(stepper, request, first, result);
    if (request.from == nullptr) {
        keeper.keep(first, 1, 0);
    } else {
        result = request.from->result;
        result.started = true;
        result.interrupted = false;
        stepper.restore(request.from->stepper);
    }
    Checkpoints checkpoints(request);

    const std::int64_t rows = records_of_call(kernel, request);
    const std::size_t columns = 1 + 2 * request.q.size();
    NumberStepper::Parts records, events, time;
    const std::int64_t event_rows =
        request.events && kernel->events > 0 ? std::max<std::int64_t>(rows_at_once, kernel->events_of_step) : 0;
    LastOfChain last_of_chain(kernel, request);
    Pace pace;
    Stopwatch since_progress;
    while (result.steps_done < request.steps && result.status == LOBATTO_OK) {
        result.interrupted = request.interrupted != nullptr && *request.interrupted != 0;
        if (result.interrupted) {
            checkpoints.at_once(stepper, result);
            break;
        }
        lobatto_advance call = call_for(request, rows, event_rows);
        last_of_chain.ask(call);
        call.steps = std::min(pace.block(), request.steps - result.steps_done);
        const Stopwatch watch;
        const double processor_start = processor_seconds();
        result.status = stepper.advance(call, records, events);
        result.seconds += processor_seconds() - processor_start;
        const double seconds = watch.seconds();
        add(result, call);
        stepper.state(time, q, p);
        result.time = time[0];
        result.q = rounded(q, parts);
        result.p = rounded(p, parts);
        last_of_chain.look(result);
        result.events += call.events_written;
        if (call.events_written > 0) {
            const std::vector<double> found = rounded(events, parts);
            request.events({found.data(), call.events_written, static_cast<int>(1 + columns), events.data(),
                            static_cast<int>(parts)});
        }
        keeper.keep(records, call.records_written, request.dense);
        if (result.status == LOBATTO_STOPPED) {
            end_at_stop(stepper, request, rows, events, keeper, result);
            return result;
        }
        pace.took(seconds, call.steps_done);
        if (request.progress && since_progress.seconds() > progress_seconds) {
            since_progress = Stopwatch();
            request.progress(result.steps_done);
        }
        if (result.status == LOBATTO_OK) checkpoints.look(stepper, result);
    }
    if (result.steps_done % request.every != 0) keeper.keep_last();
    return result;
}

double passing_step(const Kernel& kernel, const TrajectoryRequest& request, const TrajectoryResult& result) {
    const bool in_a_step = result.status == LOBATTO_NOT_CONVERGED || result.status == LOBATTO_NOT_FINITE ||
                           result.status == LOBATTO_SINGULAR_JACOBIAN;
    if (!result.started || !in_a_step || kernel->clocked != 0) return 0;
    LoadedStepper<double> stepper(kernel);
    std::vector<double> before, q, p;
    double time = 0;
    for (int halvings = 1; halvings <= most_halvings + 1; ++halvings) {
        const double step = std::ldexp(request.step, -halvings);
        lobatto_advance call{};
        call.steps = std::int64_t(1) << halvings;
        call.tolerance = request.tolerance;
        const bool passes = stepper.prepare(request.parameters, step) == LOBATTO_OK &&
                            stepper.start(result.time, result.q, result.p) == LOBATTO_OK &&
                            stepper.advance(call) == LOBATTO_OK;
        if (!passes) {
            before.clear();
            continue;
        }
        stepper.state(time, q, p);
        double apart = 0, moved = 0;
        for (std::size_t k = 0; k < q.size() && !before.empty(); ++k) {
            apart = std::fmax(apart, std::fabs(q[k] - before[k]));
            moved = std::fmax(moved, std::fabs(q[k] - result.q[k]));
        }
        if (!before.empty() && apart < same_place * moved) return 2 * step;
        before = q;
    }
    return 0;
}

}  // namespace lobatto
