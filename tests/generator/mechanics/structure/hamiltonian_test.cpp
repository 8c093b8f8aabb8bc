// SPDX-License-Identifier: GPL-2.0-or-later
// Velocities as formulas of momenta: where they are found, and that steps are the general path's.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "analysis/motion.hpp"
#include "generator/mechanics/structure/hamiltonian.hpp"
#include "tests/scenes/scenes.hpp"

using namespace lobatto;

namespace {

Scene scene_of_bodies(const std::string& text) {
    return read_scene(Source("bodies.toml", text + "[run]\nstep = 0.05\nuntil = 1\n"));
}

const std::string two_bodies =
    "[bodies]\na = { mass = 1, inertia = [0.1, 0.2, 0.25], position = [0, 0, 1] }\n"
    "b = { mass = 1, inertia = [0.1, 0.2, 0.25], position = [0, 0, 3], angular_velocity = [1, 2, 3] }\n[joints]\n"
    "foot = { type = \"ball\", bodies = [\"ground\", \"a\"], point = [0, 0, 0] }\n";

// Why velocities are not formulas; "" where they are.
std::string refusal_of(const Scene& scene) {
    const Derivation derivation = derive(scene);
    const bool found = derivation.structure.hamiltonian().has_value();
    for (const Finding& finding : derivation.findings)
        if (finding.name == "velocities of momenta") {
            CHECK(finding.holds == found);
            return found ? "" : finding.reason;
        }
    CHECK_FALSE(found);
    return "nothing is said";
}

// The largest distance of positions and momenta at the ends of two runs.
double apart(const Derivation& a, const Derivation& b, std::int64_t steps) {
    std::vector<double> ends[2];
    int i = 0;
    for (const Derivation* const derivation : {&a, &b}) {
        const Kernel kernel = test::kernel_in_own_cache(*derivation, Precision::double_);
        LoadedStepper<double> stepper(kernel);
        TrajectoryRequest request = request_of(derivation->scene, steps, stepper);
        request.every = steps;
        const TrajectoryResult result = integrate(kernel, request);
        REQUIRE(result.status == LOBATTO_OK);
        ends[i] = result.q;
        ends[i].insert(ends[i].end(), result.p.begin(), result.p.end());
        ++i;
    }
    double most = 0;
    for (std::size_t k = 0; k < ends[0].size(); ++k) most = std::max(most, std::fabs(ends[0][k] - ends[1][k]));
    return most;
}

}  // namespace

TEST_CASE("steps by velocities of momenta are those of the general path" * doctest::test_suite("slow")) {
    // A top on a joint, a free body with three moments, a rotor in its bearing; with a force of the time; Gauss's
    // nodes.
    const auto library = [](const std::string& name) {
        return read_scene(std::string(LOBATTO_SOURCE_DIR) + "/scenes/" + name + ".toml");
    };
    Scene gauss = library("rigid_top");
    gauss.method = {Family::gauss, 4};
    const Scene driven = scene_of_bodies(
        "time = \"t\"\nlagrangian = \"-(1 + sin(t)/2)*(b.x^2 + b.z^2 - a.z + 2*b.R[3,1])\"\n" + two_bodies);
    for (const Scene& scene :
         {library("rigid_top"), library("wing_nut"), library("gyroscopic_pendulum"), gauss, driven}) {
        CAPTURE(scene.name);
        CHECK(refusal_of(scene).empty());
        CHECK(apart(derive(scene), derive(scene, Shortcuts::none), 100) < 1e-11);  // measured at most 1e-12
    }
}

TEST_CASE("velocities of momenta are refused where the masses of bodies change" * doctest::test_suite("slow")) {
    const std::string varies = "in the angular velocities of bodies the masses are not constant",
                      ball = "elbow = { type = \"ball\", bodies = [\"a\", \"b\"], point = [0, 0, 2] }\n",
                      pulled = "lagrangian = \"-a.z - b.z\"\n" + two_bodies;
    CHECK(refusal_of(scene_of_bodies(pulled)).empty());
    CHECK(refusal_of(scene_of_bodies(pulled + ball)) == varies);
    CHECK(refusal_of(scene_of_bodies("lagrangian = \"-a.z + b.omega[1]*b.x\"\n" + two_bodies)) == varies);  // linear
    CHECK(refusal_of(scene_of_bodies("lagrangian = \"-a.z + a.omega[1]^4\"\n" + two_bodies)) == varies);
    CHECK(refusal_of(scene_of_bodies("time = \"t\"\nlagrangian = \"-a.z + exp(-(t - 40)^2)*a.omega[1]^2\"\n" +
                                     two_bodies)) == "momenta hold the time or inputs");
    CHECK(refusal_of(scene_of_bodies(pulled + "[forces]\n\"b.x\" = \"-b.x'\"\n")) == "forces hold velocities");
    CHECK(refusal_of(scene_of_bodies(pulled + "[constraints]\ntie = \"b.x^2 + b.z^2 = 9\"\n")) ==
          "constraints are solved for together with the motion");
}
