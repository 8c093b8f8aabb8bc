// SPDX-License-Identifier: MIT
// The host's side of a run: how many steps to ask the kernel for at a time, and what to say when it stops.
#include "runtime/run/trajectory.hpp"
#include "runtime/run/parts.hpp"
#include "runtime/run/timing.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>

namespace lobatto {

namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
}

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

    void keep_last() {
        Parts row, q, p;
        stepper_.state(row, q, p);
        row.insert(row.end(), q.begin(), q.end());
        row.insert(row.end(), p.begin(), p.end());
        keep(row, 1, 0);
    }

private:
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
    Parts energy_start_, energies_, rows_, rounded_energies_, beside_;
};

// Hands out checkpoints, at the right times.
class Checkpoints {
public:
    explicit Checkpoints(const TrajectoryRequest& request) : request_(request) {}

    void look(const NumberStepper& stepper, const TrajectoryResult& result) {
        if (!request_.checkpoint || seconds_since(last_) < pause_) return;
        const Clock::time_point start = Clock::now();
        request_.checkpoint({result, stepper.memory()});
        last_ = Clock::now();
        pause_ = std::max(checkpoint_seconds, seconds_since(start) / checkpoint_part);
    }
    void at_once(const NumberStepper& stepper, const TrajectoryResult& result) {
        pause_ = 0;
        look(stepper, result);
    }

private:
    const TrajectoryRequest& request_;
    Clock::time_point last_ = Clock::now();
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

constexpr int most_halvings = 14;    // of a step that could not be taken
constexpr double same_place = 0.01;  // of the way

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

