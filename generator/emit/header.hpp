// SPDX-License-Identifier: GPL-2.0-or-later
// The header of a kernel for people: what it is, and its formulas with the values of the scene.
#pragma once

#include <string>

#include "generator/emit/kernel.hpp"

namespace lobatto {

struct Scene;

// Left out: zeros, without units. The text is the same whatever they are.
enum class Values { of_scene, left_out };

// struct Parameters, and `parameter`, which finds one by its number.
std::string parameters(const Scene& scene, Precision precision, Values values);

// The text of NAME.hpp; of `source` all else is there.
std::string header(const Derivation& derivation, const KernelSource& source, const EmitOptions& options);

// Whether a program steps the kernel by lobatto::HybridStepper, which looks for events; else by lobatto::Stepper.
bool has_hybrid_stepper(const Scene& scene);
// "tolerance = 1e-06": how a program asks its stepper for the tolerance of the scene. Empty: nothing is iterated to
// one.
std::string tolerance_setting(const Scene& scene, StepForm form);

}  // namespace lobatto
