// SPDX-License-Identifier: GPL-2.0-or-later
// Ranks of MPI.
#include <mpi.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <climits>
#include <list>
#include <thread>

#include "cli/ranks/ranks.hpp"
#include "runtime/error.hpp"
#include "runtime/run/ensemble/ensemble.hpp"

namespace lobatto {

namespace {

// Sleeping takes hardly any processor time; MPI's own wait is a busy loop.
constexpr std::chrono::microseconds shortest_moment{100}, longest_moment{10000};

class MpiRanks : public Ranks {
public:
    MpiRanks() {
        int provided = 0;
        MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &provided);
        MPI_Comm_rank(MPI_COMM_WORLD, &number_);
        MPI_Comm_size(MPI_COMM_WORLD, &count_);
        MPI_Comm here = MPI_COMM_NULL;
        MPI_Comm_split_type(MPI_COMM_WORLD, MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, &here);
        MPI_Comm_size(here, &on_machine_);
        MPI_Comm_free(&here);
    }
    ~MpiRanks() override {
        for (carry(); !on_its_way_.empty(); carry()) pause();
        MPI_Finalize();
    }
    MpiRanks(const MpiRanks&) = delete;
    MpiRanks& operator=(const MpiRanks&) = delete;

    int number() const override { return number_; }
    int count() const override { return count_; }

    // The processors that mpirun has bound this process to or, where it has not, its share of the machine.
    int threads() const override {
        const int all = static_cast<int>(::sysconf(_SC_NPROCESSORS_ONLN)), bound = thread_count(0);
        return bound < all ? bound : std::max(1, all / on_machine_);
    }

    void send(int to, std::string message) override {
        if (message.size() > INT_MAX)
            throw MachineError(
                "the rows of one trajectory are more than a message of MPI can hold; give a larger --every");
        Sent& sent = on_its_way_.emplace_back();
        sent.message = std::move(message);
        MPI_Isend(sent.message.data(), static_cast<int>(sent.message.size()), MPI_BYTE, to, 0, MPI_COMM_WORLD,
                  &sent.request);
    }

    void carry() override {
        on_its_way_.remove_if([](Sent& sent) {
            int has_arrived = 0;
            MPI_Test(&sent.request, &has_arrived, MPI_STATUS_IGNORE);
            return has_arrived != 0;
        });
    }

    std::optional<std::pair<int, std::string>> receive() override {
        carry();
        int is_there = 0;
        MPI_Status status;
        MPI_Iprobe(MPI_ANY_SOURCE, 0, MPI_COMM_WORLD, &is_there, &status);
        if (is_there == 0) return std::nullopt;
        moment_ = shortest_moment;
        int size = 0;
        MPI_Get_count(&status, MPI_BYTE, &size);
        std::string message(static_cast<std::size_t>(size), '\0');
        MPI_Recv(message.data(), size, MPI_BYTE, status.MPI_SOURCE, 0, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
        return std::pair(status.MPI_SOURCE, std::move(message));
    }

    void pause() override {
        std::this_thread::sleep_for(moment_);
        moment_ = std::min(2 * moment_, longest_moment);
    }

private:
    struct Sent {
        std::string message;
        MPI_Request request = MPI_REQUEST_NULL;
    };
    std::list<Sent> on_its_way_;  // where a message lies does not change
    std::chrono::microseconds moment_ = shortest_moment;
    int number_ = 0, count_ = 1, on_machine_ = 1;
};

}  // namespace

std::unique_ptr<Ranks> join_ranks() {
    auto ranks = std::make_unique<MpiRanks>();
    if (ranks->count() > 1) return ranks;
    return nullptr;
}

}  // namespace lobatto
