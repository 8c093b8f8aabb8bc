// SPDX-License-Identifier: MIT
// NVIDIA's driver, libcuda.so.1, loaded when it is asked for: a device, memory on it, launches. Nothing of CUDA is
// needed to build this, or to run what asks for no device.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

namespace lobatto {

struct CudaDriver;  // its functions

class CudaDevice {
public:
    // The first device that the driver shows. MachineError: what is missing, and what to do.
    static std::shared_ptr<const CudaDevice> open();
    ~CudaDevice();
    CudaDevice(const CudaDevice&) = delete;
    CudaDevice& operator=(const CudaDevice&) = delete;

    const std::string& name() const { return name_; }                  // "NVIDIA H200"
    const std::string& architecture() const { return architecture_; }  // "sm_90"
    int multiprocessors() const { return multiprocessors_; }
    std::size_t free_memory() const;  // bytes, what queues left behind with them

private:
    friend class CudaFunction;
    friend class CudaQueue;
    CudaDevice() = default;
    void use() const;                                // by the calling thread, from now on
    void check(int result, const char* what) const;  // MachineError where a call failed

    std::shared_ptr<const CudaDriver> driver_;
    int device_ = 0;
    void* context_ = nullptr;
    std::string name_, architecture_;
    int multiprocessors_ = 0;
    // What queues have left, for the next ones: making it, and giving it back, holds up all that goes on on the device.
    mutable std::mutex mutex_;
    mutable std::multimap<std::size_t, std::uint64_t> spare_;  // memory, by bytes
    mutable std::vector<void*> streams_;
    void release_spare() const;
};

// A function of a cubin.
class CudaFunction {
public:
    CudaFunction(std::shared_ptr<const CudaDevice> device, const std::string& cubin, const char* name);
    ~CudaFunction();
    CudaFunction(const CudaFunction&) = delete;
    CudaFunction& operator=(const CudaFunction&) = delete;

    const std::shared_ptr<const CudaDevice>& device() const { return device_; }
    int registers() const;            // of a thread
    int resident(int threads) const;  // blocks of so many threads that a multiprocessor holds at once

private:
    friend class CudaQueue;
    std::shared_ptr<const CudaDevice> device_;
    void *module_ = nullptr, *function_ = nullptr;
};

// What one thread of the host asks of a device, in this order; with memory on the device.
class CudaQueue {
public:
    explicit CudaQueue(std::shared_ptr<const CudaDevice> device);
    ~CudaQueue();
    CudaQueue(const CudaQueue&) = delete;
    CudaQueue& operator=(const CudaQueue&) = delete;

    // Memory of the device, which lives as long as the queue.
    void* allocate(std::size_t bytes);
    void upload(void* to, const void* from, std::size_t bytes);
    void download(void* to, const void* from, std::size_t bytes);  // when all before it is done
    // One thread for each of `count`, in blocks of `block`; arguments as of cuLaunchKernel.
    void launch(const CudaFunction& function, std::int64_t count, int block, void** arguments);
    void wait();

private:
    std::shared_ptr<const CudaDevice> device_;
    void* stream_ = nullptr;
    std::vector<std::pair<std::size_t, std::uint64_t>> memory_;  // bytes, address
};

}  // namespace lobatto
