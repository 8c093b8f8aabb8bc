// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/accuracy/error_estimate.hpp"

#include <cln/cln.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <type_traits>

#include "generator/method/propagation.hpp"
#include "runtime/measure/polynomial_estimate.hpp"

namespace lobatto {

namespace {

constexpr double turning = 0.25;     // of the swing: what angles turn faster
constexpr double shortest = 0.5;     // z, below which the leading power of the phase error does
constexpr double shadow_work = 3e5;  // steps times coordinates that a second run may take

// Coefficients of a polynomial, lowest first.
std::vector<long double> coefficients_of(const GiNaC::ex& polynomial, const GiNaC::symbol& z) {
    std::vector<long double> result;
    for (int power = 0; power <= polynomial.degree(z); ++power) {
        const GiNaC::numeric exact = GiNaC::ex_to<GiNaC::numeric>(polynomial.coeff(z, power).evalf());
        const double high = exact.to_double();
        result.push_back(static_cast<long double>(high) +
                         static_cast<long double>((exact - GiNaC::numeric(high)).to_double()));
    }
    return result;
}

long double value_of(const std::vector<long double>& polynomial, long double z) {
    long double sum = 0;
    for (std::size_t i = polynomial.size(); i-- > 0;) sum = sum * z + polynomial[i];
    return sum;
}

template <class real>
double size(real x) {
    return std::fabs(static_cast<double>(x));
}

// The largest distance at the states of a motion that begins beside theirs, in units of that at the start.
template <class real>
double growth_of(LoadedStepper<real>& stepper, const States<real>& states, real step,
                 const std::vector<double>& scale) {
    const double away = std::is_same_v<real, float> ? 3e-4 : 1e-7;  // of the amplitude: far above rounding
    std::vector<real> start = states.front();
    double first = 0, largest = 0;
    for (std::size_t k = 0; k < scale.size(); ++k) {
        // Each by its own amplitude: what is far for a heavy body throws a light one out of its way.
        real low = start[1 + k], high = low;
        for (const std::vector<real>& state : states)
            low = std::min(low, state[1 + k]), high = std::max(high, state[1 + k]);
        const double way = away * static_cast<double>(high - low) * std::cos(1 + 0.7 * static_cast<double>(k));
        start[1 + k] += static_cast<real>(way);
        first = std::fmax(first, std::fabs(way) / scale[k]);
    }
    if (!(first > 0) || start_at(stepper, start) != LOBATTO_OK) return 0;
    std::int64_t done = 0;
    for (const std::vector<real>& state : states) {
        const std::int64_t steps = std::llround(static_cast<double>((state[0] - start[0]) / step)) - done;
        if (steps <= 0) continue;
        const std::vector<real> there = state_after(stepper, steps);
        if (there.empty()) break;
        done += steps;
        largest = std::fmax(largest, distance(there, state, scale));
    }
    return largest / first;
}

template <class real>
double local_error_of(LoadedStepper<real>& stepper, const States<real>& states, const std::vector<real>& parameters,
                      real step, const std::vector<double>& scale) {
    double sum = 0;
    int count = 0;
    for (const Halved<real>& one : halved(stepper, states, parameters, step, scale)) {
        if (one.end.empty() || !std::isfinite(one.difference)) continue;
        sum += one.difference;
        ++count;
    }
    return count > 0 ? sum / count : 0;
}

// cos(x + phase) = a/delta at the short x, where phase is far below the rounding of either side.
double small_phase(const Propagation& step) {
    const auto exact = [](const GiNaC::ex& value) {
        return cln::cl_float(cln::the<cln::cl_R>(GiNaC::ex_to<GiNaC::numeric>(value).to_cl_N()), cln::float_format(60));
    };
    const GiNaC::numeric x(static_cast<long>(shortest * 1000), 1000L);
    const GiNaC::ex cosine = (step.a / step.delta).subs(step.z == x * x);
    const cln::cl_F angle = exact(x);
    return std::fabs(cln::double_approx((cln::cos(angle) - exact(cosine)) / cln::sin(angle)));
}

}  // namespace

double error_power(const Method& method) {
    const int degree = method.family == Family::lobatto     ? method.points - 1
                       : method.family == Family::splitting ? 5  // of the polynomial between the ends of a step
                                                            : method.points;
    return (method.order() + 1.0) / (degree + 1.0);
}

ErrorEstimate::ErrorEstimate(const Quadrature& quadrature) {
    if (quadrature.is_explicit())
        for (const double end : {0.0, 1.0})
            for (const int derivative : {0, 1, 2}) data_.push_back({end, derivative});
    else
        for (const GiNaC::ex& point : quadrature.control)
            data_.push_back({GiNaC::ex_to<GiNaC::numeric>(point.evalf()).to_double(), 0});
    const auto lagrange = [&](std::size_t j, double theta) {
        double product = 1;
        for (std::size_t i = 0; i < data_.size(); ++i)
            if (i != j) product *= (theta - data_[i].point) / (data_[j].point - data_[i].point);
        return product;
    };
    // Hermite's polynomials of degree 5: those of the end 1 are those of the end 0, seen from there.
    const auto hermite = [](const Datum& datum, double theta) {
        const double t = datum.point == 0 ? theta : 1 - theta, sign = datum.point == 0 ? 1 : -1, rest = 1 - t;
        const double cube = rest * rest * rest;
        return datum.derivative == 0   ? cube * (1 + t * (3 + 6 * t))
               : datum.derivative == 1 ? sign * cube * t * (1 + 3 * t)
                                       : cube * t * t / 2;
    };
    for (const double theta : {0.25, 0.5, 0.75}) {
        std::vector<double> ahead, here;
        for (std::size_t j = 0; j < data_.size(); ++j) {
            ahead.push_back(quadrature.is_explicit() ? hermite(data_[j], 1 + theta) : lagrange(j, 1 + theta));
            here.push_back(quadrature.is_explicit() ? hermite(data_[j], theta) : lagrange(j, theta));
        }
        ahead_.push_back(ahead);
        here_.push_back(here);
    }
    const Propagation step = propagation(quadrature);
    order_ = quadrature.order();
    phase_of_short_ = small_phase(step);
    a_ = coefficients_of(step.a, step.z);
    delta_ = coefficients_of(step.delta, step.z);
}

double ErrorEstimate::jump(double z) const {
    double largest = 0;
    for (std::size_t i = 0; i < ahead_.size(); ++i) {
        std::complex<double> sum = 0;
        for (std::size_t j = 0; j < data_.size(); ++j) {
            const std::complex<double> rate = std::pow(std::complex<double>(0, z), data_[j].derivative);
            sum += rate * (ahead_[i][j] * std::polar(1.0, z * data_[j].point) -
                           here_[i][j] * std::polar(1.0, z * (1 + data_[j].point)));
        }
        largest = std::max(largest, std::abs(sum));
    }
    return largest;
}

double ErrorEstimate::phase(double z) const {
    if (z < shortest) return phase_of_short_ * std::pow(z / shortest, order_ + 1);
    const long double square = static_cast<long double>(z) * z;
    const long double cosine = value_of(a_, square) / value_of(delta_, square);
    if (!(std::fabs(cosine) < 1)) return 1;
    return static_cast<double>(std::fabs(std::acos(cosine) - static_cast<long double>(z)));
}

double ErrorEstimate::of_oscillation(double steps, double jump_of_step) const {
    if (!(jump_of_step > 0) || jump(longest_) <= jump_of_step) return 0;
    double below = 0, above = longest_;
    for (int halving = 0; halving < 50; ++halving) {
        const double middle = (below + above) / 2;
        (jump(middle) < jump_of_step ? below : above) = middle;
    }
    return steps * phase(above);
}

double ErrorEstimate::after(double steps, double duration, const Evidence& evidence, double random) const {
    const double way = evidence.rate * duration,
                 laws = std::max(
                     {turning * evidence.swing * way, steps * evidence.local, of_oscillation(steps, evidence.jump)}),
                 error = laws + random * std::sqrt(steps);
    return std::fmax(evidence.certain, way > 0 ? error * std::fmax(1, evidence.growth / way) : error);
}

template <class real>
std::vector<Halved<real>> halved(LoadedStepper<real>& stepper, const States<real>& states,
                                 const std::vector<real>& parameters, real step, const std::vector<double>& scale) {
    std::vector<Halved<real>> steps(states.size());
    for (std::size_t i = 0; i < states.size(); ++i)
        if (start_at(stepper, states[i]) == LOBATTO_OK) steps[i].end = state_after(stepper, 1);
    if (stepper.prepare(parameters, step / 2) != LOBATTO_OK) return {};
    for (std::size_t i = 0; i < states.size(); ++i) {
        if (steps[i].end.empty() || start_at(stepper, states[i]) != LOBATTO_OK) continue;
        const std::vector<real> end = state_after(stepper, 2);
        steps[i].difference = end.empty() ? HUGE_VAL : distance(end, steps[i].end, scale);
    }
    stepper.prepare(parameters, step);
    return steps;
}

template <class real>
std::vector<double> energies_of(const LoadedStepper<real>& stepper, const States<real>& states) {
    std::vector<double> energies;
    real first = 0;
    for (const std::vector<real>& state : states) {
        const auto middle = state.begin() + 1 + static_cast<std::ptrdiff_t>(state.size() / 2);
        real energy = 0;
        const bool is_known =
            stepper.energy(state[0], {state.begin() + 1, middle}, {middle, state.end()}, energy) == LOBATTO_OK;
        if (energies.empty()) first = energy;
        energies.push_back(is_known ? static_cast<double>(energy - first) : std::nan(""));
    }
    return energies;
}

template <class real>
Evidence evidence_of(LoadedStepper<real>& stepper, const States<real>& states, const std::vector<real>& parameters,
                     real step, const std::vector<double>& scale, double power, const std::vector<double>& energies,
                     bool energy_tells) {
    const std::size_t n = scale.size() / 2;
    Evidence evidence;
    if (states.size() < 2) return evidence;
    double sum = 0, motion = 0, lowest = 0, highest = 0;
    int jumps = 0, motions = 0;
    for (std::size_t i = 0; i < states.size(); ++i) {
        const std::vector<real>& state = states[i];
        const auto middle = state.begin() + 1 + static_cast<std::ptrdiff_t>(n);
        const std::vector<real> q(state.begin() + 1, middle), p(middle, state.end());
        std::vector<real> v, Lv, Lq;
        if (stepper.velocity(state[0], q, p, v) != LOBATTO_OK) continue;
        stepper.slopes(state[0], q, v, Lv, Lq);
        double product = 0, slope = 0;  // of the energy: by an error of the whole amplitude it changes so much
        for (std::size_t k = 0; k < n; ++k) {
            product += static_cast<double>(p[k] * v[k]);
            slope += size(Lq[k]) * scale[k] + size(v[k]) * scale[n + k];
            evidence.rate = std::fmax(evidence.rate, std::fmax(size(v[k]) / scale[k], size(Lq[k]) / scale[n + k]));
        }
        if (!energies.empty() && std::isfinite(energies[i])) {
            lowest = std::fmin(lowest, energies[i]);
            highest = std::fmax(highest, energies[i]);
            motion += std::fabs(product);
            ++motions;
            if (slope > 0) evidence.certain = std::fmax(evidence.certain, std::fabs(energies[i]) / slope);
        }
        const double here = polynomial_defect(stepper, state[0], q, p, scale);
        if (!(here >= 0)) continue;
        sum += std::pow(here, power);
        ++jumps;
    }
    if (jumps > 0) evidence.jump = std::pow(sum / jumps, 1 / power);
    if (energy_tells && motion > 0) evidence.swing = (highest - lowest) / (motion / motions);
    if (!energy_tells) evidence.local = local_error_of(stepper, states, parameters, step, scale);
    const double work = static_cast<double>((states.back()[0] - states.front()[0]) / step) * static_cast<double>(n);
    if (work <= shadow_work) evidence.growth = growth_of(stepper, states, step, scale);
    return evidence;
}

template std::vector<Halved<float>> halved(LoadedStepper<float>&, const States<float>&, const std::vector<float>&,
                                           float, const std::vector<double>&);
template std::vector<double> energies_of(const LoadedStepper<float>&, const States<float>&);
template std::vector<Halved<double>> halved(LoadedStepper<double>&, const States<double>&, const std::vector<double>&,
                                            double, const std::vector<double>&);
template std::vector<double> energies_of(const LoadedStepper<double>&, const States<double>&);
template std::vector<Halved<long double>> halved(LoadedStepper<long double>&, const States<long double>&,
                                                 const std::vector<long double>&, long double,
                                                 const std::vector<double>&);
template std::vector<double> energies_of(const LoadedStepper<long double>&, const States<long double>&);
template std::vector<Halved<__float128>> halved(LoadedStepper<__float128>&, const States<__float128>&,
                                                const std::vector<__float128>&, __float128, const std::vector<double>&);
template std::vector<double> energies_of(const LoadedStepper<__float128>&, const States<__float128>&);
template Evidence evidence_of(LoadedStepper<float>&, const States<float>&, const std::vector<float>&, float,
                              const std::vector<double>&, double, const std::vector<double>&, bool);
template Evidence evidence_of(LoadedStepper<double>&, const States<double>&, const std::vector<double>&, double,
                              const std::vector<double>&, double, const std::vector<double>&, bool);
template Evidence evidence_of(LoadedStepper<long double>&, const States<long double>&, const std::vector<long double>&,
                              long double, const std::vector<double>&, double, const std::vector<double>&, bool);
template Evidence evidence_of(LoadedStepper<__float128>&, const States<__float128>&, const std::vector<__float128>&,
                              __float128, const std::vector<double>&, double, const std::vector<double>&, bool);

}  // namespace lobatto
