// SPDX-License-Identifier: MIT
#include "runtime/run/other_velocity.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "runtime/error.hpp"
#include "runtime/kernel/base/double_double.hpp"
#include "runtime/run/parts.hpp"
#include "runtime/run/trajectory.hpp"

namespace lobatto {

namespace {

// Whether two velocities with the momentum p are two, and not one and its rounding: between two the momentum is another
// one. Compared are products of momenta and velocities, so that units do not matter. momentum_of(v): the momentum of v.
// False where the other one has not this momentum: it is not found to the last digits, as near the speed of light.
template <class MomentumOf>
bool are_two(const std::vector<double>& one, const std::vector<double>& other, const std::vector<double>& p,
             double epsilon, const MomentumOf& momentum_of) {
    constexpr double roundings = 64, alike = 1e5;
    double apart = 0, size = 0, off = 0;
    const std::vector<double> again = momentum_of(other);
    for (std::size_t k = 0; k < one.size(); ++k) {
        off += std::fabs((again[k] - p[k]) * (other[k] - one[k]));
        size += std::fabs(p[k]) * (std::fabs(one[k]) + std::fabs(other[k]));
    }
    for (const double part : {0.3, 0.7}) {  // at 0.5 the momentum may be p once more, as of v^3 - v
        std::vector<double> between(one.size());
        for (std::size_t k = 0; k < one.size(); ++k) between[k] = one[k] + part * (other[k] - one[k]);
        const std::vector<double> there = momentum_of(between);
        for (std::size_t k = 0; k < one.size(); ++k) {
            apart += std::fabs((there[k] - p[k]) * (other[k] - one[k]));
            size += std::max(std::fabs(there[k]), std::fabs(p[k])) * (std::fabs(one[k]) + std::fabs(other[k]));
        }
    }
    return off <= alike * epsilon * apart && apart > roundings * epsilon * size;
}

template <class real>
std::vector<double> in_double(const std::vector<real>& x) {
    std::vector<double> numbers;
    for (const real& value : x) numbers.push_back(static_cast<double>(value));
    return numbers;
}

}  // namespace

template <class real>
std::vector<double> other_velocity(const LoadedStepper<real>& stepper, real time, const std::vector<real>& q,
                                   const std::vector<real>& velocity, const std::vector<real>& p) {
    std::vector<real> found;
    if (stepper.kernel()->form != LOBATTO_GENERAL || stepper.velocity(time, q, p, found) != LOBATTO_OK) return {};
    const bool two = are_two(in_double(velocity), in_double(found), in_double(p),
                             std::max(stepper.kernel()->epsilon, 0x1p-52), [&](const std::vector<double>& v) {
                                 return in_double(stepper.momentum(time, q, std::vector<real>(v.begin(), v.end())));
                             });
    return two ? in_double(found) : std::vector<double>();
}

template <class real>
std::vector<real> momentum_of_start(const LoadedStepper<real>& stepper, real time, const std::vector<real>& q,
                                    const std::vector<real>& velocity, const std::string& place) {
    const std::vector<real> p = stepper.momentum(time, q, velocity);
    const std::vector<double> other = other_velocity(stepper, time, q, velocity, p);
    if (!other.empty())
        throw ComputationError(
            fmt::format("{}the momentum of the start belongs to several velocities. Kernels keep positions and "
                        "momenta, so its steps would begin with {} instead of {}. Try another start, or a Lagrangian "
                        "whose mass matrix d2L/dq'dq' is positive for all velocities",
                        place, list_text(other), list_text(in_double(velocity))));
    return p;
}

#define LOBATTO_FOR(real)                                                                                    \
    template std::vector<double> other_velocity(const LoadedStepper<real>&, real, const std::vector<real>&,  \
                                                const std::vector<real>&, const std::vector<real>&);         \
    template std::vector<real> momentum_of_start(const LoadedStepper<real>&, real, const std::vector<real>&, \
                                                 const std::vector<real>&, const std::string&);
LOBATTO_FOR(float)
LOBATTO_FOR(double)
LOBATTO_FOR(long double)
LOBATTO_FOR(DoubleDouble)
LOBATTO_FOR(__float128)
#undef LOBATTO_FOR

std::vector<double> other_velocity(const NumberStepper& stepper, const NumberStepper::Parts& time,
                                   const NumberStepper::Parts& q, const NumberStepper::Parts& velocity,
                                   const NumberStepper::Parts& p) {
    NumberStepper::Parts found;
    if (stepper.kernel()->form != LOBATTO_GENERAL || stepper.velocity(time, q, p, found) != LOBATTO_OK) return {};
    const std::size_t parts = stepper.parts();
    found = rounded(found, parts);
    const bool two = are_two(
        rounded(velocity, parts), found, rounded(p, parts), std::max(stepper.kernel()->epsilon, 0x1p-52),
        [&](const std::vector<double>& v) { return rounded(stepper.momentum(time, q, as_parts(v, parts)), parts); });
    return two ? found : std::vector<double>();
}

}  // namespace lobatto
