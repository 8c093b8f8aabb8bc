// SPDX-License-Identifier: GPL-2.0-or-later
// Every shortcut of the structure against the general path: the same motion to rounding, and less work.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "generator/mechanics/structure/scaled_mass.hpp"
#include "runtime/run/trajectory.hpp"
#include "tests/scenes/scenes.hpp"

using namespace lobatto;

namespace {

Scene scene(const std::string& text) {
    return read_scene(Source("shortcut.toml", text));
}

Scene library(const std::string& name) {
    return read_scene(std::string(LOBATTO_SOURCE_DIR) + "/scenes/" + name + ".toml");
}

struct Motion {
    std::vector<double> q, p;
    TrajectoryResult result;
    int unknowns = 0;
};

// `steps` steps of the scene's own size from its own start.
Motion motion(const Derivation& derivation, std::int64_t steps, double tolerance = 0) {
    const Scene& scene = derivation.scene;
    const Kernel kernel = test::kernel_in_own_cache(derivation, Precision::double_);
    TrajectoryRequest request;
    for (const Parameter& parameter : scene.parameters)
        request.parameters.push_back(scene.evaluate(parameter.value, parameter.name).to_double());
    request.step = scene.evaluate(scene.run.step, "the step").to_double();
    request.steps = steps;
    request.every = steps;
    request.tolerance = tolerance;
    for (std::size_t k = 0; k < scene.coordinates.size(); ++k) {
        request.q.push_back(scene.evaluate(scene.initial_position[k], "position").to_double());
        request.p.push_back(scene.evaluate(scene.initial_rate[k], "rate").to_double());
    }
    if (scene.start == Start::velocity) {
        LoadedStepper<double> stepper(kernel);
        REQUIRE(stepper.prepare(request.parameters, request.step) == LOBATTO_OK);
        request.p = stepper.momentum(0, request.q, request.p);
    }
    Motion motion;
    motion.result = integrate(kernel, request);
    REQUIRE(motion.result.status == LOBATTO_OK);
    motion.q = motion.result.q;
    motion.p = motion.result.p;
    motion.unknowns = kernel->unknowns;
    return motion;
}

double distance(const std::vector<double>& x, const std::vector<double>& y) {
    double most = 0, size = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
        most = std::max(most, std::fabs(x[i] - y[i]));
        size = std::max({size, std::fabs(x[i]), std::fabs(y[i])});
    }
    return most == 0 ? 0 : most / size;
}

// The largest relative distance of the two ends.
double distance(const Motion& x, const Motion& y) {
    return std::max(distance(x.q, y.q), distance(x.p, y.p));
}

const Finding& finding(const Derivation& derivation, const std::string& name) {
    for (const Finding& f : derivation.findings)
        if (f.name == name) return f;
    throw std::runtime_error("no finding " + name);
}

long operations(const Derivation& derivation) {
    return emit(derivation).report.back().after.total();
}

std::string header(const Scene& scene, Shortcuts shortcuts = Shortcuts::all) {
    return emit(derive(scene, shortcuts)).header;
}

const std::string run = "[run]\nstep = 0.05\nuntil = 1\n";

}  // namespace

TEST_CASE("a linear system's map takes the general path's steps without iterating") {
    for (const char* name : {"coupled_oscillators", "harmonic_oscillator"}) {
        const Scene linear = library(name);
        const Motion map = motion(derive(linear), 193), general = motion(derive(linear, Shortcuts::none), 193);
        CHECK(finding(derive(linear), "linear system").holds);
        CHECK(distance(map, general) < 1e-12);  // measured 2e-14
        CHECK(map.unknowns == 0);
        CHECK(map.result.iterations == 0);
        CHECK(general.result.iterations >= 193);
    }
}

TEST_CASE("a constant mass matrix leaves only the interior nodes to solve") {
    for (const char* name : {"pendulum", "henon_heiles", "toda_lattice"}) {
        const Scene constant = library(name);
        const Derivation shortcut = derive(constant), whole = derive(constant, Shortcuts::none);
        const Motion reduced = motion(shortcut, 100), general = motion(whole, 100);
        CHECK(distance(reduced, general) < 1e-12);  // measured at most 2e-14
        const int n = static_cast<int>(constant.coordinates.size()), s = constant.method.points;
        CHECK(reduced.unknowns == n * (s - 2));
        CHECK(general.unknowns == n * (s - 1));
    }
}

