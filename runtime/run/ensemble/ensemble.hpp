// SPDX-License-Identifier: MIT
// Many trajectories of one kernel: side by side in its lanes, shared by threads, handed over in their order. This is
// the work of the host. The lanes themselves are in the kernel library (runtime/kernel/steppers/ensemble.hpp), which
// analysis/kernel/kernel_of.cpp compiled for them.
//
// What a trajectory becomes depends on nothing but its own start: not on the number of threads, not on the others of
// the ensemble. So everything here is bit-identical for any number of threads. Where a kernel has no lanes, a
// trajectory is bit-identical to that of `integrate` too.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "runtime/build/library.hpp"
#include "runtime/kernel/abi.h"
#include "runtime/run/trajectory.hpp"

namespace lobatto {

struct DeviceKernel;  // runtime/run/ensemble/device_trajectories.hpp

// Where a trajectory begins.
struct EnsembleStart {
    std::vector<double> parameters;  // scene order
    std::vector<double> q;           // n
    std::vector<double> rate;        // n: momenta, or velocities when the request says so
    // With all digits of the kernel's numbers, as sums of `parts` doubles (NumberStepper); empty: those above are
    // exact.
    std::vector<double> whole_parameters = {}, whole_q = {}, whole_rate = {};
};

// A trajectory that has ended: at the end of the time, or where it failed, which stops it alone.
struct EnsembleTrajectory {
    std::int64_t index = 0;
    lobatto_status status = LOBATTO_OK;
    std::int64_t steps_done = 0;
    std::int64_t iterations = 0;
    // Kept states, at least one. The last is the last good one; its status is that of the trajectory. Those before it
    // are the start and each `every`-th state. A start that is impossible is kept too.
    Records kept;
    double energy_start = 0;                     // not a number when there is none, and the errors with it
    double energy_error_final = 0;               // H - H(0)
    double energy_error_largest = 0;             // max over the kept states |H - H(0)|
    const double* whole_energy_start = nullptr;  // where numbers have parts
    int stop = -1;               // of a trajectory that a stop ended: the number of the event; its last state is
                                 // that of the stop
    bool has_near_cuts = false;  // of walls and switches (NearCuts)
    const std::vector<double>* reduced = nullptr;  // what its reducer made of it

    double energy_error(std::int64_t row) const;  // H - H(0) of a kept state; not a number when there is none
};

// Makes a few numbers of one trajectory after another, each from its first state to its last.
class Reducer {
public:
    virtual ~Reducer() = default;
    virtual void begin(const LoadedStepper<double>& stepper, const EnsembleStart& start) = 0;
    virtual void observe(const double* rows, std::int64_t count) = 0;         // t, q, p of every step
    virtual void observe_events(const double* rows, std::int64_t count) = 0;  // event number, t, q, p
    virtual std::vector<double> values() const = 0;
};

struct EnsembleRequest {
    std::int64_t first = 0;  // number of the first trajectory
    std::int64_t count = 0;  // trajectories from there on
    // Fills the start of a trajectory; called once for each, in any order, from several threads at once.
    std::function<void(std::int64_t index, EnsembleStart& start)> start;
    bool from_velocities = false;  // momenta are computed with the parameters of each trajectory
    double time = 0;
    double step = 0;                                        // h; may be negative
    std::vector<double> whole_step;                         // as of EnsembleStart
    double tolerance = 0;                                   // of a step's iteration; 0: to rounding
    std::int64_t steps = 0;                                 // >= 0, of each trajectory; count * steps < 2^63
    Arrivals arrivals;                                      // of kernels with a clock
    std::int64_t every = 0;                                 // keep every such state; 0: the last one alone
    bool stops = false;                                     // the kernel's stops end trajectories
    std::function<std::unique_ptr<Reducer>()> reducer;      // one a thread or lane; nothing: none
    std::shared_ptr<const DeviceKernel> device;             // takes the steps; nothing: the processor. Without clock;
                                                            // reduces as it was compiled to, if there is a reducer
    int threads = 0;                                        // that compute; 0: as many as the machine runs at once
    std::function<void(const EnsembleTrajectory&)> sink;    // in the order of the indices, in the thread of the caller
    std::function<void(std::int64_t steps_done)> progress;  // of all trajectories; about ten times a second, likewise
    const volatile int* interrupted = nullptr;              // stop once it is not zero; what is complete is handed over
};

struct EnsembleResult {
    bool interrupted = false;
    std::int64_t trajectories = 0;                          // handed over: all, unless interrupted
    std::array<std::int64_t, LOBATTO_STATUSES> count_of{};  // of each lobatto_status
    std::int64_t steps_done = 0;                            // of all trajectories
    std::int64_t iterations = 0;
    int threads = 0, lanes = 0;    // that computed; lanes 1: one trajectory at a time
    double processor_seconds = 0;  // advancing and keeping states, of all threads together
    double seconds = 0;            // that passed meanwhile
};

// How many threads compute where `threads` are asked for; 0: as many as the machine runs at once.
int thread_count(int threads);

// The most bytes of kept states in memory at any time, with the host's side of a device.
double memory_of(const Kernel& kernel, const EnsembleRequest& request);

// Rethrows what `start` and `sink` throw; MachineError when no threads can be had.
EnsembleResult integrate(const Kernel& kernel, const EnsembleRequest& request);

}  // namespace lobatto
