// SPDX-License-Identifier: GPL-2.0-or-later
#include "bench/reference.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "bench/peers/gauss.hpp"
#include "bench/peers/kepler.hpp"
#include "bench/peers/taylor.hpp"

namespace lobatto::bench {

namespace {

template <class real, int n>
State<real, n> state_of(const Trajectory& start) {
    State<real, n> state;
    for (int k = 0; k < n; ++k) state.q[k] = start.q[k], state.p[k] = start.p[k];
    return state;
}
template <class real, int n>
Trajectory trajectory_of(const State<real, n>& state) {
    Trajectory end{std::vector<double>(n), std::vector<double>(n)};
    for (int k = 0; k < n; ++k) end.q[k] = static_cast<double>(state.q[k]), end.p[k] = static_cast<double>(state.p[k]);
    return end;
}

// Equal steps, or each as long as the pace allows where it begins.
template <class Type, class real>
void integrate(State<real, Type::coordinates>& state, real until, real step, real tolerance) {
    if constexpr (!Type::has_pace) {
        const long steps = static_cast<long>(until / step + real(0.5));
        integrate_gauss<12, Type>(state, until / steps, steps, tolerance);
    } else {
        for (real t = 0; t < until;) {
            const real h = step * Type::pace(state.q.data()), left = until - t;
            const bool is_last = h >= left;
            integrate_gauss<12, Type>(state, is_last ? left : h, 1, tolerance);
            t = is_last ? until : t + h;
        }
    }
}

template <class real>
Trajectory end_of(const Problem& problem, const Trajectory& start, double step, real tolerance) {
    return with_type_of(problem, [&](auto type) {
        using Type = decltype(type);
        auto state = state_of<real, Type::coordinates>(start);
        integrate<Type>(state, real(problem.until), real(step), tolerance);
        return trajectory_of(state);
    });
}

// By the series of order 20 in 80 bits, what is added to the state summed with its roundings (Kahan): for 10^5
// revolutions Gauss' iteration leaves more.
template <class Type>
Trajectory end_by_series(const Problem& problem, const Trajectory& start, long double step) {
    using real = long double;
    constexpr int n = Type::coordinates;
    Expansion<Type, real> x;
    real lost[2 * n] = {};
    for (int k = 0; k < n; ++k) x.y[k][0] = start.q[k], x.y[n + k][0] = start.p[k];
    for (real t = 0; t < problem.until;) {
        x.expand(most_orders);
        const real pace = step * [&] {
            real q[n];
            for (int k = 0; k < n; ++k) q[k] = x.y[k][0];
            return Type::pace(q);
        }();
        const bool is_last = pace >= problem.until - t;
        const real h = is_last ? problem.until - t : pace;
        for (int k = 0; k < 2 * n; ++k) {
            real sum = x.y[k][most_orders];
            for (int i = most_orders; --i >= 1;) sum = sum * h + x.y[k][i];
            const real added = h * sum - lost[k], next = x.y[k][0] + added;
            lost[k] = (next - x.y[k][0]) - added;
            x.y[k][0] = next;
        }
        t = is_last ? problem.until : t + h;
    }
    Trajectory end = start;
    for (int k = 0; k < n; ++k) {
        end.q[k] = static_cast<double>(x.y[k][0]);
        end.p[k] = static_cast<double>(x.y[n + k][0]);
    }
    return end;
}

}  // namespace

Trajectory reference_end(const Problem& problem, const Trajectory& start, double refinement) {
    const double step = problem.reference_step * refinement;
    switch (problem.reference) {
        case Reference::closed:
            return trajectory_of(kepler_after(state_of<__float128, 2>(start), problem.until));
        case Reference::extended:
            return end_by_series<Hierarchical>(problem, start, step);
        case Reference::quadruple:
            return end_of<__float128>(problem, start, step, exact("1e-31"));
        default:
            return end_of<__float128>(problem, start, step, exact("1e-24"));
    }
}

Trajectory quick_reference_end(const Problem& problem, const Trajectory& start) {
    if (problem.reference != Reference::quadruple_for_one) return reference_end(problem, start);
    return end_of<long double>(problem, start, problem.reference_step, rounding<long double>);
}

void print_references(const std::vector<std::string>& names) {
    std::printf("| problem | first coordinate at T | moves with shorter steps by |\n|---|---|---|\n");
    for (const Problem& problem : problems()) {
        if (!names.empty() && std::find(names.begin(), names.end(), problem.name) == names.end()) continue;
        const Trajectory start{problem.q, problem.p}, end = reference_end(problem, start);
        const Trajectory finer = reference_end(problem, start, 0.8);
        double moved = 0;
        for (std::size_t k = 0; k < end.q.size(); ++k) moved = std::max(moved, std::fabs(finer.q[k] - end.q[k]));
        std::printf("| %s | %.17g | %.1e |\n", problem.name.c_str(), end.q[0], moved);
    }
}

double energy_of(const Problem& problem, const Trajectory& state) {
    return with_type_of(problem, [&](auto type) { return decltype(type)::energy(state.q.data(), state.p.data()); });
}

}  // namespace lobatto::bench
