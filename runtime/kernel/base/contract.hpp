// SPDX-License-Identifier: MIT
// What an emitted kernel K provides: static functions, the formulas of one scene, and constants (concept.hpp checks).
//
// Every kernel: real; name, digest, method; coordinates (n), order, parameter_count, Parameters, parameter();
// Coefficients, prepare(); form; and claims, all constexpr, of which KernelDefaults has those that rarely hold:
//   autonomous   no formula depends on time; otherwise `real time` follows `k` in every function that takes `k` and q
//   linear       the second derivatives are constant, so that one correction solves a step
//   has_energy, has_tangent   whether energies and tangent maps are compiled
//   events       how many; event(k, q, velocity, value) gives all their values, event_direction[] is 1 for rising, -1
//                for falling, 0 for both. More of them: steppers/watched_stepper.hpp
// Form::linear_map and Form::separable: is_explicit; of splitting methods they have c, b and drift_length[s - 1], the
//   way between nodes, and neither A nor E nor what orders unknowns.
// Form::linear_map: energy(k, q, p), momentum(k, velocity, p), velocity(k, p, velocity), minus_acceleration(k, q, W),
//   node(k, q, W, S), propagate(k, q, p, q1, p1).
// Form::separable: the first five of these; points (s, both ends included), c, b, A (interior); entries, entry_row,
//   entry_column of S; unknowns, N = n (s - 2); E[(s - 2) * s] extrapolates (D15); the tables of base/grouped.hpp order
//   the unknowns; `neighbours` says that acceleration can go SideBySide (base/rows.hpp; with row_reach, how far its
//   rows reach, immediate, that it can go Immediate, and unit_masses), and `absorbed` says that quadratic_part(k, S0)
//   gives a constant part of S to iterate with; `clean` that steps are those of steppers/clean.hpp. Gauss's nodes stand
//   between two ends of weight zero. `diagonal_part`: the constant part of S, from quadratic_part, is diagonal, D, and
//   taken into the stage map.
// Form::general: iteration/galerkin_equations.hpp. `clocked`: its Lagrangian is one in the time tau of a clock,
//   clock(k, q) = dt/dtau (steppers/clocked.hpp). `constraints` says how many constraints phi(q, t) = 0 there are;
//   constraint(k, q, phi, phi_t, G) gives them, dphi/dt at fixed q, and the constraint_entries of G = dphi/dq;
//   multiplier_terms(k, q, velocity, r, s) what multipliers follow from; `constant_mass` that M is constant and forces
//   hold no velocity, `scaled_mass` that M is a function times a constant matrix: then `stage` gives one over the first
//   entry of M in place of M. `hamiltonian` that velocity(k, q, p, velocity) and force(k, q, velocity, p, F) are
//   formulas, which take the place of `stage`. `angles`: how many sines and cosines `stage` takes as a last argument
//   (base/angles.hpp). constraint_summands: what rounds phi; momentum_summands: what rounds p, if it cancels at rest.
#ifndef LOBATTO_KERNEL_CONTRACT_HPP
#define LOBATTO_KERNEL_CONTRACT_HPP

#include <cstdint>
#include <type_traits>
#include <utility>

#include "numbers.hpp"
#include "pack.hpp"

