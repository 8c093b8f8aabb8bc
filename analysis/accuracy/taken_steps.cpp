// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/accuracy/taken_steps.hpp"

#include <algorithm>
#include <cmath>

#include "analysis/exact_start.hpp"
#include "generator/check/check.hpp"
#include "generator/mechanics/algebra/sample.hpp"
#include "runtime/error.hpp"
#include "runtime/run/ensemble/ensemble.hpp"

namespace lobatto {

namespace {

constexpr int steps_looked_at = 3;

// Exactly.
template <class real>
cln::cl_R exact(real value) {
    cln::cl_R sum = 0;
    for (int part = 0; part < 3; ++part) {
        const auto leading = static_cast<double>(value);
        sum = sum + cln::rational(cln::cl_R(leading));
        value -= static_cast<real>(leading);
    }
    return cln::cl_float(sum, cln::float_format(60));
}
template <class real>
std::vector<cln::cl_R> exact(const std::vector<real>& values) {
    std::vector<cln::cl_R> numbers;
    for (const real value : values) numbers.push_back(exact(value));
    return numbers;
}

[[noreturn]] void fail() {
    throw ComputationError("a step that the checks need failed; choose a smaller step");
}

// The positions of the last step at the control points.
template <class real>
std::vector<std::vector<cln::cl_R>> path_of(const Derivation& derivation, const LoadedStepper<real>& stepper,
                                            const std::vector<real>& start, const std::vector<real>& end) {
    std::vector<std::vector<cln::cl_R>> path = {exact(start)};
    const bool is_solved = derivation.structure.form() != StepForm::linear_map && !derivation.quadrature.is_explicit();
    Formulas formulas;
    const std::vector<cln::cl_R> control = formulas(derivation.quadrature.control);
    for (std::size_t j = 1; is_solved && j + 1 < control.size(); ++j) {
        std::vector<real> position, velocity;
        const auto place = number_of<real>(GiNaC::numeric(control[j]));
        if (stepper.dense(place, position, velocity) != LOBATTO_OK) fail();
        path.push_back(exact(position));
    }
    path.push_back(exact(end));
    return path;
}

template <class real>
cln::cl_R epsilon_of() {
    return cln::expt(cln::cl_RA(2), sizeof(real) == sizeof(double) ? -53 : -113);
}

}  // namespace

template <class real>
double trajectory_leaves(const Derivation& derivation, const Kernel& kernel, const std::vector<real>& parameters,
                         const std::vector<real>& q, const std::vector<real>& p, real step) {
    LoadedStepper<real> stepper(kernel);
    if (stepper.prepare(parameters, step) != LOBATTO_OK || stepper.start(real(0), q, p) != LOBATTO_OK) fail();
    std::vector<real> q0 = q, p0 = p;
    double worst = 0;
    for (int i = 0; i < steps_looked_at; ++i) {
        lobatto_advance call{};
        call.steps = 1;
        if (stepper.advance(call) != LOBATTO_OK) {
            if (i == 0) fail();
            break;
        }
        real time = 0;
        std::vector<real> q1, p1;
        stepper.state(time, q1, p1);
        const TakenStep taken{exact(parameters), exact(static_cast<real>(i) * step),
                              exact(step),       path_of(derivation, stepper, q0, q1),
                              exact(p0),         exact(p1),
                              epsilon_of<real>()};
        worst = std::fmax(worst, equations_left(derivation, taken));
        q0 = q1;
        p0 = p1;
    }
    return worst;
}

double lane_leaves(const Derivation& derivation, const Kernel& kernel, const Kernel& ensemble_kernel,
                   const std::vector<double>& parameters, const std::vector<double>& q, const std::vector<double>& p,
                   double step) {
    EnsembleRequest request;
    request.count = std::max(1, ensemble_kernel->lanes);
    request.start = [&](std::int64_t, EnsembleStart& start) {
        start.parameters = parameters;
        start.q = q;
        start.rate = p;
    };
    request.step = step;
    request.steps = steps_looked_at;
    request.every = 1;
    request.threads = 1;
    double worst = 0;
    request.sink = [&](const EnsembleTrajectory& trajectory) {
        if (trajectory.index != 0) return;
        if (trajectory.steps_done == 0) fail();
        const std::size_t n = q.size();
        LoadedStepper<double> stepper(kernel);
        if (stepper.prepare(parameters, step) != LOBATTO_OK) fail();
        for (int i = 0; i < trajectory.steps_done; ++i) {
            const auto row = [&](int number) {
                const double* const begin = trajectory.kept.rows + number * trajectory.kept.columns + 1;
                return std::pair{std::vector<double>(begin, begin + n), std::vector<double>(begin + n, begin + 2 * n)};
            };
            const auto [q0, p0] = row(i);
            const auto [q1, p1] = row(i + 1);
            lobatto_advance call{};
            call.steps = 1;
            if (stepper.start(i * step, q0, p0) != LOBATTO_OK || stepper.advance(call) != LOBATTO_OK) fail();
            const TakenStep taken{
                exact(parameters), exact(i * step), exact(step),         path_of(derivation, stepper, q0, q1),
                exact(p0),         exact(p1),       epsilon_of<double>()};
            worst = std::fmax(worst, equations_left(derivation, taken));
        }
    };
    integrate(ensemble_kernel, request);
    return worst;
}

double jacobian_defect(const Derivation& derivation, const Kernel& kernel, const std::vector<__float128>& parameters,
                       const std::vector<__float128>& q, const std::vector<__float128>& p, __float128 step) {
    using real = __float128;
    const auto N = static_cast<std::size_t>(kernel->unknowns);
    LoadedStepper<real> stepper(kernel);
    lobatto_advance call{};
    call.steps = 1;
    if (stepper.prepare(parameters, step) != LOBATTO_OK || stepper.start(real(0), q, p) != LOBATTO_OK ||
        stepper.advance(call) != LOBATTO_OK)
        fail();
    // Unknowns are positions, point by point, of the coordinates that are solved for, and after them multipliers.
    const bool is_general = derivation.structure.form() == StepForm::general;
    std::vector<int> solved_for;
    if (is_general) solved_for = derivation.structure.routhian().active;
    for (int k = 0; !is_general && k < derivation.system.n; ++k) solved_for.push_back(k);
    Formulas formulas;
    std::vector<cln::cl_R> places = formulas(is_general ? derivation.quadrature.control : derivation.quadrature.c);
    places.erase(places.begin());
    if (!is_general) places.pop_back();
    Noise noise(13);
    const auto random = [&] { return number_of<real>(GiNaC::numeric(noise.next())) / 100; };
    std::vector<real> X, direction, position, velocity;
    for (const cln::cl_R& place : places) {
        stepper.dense(number_of<real>(GiNaC::numeric(place)), position, velocity);
        for (const int k : solved_for) {
            const auto here = static_cast<std::size_t>(k);
            // What hardly moves, as near an equilibrium, is moved by more than its rounding.
            const auto size = [](real x) { return x < 0 ? -x : x; };
            const real moved = position[here] - q[here], least = real(0x1p-20) * size(position[here]);
            const real way = size(moved) > least ? moved : least > 0 ? least : step;
            X.push_back(position[here] + way * random());
            direction.push_back(way * random());
        }
        for (int c = 0; c < kernel->constraints; ++c) {  // the multipliers of the node before
            X.push_back(random());
            direction.push_back(random());
        }
    }
    while (X.size() < N) {
        X.push_back(real(0));
        direction.push_back(step * random());
    }
    constexpr double e = 1e-8;
    const auto moved = [&](real distance) {
        std::vector<real> at = X, F(N);
        for (std::size_t i = 0; i < N; ++i) at[i] += distance * direction[i];
        stepper.residual(real(0), q, p, at, F);
        return F;
    };
    const std::vector<real> after = moved(e), before = moved(-e);
    std::vector<real> J(N * N);
    stepper.jacobian(real(0), q, p, X, J);
    double largest = 0, defect = 0;
    for (std::size_t i = 0; i < N; ++i) {
        real product = 0;
        for (std::size_t j = 0; j < N; ++j) product += J[i * N + j] * direction[j];
        const auto difference = static_cast<double>(product - (after[i] - before[i]) / (2 * real(e)));
        largest = std::fmax(largest, std::fabs(static_cast<double>(product)));
        defect = std::isnan(difference) ? difference : std::fmax(defect, std::fabs(difference));
    }
    return largest > 0 ? defect / largest : defect;
}

template double trajectory_leaves(const Derivation&, const Kernel&, const std::vector<double>&,
                                  const std::vector<double>&, const std::vector<double>&, double);
template double trajectory_leaves(const Derivation&, const Kernel&, const std::vector<__float128>&,
                                  const std::vector<__float128>&, const std::vector<__float128>&, __float128);

}  // namespace lobatto
