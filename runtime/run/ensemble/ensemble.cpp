// SPDX-License-Identifier: MIT
// Workers take groups of trajectories from a counter; the caller's thread hands them over in order, through a window.
#include "runtime/run/ensemble/ensemble.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <system_error>
#include <thread>

#include "runtime/error.hpp"
#include "runtime/run/ensemble/device_trajectories.hpp"
#include "runtime/run/ensemble/ended.hpp"
#include "runtime/run/ensemble/refilled.hpp"
#include "runtime/run/ensemble/side_by_side.hpp"
#include "runtime/run/other_velocity.hpp"
#include "runtime/run/parts.hpp"
#include "runtime/run/timing.hpp"
#include "runtime/stopwatch.hpp"

namespace lobatto {

namespace {

constexpr std::int64_t largest_group = 64;  // trajectories; handing one over takes about a microsecond
constexpr std::int64_t rows_of_group = 4096;
constexpr std::int64_t fillings = 16;  // so much more where lanes are refilled: at the end of a group some are empty

// Who works on what. Trajectories are handed over in groups: whole lanes, so that the number of threads does not decide
// who stands beside whom; several groups for every thread.
struct Plan {
    std::int64_t threads, group_size, groups, window;  // window: groups in memory
    Plan(const Kernel& kernel, const EnsembleRequest& request) {
        threads = thread_count(request.threads);
        if (request.device) {
            const DeviceShares shares(kernel, request);
            threads = shares.workers;
            group_size = shares.room;
            groups = (request.count + group_size - 1) / group_size;
            window = threads + 1;
            return;
        }
        const std::int64_t lanes = std::max(kernel->lanes, 1);
        const std::int64_t times = kernel->refilled_advance != nullptr ? fillings : 1;
        const std::int64_t wanted = std::min(
            {times * largest_group, times * rows_of_group / rows_kept(request), request.count / (8 * threads)});
        group_size = std::max<std::int64_t>(wanted / lanes, 1) * lanes;
        groups = (request.count + group_size - 1) / group_size;
        threads = std::clamp<std::int64_t>(groups, 1, threads);
        window = 2 * threads + 2;
    }
};

// One thread's work: trajectories of one group after another, as many at a time as there are lanes.
class Worker {
public:
    // `room`: of a device, trajectories at a time.
    Worker(const Kernel& kernel, const EnsembleRequest& request, Shared& shared, std::int64_t room)
        : request_(request),
          shared_(shared),
          n_(static_cast<std::size_t>(kernel->coordinates)),
          parts_(static_cast<std::size_t>(kernel->parts)),
          step_(request.whole_step.empty() ? as_parts({request.step}, parts_) : request.whole_step),
          single_(kernel) {
        if (kernel->clocked != 0 && kernel->real_kind == LOBATTO_DOUBLE) clocked_.emplace(kernel);
        if (request.device)
            lanes_ = std::make_unique<DeviceTrajectories>(kernel, request, room, shared.halted);
        else if (kernel->lanes > 0)
            lanes_ = std::make_unique<LaneTrajectories>(kernel);
        else if (kernel->real_kind != LOBATTO_DOUBLE)
            lanes_ = std::make_unique<NumberTrajectory>(kernel, request);
        else
            lanes_ = std::make_unique<SingleTrajectory>(kernel, request);
        const auto width = static_cast<std::size_t>(lanes_->width());
        start_.parameters.resize(static_cast<std::size_t>(kernel->parameters));
        start_.q.resize(n_);
        start_.rate.resize(n_);
        parameters_.resize(width * start_.parameters.size() * parts_);
        q_.resize(width * n_ * parts_);
        p_.resize(width * n_ * parts_);
        energy_.resize(width * parts_);
        status_.resize(width);
        steps_done_.resize(width);
        iterations_.resize(width);
        reduces_.resize(width);
    }

