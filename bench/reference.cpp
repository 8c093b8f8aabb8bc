// SPDX-License-Identifier: GPL-2.0-or-later
#include "bench/reference.hpp"

#include "bench/peers/gauss.hpp"

namespace lobatto::bench {

namespace {

template <class real>
Trajectory end_of(const Problem& problem, const Trajectory& start, real tolerance) {
    return with_type_of(problem, [&](auto type) {
        using Type = decltype(type);
        const int n = Type::coordinates;
        State<real, n> state;
        for (int k = 0; k < n; ++k) state.q[k] = start.q[k], state.p[k] = start.p[k];
        integrate_gauss<12, Type>(state, real(problem.until) / problem.reference_steps, problem.reference_steps,
                                  tolerance);
        Trajectory end = start;
        for (int k = 0; k < n; ++k) {
            end.q[k] = static_cast<double>(state.q[k]);
            end.p[k] = static_cast<double>(state.p[k]);
        }
        return end;
    });
}

}  // namespace

Trajectory reference_end(const Problem& problem, const Trajectory& start) {
    return end_of<__float128>(problem, start, exact("1e-24"));
}

Trajectory quick_reference_end(const Problem& problem, const Trajectory& start) {
    return end_of<long double>(problem, start, rounding<long double>);
}

double energy_of(const Problem& problem, const Trajectory& state) {
    return with_type_of(problem, [&](auto type) { return decltype(type)::energy(state.q.data(), state.p.data()); });
}

}  // namespace lobatto::bench
