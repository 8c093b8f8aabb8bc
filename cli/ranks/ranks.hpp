// SPDX-License-Identifier: GPL-2.0-or-later
// Processes that compute one sweep together, on one machine or many; what they say to one another.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>

namespace lobatto {

// One of `count` processes that were started together, told apart by their numbers. Messages between two of them
// arrive in their order.
class Ranks {
public:
    virtual ~Ranks() = default;  // waits for the others
    virtual int number() const = 0;
    virtual int count() const = 0;
    virtual int threads() const = 0;                     // that this process may compute with: its share of the machine
    virtual void send(int to, std::string message) = 0;  // waits for nobody
    virtual void carry() = 0;                            // what was sent and is on its way goes on
    virtual std::optional<std::pair<int, std::string>> receive() = 0;  // from whom, and what; nothing: none is there
    virtual void pause() = 0;  // a moment, where nothing is there; a longer one each time until something is
};

// The others, where there are some. MachineError where this program was started by mpirun and cannot speak to them.
std::unique_ptr<Ranks> join_ranks();

}  // namespace lobatto
