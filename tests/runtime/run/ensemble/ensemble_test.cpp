// SPDX-License-Identifier: GPL-2.0-or-later
// Ensembles: the same bits for any number of threads, each trajectory what it is alone, failures that stop alone.
#include "runtime/run/ensemble/ensemble.hpp"

#include <doctest/doctest.h>

#include <atomic>
#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>

#include "runtime/error.hpp"
#include "runtime/run/trajectory.hpp"
#include "tests/support.hpp"

using namespace lobatto;

namespace {

const char* const includes =
    "#include \"tests/handwritten/pendulum.hpp\"\n#include \"runtime/kernel/export/export.hpp\"\n"
    "using K = lobatto::HandwrittenPendulum;\n";

// Four lanes made of four steppers, so that a lane must give the bits of a stepper; what the contract of abi.h
// asks for is checked by the lanes themselves: a violation makes every energy infinite.
const char* const four_lanes = R"(
using E = lobatto::Export<K>;
struct Ensemble { alignas(64) unsigned char memory[4][(sizeof(E::S) + 63) / 64 * 64]; bool misused; };
void* lane(void* ensemble, int l) { return static_cast<Ensemble*>(ensemble)->memory[l]; }
const double* at(const void* numbers, int i) { return static_cast<const double*>(numbers) + i; }
double* at(void* numbers, int i) { return static_cast<double*>(numbers) + i; }
void prepare(void* ensemble, const void* parameters, const void* step, int32_t* status) {
    static_cast<Ensemble*>(ensemble)->misused = reinterpret_cast<std::uintptr_t>(ensemble) % 64 != 0;
    for (int l = 0; l < 4; ++l) status[l] = E::prepare(lane(ensemble, l), at(parameters, 2 * l), step);
}
void start(void* ensemble, const void* time, const void* q, const void* p, int32_t* status) {
    for (int l = 0; l < 4; ++l)
        if (status[l] == LOBATTO_OK) status[l] = E::start(lane(ensemble, l), time, at(q, l), at(p, l));
}
void advance(void* ensemble, int64_t steps, double, int32_t* status, int64_t* steps_done, int64_t* iterations) {
    if (steps < 1) static_cast<Ensemble*>(ensemble)->misused = true;
    for (int l = 0; l < 4; ++l) {
        lobatto_advance call{};
        call.steps = steps;
        call.steps_done = call.iterations = 12345;  // nothing, for a lane that is left alone
        if (status[l] == LOBATTO_OK) status[l] = E::advance(lane(ensemble, l), &call);
        steps_done[l] = call.steps_done;
        iterations[l] = call.iterations;
    }
}
void state(const void* ensemble, void* q, void* p) {
    double time = 0;
    for (int l = 0; l < 4; ++l) E::state(lane(const_cast<void*>(ensemble), l), &time, at(q, l), at(p, l));
}
void energy(const void* ensemble, void* energy) {
    for (int l = 0; l < 4; ++l) {
        double time = 0, q = 0, p = 0;
        E::state(lane(const_cast<void*>(ensemble), l), &time, &q, &p);
        E::energy(lane(const_cast<void*>(ensemble), l), &time, &q, &p, at(energy, l));
        if (static_cast<const Ensemble*>(ensemble)->misused) *at(energy, l) = 1.0 / 0.0;
    }
}
extern "C" __attribute__((visibility("default"))) const lobatto_kernel* lobatto_kernel_table(void) {
    static const lobatto_kernel table = [] {
        lobatto_kernel t = E::table;
        t.lanes = 4;
        t.ensemble_bytes = sizeof(Ensemble);
        t.ensemble_alignment = 64;
        t.ensemble_prepare = prepare;
        t.ensemble_start = start;
        t.ensemble_advance = advance;
        t.ensemble_state = state;
        t.ensemble_energy = energy;
        return t;
    }();
    return &table;
}
)";

Kernel compiled(const std::string& name, const std::string& text) {
    static const test::TemporaryFolder folder;
    const test::EnvironmentVariable cache("LOBATTO_CACHE_DIR", folder.string()), headers("CPATH", LOBATTO_SOURCE_DIR);
    return Kernel::load(compile({name, includes + text}).object, "0123456789abcdef");
}

// As the generator makes it.
const Kernel& pendulum() {
    static const Kernel kernel = compiled("pendulum", "LOBATTO_EXPORT_KERNEL(K)\n");
    return kernel;
}
// One trajectory at a time, whatever kernels have.
const Kernel& pendulum_alone() {
    static const Kernel kernel =
        compiled("pendulum_alone",
                 "extern \"C\" __attribute__((visibility(\"default\"))) const lobatto_kernel* "
                 "lobatto_kernel_table(void) {\n    static const lobatto_kernel table = [] { lobatto_kernel t = "
                 "lobatto::Export<K>::table; t.lanes = 0; return t; }();\n    return &table;\n}\n");
    return kernel;
}
const Kernel& pendulum_in_four_lanes() {
    static const Kernel kernel = compiled("pendulum_in_four_lanes", four_lanes);
    return kernel;
}