    // Trajectories first, first + 1, ..., last - 1; without those that an interruption cut short.
    EndedTogether run(std::int64_t first, std::int64_t last) {
        EndedTogether group;
        for (; first < last && !shared_.halted; first += lanes_->width()) {
            std::vector<Ended> side_by_side(
                static_cast<std::size_t>(std::min<std::int64_t>(lanes_->width(), last - first)));
            if (!run_together(first, side_by_side, group.processor_seconds)) break;
            std::move(side_by_side.begin(), side_by_side.end(), std::back_inserter(group.trajectories));
        }
        return group;
    }

private:
    void place(std::size_t lane) {
        const auto put = [&](const std::vector<double>& from, std::vector<double>& to) {
            std::copy(from.begin(), from.end(), to.begin() + static_cast<std::ptrdiff_t>(lane * from.size()));
        };
        put(whole(start_.whole_parameters, start_.parameters), parameters_);
        put(whole(start_.whole_q, start_.q), q_);
        put(whole(start_.whole_rate, start_.rate), p_);
    }
    // As the kernel takes them.
    const std::vector<double>& whole(std::vector<double>& parts, const std::vector<double>& x) const {
        if (parts_ == 1) return x;
        if (parts.empty()) parts = as_parts(x, parts_);
        return parts;
    }
    void turn_velocities_into_momenta() {
        loses_velocity_ = false;
        if (single_.prepare(whole(start_.whole_parameters, start_.parameters), step_) != LOBATTO_OK) {
            std::fill(start_.rate.begin(), start_.rate.end(), no_number);
            start_.whole_rate.clear();
            return;
        }
        const std::vector<double> time = as_parts({request_.time}, parts_), &q = whole(start_.whole_q, start_.q),
                                  &velocity = whole(start_.whole_rate, start_.rate),
                                  p = single_.momentum(time, q, velocity);
        loses_velocity_ = !other_velocity(single_, time, q, velocity, p).empty();
        start_.rate = rounded(p, parts_);
        if (parts_ > 1) start_.whole_rate = p;
    }

    void begin(std::int64_t first, std::vector<Ended>& ended) {
        const auto width = static_cast<std::size_t>(lanes_->width());
        for (std::size_t lane = 0; lane < width; ++lane) {  // those that are left over repeat the last
            if (lane < ended.size()) {
                request_.start(request_.first + first + static_cast<std::int64_t>(lane), start_);
                if (request_.from_velocities)
                    turn_velocities_into_momenta();
                else if (clocked_ && clocked_->prepare(start_.parameters, request_.step) == LOBATTO_OK &&
                         clocked_->start(request_.time, start_.q, start_.rate) == LOBATTO_OK)
                    clocked_->state(time_of_start_, start_.q, start_.rate);
            }
            place(lane);
            if (lane < ended.size() && loses_velocity_) ended[lane].status = LOBATTO_SINGULAR_MASS;
        }
        lanes_->prepare(parameters_, step_, status_.data());
        lanes_->start(request_.time, q_, p_, status_.data());
        lanes_->energy(q_, p_, energy_);
        for (std::size_t lane = 0; lane < ended.size(); ++lane) {
            if (ended[lane].status == LOBATTO_OK) ended[lane].status = static_cast<lobatto_status>(status_[lane]);
            if (ended[lane].status != LOBATTO_OK) energy_[lane * parts_] = no_number;
            keep(lane, ended[lane]);
        }
        for (std::size_t lane = 0; lane < ended.size(); ++lane)
            reduces_[lane] = request_.reducer && ended[lane].status == LOBATTO_OK;
        if (reduces_[0]) lanes_->reduce(start_);
    }

    void keep(std::size_t lane, Ended& ended) const {
        ended.keep(request_, ended.stop >= 0 ? lanes_->stop_time(lane) : time_after(request_, ended.steps_done),
                   q_.data() + lane * n_ * parts_, p_.data() + lane * n_ * parts_, n_, energy_.data() + lane * parts_,
                   parts_);
    }

