// SPDX-License-Identifier: GPL-2.0-or-later
// Threads that share a device: none gets ahead, none waits for one that has left.
#include "runtime/run/ensemble/fair_queue.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <optional>
#include <thread>
#include <vector>

using lobatto::FairQueue;

TEST_CASE("no thread begins more than one call more than another, however fast it is") {
    constexpr int threads = 4, calls = 200;
    FairQueue queue;
    std::array<std::atomic<int>, threads> begun{};
    std::atomic<int> ready{0}, largest_lead{0};
    {
        std::vector<std::jthread> all;
        for (int t = 0; t < threads; ++t)
            all.emplace_back([&, t] {
                FairQueue::Flow flow(queue);
                ++ready;
                while (ready < threads) std::this_thread::yield();
                for (int call = 1; call <= calls; ++call) {
                    flow.wait();
                    int least = calls;
                    for (const auto& other : begun) least = std::min(least, other.load());
                    begun[static_cast<std::size_t>(t)] = call;
                    for (int seen = largest_lead;
                         call - least > seen && !largest_lead.compare_exchange_weak(seen, call - least);) {
                    }
                    if (t == 0) std::this_thread::sleep_for(std::chrono::microseconds(200));
                }
            });
    }
    // One more than the queue's, whose count is ahead of `begun` for a moment.
    CHECK(largest_lead <= 2);
    CHECK(largest_lead >= 1);
}

TEST_CASE("a thread that comes late or leaves holds nobody up") {
    FairQueue queue;
    std::optional<FairQueue::Flow> first(std::in_place, queue);
    for (int call = 0; call < 10; ++call) first->wait();  // alone it never waits
    std::optional<FairQueue::Flow> late(std::in_place, queue);
    first->wait();  // both have begun ten
    std::atomic<bool> goes_on{false};
    std::jthread waiting([&] {
        first->wait();
        goes_on = true;
    });
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    CHECK_FALSE(goes_on);  // the late one has begun ten still
    late.reset();
    waiting.join();
    CHECK(goes_on);
}
