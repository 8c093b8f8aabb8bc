// SPDX-License-Identifier: GPL-2.0-or-later
// Between two steps: states on the step's polynomial, and where event functions vanish.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "runtime/kernel/export/export.hpp"
#include "tests/handwritten/cyclic.hpp"
#include "tests/handwritten/pendulum.hpp"

using namespace lobatto;

namespace {

// The pendulum of generated kernels with events: q = 0 rising, q' = 0 falling, and q^2 = 1 either way.
struct Swing : HandwrittenPendulum {
    static constexpr int events = 3, stops = 0, impacts = 0, switches = 0;
    static constexpr int event_direction[3] = {1, -1, 0};
    static void event(const Coefficients&, const real* q, const real* velocity, real* value) {
        value[0] = q[0];
        value[1] = velocity[0];
        value[2] = q[0] * q[0] - 1;
    }
};

// Events that change their sign through infinity: 1/q = 0, and q'/q = 0, which has roots as well.
struct Poles : HandwrittenPendulum {
    static constexpr int events = 2, stops = 0, impacts = 0, switches = 0;
    static constexpr int event_direction[2] = {0, 0};
    static void event(const Coefficients&, const real* q, const real* velocity, real* value) {
        value[0] = 1 / q[0];
        value[1] = velocity[0] / q[0];
    }
};

struct Row {
    int event;
    double t, q, p;
};

// Runs in calls of `block` steps, with room for `capacity` events in each.
template <class K>
std::vector<Row> events_of(double h, double q, double p, int steps, int block, int capacity = 64) {
    typename Export<K>::S stepper;
    std::vector<double> rows(static_cast<std::size_t>(capacity) * 4);
    const double time = 0, parameters[2] = {1, 1};
    REQUIRE(Export<K>::prepare(&stepper, parameters, &h) == LOBATTO_OK);
    REQUIRE(Export<K>::start(&stepper, &time, &q, &p) == LOBATTO_OK);
    std::vector<Row> found;
    for (int done = 0; done < steps;) {
        lobatto_advance call{};
        call.steps = std::min(block, steps - done);
        call.events = rows.data();
        call.event_capacity = capacity;
        REQUIRE(Export<K>::advance(&stepper, &call) == LOBATTO_OK);
        REQUIRE(call.steps_done > 0);
        done += static_cast<int>(call.steps_done);
        for (std::size_t i = 0; i < static_cast<std::size_t>(call.events_written); ++i)
            found.push_back({static_cast<int>(rows[4 * i]), rows[4 * i + 1], rows[4 * i + 2], rows[4 * i + 3]});
    }
    return found;
}

}  // namespace

TEST_CASE("events of the pendulum are found once each, in order, at their times") {
    // From q = 2 at rest; the quarter period K(sin 1) for omega = 1.
    const double quarter = std::comp_ellint_1(std::sin(1.0));
    const std::vector<Row> found = events_of<Swing>(0.1, 2, 0, 400, 400, 400);
    int rising = 0, turning = 0, crossing = 0;
    double before = -1;
    for (const Row& row : found) {
        CHECK(row.t >= before);
        before = row.t;
        if (row.event == 0) {
            CHECK(std::fabs(row.t - (3 + 4 * rising) * quarter) < 1e-8);
            CHECK(std::fabs(row.q) < 1e-15);
            CHECK(row.p > 0);
            ++rising;
        } else if (row.event == 1) {
            ++turning;
            CHECK(std::fabs(row.t - 4 * turning * quarter) < 1e-8);
            CHECK(std::fabs(row.p) < 1e-15);
            CHECK(row.q > 0);
        } else {
            CHECK(std::fabs(std::fabs(row.q) - 1) < 4e-16);
            ++crossing;
        }
    }
    CHECK(rising == static_cast<int>((40 / quarter + 1) / 4));
    CHECK(turning == static_cast<int>(40 / quarter / 4));
    CHECK(crossing == 4 * turning + static_cast<int>((40 / quarter - 4 * turning) + 0.6));
}

TEST_CASE("a change of sign at a pole is no event") {
    int turning = 0;
    for (const Row& row : events_of<Poles>(0.1, 2, 0, 400, 400, 400)) {
        CHECK(row.event == 1);
        CHECK(std::fabs(row.p) < 1e-12);
        ++turning;
    }
    CHECK(turning == static_cast<int>(40 / std::comp_ellint_1(std::sin(1.0)) / 2));
}

