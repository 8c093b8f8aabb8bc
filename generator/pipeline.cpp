// SPDX-License-Identifier: GPL-2.0-or-later
// The one place that calls the stages in order.
#include "generator/pipeline.hpp"

#include "generator/programs.hpp"

namespace lobatto {

Derivation derive(const Scene& scene) {
    System system = build_system(scene);
    Quadrature quadrature = quadrature_of(scene.method);
    Discretisation discretisation = discretise(system, quadrature);
    Structure structure = find_structure(system);
    return {scene, std::move(system), std::move(quadrature), std::move(discretisation), std::move(structure)};
}

KernelSource emit(const Derivation& derivation, const EmitOptions& options) {
    const Scene& scene = derivation.scene;
    try {
        return emit_kernel(derivation, build_programs(derivation), options);
    } catch (const DomainError& error) {
        scene.source.fail(scene.lagrangian_at,
                          std::string("no kernel can be written for the Lagrangian: ") + error.what());
    }
}

}  // namespace lobatto
