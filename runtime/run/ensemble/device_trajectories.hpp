// SPDX-License-Identifier: MIT
// Trajectories of an ensemble whose steps are taken on a device, as many at a time as fill it
// (kernel/device_lanes.hpp).
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "runtime/build/device_library.hpp"
#include "runtime/run/ensemble/cuda.hpp"
#include "runtime/run/ensemble/side_by_side.hpp"

namespace lobatto {

// A kernel for a device.
struct DeviceKernel {
    static constexpr int block = 64;  // threads; LOBATTO_DEVICE_BLOCK of the text
    static constexpr const char* function_name = "lobatto_advance_lanes";

    DeviceLibrary host;
    std::shared_ptr<const CudaFunction> function;
};

// How many trajectories of a request stand on the device at a time, for each of `workers`.
std::int64_t device_room(const Kernel& kernel, const EnsembleRequest& request, std::int64_t workers);

class DeviceTrajectories : public Trajectories {
public:
    // `threads`: of the host, for what is done there.
    DeviceTrajectories(const Kernel& kernel, const EnsembleRequest& request, std::int64_t room, int threads);
    int width() const override { return static_cast<int>(room_); }
    void prepare(const std::vector<double>& parameters, const std::vector<double>& step, std::int32_t* status) override;
    void start(double time, const std::vector<double>& q, const std::vector<double>& p, std::int32_t* status) override;
    void advance(const EnsembleRequest& request, std::int64_t steps, std::int32_t* status, std::int64_t* steps_done,
                 std::int64_t* iterations) override;
    void state(std::vector<double>& q, std::vector<double>& p) override;
    void energy(const std::vector<double>& q, const std::vector<double>& p, std::vector<double>& energy) const override;

private:
    using Bytes = std::vector<std::byte>;
    // use(room of the host's side, first, last) in threads, each with `few` of `count` at least.
    template <class Use>
    void share(std::int64_t count, std::int64_t few, const Use& use);
    Bytes numbers(const std::vector<double>& values) const;
    void read_state(Bytes& q, Bytes& p);
    void upload(bool with_words);
    void launch();
    void retake(const std::vector<std::int64_t>& failed);
    std::size_t bytes_of_words(std::int64_t words) const { return static_cast<std::size_t>(8 * words * room_); }

    Kernel kernel_;
    std::shared_ptr<const DeviceKernel> device_;
    double tolerance_;
    std::int64_t room_;
    int threads_;
    CudaQueue queue_;
    std::vector<std::uint64_t> words_;  // here; those that move are up to date after read_state alone
    std::vector<std::int64_t> steps_, iterations_;
    std::vector<std::int32_t> status_;
    lobatto_device_call here_{}, there_{};  // the same, with addresses of the host and of the device
    Bytes parameters_, shared_, energy_;
    std::vector<Bytes> rooms_;  // of the host's side, one a thread
};

}  // namespace lobatto
