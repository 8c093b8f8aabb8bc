// SPDX-License-Identifier: GPL-2.0-or-later
// The scenes of the library against solutions that others computed: from scene file to end state, through everything.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "cli/kernel_of.hpp"
#include "generator/pipeline.hpp"
#include "runtime/trajectory.hpp"

using namespace lobatto;

namespace {

// The state (q, p) of a scene at time `until`, with 5 points and `steps` steps, from (q, p).
std::vector<double> state_at(const std::string& name, double until, std::int64_t steps, const std::vector<double>& q,
                             const std::vector<double>& p) {
    Scene scene = read_scene(std::string(LOBATTO_SOURCE_DIR) + "/scenes/" + name + ".toml");
    scene.method.points = 5;
    TrajectoryRequest request;
    for (const Parameter& parameter : scene.parameters)
        request.parameters.push_back(scene.evaluate(parameter.value, parameter.name).to_double());
    request.q = q;
    request.p = p;
    request.step = until / static_cast<double>(steps);
    request.steps = steps;
    request.every = steps;
    const TrajectoryResult result = integrate(kernel_of(emit(derive(scene)), Precision::double_), request);
    REQUIRE(result.status == LOBATTO_OK);
    std::vector<double> state = result.q;
    state.insert(state.end(), result.p.begin(), result.p.end());
    return state;
}

double distance(const std::vector<double>& state, const std::vector<double>& reference) {
    double largest = 0;
    for (std::size_t i = 0; i < reference.size(); ++i) largest = std::max(largest, std::fabs(state[i] - reference[i]));
    return largest;
}

}  // namespace

// The references were computed by others with methods of order 16 in 113-bit arithmetic; the errors in the comments are
// ours.

TEST_CASE("Kepler's planet, e = 0.6, is where it should be after 100 units of time") {
    const auto state = state_at("kepler", 100, 10000, {0.4, 0}, {0, 2});
    CHECK(distance(state, {-0.10418320443418060, -0.69474171556795060}) < 5e-12);  // measured 6e-13
}

TEST_CASE("Kepler's planet, e = 0.3, returns to its start after a hundred years") {
    const double speed = std::sqrt(13.0 / 7.0);
    const auto state = state_at("kepler", 200 * 3.14159265358979323846, 40000, {0.7, 0}, {0, speed});
    CHECK(distance(state, {0.7, 0, 0, speed}) < 5e-10);  // measured 1.2e-10, rounding of the phase
}

TEST_CASE("the star of Henon and Heiles at energy 1/12 is where it should be after 100 units of time") {
    const auto state = state_at("henon_heiles", 100, 5000, {0, 0.3}, {0.23380903889000242556, 0.2});
    const std::vector<double> reference = {0.3445792770156945, -0.05235385847367687, -0.19281916660630640,
                                           -0.14264790092343943};
    CHECK(distance(state, reference) < 1e-12);  // measured 1e-14
}

TEST_CASE("the star of Henon and Heiles started on the diagonal is where it should be after 1000 units of time") {
    const auto state = state_at("henon_heiles", 1000, 50000, {0.18, 0.18}, {0.18, 0.18});
    const std::vector<double> reference = {0.12085258980265259, 0.09508566555990329, -0.31273554050626291,
                                           -0.11713864380439564};
    CHECK(distance(state, reference) < 1e-10);  // measured 3.8e-11
}

TEST_CASE("a step fifty times too long misses the published place: the comparison can fail") {
    const auto state = state_at("henon_heiles", 100, 100, {0, 0.3}, {0.23380903889000242556, 0.2});
    CHECK(distance(state, {0.3445792770156945, -0.05235385847367687}) > 1e-8);
}
