// SPDX-License-Identifier: GPL-2.0-or-later
// The tables of all rules against published ones, and the propagation against the tables.
#include "generator/method/quadrature.hpp"

#include <cln/cln.h>
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "generator/check/check.hpp"
#include "generator/graph/graph.hpp"
#include "generator/graph/notation.hpp"
#include "generator/method/propagation.hpp"

using namespace lobatto;
using GiNaC::ex;
using GiNaC::numeric;

namespace {

ex root(int radicand) {
    return GiNaC::sqrt(ex(radicand));
}

bool equal(const ex& x, const ex& y) {
    return expand_exactly(x - y).is_zero();
}

std::vector<Method> all_methods() {
    std::vector<Method> methods;
    for (int points = 2; points <= 12; ++points) methods.push_back({Family::lobatto, points});
    for (int points = 1; points <= 10; ++points) methods.push_back({Family::gauss, points});
    return methods;
}

using Real = cln::cl_R;
using Reals = std::vector<Real>;

Real real(const ex& number) {  // 60 digits
    Graph graph;
    const Id id = graph.from(number, {});
    return graph.evaluate({}, {id})[static_cast<std::size_t>(id)];
}

Reals reals(const std::vector<ex>& numbers) {
    Reals result;
    for (const ex& number : numbers) result.push_back(real(number));
    return result;
}

std::vector<Reals> reals(const GiNaC::matrix& matrix) {
    std::vector<Reals> rows(matrix.rows());
    for (unsigned i = 0; i < matrix.rows(); ++i)
        for (unsigned j = 0; j < matrix.cols(); ++j) rows[i].push_back(real(matrix(i, j)));
    return rows;
}

double distance(const Real& x, const Real& y) {
    return cln::double_approx(cln::abs(x - y));
}

// Matrix x = right by elimination without exchanges: enough for the few systems here.
Reals solve(std::vector<Reals> matrix, Reals right) {
    const std::size_t n = right.size();
    for (std::size_t k = 0; k < n; ++k)
        for (std::size_t i = k + 1; i < n; ++i) {
            const Real factor = matrix[i][k] / matrix[k][k];
            for (std::size_t j = k; j < n; ++j) matrix[i][j] = matrix[i][j] - factor * matrix[k][j];
            right[i] = right[i] - factor * right[k];
        }
    for (std::size_t i = n; i-- > 0;) {
        for (std::size_t j = i + 1; j < n; ++j) right[i] = right[i] - matrix[i][j] * right[j];
        right[i] = right[i] / matrix[i][i];
    }
    return right;
}

struct State {
    Real q, p;
};

// One step of q'' = f - z q with h = 1: by (D11) ... (D17) ...
State reduced_step(const Quadrature& rule, const Real& z, const Real& f, const State& from) {
    const Reals c = reals(rule.c), b = reals(rule.b);
    std::vector<Reals> A = reals(rule.A);
    const std::size_t m = A.size();
    const Real v = from.p - b[0] * (z * from.q - f);
    Reals base;
    for (std::size_t i = 0; i < m; ++i) {
        base.push_back(from.q + c[i + 1] * v);
        for (std::size_t j = 0; j < m; ++j) {
            base[i] = base[i] + A[i][j] * f;
            A[i][j] = z * A[i][j] + (i == j ? 1 : 0);
        }
    }
    const Reals Q = solve(A, base);
    State to{from.q + v, v};
    for (std::size_t j = 0; j < m; ++j) {
        to.q = to.q - b[j + 1] * (1 - c[j + 1]) * (z * Q[j] - f);
        to.p = to.p - b[j + 1] * (z * Q[j] - f);
    }
    to.p = to.p - b.back() * (z * to.q - f);
    return to;
}

// ... and by the Galerkin form: sum_i b_i (D_ij q'_i + B_ij (f - z q_i)) + (j = 0) p0 - (j = last) p1 = 0 for every
// control point j.
State galerkin_step(const Quadrature& rule, const Real& z, const Real& f, const State& from) {
    const Reals b = reals(rule.weights);
    const std::vector<Reals> B = reals(rule.B), D = reals(rule.D);
    const std::size_t m = rule.control.size() - 1;
    std::vector<Reals> slope(m + 1, Reals(m + 1, 0));
    Reals constant(m + 1, 0);
    for (std::size_t j = 0; j <= m; ++j)
        for (std::size_t i = 0; i < b.size(); ++i) {
            constant[j] = constant[j] + b[i] * B[i][j] * f;
            for (std::size_t k = 0; k <= m; ++k)
                slope[j][k] = slope[j][k] + b[i] * (D[i][j] * D[i][k] - z * B[i][j] * B[i][k]);
        }
    std::vector<Reals> matrix;
    Reals right;
    for (std::size_t j = 0; j < m; ++j) {
        matrix.emplace_back(slope[j].begin() + 1, slope[j].end());
        right.push_back(-constant[j] - slope[j][0] * from.q - (j == 0 ? from.p : Real(0)));
    }
    const Reals X = solve(matrix, right);
    State to{X.back(), constant[m] + slope[m][0] * from.q};
    for (std::size_t k = 0; k < m; ++k) to.p = to.p + slope[m][k + 1] * X[k];
    return to;
}

}  // namespace

