// SPDX-License-Identifier: GPL-2.0-or-later
// Fuzz target: whatever bytes a scene file has, read_scene answers with a Scene or an InputError, soon.
#include <cstddef>
#include <cstdint>
#include <string>

#include "generator/scene/scene.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    try {
        lobatto::read_scene(lobatto::Source("scene.toml", std::string(reinterpret_cast<const char*>(data), size)));
    } catch (const lobatto::InputError&) {
    }
    return 0;
}
