// SPDX-License-Identifier: GPL-2.0-or-later
// One trajectory that the caller takes forward.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "analysis/accuracy/formulas/stopped_at_formula.hpp"
#include "generator/mechanics/start.hpp"
#include "library/parts.hpp"
#include "runtime/run/near_cuts.hpp"
#include "runtime/run/other_velocity.hpp"

namespace lobatto::api {

struct Stepper::Parts {
    Kernel kernel;
    LoadedStepper<double> stepper;
    std::vector<double> parameters;
    double step, time = 0;
    std::vector<double> q, p, start_q;
    double last_step = 0;    // of the last step taken; 0: none yet
    std::int64_t taken = 0;  // steps, or with a clock arrivals, since the start
    std::vector<double> event_rows;
    std::vector<EventHit> found;  // with a clock also some beyond the time now, in the chain's last step
    // With a clock: where the scene's times are counted from, and a stop that the chain has met beyond the time now.
    double origin = 0;
    std::optional<EventHit> stop_ahead;
    std::optional<int> rests_on;   // the wall, by its number among the events
    std::int64_t chain_steps = 0;  // since the start
    std::vector<double> chain;     // t, q, p at the end of the last of them

    enum class Rate { momentum, velocity };

    explicit Parts(const Kernel& of) : kernel(of), stepper(of.parts().kernel) {
        const TrajectoryRequest& start = kernel.parts().start;
        parameters = start.parameters;
        step = start.step;
        if (const lobatto_kernel& table = stepper.kernel().table(); table.events > 0)
            event_rows.resize(static_cast<std::size_t>(2 * table.events_of_step) * columns());
        go_on_from(start.time, start.q, start.p);
    }

    std::size_t n() const { return q.size(); }
    std::size_t columns() const { return 2 + 2 * static_cast<std::size_t>(stepper.kernel()->coordinates); }

    void require_finite(double t, const double* q, const char* position, const double* rate, const char* what) const {
        if (!std::isfinite(t)) throw lobatto::InputError(fmt::format("start: {} is no time", t));
        for (const auto& [values, of] : {std::pair(q, position), std::pair(rate, what)})
            for (std::size_t k = 0; k < n(); ++k)
                if (!std::isfinite(values[k]))
                    throw lobatto::InputError(fmt::format("start: {} {} is {}, not a finite number", of,
                                                          kernel.parts().coordinates[k].name, values[k]));
    }

    // What to say of a step or a start that failed; with a clock, where its chain of steps was.
    [[noreturn]] void fail(lobatto_status status, const lobatto_advance& call) const {
        TrajectoryRequest request = kernel.parts().start;
        request.parameters = parameters;
        request.step = step;
        request.q = q;
        request.p = p;
        TrajectoryResult result;
        result.status = status;
        result.started = taken > 0 || chain_steps > 0 || call.steps > 0;
        result.steps_done = taken;
        result.chain_steps = chain_steps;
        result.time = time;
        result.q = q;
        result.p = p;
        if (chain_steps > 0 && call.chain != nullptr) {
            result.time = chain.front();
            const auto middle = chain.begin() + 1 + std::ssize(q);
            result.q.assign(chain.begin() + 1, middle);
            result.p.assign(middle, chain.end());
        }
        result.increment_failed = call.increment_failed;
        const Kernel::Parts& known = kernel.parts();
        TrajectoryRequest from_start = request;
        from_start.q = start_q;
        const std::lock_guard lock(algebra());
        const std::string why = stopped_at_formula(known.scene, known.domains, known.kernel, from_start, result);
        throw ComputationError(known.scene.path + ": " + (why.empty() ? explain_stop(result, request) : why));
    }