TEST_CASE("four points have the paper's nodes, weights and basis") {
    const Quadrature q = quadrature_of({Family::lobatto, 4});
    const ex xi = numeric(1, 2) - root(5) / 10;
    CHECK(equal(q.c[1], xi));
    CHECK(equal(q.c[2], 1 - xi));
    for (const std::size_t i : {0u, 3u}) CHECK(equal(q.b[i], numeric(1, 12)));
    for (const std::size_t i : {1u, 2u}) CHECK(equal(q.b[i], numeric(5, 12)));
    const ex t = q.theta;
    CHECK(equal(q.basis[0], 5 * (t - xi) * (t - (1 - xi)) * (1 - t)));
    CHECK(equal(q.basis[1], -5 * root(5) * t * (1 - t) * (t - (1 - xi))));
    CHECK(equal(q.basis[2], 5 * root(5) * t * (1 - t) * (t - xi)));
    CHECK(equal(q.basis[3], 5 * t * (t - xi) * (t - (1 - xi))));
}

TEST_CASE("four points have the paper's rigidity matrix K") {
    const Quadrature q = quadrature_of({Family::lobatto, 4});
    const ex left = -5 * root(5) / 4 - numeric(25, 12), right = 5 * root(5) / 4 - numeric(25, 12);
    const ex K[4][4] = {{numeric(13, 3), left, right, numeric(-1, 6)},
                        {left, numeric(25, 3), numeric(-25, 6), right},
                        {right, numeric(-25, 6), numeric(25, 3), left},
                        {numeric(-1, 6), right, left, numeric(13, 3)}};
    for (unsigned i = 0; i < 4; ++i)
        for (unsigned j = 0; j < 4; ++j) CHECK(equal(q.K(i, j), K[i][j]));
}

TEST_CASE("four points have the stage matrix A = [1/60, (11 - 5 sqrt 5)/120; (11 + 5 sqrt 5)/120, 1/60]") {
    const Quadrature q = quadrature_of({Family::lobatto, 4});
    CHECK(equal(q.A(0, 0), numeric(1, 60)));
    CHECK(equal(q.A(0, 1), (11 - 5 * root(5)) / 120));
    CHECK(equal(q.A(1, 0), (11 + 5 * root(5)) / 120));
    CHECK(equal(q.A(1, 1), numeric(1, 60)));
}

TEST_CASE("two points are the trapezoidal rule, three are Simpson's, five have the weights 1/20, 49/180, 16/45") {
    const auto weights = [](int points, const std::vector<ex>& expected) {
        const Quadrature q = quadrature_of({Family::lobatto, points});
        REQUIRE(q.b.size() == expected.size());
        for (std::size_t i = 0; i < expected.size(); ++i) CHECK(equal(q.b[i], expected[i]));
    };
    weights(2, {numeric(1, 2), numeric(1, 2)});
    weights(3, {numeric(1, 6), numeric(2, 3), numeric(1, 6)});
    weights(5, {numeric(1, 20), numeric(49, 180), numeric(16, 45), numeric(49, 180), numeric(1, 20)});
    CHECK(equal(quadrature_of({Family::lobatto, 3}).A(0, 0), numeric(1, 24)));
    CHECK(equal(quadrature_of({Family::lobatto, 5}).c[1], (7 - root(21)) / 14));
}