namespace lobatto {

// The outcome of preparing or stepping; the same values as lobatto_status in abi.h.
enum class Status : std::int32_t {
    ok = 0,
    not_converged = 1,
    not_finite = 2,
    singular_jacobian = 3,
    singular_mass = 4,
    time_stands_still = 5,
    unsupported = 6,
    off_constraints = 9,
    stopped = 11,
    impacts_accumulate = 12
};

// The same values as lobatto_form in abi.h.
enum class Form : std::int32_t { linear_map = 0, separable = 1, general = 2 };

// What a kernel claims by saying nothing: kernels inherit this, and declare what is otherwise.
struct KernelDefaults {
    static constexpr bool linear = false, clean = false, is_explicit = false, absorbed = false, diagonal_part = false;
    static constexpr bool neighbours = false, immediate = false, unit_masses = false;
    static constexpr bool clocked = false, has_time_coordinate = false, hamiltonian = false;
    static constexpr bool constant_mass = false, scaled_mass = false, mass_needs_velocity = false;
    static constexpr int events = 0, event_direction[1] = {}, stops = 0, impacts = 0, resets = 0, passages = 0;
    static constexpr int switches = 0, refractions = 0, inputs = 0, first_input = 0, angles = 0, row_reach = -1;
    static constexpr int constraints = 0, constraint_entries = 0, constraint_row[1] = {}, constraint_column[1] = {};
    static constexpr int momentum_summand_count = 0;
};

// K's functions with a time for all of them: it is passed on where the kernel depends on it.
#define LOBATTO_WITH_TIME(name)                                                                 \
    template <class Given, class Time, class... Rest>                                           \
    LOBATTO_INLINE static auto name(const Given& k, [[maybe_unused]] Time time, Rest... rest) { \
        if constexpr (K::autonomous)                                                            \
            return K::name(k, rest...);                                                         \
        else                                                                                    \
            return K::name(k, time, rest...);                                                   \
    }
template <class K>
struct Formulas {
    LOBATTO_WITH_TIME(node)
    LOBATTO_WITH_TIME(minus_acceleration)
    LOBATTO_WITH_TIME(slope)
    LOBATTO_WITH_TIME(slopes)
    LOBATTO_WITH_TIME(stage)
    LOBATTO_WITH_TIME(legendre)
    LOBATTO_WITH_TIME(momentum)  // of Form::general, as the next two
    LOBATTO_WITH_TIME(velocity)
    LOBATTO_WITH_TIME(force)
    LOBATTO_WITH_TIME(event)
    LOBATTO_WITH_TIME(impact)
    LOBATTO_WITH_TIME(reset)
    LOBATTO_WITH_TIME(refraction)
    LOBATTO_WITH_TIME(energy)
    LOBATTO_WITH_TIME(clock)
    LOBATTO_WITH_TIME(constraint)
    LOBATTO_WITH_TIME(constraint_summands)
    LOBATTO_WITH_TIME(momentum_summands)
    LOBATTO_WITH_TIME(multiplier_terms)
    // Along rows of coordinates, in the way How (base/rows.hpp).
    template <class How, class Given, class Time, class Position, class Slope>
    LOBATTO_INLINE static void along_rows(const Given& k, [[maybe_unused]] Time time, Position position, Slope slope) {
        if constexpr (K::autonomous)
            K::template minus_acceleration<How>(k, position, slope);
        else
            K::template minus_acceleration<How>(k, time, position, slope);
    }
};
#undef LOBATTO_WITH_TIME

// How steps are taken: the equations of inner nodes solved, round-off-clean (steppers/clean.hpp), kicks and drifts in
// turn (steppers/splitting.hpp), equally long in the time of a clock (steppers/clocked.hpp).
enum class Stepping { solved, clean, composition, clocked };
template <class K>
constexpr Stepping stepping_of() {
    return K::clocked                                     ? Stepping::clocked
           : K::clean                                     ? Stepping::clean
           : K::form == Form::separable && K::is_explicit ? Stepping::composition
                                                          : Stepping::solved;
}

// The most coordinates whose mass matrix is treated as a full one.
constexpr int most_full = 16;

// Zero when all are finite, not a number otherwise; of Packs in each lane.
template <class T>
LOBATTO_DEVICE inline T not_finite_part(const T* x, int count) {
    T sum = T(real_of<T>(0));
    for (int i = 0; i < count; ++i) sum += x[i] - x[i];
    return sum;
}

// A row of t, q[n], p[n]; of Packs, that of one lane.
template <int n, class real, class Number>
inline void put_state(real time, const Number* q, const Number* p, real* row, int lane = 0) {
    row[0] = time;
    for (int c = 0; c < n; ++c) {
        row[1 + c] = lane_of(q[c], lane);
        row[1 + n + c] = lane_of(p[c], lane);
    }
}

// What the steppers of all forms carry.
template <class K>
struct Motion {
    using real = typename K::real;
    static constexpr int n = K::coordinates;
    static constexpr int event_room = K::events > 0 ? K::events : 1;

    typename K::Coefficients coefficients{};  // values of parameters and step size
    real step_size{};                         // h
    real start_time{};
    std::int64_t steps{};             // since start: the time is start_time + steps * h
    real tolerance{};                 // of increments, relative; the iteration of a step ends there, or at rounding
    real q[n]{};                      // position
    std::int32_t iterations{};        // of the last step
    real increment{};                 // last increment that was measured, relative to the displacement of its step
    real event_values[event_room]{};  // the last of each that was not zero (steppers/events.hpp)
    bool event_begins[event_room]{};  // whether that is of the state now, which no step has looked at
    bool events_go_on{};              // from a motion before the start: then the first step is one like others

    real time() const { return start_time + real(steps) * step_size; }
    real next_time() const { return start_time + real(steps + 1) * step_size; }
    bool time_stands_still() const { return next_time() == time(); }