// How far a trajectory of the kernel may be from the one that runs alone, relative to its size. Lanes may round in
// another order; in the 1000 steps of `some` an error of the start grows up to 200 times (measured), so that 1000
// roundings of 1e-16 make some 6e-13.
double tolerance(const Kernel& kernel) {
    return kernel->lanes == 0 ? 0 : 1e-11;
}

struct Kept {
    std::int64_t index, steps_done;
    lobatto_status status;
    std::vector<double> rows, energies;
    double energy_start, energy_error_final, energy_error_largest;
    bool operator==(const Kept&) const = default;
};

struct Outcome {
    EnsembleResult result;
    std::vector<Kept> kept;
};

Outcome outcome(const Kernel& kernel, EnsembleRequest request) {
    Outcome outcome;
    request.sink = [&](const EnsembleTrajectory& t) {
        CHECK(t.kept.columns == 3);
        outcome.kept.push_back({t.index, t.steps_done, t.status,
                                std::vector<double>(t.kept.rows, t.kept.rows + t.kept.count * t.kept.columns),
                                std::vector<double>(t.kept.energy, t.kept.energy + t.kept.count), t.energy_start,
                                t.energy_error_final, t.energy_error_largest});
    };
    outcome.result = integrate(kernel, request);
    return outcome;
}

// Pendulums of different lengths from different angles, some of them fast.
void some_start(std::int64_t index, EnsembleStart& start) {
    const auto i = static_cast<double>(index);
    start.parameters = {1 + i / 7, 1 + 0.01 * i};
    start.q = {std::sin(i) * 3};
    start.rate = {0.3 * i};
}

EnsembleRequest some(std::int64_t count, std::int64_t every = 0) {
    EnsembleRequest request;
    request.count = count;
    request.start = some_start;
    request.step = 0.125;
    request.steps = 1000;
    request.every = every;
    return request;
}

TrajectoryRequest alone(const EnsembleRequest& of, std::int64_t index) {
    EnsembleStart start;
    of.start(index, start);
    TrajectoryRequest request;
    request.parameters = start.parameters;
    request.q = start.q;
    request.p = start.rate;
    request.step = of.step;
    request.steps = of.steps;
    request.every = of.every;
    return request;
}

}  // namespace

TEST_CASE("an ensemble has the same bits for any number of threads, with and without lanes") {
    for (const Kernel* kernel : {&pendulum(), &pendulum_alone(), &pendulum_in_four_lanes()}) {
        for (const std::int64_t count : {0, 1, 2, 7, 8, 9, 17, 300}) {
            for (const std::int64_t every : {0, 300}) {
                EnsembleRequest request = some(count, every);
                request.threads = 1;
                const Outcome one = outcome(*kernel, request);
                CHECK(one.result.trajectories == count);
                REQUIRE(std::ssize(one.kept) == count);
                for (std::int64_t i = 0; i < count; ++i) CHECK(one.kept[static_cast<std::size_t>(i)].index == i);
                CHECK(one.result.steps_done == 1000 * count);
                for (const int threads : {2, 3, 0}) {
                    request.threads = threads;
                    const Outcome more = outcome(*kernel, request);
                    CHECK(more.kept == one.kept);
                    CHECK(more.result.count_of == one.result.count_of);
                    CHECK(more.result.iterations == one.result.iterations);
                }
            }
        }
    }
}

TEST_CASE("a trajectory of an ensemble is the trajectory that runs alone") {
    for (const std::int64_t every : {0, 1, 300}) {
        const EnsembleRequest request = some(9, every);
        const Outcome together = outcome(pendulum(), request);
        const Outcome lanes = outcome(pendulum_in_four_lanes(), request);
        for (const Kept& kept : together.kept) {
            TrajectoryRequest run = alone(request, kept.index);
            if (every == 0) run.every = request.steps;
            std::vector<double> rows, energies;
            run.sink = [&](const Records& records) {
                rows.insert(rows.end(), records.rows, records.rows + records.count * records.columns);
                energies.insert(energies.end(), records.energy, records.energy + records.count);
            };
            const TrajectoryResult result = integrate(pendulum_alone(), run);
            if (every == 0) {  // the last state alone
                rows.erase(rows.begin(), rows.begin() + 3);
                energies.erase(energies.begin());
            }
            REQUIRE(kept.rows.size() == rows.size());
            REQUIRE(kept.energies.size() == energies.size());
            const auto near = [&](double a, double b) {
                return a == b || std::fabs(a - b) <= tolerance(pendulum()) * (1 + std::fabs(b));
            };
            for (std::size_t i = 0; i < rows.size(); ++i) CHECK(near(kept.rows[i], rows[i]));
            for (std::size_t i = 0; i < energies.size(); ++i) CHECK(near(kept.energies[i], energies[i]));
            CHECK(near(kept.energy_error_final, result.energy_error_final));
            CHECK(near(kept.energy_error_largest, result.energy_error_largest));
            CHECK(kept.steps_done == result.steps_done);
            CHECK(lanes.kept[static_cast<std::size_t>(kept.index)].rows == rows);
        }
    }
}

