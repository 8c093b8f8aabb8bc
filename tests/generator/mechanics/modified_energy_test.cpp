// SPDX-License-Identifier: GPL-2.0-or-later
// The leading term of the modified energy: against known formulas, against the exact linear step, against kernels.
#include "generator/mechanics/modified_energy.hpp"

#include <doctest/doctest.h>

#include <cmath>

#include "generator/graph/notation.hpp"
#include "generator/mechanics/algebra/sample.hpp"
#include "generator/method/stability.hpp"
#include "tests/scenes/scenes.hpp"

namespace {

using namespace lobatto;
using GiNaC::ex;
using GiNaC::numeric;

System system_of(const Method& method, const std::string& lagrangian, const std::string& coordinates) {
    Scene scene = test::scene_of(lagrangian, coordinates, 4);
    scene.method = method;
    return build_system(scene);
}

cln::cl_R exactly(__float128 x) {
    cln::cl_RA sum = 0;
    for (int part = 0; part < 4; ++part) {
        const double leading = static_cast<double>(x);
        sum = sum + cln::rational(cln::cl_DF(leading));
        x -= leading;
    }
    return sum;
}

// How much H and H + h^order H_order vary in `steps` steps of a kernel in quadruple precision.
std::pair<double, double> variations(const Kernel& kernel, const System& system, const ModifiedEnergy& modified,
                                     double step, int steps) {
    LoadedStepper<__float128> stepper(kernel);
    REQUIRE(stepper.prepare({}, step) == LOBATTO_OK);
    const auto n = static_cast<std::size_t>(system.n);
    std::vector<__float128> q(n, 0.9), p(n, 0.3);
    p[0] = 0.1;
    REQUIRE(stepper.start(0, q, p) == LOBATTO_OK);
    Formulas formulas;
    std::vector<Id> ids;
    cln::cl_R low[2], high[2];
    for (int i = 0; i <= steps; ++i) {
        __float128 time;
        stepper.state(time, q, p);
        for (std::size_t k = 0; k < n; ++k) {
            formulas.set(system.q[k], cln::cl_float(exactly(q[k]), cln::float_format(60)));
            formulas.set(modified.p[k], cln::cl_float(exactly(p[k]), cln::float_format(60)));
        }
        if (i == 0) ids = formulas.convert({modified.energy, modified.term});
        const auto values = formulas.evaluate(ids);
        const cln::cl_R power = cln::expt(cln::rational(cln::cl_DF(step)), modified.order);
        const cln::cl_R energies[2] = {values[0], values[0] + power * values[1]};
        for (int e = 0; e < 2; ++e) {
            low[e] = i == 0 ? energies[e] : cln::min(low[e], energies[e]);
            high[e] = i == 0 ? energies[e] : cln::max(high[e], energies[e]);
        }
        lobatto_advance call{};
        call.steps = 1;
        REQUIRE(stepper.advance(call) == LOBATTO_OK);
    }
    return {cln::double_approx(high[0] - low[0]), cln::double_approx(high[1] - low[1])};
}

}  // namespace

TEST_CASE("the modified energies of two points and of one stage are the classical ones") {
    // E. Hairer, C. Lubich, G. Wanner, Acta Numerica 12 (2003), section 4 for Stormer and Verlet; the implicit midpoint
    // rule: Geometric Numerical Integration, IX.
    CHECK(canonical_text(*general_modified_energy({Family::lobatto, 2})) == "V_2*p^2/(12*m^2) - V_1^2/(24*m)");
    CHECK(canonical_text(*general_modified_energy({Family::gauss, 1})) == "-V_1^2/(24*m) - V_2*p^2/(24*m^2)");
}

TEST_CASE("the formula in V's derivatives is the one derived for a scene's V") {
    for (const Method& method : {Method{Family::lobatto, 2}, Method{Family::lobatto, 3}, Method{Family::lobatto, 4},
                                 Method{Family::lobatto, 5}, Method{Family::gauss, 2}, Method{Family::gauss, 4}}) {
        CAPTURE(method.name());
        const System system =
            system_of(method, "3*q'^2/2 - (q^5/5 - q^3 + sin(2*q))", "q = { position = 1, velocity = 0 }");
        const auto modified = modified_energy(system, method);
        REQUIRE(modified);
        CHECK(modified->order == method.order());
        ex general = *general_modified_energy(method);
        GiNaC::exmap values;
        for (GiNaC::const_preorder_iterator node = general.preorder_begin(); node != general.preorder_end(); ++node) {
            if (!GiNaC::is_a<GiNaC::symbol>(*node)) continue;
            const std::string name = GiNaC::ex_to<GiNaC::symbol>(*node).get_name();
            values[*node] = name == "m" ? ex(3)
                            : name == "p"
                                ? ex(modified->p[0])
                                : system.potential.diff(system.q[0], static_cast<unsigned>(std::stoi(name.substr(2))));
        }
        CHECK((general.subs(values) - modified->term).expand().is_zero());
    }
}

