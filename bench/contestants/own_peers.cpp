// SPDX-License-Identifier: GPL-2.0-or-later
// Our own implementations of published methods, as contestants.
#include "bench/contestants/contestant.hpp"
#include "bench/peers/gauss.hpp"
#include "bench/peers/nystrom.hpp"
#include "bench/peers/radau.hpp"
#include "bench/peers/splitting.hpp"

namespace lobatto::bench {

namespace {

// `integrate`(state, h, steps) returns its evaluations, -1 when it failed.
template <class Type, class Integrate>
Contestant with_fixed_steps(const Problem& problem, const std::string& method, int order, const Integrate& integrate) {
    const auto run = [until = problem.until, integrate](double setting, std::vector<Trajectory>& trajectories) {
        return one_by_one(trajectories, [&](Trajectory& trajectory) {
            const long steps = static_cast<long>(setting);
            State<double, Type::coordinates> state;
            std::copy(trajectory.q.begin(), trajectory.q.end(), state.q.begin());
            std::copy(trajectory.p.begin(), trajectory.p.end(), state.p.begin());
            const long evaluations = integrate(state, until / setting, steps);
            std::copy(state.q.begin(), state.q.end(), trajectory.q.begin());
            std::copy(state.p.begin(), state.p.end(), trajectory.p.begin());
            return Effort{evaluations >= 0, steps, evaluations};
        });
    };
    return {method, order, true, false, Ladder::steps, run};
}

template <class Type, const auto& table>
Contestant splitting(const Problem& problem, const std::string& method) {
    return with_fixed_steps<Type>(problem, method, table.order, [](auto& state, double h, long steps) {
        return integrate_splitting<table, Type>(state, h, steps);
    });
}

template <class Type, int stages>
Contestant gauss(const Problem& problem) {
    const std::string method = "Gauss " + std::to_string(stages) + " stages, fixed point";
    return with_fixed_steps<Type>(problem, method, 2 * stages, [](auto& state, double h, long steps) {
        return integrate_gauss<stages, Type>(state, h, steps);
    });
}

// `integrate`(state, tolerance) returns its steps and evaluations.
template <class Type, class Integrate>
Contestant adaptive(const std::string& method, int order, const Integrate& integrate) {
    const auto run = [integrate](double setting, std::vector<Trajectory>& trajectories) {
        return one_by_one(trajectories, [&](Trajectory& trajectory) {
            State<double, Type::coordinates> state;
            std::copy(trajectory.q.begin(), trajectory.q.end(), state.q.begin());
            std::copy(trajectory.p.begin(), trajectory.p.end(), state.p.begin());
            const AdaptiveCount count = integrate(state, setting);
            std::copy(state.q.begin(), state.q.end(), trajectory.q.begin());
            std::copy(state.p.begin(), state.p.end(), trajectory.p.begin());
            return Effort{count.steps >= 0, count.steps, count.evaluations};
        });
    };
    return {method, order, false, false, Ladder::tolerance, run};
}

template <class Type>
Contestant nystrom(const Problem& problem) {
    return adaptive<Type>("Dormand-Prince Nystroem 12", 12, [until = problem.until](auto& state, double tolerance) {
        return integrate_nystrom<Type>(state, until, tolerance);
    });
}

template <class Type>
Contestant radau(const Problem& problem) {
    const auto integrate = [until = problem.until, most = problem.most_steps](auto& state, double tolerance) {
        return integrate_radau<Type>(state, until, tolerance, most);
    };
    Contestant contestant = adaptive<Type>("Gauss-Radau 15", 15, integrate);
    // The seventh root of it is the step; the paper recommends 1e-9, and beyond 1e-11 it asks for less than rounding.
    contestant.coarsest = 10;
    contestant.finest = 1e-11;
    return contestant;
}

}  // namespace

Contestants own_peers(const Problem& problem) {
    return with_type_of(problem, [&](auto type) -> Contestants {
        using Type = decltype(type);
        if constexpr (Type::separable) {
            return {nystrom<Type>(problem),
                    radau<Type>(problem),
                    splitting<Type, blanes_moan_14>(problem, "Blanes-Moan SRKN14a"),
                    splitting<Type, blanes_moan_11>(problem, "Blanes-Moan SRKN11b"),
                    splitting<Type, sofroniou_spaletta_10>(problem, "Sofroniou-Spaletta 35 stages"),
                    gauss<Type, 6>(problem),
                    gauss<Type, 8>(problem),
                    splitting<Type, kahan_li_8>(problem, "Kahan-Li 17 stages"),
                    splitting<Type, stoermer_verlet>(problem, "Stoermer-Verlet")};
        } else {
            return {gauss<Type, 6>(problem), gauss<Type, 8>(problem)};
        }
    });
}

}  // namespace lobatto::bench
