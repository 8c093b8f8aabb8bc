// SPDX-License-Identifier: GPL-2.0-or-later
// A compiled kernel alone, for programs that count its instructions: run_kernel OBJECT STEPS STEP Q... P... prints the
// iterations it took. Built for any processor of its family, so that an emulator knows every instruction of it.
#include <dlfcn.h>

#include <cstdio>
#include <cstdlib>
#include <vector>

#include "runtime/kernel/abi.h"

int main(int count, char** arguments) {
    if (count < 4) return 2;
    void* const library = dlopen(arguments[1], RTLD_NOW);
    if (library == nullptr) {
        std::fprintf(stderr, "run_kernel: %s\n", dlerror());
        return 4;
    }
    const auto table = reinterpret_cast<const lobatto_kernel* (*)()>(dlsym(library, "lobatto_kernel_table"))();
    const int n = table->coordinates;
    if (count != 4 + 2 * n) return 2;
    std::vector<double> q, p;
    for (int k = 0; k < n; ++k) q.push_back(std::atof(arguments[4 + k]));
    for (int k = 0; k < n; ++k) p.push_back(std::atof(arguments[4 + n + k]));
    const double step = std::atof(arguments[3]), time = 0;
    const auto alignment = static_cast<std::size_t>(table->stepper_alignment);
    const auto bytes = (static_cast<std::size_t>(table->stepper_bytes) + alignment - 1) / alignment * alignment;
    void* const stepper = std::aligned_alloc(alignment < sizeof(void*) ? sizeof(void*) : alignment, bytes);
    lobatto_advance call{};
    call.steps = std::atol(arguments[2]);
    const bool good = table->prepare(stepper, nullptr, &step) == LOBATTO_OK &&
                      table->start(stepper, &time, q.data(), p.data()) == LOBATTO_OK &&
                      table->advance(stepper, &call) == LOBATTO_OK;
    std::printf("%lld\n", static_cast<long long>(call.iterations));
    std::free(stepper);
    return good ? 0 : 3;
}
