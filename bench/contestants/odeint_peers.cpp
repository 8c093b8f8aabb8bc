// SPDX-License-Identifier: GPL-2.0-or-later
// Boost.odeint's steppers as contestants.
#include <boost/numeric/odeint.hpp>
#include <boost/numeric/odeint/stepper/symplectic_rkn_sb3a_m4_mclachlan.hpp>

#include "bench/contestants/contestant.hpp"

namespace lobatto::bench {

namespace {

namespace odeint = boost::numeric::odeint;

// `make`(tolerance) returns a controlled stepper.
template <class Type, class Make>
Contestant adaptive(const Problem& problem, const std::string& method, int order, const Make& make) {
    constexpr std::size_t size = 2 * Type::coordinates;
    const auto run = [until = problem.until, most_steps = problem.most_steps, make](
                         double tolerance, std::vector<Trajectory>& trajectories) {
        return one_by_one(trajectories, [&](Trajectory& trajectory) {
            std::array<double, size> y;
            join(trajectory, y.data());
            long evaluations = 0;
            const auto slope = [&](const auto& state, auto& derivative, double) {
                if (++evaluations > 20 * most_steps) throw odeint::no_progress_error("too many evaluations");
                Type::slope(state.data(), derivative.data());
            };
            auto stepper = make(tolerance);
            try {
                const std::size_t steps = odeint::integrate_adaptive(stepper, slope, y, 0.0, until, 0.1);
                split(y.data(), trajectory);
                return Effort{true, static_cast<long>(steps), evaluations};
            } catch (const odeint::odeint_error&) {  // it found no step for this tolerance
                return Effort{false, 0, evaluations};
            }
        });
    };
    return {method, order, false, false, Ladder::tolerance, run};
}

template <class Type>
Contestant mclachlan(const Problem& problem) {
    const auto run = [until = problem.until](double setting, std::vector<Trajectory>& trajectories) {
        return one_by_one(trajectories, [&](Trajectory& trajectory) {
            using Half = std::array<double, Type::coordinates>;
            std::pair<Half, Half> state;
            std::copy(trajectory.q.begin(), trajectory.q.end(), state.first.begin());
            std::copy(trajectory.p.begin(), trajectory.p.end(), state.second.begin());
            const auto acceleration = [](const Half& q, Half& a) { Type::acceleration(q.data(), a.data()); };
            odeint::symplectic_rkn_sb3a_m4_mclachlan<Half> stepper;
            const long steps = static_cast<long>(setting);
            const double h = until / setting;
            for (long i = 0; i < steps; ++i) stepper.do_step(acceleration, state, 0.0, h);
            std::copy(state.first.begin(), state.first.end(), trajectory.q.begin());
            std::copy(state.second.begin(), state.second.end(), trajectory.p.begin());
            return Effort{true, steps, 4 * steps};
        });
    };
    return {"odeint symplectic_rkn_sb3a_m4", 4, true, false, Ladder::steps, run};
}

}  // namespace

Contestants odeint_peers(const Problem& problem) {
    return with_type_of(problem, [&](auto type) {
        using Type = decltype(type);
        using Array = std::array<double, 2 * Type::coordinates>;
        Contestants all = {
            adaptive<Type>(problem, "odeint Bulirsch-Stoer", 0,
                           [](double tolerance) { return odeint::bulirsch_stoer<Array>(tolerance, tolerance); }),
            adaptive<Type>(problem, "odeint Runge-Kutta-Fehlberg 78", 8, [](double tolerance) {
                return odeint::make_controlled(tolerance, tolerance, odeint::runge_kutta_fehlberg78<Array>());
            })};
        if constexpr (Type::separable) all.push_back(mclachlan<Type>(problem));
        return all;
    });
}

}  // namespace lobatto::bench
