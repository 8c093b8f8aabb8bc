// SPDX-License-Identifier: MIT
#include "runtime/build/cuda_compiler.hpp"

#include <fmt/format.h>

#include <cstdlib>

#include "runtime/build/compiler.hpp"
#include "runtime/build/recipe.hpp"
#include "runtime/error.hpp"

namespace lobatto {

std::optional<std::string> find_nvcc() {
    if (const char* const named = std::getenv("NVCC"); named != nullptr && *named != '\0') {
        if (const auto program = find_program(named)) return program;
        throw MachineError(
            fmt::format("the environment variable NVCC names '{}', which is no program; correct NVCC, or unset it to "
                        "look for nvcc in PATH and in /usr/local/cuda/bin",
                        named));
    }
    if (const auto program = find_program("nvcc")) return program;
    if (const char* const home = std::getenv("CUDA_HOME"); home != nullptr && *home != '\0')
        if (const auto program = find_program(std::string(home) + "/bin/nvcc")) return program;
    return find_program("/usr/local/cuda/bin/nvcc");
}

Compiled compile_for_device(const DeviceTranslation& translation) {
    const auto nvcc = find_nvcc();
    if (!nvcc)
        throw MachineError(
            "there is no nvcc, which compiles for the GPU: looked in PATH, $CUDA_HOME/bin and /usr/local/cuda/bin; "
            "install NVIDIA's CUDA toolkit (Debian: apt-get install nvidia-cuda-toolkit), or name its nvcc in the "
            "environment variable NVCC, or compute with --device cpu");
    Recipe recipe;
    recipe.name = translation.name;
    recipe.source = translation.name + ".cu";
    recipe.object = translation.name + ".cubin";
    recipe.ending = ".cubin";
    recipe.text = translation.text;
    // --fmad=false: as -ffp-contract=off for the host (compiler.cpp), products and sums are fused where the text says
    // so. A function that the device lacks is an error, not a warning.
    recipe.arguments = {*nvcc,
                        "-std=c++17",
                        "-O3",
                        "-cubin",
                        "-arch=" + translation.architecture,
                        "--fmad=false",
                        "--expt-relaxed-constexpr",
                        "-Werror",
                        "cross-execution-space-call",
                        recipe.source,
                        "-o",
                        recipe.object};
    recipe.identity = identity_of(*nvcc);
    recipe.processor = translation.architecture + "\n";
    recipe.compiler = "nvcc";
    recipe.mend = "correct the environment variable NVCC, or compute with --device cpu";
    return build(recipe);
}

}  // namespace lobatto
