// SPDX-License-Identifier: GPL-2.0-or-later
// What was derived is found again, and is the same; what changes the kernel is derived anew.
#include "analysis/kernel/derived_kernel.hpp"

#include <doctest/doctest.h>

#include <filesystem>

#include "analysis/kernel/kernel_of.hpp"
#include "generator/pipeline.hpp"
#include "tests/scenes/scenes.hpp"
#include "tests/support.hpp"

using namespace lobatto;

namespace {

Scene read(const std::string& text) {
    return read_scene(Source("scene.toml", text));
}

std::string pendulum(const std::string& more = "") {
    return "lagrangian = \"m*l^2*a'^2/2 + m*g*l*cos(a)\"\n" + more +
           "[coordinates]\na = { position = 1, velocity = 0 }\n[parameters]\nm = 1\nl = 2\ng = 9.81\n"
           "[run]\nstep = 0.1\nuntil = 1\n";
}

bool same(const Outline& a, const Outline& b) {
    bool equal = a.system.autonomous == b.system.autonomous && a.system.linear == b.system.linear &&
                 a.conserves_energy() == b.conserves_energy() && a.scene.outputs.energy == b.scene.outputs.energy &&
                 a.closed_solution.has_value() == b.closed_solution.has_value() && a.system.n == b.system.n &&
                 a.quadrature.points == b.quadrature.points;
    if (equal && a.closed_solution)
        equal = a.closed_solution->kind == b.closed_solution->kind &&
                a.closed_solution->omega_squared.is_equal(b.closed_solution->omega_squared);
    return equal;
}

}  // namespace

TEST_CASE("a scene is derived once, and what is kept of it is what was derived" * doctest::test_suite("slow")) {
    const test::TemporaryFolder folder;
    const test::EnvironmentVariable cache("LOBATTO_CACHE_DIR", (folder / "cache").string());
    for (const char* name : {"pendulum", "kepler", "double_pendulum", "driven_damped_pendulum", "pythagorean",
                             "rod_pendulum", "bouncing_ball", "fput_beta", "magnetic_bottle", "harmonic_oscillator"}) {
        const std::string path = std::string(LOBATTO_SOURCE_DIR "/scenes/") + name + ".toml";
        const Scene scene = read_scene(path);
        INFO(name);
        const DerivedKernel first = derived_kernel(scene, {});
        CHECK_FALSE(first.from_cache);
        const DerivedKernel again = derived_kernel(scene, {});  // the same symbols
        CHECK(again.from_cache);
        CHECK(same(first.outline, again.outline));
        CHECK(same(again.outline, Outline(derive(scene))));
        CHECK(again.source.formulas == emit(derive(scene)).formulas);
        CHECK(again.source.support == first.source.support);
        CHECK(again.source.name == first.source.name);
        CHECK(again.source.form == first.source.form);
        CHECK(again.source.digest == first.source.digest);
        for (std::size_t k = 0; k < again.outline.system.momentum.size(); ++k)
            CHECK(again.outline.system.momentum[k].is_equal(first.outline.system.momentum[k]));
        CHECK(derived_kernel(read_scene(path), {}).from_cache);
    }
}

TEST_CASE("a time that drops out of the motion stays out of what is kept") {
    const test::TemporaryFolder folder;
    const test::EnvironmentVariable cache("LOBATTO_CACHE_DIR", (folder / "cache").string());
    const Scene scene = read(
        "lagrangian = \"q'^2/2 - q^4 + sin(t)\"\ntime = \"t\"\n[coordinates]\n"
        "q = { position = 1, velocity = 0 }\n[run]\nstep = 0.1\nuntil = 1\n");
    const DerivedKernel first = derived_kernel(scene, {}), again = derived_kernel(scene, {});
    REQUIRE(again.from_cache);
    for (const DerivedKernel& kernel : {first, again}) {
        CHECK(kernel.outline.system.autonomous);
        CHECK_FALSE(kernel.outline.system.lagrangian.has(scene.time));
        CHECK(kernel.outline.conserves_energy());
    }
}

