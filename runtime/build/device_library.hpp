// SPDX-License-Identifier: MIT
// The host's side of a kernel's lanes on a device (runtime/kernel/device_lanes.hpp), loaded and checked.
#pragma once

#include <string>

#include "runtime/build/kernel_object.hpp"
#include "runtime/kernel/abi.h"

namespace lobatto {

// Copies share the library, which is unloaded with the last of them.
class DeviceLibrary {
public:
    // Throws MachineError.
    static DeviceLibrary load(const std::string& path, const std::string& expected_digest);

    bool has_lanes() const { return table_->words > 0; }
    const lobatto_device_lanes* operator->() const { return table_; }

private:
    KernelObject object_;
    const lobatto_device_lanes* table_ = nullptr;
};

}  // namespace lobatto
