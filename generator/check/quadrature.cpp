// SPDX-License-Identifier: GPL-2.0-or-later
// Identities that a rule's tables must satisfy, by routes that quadrature.cpp does not take.
#include <algorithm>
#include <cmath>

#include "generator/check/check.hpp"
#include "generator/method/splitting.hpp"
#include "generator/method/splitting_order.hpp"

namespace lobatto {

namespace {

using GiNaC::ex;
using GiNaC::numeric;
using Expressions = std::vector<ex>;
using MatrixRows = std::vector<Expressions>;

// Tables of floats: what is left of an identity, absolute. Measured at most 2e-140: 150 digits, of numbers below 1e10.
constexpr double table_bound = 1e-130;

ex power(const ex& x, std::size_t exponent) {  // GiNaC refuses 0^0
    return exponent == 0 ? ex(1) : expand_exactly(GiNaC::pow(x, static_cast<int>(exponent)));
}

// Coefficients of a polynomial, lowest degree first.
Expressions coefficients(const ex& polynomial, const GiNaC::symbol& theta, std::size_t count) {
    Expressions result;
    for (std::size_t k = 0; k < count; ++k) result.push_back(polynomial.coeff(theta, static_cast<int>(k)));
    return result;
}

ex value(const Expressions& polynomial, const ex& x) {
    ex sum = 0;
    for (std::size_t k = 0; k < polynomial.size(); ++k) sum += polynomial[k] * power(x, k);
    return sum;
}

Expressions slope(const Expressions& polynomial) {
    Expressions result;
    for (std::size_t k = 1; k < polynomial.size(); ++k) result.push_back(polynomial[k] * numeric(static_cast<long>(k)));
    return result;
}

// The integral over [0, 1] of the product of two polynomials.
ex integral(const Expressions& f, const Expressions& g) {
    ex sum = 0;
    for (std::size_t i = 0; i < f.size(); ++i)
        for (std::size_t j = 0; j < g.size(); ++j) sum += f[i] * g[j] / static_cast<int>(i + j + 1);
    return sum;
}

MatrixRows rows_of(const GiNaC::matrix& matrix) {
    MatrixRows rows(matrix.rows());
    for (unsigned i = 0; i < matrix.rows(); ++i)
        for (unsigned j = 0; j < matrix.cols(); ++j) rows[i].push_back(matrix(i, j));
    return rows;
}

class Identities {
public:
    explicit Identities(const Quadrature& quadrature)
        : q_(quadrature),
          lobatto_(quadrature.method.family == Family::lobatto),
          is_straight_(quadrature.is_explicit()),
          controls_(quadrature.control.size()),
          r_(quadrature.nodes.size()),
          m_(quadrature.c.size() - 2),
          A_(rows_of(quadrature.A)) {
        for (const ex& f : q_.basis) {
            basis_.push_back(coefficients(f, q_.theta, controls_));
            slopes_.push_back(slope(basis_.back()));
        }
    }

    std::vector<Check> checks() {
        if (is_straight_) {
            straight_paths();
            explicit_stages();
            order_of_steps();
            return std::move(checks_);
        }
        moments();
        lagrange();
        rigidity();
        forces();
        continuation();
        if (lobatto_)
            legendre();
        else
            collocation();
        return std::move(checks_);
    }

private:
    void claim(const std::string& claim, const Expressions& zeros, const std::string& meaning) {
        Check check{claim, true, q_.exact, 0, q_.exact ? 0 : table_bound, meaning};
        for (const ex& zero : zeros) {
            const ex left = expand_exactly(zero);
            if (left.is_zero()) continue;
            check.measured = q_.exact ? 1 : std::max(check.measured, abs(GiNaC::ex_to<numeric>(left)).to_double());
        }
        check.holds = check.measured <= check.bound;
        checks_.push_back(check);
    }

