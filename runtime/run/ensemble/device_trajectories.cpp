// SPDX-License-Identifier: MIT
#include "runtime/run/ensemble/device_trajectories.hpp"

#include <algorithm>
#include <cstring>
#include <limits>

#include "runtime/run/ensemble/ended.hpp"

namespace lobatto {

namespace {

// Of all workers together: four times what fills a device of 132 multiprocessors with 15 warps each, so that it has
// something to do while some of them begin and end their trajectories.
constexpr std::int64_t lanes_of_all = 1 << 18, bytes_of_all = 1 << 30;
constexpr std::int64_t kept_of_all = 1 << 26;                  // numbers of kept states
constexpr std::int64_t most_lanes = 1 << 16;                   // of a worker
constexpr std::int64_t few_lanes = 1024;                       // for so few no worker is worth its start
constexpr std::int64_t most_workers = 8, most_that_look = 16;  // look: at steps that may hold a stop
constexpr std::int64_t launches_together = 4;
constexpr std::int64_t steps_of_call = 256, steps_between_looks = 64;  // at least, else launching takes longer
constexpr double seconds_of_call = 0.03, seconds_between_looks = 0.01;

}  // namespace

DeviceShares::DeviceShares(const Kernel& kernel, const EnsembleRequest& request) {
    const lobatto_device_lanes& lanes = *request.device->host.operator->();
    const std::int64_t most_threads = lanes.columns > 0 ? most_that_look : most_workers;
    workers = std::clamp<std::int64_t>(request.count / few_lanes, 1,
                                       std::min<std::int64_t>(thread_count(request.threads), most_threads));
    const auto bytes =
        static_cast<std::int64_t>(lanes.words) * 9 + 32 + 8 * (kernel->parameters + 4 * kernel->coordinates);
    const auto free = static_cast<std::int64_t>(request.device->alike->device()->free_memory());
    const std::int64_t kept = rows_kept(request) * (2 + 2 * kernel->coordinates);
    const std::int64_t most = std::max<std::int64_t>(
        std::min({most_lanes, lanes_of_all / workers, std::min(bytes_of_all, free / 2) / (workers * bytes),
                  kept_of_all / ((workers + 2) * kept)}),
        1);
    // All take the same number of groups, of the same size.
    const std::int64_t rounds = std::max<std::int64_t>(1, (request.count + workers * most - 1) / (workers * most));
    const std::int64_t wanted = (request.count + workers * rounds - 1) / (workers * rounds);
    room = (wanted + DeviceKernel::block - 1) / DeviceKernel::block * DeviceKernel::block;
}

Chunk DeviceTrajectories::chunk_of(const DeviceKernel& kernel) {
    return kernel.host->columns > 0 ? Chunk(seconds_between_looks, steps_between_looks)
                                    : Chunk(seconds_of_call, steps_of_call);
}

// Its row, the progress, the numbers of its start, its last row.
double DeviceTrajectories::bytes_of_lane(const Kernel& kernel, const DeviceKernel& device) {
    const double starts = 2.0 * kernel->parts * (kernel->parameters + 3.0 * kernel->coordinates + 2);
    return sizeof(double) *
           (device.host->words * 9 / 8.0 + 6 + starts + device.host->columns * kernel->parts + device.host->kept);
}

DeviceTrajectories::DeviceTrajectories(const Kernel& kernel, const EnsembleRequest& request, std::int64_t room,
                                       const std::atomic<bool>& halted)
    : kernel_(kernel),
      device_(request.device),
      tolerance_(request.tolerance),
      room_(room),
      parts_(kernel->parts),
      halted_(halted),
      queue_(device_->alike->device()),
      words_(static_cast<std::size_t>(device_->host->words * room)),
      progress_(bytes_of_words(3)),
      host_(device_->host->host_bytes, device_->host->host_alignment),
      shared_(device_->host->shared_bytes, device_->host->shared_alignment) {
    const auto lanes = static_cast<std::size_t>(room);
    steps_ = {reinterpret_cast<std::int64_t*>(progress_.data()), lanes};
    iterations_ = {reinterpret_cast<std::int64_t*>(progress_.data() + bytes_of_words(1)), lanes};
    status_ = {reinterpret_cast<std::int32_t*>(progress_.data() + bytes_of_words(2)), lanes};
    energy_.resize(static_cast<std::size_t>(room * kernel_->real_bytes));
    rows_.resize(static_cast<std::size_t>(device_->host->columns * room * parts_));
    kept_.resize(static_cast<std::size_t>(device_->host->kept * room));
    here_.words = words_.data();
    here_.room = here_.lanes = room;
    here_.steps = steps_.data();
    here_.iterations = iterations_.data();
    here_.status = status_.data();
    here_.watches = request.stops || request.reducer ? 1 : 0;
    there_ = here_;
    batch_ = std::max<std::int64_t>(room / 8, DeviceKernel::block);
    packed_.resize(static_cast<std::size_t>(device_->host->words * batch_));
    const std::int64_t words = device_->host->words * room;
    auto* const memory =  // the rows, the progress, the order, lanes together
        static_cast<std::uint64_t*>(queue_.allocate(8 * (static_cast<std::size_t>(words + 4 * room) + packed_.size())));
    there_.words = memory;
    there_.steps = reinterpret_cast<std::int64_t*>(memory + words);
    there_.iterations = there_.steps + room;
    there_.status = reinterpret_cast<std::int32_t*>(there_.steps + 2 * room);
    there_order_ = memory + words + 3 * room;
    there_packed_ = memory + words + 4 * room;
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
    const std::ptrdiff_t one = std::ssize(parameters_) / room_;
    here_.alike = std::equal(parameters_.begin() + one, parameters_.end(), parameters_.begin()) ? 1 : 0;
    const Bytes h = numbers(step);
    std::memcpy(here_.step, h.data(), h.size());
}

// Words first, ..., last - 1, without those that are shared: move(at, count) for some side by side.
template <class Move>
void DeviceTrajectories::move_own(std::int64_t first, std::int64_t last, const Move& move) {
    const auto is_own = [&](std::int64_t word) { return is_own_[static_cast<std::size_t>(word)] != 0; };
    for (std::int64_t end = first; first < last; first = end + 1) {
        for (end = first; end < last && is_own(end);) ++end;
        if (end > first) move(first * room_, bytes_of_words(end - first));
    }
}

void DeviceTrajectories::start(double time, const std::vector<double>& q, const std::vector<double>& p,
                               std::int32_t* status) {
    std::vector<double> parts(static_cast<std::size_t>(kernel_->parts));
    parts[0] = time;
    const Bytes begin = numbers(parts), positions = numbers(q), momenta = numbers(p);
    std::memcpy(here_.start_time, begin.data(), begin.size());
    here_.target = 0;
    device_->host->place(host_.get(), &here_, 0, room_, parameters_.data(), positions.data(), momenta.data(),
                         tolerance_, energy_.data());
    const auto good = std::find(status_.begin(), status_.end(), LOBATTO_OK);
    is_own_.assign(static_cast<std::size_t>(device_->host->words), 1);
    if (good != status_.end()) {
        device_->host->shared(&here_, good - status_.begin(), shared_.get());
        if (here_.alike != 0) device_->host->own(shared_.get(), is_own_.data());
    }
    std::copy(status_.begin(), status_.end(), status);
    if (!kept_.empty()) {  // of trajectories without a step
        std::vector<double> same_q = q, same_p = p;
        const Bytes energy = energy_;  // of an impossible start it is no number
        read(same_q, same_p);
        energy_ = energy;
    }
    move_own(0, device_->host->words,
             [&](std::int64_t at, std::size_t bytes) { queue_.upload(there_.words + at, here_.words + at, bytes); });
    upload_progress();
}

void DeviceTrajectories::upload_progress() {
    queue_.upload(there_.steps, progress_.data(), bytes_of_words(3));
    queue_.wait();
}

// The lanes of `order_`, from `begin` to the target: by several launches one behind another in the queue. Each is
// short, so that the device takes launches of other queues in between.
void DeviceTrajectories::launch(std::int64_t begin) {
    lobatto_device_call call = there_;
    call.most = here_.most;
    call.alike = here_.alike;
    if (std::ssize(order_) < room_) {
        call.lanes = std::ssize(order_);
        queue_.upload(there_order_, order_.data(), order_.size() * sizeof(std::int32_t));
        call.order = static_cast<const std::int32_t*>(there_order_);
    }
    std::copy(std::begin(here_.step), std::end(here_.step), call.step);
    std::copy(std::begin(here_.start_time), std::end(here_.start_time), call.start_time);
    void* arguments[] = {&call, shared_.get()};
    const std::int64_t steps = here_.target - begin, launches = is_watched() ? 1 : std::min(launches_together, steps);
    for (std::int64_t i = 1; i <= launches; ++i) {
        call.target = begin + steps * i / launches;
        queue_.launch(here_.alike != 0 ? *device_->alike : *device_->lanes, call.lanes, DeviceKernel::block, arguments);
    }
    queue_.download(progress_.data(), there_.steps, bytes_of_words(3));
}

// If each step is looked at, a lane that had to wait for the host is behind the others. It catches up only in a call at
// whose end all lanes must have arrived.
void DeviceTrajectories::advance(const EnsembleRequest& request, std::int64_t steps, std::int32_t* status,
                                 std::int64_t* steps_done, std::int64_t* iterations) {
    const std::vector<std::int64_t> steps_before(steps_.begin(), steps_.end()),
        iterations_before(iterations_.begin(), iterations_.end());
    here_.target += steps;
    here_.most = is_watched() ? steps : std::numeric_limits<std::int64_t>::max();
    arrives_ = here_.target == request.steps || (request.every != 0 && here_.target % request.every == 0);
    ended_.clear();
    while (true) {
        order_.clear();
        for (std::size_t lane = 0; lane < status_.size(); ++lane)
            if (status_[lane] == LOBATTO_OK && steps_[lane] < here_.target)
                order_.push_back(static_cast<std::int32_t>(lane));
        if (order_.empty()) break;
        launch(here_.target - steps);
        std::vector<std::int32_t> waiting;
        for (const std::int32_t lane : order_)
            if (const std::int32_t its = status_[static_cast<std::size_t>(lane)];
                its == LOBATTO_NOT_CONVERGED || (is_watched() && its != LOBATTO_OK))
                waiting.push_back(lane);
        if (!waiting.empty()) retake(waiting);
        if (!is_watched() || !arrives_) break;
        if (halted_.load(std::memory_order_relaxed)) break;
    }
    is_cut_short_ = false;
    for (std::size_t lane = 0; lane < status_.size(); ++lane) {
        is_cut_short_ = is_cut_short_ || (arrives_ && status_[lane] == LOBATTO_OK && steps_[lane] < here_.target);
        status[lane] = status_[lane];
        steps_done[lane] = steps_[lane] - steps_before[lane];
        iterations[lane] = iterations_[lane] - iterations_before[lane];
    }
}

// The lanes whose iterations failed go on here, as those of the processor do: by Newton's iteration. So do lanes whose
// step may hold a stop, after a look at it.
void DeviceTrajectories::retake(const std::vector<std::int32_t>& waiting) {
    const std::int64_t all = std::ssize(waiting);
    for (std::int64_t first = 0; first < all; first += batch_)
        retake(waiting.data() + first, std::min(batch_, all - first));
    upload_progress();
}

void DeviceTrajectories::retake(const std::int32_t* waiting, std::int64_t count) {
    const auto one = static_cast<std::ptrdiff_t>(kernel_->parameters) * kernel_->real_bytes;
    const std::size_t bytes = 8 * static_cast<std::size_t>(device_->host->words * count);
    queue_.upload(there_order_, waiting, static_cast<std::size_t>(count) * sizeof(std::int32_t));
    move(count, false);
    queue_.download(packed_.data(), there_packed_, bytes);
    for (std::int64_t w = 0; w < device_->host->words; ++w)
        if (is_own_[static_cast<std::size_t>(w)] == 0)
            for (std::int64_t i = 0; i < count; ++i)
                packed_[static_cast<std::size_t>(w * count + i)] = here_.words[w * room_ + waiting[i]];
    std::vector<std::int64_t> steps, iterations;
    std::vector<std::int32_t> status;
    for (std::int64_t i = 0; i < count; ++i) {
        steps.push_back(here_.steps[waiting[i]]);
        iterations.push_back(here_.iterations[waiting[i]]);
        status.push_back(here_.status[waiting[i]]);
    }
    const std::int64_t columns = device_->host->columns;
    Bytes parameters, rows(static_cast<std::size_t>(count * columns * kernel_->real_bytes));
    for (std::int64_t i = 0; i < count; ++i) {
        const auto first = parameters_.begin() + waiting[i] * one;
        parameters.insert(parameters.end(), first, first + one);
    }
    lobatto_device_call packed = here_;
    packed.words = packed_.data();
    packed.room = packed.lanes = count;
    packed.steps = steps.data();
    packed.iterations = iterations.data();
    packed.status = status.data();
    device_->host->retake(host_.get(), &packed, count, parameters.data(), tolerance_, rows.data());
    for (std::int64_t i = 0; i < count; ++i) {
        const std::int32_t lane = waiting[i];
        here_.steps[lane] = packed.steps[i];
        here_.iterations[lane] = packed.iterations[i];
        here_.status[lane] = packed.status[i];
        if (!is_watched() || packed.status[i] == LOBATTO_OK) continue;
        ended_.push_back(lane);
        kernel_->to_parts(rows.data() + i * columns * kernel_->real_bytes, columns,
                          rows_.data() + lane * columns * parts_);
    }
    queue_.upload(there_packed_, packed_.data(), bytes);
    move(count, true);
    queue_.wait();
}

// The lanes of the order that is on the device.
void DeviceTrajectories::move(std::int64_t count, bool back) {
    lobatto_device_call call = there_;
    call.lanes = count;
    call.order = static_cast<const std::int32_t*>(there_order_);
    std::int64_t words = device_->host->words, goes_back = back ? 1 : 0;
    void* arguments[] = {&call, &there_packed_, &words, &goes_back};
    queue_.launch(*device_->move, count, DeviceKernel::block, arguments);
}

// Of the lanes as they are here.
void DeviceTrajectories::read(std::vector<double>& q, std::vector<double>& p) {
    const std::int64_t count = room_ * kernel_->coordinates;
    Bytes positions(static_cast<std::size_t>(count * kernel_->real_bytes)), momenta(positions.size());
    device_->host->state(host_.get(), &here_, 0, room_, positions.data(), momenta.data(), energy_.data(), kept_.data());
    kernel_->to_parts(positions.data(), count, q.data());
    kernel_->to_parts(momenta.data(), count, p.data());
}

void DeviceTrajectories::state(std::vector<double>& q, std::vector<double>& p) {
    if (arrives_ || !is_watched()) {
        const std::int64_t first = device_->host->first_moving;
        move_own(first, first + device_->host->moving, [&](std::int64_t at, std::size_t bytes) {
            queue_.download(here_.words + at, there_.words + at, bytes);
        });
        read(q, p);
    }
    const std::ptrdiff_t n = kernel_->coordinates * parts_;  // rows: event, t, q, p, energy
    for (const std::int32_t lane : ended_) {
        const double* const row = row_of(lane);
        std::copy_n(row + 2 * parts_, n, q.begin() + lane * n);
        std::copy_n(row + 2 * parts_ + n, n, p.begin() + lane * n);
        kernel_->from_parts(row + 2 * parts_ + 2 * n, 1, energy_.data() + lane * kernel_->real_bytes);
    }
}

std::vector<double> DeviceTrajectories::reduced(std::size_t lane) const {
    const auto place = static_cast<std::ptrdiff_t>(lane);
    const std::ptrdiff_t kept = device_->host->kept;
    const bool has_ended = status_[lane] != LOBATTO_OK;
    const double* const first =
        has_ended ? row_of(place) + (3 + 2 * kernel_->coordinates) * parts_ : kept_.data() + place * kept;
    return {first, first + kept};
}

void DeviceTrajectories::energy(const std::vector<double>&, const std::vector<double>&,
                                std::vector<double>& energy) const {
    kernel_->to_parts(energy_.data(), room_, energy.data());
}

}  // namespace lobatto