TEST_CASE("masses that all change alike leave no matrix of a node to factor" * doctest::test_suite("slowest")) {
    const auto with_kinetic_energy = [](const std::string& energy, const std::string& method = "") {
        return scene("time = \"t\"\nlagrangian = \"" + energy + " - x^2/2 - (y - x)^4\"\n[coordinates]\n" +
                     "x = { position = 0.5, velocity = 0.3 }\ny = { position = 0.2, velocity = -0.4 }\n[method]\n" +
                     method + run);
    };
    struct Row {
        std::string energy;
        bool is_scaled, is_light;
    };
    for (const Row& row :
         {Row{"(1 + x^2)*(x'^2 + 3*y'^2)", true, true}, Row{"(1 + x^2 + y^2)*(x'^2 + x'*y' + y'^2)", true, false},
          Row{"x'^2 + x'*y' + y'^2 + x*y'", true, false}, Row{"exp(-t)*(x'^2 + y'^2)", true, true},
          Row{"(cos(x)^2 + sin(x)^2)*(1 + y^2)*x'^2 + ((1 + y)^2 - 2*y)*y'^2", true, true},
          Row{"x'^2 + (1 + x^2)*y'^2", false, false}, Row{"(1 + x^2)*(x'^2 + y'^2) + x'*y'", false, false}}) {
        INFO(row.energy);
        const Scene whole = with_kinetic_energy(row.energy);
        const Derivation derivation = derive(whole);
        REQUIRE(derivation.structure.form() == StepForm::general);
        CHECK(uses_scaled_mass(whole, derivation.system, derivation.structure) == row.is_scaled);
        CHECK(finding(derivation, "scaled mass matrix").holds == row.is_scaled);
        CHECK(has_light_mass(whole, derivation.system, derivation.structure) == row.is_light);
    }
    for (const char* energy :
         {"(1 + x^2)*(x'^2 + 3*y'^2) + x*y'", "(1 + x^2 + y^2)*(x'^2 + x'*y' + y'^2)", "x'^2 + (1 + x^2)*y'^2"})
        for (const char* method : {"points = 5\n", "family = \"gauss\"\nstages = 3\n"}) {
            INFO(energy);
            INFO(method);
            const Scene whole = with_kinetic_energy(energy, method);
            const Motion shortcut = motion(derive(whole), 100);
            CHECK(distance(shortcut, motion(derive(whole, Shortcuts::none), 100)) < 1e-12);
        }
}

TEST_CASE("independent groups are solved by themselves, with fewer operations") {
    const std::string coordinates =
        "[coordinates]\na = { position = 1, velocity = 0 }\nb = { position = 0.5, velocity = 1 }\n";
    const Scene apart = scene("lagrangian = \"a'^2/2 + b'^2/2 + cos(a) - b^4/4\"\n" + coordinates + run);
    const Scene joined = scene("lagrangian = \"a'^2/2 + b'^2/2 + cos(a) - b^4/4 - a*b/1000\"\n" + coordinates + run);
    CHECK(finding(derive(apart), "independent groups").holds);
    CHECK_FALSE(finding(derive(joined), "independent groups").holds);
    CHECK(distance(motion(derive(apart), 100), motion(derive(apart, Shortcuts::none), 100)) < 1e-13);
    CHECK(emit(derive(apart)).header.find("int group_count = 2;") != std::string::npos);
    CHECK(emit(derive(joined)).header.find("int group_count = 1;") != std::string::npos);
}

TEST_CASE("large independent groups are solved apart") {
    std::string lagrangian, coordinates = "[coordinates]\n";
    for (int k = 1; k <= 6; ++k) {
        const std::string x = "x" + std::to_string(k);
        lagrangian += (k > 1 ? " + " : "") + x + "'^2/2";
        coordinates += x + " = { position = 0." + std::to_string(k) + ", velocity = 0 }\n";
    }
    for (const char* pair : {"x1 - x3", "x3 - x5", "x2 - x4", "x4 - x6", "x1", "x2"})
        lagrangian += std::string(" - (") + pair + ")^4/4 - (" + pair + ")^2/2";
    const Scene two = scene("lagrangian = \"" + lagrangian + "\"\n" + coordinates + run);
    const Derivation derivation = derive(two);
    REQUIRE(derivation.structure.groups.size() == 2);
    CHECK(distance(motion(derivation, 100), motion(derive(two, Shortcuts::none), 100)) < 1e-13);
    CHECK(emit(derivation).header.find("group_first[3] = {0, 3, 6}") != std::string::npos);
}

