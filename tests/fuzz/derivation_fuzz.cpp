// SPDX-License-Identifier: GPL-2.0-or-later
// Fuzz target: whatever the formula, from reading to the emitted text there is a kernel or an InputError; nothing of
// the text but what belongs there. The length chooses what the formula stands for; after '=' it is the whole
// Lagrangian.
#include <cstdlib>

#include "generator/pipeline.hpp"
#include "tests/fuzz/formula_scene.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    try {
        auto kind = static_cast<lobatto::FormulaScene>(size % lobatto::formula_scenes);
        if (size > 0 && *data == lobatto::whole_mark) ++data, --size, kind = lobatto::FormulaScene::whole;
        const lobatto::KernelSource source =
            lobatto::emit(lobatto::derive(lobatto::read_scene(lobatto::formula_scene(kind, data, size))));
        for (const char c : source.header)
            if (c != '\n' && (c < ' ' || c == '`' || c == '\x7f')) std::abort();  // the template's text is ASCII
    } catch (const lobatto::InputError&) {
    }
    return 0;
}