TEST_CASE("Gauss' rules with 2 and 3 stages have Kuntzmann's and Butcher's matrices, squared") {
    const auto is_square = [](const Quadrature& rule, const GiNaC::matrix& a) {
        const GiNaC::matrix square = a.mul(a);
        for (unsigned i = 0; i < a.rows(); ++i)
            for (unsigned j = 0; j < a.cols(); ++j) CHECK(equal(rule.A(i, j), square(i, j)));
    };
    const ex sixth = root(3) / 6, quarter = numeric(1, 4);
    is_square(quadrature_of({Family::gauss, 1}), {{numeric(1, 2)}});
    is_square(quadrature_of({Family::gauss, 2}), {{quarter, quarter - sixth}, {quarter + sixth, quarter}});
    const ex r = root(15);
    is_square(quadrature_of({Family::gauss, 3}), {{numeric(5, 36), numeric(2, 9) - r / 15, numeric(5, 36) - r / 30},
                                                  {numeric(5, 36) + r / 24, numeric(2, 9), numeric(5, 36) - r / 24},
                                                  {numeric(5, 36) + r / 30, numeric(2, 9) + r / 15, numeric(5, 36)}});
    CHECK(equal(quadrature_of({Family::gauss, 3}).control[1], quarter));
}

TEST_CASE("all rules have the published nodes and weights") {
    // On [-1, 1], not negative. Abramowitz and Stegun, tables 25.4 and 25.6 (Lobatto to 10 points), digits after the
    // 15th and Lobatto with 11 and 12 points from the roots of the Legendre polynomials by mpmath.
    struct Published {
        Method method;
        std::vector<double> nodes, weights;
    };
    const std::vector<Published> table = {
        {{Family::gauss, 1}, {0.0}, {2.0}},
        {{Family::gauss, 2}, {0.5773502691896258}, {1.0}},
        {{Family::gauss, 3}, {0.0, 0.7745966692414834}, {0.8888888888888889, 0.5555555555555556}},
        {{Family::gauss, 4}, {0.3399810435848563, 0.8611363115940526}, {0.6521451548625461, 0.3478548451374539}},
        {{Family::gauss, 5},
         {0.0, 0.5384693101056831, 0.906179845938664},
         {0.5688888888888889, 0.4786286704993665, 0.2369268850561891}},
        {{Family::gauss, 6},
         {0.2386191860831969, 0.6612093864662645, 0.932469514203152},
         {0.467913934572691, 0.3607615730481386, 0.1713244923791703}},
        {{Family::gauss, 7},
         {0.0, 0.4058451513773972, 0.7415311855993944, 0.9491079123427585},
         {0.4179591836734694, 0.3818300505051189, 0.2797053914892767, 0.1294849661688697}},
        {{Family::gauss, 8},
         {0.1834346424956498, 0.525532409916329, 0.7966664774136267, 0.9602898564975362},
         {0.362683783378362, 0.3137066458778873, 0.2223810344533745, 0.1012285362903763}},
        {{Family::gauss, 9},
         {0.0, 0.3242534234038089, 0.6133714327005904, 0.8360311073266358, 0.9681602395076261},
         {0.3302393550012598, 0.3123470770400028, 0.2606106964029355, 0.1806481606948574, 0.08127438836157441}},
        {{Family::gauss, 10},
         {0.1488743389816312, 0.4333953941292472, 0.6794095682990244, 0.8650633666889845, 0.9739065285171717},
         {0.2955242247147529, 0.2692667193099964, 0.219086362515982, 0.1494513491505806, 0.06667134430868814}},
        {{Family::lobatto, 2}, {1.0}, {1.0}},
        {{Family::lobatto, 3}, {0.0, 1.0}, {1.333333333333333, 0.3333333333333333}},
        {{Family::lobatto, 4}, {0.4472135954999579, 1.0}, {0.8333333333333333, 0.1666666666666667}},
        {{Family::lobatto, 5}, {0.0, 0.6546536707079771, 1.0}, {0.7111111111111111, 0.5444444444444444, 0.1}},
        {{Family::lobatto, 6},
         {0.2852315164806451, 0.7650553239294647, 1.0},
         {0.5548583770354864, 0.378474956297847, 0.06666666666666667}},
        {{Family::lobatto, 7},
         {0.0, 0.4688487934707142, 0.8302238962785669, 1.0},
         {0.4876190476190476, 0.4317453812098626, 0.2768260473615659, 0.04761904761904762}},
        {{Family::lobatto, 8},
         {0.2092992179024789, 0.5917001814331423, 0.8717401485096066, 1.0},
         {0.4124587946587039, 0.3411226924835044, 0.210704227143506, 0.03571428571428571}},
        {{Family::lobatto, 9},
         {0.0, 0.3631174638261782, 0.6771862795107378, 0.8997579954114602, 1.0},
         {0.3715192743764172, 0.3464285109730463, 0.2745387125001617, 0.1654953615608055, 0.02777777777777778}},
        {{Family::lobatto, 10},
         {0.165278957666387, 0.4779249498104445, 0.7387738651055051, 0.9195339081664588, 1.0},
         {0.3275397611838975, 0.2920426836796838, 0.2248893420631265, 0.1333059908510701, 0.02222222222222222}},
        {{Family::lobatto, 11},
         {0.0, 0.2957581355869394, 0.565235326996205, 0.7844834736631444, 0.9340014304080591, 1.0},
         {0.3002175954556907, 0.2868791247790081, 0.2480481042640283, 0.1871698817803052, 0.1096122732669949,
          0.01818181818181818}},
        {{Family::lobatto, 12},
         {0.1365529328549276, 0.3995309409653489, 0.6328761530318607, 0.8192793216440067, 0.9448992722228822, 1.0},
         {0.2714052409106962, 0.2512756031992013, 0.2125084177610211, 0.1579747055643701, 0.09168451741319613,
          0.01515151515151515}},
    };
    CHECK(table.size() == all_methods().size());
    for (const Published& published : table) {
        CAPTURE(published.method.name());
        const Quadrature rule = quadrature_of(published.method);
        const std::size_t r = rule.nodes.size(), half = published.nodes.size();
        REQUIRE(r == static_cast<std::size_t>(published.method.points));
        REQUIRE(half == (r + 1) / 2);
        for (std::size_t k = 0; k < half; ++k)
            for (const bool mirrored : {false, true}) {
                const std::size_t i = mirrored ? half - 1 - k : r - half + k;
                const Real x = 2 * real(rule.nodes[i]) - 1;
                CHECK(distance(mirrored ? -x : x, published.nodes[k]) < 1.2e-16);  // half a unit of the 16th digit
                CHECK(distance(2 * real(rule.weights[i]), published.weights[k]) < 6e-16);
            }
        CHECK(rule.exact == (published.method.points <= (published.method.family == Family::lobatto ? 5 : 3)));
    }
}