TEST_CASE("cyclic coordinates leave the solve, their momenta stay to the last bit") {
    struct Row {
        const char* name;
        std::vector<std::size_t> cyclic;
    };
    for (const Row& row : {Row{"spherical_pendulum", {1}}, Row{"lagrange_top", {1, 2}}}) {
        for (const Method& method : {Method{Family::lobatto, 4}, Method{Family::gauss, 3}}) {
            if (row.cyclic.size() > 1 && method.family == Family::gauss) continue;  // nothing new, and long to compile
            Scene cyclic = library(row.name);
            cyclic.method = method;
            const Derivation shortcut = derive(cyclic), whole = derive(cyclic, Shortcuts::none);
            CHECK(finding(shortcut, "cyclic coordinates").holds);
            REQUIRE(shortcut.structure.routhian().cyclic.size() == row.cyclic.size());
            const Motion reduced = motion(shortcut, 100), general = motion(whole, 100);
            CHECK(distance(reduced, general) < 1e-11);  // measured 2e-12: momenta of 1e-2, rounded beside others of 1
            const int n = static_cast<int>(cyclic.coordinates.size()), c = static_cast<int>(row.cyclic.size());
            CHECK(general.unknowns == 3 * n);
            CHECK(reduced.unknowns == 3 * (n - c) + (method.family == Family::lobatto ? c : 0));
            LoadedStepper<double> stepper(test::kernel_in_own_cache(shortcut, Precision::double_));
            std::vector<double> q, p;
            for (std::size_t k = 0; k < cyclic.coordinates.size(); ++k) {
                q.push_back(cyclic.evaluate(cyclic.initial_position[k], "position").to_double());
                p.push_back(cyclic.evaluate(cyclic.initial_rate[k], "momentum").to_double());
            }
            std::vector<double> parameters;
            for (const Parameter& parameter : cyclic.parameters)
                parameters.push_back(cyclic.evaluate(parameter.value, parameter.name).to_double());
            REQUIRE(stepper.prepare(parameters, 0.05) == LOBATTO_OK);
            if (cyclic.start == Start::velocity) p = stepper.momentum(0, q, p);
            for (const std::size_t k : row.cyclic) CHECK(reduced.p[k] == p[k]);
        }
    }
}

TEST_CASE("a coordinate whose velocity stands in masses stays in the solve, and the other cyclic ones leave it") {
    const Derivation found =
        derive(read_scene(Source("scene.toml",
                                 "lagrangian = \"r'^2/2 + r^2*phi'^2/2 + phi'^4/20 - r^4/4 + w'^2\"\n[coordinates]\n"
                                 "r = { position = 1, velocity = 0 }\nphi = { position = 0, velocity = 0.6 }\n"
                                 "w = { position = 0, velocity = 0.1 }\n[run]\nstep = 0.05\nuntil = 10\n")));
    CHECK(found.structure.routhian().cyclic == std::vector<int>{2});
}

TEST_CASE("a cyclic coordinate stays in the solve where its mass may vanish though the whole mass matrix does not") {
    const auto cyclic_of = [](const std::string& lagrangian) {
        const Derivation derivation = derive(scene("lagrangian = \"" + lagrangian +
                                                   "\"\n[coordinates]\nx = { position = 1, velocity = 0.3 }\n"
                                                   "y = { position = 0.5, velocity = 1 }\n" +
                                                   run));
        CHECK(finding(derivation, "cyclic coordinates").holds == !derivation.structure.routhian().cyclic.empty());
        return derivation.structure.routhian().cyclic;
    };
    CHECK(cyclic_of("x'*y' + x'*y^2 - y^3").empty());                    // 0
    CHECK(cyclic_of("x'*y' + (1 - y^2)*x'^2/2 - y^3").empty());          // of both signs
    CHECK(cyclic_of("y'^2/2 + x'^2/2 + y*x'^2 + y*x'*y'").empty());      // near the start it has one
    CHECK(cyclic_of("y'^2/2 - exp(y)*x'^2/2 - y^3") == std::vector{0});  // negative
    CHECK(cyclic_of("y'^2/2 + (1 + y^2)*x'^2/2 - y^3") == std::vector{0});
    CHECK(cyclic_of("y'^2/2 + (1 + y^2)*x'^2/2 - 1e-70/x'").empty());  // no value at rest, however small
}

