// SPDX-License-Identifier: GPL-2.0-or-later
// The compiled kernel of a scene, and which values of its parameters are allowed.
#include <fmt/format.h>

#include <cmath>

#include "analysis/accuracy/watch/energy_watch.hpp"
#include "analysis/kernel/derived_kernel.hpp"
#include "generator/mechanics/start.hpp"
#include "library/parts.hpp"

namespace lobatto::api {

Kernel::Kernel(std::shared_ptr<const Parts> parts) : parts_(std::move(parts)) {}

const std::string& Kernel::digest() const {
    return parts_->digest;
}
std::string Kernel::method() const {
    return parts_->kernel->method;
}
int Kernel::order() const {
    return parts_->kernel->order;
}
double Kernel::step() const {
    return parts_->start.step;
}
const std::vector<Variable>& Kernel::coordinates() const {
    return parts_->coordinates;
}
const std::vector<Variable>& Kernel::parameters() const {
    return parts_->parameters;
}
const std::vector<Variable>& Kernel::inputs() const {
    return parts_->inputs;
}
const std::vector<std::string>& Kernel::events() const {
    return parts_->events;
}
const std::vector<std::string>& Kernel::column_names() const {
    return parts_->column_names;
}

std::vector<Required> required_of(const lobatto::Scene& scene) {
    std::vector<GiNaC::symbol> symbols;
    for (const Parameter& parameter : scene.parameters) symbols.push_back(parameter.symbol);
    std::vector<Required> all;
    for (const Requirement& requirement : scene.requirements)
        all.push_back({Tape::of(requirement.value, symbols).value(), requirement.may_vanish, requirement.complaint});
    return all;
}

void check_change(const std::vector<Required>& required, const std::vector<double>& parameters, std::size_t first,
                  std::size_t count) {
    constexpr double most = 1e300;
    for (std::size_t i = first; i < first + count; ++i)
        if (const double size = std::fabs(parameters[i]); !(size == 0 || (size >= least_parameter && size <= most)))
            throw InputError(fmt::format(
                "{} is no value of a parameter: it must be 0, or of a size between 1e-300 and 1e300", parameters[i]));
    for (const Required& one : required) {
        const double value = one.value(parameters);
        if (!(value > 0 || (one.may_vanish && value == 0))) throw InputError(one.complaint);
    }
}

namespace {

std::vector<std::string> column_names_of(const lobatto::Scene& scene) {
    std::vector<std::string> names;
    for (const Column& column : scene.outputs.columns) names.push_back(column.name);
    return names;
}

}  // namespace

Kernel compile(const Scene& scene, const Settings& settings) {
    return in_algebra([&] {
        lobatto::Scene changed = with_method(scene, settings);
        if (changed.method.numbers != Precision::double_)
            throw InputError(fmt::format(
                "{}: steps that a caller takes are computed in double, but numbers are \"{}\"; leave them out, or use "
                "run(), which computes in all numbers",
                changed.path, precision_name(changed.method.numbers)));
        const Overrides overrides = overrides_of(settings);
        const DerivedKernel derived =
            derived_kernel(changed, {Precision::double_, Shortcuts::all, EnergyWatch::can_watch}, nullptr,
                           with_values(changed, overrides));
        apply(overrides, changed);
        if (!overrides.set.empty()) check_values(changed);
        const Steps steps = steps_of(changed, overrides);
        const lobatto::Kernel kernel = kernel_of(derived.source, Precision::double_);
        LoadedStepper<double> stepper(kernel);
        const TrajectoryRequest start = request_of(changed, steps.count, stepper);
        return Kernel(shared_in_algebra(new const Kernel::Parts{
            changed, kernel, derived.source.digest, start, coordinates_of(changed), parameters_of(changed),
            inputs_of(changed), events_of(changed), required_of(changed), Domains(changed, derived.outline.system),
            ColumnFormulas(changed), column_names_of(changed)}));
    });
}

}  // namespace lobatto::api
