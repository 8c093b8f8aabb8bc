// SPDX-License-Identifier: GPL-2.0-or-later
// Steps by fixed-point iterations are the steps of Newton's iteration, to rounding; where fixed-point iterations cannot
// contract Newton takes over.
#include <doctest/doctest.h>

#include <cmath>
#include <limits>

#include "runtime/build/library.hpp"
#include "tests/motions.hpp"

using namespace lobatto;
using namespace lobatto::test;

namespace {

template <class real>
struct Path {
    std::vector<real> q, p;
    lobatto_advance call{};
};

template <class real>
Path<real> path(LoadedStepper<real>& stepper, std::int64_t steps, double tolerance = 0) {
    Path<real> path;
    path.call.steps = steps;
    path.call.tolerance = tolerance;
    CHECK(stepper.advance(path.call) == LOBATTO_OK);
    CHECK(path.call.steps_done == steps);
    real time = 0;
    stepper.state(time, path.q, path.p);
    return path;
}
template <class real>
Path<real> path(const Kernel& kernel, const Motion& motion, double step, std::int64_t steps, double tolerance = 0) {
    LoadedStepper<real> stepper = started<real>(kernel, motion, step);
    return path(stepper, steps, tolerance);
}

// The largest difference of positions or momenta, relative to the largest of them, in units of epsilon.
template <class real>
double distance(const std::vector<real>& a, const std::vector<real>& b) {
    REQUIRE(a.size() == b.size());
    real most = 0, size = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        const real d = std::fabs(a[i] - b[i]);
        if (std::isnan(d)) return std::numeric_limits<double>::infinity();
        most = std::fmax(most, d);
        size = std::fmax(size, std::fabs(b[i]));
    }
    return static_cast<double>(most / size / std::numeric_limits<real>::epsilon());
}
template <class real>
double distance(const Path<real>& a, const Path<real>& b) {
    return std::fmax(distance(a.q, b.q), distance(a.p, b.p));
}

const char* const plain = "tangent = false";  // the output of kernels that several tests share

template <class real>
double compared(const Motion& motion, const std::string& method, Precision precision, std::int64_t steps) {
    const Derivation derivation = derivation_of(motion, method, plain);
    const auto has_fixed_point = path<real>(kernel_in_own_cache(derivation, precision), motion, motion.step, steps);
    const auto newton = path<real>(newton_kernel(derivation, precision), motion, motion.step, steps);
    CHECK(has_fixed_point.call.iterations >= steps);
    CHECK(distance(has_fixed_point, newton) > 0);  // they did not go the same way
    return distance(has_fixed_point, newton);
}

const char* const lobatto_4 = "points = 4";
const char* const lobatto_8 = "points = 8";
const char* const lobatto_9 = "points = 9";
const char* const gauss_3 = "family = \"gauss\"\nstages = 3";

// max |T^T J T - J| of `steps` steps from the motion's start, T by central differences of fourth order in all
// directions; entries are of the size of T's squared.
double map_defect(const Kernel& kernel, const Motion& motion, std::int64_t steps, double tolerance) {
    using real = long double;
    const std::size_t n = motion.q.size();
    LoadedStepper<real> stepper = started<real>(kernel, motion, motion.step);
    const auto q = converted<real>(motion.q);
    const auto p = stepper.momentum(0, q, converted<real>(motion.v));
    const real e = 1e-3L;
    const auto image = [&](std::size_t direction, real shift) {
        auto at_q = q, at_p = p;
        (direction < n ? at_q[direction] : at_p[direction - n]) += shift;
        REQUIRE(stepper.start(0, at_q, at_p) == LOBATTO_OK);
        Path<real> end = path(stepper, steps, tolerance);
        end.q.insert(end.q.end(), end.p.begin(), end.p.end());
        return end.q;
    };
    std::vector<std::vector<real>> columns;  // of T
    for (std::size_t c = 0; c < 2 * n; ++c) {
        // 8/6 of the difference over e less 1/6 of that over 2e, and once more against their error e^4
        const auto rough = [&](real width) {
            const auto a = image(c, width), b = image(c, -width), far_a = image(c, 2 * width),
                       far_b = image(c, -2 * width);
            std::vector<real> slope(2 * n);
            for (std::size_t r = 0; r < 2 * n; ++r)
                slope[r] = (8 * (a[r] - b[r]) - (far_a[r] - far_b[r])) / (12 * width);
            return slope;
        };
        auto fine = rough(e);
        const auto coarse = rough(2 * e);
        for (std::size_t r = 0; r < 2 * n; ++r) fine[r] += (fine[r] - coarse[r]) / 15;
        columns.push_back(fine);
    }
    real worst = 0;
    for (std::size_t a = 0; a < 2 * n; ++a)
        for (std::size_t b = 0; b < 2 * n; ++b) {
            real form = a + n == b ? -1.0L : b + n == a ? 1.0L : 0.0L;
            for (std::size_t k = 0; k < n; ++k)
                form += columns[a][k] * columns[b][n + k] - columns[a][n + k] * columns[b][k];
            worst = std::fmax(worst, std::fabs(form));
        }
    return static_cast<double>(worst);
}

