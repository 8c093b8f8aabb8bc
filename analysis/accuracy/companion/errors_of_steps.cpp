// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/accuracy/companion/errors_of_steps.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace lobatto {

namespace {

constexpr double at_rest = 0x1p-46;      // of the largest pace or amplitude of its kind: rounding
constexpr double last_digits = 0x1p-50;  // of a number
constexpr double noisy = 16;             // a pace below so many times what the last digits of others change
constexpr double slight_part = 0.01;     // of the largest amplitude of its kind
constexpr double slight_product = 1e-5;  // of amplitudes of position and momentum, which does not depend on units
constexpr double shrinks = 1.3;          // by as much with 2/3 of the step, at least: an error of steps

}  // namespace

std::vector<double> pace_at(LoadedStepper<double>& stepper, double step, const std::vector<double>& row) {
    const auto begin = row.begin() + 1, middle = begin + (std::ssize(row) - 1) / 2;
    const std::vector<double> q(begin, middle), p(middle, row.end());
    std::vector<double> pace, Lv, Lq;
    if (stepper.start(row[0], q, p) != LOBATTO_OK) return {};  // with a clock it knows its energy from then on
    if (stepper.velocity(row[0], q, p, pace) != LOBATTO_OK) return {};
    stepper.slopes(row[0], q, pace, Lv, Lq);
    pace.insert(pace.end(), Lq.begin(), Lq.end());
    for (double& one : pace) one *= step;
    return pace;
}

std::vector<bool> slight(const std::vector<double>& amplitudes) {
    const std::size_t n = amplitudes.size() / 2;
    double largest[2] = {0, 0}, product = 0;
    for (std::size_t i = 0; i < 2 * n; ++i) largest[i / n] = std::fmax(largest[i / n], amplitudes[i]);
    for (std::size_t k = 0; k < n; ++k) product = std::fmax(product, amplitudes[k] * amplitudes[n + k]);
    std::vector<bool> result(n);
    for (std::size_t k = 0; k < n; ++k)
        result[k] = amplitudes[k] < slight_part * largest[0] && amplitudes[n + k] < slight_part * largest[1] &&
                    amplitudes[k] * amplitudes[n + k] < slight_product * product;
    return result;
}

namespace {

// Whether coordinate k has no pace but rounding at a state: none, or one that is another where all other coordinates
// move by their last digits.
bool begins_at_rest(LoadedStepper<double>& stepper, double step, const std::vector<double>& row,
                    const std::vector<double>& pace, std::size_t k) {
    const std::size_t n = pace.size() / 2;
    if (pace[k] == 0 && pace[n + k] == 0) return true;
    double apart[2] = {0, 0};
    for (const double sign : {1.0, -1.0}) {
        std::vector<double> shaken = row;
        for (std::size_t i = 0; i < 2 * n; ++i)
            if (i % n != k) shaken[1 + i] *= 1 + (i % 2 == 0 ? sign : -sign) * last_digits;
        const std::vector<double> other = pace_at(stepper, step, shaken);
        if (other.empty()) return false;
        for (const std::size_t i : {k, n + k}) apart[i / n] = std::fmax(apart[i / n], std::fabs(other[i] - pace[i]));
    }
    return std::fabs(pace[k]) <= noisy * apart[0] && std::fabs(pace[n + k]) <= noisy * apart[1];
}

}  // namespace

std::vector<bool> rests_beside(LoadedStepper<double>& stepper, double step, const Rows& rows,
                               const std::vector<double>& amplitudes, const std::vector<bool>& asked) {
    const std::size_t n = asked.size();
    std::vector<bool> rests(n, false);
    const std::vector<double> first = rows.empty() ? std::vector<double>() : pace_at(stepper, step, rows.front());
    if (first.empty()) return rests;
    double largest[2] = {0, 0};
    for (std::size_t i = 0; i < 2 * n; ++i)
        largest[i / n] = std::fmax(largest[i / n], std::fmax(std::fabs(first[i]), amplitudes[i]));
    for (std::size_t k = 0; k < n; ++k) {
        rests[k] = asked[k] && std::fabs(first[k]) <= at_rest * largest[0] &&
                   std::fabs(first[n + k]) <= at_rest * largest[1] &&
                   begins_at_rest(stepper, step, rows.front(), first, k);
        for (std::size_t j = 1; j < rows.size() && rests[k]; ++j) {
            std::vector<double> row = rows[j];
            for (const std::size_t i : {k, n + k}) row[1 + i] = rows.front()[1 + i];
            const std::vector<double> pace = pace_at(stepper, step, row);
            rests[k] =
                !pace.empty() && std::fabs(pace[k]) < amplitudes[k] && std::fabs(pace[n + k]) < amplitudes[n + k];
        }
    }
    return rests;
}

void leave_out_errors_of_steps(std::vector<double>& amplitudes, const std::vector<double>& of_run,
                               const std::vector<double>& of_companion,
                               const std::function<std::vector<bool>(const std::vector<bool>& asked)>& rests) {
    const std::size_t n = amplitudes.size() / 2;
    std::vector<bool> asked = slight(amplitudes);
    for (std::size_t i = 0; i < 2 * n; ++i)
        asked[i % n] = asked[i % n] && amplitudes[i] > 0 && of_run[i] > shrinks * of_companion[i];
    if (std::none_of(asked.begin(), asked.end(), [](bool any) { return any; })) return;
    const std::vector<bool> resting = rests(asked);
    for (std::size_t k = 0; k < n; ++k)
        if (resting[k]) amplitudes[k] = amplitudes[n + k] = 0;
}

}  // namespace lobatto
