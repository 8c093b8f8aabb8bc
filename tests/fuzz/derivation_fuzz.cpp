// SPDX-License-Identifier: GPL-2.0-or-later
// Fuzz target: whatever the formula, from reading to the emitted text there is a kernel or an InputError; nothing of
// the text but what belongs there. The length chooses what the formula stands for.
#include <cstdlib>

#include "generator/pipeline.hpp"
#include "tests/fuzz/formula_scene.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    try {
        const auto kind = static_cast<lobatto::FormulaScene>(size % lobatto::formula_scenes);
        const lobatto::KernelSource source =
            lobatto::emit(lobatto::derive(lobatto::read_scene(lobatto::formula_scene(kind, data, size))));
        for (const char c : source.header)
            if (c != '\n' && (c < ' ' || c == '`' || c == '\x7f')) std::abort();  // the template's text is ASCII
    } catch (const lobatto::InputError&) {
    }
    return 0;
}
