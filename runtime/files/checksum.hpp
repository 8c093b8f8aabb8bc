// SPDX-License-Identifier: MIT
// A checksum that detects altered bytes, and takes hardly any time beside writing them. It gives no protection against
// forgery; SHA-256 does.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace lobatto {

// How far a file was written, and what was.
struct Written {
    std::int64_t size = 0;  // bytes
    std::uint64_t checksum = 0;
    bool operator==(const Written&) const = default;
};

class Checksum {
public:
    void add(std::string_view bytes);
    Written written() const;  // all that was added, however it was divided

private:
    std::uint64_t state_ = 0;
    std::int64_t size_ = 0;
    std::string rest_;  // less than a word
};

}  // namespace lobatto
