// SPDX-License-Identifier: GPL-2.0-or-later
// Values for checks: the symbols of a derivation at a seeded point near the scene's start, expressions at 60 digits.
#include "generator/check/point.hpp"

#include <algorithm>
#include <cmath>

namespace lobatto {

Formulas point_near_start(const Derivation& derivation, int attempt) {
    const Scene& scene = derivation.scene;
    const Discretisation& d = derivation.discretisation();
    Formulas formulas;
    NearStart start(scene, attempt);
    start.set_all(formulas);
    formulas.set(d.t0, formulas.get(scene.time));
    const cln::cl_R h = start.near(float_of(scene.evaluate(scene.run.step, "the step")));
    formulas.set(d.h, h);
    const std::vector<GiNaC::ex>& x = derivation.quadrature.control;
    for (std::size_t k = 0; k < scene.coordinates.size(); ++k) {
        // Of a separable system any positions near the start will do; otherwise velocities must stay near it too.
        const cln::cl_R q = start.position(k);
        const auto on_path = [&](const GiNaC::ex& at) {
            return derivation.system.separable ? start.position(k) : q + h * formulas({at})[0] * start.velocity(k);
        };
        for (std::size_t j = 0; j < x.size(); ++j) {
            formulas.set(d.Q_before[j][k], on_path(x[j] - 1));
            formulas.set(d.Q[j][k], on_path(x[j]));
        }
        for (const auto& stage : d.Y)
            if (derivation.quadrature.method.family == Family::gauss) formulas.set(stage[k], start.position(k));
        // In its own unit; of a start at rest, one that moves the position by at most its own size.
        cln::cl_R p = formulas({derivation.system.momentum[k]})[0];
        const cln::cl_R speed = cln::abs(q / h);
        const bool rests = scene.evaluate(scene.initial_rate[k], "the initial velocity").is_zero();
        if (rests && !cln::zerop(speed) && speed < 1) p = p * speed;
        formulas.set(d.p0[k], start.near(p));
        formulas.set(d.p1[k], start.near(p));
    }
    return formulas;
}

double relative_difference(const Numbers& x, const Numbers& y) {
    cln::cl_R size = 0, difference = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
        size = cln::max(size, cln::max(cln::abs(x[i]), cln::abs(y[i])));
        difference = cln::max(difference, cln::abs(x[i] - y[i]));
    }
    return cln::zerop(difference) ? 0 : cln::double_approx(difference / size);
}

Numbers times(const Numbers& A, const Numbers& x) {
    Numbers product(A.size() / x.size(), cln::cl_R(0));
    for (std::size_t i = 0; i < product.size(); ++i)
        for (std::size_t j = 0; j < x.size(); ++j) product[i] = product[i] + A[i * x.size() + j] * x[j];
    return product;
}

Numbers solve(Numbers A, Numbers y) {
    const std::size_t n = y.size();
    for (std::size_t k = 0; k < n; ++k) {
        std::size_t pivot = k;
        for (std::size_t i = k + 1; i < n; ++i)
            if (cln::abs(A[i * n + k]) > cln::abs(A[pivot * n + k])) pivot = i;
        for (std::size_t j = 0; j < n; ++j) std::swap(A[k * n + j], A[pivot * n + j]);
        std::swap(y[k], y[pivot]);
        if (cln::zerop(A[k * n + k])) throw DomainError("a singular matrix");
        for (std::size_t i = 0; i < n; ++i) {
            if (i == k) continue;
            const cln::cl_R factor = A[i * n + k] / A[k * n + k];
            for (std::size_t j = k; j < n; ++j) A[i * n + j] = A[i * n + j] - factor * A[k * n + j];
            y[i] = y[i] - factor * y[k];
        }
    }
    for (std::size_t k = 0; k < n; ++k) y[k] = y[k] / A[k * n + k];
    return y;
}

Numbers seeded_direction(const Numbers& start, Noise& noise) {
    cln::cl_R largest = 0;
    for (const cln::cl_R& value : start) largest = cln::max(largest, cln::abs(value));
    if (cln::zerop(largest)) largest = 1;
    Numbers direction;
    for (const cln::cl_R& value : start)
        direction.push_back(noise.next() * (cln::zerop(value) ? largest : cln::abs(value)));
    return direction;
}

}  // namespace lobatto
