// SPDX-License-Identifier: MIT
// Kernel text to shared object, through the user's compiler and a content-addressed cache (docs/architecture.md).
#pragma once

#include <atomic>
#include <string>
#include <vector>

namespace lobatto {

// What is compiled: one self-contained translation unit.
struct Translation {
    std::string name;          // C identifier, for file names
    std::string text;          // the whole C++ source: abi.h, kernel.hpp, the emitted header, export/,
                               // LOBATTO_EXPORT_KERNEL
    bool quadruple = false;    // links libquadmath (g++ only)
    int many_digits = 0;       // links MPFR, for numbers of so many digits; 0: does not
    bool short_loops = false;  // only loops of few instructions are written out: large texts compile in less time
};

struct Compiled {
    std::string object;   // path of the shared object in the cache
    std::string command;  // the command that made it
    bool from_cache = false;
    double seconds = 0;        // spent compiling; 0 on a hit
    bool was_altered = false;  // an object in the cache was not as it had been built, or others could write to it
};

// Compiles, or finds in the cache. Safe with any number of processes and threads at once. Throws MachineError with the
// compiler's own output; also where `abandoned` becomes true, on which the compiler is ended.
Compiled compile(const Translation& translation, const std::atomic<bool>* abandoned = nullptr);

// The cache folder: $LOBATTO_CACHE_DIR, else $XDG_CACHE_HOME/lobatto, else ~/.cache/lobatto; made with, or brought to,
// mode 0700. Refused (MachineError) when it belongs to another user, others may write to it, or a folder above it
// belongs to another user than root or lets others rename what is in it (writable, without the sticky bit).
std::string cache_folder();

}  // namespace lobatto
