// SPDX-License-Identifier: MIT
#include "runtime/build/device_library.hpp"

namespace lobatto {

DeviceLibrary DeviceLibrary::load(const std::string& path, const std::string& expected_digest) {
    DeviceLibrary loaded;
    loaded.object_ = KernelObject(path);
    loaded.table_ = loaded.object_.table<lobatto_device_lanes>("lobatto_device_lanes_table", expected_digest);
    return loaded;
}

}  // namespace lobatto
