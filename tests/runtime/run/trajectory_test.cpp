// SPDX-License-Identifier: GPL-2.0-or-later
// Driving a kernel: which states are kept, what is measured, how a run ends.
#include "runtime/run/trajectory.hpp"

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>
#include <filesystem>

#include "analysis/kernel/kernel_of.hpp"
#include "generator/pipeline.hpp"
#include "runtime/error.hpp"
#include "runtime/measure/diagnostics.hpp"
#include "runtime/measure/reference.hpp"
#include "tests/support.hpp"

using namespace lobatto;

namespace {

const Kernel& pendulum() {
    static const Kernel kernel = [] {
        KernelSource source;
        source.name = "handwritten_pendulum";
        source.digest = "0123456789abcdef";
        source.formulas = test::read_file(LOBATTO_SOURCE_DIR "/tests/handwritten/pendulum.hpp") +
                          "namespace lobatto::kernels { using handwritten_pendulum = HandwrittenPendulum; }\n";
        return kernel_of(source, Precision::double_);
    }();
    return kernel;
}

// The same with events: q = 0 rising, and momenta that vanish.
const Kernel& eventful_pendulum() {
    static const Kernel kernel = [] {
        KernelSource source;
        source.name = "eventful_pendulum";
        source.digest = "0123456789abcdef";
        source.formulas =
            test::read_file(LOBATTO_SOURCE_DIR "/tests/handwritten/pendulum.hpp") +
            "namespace lobatto::kernels {\nstruct eventful_pendulum : HandwrittenPendulum {\n"
            "    static constexpr int events = 2, stops = 0, impacts = 0, switches = 0;\n    static constexpr int "
            "event_direction[2] = {1, 0};\n"
            "    static void event(const Coefficients&, const real* q, const real* velocity, real* value) {\n"
            "        value[0] = q[0];\n        value[1] = velocity[0];\n    }\n};\n}\n";
        return kernel_of(source, Precision::double_);
    }();
    return kernel;
}

// Two coordinates with a mass matrix that is not diagonal, in the given potential.
Scene coupled(const std::string& potential) {
    return read_scene(
        Source("coupled.toml",
               "title = \"Coupled\"\nlagrangian = \"x'^2 + x'*y'/2 + y'^2 - (" + potential +
                   ")\"\n[coordinates]\nx = { position = 1, velocity = 0 }\ny = { position = 1, velocity = 0 }\n"
                   "[method]\nfamily = \"lobatto\"\npoints = 4\n[run]\nstep = 0.5\nuntil = 1\n"));
}

// m = omega = 1 from q = 2 at rest.
TrajectoryRequest from_two(double step, std::int64_t steps, std::int64_t every = 1) {
    TrajectoryRequest request;
    request.parameters = {1, 1};
    request.q = {2};
    request.p = {0};
    request.step = step;
    request.steps = steps;
    request.every = every;
    return request;
}

std::vector<double> kept_times(TrajectoryRequest request, TrajectoryResult* result = nullptr) {
    std::vector<double> times;
    request.sink = [&](const Records& records) {
        for (std::int64_t i = 0; i < records.count; ++i) times.push_back(records.rows[i * records.columns]);
    };
    const TrajectoryResult done = integrate(pendulum(), request);
    if (result != nullptr) *result = done;
    return times;
}

}  // namespace

TEST_CASE("the first and the last state are kept exactly once") {
    using Times = std::vector<double>;
    CHECK(kept_times(from_two(0.25, 0)) == Times{0});
    CHECK(kept_times(from_two(0.25, 1)) == Times{0, 0.25});
    CHECK(kept_times(from_two(0.25, 4, 2)) == Times{0, 0.5, 1});
    CHECK(kept_times(from_two(0.25, 5, 2)) == Times{0, 0.5, 1, 1.25});
    CHECK(kept_times(from_two(0.25, 3, 1000)) == Times{0, 0.75});
    CHECK(kept_times(from_two(-0.25, 3, 2)) == Times{0, -0.5, -0.75});
}

TEST_CASE("a run of many blocks keeps every state in order") {
    // 20,000 states pass through a buffer of 4096.
    const std::vector<double> times = kept_times(from_two(0.125, 60001, 3));
    REQUIRE(times.size() == 20002);
    bool in_order = true;
    for (std::size_t i = 0; i + 1 < times.size(); ++i)
        in_order = in_order && times[i] == 0.375 * static_cast<double>(i);
    CHECK(in_order);
    CHECK(times.back() == 0.125 * 60001);
}

