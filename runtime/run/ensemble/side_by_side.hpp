// SPDX-License-Identifier: MIT
// Trajectories of an ensemble that take their steps together: in the lanes of a kernel, or a single one.
//
// All arrays are lane-major, status is one a lane (abi.h); numbers are sums of doubles, `parts` each (NumberStepper),
// which is one double in lanes. Stops and reductions are of single trajectories and of those on a device.
#pragma once

#include <limits>
#include <memory>
#include <vector>

#include "runtime/build/library.hpp"
#include "runtime/build/number_stepper.hpp"
#include "runtime/run/ensemble/ensemble.hpp"
#include "runtime/run/near_cuts.hpp"

namespace lobatto {

class Trajectories {
public:
    virtual ~Trajectories() = default;
    virtual int width() const = 0;
    virtual void prepare(const std::vector<double>& parameters, const std::vector<double>& step,
                         std::int32_t* status) = 0;
    virtual void start(double time, const std::vector<double>& q, const std::vector<double>& p,
                       std::int32_t* status) = 0;
    virtual void advance(const EnsembleRequest& request, std::int64_t steps, std::int32_t* status,
                         std::int64_t* steps_done, std::int64_t* iterations) = 0;
    virtual void state(std::vector<double>& q, std::vector<double>& p) = 0;
    // Of (q, p), the start or the state just read; not numbers without one.
    virtual void energy(const std::vector<double>& q, const std::vector<double>& p,
                        std::vector<double>& energy) const = 0;
    // Of a trajectory that was stopped: by which event, and when.
    virtual int stop(std::size_t) const { return -1; }
    virtual double stop_time(std::size_t) const { return 0; }
    // The shortest time between two cuts from the start to this end (NearCuts).
    virtual double gap_of_cuts(double) const { return std::numeric_limits<double>::infinity(); }
    // From the start on everything is handed to the reducer of a single trajectory; what it, or a device, made of it.
    virtual void reduce(const EnsembleStart&) {}
    virtual std::vector<double> reduced(std::size_t) const { return {}; }
    // Whether `advance` is a launch on a device that others wait for too, and nothing else.
    virtual bool queues_fairly() const { return false; }
    // Whether the last call of `advance` was interrupted on its way.
    virtual bool is_cut_short() const { return false; }
};

class SingleTrajectory : public Trajectories {
public:
    SingleTrajectory(const Kernel& kernel, const EnsembleRequest& request);
    int width() const override { return 1; }
    void prepare(const std::vector<double>& parameters, const std::vector<double>& step, std::int32_t* status) override;
    void start(double time, const std::vector<double>& q, const std::vector<double>& p, std::int32_t* status) override;
    void advance(const EnsembleRequest& request, std::int64_t steps, std::int32_t* status, std::int64_t* steps_done,
                 std::int64_t* iterations) override;
    void state(std::vector<double>& q, std::vector<double>& p) override;
    void energy(const std::vector<double>& q, const std::vector<double>& p, std::vector<double>& energy) const override;
    int stop(std::size_t) const override { return stop_; }
    double stop_time(std::size_t) const override { return time_; }
    double gap_of_cuts(double end) const override { return cuts_.gap_until(end); }
    void reduce(const EnsembleStart& start) override;
    std::vector<double> reduced(std::size_t) const override { return reducer_->values(); }

private:
    void stop_at(const double* row);

    LoadedStepper<double> stepper_;
    std::unique_ptr<Reducer> reducer_;
    std::vector<double> records_, events_;  // room for rows
    double time_ = 0;
    int stop_ = -1;
    std::vector<double> stop_q_, stop_p_;
    NearCuts cuts_;
};

// Of a kernel in other numbers than double; it reduces nothing.
class NumberTrajectory : public Trajectories {
public:
    NumberTrajectory(const Kernel& kernel, const EnsembleRequest& request);
    int width() const override { return 1; }
    void prepare(const std::vector<double>& parameters, const std::vector<double>& step, std::int32_t* status) override;
    void start(double time, const std::vector<double>& q, const std::vector<double>& p, std::int32_t* status) override;
    void advance(const EnsembleRequest& request, std::int64_t steps, std::int32_t* status, std::int64_t* steps_done,
                 std::int64_t* iterations) override;
    void state(std::vector<double>& q, std::vector<double>& p) override;
    void energy(const std::vector<double>& q, const std::vector<double>& p, std::vector<double>& energy) const override;
    int stop(std::size_t) const override { return stop_; }
    double stop_time(std::size_t) const override { return time_[0]; }
    double gap_of_cuts(double end) const override { return cuts_.gap_until(end); }

private:
    NumberStepper stepper_;
    std::int64_t event_rows_;
    std::vector<double> time_, stop_q_, stop_p_;
    int stop_ = -1;
    NearCuts cuts_;
};

class LaneTrajectories : public Trajectories {
public:
    explicit LaneTrajectories(const Kernel& kernel);
    int width() const override { return kernel_->lanes; }
    void prepare(const std::vector<double>& parameters, const std::vector<double>& step, std::int32_t* status) override;
    void start(double time, const std::vector<double>& q, const std::vector<double>& p, std::int32_t* status) override;
    void advance(const EnsembleRequest& request, std::int64_t steps, std::int32_t* status, std::int64_t* steps_done,
                 std::int64_t* iterations) override;
    void state(std::vector<double>& q, std::vector<double>& p) override;
    void energy(const std::vector<double>& q, const std::vector<double>& p, std::vector<double>& energy) const override;

private:
    // The numbers of the kernel, and back: doubles are those themselves.
    const void* numbers(const std::vector<double>& values, std::vector<std::byte>& room) const;
    template <class Read>
    void read(std::vector<double>& values, std::vector<std::byte>& room, const Read& read) const;

    Kernel kernel_;
    AlignedMemory memory_;
    mutable std::vector<std::byte> room_, more_room_;
};

}  // namespace lobatto
