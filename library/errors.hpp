// SPDX-License-Identifier: GPL-2.0-or-later
// What the parts of the program throw becomes an Error of lobatto.hpp, which has an exit code: here and nowhere else.
#pragma once

#include "library/include/lobatto/lobatto.hpp"

namespace lobatto::api {

// Throws anew what is being handled. What is no std::exception stays as it is.
[[noreturn]] void rethrow();

template <class Work>
decltype(auto) guarded(Work&& work) {
    try {
        return work();
    } catch (...) {
        rethrow();
    }
}

}  // namespace lobatto::api
