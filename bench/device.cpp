// SPDX-License-Identifier: GPL-2.0-or-later
#include "bench/device.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <string>
#include <vector>

#include "analysis/kernel/derived_kernel.hpp"
#include "analysis/kernel/device_kernel.hpp"
#include "analysis/kernel/kernel_of.hpp"
#include "analysis/motion.hpp"
#include "runtime/error.hpp"

namespace lobatto::bench {

namespace {

struct Row {
    const char *name, *scene;
    int points;
    double step;
    std::int64_t steps;  // of each trajectory
};
constexpr Row rows[] = {{"P1", "p1_pendulum", 4, 0.2, 20'000},
                        {"P2", "p2_henon_heiles", 6, 0.25, 10'000},
                        {"P3", "p3_double_pendulum", 6, 0.05, 4'000},
                        {"P4", "p4_kepler", 6, 0.1, 10'000}};
struct Size {
    std::int64_t trajectories;
    double steps = 1;  // of each, as a part of those of the row
};
constexpr Size sizes[] = {{1'000}, {10'000}, {100'000}, {100'000, 5}, {1'000'000}, {10'000'000, 0.2}};
constexpr std::int64_t steps_of_processor = 30'000'000;  // of each core: it takes fewer trajectories as far

// Steps of all trajectories in a second, what begins and ends them included; 0: some failed.
double rate_of(const Kernel& kernel, EnsembleRequest request, std::int64_t count) {
    request.count = count;
    const EnsembleResult result = integrate(kernel, request);
    return result.count_of[LOBATTO_OK] < count ? 0 : static_cast<double>(result.steps_done) / result.seconds;
}

void print_rates(const Row& row, const std::shared_ptr<const CudaDevice>& device) {
    Scene scene = read_scene(fmt::format("{}/bench/scenes/{}.toml", LOBATTO_SOURCE_DIR, row.scene));
    scene.method.points = row.points;
    const DerivedKernel derived = derived_kernel(scene, {});
    const Kernel kernel = ensemble_kernel_of(derived.source, Precision::double_, 1 << 20);
    EnsembleRequest request;
    EnsembleStart scenes_start;
    for (const Parameter& parameter : scene.parameters)
        scenes_start.parameters.push_back(scene.evaluate(parameter.value, parameter.name).to_double());
    for (std::size_t k = 0; k < scene.coordinates.size(); ++k) {
        scenes_start.q.push_back(scene.evaluate(scene.initial_position[k], "a position").to_double());
        scenes_start.rate.push_back(scene.evaluate(scene.initial_rate[k], "a velocity").to_double());
    }
    request.start = [scenes_start](std::int64_t index, EnsembleStart& start) {
        start = scenes_start;
        start.q[0] *= 1 + static_cast<double>(index % 1000) / 1e6;
    };
    request.from_velocities = scene.start == Start::velocity;
    request.step = row.step;
    request.tolerance = 1e-9;
    EnsembleRequest alone = request, there = request;
    alone.threads = 1;
    there.device = device_kernel_of(derived.source, Precision::double_, device);
    const CudaFunction& function = *there.device->alike;
    const int blocks = function.resident(DeviceKernel::block);
    fmt::print("\n{}: {}, h = {}, {} registers, {} threads on each of {} multiprocessors\n\n", row.name,
               scene.method.name(), row.step, function.registers(), blocks * DeviceKernel::block,
               device->multiprocessors());
    fmt::print("| trajectories | steps of each | one core, steps/s | {} cores | {} | times one core | times all |\n",
               thread_count(0), device->name());
    fmt::print("|---|---|---|---|---|---|---|\n");
    for (const Size& size : sizes) {
        const auto steps = static_cast<std::int64_t>(size.steps * static_cast<double>(row.steps));
        const std::int64_t count = size.trajectories, few = steps_of_processor / steps;
        alone.steps = request.steps = there.steps = steps;
        const double one = rate_of(kernel, alone, std::min(count, few)),
                     all = rate_of(kernel, request, std::min(count, few * thread_count(0))),
                     device_rate = rate_of(kernel, there, count);
        fmt::print("| {} | {} | {:.3g} | {:.3g} | {:.3g} | {:.1f} | {:.1f} |\n", count, steps, one, all, device_rate,
                   device_rate / one, device_rate / all);
        std::fflush(stdout);
    }
}

// The map of flips (docs/flips.md): size x size starts at rest, each until it turns over or t = 100.
EnsembleRequest flips_of(const Scene& scene, std::int64_t size) {
    EnsembleRequest request;
    request.count = size * size;
    request.start = [size](std::int64_t index, EnsembleStart& start) {
        const auto angle = [size](std::int64_t i) {
            return -3 + 6 * static_cast<double>(i) / static_cast<double>(size - 1);
        };
        start.q = {angle(index / size), angle(index % size)};
        start.rate = {0, 0};
    };
    request.from_velocities = true;
    request.step = scene.evaluate(scene.run.step, "the step").to_double();
    request.steps = steps_of(scene).count;
    request.stops = true;
    return request;
}

struct Flips {
    double rate = 0;  // trajectories in a second
    std::int64_t flipped = 0, steps = 0;
};
Flips flips_in(const Kernel& kernel, EnsembleRequest request) {
    Flips flips;
    request.sink = [&](const EnsembleTrajectory& trajectory) { flips.flipped += trajectory.stop >= 0 ? 1 : 0; };
    const EnsembleResult result = integrate(kernel, request);
    flips.rate = static_cast<double>(result.trajectories) / result.seconds;
    flips.steps = result.steps_done;
    return flips;
}

void print_flips(const std::shared_ptr<const CudaDevice>& device) {
    const Scene scene = read_scene(LOBATTO_SOURCE_DIR "/scenes/flips.toml");
    const DerivedKernel derived = derived_kernel(scene, {});
    const Kernel kernel = ensemble_kernel_of(derived.source, Precision::double_, 1 << 20, nullptr, true);
    EnsembleRequest alone = flips_of(scene, 100), there = flips_of(scene, 100);
    alone.threads = 1;
    const double one = flips_in(kernel, alone).rate, all = flips_in(kernel, flips_of(scene, 400)).rate;
    there.device = device_kernel_of(derived.source, Precision::double_, device, nullptr, {true});
    fmt::print("\nThe map of flips: {}, h = {}, {} registers; one core {:.3g} trajectories/s, {} cores {:.3g}\n\n",
               scene.method.name(), there.step, there.device->alike->registers(), one, thread_count(0), all);
    fmt::print("| map | flips | steps | {}, trajectories/s | times one core | times all |\n|---|---|---|---|---|---|\n",
               device->name());
    for (const std::int64_t size : {100, 200, 1000, 2000}) {
        EnsembleRequest map = flips_of(scene, size);
        map.device = there.device;
        const Flips flips = flips_in(kernel, map);
        fmt::print("| {0} x {0} | {1} | {2:.3g} | {3:.3g} | {4:.1f} | {5:.1f} |\n", size, flips.flipped,
                   static_cast<double>(flips.steps), flips.rate, flips.rate / one, flips.rate / all);
        std::fflush(stdout);
    }
}

}  // namespace

void print_device_rates() {
    std::shared_ptr<const CudaDevice> device;
    std::string missing;
    try {
        device = CudaDevice::open();
        if (!find_nvcc()) missing = "there is no nvcc, which compiles for it";
    } catch (const MachineError& error) {
        missing = error.what();
    }
    if (!missing.empty()) {
        fmt::print(
            "Not measured here: the rates of P1 to P4 with 10^3 to 10^7 trajectories, and of the map of flips, on a "
            "GPU, beside one and all cores; registers and occupancy there.\nWhat is missing: {}.\n",
            missing);
        return;
    }
    for (const Row& row : rows) print_rates(row, device);
    print_flips(device);
}

}  // namespace lobatto::bench
