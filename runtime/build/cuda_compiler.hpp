// SPDX-License-Identifier: MIT
// The user's compiler of device code, nvcc: where it is, and what it makes of a kernel's text.
#pragma once

#include <optional>
#include <string>

#include "runtime/build/compile.hpp"

namespace lobatto {

// The environment variable NVCC, else nvcc in PATH, in $CUDA_HOME/bin or in /usr/local/cuda/bin; nothing: there is
// none. MachineError where NVCC names no program.
std::optional<std::string> find_nvcc();

struct DeviceTranslation {
    std::string name;          // C identifier, for file names
    std::string text;          // the whole CUDA C++ source
    std::string architecture;  // of the device: "sm_90"
};

// Compiles it to the device's own code (a cubin), or finds that in the same cache as libraries. MachineError without
// nvcc, and with nvcc's own output where it fails.
Compiled compile_for_device(const DeviceTranslation& translation);

}  // namespace lobatto