TEST_CASE("events do not depend on how steps are grouped, nor on the room for them") {
    const std::vector<Row> once = events_of<Swing>(0.3, 2, 0.1, 500, 500, 1000);
    REQUIRE(once.size() > 50);
    for (const auto& other :
         {events_of<Swing>(0.3, 2, 0.1, 500, 1), events_of<Swing>(0.3, 2, 0.1, 500, 17, Watch<Swing>::most)}) {
        REQUIRE(other.size() == once.size());
        for (std::size_t i = 0; i < once.size(); ++i) {
            CHECK(other[i].event == once[i].event);
            CHECK(other[i].t == once[i].t);
            CHECK(other[i].q == once[i].q);
        }
    }
}

TEST_CASE("backwards in time an event that rises with time is still the rising one") {
    const std::vector<Row> found = events_of<Swing>(-0.1, 0.5, 0.6, 300, 300, 300);
    int rising = 0;
    double before = 1;
    for (const Row& row : found) {
        CHECK(row.t <= before);
        before = row.t;
        if (row.event == 0) {
            CHECK(row.p > 0);
            ++rising;
        }
    }
    CHECK(rising >= 4);
}

TEST_CASE("a start on an event is none") {
    for (const Row& row : events_of<Swing>(0.1, 0, 1, 5, 5, 200)) CHECK(row.event != 0);
}

TEST_CASE("dense rows lie on the step's polynomial, between the records") {
    using K = Swing;
    typename Export<K>::S stepper;
    const double time = 0, h = 0.2, q = 2, p = 0, parameters[2] = {1, 1};
    REQUIRE(Export<K>::prepare(&stepper, parameters, &h) == LOBATTO_OK);
    REQUIRE(Export<K>::start(&stepper, &time, &q, &p) == LOBATTO_OK);
    double between, velocity;
    const double half = 0.5;
    CHECK(Export<K>::dense(&stepper, &half, &between, &velocity) == LOBATTO_UNSUPPORTED);  // no step yet
    Export<K>::S fine;
    const double h_fine = 0.05;
    REQUIRE(Export<K>::prepare(&fine, parameters, &h_fine) == LOBATTO_OK);
    REQUIRE(Export<K>::start(&fine, &time, &q, &p) == LOBATTO_OK);
    std::vector<double> rows(3 * 8);
    lobatto_advance call{};
    call.steps = 100;
    call.record_every = 1;
    call.dense = 3;
    call.records = rows.data();
    call.capacity = 8;
    REQUIRE(Export<K>::advance(&stepper, &call) == LOBATTO_OK);
    CHECK(call.steps_done == 2);
    REQUIRE(call.records_written == 8);
    for (int i = 0; i < 8; ++i) {
        REQUIRE(fine.step() == Status::ok);
        CHECK(rows[3 * i] == doctest::Approx(0.05 * (i + 1)).epsilon(1e-15));
        const bool is_step = i % 4 == 3;
        CHECK(std::fabs(rows[3 * i + 1] - fine.q[0]) < (is_step ? 1e-9 : 1e-6));  // 4.3e-11 and 3.1e-7 measured
        CHECK(std::fabs(rows[3 * i + 2] - fine.u[0]) < (is_step ? 1e-8 : 1e-4));  // 1.8e-10 and 1.1e-5
    }
    REQUIRE(Export<K>::dense(&stepper, &half, &between, &velocity) == LOBATTO_OK);
    CHECK(between == rows[3 * 5 + 1]);
    const double end = 1;
    REQUIRE(Export<K>::dense(&stepper, &end, &between, &velocity) == LOBATTO_OK);
    CHECK(std::fabs(between - rows[3 * 7 + 1]) < 1e-15);
    call.record_every = 2;
    CHECK(Export<K>::advance(&stepper, &call) == LOBATTO_UNSUPPORTED);
}

TEST_CASE("a conserved momentum is the same between steps") {
    using K = HandwrittenSphericalPendulum<double, LobattoFour<double>, true>;
    typename Export<K>::S stepper;
    const double q[2] = {0.9, 0.4}, p[2] = {0.2, 0.7};
    REQUIRE(stepper.prepare({}, 0.2) == Status::ok);
    REQUIRE(stepper.start(0, q, p) == Status::ok);
    REQUIRE(stepper.step() == Status::ok);
    double row[5];
    Between<K>::row(stepper, 0.37, row);
    CHECK(row[4] == 0.7);
    // The polynomial's velocity errs by O(h^3): 3.9e-6 measured.
    double energy = 0, at_start = 0;
    REQUIRE(stepper.energy(0, q, p, &at_start) == Status::ok);
    REQUIRE(stepper.energy(0, row + 1, row + 3, &energy) == Status::ok);
    CHECK(std::fabs(energy - at_start) < 1e-4);
    lobatto_advance call{};
    double events[6];
    call.events = events;
    CHECK(Export<K>::advance(&stepper, &call) == LOBATTO_UNSUPPORTED);  // it has none
}
