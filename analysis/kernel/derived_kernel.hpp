// SPDX-License-Identifier: GPL-2.0-or-later
// Derivations are kept like compiled kernels: the same scene is derived once.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "generator/emit/kernel.hpp"
#include "generator/mechanics/outline.hpp"

namespace lobatto {

// The text of a scene's kernel, and what a run asks of the derivation beside it.
struct DerivedKernel {
    Outline outline;
    KernelSource source;  // without the passes' report where it was kept
    bool from_cache = false;
    std::shared_ptr<const Derivation> derivation;  // where it was derived now
};

// What a kernel is to have beside what its scene asks for.
struct KernelWish {
    Precision precision = Precision::double_;
    Shortcuts shortcuts = Shortcuts::all;
    // Where this holds it computes the energy, also where the scene does not ask for it.
    bool (*wants_energy)(const Outline&) = nullptr;
};

// Derives and emits, or finds what was kept of that: by the text of the scene and of its tables, its method and what it
// keeps, and by the build of this program. `known`: a derivation of this very scene, if there is one.
// Throws InputError; MachineError where there is no folder to keep things in.
// `with_values`: the scene with other values of parameters, which decide where a start is none with its own.
DerivedKernel derived_kernel(const Scene& scene, const KernelWish& wish, const Derivation* known = nullptr,
                             const std::function<Scene()>& with_values = {});

}  // namespace lobatto
