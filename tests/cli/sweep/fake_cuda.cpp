// SPDX-License-Identifier: GPL-2.0-or-later
// A driver without a GPU, for tests: a "cubin" is a shared object of the device's text, made by a C++ compiler, and a
// launch calls its host function. Addresses of the device are none of the host's. Environment variables:
// FAKE_CUDA_DEVICES, FAKE_CUDA_BYTES (that can be allocated), FAKE_CUDA_LOST (the number of the launch that fails).
#include <dlfcn.h>
#include <elf.h>
#include <unistd.h>

#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <initializer_list>

#include "runtime/kernel/abi.h"

namespace {

constexpr std::uint64_t on_device = std::uint64_t(1) << 62;
std::atomic<long> launches{0}, allocated{0};

long number(const char* name, long otherwise) {
    const char* const text = std::getenv(name);
    return text == nullptr ? otherwise : std::atol(text);
}
// A function of a "cubin": lanes move together and back, or advance, those that have the same parameters or any.
struct Function {
    const lobatto_device_lanes* (*table)();
    bool is_alike, is_move;
};
std::deque<Function> functions;

template <class T>
T* here(T* there) {
    return reinterpret_cast<T*>(reinterpret_cast<std::uint64_t>(there) & ~on_device);
}

}  // namespace

extern "C" {

int cuInit(unsigned) {
    return 0;
}
int cuDeviceGetCount(int* count) {
    *count = static_cast<int>(number("FAKE_CUDA_DEVICES", 1));
    return 0;
}
int cuDeviceGet(int* device, int ordinal) {
    *device = ordinal;
    return 0;
}
int cuDeviceGetName(char* name, int length, int) {
    std::strncpy(name, "no real GPU", static_cast<std::size_t>(length));
    return 0;
}
int cuDeviceGetAttribute(int* value, int attribute, int) {
    *value = attribute == 75 ? 9 : attribute == 76 ? 0 : 4;
    return 0;
}
int cuDevicePrimaryCtxRetain(void** context, int) {
    *context = context;
    return 0;
}
int cuDevicePrimaryCtxRelease_v2(int) {
    return 0;
}
int cuCtxSetCurrent(void* context) {
    return context == nullptr ? 201 : 0;
}
int cuMemGetInfo_v2(std::size_t* free, std::size_t* total) {
    *free = *total = std::size_t(1) << 30;
    return 0;
}
int cuMemAlloc_v2(std::uint64_t* address, std::size_t bytes) {
    if ((allocated += static_cast<long>(bytes)) > number("FAKE_CUDA_BYTES", 1L << 30)) return 2;
    *address = reinterpret_cast<std::uint64_t>(std::malloc(bytes)) | on_device;
    return 0;
}
int cuMemFree_v2(std::uint64_t address) {
    std::free(here(reinterpret_cast<void*>(address)));
    return 0;
}
int cuMemcpyHtoDAsync_v2(std::uint64_t to, const void* from, std::size_t bytes, void*) {
    std::memcpy(here(reinterpret_cast<void*>(to)), from, bytes);
    return 0;
}
int cuMemcpyDtoHAsync_v2(void* to, std::uint64_t from, std::size_t bytes, void*) {
    std::memcpy(to, here(reinterpret_cast<void*>(from)), bytes);
    return 0;
}
int cuModuleLoadData(void** module, const void* image) {
    Elf64_Ehdr head;
    std::memcpy(&head, image, sizeof head);
    const std::size_t bytes = head.e_shoff + static_cast<std::size_t>(head.e_shnum) * head.e_shentsize;
    char name[] = "/tmp/fake-cuda-XXXXXX";
    const int file = ::mkstemp(name);
    const bool is_written = ::write(file, image, bytes) == static_cast<ssize_t>(bytes);
    ::close(file);
    *module = is_written ? ::dlopen(name, RTLD_NOW | RTLD_LOCAL) : nullptr;
    ::unlink(name);
    return *module == nullptr ? 200 : 0;
}
int cuModuleUnload(void* module) {
    ::dlclose(module);
    return 0;
}
int cuModuleGetFunction(void** function, void* module, const char* name) {
    const bool is_alike = std::strcmp(name, "lobatto_advance_alike") == 0,
               is_move = std::strcmp(name, "lobatto_move_lanes") == 0;
    void* const table = ::dlsym(module, "lobatto_device_lanes_table");
    if (table == nullptr || (!is_alike && !is_move && std::strcmp(name, "lobatto_advance_lanes") != 0)) return 500;
    functions.push_back({reinterpret_cast<const lobatto_device_lanes* (*)()>(table), is_alike, is_move});
    *function = &functions.back();
    return 0;
}
int cuFuncGetAttribute(int* value, int, void*) {
    *value = 128;
    return 0;
}
int cuOccupancyMaxActiveBlocksPerMultiprocessor(int* blocks, void*, int, std::size_t) {
    *blocks = 8;
    return 0;
}
int cuStreamCreate(void** stream, unsigned) {
    *stream = stream;
    return 0;
}
int cuStreamDestroy_v2(void*) {
    return 0;
}
int cuStreamSynchronize(void*) {
    return 0;
}
int cuLaunchKernel(void* function, unsigned blocks, unsigned, unsigned, unsigned threads, unsigned, unsigned, unsigned,
                   void*, void** arguments, void**) {
    const auto& chosen = *static_cast<const Function*>(function);
    lobatto_device_call call = *static_cast<lobatto_device_call*>(arguments[0]);
    if (!chosen.is_move && ++launches == number("FAKE_CUDA_LOST", 0)) return 719;
    if (static_cast<std::int64_t>(blocks) * threads < call.lanes) return 1;
    for (const void* pointer : {static_cast<const void*>(call.words), static_cast<const void*>(call.steps),
                                static_cast<const void*>(call.iterations), static_cast<const void*>(call.status)})
        if ((reinterpret_cast<std::uint64_t>(pointer) & on_device) == 0) return 700;
    call.words = here(call.words);
    call.steps = here(call.steps);
    call.iterations = here(call.iterations);
    call.status = here(call.status);
    if (call.order != nullptr) call.order = here(call.order);
    if (chosen.is_move) {
        std::uint64_t* const packed = here(*static_cast<std::uint64_t**>(arguments[1]));
        const std::int64_t words = *static_cast<std::int64_t*>(arguments[2]);
        for (std::int64_t word = 0; word < words; ++word)
            for (std::int64_t i = 0; i < call.lanes; ++i) {
                std::uint64_t &row = call.words[word * call.room + call.order[i]],
                              &other = packed[word * call.lanes + i];
                *static_cast<std::int64_t*>(arguments[3]) != 0 ? row = other : other = row;
            }
        return 0;
    }
    if ((call.alike != 0) != chosen.is_alike) return 1;
    chosen.table()->advance(&call, arguments[1], 0, call.lanes);
    return 0;
}
int cuGetErrorName(int error, const char** text) {
    *text = error == 719 ? "CUDA_ERROR_LAUNCH_FAILED" : "CUDA_ERROR_OF_A_TEST";
    return 0;
}
int cuGetErrorString(int error, const char** text) {
    *text = error == 719 ? "unspecified launch failure" : "an error of a test";
    return 0;
}
}
