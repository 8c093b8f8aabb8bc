// SPDX-License-Identifier: GPL-2.0-or-later
// The scenes of the library against solutions computed elsewhere and against what must not change, run as a user would.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include "analysis/kernel/kernel_of.hpp"
#include "analysis/motion.hpp"
#include "generator/pipeline.hpp"
#include "runtime/measure/reference.hpp"
#include "runtime/run/output.hpp"
#include "runtime/run/trajectory.hpp"
#include "tests/scenes/references.hpp"
#include "tests/support.hpp"
#include "tests/trajectory_table.hpp"

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

// The trajectory of a scene with its own step and method, as the program writes it.
class Trajectory {
public:
    explicit Trajectory(const std::string& scene, const std::vector<std::string>& options = {}) {
        static const test::TemporaryFolder folder;
        const std::string file = folder / (scene + ".csv");
        std::vector<std::string> arguments = {LOBATTO_PROGRAM, "run", scene_file(scene), "--quiet", "-o", file};
        arguments.insert(arguments.end(), options.begin(), options.end());
        const test::Finished done = test::run(arguments);
        REQUIRE_MESSAGE(done.exit_code == 0, done.err);
        table_ = test::read_trajectory(file);
        REQUIRE(table_.rows.size() > 1);
    }

    static std::string scene_file(const std::string& scene) {
        return std::string(LOBATTO_SOURCE_DIR) + "/scenes/" + scene + ".toml";
    }

    std::size_t size() const { return table_.rows.size(); }
    std::size_t last() const { return size() - 1; }

    double operator()(std::size_t row, const std::string& column) const {
        const auto at = std::find(table_.columns.begin(), table_.columns.end(), column);
        REQUIRE_MESSAGE(at != table_.columns.end(), "no column " << column);
        return table_.rows[row][static_cast<std::size_t>(at - table_.columns.begin())];
    }

    // How far a function of the state strays from its first value, at most.
    double drift(const std::function<double(std::size_t row)>& integral) const {
        double largest = 0;
        const double first = integral(0);
        for (std::size_t row = 0; row < size(); ++row) largest = std::max(largest, std::fabs(integral(row) - first));
        return largest;
    }
    double drift(const std::string& column) const {
        return drift([&](std::size_t row) { return (*this)(row, column); });
    }

private:
    test::TrajectoryTable table_;
};

std::string element(const std::string& name, int index) {
    return name + "_" + std::to_string(index);
}

