// SPDX-License-Identifier: GPL-2.0-or-later
// The names a scene declares, each once, and none that is taken in formulas, in the trajectory or in code.
#pragma once

#include <map>
#include <string>

#include "generator/formula/names.hpp"
#include "generator/formula/text/source.hpp"

namespace lobatto {

class Declarations {
public:
    explicit Declarations(const Source& source) : source_(source) {}

    // Refuses a name that cannot be one of a `what` ("parameter"), or is taken. An array takes x_1 ... x_n too.
    void declare(const std::string& name, Position at, const std::string& what);
    void declare_elements(const std::string& array, Position at, std::size_t count);

    bool is_taken(const std::string& name) const { return taken_.contains(name); }

    Names names;

private:
    struct Taken {
        std::string what;  // "parameter"; of an element: "element 3 of x"
        bool element = false;
    };

    [[noreturn]] void fail(Position at, const std::string& message) const { source_.fail(at, message); }

    const Source& source_;
    std::map<std::string, Taken> taken_;
};

// Element k of an array, counted from 1, in the trajectory and in code: x_3.
std::string element_name(const std::string& array, std::size_t k);

}  // namespace lobatto