    // q and p stay where they lie: callers may look at them for as long as the stepper lives.
    void go_on_from(double t, const std::vector<double>& position, const std::vector<double>& momentum) {
        time = t;
        q.assign(position.begin(), position.end());
        p.assign(momentum.begin(), momentum.end());
        start_q = q;
        last_step = 0;
        taken = chain_steps = 0;
        restart();
    }
    // Where no motion can begin, the stepper stays where it was. `inputs`: null where they stay.
    void begin_at(double t, const double* position, const double* rate, Rate kind, const double* inputs) {
        const bool has_velocity = kind == Rate::velocity;
        require_finite(t, position, "the position of", rate, has_velocity ? "the velocity of" : "the momentum of");
        const double time_before = time;
        const std::vector<double> q_before = q, p_before = p, parameters_before = parameters;
        std::vector<double> begin(position, position + n()), momentum(rate, rate + n());
        if (inputs != nullptr) parameters = with_inputs(inputs);
        try {
            if (has_velocity) {
                if (inputs != nullptr) prepare();
                momentum = momentum_of_start(stepper, t, begin, momentum);
            }
            go_on_from(t, begin, momentum);
        } catch (...) {
            parameters = parameters_before;
            go_on_from(time_before, q_before, p_before);
            throw;
        }
    }
    void prepare() {
        if (const lobatto_status status = stepper.prepare(parameters, step); status != LOBATTO_OK) fail(status, {});
    }
    void restart() {
        prepare();
        if (const lobatto_status status = stepper.start(time, q, p); status != LOBATTO_OK) fail(status, {});
        if (is_clocked()) stepper.state(time, q, p);  // where the time is a coordinate, the kernel sets it
        origin = time;
        stop_ahead.reset();
        rests_on.reset();
        std::erase_if(found, [&](const EventHit& hit) { return time < hit.t; });
    }

    bool are_inputs(std::size_t first, std::size_t count) const {
        const lobatto_kernel& table = stepper.kernel().table();
        const auto begin = static_cast<std::size_t>(table.first_input);
        return first >= begin && first + count <= begin + static_cast<std::size_t>(table.inputs);
    }
    // The parameters, with these from `first` on.
    std::vector<double> with(std::size_t first, const std::vector<double>& values) const {
        std::vector<double> after = parameters;
        std::copy(values.begin(), values.end(), after.begin() + static_cast<std::ptrdiff_t>(first));
        for (std::size_t i = first; are_inputs(first, values.size()) && i < first + values.size(); ++i)
            if (std::fabs(after[i]) < least_parameter) after[i] = 0;  // a control loop that has come to rest
        check_change(kernel.parts().required, after, first, values.size());
        return after;
    }
    std::vector<double> with_inputs(const double* values) const {
        const lobatto_kernel& table = stepper.kernel().table();
        return with(static_cast<std::size_t>(table.first_input), {values, values + table.inputs});
    }

    // Parameters from `first` on; where the kernel refuses them, those of before.
    void change(std::size_t first, const std::vector<double>& values) {
        const std::vector<double> before = parameters, after = with(first, values);
        const bool are_inputs = this->are_inputs(first, values.size());
        const lobatto_kernel& table = stepper.kernel().table();
        if (after == before) return;
        parameters = after;
        const double step_before = last_step;
        const auto take = [&] {
            last_step = 0;
            if (!are_inputs) return restart();
            if (const lobatto_status status = stepper.set_inputs(parameters); status != LOBATTO_OK) fail(status, {});
        };
        const auto put_back = [&] {
            parameters = before;
            if (are_inputs && table.events > 0)
                last_step = step_before;  // a kernel that watches has refused them itself
            else
                restart();
        };
        try {
            take();
        } catch (const ComputationError& error) {
            put_back();
            throw ComputationError(fmt::format("the new value is not taken, the one before stays: {}", error.what()));
        } catch (...) {
            put_back();
            throw;
        }
    }

    // Whether a wall or a switch cuts the step from here. With a clock there are none.
    bool is_cut_next() const {
        if (!kernel.parts().scene.is_cut()) return false;
        LoadedStepper<double> trial(stepper.kernel());
        NearCuts cuts;
        cuts.begin(std::numeric_limits<double>::infinity());
        lobatto_advance call{};
        call.steps = 1;
        call.tolerance = kernel.parts().start.tolerance;
        cuts.ask(call);
        if (trial.prepare(parameters, step) != LOBATTO_OK || trial.start(time, q, p) != LOBATTO_OK) return false;
        trial.advance(call);
        return call.cuts_written > 0;
    }

