// SPDX-License-Identifier: GPL-2.0-or-later
// The contract of kernels as a concept: kernels by hand, emitted ones of every form, and kernels that lack something.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "generated/harmonic_oscillator.hpp"
#include "generated/pendulum.hpp"
#include "runtime/kernel/concept.hpp"
#include "tests/handwritten/chain.hpp"
#include "tests/handwritten/cyclic.hpp"
#include "tests/handwritten/double_pendulum.hpp"
#include "tests/handwritten/driven.hpp"
#include "tests/handwritten/pendulum.hpp"
#include "tests/support.hpp"

using namespace lobatto;

static_assert(SeparableKernel<HandwrittenPendulum>);
static_assert(SeparableKernel<kernels::pendulum>);
static_assert(LinearMapKernel<kernels::harmonic_oscillator>);

namespace {

// Each lacks one thing of a kernel that has all.
struct WithoutNode : HandwrittenPendulum {
    static void node();
};
struct WithoutTable : HandwrittenPendulum {
    static constexpr real A = 0;
};
struct WithTimeThatIsNotThere : HandwrittenPendulum {
    static constexpr bool autonomous = false;
};
struct WithWrongCount : HandwrittenPendulum {
    static constexpr int unknowns = 3;
};
struct WithoutEvents : HandwrittenPendulum {
    static constexpr int events = 1;
};
static_assert(!Kernel<WithoutNode> && !Kernel<WithoutTable> && !Kernel<WithTimeThatIsNotThere> &&
              !Kernel<WithWrongCount> && !Kernel<WithoutEvents>);

// Whether a scene's kernel fulfils the concept, as g++ sees it; its complaints, or "".
std::string complaints(const std::string& scene, const std::string& options) {
    const test::TemporaryFolder folder;
    std::vector<std::string> command = {
        LOBATTO_PROGRAM, "emit", fmt::format("{}/scenes/{}.toml", LOBATTO_SOURCE_DIR, scene), "-o", folder.string()};
    std::istringstream words(options);
    for (std::string word; words >> word;) command.push_back(std::move(word));
    const test::Finished emitted = test::run(command);
    if (emitted.exit_code != 0) return emitted.err;
    test::write_text(folder / "program.cpp",
                     fmt::format("#include \"{0}.hpp\"\n#include \"{1}/runtime/kernel/concept.hpp\"\n"
                                 "static_assert(lobatto::Kernel<lobatto::kernels::{0}>);\n",
                                 scene, LOBATTO_SOURCE_DIR));
    return test::run({"g++", "-std=c++20", "-fsyntax-only", "-I", folder.string(), folder / "program.cpp"}).err;
}

}  // namespace

TEST_CASE("emitted kernels of every form fulfil the contract" * doctest::test_suite("slow")) {
    const char* const lobatto_4 = "";
    const char* const gauss_3 = "--stages 3";
    const char* const splitting = "--splitting 11";
    const char* const clean = "--points 5 --arithmetic clean";
    const std::vector<std::pair<const char*, const char*>> rows = {{"harmonic_oscillator", lobatto_4},
                                                                   {"harmonic_oscillator", splitting},
                                                                   {"pendulum", gauss_3},
                                                                   {"pendulum", splitting},
                                                                   {"pendulum", clean},
                                                                   {"driven_damped_pendulum", lobatto_4},
                                                                   {"double_pendulum", lobatto_4},
                                                                   {"lagrange_top", lobatto_4},
                                                                   {"magnetic_bottle", gauss_3},
                                                                   {"fput_beta", lobatto_4},
                                                                   {"wave_chain", splitting},
                                                                   {"stiff_fput", lobatto_4},
                                                                   {"kapitza_pendulum", lobatto_4},
                                                                   {"triple_pendulum", gauss_3},
                                                                   {"rod_pendulum", lobatto_4},
                                                                   {"quaternion_top", lobatto_4},
                                                                   {"pythagorean", lobatto_4},
                                                                   {"bouncing_ball", lobatto_4},
                                                                   {"flips", lobatto_4}};
    for (const auto& row : rows) {
        INFO(row.first << " " << row.second);
        CHECK(complaints(row.first, row.second) == "");
    }
}
