// SPDX-License-Identifier: GPL-2.0-or-later
// Steps of the general form: its equations, its order, cyclic coordinates, velocities of momenta, tangent maps.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>
#include <vector>

#include "tests/handwritten/cyclic.hpp"
#include "tests/handwritten/double_pendulum.hpp"
#include "tests/handwritten/driven.hpp"

using namespace lobatto;

namespace {

template <class number>
using Lobatto = HandwrittenDoublePendulum<number, LobattoFour<number>>;
template <class number>
using Gauss = HandwrittenDoublePendulum<number, GaussTwo<number>>;

template <class number>
struct State {
    std::vector<number> q, p;
};

template <class K, class number = typename K::real>
Stepper<K> started(number h, const State<number>& state, const typename K::Parameters& parameters = {},
                   number time = 0) {
    Stepper<K> stepper;
    REQUIRE(stepper.prepare(parameters, h) == Status::ok);
    REQUIRE(stepper.start(time, state.q.data(), state.p.data()) == Status::ok);
    return stepper;
}

template <class K>
State<typename K::real> state_of(const Stepper<K>& stepper) {
    State<typename K::real> state{{stepper.q, stepper.q + K::coordinates},
                                  std::vector<typename K::real>(K::coordinates)};
    stepper.momentum(state.p.data());
    return state;
}

template <class K>
void go(Stepper<K>& stepper, int steps) {
    for (int i = 0; i < steps; ++i) REQUIRE(stepper.step() == Status::ok);
}

template <class number>
double distance(const State<number>& a, const State<number>& b) {
    double most = 0;
    for (std::size_t i = 0; i < a.q.size(); ++i) {
        const number q = a.q[i] - b.q[i], p = a.p[i] - b.p[i];
        most = std::max({most, static_cast<double>(q < 0 ? -q : q), static_cast<double>(p < 0 ? -p : p)});
    }
    return most;
}

const State<double> swinging{{1.0, 2.0}, {0.3, 0.1}};

template <class K>
State<double> after(double h, double until) {
    Stepper<K> stepper = started<K>(h, swinging);
    go(stepper, static_cast<int>(std::lround(until / h)));
    return state_of(stepper);
}

// d(q1, p1)/d(q, p) by central differences, against the tangent map; and T^T J T = J.
template <class K>
void check_tangent(const State<double>& state, double h, double time = 0) {
    constexpr int n = K::coordinates, rows = 2 * n;
    const Stepper<K> stepper = started<K>(h, state, {}, time);
    std::vector<double> q1(n), p1(n), T(rows * rows), none(rows * rows);
    REQUIRE(stepper.tangent(time, state.q.data(), state.p.data(), q1.data(), p1.data(), T.data()) == Status::ok);
    const double d = 1e-5;
    for (int c = 0; c < rows; ++c) {
        const auto image = [&](double shift) {
            State<double> moved = state;
            (c < n ? moved.q[c] : moved.p[c - n]) += shift;
            Stepper<K> other = started<K>(h, moved, {}, time);
            go(other, 1);
            return state_of(other);
        };
        const State<double> plus = image(d), minus = image(-d);
        for (int r = 0; r < rows; ++r) {
            CAPTURE(r);
            CAPTURE(c);
            const double slope =
                ((r < n ? plus.q[r] : plus.p[r - n]) - (r < n ? minus.q[r] : minus.p[r - n])) / (2 * d);
            CHECK(std::fabs(T[r * rows + c] - slope) < 1e-8);  // at most 8.3e-11 measured
        }
    }
    for (int a = 0; a < rows; ++a)
        for (int b = 0; b < a; ++b) {
            double sum = a == b + n ? 1 : 0;
            for (int i = 0; i < n; ++i)
                sum += T[i * rows + a] * T[(n + i) * rows + b] - T[(n + i) * rows + a] * T[i * rows + b];
            CHECK(std::fabs(sum) < 1e-14);  // at most 2.2e-16 measured
        }
}

// L = -sqrt(1 - v^2): p = v / sqrt(1 - v^2).
struct Relativistic : HandwrittenKernel, LobattoFour<double> {
    using real = double;
    static constexpr int coordinates = 1;
    static constexpr Form form = Form::general;
    static constexpr bool autonomous = true;
    static constexpr int active = 1, cyclic = 0, active_index[1] = {0}, cyclic_index[1] = {0};
    static constexpr int position[1] = {0}, group_count = 1, group_first[2] = {0, 1}, group_bandwidth[1] = {0};
    static constexpr int entries = 1, entry_row[1] = {0}, entry_column[1] = {0};
    static constexpr int mass_entries = 1, mass_row[1] = {0}, mass_column[1] = {0};
    struct Parameters {};
    struct Coefficients {};
    static Status prepare(const Parameters&, real, Coefficients&) { return Status::ok; }
    static void slope(const Coefficients&, const real* z, real* g) {
        g[0] = z[0] / std::sqrt(1 - z[0] * z[0]);
        g[1] = 0;
    }
    static void node(const Coefficients& k, const real* z, real* g, real* H) {
        slope(k, z, g);
        H[0] = std::pow(1 - z[0] * z[0], -1.5);
    }
    static void momentum(const Coefficients& k, const real*, const real* v, real* p) {
        real g[2];
        slope(k, v, g);
        p[0] = g[0];
    }
    static void legendre(const Coefficients& k, const real* q, const real* v, real* p, real* M) {
        momentum(k, q, v, p);
        M[0] = std::pow(1 - v[0] * v[0], -1.5);
    }
    static void slopes(const Coefficients& k, const real* q, const real* v, real* Lv, real* Lq) {
        momentum(k, q, v, Lv);
        Lq[0] = 0;
    }
    static real energy(const Coefficients&, const real*, const real* v) { return 1 / std::sqrt(1 - v[0] * v[0]); }
};

}  // namespace