TEST_CASE("dense rows stand between the steps, in order, and do not count in the energy error") {
    TrajectoryRequest request = from_two(0.25, 10000);
    const TrajectoryResult plain = integrate(pendulum(), request);
    request.dense = 4;
    std::vector<double> times;
    request.sink = [&](const Records& records) {
        for (std::int64_t i = 0; i < records.count; ++i) times.push_back(records.rows[i * records.columns]);
    };
    const TrajectoryResult result = integrate(pendulum(), request);
    REQUIRE(times.size() == 50001);
    for (std::size_t i = 0; i < times.size(); ++i) CHECK(std::fabs(times[i] - 0.05 * static_cast<double>(i)) < 1e-9);
    CHECK(result.energy_error_largest == plain.energy_error_largest);
    CHECK(result.q == plain.q);
    request.every = 2;
    CHECK(integrate(pendulum(), request).status == LOBATTO_UNSUPPORTED);
}

TEST_CASE("events reach their sink in order, all of them") {
    TrajectoryRequest request = from_two(0.1, 200000, 1000);
    std::int64_t rising = 0, turning = 0;
    double before = 0;
    bool in_order = true;
    request.events = [&](const EventRecords& events) {
        CHECK(events.columns == 4);
        for (std::int64_t i = 0; i < events.count; ++i) {
            const double* const row = events.rows + 4 * i;
            in_order = in_order && row[1] > before;
            before = row[1];
            ++(row[0] == 0 ? rising : turning);
            CHECK(std::fabs(row[0] == 0 ? row[2] : row[3]) < 1e-13);
        }
    };
    const TrajectoryResult result = integrate(eventful_pendulum(), request);
    const double period = 4 * std::comp_ellint_1(std::sin(1.0));
    CHECK(in_order);
    CHECK(result.events == rising + turning);
    CHECK(rising == std::llround(20000 / period));
    CHECK(std::llabs(turning - 2 * rising) <= 1);
    // A kernel without events has none to seek.
    CHECK(integrate(pendulum(), from_two(0.1, 10)).events == 0);
}

TEST_CASE("a trajectory follows the exact solution, forwards and backwards") {
    for (const double h : {0.1, -0.1}) {
        TrajectoryResult result;
        kept_times(from_two(h, 1000), &result);
        const PhasePoint exact = pendulum_solution(1, 2, 0, static_cast<long double>(result.time));
        CHECK(std::fabs(result.q[0] - static_cast<double>(exact.q)) < 1e-10);  // measured 1.9e-11 at t = 100
        CHECK(result.time == doctest::Approx(1000 * h).epsilon(1e-14));
        CHECK(result.steps_done == 1000);
        CHECK(result.status == LOBATTO_OK);
    }
}

TEST_CASE("there and back again leads to the start") {
    TrajectoryRequest request = from_two(0.1, 1000);
    const TrajectoryResult there = integrate(pendulum(), request);
    request.q = there.q;
    request.p = there.p;
    request.time = there.time;
    request.step = -0.1;
    const TrajectoryResult back = integrate(pendulum(), request);
    CHECK(std::fabs(back.q[0] - 2) < 1e-11);  // rounding, which grows with t; measured 2.4e-13
    CHECK(std::fabs(back.p[0]) < 1e-11);
    CHECK(back.time == doctest::Approx(0));
}

TEST_CASE("the energy error is that of the kept states") {
    TrajectoryRequest request = from_two(0.5, 1000);
    double largest = 0, last = 0;
    const double start = 1 - std::cos(2.0);
    request.sink = [&](const Records& records) {
        for (std::int64_t i = 0; i < records.count; ++i) {
            const double q = records.rows[3 * i + 1], p = records.rows[3 * i + 2], H = p * p / 2 + 1 - std::cos(q);
            CHECK(std::fabs(records.energy[i] - H) < 1e-15);
            last = H - start;
            largest = std::fmax(largest, std::fabs(last));
        }
    };
    const TrajectoryResult result = integrate(pendulum(), request);
    CHECK(result.energy_start == doctest::Approx(start).epsilon(1e-15));
    CHECK(std::fabs(result.energy_error_largest - largest) < 1e-15);
    CHECK(std::fabs(result.energy_error_final - last) < 1e-15);
    CHECK(largest > 1e-6);  // the method's own error, far above rounding; measured 2.7e-6
    CHECK(largest < 1e-4);
}

