// SPDX-License-Identifier: GPL-2.0-or-later
// The GNU Scientific Library's Dormand-Prince 8(7) as a contestant.
#include <gsl/gsl_errno.h>
#include <gsl/gsl_odeiv2.h>

#include <memory>

#include "bench/contestants/contestant.hpp"

namespace lobatto::bench {

Contestants gsl_peers(const Problem& problem) {
    const auto run = [&problem](double tolerance, std::vector<Trajectory>& trajectories) {
        return with_type_of(problem, [&](auto type) {
            using Type = decltype(type);
            constexpr std::size_t size = 2 * Type::coordinates;
            long evaluations = 0;
            gsl_odeiv2_system system{[](double, const double* y, double* dy, void* count) {
                                         ++*static_cast<long*>(count);
                                         Type::slope(y, dy);
                                         return static_cast<int>(GSL_SUCCESS);
                                     },
                                     nullptr, size, &evaluations};
            const std::unique_ptr<gsl_odeiv2_driver, void (*)(gsl_odeiv2_driver*)> driver(
                gsl_odeiv2_driver_alloc_y_new(&system, gsl_odeiv2_step_rk8pd, 0.1, tolerance, tolerance),
                gsl_odeiv2_driver_free);
            gsl_odeiv2_driver_set_nmax(driver.get(), static_cast<unsigned long>(problem.most_steps));
            return one_by_one(trajectories, [&](Trajectory& trajectory) {
                std::array<double, size> y;
                join(trajectory, y.data());
                gsl_odeiv2_driver_reset_hstart(driver.get(), 0.1);
                double t = 0;
                evaluations = 0;
                const int status = gsl_odeiv2_driver_apply(driver.get(), &t, problem.until, y.data());
                split(y.data(), trajectory);
                return Effort{status == GSL_SUCCESS, static_cast<long>(driver->n), evaluations};
            });
        });
    };
    gsl_set_error_handler_off();
    return {{"GSL rk8pd", 8, false, false, Ladder::tolerance, run}};
}

}  // namespace lobatto::bench