// Runs the scene to the time of its reference and compares every number of the state.
void check_against_reference(const std::string& scene) {
    const test::SceneReference& reference = test::scene_reference(scene);
    const Trajectory trajectory(scene, {"--until", exact_text(reference.time)});
    REQUIRE(trajectory(trajectory.last(), "t") == doctest::Approx(reference.time).epsilon(1e-12));
    for (const auto& entry : reference.state) {
        const std::string& column = entry.first;
        const double found = trajectory(trajectory.last(), column), error = found - entry.second;
        CAPTURE(column);
        CHECK(std::fabs(error) < reference.tolerance);
    }
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

// From here on each scene runs with its own step and method. The tolerances are of the method, unless they say
// otherwise.

TEST_CASE("the harmonic oscillator is back at its start after one period") {
    const Trajectory one("harmonic_oscillator");
    CHECK(std::fabs(one(one.last(), "q") - one(0, "q")) < 1e-13);  // measured 2e-16: the phase error squared
    CHECK(std::fabs(one(one.last(), "p_q")) < 3e-7);               // measured 9.9e-8: the phase error
}

TEST_CASE("the pendulum is on the exact elliptic solution after a hundred swings") {
    check_against_reference("pendulum");
}

TEST_CASE("the two pendulums on a spring are where they should be after 20 s") {
    check_against_reference("two_pendulums");
}

TEST_CASE("the coupled oscillators follow the sum of their two normal modes") {
    const Trajectory beats("coupled_oscillators");
    double largest = 0;
    for (std::size_t row = 0; row < beats.size(); ++row) {
        const double t = beats(row, "t"), slow = std::cos(t), fast = std::cos(std::sqrt(1.2) * t);
        largest = std::max(largest, std::fabs(beats(row, "x") - (slow + fast) / 2));
        largest = std::max(largest, std::fabs(beats(row, "y") - (slow - fast) / 2));
    }
    CHECK(largest < 2e-7);  // measured 7.6e-8
}

TEST_CASE("the driven, damped pendulum is where it should be after ten periods of the drive") {
    check_against_reference("driven_damped_pendulum");
}

TEST_CASE("the driven, damped pendulum repeats after two periods of the drive, not after one") {
    const Trajectory driven("driven_damped_pendulum");
    const std::size_t period = 50, end = driven.last();
    CHECK(std::fabs(driven(end, "theta") - driven(end - 2 * period, "theta")) < 1e-7);  // measured 8.6e-9
    CHECK(std::fabs(driven(end, "theta") - driven(end - period, "theta")) > 0.1);       // measured 0.235
}

TEST_CASE("Ueda's oscillator is where it should be after 20 units of time") {
    check_against_reference("duffing");
}

TEST_CASE("hydrogen chloride follows the exact solution in Morse's potential") {
    const double D = 0.0731, a = 1.81, m = 1.63, r0 = 1.275, root = 0.8, frequency = 0.6 * a * std::sqrt(2 * D / m);
    const Trajectory molecule("morse");
    double largest = 0;
    for (std::size_t row = 0; row < molecule.size(); ++row) {
        // exp(a (r - r0)) = (1 - sqrt(E/D) cos(w t)) / (1 - E/D), w = a sqrt(2 (D - E)/m)
        const double stretch = (1 - root * std::cos(frequency * molecule(row, "t"))) / (1 - root * root);
        largest = std::max(largest, std::fabs(molecule(row, "r") - r0 - std::log(stretch) / a));
    }
    CHECK(largest < 1e-6);  // measured 2.6e-7
}

TEST_CASE("the double pendulum is where it should be after 10 s") {
    check_against_reference("double_pendulum");
}

TEST_CASE("the triple pendulum is where it should be after 5 s") {
    check_against_reference("triple_pendulum");
}

TEST_CASE("the chain of ten pendulums is where it should be after 1 s") {
    check_against_reference("ten_link_pendulum");
}

TEST_CASE("the spherical pendulum is where it should be after 100 units of time, its angular momentum exactly kept") {
    check_against_reference("spherical_pendulum");
    CHECK(Trajectory("spherical_pendulum").drift("p_phi") == 0);
}

TEST_CASE("the swinging spring is where it should be after 100 s, its angular momentum kept") {
    check_against_reference("swinging_spring");
    const Trajectory spring("swinging_spring");
    CHECK(spring.drift([&](std::size_t row) {
        return spring(row, "x") * spring(row, "p_y") - spring(row, "y") * spring(row, "p_x");
    }) < 1e-15);                      // measured 8e-17
    CHECK(spring.drift("H") < 1e-9);  // measured 2.8e-10
}

TEST_CASE("the swing-plane of the spring turns by thirty degrees each time the swing comes back") {
    const Trajectory spring("swinging_spring");
    const std::size_t excursion = 246;  // rows: the swing comes back every 24.6 s
    double before = 0;
    for (std::size_t k = 0; (k + 1) * excursion < spring.size(); ++k) {
        double widest = 0, azimuth = 0;
        for (std::size_t row = k * excursion; row < (k + 1) * excursion; ++row) {
            const double x = spring(row, "x"), y = spring(row, "y"), width = std::hypot(x, y);
            if (width > widest) widest = width, azimuth = std::atan2(y, x) * 180 / std::acos(-1.0);
        }
        CHECK(widest > 0.16);  // the bouncing has gone into the swing, which began with 0.04
        if (k > 0) CHECK(std::fabs(std::remainder(azimuth - before - 30, 180)) < 0.5);  // measured 0.2
        before = azimuth;
    }
}

TEST_CASE("Lagrange's top is where it should be after 50 units of time, two momenta exactly kept") {
    check_against_reference("lagrange_top");
    const Trajectory top("lagrange_top");
    CHECK(top.drift("p_phi") == 0);
    CHECK(top.drift("p_psi") == 0);
    CHECK(top.drift("H") < 5e-13);  // measured 9.5e-14
}

TEST_CASE("the figure of eight closes, and its momenta stay zero") {
    check_against_reference("figure_eight");
    const Trajectory eight("figure_eight");
    for (const std::string name : {"x", "y"}) {
        for (int i = 1; i <= 3; ++i) {
            CAPTURE(element(name, i));
            CHECK(std::fabs(eight(100, element(name, i)) - eight(0, element(name, i))) <
                  1e-7);  // measured 3e-8: the digits of the data
        }
    }
    CHECK(eight.drift([&](std::size_t row) {
        double angular = 0;
        for (int i = 1; i <= 3; ++i)
            angular += eight(row, element("x", i)) * eight(row, element("p_y", i)) -
                       eight(row, element("y", i)) * eight(row, element("p_x", i));
        return angular;
    }) < 1e-13);  // measured 5.4e-15
}

TEST_CASE("the Pleiades are where the test set has them at t = 3") {
    check_against_reference("pleiades");
}

TEST_CASE("the outer planets are where they should be after 200,000 days, their energy kept") {
    check_against_reference("outer_solar_system");
    CHECK(Trajectory("outer_solar_system").drift("H") < 1e-20);  // measured 3.6e-22 of 3.2e-8: rounding
}

TEST_CASE("Arenstorf's orbit is where it should be, and Jacobi's integral constant") {
    check_against_reference("arenstorf");
    CHECK(Trajectory("arenstorf").drift("H") < 2e-10);  // measured 3.6e-11
}

TEST_CASE("Arenstorf's orbit closes") {
    const Trajectory orbit("arenstorf");
    for (const std::string column : {"x", "y", "p_x", "p_y"}) {
        CAPTURE(column);
        CHECK(std::fabs(orbit(orbit.last(), column) - orbit(0, column)) <
              1e-6);  // measured 2.1e-7, of a momentum beside the Moon
    }
}

TEST_CASE("the particle in the magnetic bottle is where it should be, turned back, its speed kept") {
    check_against_reference("magnetic_bottle");
    const Trajectory bottle("magnetic_bottle");
    CHECK(bottle.drift("H") < 1e-13);  // the speed; measured 2.5e-14
    CHECK(bottle.drift([&](std::size_t row) {
        return bottle(row, "x") * bottle(row, "p_y") - bottle(row, "y") * bottle(row, "p_x");
    }) < 1e-13);  // the canonical angular momentum; measured 1.8e-14
    double furthest = 0;
    for (std::size_t row = 0; row < bottle.size(); ++row) furthest = std::max(furthest, std::fabs(bottle(row, "z")));
    CHECK(furthest > 4);  // measured 4.62
    CHECK(furthest < 5);
}

TEST_CASE("the oscillator of Mathews and Lakshmanan swings as a sine with the frequency of its amplitude") {
    const Trajectory oscillator("mathews_lakshmanan");
    double largest = 0;
    for (std::size_t row = 0; row < oscillator.size(); ++row) {
        const double exact = 2 * std::cos(oscillator(row, "t") / std::sqrt(3.0));
        largest = std::max(largest, std::fabs(oscillator(row, "x") - exact));
    }
    CHECK(largest < 1e-7);  // measured 3.2e-8
}

TEST_CASE("Toda's lattice is where it should be after 50 units of time and keeps its third integral") {
    check_against_reference("toda_lattice");
    const Trajectory toda("toda_lattice");
    const auto cubic = [&](std::size_t row) {  // the determinant of Flaschka's matrix, but for constants
        double q[3], p[3];
        for (int i = 0; i < 3; ++i) {
            q[i] = toda(row, element("q", i + 1));
            p[i] = toda(row, element("p_q", i + 1));
        }
        return p[0] * p[1] * p[2] - p[0] * std::exp(q[1] - q[2]) - p[1] * std::exp(q[2] - q[0]) -
               p[2] * std::exp(q[0] - q[1]);
    };
    CHECK(cubic(0) == doctest::Approx(29.059030380959168));
    CHECK(toda.drift(cubic) < 5e-9);  // measured 1.3e-9
    CHECK(toda.drift([&](std::size_t row) { return toda(row, "p_q_1") + toda(row, "p_q_2") + toda(row, "p_q_3"); }) <
          1e-12);  // measured 3.9e-14
}

TEST_CASE("the string of Fermi, Pasta, Ulam and Tsingou is where it should be, and stays symmetric") {
    check_against_reference("fput_beta");
    const Trajectory string("fput_beta");
    double largest = 0;
    for (int i = 1; i <= 16; ++i)
        largest = std::max(
            largest, std::fabs(string(string.last(), element("x", i)) - string(string.last(), element("x", 33 - i))));
    CHECK(largest < 1e-12);           // measured 2e-14
    CHECK(string.drift("H") < 1e-7);  // measured 2.0e-8 of 0.077
}

TEST_CASE("the chain of stiff and soft springs is where it should be, and the stiff ones keep their energy") {
    check_against_reference("stiff_fput");
    const Trajectory chain("stiff_fput");
    const auto stiff = [&](std::size_t row) {
        double energy = 0;
        for (int i = 1; i <= 3; ++i) {
            const double b = chain(row, element("b", i)), p = chain(row, element("p_b", i));
            energy += p * p / 2 + 1250 * b * b;
        }
        return energy;
    };
    CHECK(stiff(0) == doctest::Approx(1));
    CHECK(chain.drift(stiff) < 0.1);  // an adiabatic invariant; measured 0.065
}

TEST_CASE("the waves on a string of beads are the sum of their normal modes after they have met again") {
    constexpr int n = 256;
    const double pi = std::acos(-1.0);
    const Trajectory chain("wave_chain");
    const double t = chain(chain.last(), "t");
    std::vector<double> exact(n);
    for (int k = 1; k <= n; ++k) {
        double amplitude = 0;
        for (int i = 1; i <= n; ++i)
            amplitude += std::exp(-(i - 80.0) * (i - 80.0) / 50) * std::sin(k * pi * i / (n + 1)) * 2 / (n + 1);
        amplitude *= std::cos(2 * std::sin(k * pi / (2 * (n + 1))) * t);
        for (int i = 1; i <= n; ++i)
            exact[static_cast<std::size_t>(i - 1)] += amplitude * std::sin(k * pi * i / (n + 1));
    }
    double largest = 0;
    for (int i = 1; i <= n; ++i)
        largest =
            std::max(largest, std::fabs(chain(chain.last(), element("x", i)) - exact[static_cast<std::size_t>(i - 1)]));
    CHECK(largest < 1e-8);  // measured 2.3e-9
}

TEST_CASE("the relativistic oscillator is where it should be after 20 units of time, its energy kept") {
    check_against_reference("relativistic_oscillator");
    const Trajectory oscillator("relativistic_oscillator");
    CHECK(oscillator.drift("H") < 2e-11);  // measured 6.2e-12
}

TEST_CASE("Kapitza's pendulum is where it should be after 1 s, and never falls") {
    check_against_reference("kapitza_pendulum");
    const Trajectory pendulum("kapitza_pendulum");
    for (std::size_t row = 0; row < pendulum.size(); ++row) REQUIRE(std::fabs(pendulum(row, "theta") - 3.1416) < 0.142);
}

TEST_CASE("the swinging Atwood's machine is where it should be after 10 s and keeps its second integral") {
    check_against_reference("swinging_atwood");
    const Trajectory machine("swinging_atwood");
    // r^2 theta' (r' cos(theta/2) - r theta'/2 sin(theta/2)) + g r^2 sin(theta/2) cos(theta/2)^2, Tufillaro (1986)
    const double drift = machine.drift([&](std::size_t row) {
        const double r = machine(row, "r"), angular = machine(row, "p_theta"), half = machine(row, "theta") / 2;
        return angular * (machine(row, "p_r") / 4 * std::cos(half) - angular / (2 * r) * std::sin(half)) +
               9.81 * r * r * std::sin(half) * std::cos(half) * std::cos(half);
    });
    CHECK(drift < 3e-9);  // measured 8.4e-10
}

namespace {

// Where the coordinates of a scene with its [run] are at the end.
std::vector<double> end_of(const std::string& text) {
    const Scene scene = read_scene(Source("minimal.toml", text));
    const Kernel kernel = kernel_of(emit(derive(scene)), Precision::double_);
    LoadedStepper<double> stepper(kernel);
    TrajectoryRequest request = request_of(scene, steps_of(scene, {}).count, stepper);
    return integrate(kernel, request).q;
}

std::string parameters_of(const std::string& scene) {
    const std::string text = test::read_file(Trajectory::scene_file(scene));
    const std::size_t begin = text.find("[parameters]");
    return text.substr(begin, text.find("[method]") - begin);
}

}  // namespace

TEST_CASE("the pendulum on a rod is on the exact elliptic solution") {
    const Trajectory rod("rod_pendulum");
    const auto exact = pendulum_solution(9.80665L / 2, 1.5L, 0, 20);
    CHECK(std::fabs(rod(rod.last(), "x") - static_cast<double>(2 * std::sin(exact.q))) < 1e-10);
    CHECK(std::fabs(rod(rod.last(), "y") + static_cast<double>(2 * std::cos(exact.q))) < 1e-10);
}

TEST_CASE("the double pendulum of rods is where the one in angles should be after 10 s") {
    const auto& angles = test::scene_reference("double_pendulum").state;
    const double a = angles[0].second, b = angles[1].second;
    const Trajectory rods("rod_double_pendulum", {"--until", "10"});
    CHECK(std::fabs(rods(rods.last(), "x_2") - (2 * std::sin(a) + 3 * std::sin(b))) < 1e-8);
    CHECK(std::fabs(rods(rods.last(), "y_2") + (2 * std::cos(a) + 3 * std::cos(b))) < 1e-8);
}

TEST_CASE("the slider-crank moves like the one whose only coordinate is its crank") {
    const std::string minimal =
        "lagrangian = \"J1*a'^2/2 + m2*(x'^2 + y'^2)/2 + J2*b'^2/2 + m3*s'^2/2 - g*(m1*r/2*sin(a) + m2*y)\"\n"
        "[coordinates]\na = { position = 1, velocity = 0 }\n[definitions]\nb = \"-asin(r/l*sin(a))\"\n"
        "x = \"r*cos(a) + l/2*cos(b)\"\ny = \"r*sin(a) + l/2*sin(b)\"\ns = \"r*cos(a) + l*cos(b)\"\n" +
        parameters_of("slider_crank") + "[method]\npoints = 8\n[run]\nstep = 0.02\nuntil = 10\n";
    const Trajectory crank("slider_crank");
    const double a = end_of(minimal)[0];
    CHECK(std::fabs(crank(crank.last(), "a") - a) < 1e-8);
    CHECK(std::fabs(crank(crank.last(), "s") - std::cos(a) - std::sqrt(2.5 * 2.5 - std::sin(a) * std::sin(a))) < 1e-8);
}

TEST_CASE("the four-bar linkage moves like the one whose only coordinate is its crank") {
    // The rocker's angle from the triangle of its joint, the coupler's from the height of its end.
    const Trajectory linkage("four_bar");
    const double a = linkage(0, "a"), b = linkage(0, "b"), c = linkage(0, "c");
    const double of_b = std::sin(a - c) / (3 * std::sin(c - b)), of_c = std::sin(a - b) / (2.5 * std::sin(c - b));
    const double momentum = linkage(0, "p_a") + of_b * linkage(0, "p_b") + of_c * linkage(0, "p_c");
    const std::string text = test::read_file(Trajectory::scene_file("four_bar"));
    const std::size_t begin = text.find("lagrangian"), end = text.find("[definitions]");
    const std::string minimal = text.substr(begin, end - begin) + "[coordinates]\na = { position = " + exact_text(a) +
                                ", momentum = " + exact_text(momentum) +
                                " }\n[definitions]\nxm = \"r*cos(a) + l/2*cos(b)\"\n"
                                "ym = \"r*sin(a) + l/2*sin(b)\"\ne = \"sqrt((d - r*cos(a))^2 + (r*sin(a))^2)\"\n"
                                "c = \"pi - atan(r*sin(a)/(d - r*cos(a))) - acos((k^2 + e^2 - l^2)/(2*k*e))\"\n"
                                "b = \"asin((k*sin(c) - r*sin(a))/l)\"\n" +
                                parameters_of("four_bar") + "[method]\npoints = 8\n[run]\nstep = 0.01\nuntil = 10\n";
    CHECK(std::fabs(linkage(linkage.last(), "a") - end_of(minimal)[0]) < 1e-7);
}

TEST_CASE("the Pythagorean problem is where it should be after its closest encounter") {
    // By explicit extrapolation of order 24 in arithmetic of 113 bits, with a tolerance of 1e-27 a step.
    const std::array<double, 6> reference = {3.004292636696399,  -1.388626537510895,  -0.6916743520091232,
                                             0.5119252350246859, -0.4704760502527222, 0.06922569918736622};
    const Trajectory bodies("pythagorean");
    const char* names[] = {"x_1", "x_2", "x_3", "y_1", "y_2", "y_3"};
    for (std::size_t k = 0; k < reference.size(); ++k)
        CHECK(std::fabs(bodies(bodies.last(), names[k]) - reference[k]) < 2e-11);
    CHECK(std::fabs(bodies(bodies.last(), "H") - bodies(0, "H")) < 1e-11);
    CHECK(bodies.size() < 250);
}

TEST_CASE("the flipping pendulum stops where a rod turns over, and mirrored at the same time") {
    const Trajectory flip("flips");
    const double a = flip(flip.last(), "a"), b = flip(flip.last(), "b"), t = flip(flip.last(), "t");
    CHECK(std::min(std::fabs(std::fabs(a) - std::numbers::pi), std::fabs(std::fabs(b) - std::numbers::pi)) < 1e-13);
    CHECK(t < 100);
    CHECK(std::fabs(flip(flip.last(), "H") - flip(0, "H")) < 1e-5);
    const test::TemporaryFolder folder;
    const std::string file = folder / "mirrored.csv";
    const test::Finished done = test::run({LOBATTO_PROGRAM, "sweep", Trajectory::scene_file("flips"), "--vary",
                                           "a=-2.5", "--vary", "b=-1", "--quiet", "-o", file});
    REQUIRE_MESSAGE(done.exit_code == 0, done.err);
    const test::TrajectoryTable table = test::read_trajectory(file);
    CHECK(table.columns[6] == "t");
    CHECK(std::fabs(table.rows[0][6] - t) < 1e-12);
}

TEST_CASE("the bouncing ball is where parabolas say") {
    const Trajectory ball("bouncing_ball");
    const double g = 9.81, e = 0.8;
    for (std::size_t row = 0; row < ball.size(); ++row) {
        const double t = ball(row, "t");
        double impact = std::sqrt(2 / g), speed = std::sqrt(2 * g), y = 1 - g * t * t / 2;
        while (t >= impact) {
            speed *= e;
            const double flown = t - impact;
            y = flown * (speed - g * flown / 2);
            impact += 2 * speed / g;
        }
        CHECK(std::fabs(ball(row, "y") - y) < 1e-13);
    }
}

TEST_CASE("two balls of Newton's cradle move at any time, and both like one pendulum") {
    const Trajectory cradle("newtons_cradle");
    for (std::size_t row = 0; row < cradle.size(); ++row) {
        int moving = 0;
        double sum = 0;
        for (const char* q : {"q_1", "q_2", "q_3", "q_4", "q_5"}) {
            moving += std::fabs(cradle(row, q)) > 1e-9 ? 1 : 0;
            sum += std::fabs(cradle(row, q));
        }
        CHECK((moving == 2 || moving == 0));
        const auto exact = pendulum_solution(9.81L / 0.15L, 0.5L, 0, static_cast<long double>(cradle(row, "t")));
        CHECK(std::fabs(sum - 2 * std::fabs(static_cast<double>(exact.q))) < 1e-9);
    }
}

TEST_CASE("Sinai's billiard goes in straight lines from mirror to mirror") {
    const Trajectory billiard("sinai_billiard");
    long double x = 0.7L, y = 0.1L, u = 0.6L, v = 0.8L, left = 12;
    for (;;) {
        // The first mirror on the way: walls at +-1, the disc of radius 0.4.
        const long double to_x = u > 0 ? (1 - x) / u : (-1 - x) / u, to_y = v > 0 ? (1 - y) / v : (-1 - y) / v,
                          b = x * u + y * v, c = x * x + y * y - 0.16L;
        long double to_disc = 1e9L;
        if (b < 0 && b * b > c && c > 1e-15L) to_disc = -b - std::sqrt(b * b - c);
        const long double next = std::min({to_x, to_y, to_disc});
        if (next > left) break;
        left -= next;
        x += next * u;
        y += next * v;
        if (next == to_disc) {
            const long double normal = 2 * (x * u + y * v) / 0.16L;
            u -= normal * x;
            v -= normal * y;
        } else {
            (next == to_x ? u : v) *= -1;
        }
    }
    CHECK(std::fabs(billiard(billiard.last(), "x") - static_cast<double>(x + left * u)) < 1e-11);
    CHECK(std::fabs(billiard(billiard.last(), "y") - static_cast<double>(y + left * v)) < 1e-11);
}

TEST_CASE("the free body tips over, and keeps its energy and its angular momentum") {
    const Trajectory body("free_body");
    // Of space: 2 q x p by the quaternion from the left.
    const auto momentum = [&](std::size_t row, int i, int j, int k) {
        const auto q = [&](int n) { return body(row, "q" + std::to_string(n)); };
        const auto p = [&](int n) { return body(row, "p_q" + std::to_string(n)); };
        return q(0) * p(i) - q(i) * p(0) + q(j) * p(k) - q(k) * p(j);
    };
    CHECK(body.drift("H") < 1e-12);
    for (const auto& [i, j, k] : {std::array{1, 2, 3}, std::array{2, 3, 1}, std::array{3, 1, 2}})
        CHECK(body.drift([&, i = i, j = j, k = k](std::size_t row) { return momentum(row, i, j, k); }) < 1e-12);
    // The axis of the middle moment, in space: y at the start, at some time -y.
    double lowest = 1;
    for (std::size_t row = 0; row < body.size(); ++row) {
        const double q0 = body(row, "q0"), q1 = body(row, "q1"), q2 = body(row, "q2"), q3 = body(row, "q3");
        lowest = std::fmin(lowest, q0 * q0 - q1 * q1 + q2 * q2 - q3 * q3);
    }
    CHECK(lowest < -0.9);
}

TEST_CASE("the top in a quaternion points where the one in Euler's angles should") {
    const auto& angles = test::scene_reference("lagrange_top").state;
    const double theta = angles[0].second, phi = angles[1].second;
    const Trajectory top("quaternion_top");
    const auto q = [&](int n) { return top(top.last(), "q" + std::to_string(n)); };
    CHECK(std::fabs(2 * (q(1) * q(3) + q(0) * q(2)) - std::sin(theta) * std::sin(phi)) < 1e-11);
    CHECK(std::fabs(2 * (q(2) * q(3) - q(0) * q(1)) + std::sin(theta) * std::cos(phi)) < 1e-11);
    CHECK(std::fabs(q(0) * q(0) - q(1) * q(1) - q(2) * q(2) + q(3) * q(3) - std::cos(theta)) < 1e-11);
}

// The quaternion of a body and the momenta along it, in a row.
struct Orientation {
    std::array<double, 4> q, p;
    Orientation(const Trajectory& trajectory, std::size_t row, const std::string& body) {
        for (int k = 0; k < 4; ++k) {
            q[static_cast<std::size_t>(k)] = trajectory(row, element(body + "_q", k + 1));
            p[static_cast<std::size_t>(k)] = trajectory(row, "p_" + element(body + "_q", k + 1));
        }
    }
    double length() const { return q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]; }
    // The third axis of the body in space.
    std::array<double, 3> axis() const {
        return {2 * (q[1] * q[3] + q[0] * q[2]) / length(), 2 * (q[2] * q[3] - q[0] * q[1]) / length(),
                (q[0] * q[0] - q[1] * q[1] - q[2] * q[2] + q[3] * q[3]) / length()};
    }
    // Angular momentum in the body's frame (side = -1), in that of space (side = 1).
    std::array<double, 3> momentum(int side) const {
        return {(q[0] * p[1] - q[1] * p[0] + side * (q[2] * p[3] - q[3] * p[2])) / 2,
                (q[0] * p[2] - q[2] * p[0] + side * (q[3] * p[1] - q[1] * p[3])) / 2,
                (q[0] * p[3] - q[3] * p[0] + side * (q[1] * p[2] - q[2] * p[1])) / 2};
    }
};

