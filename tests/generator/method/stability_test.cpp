// SPDX-License-Identifier: GPL-2.0-or-later
// The exact intervals of stability of every member, against the nodes themselves and against kernels.
#include "generator/method/stability.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "analysis/stability/linearisation.hpp"
#include "generator/formula/real.hpp"
#include "runtime/measure/monodromy.hpp"
#include "tests/scenes/scenes.hpp"

namespace {

using namespace lobatto;
using GiNaC::ex;
using GiNaC::numeric;

std::vector<Method> every_member() {
    std::vector<Method> members;
    for (int points = 2; points <= 12; ++points) members.push_back({Family::lobatto, points});
    for (int stages = 1; stages <= 10; ++stages) members.push_back({Family::gauss, stages});
    return members;
}

const Stability& stability_of(const Method& method) {
    static std::map<std::string, Stability> known;
    const auto place = known.find(method.name());
    return place != known.end() ? place->second
                                : known.emplace(method.name(), stability(quadrature_of(method))).first->second;
}

// The trace of a step of q'' = -z q, h = 1, from the nodes: L_d = 1/2 X^T (sum_k b_k (D_k D_k^T - z B_k B_k^T)) X over
// the control points, the inner ones eliminated; with what is left, (alpha, beta; beta, alpha), p0 = -alpha q0 - beta
// q1.
numeric trace_from_nodes(const Quadrature& quadrature, const numeric& z) {
    const std::size_t m = quadrature.control.size(), r = quadrature.nodes.size();
    const auto entry = [](const GiNaC::matrix& matrix, std::size_t i, std::size_t j) {
        return real_value(matrix(static_cast<unsigned>(i), static_cast<unsigned>(j)));
    };
    std::vector<std::vector<numeric>> S(m, std::vector<numeric>(m, 0));
    for (std::size_t k = 0; k < r; ++k)
        for (std::size_t i = 0; i < m; ++i)
            for (std::size_t j = 0; j < m; ++j)
                S[i][j] +=
                    real_value(quadrature.weights[k]) * (entry(quadrature.D, k, i) * entry(quadrature.D, k, j) -
                                                         z * entry(quadrature.B, k, i) * entry(quadrature.B, k, j));
    for (std::size_t k = 1; k + 1 < m; ++k)
        for (std::size_t i = 0; i < m; ++i) {
            if (i == k || (i > 0 && i < k)) continue;
            const numeric factor = S[i][k] / S[k][k];
            for (std::size_t j = 0; j < m; ++j) S[i][j] -= factor * S[k][j];
        }
    return -2 * S[0][0] / S[0][m - 1];
}

// Intervals alternate, and the first is stable.
bool is_stable(const Stability& stability, double z) {
    const auto below = std::count_if(stability.limits.begin(), stability.limits.end(),
                                     [&](const RealRoot& limit) { return limit.high.to_double() < z; });
    return below % 2 == 0;
}

}  // namespace

TEST_CASE("the trace of every member is what its nodes give, to 45 digits") {
    for (const Method& method : every_member()) {
        CAPTURE(method.name());
        const Quadrature quadrature = quadrature_of(method);
        const Stability& member = stability_of(method);
        for (const numeric& z : {numeric(1, 7), numeric(37, 10), numeric(101, 3), numeric(-5, 3), numeric(900)}) {
            const numeric exact = member.trace(z), measured = trace_from_nodes(quadrature, z);
            CHECK(abs(measured - exact) < (1 + abs(exact)) * numeric(10).power(-45));
        }
    }
}

TEST_CASE("the trace is in lowest terms, its denominator has positive coefficients, and z = 0 gives 2") {
    for (const Method& method : every_member()) {
        CAPTURE(method.name());
        const Stability& member = stability_of(method);
        const GiNaC::symbol& z = member.step.z;
        CHECK(GiNaC::gcd(member.step.a, member.step.delta).degree(z) == 0);
        for (const numeric& coefficient : member.trace_below) CHECK(coefficient > 0);
        CHECK(member.trace(0) == 2);
        // a^2 - b c = delta^2: the step has determinant 1.
        const Propagation& step = member.step;
        CHECK((step.a * step.a - step.b * step.c - step.delta * step.delta).expand().is_zero());
        CHECK(rational_polynomial(step.a, z).size() == member.trace_above.size());
    }
}