    // (D22), for the nodes with a weight and for the list with the ends: the same sums.
    Expressions moment_errors(std::size_t degree, const ex& expected) const {
        ex sum = -expected, with_ends = -expected;
        for (std::size_t i = 0; i < r_; ++i) sum += q_.weights[i] * power(q_.nodes[i], degree);
        for (std::size_t i = 0; i < q_.c.size(); ++i) with_ends += q_.b[i] * power(q_.c[i], degree);
        return {sum, with_ends};
    }

    void moments() {
        const std::size_t d = controls_ - 1, highest = 2 * d - 1;  // d: degree of the path
        Expressions zeros;
        for (std::size_t degree = 0; degree <= highest; ++degree)
            for (const ex& error : moment_errors(degree, numeric(1, static_cast<long>(degree) + 1)))
                zeros.push_back(error);
        claim("the quadrature is exact to degree " + std::to_string(highest), zeros,
              "the nodes or weights are not those of the rule");
        // theta^(2 d) is P_d(2 theta - 1)^2 / binomial(2 d, d)^2 and lower terms. The integral of P_d^2 is
        // 1/(2 d + 1), its sum 1/d (Lobatto) or 0 (Gauss).
        const long degree = static_cast<long>(d);
        const ex sum = lobatto_ ? numeric(1, degree) : numeric(0);
        const ex leading = GiNaC::binomial(numeric(2 * degree), numeric(degree));
        claim(
            "the quadrature is not exact beyond degree " + std::to_string(highest),
            moment_errors(2 * d, numeric(1, 2 * degree + 1) + (sum - numeric(1, 2 * degree + 1)) / (leading * leading)),
            "the error at the next degree is not the rule's");
        claim("the weights sum to 1", moment_errors(0, 1), "constants are not integrated exactly");
    }

    void lagrange() {
        Expressions zeros;
        for (std::size_t j = 0; j < controls_; ++j) {
            for (std::size_t i = 0; i < controls_; ++i)
                zeros.push_back(value(basis_[j], q_.control[i]) - (i == j ? 1 : 0));
            for (std::size_t i = 0; i < r_; ++i) {
                const unsigned row = static_cast<unsigned>(i), column = static_cast<unsigned>(j);
                zeros.push_back(value(basis_[j], q_.nodes[i]) - q_.B(row, column));
                zeros.push_back(value(slopes_[j], q_.nodes[i]) - q_.D(row, column));
            }
        }
        claim("the basis is Lagrange's on the control points", zeros,
              "a basis polynomial, its value or its slope at a node is wrong");
    }

    // (D4). The rule is exact for products of slopes.
    void rigidity() {
        const MatrixRows K = rows_of(q_.K);
        Expressions zeros;
        for (std::size_t i = 0; i < controls_; ++i) {
            ex row = 0;
            for (std::size_t j = 0; j < controls_; ++j) {
                zeros.push_back(K[i][j] - integral(slopes_[i], slopes_[j]));
                zeros.push_back(K[i][j] - K[j][i]);
                row += K[i][j];
            }
            zeros.push_back(row);
        }
        claim("K is the integral of products of basis derivatives", zeros, "K is not the rigidity matrix of the basis");
        inverse_of_K();
    }
    void inverse_of_K() {
        const MatrixRows K = rows_of(q_.K), G = rows_of(q_.G);
        Expressions inverse;
        for (std::size_t i = 0; i + 2 < controls_; ++i)
            for (std::size_t j = 0; j + 2 < controls_; ++j) {
                ex product = i == j ? -1 : 0;
                for (std::size_t k = 0; k + 2 < controls_; ++k) product += G[i][k] * K[k + 1][j + 1];
                inverse.push_back(product);
                inverse.push_back(G[i][j] - G[j][i]);
            }
        claim("G inverts the interior of K", inverse, "the stage equations are solved with a wrong inverse");
    }

