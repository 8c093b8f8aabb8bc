// SPDX-License-Identifier: GPL-2.0-or-later
// A scene's kernel on a device: which sweeps can go there, and both libraries of their kernels, compiled and loaded.
#pragma once

#include <memory>
#include <string>

#include "generator/emit/kernel.hpp"
#include "generator/scene/scene.hpp"
#include "runtime/build/compile.hpp"
#include "runtime/build/cuda_compiler.hpp"
#include "runtime/run/ensemble/device_trajectories.hpp"

namespace lobatto {

// Why sweeps of this scene are for the processor alone, as a sentence without its stop; empty: they are not.
std::string why_not_on_device(const Scene& scene);

// What is looked at after each step of a lane.
struct WatchedLanes {
    bool events = false;
    std::string kept = {};  // text of KeptFormulas (analysis/reductions.hpp); empty: nothing is kept
    bool any() const { return events || !kept.empty(); }
};

// The two texts of a kernel's lanes: for the C++ compiler and for nvcc.
Translation host_side_of(const KernelSource& source, Precision precision, const WatchedLanes& watched = {});
// `host`: the library of the first text. Where a row has few words all loops are written out, so that a lane is in
// registers. nvcc proves that both have the same rows.
DeviceTranslation device_side_of(const KernelSource& source, const std::string& architecture, const DeviceLibrary& host,
                                 const WatchedLanes& watched = {});

// Compiles both, or finds them in the cache. `compiled`: names them with their compilers. Throws MachineError;
// InputError where this kernel has no lanes for a device.
std::shared_ptr<const DeviceKernel> device_kernel_of(const KernelSource& source, Precision precision,
                                                     const std::shared_ptr<const CudaDevice>& device,
                                                     std::string* compiled = nullptr, const WatchedLanes& watched = {});

}  // namespace lobatto