TEST_CASE("the first limits of the members with few points are those of the literature and the paper") {
    const auto limits = [](int points) {
        std::string text;
        for (const RealRoot& limit : stability_of({Family::lobatto, points}).limits) text += radicals_of(limit) + "; ";
        return text;
    };
    CHECK(limits(2) == "4; ");
    CHECK(limits(3) == "8; 12; 24; ");
    CHECK(limits(4) == "42 - 6*sqrt(29); 10; 30; 60; 42 + 6*sqrt(29); ");  // the paper's eq:stabilityCondition2
    CHECK(decimal_of_square_root(stability_of({Family::lobatto, 4}).limits.front(), 30) ==
          "3.11271764816421725708492043465");
}

TEST_CASE("between two limits 4 - trace^2 keeps the sign that its interval claims, and at limits it vanishes") {
    for (const Method& method : every_member()) {
        CAPTURE(method.name());
        const Stability& member = stability_of(method);
        REQUIRE(member.intervals.size() == member.limits.size() + 1);
        for (std::size_t k = 0; k < member.intervals.size(); ++k) {
            const numeric begin = k > 0 ? member.limits[k - 1].high : numeric(0);
            const numeric end = k < member.limits.size() ? member.limits[k].low : 10 * begin + 1000;
            const StabilityInterval& interval = member.intervals[k];
            CHECK(interval.stable == (k % 2 == 0));
            double largest = 0;
            for (int i = 1; i < 64; ++i) {
                const numeric z = begin + (end - begin) * numeric(i, 64);
                const numeric trace = member.trace(z);
                const bool touches = 4 == trace * trace;
                CHECK((touches || (4 - trace * trace).is_positive() == interval.stable));
                largest = std::fmax(largest, rate_of_step(member, z));
            }
            CHECK(largest <= interval.rate);
            if (!interval.stable && k < member.limits.size()) CHECK(interval.rate < 1.01 * largest);
        }
        for (const RealRoot& limit : member.limits) {
            CHECK(limit.multiplicity == 1);
            const numeric trace = member.trace(limit.approximation(60));
            CHECK(abs(4 - trace * trace) < numeric(10).power(-30));
        }
    }
}

TEST_CASE("Lobatto's members have limits, 2 s - 3 of them; Gauss's have none, and a proof") {
    for (const Method& method : every_member()) {
        CAPTURE(method.name());
        const Stability& member = stability_of(method);
        const auto proof = proof_of_stability(member);
        const auto s = static_cast<std::size_t>(method.points);
        if (method.family == Family::lobatto) {
            CHECK(member.limits.size() == 2 * s - 3);
            CHECK(!proof);
            CHECK(member.contacts.empty());
            continue;
        }
        CHECK(member.limits.empty());
        REQUIRE(proof);
        CHECK(changes_of_sign(proof->at_zero) == changes_of_sign(proof->at_infinity));
        // The same by another route: every positive zero of (2 delta)^2 - (2 a)^2 is a double one.
        const Propagation& step = member.step;
        const auto zeros = positive_roots((4 * (step.delta * step.delta - step.a * step.a) / step.z).expand(), step.z);
        CHECK(zeros.size() == s - 1);
        for (const RealRoot& zero : zeros) CHECK(zero.multiplicity == 2);
        REQUIRE(member.contacts.size() == s - 1);
        for (const Contact& contact : member.contacts) CHECK(contact.identity);
    }
}

TEST_CASE("Gauss's trace is that of the diagonal Pade approximant of exp(i x)") {
    for (int s = 1; s <= 10; ++s) {
        // N(y) = sum_k (2 s - k)! s!/((2 s)! k! (s - k)!) y^k, R = N(i x)/N(-i x), trace = 2 Re R = 2 (E^2 - O^2)/(E^2
        // + O^2) with N(i x) = E + i O.
        const GiNaC::symbol x("x");
        ex even = 0, odd = 0;
        const auto factorial = [](int k) { return GiNaC::factorial(numeric(k)); };
        for (int k = 0; k <= s; ++k) {
            const ex term = factorial(2 * s - k) * factorial(s) / (factorial(2 * s) * factorial(k) * factorial(s - k)) *
                            (k % 4 < 2 ? 1 : -1) * GiNaC::pow(x, k);
            (k % 2 == 0 ? even : odd) += term;
        }
        const Propagation& step = stability_of({Family::gauss, s}).step;
        const GiNaC::lst square{step.z == x * x};
        const ex difference =
            step.a.subs(square) * (even * even + odd * odd) - step.delta.subs(square) * (even * even - odd * odd);
        CHECK(difference.expand().is_zero());
    }
}

