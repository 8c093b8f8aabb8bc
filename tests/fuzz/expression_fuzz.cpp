// SPDX-License-Identifier: GPL-2.0-or-later
// Fuzz target: whatever bytes a formula has, it is read or refused, soon.
#include "generator/scene/scene.hpp"
#include "tests/fuzz/formula_scene.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    try {
        lobatto::read_scene(lobatto::formula_scene(lobatto::FormulaScene::all, data, size));
    } catch (const lobatto::InputError&) {
    }
    return 0;
}
