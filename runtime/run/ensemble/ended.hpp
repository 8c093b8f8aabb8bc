// SPDX-License-Identifier: MIT
// A trajectory of an ensemble on its way and when it has ended, and what its thread shares with the others.
#pragma once

#include <atomic>
#include <cstdint>
#include <limits>
#include <mutex>
#include <vector>

#include "runtime/kernel/abi.h"
#include "runtime/run/ensemble/ensemble.hpp"
#include "runtime/run/ensemble/fair_queue.hpp"

namespace lobatto {

inline constexpr double no_number = std::numeric_limits<double>::quiet_NaN();

// With what it has kept.
struct Ended {
    lobatto_status status = LOBATTO_OK;
    std::int64_t steps_done = 0, iterations = 0;
    std::vector<double> rows, energies;
    std::int64_t row_step = 0;  // steps before the last row
    int stop = -1;              // of a trajectory that a stop ended: which
    bool has_near_cuts = false;
    std::vector<double> reduced;
    double energy_error_largest = 0;
    // Where numbers have several parts: rows and energies with all of them. The energy at the start always.
    std::vector<double> whole_rows, whole_energies, energy_start;

    bool goes_on() const { return status == LOBATTO_OK && stop < 0; }
    // A state with its energy; q and p have n numbers of so many parts.
    void keep(const EnsembleRequest& request, double time, const double* q, const double* p, std::size_t n,
              const double* energy, std::size_t parts = 1);
};

// The most rows that a trajectory keeps.
std::int64_t rows_kept(const EnsembleRequest& request);

struct EndedTogether {
    std::vector<Ended> trajectories;  // fewer than there should be when interrupted
    double processor_seconds = 0;
};

// How many steps go between two looks at the interruption.
class Chunk {
public:
    static constexpr double usual = 0.02, longest = 1;
    // At least `least` steps, unless these take a second.
    explicit Chunk(double seconds = usual, std::int64_t least = 1) : wanted_(seconds), least_(least) {}
    std::int64_t steps() const { return steps_; }
    void took(std::int64_t steps, double seconds);

private:
    double wanted_;
    std::int64_t least_, steps_ = 256;
};

// What all threads see.
struct Shared {
    explicit Shared(const Chunk& of_device) : chunk(of_device) {}
    std::atomic<std::int64_t> steps_gone{0};
    std::atomic<bool> halted{false};
    FairQueue queue;  // of calls on a device

    // Where all wait for one device they take the same number of steps at a time: else those that wait longer would
    // take fewer, and end last.
    std::int64_t steps_of_chunk() {
        const std::lock_guard lock(mutex);
        return chunk.steps();
    }
    void took(std::int64_t steps, double seconds) {
        const std::lock_guard lock(mutex);
        chunk.took(steps, seconds);
    }

private:
    std::mutex mutex;
    Chunk chunk;
};

}  // namespace lobatto