    // False: interrupted.
    bool run_together(std::int64_t first, std::vector<Ended>& ended, double& seconds) {
        begin(first, ended);
        const auto active = [&] {
            return std::any_of(ended.begin(), ended.end(), [](const Ended& e) { return e.goes_on(); });
        };
        const auto side_by_side = static_cast<std::int64_t>(ended.size());
        std::optional<FairQueue::Flow> flow;
        if (lanes_->queues_fairly()) flow.emplace(shared_.queue);
        std::int64_t done = 0;
        while (done < request_.steps && active()) {
            if (shared_.halted.load(std::memory_order_relaxed)) return false;
            if (flow) flow->wait();
            const double start = seconds_of_work();
            const std::int64_t from = done, target = done + std::min(steps_of_chunk(), request_.steps - done);
            while (done < target && active()) {
                const std::int64_t next =
                    request_.every == 0 ? target : std::min(target, done + request_.every - done % request_.every);
                advance(next, next - done, ended);
                done = next;
            }
            const double passed = seconds_of_work() - start;
            seconds += passed;
            took(done - from, passed);
            shared_.steps_gone += (done - from) * side_by_side;
        }
        shared_.steps_gone += (request_.steps - done) * side_by_side;
        for (std::size_t lane = 0; lane < ended.size(); ++lane) {
            if (reduces_[lane]) ended[lane].reduced = lanes_->reduced(lane);
            ended[lane].has_near_cuts =
                lanes_->gap_of_cuts(time_after(request_, request_.steps)) < NearCuts::near * std::fabs(request_.step);
        }
        return !lanes_->is_cut_short();
    }

    // To step number `next`; keeps what is to be kept there, and the last good state of a trajectory that fails.
    void advance(std::int64_t next, std::int64_t steps, std::vector<Ended>& ended) {
        lanes_->advance(request_, steps, status_.data(), steps_done_.data(), iterations_.data());
        const bool kept_here = next == request_.steps || (request_.every != 0 && next % request_.every == 0);
        bool reads = kept_here;
        for (std::size_t lane = 0; lane < ended.size(); ++lane)
            reads = reads || (ended[lane].goes_on() && status_[lane] != ended[lane].status);
        if (reads) {
            lanes_->state(q_, p_);
            lanes_->energy(q_, p_, energy_);
        }
        for (std::size_t lane = 0; lane < ended.size(); ++lane) {
            Ended& trajectory = ended[lane];
            if (!trajectory.goes_on()) continue;  // ended before
            trajectory.status = static_cast<lobatto_status>(status_[lane]);
            if (trajectory.status == LOBATTO_STOPPED) {
                trajectory.status = LOBATTO_OK;
                trajectory.stop = lanes_->stop(lane);
            }
            trajectory.steps_done += steps_done_[lane];
            trajectory.iterations += iterations_[lane];
            const bool failed = trajectory.status != LOBATTO_OK;
            if (trajectory.stop >= 0)
                keep(lane, trajectory);
            else if (failed ? trajectory.steps_done > trajectory.row_step : kept_here)
                keep(lane, trajectory);
        }
    }

    std::int64_t steps_of_chunk() const { return request_.device ? shared_.steps_of_chunk() : chunk_.steps(); }
    void took(std::int64_t steps, double seconds) {
        request_.device ? shared_.took(steps, seconds) : chunk_.took(steps, seconds);
    }

    // While a device works, the thread only waits.
    double seconds_of_work() const {
        if (!request_.device) return processor_seconds();
        return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
    }

    const EnsembleRequest& request_;
    Shared& shared_;
    std::size_t n_, parts_;
    std::vector<double> step_;
    NumberStepper single_;  // for momenta
    // Of a kernel with a clock: it knows the momentum of the time.
    std::optional<LoadedStepper<double>> clocked_;
    double time_of_start_ = 0;
    std::unique_ptr<Trajectories> lanes_;
    EnsembleStart start_;
    std::vector<double> parameters_, q_, p_, energy_;
    bool loses_velocity_ = false;  // of the start: other_velocity
    std::vector<std::int32_t> status_;
    std::vector<std::int64_t> steps_done_, iterations_;
    std::vector<bool> reduces_;  // where a trajectory has begun
    Chunk chunk_;
};

// Groups that are done, on their way to the caller. A group far ahead of the next one to be handed over has to wait.
class Window {
public:
    explicit Window(const Plan& plan) : groups_(plan.groups), slots_(static_cast<std::size_t>(plan.window)) {}

