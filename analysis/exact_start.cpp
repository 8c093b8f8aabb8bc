// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/exact_start.hpp"

#include <cln/cln.h>

#include "generator/mechanics/start.hpp"
#include "runtime/error.hpp"
#include "runtime/kernel/base/double_double.hpp"
#include "runtime/run/other_velocity.hpp"

namespace lobatto {

ExactStart::ExactStart(const Scene& scene) : from_velocity(scene.start == Start::velocity) {
    for (const Parameter& parameter : scene.parameters)
        parameters.push_back(scene.evaluate(parameter.value, "the parameter " + parameter.name));
    if (!scene.constraints.empty()) {
        const StartOnConstraints start = start_on_constraints(scene, build_system(scene));
        for (const cln::cl_R& position : start.q) q.emplace_back(position);
        for (const cln::cl_R& velocity : start.v) rate.emplace_back(velocity);
        from_velocity = true;
        return;
    }
    for (std::size_t k = 0; k < scene.coordinates.size(); ++k) {
        const std::string& name = scene.coordinates[k].name;
        q.push_back(scene.evaluate(scene.initial_position[k], "the initial position of " + name));
        rate.push_back(scene.evaluate(
            scene.initial_rate[k], (from_velocity ? "the initial velocity of " : "the initial momentum of ") + name));
    }
}

std::vector<double> parts_of(const std::vector<GiNaC::numeric>& values, std::size_t parts) {
    std::vector<double> numbers;
    for (const GiNaC::numeric& value : values) {
        cln::cl_RA rest = cln::rational(cln::the<cln::cl_R>(value.to_cl_N()));
        for (std::size_t part = 0; part < parts; ++part) {
            numbers.push_back(cln::double_approx(rest));
            rest = rest - cln::rational(cln::cl_float(numbers.back()));
        }
    }
    return numbers;
}

template <class real>
StartIn<real> start_in(const ExactStart& start, const Kernel& kernel, real step) {
    const auto all = [](const std::vector<GiNaC::numeric>& values) {
        std::vector<real> converted;
        for (const GiNaC::numeric& value : values) converted.push_back(number_of<real>(value));
        return converted;
    };
    StartIn<real> result{all(start.parameters), all(start.q), all(start.rate)};
    if (static_cast<std::size_t>(kernel->coordinates) == result.q.size() + 1) {  // of a clock that knows the time (D64)
        result.q.push_back(real(0));
        result.p.push_back(start.from_velocity ? real(1) : real(0));
    }
    LoadedStepper<real> stepper(kernel);
    const lobatto_status status = stepper.prepare(result.parameters, step);
    if (status != LOBATTO_OK)
        throw ComputationError(status == LOBATTO_SINGULAR_MASS
                                   ? "the mass matrix has no inverse for the scene's parameters"
                                   : "the kernel's coefficients are not finite for the scene's parameters and step");
    if (start.from_velocity) {
        result.p = momentum_of_start(stepper, real(0), result.q, result.p);
    } else if (kernel->clocked != 0 && stepper.start(real(0), result.q, result.p) == LOBATTO_OK) {
        real time;  // the kernel knows the momentum of the time
        stepper.state(time, result.q, result.p);
    }
    return result;
}

template StartIn<float> start_in(const ExactStart&, const Kernel&, float);
template StartIn<double> start_in(const ExactStart&, const Kernel&, double);
template StartIn<long double> start_in(const ExactStart&, const Kernel&, long double);
template StartIn<DoubleDouble> start_in(const ExactStart&, const Kernel&, DoubleDouble);
template StartIn<__float128> start_in(const ExactStart&, const Kernel&, __float128);

}  // namespace lobatto