TEST_CASE("the phase error has its closed form") {
    for (const Method& method : every_member()) {
        CAPTURE(method.name());
        const bool lobatto = method.family == Family::lobatto;
        const int r = method.points - (lobatto ? 1 : 0);
        const auto factorial = [](int k) { return GiNaC::factorial(numeric(k)); };
        const numeric kappa = factorial(r) * factorial(r) / (factorial(2 * r) * factorial(2 * r + 1));
        const Stability& member = stability_of(method);
        CHECK(member.phase_order == method.order());
        CHECK(abs(member.phase_error.numer()) == 1);  // as the text of the command says it
        CHECK(member.phase_error == (lobatto ? kappa / (2 * r) : -kappa));
        // And is what the angle does: at x = 1/16, to the next order.
        const cln::cl_R x = cln::cl_float(cln::cl_RA(1) / 16, cln::float_format(120));
        const cln::cl_R cosine = cln::the<cln::cl_R>((member.trace(numeric(1, 256)) / 2).to_cl_N());
        const cln::cl_R angle =
            cln::realpart(cln::acos(cln::complex(cln::cl_float(cosine, cln::float_format(120)), 0)));
        const double constant = cln::double_approx((angle / x - 1) / cln::expt(x, method.order()));
        CHECK(constant == doctest::Approx(member.phase_error.to_double()).epsilon(0.01));
    }
}

TEST_CASE("a kernel's own steps are unstable exactly where the intervals say") {
    for (const Method& method : {Method{Family::lobatto, 3}, Method{Family::lobatto, 5}, Method{Family::gauss, 3}}) {
        Scene scene = test::scene_of("q'^2/2 - q^2/2", "q = { position = 1, velocity = 0 }", 4);
        scene.method = method;
        const Kernel kernel = test::kernel_in_own_cache(derive(scene), Precision::double_);
        LoadedStepper<double> stepper(kernel);
        const Stability& member = stability_of(method);
        int unstable = 0, compared = 0;
        for (int i = 1; i <= 3000; ++i) {
            const double h = 0.005 * i;
            REQUIRE(stepper.prepare({}, h) == LOBATTO_OK);
            std::vector<double> q1, p1, T;
            REQUIRE(stepper.tangent(0, {0}, {0}, q1, p1, T) == LOBATTO_OK);
            const double trace = T[0] + T[3];
            if (std::fabs(std::fabs(trace) - 2) < 1e-7) continue;
            ++compared;
            const bool grows = std::fabs(trace) > 2;
            unstable += grows ? 1 : 0;
            CHECK(is_stable(member, h * h) == !grows);
        }
        CHECK(compared > 2900);
        CHECK((unstable > 100) == (method.family == Family::lobatto));
    }
}

TEST_CASE("a motion in a gap grows as fast as the exact trace says, and beside it not at all") {
    const Kernel kernel = test::kernel_in_own_cache(
        derive(test::scene_of("q'^2/2 - q^2/2", "q = { position = 1, velocity = 0 }", 4)), Precision::double_);
    LoadedStepper<double> stepper(kernel);
    const Stability& member = stability_of({Family::lobatto, 4});
    for (const double h : {3.12, 3.1375, 3.155, 6.5, 7.7, 9.0}) {
        REQUIRE(stepper.prepare({}, h) == LOBATTO_OK);
        const double expected = rate_of_step(member, numeric(cln::rational(cln::cl_DF(h * h))));
        const auto rate = measured_rate(stepper, h, 1 << 14);
        REQUIRE(rate);
        // What is left of the start is a constant factor: some 1/16384. Measured 1e-12 relative at most.
        CHECK(*rate == doctest::Approx(expected).epsilon(1e-6));
    }
    for (const double h : {0.1, 3.11, 3.17, 5.4, 8.0}) {
        REQUIRE(stepper.prepare({}, h) == LOBATTO_OK);
        CHECK(std::fabs(*measured_rate(stepper, h, 1 << 14)) < 1e-5);  // measured 1.6e-7
    }
}

