// SPDX-License-Identifier: MIT
// The harmonic oscillator and the plane pendulum, solved exactly. DLMF chapters 19 (integrals) and 22 (functions).
#include "runtime/measure/reference.hpp"

#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace lobatto {

namespace {

using real = long double;
constexpr real pi = std::numbers::pi_v<real>;
constexpr real pi_rest = -5.01655761266833202355732708e-20L;  // the true pi minus `pi`
constexpr real epsilon = std::numeric_limits<real>::epsilon();

// Carlson's R_F(x, y, 1) by duplication (DLMF 19.26.18), ended by the series 19.36.1.
real carlson(real x, real y) {
    real z = 1;
    const real mean0 = (x + y + z) / 3;
    real mean = mean0, spread = std::fmax(std::fabs(mean - x), std::fmax(std::fabs(mean - y), std::fabs(mean - z)));
    real X = mean - x, Y = mean - y;
    while (spread > 0.0025L * mean) {  // the series errs by about (spread / mean)^8 / 100
        const real root = std::sqrt(x * y) + std::sqrt(y * z) + std::sqrt(z * x);
        x = (x + root) / 4;
        y = (y + root) / 4;
        z = (z + root) / 4;
        mean = (mean + root) / 4;
        spread /= 4;
        X /= 4;
        Y /= 4;
    }
    X /= mean;
    Y /= mean;
    const real Z = -X - Y, e2 = X * Y - Z * Z, e3 = X * Y * Z;
    const real series = 1 - e2 / 10 + e3 / 14 + e2 * e2 / 24 - 3 * e2 * e3 / 44 - 5 * e2 * e2 * e2 / 208 +
                        3 * e3 * e3 / 104 + e2 * e2 * e3 / 16;
    return series / std::sqrt(mean);
}

// The scale of arithmetic-geometric means 1, k', and from it K(k) and the amplitude am(u, k) (DLMF 22.20.3 to 22.20.5).
class Modulus {
public:
    explicit Modulus(real complement) {
        real a = 1, b = complement;
        while (true) {
            const real c = (a - b) / 2;
            if (!(c > epsilon * a / 4) || depth_ == ratio_.size()) break;
            const real mean = (a + b) / 2;
            b = std::sqrt(a * b);
            a = mean;
            ratio_[depth_++] = c / a;
        }
        limit_ = a;
    }

    real quarter_period() const { return pi / (2 * limit_); }

    // |u| <= 2K: larger arguments are reduced by the caller, who counts the turns.
    real amplitude(real u) const {
        real angle = std::ldexp(limit_ * u, static_cast<int>(depth_));
        for (std::size_t i = depth_; i-- > 0;) angle = (angle + std::asin(ratio_[i] * std::sin(angle))) / 2;
        return angle;
    }

private:
    std::array<real, 32> ratio_{};  // c_i / a_i; the means converge quadratically, after log2 log(1/k') halvings
    std::size_t depth_ = 0;
    real limit_ = 1;
};

// value - count * 2 pi, with pi to twice the precision.
real without_turns(real value, real count) {
    return std::fma(-count, 2 * pi, value) - count * 2 * pi_rest;
}

// q between the dead points: sin(q/2) = k sn(w t + u0, k), q' = 2 w k cn. `sine` and `rate` are sin(q0/2) and q0'/(2w).
PhasePoint libration(real omega, real sine, real rate, real complement_squared, real time) {
    const real k = std::hypot(sine, rate);
    if (k == 0) return {};
    const Modulus modulus(std::sqrt(complement_squared));
    const real K = modulus.quarter_period();
    const real sn = sine / k, cn = rate / k, dn_squared = complement_squared + rate * rate;  // dn = cos(q0/2)
    real u = sn * carlson(cn * cn, dn_squared);
    if (cn < 0) u = std::copysign(2 * K, sn) - u;
    const real angle = modulus.amplitude(std::remainder(u + std::remainder(omega * time, 4 * K), 4 * K));
    const real cosine = k * std::cos(angle);
    return {2 * std::atan2(k * std::sin(angle), std::hypot(std::sqrt(complement_squared), cosine)), 2 * omega * cosine};
}

// q runs over the top: q/2 = am(k w t + u0, 1/k), q' = 2 w k dn. `half` is q0/2 in [-pi/2, pi/2], rate > 0.
PhasePoint rotation(real omega, real half, real rate, real excess_squared, real time) {
    const real k = std::hypot(std::sin(half), rate);
    const real complement_squared = excess_squared / k / k;
    const Modulus modulus(std::sqrt(complement_squared));
    const real K = modulus.quarter_period();
    const real cosine = std::cos(half);
    const real u = std::sin(half) * carlson(cosine * cosine, (rate / k) * (rate / k)) + k * omega * time;
    const real turns = std::nearbyint(u / (2 * K));
    const real angle = modulus.amplitude(std::remainder(u, 2 * K));
    return {2 * angle + turns * 2 * pi, 2 * omega * k * std::hypot(std::sqrt(complement_squared), std::cos(angle) / k)};
}

}  // namespace

PhasePoint harmonic_solution(real omega_squared, real q0, real velocity0, real time) {
    if (omega_squared == 0) return {q0 + velocity0 * time, velocity0};
    const real omega = std::sqrt(std::fabs(omega_squared)), phase = omega * time;
    if (omega_squared < 0) {
        return {q0 * std::cosh(phase) + velocity0 / omega * std::sinh(phase),
                q0 * omega * std::sinh(phase) + velocity0 * std::cosh(phase)};
    }
    return {q0 * std::cos(phase) + velocity0 / omega * std::sin(phase),
            velocity0 * std::cos(phase) - q0 * omega * std::sin(phase)};
}

PhasePoint pendulum_solution(real omega_squared, real q0, real velocity0, real time) {
    if (omega_squared == 0) return harmonic_solution(0, q0, velocity0, time);
    if (omega_squared < 0) {  // the pendulum upside down
        const PhasePoint hanging = pendulum_solution(-omega_squared, q0 - pi, velocity0, time);
        return {hanging.q + pi, hanging.velocity};
    }
    const real omega = std::sqrt(omega_squared);
    const real turns = std::nearbyint(q0 / (2 * pi));
    const real half = without_turns(q0, turns) / 2;
    const real sine = std::sin(half), cosine = std::fabs(std::cos(half)), rate = velocity0 / (2 * omega);
    const real complement_squared = (cosine - std::fabs(rate)) * (cosine + std::fabs(rate));  // 1 - k^2
    const real direction = rate < 0 ? -1 : 1;
    PhasePoint point;
    if (complement_squared > 0) {
        point = libration(omega, sine, rate, complement_squared, time);
    } else if (complement_squared < 0) {
        point = rotation(omega, direction * half, direction * rate, -complement_squared, time);
        point = {direction * point.q, direction * point.velocity};
    } else {  // the separatrix: tan(q/2) = sinh(w t + u0)
        const real u = std::asinh(direction * sine / cosine) + omega * time;
        point = {direction * 2 * std::atan(std::sinh(u)), direction * 2 * omega / std::cosh(u)};
    }
    return {point.q + turns * 2 * pi, point.velocity};
}

real pendulum_period(real omega_squared, real amplitude) {
    return 4 * Modulus(std::fabs(std::cos(amplitude / 2))).quarter_period() / std::sqrt(omega_squared);
}

}  // namespace lobatto
