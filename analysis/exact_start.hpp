// SPDX-License-Identifier: GPL-2.0-or-later
// Where a scene starts, to 60 digits, for a kernel of any number type.
#pragma once

#include <vector>

#include "generator/scene/scene.hpp"
#include "runtime/build/library.hpp"

namespace lobatto {

struct ExactStart {
    std::vector<GiNaC::numeric> parameters, q, rate;
    bool from_velocity = false;  // rate: velocities, else momenta

    explicit ExactStart(const Scene& scene);
};

// Each value as the sum of `parts` doubles (NumberStepper), the first its rounded value.
std::vector<double> parts_of(const std::vector<GiNaC::numeric>& values, std::size_t parts);

// Nearly rounded: the sum of the value's leading doubles.
template <class real>
real number_of(GiNaC::numeric value) {
    real sum = 0;
    for (int part = 0; part < 3; ++part) {
        const double leading = value.to_double();
        sum += static_cast<real>(leading);
        value -= GiNaC::numeric(leading);
    }
    return sum;
}
template <>
inline float number_of<float>(GiNaC::numeric value) {
    return static_cast<float>(value.to_double());
}
template <>
inline double number_of<double>(GiNaC::numeric value) {
    return value.to_double();
}

template <class real>
struct StartIn {
    std::vector<real> parameters, q, p;
};

// ComputationError when the kernel cannot be prepared with these parameters and this step. A kernel may have the time
// as one coordinate more than the scene of the start.
template <class real>
StartIn<real> start_in(const ExactStart& start, const Kernel& kernel, real step);

}  // namespace lobatto