TEST_CASE("iterations, increments and progress are counted") {
    TrajectoryRequest request = from_two(0.2, 3000000, 1000000);
    std::int64_t told = 0;
    request.progress = [&](std::int64_t done) {
        CHECK(done > told);
        told = done;
    };
    const TrajectoryResult result = integrate(pendulum(), request);
    CHECK(result.iterations >= result.steps_done);
    CHECK(result.iterations_most >= 2);
    CHECK(result.iterations_most <= 6);
    CHECK(result.increment_largest > 0);
    CHECK(result.increment_largest < 1e-6);  // below the root of rounding; measured 4e-13
    CHECK(result.seconds > 0);
    CHECK(told > 0);  // 3 million steps take more than a tenth of a second
}

TEST_CASE("an interruption ends the run between two blocks and keeps what was done") {
    TrajectoryRequest request = from_two(0.125, 1'000'000'000'000, 1000);
    volatile int flag = 0;
    request.interrupted = &flag;
    request.progress = [&](std::int64_t) { flag = 1; };
    TrajectoryResult result;
    const std::vector<double> times = kept_times(request, &result);
    CHECK(result.interrupted);
    CHECK(result.status == LOBATTO_OK);
    CHECK(result.steps_done > 0);
    CHECK(times.back() == result.time);
    CHECK(result.time == 0.125 * static_cast<double>(result.steps_done));
}

TEST_CASE("a step that does not converge stops the run, keeps the steps before and explains itself") {
    TrajectoryRequest request = from_two(6, 100, 3);  // omega h = 38, an order beyond the stability bound 3.1
    request.parameters = {1, 6.283185307179586};
    TrajectoryResult result;
    const std::vector<double> times = kept_times(request, &result);
    CHECK(result.status == LOBATTO_NOT_CONVERGED);
    CHECK(result.increment_failed > 1e-6);
    CHECK(result.steps_done < 100);  // a few: which one, rounding decides
    CHECK(times.front() == 0);
    CHECK(times.back() == result.time);
    CHECK(times.back() == 6.0 * static_cast<double>(result.steps_done));
    const std::string where = result.steps_done == 0
                                  ? "in its first step, at t = 0"
                                  : fmt::format("in step {}, after t = {:.6g}", result.steps_done + 1, result.time);
    CHECK(explain_stop(result, request).starts_with("the run stopped " + where + ", from q = "));
}

TEST_CASE("each way to stop has its own explanation") {
    TrajectoryRequest request = from_two(0.5, 100);
    TrajectoryResult result;
    result.started = true;
    result.steps_done = 41;
    result.time = 20.5;
    result.q = {1.25, -3};
    result.p = {0, 1e10};
    const std::string where = "the run stopped in step 42, after t = 20.5, from q = (1.25, -3), p = (0, 1e+10): ";
    result.status = LOBATTO_OK;
    CHECK(explain_stop(result, request) == "");
    result.status = LOBATTO_NOT_CONVERGED;
    result.increment_failed = 0.3;
    CHECK(explain_stop(result, request) ==
          where +
              "the iteration for the positions inside the step did not converge: its last increment was 0.3 of "
              "the displacement within the step. The step is too "
              "long for the forces met there, or the motion runs into a singularity of the potential, to a place where "
              "a mass vanishes, or away to infinity. Try a smaller step, such as h = 0.25, an earlier end, or start "
              "elsewhere.");
    result.status = LOBATTO_NOT_FINITE;
    CHECK(explain_stop(result, request) ==
          where +
              "a position or momentum became infinite or not a number. The motion runs into a singularity of the "
              "potential, to a place where a mass vanishes, exp overflows or a root gets a negative number, or away "
              "to infinity, "
              "or the step is too long for the method to be stable. Try a smaller step, such as h = 0.25, an earlier "
              "end, or start elsewhere.");
    result.status = LOBATTO_SINGULAR_JACOBIAN;
    CHECK(explain_stop(result, request) ==
          where +
              "the equations for the positions inside the step have no unique solution: their Jacobian is singular. "
              "This h meets a resonance of the forces there, a body turns by a large part of a revolution in it, or "
              "constraints depend on one another, as at a dead point. "
              "Try a smaller step, such as h = 0.25, or a slightly different one.");
    result.status = LOBATTO_TIME_STANDS_STILL;
    CHECK(explain_stop(result, request) ==
          where +
              "t + h equals t in the numbers of the run: h = 0.5 is below the rounding of "
              "t. Try a larger step, or a start time nearer to zero.");
    result.status = LOBATTO_SINGULAR_MASS;
    result.steps_done = 0;
    result.time = 0;
    CHECK(explain_stop(result, request) ==
          "the run stopped in its first step, at t = 0, from q = (1.25, -3), p = (0, 1e+10): the mass matrix has no "
          "inverse for these parameters or at this state, so that momenta do not determine velocities. Try other "
          "values of the parameters that stand "
          "before the squared velocities, or start elsewhere; none of the masses may vanish.");
    result.status = LOBATTO_UNSUPPORTED;
    CHECK(
        explain_stop(result, request) ==
        "the run stopped in its first step, at t = 0, from q = (1.25, -3), p = (0, 1e+10): the kernel was compiled "
        "without what is asked of it: states between steps, events, energies or tangent maps. Try to compile it from a "
        "scene whose [output] asks for it.");
}

