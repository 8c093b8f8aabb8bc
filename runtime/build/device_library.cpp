// SPDX-License-Identifier: MIT
#include "runtime/build/device_library.hpp"

#include <dlfcn.h>
#include <fmt/format.h>

#include "runtime/error.hpp"

namespace lobatto {

DeviceLibrary DeviceLibrary::load(const std::string& object, const std::string& expected_digest) {
    const auto refuse = [&](const std::string& reason) {
        throw MachineError(fmt::format(
            "cannot use the compiled kernel {}: {}; delete this file, and it is compiled again", object, reason));
    };
    DeviceLibrary loaded;
    void* const library = ::dlopen(object.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (library == nullptr) refuse(::dlerror());
    loaded.library_ = std::shared_ptr<void>(library, [](void* handle) { ::dlclose(handle); });
    using Fetch = const lobatto_device_lanes* (*)();
    const auto fetch = reinterpret_cast<Fetch>(::dlsym(library, "lobatto_device_lanes_table"));
    if (fetch == nullptr) refuse("it has no function lobatto_device_lanes_table");
    loaded.table_ = fetch();
    if (loaded.table_->abi_version != LOBATTO_ABI_VERSION || loaded.table_->bytes != sizeof(lobatto_device_lanes))
        refuse("it speaks another version of the kernel interface than this program");
    if (loaded.table_->digest != expected_digest)
        refuse(fmt::format("its formulas have the digest {} instead of {}", loaded.table_->digest, expected_digest));
    return loaded;
}

}  // namespace lobatto
