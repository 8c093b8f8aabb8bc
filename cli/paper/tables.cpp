// SPDX-License-Identifier: GPL-2.0-or-later
// The experiments of the paper's section 6, maxima over one period.
#include "cli/paper/tables.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "analysis/kernel/kernel_of.hpp"
#include "generator/paper/midpoint.hpp"
#include "generator/pipeline.hpp"
#include "library/parts.hpp"
#include "runtime/error.hpp"
#include "runtime/measure/diagnostics.hpp"
#include "runtime/measure/reference.hpp"

namespace lobatto {

namespace {

constexpr double omega = 2 * std::numbers::pi;
constexpr long double omega_squared = 4 * std::numbers::pi_v<long double> * std::numbers::pi_v<long double>;

std::string scene_text(PaperSystem system, int points) {
    const bool linear = system == PaperSystem::oscillator;
    return std::string("title = \"The paper's ") + (linear ? "oscillator" : "pendulum") +
           "\"\nlagrangian = \"m*q'^2/2 - " + (linear ? "m*omega^2*q^2/2" : "m*omega^2*(1 - cos(q))") +
           "\"\n[coordinates]\nq = { position = \"pi/2\", momentum = 0 }\n[parameters]\nm = 1\nomega = \"2*pi\"\n"
           "[method]\nfamily = \"lobatto\"\npoints = " +
           std::to_string(points) + "\n[run]\nstep = 0.1\nuntil = 1\n";
}

struct Errors {
    double p = 0, q = 0, H = 0;
};

void keep_largest(double& largest, long double error) {
    largest = std::max(largest, static_cast<double>(std::fabs(error)));
}

Errors largest_errors(PaperSystem system, const std::vector<PaperState>& states, long double energy_unit) {
    Errors largest;
    for (const PaperState& state : states) {
        const PaperState exact = exact_state(system, state.t);
        keep_largest(largest.p, state.p - exact.p);
        keep_largest(largest.q, state.q - exact.q);
        keep_largest(largest.H, (exact_energy(system, state) - exact_energy(system, states[0])) / energy_unit);
    }
    return largest;
}

double discrete_energy_error(int points, double step, const std::vector<PaperState>& states) {
    const auto H_d = discrete_energy_of(paper_kernel(PaperSystem::oscillator, points), step);
    double largest = 0;
    for (const PaperState& state : states) keep_largest(largest, H_d(state) - H_d(states[0]));
    return largest;
}

PaperTable table(PaperSystem system, std::string title, const int (&meshes)[3], std::vector<TableRow> rows,
                 long double energy_unit) {
    PaperTable result{std::move(title), {meshes[0], meshes[1], meshes[2]}, std::move(rows)};
    for (int k = 0; k < 3; ++k) {
        const double step = exact_period(system) / meshes[k];
        const auto fill = [&](double(TableRow::*column)[3], const std::vector<PaperState>& states) {
            const Errors errors = largest_errors(system, states, energy_unit);
            (result.rows[0].*column)[k] = errors.p;
            (result.rows[1].*column)[k] = errors.q;
            (result.rows[2].*column)[k] = errors.H;
            return states;
        };
        const auto lobatto = fill(&TableRow::lobatto, kernel_states(system, 4, step, meshes[k]));
        const auto simpson = fill(&TableRow::simpson, kernel_states(system, 3, step, meshes[k]));
        fill(&TableRow::midpoint, midpoint_states(system, step, meshes[k]));
        if (result.rows.size() < 4) continue;
        result.rows[3].lobatto[k] = discrete_energy_error(4, step, lobatto);
        result.rows[3].simpson[k] = discrete_energy_error(3, step, simpson);
        result.rows[3].midpoint[k] = result.rows[2].midpoint[k];  // the midpoint rule preserves H itself
    }
    return result;
}

// The step loop runs inside the kernel, in blocks of records.
template <class real>
void run_in(const Kernel& kernel, double step, long steps, const std::function<void(const PaperState&)>& observe) {
    LoadedStepper<real> stepper(kernel);
    const auto succeed = [](std::int32_t status) {
        if (status != LOBATTO_OK)
            throw ComputationError("paper: a step of the paper's own experiments failed, status " +
                                   std::to_string(status));
    };
    // pi in the kernel's arithmetic
    constexpr real pi = std::numbers::pi_v<real>;
    succeed(stepper.prepare({1, 2 * pi}, static_cast<real>(step)));
    succeed(stepper.start(0, {pi / 2}, {0}));
    observe({0, pi / 2, 0});
    if (kernel->two_fold_state != nullptr) {
        std::vector<real> q, q_rest, p, p_rest;  // m = 1: the velocity is the momentum
        for (long done = 1; done <= steps; ++done) {
            lobatto_advance call{};
            call.steps = 1;
            succeed(stepper.advance(call));
            stepper.two_fold_state(q, q_rest, p, p_rest);
            const auto sum = [](real value, real rest) { return static_cast<long double>(value) + rest; };
            observe({static_cast<long double>(step) * done, sum(q[0], q_rest[0]), sum(p[0], p_rest[0])});
        }
        return;
    }
    std::vector<real> records(3 * 1024);
    for (long done = 0; done < steps;) {
        lobatto_advance call{};
        call.steps = std::min(steps - done, 1024L);
        call.record_every = 1;
        call.records = records.data();
        call.capacity = 1024;
        succeed(stepper.advance(call));
        for (std::int64_t i = 0; i < call.records_written; ++i)
            observe({records[3 * i], records[3 * i + 1], records[3 * i + 2]});
        done += call.steps_done;
    }
}

}  // namespace

PaperState exact_state(PaperSystem system, long double time) {
    constexpr long double start = std::numbers::pi_v<long double> / 2;
    const PhasePoint point = system == PaperSystem::oscillator ? harmonic_solution(omega_squared, start, 0, time)
                                                               : pendulum_solution(omega_squared, start, 0, time);
    return {time, point.q, point.velocity};
}

long double exact_energy(PaperSystem system, const PaperState& state) {
    const long double potential = system == PaperSystem::oscillator ? state.q * state.q / 2 : 1 - std::cos(state.q);
    return state.p * state.p / 2 + omega_squared * potential;
}

double exact_period(PaperSystem system) {
    return system == PaperSystem::oscillator
               ? 1
               : static_cast<double>(pendulum_period(omega_squared, std::numbers::pi_v<long double> / 2));
}

Kernel paper_kernel(PaperSystem system, int points, Precision precision, StepArithmetic arithmetic) {
    Scene scene =
        api::Scene::from_text(scene_text(system, points),
                              system == PaperSystem::oscillator ? "paper_oscillator.toml" : "paper_pendulum.toml")
            .parts()
            .scene;
    scene.method.arithmetic = arithmetic;
    return kernel_of(emit(derive(scene), {.precision = precision, .support_text = {}}), precision);
}

std::function<long double(const PaperState&)> discrete_energy_of(const Kernel& kernel, double step) {
    LoadedStepper<double> stepper(kernel);
    if (stepper.prepare({1, omega}, step) != LOBATTO_OK)
        throw ComputationError("paper: the oscillator's kernel refuses this step");
    const auto H_d = discrete_energy(stepper);
    if (!H_d) throw ComputationError("paper: the oscillator's step has no discrete energy");
    const std::vector<double> form = H_d->form;
    return [form](const PaperState& state) {
        return form[0] * state.q * state.q + (static_cast<long double>(form[1]) + form[2]) * state.q * state.p +
               form[3] * state.p * state.p;
    };
}

void run_kernel(const Kernel& kernel, double step, long steps, const std::function<void(const PaperState&)>& observe) {
    kernel->real_kind == LOBATTO_LONG_DOUBLE ? run_in<long double>(kernel, step, steps, observe)
                                             : run_in<double>(kernel, step, steps, observe);
}

std::vector<PaperState> kernel_states(PaperSystem system, int points, double step, int steps) {
    std::vector<PaperState> states;
    run_kernel(paper_kernel(system, points), step, steps, [&](const PaperState& state) { states.push_back(state); });
    return states;
}

std::vector<PaperState> midpoint_states(PaperSystem system, double step, int steps) {
    const std::string potential = system == PaperSystem::oscillator ? "m*omega^2*q^2/2" : "m*omega^2*(1 - cos(q))";
    std::vector<PaperState> states;
    for (const auto& [q, p] : paper::Midpoint(potential, 1, omega, step).run({std::numbers::pi / 2, 0}, steps))
        states.push_back({static_cast<long double>(step) * static_cast<long double>(states.size()), q, p});
    return states;
}

double TableRow::order(double coarse, double fine) {
    return std::log2(coarse / fine);
}

bool TableRow::reproduced() const {
    for (int k = 0; k < 3; ++k) {
        const double tolerance = rounding ? 0 : printed[k] > 1e-12 ? 0.01 : 0.1;
        if (rounding ? lobatto[k] > 5e-14 : std::fabs(lobatto[k] / printed[k] - 1) > tolerance) return false;
    }
    return true;
}

bool PaperTable::reproduced() const {
    return std::all_of(rows.begin(), rows.end(), [](const TableRow& row) { return row.reproduced(); });
}

PaperTable table_1() {
    return table(PaperSystem::oscillator, "Table 1: harmonic oscillator, one period T = 1, maximum norm", {10, 20, 40},
                 {{"momentum p", {8.95248e-6, 1.39279e-7, 2.17034e-9}, {}, {}, {}},
                  {"state q", {7.64034e-7, 1.19368e-8, 1.87641e-10}, {}, {}, {}},
                  {"energy H", {0.0000661948, 1.09831e-6, 1.69917e-8}, {}, {}, {}},
                  {"discrete energy H_d", {2.66454e-15, 1.33227e-15, 2.22045e-15}, {}, {}, {}, true}},
                 1);
}

PaperTable table_2() {
    return table(PaperSystem::pendulum, "Table 2: nonlinear pendulum, one period, maximum norm, energy divided by mω²",
                 {50, 100, 200},
                 {{"momentum p", {2.83174e-9, 4.56684e-11, 7.0699e-13}, {}, {}, {}},
                  {"state q", {4.21838e-10, 6.69165e-12, 1.05693e-13}, {}, {}, {}},
                  {"energy H/(mω²)", {6.23384e-10, 1.02788e-11, 1.58925e-13}, {}, {}, {}}},
                 omega * omega);
}

}  // namespace lobatto
