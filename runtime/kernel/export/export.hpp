// SPDX-License-Identifier: MIT
// Wraps an emitted kernel K into the C structure of abi.h. Compiled into every kernel library, after kernel.hpp.
#pragma once

#include <cstddef>
#include <new>
#include <type_traits>

#include "../abi.h"
#include "../kernel.hpp"
#include "advance.hpp"
#include "lanes.hpp"

namespace lobatto {

// The functions of one trajectory, and those of E.
template <class K, class E = NoEnsemble>
struct Export {
    using real = typename K::real;
    // Beside lanes, which have functions of their own, a single trajectory takes steps and does no more.
    static constexpr bool is_whole = E::lanes == 0;
    static constexpr int n = K::coordinates, event_count = is_whole ? K::events : 0;
    static constexpr int constraint_count = K::constraints;
    static constexpr int inputs = is_whole ? K::inputs : 0;
    static constexpr bool has_switches = is_whole && K::switches > 0;
    static constexpr bool has_walls = has_switches || (is_whole && K::impacts > 0);
    static constexpr bool has_dense = is_whole && K::form != Form::linear_map, has_tangent = is_whole && K::has_tangent;
    using S = std::conditional_t<(event_count > 0), WatchedStepper<K>, Stepper<K>>;
    using Taken = Advance<K, S, has_dense>;

    static const S& of(const void* stepper) { return *static_cast<const S*>(stepper); }
    static const real* in(const void* numbers) { return static_cast<const real*>(numbers); }
    static real* out(void* numbers) { return static_cast<real*>(numbers); }
    static std::int32_t code(Status status) { return static_cast<std::int32_t>(status); }

    static std::int32_t prepare(void* stepper, const void* parameters, const void* step) {
        typename K::Parameters values;
        for (int i = 0; i < K::parameter_count; ++i) K::parameter(values, i) = in(parameters)[i];
        S* const fresh = new (stepper) S;
        if (*in(step) == real(0)) return LOBATTO_TIME_STANDS_STILL;
        if (!is_finite(*in(step))) return LOBATTO_NOT_FINITE;
        if constexpr (event_count > 0) fresh->parameters = values;
        return code(fresh->prepare(values, *in(step)));
    }

    static std::int32_t start(void* stepper, const void* time, const void* q, const void* p) {
        if constexpr (has_walls)
            return code(Sides<K>::start(*static_cast<S*>(stepper), *in(time), in(q), in(p)));
        else
            return code(static_cast<S*>(stepper)->start(*in(time), in(q), in(p)));
    }
    static std::int32_t go_on(void* stepper, const void* other, const void* time, const void* q, const void* p) {
        if constexpr (event_count > 0) {
            const KnownEvents<S> known(of(other));
            const std::int32_t status = start(stepper, time, q, p);
            known.continue_in(*static_cast<S*>(stepper));
            return status;
        }
        return start(stepper, time, q, p);
    }
    static std::int32_t take_inputs(void* stepper, const void* parameters) {
        if constexpr (inputs > 0) {
            S& here = *static_cast<S*>(stepper);
            typename K::Parameters values;
            for (int i = 0; i < K::parameter_count; ++i) K::parameter(values, i) = in(parameters)[i];
            if constexpr (event_count > 0)
                return code(set_watched_inputs(here, values));
            else
                return code(set_inputs(here, values));
        }
        return LOBATTO_UNSUPPORTED;
    }
    static constexpr auto inputs_taken = inputs > 0 ? take_inputs : nullptr;
    // What `use` makes of the stepper, on the side of all switches that `take` gives it.
    template <class Take, class Use>
    static auto on_a_side(const void* stepper, const Take& take, const Use& use) {
        if constexpr (has_switches) {
            S local = of(stepper);
            take(local);
            return use(local);
        } else {
            return use(of(stepper));
        }
    }
    template <class Use>
    static auto at_state(const void* stepper, const void* time, const void* q, const void* p, const Use& use) {
        return on_a_side(
            stepper, [&](auto& s) { Sides<K>::take(s, *in(time), in(q), in(p)); }, use);
    }
    template <class Use>
    static auto at_motion(const void* stepper, const void* time, const void* q, const void* velocity, const Use& use) {
        return on_a_side(
            stepper, [&](auto& s) { Sides<K>::take_at(s, *in(time), in(q), in(velocity)); }, use);
    }
    static std::int32_t advance(void* stepper, lobatto_advance* call) {
        call->steps_done = call->records_written = call->events_written = call->cuts_written = call->iterations = 0;
        call->chain_steps = 0;
        call->iterations_most = 0;
        call->increment_largest = call->increment_failed = 0.0;
        if ((call->dense > 0 && (!has_dense || call->record_every != 1)) ||
            (call->events != nullptr && event_count == 0))
            return call->status = LOBATTO_UNSUPPORTED;
        if constexpr (sizeof(S) <= 4096) {
            S local = of(stepper);  // a local copy: the optimiser may keep it in registers
            const Status status = advance_in(local, *call);
            *static_cast<S*>(stepper) = local;
            return call->status = code(status);
        } else {
            return call->status = code(advance_in(*static_cast<S*>(stepper), *call));
        }
    }

