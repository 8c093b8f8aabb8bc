// SPDX-License-Identifier: MIT
// How an object of the cache is made by a compiler, whichever it is.
#pragma once

#include <atomic>
#include <functional>
#include <string>
#include <vector>

#include "runtime/build/compile.hpp"

namespace lobatto {

struct Recipe {
    std::string name;                                 // C identifier, for the name of the entry
    std::string source, object;                       // names of files in the folder of the compilation
    std::string text;                                 // of the source
    std::vector<std::string> arguments;               // the whole command
    std::string identity, processor;                  // of the compiler, and of what it compiles for: parts of the key
    std::string ending = ".so";                       // of the object in the cache
    std::string compiler = "the C++ compiler";        // subject of messages
    std::string mend;                                 // of a compiler that writes nothing
    std::function<void(const std::string&)> explain;  // throws what its output means; empty, or returns: unknown
};

// As `compile` in compile.hpp.
Compiled build(const Recipe& recipe, const std::atomic<bool>* abandoned = nullptr);

}  // namespace lobatto
