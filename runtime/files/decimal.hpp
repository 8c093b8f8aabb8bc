// SPDX-License-Identifier: MIT
// Numbers of more digits than a double has, as decimals and back: sums of doubles ("parts"), the first of which is the
// rounded value.
#pragma once

#include <string>
#include <string_view>

namespace lobatto {

// A text that reads back to the same parts: the shortest for one part; else of as many digits as the type has, and more
// only where a number needs them.
std::string decimal_text(const double* parts, int count);

// False where the text is no decimal number.
bool read_decimal(std::string_view text, double* parts, int count);

}  // namespace lobatto
