// SPDX-License-Identifier: MIT
// The functions of trajectories side by side, as abi.h has them: untyped pointers in, an ensemble of K's numbers
// called.
#pragma once

#include <cstddef>
#include <cstdint>
#include <new>
#include <type_traits>

#include "../abi.h"
#include "../kernel.hpp"

namespace lobatto {

// In a library of single trajectories, and where trajectories side by side would be no faster.
struct NoEnsemble {
    static constexpr std::int32_t lanes = 0, bytes = 0, alignment = 0;
    static constexpr std::nullptr_t prepare{}, start{}, advance{}, state{}, energy{};
    static constexpr std::nullptr_t refilled_prepare{}, fill{}, refilled_advance{};
    static constexpr std::int32_t events_of_step = 0;
};

#ifdef LOBATTO_ENSEMBLES
// The functions of `lanes` trajectories side by side.
template <class K, int width>
struct ExportEnsemble : NoEnsemble {
    using real = typename K::real;
    using Side = Ensemble<K, width>;
    static constexpr std::int32_t lanes = width, bytes = sizeof(Side), alignment = alignof(Side);

    static const real* in(const void* numbers) { return static_cast<const real*>(numbers); }
    static real* out(void* numbers) { return static_cast<real*>(numbers); }

    // `use` with the statuses of the lanes.
    template <class Use>
    static void with(std::int32_t* codes, const Use& use) {
        Status status[lanes];
        for (int lane = 0; lane < lanes; ++lane) status[lane] = static_cast<Status>(codes[lane]);
        use(+status);
        for (int lane = 0; lane < lanes; ++lane) codes[lane] = static_cast<std::int32_t>(status[lane]);
    }
    static void prepare(void* ensemble, const void* parameters, const void* step, std::int32_t* codes) {
        with(codes, [&](Status* status) { (new (ensemble) Side)->prepare(in(parameters), *in(step), status); });
    }
    static void start(void* ensemble, const void* time, const void* q, const void* p, std::int32_t* codes) {
        with(codes, [&](Status* status) { static_cast<Side*>(ensemble)->start(*in(time), in(q), in(p), status); });
    }
    static void advance(void* ensemble, std::int64_t steps, double tolerance, std::int32_t* codes, std::int64_t* done,
                        std::int64_t* iterations) {
        with(codes, [&](Status* status) {
            static_cast<Side*>(ensemble)->advance(steps, static_cast<real>(tolerance), status, done, iterations);
        });
    }
    static void state(const void* ensemble, void* q, void* p) {
        static_cast<const Side*>(ensemble)->state(out(q), out(p));
    }
    static void energy(const void* ensemble, void* value) { static_cast<const Side*>(ensemble)->energy(out(value)); }
};

// The functions of lanes that are refilled.
template <class K, class Side>
struct ExportLanes : NoEnsemble {
    using real = typename K::real;
    static constexpr std::int32_t lanes = Side::lanes, bytes = sizeof(Side), alignment = alignof(Side);
    static constexpr std::int32_t events_of_step = Side::events_of_step;

    static void refilled_prepare(void* ensemble, const void* step) {
        (new (ensemble) Side)->prepare(*static_cast<const real*>(step));
    }
    static std::int32_t fill(void* ensemble, std::int32_t lane, const void* parameters, const void* time, const void* q,
                             const void* p) {
        return static_cast<std::int32_t>(static_cast<Side*>(ensemble)->fill(
            lane, static_cast<const real*>(parameters), *static_cast<const real*>(time), static_cast<const real*>(q),
            static_cast<const real*>(p)));
    }
    static void refilled_advance(void* ensemble, lobatto_refilled_advance* call) {
        ExportEnsemble<K, lanes>::with(call->status,
                                       [&](Status* status) { static_cast<Side*>(ensemble)->advance(*call, status); });
    }
};

template <class K, int width>
using ExportSide = std::conditional_t<K::clocked, ExportLanes<K, ClockedEnsemble<K, width>>, ExportEnsemble<K, width>>;
#ifdef LOBATTO_REFILLED
template <class K, int width>
using ExportRefilled = ExportLanes<K, RefilledEnsemble<K, width>>;
#endif
#endif

}  // namespace lobatto
