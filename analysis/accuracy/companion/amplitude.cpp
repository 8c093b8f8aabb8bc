// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/accuracy/companion/amplitude.hpp"

#include <cmath>
#include <map>
#include <string>

namespace lobatto {

namespace {

constexpr double at_rest = 0x1p-40;  // of the place: what rounding moves it by
// Of the largest place of all: what is left of rounding where a constraint holds a coordinate at 0. Newton's iteration
// squares it each time; a motion that small beside others is none.
constexpr double held_at_zero = 0x1p-100;

}  // namespace

double beside(double start) {
    return start + 4 * (std::nextafter(start, HUGE_VAL) - start);
}

std::vector<int> amplitude_groups(const Scene& scene) {
    std::map<std::string, int> numbers;
    std::vector<int> groups;
    for (const Coordinate& coordinate : scene.coordinates) {
        const std::string array = coordinate.written.substr(0, coordinate.written.find('['));
        groups.push_back(numbers.try_emplace(array, static_cast<int>(numbers.size())).first->second);
    }
    return groups;
}

void widen_to(std::vector<double>& least, std::vector<double>& most, const double* row, std::size_t count) {
    if (least.empty()) least.assign(row, row + count), most = least;
    for (std::size_t i = 0; i < count; ++i) {
        least[i] = std::fmin(least[i], row[i]);
        most[i] = std::fmax(most[i], row[i]);
    }
}

std::vector<bool> moving(const std::vector<double>& least, const std::vector<double>& most) {
    const std::size_t n = least.size() / 2;
    const auto place = [&](std::size_t i) { return std::fmax(std::fabs(least[i]), std::fabs(most[i])); };
    double farthest[2] = {0, 0};  // of positions, of momenta
    for (std::size_t i = 0; i < 2 * n; ++i) farthest[i / n] = std::fmax(farthest[i / n], place(i));
    std::vector<bool> moves(2 * n);
    for (std::size_t i = 0; i < 2 * n; ++i) {
        const double half = (most[i] - least[i]) / 2;
        moves[i] = half > at_rest * place(i) && half > held_at_zero * farthest[i / n];
    }
    return moves;
}

std::vector<double> amplitudes_of(const std::vector<double>& least, const std::vector<double>& most,
                                  const std::vector<int>& groups) {
    const std::size_t n = groups.size();
    std::vector<double> own(2 * n), shared(2 * n, 0.0);
    const std::vector<bool> moves = moving(least, most);
    for (std::size_t i = 0; i < 2 * n; ++i) own[i] = moves[i] ? (most[i] - least[i]) / 2 : 0;
    for (std::size_t k = 0; k < n; ++k)
        if (own[k] == 0) own[n + k] = 0;  // what rests has the momentum that rounding gives it
    std::map<std::pair<bool, int>, double> largest;
    for (std::size_t i = 0; i < 2 * n; ++i) {
        double& of_group = largest[{i < n, groups[i % n]}];
        of_group = std::fmax(of_group, own[i]);
    }
    for (std::size_t i = 0; i < 2 * n; ++i) shared[i] = largest[{i < n, groups[i % n]}];
    return shared;
}

}  // namespace lobatto
