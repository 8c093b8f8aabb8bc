// SPDX-License-Identifier: GPL-2.0-or-later
// Ctrl-C as a flag, so that what was computed is kept.
#pragma once

#include <csignal>
#include <cstddef>

namespace lobatto {

constexpr int interrupted_exit = 130;  // as shells count an interruption

// While it lives, the first SIGINT or SIGTERM only raises a flag; a second one ends the process.
class Interruption {
public:
    Interruption() {
        raised_ = 0;
        struct sigaction action {};
        action.sa_handler = [](int) { raised_ = 1; };
        action.sa_flags = SA_RESETHAND;
        for (std::size_t i = 0; i < 2; ++i) {
            sigaction(signals[i], nullptr, &before_[i]);
            if (before_[i].sa_handler != SIG_IGN) sigaction(signals[i], &action, nullptr);
        }
    }
    ~Interruption() {
        for (std::size_t i = 0; i < 2; ++i) sigaction(signals[i], &before_[i], nullptr);
    }
    Interruption(const Interruption&) = delete;
    Interruption& operator=(const Interruption&) = delete;
    static const volatile int* flag() { return &raised_; }

private:
    static constexpr int signals[2] = {SIGINT, SIGTERM};
    static inline volatile std::sig_atomic_t raised_ = 0;
    struct sigaction before_[2]{};
};

}  // namespace lobatto