    // Of steps of equal length; with a clock an arrival at a time.
    bool advance(std::int64_t steps, double arrival = 0) {
        if (rests_on)  // else a loop over steps would never end
            throw ComputationError(fmt::format(
                "{}: at t = {:.6g} the motion came to rest on '{}', and a step leads nowhere. Start it elsewhere",
                kernel.parts().scene.path, time, kernel.parts().events[static_cast<std::size_t>(*rests_on)]));
        lobatto_advance call{};
        call.tolerance = kernel.parts().start.tolerance;
        call.interval = std::numeric_limits<double>::infinity();
        call.end = arrival;
        if (is_clocked() && stepper.kernel()->real_kind == LOBATTO_DOUBLE) {
            chain.resize(1 + 2 * n());
            call.chain = chain.data();
        }
        lobatto_status status = LOBATTO_OK;
        for (std::int64_t done = 0; done < steps && status == LOBATTO_OK; done += call.steps_done) {
            call.steps = steps - done;
            if (!event_rows.empty()) {
                call.events = event_rows.data();
                call.event_capacity = static_cast<std::int64_t>(event_rows.size() / columns());
            }
            status = stepper.advance(call);
            keep_events(call.events_written);
            taken += call.steps_done;
            chain_steps += call.chain_steps;
            if (status == LOBATTO_STOPPED && is_clocked() && arrival < found.back().t) {
                stop_ahead = found.back();
                status = LOBATTO_OK;
            }
        }
        if (status == LOBATTO_STOPPED) return stop_at(EventHit(found.back()));
        stepper.state(time, q, p);
        if (steps > 0) last_step = step;
        if (status != LOBATTO_OK) fail(status, call);
        return true;
    }
    // On a wall the motion may lie where no start is accepted, and goes nowhere.
    bool stop_at(const EventHit& stop) {
        if (const lobatto::Scene& scene = kernel.parts().scene;
            static_cast<std::size_t>(stop.kind) >= scene.outputs.events.size() + scene.run.stops.size()) {
            time = stop.t;
            q.assign(stop.q.begin(), stop.q.end());
            p.assign(stop.p.begin(), stop.p.end());
            last_step = 0;
            rests_on = stop.kind;
            return false;
        }
        go_on_from(stop.t, stop.q, stop.p);
        return false;
    }

    void keep_events(std::int64_t count) {
        for (std::int64_t i = 0; i < count; ++i) {
            const double* const row = event_rows.data() + static_cast<std::size_t>(i) * columns();
            found.push_back(
                {static_cast<int>(row[0]), row[1], {row + 2, row + 2 + n()}, {row + 2 + n(), row + 2 + 2 * n()}});
        }
    }

    bool is_clocked() const { return stepper.kernel()->clocked != 0; }

    bool arrive_at(double t) {
        return stop_ahead && stop_ahead->t <= t ? stop_at(EventHit(*stop_ahead)) : advance(1, t);
    }
    // The next of the scene's times.
    double next_arrival() const {
        const double interval = kernel.parts().start.arrivals.interval;
        const double number = std::floor((time - origin) / interval) + 1, next = origin + number * interval;
        return time < next ? next : origin + (number + 1) * interval;
    }
    bool arrive(std::int64_t times) {
        for (std::int64_t i = 0; i < times; ++i) {
            const double next = next_arrival();
            if (next <= time) fail(LOBATTO_TIME_STANDS_STILL, {});
            if (!arrive_at(next)) return false;
        }
        return true;
    }

    bool advance_to(double t) {
        if (!std::isfinite(t)) throw InputError(fmt::format("advance_to: {} is no time", t));
        if (t < time)
            throw InputError(fmt::format(
                "advance_to: the motion is at t = {:.17g} already, beyond {:.17g}; start() goes to another place", time,
                t));
        if (t == time) return true;
        if (is_clocked()) return arrive_at(t);
        const double ratio = (t - time) / step, nearest = std::round(ratio);
        if (ratio > 9e15) throw InputError(fmt::format("advance_to: {:.3g} steps are too many to count", ratio));
        // But for the roundings of both times.
        const double rounding = 4 * std::numeric_limits<double>::epsilon() * std::fmax(std::fabs(t), std::fabs(time));
        const bool fits = std::fabs(time + nearest * step - t) <= rounding;
        if (!advance(static_cast<std::int64_t>(fits ? nearest : std::floor(ratio)))) return false;
        if (!fits && !take_rest(t)) return false;
        time = t;
        return true;
    }

