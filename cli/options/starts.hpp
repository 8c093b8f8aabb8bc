// SPDX-License-Identifier: GPL-2.0-or-later
// --vary, --zip, --starts, --random, --seed, --draw: what the trajectories of a sweep begin with. --shard: which of
// them.
#pragma once

#include <cstdint>
#include <string>

#include "analysis/sweep/starts.hpp"
#include "cli/options/command_line.hpp"

namespace lobatto {

struct StartsOption : StartsRequest {
    std::int64_t seed_given = 0;
    std::string shard;  // "3/64"; empty: all

    void add_to(Command& command);
    StartsRequest request() const;  // InputError where nothing varies
};

// "3/64" as {3, 64}; InputError for anything else, and for an empty text {1, 1}.
std::pair<std::int64_t, std::int64_t> shard_of(const std::string& text);

}  // namespace lobatto