TEST_CASE("every rule passes its checks, floats far below their bound") {
    for (const Method& method : all_methods()) {
        const Quadrature rule = quadrature_of(method);
        for (const Check& check : check_quadrature(rule)) {
            CAPTURE(method.name() + ": " + check.claim);
            CHECK(check.holds);
            CHECK(check.exact == rule.exact);
            CHECK(check.measured < 1e-100);  // measured 5.8e-102 at most, Lobatto with 12 points
        }
    }
}

TEST_CASE("a number spoiled in its 45th digit fails a check, whichever it is") {
    for (const Method& method :
         {Method{Family::lobatto, 4}, {Family::lobatto, 7}, {Family::gauss, 2}, {Family::gauss, 5}}) {
        const ex spoil = GiNaC::pow(ex(10), -45);
        const std::vector<std::pair<const char*, std::function<void(Quadrature&)>>> ways = {
            {"c", [&](Quadrature& q) { q.c[1] += spoil; }},
            {"b", [&](Quadrature& q) { q.b[1] += spoil; }},
            {"A", [&](Quadrature& q) { q.A(1, 0) += spoil; }},
            {"E", [&](Quadrature& q) { q.E(1, 2) += spoil; }},
            {"nodes", [&](Quadrature& q) { q.nodes[1] += spoil; }},
            {"weights", [&](Quadrature& q) { q.weights[1] += spoil; }},
            {"control", [&](Quadrature& q) { q.control[1] += spoil; }},
            {"basis", [&](Quadrature& q) { q.basis[1] += spoil * q.theta; }},
            {"B", [&](Quadrature& q) { q.B(1, 0) += spoil; }},
            {"D", [&](Quadrature& q) { q.D(0, 1) += spoil; }},
            {"K", [&](Quadrature& q) { q.K(1, 1) += spoil; }},
            {"G", [&](Quadrature& q) { q.G(0, 0) += spoil; }},
            {"extrapolation", [&](Quadrature& q) { q.extrapolation(1, 0) += spoil; }},
            {"legendre", [&](Quadrature& q) { q.legendre[1] += spoil; }}};
        for (const auto& way : ways) {
            CAPTURE(method.name() + ": " + way.first);
            Quadrature rule = quadrature_of(method);
            way.second(rule);
            const auto checks = check_quadrature(rule);
            CHECK(std::any_of(checks.begin(), checks.end(), [](const Check& check) { return !check.holds; }));
        }
    }
}

