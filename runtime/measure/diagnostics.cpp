// SPDX-License-Identifier: MIT
// The symplectic defect and the discrete energy, from the kernel's tangent map.
#include "runtime/measure/diagnostics.hpp"

#include <gmpxx.h>

#include <Eigen/Core>
#include <cmath>

#include "runtime/error.hpp"
#include "runtime/kernel/base/double_double.hpp"
#include "runtime/measure/linear_algebra.hpp"
#include "runtime/run/parts.hpp"

namespace lobatto {

namespace {

constexpr int most_coordinates = 64;  // of a discrete energy: matrices of twice as many rows

}  // namespace

template <class real>
real symplectic_defect(const LoadedStepper<real>& stepper, const std::vector<real>& q, const std::vector<real>& p) {
    const std::size_t n = q.size(), rows = 2 * n;
    std::vector<real> q1, p1, T;
    if (stepper.tangent(0, q, p, q1, p1, T) != LOBATTO_OK)
        throw ComputationError("the symplectic defect cannot be measured: the step from this state fails");
    const auto size = [](real x) { return x < real(0) ? -x : x; };
    real defect = 0, squares = 0;
    // Units of q and p in which the blocks dq1/dp and dp1/dq are of one size: else the larger one's square hides all.
    real to_q = 0, to_p = 0;
    for (std::size_t a = 0; a < n; ++a)
        for (std::size_t b = n; b < rows; ++b) {
            to_q = size(T[a * rows + b]) > to_q ? size(T[a * rows + b]) : to_q;
            to_p = size(T[b * rows + a]) > to_p ? size(T[b * rows + a]) : to_p;
        }
    const double exponent =
        std::round(std::log2(static_cast<double>(to_q)) / 2 - std::log2(static_cast<double>(to_p)) / 2);
    const real unit =
        std::fabs(exponent) < 1000 ? static_cast<real>(std::ldexp(1.0, static_cast<int>(exponent))) : real(1);
    for (std::size_t a = 0; a < n; ++a)
        for (std::size_t b = n; b < rows; ++b) {
            T[a * rows + b] /= unit;
            T[b * rows + a] *= unit;
        }
    for (const real entry : T) squares += entry * entry;
    for (std::size_t a = 0; a < rows; ++a) {
        for (std::size_t b = 0; b < a; ++b) {           // T^T J T - J is antisymmetric
            real sum = a == b + n ? real(1) : real(0);  // -J_ab
            for (std::size_t i = 0; i < n; ++i)
                sum += T[i * rows + a] * T[(n + i) * rows + b] - T[(n + i) * rows + a] * T[i * rows + b];
            if (!(size(sum) <= defect)) defect = size(sum);
        }
    }
    return squares > real(1) ? defect / squares : defect;
}

template float symplectic_defect(const LoadedStepper<float>&, const std::vector<float>&, const std::vector<float>&);
template double symplectic_defect(const LoadedStepper<double>&, const std::vector<double>&, const std::vector<double>&);
template long double symplectic_defect(const LoadedStepper<long double>&, const std::vector<long double>&,
                                       const std::vector<long double>&);
template DoubleDouble symplectic_defect(const LoadedStepper<DoubleDouble>&, const std::vector<DoubleDouble>&,
                                        const std::vector<DoubleDouble>&);
template __float128 symplectic_defect(const LoadedStepper<__float128>&, const std::vector<__float128>&,
                                      const std::vector<__float128>&);

double symplectic_defect(const NumberStepper& stepper, const NumberStepper::Parts& q, const NumberStepper::Parts& p) {
    const std::size_t n = stepper.coordinates(), rows = 2 * n, parts = stepper.parts();
    NumberStepper::Parts whole;
    if (stepper.tangent(as_parts({0}, parts), q, p, whole) != LOBATTO_OK)
        throw ComputationError("the symplectic defect cannot be measured: the step from this state fails");
    const mpf_class zero(0, 2 * 53 * parts + 64);  // its precision is that of all others
    std::vector<mpf_class> T(rows * rows, zero);
    for (const double part : whole)  // GMP knows finite numbers only
        if (!std::isfinite(part))
            throw ComputationError("the symplectic defect cannot be measured: the step has no derivative there");
    for (std::size_t i = 0; i < whole.size(); ++i) T[i / parts] += whole[i];
    double to_q = 0, to_p = 0;
    for (std::size_t a = 0; a < n; ++a)
        for (std::size_t b = n; b < rows; ++b) {
            to_q = std::fmax(to_q, std::fabs(T[a * rows + b].get_d()));
            to_p = std::fmax(to_p, std::fabs(T[b * rows + a].get_d()));
        }
    const double exponent = std::round(std::log2(to_q) / 2 - std::log2(to_p) / 2),
                 unit = std::fabs(exponent) < 1000 ? std::ldexp(1.0, static_cast<int>(exponent)) : 1;
    for (std::size_t a = 0; a < n; ++a)
        for (std::size_t b = n; b < rows; ++b) {
            T[a * rows + b] /= unit;
            T[b * rows + a] *= unit;
        }
    double squares = 0, defect = 0;
    for (const mpf_class& entry : T) squares += entry.get_d() * entry.get_d();
    for (std::size_t a = 0; a < rows; ++a)
        for (std::size_t b = 0; b < a; ++b) {
            mpf_class sum = zero, product = zero;
            if (a == b + n) sum = 1;  // -J_ab
            for (std::size_t i = 0; i < n; ++i) {
                product = T[i * rows + a] * T[(n + i) * rows + b];
                sum += product;
                product = T[(n + i) * rows + a] * T[i * rows + b];
                sum -= product;
            }
            defect = std::fmax(defect, std::fabs(sum.get_d()));
        }
    return squares > 1 ? defect / squares : defect;
}

double DiscreteEnergy::operator()(const double* q, const double* p) const {
    Eigen::VectorXd z(2 * n);
    z << Eigen::Map<const Eigen::VectorXd>(q, n), Eigen::Map<const Eigen::VectorXd>(p, n);
    z -= Eigen::Map<const Eigen::VectorXd>(centre.data(), 2 * n);
    const Eigen::Map<const Eigen::MatrixXd> matrix(form.data(), 2 * n,
                                                   2 * n);  // symmetric: the order of storage does not matter
    return z.dot(matrix * z) + z.dot(Eigen::Map<const Eigen::VectorXd>(slope.data(), 2 * n));
}

std::optional<DiscreteEnergy> discrete_energy(const LoadedStepper<double>& stepper) {
    const lobatto_kernel& kernel = stepper.kernel().table();
    const int n = kernel.coordinates;
    if (kernel.linear == 0 || kernel.autonomous == 0 || n > most_coordinates) return std::nullopt;
    const std::vector<double> zero(static_cast<std::size_t>(n), 0.0);
    std::vector<double> q1, p1, T;
    if (stepper.tangent(0, zero, zero, q1, p1, T) != LOBATTO_OK) return std::nullopt;
    using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    const Matrix Phi = Eigen::Map<const Matrix>(T.data(), 2 * n, 2 * n);
    Eigen::VectorXd shift(2 * n);  // the image of zero
    shift << Eigen::Map<const Eigen::VectorXd>(q1.data(), n), Eigen::Map<const Eigen::VectorXd>(p1.data(), n);

    // (1 - Phi) z* = shift, where it has a solution.
    const Matrix difference = Matrix::Identity(2 * n, 2 * n) - Phi;
    const Eigen::VectorXd centre = least_squares(difference, shift);
    Eigen::VectorXd left = shift - difference * centre;
    if (left.norm() <= 1e-10 * shift.norm()) left.setZero();

    Matrix J = Matrix::Zero(2 * n, 2 * n);
    J.topRightCorner(n, n).setIdentity();
    J.bottomLeftCorner(n, n) = -Matrix::Identity(n, n);
    const Matrix form = -0.25 * (J * Phi + (J * Phi).transpose());
    const Eigen::VectorXd slope = -0.5 * (J * left + Phi.transpose() * (J * left));
    return DiscreteEnergy{n,
                          {form.data(), form.data() + form.size()},
                          {centre.data(), centre.data() + centre.size()},
                          {slope.data(), slope.data() + slope.size()}};
}

}  // namespace lobatto