TEST_CASE("the eigenvalues of a step at the top of a pendulum are those of its linearised step") {
    const Scene scene = test::pendulum_scene(4);
    const Derivation derivation = derive(scene);
    LoadedStepper<double> stepper(test::kernel_in_own_cache(derivation, Precision::double_));
    const double h = 0.2, omega = 1.5;
    REQUIRE(stepper.prepare({2, omega}, h) == LOBATTO_OK);
    const Stability& member = stability_of({Family::lobatto, 4});
    const auto top = step_eigenvalues(stepper, h, 0, {std::acos(-1.0)}, {0});
    REQUIRE(top);
    const double exact = rate_of_step(member, numeric(cln::rational(cln::cl_DF(-(h * omega) * (h * omega)))));
    CHECK(std::log(std::abs(top->front())) == doctest::Approx(exact).epsilon(1e-12));
    const auto bottom = step_eigenvalues(stepper, h, 0, {0}, {0});
    REQUIRE(bottom);
    CHECK(std::fabs(std::abs(bottom->front()) - 1) < 1e-14);
    const double angle = std::fabs(std::arg(bottom->front()));
    CHECK(angle == doctest::Approx(h * omega * (1 + std::pow(h * omega, 6) / 604800)).epsilon(1e-11));
    // Eight steps at once: eight times the angle.
    CHECK(std::fabs(std::arg(step_eigenvalues(stepper, h, 0, {0}, {0}, 8)->front())) ==
          doctest::Approx(8 * angle).epsilon(1e-10));
}

TEST_CASE("Newton's method finds the equilibria near a motion, each once, and none where there is none") {
    const Scene scene = test::pendulum_scene(4);
    const System system = build_system(scene);
    Linearisation linearisation(scene, system);
    std::vector<Eigen::VectorXd> starts;
    for (const double q : {0.3, -2.9, 1.5, 2.8, 6.0, 9.6}) starts.push_back(Eigen::VectorXd::Constant(1, q));
    const auto found = linearisation.equilibria(starts);
    REQUIRE(found.size() == 2);
    CHECK(found[0].q(0) == 0);
    CHECK(std::fabs(found[1].q(0)) == std::acos(-1.0));
    CHECK((*found[0].system.squared_frequencies())(0) == 2.25);
    CHECK((*found[1].system.squared_frequencies())(0) == -2.25);
    CHECK(found[1].system.rate() == 1.5);

    const Scene kepler = test::scene_of("(x'^2 + y'^2)/2 + 1/sqrt(x^2 + y^2)",
                                        "x = { position = 1, velocity = 0 }\ny = { position = 0, velocity = 1 }", 4);
    const System attraction = build_system(kepler);
    Linearisation orbit(kepler, attraction);
    CHECK(orbit.equilibria({Eigen::Vector2d(1, 0), Eigen::Vector2d(0.3, -2)}).empty());
}

TEST_CASE("of what hangs also the equilibria are found in which it stands, though the motion comes near none") {
    // A double pendulum, the lower one twice as long. With a spring at its pivot the lower angle alone is one.
    const auto found_of = [](const std::string& spring) {
        const Scene scene =
            test::scene_of("x'^2 + 2*y'^2 + 2*x'*y'*cos(x - y) + 2*cos(x) + 2*cos(y)" + spring,
                           "x = { position = 0.1, velocity = 0 }\ny = { position = 0.1, velocity = 0 }", 4);
        const System system = build_system(scene);
        return Linearisation(scene, system).equilibria({Eigen::Vector2d(0.1, 0.1)});
    };
    const auto pendulums = found_of("");
    REQUIRE(pendulums.size() == 4);
    std::set<std::pair<bool, bool>> stand;
    for (const Equilibrium& equilibrium : pendulums) {
        for (const double angle : equilibrium.q) CHECK(std::fabs(std::sin(angle)) < 1e-15);
        stand.emplace(std::cos(equilibrium.q(0)) < 0, std::cos(equilibrium.q(1)) < 0);
    }
    CHECK(stand.size() == 4);
    const auto sprung = found_of(" - 50*x^2");
    REQUIRE(sprung.size() == 2);
    CHECK(sprung[0].q == Eigen::Vector2d(0, 0));
    CHECK(sprung[1].q(0) == 0);
    CHECK(std::fabs(sprung[1].q(1)) == std::acos(-1.0));
}

