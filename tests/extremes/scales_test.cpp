// SPDX-License-Identifier: GPL-2.0-or-later
// Frequencies, masses and amplitudes from 1e-150 to 1e150 and beyond: the same motion in other units, to the last bit,
// and closed forms.
#include "generator/mechanics/algebra/sample.hpp"
#include "runtime/measure/reference.hpp"
#include "tests/extremes/extremes.hpp"

using namespace lobatto;
using namespace lobatto::test;

namespace {

using Numbers = std::vector<double>;

// A motion in units 2^time and 2^mass times as large; the length is `length` for systems that have none of their own.
struct Units {
    int time = 0, mass = 0, length = 0;
};
// How a system's parameters change with the units, and its h omega where the iteration of a step is put to the test.
struct System {
    std::string body;
    Numbers q, v;
    double easy, hard;  // steps
    std::function<Numbers(const Units&)> parameters;
};

const System scaled_pendulum{
    "lagrangian = \"m*q'^2/2 - m*omega^2*(1 - cos(q))\"\n[coordinates]\nq = { position = 1.5, velocity = 0.25 }\n"
    "[parameters]\nm = 2\nomega = 1.5\n",
    {1.5},
    {0.25},
    0.1,
    2.5,
    [](const Units& in) {
        return Numbers{std::ldexp(1, in.mass), std::ldexp(1, -in.time)};
    }};
const System scaled_oscillator{harmonic_oscillator.body, {1}, {0.5}, 0.1, 3, [](const Units& in) {
                                   return Numbers{std::ldexp(1, in.mass), std::ldexp(1, in.mass - 2 * in.time)};
                               }};
const System scaled_oscillators{
    "lagrangian = \"m*(x'^2 + y'^2)/2 - k*(x^2 + y^2)/2 - k*(x - y)^2/4\"\n[coordinates]\nx = { position = 1, velocity "
    "= 0 }\ny = { position = 0, velocity = 0.5 }\n[parameters]\nm = 1\nk = 1\n",
    {1, 0},
    {0, 0.5},
    0.1,
    2,
    [](const Units& in) {
        return Numbers{std::ldexp(1, in.mass), std::ldexp(1, in.mass - 2 * in.time)};
    }};
const System scaled_kepler{
    kepler.body, {0.7, 0}, {0, 1.3627},
    0.05,        0.4,      [](const Units& in) {
        return Numbers{std::ldexp(1, 3 * in.length - 2 * in.time)}; }};
const System scaled_double_pendulum{
    "lagrangian = \"m*(l^2*a'^2 + l^2*b'^2/2 + l^2*a'*b'*cos(a - b)) + m*l*g*(2*cos(a) + cos(b))\"\n[coordinates]\n"
    "a = { position = 0.5, velocity = 0 }\nb = { position = 0.75, velocity = 0.25 }\n"
    "[parameters]\nm = 2\nl = 1\ng = 1\n",
    {0.5, 0.75},
    {0, 0.25},
    0.1,
    1.25,
    [](const Units& in) {
        return Numbers{std::ldexp(1, in.mass), std::ldexp(1, in.length), std::ldexp(1, in.length - 2 * in.time)};
    }};

bool is_same(const System& system, const Units& units, double step, bool angles) {
    const Kernel& kernel = kernel_for(system.body);
    const int length = angles ? 0 : units.length;
    const auto in_units = [](Numbers values, int exponent) {
        for (double& value : values) value = std::ldexp(value, exponent);
        return values;
    };
    const State<double> plain = travel(kernel, system.parameters({}), system.q, system.v, step, 40);
    const State<double> scaled = travel(kernel, system.parameters(units), in_units(system.q, length),
                                        in_units(system.v, length - units.time), std::ldexp(step, units.time), 40);
    const int momentum = units.mass - units.time + (angles ? 2 * units.length : units.length);
    return plain.status == LOBATTO_OK && scaled.status == LOBATTO_OK && scaled.q == in_units(plain.q, length) &&
           scaled.p == in_units(plain.p, momentum);
}

Extreme same(const std::string& claim, const System& system, bool angles, std::vector<Units> all) {
    return says("the same motion, to the last bit", claim, [&system, angles, all = std::move(all)] {
        for (const Units& units : all)
            for (const double step : {system.easy, system.hard})
                if (!is_same(system, units, step, angles)) {
                    MESSAGE("units 2^" << units.time << ", 2^" << units.mass << ", 2^" << units.length
                                       << ", h = " << step);
                    return false;
                }
        return true;
    });
}

// From q0 with velocity v0, relative to `size`.
double pendulum_error(double m, double omega, double q0, double v0, double h, std::int64_t steps, double size) {
    const State<double> end = travel<double>(kernel_for(pendulum.body), {m, omega}, {q0}, {v0}, h, steps);
    if (end.status != LOBATTO_OK) return HUGE_VAL;
    const long double w = static_cast<long double>(omega);
    const PhasePoint exact = pendulum_solution(w * w, static_cast<long double>(q0), static_cast<long double>(v0),
                                               static_cast<long double>(end.time));
    return static_cast<double>(std::fabs(exact.q - static_cast<long double>(end.q[0]))) / size;
}

// Lq = -m omega^2 sin q at q, against 60 digits.
double force_error(double q) {
    LoadedStepper<double> stepper(kernel_for(pendulum.body));
    if (stepper.prepare({1, 1}, 0.1) != LOBATTO_OK) return HUGE_VAL;
    Numbers Lv, Lq;
    stepper.slopes(0, {q}, {0}, Lv, Lq);
    const cln::cl_R exact = -cln::sin(float_of(GiNaC::numeric(q)));
    return std::fabs(cln::double_approx((float_of(GiNaC::numeric(Lq[0])) - exact) / exact));
}

// Masses M and 1, joined by a spring of stiffness 1, from x = 0 and y = 1 at rest: y - x = cos(omega t) with omega^2 =
// 1 + 1/M, about a centre of mass at rest. The error of each, relative to its own amplitude.
double two_masses_error(double M, double h, std::int64_t steps) {
    const Kernel& kernel = kernel_for(
        "lagrangian = \"M*x'^2/2 + y'^2/2 - (x - y)^2/2\"\n[coordinates]\nx = { position = 0, velocity = 0 }\n"
        "y = { position = 1, velocity = 0 }\n[parameters]\nM = 1\n");
    const State<double> end = travel<double>(kernel, {M}, {0, 1}, {0, 0}, h, steps);
    if (end.status != LOBATTO_OK) return HUGE_VAL;
    const long double mass = static_cast<long double>(M), centre = 1 / (1 + mass),
                      t = static_cast<long double>(end.time);
    const long double apart = std::cos(std::sqrt(1 + 1 / mass) * t);
    const long double x = centre * (1 - apart), y = x + apart;
    return static_cast<double>(
        std::fmax(std::fabs(x - static_cast<long double>(end.q[0])) / (2 * centre),
                  std::fabs(y - static_cast<long double>(end.q[1])) / std::fmax(1.0L, mass * centre)));
}

// The quartic spring q'' = -q - q^3 of a tiny amplitude is the harmonic one.
double tiny_error(double amplitude) {
    const Kernel& kernel = kernel_for(
        "lagrangian = \"q'^2/2 - q^2/2 - k*q^4/4\"\n[coordinates]\nq = { position = 1, velocity = 0 }\n[parameters]\n"
        "k = 1\n");
    const State<double> end = travel<double>(kernel, {1}, {amplitude}, {0}, 0.05, 200);
    if (end.status != LOBATTO_OK) return HUGE_VAL;
    return std::fabs(end.q[0] / amplitude - static_cast<double>(std::cos(static_cast<long double>(end.time))));
}

const Extremes table(
    3, "Scales",
    {
        same("pendulum, frequencies 2^-498 to 2^498 (1e-150 to 1e150), masses likewise, h omega = 0.1 and 2.5",
             scaled_pendulum, true,
             {{-498, 0}, {498, 0}, {100, 0}, {-100, 0}, {-260, 0}, {0, -498}, {0, 498}, {250, -498}, {-250, 300}}),
        same("oscillator, the same, h omega = 0.1 and 3", scaled_oscillator, false,
             {{-498, -498}, {498, 498}, {-498, 0}, {498, 0}, {0, 498}, {0, -498}, {0, 0, 900}, {0, 0, -900}}),
        same("two coupled oscillators, the same, amplitudes 2^-900 to 2^400", scaled_oscillators, false,
             {{-490, 0}, {490, 0}, {0, 498}, {0, -498}, {0, 0, 400}, {0, 0, -900}}),
        same("Kepler's ellipse, times 2^-450 to 2^300, lengths 2^-150 to 2^200", scaled_kepler, false,
             {{-450, 0, 0}, {300, 0, 0}, {0, 0, -150}, {0, 0, 200}}),
        same("double pendulum, times, masses and lengths 2^-300 to 2^400", scaled_double_pendulum, true,
             {{-300, 0, 0}, {400, 0, 0}, {0, -300, 0}, {0, 400, 0}, {0, 0, -150}, {0, 0, 200}}),
        right_to(1e-11, "rad", "pendulum, omega = 1e150, m = 1, h = 0.05/omega, to 10/omega",
                 [] { return pendulum_error(1, 1e150, 1.5, 2.5e149, 5e-152, 200, 1); }),
        right_to(1e-11, "rad", "pendulum, omega = 1e-150, m = 1e150",
                 [] { return pendulum_error(1e150, 1e-150, 1.5, 2.5e-151, 5e148, 200, 1); }),
        right_to(1e-11, "rad", "pendulum, omega = 1e-150, m = 1e-150: momenta of 1e-300",
                 [] { return pendulum_error(1e-150, 1e-150, 1.5, 0, 5e148, 200, 1); }),
        stops(LOBATTO_NOT_FINITE, "pendulum, omega = 1e150, m = 1e150: m omega^2 is no number",
              [] {
                  return travel<double>(kernel_for(pendulum.body), {1e150, 1e150}, {1.5}, {0}, 5e-152, 200).status;
              }),
        right_to(5e-12, "of the amplitude", "pendulum, amplitude 1e-300",
                 [] { return pendulum_error(1, 1, 1e-300, 0, 0.05, 200, 1e-300); }),
        right_to(5e-12, "of the amplitude", "quartic spring, amplitude 1e-300", [] { return tiny_error(1e-300); }),
        right_to(5e-12, "of the amplitude", "quartic spring, amplitude 1e-150", [] { return tiny_error(1e-150); }),
        right_to(0.02, "of the amplitude, which has 10 bits", "pendulum, amplitude 5e-321, a denormal number",
                 [] { return pendulum_error(1, 1, 5e-321, 0, 0.05, 200, 5e-321); }),
        right_to(1e-10, "rad, the rounding of the start times e^t", "pendulum at rest from pi - 1e-12, to t = 10",
                 [] { return pendulum_error(1, 1, 3.14159265358879312, 0, 0.05, 200, 1); }),
        right_to(2e-3, "rad: 1e-12 is 2000 times the rounding of pi", "the same to t = 30, past the bottom",
                 [] { return pendulum_error(1, 1, 3.14159265358879312, 0, 0.0125, 2400, 1); }),
        right_to(1e-2, "rad, likewise", "pendulum rotating 1e-12 above the separatrix, to t = 30",
                 [] { return pendulum_error(1, 1, 0, 2 + 1e-12, 0.0125, 2400, 1); }),
        right_to(1e-14, "of the angle", "pendulum rotating 1000 times as fast, h = 1e-4, 100,000 steps",
                 [] { return pendulum_error(1, 1, 0, 1000, 1e-4, 100000, 1e4); }),
        right_to(1e-8, "rad", "pendulum from 1e6 rad", [] { return pendulum_error(1, 1, 1e6, 0, 0.05, 200, 1); }),
        right_to(1e-15, "of the force", "the force at 1e15 and 1e22 rad",
                 [] { return std::fmax(force_error(1e15), force_error(1e22)); }),
        right_to(1e-11, "of each amplitude", "masses 1e12 and 1 with a spring",
                 [] { return two_masses_error(1e12, 0.05, 200); }),
        right_to(1e-11, "of each amplitude", "masses 1e-12 and 1 with a spring: omega = 1e6",
                 [] { return two_masses_error(1e-12, 5e-8, 200); }),
    });

}  // namespace

TEST_CASE("motions of any scale end in the right answer or in a stop") {
    table.check();
}