    static Status advance_in(S& stepper, lobatto_advance& call) {
        if constexpr (event_count > 0) {
            if (call.events != nullptr || has_walls) {
                Watch<K> watch(stepper);
                return Taken::take_steps(stepper, call, &watch);
            }
        }
        return Taken::take_steps(stepper, call, static_cast<Nothing*>(nullptr));
    }

    static void state(const void* stepper, void* time, void* q, void* p) {
        if constexpr (K::clocked) {
            *out(time) = of(stepper).arrival_time;
            for (int k = 0; k < n; ++k) {
                out(q)[k] = of(stepper).arrival_q[k];
                out(p)[k] = of(stepper).arrival_p[k];
            }
        } else {
            *out(time) = of(stepper).time();
            for (int k = 0; k < n; ++k) out(q)[k] = of(stepper).q[k];
            of(stepper).momentum(out(p));
        }
    }

    static void read_two_fold(const void* stepper, void* q, void* q_rest, void* velocity, void* velocity_rest) {
        if constexpr (K::clean) {
            for (int k = 0; k < n; ++k) {
                out(q)[k] = of(stepper).q[k];
                out(q_rest)[k] = of(stepper).q_rest[k];
                out(velocity)[k] = of(stepper).u[k];
                out(velocity_rest)[k] = of(stepper).u_rest[k];
            }
        }
    }
    static constexpr auto two_fold_state = K::clean ? read_two_fold : nullptr;

    static std::int32_t dense(const void* stepper, const void* theta, void* q, void* velocity) {
        if constexpr (has_dense) {
            if (of(stepper).has_history) {
                of(stepper).polynomial(*in(theta), out(q), out(velocity));
                return LOBATTO_OK;
            }
        }
        return LOBATTO_UNSUPPORTED;
    }

    static constexpr std::int32_t parts_of(double epsilon) {
        std::int32_t count = 1;
        for (double bound = 0x1p-53; epsilon <= bound; bound *= 0x1p-53) ++count;
        return count;
    }
    static constexpr std::int32_t parts = parts_of(static_cast<double>(Limits<real>::epsilon));
    static void to_parts(const void* numbers, std::int64_t count, double* to) {
        for (std::int64_t i = 0; i < count; ++i) {
            real rest = in(numbers)[i];
            const bool finite = is_finite(static_cast<double>(rest));  // the largest of its numbers are no doubles
            for (std::int32_t j = 0; j < parts; ++j) {
                to[i * parts + j] = finite || j == 0 ? static_cast<double>(rest) : 0.0;
                rest -= real(to[i * parts + j]);
            }
        }
    }
    static void from_parts(const double* from, std::int64_t count, void* numbers) {
        for (std::int64_t i = 0; i < count; ++i) {
            real sum = real(from[i * parts + parts - 1]);
            for (std::int32_t j = parts - 2; j >= 0; --j) sum = real(from[i * parts + j]) + sum;
            out(numbers)[i] = sum;
        }
    }

