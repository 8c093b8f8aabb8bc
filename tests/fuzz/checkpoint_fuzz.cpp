// SPDX-License-Identifier: GPL-2.0-or-later
// Fuzz target: whatever bytes a checkpoint has, sealed well, it is read or refused with a MachineError.
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <fstream>

#include "runtime/build/sha256.hpp"
#include "runtime/error.hpp"
#include "runtime/run/checkpoint.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static const std::string path = "/dev/shm/lobatto-fuzz-" + std::to_string(::getpid());
    const std::string bytes(reinterpret_cast<const char*>(data), size);
    try {
        std::remove(path.c_str());
        std::ofstream(path, std::ios::binary) << lobatto::sha256(bytes) << '\n' << bytes;
        lobatto::read_checkpoint(path);
    } catch (const lobatto::MachineError&) {
    }
    std::remove(path.c_str());
    return 0;
}
