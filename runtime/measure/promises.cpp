// SPDX-License-Identifier: MIT
// What a symmetric variational integrator promises on a given motion: to run backwards, to keep energy errors bounded.
#include "runtime/measure/promises.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "runtime/error.hpp"
#include "runtime/measure/extent.hpp"
#include "runtime/run/trajectory.hpp"

namespace lobatto {

namespace {

template <class real>
real magnitude(real x) {
    return x < 0 ? -x : x;
}

template <class real>
double rounding_of() {
    return sizeof(real) == 8 ? std::ldexp(1.0, -53) : std::ldexp(1.0, -113);
}

template <class real>
std::vector<real> joined(std::vector<real> q, const std::vector<real>& p) {
    q.insert(q.end(), p.begin(), p.end());
    return q;
}

// The inverse of a matrix, row-major, by Gauss-Jordan elimination with the largest pivot of each column.
template <class real>
std::vector<real> inverse(std::vector<real> matrix, std::size_t rows) {
    std::vector<real> result(rows * rows, real(0));
    for (std::size_t i = 0; i < rows; ++i) result[i * rows + i] = 1;
    for (std::size_t k = 0; k < rows; ++k) {
        std::size_t pivot = k;
        for (std::size_t i = k + 1; i < rows; ++i)
            if (magnitude(matrix[i * rows + k]) > magnitude(matrix[pivot * rows + k])) pivot = i;
        for (std::size_t j = 0; j < rows; ++j) {
            std::swap(matrix[k * rows + j], matrix[pivot * rows + j]);
            std::swap(result[k * rows + j], result[pivot * rows + j]);
        }
        const real divisor = matrix[k * rows + k];
        for (std::size_t j = 0; j < rows; ++j) {
            matrix[k * rows + j] /= divisor;
            result[k * rows + j] /= divisor;
        }
        for (std::size_t i = 0; i < rows; ++i) {
            const real factor = matrix[i * rows + k];
            if (i == k || factor == real(0)) continue;
            for (std::size_t j = 0; j < rows; ++j) {
                matrix[i * rows + j] -= factor * matrix[k * rows + j];
                result[i * rows + j] -= factor * result[k * rows + j];
            }
        }
    }
    return result;
}

template <class real>
std::vector<real> product_of(const std::vector<real>& A, const std::vector<real>& B, std::size_t rows) {
    std::vector<real> product(rows * rows, real(0));
    for (std::size_t i = 0; i < rows; ++i)
        for (std::size_t k = 0; k < rows; ++k)
            for (std::size_t j = 0; j < rows; ++j) product[i * rows + j] += A[i * rows + k] * B[k * rows + j];
    return product;
}

}  // namespace

template <class real>
Return there_and_back(const Kernel& kernel, const std::vector<real>& parameters, const std::vector<real>& q,
                      const std::vector<real>& p, real step, std::int64_t steps, bool symplectic) {
    LoadedStepper<real> stepper(kernel);
    const std::size_t n = q.size(), rows = 2 * n;
    const std::vector<real> start = joined(q, p);
    std::vector<real> position = q, momentum = p, q1, p1, T;
    Extent<real> extent(n);
    if (stepper.prepare(parameters, step) != LOBATTO_OK)
        throw ComputationError("the motion cannot be reversed: the kernel refuses the scene's values");
    // What the way back from each state makes of a disturbance there: the inverse of the flow's derivative F, for a
    // symplectic one -J F^T J.
    std::vector<std::vector<real>> returns;
    Return result;
    std::vector<real> flow(rows * rows, real(0));
    for (std::size_t i = 0; i < rows; ++i) flow[i * rows + i] = 1;
    for (; result.steps < steps; ++result.steps) {
        if (stepper.tangent(step * real(result.steps), position, momentum, q1, p1, T) != LOBATTO_OK) break;
        position = q1;
        momentum = p1;
        if (symplectic) {
            flow = product_of(T, flow, rows);
            std::vector<real> back(rows * rows);
            for (std::size_t i = 0; i < rows; ++i)
                for (std::size_t j = 0; j < rows; ++j)
                    back[i * rows + j] = flow[((j + n) % rows) * rows + (i + n) % rows];  // up to its sign
            returns.push_back(std::move(back));
        } else {
            flow = product_of(flow, inverse(T, rows), rows);
            returns.push_back(flow);
        }
        const std::vector<real> here = joined(position, momentum);
        for (std::size_t i = 0; i < rows; ++i) extent.take(i, start[i], here[i]);
    }
    if (result.steps == 0) throw ComputationError("the motion cannot be reversed: its first step fails");

    // The way there once more, this time as a run does it, with start values from the step before; then back.
    real time = 0;
    const auto travel = [&](real h) {
        lobatto_advance call{};
        call.steps = result.steps;
        if (stepper.prepare(parameters, h) != LOBATTO_OK || stepper.start(time, position, momentum) != LOBATTO_OK ||
            stepper.advance(call) != LOBATTO_OK)
            return false;
        stepper.state(time, position, momentum);
        return true;
    };
    position = q;
    momentum = p;
    if (!travel(step) || !travel(-step)) {
        result.distance = result.rounding = std::numeric_limits<double>::infinity();
        return result;
    }
    const std::vector<real> end = joined(position, momentum);
    const auto most_of = [n](const std::vector<real>& positions) {
        return *std::max_element(positions.begin(), positions.begin() + static_cast<std::ptrdiff_t>(n));
    };
    result.rests = most_of(extent.range) < real(1e-8) * most_of(extent.largest);
    // Rounding in component j, anywhere on the way, comes back to component i through these.
    for (const std::size_t block : {std::size_t(0), n}) {
        if (!extent.moves(block)) continue;
        real moved = 0, missed = 0, growth = 0;
        for (std::size_t i = block; i < block + n; ++i) {
            moved = std::max(moved, extent.range[i]);
            missed = std::max(missed, magnitude(end[i] - start[i]));
            growth = std::max(growth, extent.largest[i]);
            for (const std::vector<real>& back : returns)
                for (std::size_t j = 0; j < rows; ++j)
                    growth = std::max(growth, magnitude(back[i * rows + j]) * extent.largest[j]);
        }
        constexpr double roundings = 64;  // of a step, all the same way; measured: 0.8 on the linear oscillator, 53 on
                                          // 16 coordinates
        result.distance = std::max(result.distance, static_cast<double>(missed / moved));
        result.rounding =
            std::max(result.rounding, rounding_of<real>() * roundings * static_cast<double>(result.steps) *
                                          static_cast<double>(growth / moved));
    }
    return result;
}

template Return there_and_back(const Kernel&, const std::vector<double>&, const std::vector<double>&,
                               const std::vector<double>&, double, std::int64_t, bool);
template Return there_and_back(const Kernel&, const std::vector<__float128>&, const std::vector<__float128>&,
                               const std::vector<__float128>&, __float128, std::int64_t, bool);

namespace {

const char* const no_tangent_map = "the tangent map cannot be measured: the step from the start fails";

// Each component's size, q then p, and how far it is shifted to measure a slope.
struct Shifts {
    std::vector<__float128> sizes, shifts;
};

// A component's own size, and as its shift a part of what velocity and force move it in the step, or of itself where
// they hardly do. T is the tangent map of the step, which ends at `after`.
Shifts own_shifts(LoadedStepper<__float128>& stepper, const QuadrupleStart& start, double step,
                  const std::vector<__float128>& after, const std::vector<__float128>& T) {
    using real = __float128;
    const std::size_t n = start.q.size(), rows = 2 * n;
    const std::vector<real> before = joined(start.q, start.p);
    std::vector<real> velocity, p_of_v, force;
    if (stepper.velocity(0, start.q, start.p, velocity) != LOBATTO_OK) throw ComputationError(no_tangent_map);
    stepper.slopes(0, start.q, velocity, p_of_v, force);
    const real h = step;
    Shifts result{std::vector<real>(rows), std::vector<real>(rows)};
    auto& [sizes, shifts] = result;
    std::vector<real> pace(rows);
    for (std::size_t i = 0; i < rows; ++i) {
        pace[i] = magnitude(h * (i < n ? velocity[i] : force[i - n]));
        const real moved = i < n ? std::max(pace[i], magnitude(after[i] - before[i])) : pace[i];
        sizes[i] = std::max(magnitude(before[i]), magnitude(after[i]));
        shifts[i] = std::max(real(1e-6) * moved, real(1e-14) * magnitude(before[i]));
    }
    // A component that only rounding or the error of the step moves from 0, as the radial momentum of a circular orbit,
    // has the size that a part of another would give it.
    const std::vector<real> own = sizes;
    for (std::size_t i = 0; i < rows; ++i) {
        real given = 0;
        for (std::size_t j = 0; j < rows; ++j) given = std::max(given, magnitude(T[i * rows + j]) * own[j]);
        const bool begins_at_rest = magnitude(before[i]) < real(1e-6) * own[i] && pace[i] < real(1e-6) * own[i];
        if (own[i] < (begins_at_rest ? real(1) : real(1e-12)) * given) {
            sizes[i] = given;
            shifts[i] = std::max(shifts[i], real(1e-14) * given);
        }
    }
    return result;
}

// Components that rest have the size, and a shift, that the others of their block give them, or those of the other
// block.
void shift_resting(Shifts& of, const std::vector<__float128>& T) {
    using real = __float128;
    auto& [sizes, shifts] = of;
    const std::size_t rows = sizes.size(), n = rows / 2;
    // The unit of momenta in which the blocks dq1/dp and dp1/dq are of one size.
    real to_q = 0, to_p = 0;
    for (std::size_t i = 0; i < n; ++i)
        for (std::size_t j = n; j < rows; ++j) {
            to_q = std::max(to_q, magnitude(T[i * rows + j]));
            to_p = std::max(to_p, magnitude(T[j * rows + i]));
        }
    const real unit = to_q > 0 && to_p > 0
                          ? static_cast<real>(std::sqrt(static_cast<double>(to_p) / static_cast<double>(to_q)))
                          : real(0);
    const auto most = [&](const std::vector<real>& values, std::size_t block) {
        return *std::max_element(values.begin() + static_cast<std::ptrdiff_t>(block),
                                 values.begin() + static_cast<std::ptrdiff_t>(block + n));
    };
    const std::array<real, 2> ordinary = {unit > 0 ? most(sizes, n) / unit : real(0), most(sizes, 0) * unit};
    for (const std::size_t block : {std::size_t(0), n}) {
        // A block that rests, to rounding, has the size that the other one gives it.
        const real other = ordinary[block / n];
        if (most(sizes, block) < real(1e-20) * other)
            for (std::size_t i = block; i < block + n; ++i) sizes[i] = other, shifts[i] = real(1e-14) * other;
        // For a component that rests at zero, also where all of them do.
        const real alone = block == n && unit > 0 ? unit : real(1),
                   most_size = most(sizes, block) > 0 ? most(sizes, block) : alone,
                   most_shift = std::min(most(shifts, block) > 0 ? most(shifts, block) : alone, real(1e-6) * most_size);
        for (std::size_t i = block; i < block + n; ++i) {
            if (sizes[i] > real(1e-20) * most_size) {  // less is the rounding of what moves the others
                shifts[i] = std::max(shifts[i], real(1e-14) * sizes[i]);
            } else {
                sizes[i] = most_size;
                shifts[i] = std::max(shifts[i], real(1e-4) * most_shift);
            }
        }
    }
}

}  // namespace

double tangent_defect(const Kernel& kernel, const QuadrupleStart& start, double step) {
    using real = __float128;
    LoadedStepper<real> stepper(kernel);
    const std::size_t n = start.q.size(), rows = 2 * n;
    std::vector<real> q1, p1, T;
    if (stepper.prepare(start.parameters, step) != LOBATTO_OK ||
        stepper.tangent(0, start.q, start.p, q1, p1, T) != LOBATTO_OK)
        throw ComputationError(no_tangent_map);
    Shifts found = own_shifts(stepper, start, step, joined(q1, p1), T);
    shift_resting(found, T);
    const auto& [sizes, shifts] = found;
    // Of images: forces of large terms that cancel move what hardly moves, too.
    const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(n);
    const real roundings = 64 * rounding_of<real>();
    const std::array<real, 2> rounding = {roundings * *std::max_element(sizes.begin(), middle),
                                          roundings * *std::max_element(middle, sizes.end())};
    double defect = 0;
    for (std::size_t j = 0; j < rows; ++j) {
        const auto image = [&](real shift) {
            std::vector<real> q = start.q, p = start.p;
            (j < n ? q[j] : p[j - n]) += shift;
            lobatto_advance call{};
            call.steps = 1;
            if (stepper.start(0, q, p) != LOBATTO_OK || stepper.advance(call) != LOBATTO_OK)
                throw ComputationError(no_tangent_map);
            real time;
            stepper.state(time, q, p);
            return joined(q, p);
        };
        // The best of three shifts: truncation spoils the first where the motion is violent, rounding the last.
        real best = -1;
        for (const real e : {30 * shifts[j], shifts[j], shifts[j] / 1000}) {
            const std::vector<real> f1 = image(e), b1 = image(-e), f2 = image(2 * e), b2 = image(-2 * e);
            real largest = 0, difference = 0;
            for (std::size_t i = 0; i < rows; ++i) {
                const real slope = (8 * (f1[i] - b1[i]) - (f2[i] - b2[i])) / (12 * e);
                const real apart = magnitude(T[i * rows + j] - slope) - rounding[i / n] / e;
                largest = std::max(largest, magnitude(T[i * rows + j]) / sizes[i]);
                difference = std::max(difference, apart / sizes[i]);
            }
            if (best < 0 || difference / largest < best) best = difference / largest;
        }
        defect = std::max(defect, static_cast<double>(best));
    }
    return defect;
}

double energy_defect(const Kernel& kernel, const Kernel& exact_kernel, const std::vector<double>& parameters,
                     double step, const std::vector<std::pair<std::vector<double>, std::vector<double>>>& states) {
    using real = __float128;
    LoadedStepper<double> stepper(kernel);
    LoadedStepper<real> exact(exact_kernel);
    if (stepper.prepare(parameters, step) != LOBATTO_OK ||
        exact.prepare({parameters.begin(), parameters.end()}, step) != LOBATTO_OK)
        throw ComputationError("the energy cannot be compared: a kernel refuses the scene's values");
    constexpr double least = 1e-300;  // what is less has lost digits in a double
    real difference = 0, largest = 0;
    bool is_compared = false;
    for (const auto& [position, momentum] : states) {
        const std::vector<real> q(position.begin(), position.end()), p(momentum.begin(), momentum.end());
        real H = 0;
        double H_double = 0;
        std::vector<real> velocity;
        if (exact.energy(0, q, p, H) != LOBATTO_OK || exact.velocity(0, q, p, velocity) != LOBATTO_OK ||
            stepper.energy(0, position, momentum, H_double) != LOBATTO_OK)
            throw ComputationError("the energy cannot be compared: a kernel refuses a state");
        real kinetic = 0;
        for (std::size_t k = 0; k < q.size(); ++k) kinetic += p[k] * velocity[k] / 2;
        const real size = magnitude(kinetic) + magnitude(H - kinetic), apart = magnitude(real(H_double) - H);
        if (size > real(std::numeric_limits<double>::max()) / 4) continue;
        is_compared = true;
        if (apart > least) difference = std::max(difference, apart);
        largest = std::max(largest, size);
    }
    if (!is_compared) return std::nan("");
    return difference > 0 ? static_cast<double>(difference / largest) : 0.0;
}

EnergyDrift energy_drift(const Kernel& kernel, const std::vector<double>& parameters, const std::vector<double>& q,
                         const std::vector<double>& p, double step, std::int64_t steps) {
    const std::size_t n = q.size();
    std::vector<double> energies;
    std::vector<std::vector<double>> motion;
    std::vector<double> velocity, ignored, slope;
    std::vector<double> kinetic_energies;
    double energy_size = 0;
    LoadedStepper<double> stepper(kernel);
    if (stepper.prepare(parameters, step) != LOBATTO_OK)
        throw ComputationError("the energy cannot be followed: the kernel refuses the scene's values");
    TrajectoryRequest request;
    request.parameters = parameters;
    request.q = q;
    request.p = p;
    request.step = step;
    request.steps = steps;
    request.sink = [&](const Records& records) {
        for (std::int64_t i = 0; i < records.count; ++i) {
            const double* const row = records.rows + i * records.columns + 1;
            energies.push_back(records.energy[i]);
            motion.emplace_back(row, row + n);
            const std::vector<double> momentum(row + n, row + 2 * n);
            if (stepper.velocity(row[-1], motion.back(), momentum, velocity) != LOBATTO_OK)
                throw ComputationError(
                    "the energy cannot be followed: on the way a momentum has no velocity; try a smaller step");
            double kinetic = 0;
            for (std::size_t k = 0; k < n; ++k) kinetic += std::fabs(momentum[k] * velocity[k]) / 2;
            double sizes = kinetic + std::fabs(records.energy[i] - kinetic);
            // Rounding of q_k costs V its slope times that: sum |q_k dV/dq_k|.
            stepper.slopes(row[-1], motion.back(), velocity, ignored, slope);
            for (std::size_t k = 0; k < n; ++k) sizes += std::fabs(row[k] * slope[k]);
            energy_size = std::max(energy_size, sizes);
            kinetic_energies.push_back(kinetic);
        }
    };
    const TrajectoryResult run = integrate(kernel, request);
    EnergyDrift result;
    result.steps = run.steps_done;
    const std::size_t half = energies.size() / 2;
    if (half == 0) throw ComputationError("the energy cannot be followed: the first step fails");
    std::vector<double> reach(2, 0.0), mean(2, 0.0), moving(2, 0.0);
    for (std::size_t i = 0; i < 2 * half; ++i) {
        const std::size_t part = i < half ? 0 : 1;
        moving[part] = std::max(moving[part], kinetic_energies[i]);
        mean[part] += (energies[i] - energies[0]) / static_cast<double>(half);
        for (std::size_t k = 0; k < n; ++k) reach[part] = std::max(reach[part], std::fabs(motion[i][k] - q[k]));
    }
    const auto [least, most] = std::minmax_element(energies.begin(), energies.end());
    result.swing = *most - *least;
    result.drift = std::fabs(mean[1] - mean[0]);
    // Rounding of the energy itself, and of the steps: a periodic motion repeats it, so that it adds up.
    result.rounding = rounding_of<double>() * energy_size * (8 + static_cast<double>(result.steps) / 4);
    // Four times as far: a fall; farther, and faster: an escape in a rotating frame.
    result.bounded = reach[1] <= 3 * reach[0] && !(reach[1] > 1.5 * reach[0] && moving[1] > 1.5 * moving[0]);
    // The same run from a start disturbed by 1e-12 of the region: how far it is from this one in the last tenth.
    constexpr double disturbance = 1e-12, most_growth = 1e7;
    const double region = std::max(reach[0], reach[1]);
    double apart = 0;
    std::size_t state = 0;
    request.q[0] += disturbance * region;
    request.sink = [&](const Records& records) {
        for (std::int64_t i = 0; i < records.count && state < motion.size(); ++i, ++state) {
            const double* const row = records.rows + i * records.columns + 1;
            if (10 * state < 9 * motion.size()) continue;
            for (std::size_t k = 0; k < n; ++k) apart = std::max(apart, std::fabs(row[k] - motion[state][k]));
        }
    };
    integrate(kernel, request);
    result.chaotic = apart > most_growth * disturbance * region;
    return result;
}

}  // namespace lobatto