    static std::int32_t energy(const void* stepper, const void* time, const void* q, const void* p, void* energy) {
        return at_state(stepper, time, q, p,
                        [&](const S& s) { return code(s.energy(*in(time), in(q), in(p), out(energy))); });
    }
    static void momentum(const void* stepper, const void* time, const void* q, const void* velocity, void* p) {
        at_motion(stepper, time, q, velocity, [&](const S& s) { s.momentum(*in(time), in(q), in(velocity), out(p)); });
    }
    static std::int32_t velocity(const void* stepper, const void* time, const void* q, const void* p, void* velocity) {
        return at_state(stepper, time, q, p,
                        [&](const S& s) { return code(s.velocity(*in(time), in(q), in(p), out(velocity))); });
    }
    static void slopes(const void* stepper, const void* time, const void* q, const void* velocity, void* Lv, void* Lq) {
        at_motion(stepper, time, q, velocity,
                  [&](const S& s) { s.slopes(*in(time), in(q), in(velocity), out(Lv), out(Lq)); });
    }
    static void read_constraint(const void* stepper, const void* time, const void* q, void* phi, void* phi_t, void* G) {
        if constexpr (constraint_count > 0) {
            real entries[K::constraint_entries];
            const real at_rest[n] = {};  // no constraint holds a velocity
            at_motion(stepper, time, q, at_rest, [&](const S& s) {
                Formulas<K>::constraint(s.coefficients, *in(time), in(q), out(phi), out(phi_t), entries);
            });
            for (int i = 0; i < constraint_count * n; ++i) out(G)[i] = real(0);
            for (int e = 0; e < K::constraint_entries; ++e)
                out(G)[K::constraint_row[e] * n + K::constraint_column[e]] = entries[e];
        }
    }
    static std::int32_t find_multipliers(const void* stepper, const void* time, const void* q, const void* p,
                                         void* lambda) {
        if constexpr (constraint_count > 0)
            return at_state(stepper, time, q, p,
                            [&](const S& s) { return code(s.multipliers(*in(time), in(q), in(p), out(lambda))); });
        return LOBATTO_UNSUPPORTED;
    }
    static constexpr auto constraint = constraint_count > 0 ? read_constraint : nullptr;

    static std::int32_t residual(const void* stepper, const void* time, const void* q, const void* p, const void* X,
                                 void* F) {
        if constexpr (is_whole) return code(of(stepper).residual(*in(time), in(q), in(p), in(X), out(F)));
        return LOBATTO_UNSUPPORTED;
    }
    static std::int32_t jacobian(const void* stepper, const void* time, const void* q, const void* p, const void* X,
                                 void* J) {
        if constexpr (is_whole) return code(of(stepper).jacobian(*in(time), in(q), in(p), in(X), out(J)));
        return LOBATTO_UNSUPPORTED;
    }
    static std::int32_t tangent(const void* stepper, const void* time, const void* q, const void* p, void* q1, void* p1,
                                void* T) {
        if constexpr (has_tangent) return code(of(stepper).tangent(*in(time), in(q), in(p), out(q1), out(p1), out(T)));
        return LOBATTO_UNSUPPORTED;
    }

    static constexpr lobatto_real kind() {
        return is_many_digits<real>                   ? LOBATTO_MANY_DIGITS
               : std::is_class_v<real>                ? LOBATTO_DOUBLE_DOUBLE
               : sizeof(real) == 4                    ? LOBATTO_FLOAT
               : sizeof(real) == 8                    ? LOBATTO_DOUBLE
               : Limits<real>::epsilon > real(1e-25L) ? LOBATTO_LONG_DOUBLE
                                                      : LOBATTO_FLOAT128;
    }
    static constexpr std::int32_t events_of_step() {
        if constexpr (event_count > 0)
            return Watch<K>::most;
        else
            return E::events_of_step;
    }