// How far the mean of H moves from the first to the last fifth of a run, relative to |H|.
double energy_drift(const Kernel& kernel, const Motion& motion, std::int64_t steps, double tolerance) {
    LoadedStepper<double> stepper = started<double>(kernel, motion, motion.step);
    const std::size_t n = motion.q.size(), rows = static_cast<std::size_t>(steps) / 10;
    std::vector<double> records(rows * (1 + 2 * n));
    lobatto_advance call{};
    call.steps = steps;
    call.record_every = 10;
    call.records = records.data();
    call.capacity = static_cast<std::int64_t>(rows);
    call.tolerance = tolerance;
    REQUIRE(stepper.advance(call) == LOBATTO_OK);
    REQUIRE(call.steps_done == steps);
    double first = 0, last = 0;
    for (std::size_t row = 0; row < rows; ++row) {
        const double* const at = records.data() + row * (1 + 2 * n);
        double H = 0;
        REQUIRE(stepper.energy(at[0], {at + 1, at + 1 + n}, {at + 1 + n, at + 1 + 2 * n}, H) == LOBATTO_OK);
        if (row < rows / 5) first += H;
        if (row >= rows - rows / 5) last += H;
    }
    return std::fabs(last / first - 1);
}

}  // namespace

// What computes here are kernels, which no sanitiser looks into.
TEST_SUITE_BEGIN("slow");

// Bounds are in units of epsilon, relative to the largest position or momentum; what was measured is beside each. Where
// a motion makes more of its rounding (the pendulums) the measured figures are larger.
TEST_CASE("steps by fixed-point iteration are those of Newton's iteration, in double") {
    struct Compared {
        const Motion& motion;
        const char* method;
        double bound;
    };
    const Motion twelve = chain(), ring = lattice();
    for (const Compared& c : {Compared{pendulum, lobatto_4, 800},          // 102
                              Compared{pendulum, lobatto_9, 400},          // 27
                              Compared{pendulum, gauss_3, 400},            // 57
                              Compared{henon_heiles, lobatto_4, 200},      // 11; its diagonal part is absorbed
                              Compared{kepler, "points = 5", 800},         // 97
                              Compared{double_pendulum, lobatto_4, 1500},  // 174
                              Compared{double_pendulum, lobatto_8, 1500},  // 142
                              Compared{spherical_pendulum, lobatto_4,
                                       4000},  // 546; against long double 37 by fixed-point iterations, 509 by Newton
                              Compared{spherical_pendulum, gauss_3, 500},  // 53
                              Compared{driven_pendulum, lobatto_4, 200},   // 21
                              Compared{twelve, lobatto_4, 800},            // 90
                              Compared{ring, "points = 5", 800}, Compared{ring, gauss_3, 800}}) {
        INFO(c.motion.body << c.method);
        CHECK(compared<double>(c.motion, c.method, Precision::double_, 200) < c.bound);
    }
}

TEST_CASE("steps by fixed-point iteration are those of Newton's iteration, in float and long double" *
          doctest::test_suite("slowest")) {
    const Motion ring = lattice();
    for (const Motion* motion : {&pendulum, &double_pendulum, &ring}) {
        INFO(motion->body);
        CHECK(compared<float>(*motion, lobatto_4, Precision::single, 100) < 500);  // 71, 61, ...
    }
    for (const Motion* motion : {&henon_heiles, &double_pendulum}) {
        INFO(motion->body);
        CHECK(compared<long double>(*motion, lobatto_4, Precision::extended, 100) < 100);  // 4, 6
    }
}

