// SPDX-License-Identifier: GPL-2.0-or-later
// What is told on standard error: warnings, errors, progress.
#pragma once

#include <fmt/format.h>

#include <cstdio>
#include <string>
#include <utility>

namespace lobatto {

// Where it cannot be written nothing more can be told, and the exit code still says it.
template <class... Values>
void tell(fmt::format_string<Values...> text, Values&&... values) {
    std::fputs(fmt::format(text, std::forward<Values>(values)...).c_str(), stderr);
}

}  // namespace lobatto