TEST_CASE("a coordinate that nothing holds moves uniformly beside a nonlinear one") {
    const Scene free = scene(
        "lagrangian = \"a'^2/2 + b'^2 + cos(a)\"\n[coordinates]\na = { position = 1, velocity = 0 }\n"
        "b = { position = 0.5, velocity = 1 }\n" +
        run);
    CHECK(finding(derive(free), "cyclic coordinates").holds);
    const Motion shortcut = motion(derive(free), 100);
    CHECK(distance(shortcut, motion(derive(free, Shortcuts::none), 100)) < 1e-13);
    CHECK(shortcut.p[1] == 2.0);
}

TEST_CASE("banded and repeated equations give the motion of full matrices") {
    for (const char* name : {"wave_chain", "fput_beta"}) {
        const Derivation shortcut = derive(library(name));
        CHECK(finding(shortcut, "banded equations").holds);
        CHECK(finding(shortcut, "repeated terms").holds);
        if (std::string(name) == "fput_beta")  // 256 masses with full matrices take too long for a test
            CHECK(distance(motion(shortcut, 50), motion(derive(library(name), Shortcuts::none), 50)) < 1e-12);
    }
}

TEST_CASE("a chain with the fewest nodes takes the general path's steps") {
    Scene chain = library("fput_beta");
    chain.run.step = GiNaC::numeric(1, 100);
    for (const Method& method : {Method{Family::lobatto, 2}, Method{Family::lobatto, 3}, Method{Family::gauss, 1}}) {
        CAPTURE(method.name());
        chain.method = method;
        CHECK(distance(motion(derive(chain), 20), motion(derive(chain, Shortcuts::none), 20)) < 1e-13);
    }
}

TEST_CASE("positions and velocities of one formula are told apart in the energy of loops") {
    const Scene squares = scene(
        "lagrangian = \"sum(i=1..12, x[i]'^2/2 + x[i]^4*x[i]'^2/2) - sum(i=1..12, x[i]^2)\"\n"
        "[coordinates]\nx = { count = 12, position = \"i/10\", velocity = 0.5 }\n" +
        run);
    const Derivation derivation = derive(squares);
    REQUIRE(derivation.structure.form() == StepForm::general);
    REQUIRE(derivation.structure.looped);
    LoadedStepper<double> stepper(test::kernel_in_own_cache(derivation, Precision::double_));
    REQUIRE(stepper.prepare({}, 0.05) == LOBATTO_OK);
    std::vector<double> q;
    double exact = 0, H = 0;
    for (int i = 1; i <= 12; ++i) {
        q.push_back(i / 10.0);
        exact += 0.125 * (1 + std::pow(q.back(), 4)) + q.back() * q.back();
    }
    const std::vector<double> p = stepper.momentum(0, q, std::vector<double>(12, 0.5));
    REQUIRE(stepper.energy(0, q, p, H) == LOBATTO_OK);
    CHECK(std::fabs(H - exact) < 1e-12);
}

TEST_CASE("derivatives of a repeated term that are equal and opposite several times") {
    const Scene shear = scene(
        "lagrangian = \"sum(i = 1 .. 40, x[i]'^2/2) - sum(i = 1 .. 37, (x[i] - x[i+1] - x[i+2] + x[i+3])^4/4)\"\n"
        "[coordinates]\nx = { count = 40, position = \"sin(i)\", velocity = 0 }\n" +
        run);
    const Derivation shortcut = derive(shear);
    REQUIRE(shortcut.structure.looped);
    CHECK(distance(motion(shortcut, 50), motion(derive(shear, Shortcuts::none), 50)) < 1e-12);
}

TEST_CASE("a formula without a value at zero is no fixed end") {
    const Scene quotients = scene(
        "lagrangian = \"\"\"sum(i = 1 .. 24, x[i]'^2/2) - sum(i = 1 .. 23, x[i+1]/x[i] + x[i]/x[i+1])\n"
        "  - (x[1] - 1)^2\"\"\"\n[coordinates]\nx = { count = 24, position = 1, velocity = \"sin(i)/10\" }\n" +
        run);
    const Derivation shortcut = derive(quotients);
    REQUIRE(shortcut.structure.neighbours());
    CHECK_FALSE(shortcut.structure.separable().fixed_ends.before);
    CHECK(distance(motion(shortcut, 50), motion(derive(quotients, Shortcuts::none), 50)) < 1e-12);
}