static_assert(std::is_trivially_copyable_v<Stepper<Lobatto<double>>>, "the host copies steppers byte by byte");

TEST_CASE("the double pendulum converges at order 6 with four Lobatto points, and at order 4 with two Gauss stages") {
    const State<double> exact = after<Lobatto<double>>(1.0 / 160, 2);
    const auto order = [&](auto stepper, double h) {
        using K = decltype(stepper);
        return std::log2(distance(after<K>(h, 2), exact) / distance(after<K>(h / 2, 2), exact));
    };
    CHECK(std::fabs(order(Lobatto<double>(), 1.0 / 10) - 6) < 0.15);  // off by 0.024
    CHECK(std::fabs(order(Gauss<double>(), 1.0 / 20) - 4) < 0.15);    // off by 0.002
}

TEST_CASE("two Newton iterations a step suffice on the double pendulum with h = 0.02") {
    Stepper<Lobatto<double>> stepper = started<Lobatto<double>>(0.02, swinging);
    long iterations = 0;
    for (int i = 0; i < 1000; ++i) {
        REQUIRE(stepper.step() == Status::ok);
        CHECK(stepper.iterations <= 3);
        iterations += stepper.iterations;
    }
    CHECK(iterations <= 2010);  // 2.00 a step measured
}

TEST_CASE("the double pendulum's energy stays, and time runs backwards to the start") {
    const double h = 0.02;
    Stepper<Lobatto<double>> there = started<Lobatto<double>>(h, swinging);
    double before = 0, now = 0, worst = 0;
    REQUIRE(there.energy(0, swinging.q.data(), swinging.p.data(), &before) == Status::ok);
    for (int i = 0; i < 500; ++i) {
        REQUIRE(there.step() == Status::ok);
        REQUIRE(there.energy(0, there.q, there.p, &now) == Status::ok);
        worst = std::max(worst, std::fabs(now - before));
    }
    CHECK(worst > 0);
    CHECK(worst < 1e-9);  // 3.2e-11 measured
    Stepper<Lobatto<double>> back = started<Lobatto<double>>(-h, state_of(there));
    go(back, 500);
    CHECK(distance(state_of(back), swinging) < 1e-12);  // 6.7e-16 measured
}

