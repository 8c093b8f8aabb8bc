// SPDX-License-Identifier: MIT
// Memory for an object of a compiled kernel, whose size and alignment are known only at run time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <new>

namespace lobatto {

// Zeroed, so that two objects with the same history have the same bytes.
class AlignedMemory {
public:
    AlignedMemory(std::int64_t bytes, std::int64_t alignment)
        : memory_(::operator new(static_cast<std::size_t>(bytes), std::align_val_t(alignment)),
                  Deleter{std::align_val_t(alignment)}) {
        std::memset(memory_.get(), 0, static_cast<std::size_t>(bytes));
    }
    void* get() const { return memory_.get(); }

private:
    struct Deleter {
        std::align_val_t alignment;
        void operator()(void* memory) const { ::operator delete(memory, alignment); }
    };
    std::unique_ptr<void, Deleter> memory_;
};

}  // namespace lobatto
