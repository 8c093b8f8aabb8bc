// SPDX-License-Identifier: MIT
// The shared object of a compiled kernel, loaded, and a table of functions in it, checked.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

namespace lobatto {

// Unloads it with the last copy.
class KernelObject {
public:
    KernelObject() = default;
    explicit KernelObject(std::string path);  // MachineError

    // The table that the function of this name returns. Throws MachineError when it is of another version of the
    // interface, of another size, or of other formulas.
    template <class Table>
    const Table* table(const char* function, const std::string& expected_digest) const {
        const Table* const table = reinterpret_cast<const Table* (*)()>(address_of(function))();
        check(table->abi_version, table->bytes, sizeof(Table));
        check(table->digest, expected_digest);
        return table;
    }

private:
    [[noreturn]] void fail(const std::string& reason) const;
    void* address_of(const char* function) const;
    void check(std::int64_t version, std::int64_t bytes, std::int64_t expected_bytes) const;
    void check(const std::string& digest, const std::string& expected) const;

    std::string path_;
    std::shared_ptr<void> library_;
};

}  // namespace lobatto
