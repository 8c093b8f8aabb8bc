// SPDX-License-Identifier: MIT
// Drives one trajectory: blocks of steps inside the kernel, records to a sink, progress, interruption, diagnosis of a
// stop.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "runtime/build/number_stepper.hpp"
#include "runtime/kernel/abi.h"

namespace lobatto {

// Kept states: rows of t, q[n], p[n], row-major as the kernel writes them, and the energy of each. Of kernels in other
// numbers than double these are rounded; `whole` and `whole_energy` have all digits, as sums of `parts` doubles.
struct Records {
    const double* rows = nullptr;    // count x columns
    const double* energy = nullptr;  // count: H(t, q, p); null when the kernel has no energy
    std::int64_t count = 0;
    int columns = 0;                 // 1 + 2n
    const double* beside = nullptr;  // count x columns_beside() of the request x parts; null where there are none
    const double* whole = nullptr;   // count x columns x parts; null: `rows` has all digits
    const double* whole_energy = nullptr;
    int parts = 1;
    bool is_stop = false;  // the one row is where a stop ended the run, between two steps
};

// Where event functions vanished: rows of event number, t, q[n], p[n], in the order of the motion.
struct EventRecords {
    const double* rows = nullptr;  // count x columns
    std::int64_t count = 0;
    int columns = 0;                // 2 + 2n
    const double* whole = nullptr;  // as of Records
    int parts = 1;
};

struct TrajectoryResult {
    lobatto_status status = LOBATTO_OK;
    bool started = false;  // parameters, step and start were accepted
    bool interrupted = false;
    std::int64_t steps_done = 0;
    std::int64_t chain_steps = 0;  // of kernels with a clock: steps in its time; steps_done counts arrivals
    std::int64_t iterations = 0;
    std::int32_t iterations_most = 0;
    double increment_largest = 0;
    double increment_failed = 0;
    double time = 0;                  // of the last good state
    std::vector<double> q, p;         // the last good state
    double seconds = 0;               // of processor time inside the kernel
    std::int64_t events = 0;          // found
    int stop = -1;                    // the number of the event that ended the run; -1: it went to its end
    double energy_start = 0;          // not a number when the kernel has no energy, and the errors with it
    double energy_error_largest = 0;  // max over the kept states at steps |H - H(0)|, absolute; H in double, so about
                                      // |H| 2^-53 of it is rounding
    double energy_error_final = 0;    // H - H(0) at the last good state
};

// Of kernels with a clock: the steps of a request are arrivals at the times start + interval, start + 2 interval, ...,
// none beyond `end`. Between them the kernel takes steps of its own, equally long in the time of the clock.
struct Arrivals {
    double interval = 0, end = 0;
    bool keeps_chain = false;  // the states at those steps are kept too
};

// Where a run stood between two steps: what it had found, and all that its stepper knew.
struct Halfway {
    TrajectoryResult result;
    std::string stepper;  // LoadedStepper::memory
};

struct TrajectoryRequest {
    std::vector<double> parameters;  // scene order
    std::vector<double> q, p;        // n each
    double time = 0;
    double step = 0;         // h; may be negative
    double tolerance = 0;    // of a step's iteration, relative; 0: to rounding
    std::int64_t steps = 0;  // >= 0
    Arrivals arrivals;       // of kernels with a clock
    std::int64_t every = 1;  // keep every such state; the first and the last state are always kept
    int multipliers = 0;     // beside each kept state: as many as there are constraints, or none
    // Values of formulas, beside each kept state and after the multipliers; vectors as those of NumberStepper.
    struct Formulas {
        using Parts = std::vector<double>;
        std::size_t count = 0;
        std::function<void(const Parts& time, const Parts& q, const Parts& velocity, Parts& values)> evaluate;
    } formulas;
    std::size_t columns_beside() const { return static_cast<std::size_t>(multipliers) + formulas.count; }
    // Parameters, step and start with all digits of the kernel's numbers, as sums of `parts` doubles (NumberStepper);
    // empty: the doubles above are exact.
    std::vector<double> whole_parameters, whole_step, whole_q, whole_p;
    int dense = 0;  // states between two steps, on the step's polynomial; above 0 needs every = 1
    std::function<void(const Records&)> sink;         // called for each block, in order
    std::function<void(const EventRecords&)> events;  // likewise; nothing: events are not sought
    std::function<void(std::int64_t done)> progress;  // called about ten times a second
    const volatile int* interrupted = nullptr;        // stop between blocks once it is not zero
    // Called about ten times a second, less often where it takes longer than a fiftieth of the time, and when the run
    // is interrupted; all that came before has gone to the sinks. Going on from there gives the bits of a run that was
    // never stopped.
    std::function<void(const Halfway&)> checkpoint;
    const Halfway* from = nullptr;  // where to go on; of a run with this request and this kernel's object
};

// The time after so many steps of a request, TrajectoryRequest or EnsembleRequest.
template <class Request>
double time_after(const Request& request, std::int64_t steps) {
    const Arrivals& arrivals = request.arrivals;
    if (arrivals.interval == 0) return request.time + static_cast<double>(steps) * request.step;
    const double time = request.time + static_cast<double>(steps) * arrivals.interval;
    return (time - arrivals.end) * arrivals.interval > 0 ? arrivals.end : time;
}

TrajectoryResult integrate(const Kernel& kernel, const TrajectoryRequest& request);

// (1.25, -3); of long lists the beginning and the number.
std::string list_text(const std::vector<double>& values);

// Of a run that stopped in a step: the longest step h/2, h/4 ... that takes the motion through the same time, and to
// the same place as half of it; 0: there is none down to h/2^14, or the run stopped for another reason.
double passing_step(const Kernel& kernel, const TrajectoryRequest& request, const TrajectoryResult& result);

// What to tell a person when a run stopped: step, time, state, residual, why, and what to try. One paragraph.
// `passing`: passing_step, where it was looked for; `more`: further advice.
std::string explain_stop(const TrajectoryResult& result, const TrajectoryRequest& request, double passing = 0,
                         const std::string& more = "");

}  // namespace lobatto
