// SPDX-License-Identifier: GPL-2.0-or-later
#include "generator/method/splitting_order.hpp"

#include <cln/cln.h>

#include <algorithm>
#include <vector>

namespace lobatto {

namespace {

const cln::float_format_t sixty = cln::float_format(60);

cln::cl_F number(const GiNaC::ex& value) {
    return cln::cl_float(cln::the<cln::cl_R>(GiNaC::ex_to<GiNaC::numeric>(value).to_cl_N()), sixty);
}
cln::cl_F ratio(int above, int below) {
    return cln::cl_float(cln::cl_RA(above) / below, sixty);
}

// Power series in h, cut off behind the last coefficient.
using Series = std::vector<cln::cl_F>;

Series operator+(Series x, const Series& y) {
    for (std::size_t k = 0; k < x.size(); ++k) x[k] = x[k] + y[k];
    return x;
}
Series operator*(const cln::cl_F& factor, Series x) {
    for (cln::cl_F& coefficient : x) coefficient = factor * coefficient;
    return x;
}
Series operator*(const Series& x, const Series& y) {
    Series product(x.size(), cln::cl_float(0, sixty));
    for (std::size_t i = 0; i < x.size(); ++i)
        for (std::size_t j = 0; i + j < x.size(); ++j) product[i + j] = product[i + j] + x[i] * y[j];
    return product;
}
Series times_h(const Series& x) {
    Series result(x.size(), cln::cl_float(0, sixty));
    for (std::size_t k = 1; k < x.size(); ++k) result[k] = x[k - 1];
    return result;
}

struct State {
    Series q[2], u[2];
};

// grad V, V = x^2/2 + y^2/3 + x^3/5 - x^2 y/2 + x y^2/3 + x^4/7 + x y^3/4 - y^4/6 + x^3 y^2/3 + y^5/5.
void slopes(const Series q[2], Series grad[2]) {
    const Series &x = q[0], &y = q[1];
    const Series xx = x * x, xy = x * y, yy = y * y;
    grad[0] = x + ratio(3, 5) * xx + ratio(-1, 1) * xy + ratio(1, 3) * yy + ratio(4, 7) * (x * xx) +
              ratio(1, 4) * (y * yy) + xx * yy;
    grad[1] = ratio(2, 3) * y + ratio(-1, 2) * xx + ratio(2, 3) * xy + ratio(3, 4) * (x * yy) +
              ratio(-2, 3) * (y * yy) + ratio(2, 3) * (x * xx * y) + yy * yy;
}

State start(std::size_t order) {
    State state;
    const cln::cl_F values[2][2] = {{ratio(3, 10), ratio(-7, 10)}, {ratio(9, 10), ratio(2, 5)}};
    for (int k = 0; k < 2; ++k) {
        state.q[k] = state.u[k] = Series(order + 1, cln::cl_float(0, sixty));
        state.q[k][0] = values[0][k];
        state.u[k][0] = values[1][k];
    }
    return state;
}

State step(const Quadrature& rule, State state) {
    for (std::size_t i = 0; i < rule.c.size(); ++i) {
        Series grad[2];
        slopes(state.q, grad);
        for (int k = 0; k < 2; ++k) {
            state.u[k] = state.u[k] + number(-rule.b[i]) * times_h(grad[k]);
            if (i + 1 < rule.c.size())
                state.q[k] = state.q[k] + number(rule.c[i + 1] - rule.c[i]) * times_h(state.u[k]);
        }
    }
    return state;
}

// The k-th coefficients follow from those before: q' = u, u' = -grad V(q).
State motion(State state) {
    for (std::size_t k = 1; k < state.q[0].size(); ++k) {
        Series grad[2];
        slopes(state.q, grad);
        for (int c = 0; c < 2; ++c) {
            state.q[c][k] = state.u[c][k - 1] / static_cast<int>(k);
            state.u[c][k] = -grad[c][k - 1] / static_cast<int>(k);
        }
    }
    return state;
}

}  // namespace

double splitting_defect(const Quadrature& quadrature, std::size_t order) {
    const State stepped = step(quadrature, start(order)), exact = motion(start(order));
    cln::cl_F difference = ratio(0, 1), largest = ratio(0, 1);
    for (int c = 0; c < 2; ++c)
        for (std::size_t k = 1; k <= order; ++k)
            for (const auto& [one, other] :
                 {std::pair(stepped.q[c][k], exact.q[c][k]), std::pair(stepped.u[c][k], exact.u[c][k])}) {
                difference = cln::max(difference, cln::abs(one - other));
                largest = cln::max(largest, cln::abs(other));
            }
    return cln::double_approx(difference / largest);
}

}  // namespace lobatto