TEST_CASE("a start that makes numbers too large is told apart from a motion that does, and long states are shortened") {
    TrajectoryRequest request = from_two(0.5, 100);
    TrajectoryResult result;
    result.status = LOBATTO_NOT_FINITE;
    result.q = {1.25};
    result.p = std::vector<double>(20, 0.5);
    CHECK(
        explain_stop(result, request) ==
        "the run cannot begin at t = 0, from q = (1.25), p = (0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, "
        "0.5, 0.5, 0.5, 0.5, 0.5, ... 20 in all): a number computed from the parameters, the step and this start alone "
        "is infinite or not a number: they are too large or too small together, or the start is at a singularity. Try "
        "other units, so that numbers are nearer to 1, or start elsewhere.");
    request.q = {1e300};
    request.parameters = {1, 1e200};
    CHECK(!integrate(pendulum(), request).started);
}

TEST_CASE("a start that is impossible keeps nothing and says why") {
    TrajectoryRequest request = from_two(0.1, 10);
    request.parameters = {0, 1};
    TrajectoryResult result;
    CHECK(kept_times(request, &result).empty());
    CHECK(result.status == LOBATTO_SINGULAR_MASS);
    request = from_two(0.1, 10);
    request.q = {std::nan("")};
    CHECK(kept_times(request, &result).empty());
    CHECK(result.status == LOBATTO_NOT_FINITE);
    request = from_two(1e-30, 10);
    request.time = 1;
    CHECK(kept_times(request, &result).size() == 1);
    CHECK(result.status == LOBATTO_TIME_STANDS_STILL);
}

TEST_CASE("the step is symplectic to rounding") {
    LoadedStepper<double> stepper(pendulum());
    REQUIRE(stepper.prepare({1.5, 2}, 0.7) == LOBATTO_OK);
    for (const double q : {0.0, 1.0, 2.9}) CHECK(symplectic_defect(stepper, {q}, {0.8}) < 1e-15);  // measured 5e-17
    CHECK(test::message_of<ComputationError>([&] { symplectic_defect(stepper, {std::nan("")}, {0.8}); }) ==
          "the symplectic defect cannot be measured: the step from this state fails");
}

TEST_CASE("the symplectic defect shrinks with the precision") {
    const Derivation derivation = derive(coupled("x^2 + x*y + y^4/4"));
    const auto defect_in = [&]<class real>(real, Precision precision) {
        EmitOptions options;
        options.precision = precision;
        LoadedStepper<real> stepper(kernel_of(emit(derivation, options), precision));
        REQUIRE(stepper.prepare({}, real(0.3)) == LOBATTO_OK);
        return static_cast<double>(symplectic_defect<real>(stepper, {real(0.7), real(-0.4)}, {real(0.2), real(1.1)}));
    };
    const double twice = defect_in(double(), Precision::double_);
    const double extended = defect_in(0.0L, Precision::extended),
                 quadruple = defect_in(__float128(), Precision::quadruple);
    // Measured 2.5e-17, 1.6e-20, 4.3e-35; above zero, or nothing was measured.
    CHECK(twice < 1e-15);
    CHECK(twice > extended);
    CHECK(extended < 1e-18);
    CHECK(extended > quadruple);
    CHECK(quadruple < 1e-33);
    CHECK(quadruple > 0);
}

