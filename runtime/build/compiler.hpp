// SPDX-License-Identifier: MIT
// The user's C++ compiler: which one it is, how to recognise it again without running it, and with which flags.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "runtime/build/compile.hpp"

namespace lobatto {

struct Compiler {
    std::vector<std::string> words;  // program and fixed arguments, for example {"/usr/bin/ccache", "g++"}
    std::string identity;  // of each word that is a program: its path, the file behind it, size and time of change
};

// $CXX (split at spaces), else g++, else clang++, found through PATH. MachineError when there is none, or when the
// kernel needs quadruple precision and the compiler is clang++.
Compiler find_compiler(bool quadruple);

// The whole argument list that makes `object` from `source`, both relative to the folder of the compilation.
std::vector<std::string> compile_arguments(const Compiler& compiler, const std::string& source,
                                           const std::string& object, const Translation& translation);

// As execvp would find it, but absolute.
std::optional<std::string> find_program(const std::string& name);
// Its path, the file behind it, size and time of change: two programs at one path differ in one of these.
std::string identity_of(const std::string& path);

// A word of a command as one would type it: quoted when anything in it is unusual.
std::string shell_word(const std::string& word);

// What -march=native looks at: the model and the features of the processor.
std::string processor_identity();

}  // namespace lobatto
