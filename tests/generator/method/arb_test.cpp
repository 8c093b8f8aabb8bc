// SPDX-License-Identifier: GPL-2.0-or-later
// Nodes, weights and zeros of polynomials against Arb, whose balls are proved to hold the true number.
#include <arb_fmpz_poly.h>
#include <arb_hypgeom.h>
#include <doctest/doctest.h>
#include <flint/fmpq_poly.h>

#include <random>
#include <sstream>

#include "generator/method/quadrature.hpp"
#include "generator/method/real_roots.hpp"

namespace {

using namespace lobatto;

constexpr int digits = 200;
constexpr slong bits = 700;  // that is 210 digits

class Ball {
public:
    Ball() { arb_init(value); }
    ~Ball() { arb_clear(value); }
    Ball(const Ball&) = delete;
    Ball& operator=(const Ball&) = delete;

    arb_t value;
};

// Whether a number, exact or a float, is the one in the ball but for 10^exponent.
bool is_in(const Ball& ball, const GiNaC::ex& number, int exponent) {
    const long before = GiNaC::Digits;
    GiNaC::Digits = digits;
    std::ostringstream text;
    text << GiNaC::ex_to<GiNaC::numeric>(number.evalf());
    GiNaC::Digits = before;
    Ball ours, off, bound;
    REQUIRE(arb_set_str(ours.value, text.str().c_str(), bits) == 0);
    REQUIRE(arb_set_str(bound.value, ("1e" + std::to_string(exponent)).c_str(), bits) == 0);
    arb_sub(off.value, ours.value, ball.value, bits);
    arb_abs(off.value, off.value);
    return arb_lt(off.value, bound.value) != 0;
}

constexpr int of_floats = -145;  // numbers that are not exact have 150 digits

// x on [-1, 1] as c = (1 - x)/2 on [0, 1], and a weight there halved.
void to_step(Ball& node, Ball& weight) {
    arb_sub_ui(node.value, node.value, 1, bits);
    arb_div_si(node.value, node.value, -2, bits);
    arb_div_ui(weight.value, weight.value, 2, bits);
}

class Polynomial {
public:
    Polynomial() { fmpz_poly_init(value); }
    ~Polynomial() { fmpz_poly_clear(value); }
    Polynomial(const Polynomial&) = delete;
    Polynomial& operator=(const Polynomial&) = delete;

    fmpz_poly_t value;
};

// The real zeros of a polynomial without multiple ones, ascending.
class Zeros {
public:
    explicit Zeros(const Polynomial& f)
        : degree_(std::max<slong>(fmpz_poly_degree(f.value), 0)), all_(_acb_vec_init(degree_)) {
        arb_fmpz_poly_complex_roots(all_, f.value, 0, bits);  // real ones first, which have no imaginary part at all
        while (count_ < degree_ && arb_is_zero(acb_imagref(all_ + count_))) ++count_;
        std::sort(all_, all_ + count_, [](const acb_struct& a, const acb_struct& b) {
            return arb_lt(acb_realref(&a), acb_realref(&b)) != 0;
        });
    }
    ~Zeros() { _acb_vec_clear(all_, degree_); }
    Zeros(const Zeros&) = delete;
    Zeros& operator=(const Zeros&) = delete;

    slong count() const { return count_; }
    void get(slong index, Ball& ball) const { arb_set(ball.value, acb_realref(all_ + index)); }

private:
    slong degree_, count_ = 0;
    acb_ptr all_;
};

}  // namespace

TEST_CASE("Gauss' nodes and weights lie in Arb's balls") {
    for (const int stages : sizes_of(Family::gauss)) {
        CAPTURE(stages);
        const Quadrature rule = quadrature_of({Family::gauss, stages});
        for (int i = 0; i < stages; ++i) {
            Ball node, weight;
            arb_hypgeom_legendre_p_ui_root(node.value, weight.value, static_cast<ulong>(stages), static_cast<ulong>(i),
                                           bits);
            to_step(node, weight);
            CHECK(is_in(node, rule.nodes[static_cast<std::size_t>(i)], of_floats));
            CHECK(is_in(weight, rule.weights[static_cast<std::size_t>(i)], of_floats));
        }
    }
}

TEST_CASE("Lobatto's nodes are the ends and the zeros of a derivative of Legendre's, with their weights") {
    for (const int points : sizes_of(Family::lobatto)) {
        CAPTURE(points);
        const Quadrature rule = quadrature_of({Family::lobatto, points});
        const auto degree = static_cast<ulong>(points - 1);
        fmpq_poly_t legendre;
        fmpq_poly_init(legendre);
        fmpq_poly_legendre_p(legendre, degree);
        fmpq_poly_derivative(legendre, legendre);
        Polynomial slope;
        fmpq_poly_get_numerator(slope.value, legendre);
        fmpq_poly_clear(legendre);
        const Zeros zeros(slope);
        REQUIRE(zeros.count() == points - 2);
        for (int i = 0; i < points; ++i) {
            Ball node, weight, value;
            if (i == 0 || i == points - 1)
                arb_set_si(node.value, i == 0 ? 1 : -1);
            else
                zeros.get(points - 2 - i, node);
            arb_hypgeom_legendre_p_ui(value.value, weight.value, degree, node.value, bits);
            arb_mul(value.value, value.value, value.value, bits);
            arb_mul_si(value.value, value.value, points * (points - 1), bits);
            arb_ui_div(weight.value, 2, value.value, bits);
            to_step(node, weight);
            CHECK(is_in(node, rule.nodes[static_cast<std::size_t>(i)], of_floats));
            CHECK(is_in(weight, rule.weights[static_cast<std::size_t>(i)], of_floats));
        }
    }
}

TEST_CASE("the positive zeros of random polynomials are as many as Arb's, and where they are") {
    const GiNaC::symbol z("z");
    std::mt19937 random(11);
    std::uniform_int_distribution<int> degrees(1, 12), coefficients(-40, 40);
    slong seen = 0;
    for (int tries = 0; tries < 400; ++tries) {
        Polynomial f;
        GiNaC::ex written = 0;
        for (int power = degrees(random); power >= 0; --power) {
            const int coefficient = coefficients(random);
            fmpz_poly_set_coeff_si(f.value, power, coefficient);
            written += coefficient * GiNaC::pow(z, power);
        }
        if (fmpz_poly_is_zero(f.value) || !fmpz_poly_is_squarefree(f.value)) continue;
        CAPTURE(written);
        const Zeros zeros(f);
        const std::vector<RealRoot> ours = positive_roots(written, z);
        std::size_t next = 0;
        for (slong i = 0; i < zeros.count(); ++i) {
            Ball zero;
            zeros.get(i, zero);
            if (!arb_is_positive(zero.value)) continue;
            REQUIRE(next < ours.size());
            CHECK(ours[next].multiplicity == 1);
            CHECK(is_in(zero, ours[next].approximation(60), -56));  // relative, of at most 41: Cauchy's bound
            ++next;
            ++seen;
        }
        CHECK(next == ours.size());
    }
    CHECK(seen > 300);
}

TEST_CASE("a number that is off in its hundredth digit is not in the ball") {
    const Quadrature rule = quadrature_of({Family::gauss, 7});
    Ball node, weight;
    arb_hypgeom_legendre_p_ui_root(node.value, weight.value, 7, 2, bits);
    to_step(node, weight);
    CHECK(is_in(node, rule.nodes[2], of_floats));
    CHECK_FALSE(is_in(node, rule.nodes[2] + GiNaC::pow(GiNaC::numeric(10), -100), of_floats));
}
