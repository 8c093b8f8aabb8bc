// SPDX-License-Identifier: GPL-2.0-or-later
// The kernels of the family for one scene, compiled on all processors while others are measured.
#pragma once

#include <atomic>
#include <condition_variable>
#include <deque>
#include <exception>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <thread>
#include <vector>

#include "analysis/tradeoff/candidate.hpp"
#include "generator/mechanics/derivation.hpp"
#include "runtime/build/compile.hpp"
#include "runtime/build/library.hpp"

namespace lobatto {

// For one thread; the compilers have their own.
class KernelBuilder {
public:
    // The kernels that serve a scene, and the same scene with other values of parameters. `tries_clocks`: with clocks
    // that it does not have, and without the one it has.
    KernelBuilder(const Scene& written, const Scene& with_values, bool tries_clocks);
    ~KernelBuilder();  // ends the compilers at work
    KernelBuilder(const KernelBuilder&) = delete;
    KernelBuilder& operator=(const KernelBuilder&) = delete;

    const Derivation& derivation(StepClock clock = StepClock::none) const { return derivations_.at(clock); }
    // Whether the search may take this member for the scene. A reference may take it with equal steps even if not.
    bool allows(const Member& member) const;
    std::vector<StepClock> clocks() const;  // all that are allowed, without StepClock::none
    void forget(StepClock clock) { allowed_.erase(clock); }
    unsigned threads() const { return static_cast<unsigned>(workers_.size()); }

    // Writes the kernel and hands it to a compiler, unless that has been done.
    void order(const Member& member);
    bool is_ordered(const Member& member) const { return items_.count(member) != 0; }
    bool is_ready(const Member& member) const;  // ordered, and compiled or found in the cache, or failed
    // Orders it if need be, and waits for it. Throws what compiling threw.
    Kernel kernel(const Member& member);
    double compile_seconds(const Member& member) const;  // of one that is ready; 0: found in the cache
    const std::string& digest(const Member& member) const { return items_.at(member).digest; }
    void cancel();  // what no compiler has begun is not compiled

private:
    struct Item {
        std::string digest;
        Translation translation;
        std::optional<Compiled> compiled;
        std::optional<Kernel> kernel;
        std::exception_ptr failure;
        bool ready = false, cancelled = false;
    };
    void work();

    std::map<StepClock, Derivation> derivations_;
    std::set<StepClock> allowed_;
    std::map<Member, Item> items_;
    std::deque<Item*> queue_;
    mutable std::mutex mutex_;
    std::condition_variable ordered_, finished_;
    bool closing_ = false;
    std::atomic<bool> abandoned_ = false;
    std::vector<std::thread> workers_;
};

}  // namespace lobatto
