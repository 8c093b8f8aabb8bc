// SPDX-License-Identifier: MIT
// Several threads that launch steps on one device: none gets ahead of another by more than a launch, whatever the
// device takes first. Else the last of them ends long after the others, and alone.
#pragma once

#include <algorithm>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <vector>

namespace lobatto {

class Turns {
public:
    // Of a thread, while it has steps to launch; one that comes later is no further than the last of those before it.
    class Turn {
    public:
        explicit Turn(Turns& turns) : turns_(turns) {
            const std::lock_guard lock(turns_.mutex_);
            launches_ = turns_.least();
            turns_.all_.push_back(this);
        }
        ~Turn() {
            {
                const std::lock_guard lock(turns_.mutex_);
                std::erase(turns_.all_, this);
            }
            turns_.news_.notify_all();
        }
        Turn(const Turn&) = delete;
        Turn& operator=(const Turn&) = delete;

        // Until the others have begun as many launches as this one.
        void wait() {
            {
                std::unique_lock lock(turns_.mutex_);
                turns_.news_.wait(lock, [&] { return launches_ <= turns_.least(); });
                ++launches_;
            }
            turns_.news_.notify_all();
        }

    private:
        friend class Turns;
        Turns& turns_;
        std::int64_t launches_ = 0;
    };

private:
    std::int64_t least() const {
        const auto first = std::min_element(all_.begin(), all_.end(),
                                            [](const Turn* a, const Turn* b) { return a->launches_ < b->launches_; });
        return first == all_.end() ? 0 : (*first)->launches_;
    }

    std::mutex mutex_;
    std::condition_variable news_;
    std::vector<const Turn*> all_;
};

}  // namespace lobatto
