// SPDX-License-Identifier: MIT
#include "runtime/build/kernel_object.hpp"

#include <dlfcn.h>
#include <fmt/format.h>

#include "runtime/error.hpp"
#include "runtime/kernel/abi.h"

namespace lobatto {

KernelObject::KernelObject(std::string path) : path_(std::move(path)) {
    void* const library = ::dlopen(path_.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (library == nullptr) fail(::dlerror());
    library_ = std::shared_ptr<void>(library, [](void* handle) { ::dlclose(handle); });
}

void KernelObject::fail(const std::string& reason) const {
    throw MachineError(fmt::format("cannot use the compiled kernel {}: {}; delete this file, and it is compiled again",
                                   path_, reason));
}

void* KernelObject::address_of(const char* function) const {
    void* const address = ::dlsym(library_.get(), function);
    if (address == nullptr) fail(fmt::format("it has no function {}, so it is not such a kernel", function));
    return address;
}

void KernelObject::check(std::int64_t version, std::int64_t bytes, std::int64_t expected_bytes) const {
    if (version != LOBATTO_ABI_VERSION)
        fail(fmt::format("it speaks version {} of the kernel interface, this program version {}", version,
                         LOBATTO_ABI_VERSION));
    if (bytes != expected_bytes)
        fail(fmt::format("its function table has {} bytes instead of {}", bytes, expected_bytes));
}

void KernelObject::check(const std::string& digest, const std::string& expected) const {
    if (digest != expected) fail(fmt::format("its formulas have the digest {} instead of {}", digest, expected));
}

}  // namespace lobatto
