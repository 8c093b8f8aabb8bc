// SPDX-License-Identifier: GPL-2.0-or-later
// What stands behind the classes of lobatto.hpp, and the way in and out: one thread derives at a time, and errors
// become those of the library.
#pragma once

#include <mutex>
#include <new>
#include <system_error>

#include "analysis/kernel/kernel_of.hpp"
#include "analysis/method_choice.hpp"
#include "analysis/motion.hpp"
#include "generator/mechanics/derivation.hpp"
#include "library/include/lobatto/lobatto.hpp"
#include "runtime/error.hpp"

namespace lobatto::api {

struct Scene::Parts {
    lobatto::Scene scene;
    std::vector<Variable> coordinates, parameters, inputs;
    std::vector<std::string> events;
    double step, until;
};

struct Kernel::Parts {
    lobatto::Scene scene;  // with its method and values
    lobatto::Kernel kernel;
    std::string digest;
    TrajectoryRequest start;  // of the scene, in numbers
    std::vector<Variable> coordinates, parameters, inputs;
    std::vector<std::string> events;
};

// Formulas are not made for several threads.
std::recursive_mutex& algebra();

// What the parts of the program throw, as what the library throws.
[[noreturn]] void rethrow();

template <class Work>
auto guarded(Work&& work) {
    try {
        return work();
    } catch (...) {
        rethrow();
    }
}

template <class Work>
auto in_algebra(Work&& work) {
    return guarded([&] {
        const std::lock_guard lock(algebra());
        return work();
    });
}

MethodChoice method_of(const Settings& settings);
Overrides overrides_of(const Settings& settings);
// The scene, by another method; values are set later, because one kernel serves all of them.
lobatto::Scene with_method(const Scene& scene, const Settings& settings);

// With their initial positions and their values.
std::vector<Variable> coordinates_of(const lobatto::Scene& scene);
std::vector<Variable> parameters_of(const lobatto::Scene& scene);
std::vector<Variable> inputs_of(const lobatto::Scene& scene);
std::vector<std::string> events_of(const lobatto::Scene& scene);

}  // namespace lobatto::api