    // A worker's: the number of a group, once there is room for it; nothing when there is no more to do.
    std::optional<std::int64_t> take() {
        const std::int64_t group = next_++;
        std::unique_lock lock(mutex_);
        room_.wait(lock, [&] { return closed_ || group < handed_over_ + std::ssize(slots_); });
        return closed_ || group >= groups_ ? std::nullopt : std::optional(group);
    }
    void put(std::int64_t number, EndedTogether&& group) {
        std::optional<EndedTogether> spent;
        {
            const std::lock_guard lock(mutex_);
            slot(number) = std::move(group);
            spent.swap(spent_);
        }
        news_.notify_one();
    }
    // The caller's: a group that it has done with. A worker frees it, which takes as long as handing it over, unless
    // one is waiting for that.
    void give_back(EndedTogether&& group) {
        const std::lock_guard lock(mutex_);
        if (!spent_) spent_ = std::move(group);
    }
    void fail(std::exception_ptr error) {
        {
            const std::lock_guard lock(mutex_);
            error_ = std::move(error);
        }
        news_.notify_one();
    }
    // No group is given out any more.
    void close() {
        {
            const std::lock_guard lock(mutex_);
            closed_ = true;
        }
        room_.notify_all();
    }

    // The caller's: the next group in order; `meanwhile` is called about ten times a second. Rethrows a worker's error.
    template <class Meanwhile>
    EndedTogether next(Meanwhile meanwhile) {
        std::unique_lock lock(mutex_);
        const auto pause = std::chrono::duration<double>(progress_seconds);
        while (!news_.wait_for(lock, pause, [&] { return error_ || slot(handed_over_); })) {
            lock.unlock();
            meanwhile();
            lock.lock();
        }
        if (error_) std::rethrow_exception(error_);
        EndedTogether group = *std::move(slot(handed_over_));
        slot(handed_over_++).reset();
        lock.unlock();
        room_.notify_all();
        return group;
    }

private:
    std::optional<EndedTogether>& slot(std::int64_t number) {
        return slots_[static_cast<std::size_t>(number) % slots_.size()];
    }

