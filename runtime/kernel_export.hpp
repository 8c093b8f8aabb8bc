// SPDX-License-Identifier: MIT
// Wraps an emitted kernel K into the C structure of kernel_abi.h. Compiled into every kernel library, after kernel.hpp.
#pragma once

#include <new>

#include "kernel.hpp"
#include "kernel_abi.h"

namespace lobatto {

template <class K>
struct Export {
    using real = typename K::real;
    using S = Stepper<K>;
    static constexpr int n = K::coordinates;

    static const S& of(const void* stepper) { return *static_cast<const S*>(stepper); }
    static const real* in(const void* numbers) { return static_cast<const real*>(numbers); }
    static real* out(void* numbers) { return static_cast<real*>(numbers); }
    static std::int32_t code(Status status) { return static_cast<std::int32_t>(status); }

    static std::int32_t prepare(void* stepper, const void* parameters, const void* step) {
        typename K::Parameters values;
        for (int i = 0; i < K::parameter_count; ++i) K::parameter(values, i) = in(parameters)[i];
        return code((new (stepper) S)->prepare(values, *in(step)));
    }

    static std::int32_t start(void* stepper, const void* time, const void* q, const void* p) {
        return code(static_cast<S*>(stepper)->start(*in(time), in(q), in(p)));
    }

    static std::int32_t advance(void* stepper, lobatto_advance* call) {
        S local = of(stepper);  // a local copy: the optimiser may keep it in registers
        call->steps_done = call->records_written = call->iterations = 0;
        call->iterations_most = 0;
        call->increment_largest = call->increment_failed = 0.0;
        Status status = Status::ok;
        std::int64_t until_record = call->record_every > 0 ? call->record_every - local.steps % call->record_every : -1;
        for (std::int64_t i = 0; i < call->steps; ++i) {
            if (until_record == 1 && call->records_written == call->capacity) break;
            status = local.step();
            if (status != Status::ok) {
                call->increment_failed = static_cast<double>(local.increment);
                break;
            }
            ++call->steps_done;
            if constexpr (K::unknowns > 0 && !K::linear) {
                call->iterations += local.iterations;
                if (local.iterations > call->iterations_most) call->iterations_most = local.iterations;
                if (static_cast<double>(local.increment) > call->increment_largest)
                    call->increment_largest = static_cast<double>(local.increment);
            }
            if (--until_record == 0) {
                real* row = out(call->records) + call->records_written * (1 + 2 * n);
                row[0] = local.time();
                for (int k = 0; k < n; ++k) row[1 + k] = local.q[k];
                local.momentum(row + 1 + n);
                ++call->records_written;
                until_record = call->record_every;
            }
        }
        *static_cast<S*>(stepper) = local;
        return call->status = code(status);
    }

    static void state(const void* stepper, void* time, void* q, void* p) {
        *out(time) = of(stepper).time();
        for (int k = 0; k < n; ++k) out(q)[k] = of(stepper).q[k];
        of(stepper).momentum(out(p));
    }

    static void energy(const void* stepper, const void* q, const void* p, void* energy) {
        *out(energy) = K::energy(of(stepper).coefficients, in(q), in(p));
    }
    static void momentum(const void* stepper, const void*, const void* velocity, void* p) {
        K::momentum(of(stepper).coefficients, in(velocity), out(p));
    }
    static void velocity(const void* stepper, const void*, const void* p, void* velocity) {
        K::velocity(of(stepper).coefficients, in(p), out(velocity));
    }
    static void acceleration(const void* stepper, const void* q, void* W, void* full) {
        real entries[K::entries > 0 ? K::entries : 1];
        K::node(of(stepper).coefficients, in(q), out(W), entries);
        expand_entries<K>(entries, out(full));
    }

    static void residual(const void* stepper, const void* q, const void* p, const void* Q, void* F) {
        if constexpr (K::unknowns > 0 && !K::linear) {
            const auto& k = of(stepper).coefficients;
            real u[n], v[n], W0[n], base[(K::points - 1) * n], W[K::unknowns];
            K::velocity(k, in(p), u);
            K::acceleration(k, in(q), W0);
            K::drift(k, in(q), u, W0, v, base);
            for (int i = 0; i < K::points - 2; ++i) K::acceleration(k, in(Q) + i * n, W + i * n);
            K::residual(k, base, in(Q), W, out(F));
        }
    }

    static void jacobian(const void* stepper, const void* Q, void* J) {
        if constexpr (K::unknowns > 0 && !K::linear) {
            const auto& k = of(stepper).coefficients;
            constexpr int e = K::entries;
            real W[n], entries[(K::points - 2) * (e > 0 ? e : 1)];
            for (int i = 0; i < K::points - 2; ++i) K::node(k, in(Q) + i * n, W, entries + i * e);
            K::jacobian(k, entries, out(J));
        }
    }

    static std::int32_t tangent(const void* stepper, const void* q, const void* p, void* q1, void* p1, void* T) {
        S local = of(stepper);
        Status status = local.start(real(0), in(q), in(p));
        if (status != Status::ok) return code(status);
        status = local.step();
        if (status != Status::ok) return code(status);
        for (int k = 0; k < n; ++k) out(q1)[k] = local.q[k];
        local.momentum(out(p1));
        constexpr int s = K::points, columns = 2 * n + 1;
        real full[2 * n * columns];
        if constexpr (K::linear) {
            for (int i = 0; i < 2 * n * columns; ++i) full[i] = local.coefficients.Phi_minus_I[i];
        } else {
            real second[s * n * n], W[n], entries[K::entries > 0 ? K::entries : 1], none[n] = {};
            for (int i = 0; i < s; ++i) {
                K::node(local.coefficients, i == 0 ? in(q) : i == s - 1 ? local.q : local.Q + (i - 1) * n, W, entries);
                expand_entries<K>(entries, second + i * n * n);
            }
            if (!increment_of_step<K>(local.step_size, second, none, full)) return code(Status::singular_jacobian);
            to_momentum<K>(local.coefficients, full);
        }
        for (int r = 0; r < 2 * n; ++r)
            for (int c = 0; c < 2 * n; ++c)
                out(T)[r * 2 * n + c] = (r == c ? real(1) : real(0)) + full[r * columns + c];
        return code(Status::ok);
    }

    static constexpr lobatto_real kind() {
        return sizeof(real) == 4                      ? LOBATTO_FLOAT
               : sizeof(real) == 8                    ? LOBATTO_DOUBLE
               : Limits<real>::epsilon > real(1e-25L) ? LOBATTO_LONG_DOUBLE
                                                      : LOBATTO_FLOAT128;
    }

    static constexpr lobatto_kernel table = {LOBATTO_ABI_VERSION,
                                             sizeof(lobatto_kernel),
                                             K::name,
                                             K::digest,
                                             kind(),
                                             sizeof(real),
                                             n,
                                             K::parameter_count,
                                             K::points,
                                             K::order,
                                             K::linear ? 0 : K::unknowns,
                                             K::linear ? 1 : 0,
                                             sizeof(S),
                                             alignof(S),
                                             prepare,
                                             start,
                                             advance,
                                             state,
                                             energy,
                                             momentum,
                                             velocity,
                                             acceleration,
                                             residual,
                                             jacobian,
                                             tangent};
};

}  // namespace lobatto

#define LOBATTO_EXPORT_KERNEL(K)                                                                         \
    extern "C" __attribute__((visibility("default"))) const lobatto_kernel* lobatto_kernel_table(void) { \
        return &lobatto::Export<K>::table;                                                               \
    }
