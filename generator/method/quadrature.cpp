// SPDX-License-Identifier: GPL-2.0-or-later
// The tables of a quadrature rule, computed once for both kinds of numbers: exact in Q(sqrt d), else long floats.
#include "generator/method/quadrature.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "generator/method/long_real.hpp"
#include "generator/method/splitting.hpp"
#include "generator/method/surd.hpp"

namespace lobatto {

namespace {

using GiNaC::numeric;

// Coefficients, lowest degree first.
template <class Number>
using Polynomial = std::vector<Number>;

template <class Number>
using MatrixRows = std::vector<std::vector<Number>>;

template <class Number>
Number value(const Polynomial<Number>& f, const Number& x) {
    Number sum;
    for (std::size_t k = f.size(); k-- > 0;) sum = sum * x + f[k];
    return sum;
}

template <class Number>
Polynomial<Number> derivative(const Polynomial<Number>& f) {
    Polynomial<Number> slope;
    for (std::size_t k = 1; k < f.size(); ++k) slope.push_back(f[k] * Number(static_cast<int>(k)));
    return slope;
}

// The integral from 0.
template <class Number>
Polynomial<Number> integral(const Polynomial<Number>& f) {
    Polynomial<Number> sum{Number(0)};
    for (std::size_t k = 0; k < f.size(); ++k) sum.push_back(f[k] / Number(static_cast<int>(k) + 1));
    return sum;
}

// The polynomial of a degree in a family with f_0 = 1, f_1 = first x, f_{n+1} = forward(n) x f_n - back(n) f_{n-1}.
template <class Forward, class Back>
Polynomial<numeric> by_recurrence(int degree, int first, const Forward& forward, const Back& back) {
    Polynomial<numeric> before, f{1};
    for (int n = 0; n < degree; ++n) {
        Polynomial<numeric> next(f.size() + 1);
        const numeric scale = n == 0 ? numeric(first) : forward(n);
        for (std::size_t k = 0; k < f.size(); ++k) next[k + 1] = scale * f[k];
        for (std::size_t k = 0; k < before.size(); ++k) next[k] -= back(n) * before[k];
        before = std::move(f);
        f = std::move(next);
    }
    return f;
}

// Legendre: (n + 1) P_{n+1} = (2 n + 1) x P_n - n P_{n-1}.
Polynomial<numeric> legendre(int degree) {
    return by_recurrence(
        degree, 1, [](int n) { return numeric(2 * n + 1, n + 1); }, [](int n) { return numeric(n, n + 1); });
}

// Chebyshev, of the second kind: U_{n+1} = 2 x U_n - U_{n-1}. The zeros are cos(j pi/(n + 1)).
Polynomial<numeric> chebyshev(int degree) {
    return by_recurrence(
        degree, 2, [](int) { return numeric(2); }, [](int) { return numeric(1); });
}

// The zeros x of a polynomial that is even or odd and has them all in (-1, 1), as (1 + x)/2, ascending.
// Newton's method for the squares of the zeros, the greatest first, divided by those found: from 1 it falls steadily.
// A single square is rational and found exactly, in one step.
template <class Number>
std::vector<Number> zeros(const Polynomial<numeric>& f) {
    const std::size_t odd = (f.size() - 1) % 2;  // f(x) = x^odd g(x^2)
    Polynomial<Number> g;
    for (std::size_t k = odd; k < f.size(); k += 2) g.push_back(Number(f[k]));
    const Polynomial<Number> slope = derivative(g);
    std::vector<Number> squares;
    while (squares.size() + 1 < g.size()) {
        Number y(1), step;
        do {
            const Number g_y = value(g, y);
            Number divisor = value(slope, y);
            for (const Number& found : squares) divisor = divisor - g_y / (y - found);
            step = g_y / divisor;
            y = y - step;
        } while (!step.is_zero());
        squares.push_back(y);
    }
    const Number half(numeric(1, 2));
    std::vector<Number> result;
    for (const Number& square : squares) result.push_back(half - half * root(square));
    if (odd == 1) result.push_back(half);
    for (std::size_t k = squares.size(); k-- > 0;) result.push_back(Number(1) - result[k]);
    return result;
}

template <class Number>
std::vector<Number> with_ends(const std::vector<Number>& inner, int first, int last) {
    std::vector<Number> list{Number(first)};
    list.insert(list.end(), inner.begin(), inner.end());
    list.push_back(Number(last));
    return list;
}

// The Lagrange polynomials on the points x.
template <class Number>
std::vector<Polynomial<Number>> lagrange(const std::vector<Number>& x) {
    std::vector<Polynomial<Number>> basis;
    for (std::size_t j = 0; j < x.size(); ++j) {
        Polynomial<Number> product{Number(1)};
        Number divisor(1);
        for (std::size_t m = 0; m < x.size(); ++m) {
            if (m == j) continue;
            product.push_back(Number(0));
            for (std::size_t k = product.size(); k-- > 0;)
                product[k] = (k > 0 ? product[k - 1] : Number(0)) - x[m] * product[k];
            divisor = divisor * (x[j] - x[m]);
        }
        for (Number& coefficient : product) coefficient = coefficient / divisor;
        basis.push_back(std::move(product));
    }
    return basis;
}

// Row i: the values of the polynomials at x_i.
template <class Number>
MatrixRows<Number> values(const std::vector<Polynomial<Number>>& basis, const std::vector<Number>& x) {
    MatrixRows<Number> rows(x.size());
    for (std::size_t i = 0; i < x.size(); ++i)
        for (const Polynomial<Number>& f : basis) rows[i].push_back(value(f, x[i]));
    return rows;
}

// The inverse of a square matrix by Gauss-Jordan elimination.
template <class Number>
MatrixRows<Number> inverse(MatrixRows<Number> matrix) {
    const std::size_t n = matrix.size();
    MatrixRows<Number> result(n, std::vector<Number>(n));
    for (std::size_t i = 0; i < n; ++i) result[i][i] = Number(1);
    for (std::size_t k = 0; k < n; ++k) {  // without exchange of rows: the matrix is positive definite
        const Number divisor = matrix[k][k];
        for (std::size_t j = 0; j < n; ++j) {
            matrix[k][j] = matrix[k][j] / divisor;
            result[k][j] = result[k][j] / divisor;
        }
        for (std::size_t i = 0; i < n; ++i) {
            if (i == k) continue;
            const Number factor = matrix[i][k];
            for (std::size_t j = 0; j < n; ++j) {
                matrix[i][j] = matrix[i][j] - factor * matrix[k][j];
                result[i][j] = result[i][j] - factor * result[k][j];
            }
        }
    }
    return result;
}

template <class Number>
std::vector<GiNaC::ex> expressions(const std::vector<Number>& numbers) {
    std::vector<GiNaC::ex> result;
    for (const Number& number : numbers) result.push_back(number.expression());
    return result;
}

template <class Number>
GiNaC::matrix matrix_of(const MatrixRows<Number>& rows, std::size_t columns) {
    GiNaC::matrix result(static_cast<unsigned>(rows.size()), static_cast<unsigned>(columns));
    for (std::size_t i = 0; i < rows.size(); ++i)
        for (std::size_t j = 0; j < columns; ++j)
            result(static_cast<unsigned>(i), static_cast<unsigned>(j)) = rows[i][j].expression();
    return result;
}

template <class Number>
std::vector<Number> plus_one(std::vector<Number> numbers) {
    for (Number& number : numbers) number = number + Number(1);
    return numbers;
}

template <class Number>
Quadrature tables(const Method& method) {
    const bool lobatto = method.family == Family::lobatto;
    const int s = method.points;

    // Nodes: Lobatto's are 0, 1 and the zeros of P'_{s-1}(2 x - 1), Gauss' those of P_s(2 x - 1).
    const std::vector<Number> inner = zeros<Number>(lobatto ? derivative(legendre(s - 1)) : legendre(s));
    const std::vector<Number> list = with_ends(inner, 0, 1);
    const std::vector<Number> nodes = lobatto ? list : inner;
    const std::vector<Number> control = lobatto ? list : with_ends(zeros<Number>(chebyshev(s - 1)), 0, 1);
    const auto basis = lagrange(control);
    const auto node_basis = lobatto ? basis : lagrange(nodes), list_basis = lobatto ? basis : lagrange(list);
    const std::size_t r = nodes.size(), controls = control.size(), m = inner.size();

    std::vector<Number> weights;
    std::vector<Polynomial<Number>> slopes, node_integrals;
    for (const auto& f : node_basis) {
        node_integrals.push_back(integral(f));
        weights.push_back(value(node_integrals.back(), Number(1)));
    }
    for (const auto& f : basis) slopes.push_back(derivative(f));

    const MatrixRows<Number> D = values(slopes, nodes);
    MatrixRows<Number> K(controls, std::vector<Number>(controls)), interior;
    for (std::size_t i = 0; i < controls; ++i)
        for (std::size_t j = 0; j < controls; ++j)
            for (std::size_t k = 0; k < r; ++k) K[i][j] = K[i][j] + D[k][i] * weights[k] * D[k][j];
    for (std::size_t i = 1; i + 1 < controls; ++i) interior.emplace_back(K[i].begin() + 1, K[i].end() - 1);
    const MatrixRows<Number> G = inverse(interior);

    MatrixRows<Number> A(m, std::vector<Number>(m));
    if (lobatto) {
        for (std::size_t i = 0; i < m; ++i)
            for (std::size_t j = 0; j < m; ++j)
                A[i][j] = weights[j + 1] * (inner[i] * (Number(1) - inner[j]) - G[i][j]);
    } else {
        const MatrixRows<Number> a = values(node_integrals, nodes);  // collocation: a_ij, from 0 to c_i over l_j
        for (std::size_t i = 0; i < m; ++i)
            for (std::size_t j = 0; j < m; ++j)
                for (std::size_t k = 0; k < m; ++k) A[i][j] = A[i][j] + a[i][k] * a[k][j];
    }

    const Polynomial<numeric> pi = legendre(static_cast<int>(r) - 1);
    const Polynomial<Number> highest(pi.begin(), pi.end());
    std::vector<Number> highest_values(r);
    for (std::size_t i = 0; lobatto && i < r; ++i) highest_values[i] = value(highest, nodes[i] + nodes[i] - Number(1));

    Quadrature result;
    result.method = method;
    result.exact = Number::exact;
    for (const Number& x : list) result.radicand = std::max(result.radicand, x.radicand());
    result.points = static_cast<int>(list.size());
    result.c = expressions(list);
    result.b = expressions(lobatto ? weights : with_ends(weights, 0, 0));
    result.A = matrix_of(A, m);
    result.E = matrix_of(values(list_basis, plus_one(inner)), list.size());
    result.nodes = expressions(nodes);
    result.weights = expressions(weights);
    result.control = expressions(control);
    for (const auto& f : basis) {
        GiNaC::exvector terms;
        for (std::size_t k = 0; k < f.size(); ++k)
            terms.push_back(f[k].expression() * GiNaC::pow(result.theta, static_cast<int>(k)));
        result.basis.push_back(GiNaC::add(terms));
    }
    result.B = matrix_of(values(basis, nodes), controls);
    result.D = matrix_of(D, controls);
    result.K = matrix_of(K, controls);
    result.G = matrix_of(G, controls - 2);
    result.extrapolation = matrix_of(values(basis, plus_one(control)), controls);
    result.legendre = expressions(highest_values);
    result.integration = matrix_of(values(node_integrals, nodes), r);
    result.reach = matrix_of(values(node_integrals, std::vector<Number>(control.begin() + 1, control.end())), r);
    result.ahead = matrix_of(values(node_basis, plus_one(nodes)), r);
    return result;
}

// Paths that are straight between the nodes: kinetic energies are those of the lengths of the drifts, and G is Green's
// function of a string through the nodes, in the order they come (D40).
Quadrature straight_tables(const Method& method) {
    const Splitting splitting = splitting_of(method.points);
    const std::size_t s = splitting.kicks.size();
    std::vector<numeric> c(s);
    for (std::size_t i = 0; i + 1 < s; ++i) c[i + 1] = c[i] + splitting.drifts[i];
    Quadrature result;
    result.method = method;
    result.points = static_cast<int>(s);
    result.c.assign(c.begin(), c.end());
    result.b.assign(splitting.kicks.begin(), splitting.kicks.end());
    result.control = result.c;
    std::vector<std::size_t> weighted;
    for (std::size_t i = 0; i < s; ++i)
        if (!splitting.kicks[i].is_zero()) weighted.push_back(i);
    const auto size = static_cast<unsigned>(s), inner = size - 2;
    result.B = GiNaC::matrix(static_cast<unsigned>(weighted.size()), size);
    for (unsigned i = 0; i < result.B.rows(); ++i) {
        result.nodes.push_back(result.c[weighted[i]]);
        result.weights.push_back(result.b[weighted[i]]);
        result.B(i, static_cast<unsigned>(weighted[i])) = 1;
    }
    result.K = GiNaC::matrix(size, size);
    for (unsigned i = 0; i + 1 < size; ++i) {
        const numeric stiffness = splitting.drifts[i].inverse();
        result.K(i, i) += stiffness;
        result.K(i + 1, i + 1) += stiffness;
        result.K(i, i + 1) = result.K(i + 1, i) = -stiffness;
    }
    result.G = GiNaC::matrix(inner, inner);
    result.A = GiNaC::matrix(inner, inner);
    for (unsigned i = 0; i < inner; ++i)
        for (unsigned j = 0; j < inner; ++j) {
            result.G(i, j) = c[std::min(i, j) + 1] * (1 - c[std::max(i, j) + 1]);
            result.A(i, j) = splitting.kicks[j + 1] * (c[i + 1] * (1 - c[j + 1]) - result.G(i, j));
        }
    return result;
}

}  // namespace

Quadrature quadrature_of(const Method& method) {
    if (method.family == Family::splitting) return straight_tables(method);
    const bool lobatto = method.family == Family::lobatto;
    const int least = lobatto ? 2 : 1, most = lobatto ? 12 : 10;
    if (method.points < least || method.points > most)
        throw std::invalid_argument(method.name() + ": the rules there are have " + std::to_string(least) + " to " +
                                    std::to_string(most));
    // Two nodes (1 -+ sqrt y)/2 at most beside 0, 1/2 and 1: they lie in Q(sqrt d).
    return method.points <= (lobatto ? 5 : 3) ? tables<Surd>(method) : tables<LongReal>(method);
}

GiNaC::ex expand_exactly(const GiNaC::ex& expression) {
    return expression.expand(GiNaC::expand_options::expand_function_args);
}

}  // namespace lobatto
