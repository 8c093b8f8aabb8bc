// SPDX-License-Identifier: GPL-2.0-or-later
// Prints a message on standard error if its scope lasts long.
#pragma once

#include <unistd.h>

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>

#include "cli/print/tell.hpp"

namespace lobatto {

class AfterAWhile {
public:
    // No text: no remark.
    explicit AfterAWhile(std::string text, std::chrono::milliseconds after = std::chrono::seconds(10)) {
        if (text.empty()) return;
        thread_ = std::thread([this, text = std::move(text), after] {
            std::unique_lock lock(mutex_);
            if (over_.wait_for(lock, after, [this] { return is_over_; })) return;
            tell("{}{}\n", isatty(STDERR_FILENO) == 1 ? "\r\033[K" : "", text);
        });
    }
    ~AfterAWhile() {
        {
            const std::lock_guard lock(mutex_);
            is_over_ = true;
        }
        over_.notify_one();
        if (thread_.joinable()) thread_.join();
    }
    AfterAWhile(const AfterAWhile&) = delete;
    AfterAWhile& operator=(const AfterAWhile&) = delete;

private:
    std::mutex mutex_;
    std::condition_variable over_;
    bool is_over_ = false;
    std::thread thread_;
};

}  // namespace lobatto
