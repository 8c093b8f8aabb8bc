// SPDX-License-Identifier: GPL-2.0-or-later
// Values for checks: the symbols of a derivation at a seeded point near the scene's start, expressions at 60 digits.
#include "generator/check_point.hpp"

#include <algorithm>
#include <cmath>

namespace lobatto {

Formulas point_near_start(const Derivation& derivation, int attempt) {
    const Scene& scene = derivation.scene;
    const Discretisation& d = derivation.discretisation();
    Formulas formulas;
    NearStart start(scene, attempt);
    start.set_all(formulas);
    formulas.set(d.h, start.near(float_of(scene.evaluate(scene.run.step, "the step"))));
    for (std::size_t k = 0; k < scene.coordinates.size(); ++k) {
        for (const auto& positions : {d.Q, d.Q_before})
            for (const auto& position : positions) formulas.set(position[k], start.position(k));
        formulas.set(d.p0[k], start.velocity(k));
        formulas.set(d.p1[k], start.velocity(k));
    }
    return formulas;
}

double relative_difference(const std::vector<cln::cl_R>& x, const std::vector<cln::cl_R>& y) {
    cln::cl_R size = 0, difference = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
        size = cln::max(size, cln::max(cln::abs(x[i]), cln::abs(y[i])));
        difference = cln::max(difference, cln::abs(x[i] - y[i]));
    }
    return cln::zerop(difference) ? 0 : cln::double_approx(difference / size);
}

}  // namespace lobatto
