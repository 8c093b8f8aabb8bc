// SPDX-License-Identifier: MIT
// How fast nearby trajectories diverge: the eigenvalues of one step, and the growth of a linear kernel's own motion.
#include "runtime/measure/monodromy.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <random>

#include "runtime/measure/linear_algebra.hpp"

namespace lobatto {

namespace {

using Eigen::MatrixXd;
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// One motion, its momenta in a unit in which they are as large as positions.
struct State {
    std::vector<double> q, p;
};

bool advance(LoadedStepper<double>& stepper, State& state, long steps) {
    if (stepper.start(0, state.q, state.p) != LOBATTO_OK) return false;
    lobatto_advance call{};
    while (call.steps_done < steps) {
        lobatto_advance more{};
        more.steps = steps - call.steps_done;
        if (stepper.advance(more) != LOBATTO_OK || more.steps_done == 0) return false;
        call.steps_done += more.steps_done;
    }
    double time;
    stepper.state(time, state.q, state.p);
    return true;
}

}  // namespace

std::optional<std::vector<std::complex<double>>> step_eigenvalues(const LoadedStepper<double>& stepper, double step,
                                                                  double time, const std::vector<double>& q,
                                                                  const std::vector<double>& p, int steps) {
    const auto n = static_cast<Eigen::Index>(q.size());
    MatrixXd product = MatrixXd::Identity(2 * n, 2 * n);
    std::vector<double> q0 = q, p0 = p, q1, p1, T;
    for (int k = 0; k < steps; ++k) {
        if (stepper.tangent(time + k * step, q0, p0, q1, p1, T) != LOBATTO_OK) return std::nullopt;
        product = Eigen::Map<const RowMajor>(T.data(), 2 * n, 2 * n) * product;
        q0 = q1;
        p0 = p1;
    }
    if (!product.allFinite()) return std::nullopt;
    // Positions and momenta in units that make their blocks alike.
    const double down = product.topRightCorner(n, n).norm(), up = product.bottomLeftCorner(n, n).norm();
    if (const double unit = std::sqrt(up / down); unit > 0 && std::isfinite(unit)) {
        product.topRightCorner(n, n) *= unit;
        product.bottomLeftCorner(n, n) /= unit;
    }
    const auto eigenvalues_of_product = eigenvalues(product);
    if (!eigenvalues_of_product) return std::nullopt;
    std::vector<std::complex<double>> values(eigenvalues_of_product->begin(), eigenvalues_of_product->end());
    std::sort(values.begin(), values.end(), [](const auto& x, const auto& y) {
        return std::abs(x) != std::abs(y) ? std::abs(x) > std::abs(y) : std::arg(x) > std::arg(y);
    });
    return values;
}

std::optional<double> measured_rate(LoadedStepper<double>& stepper, double step, long steps) {
    constexpr long block = 8;
    const auto n = static_cast<std::size_t>(stepper.kernel()->coordinates);
    State state{std::vector<double>(n), std::vector<double>(n)}, rest = state;
    std::mt19937_64 generator(1);
    const auto random = [&] { return static_cast<double>(generator() >> 11) * 0x1p-52 - 1; };
    std::vector<double> velocity(n);
    for (std::size_t k = 0; k < n; ++k) {
        state.q[k] = random();
        velocity[k] = random() / step;
    }
    state.p = stepper.momentum(0, state.q, velocity);
    const std::vector<double> momentum = stepper.momentum(0, state.q, velocity);
    double momentum_size = 0;
    for (const double p : momentum) momentum_size = std::fmax(momentum_size, std::fabs(p));
    const double unit = momentum_size > 0 ? 1 / momentum_size : 1;

    double scale = 0;                      // ln of what the distance was divided by
    double largest[2] = {-1e300, -1e300};  // ln of the largest distance in the two halves
    for (long done = 0; done < steps; done += block) {
        if (!advance(stepper, state, block) || !advance(stepper, rest, block)) return std::nullopt;
        double distance = 0;
        for (std::size_t k = 0; k < n; ++k)
            distance = std::fmax(
                distance, std::fmax(std::fabs(state.q[k] - rest.q[k]), unit * std::fabs(state.p[k] - rest.p[k])));
        if (!std::isfinite(distance) || distance <= 0) return std::nullopt;
        double& most = largest[2 * done >= steps ? 1 : 0];
        most = std::fmax(most, scale + std::log(distance));
        if (distance > 1e-50 && distance < 1e50) continue;
        for (std::size_t k = 0; k < n; ++k) {
            state.q[k] = (state.q[k] - rest.q[k]) / distance;
            state.p[k] = (state.p[k] - rest.p[k]) / distance;
            rest.q[k] = rest.p[k] = 0;
        }
        scale += std::log(distance);
    }
    return (largest[1] - largest[0]) / static_cast<double>(steps / 2);
}

}  // namespace lobatto