TEST_CASE_TEMPLATE("steps of the general form solve their equations to the rounding of each number type", number, float,
                   double, long double) {
    // |R| of the last step, in units of what momenta are rounded to.
    using K = Lobatto<number>;
    const State<number> start{{number(1), number(2)}, {number(3) / 10, number(1) / 10}};
    const number h = number(1) / 16;
    Stepper<K> stepper = started<K>(h, start);
    go(stepper, 4);
    const State<number> before = state_of(stepper);
    go(stepper, 1);
    number X[6], F[6], R = 0;
    for (int j = 0; j < 3; ++j)
        for (int a = 0; a < 2; ++a) X[j * 2 + a] = before.q[a] + stepper.Y[a * 3 + j];
    REQUIRE(stepper.residual(0, before.q.data(), before.p.data(), X, F) == Status::ok);
    for (const number f : F) R = std::max(R, f < 0 ? -f : f);
    const double units = static_cast<double>(R / Limits<number>::epsilon);
    CHECK(units > 0);
    CHECK(units < 400);  // X is rounded, and divided by h: 91 to 214 measured
    number J[36];
    REQUIRE(stepper.jacobian(0, before.q.data(), before.p.data(), X, J) == Status::ok);
    number shifted[6];
    const number d = Limits<number>::root_epsilon;
    for (int c = 0; c < 6; ++c) {
        const number kept = X[c];
        X[c] = kept + d;
        REQUIRE(stepper.residual(0, before.q.data(), before.p.data(), X, shifted) == Status::ok);
        X[c] = kept;
        for (int r = 0; r < 6; ++r) {
            const double difference = static_cast<double>((shifted[r] - F[r]) / d - J[r * 6 + c]);
            CHECK(std::fabs(difference) <
                  1e3 * static_cast<double>(d) + 1e3 * static_cast<double>(Limits<number>::epsilon / d));
        }
    }
}

TEST_CASE("the tangent maps of the general form agree with differences and are symplectic") {
    check_tangent<Lobatto<double>>(swinging, 0.1);
    check_tangent<Gauss<double>>(swinging, 0.1);
    const State<double> tilted{{0.9, 0.4}, {0.2, 0.7}};
    check_tangent<HandwrittenSphericalPendulum<double, LobattoFour<double>, true>>(tilted, 0.1);
    check_tangent<HandwrittenSphericalPendulum<double, GaussTwo<double>, true>>(tilted, 0.1);
    check_tangent<HandwrittenCharge<double, LobattoFour<double>, true, true>>(tilted, 0.1);
    check_tangent<HandwrittenDrivenGeneral<double, LobattoFour<double>>>({{0.9}, {0.4}}, 0.1, 0.3);
}

TEST_CASE("eliminating a cyclic coordinate changes no step: Lobatto's momenta vary by kappa, Gauss's do not") {
    const State<double> tilted{{0.9, 0.4}, {0.2, 0.7}};
    const auto compare = [&](auto full_kernel, auto reduced_kernel, double tolerance) {
        using Full = decltype(full_kernel);
        using Reduced = decltype(reduced_kernel);
        Stepper<Full> full = started<Full>(0.2, tilted);
        Stepper<Reduced> reduced = started<Reduced>(0.2, tilted);
        for (int i = 0; i < 200; ++i) {
            go(full, 1);
            go(reduced, 1);
            CHECK(distance(state_of(full), state_of(reduced)) < tolerance);
            CHECK(reduced.p[1] == 0.7);
        }
        // And inside the step.
        double q[2], v[2], q_reduced[2], v_reduced[2];
        full.polynomial(0.4, q, v);
        reduced.polynomial(0.4, q_reduced, v_reduced);
        for (int k = 0; k < 2; ++k) {
            CHECK(std::fabs(q[k] - q_reduced[k]) < tolerance);
            CHECK(std::fabs(v[k] - v_reduced[k]) < 10 * tolerance);
        }
        return full.q[1];
    };
    using L = LobattoFour<double>;
    using G = GaussTwo<double>;
    const double azimuth = compare(HandwrittenSphericalPendulum<double, L, false>(),
                                   HandwrittenSphericalPendulum<double, L, true>(), 1e-11);  // at most 1.1e-12 measured
    CHECK(azimuth > 10);
    compare(HandwrittenSphericalPendulum<double, G, false>(), HandwrittenSphericalPendulum<double, G, true>(), 1e-11);
    compare(HandwrittenCharge<double, L, false, false>(), HandwrittenCharge<double, L, true, false>(), 1e-12);
    compare(HandwrittenCharge<double, G, false, false>(), HandwrittenCharge<double, G, true, false>(), 1e-12);
}

TEST_CASE("a linear system takes one correction a step, and the same steps") {
    const State<double> start{{0.9, 0.4}, {0.2, 0.7}};
    const auto compare = [&](auto frozen_kernel, auto kernel) {
        using Frozen = decltype(frozen_kernel);
        using K = decltype(kernel);
        Stepper<Frozen> frozen = started<Frozen>(0.2, start);
        Stepper<K> stepper = started<K>(0.2, start);
        for (int i = 0; i < 200; ++i) {
            go(frozen, 1);
            go(stepper, 1);
            CHECK(frozen.iterations == 1);
            CHECK(distance(state_of(frozen), state_of(stepper)) < 1e-13);  // 6.2e-15 measured
        }
    };
    compare(HandwrittenCharge<double, LobattoFour<double>, true, true>(),
            HandwrittenCharge<double, LobattoFour<double>, true, false>());
    compare(HandwrittenCharge<double, GaussTwo<double>, false, true>(),
            HandwrittenCharge<double, GaussTwo<double>, false, false>());
}

