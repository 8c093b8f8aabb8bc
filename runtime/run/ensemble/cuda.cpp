// SPDX-License-Identifier: MIT
#include "runtime/run/ensemble/cuda.hpp"

#include <dlfcn.h>
#include <fmt/format.h>

#include <cstdlib>

#include "runtime/error.hpp"

namespace lobatto {

// As cuda.h declares them; a result of 0 is success, handles are pointers, addresses on the device are 64 bits.
struct CudaDriver {
    using Address = std::uint64_t;
    int (*init)(unsigned flags);
    int (*device_count)(int* count);
    int (*device_get)(int* device, int ordinal);
    int (*device_name)(char* name, int length, int device);
    int (*device_attribute)(int* value, int attribute, int device);
    int (*context_retain)(void** context, int device);
    int (*context_release)(int device);
    int (*context_set)(void* context);
    int (*memory_info)(std::size_t* free, std::size_t* total);
    int (*allocate)(Address* address, std::size_t bytes);
    int (*release)(Address address);
    int (*upload)(Address to, const void* from, std::size_t bytes, void* stream);
    int (*download)(void* to, Address from, std::size_t bytes, void* stream);
    int (*module_load)(void** module, const void* image);
    int (*module_unload)(void* module);
    int (*module_function)(void** function, void* module, const char* name);
    int (*function_attribute)(int* value, int attribute, void* function);
    int (*resident_blocks)(int* blocks, void* function, int threads, std::size_t shared_bytes);
    int (*stream_create)(void** stream, unsigned flags);
    int (*stream_destroy)(void* stream);
    int (*stream_wait)(void* stream);
    int (*launch)(void* function, unsigned x, unsigned y, unsigned z, unsigned block_x, unsigned block_y,
                  unsigned block_z, unsigned shared_bytes, void* stream, void** arguments, void** extra);
    int (*error_name)(int error, const char** text);
    int (*error_text)(int error, const char** text);
    void* library = nullptr;

