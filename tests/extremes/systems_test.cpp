// SPDX-License-Identifier: GPL-2.0-or-later
// Systems at the edge: no force, steep and crowded potentials, close encounters, poles, nearly singular masses, one
// coordinate and 4096, against closed forms and against an extrapolation of hand-written forces.
#include <numbers>

#include "runtime/measure/reference.hpp"
#include "tests/extremes/extremes.hpp"

using namespace lobatto;
using namespace lobatto::test;

namespace {

using Numbers = std::vector<double>;
using Long = std::vector<long double>;
using Force = std::function<Long(const Long&)>;
constexpr long double pi = std::numbers::pi_v<long double>;

// q'' = force(q) from (q, v) over `time`: the leapfrog with 2, 4, ... 16 substeps in each of `parts` parts,
// extrapolated in the squared substep.
Long extrapolated(const Force& force, Long q, Long v, long double time, int parts) {
    constexpr std::size_t columns = 8;
    const std::size_t n = q.size();
    for (int part = 0; part < parts; ++part) {
        std::vector<Long> before, row;
        for (std::size_t j = 0; j < columns; ++j) {
            const auto substeps = static_cast<int>(2 * (j + 1));
            const long double h = time / parts / substeps;
            Long x = q, u = v, f = force(q);
            for (int i = 0; i < substeps; ++i) {
                for (std::size_t k = 0; k < n; ++k) x[k] += h * (u[k] += h / 2 * f[k]);
                f = force(x);
                for (std::size_t k = 0; k < n; ++k) u[k] += h / 2 * f[k];
            }
            x.insert(x.end(), u.begin(), u.end());
            row = {x};
            for (std::size_t l = 1; l <= j; ++l) {
                const long double ratio = static_cast<long double>(j + 1) / static_cast<long double>(j + 1 - l);
                for (std::size_t k = 0; k < 2 * n; ++k) x[k] += (x[k] - before[l - 1][k]) / (ratio * ratio - 1);
                row.push_back(x);
            }
            before = row;
        }
        const auto middle = row.back().begin() + static_cast<std::ptrdiff_t>(n);
        q.assign(row.back().begin(), middle);
        v.assign(middle, row.back().end());
    }
    return q;
}

// The largest error of a position.
double error_of(const State<double>& end, const Long& exact) {
    if (end.status != LOBATTO_OK) return HUGE_VAL;
    double largest = 0;
    for (std::size_t k = 0; k < exact.size(); ++k) {
        const double here = static_cast<double>(std::fabs(exact[k] - static_cast<long double>(end.q[k])));
        if (!(here <= largest)) largest = here;
    }
    return largest;
}

const std::string one = "[coordinates]\nq = { position = 1, velocity = 0 }\n";
const std::string free_particle = "lagrangian = \"m*q'^2/2\"\n" + one + "[parameters]\nm = 1\n";
const std::string falling = "lagrangian = \"m*q'^2/2 - m*g*q\"\n" + one + "[parameters]\nm = 1\ng = 1\n";
const std::string steep = "lagrangian = \"q'^2/2 - k*q^20/20\"\n" + one + "[parameters]\nk = 1\n";
const std::string crowded =
    "lagrangian = \"q'^2/2 - a*sum(i = 1 .. 100, cos(i*q)/i^2)\"\n" + one + "[parameters]\na = 1\n";
const std::string polar =
    "lagrangian = \"m*(r'^2 + r^2*f'^2)/2 - k*r^2/2\"\n[coordinates]\nr = { position = 1, velocity = 0 }\n"
    "f = { position = 0, velocity = 0 }\n[parameters]\nm = 1\nk = 1\n";
const std::string nearly_singular =
    "lagrangian = \"(x'^2 + 2*c*x'*y' + y'^2)/2 - x^2/2 - y^2/2 - d*x^4*y^4\"\n[coordinates]\nx = { position = 1, "
    "velocity = 0 }\ny = { position = 0, velocity = 0.5 }\n[parameters]\nc = 0.5\nd = 1\n";
const std::string nearly_singular_here =
    "lagrangian = \"(x'^2 + 2*c*cos(x - y)*x'*y' + y'^2)/2 - x^2/2\"\n[coordinates]\nx = { position = 1, velocity = 0 "
    "}\ny = { position = 0, velocity = 0.5 }\n[parameters]\nc = 0.5\n";

// L = m q'^2/2 - m g q from q = 1, v: relative to the way.
double parabola_error(const std::string& body, const Numbers& parameters, double v, double h, std::int64_t steps) {
    const State<double> end = travel<double>(kernel_for(body), parameters, {1}, {v}, h, steps);
    const long double t = static_cast<long double>(end.time),
                      g = parameters.size() > 1 ? static_cast<long double>(parameters[1]) : 0;
    const long double way = static_cast<long double>(v) * t - g * t * t / 2;
    return error_of(end, {1 + way}) / static_cast<double>(std::fabs(way));
}

// From q = 1 at rest: at q = 0 after sqrt(10) int_0^1 du / sqrt(1 - u^20), which is a quotient of Gamma functions, and
// back with the opposite velocity after twice as long. The error of q on the way out and back in.
double steep_error(std::int64_t steps) {
    const long double quarter =
        std::sqrt(10.0L) * std::sqrt(pi) * std::tgamma(1 + 1 / 20.0L) / std::tgamma(0.5L + 1 / 20.0L);
    const double h = static_cast<double>(quarter / static_cast<long double>(steps));
    const Kernel& kernel = kernel_for(steep, "points = 6");
    return std::fmax(error_of(travel<double>(kernel, {1}, {1}, {0}, h, steps), {0}),
                     error_of(travel<double>(kernel, {1}, {1}, {0}, h, 3 * steps), {0}));
}

double crowded_error(double h, std::int64_t steps) {
    const Force force = [](const Long& q) {
        long double sum = 0;
        for (int i = 1; i <= 100; ++i) sum += std::sin(static_cast<long double>(i) * q[0]) / i;
        return Long{sum};
    };
    static const long double exact = extrapolated(force, {1}, {0}, 10, 2000)[0];
    return error_of(travel<double>(kernel_for(crowded, "points = 6"), {1}, {1}, {0}, h, steps), {exact});
}

// Kepler's ellipse with e = 0.999 and a = 1, over half a period, from the pericentre on; Kepler's equation by Newton's
// iteration.
double kepler_error(std::int64_t steps) {
    const long double e = 0.999L;
    const double h = static_cast<double>(pi / static_cast<long double>(steps));
    const State<double> end =
        travel<double>(kernel_for(kepler.body, "points = 8"), {1}, {0.001, 0}, {0, std::sqrt(1999.0)}, h, steps);
    const long double time = static_cast<long double>(end.time);
    long double E = pi;
    for (int i = 0; i < 50; ++i) E -= (E - e * std::sin(E) - time) / (1 - e * std::cos(E));
    return error_of(end, {std::cos(E) - e, std::sqrt(1 - e * e) * std::sin(E)});
}

// A plane oscillator, m = k = 1, in polar coordinates from r = 1 with the angular momentum P: where x and y are.
double polar_error(double P, double h, std::int64_t steps) {
    State<double> end = travel<double>(kernel_for(polar), {1, 1}, {1, 0}, {0, P}, h, steps);
    if (end.q.size() == 2) end.q = {end.q[0] * std::cos(end.q[1]), end.q[0] * std::sin(end.q[1])};
    const long double t = static_cast<long double>(end.time);
    return error_of(end, {std::cos(t), static_cast<long double>(P) * std::sin(t)});
}

// d = 0: x + y and x - y oscillate with omega^2 = 1/(1 + c) and 1/(1 - c).
double nearly_singular_error(double c, std::int64_t steps) {
    const double h = 0.05 * std::sqrt(1 - c);
    const State<double> end = travel<double>(kernel_for(nearly_singular), {c, 0}, {1, 0.5}, {0, 0}, h, steps);
    const long double t = static_cast<long double>(end.time), C = static_cast<long double>(c);
    const long double sum = 1.5L * std::cos(t / std::sqrt(1 + C)), difference = 0.5L * std::cos(t / std::sqrt(1 - C));
    return error_of(end, {(sum + difference) / 2, (sum - difference) / 2});
}

lobatto_status singular_status(const std::string& body, const Numbers& parameters, const Numbers& q) {
    return follow(kernel_for(body), parameters, State<double>{LOBATTO_OK, 0, 0, q, {0.5, 0.25}}, 0.01, 3).status;
}

std::string chain_of(int n) {
    return "lagrangian = \"sum(i = 1 .. n, x[i]'^2/2) - sum(i = 2 .. n, s[i])\"\n[definitions]\n\"s[i]\" = \"k*(x[i] - "
           "x[i-1])^2/2 + (x[i] - x[i-1])^4/4\"\n[coordinates]\nx = { count = \"n\", position = \"sin(i)\", velocity = "
           "0 }\n[parameters]\nn = { value = " +
           std::to_string(n) + ", constant = true }\nk = 1\n";
}
double chain_error(int n) {
    Numbers q, v(static_cast<std::size_t>(n), 0.0);
    for (int i = 1; i <= n; ++i) q.push_back(std::sin(i));
    const State<double> end = travel<double>(kernel_for(chain_of(n)), {1}, q, v, 0.02, 100);
    const Force force = [](const Long& x) {
        Long f(x.size(), 0);
        for (std::size_t i = 1; i < x.size(); ++i) {
            const long double d = x[i] - x[i - 1], pull = d + d * d * d;
            f[i] -= pull;
            f[i - 1] += pull;
        }
        return f;
    };
    return error_of(end, extrapolated(force, {q.begin(), q.end()}, Long(q.size(), 0), 2, 16));
}

const Extremes table(
    4, "Systems",
    {
        right_to(1e-12, "of the way", "free particle, h = 0.1, 1000 steps",
                 [] { return parabola_error(free_particle, {1}, 3, 0.1, 1000); }),
        right_to(1e-12, "of the way", "free particle of mass 1e150, velocity 1e100, h = 1e-100",
                 [] { return parabola_error(free_particle, {1e150}, 1e100, 1e-100, 1000); }),
        right_to(1e-12, "of the way", "constant force, h = 0.1, 1000 steps",
                 [] {
                     return parabola_error(falling, {1, 9.81}, 3, 0.1, 1000);
                 }),
        right_to(1e-12, "of the way", "constant force 1e200 times as strong, h = 1e-100",
                 [] {
                     return parabola_error(falling, {1, 1e200}, 3, 1e-100, 1000);
                 }),
        right_to(1e-9, "of the amplitude", "potential of degree 20, three quarters of a period in 300 steps, 6 points",
                 [] { return steep_error(100); }),
        right_to(1e-12, "rad", "100 harmonics, h = 0.005, to t = 10, 6 points",
                 [] { return crowded_error(0.005, 2000); }),
        right_to(1e-11, "of the major half axis",
                 "Kepler's ellipse, e = 0.999, half a period, 1,000,000 steps, 8 points",
                 [] { return kepler_error(1000000); }),
        right_to(1e-11, "of the amplitude, in x and y", "polar coordinates, straight through the pole",
                 [] { return polar_error(0, 0.05, 200); }),
        right_to(2e-8, "of the amplitude, in x and y", "polar coordinates, 0.001 past the pole, h = 1e-4",
                 [] { return polar_error(0.001, 1e-4, 31416); }),
        stops(LOBATTO_SINGULAR_MASS, "polar coordinates, begun at the pole",
              [] {
                  return singular_status(polar, {1, 1}, {0, 0});
              }),
        right_to(1e-11, "of the amplitude", "mass matrix of condition 1e6",
                 [] { return nearly_singular_error(1 - 0x1p-20, 2000); }),
        right_to(5e-11, "of the amplitude", "mass matrix of condition 1e12",
                 [] { return nearly_singular_error(1 - 0x1p-40, 2000); }),
        right_to(1e-11, "of the amplitude", "mass matrix of condition 1e16",
                 [] { return nearly_singular_error(1 - 0x1p-53, 2000); }),
        stops(LOBATTO_SINGULAR_MASS, "singular mass matrix, constant",
              [] {
                  return singular_status(nearly_singular, {1, 0}, {1, 0.5});
              }),
        stops(LOBATTO_SINGULAR_MASS, "mass matrix that is singular at the start",
              [] {
                  return singular_status(nearly_singular_here, {1}, {0.5, 0.5});
              }),
        right_to(1e-14, "of the amplitude", "chain of 2 masses, springs of fourth power",
                 [] { return chain_error(2); }),
        right_to(1e-12, "of the amplitude", "chain of 64 masses, in loops", [] { return chain_error(64); }),
    });

const Extremes long_table(5, "Large systems",
                          {
                              right_to(1e-12, "of the amplitude", "chain of 4096 masses, springs of fourth power",
                                       [] { return chain_error(4096); }),
                          });

}  // namespace

TEST_CASE("systems at the edge end in the right answer or in a stop") {
    table.check();
}

TEST_CASE("4096 coordinates end in the right answer" * doctest::test_suite("slow")) {
    long_table.check();
}
