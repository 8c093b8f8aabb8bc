// SPDX-License-Identifier: GPL-2.0-or-later
// Messages: a letter, then bytes. To others: B begin, W a range to compute, E end. To the first: R a block, X an error,
// D what judges warn of, the last one.
#include "cli/ranks/crew.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <map>
#include <sstream>
#include <string>
#include <type_traits>

#include "library/errors.hpp"
#include "runtime/error.hpp"
#include "runtime/stopwatch.hpp"

namespace lobatto {

namespace {

constexpr double range_seconds = 1;           // that a range should take
constexpr std::int64_t first_range = 64;      // trajectories
constexpr std::int64_t most_cells = 1 << 17;  // of the rows of a range
constexpr int ahead = 2;                      // ranges that a process has at a time, so that it never waits
constexpr int between_carrying = 256;         // trajectories
constexpr int window = 8;                     // ranges for each process that may wait for an earlier one

template <class T>
void pack(std::string& message, const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    message.append(reinterpret_cast<const char*>(&value), sizeof value);
}

template <class T>
void pack_all(std::string& message, const std::vector<T>& values) {
    pack(message, values.size());
    message.append(reinterpret_cast<const char*>(values.data()), sizeof(T) * values.size());
}

class Unpacker {
public:
    explicit Unpacker(const std::string& message) : message_(message) {}
    template <class T>
    T take() {
        T value{};
        copy(&value, sizeof value);
        return value;
    }
    template <class T>
    std::vector<T> take_all() {
        std::vector<T> values(take<std::size_t>());
        copy(values.data(), sizeof(T) * values.size());
        return values;
    }

private:
    void copy(void* to, std::size_t bytes) {
        if (message_.size() - at_ < bytes) throw MachineError("a message of another process came in parts");
        if (bytes > 0) std::memcpy(to, message_.data() + at_, bytes);
        at_ += bytes;
    }
    const std::string& message_;
    std::size_t at_ = 1;  // after its letter
};

std::string packed(const SweepBlock& block) {
    std::string message = "R";
    message.reserve(200 + sizeof(SweepFigures) * block.figures.size() + sizeof(double) * block.states.size() +
                    sizeof(TableCell) * block.cells.size());
    pack(message, block.first);
    pack(message, block.last);
    pack(message, block.times);
    pack_all(message, block.figures);
    pack_all(message, block.states);
    pack_all(message, block.cells);
    return message;
}

SweepBlock unpacked(const std::string& message) {
    Unpacker from(message);
    SweepBlock block;
    block.first = from.take<std::int64_t>();
    block.last = from.take<std::int64_t>();
    block.times = from.take<StudyTimes>();
    block.figures = from.take_all<SweepFigures>();
    block.states = from.take_all<double>();
    block.cells = from.take_all<TableCell>();
    return block;
}

// What another process threw: its exit code as a digit, then the text.
[[noreturn]] void rethrow_of(int rank, const std::string& message) {
    const std::string text = fmt::format("process {}: {}", rank, message.substr(2));
    const int exit_code = message[1] - '0';
    if (exit_code == api::InputError("").exit_code()) throw api::InputError(text);
    throw api::Error(text, exit_code);
}

std::pair<int, std::string> next_message(Ranks& ranks) {
    while (true) {
        if (auto message = ranks.receive()) return *std::move(message);
        ranks.pause();
    }
}

// Who has how much to do, and what waits for its turn.
struct Handing {
    std::int64_t next;                        // trajectory to hand out
    std::int64_t due;                         // trajectory whose block is to be taken next
    std::int64_t size = first_range;          // of ranges
    std::vector<int> has;                     // ranges, by process
    std::map<std::int64_t, SweepBlock> wait;  // by their first trajectory
};

}  // namespace

void SweepBlock::clear() {
    figures.clear();
    states.clear();
    cells.clear();
}

void SweepBlock::add(const SweepStudy& study, const EnsembleTrajectory& trajectory, const Verdict& verdict,
                     const EnsembleRequest& request) {
    const std::size_t n = study.rows().coordinates(), place = states.size();
    states.resize(place + 2 * n);
    figures.push_back(study.rows().append(cells, trajectory, request.every, verdict, states.data() + place));
}

CrewLeader::CrewLeader(Ranks& ranks) : ranks_(ranks) {}

CrewLeader::~CrewLeader() {
    try {
        if (!has_ended_) end();
    } catch (const std::exception&) {  // one error is told already
    }
}

void CrewLeader::tell_all(const std::string& message) {
    for (int rank = 1; rank < ranks_.count(); ++rank) ranks_.send(rank, message);
}

StudyTimes CrewLeader::compute(std::int64_t first, std::int64_t last,
                               const std::function<void(const SweepBlock&)>& take,
                               const std::function<void()>& meanwhile, const volatile int* interrupted,
                               double cells_each) {
    const Stopwatch watch;
    const int workers = ranks_.count() - 1;
    const auto fitting =
        std::max<std::int64_t>(1, static_cast<std::int64_t>(static_cast<double>(most_cells) / cells_each));
    Handing handing{
        first, first, std::min(first_range, fitting), std::vector<int>(static_cast<std::size_t>(ranks_.count())), {}};
    StudyTimes all;
    tell_all("B");
    const auto hand_out = [&] {
        for (int round = 0; round < ahead; ++round)
            for (int rank = 1; rank <= workers; ++rank) {
                int& has = handing.has[static_cast<std::size_t>(rank)];
                // At the end ranges get shorter, so that all processes end at about the same time.
                const std::int64_t share = (last - handing.next) / (2 * workers);
                const std::int64_t size = std::max(std::min(handing.size, share), std::min(first_range, handing.size));
                if (has > round || handing.next >= last || handing.next - handing.due > window * workers * size)
                    continue;
                std::string message = "W";
                pack(message, handing.next);
                handing.next = std::min(last, handing.next + size);
                pack(message, handing.next);
                ranks_.send(rank, message);
                ++has;
            }
    };
    while (handing.due < last && !all.interrupted) {
        hand_out();
        meanwhile();
        if (interrupted != nullptr && *interrupted != 0) all.interrupted = true;
        const auto message = ranks_.receive();
        if (!message) {
            ranks_.pause();
            continue;
        }
        const auto& [rank, text] = *message;
        if (text[0] == 'X') rethrow_of(rank, text);
        SweepBlock block = unpacked(text);
        --handing.has[static_cast<std::size_t>(rank)];
        const std::int64_t count = std::ssize(block.figures);
        if (count > 0) {
            const double pace = range_seconds / std::max(block.times.seconds, range_seconds / 64);
            const double cells =
                static_cast<double>(std::max<std::size_t>(block.cells.size(), 1)) / static_cast<double>(count);
            const double wanted = std::min({static_cast<double>(count) * pace, 4.0 * static_cast<double>(handing.size),
                                            static_cast<double>(most_cells) / cells});
            handing.size = std::max<std::int64_t>(1, static_cast<std::int64_t>(wanted));
        }
        handing.wait.emplace(block.first, std::move(block));
        for (auto ready = handing.wait.find(handing.due); ready != handing.wait.end();
             ready = handing.wait.find(handing.due)) {
            const SweepBlock& next = ready->second;
            take(next);
            all.add(next.times);
            if (std::ssize(next.figures) < next.last - next.first) all.interrupted = true;
            handing.due = next.last;
            handing.wait.erase(ready);
            if (all.interrupted) break;
        }
    }
    all.threads *= workers;
    all.seconds = watch.seconds();
    return all;
}

// Receives all that is still on its way: a process whose message is not received does not end.
std::vector<std::string> CrewLeader::end() {
    has_ended_ = true;
    tell_all("E");
    std::vector<std::string> warnings;
    std::pair<int, std::string> error;
    for (int left = ranks_.count() - 1; left > 0;) {
        const auto message = next_message(ranks_);
        if (message.second[0] == 'X') error = message;
        if (message.second[0] != 'D') continue;
        --left;
        std::istringstream lines(message.second.substr(1));
        for (std::string warning; std::getline(lines, warning);) warnings.push_back(warning);
    }
    if (!error.second.empty()) rethrow_of(error.first, error.second);
    std::sort(warnings.begin(), warnings.end());
    warnings.erase(std::unique(warnings.begin(), warnings.end()), warnings.end());
    return warnings;
}

void work_in_crew(Ranks& ranks, const std::function<api::OpenedSweep()>& begin) {
    const auto work = [&] {
        api::OpenedSweep study;
        SweepBlock block;
        while (true) {
            const std::string message = next_message(ranks).second;
            if (message[0] == 'B') {
                study = begin();
            } else if (message[0] == 'W') {
                Unpacker from(message);
                block.clear();
                block.first = from.take<std::int64_t>();
                block.last = from.take<std::int64_t>();
                block.times = study->compute(
                    block.first, block.last,
                    [&](const EnsembleTrajectory& trajectory, const Verdict& verdict, const EnsembleRequest& request) {
                        block.add(*study, trajectory, verdict, request);
                        if (trajectory.index % between_carrying == 0) ranks.carry();
                    },
                    {}, nullptr);
                ranks.send(0, packed(block));
            } else {
                std::string warnings = "D";
                if (study)
                    for (const std::string& warning : study->end()) warnings += warning + "\n";
                ranks.send(0, warnings);
                return;
            }
        }
    };
    try {
        api::guarded(work);
    } catch (const api::Error& error) {
        ranks.send(0, fmt::format("X{}{}", error.exit_code(), error.what()));
        while (next_message(ranks).second[0] != 'E') continue;
        ranks.send(0, "D");
    }
}

}  // namespace lobatto
