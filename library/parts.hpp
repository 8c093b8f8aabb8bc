// SPDX-License-Identifier: GPL-2.0-or-later
// What stands behind the classes of lobatto.hpp, and the way in: one thread derives at a time.
#pragma once

#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "analysis/accuracy/formulas/domains.hpp"
#include "analysis/columns.hpp"
#include "analysis/kernel/kernel_of.hpp"
#include "analysis/method_choice.hpp"
#include "analysis/motion.hpp"
#include "analysis/tape.hpp"
#include "generator/mechanics/derivation.hpp"
#include "library/errors.hpp"

namespace lobatto::api {

struct Scene::Parts {
    lobatto::Scene scene;
    std::vector<Variable> coordinates, parameters, inputs;
    std::vector<std::string> events;
    double step, until;
};

// Of parameters: above zero, or not below it.
struct Required {
    Tape value;
    bool may_vanish;
    std::string complaint;
};
std::vector<Required> required_of(const lobatto::Scene& scene);
inline constexpr double least_parameter = 1e-300;  // in size, other than 0
// InputError where one of the `count` parameters from `first` on, which have changed, is no number, or where all of
// them together are no values that the scene allows.
void check_change(const std::vector<Required>& required, const std::vector<double>& parameters, std::size_t first,
                  std::size_t count);

struct Kernel::Parts {
    lobatto::Scene scene;  // with its method and values
    lobatto::Kernel kernel;
    std::string digest;
    TrajectoryRequest start;  // of the scene, in numbers
    std::vector<Variable> coordinates, parameters, inputs;
    std::vector<std::string> events;
    std::vector<Required> required;
    Domains domains;  // of the scene's formulas
    ColumnFormulas columns;
    std::vector<std::string> column_names;
};

// Formulas are not made for several threads.
std::recursive_mutex& algebra();

template <class Work>
decltype(auto) in_algebra(Work&& work) {
    return guarded([&] {
        const std::lock_guard lock(algebra());
        return work();
    });
}

// Their reference counts are not made for several threads either: formulas are destroyed under the same lock.
struct DestroyInAlgebra {
    template <class T>
    void operator()(T* held) const {
        const std::lock_guard lock(algebra());
        delete held;
    }
};
template <class T>
std::shared_ptr<T> shared_in_algebra(T* made) {
    return std::shared_ptr<T>(made, DestroyInAlgebra());
}

MethodChoice method_of(const Settings& settings);
Overrides overrides_of(const Settings& settings);
// {"m", "2"} of "m=2", for Settings::set.
std::pair<std::string, std::string> named_value(const std::string& argument);
// InputError where values are set: `what` is of the scene with all its values as they are written.
void refuse_values(const Settings& settings, const std::string& what);
// The scene, by another method; values are set later, because one kernel serves all of them.
lobatto::Scene with_method(const Scene& scene, const Settings& settings);
// One that no file has: what was read, changed in memory.
Scene scene_of(lobatto::Scene changed);

// With their initial positions and their values.
std::vector<Variable> coordinates_of(const lobatto::Scene& scene);
std::vector<Variable> parameters_of(const lobatto::Scene& scene);
std::vector<Variable> inputs_of(const lobatto::Scene& scene);
std::vector<std::string> events_of(const lobatto::Scene& scene);
// Among parameters, by name; InputError where there is none.
std::size_t index_of(const std::vector<Variable>& parameters, const std::string& name);

}  // namespace lobatto::api
