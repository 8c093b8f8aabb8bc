// SPDX-License-Identifier: MIT
#include "runtime/run/ensemble/device_trajectories.hpp"

#include <algorithm>
#include <cstring>
#include <memory>
#include <thread>

#include "runtime/run/ensemble/ended.hpp"

namespace lobatto {

namespace {

constexpr std::int64_t most_lanes = 65536;   // fill a device of 132 multiprocessors with 15 warps each
constexpr std::int64_t most_kept = 1 << 24;  // numbers of kept states
constexpr std::int64_t few_lanes = 256;      // for so few no thread is worth its start

// Memory may begin anywhere.
void* aligned(std::vector<std::byte>& room, std::int32_t bytes, std::int32_t alignment) {
    if (room.empty()) room.resize(static_cast<std::size_t>(bytes + alignment));
    void* place = room.data();
    std::size_t space = room.size();
    return std::align(static_cast<std::size_t>(alignment), static_cast<std::size_t>(bytes), place, space);
}

}  // namespace

std::int64_t device_room(const Kernel& kernel, const EnsembleRequest& request, std::int64_t workers) {
    const lobatto_device_lanes& lanes = *request.device->host.operator->();
    const auto bytes =
        static_cast<std::int64_t>(lanes.words) * 8 + 20 + 8 * (kernel->parameters + 4 * kernel->coordinates);
    const auto free = static_cast<std::int64_t>(request.device->function->device()->free_memory());
    const std::int64_t most = std::min(
        {most_lanes, most_kept / (rows_kept(request) * (2 + 2 * kernel->coordinates)), free / (2 * workers * bytes)});
    const std::int64_t block = DeviceKernel::block;
    const std::int64_t wanted = std::min(most, (request.count + workers - 1) / workers);
    return std::max(block, (wanted + block - 1) / block * block);
}

DeviceTrajectories::DeviceTrajectories(const Kernel& kernel, const EnsembleRequest& request, std::int64_t room,
                                       int threads)
    : kernel_(kernel),
      device_(request.device),
      tolerance_(request.tolerance),
      room_(room),
      threads_(std::max(threads, 1)),
      queue_(device_->function->device()),
      words_(static_cast<std::size_t>(device_->host->words * room)),
      steps_(static_cast<std::size_t>(room)),
      iterations_(static_cast<std::size_t>(room)),
      status_(static_cast<std::size_t>(room)),
      rooms_(static_cast<std::size_t>(threads_)) {
    here_ = {words_.data(), room, room, 0, steps_.data(), iterations_.data(), status_.data(), {}, {}};
    there_ = here_;
    there_.words = static_cast<std::uint64_t*>(queue_.allocate(bytes_of_words(device_->host->words)));
    there_.steps = static_cast<std::int64_t*>(queue_.allocate(bytes_of_words(1)));
    there_.iterations = static_cast<std::int64_t*>(queue_.allocate(bytes_of_words(1)));
    there_.status = static_cast<std::int32_t*>(queue_.allocate(bytes_of_words(1)));
}

template <class Use>
void DeviceTrajectories::share(std::int64_t count, std::int64_t few, const Use& use) {
    const std::int64_t threads = std::clamp<std::int64_t>(count / few, 1, threads_);
    const auto part = [&](std::int64_t thread) {
        void* const host =
            aligned(rooms_[static_cast<std::size_t>(thread)], device_->host->host_bytes, device_->host->host_alignment);
        use(host, count * thread / threads, count * (thread + 1) / threads);
    };
    std::vector<std::jthread> others;
    for (std::int64_t thread = 1; thread < threads; ++thread) others.emplace_back(part, thread);
    part(0);
}

// As the kernel has them.
DeviceTrajectories::Bytes DeviceTrajectories::numbers(const std::vector<double>& values) const {
    const std::size_t count = values.size() / static_cast<std::size_t>(kernel_->parts);
    Bytes bytes(count * static_cast<std::size_t>(kernel_->real_bytes));
    kernel_->from_parts(values.data(), static_cast<std::int64_t>(count), bytes.data());
    return bytes;
}

void DeviceTrajectories::prepare(const std::vector<double>& parameters, const std::vector<double>& step,
                                 std::int32_t*) {
    parameters_ = numbers(parameters);
    const Bytes h = numbers(step);
    std::memcpy(here_.step, h.data(), h.size());
}

void DeviceTrajectories::start(double time, const std::vector<double>& q, const std::vector<double>& p,
                               std::int32_t* status) {
    std::vector<double> parts(static_cast<std::size_t>(kernel_->parts));
    parts[0] = time;
    const Bytes begin = numbers(parts), positions = numbers(q), momenta = numbers(p);
    std::memcpy(here_.start_time, begin.data(), begin.size());
    here_.target = 0;
    share(room_, few_lanes, [&](void* host, std::int64_t first, std::int64_t last) {
        device_->host->place(host, &here_, first, last, parameters_.data(), positions.data(), momenta.data(),
                             tolerance_);
    });
    const auto good = std::find(status_.begin(), status_.end(), LOBATTO_OK);
    if (good != status_.end())
        device_->host->shared(&here_, good - status_.begin(),
                              aligned(shared_, device_->host->shared_bytes, device_->host->shared_alignment));
    std::copy(status_.begin(), status_.end(), status);
    upload(true);
    Bytes read_q(positions.size()), read_p(momenta.size());
    read_state(read_q, read_p);
}

void DeviceTrajectories::upload(bool with_words) {
    if (with_words) queue_.upload(there_.words, here_.words, bytes_of_words(device_->host->words));
    queue_.upload(there_.steps, here_.steps, bytes_of_words(1));
    queue_.upload(there_.iterations, here_.iterations, bytes_of_words(1));
    queue_.upload(there_.status, here_.status, bytes_of_words(1) / 2);
    queue_.wait();
}

void DeviceTrajectories::launch() {
    lobatto_device_call call = there_;
    call.target = here_.target;
    std::copy(std::begin(here_.step), std::end(here_.step), call.step);
    std::copy(std::begin(here_.start_time), std::end(here_.start_time), call.start_time);
    void* arguments[] = {&call, aligned(shared_, device_->host->shared_bytes, device_->host->shared_alignment)};
    queue_.launch(*device_->function, room_, DeviceKernel::block, arguments);
    queue_.download(here_.steps, there_.steps, bytes_of_words(1));
    queue_.download(here_.iterations, there_.iterations, bytes_of_words(1));
    queue_.download(here_.status, there_.status, bytes_of_words(1) / 2);
}

void DeviceTrajectories::advance(const EnsembleRequest&, std::int64_t steps, std::int32_t* status,
                                 std::int64_t* steps_done, std::int64_t* iterations) {
    const std::vector<std::int32_t> status_before = status_;
    const std::vector<std::int64_t> steps_before = steps_, iterations_before = iterations_;
    here_.target += steps;
    launch();
    std::vector<std::int64_t> failed;
    for (std::size_t lane = 0; lane < status_.size(); ++lane)
        if (status_before[lane] == LOBATTO_OK && status_[lane] == LOBATTO_NOT_CONVERGED)
            failed.push_back(static_cast<std::int64_t>(lane));
    if (!failed.empty()) retake(failed);
    for (std::size_t lane = 0; lane < status_.size(); ++lane) {
        status[lane] = status_[lane];
        steps_done[lane] = steps_[lane] - steps_before[lane];
        iterations[lane] = iterations_[lane] - iterations_before[lane];
    }
}

// The lanes whose iterations failed go on here, as those of the processor do: by Newton's iteration.
void DeviceTrajectories::retake(const std::vector<std::int64_t>& failed) {
    queue_.download(here_.words, there_.words, bytes_of_words(device_->host->words));
    const auto one = static_cast<std::ptrdiff_t>(kernel_->parameters) * kernel_->real_bytes;
    share(std::ssize(failed), 1, [&](void* host, std::int64_t first, std::int64_t last) {
        for (std::int64_t i = first; i < last; ++i) {
            const std::int64_t lane = failed[static_cast<std::size_t>(i)];
            device_->host->retake(host, &here_, lane, parameters_.data() + lane * one, tolerance_);
        }
    });
    upload(true);
}

void DeviceTrajectories::read_state(Bytes& q, Bytes& p) {
    energy_.resize(static_cast<std::size_t>(room_ * kernel_->real_bytes));
    share(room_, few_lanes, [&](void* host, std::int64_t first, std::int64_t last) {
        device_->host->state(host, &here_, first, last, q.data(), p.data(), energy_.data());
    });
}

void DeviceTrajectories::state(std::vector<double>& q, std::vector<double>& p) {
    const std::int64_t first = device_->host->first_moving, moving = device_->host->moving;
    queue_.download(here_.words + first * room_, there_.words + first * room_, bytes_of_words(moving));
    const auto count = static_cast<std::int64_t>(room_) * kernel_->coordinates;
    Bytes positions(static_cast<std::size_t>(count * kernel_->real_bytes)), momenta(positions.size());
    read_state(positions, momenta);
    kernel_->to_parts(positions.data(), count, q.data());
    kernel_->to_parts(momenta.data(), count, p.data());
}

void DeviceTrajectories::energy(const std::vector<double>&, const std::vector<double>&,
                                std::vector<double>& energy) const {
    kernel_->to_parts(energy_.data(), room_, energy.data());
}

}  // namespace lobatto