    // (D12), (D16), (D19). An acceleration theta^k moves the node c_i by c_i^(k+2)/((k+1)(k+2)), as far as paths have
    // that degree; k = 0 is the parabola.
    void forces() {
        const Expressions &c = q_.c, &b = q_.b;
        Expressions zeros;
        for (std::size_t k = 0; k + 3 <= controls_; ++k)
            for (std::size_t i = 0; i < m_; ++i) {
                ex moved =
                    (k == 0 ? b[0] * c[i + 1] : ex(0)) - power(c[i + 1], k + 2) / static_cast<int>((k + 1) * (k + 2));
                for (std::size_t j = 0; j < m_; ++j) moved += A_[i][j] * power(c[j + 1], k);
                zeros.push_back(moved);
            }
        ex arrival = -numeric(1, 2);
        for (std::size_t j = 0; j < c.size(); ++j) arrival += b[j] * (1 - c[j]);
        zeros.push_back(arrival);
        claim("the stage matrix A integrates accelerations", zeros, "the stage matrix A is inconsistent");
        symplecticity();
    }
    void symplecticity() {
        const Expressions &c = q_.c, &b = q_.b;
        Expressions symplectic;
        for (std::size_t i = 0; i < m_; ++i)
            for (std::size_t j = 0; j < i; ++j)
                symplectic.push_back(b[i + 1] * A_[i][j] - b[j + 1] * A_[j][i] -
                                     b[i + 1] * b[j + 1] * (c[i + 1] - c[j + 1]));
        claim("the stage matrix is symplectic", symplectic,
              "b_i A_ij - b_j A_ji = b_i b_j (c_i - c_j) fails: the step would not be symplectic");
    }

    // (D15): continued to 1 + x, powers remain powers.
    void continuation() {
        Expressions zeros;
        const auto carried = [&](const MatrixRows& rows, const Expressions& from, const Expressions& to) {
            for (std::size_t i = 0; i < rows.size(); ++i)
                for (std::size_t k = 0; k < from.size(); ++k) {
                    ex sum = -power(1 + to[i], k);
                    for (std::size_t j = 0; j < from.size(); ++j) sum += rows[i][j] * power(from[j], k);
                    zeros.push_back(sum);
                }
        };
        carried(rows_of(q_.E), q_.c, Expressions(q_.c.begin() + 1, q_.c.end() - 1));
        carried(rows_of(q_.extrapolation), q_.control, q_.control);
        claim("polynomials continue into the next step", zeros, "start values are extrapolated wrongly");
    }

    // P_{r-1} is 1 at the end and orthogonal, in the rule, to every slope of a path: that defines it.
    void legendre() {
        Expressions zeros{q_.legendre.back() - 1};
        for (std::size_t j = 0; j < controls_; ++j) {
            ex sum = 0;
            for (std::size_t i = 0; i < r_; ++i)
                sum += q_.weights[i] * q_.legendre[i] * q_.D(static_cast<unsigned>(i), static_cast<unsigned>(j));
            zeros.push_back(sum);
        }
        claim("the highest Legendre polynomial is orthogonal to velocities", zeros,
              "the momenta of cyclic coordinates vary wrongly inside the step");
    }

    // a_ij, the integral of node polynomial j from 0 to c_i, by the rule itself on [0, c_i].
    void collocation() {
        const Expressions &c = q_.nodes, &b = q_.weights;
        MatrixRows a(r_, Expressions(r_));
        for (std::size_t i = 0; i < r_; ++i)
            for (std::size_t j = 0; j < r_; ++j) {
                for (std::size_t k = 0; k < r_; ++k) {
                    ex product = b[k];
                    for (std::size_t n = 0; n < r_; ++n)
                        if (n != j) product = expand_exactly(product * (c[i] * c[k] - c[n]));
                    a[i][j] += product;
                }
                ex divisor = 1;
                for (std::size_t n = 0; n < r_; ++n)
                    if (n != j) divisor = expand_exactly(divisor * (c[j] - c[n]));
                a[i][j] = expand_exactly(c[i] * a[i][j] * GiNaC::pow(divisor, -1));
            }
        Expressions symplectic, square, zero{};
        for (std::size_t i = 0; i < r_; ++i)
            for (std::size_t j = 0; j < r_; ++j) {
                symplectic.push_back(b[i] * a[i][j] + b[j] * a[j][i] - b[i] * b[j]);
                ex sum = -A_[i][j];
                for (std::size_t k = 0; k < r_; ++k) sum += a[i][k] * a[k][j];
                square.push_back(sum);
            }
        claim("the collocation matrix is symplectic", symplectic,
              "b_i a_ij + b_j a_ji = b_i b_j fails: the nodes are not Gauss'");
        claim("the stage matrix is its square", square, "A is not that of collocation at Gauss' nodes");
        for (const ex& entry : q_.legendre) zero.push_back(entry);
        claim("momenta of cyclic coordinates are constant", zero, "Gauss' rule has no Legendre values");
    }