TEST_CASE("what changes the kernel is derived anew") {
    const test::TemporaryFolder folder;
    const test::EnvironmentVariable cache("LOBATTO_CACHE_DIR", (folder / "cache").string());
    const Scene scene = read(pendulum());
    CHECK_FALSE(derived_kernel(scene, {}).from_cache);
    CHECK(derived_kernel(scene, {}).from_cache);
    CHECK_FALSE(derived_kernel(scene, {Precision::quadruple}).from_cache);
    CHECK_FALSE(derived_kernel(scene, {Precision::double_, Shortcuts::none}).from_cache);
    Scene other = scene;
    other.method.points = 6;
    CHECK_FALSE(derived_kernel(other, {}).from_cache);
    other = scene;
    other.outputs.energy = false;
    CHECK_FALSE(derived_kernel(other, {}).from_cache);
    const KernelWish watched{Precision::double_, Shortcuts::all, [](const Outline&) { return true; }};
    const DerivedKernel with_energy = derived_kernel(other, watched);
    CHECK_FALSE(with_energy.from_cache);
    CHECK(with_energy.outline.scene.outputs.energy);
    CHECK(derived_kernel(other, watched).outline.scene.outputs.energy);
    CHECK(derived_kernel(other, watched).from_cache);
    CHECK_FALSE(derived_kernel(read(pendulum("# another text\n")), {}).from_cache);
    other = scene;
    other.name = "another";
    CHECK_FALSE(derived_kernel(other, {}).from_cache);
}

TEST_CASE("a table that has changed is another scene") {
    const test::TemporaryFolder folder;
    const test::EnvironmentVariable cache("LOBATTO_CACHE_DIR", (folder / "cache").string());
    test::write_text(folder / "pull.csv", "0, 0\n1, 1\n2, 4\n3, 9\n");
    test::write_text(
        folder / "pulled.toml",
        "lagrangian = '''q'^2/2 - table(\"pull.csv\", q)'''\n[coordinates]\nq = { position = 1.5, velocity = "
        "0 }\n[run]\nstep = 0.1\nuntil = 0.1\n");
    const std::string path = (folder / "pulled.toml").string();
    CHECK_FALSE(derived_kernel(read_scene(path), {}).from_cache);
    CHECK(derived_kernel(read_scene(path), {}).from_cache);
    // Also where doubles do not know the difference.
    for (const char* last : {"3, 8\n", "3, 8.00000000000000000007\n"}) {
        test::write_text(folder / "pull.csv", std::string("0, 0\n1, 1\n2, 4\n") + last);
        CHECK_FALSE(derived_kernel(read_scene(path), {}).from_cache);
        CHECK(derived_kernel(read_scene(path), {}).from_cache);
    }
}

TEST_CASE("starts, steps and values of parameters are not compiled: scenes that differ in them share a kernel") {
    const auto source_of = [](const std::string& k, const std::string& x, const std::string& step,
                              const std::string& power = "3") {
        return derived_kernel(
                   read_scene(Source("a.toml", "title = \"k = " + k + "\"\nlagrangian = \"x'^2/2 - x^2/2 - k*x^" +
                                                   power + "\"\n[coordinates]\nx = { position = " + x +
                                                   ", velocity = 0 }\n[parameters]\nk = " + k +
                                                   "\n[run]\nstep = " + step + "\nuntil = 1\n")),
                   {})
            .source;
    };
    const test::TemporaryFolder folder;
    const test::EnvironmentVariable cache("LOBATTO_CACHE_DIR", (folder / "cache").string());
    const KernelSource one = source_of("0.125", "0.1", "0.1");
    static_cast<void>(kernel_of(one, Precision::double_));
    for (const KernelSource& other :
         {source_of("0.25", "0.1", "0.1"), source_of("0.125", "0.2", "0.1"), source_of("0.125", "0.1", "0.05")}) {
        CHECK(other.digest == one.digest);
        Compiled compiled;
        static_cast<void>(kernel_of(other, Precision::double_, &compiled));
        CHECK(compiled.from_cache);
    }
    CHECK(source_of("0.125", "0.1", "0.1", "4").digest != one.digest);
    // People are told the values.
    const KernelSource emitted = emit(derive(read(pendulum())));
    CHECK(emitted.header.find("real g = 9.81;") != std::string::npos);
}

TEST_CASE("what was kept and then altered is derived again") {
    const test::TemporaryFolder folder;
    const test::EnvironmentVariable cache("LOBATTO_CACHE_DIR", (folder / "cache").string());
    const Scene scene = read(pendulum());
    const std::string formulas = derived_kernel(scene, {}).source.formulas;
    int altered = 0;
    for (const auto& file : std::filesystem::directory_iterator(folder / "cache"))
        if (file.path().extension() == ".derived") {
            std::string text = test::read_file(file.path());
            text.replace(text.find("struct"), 6, "class ");
            test::write_text(file.path(), text);
            ++altered;
        }
    REQUIRE(altered == 1);
    const DerivedKernel again = derived_kernel(scene, {});
    CHECK_FALSE(again.from_cache);
    CHECK(again.source.formulas == formulas);
    CHECK(derived_kernel(scene, {}).from_cache);
}