TEST_CASE("steps of a chain do not depend on the unit of length, a power of two") {
    const auto in_units = [](const std::string& L) {
        const Scene chain = scene(
            "lagrangian = \"\"\"sum(i = 1 .. 256, x[i]'^2/2)\n"
            "  + sum(i = 1 .. 255, 4*L^2*cos((x[i+1] - x[i])/L))\"\"\"\n"
            "[coordinates]\nx = { count = 256, position = \"0.05*L*sin(0.37*i^2)\", velocity = 0 }\n"
            "[parameters]\nL = { value = " +
            L + ", constant = true }\n[method]\npoints = 4\n[run]\nstep = 0.3\nuntil = 90\n");
        return motion(derive(chain), 300, 1e-3);
    };
    const Motion one = in_units("1"), many = in_units("4096");
    CHECK(one.result.iterations == many.result.iterations);
    for (std::size_t k = 0; k < one.q.size(); ++k) CHECK(many.q[k] == 4096 * one.q[k]);
}

TEST_CASE("a linear chain in loops takes the general path's steps with one correction each") {
    const auto chain = [](int n) {
        return scene(
            "lagrangian = \"sum(i=1..n, x[i]'^2/2) - sum(i=1..n-1, (x[i+1]-x[i])^2/2) - x[1]^2/2 - x[n]^2/2\"\n"
            "[coordinates]\nx = { count = \"n\", position = \"sin(pi*i/(n+1))\", velocity = 0 }\n"
            "[parameters]\nn = { value = " +
            std::to_string(n) + ", constant = true }\n" + run);
    };
    const Derivation shortcut = derive(chain(40));
    CHECK(shortcut.structure.linear);
    CHECK(shortcut.structure.looped);
    const Motion reduced = motion(shortcut, 50), general = motion(derive(chain(40), Shortcuts::none), 50);
    CHECK(distance(reduced, general) < 1e-12);
    CHECK(reduced.result.iterations == 50);
}

TEST_CASE("emitted text grows linearly with the length of a chain") {
    const auto bytes = [](int n) {
        return static_cast<double>(
            header(scene("lagrangian = \"sum(i=1..n, x[i]'^2/2) - sum(i=1..n-1, 1 - cos(x[i+1]-x[i]))\"\n"
                         "[coordinates]\nx = { count = \"n\", position = \"i/n\", velocity = 0 }\n"
                         "[parameters]\nn = { value = " +
                         std::to_string(n) + ", constant = true }\n" + run))
                .size());
    };
    const double b64 = bytes(64), b128 = bytes(128), b256 = bytes(256);
    const double growth = (b256 - b128) / (b128 - b64);
    CHECK(growth > 1.8);
    CHECK(growth < 2.3);  // numbers get longer: 2.13 measured
}

TEST_CASE("formulas without time are not given it, and those with it are") {
    const std::string coordinates = "[coordinates]\nq = { position = 1, velocity = 0 }\n";
    const std::string still = header(scene("lagrangian = \"q'^2/2 + cos(q)\"\n" + coordinates + run));
    CHECK(still.find("number time") == std::string::npos);
    const Scene driven = scene("time = \"t\"\nlagrangian = \"q'^2/2 + (1 + sin(t)/5)*cos(q)\"\n" + coordinates + run);
    CHECK(header(driven).find("number time") != std::string::npos);
    CHECK(distance(motion(derive(driven), 100), motion(derive(driven, Shortcuts::none), 100)) <
          1e-11);  // measured 3e-13
}

TEST_CASE("constant parameters are folded: fewer fields, no more operations") {
    const auto with = [](const std::string& mass) {
        return derive(
            scene("lagrangian = \"m*q'^2/2 - k*q^4\"\n[coordinates]\nq = { position = 1, velocity = 0 }\n"
                  "[parameters]\nm = " +
                  mass + "\nk = 3\n" + run));
    };
    const Derivation open = with("2"), folded = with("{ value = 2, constant = true }");
    CHECK(operations(folded) < operations(open));
    CHECK(emit(folded).header.find("number m") == std::string::npos);
    CHECK(distance(motion(open, 100), motion(folded, 100)) < 1e-14);
}