TEST_CASE("frequencies are found only where the coordinates fall into independent oscillators") {
    const auto system_of = [](const std::string& lagrangian) {
        const Scene scene =
            test::scene_of(lagrangian, "x = { position = 1, velocity = 0 }\ny = { position = 0, velocity = 1 }", 4);
        const System system = build_system(scene);
        Linearisation linearisation(scene, system);
        return linearisation.at(0, Eigen::Vector2d(0, 0), Eigen::Vector2d(0, 0));
    };
    const auto springs = system_of("(2*x'^2 + y'^2)/2 - (x^2 + 2*y^2 + (x - y)^2)/2").squared_frequencies();
    REQUIRE(springs);
    // 2 l^2 - 8 l + 5 = 0.
    CHECK((*springs)(0) == doctest::Approx(2 - std::sqrt(1.5)));
    CHECK((*springs)(1) == doctest::Approx(2 + std::sqrt(1.5)));
    CHECK(!system_of("(x'^2 + y'^2)/2 + 3*(x*y' - y*x')/2 - (x^2 + y^2)/2").squared_frequencies());
    // A magnetic field holds what would fall: exponents i (3 -+ sqrt(9 - 8))/2.
    CHECK(std::fabs(system_of("(x'^2 + y'^2)/2 + 3*(x*y' - y*x')/2 + (2*x^2 + 2*y^2)/2").rate()) < 1e-40);
    CHECK(system_of("(x'^2 + y'^2)/2 + (x*y' - y*x')/2 + (2*x^2 + 2*y^2)/2").rate() > 1);
    CHECK(*system_of("(x'^2 + y'^2)/2 + 3*(x*y' - y*x')/2 + (2*x^2 + 2*y^2)/2").largest_frequency() ==
          doctest::Approx(2));
    CHECK(*system_of("(x'^2 + y'^2)/2 + (x*y' - y*x')/10 + (2*x^2 + 3*y^2)/2").largest_frequency() == 0);
    // Each block by its own sign.
    const auto signs = system_of("(x'^2 - y'^2)/2 - (x^2 - 3*y^2)/2").squared_frequencies();
    REQUIRE(signs);
    CHECK((*signs)(1) == 3);
    CHECK(system_of("(x'^2 - y'^2)/2 + x*y").obstacle() == "its masses have both signs");
}

TEST_CASE("a stiff coordinate hides no slow one, whether coupled or not") {
    const auto system_of = [](const std::string& lagrangian, const std::string& more = "") {
        const Scene scene = test::scene_of(
            lagrangian, "x = { position = 1, velocity = 0 }\ny = { position = 0, velocity = 1 }" + more, 4);
        const System system = build_system(scene);
        Linearisation linearisation(scene, system);
        return linearisation.at(0, Eigen::Vector2d(0, 0), Eigen::Vector2d(0, 0));
    };
    const auto lowest = [&](const std::string& lagrangian) {
        return (*system_of(lagrangian).squared_frequencies())(0);
    };
    CHECK(lowest("(x'^2 + y'^2)/2 + x^2/2 - 1e16*y^2/2") == -1);
    CHECK(lowest("(x'^2 + y'^2)/2 - x^2/2 - 1e16*y^2/2") == 1);
    CHECK(lowest("(x'^2 + y'^2)/2 - x^2/2 - 1e12*(x - y)^2/2") == doctest::Approx(0.5 - 0.125e-12).epsilon(1e-15));
    CHECK(lowest("(x'^2 + y'^2)/2 - x^2/2 - 1e30*(x - y)^2/2") == 0.5);
    CHECK(lowest("(x'^2 + y'^2)/2 - 1e30*(x - y)^2/2") == 0);
    const LinearSystem driven = system_of("(x'^2 + y'^2)/2 - x^2/2 - 1e24*y^2/2", "\n[forces]\nx = \"0.1*x'\"");
    CHECK(driven.obstacle() == "its forces depend on the velocities");
    CHECK(driven.rate() == doctest::Approx(0.05).epsilon(1e-14));
    // A hundred coordinates and more: in double precision.
    const Scene chain = test::scene_of("sum(i=1..120, x[i]'^2)/2 - sum(i=1..119, (x[i+1] - x[i])^2)/2",
                                       "x = { count = 120, position = 0, velocity = 1 }", 2);
    const System system = build_system(chain);
    const Eigen::VectorXd zero = Eigen::VectorXd::Zero(120);
    const auto squared = Linearisation(chain, system).at(0, zero, zero).squared_frequencies();
    REQUIRE(squared);
    CHECK((*squared)(0) == 0);
    CHECK((*squared)(1) == doctest::Approx(std::pow(2 * std::sin(std::acos(-1.0) / 240), 2)).epsilon(1e-10));
}