    ~CudaDriver() {
        if (library != nullptr) ::dlclose(library);
    }
    std::string error(int code) const {
        const char *name = nullptr, *text = nullptr;
        error_name(code, &name);
        error_text(code, &text);
        return fmt::format("{} ({})", text == nullptr ? "an unknown error" : text,
                           name == nullptr ? std::to_string(code) : name);
    }
};

namespace {

constexpr int multiprocessor_count = 16, capability_major = 75, capability_minor = 76, register_count = 4;
constexpr int out_of_memory = 2;
constexpr unsigned queue_of_its_own = 1;  // CU_STREAM_NON_BLOCKING
constexpr int oldest_architecture = 70;   // with which parameters of launches may be long

const char* const otherwise = "; or compute with --device cpu";

template <class Function>
void fetch(void* library, const char* name, Function& function) {
    function = reinterpret_cast<Function>(::dlsym(library, name));
    if (function == nullptr)
        throw MachineError(
            fmt::format("NVIDIA's driver libcuda.so.1 lacks the function {}: install a newer one{}", name, otherwise));
}

std::shared_ptr<const CudaDriver> load_driver() {
    auto driver = std::make_shared<CudaDriver>();
    driver->library = ::dlopen("libcuda.so.1", RTLD_NOW | RTLD_LOCAL);
    if (driver->library == nullptr)
        throw MachineError(fmt::format("there is no driver of an NVIDIA GPU: {}. Install it where there is a GPU{}",
                                       ::dlerror(), otherwise));
    void* const library = driver->library;
    fetch(library, "cuInit", driver->init);
    fetch(library, "cuDeviceGetCount", driver->device_count);
    fetch(library, "cuDeviceGet", driver->device_get);
    fetch(library, "cuDeviceGetName", driver->device_name);
    fetch(library, "cuDeviceGetAttribute", driver->device_attribute);
    fetch(library, "cuDevicePrimaryCtxRetain", driver->context_retain);
    fetch(library, "cuDevicePrimaryCtxRelease_v2", driver->context_release);
    fetch(library, "cuCtxSetCurrent", driver->context_set);
    fetch(library, "cuMemGetInfo_v2", driver->memory_info);
    fetch(library, "cuMemAlloc_v2", driver->allocate);
    fetch(library, "cuMemFree_v2", driver->release);
    fetch(library, "cuMemcpyHtoDAsync_v2", driver->upload);
    fetch(library, "cuMemcpyDtoHAsync_v2", driver->download);
    fetch(library, "cuModuleLoadData", driver->module_load);
    fetch(library, "cuModuleUnload", driver->module_unload);
    fetch(library, "cuModuleGetFunction", driver->module_function);
    fetch(library, "cuFuncGetAttribute", driver->function_attribute);
    fetch(library, "cuOccupancyMaxActiveBlocksPerMultiprocessor", driver->resident_blocks);
    fetch(library, "cuStreamCreate", driver->stream_create);
    fetch(library, "cuStreamDestroy_v2", driver->stream_destroy);
    fetch(library, "cuStreamSynchronize", driver->stream_wait);
    fetch(library, "cuLaunchKernel", driver->launch);
    fetch(library, "cuGetErrorName", driver->error_name);
    fetch(library, "cuGetErrorString", driver->error_text);
    return driver;
}

CudaDriver::Address address_of(const void* memory) {
    return reinterpret_cast<CudaDriver::Address>(memory);
}

}  // namespace

std::shared_ptr<const CudaDevice> CudaDevice::open() {
    const std::shared_ptr<CudaDevice> opened(new CudaDevice);
    opened->driver_ = load_driver();
    const CudaDriver& driver = *opened->driver_;
    ::setenv("CUDA_DEVICE_MAX_CONNECTIONS", "32", 0);  // else several queues wait for each other
    const auto refuse = [](const std::string& reason) { throw MachineError(reason + otherwise); };
    if (const int result = driver.init(0); result != 0)
        refuse("NVIDIA's driver finds no GPU that it can use: " + driver.error(result) +
               ". See what nvidia-smi says, and whether CUDA_VISIBLE_DEVICES hides it");
    int count = 0;
    if (const int result = driver.device_count(&count); result != 0 || count == 0)
        refuse("NVIDIA's driver shows no GPU; see what nvidia-smi says, and whether CUDA_VISIBLE_DEVICES hides it");
    char name[256] = {};
    int major = 0, minor = 0;
    opened->check(driver.device_get(&opened->device_, 0), "cannot be opened");
    opened->check(driver.device_name(name, sizeof name - 1, opened->device_), "does not tell its name");
    opened->name_ = name;
    opened->check(driver.device_attribute(&major, capability_major, opened->device_), "does not tell what it can do");
    opened->check(driver.device_attribute(&minor, capability_minor, opened->device_), "does not tell what it can do");
    opened->check(driver.device_attribute(&opened->multiprocessors_, multiprocessor_count, opened->device_),
                  "does not tell what it can do");
    opened->architecture_ = fmt::format("sm_{}{}", major, minor);
    if (10 * major + minor < oldest_architecture)
        refuse(fmt::format("the GPU {} is of the architecture {}; sweeps need sm_{} or newer", opened->name_,
                           opened->architecture_, oldest_architecture));
    opened->check(driver.context_retain(&opened->context_, opened->device_), "cannot be taken into use");
    opened->use();
    return opened;
}

CudaDevice::~CudaDevice() {
    if (context_ == nullptr) return;
    if (driver_->context_set(context_) == 0) {
        release_spare();
        for (void* const stream : streams_) driver_->stream_destroy(stream);
    }
    driver_->context_release(device_);
}

void CudaDevice::release_spare() const {
    const std::lock_guard lock(mutex_);
    for (const auto& [bytes, address] : spare_) driver_->release(address);
    spare_.clear();
}

void CudaDevice::use() const {
    check(driver_->context_set(context_), "cannot be used by a thread");
}

void CudaDevice::check(int result, const char* what) const {
    if (result == 0) return;
    const std::string device = "the GPU" + (name_.empty() ? "" : " " + name_);
    if (result == out_of_memory)
        throw MachineError(fmt::format("{} {}: its memory is full; wait until other programs have left it{}", device,
                                       what, otherwise));
    throw MachineError(fmt::format("{} {}: {}{}", device, what, driver_->error(result), otherwise));
}

std::size_t CudaDevice::free_memory() const {
    use();
    std::size_t free = 0, total = 0;
    check(driver_->memory_info(&free, &total), "does not tell how much memory is free");
    const std::lock_guard lock(mutex_);
    for (const auto& [bytes, address] : spare_) free += bytes;
    return free;
}

CudaFunction::CudaFunction(std::shared_ptr<const CudaDevice> device, const std::string& cubin, const char* name)
    : device_(std::move(device)) {
    device_->use();
    device_->check(device_->driver_->module_load(&module_, cubin.data()), "does not take the compiled kernel");
    device_->check(device_->driver_->module_function(&function_, module_, name), "does not find the kernel's function");
}

CudaFunction::~CudaFunction() {
    if (module_ != nullptr && device_->driver_->context_set(device_->context_) == 0)
        device_->driver_->module_unload(module_);
}

int CudaFunction::registers() const {
    int count = 0;
    device_->check(device_->driver_->function_attribute(&count, register_count, function_), "does not tell registers");
    return count;
}

int CudaFunction::resident(int threads) const {
    int blocks = 0;
    device_->use();
    device_->check(device_->driver_->resident_blocks(&blocks, function_, threads, 0), "does not tell its occupancy");
    return blocks;
}

CudaQueue::CudaQueue(std::shared_ptr<const CudaDevice> device) : device_(std::move(device)) {
    device_->use();
    {
        const std::lock_guard lock(device_->mutex_);
        if (!device_->streams_.empty()) {
            stream_ = device_->streams_.back();
            device_->streams_.pop_back();
        }
    }
    if (stream_ == nullptr)
        device_->check(device_->driver_->stream_create(&stream_, queue_of_its_own), "has no queue left");
}

CudaQueue::~CudaQueue() {
    if (device_->driver_->context_set(device_->context_) != 0) return;
    device_->driver_->stream_wait(stream_);
    const std::lock_guard lock(device_->mutex_);
    device_->streams_.push_back(stream_);
    device_->spare_.insert(memory_.begin(), memory_.end());
}

void* CudaQueue::allocate(std::size_t bytes) {
    CudaDriver::Address address = 0;
    device_->use();
    {
        const std::lock_guard lock(device_->mutex_);
        if (const auto found = device_->spare_.find(bytes); found != device_->spare_.end()) {
            address = found->second;
            device_->spare_.erase(found);
        }
    }
    if (address == 0) {
        int result = device_->driver_->allocate(&address, bytes);
        if (result == out_of_memory) {
            device_->release_spare();
            result = device_->driver_->allocate(&address, bytes);
        }
        device_->check(result, "cannot hold the trajectories");
    }
    memory_.emplace_back(bytes, address);
    return reinterpret_cast<void*>(address);
}

void CudaQueue::upload(void* to, const void* from, std::size_t bytes) {
    device_->use();
    device_->check(device_->driver_->upload(address_of(to), from, bytes, stream_), "does not take the trajectories");
}

void CudaQueue::download(void* to, const void* from, std::size_t bytes) {
    device_->use();
    device_->check(device_->driver_->download(to, address_of(from), bytes, stream_),
                   "does not give the trajectories back");
    wait();
}

void CudaQueue::launch(const CudaFunction& function, std::int64_t count, int block, void** arguments) {
    device_->use();
    const auto blocks = static_cast<unsigned>((count + block - 1) / block);
    device_->check(device_->driver_->launch(function.function_, blocks, 1, 1, static_cast<unsigned>(block), 1, 1, 0,
                                            stream_, arguments, nullptr),
                   "does not begin the steps");
}

void CudaQueue::wait() {
    device_->use();
    device_->check(device_->driver_->stream_wait(stream_), "failed in the steps");
}

}  // namespace lobatto