TEST_CASE("the general and the separable form take the same steps, with explicit time too") {
    const State<double> start{{1.2}, {0.3}};
    const auto compare = [&](auto general_kernel, auto separable_kernel) {
        using General = decltype(general_kernel);
        using Separable = decltype(separable_kernel);
        Stepper<General> general = started<General>(0.15, start, {}, 0.7);
        Stepper<Separable> separable = started<Separable>(0.15, start, {}, 0.7);
        for (int i = 0; i < 200; ++i) {
            go(general, 1);
            go(separable, 1);
            CHECK(distance(state_of(general), state_of(separable)) < 1e-12);  // 1.3e-14 measured
        }
        for (const double theta : {0.1, 0.5, 1.0}) {
            double q, v, q_separable, v_separable;
            general.polynomial(theta, &q, &v);
            separable.polynomial(theta, &q_separable, &v_separable);
            CHECK(std::fabs(q - q_separable) < 1e-11);
            CHECK(std::fabs(v - v_separable) < 1e-11);
        }
    };
    compare(HandwrittenDrivenGeneral<double, LobattoFour<double>>(),
            HandwrittenDrivenSeparable<double, SeparableLobattoFour<double>>());
    compare(HandwrittenDrivenGeneral<double, GaussTwo<double>>(),
            HandwrittenDrivenSeparable<double, SeparableGaussTwo<double>>());
}

TEST_CASE("friction and drive converge at order 6") {
    const auto at = [](double h) {
        using K = HandwrittenDrivenGeneral<double, LobattoFour<double>>;
        Stepper<K> stepper = started<K>(h, {{1.2}, {0.3}}, {0.5, 1.5, 0.2});
        go(stepper, static_cast<int>(std::lround(4 / h)));
        return stepper.q[0];
    };
    const double exact = at(1.0 / 64);
    CHECK(std::fabs(std::log2((at(0.25) - exact) / (at(0.125) - exact)) - 6) < 0.1);
}

TEST_CASE("the velocity of a momentum is found where a full increment would leave the Lagrangian's domain") {
    Stepper<Relativistic> stepper;
    REQUIRE(stepper.prepare({}, 0.1) == Status::ok);
    const double q = 0;
    for (const double p : {0.0, 1e-8, 0.1, 1.0, 3.0, 100.0, -100.0}) {
        CAPTURE(p);
        double v = 0;
        REQUIRE(stepper.velocity(0, &q, &p, &v) == Status::ok);
        CHECK(std::fabs(v - p / std::sqrt(1 + p * p)) <= 4 * std::numeric_limits<double>::epsilon() * std::fabs(v));
    }
    const double p = 3;
    REQUIRE(stepper.start(0, &q, &p) == Status::ok);
    go(stepper, 10);
    CHECK(std::fabs(stepper.q[0] - 3 / std::sqrt(10.0)) < 1e-14);
}

TEST_CASE("a start without velocity is refused, and a step that fails keeps the last good state") {
    Stepper<Lobatto<double>> stepper;
    REQUIRE(stepper.prepare({}, 50.0) == Status::ok);
    const double bad[2] = {0, std::nan("")};
    CHECK(stepper.start(0, bad, swinging.p.data()) == Status::not_finite);
    CHECK(stepper.start(0, swinging.q.data(), bad) == Status::not_finite);
    REQUIRE(stepper.start(0, swinging.q.data(), swinging.p.data()) == Status::ok);
    Status status = Status::ok;
    State<double> good;
    int steps = 0;
    do {
        good = state_of(stepper);
        status = stepper.step();
    } while (status == Status::ok && ++steps < 1000);
    CHECK(status != Status::ok);
    CHECK(distance(state_of(stepper), good) == 0);
    CHECK(stepper.steps == steps);

    using Spherical = HandwrittenSphericalPendulum<double, LobattoFour<double>, false>;
    Stepper<Spherical> pole;
    REQUIRE(pole.prepare({}, 0.1) == Status::ok);
    const double at_pole[2] = {0, 0}, p[2] = {0.1, 0.1};
    CHECK(pole.start(0, at_pole, p) == Status::singular_mass);
}