TEST_CASE("steps by fixed-point iteration are those of the general path") {
    for (const Motion* motion : {&pendulum, &kepler}) {
        const Derivation derivation = derivation_of(*motion, lobatto_4, plain),
                         general = derivation_of(*motion, lobatto_4, plain, Shortcuts::none);
        const auto a = path<double>(kernel_in_own_cache(derivation, Precision::double_), *motion, motion->step, 200);
        const auto b = path<double>(kernel_in_own_cache(general, Precision::double_), *motion, motion->step, 200);
        const auto c = path<double>(newton_kernel(general, Precision::double_), *motion, motion->step, 200);
        CHECK(distance(a, b) < 500);  // 94 and 20 epsilon measured
        CHECK(distance(a, c) < 500);  // 36 and 52: the general path by Newton's iteration
    }
}

// Five steps, so that all but the first start from the step before.
TEST_CASE("the map of steps by fixed-point iteration is symplectic to rounding, and with a tolerance it is not") {
    for (const Motion* motion : {&pendulum, &kepler}) {
        const Kernel kernel = kernel_in_own_cache(derivation_of(*motion, lobatto_4), Precision::extended);
        CHECK(map_defect(kernel, *motion, 5, 0) < 1e-13);     // 4e-17 and 7e-15, what the differences leave
        CHECK(map_defect(kernel, *motion, 5, 1e-6) > 1e-10);  // 2e-9
    }
}

TEST_CASE("energy does not drift in 100000 steps by fixed-point iteration, and with a tolerance it does") {
    const Kernel six = kernel_in_own_cache(derivation_of(pendulum, "points = 6"), Precision::double_);
    CHECK(energy_drift(six, pendulum, 100000, 0) < 1e-12);    // 1e-13: rounding, added up
    CHECK(energy_drift(six, pendulum, 100000, 1e-6) > 1e-7);  // 1.2e-6
    const Kernel four = kernel_in_own_cache(derivation_of(kepler, lobatto_4, plain), Precision::double_);
    CHECK(energy_drift(four, kepler, 100000, 0) < 1e-12);     // 1.3e-13; by Newton's iteration 2.2e-13
    CHECK(energy_drift(four, kepler, 100000, 1e-6) > 3e-12);  // 2.5e-11
}

// Increments are measured coordinate by coordinate: where one is far from zero and hardly moves, its rounding is large
// beside its displacement, and must not stand for the rounding of the others.
TEST_CASE("a coordinate at rest far from zero takes no accuracy from the others") {
    for (const char* kinetic : {"(1 + x^2/9)", "1"}) {
        const Motion motion{std::string("lagrangian = \"x'^2/2*") + kinetic +
                                " + z'^2/2 - x^4/4 - x^2/2 - (z - 1)^2/2 - (z - 1)^4\"\n[coordinates]\n"
                                "x = { position = 1, velocity = 0 }\nz = { position = 1, velocity = 0 }\n",
                            {},
                            {1, 1},
                            {0, 0},
                            0.1};
        const Kernel kernel = kernel_in_own_cache(derivation_of(motion, "points = 6"), Precision::double_);
        CHECK(energy_drift(kernel, motion, 20000, 0) < 1e-12);  // 1e-13; 1e-7 with one measure for all
    }
}

TEST_CASE("formulas go along neighbouring coordinates where these stand in rows, and only there") {
    const auto claims = [](const Motion& motion, const char* output = "", Shortcuts shortcuts = Shortcuts::all) {
        return derivation_of(motion, lobatto_4, output, shortcuts).structure.neighbours();
    };
    CHECK(claims(lattice()));
    CHECK_FALSE(claims(lattice(), "", Shortcuts::none));
    CHECK_FALSE(claims(pendulum));
    Motion scattered = lattice();  // each coupled to the one 7 times as far round the ring: nobody's neighbour
    scattered.body =
        "lagrangian = \"sum(i = 1 .. n, x[i]'^2/2 - (x[i] - x[mod(7*i, n) + 1])^4)\"\n[coordinates]\n"
        "x = { count = \"n\", position = \"i/40\", velocity = 0 }\n[parameters]\nn = { value = 45, constant = true }\n";
    CHECK_FALSE(claims(scattered));
}

