// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/accuracy/companion/at_rest.hpp"

#include <algorithm>
#include <cmath>

#include "analysis/accuracy/companion/amplitude.hpp"
#include "analysis/accuracy/formulas/constraint_sizes.hpp"

namespace lobatto {

namespace {

constexpr double nearby = 1e-6;  // of the place: an equilibrium that is unstable is left by more

// The numbers from `begin` on, n of them, stay within this part of where they begin, or of the farthest.
bool stays_within(double part, const std::vector<double>& start, const std::vector<double>& least,
                  const std::vector<double>& most, std::size_t begin) {
    const std::size_t n = start.size() / 2;
    double farthest = 0;
    for (std::size_t i = begin; i < begin + n; ++i) farthest = std::fmax(farthest, std::fabs(start[i]));
    for (std::size_t i = begin; i < begin + n; ++i)
        if (!(most[i] - least[i] <= part * (start[i] != 0 ? std::fabs(start[i]) : farthest))) return false;
    return true;
}

constexpr std::size_t most_linear = 24;  // coordinates whose steps are raised to a power
constexpr double of_start = 0x1p-50;     // a few roundings of the places: where nobody can tell them apart
constexpr double of_forces = 0x1p-46;    // of the terms of a force: what is less is its rounding

// a b, of matrices of size x size.
std::vector<double> product(const std::vector<double>& a, const std::vector<double>& b, std::size_t size) {
    std::vector<double> result(size * size, 0.0);
    for (std::size_t i = 0; i < size; ++i)
        for (std::size_t k = 0; k < size; ++k)
            if (const double value = a[i * size + k]; value != 0)
                for (std::size_t j = 0; j < size; ++j) result[i * size + j] += value * b[k * size + j];
    return result;
}

// d(q1, p1)/d(q, p), by differences where the kernel has none of its own. Empty: a step failed.
std::vector<double> tangent_at(const LoadedStepper<double>& stepper, double time, const std::vector<double>& q,
                               const std::vector<double>& p) {
    const std::size_t n = q.size();
    std::vector<double> T, q1, p1;
    if (stepper.kernel()->has_tangent != 0)
        return stepper.tangent(time, q, p, q1, p1, T) == LOBATTO_OK ? T : std::vector<double>();
    T.resize(4 * n * n);
    const auto largest = [](const std::vector<double>& all) {
        double size = 0;
        for (const double one : all) size = std::fmax(size, std::fabs(one));
        return size;
    };
    LoadedStepper<double> beside = stepper;
    for (std::size_t j = 0; j < 2 * n; ++j) {
        const double size = largest(j < n ? q : p), shift = 0x1p-18 * (size > 0 ? size : 1);
        for (const double side : {shift, -shift}) {
            std::vector<double> from_q = q, from_p = p;
            (j < n ? from_q[j] : from_p[j - n]) += side;
            lobatto_advance call{};
            call.steps = 1;
            double end = 0;
            if (beside.start(time, from_q, from_p) != LOBATTO_OK || beside.advance(call) != LOBATTO_OK) return {};
            beside.state(end, q1, p1);
            for (std::size_t i = 0; i < 2 * n; ++i) T[i * 2 * n + j] += (i < n ? q1[i] : p1[i - n]) / (2 * side);
        }
    }
    return T;
}

}  // namespace

bool is_held_by_rounding(const LoadedStepper<double>& stepper, double time, const std::vector<double>& q,
                         const std::vector<double>& p, double step, std::int64_t steps) {
    const std::size_t n = q.size(), size = 2 * n + 1;
    std::vector<double> velocity, momentum, force;
    if (n > most_linear || stepper.velocity(time, q, p, velocity) != LOBATTO_OK) return false;
    const std::vector<double> T = tangent_at(stepper, time, q, p);
    if (T.empty()) return false;
    stepper.slopes(time, q, velocity, momentum, force);
    // A step of what is beside the start, with what the forces add to it: one matrix, whose last column they are.
    std::vector<double> power(size * size, 0.0), state(size, 0.0);
    for (std::size_t i = 0; i < 2 * n; ++i) {
        double terms = 0;
        for (std::size_t j = 0; j < 2 * n; ++j) {
            power[i * size + j] = T[i * 2 * n + j];
            if (i >= n && j < n) terms += std::fabs(T[i * 2 * n + j] * q[j]);
        }
        if (i < n)
            state[i] = of_start * q[i];
        else if (const double change = step * force[i - n]; std::fabs(change) > of_forces * terms)
            power[i * size + 2 * n] = change;
    }
    power[size * size - 1] = state[2 * n] = 1;
    const double farthest = std::fabs(
        *std::max_element(q.begin(), q.end(), [](double a, double b) { return std::fabs(a) < std::fabs(b); }));
    for (; steps > 0; steps /= 2) {
        if (steps % 2 != 0) {
            std::vector<double> next(size, 0.0);
            for (std::size_t i = 0; i < size; ++i)
                for (std::size_t j = 0; j < size; ++j) next[i] += power[i * size + j] * state[j];
            state = next;
        }
        power = product(power, power, size);
    }
    for (std::size_t k = 0; k < n; ++k)
        if (!(std::fabs(state[k]) <= nearby * (q[k] != 0 ? std::fabs(q[k]) : farthest))) return true;
    return false;
}

// Momenta, too: positions far from 0 may be too coarse to move.
bool rests(const std::vector<double>& start, const std::vector<double>& least, const std::vector<double>& most,
           double epsilon) {
    return stays_within(few_roundings * epsilon, start, least, most, 0) &&
           stays_within(few_roundings * epsilon, start, least, most, start.size() / 2);
}

bool rests_beside_companion(const std::vector<double>& start, const std::vector<double>& least,
                            const std::vector<double>& most, const std::vector<double>& least_of_companion,
                            const std::vector<double>& most_of_companion, double epsilon) {
    return rests(start, least, most, epsilon) && stays_within(nearby, start, least_of_companion, most_of_companion, 0);
}

bool is_at_rest(const SystemOutline& system, const std::vector<std::vector<double>>& rows,
                const std::vector<double>& parameters, double epsilon) {
    if (rows.empty()) return false;
    std::vector<double> least, most, sizes;
    for (const std::vector<double>& row : rows) widen_to(least, most, row.data() + 1, row.size() - 1);
    if (system.constraints.empty())  // the start alone is no motion
        return rows.size() > 1 && rests({rows.front().begin() + 1, rows.front().end()}, least, most, epsilon);
    const ConstraintSizes constraints(system);
    for (const std::vector<double>& row : rows) constraints.widen(sizes, row[0], row.data() + 1, parameters);
    const std::vector<bool> moves = moving(least, most, places_of(least, most, sizes), rounding_of_run(epsilon));
    return std::none_of(moves.begin(), moves.begin() + std::ssize(moves) / 2, [](bool any) { return any; });
}

}  // namespace lobatto
