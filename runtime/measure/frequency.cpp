// SPDX-License-Identifier: MIT
#include "runtime/measure/frequency.hpp"

#include <algorithm>
#include <cmath>

namespace lobatto {

namespace {

constexpr int iterations = 40;
constexpr double part = 1e-5;  // of the scale: a difference
constexpr double near = 1e-6;  // of the scale, and of the place, whose rounding is less

template <class real>
struct Equations {
    const LoadedStepper<real>& stepper;
    real time;
    std::size_t n;

    bool operator()(const std::vector<real>& y, std::vector<real>& f) const {
        const auto middle = y.begin() + static_cast<std::ptrdiff_t>(n);
        const std::vector<real> q(y.begin(), middle), p(middle, y.end());
        std::vector<real> v, Lv, Lq;
        if (stepper.velocity(time, q, p, v) != LOBATTO_OK) return false;
        stepper.slopes(time, q, v, Lv, Lq);
        f = v;
        f.insert(f.end(), Lq.begin(), Lq.end());
        return true;
    }
};

double product(const std::vector<double>& x, const std::vector<double>& y) {
    double sum = 0;
    for (std::size_t i = 0; i < x.size(); ++i) sum += x[i] * y[i];
    return sum;
}

double norm(const std::vector<double>& x) {
    return std::sqrt(product(x, x));
}

// The larger |lambda| of lambda^2 = a lambda + b, which A has where A x = first u and A u = second w; x, u and w of
// length 1. With friction lambda is a complex pair, and the lengths of powers of A swing about it: little where x and u
// are parallel all the same, because the units of positions and momenta are far apart.
double largest_eigenvalue(const std::vector<double>& x, const std::vector<double>& u, const std::vector<double>& w,
                          double first, double second) {
    constexpr double parallel = 1e-6;
    const double xu = product(x, u), xw = product(x, w), uw = product(u, w), apart = 1 - xu * xu;
    if (!(apart > parallel)) return std::sqrt(first * second);
    const double a = second * (uw - xu * xw) / apart, b = first * second * (xw - xu * uw) / apart;
    const double discriminant = a * a + 4 * b;
    return discriminant < 0 ? std::sqrt(-b) : (std::fabs(a) + std::sqrt(discriminant)) / 2;
}

}  // namespace

template <class real>
double largest_frequency(const LoadedStepper<real>& stepper, real time, const std::vector<real>& q,
                         const std::vector<real>& p, const std::vector<double>& scale) {
    const std::size_t n = q.size();
    if (stepper.kernel()->constraints > 0) return 0;
    const Equations<real> equations{stepper, time, n};
    std::vector<real> y = q;
    y.insert(y.end(), p.begin(), p.end());

    // x -> A x, in units of the scale
    const auto derivative = [&](const std::vector<double>& x, std::vector<double>& Ax) {
        std::vector<real> ahead = y, behind = y, f_ahead, f_behind;
        for (std::size_t i = 0; i < y.size(); ++i) {
            ahead[i] += static_cast<real>(part * scale[i] * x[i]);
            behind[i] -= static_cast<real>(part * scale[i] * x[i]);
        }
        if (!equations(ahead, f_ahead) || !equations(behind, f_behind)) return false;
        Ax.resize(x.size());
        for (std::size_t i = 0; i < x.size(); ++i)
            Ax[i] = static_cast<double>(f_ahead[i] - f_behind[i]) / (2 * part * scale[i]);
        return true;
    };

    std::vector<double> x(2 * n), Ax, AAx;  // a start that favours no mode
    for (std::size_t i = 0; i < x.size(); ++i) x[i] = i < n ? std::sin(1 + 0.7 * static_cast<double>(i * i)) : 0;
    const double size = norm(x);
    double growth = 0;
    for (double& value : x) value /= size;
    for (int iteration = 0; iteration < iterations; ++iteration) {
        if (!derivative(x, Ax)) return std::nan("");
        const double first = norm(Ax);
        if (!(first > 0)) return first;
        for (double& value : Ax) value /= first;
        if (!derivative(Ax, AAx)) return std::nan("");
        const double second = norm(AAx);
        if (!(second > 0)) return 0;
        for (double& value : AAx) value /= second;
        growth = largest_eigenvalue(x, Ax, AAx, first, second);
        x = AAx;
    }
    return growth;
}

double largest_frequency_near(const LoadedStepper<double>& stepper, double time, const std::vector<double>& q,
                              const std::vector<double>& p, const std::vector<double>& scale) {
    std::vector<double> closer;
    for (std::size_t i = 0; i < scale.size(); ++i)
        closer.push_back(near * std::fmax(scale[i], std::fabs(i < q.size() ? q[i] : p[i - q.size()])));
    return std::fmin(largest_frequency(stepper, time, q, p, scale), largest_frequency(stepper, time, q, p, closer));
}

template double largest_frequency(const LoadedStepper<double>&, double, const std::vector<double>&,
                                  const std::vector<double>&, const std::vector<double>&);
template double largest_frequency(const LoadedStepper<long double>&, long double, const std::vector<long double>&,
                                  const std::vector<long double>&, const std::vector<double>&);
template double largest_frequency(const LoadedStepper<__float128>&, __float128, const std::vector<__float128>&,
                                  const std::vector<__float128>&, const std::vector<double>&);

}  // namespace lobatto