TEST_CASE("the top on a ball joint points where the one in Euler's angles should") {
    const auto& angles = test::scene_reference("lagrange_top").state;
    const double theta = angles[0].second, phi = angles[1].second;
    const Trajectory top("rigid_top");
    const Orientation end(top, top.last(), "top");
    const std::array<double, 3> axis = end.axis();
    CHECK(std::fabs(axis[0] - std::sin(theta) * std::sin(phi)) < 1e-12);
    CHECK(std::fabs(axis[1] + std::sin(theta) * std::cos(phi)) < 1e-12);
    CHECK(std::fabs(axis[2] - std::cos(theta)) < 1e-12);
    CHECK(top.drift("H") < 1e-13);
    CHECK(top.drift([&](std::size_t row) { return Orientation(top, row, "top").momentum(1)[2]; }) < 1e-13);
}

namespace {

// sn, cn, dn by the arithmetic-geometric mean (M. Abramowitz and I. A. Stegun, 16.4).
std::array<long double, 3> elliptic(long double u, long double k2) {
    std::vector<long double> a{1}, c{std::sqrt(k2)};
    long double b = std::sqrt(1 - k2);
    while (std::fabs(c.back()) > 1e-19L) {
        c.push_back((a.back() - b) / 2);
        const long double mean = (a.back() + b) / 2;
        b = std::sqrt(a.back() * b);
        a.push_back(mean);
    }
    const std::size_t n = a.size() - 1;
    long double phi = std::ldexp(a[n] * u, static_cast<int>(n));
    for (std::size_t i = n; i > 0; --i) phi = (phi + std::asin(c[i] / a[i] * std::sin(phi))) / 2;
    const long double sn = std::sin(phi);
    return {sn, std::cos(phi), std::sqrt(1 - k2 * sn * sn)};
}

}  // namespace

