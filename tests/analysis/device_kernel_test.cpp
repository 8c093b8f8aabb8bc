// SPDX-License-Identifier: GPL-2.0-or-later
// Kernels for a device: nvcc takes their texts, where there is one.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <filesystem>

#include "analysis/kernel/derived_kernel.hpp"
#include "analysis/kernel/device_kernel.hpp"
#include "analysis/reductions.hpp"
#include "generator/scene/scene.hpp"
#include "tests/support.hpp"

using namespace lobatto;

namespace {

KernelSource source_of(const std::string& scene_name, Precision numbers, int splitting = 0) {
    Scene scene = read_scene(LOBATTO_SOURCE_DIR "/scenes/" + scene_name + ".toml");
    scene.method.numbers = numbers;
    if (splitting > 0) {
        scene.method.family = Family::splitting;
        scene.method.points = splitting;
    }
    return derived_kernel(scene, {numbers}).source;
}

}  // namespace

TEST_CASE("nvcc compiles the kernels of all forms, in double, float and double-double, to code of sm_80 and sm_90" *
          doctest::test_suite("slowest")) {
    if (!find_nvcc()) {
        MESSAGE("there is no nvcc: not tested");
        return;
    }
    const test::TemporaryFolder folder;
    const test::EnvironmentVariable cache("LOBATTO_CACHE_DIR", folder.string());
    const auto check = [](const KernelSource& source, Precision numbers, const std::string& architecture,
                          const WatchedLanes& watched = {}) {
        CAPTURE(source.name);
        CAPTURE(architecture);
        const DeviceLibrary host =
            DeviceLibrary::load(compile(host_side_of(source, numbers, watched)).object, source.digest);
        REQUIRE(host.has_lanes());
        const DeviceTranslation translation = device_side_of(source, architecture, host, watched);
        const Compiled made = compile_for_device(translation);
        CHECK_FALSE(made.from_cache);
        CHECK(std::filesystem::file_size(made.object) > 1000);
        for (const char* name : {DeviceKernel::name_of_lanes, DeviceKernel::name_of_alike, DeviceKernel::name_of_move})
            CHECK(test::read_file(made.object).find(name) != std::string::npos);
        CHECK(compile_for_device(translation).from_cache);
    };
    for (const char* name : {"pendulum", "kepler", "double_pendulum", "harmonic_oscillator"})
        check(source_of(name, Precision::double_), Precision::double_, "sm_90");
    check(source_of("henon_heiles", Precision::double_, 6), Precision::double_, "sm_80");
    check(source_of("driven_damped_pendulum", Precision::double_), Precision::double_, "sm_80");
    check(source_of("pendulum", Precision::single), Precision::single, "sm_80");
    check(source_of("flips", Precision::double_), Precision::double_, "sm_90", {true});
    check(source_of("flips", Precision::single), Precision::single, "sm_90", {true});
    for (const char* name : {"pendulum", "double_pendulum"})
        check(source_of(name, Precision::double_double), Precision::double_double, "sm_90");
    for (const auto& [name, formulas] : {std::pair("pendulum", "max(H), mean(q^2), last(sin(q) + q')"),
                                         std::pair("double_pendulum", "max(H), count(a = 0), mean(b')")}) {
        Scene kept = read_scene(fmt::format("{}/scenes/{}.toml", LOBATTO_SOURCE_DIR, name), {formulas});
        kept.outputs.watch_kept();
        check(derived_kernel(kept, {Precision::double_}).source, Precision::double_, "sm_90",
              {!kept.outputs.events.empty(), Reductions(kept).text()});
    }
}
