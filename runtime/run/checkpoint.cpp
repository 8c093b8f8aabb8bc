// SPDX-License-Identifier: MIT
// The file: the SHA-256 of the rest and a line end, then an array in CBOR (RFC 8949).
#include "runtime/run/checkpoint.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "runtime/build/sha256.hpp"
#include "runtime/error.hpp"
#include "runtime/files/partial_file.hpp"
#include "runtime/files/private_file.hpp"

namespace lobatto {

namespace {

using Json = nlohmann::json;

constexpr std::size_t seal_bytes = 64 + 1;

Json packed(const TrajectoryResult& result) {
    return {result.steps_done,
            result.chain_steps,
            result.iterations,
            result.iterations_most,
            result.increment_largest,
            result.increment_failed,
            result.time,
            result.q,
            result.p,
            result.seconds,
            result.events,
            result.energy_start,
            result.energy_error_largest,
            result.energy_error_final};
}

TrajectoryResult unpacked(const Json& numbers) {
    TrajectoryResult result;
    std::size_t at = 0;
    const auto take = [&](auto& field) { numbers.at(at++).get_to(field); };
    take(result.steps_done);
    take(result.chain_steps);
    take(result.iterations);
    take(result.iterations_most);
    take(result.increment_largest);
    take(result.increment_failed);
    take(result.time);
    take(result.q);
    take(result.p);
    take(result.seconds);
    take(result.events);
    take(result.energy_start);
    take(result.energy_error_largest);
    take(result.energy_error_final);
    return result;
}

Json packed(const std::vector<Written>& files) {
    Json list = Json::array();
    for (const Written& file : files) list.push_back({file.size, file.checksum});
    return list;
}

std::vector<Written> files_of(const Json& list) {
    std::vector<Written> files;
    for (const Json& file : list) files.push_back({file.at(0).get<std::int64_t>(), file.at(1).get<std::uint64_t>()});
    return files;
}

[[noreturn]] void fail(const std::string& path, const std::string& reason) {
    throw MachineError(fmt::format("cannot continue from {}: {}. Run without --resume to start again", path, reason));
}

// Nothing when there is no such file.
std::optional<std::string> own_file(const std::string& path) {
    PrivateFile file = read_private_file(path, Writers::owner_and_own_group);
    if (file.error == ENOENT) return std::nullopt;
    if (file.error != 0) fail(path, std::strerror(file.error));
    if (!file.is_private) fail(path, "it is no file of yours that only you can write");
    if (!file.is_whole) fail(path, "it cannot be read as a whole");
    return std::move(file.content);
}

}  // namespace

void write_checkpoint(const std::string& path, const Checkpoint& checkpoint) {
    const std::string& memory = checkpoint.halfway.stepper;
    const Json whole = {checkpoint.run, packed(checkpoint.halfway.result),
                        Json::binary(std::vector<std::uint8_t>(memory.begin(), memory.end())), packed(checkpoint.files),
                        checkpoint.observers};
    std::string bytes;
    Json::to_cbor(whole, bytes);
    write_whole(path, "the checkpoint", sha256(bytes) + '\n' + bytes);
}

bool is_checkpoint(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    char seal[seal_bytes];
    return file.read(seal, sizeof seal) && seal[seal_bytes - 1] == '\n' &&
           std::all_of(seal, seal + seal_bytes - 1,
                       [](char c) { return std::isxdigit(static_cast<unsigned char>(c)); });
}

std::optional<Checkpoint> read_checkpoint(const std::string& path) {
    const std::optional<std::string> content = own_file(path);
    if (!content) return std::nullopt;
    const std::string bytes = content->size() < seal_bytes ? "" : content->substr(seal_bytes);
    if (content->substr(0, seal_bytes) != sha256(bytes) + '\n') fail(path, "it is damaged");
    try {
        const Json whole = Json::from_cbor(bytes);
        const auto& memory = whole.at(2).get_binary();
        return Checkpoint{whole.at(0).get<std::string>(),
                          {unpacked(whole.at(1)), std::string(memory.begin(), memory.end())},
                          files_of(whole.at(3)),
                          whole.at(4).get<std::map<std::string, std::vector<double>>>()};
    } catch (const Json::exception&) {
        fail(path, "it was written by another version of Lobatto");
    }
}

std::string difference(const std::string& checkpoint, const std::string& ours) {
    std::istringstream theirs(checkpoint), mine(ours);
    std::string there, here;
    while (true) {
        const bool more_there = static_cast<bool>(std::getline(theirs, there)),
                   more_here = static_cast<bool>(std::getline(mine, here));
        if (!more_there && !more_here) return "";
        if (!more_there) there.clear();
        if (!more_here) here.clear();
        if (there != here) return fmt::format("'{}' there, '{}' here", there, here);
    }
}

}  // namespace lobatto