TEST_CASE("the wing nut tips over as Jacobi's elliptic functions say, and keeps its angular momentum") {
    const Trajectory nut("wing_nut");
    const long double A = 1, B = 2, C = 3, w1 = 1.73L, w3 = 1;
    const long double k2 = (B - A) * A * (C - A) * w1 * w1 / ((C - B) * C * (C - A) * w3 * w3),
                      rate = w3 * std::sqrt((C - B) * (C - A) / (A * B));
    double off = 0, lowest = 1;
    for (std::size_t row = 0; row < nut.size(); ++row) {
        const auto [sn, cn, dn] = elliptic(rate * static_cast<long double>(nut(row, "t")), k2);
        const std::array<double, 3> L = Orientation(nut, row, "nut").momentum(-1);
        const long double w2 = w1 * std::sqrt(A * (C - A) / (B * (C - B))) * sn;
        off = std::fmax(off, std::fabs(L[0] / 1 - static_cast<double>(w1 * cn)));
        off = std::fmax(off, std::fabs(L[1] / 2 - static_cast<double>(w2)));
        off = std::fmax(off, std::fabs(L[2] / 3 - static_cast<double>(w3 * dn)));
        lowest = std::fmin(lowest, L[1]);
        CHECK(std::fabs(nut(row, "nut_x") - 0.1 * nut(row, "t")) < 1e-12);
        CHECK(std::fabs(Orientation(nut, row, "nut").length() - 1) < 1e-9);
    }
    CHECK(off < 1e-11);
    CHECK(lowest < -2.9);  // it has tipped over
    CHECK(nut.drift("H") < 1e-13);
    for (const std::size_t k : {0U, 1U, 2U})
        CHECK(nut.drift([&](std::size_t row) { return Orientation(nut, row, "nut").momentum(1)[k]; }) < 1e-13);
}

