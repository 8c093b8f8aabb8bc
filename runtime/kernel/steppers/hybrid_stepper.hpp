// SPDX-License-Identifier: MIT
// A stepper that also handles events, stops, impacts and switches. A step is one from t to t + h, whatever it meets on
// the way. For programs that hold a kernel's text; it allocates when it starts.
#ifndef LOBATTO_KERNEL_HYBRID_STEPPER_HPP
#define LOBATTO_KERNEL_HYBRID_STEPPER_HPP

#include "../base/contract.hpp"
#include "../base/numbers.hpp"
#include "watch.hpp"

namespace lobatto {

template <class K>
class HybridStepper {
public:
    using real = typename K::real;
    static constexpr int n = K::coordinates, columns = Watch<K>::columns;

    HybridStepper() = default;
    // A copy goes on with the same bits: a motion that is kept to go back to.
    HybridStepper(const HybridStepper& other) { *this = other; }
    HybridStepper& operator=(const HybridStepper& other) {
        if (this == &other) return *this;
        stepper = other.stepper;
        started = other.started;
        delete looks;
        looks = nullptr;
        if (other.looks != nullptr) looks = new Looks(stepper, *other.looks);
        return *this;
    }
    ~HybridStepper() { delete looks; }

    void set_tolerance(real tolerance) { stepper.tolerance = tolerance; }  // of increments, relative; 0: to rounding
    Status prepare(const typename K::Parameters& parameters, real h) {
        delete looks;
        looks = nullptr;
        started = Status::unsupported;
        stepper.parameters = parameters;
        return stepper.prepare(parameters, h);
    }
    // Status::off_constraints behind a wall; Status::unsupported where walls or switches are and h < 0.
    Status start(real time, const real* q, const real* p) {
        delete looks;
        looks = nullptr;
        if constexpr (WatchedStepper<K>::walls > 0)
            started = stepper.step_size < real(0) ? Status::unsupported : Sides<K>::start(stepper, time, q, p);
        else
            started = stepper.start(time, q, p);
        if (started == Status::ok) looks = new Looks(stepper);
        return started;
    }
    // Status::stopped: the motion met a stop in this step, where the last event says. Without a start:
    // Status::unsupported; after one that was refused: the status of that one.
    Status step() {
        if (looks == nullptr) return started;
        looks->count = 0;
        looks->watch.keep(stepper);
        const Status status = stepper.step();
        return status == Status::ok ? looks->watch.look(stepper, looks->rows, looks->count) : status;
    }

    // Of a kernel with inputs, before a step: their values in `values`, the others of which do not count.
    Status set_inputs(const typename K::Parameters& values) { return set_watched_inputs(stepper, values); }

    real time() const { return stepper.time(); }
    const real* q() const { return stepper.q; }
    void momentum(real* p) const { stepper.momentum(p); }
    Status velocity(real* v) const {
        real p[n];
        stepper.momentum(p);
        return stepper.velocity(time(), q(), p, v);
    }
    Status energy(real* H) const {  // of a kernel that has it: K::has_energy
        real p[n];
        stepper.momentum(p);
        return stepper.energy(time(), q(), p, H);
    }
    // Of the last step, in the order of the motion: number (from 0: events, stops, impacts of the scene; files count
    // them from 1), t, q[n], p[n]; of an impact the state after it.
    std::int64_t events() const { return looks == nullptr ? 0 : looks->count; }
    const real* event(std::int64_t i) const { return looks->rows + i * columns; }

private:
    struct Looks {
        explicit Looks(const WatchedStepper<K>& stepper) : watch(stepper) {}
        Looks(const WatchedStepper<K>& stepper, const Looks& other) : watch(stepper), count(other.count) {
            for (std::int64_t i = 0; i < count * columns; ++i) rows[i] = other.rows[i];
        }
        Watch<K> watch;
        real rows[Watch<K>::most * columns];
        std::int64_t count = 0;
    };
    WatchedStepper<K> stepper{};
    Status started = Status::unsupported;
    Looks* looks = nullptr;
};

}  // namespace lobatto

#endif
