// SPDX-License-Identifier: MIT
// Trajectories of an ensemble whose steps are taken on a device, as many at a time as fill it
// (kernel/device_lanes.hpp).
#pragma once

#include <atomic>
#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "runtime/build/device_library.hpp"
#include "runtime/run/ensemble/cuda.hpp"
#include "runtime/run/ensemble/ended.hpp"
#include "runtime/run/ensemble/side_by_side.hpp"

namespace lobatto {

// A kernel for a device.
struct DeviceKernel {
    static constexpr int block = 64;  // threads; LOBATTO_DEVICE_BLOCK of the text
    static constexpr const char *name_of_lanes = "lobatto_advance_lanes", *name_of_alike = "lobatto_advance_alike",
                                *name_of_move = "lobatto_move_lanes";

    DeviceLibrary host;
    // Of any trajectories, and of those with the same parameters, whose common numbers need no registers.
    std::shared_ptr<const CudaFunction> lanes, alike;
    std::shared_ptr<const CudaFunction> move;  // lanes together, for the host, and back
};

// How a request is shared: so many workers, each with a queue of its own and room for so many trajectories at a time.
// While some begin and end theirs, the device takes the steps of others.
struct DeviceShares {
    std::int64_t workers = 1, room = 0;
    DeviceShares(const Kernel& kernel, const EnsembleRequest& request);
};

class DeviceTrajectories : public Trajectories {
public:
    // Of all lanes together: longer where the host has nothing to look for in between.
    static Chunk chunk_of(const DeviceKernel& kernel);
    // On the host.
    static double bytes_of_lane(const Kernel& kernel, const DeviceKernel& device);

    // `halted`: steps are wanted no longer.
    DeviceTrajectories(const Kernel& kernel, const EnsembleRequest& request, std::int64_t room,
                       const std::atomic<bool>& halted);
    int width() const override { return static_cast<int>(room_); }
    void prepare(const std::vector<double>& parameters, const std::vector<double>& step, std::int32_t* status) override;
    void start(double time, const std::vector<double>& q, const std::vector<double>& p, std::int32_t* status) override;
    void advance(const EnsembleRequest& request, std::int64_t steps, std::int32_t* status, std::int64_t* steps_done,
                 std::int64_t* iterations) override;
    void state(std::vector<double>& q, std::vector<double>& p) override;
    void energy(const std::vector<double>& q, const std::vector<double>& p, std::vector<double>& energy) const override;
    int stop(std::size_t lane) const override { return static_cast<int>(row_of(static_cast<std::int64_t>(lane))[0]); }
    double stop_time(std::size_t lane) const override { return row_of(static_cast<std::int64_t>(lane))[parts_]; }
    std::vector<double> reduced(std::size_t lane) const override;
    bool queues_fairly() const override { return !is_watched(); }
    bool is_cut_short() const override { return is_cut_short_; }

private:
    using Bytes = std::vector<std::byte>;
    Bytes numbers(const std::vector<double>& values) const;
    template <class Move>
    void move_own(std::int64_t first, std::int64_t last, const Move& move);
    void read(std::vector<double>& q, std::vector<double>& p);
    void upload_progress();
    void launch(std::int64_t begin);
    void retake(const std::vector<std::int32_t>& waiting);
    void retake(const std::int32_t* waiting, std::int64_t count);
    void move(std::int64_t count, bool back);
    bool is_watched() const { return device_->host->columns > 0; }
    const double* row_of(std::int64_t lane) const { return rows_.data() + lane * device_->host->columns * parts_; }
    std::size_t bytes_of_words(std::int64_t words) const { return static_cast<std::size_t>(8 * words * room_); }

    Kernel kernel_;
    std::shared_ptr<const DeviceKernel> device_;
    double tolerance_;
    std::int64_t room_;
    std::ptrdiff_t parts_;  // doubles of a number
    const std::atomic<bool>& halted_;
    bool is_cut_short_ = false;
    CudaQueue queue_;
    std::vector<std::uint64_t> words_;  // here; those that move are up to date after `state` alone
    Bytes progress_;                    // of each lane its steps, then iterations, then statuses
    std::span<std::int64_t> steps_, iterations_;
    std::span<std::int32_t> status_;
    lobatto_device_call here_{}, there_{};  // the same, with addresses of the host and of the device
    Bytes parameters_, energy_;
    AlignedMemory host_, shared_;       // of the host's side, and of what lanes share
    std::vector<std::uint8_t> is_own_;  // of each word; those that lanes share are not on the device
    void *there_order_, *there_packed_;
    std::int64_t batch_;                 // lanes that the host takes at a time,
    std::vector<std::uint64_t> packed_;  // their words
    std::vector<std::int32_t> order_;    // of the lanes of a launch
    bool arrives_ = true;                // all lanes are at the target
    std::vector<std::int32_t> ended_;    // in the last call, with their last rows:
    std::vector<double> rows_;
    std::vector<double> kept_;  // of each lane
};

}  // namespace lobatto