    const std::int64_t rows_of_step = 1 + request.dense;
    const std::int64_t wanted = request.arrivals.keeps_chain ? rows_at_once : request.steps / request.every;
    const std::int64_t rows = std::clamp<std::int64_t>(wanted, kernel->clocked != 0 ? 2 : 1,
                                                       std::max<std::int64_t>(rows_at_once / rows_of_step, 1)) *
                              rows_of_step;
    const std::size_t columns = 1 + 2 * request.q.size();
    NumberStepper::Parts records, events, time;
    const bool seeks_events = request.events && kernel->events > 0;
    const std::int64_t event_rows = seeks_events ? std::max<std::int64_t>(rows_at_once, kernel->events_of_step) : 0;
    std::int64_t block = 256;
    Clock::time_point last_progress = Clock::now();
    while (result.steps_done < request.steps && result.status == LOBATTO_OK) {
        result.interrupted = request.interrupted != nullptr && *request.interrupted != 0;
        if (result.interrupted) {
            checkpoints.at_once(stepper, result);
            break;
        }

        lobatto_advance call = call_for(request, rows, event_rows);
        call.steps = std::min(block, request.steps - result.steps_done);
        const Clock::time_point start = Clock::now();
        const double processor_start = processor_seconds();
        result.status = stepper.advance(call, records, events);
        result.seconds += processor_seconds() - processor_start;
        const double seconds = seconds_since(start);

        add(result, call);
        stepper.state(time, q, p);
        result.time = time[0];
        result.q = rounded(q, parts);
        result.p = rounded(p, parts);
        result.events += call.events_written;
        if (call.events_written > 0) {
            const std::vector<double> found = rounded(events, parts);
            request.events({found.data(), call.events_written, static_cast<int>(1 + columns), events.data(),
                            static_cast<int>(parts)});
        }
        keeper.keep(records, call.records_written, request.dense);
        if (result.status == LOBATTO_STOPPED) {
            result.status = LOBATTO_OK;
            keeper.keep(stop_at(events, parts, columns, result), 1, 0, true);
            return result;
        }

        // The clock ticks coarsely against a short block: grow at most eightfold at a time.
        const double pace = block_seconds / std::max(seconds, block_seconds / 8);
        block = std::max<std::int64_t>(1, std::llround(static_cast<double>(call.steps_done) * pace));
        if (request.progress && seconds_since(last_progress) > progress_seconds) {
            last_progress = Clock::now();
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

std::string explain_stop(const TrajectoryResult& result, const TrajectoryRequest& request, double passing,
                         const std::string& more) {
    const std::string smaller =
        passing != 0 ? fmt::format("a smaller step, such as h = {:.6g}, with which the motion goes on there", passing)
                     : fmt::format("a smaller step, such as h = {:.6g}", request.step / 2);
    std::string why, advice;
    switch (result.status) {
        case LOBATTO_OK:
        case LOBATTO_STOPPED:
        case LOBATTO_STATUSES:
            return {};
        case LOBATTO_NOT_CONVERGED:
            why = fmt::format(
                "the iteration for the positions inside the step did not converge: its last increment was {:.2g} "
                "of the displacement "
                "within the step. The step is too long for the forces met there, or the motion runs into a singularity "
                "of the potential",
                result.increment_failed);
            advice = smaller + more + ", or start elsewhere";
            break;
        case LOBATTO_NOT_FINITE:
            if (!result.started) {
                why =
                    "a number computed from the parameters, the step and this start alone is infinite or not a number: "
                    "they are too large or too small together, or the start is at a singularity";
                advice = "other units, so that numbers are nearer to 1, or start elsewhere";
                break;
            }
            why =
                "a position or momentum became infinite or not a number. The motion runs into a singularity of the "
                "potential or away to infinity, or the "
                "step is too long for the method to be stable";
            advice = smaller + more + ", an earlier end, or start elsewhere";
            break;
        case LOBATTO_SINGULAR_JACOBIAN:
            why =
                "the equations for the positions inside the step have no unique solution: their Jacobian is singular. "
                "This h meets a resonance of the forces there, or constraints depend on one another, as at a dead "
                "point";
            advice = smaller + ", or a slightly different one";
            break;
        case LOBATTO_SINGULAR_MASS:
            why =
                "the mass matrix has no inverse for these parameters or at this state, so that momenta do not "
                "determine velocities";
            advice =
                "other values of the parameters that stand before the squared velocities, or start elsewhere; none of "
                "the "
                "masses may vanish";
            break;
        case LOBATTO_UNSUPPORTED:
            why =
                "the kernel was compiled without what is asked of it: states between steps, events, energies or "
                "tangent "
                "maps";
            advice = "to compile it from a scene whose [output] asks for it";
            break;
        case LOBATTO_OFF_CONSTRAINTS:
            why = "the start does not keep the constraints: its positions or its momenta are off";
            advice = "positions and velocities that keep them, or assemble = true under [run] of the scene";
            break;
        case LOBATTO_IMPACTS_ACCUMULATE:
            why =
                "impacts accumulate within this step, more than 100 of them or nearer to one another than can be told "
                "apart: the motion comes to rest on a wall, or slides along it, and walls throw back only; or friction "
                "holds it fast, and formulas that are not smooth are known on their two sides only";
            advice = "an end before that time, a stop under [run] where the motion has become slow, or " + smaller +
                     " where many impacts belong into a step";
            break;
        case LOBATTO_TIME_STANDS_STILL:
            if (request.arrivals.interval != 0) {
                why = "the clock is not above 0 along the step, or so small that time stands still";
                advice = "a clock that is positive wherever the motion goes";
                break;
            }
            why = fmt::format("t + h equals t in the numbers of the run: h = {:.6g} is below the rounding of t",
                              request.step);
            advice = "a larger step, or a start time nearer to zero";
            break;
    }
    const std::string where =
        !result.started ? fmt::format("the run cannot begin at t = {:.6g}", result.time)
        : request.arrivals.interval != 0
            ? fmt::format("the run stopped in step {}, after t = {:.6g}", result.chain_steps + 1, result.time)
        : result.steps_done == 0
            ? fmt::format("the run stopped in its first step, at t = {:.6g}", result.time)
            : fmt::format("the run stopped in step {}, after t = {:.6g}", result.steps_done + 1, result.time);
    return fmt::format("{}, from q = {}, p = {}: {}. Try {}.", where, list_text(result.q), list_text(result.p), why,
                       advice);
}

}  // namespace lobatto