    // To t as one step of its own length.
    bool take_rest(double t) {
        const double usual = step;
        LoadedStepper<double> before = stepper;
        bool goes_on = false;
        step = t - time;
        try {
            lobatto_status status = stepper.prepare(parameters, step);
            if (status == LOBATTO_OK) status = stepper.go_on(before, time, q, p);
            if (status != LOBATTO_OK) fail(status, {});
            goes_on = advance(1);
        } catch (...) {
            step = usual;
            stepper = std::move(before);
            throw;
        }
        const double rest = std::exchange(step, usual);
        if (rests_on) stepper = std::move(before);
        if (!goes_on) {
            if (!rests_on) restart();
            return false;
        }
        inside = stepper;
        last_step = rest;
        stepper = std::move(before);
        if (const auto status = stepper.go_on(*inside, t, q, p); status != LOBATTO_OK) fail(status, {});
        return true;
    }

    std::optional<LoadedStepper<double>> inside;  // of the last step, where it was one of another length
};

Stepper::Stepper(const Kernel& kernel) : parts_(guarded([&] { return std::make_unique<Parts>(kernel); })) {}
Stepper::Stepper(const Stepper& other) : parts_(std::make_unique<Parts>(*other.parts_)) {}
// q() and p() stay in their places.
Stepper& Stepper::operator=(const Stepper& other) {
    if (this == &other) return *this;
    auto copy = std::make_unique<Parts>(*other.parts_);
    if (parts_ && parts_->n() == copy->n())
        for (std::vector<double> Parts::*state : {&Parts::q, &Parts::p}) {
            std::copy((*copy.*state).begin(), (*copy.*state).end(), (*parts_.*state).begin());
            std::swap(*copy.*state, *parts_.*state);
        }
    parts_ = std::move(copy);
    return *this;
}
Stepper::Stepper(Stepper&&) noexcept = default;
Stepper& Stepper::operator=(Stepper&&) noexcept = default;
Stepper::~Stepper() = default;

std::size_t Stepper::coordinates() const {
    return parts_->n();
}
std::size_t Stepper::inputs() const {
    return parts_->kernel.inputs().size();
}
double Stepper::step_size() const {
    return parts_->step;
}

void Stepper::start(double t, const double* q, const double* p, const double* inputs) {
    guarded([&] { parts_->begin_at(t, q, p, Parts::Rate::momentum, inputs); });
}
void Stepper::start_from_velocity(double t, const double* q, const double* v, const double* inputs) {
    guarded([&] { parts_->begin_at(t, q, v, Parts::Rate::velocity, inputs); });
}

bool Stepper::advance(std::int64_t steps) {
    return guarded([&] {
        if (steps < 0) throw InputError(fmt::format("advance: {} is no number of steps", steps));
        parts_->inside.reset();
        return parts_->is_clocked() ? parts_->arrive(steps) : parts_->advance(steps);
    });
}
bool Stepper::advance_to(double t) {
    return guarded([&] {
        parts_->inside.reset();
        return parts_->advance_to(t);
    });
}

double Stepper::t() const {
    return parts_->time;
}
double Stepper::next_time() const {
    return parts_->is_clocked() ? parts_->next_arrival() : parts_->time + parts_->step;
}
const double* Stepper::q() const {
    return parts_->q.data();
}
const double* Stepper::p() const {
    return parts_->p.data();
}

std::vector<double> Stepper::velocity() const {
    return guarded([&] {
        std::vector<double> velocity;
        const Parts& parts = *parts_;
        if (const auto status = parts.stepper.velocity(parts.time, parts.q, parts.p, velocity); status != LOBATTO_OK)
            parts.fail(status, {});
        return velocity;
    });
}
double Stepper::energy() const {
    double energy = 0;
    const bool has_one = parts_->stepper.kernel()->has_energy != 0 &&
                         parts_->stepper.energy(parts_->time, parts_->q, parts_->p, energy) == LOBATTO_OK;
    return has_one ? energy : std::nan("");
}
std::vector<double> Stepper::multipliers() const {
    return guarded([&] {
        std::vector<double> lambda;
        const Parts& parts = *parts_;
        if (parts.stepper.kernel()->constraints == 0) return lambda;
        if (const auto status = parts.stepper.multipliers(parts.time, parts.q, parts.p, lambda); status != LOBATTO_OK)
            parts.fail(status, {});
        return lambda;
    });
}

std::pair<std::vector<double>, std::vector<double>> Stepper::at(double t) const {
    return guarded([&] {
        const Parts& parts = *parts_;
        if (parts.last_step == 0)
            throw InputError(
                "at: no step was taken yet, or a stop, another start or parameter came after it; take one first");
        const double theta = 1 + (t - parts.time) / parts.last_step;
        if (!(theta >= -1e-9 && theta <= 1 + 1e-9) || parts.is_clocked())
            throw InputError(
                parts.is_clocked()
                    ? "at: with a clock the last step is not known here; use advance_to"
                    : fmt::format("at: t = {:.17g} is not inside the last step, which leads from {:.17g} to "
                                  "{:.17g}",
                                  t, parts.time - parts.last_step, parts.time));
        std::pair<std::vector<double>, std::vector<double>> state;
        const LoadedStepper<double>& stepper = parts.inside ? *parts.inside : parts.stepper;
        if (stepper.dense(std::clamp(theta, 0.0, 1.0), state.first, state.second) != LOBATTO_OK)
            throw InputError(
                "at: this step has no polynomial: splitting methods have none, and there is none across an impact or a "
                "switch. Copy the stepper before the step, and let the copy advance_to this time");
        return state;
    });
}

std::vector<double> Stepper::tangent() const {
    return guarded([&] {
        const Parts& parts = *parts_;
        std::vector<double> q, p, T;
        if (parts.stepper.kernel()->has_tangent == 0)
            throw InputError(
                "tangent: this kernel has no derivative of a step: the scene leaves it out, or has "
                "constraints");
        if (parts.is_clocked())
            throw InputError(
                "tangent: with a clock a step lasts as long as the motion makes it, so there is no derivative at a "
                "time; use equal steps (the setting clock = \"none\"), or differences of runs");
        if (parts.is_cut_next())
            throw ComputationError(
                "tangent: a wall or a switch cuts the step from here, and this is the derivative of a whole one. Take "
                "differences of steps from starts that are near to one another");
        if (const auto status = parts.stepper.tangent(parts.time, parts.q, parts.p, q, p, T); status != LOBATTO_OK)
            parts.fail(status, {});
        return T;
    });
}

const std::vector<std::string>& Stepper::column_names() const {
    return parts_->kernel.column_names();
}
std::vector<double> Stepper::columns() const {
    const std::vector<double> v = velocity();
    const Kernel::Parts& known = parts_->kernel.parts();
    std::vector<double> values(known.columns.count());
    known.columns.evaluate(parts_->parameters, parts_->time, parts_->q, v, values.data());
    return values;
}

double Stepper::parameter(const std::string& name) const {
    return guarded([&] { return parts_->parameters[index_of(parts_->kernel.parameters(), name)]; });
}
void Stepper::set(const std::string& name, double value) {
    guarded([&] { parts_->change(index_of(parts_->kernel.parameters(), name), {value}); });
}
void Stepper::set_inputs(const double* values) {
    guarded([&] {
        const lobatto_kernel& table = parts_->stepper.kernel().table();
        parts_->change(static_cast<std::size_t>(table.first_input), {values, values + table.inputs});
    });
}

std::vector<EventHit> Stepper::take_events() {
    Parts& parts = *parts_;
    const auto ahead = std::stable_partition(parts.found.begin(), parts.found.end(),
                                             [&](const EventHit& hit) { return hit.t <= parts.time; });
    std::vector<EventHit> taken(parts.found.begin(), ahead);
    parts.found.erase(parts.found.begin(), ahead);
    return taken;
}
const std::vector<std::string>& Stepper::events() const {
    return parts_->kernel.events();
}

}  // namespace lobatto::api