TEST_CASE("an equilibrium is where every force vanishes beside its own terms, however far or near it lies") {
    const auto found_from = [](const std::string& lagrangian, const std::vector<Eigen::VectorXd>& starts) {
        const Scene scene =
            starts.front().size() == 1
                ? test::scene_of(lagrangian, "x = { position = 1, velocity = 0 }", 4)
                : test::scene_of(lagrangian, "x = { position = 1, velocity = 0 }\ny = { position = 1, velocity = 0 }",
                                 4);
        const System system = build_system(scene);
        return Linearisation(scene, system).equilibria(starts);
    };
    const auto one = [](double x) { return Eigen::VectorXd(Eigen::VectorXd::Constant(1, x)); };
    // A stiff length beside a weak torque, from where a motion ran away to.
    const auto polar = found_from(
        "(x'^2 + x^2*y'^2)/2 - 450*(x - 1)^2 + x*cos(y)",
        {Eigen::Vector2d(1, 0.5), Eigen::Vector2d(1, 3), Eigen::Vector2d(1.8, 2432.3), Eigen::Vector2d(1e6, 1e9)});
    REQUIRE(polar.size() == 2);
    for (const Equilibrium& equilibrium : polar) {
        CHECK(std::fabs(std::sin(equilibrium.q(1))) < 1e-12);
        CHECK(equilibrium.q(0) == doctest::Approx(1 + std::cos(equilibrium.q(1)) / 900));
    }
    const auto small = found_from("x'^2/2 + x^2/2 - 1e14*x^4/4", {one(1.2e-7), one(2e-8)});
    REQUIRE(small.size() == 2);
    CHECK(small[0].q(0) == doctest::Approx(1e-7));
    CHECK(small[1].q(0) == 0);
    const auto far = found_from("(x'^2 + y'^2)/2 + cos(x)", {Eigen::Vector2d(3, 1e9), Eigen::Vector2d(0.5, 1e9)});
    REQUIRE(far.size() == 2);
    CHECK(far[0].q(0) == std::acos(-1.0));
    CHECK(far[1].q(0) == 0);
    // Multiple zeros of the force: their stiffness is zero, and each counts once.
    const auto flat = found_from("x'^2/2 - (x^2 - 1)^3", {one(0.5), one(0.7), one(1.3), one(-2), one(0.1)});
    REQUIRE(flat.size() == 2);
    CHECK(flat[0].q(0) == doctest::Approx(1).epsilon(1e-15));
    CHECK((*flat[0].system.squared_frequencies())(0) == 0);
    CHECK(flat[1].q(0) == 0);
    CHECK((*flat[1].system.squared_frequencies())(0) == 6);
    for (const std::string power : {"x^4", "x^10", "x^4 - x^6"}) {
        const auto quartic = found_from("x'^2/2 - (" + power + ")", {one(0.5), one(0.1)});
        REQUIRE(quartic.size() == 1);
        CHECK(quartic[0].q(0) == 0);
        CHECK((*quartic[0].system.squared_frequencies())(0) == 0);
    }
}