TEST_CASE("kept are the start, every k-th state and the last one") {
    for (const Kernel* kernel : {&pendulum(), &pendulum_in_four_lanes()}) {
        const auto times = [&](std::int64_t steps, std::int64_t every) {
            EnsembleRequest request = some(6, every);
            request.steps = steps;
            const Outcome done = outcome(*kernel, request);
            std::vector<double> first;
            for (const Kept& kept : done.kept) {
                std::vector<double> t;
                for (std::size_t i = 0; i < kept.rows.size(); i += 3) t.push_back(kept.rows[i]);
                if (kept.index == 0) first = t;
                CHECK(t == first);
            }
            return first;
        };
        using Times = std::vector<double>;
        CHECK(times(0, 0) == Times{0});
        CHECK(times(0, 1) == Times{0});
        CHECK(times(4, 0) == Times{0.5});
        CHECK(times(4, 2) == Times{0, 0.25, 0.5});
        CHECK(times(5, 2) == Times{0, 0.25, 0.5, 0.625});
        CHECK(times(2, 1000) == Times{0, 0.25});
        const Times many = times(3000, 2);  // several chunks of steps
        REQUIRE(many.size() == 1501);
        for (std::size_t i = 0; i < many.size(); ++i) CHECK(many[i] == 0.25 * static_cast<double>(i));
    }
}

TEST_CASE("a trajectory that fails stops alone, at its own step, with its own reason") {
    for (const Kernel* kernel : {&pendulum(), &pendulum_alone(), &pendulum_in_four_lanes()}) {
        for (const std::int64_t every : {0, 1, 7}) {
            EnsembleRequest request = some(13, every);
            const Outcome good = outcome(*kernel, request);
            request.start = [](std::int64_t index, EnsembleStart& start) {
                some_start(index, start);
                if (index == 2) start.parameters = {0, 1};  // no mass
                if (index == 5) start.q = {std::nan("")};
                if (index == 6) start.rate = {std::numeric_limits<double>::infinity()};
                if (index == 9) start = {{1, 300}, {2}, {0}};  // omega h = 38: an order beyond the stability bound
            };
            const Outcome done = outcome(*kernel, request);
            REQUIRE(done.kept.size() == 13);
            for (std::size_t i : {0u, 1u, 3u, 4u, 7u, 8u, 10u, 11u, 12u}) CHECK(done.kept[i] == good.kept[i]);
            CHECK(done.kept[2].status == LOBATTO_SINGULAR_MASS);
            CHECK(done.kept[5].status == LOBATTO_NOT_FINITE);
            CHECK(done.kept[6].status == LOBATTO_NOT_FINITE);
            for (std::size_t i : {2u, 5u, 6u}) {
                CHECK(done.kept[i].steps_done == 0);
                REQUIRE(done.kept[i].rows.size() == 3);  // the start that is impossible
                CHECK(done.kept[i].rows[0] == 0);
                CHECK(std::isnan(done.kept[i].energy_start));
                CHECK(std::isnan(done.kept[i].energy_error_largest));
            }
            const Kept& failed = done.kept[9];
            CHECK(failed.status == LOBATTO_NOT_CONVERGED);
            CHECK(failed.steps_done < 1000);
            TrajectoryRequest run = alone(request, 9);
            if (every == 0) run.every = run.steps;
            const TrajectoryResult result = integrate(pendulum_alone(), run);
            CHECK(result.status == failed.status);
            if (tolerance(*kernel) == 0 || kernel == &pendulum_in_four_lanes()) {
                CHECK(result.steps_done == failed.steps_done);
                CHECK(failed.rows[failed.rows.size() - 2] == result.q[0]);
                CHECK(failed.energy_error_final == result.energy_error_final);
            }
            CHECK(failed.rows[failed.rows.size() - 3] == 0.125 * static_cast<double>(failed.steps_done));
            if (every != 0)  // the last good state is kept once
                CHECK(std::ssize(failed.rows) / 3 ==
                      1 + failed.steps_done / every + (failed.steps_done % every == 0 ? 0 : 1));
            CHECK(done.result.count_of[LOBATTO_OK] == 9);
            CHECK(done.result.count_of[LOBATTO_NOT_FINITE] == 2);
            CHECK(done.result.count_of[LOBATTO_SINGULAR_MASS] == 1);
            CHECK(done.result.count_of[LOBATTO_NOT_CONVERGED] == 1);
        }
    }
}

