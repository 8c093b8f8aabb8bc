// SPDX-License-Identifier: MIT
// Fair queueing on one device: of several threads none has begun more than one call more than another (a call is a few
// launches), whatever the device takes first. Else the last of them ends long after the others, and alone.
#pragma once

#include <algorithm>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <vector>

namespace lobatto {

class FairQueue {
public:
    // The calls of one thread, while it has some. A new one counts as many calls as the slowest of the others.
    class Flow {
    public:
        explicit Flow(FairQueue& queue) : queue_(queue) {
            const std::lock_guard lock(queue_.mutex_);
            calls_ = queue_.least();
            queue_.flows_.push_back(this);
        }
        ~Flow() {
            {
                const std::lock_guard lock(queue_.mutex_);
                std::erase(queue_.flows_, this);
            }
            queue_.news_.notify_all();
        }
        Flow(const Flow&) = delete;
        Flow& operator=(const Flow&) = delete;

        // Before a call: until the others have begun as many as this one.
        void wait() {
            {
                std::unique_lock lock(queue_.mutex_);
                queue_.news_.wait(lock, [&] { return calls_ <= queue_.least(); });
                ++calls_;
            }
            queue_.news_.notify_all();
        }

    private:
        friend class FairQueue;
        FairQueue& queue_;
        std::int64_t calls_ = 0;
    };

private:
    std::int64_t least() const {
        const auto first = std::min_element(flows_.begin(), flows_.end(),
                                            [](const Flow* a, const Flow* b) { return a->calls_ < b->calls_; });
        return first == flows_.end() ? 0 : (*first)->calls_;
    }

    std::mutex mutex_;
    std::condition_variable news_;
    std::vector<const Flow*> flows_;
};

}  // namespace lobatto