    const std::int64_t groups_;
    std::atomic<std::int64_t> next_{0};
    std::mutex mutex_;
    std::condition_variable room_, news_;
    std::vector<std::optional<EndedTogether>> slots_;
    std::optional<EndedTogether> spent_;
    std::int64_t handed_over_ = 0;
    std::exception_ptr error_;
    bool closed_ = false;
};

EnsembleTrajectory view(std::int64_t index, const Ended& ended) {
    EnsembleTrajectory trajectory;
    trajectory.index = index;
    trajectory.status = ended.status;
    trajectory.steps_done = ended.steps_done;
    trajectory.iterations = ended.iterations;
    trajectory.stop = ended.stop;
    trajectory.has_near_cuts = ended.has_near_cuts;
    trajectory.reduced = &ended.reduced;
    const std::int64_t count = std::ssize(ended.energies);
    trajectory.kept = {ended.rows.data(), ended.energies.data(), count,
                       static_cast<int>(std::ssize(ended.rows) / count)};
    if (!ended.whole_rows.empty()) {
        trajectory.kept.whole = ended.whole_rows.data();
        trajectory.kept.whole_energy = ended.whole_energies.data();
        trajectory.kept.parts = static_cast<int>(ended.energy_start.size());
        trajectory.whole_energy_start = ended.energy_start.data();
    }
    trajectory.energy_start = ended.energy_start[0];
    trajectory.energy_error_final = trajectory.energy_error(count - 1);
    trajectory.energy_error_largest = ended.energy_error_largest;
    return trajectory;
}

}  // namespace

double EnsembleTrajectory::energy_error(std::int64_t row) const {
    if (kept.energy == nullptr) return no_number;
    if (kept.whole_energy == nullptr) return kept.energy[row] - energy_start;
    return difference(kept.whole_energy + row * kept.parts, whole_energy_start, static_cast<std::size_t>(kept.parts));
}

int thread_count(int threads) {
    return threads > 0 ? threads : std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

double memory_of(const Kernel& kernel, const EnsembleRequest& request) {
    const Plan plan(kernel, request);
    const double rows = static_cast<double>(rows_kept(request)) * static_cast<double>(plan.group_size);
    const int parts = kernel->parts > 1 ? 1 + kernel->parts : 1;
    const double kept =
        sizeof(double) * parts * (2 + 2.0 * kernel->coordinates) * rows * static_cast<double>(plan.window + 2);
    if (!request.device) return kept;
    return kept + static_cast<double>(plan.threads * plan.group_size) *
                      DeviceTrajectories::bytes_of_lane(kernel, *request.device);
}

EnsembleResult integrate(const Kernel& kernel, const EnsembleRequest& request) {
    const Stopwatch watch;
    EnsembleResult result;
    const Plan plan(kernel, request);
    result.lanes = request.device ? static_cast<int>(plan.group_size) : std::max(kernel->lanes, 1);
    result.threads = static_cast<int>(plan.threads);

    Shared shared(request.device ? DeviceTrajectories::chunk_of(*request.device) : Chunk());
    Window window(plan);
    const auto work_with = [&](auto worker) {
        while (const auto group = window.take())
            window.put(*group,
                       worker.run(*group * plan.group_size, std::min((*group + 1) * plan.group_size, request.count)));
    };
    const auto work = [&] {
        try {
            if (kernel->refilled_advance != nullptr && !request.device)
                work_with(RefilledLanes(kernel, request, shared));
            else
                work_with(Worker(kernel, request, shared, plan.group_size));
        } catch (...) {
            window.fail(std::current_exception());
        }
    };
    std::vector<std::jthread> workers;
    struct Halt {  // before the workers are waited for, also when an exception ends this function
        Shared& shared;
        Window& window;
        ~Halt() {
            shared.halted = true;
            window.close();
        }
    } const halt{shared, window};
    try {
        for (int i = 0; i < result.threads; ++i) workers.emplace_back(work);
    } catch (const std::system_error& error) {
        throw MachineError(fmt::format("cannot start {} threads: {}. Ask for fewer with --threads", result.threads,
                                       error.code().message()));
    }

    auto last_progress = std::chrono::steady_clock::now();
    const auto meanwhile = [&] {
        if (request.interrupted != nullptr && *request.interrupted != 0) shared.halted = true;
        const auto now = std::chrono::steady_clock::now();
        if (!request.progress || now - last_progress < std::chrono::duration<double>(progress_seconds)) return;
        last_progress = now;
        request.progress(shared.steps_gone);
    };
    for (std::int64_t number = 0; number < plan.groups && !result.interrupted; ++number) {
        EndedTogether group = window.next(meanwhile);
        result.processor_seconds += group.processor_seconds;
        for (const Ended& ended : group.trajectories) {
            const EnsembleTrajectory trajectory = view(request.first + result.trajectories, ended);
            ++result.trajectories;
            ++result.count_of[static_cast<std::size_t>(trajectory.status)];
            result.steps_done += trajectory.steps_done;
            result.iterations += trajectory.iterations;
            if (request.sink) request.sink(trajectory);
        }
        window.give_back(std::move(group));
        result.interrupted = result.trajectories < std::min((number + 1) * plan.group_size, request.count);
        meanwhile();
    }
    result.seconds = watch.seconds();
    return result;
}

}  // namespace lobatto