TEST_CASE("momenta of velocities are those of each trajectory's own parameters") {
    EnsembleRequest request = some(6, 1000);
    request.from_velocities = true;
    request.start = [](std::int64_t index, EnsembleStart& start) {
        some_start(index, start);
        if (index == 4) start.parameters[0] = 0;
    };
    for (const Kernel* kernel : {&pendulum(), &pendulum_in_four_lanes()}) {
        const Outcome done = outcome(*kernel, request);
        for (const Kept& kept : done.kept) {
            if (kept.index == 4) {
                CHECK(kept.status == LOBATTO_SINGULAR_MASS);
                CHECK(kept.rows[1] == std::sin(4.0) * 3);
                CHECK(std::isnan(kept.rows[2]));
            } else {
                const auto i = static_cast<double>(kept.index);
                CHECK(kept.rows[2] == doctest::Approx((1 + i / 7) * 0.3 * i).epsilon(1e-15));  // p = m q'
            }
        }
    }
}

TEST_CASE("a range of an ensemble is that part of the whole, with its own numbers") {
    const EnsembleRequest whole = some(20, 40);
    const Outcome all = outcome(pendulum(), whole);
    EnsembleRequest part = whole;
    part.first = 7;
    part.count = 9;
    const Outcome some_of = outcome(pendulum(), part);
    CHECK(some_of.kept == std::vector<Kept>(all.kept.begin() + 7, all.kept.begin() + 16));
    CHECK(some_of.kept.front().index == 7);
}

TEST_CASE("an interruption keeps complete trajectories, in order") {
    for (const Kernel* kernel : {&pendulum(), &pendulum_in_four_lanes()}) {
        volatile int flag = 0;
        EnsembleRequest request = some(1000000);
        request.threads = 2;
        request.interrupted = &flag;
        std::int64_t told = 0, kept = 0;
        request.progress = [&](std::int64_t steps) {
            CHECK(steps >= told);
            told = steps;
            flag = 1;
        };
        request.sink = [&](const EnsembleTrajectory& trajectory) {
            CHECK(trajectory.index == kept++);
            CHECK(trajectory.steps_done == 1000);
        };
        const EnsembleResult result = integrate(*kernel, request);
        CHECK(result.interrupted);
        CHECK(told > 0);
        CHECK(result.trajectories == kept);
        CHECK(kept < 1000000);
        CHECK(kept > 0);

        request.steps = 1'000'000'000'000;  // not even one ends
        request.count = 3;
        flag = 0;
        told = kept = 0;
        CHECK(integrate(*kernel, request).interrupted);
        CHECK(kept == 0);
    }
}

TEST_CASE("what a sink or a start throws ends the ensemble and arrives") {
    EnsembleRequest request = some(1000000);
    request.threads = 3;
    request.sink = [](const EnsembleTrajectory& trajectory) {
        if (trajectory.index == 100) throw MachineError("the disk is full");
    };
    CHECK(test::message_of<MachineError>([&] { integrate(pendulum(), request); }) == "the disk is full");
    request.sink = nullptr;
    request.start = [](std::int64_t index, EnsembleStart& start) {
        some_start(index, start);
        if (index == 1000) throw std::out_of_range("no such start");
    };
    CHECK(test::message_of<std::out_of_range>([&] { integrate(pendulum(), request); }) == "no such start");
}

TEST_CASE("a slow sink holds the workers back: memory stays bounded") {
    EnsembleRequest request = some(100000);
    request.steps = 1;
    request.threads = 2;
    std::atomic<std::int64_t> begun{0};
    std::int64_t most_ahead = 0;
    request.start = [&](std::int64_t index, EnsembleStart& start) {
        ++begun;
        some_start(index, start);
    };
    request.sink = [&](const EnsembleTrajectory& trajectory) {
        most_ahead = std::max(most_ahead, begun - trajectory.index);
    };
    CHECK(integrate(pendulum(), request).trajectories == 100000);
    CHECK(most_ahead <= (2 * 2 + 2 + 1) * 64);  // the window, and the group that is being handed over
}

TEST_CASE("times are measured, of processors and of the clock") {
    EnsembleRequest request = some(64);
    request.steps = 20000;
    request.threads = 2;
    const EnsembleResult result = integrate(pendulum(), request);
    CHECK(result.threads == 2);
    CHECK(result.processor_seconds > 0.01);
    CHECK(result.processor_seconds < 2 * result.seconds + 0.1);
    CHECK(integrate(pendulum_in_four_lanes(), request).lanes == 4);
    CHECK(integrate(pendulum_alone(), request).lanes == 1);
}
