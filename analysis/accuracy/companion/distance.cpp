// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/accuracy/companion/distance.hpp"

#include <cmath>
#include <limits>

#include "runtime/run/parts.hpp"

namespace lobatto {

namespace {

constexpr double at_pericentre = 0.01, at_wall = 0.1;  // of an amplitude

}  // namespace

double momenta_alone(const Kernel& kernel) {
    return kernel->impacts > 0 ? at_wall : at_pericentre;
}

Distance distance_between(const double* run, const double* companion, std::size_t parts,
                          const std::vector<double>& amplitude, double of_run, double momenta_alone) {
    const std::size_t n = amplitude.size() / 2;
    Distance found;
    bool agree = true, any = false, is_number = true;  // agree, any: of positions
    for (std::size_t i = 0; i < 2 * n; ++i) {
        if (!(amplitude[i] > 0)) continue;
        const double difference_here = std::fabs(difference(run + i * parts, companion + i * parts, parts)),
                     apart = difference_here / amplitude[i];
        is_number = is_number && !std::isnan(apart);
        found.apart = std::fmax(found.apart, apart);
        if (i >= n) continue;
        any = true;
        agree = agree && apart < momenta_alone;
        if (!(of_run * apart > found.relative)) continue;
        found.relative = of_run * apart;
        found.coordinate = i;
        found.absolute = of_run * difference_here;
    }
    if (any && agree) found.apart = std::fmin(found.apart, momenta_alone);
    if (!is_number) found.apart = std::numeric_limits<double>::quiet_NaN();
    return found;
}

double error_of_run(double ratio, int order) {
    return 1 / (1 - std::pow(ratio, -order));
}

void move_beside(const Kernel& kernel, std::vector<double>& q) {
    const auto parts = static_cast<std::size_t>(kernel->parts);
    for (std::size_t k = 0; k < q.size(); k += parts) {
        if (q[k] == 0) continue;
        if (kernel->real_kind == LOBATTO_DOUBLE)
            q[k] += 4 * (std::nextafter(q[k], HUGE_VAL) - q[k]);
        else
            q[k + parts - 1] += 4 * kernel->epsilon * q[k];
    }
}

}  // namespace lobatto