TEST_CASE("a linear system conserves its discrete energy about its fixed point") {
    const Derivation derivation = derive(coupled("x^2 + x*y + y^2 - 3*x"));
    LoadedStepper<double> stepper(kernel_of(emit(derivation), Precision::double_));
    REQUIRE(stepper.prepare({}, 0.5) == LOBATTO_OK);
    const std::optional<DiscreteEnergy> energy = discrete_energy(stepper);
    REQUIRE(energy);
    REQUIRE(energy->centre.size() == 4);
    const double centre[] = {2, -1, 0, 0};  // where 2 x + y = 3 and x + 2 y = 0
    for (std::size_t i = 0; i < 4; ++i) CHECK(std::fabs(energy->centre[i] - centre[i]) < 1e-14);
    // To first order in h it is h times the energy above the minimum.
    const double q[] = {1, 1}, p[] = {0.5, -0.25};
    const auto energy_at = [&](const std::vector<double>& position, const std::vector<double>& momentum) {
        double value = 0;
        REQUIRE(stepper.energy(0, position, momentum, value) == LOBATTO_OK);
        return value;
    };
    const double H = energy_at({1, 1}, {0.5, -0.25}) - energy_at({2, -1}, {0, 0});
    CHECK((*energy)(q, p) == doctest::Approx(0.5 * H).epsilon(0.1));
    std::vector<double> q1, p1, T;
    REQUIRE(stepper.tangent(0, {1, 1}, {0.5, -0.25}, q1, p1, T) == LOBATTO_OK);
    CHECK(std::fabs((*energy)(q1.data(), p1.data()) - (*energy)(q, p)) < 1e-14);
    CHECK(std::fabs(energy_at(q1, p1) - energy_at({1, 1}, {0.5, -0.25})) > 1e-8);
}

TEST_CASE("a constant force leaves a discrete energy that steps conserve; a nonlinear system has none") {
    // A fall in x, an oscillation in y: no fixed point.
    const Derivation derivation = derive(coupled("9.81*x + y^2"));
    LoadedStepper<double> stepper(kernel_of(emit(derivation), Precision::double_));
    REQUIRE(stepper.prepare({}, 0.25) == LOBATTO_OK);
    const std::optional<DiscreteEnergy> energy = discrete_energy(stepper);
    REQUIRE(energy);
    std::vector<double> q = {0.5, 1}, p = {0.25, -0.5};
    const double first = (*energy)(q.data(), p.data());
    double H0 = 0, H1 = 0;
    REQUIRE(stepper.energy(0, q, p, H0) == LOBATTO_OK);
    for (int i = 0; i < 20; ++i) {
        std::vector<double> q1, p1, T;
        REQUIRE(stepper.tangent(0, q, p, q1, p1, T) == LOBATTO_OK);
        if (i == 0) {  // its differences between states are h times those of the energy, nearly
            REQUIRE(stepper.energy(0, {q[0] + 0.1, q[1]}, {p[0], p[1] + 0.1}, H1) == LOBATTO_OK);
            const double moved[] = {q[0] + 0.1, q[1]}, pushed[] = {p[0], p[1] + 0.1};
            CHECK((*energy)(moved, pushed) - first == doctest::Approx(0.25 * (H1 - H0)).epsilon(0.02));
        }
        q = q1;
        p = p1;
        // Its terms have grown to some 1e4 when it ends; measured 2e-12.
        CHECK(std::fabs((*energy)(q.data(), p.data()) - first) < 1e-10);
    }
    LoadedStepper<double> nonlinear(pendulum());
    REQUIRE(nonlinear.prepare({1, 1}, 0.5) == LOBATTO_OK);
    CHECK(!discrete_energy(nonlinear));
}

TEST_CASE("coordinates coupled by velocities conserve their discrete energy too") {
    const Derivation derivation = derive(read_scene(
        Source("field.toml",
               "title = \"T\"\nlagrangian = \"(x'^2 + y'^2)/2 + (x*y' - y*x') - (x^2 + 2*y^2)/2\"\n[coordinates]\n"
               "x = { position = 1, velocity = 0 }\ny = { position = 0, velocity = 1 }\n[method]\nfamily = \"gauss\"\n"
               "stages = 2\n[run]\nstep = 0.3\nuntil = 3\n")));
    LoadedStepper<double> stepper(kernel_of(emit(derivation), Precision::double_));
    REQUIRE(stepper.prepare({}, 0.3) == LOBATTO_OK);
    const std::optional<DiscreteEnergy> energy = discrete_energy(stepper);
    REQUIRE(energy);
    std::vector<double> q = {1, 0.5}, p = {0.25, 1};
    const double first = (*energy)(q.data(), p.data());
    CHECK(std::fabs(first) > 0.1);
    for (int i = 0; i < 50; ++i) {
        std::vector<double> q1, p1, T;
        REQUIRE(stepper.tangent(0, q, p, q1, p1, T) == LOBATTO_OK);
        q = q1;
        p = p1;
        CHECK(std::fabs((*energy)(q.data(), p.data()) / first - 1) < 1e-13);
    }
}