TEST_CASE("equal numbers of a float table are equal, and what is rational and simple is exact") {
    for (const Method& method : {Method{Family::lobatto, 11}, {Family::gauss, 9}}) {
        const Quadrature rule = quadrature_of(method);
        const std::size_t last = rule.c.size() - 1;
        CHECK(rule.c[0].is_zero());
        CHECK(rule.c[last].is_equal(1));
        CHECK(rule.c[last / 2].is_equal(numeric(1, 2)));
        for (std::size_t i = 0; i <= last; ++i) CHECK(rule.b[i].is_equal(rule.b[last - i]));
        for (unsigned i = 0; i < rule.K.rows(); ++i)
            for (unsigned j = 0; j < i; ++j) CHECK(rule.K(i, j).is_equal(rule.K(j, i)));
        const unsigned middle = rule.D.rows() / 2;
        if (method.family == Family::lobatto) CHECK(rule.D(middle, middle).is_zero());
    }
}

TEST_CASE("the numbers of a float table reach the graph with 60 digits") {
    // Roots of P_4 in closed form.
    const Quadrature rule = quadrature_of({Family::gauss, 4});
    const ex closed = (1 - GiNaC::sqrt(numeric(3, 7) - 2 * GiNaC::sqrt(ex(30)) / 35)) / 2;
    CHECK(distance(real(rule.nodes[1]), real(closed)) < 1e-60);
    CHECK(distance(real(rule.weights[1]), real((18 + root(30)) / 72)) < 1e-60);
}

TEST_CASE("the numbers of a float table combine with others and read as 25 digits") {
    Graph graph;
    const Id x = graph.input({"x", "x"}), c = graph.from(quadrature_of({Family::gauss, 4}).nodes[1], {});
    const Id product = graph.negate(graph.multiply({graph.number(2), c, x}));
    CHECK(formula(graph, product, Notation::text) == "-0.6600189564151437351973342*x");
    CHECK(formula(graph, graph.subtract(product, product), Notation::text) == "0");
}

TEST_CASE("rules outside 2 to 12 points and 1 to 10 stages are refused") {
    CHECK_THROWS_WITH(quadrature_of({Family::lobatto, 1}), "Lobatto, 1 points: the rules there are have 2 to 12");
    CHECK_THROWS_WITH(quadrature_of({Family::lobatto, 13}), "Lobatto, 13 points: the rules there are have 2 to 12");
    CHECK_THROWS_WITH(quadrature_of({Family::gauss, 0}), "Gauss, 0 stages: the rules there are have 1 to 10");
    CHECK_THROWS_WITH(quadrature_of({Family::gauss, 11}), "Gauss, 11 stages: the rules there are have 1 to 10");
}

TEST_CASE("the determinant of the oscillator's propagation is exactly 1, for every rule") {
    for (const Method& method : all_methods()) {
        CAPTURE(method.name());
        const Propagation p = propagation(quadrature_of(method));
        CHECK(equal(p.a * p.a - p.b * p.c, p.delta * p.delta));
        CHECK(p.a.subs(p.z == 0).is_equal(1));
        CHECK(p.c.subs(p.z == 0).is_equal(1));  // q1 = q0 + (h/m) p0 when nothing pulls
        CHECK(p.b.subs(p.z == 0).is_zero());
        CHECK(p.b.coeff(p.z, 1).is_equal(-1));
        CHECK(p.delta.subs(p.z == 0).is_equal(1));
        CHECK(GiNaC::gcd(GiNaC::gcd(p.a, p.delta), GiNaC::gcd(p.b, p.c)).is_equal(1));
    }
}

TEST_CASE("the propagation is the step of the tables, reduced and Galerkin, with a force") {
    const Real z = cln::cl_RA("7/3"), f = cln::cl_RA("3/5");
    const State from{cln::cl_RA("2/7"), cln::cl_RA("-5/4")};
    for (const Method& method : all_methods()) {
        CAPTURE(method.name());
        const Quadrature rule = quadrature_of(method);
        const Propagation exact = propagation(rule);
        const auto at_z = [&](const ex& polynomial) { return real(polynomial.subs(exact.z == numeric(7, 3))); };
        const Real delta = at_z(exact.delta);
        const Real q = (at_z(exact.a) * from.q + at_z(exact.c) * from.p + at_z(exact.e_q) * f) / delta;
        const Real p = (at_z(exact.b) * from.q + at_z(exact.a) * from.p + at_z(exact.e_p) * f) / delta;
        const State reduced = reduced_step(rule, z, f, from), galerkin = galerkin_step(rule, z, f, from);
        // Measured 1.4e-76 at most: sqrt(d) of the exact tables has 77 digits here.
        CHECK(distance(reduced.q, q) < 1e-75);
        CHECK(distance(reduced.p, p) < 1e-75);
        CHECK(distance(galerkin.q, q) < 1e-75);
        CHECK(distance(galerkin.p, p) < 1e-75);
        CHECK(distance(q, from.q) > 0.1);
    }
}

