// SPDX-License-Identifier: MIT
// SHA-256 (FIPS 180-4), which names the entries of the cache and seals their objects.
#pragma once

#include <string>
#include <string_view>

namespace lobatto {

// 64 hexadecimal digits.
std::string sha256(std::string_view message);

}  // namespace lobatto
