// SPDX-License-Identifier: GPL-2.0-or-later
// Steps from 1e-12 to beyond stability, forward and backward, none, one and a thousand million of them, and changes
// between them.
#include "runtime/measure/reference.hpp"
#include "tests/extremes/extremes.hpp"

using namespace lobatto;
using namespace lobatto::test;

namespace {

using Numbers = std::vector<double>;

const Kernel& pendulum_kernel() {
    return kernel_for(pendulum.body);
}
const Kernel& oscillator_kernel() {
    return kernel_for(harmonic_oscillator.body);
}

// m = 1, omega = 1, from q = 1.5, velocity 0.25: the largest error of position and velocity at the end.
double pendulum_error(double h, std::int64_t steps) {
    const State<double> end = travel<double>(pendulum_kernel(), {1, 1}, {1.5}, {0.25}, h, steps);
    if (end.status != LOBATTO_OK) return HUGE_VAL;
    const PhasePoint exact = pendulum_solution(1, 1.5L, 0.25L, static_cast<long double>(end.time));
    return static_cast<double>(std::fmax(std::fabs(exact.q - static_cast<long double>(end.q[0])),
                                         std::fabs(exact.velocity - static_cast<long double>(end.p[0]))));
}

// m = k = 1, from q = 1 at rest.
double oscillator_error(double h, std::int64_t steps) {
    const State<double> end = travel<double>(oscillator_kernel(), {1, 1}, {1}, {0}, h, steps);
    if (end.status != LOBATTO_OK) return HUGE_VAL;
    const long double t = static_cast<long double>(h) * static_cast<long double>(steps);
    return static_cast<double>(std::fmax(std::fabs(std::cos(t) - static_cast<long double>(end.q[0])),
                                         std::fabs(-std::sin(t) - static_cast<long double>(end.p[0]))));
}

// There and back, relative to the largest number of the start.
double way_back(const lobatto::test::Motion& motion, std::int64_t steps) {
    const Kernel& kernel = kernel_for(motion.body);
    const State<double> start = begin(kernel, motion.parameters, motion.q, motion.v, motion.step);
    const State<double> there = follow(kernel, motion.parameters, start, motion.step, steps);
    const State<double> back = follow(kernel, motion.parameters, there, -motion.step, steps);
    if (there.status != LOBATTO_OK || back.status != LOBATTO_OK) return HUGE_VAL;
    if (!(distance_of(there.q, start.q) > 1e-3)) return HUGE_VAL;  // it has moved
    return std::fmax(distance_of(back.q, start.q), distance_of(back.p, start.p)) /
           *std::max_element(start.q.begin(), start.q.end());
}

bool stays(std::int64_t steps, double h, double time) {
    const State<double> start{LOBATTO_OK, 0, time, {1.5}, {0.25}};
    const State<double> end = follow<double>(pendulum_kernel(), {1, 1}, start, h, steps);
    return end.status == LOBATTO_OK && end.q == start.q && end.p == start.p && end.time == time;
}

lobatto_status status_of(const std::string& body, const Numbers& parameters, const Numbers& q, double h,
                         double time = 0) {
    const State<double> start{LOBATTO_OK, 0, time, q, q};
    return follow(kernel_for(body), parameters, start, h, 3).status;
}

// omega from 1 to 2 and the step from h1 to h2 after t = 2, to t = 4.
double error_after_change(double h1, double h2, double omega) {
    const State<double> middle = travel<double>(pendulum_kernel(), {1, 1}, {1.5}, {0.25}, h1, std::llround(2 / h1));
    const State<double> end = follow<double>(pendulum_kernel(), {1, omega}, middle, h2, std::llround(2 / h2));
    const PhasePoint half = pendulum_solution(1, 1.5L, 0.25L, 2);
    const PhasePoint exact = pendulum_solution(static_cast<long double>(omega * omega), half.q, half.velocity, 2);
    return end.status != LOBATTO_OK ? HUGE_VAL
                                    : static_cast<double>(std::fabs(exact.q - static_cast<long double>(end.q[0])));
}

const double limit = std::sqrt(42 - 6 * std::sqrt(29.0));  // of h omega, Lobatto with 4 points: the paper's

const Extremes table(
    1, "Steps",
    {
        right_to(1e-13, "rad", "pendulum, h = 1e-12, 1000 steps", [] { return pendulum_error(1e-12, 1000); }),
        right_to(1e-13, "rad", "pendulum, h = -1e-12, 1000 steps", [] { return pendulum_error(-1e-12, 1000); }),
        right_to(1e-13, "rad", "pendulum, h = 1e-6, 100,000 steps", [] { return pendulum_error(1e-6, 100000); }),
        right_to(1e-13, "rad", "pendulum, h = 1e-3, 10,000 steps", [] { return pendulum_error(1e-3, 10000); }),
        right_to(1e-11, "rad", "pendulum, h = 0.05, to t = 10", [] { return pendulum_error(0.05, 200); }),
        right_to(1e-11, "rad", "pendulum, h = -0.05, to t = -10", [] { return pendulum_error(-0.05, 200); }),
        right_to(1e-13, "of the amplitude", "oscillator, h = 1e-12, 1000 steps",
                 [] { return oscillator_error(1e-12, 1000); }),
        says("bounded: at most 12 times the start", "oscillator, h at 0.999 of the stability limit, 100,000 steps",
             [] {
                 LoadedStepper<double> stepper(oscillator_kernel());
                 if (stepper.prepare({1, 1}, 0.999 * limit) != LOBATTO_OK) return false;
                 if (stepper.start(0, {1}, {0}) != LOBATTO_OK) return false;
                 double largest = 0, time = 0;
                 for (int i = 0; i < 100000; ++i) {
                     lobatto_advance one{};
                     one.steps = 1;
                     Numbers q, p;
                     if (stepper.advance(one) != LOBATTO_OK) return false;
                     stepper.state(time, q, p);
                     largest = std::fmax(largest, std::fmax(std::fabs(q[0]), std::fabs(p[0])));
                 }
                 return largest < 12;
             }),
        right_to(5e-12, "of the start", "pendulum, 1000 steps forward, 1000 backward",
                 [] { return way_back(pendulum, 1000); }),
        right_to(5e-12, "of the start", "Kepler's ellipse, e = 0.3, there and back",
                 [] { return way_back(kepler, 1000); }),
        right_to(1e-13, "of the start", "double pendulum, there and back",
                 [] { return way_back(double_pendulum, 200); }),
        right_to(5e-12, "of the start", "spherical pendulum with its cyclic angle, there and back",
                 [] { return way_back(spherical_pendulum, 1000); }),
        right_to(1e-12, "of the start", "pendulum driven in time, there and back",
                 [] { return way_back(driven_pendulum, 1000); }),
        right_to(1e-13, "of the start", "coupled oscillators, one matrix, there and back",
                 [] { return way_back(coupled_oscillators, 1000); }),
        right_to(1e-13, "of the start", "chain of 12 masses, there and back", [] { return way_back(chain(), 1000); }),
        says("the start, to the last bit", "no step", [] { return stays(0, 0.1, 0) && stays(0, 0.1, 1e9); }),
        right_to(1e-13, "rad", "one step of h = 0.05", [] { return pendulum_error(0.05, 1); }),
        says(
            "the same bits as from t = 0, and the time to its last bit",
            "pendulum from t = 1e9 h on, as after a thousand million steps",
            [] {
                const double h = 0.0625;
                const State<double> late{LOBATTO_OK, 0, 1e9 * h, {1.5}, {0.25}}, early{LOBATTO_OK, 0, 0, {1.5}, {0.25}};
                const State<double> a = follow<double>(pendulum_kernel(), {1, 1}, late, h, 1000);
                const State<double> b = follow<double>(pendulum_kernel(), {1, 1}, early, h, 1000);
                return a.status == LOBATTO_OK && a.q == b.q && a.p == b.p && a.time == (1e9 + 1000) * h;
            }),
        stops(LOBATTO_TIME_STANDS_STILL, "h = 1 from t = 1e16",
              [] {
                  return status_of(pendulum.body, {1, 1}, {1.5}, 1, 1e16);
              }),
        stops(LOBATTO_TIME_STANDS_STILL, "h = 1e-300 from t = 1",
              [] {
                  return status_of(harmonic_oscillator.body, {1, 1}, {1.5}, 1e-300, 1);
              }),
        stops(LOBATTO_TIME_STANDS_STILL, "h = 0, pendulum",
              [] {
                  return status_of(pendulum.body, {1, 1}, {1.5}, 0);
              }),
        stops(LOBATTO_TIME_STANDS_STILL, "h = 0, oscillator",
              [] {
                  return status_of(harmonic_oscillator.body, {1, 1}, {1.5}, 0);
              }),
        stops(LOBATTO_TIME_STANDS_STILL, "h = 0, double pendulum",
              [] {
                  return status_of(double_pendulum.body, {1, 1}, {1.5, 0.5}, 0);
              }),
        stops(LOBATTO_NOT_FINITE, "h not a number or infinite, each form of kernel",
              [] {
                  for (const double h : {std::nan(""), HUGE_VAL, -HUGE_VAL})
                      for (const lobatto_status status : {status_of(pendulum.body, {1, 1}, {1.5}, h),
                                                          status_of(harmonic_oscillator.body, {1, 1}, {1.5}, h),
                                                          status_of(coupled_oscillators.body, {1.5}, {1, 0, 0.5}, h),
                                                          status_of(double_pendulum.body, {1, 1}, {1.5, 0.5}, h)})
                          if (status != LOBATTO_NOT_FINITE) return status;
                  return LOBATTO_NOT_FINITE;
              }),
        says("stop after 2^24 steps exactly: the step is too small to move the time",
             "oscillator in single precision, h = 1, for ever",
             [] {
                 const Kernel& kernel = kernel_for(harmonic_oscillator.body, "points = 4", Precision::single);
                 const State<float> end =
                     travel<float>(kernel, {1.0f, 1.0f}, {1.0f}, {0.0f}, 1.0f, std::int64_t(1) << 40);
                 return end.status == LOBATTO_TIME_STANDS_STILL && end.steps == 1 << 24 && end.time == 16777216.0f;
             }),
        right_to(1e-9, "rad", "omega doubled between two steps", [] { return error_after_change(0.05, 0.05, 2); }),
        right_to(1e-9, "rad", "h halved between two steps", [] { return error_after_change(0.1, 0.05, 1); }),
        right_to(1e-9, "rad", "both at once", [] { return error_after_change(0.05, 0.025, 2); }),
    });

const Extremes long_table(2, "A thousand million steps",
                          {
                              right_to(1e-8, "of the amplitude", "oscillator, h = 0.001, to t = 1,000,000",
                                       [] { return oscillator_error(0.001, 1000000000); }),
                          });

}  // namespace

TEST_CASE("steps of any size end in the right answer or in a stop") {
    table.check();
}

TEST_CASE("a thousand million steps end in the right answer" * doctest::test_suite("slow")) {
    long_table.check();
}
