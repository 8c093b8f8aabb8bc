// SPDX-License-Identifier: GPL-2.0-or-later
// Lobatto quadrature on [0, 1] with s points and what the variational integrator needs of it, exactly, in Q(sqrt d).
#include "generator/quadrature.hpp"

#include <stdexcept>

#include "generator/surd.hpp"

namespace lobatto {

namespace {

using GiNaC::numeric;

// The nodes are 0, 1 and the roots of P'_{s-1}(2 x - 1): 1/2; (5 -+ sqrt 5)/10; 1/2 and (7 -+ sqrt 21)/14.
std::vector<Surd> nodes(int points) {
    const Surd half(numeric(1, 2));
    const Surd sqrt5(0, numeric(1, 10), 5), sqrt21(0, numeric(1, 14), 21);
    switch (points) {
        case 2:
            return {Surd(0), Surd(1)};
        case 3:
            return {Surd(0), half, Surd(1)};
        case 4:
            return {Surd(0), half - sqrt5, half + sqrt5, Surd(1)};
        case 5:
            return {Surd(0), half - sqrt21, half, half + sqrt21, Surd(1)};
        default:
            throw std::invalid_argument("Lobatto quadrature is exact here with 2 to 5 points");
    }
}

// Coefficients of the Lagrange polynomial l_j, lowest degree first.
std::vector<Surd> lagrange(const std::vector<Surd>& c, std::size_t j) {
    std::vector<Surd> polynomial{Surd(1)};
    for (std::size_t m = 0; m < c.size(); ++m) {
        if (m == j) continue;
        const Surd scale = Surd(1) / (c[j] - c[m]);
        std::vector<Surd> next(polynomial.size() + 1);
        for (std::size_t k = 0; k < polynomial.size(); ++k) {
            next[k + 1] = next[k + 1] + polynomial[k] * scale;
            next[k] = next[k] - polynomial[k] * scale * c[m];
        }
        polynomial = std::move(next);
    }
    return polynomial;
}

Surd value(const std::vector<Surd>& polynomial, const Surd& x) {
    Surd sum;
    for (std::size_t k = polynomial.size(); k-- > 0;) sum = sum * x + polynomial[k];
    return sum;
}

Surd derivative(const std::vector<Surd>& polynomial, const Surd& x) {
    Surd sum;
    for (std::size_t k = polynomial.size(); k-- > 1;) sum = sum * x + polynomial[k] * Surd(static_cast<int>(k));
    return sum;
}

Surd integral(const std::vector<Surd>& polynomial) {
    Surd sum;
    for (std::size_t k = 0; k < polynomial.size(); ++k) sum = sum + polynomial[k] / Surd(static_cast<int>(k) + 1);
    return sum;
}

GiNaC::matrix matrix_of(const SurdMatrix& rows, std::size_t columns) {
    GiNaC::matrix result(static_cast<unsigned>(rows.size()), static_cast<unsigned>(columns));
    for (std::size_t i = 0; i < rows.size(); ++i)
        for (std::size_t j = 0; j < columns; ++j)
            result(static_cast<unsigned>(i), static_cast<unsigned>(j)) = rows[i][j].expression();
    return result;
}

}  // namespace

Quadrature quadrature_of(const Method& method) {
    const std::vector<Surd> c = nodes(method.points);
    const std::size_t s = c.size(), m = s - 2;
    std::vector<std::vector<Surd>> l(s);
    std::vector<Surd> b(s);
    for (std::size_t j = 0; j < s; ++j) {
        l[j] = lagrange(c, j);
        b[j] = integral(l[j]);
    }
    SurdMatrix D(s, std::vector<Surd>(s)), K(s, std::vector<Surd>(s));
    for (std::size_t i = 0; i < s; ++i)
        for (std::size_t j = 0; j < s; ++j) D[i][j] = derivative(l[j], c[i]);
    for (std::size_t i = 0; i < s; ++i)
        for (std::size_t j = 0; j < s; ++j)
            for (std::size_t k = 0; k < s; ++k) K[i][j] = K[i][j] + D[k][i] * b[k] * D[k][j];
    SurdMatrix interior(m, std::vector<Surd>(m));
    for (std::size_t i = 0; i < m; ++i)
        for (std::size_t j = 0; j < m; ++j) interior[i][j] = K[i + 1][j + 1];
    const SurdMatrix G = inverse(interior);
    SurdMatrix A(m, std::vector<Surd>(m)), E(m, std::vector<Surd>(s));
    for (std::size_t i = 0; i < m; ++i) {
        for (std::size_t j = 0; j < m; ++j) A[i][j] = b[j + 1] * (c[i + 1] * (Surd(1) - c[j + 1]) - G[i][j]);
        for (std::size_t j = 0; j < s; ++j) E[i][j] = value(l[j], Surd(1) + c[i + 1]);
    }

    Quadrature result;
    result.method = method;
    result.points = method.points;
    for (std::size_t j = 0; j < s; ++j) {
        result.radicand = std::max(result.radicand, c[j].b.is_zero() ? 1 : c[j].d);
        result.c.push_back(c[j].expression());
        result.b.push_back(b[j].expression());
        GiNaC::ex basis = 0;
        for (std::size_t k = 0; k < s; ++k)
            basis += l[j][k].expression() * GiNaC::pow(result.theta, static_cast<int>(k));
        result.basis.push_back(basis);
    }
    result.D = matrix_of(D, s);
    result.K = matrix_of(K, s);
    result.G = matrix_of(G, m);
    result.A = matrix_of(A, m);
    result.E = matrix_of(E, s);
    result.nodes = result.control = result.c;
    result.weights = result.b;
    return result;
}

GiNaC::ex expand_exactly(const GiNaC::ex& expression) {
    return expression.expand(GiNaC::expand_options::expand_function_args);
}

}  // namespace lobatto
