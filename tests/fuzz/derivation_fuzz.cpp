// SPDX-License-Identifier: GPL-2.0-or-later
// Fuzz target: whatever the Lagrangian, from reading to the emitted text there is a kernel or an InputError; nothing of
// the text but what belongs there.
#include <cstdlib>

#include "generator/pipeline.hpp"
#include "tests/fuzz/formula_scene.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    try {
        const lobatto::KernelSource source =
            lobatto::emit(lobatto::derive(lobatto::read_scene(lobatto::formula_scene(data, size))));
        for (const char c : source.header)
            if (c != '\n' && (c < ' ' || c == '`' || c == '\x7f')) std::abort();  // the template's text is ASCII
    } catch (const lobatto::InputError&) {
    }
    return 0;
}
