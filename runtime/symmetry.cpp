// SPDX-License-Identifier: MIT
// Linear symmetries of a kernel's system, found by sampling its forces, and the momenta that Noether's theorem
// conserves.
//
// With B = M^-1 A the condition on the kinetic energy says that A is antisymmetric, and the one on V becomes linear in
// the entries of A and d: sum_{i<j} A_ij (q_j W_i - q_i W_j) + d . M W = 0 for W = M^-1 grad V at every sampled q.
#include "runtime/symmetry.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <cmath>
#include <random>

#include "runtime/error.hpp"
#include "runtime/trajectory.hpp"

namespace lobatto {

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double tiny = 1e-7;

// The rows that span a space, reduced so that each has a leading one where the others have zero.
MatrixXd reduced(MatrixXd rows) {
    Eigen::Index done = 0;
    for (Eigen::Index column = 0; column < rows.cols() && done < rows.rows(); ++column) {
        Eigen::Index pivot = 0;
        if (rows.col(column).tail(rows.rows() - done).cwiseAbs().maxCoeff(&pivot) < tiny) continue;
        rows.row(done).swap(rows.row(done + pivot));
        rows.row(done) /= rows(done, column);
        for (Eigen::Index row = 0; row < rows.rows(); ++row)
            if (row != done) rows.row(row) -= rows(row, column) * rows.row(done);
        ++done;
    }
    return rows.unaryExpr([](double x) { return std::fabs(x) < tiny ? 0.0 : x; });
}

// Rounding of simple numbers, so that halves are halves.
double simple(double x) {
    const double nearest = std::round(x * 5040) / 5040;
    return nearest != 0 && std::fabs(x - nearest) < tiny ? nearest : x;
}

// " + 2*x*p_y" and the like, one after the other.
void append(std::string& sum, double coefficient, const std::string& factor) {
    if (coefficient == 0) return;
    const double size = std::fabs(coefficient);
    sum += sum.empty() ? (coefficient < 0 ? "-" : "") : (coefficient < 0 ? " - " : " + ");
    sum += size == 1 ? factor : fmt::format("{:.6g}*{}", size, factor);
}

Symmetry symmetry_of(const MatrixXd& B, const VectorXd& d, const std::vector<std::string>& names) {
    const Eigen::Index n = d.size();
    Symmetry symmetry;
    for (Eigen::Index k = 0; k < n; ++k)
        for (Eigen::Index l = 0; l < n; ++l) symmetry.B.push_back(B(k, l));
    symmetry.d.assign(d.data(), d.data() + n);
    const auto name = [&](Eigen::Index k) { return names[static_cast<std::size_t>(k)]; };
    std::vector<Eigen::Index> moved;
    for (Eigen::Index k = 0; k < n; ++k) {
        append(symmetry.momentum, d(k), "p_" + name(k));
        if (B.row(k).any()) moved.push_back(k);
    }
    for (Eigen::Index k = 0; k < n; ++k)
        for (Eigen::Index l = k; l < n; ++l) {  // in pairs, so that a plane rotation reads x*p_y - y*p_x
            append(symmetry.momentum, B(l, k), name(k) + "*p_" + name(l));
            if (k != l) append(symmetry.momentum, B(k, l), name(l) + "*p_" + name(k));
        }
    if (moved.empty())
        symmetry.kind = "translation";
    else if (moved.size() == 2 && B(moved[0], moved[0]) == 0 && B(moved[0], moved[1]) == -B(moved[1], moved[0]))
        symmetry.kind = fmt::format("rotation in the ({}, {}) plane", name(moved[0]), name(moved[1]));
    else
        symmetry.kind = "rotation";
    return symmetry;
}

}  // namespace