    static constexpr lobatto_kernel filled_table() {
        lobatto_kernel t{};
        t.abi_version = LOBATTO_ABI_VERSION;
        t.bytes = sizeof(lobatto_kernel);
        t.name = K::name;
        t.digest = K::digest;
        t.method = K::method;
        t.real_kind = kind();
        t.real_bytes = sizeof(real);
        t.parts = parts;
        t.epsilon = static_cast<double>(Limits<real>::epsilon);
        t.form = static_cast<std::int32_t>(K::form);
        t.coordinates = n;
        t.parameters = K::parameter_count;
        t.inputs = inputs;
        t.first_input = is_whole ? K::first_input : 0;
        t.nodes = S::nodes;
        t.order = K::order;
        t.unknowns = S::N;
        t.autonomous = K::autonomous;
        t.clocked = K::clocked;
        t.linear = K::linear;
        t.constraints = constraint_count;
        t.has_energy = K::has_energy;
        t.has_tangent = has_tangent;
        t.has_dense = has_dense;
        t.events = event_count;
        t.stops = is_whole ? K::stops : 0;
        t.impacts = is_whole ? K::impacts : 0;
        t.events_of_step = events_of_step();
        t.stepper_bytes = sizeof(S);
        t.stepper_alignment = alignof(S);
        t.prepare = prepare;
        t.start = start;
        t.go_on = go_on;
        t.advance = advance;
        t.state = state;
        t.set_inputs = inputs_taken;
        t.two_fold_state = two_fold_state;
        t.dense = dense;
        t.to_parts = to_parts;
        t.from_parts = from_parts;
        t.energy = energy;
        t.momentum = momentum;
        t.velocity = velocity;
        t.slopes = slopes;
        t.constraint = constraint;
        t.multipliers = find_multipliers;
        t.residual = residual;
        t.jacobian = jacobian;
        t.tangent = tangent;
        t.lanes = E::lanes;
        t.ensemble_bytes = E::bytes;
        t.ensemble_alignment = E::alignment;
        t.ensemble_prepare = E::prepare;
        t.ensemble_start = E::start;
        t.ensemble_advance = E::advance;
        t.ensemble_state = E::state;
        t.ensemble_energy = K::has_energy ? E::energy : nullptr;
        t.refilled_prepare = E::refilled_prepare;
        t.refilled_fill = E::fill;
        t.refilled_advance = E::refilled_advance;
        return t;
    }
    static constexpr lobatto_kernel table = filled_table();
};

// With LOBATTO_ENSEMBLES, a library for that many trajectories or more: side by side, where that is faster, and where
// none meets a wall or, without LOBATTO_REFILLED, ends before the others.
#if defined(LOBATTO_REFILLED)
template <class K, int lanes = (K::impacts + K::switches > 0) ? 0 : refilled_lanes<K>(LOBATTO_ENSEMBLES)>
using Exported = std::conditional_t<(lanes > 0), Export<FallbackKernel<K>, ExportRefilled<K, lanes>>, Export<K>>;
#elif defined(LOBATTO_ENSEMBLES)
template <class K, int lanes = (K::stops + K::impacts + K::switches > 0) ? 0
                               : K::clocked                              ? clocked_lanes<K>()
                                                                         : ensemble_lanes<K>(LOBATTO_ENSEMBLES)>
using Exported = std::conditional_t<(lanes > 0), Export<FallbackKernel<K>, ExportSide<K, lanes>>, Export<K>>;
#else
template <class K>
using Exported = Export<K>;
#endif

}  // namespace lobatto

#define LOBATTO_EXPORT_KERNEL(K)                                                                         \
    extern "C" __attribute__((visibility("default"))) const lobatto_kernel* lobatto_kernel_table(void) { \
        return &lobatto::Exported<K>::table;                                                             \
    }
