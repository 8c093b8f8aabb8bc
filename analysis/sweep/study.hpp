// SPDX-License-Identifier: GPL-2.0-or-later
// A sweep that is ready to be computed, a range of its trajectories at a time: by one process, by shards, by ranks.
// What a trajectory becomes does not depend on how they are divided.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "analysis/kernel/kernel_of.hpp"
#include "analysis/motion.hpp"
#include "analysis/overrides.hpp"
#include "analysis/sweep/judges.hpp"
#include "analysis/sweep/rows.hpp"
#include "analysis/sweep/starts.hpp"
#include "runtime/run/ensemble/cuda.hpp"

namespace lobatto {

// What takes the steps; automatic: the faster of both in a trial, the processor where there is no device.
enum class StudyDevice { processor, cuda, automatic };

struct StudyOptions {
    Overrides overrides;
    std::optional<std::int64_t> steps;  // instead of an end time
    StudyDevice device = StudyDevice::processor;
    int threads = 0;       // 0: as many as the machine runs
    bool measures = true;  // errors, by companions
    bool beyond_horizon = false;
};

// What it took to compute trajectories.
struct StudyTimes {
    bool interrupted = false;
    std::int64_t trajectories = 0, steps_done = 0;
    double processor_seconds = 0, seconds = 0;
    int threads = 0, lanes = 0;
    void add(const StudyTimes& more);
};

class SweepStudy {
public:
    // `scene` with its method and what it keeps, as read; `options` are applied here. Compiles the kernel of the first
    // setting. InputError where something makes no sense; MachineError where a device is asked for and cannot be had.
    SweepStudy(Scene scene, const StartsRequest& starts, const StudyOptions& options, std::recursive_mutex& algebra);
    // StudyDevice::automatic: takes the faster of processor and device, after trials in several threads. The caller
    // must not hold `algebra`, for which they wait.
    void choose_device();

    const Scene& scene() const { return scene_; }  // with all values that are the same for all
    const SweepStarts& starts() const { return *starts_; }
    const SweepRows& rows() const { return *rows_; }
    bool measures() const { return options_.measures; }
    const Overrides& overrides() const { return options_.overrides; }
    const CudaDevice* device() const { return device_.get(); }  // that takes the steps; null: the processor does

    // One setting of the method: what its trajectories share.
    struct Setting {
        std::int64_t number = -1;
        Scene scene;
        Steps steps;
        std::shared_ptr<const Outline> outline;
        std::shared_ptr<const KernelSource> source;
        std::optional<Kernel> kernel;
        std::optional<Kernel> plain;  // in double
        std::shared_ptr<const KernelSource> plain_source;
        std::string compiled;     // names the kernel with its compiler and processor: the same, the same bits
        EnsembleRequest request;  // of all its trajectories
    };
    const Setting& first_setting() const { return *first_; }

    // Trajectories first, ..., last - 1, in this order: to `sink` with the verdict. Ranges are asked for in ascending
    // order. `progress`: steps since the beginning of this call.
    using Sink = std::function<void(const EnsembleTrajectory&, const Verdict&, const EnsembleRequest&)>;
    StudyTimes compute(std::int64_t first, std::int64_t last, const Sink& sink,
                       const std::function<void(std::int64_t steps_done)>& progress, const volatile int* interrupted);
    // After the last range: what judges warn of, once for each setting.
    std::vector<std::string> end();

    // Of trajectories first, ..., last - 1; for the progress.
    double steps_of(std::int64_t first, std::int64_t last) const;
    // A text that identifies the sweep: two sweeps with the same text have the same rows.
    std::string identity() const;

private:
    void count_steps();  // and warns of end times that differ
    std::unique_ptr<Setting> prepare(std::int64_t number);
    EnsembleRequest request_of(const Setting& setting) const;
    Steps steps_of_setting(Scene& scene) const;
    Overrides values_of(std::int64_t index) const;
    void put_on_device(Setting& setting) const;
    void enter(std::int64_t number);
    void count_missing(const std::vector<double>& kept);
    void note_warnings();

    Scene as_written_, scene_;
    StudyOptions options_;
    std::recursive_mutex& algebra_;  // formulas in more than one thread: one at a time
    std::unique_ptr<SweepStarts> starts_;
    std::unique_ptr<SweepRows> rows_;
    struct Derived {
        std::shared_ptr<const Outline> outline;
        std::shared_ptr<const KernelSource> source, plain;  // plain: in double
    };
    std::map<std::pair<int, int>, Derived> derived_;  // by family and number of points
    std::shared_ptr<const CudaDevice> device_;
    std::unique_ptr<Setting> first_;
    std::unique_ptr<Setting> current_;
    std::optional<Judges> judges_;
    std::vector<std::string> warnings_;
    std::vector<std::int64_t> missing_;  // of each that is kept: trajectories in which it has no value
    std::vector<std::int64_t> steps_;    // of a trajectory, by setting
};

}  // namespace lobatto
