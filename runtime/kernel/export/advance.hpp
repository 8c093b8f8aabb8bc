// SPDX-License-Identifier: MIT
// The steps that a call of a kernel library asks for, with the rows and events that it keeps of them.
#pragma once

#include <cstdint>
#include <type_traits>

#include "../abi.h"
#include "../kernel.hpp"

namespace lobatto {

// Steps of a stepper S, their records and events, as a call asks for them.
template <class K, class S, bool has_dense>
struct Advance {
    using real = typename K::real;
    static constexpr int n = K::coordinates;

    static real* out(void* numbers) { return static_cast<real*>(numbers); }

    static void count(const S& stepper, lobatto_advance& call) {
        if constexpr (S::N > 0) {
            call.iterations += stepper.iterations;
            call.iterations_most = maximum(stepper.iterations, call.iterations_most);
            call.increment_largest = maximum(static_cast<double>(stepper.increment), call.increment_largest);
        }
    }

    // Arrivals at equally spaced times, of a stepper with a clock. What does not fit into one call goes on in the next.
    template <class AnyWatch>
    static Status take_intervals(S& stepper, lobatto_advance& call, AnyWatch* watch) {
        constexpr bool is_watched = !std::is_same_v<AnyWatch, Nothing>;
        constexpr std::int64_t most = 65536;  // steps of the chain in one call
        stepper.tolerance = static_cast<real>(call.tolerance);
        const real end = static_cast<real>(call.end), interval = static_cast<real>(call.interval);
        while (call.steps_done < call.steps) {
            real target = is_finite(interval) ? stepper.origin + real(stepper.arrivals + 1) * interval : end;
            if ((target - end) * interval > real(0)) target = end;
            while (stepper.is_short_of(target)) {
                if (call.chain_steps == most || (call.record_every > 0 && call.records_written + 2 > call.capacity))
                    return Status::ok;
                if constexpr (is_watched) {
                    if (call.events_written + AnyWatch::most > call.event_capacity) return Status::ok;
                    watch->keep(stepper);
                }
                if (call.chain_records != 0 && !stepper.is_recorded)
                    put_row(stepper.now.time, stepper.q, stepper.p, call);
                stepper.is_recorded = true;
                const Status status = stepper.step();
                if (status != Status::ok) {
                    call.increment_failed = static_cast<double>(stepper.increment);
                    return status;
                }
                ++call.chain_steps;
                count(stepper, call);
                if constexpr (is_watched) {
                    const Status found = look(stepper, call, *watch, is_finite(interval) ? end : interval);
                    if (found != Status::ok) return found;
                }
            }
            if (call.record_every > 0 && call.records_written == call.capacity) return Status::ok;
            const Status status = stepper.arrive(target);
            if (status != Status::ok) return status;
            ++call.steps_done;
            if (call.record_every > 0 && stepper.arrivals % call.record_every == 0)
                put_row(stepper.arrival_time, stepper.arrival_q, stepper.arrival_p, call);
        }
        return Status::ok;
    }
    // The events of a step of the chain that are not beyond the end.
    template <class AnyWatch>
    static Status look(S& stepper, lobatto_advance& call, AnyWatch& watch, real end) {
        const std::int64_t first = call.events_written;
        real* const rows = out(call.events);
        const Status status = watch.look(stepper, rows, call.events_written);
        const auto is_beyond = [&] {
            return (rows[(call.events_written - 1) * AnyWatch::columns + 1] - end) * stepper.step_size > real(0);
        };
        const bool stops_beyond = status == Status::stopped && is_beyond();
        while (call.events_written > first && is_beyond()) --call.events_written;
        return stops_beyond ? Status::ok : status;
    }
    static void put_row(real time, const real* q, const real* p, lobatto_advance& call) {
        put_state<n>(time, q, p, next_row(call));
    }

    template <class AnyWatch>
    static Status take_steps(S& stepper, lobatto_advance& call, AnyWatch* watch) {
        if constexpr (K::clocked) {
            const Status status = take_intervals(stepper, call, watch);
            if (call.chain != nullptr) put_state<n>(stepper.now.time, stepper.q, stepper.p, out(call.chain));
            return status;
        } else {
            return take_equal_steps(stepper, call, watch);
        }
    }
    template <class AnyWatch>
    static Status take_equal_steps(S& stepper, lobatto_advance& call, AnyWatch* watch) {
        constexpr bool is_watched = !std::is_same_v<AnyWatch, Nothing>;
        stepper.tolerance = static_cast<real>(call.tolerance);
        std::int64_t until_record = call.record_every > 0 ? call.record_every - stepper.steps % call.record_every : -1;
        for (std::int64_t i = 0; i < call.steps; ++i) {
            if (until_record == 1 && call.records_written + call.dense >= call.capacity) break;
            if constexpr (is_watched) {
                if (call.events != nullptr && call.events_written + AnyWatch::most > call.event_capacity) break;
                if (call.cuts != nullptr && call.cuts_written + LOBATTO_CUTS_OF_STEP > call.cut_capacity) break;
                watch->keep(stepper);
            }
            const Status status = stepper.step();
            if (status != Status::ok) {
                call.increment_failed = static_cast<double>(stepper.increment);
                return status;
            }
            ++call.steps_done;
            count(stepper, call);
            if constexpr (is_watched) {
                real* const rows = call.events == nullptr ? nullptr : out(call.events);
                const Status found = watch->look(stepper, rows, call.events_written);
                if (found != Status::ok) {
                    --call.steps_done;
                    return found;
                }
                tell_cuts(*watch, call);
            }
            if (--until_record == 0) {
                if constexpr (has_dense) {
                    for (std::int32_t d = 1; d <= call.dense; ++d)
                        Between<K>::row(stepper, real(d) / real(call.dense + 1), next_row(call));
                }
                real p[n];
                stepper.momentum(p);
                put_row(stepper.time(), stepper.q, p, call);
                until_record = call.record_every;
            }
        }
        return Status::ok;
    }
    template <class AnyWatch>
    static void tell_cuts(const AnyWatch& watch, lobatto_advance& call) {
        static_assert(AnyWatch::most_impacts <= LOBATTO_CUTS_OF_STEP);
        for (int i = 0; i < watch.cuts && call.cuts != nullptr; ++i)
            call.cuts[call.cuts_written++] = static_cast<double>(watch.cut_at[i]);
    }
    static real* next_row(lobatto_advance& call) { return out(call.records) + call.records_written++ * (1 + 2 * n); }
};

}  // namespace lobatto
