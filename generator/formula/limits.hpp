// SPDX-License-Identifier: GPL-2.0-or-later
// What a derivation may cost: GiNaC cannot be interrupted, so a derivation that takes too long or too much memory ends
// the program.
#pragma once

#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>

namespace lobatto {

// While it lives, the program ends with a message and exit code 3 (failed computation) once $LOBATTO_DERIVATION_SECONDS
// (600 without it) have passed since its construction, or the program holds more than $LOBATTO_DERIVATION_MEGABYTES
// (half of the machine's memory). Nothing may be half written meanwhile. InputError when a variable is no number above
// 0.
class DerivationLimits {
public:
    // For the message: the scene's file, and what is being done.
    explicit DerivationLimits(const std::string& scene, const std::string& task = "deriving the integrator");
    ~DerivationLimits();
    DerivationLimits(const DerivationLimits&) = delete;
    DerivationLimits& operator=(const DerivationLimits&) = delete;

private:
    void watch();

    std::string scene_, task_;
    double seconds_, megabytes_;
    std::mutex mutex_;
    std::condition_variable ended_;
    bool has_ended_ = false;
    std::thread watcher_;
};

}  // namespace lobatto