TEST_CASE("the propagation agrees with the oscillator to the order of the rule") {
    for (const Method& method : all_methods()) {
        CAPTURE(method.name());
        const Propagation p = propagation(quadrature_of(method));
        // delta times the series of cos(sqrt z) and sin(sqrt z)/sqrt z; an error of h^(order + 1) is one of
        // z^(order/2 + 1) in a and of z^(order/2) in c.
        ex cosine = 0, sine = 0;
        for (int k = 0; k <= method.order(); ++k) {
            cosine += GiNaC::pow(-p.z, k) / GiNaC::factorial(numeric(2 * k));
            sine += GiNaC::pow(-p.z, k) / GiNaC::factorial(numeric(2 * k + 1));
        }
        const ex a = (p.a - p.delta * cosine).expand(), c = (p.c - p.delta * sine).expand();
        CHECK(a.ldegree(p.z) == method.order() / 2 + 1);
        CHECK(c.ldegree(p.z) == method.order() / 2);
    }
}

TEST_CASE("h omega < 2, sqrt 8, sqrt(42 - 6 sqrt 29) is stable for Lobatto's rules, every h for Gauss'") {
    const auto growth = [](const Propagation& p, const numeric& z) {  // |a/delta| <= 1: no growth
        const auto at_z = [&](const ex& polynomial) { return GiNaC::ex_to<numeric>(polynomial.subs(p.z == z)); };
        return (abs(at_z(p.a) / at_z(p.delta)) - 1).to_double();
    };
    const double limits[] = {4, 8, 42 - 6 * std::sqrt(29.0)};  // z = (h omega)^2
    for (int points = 2; points <= 4; ++points) {
        CAPTURE(points);
        const double limit = limits[points - 2];
        const Propagation p = propagation(quadrature_of({Family::lobatto, points}));
        for (int k = 1; k <= 200; ++k) CHECK(growth(p, numeric(limit * k / 200.0001)) <= 0);
        CHECK(growth(p, numeric(limit * 1.00001)) > 0);
    }
    for (int stages = 1; stages <= 10; ++stages) {
        CAPTURE(stages);
        const Propagation p = propagation(quadrature_of({Family::gauss, stages}));
        for (int k = -40; k <= 120; ++k) CHECK(growth(p, numeric(std::pow(1.1, k))) <= 0);
    }
}

TEST_CASE("four points propagate the oscillator by the paper's polynomials in z = h^2 omega^2") {
    const Propagation p = propagation(quadrature_of({Family::lobatto, 4}));
    const ex z = p.z;
    CHECK(equal(p.delta, 1 + z / 30 + z * z / 1800));
    CHECK(equal(p.a, 1 - 7 * z / 15 + 23 * z * z / 900 - z * z * z / 3600));
    CHECK(equal(p.b, z * (z - 60) * (z * z - 84 * z + 720) / 43200));
    CHECK(equal(p.c, 1 - 2 * z / 15 + z * z / 300));
}

TEST_CASE("two points propagate the oscillator as Stoermer and Verlet do, three as Simpson's rule") {
    const Propagation verlet = propagation(quadrature_of({Family::lobatto, 2}));
    CHECK(equal(verlet.delta, 1));
    CHECK(equal(verlet.a, 1 - verlet.z / 2));
    CHECK(equal(verlet.b, -verlet.z * (1 - verlet.z / 4)));
    CHECK(equal(verlet.c, 1));
    const Propagation simpson = propagation(quadrature_of({Family::lobatto, 3}));
    const ex z = simpson.z;
    // The middle position is (q0 + q1)/2 (1 - z/24 ...): eliminated by hand.
    CHECK(equal(simpson.delta, 1 + z / 24));
    CHECK(equal(simpson.a, 1 - 11 * z / 24 + z * z / 48));
    CHECK(equal(simpson.c, 1 - z / 8));
}