    // (D40). A symmetric matrix with one diagonal beside the main one is known by what it makes of straight paths: of a
    // constant nothing, of theta a pull at the ends.
    void straight_paths() {
        const MatrixRows K = rows_of(q_.K);
        Expressions zeros, moment{-1}, mirror;
        for (std::size_t i = 0; i < controls_; ++i) {
            ex row = 0, pull = i == 0 ? 1 : i + 1 == controls_ ? -1 : 0;
            for (std::size_t j = 0; j < controls_; ++j) {
                row += K[i][j];
                pull += K[i][j] * q_.c[j];
                zeros.push_back(K[i][j] - K[j][i]);
                if (i + 1 < j) zeros.push_back(K[i][j]);
            }
            zeros.push_back(row);
            zeros.push_back(pull);
            moment[0] += q_.b[i];
            mirror.push_back(q_.b[i] - q_.b[controls_ - 1 - i]);
            mirror.push_back(q_.c[i] + q_.c[controls_ - 1 - i] - 1);
        }
        claim("K is that of paths straight from node to node", zeros, "K is not the rigidity matrix of the basis");
        inverse_of_K();
        claim("the weights sum to 1", moment, "constants are not integrated exactly");
        claim("a step backwards undoes a step", mirror, "the coefficients are no palindrome");
    }

    // (D12). Node i follows from the nodes before it.
    void explicit_stages() {
        Expressions zeros;
        for (std::size_t i = 0; i < m_; ++i)
            for (std::size_t j = 0; j < m_; ++j)
                zeros.push_back(A_[i][j] - (j < i ? q_.b[j + 1] * (q_.c[i + 1] - q_.c[j + 1]) : ex(0)));
        claim("each node follows from those before it", zeros, "the stage map is not explicit");
        symplecticity();
    }

    // A step of q'' = -grad V against the motion, both as power series in h. The potential is of no symmetry, so that
    // no two conditions of order fall together.
    void order_of_steps() {
        const std::size_t order = static_cast<std::size_t>(q_.order());
        Check check{"steps are those of the motion to h^" + std::to_string(order), false, false, 0, 0, ""};
        check.bound = std::pow(10.0, -splitting_of(q_.method.points).digits + 2);
        check.meaning = "the coefficients are not those of a method of this order";
        check.measured = splitting_defect(q_, order);
        check.holds = check.measured <= check.bound;
        checks_.push_back(check);
        // What the next power misses is no rounding.
        const double beyond = splitting_defect(q_, order + 1);
        checks_.push_back({"and not beyond h^" + std::to_string(order), beyond > 1e-9, false, beyond > 1e-9 ? 0.0 : 1.0,
                           0, "the order is higher than stated"});
    }

    const Quadrature& q_;
    bool lobatto_, is_straight_;
    std::size_t controls_, r_, m_;
    MatrixRows A_, basis_, slopes_;
    std::vector<Check> checks_;
};

}  // namespace

std::vector<Check> check_quadrature(const Quadrature& quadrature) {
    return Identities(quadrature).checks();
}

}  // namespace lobatto