TEST_CASE("the gyroscopic pendulum goes round like a top in Euler's angles with two bodies that spin") {
    const Trajectory pendulum("gyroscopic_pendulum");
    // I = a + A + M l^2/4 + m l^2; from the upright: cos(theta) = -4/5; the arm does not spin at the start.
    const std::vector<double> end = end_of(
        "lagrangian = \"(0.1 + 0.05 + 0.25 + 2)*(theta'^2 + sin(theta)^2*phi'^2)/2 + 0.01*(psi' + cos(theta)*phi')^2/2"
        " + 0.1*(chi' + cos(theta)*phi')^2/2 - 9.80665*2.5*cos(theta)\"\n[coordinates]\n"
        "theta = { position = \"acos(-4/5)\", velocity = 0 }\nphi = { position = 0, velocity = 0 }\n"
        "psi = { position = 0, velocity = 0 }\nchi = { position = 0, velocity = 50 }\n[method]\npoints = 8\n[run]\n"
        "step = 0.01\nuntil = 10\n");
    const std::array<double, 3> up = Orientation(pendulum, pendulum.last(), "arm").axis();  // towards the pivot
    CHECK(std::fabs(-up[0] - std::sin(end[0]) * std::cos(end[1])) < 1e-10);
    CHECK(std::fabs(-up[1] - std::sin(end[0]) * std::sin(end[1])) < 1e-10);
    CHECK(std::fabs(-up[2] - std::cos(end[0])) < 1e-10);
    CHECK(pendulum.drift("H") < 1e-12);
}

