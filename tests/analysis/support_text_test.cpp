// SPDX-License-Identifier: GPL-2.0-or-later
// The kernel support headers inside the program: joined whole for programs, and of a library only what its kernel
// stands on.
#include "analysis/kernel/support_text.hpp"

#include <doctest/doctest.h>

#include <filesystem>
#include <set>
#include <stdexcept>

#include "analysis/kernel/kernel_of.hpp"
#include "tests/scenes/scenes.hpp"

using namespace lobatto;

namespace {

const std::filesystem::path kernel = LOBATTO_SOURCE_DIR "/runtime/kernel";

bool has_part(const std::string& text, const std::string& name) {
    return text.find("#ifndef LOBATTO_KERNEL_" + name + "_HPP\n") != std::string::npos;
}

}  // namespace

TEST_CASE("every support header is a part, stands after those it includes and is joined once") {
    std::size_t parts = 0;
    for (const char* folder : {"base", "iteration", "steppers"})
        for (const auto& entry : std::filesystem::directory_iterator(kernel / folder))
            parts += entry.path().extension() == ".hpp";
    CHECK(support_parts.size() == parts);
    std::set<std::string> before;
    for (const SupportPart& part : support_parts) {
        CAPTURE(part.name);
        CHECK(part.text == test::read_file(kernel / part.name));
        for (std::size_t at = part.text.find("#include \""); at != std::string::npos;
             at = part.text.find("#include \"", at + 1)) {
            const std::size_t begin = at + std::string("#include \"").size();
            const std::filesystem::path included(part.text.substr(begin, part.text.find('"', begin) - begin));
            CAPTURE(included);
            CHECK(before.contains((std::filesystem::path(part.name).parent_path() / included).lexically_normal()));
        }
        before.insert(std::string(part.name));
        CHECK(has_part(support_text({std::string(part.name)}), "NUMBERS"));
    }
    const std::string whole = support_text();
    CHECK(whole.find("#include \"") == std::string::npos);
    const std::string guard = "#ifndef LOBATTO_KERNEL_PACK_HPP\n";
    CHECK(whole.find(guard) == whole.rfind(guard));
    CHECK_THROWS_AS(support_text({"base/nothing.hpp"}), std::logic_error);
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
