// SPDX-License-Identifier: GPL-2.0-or-later
// The exact step of a linear system with one coordinate: the interior unknowns eliminated symbolically.
#include "generator/propagation.hpp"

#include <array>
#include <stdexcept>
#include <vector>

namespace lobatto {

namespace {

using GiNaC::ex;

// The image of one start: q0, the scaled velocity h u0 and the scaled force h^2 f/m, each 0 or 1, times the determinant
// of the stage equations.
struct Image {
    ex position, velocity;
};

Image image(const Quadrature& quadrature, const ex& z, const GiNaC::matrix& stage, const ex& determinant, int q0,
            int u0, int force) {
    const unsigned m = static_cast<unsigned>(quadrature.points) - 2;
    const auto& c = quadrature.c;
    const auto& b = quadrature.b;
    const ex v = u0 - b[0] * (z * q0 - force);  // (D11) times h
    std::vector<ex> right;
    for (unsigned i = 0; i < m; ++i) {
        ex sum = q0 + c[i + 1] * v;
        for (unsigned j = 0; j < m; ++j) sum += quadrature.A(i, j) * force;
        right.push_back(sum);
    }
    // (D12) by Cramer's rule: determinant * Q_i.
    std::vector<ex> Q;
    for (unsigned i = 0; i < m; ++i) {
        GiNaC::matrix replaced = stage;
        for (unsigned row = 0; row < m; ++row) replaced(row, i) = right[row];
        Q.push_back(expand_exactly(replaced.determinant(GiNaC::determinant_algo::laplace)));
    }
    ex position = determinant * (q0 + v), velocity = determinant * v;
    for (unsigned j = 0; j < m; ++j) {
        const ex acceleration = z * Q[j] - determinant * force;
        position -= b[j + 1] * (1 - c[j + 1]) * acceleration;
        velocity -= b[j + 1] * acceleration;
    }
    position = expand_exactly(position);
    velocity = expand_exactly(velocity - b.back() * (z * position - determinant * force));
    return {position, velocity};
}

}  // namespace

Propagation propagation(const Quadrature& quadrature) {
    Propagation result;
    const ex z = result.z;
    const unsigned m = static_cast<unsigned>(quadrature.points) - 2;
    GiNaC::matrix stage(m, m);
    for (unsigned i = 0; i < m; ++i)
        for (unsigned j = 0; j < m; ++j) stage(i, j) = (i == j ? 1 : 0) + z * quadrature.A(i, j);
    const ex determinant = m == 0 ? ex(1) : expand_exactly(stage.determinant(GiNaC::determinant_algo::laplace));
    const Image q = image(quadrature, z, stage, determinant, 1, 0, 0);
    const Image u = image(quadrature, z, stage, determinant, 0, 1, 0);
    const Image f = image(quadrature, z, stage, determinant, 0, 0, 1);

    std::array<ex*, 6> parts = {&result.delta, &result.a, &result.b, &result.c, &result.e_q, &result.e_p};
    const std::array<ex, 6> polynomials = {determinant, q.position, q.velocity, u.position, f.position, f.velocity};
    ex common = 0;
    for (const ex& polynomial : polynomials) {
        for (int degree = 0; degree <= polynomial.degree(z); ++degree)
            if (!polynomial.coeff(z, degree).info(GiNaC::info_flags::rational))
                throw std::logic_error("a radical survived in the propagation");
        common = GiNaC::gcd(common, polynomial);
    }
    const ex scale = determinant.subs(z == 0) / common.subs(z == 0);  // delta(0) = 1
    for (std::size_t i = 0; i < parts.size(); ++i) *parts[i] = GiNaC::quo(polynomials[i], common, z).expand() / scale;
    for (ex* part : parts) *part = part->expand();
    return result;
}

}  // namespace lobatto