TEST_CASE("the four-bar linkage of plane bodies moves like the one in angles") {
    std::string text = test::read_file(Trajectory::scene_file("four_bar"));
    const auto replace = [&](const std::string& from, const std::string& to) {
        REQUIRE(text.find(from) != std::string::npos);
        text.replace(text.find(from), from.size(), to);
    };
    const Trajectory bodies("four_bar_bodies");
    const double left = std::acos(-1), a = left + bodies(0, "a_angle"),
                 b = std::acos((16 + 9 - 6.25) / 24) + bodies(0, "a_angle") + bodies(0, "b_angle"),
                 c = left - std::acos((16 - 9 + 6.25) / 20) + bodies(0, "c_angle");
    replace("position = \"pi/2\", velocity = 3", "position = " + exact_text(a) + ", velocity = 0");
    replace("position = 0.4,", "position = " + exact_text(b) + ",");
    replace("position = 1.6,", "position = " + exact_text(c) + ",");
    replace("points = 5", "points = 8");
    const std::vector<double> angles = end_of(text);
    CHECK(std::fabs(bodies(bodies.last(), "a_angle") - (angles[0] - left)) < 1e-11);
}

TEST_CASE("Andrews' squeezing mechanism is where the test set has it at t = 0.03") {
    const Trajectory mechanism("andrews_squeezer");
    // Nine digits of the published ones are reached; ours do not change with step and method.
    const std::vector<std::pair<std::string, double>> published = {
        {"beta", 15.81077119629904},   {"theta", -15.75637105984298}, {"gamma", 0.04082224013073101},
        {"phi", -0.5347301163226948},  {"delta", 0.5244099658805304}, {"omega", 0.5347301163226948},
        {"epsilon", 1.048080741042263}};
    for (const auto& entry : published) {
        const std::string& column = entry.first;
        CAPTURE(column);
        CHECK(std::fabs(mechanism(mechanism.last(), column) - entry.second) < 2e-9);
    }
    CHECK(mechanism.drift("H") < 1e-13);  // the torque's work is part of H
}

TEST_CASE("a loop of rods stays closed") {
    const Trajectory loop("rod_loop");
    const auto length = [&](std::size_t row, int i) {
        const int j = i % 8 + 1;
        return std::hypot(loop(row, element("x", i)) - loop(row, element("x", j)),
                          loop(row, element("y", i)) - loop(row, element("y", j)));
    };
    for (int i = 1; i <= 8; ++i) CHECK(loop.drift([&](std::size_t row) { return length(row, i); }) < 1e-14);
    CHECK(loop.drift("H") < 1e-6);
}

TEST_CASE("a scene of many equal terms gives the same bytes from every process") {
    const test::TemporaryFolder folder;
    std::string first;
    for (const std::string run : {"a", "b", "c", "d"}) {
        const std::string to = folder / run;
        const test::Finished done = test::run({LOBATTO_PROGRAM, "emit", Trajectory::scene_file("fput_beta"), "-o", to});
        REQUIRE_MESSAGE(done.exit_code == 0, done.err);
        const std::string text = test::read_file(to + "/fput_beta.hpp");
        if (first.empty()) first = text;
        CHECK(text == first);
    }
}
