// SPDX-License-Identifier: GPL-2.0-or-later
// The kernel support headers inside the program: joined whole for programs, and of a library only what its kernel
// stands on.
#include "cli/support_text.hpp"

#include <doctest/doctest.h>

#include <filesystem>
#include <stdexcept>

#include "cli/kernel_of.hpp"
#include "tests/scenes.hpp"

using namespace lobatto;

namespace {

const std::string tree = LOBATTO_SOURCE_DIR;

bool has_part(const std::string& text, const std::string& name) {
    return text.find("#ifndef LOBATTO_KERNEL_" + name + "_HPP\n") != std::string::npos;
}

}  // namespace

TEST_CASE("every support header is a part, stands after those it includes and is joined once") {
    std::size_t parts = 0;
    for (const auto& entry : std::filesystem::directory_iterator(tree + "/runtime")) {
        const std::string name = entry.path().filename();
        if (name.starts_with("kernel_") && name.ends_with(".hpp") && name != "kernel_export.hpp") ++parts;
    }
    CHECK(support_parts.size() == parts);
    std::string before;
    for (const SupportPart& part : support_parts) {
        CAPTURE(part.name);
        CHECK(part.text == test::read_file(tree + "/runtime/" + std::string(part.name)));
        for (std::size_t at = part.text.find("#include \""); at != std::string::npos;
             at = part.text.find("#include \"", at + 1)) {
            const std::string line(part.text.substr(at, part.text.find('\n', at) - at));
            CAPTURE(line);
            CHECK(before.find(line) != std::string::npos);
        }
        before += "#include \"" + std::string(part.name) + "\"\n";
        CHECK(has_part(support_text({std::string(part.name)}), "NUMBERS"));
    }
    const std::string whole = support_text();
    CHECK(whole.find("#include \"") == std::string::npos);
    const std::string guard = "#ifndef LOBATTO_KERNEL_PACK_HPP\n";
    CHECK(whole.find(guard) == whole.rfind(guard));
    CHECK_THROWS_AS(support_text({"kernel_nothing.hpp"}), std::logic_error);
}

TEST_CASE("a kernel's library is compiled from the steppers of its form only") {
    const KernelSource separable = emit(derive(test::pendulum_scene(4)));
    const KernelSource general =
        emit(derive(test::scene_of("(1 + x^2)*x'^2/2 - x^2", "x = { position = 1, velocity = 0 }", 4)));
    const std::string one = translation_of(separable, Precision::double_).text;
    CHECK(has_part(one, "SEPARABLE"));
    for (const char* other : {"GENERAL", "GALERKIN", "EXPLICIT", "CLEAN", "ENSEMBLE"})
        CHECK_FALSE(has_part(one, other));
    const std::string any = translation_of(general, Precision::double_).text;
    CHECK(has_part(any, "GENERAL"));
    for (const char* other : {"SEPARABLE", "SWEEPS", "ROWS", "EXPLICIT", "CLEAN", "ENSEMBLE"})
        CHECK_FALSE(has_part(any, other));
    CHECK(has_part(translation_of(separable, Precision::double_, 8).text, "ENSEMBLE"));
}