TEST_CASE("where the fixed-point iteration cannot contract Newton's iteration takes the step") {
    struct Stiff {
        const Motion& motion;
        double step;
        std::int64_t steps;
        double bound;
    };
    const Motion twelve = chain();
    for (const Stiff& stiff :
         {Stiff{pendulum, 2.9 / 1.5, 1, 0},       // h omega = 2.9
          Stiff{pendulum, 2.9 / 1.5, 20, 20000},  // 1978: some steps by fixed-point iterations, errors grow
          Stiff{twelve, 2.5, 50, 0},              // h omega = 5
          Stiff{double_pendulum, 0.9, 1, 10}, Stiff{double_pendulum, 0.9, 20, 200}}) {  // 17
        INFO(stiff.motion.body << stiff.steps);
        const Derivation derivation = derivation_of(stiff.motion, lobatto_4, plain);
        const auto with =
            path<double>(kernel_in_own_cache(derivation, Precision::double_), stiff.motion, stiff.step, stiff.steps);
        const auto newton =
            path<double>(newton_kernel(derivation, Precision::double_), stiff.motion, stiff.step, stiff.steps);
        CHECK(distance(with, newton) <= stiff.bound);
        if (stiff.bound == 0) CHECK(with.call.iterations == newton.call.iterations);
        CHECK(with.call.iterations >= 2 * stiff.steps);
        CHECK(with.call.iterations_most >= 3);
    }
}

TEST_CASE("dense output, events and the tangent map after steps by fixed-point iteration are those after Newton's" *
          doctest::test_suite("slowest")) {
    struct Watched {
        const Motion& motion;
        std::string event;
    };
    struct Seen {
        std::vector<double> between, events, tangent;
    };
    const Motion ring = lattice();
    for (const Watched& watched : {Watched{ring, "x[1] = 0"}, Watched{pendulum, "q = 0"},
                                   Watched{double_pendulum, "a = b"}, Watched{spherical_pendulum, "a = 0.8"}}) {
        const Derivation derivation = derivation_of(watched.motion, lobatto_4, "events = [\"" + watched.event + "\"]");
        const std::size_t n = watched.motion.q.size(), columns = 2 + 2 * n, room = 100;
        const auto look = [&](const Kernel& kernel) {
            Seen seen;
            auto stepper = started<double>(kernel, watched.motion, watched.motion.step);
            seen.events.resize(room * columns);
            lobatto_advance call{};
            call.steps = 100;
            call.events = seen.events.data();
            call.event_capacity = room;
            CHECK(stepper.advance(call) == LOBATTO_OK);
            CHECK(call.steps_done == 100);
            CHECK(call.events_written >= 4);
            seen.events.resize(static_cast<std::size_t>(call.events_written) * columns);
            for (const double theta : {0.0, 0.1, 0.25, 0.5, 0.9, 1.0}) {
                std::vector<double> q(n), v(n);
                CHECK(stepper.dense(theta, q, v) == LOBATTO_OK);
                seen.between.insert(seen.between.end(), q.begin(), q.end());
                seen.between.insert(seen.between.end(), v.begin(), v.end());
            }
            double time = 0;
            std::vector<double> q(n), p(n), q1(n), p1(n);
            seen.tangent.resize(4 * n * n);
            stepper.state(time, q, p);
            CHECK(stepper.tangent(time, q, p, q1, p1, seen.tangent) == LOBATTO_OK);
            return seen;
        };
        const Seen has_fixed_point = look(kernel_in_own_cache(derivation, Precision::double_)),
                   newton = look(newton_kernel(derivation, Precision::double_));
        INFO(watched.motion.body);
        CHECK(distance(has_fixed_point.events, newton.events) < 400);    // 1.1, 0.5, 2.1, 50 epsilon
        CHECK(distance(has_fixed_point.between, newton.between) < 400);  // 10.8, 6.1, 6.9, 43
        CHECK(distance(has_fixed_point.tangent, newton.tangent) < 300);  // 1.0, 0.2, 0.5, 33
    }
}

TEST_CASE("steps back in time are taken by fixed-point iteration too") {
    for (const Motion* motion : {&pendulum, &double_pendulum}) {
        const Derivation derivation = derivation_of(*motion, lobatto_4, "tangent = false");
        const Kernel kernel = kernel_in_own_cache(derivation, Precision::double_),
                     newton = newton_kernel(derivation, Precision::double_);
        const auto forth = path<double>(kernel, *motion, motion->step, 100),
                   back = path<double>(kernel, *motion, -motion->step, 100),
                   newton_back = path<double>(newton, *motion, -motion->step, 100);
        INFO(motion->body);
        CHECK(distance(back, newton_back) < 300);  // 32 and 4 epsilon
        CHECK(distance(back, newton_back) > 0);
        CHECK(static_cast<double>(back.call.iterations) < 1.2 * static_cast<double>(forth.call.iterations));
        // Newton's iteration alone would take fewer: 2 a step against 3 and 6.
        CHECK(static_cast<double>(back.call.iterations) > 1.2 * static_cast<double>(newton_back.call.iterations));
    }
}

TEST_SUITE_END();