    // One step of `local`, a copy of this stepper, from (q, p) at `time` to (q1, p1).
    template <class S>
    static Status step_from(S& local, real time, const real* position, const real* momentum, real* q1, real* p1) {
        Status status = local.start(time, position, momentum);
        if (status == Status::ok) status = local.step();
        if (status != Status::ok) return status;
        for (int k = 0; k < n; ++k) q1[k] = local.q[k];
        local.momentum(p1);
        return status;
    }
};

// One trajectory of kernel K. Usage: prepare, start (anew after another prepare, which changes h), then step as often
// as wanted. Not thread-safe; copy freely. A step that fails leaves the state of the last good one.
template <class K, Form form = K::form, Stepping stepping = stepping_of<K>()>
struct Stepper;

// K for a trajectory that leaves the lanes for a step: by Newton's iteration, so that no other is compiled.
template <class K>
struct NewtonOnly : K {
    static constexpr bool any_number = false;
};
template <class K>
using FallbackKernel = std::conditional_t<stepping_of<K>() == Stepping::composition, K, NewtonOnly<K>>;
template <class K>
using ScalarFallback = Stepper<FallbackKernel<K>>;

// Fixed-point iteration along the nodes (iteration/fixed_point.hpp), or along coordinates (iteration/neighbours.hpp).
template <class K, bool neighbours>
struct FixedPointOf;

// How the lanes of each form move by one step: start(single, lane) takes the state of a Stepper over, step(k, time,
// active) moves the active lanes, and answers which have moved; positions(), rates() and momentum(single, lane, p)
// read. What all lanes of one step size share is read by shared(), and take(shared) sets it (device_lanes.hpp).
template <class K, class T, Form form = K::form, Stepping stepping = stepping_of<K>()>
struct LaneStepper;

// A system with constant mass.
template <class K>
struct ConstantMass : Motion<K> {
    using typename Motion<K>::real;
    using Motion<K>::n, Motion<K>::coefficients;

    Status energy(real time, const real* position, const real* momentum, real* value) const {
        if constexpr (K::has_energy) {
            *value = Formulas<K>::energy(coefficients, time, position, momentum);
            return Status::ok;
        } else {
            return Status::unsupported;
        }
    }
    void momentum(real, const real*, const real* velocity, real* momentum) const {
        K::momentum(coefficients, velocity, momentum);
    }
    Status velocity(real, const real*, const real* momentum, real* velocity) const {
        K::velocity(coefficients, momentum, velocity);
        return Status::ok;
    }
    // dL/dv = M v and dL/dq + F = -M W.
    void slopes(real time, const real* position, const real* velocity, real* Lv, real* Lq) const {
        real W[n];
        Formulas<K>::minus_acceleration(coefficients, time, position, W);
        for (int k = 0; k < n; ++k) W[k] = -W[k];
        K::momentum(coefficients, velocity, Lv);
        K::momentum(coefficients, W, Lq);
    }
};

// The same, with its velocity kept beside its position.
template <class K>
struct VelocityKept : ConstantMass<K> {
    using typename ConstantMass<K>::real;
    using ConstantMass<K>::n, ConstantMass<K>::coefficients, ConstantMass<K>::momentum;
    real u[n]{};  // M^-1 p

    // Begins at (q, p); W: M^-1 grad V there.
    Status begin(real time, const real* position, const real* momentum, real* W) {
        this->start_time = time;
        this->steps = 0;
        for (int k = 0; k < n; ++k) this->q[k] = position[k];
        K::velocity(coefficients, momentum, u);
        Formulas<K>::minus_acceleration(coefficients, time, this->q, W);
        if constexpr (K::events > 0) {
            Formulas<K>::event(coefficients, time, this->q, u, this->event_values);
            this->events_go_on = false;
        }
        const real sum = time + not_finite_part(position, n) + not_finite_part(momentum, n) + not_finite_part(W, n);
        return is_finite(sum) ? Status::ok : Status::not_finite;
    }

    void momentum(real* p) const { K::momentum(coefficients, u, p); }
};

// When to try iterations: at once; after they failed, 1, 2, 4, ... 64 steps later, which Newton's iteration takes.
struct Pause {
    std::int32_t left{};   // steps
    std::int32_t next{1};  // how many, the next time that iterations fail

    // Once a step: whether the pause is over with it.
    bool count_down() { return left == 0 || --left == 0; }
    void succeed() { next = 1; }
    void fail() {
        left = next;
        next = next < 64 ? 2 * next : 64;
    }
};

// In place of what a kernel does not need.
struct Nothing {};

// Room for a step's arrays: on the stack while they are few, else in the stepper. In line, so that they are registers
// where there are enough, and what the step refers to need not lie in memory for a call.
template <class Arrays>
struct Workspace {
    static constexpr bool is_large = sizeof(Arrays) > 16384;
    mutable std::conditional_t<is_large, Arrays, Nothing> kept{};

    template <class Use>
    LOBATTO_INLINE auto with(const Use& use) const {
        if constexpr (is_large) {
            return use(kept);
        } else {
            Arrays local;
            return use(local);
        }
    }
};

// Lagrange's polynomials over the points, l_j(theta) and l_j'(theta).
template <int count, class real>
constexpr void lagrange(const real* points, real theta, real* value, real* slope) {
    for (int j = 0; j < count; ++j) {
        value[j] = real(1);
        slope[j] = real(0);
        for (int l = 0; l < count; ++l) {
            if (l == j) continue;
            const real scale = real(1) / (points[j] - points[l]);
            slope[j] = (slope[j] * (theta - points[l]) + value[j]) * scale;
            value[j] *= (theta - points[l]) * scale;
        }
    }
}

}  // namespace lobatto

#endif