std::vector<Symmetry> find_symmetries(const Kernel& kernel, const std::vector<double>& parameters,
                                      const std::vector<double>& q, double step,
                                      const std::vector<std::string>& names) {
    LoadedStepper<double> stepper(kernel);
    if (stepper.prepare(parameters, step) != LOBATTO_OK)
        throw ComputationError("symmetries cannot be looked for: the kernel refuses the scene's values");
    const Eigen::Index n = static_cast<Eigen::Index>(q.size()), pairs = n * (n - 1) / 2, unknowns = pairs + n;
    MatrixXd M(n, n);
    for (Eigen::Index k = 0; k < n; ++k) {
        std::vector<double> unit(q.size(), 0.0);
        unit[static_cast<std::size_t>(k)] = 1;
        const std::vector<double> column = stepper.momentum(q, unit);
        M.col(k) = Eigen::Map<const VectorXd>(column.data(), n);
    }
    M /= M.cwiseAbs().maxCoeff();  // its unit does not matter, and may lie near underflow

    // One row a sample, half of them to find and half to confirm, and the sum of its terms' sizes for each entry;
    // samples where the forces are not finite are left out, and the next ones are nearer.
    const Eigen::Index wanted = 3 * unknowns;
    MatrixXd conditions(2 * wanted, unknowns), sizes(2 * wanted, unknowns);
    std::mt19937_64 generator(1);
    double spread = 1;
    Eigen::Index row = 0;
    for (int attempt = 0; row < 2 * wanted && attempt < 200 * wanted; ++attempt) {
        std::vector<double> sample = q, W, S;
        for (double& x : sample)
            x += spread * (1 + std::fabs(x)) * (static_cast<double>(generator() >> 11) * 0x1p-52 - 1);
        stepper.acceleration(sample, W, S);
        const Eigen::Map<const VectorXd> force(W.data(), n), x(sample.data(), n);
        if (!force.allFinite()) {
            spread *= 0.9;
            continue;
        }
        Eigen::Index unknown = 0;
        for (Eigen::Index i = 0; i < n; ++i)
            for (Eigen::Index j = i + 1; j < n; ++j, ++unknown) {
                conditions(row, unknown) = x(j) * force(i) - x(i) * force(j);
                sizes(row, unknown) = std::fabs(x(j) * force(i)) + std::fabs(x(i) * force(j));
            }
        conditions.row(row).tail(n) = M * force;
        sizes.row(row).tail(n) = M.cwiseAbs() * force.cwiseAbs();
        ++row;
    }
    if (row < 2 * wanted)
        throw ComputationError("symmetries cannot be looked for: the forces are not finite around the start");
    // Every unknown in the unit of its own terms, then every sample: a weak force counts as much as a strong one.
    VectorXd units = sizes.colwise().maxCoeff().transpose();
    MatrixXd scaled = conditions.topRows(wanted);
    for (Eigen::Index unknown = 0; unknown < unknowns; ++unknown) {
        if (!(units(unknown) > 0)) units(unknown) = 1;
        scaled.col(unknown) /= units(unknown);
    }
    for (Eigen::Index sample = 0; sample < wanted; ++sample)
        if (const double size = sizes.row(sample).transpose().cwiseQuotient(units).maxCoeff(); size > 0)
            scaled.row(sample) /= size;
    const Eigen::JacobiSVD<MatrixXd> decomposition(scaled, Eigen::ComputeFullV);
    const VectorXd& values = decomposition.singularValues();
    Eigen::Index rank = 0;
    while (rank < unknowns && values(rank) > 1e-10 * std::fmax(values(0), 1.0)) ++rank;

    std::vector<Symmetry> symmetries;
    if (rank == unknowns) return symmetries;
    // The entries of A lead, so that translations are reduced to directions of their own, and rotations by them.
    MatrixXd space = reduced(decomposition.matrixV().rightCols(unknowns - rank).transpose());
    for (Eigen::Index s = 0; s < space.rows(); ++s) {
        space.row(s).array() /= units.transpose().array();
        Eigen::Index leading = 0;
        while (leading + 1 < unknowns && space(s, leading) == 0) ++leading;
        space.row(s) = (space.row(s) / space(s, leading)).unaryExpr(&simple).eval();
        const VectorXd direction = space.row(s).transpose();
        const double missed = (conditions.bottomRows(wanted) * direction).cwiseAbs().maxCoeff();
        const double terms = (sizes.bottomRows(wanted) * direction.cwiseAbs()).maxCoeff();
        if (!(missed <= 1e-9 * terms)) continue;
        MatrixXd A = MatrixXd::Zero(n, n);
        Eigen::Index unknown = 0;
        for (Eigen::Index i = 0; i < n; ++i)
            for (Eigen::Index j = i + 1; j < n; ++j, ++unknown) {
                A(i, j) = space(s, unknown);
                A(j, i) = -space(s, unknown);
            }
        // The sign that makes a rotation x*p_y - y*p_x, and a largest entry of 1.
        MatrixXd B = M.inverse() * A;
        const double largest = B.cwiseAbs().maxCoeff();
        const double scale = largest > 0 ? -1 / largest : 1;
        symmetries.push_back(symmetry_of(scale * B, scale * space.row(s).tail(n).transpose(), names));
    }
    return symmetries;
}

MomentumVariation momentum_variation(const Kernel& kernel, const Symmetry& symmetry,
                                     const std::vector<double>& parameters, const std::vector<double>& q,
                                     const std::vector<double>& p, double step, std::int64_t steps) {
    const std::size_t n = q.size();
    double least = 0, most = 0, size = 0;
    bool first = true;
    TrajectoryRequest request;
    request.parameters = parameters;
    request.q = q;
    request.p = p;
    request.step = step;
    request.steps = steps;
    request.sink = [&](const Records& records) {
        for (std::int64_t i = 0; i < records.count; ++i) {
            const double* const position = records.rows + i * records.columns + 1;
            double value = 0, sizes = 0;
            for (std::size_t k = 0; k < n; ++k) {
                const double* const momentum = position + n;
                value += momentum[k] * symmetry.d[k];
                sizes += std::fabs(momentum[k] * symmetry.d[k]);
                for (std::size_t l = 0; l < n; ++l) {
                    const double term = momentum[k] * symmetry.B[k * n + l] * position[l];
                    value += term;
                    sizes += std::fabs(term);
                }
            }
            least = first ? value : std::fmin(least, value);
            most = first ? value : std::fmax(most, value);
            size = std::fmax(size, sizes);
            first = false;
        }
    };
    const TrajectoryResult run = integrate(kernel, request);
    return {run.steps_done, size > 0 ? (most - least) / size : 0.0};
}

}  // namespace lobatto
