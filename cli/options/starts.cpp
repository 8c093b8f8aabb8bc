// SPDX-License-Identifier: GPL-2.0-or-later
#include "cli/options/starts.hpp"

#include <fmt/format.h>

#include <charconv>

namespace lobatto {

void StartsOption::add_to(Command& command) {
    command
        .option("--vary", vary,
                "Values of an initial position, velocity or momentum, of a parameter, or of step, points, stages, "
                "splitting, tolerance: NAME=FROM:TO:COUNT, both ends included; NAME=FROM:TO:COUNT:log, in equal "
                "ratios; NAME=a,b,c. Repeated: all combinations")
        .shown_as("NAME=VALUES")
        .one_value_each();
    command.flag("--zip", zip, "The lists of --vary run together, the first with the first, not in all combinations");
    command
        .option("--starts", file,
                "File with a start in each row, .csv or .npy: columns by the names of --vary, q or q' or omega")
        .shown_as("FILE");
    command.option("--random", random, "Rows that are drawn, of each combination").shown_as("N");
    command.option("--seed", seed_given, "Seed of what is drawn: the same seed, the same rows, on every machine")
        .shown_as("N")
        .between(0, INT64_MAX);
    command
        .option("--draw", draw,
                "What is drawn: \"NAME ~ normal(MEAN, SD)\" or \"NAME ~ uniform(FROM, TO)\"; may be repeated")
        .shown_as("LAW")
        .one_value_each();
    command
        .option("--shard", shard,
                "Part of the sweep, such as 3/64: the third of 64 equal parts, by any process or machine; `lobatto "
                "merge` makes one table of them")
        .shown_as("K/N");
}

StartsRequest StartsOption::request() const {
    if (vary.empty() && file.empty() && !random)
        throw InputError(
            "nothing is varied: give --vary NAME=FROM:TO:COUNT, --starts FILE, or --random COUNT with --draw");
    if (seed_given != 0 && !random)
        throw InputError(
            "--seed: nothing is drawn; say what and how much, such as --random 1000 --draw \"q ~ normal(0, 0.1)\"");
    StartsRequest request = *this;
    request.seed = static_cast<std::uint64_t>(seed_given);
    return request;
}

std::pair<std::int64_t, std::int64_t> shard_of(const std::string& text) {
    if (text.empty()) return {1, 1};
    std::int64_t number = 0, of = 0;
    const char* const end = text.data() + text.size();
    const auto first = std::from_chars(text.data(), end, number);
    const bool has_slash = first.ec == std::errc() && first.ptr != end && *first.ptr == '/';
    const auto second = has_slash ? std::from_chars(first.ptr + 1, end, of) : first;
    if (!has_slash || second.ec != std::errc() || second.ptr != end || number < 1 || number > of || of > 1'000'000)
        throw InputError(fmt::format(
            "--shard: '{}' is no part of a sweep; 3/64 is the third of 64, counted from 1, of a million at most",
            text));
    return {number, of};
}

}  // namespace lobatto