TEST_CASE("of an oscillator the modified energy turns the phase by the exact step's phase error") {
    // V = q^2/2: H_order = alpha p^2 + beta q^2, and on average over the angle of q and p the frequency changes by
    // alpha + beta.
    for (const Method& method : {Method{Family::lobatto, 2}, Method{Family::lobatto, 3}, Method{Family::lobatto, 4},
                                 Method{Family::lobatto, 5}, Method{Family::gauss, 1}, Method{Family::gauss, 2},
                                 Method{Family::gauss, 3}, Method{Family::gauss, 4}}) {
        CAPTURE(method.name());
        const System system = system_of(method, "q'^2/2 - q^2/2", "q = { position = 1, velocity = 0 }");
        const auto modified = modified_energy(system, method);
        REQUIRE(modified);
        const ex term = modified->term.expand(), q = system.q[0], p = modified->p[0];
        const ex alpha = term.coeff(p, 2), beta = term.coeff(q, 2);
        CHECK((term - alpha * p * p - beta * q * q).expand().is_zero());
        CHECK((alpha + beta).is_equal(stability(quadrature_of(method)).phase_error));
    }
}

TEST_CASE("steps keep H + h^order H_order two orders better than H") {
    // A pendulum, and two coordinates coupled by an anharmonic potential and by their masses.
    struct Case {
        Method method;
        std::string lagrangian, coordinates;
        double step;
    };
    const std::string one = "q = { position = 1, velocity = 0 }",
                      two = "x = { position = 1, velocity = 0 }\ny = { position = 0, velocity = 1 }";
    for (const Case& scene : {Case{{Family::lobatto, 2}, "q'^2/2 + cos(q)", one, 0.05},
                              Case{{Family::lobatto, 3}, "q'^2/2 + cos(q)", one, 0.1},
                              Case{{Family::lobatto, 4}, "q'^2/2 + cos(q)", one, 0.2},
                              Case{{Family::gauss, 2}, "q'^2/2 + cos(q)", one, 0.1},
                              Case{{Family::lobatto, 3}, "x'^2 + x'*y' + y'^2 - x^4/4 - y^2/2 - x*y^2/2", two, 0.1}}) {
        CAPTURE(scene.method.name());
        Scene given = test::scene_of(scene.lagrangian, scene.coordinates, 4);
        given.method = scene.method;
        const Derivation derivation = derive(given);
        const Kernel kernel = test::kernel_in_own_cache(derivation, Precision::quadruple);
        const auto modified = modified_energy(derivation.system, scene.method);
        REQUIRE(modified);
        const auto [H, sum] = variations(kernel, derivation.system, *modified, scene.step, 60);
        const auto [H_fine, sum_fine] = variations(kernel, derivation.system, *modified, scene.step / 2, 120);
        const double order = std::log2(H / H_fine), better = std::log2(sum / sum_fine);
        CAPTURE(order);
        CAPTURE(better);
        CHECK(std::fabs(order - scene.method.order()) < 0.15);
        CHECK(std::fabs(better - scene.method.order() - 2) < 0.15);
        CHECK(sum < 0.1 * H);
    }
}

TEST_CASE("there is no modified energy where its derivation does not hold or would fill pages") {
    const std::string one = "q = { position = 1, velocity = 0 }";
    const Method method{Family::lobatto, 3};
    CHECK(!modified_energy(system_of(method, "(1 + q^2)*q'^2/2", one), method));
    CHECK(!modified_energy(system_of(method, "q'^2/2 + cos(q)", one), {Family::lobatto, 6}));
    CHECK(!general_modified_energy({Family::gauss, 5}));
    const Scene forced = read_scene(Source(
        "test.toml",
        "title = \"T\"\nlagrangian = \"q'^2/2\"\n[coordinates]\nq = { position = 1, velocity = 0 }\n[forces]\nq = "
        "\"-q^3\"\n[run]\nstep = 0.1\nuntil = 1\n"));
    CHECK(!modified_energy(build_system(forced), method));
}
