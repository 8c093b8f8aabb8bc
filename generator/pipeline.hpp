// SPDX-License-Identifier: GPL-2.0-or-later
// The one place that calls the stages in order: scene -> system -> quadrature -> structure -> programs -> passes ->
// kernel source. The programs, optimised, are the same for all who ask: optimised_programs (generator/programs).
#pragma once

#include "generator/emit/kernel.hpp"
#include "generator/emit/plain.hpp"
#include "generator/mechanics/derivation.hpp"

namespace lobatto {

Derivation derive(const Scene& scene, Shortcuts shortcuts = Shortcuts::all);
// The same for who only writes and runs the kernel: where hundreds of terms are one formula, the derivatives of each
// are not written out (System::unwritten).
Derivation derive_kernel(const Scene& scene, Shortcuts shortcuts = Shortcuts::all);
// The same system by another member of the family: only what depends on it is found anew.
Derivation with_method(const Derivation& derivation, const Method& method);
KernelSource emit(const Derivation& derivation, const EmitOptions& options = {});
// The integrator as a textbook prints it. InputError where a scene or its method has no such text.
PlainSource emit_plain(Scene scene, Precision precision);

}  // namespace lobatto
