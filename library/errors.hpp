// SPDX-License-Identifier: GPL-2.0-or-later
// What the parts of the program throw becomes an Error of lobatto.hpp, which has an exit code: here and nowhere else.
#pragma once

#include <exception>
#include <functional>
#include <type_traits>

#include "library/include/lobatto/lobatto.hpp"

namespace lobatto::api {

// What a function of the caller threw, on its way through our work.
struct ThrownByCaller {
    std::exception_ptr what;
};

// Asks a function of the caller whether to go on.
template <class... Values>
bool ask(const std::function<bool(Values...)>& function, const std::type_identity_t<Values>&... values) {
    try {
        return function(values...);
    } catch (...) {
        throw ThrownByCaller{std::current_exception()};
    }
}

// Throws anew what is being handled; what the caller's own functions threw stays as it was.
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