TEST_CASE("a kernel with fewer outputs is shorter") {
    const auto text = [](const std::string& output) {
        return header(scene("lagrangian = \"q'^2/2 + cos(q)\"\n[coordinates]\nq = { position = 1, velocity = 0 }\n" +
                            run + "[output]\n" + output));
    };
    const std::string all = text("events = [\"q = 0 rising\"]\n"), plain = text(""),
                      least = text("energy = false\ntangent = false\n");
    CHECK(least.size() < plain.size());
    CHECK(plain.size() < all.size());
    CHECK(plain.find("number energy(") != std::string::npos);
    CHECK(least.find("number energy(") == std::string::npos);
    CHECK(all.find("void event(") != std::string::npos);
    CHECK(plain.find("void event(") == std::string::npos);
}

TEST_CASE("a nearly quadratic potential is iterated without factoring, and agrees with Newton's iteration") {
    const Scene fput = library("fput_beta");
    const Derivation absorbed = derive(fput);
    REQUIRE(absorbed.structure.absorbed());
    Derivation newton = absorbed;
    std::get<SeparableForm>(newton.structure.of_form).absorbed = false;
    const Motion with = motion(absorbed, 100), without = motion(newton, 100);
    CHECK(distance(with, without) < 1e-12);
    CHECK(emit(absorbed).header.find("quadratic_part") != std::string::npos);
    CHECK(emit(newton).header.find("quadratic_part") == std::string::npos);
}

TEST_CASE("diagonal mass and sparse second derivatives leave fewer operations than the general path") {
    for (const char* name : {"henon_heiles", "swinging_spring", "stiff_fput"}) {
        const Scene sparse = library(name);
        std::size_t entries = derive(sparse).structure.constant_mass().entries.size();
        const std::size_t n = sparse.coordinates.size();
        if (derive(sparse).structure.form() == StepForm::general)
            entries = derive(sparse).structure.routhian().second.entries().size();
        CHECK(entries <= (derive(sparse).structure.form() == StepForm::general ? 4 : 1) * n * n);
    }
    CHECK(derive(library("stiff_fput")).structure.constant_mass().entries.size() < 36);
}

TEST_CASE("a force that jumps is not taken for a constant one") {
    const std::string start = "[coordinates]\nx = { position = 3, velocity = 0.2 }\n" + run;
    for (const char* lagrangian : {"x'^2/2 - sqrt((x-1)^2)", "x'^2/2 - sqrt(x^2)", "(2 + x/sqrt(x^2))*x'^2/2 - x^2"}) {
        const Scene jumps = scene("lagrangian = \"" + std::string(lagrangian) + "\"\n" + start);
        const Derivation derivation = derive(jumps);
        CHECK_FALSE(derivation.structure.linear);
        CHECK(distance(motion(derivation, 20), motion(derive(jumps, Shortcuts::none), 20)) < 1e-13);
    }
    // Dry friction: the velocity 0.2 falls by 0.1 a unit of time.
    const Scene friction = scene("lagrangian = \"x'^2/2\"\n" + start + "[forces]\nx = \"-x'/sqrt(x'^2)/10\"\n");
    const Motion slowed = motion(derive(friction), 20);
    CHECK(std::fabs(slowed.p[0] - 0.1) < 1e-13);
    CHECK(std::fabs(slowed.q[0] - 3.15) < 1e-13);
}

TEST_CASE("an event may hold the time where the Lagrangian does not") {
    const std::string text =
        header(scene("time = \"t\"\nlagrangian = \"x'^2/2 - x^4/4\"\n[coordinates]\n"
                     "x = { position = 1, velocity = 0 }\n" +
                     run + "[output]\nevents = [\"x = t/10 falling\"]\n"));
    CHECK(text.find("void event(const CoefficientsOf<given>&, number time,") != std::string::npos);
}

TEST_CASE("a driven chain absorbs only what does not depend on the time") {
    const Scene driven = scene(
        "time = \"t\"\nlagrangian = \"sum(i=1..n, x[i]'^2/2) - sum(i=1..n-1, (1 + 0.2*sin(t))*(x[i+1]-x[i])^2 + "
        "(x[i+1]-x[i])^4/10 + (x[i+1]-x[i])^2)\"\n[coordinates]\nx = { count = \"n\", position = \"sin(pi*i/n)\", "
        "velocity = 0 }\n[parameters]\nn = { value = 40, constant = true }\n" +
        run);
    CHECK(derive(driven).structure.looped);
    CHECK(distance(motion(derive(driven), 20), motion(derive(driven, Shortcuts::none), 20)) < 1e-12);
}
