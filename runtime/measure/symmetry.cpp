// SPDX-License-Identifier: MIT
// Linear symmetries of a kernel's system, found by sampling its slopes, and the momenta that Noether's theorem
// conserves.
//
// The condition is linear in the entries of B and d: with p = dL/dv and f = dL/dq + F at a sampled (t, q, v)
//     sum_kl B_kl (f_k q_l + p_k v_l) + sum_k d_k f_k = 0.
// Constraints phi(q, t) = 0 must not change either: with G = dphi/dq, sum_kl B_kl G_ck q_l + sum_k d_k G_ck = 0.
#include "runtime/measure/symmetry.hpp"

#include <fmt/format.h>

#include <Eigen/Core>
#include <cmath>
#include <random>

#include "runtime/error.hpp"
#include "runtime/measure/linear_algebra.hpp"
#include "runtime/run/trajectory.hpp"

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

// Of a linear map that is no rotation in a plane of the coordinates: by the signs of its entries.
std::string kind_of(const MatrixXd& B) {
    bool turns = true, scales = true;
    for (Eigen::Index k = 0; k < B.rows(); ++k)
        for (Eigen::Index l = 0; l < B.cols(); ++l) {
            turns = turns && (k == l ? B(k, k) == 0 : B(k, l) * B(l, k) < 0 || (B(k, l) == 0 && B(l, k) == 0));
            scales = scales && (k == l || B(k, l) == 0);
        }
    return turns ? "rotation" : scales ? "scaling" : "linear symmetry";
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
        symmetry.kind = kind_of(B);
    return symmetry;
}

// The unknowns of a symmetry, the entries of B, where there are few, then those of b; what they must fulfil; and the
// sum of the sizes of each condition's terms.
struct Samples {
    Eigen::Index wanted = 0, entries = 0, unknowns = 0;
    MatrixXd conditions, sizes;
};

// Two rows a sample: the condition at rest, and what it adds there in motion, so that strong forces do not drown the
// kinetic energy. Half of them are to find and half to confirm. Samples where the slopes are not finite are left out,
// and the next ones are nearer; where they are not so at rest (a Lagrangian like -sqrt(v^2)), another motion takes its
// place.
Samples sample_conditions(const Kernel& kernel, LoadedStepper<double>& stepper, const std::vector<double>& q) {
    const Eigen::Index n = static_cast<Eigen::Index>(q.size());
    Samples samples;
    samples.entries = n <= most_turned ? n * n : 0;
    samples.unknowns = samples.entries + n;
    samples.wanted = 4 * samples.unknowns;
    const Eigen::Index entries = samples.entries, wanted = samples.wanted;
    samples.conditions.resize(2 * wanted, samples.unknowns);
    samples.sizes.resize(2 * wanted, samples.unknowns);
    MatrixXd &conditions = samples.conditions, &sizes = samples.sizes;
    std::mt19937_64 generator(1);
    const auto random = [&] { return static_cast<double>(generator() >> 11) * 0x1p-52 - 1; };
    double spread = 1;
    Eigen::Index row = 0;
    for (int attempt = 0; row < 2 * wanted && attempt < 200 * wanted; ++attempt) {
        std::vector<double> sample = q, Lv, Lq;
        for (double& x : sample) x += spread * (1 + std::fabs(x)) * random();
        const double time = kernel->autonomous ? 0 : spread * random();
        const auto slopes_at = [&](const VectorXd& v, VectorXd& momentum, VectorXd& force) {
            stepper.slopes(time, sample, {v.data(), v.data() + n}, Lv, Lq);
            momentum = Eigen::Map<const VectorXd>(Lv.data(), n);
            force = Eigen::Map<const VectorXd>(Lq.data(), n);
            return momentum.allFinite() && force.allFinite();
        };
        const Eigen::Map<const VectorXd> x(sample.data(), n);
        const auto some_velocity = [&] { return VectorXd(VectorXd::NullaryExpr(n, random) * spread); };
        VectorXd v0 = VectorXd::Zero(n), v1 = some_velocity(), p0, p1, f0, f1;
        if (!slopes_at(v0, p0, f0)) v0 = some_velocity();
        if (!slopes_at(v0, p0, f0) || !slopes_at(v1, p1, f1)) {
            spread *= 0.9;
            continue;
        }
        // What is left of equal forces is rounding. The unit of L does not matter, and may lie near underflow.
        VectorXd added = f1 - f0;
        for (Eigen::Index k = 0; k < n; ++k)
            if (std::fabs(added(k)) <= 0x1p-50 * std::fabs(f0(k))) added(k) = 0;
        const auto unit = [](double a, double b) { return std::fmax(a, b) > 0 ? std::fmax(a, b) : 1.0; };
        const double unit_rest = unit(f0.cwiseAbs().maxCoeff(), p0.cwiseAbs().maxCoeff()),
                     unit_added = unit(added.cwiseAbs().maxCoeff(), p1.cwiseAbs().maxCoeff());
        f0 /= unit_rest;
        added /= unit_added;
        p1 /= unit_added;
        const VectorXd p0_rest = p0 / unit_rest, p0_added = p0 / unit_added;
        for (Eigen::Index unknown = 0; unknown < entries; ++unknown) {
            const Eigen::Index k = unknown / n, l = unknown % n;
            conditions(row, unknown) = f0(k) * x(l) + p0_rest(k) * v0(l);
            sizes(row, unknown) = std::fabs(f0(k) * x(l)) + std::fabs(p0_rest(k) * v0(l));
            conditions(row + 1, unknown) = added(k) * x(l) + p1(k) * v1(l) - p0_added(k) * v0(l);
            sizes(row + 1, unknown) =
                std::fabs(added(k) * x(l)) + std::fabs(p1(k) * v1(l)) + std::fabs(p0_added(k) * v0(l));
        }
        conditions.row(row).tail(n) = f0;
        conditions.row(row + 1).tail(n) = added;
        sizes.row(row).tail(n) = f0.cwiseAbs();
        sizes.row(row + 1).tail(n) = added.cwiseAbs();
        row += 2;
        if (kernel->constraints == 0 || row >= 2 * wanted) continue;
        std::vector<double> phi, phi_t, G;
        stepper.constraint(time, sample, phi, phi_t, G);
        for (int i = 0; i < 2; ++i, ++row) {  // two sums of the constraints, which do not change either
            VectorXd slope = VectorXd::Zero(n);
            for (Eigen::Index c = 0; c < kernel->constraints; ++c)
                slope += random() * Eigen::Map<const VectorXd>(G.data() + c * n, n);
            if (const double size = slope.cwiseAbs().maxCoeff(); size > 0) slope /= size;
            for (Eigen::Index unknown = 0; unknown < entries; ++unknown)
                conditions(row, unknown) = slope(unknown / n) * x(unknown % n);
            conditions.row(row).tail(n) = slope;
            sizes.row(row) = conditions.row(row).cwiseAbs();
        }
    }
    if (row < 2 * wanted)
        throw ComputationError("symmetries cannot be looked for: the forces are not finite around the start");
    return samples;
}

}  // namespace

std::vector<Symmetry> find_symmetries(const Kernel& kernel, const std::vector<double>& parameters,
                                      const std::vector<double>& q, double step,
                                      const std::vector<std::string>& names) {
    LoadedStepper<double> stepper(kernel);
    if (stepper.prepare(parameters, step) != LOBATTO_OK)
        throw ComputationError("symmetries cannot be looked for: the kernel refuses the scene's values");
    const Eigen::Index n = static_cast<Eigen::Index>(q.size());
    if (n > 64) return {};
    const Samples samples = sample_conditions(kernel, stepper, q);
    const Eigen::Index wanted = samples.wanted, entries = samples.entries, unknowns = samples.unknowns;
    const MatrixXd &conditions = samples.conditions, &sizes = samples.sizes;
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
    const auto [values, V] = singular_values(scaled);
    Eigen::Index rank = 0;
    while (rank < unknowns && values(rank) > 1e-10 * std::fmax(values(0), 1.0)) ++rank;

    std::vector<Symmetry> symmetries;
    if (rank == unknowns) return symmetries;
    // The entries of B lead, so that translations are reduced to directions of their own, and rotations by them.
    MatrixXd space = reduced(V.rightCols(unknowns - rank).transpose());
    for (Eigen::Index s = 0; s < space.rows(); ++s) {
        space.row(s).array() /= units.transpose().array();
        Eigen::Index leading = 0;
        while (leading + 1 < unknowns && space(s, leading) == 0) ++leading;
        space.row(s) = (space.row(s) / space(s, leading)).unaryExpr(&simple).eval();
        const VectorXd direction = space.row(s).transpose();
        const double missed = (conditions.bottomRows(wanted) * direction).cwiseAbs().maxCoeff();
        const double terms = (sizes.bottomRows(wanted) * direction.cwiseAbs()).maxCoeff();
        if (!(missed <= 1e-9 * terms)) continue;
        MatrixXd B = MatrixXd::Zero(n, n);
        for (Eigen::Index unknown = 0; unknown < entries; ++unknown) B(unknown / n, unknown % n) = space(s, unknown);
        // The sign that makes a rotation x*p_y - y*p_x, and a largest entry of 1.
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
    LoadedStepper<double> slopes(kernel);
    if (slopes.prepare(parameters, step) != LOBATTO_OK)
        throw ComputationError("momenta cannot be followed: the kernel refuses the scene's values");
    double least = 0, most = 0, size = 0, changed = 0;
    bool first = true;
    TrajectoryRequest request;
    request.parameters = parameters;
    request.q = q;
    request.p = p;
    request.step = step;
    request.steps = steps;
    request.sink = [&](const Records& records) {
        for (std::int64_t i = 0; i < records.count; ++i) {
            const double* const row = records.rows + i * records.columns;
            const std::vector<double> position(row + 1, row + 1 + n), momentum(row + 1 + n, row + 1 + 2 * n);
            std::vector<double> v, Lv, Lq;
            const bool has_slopes = slopes.velocity(row[0], position, momentum, v) == LOBATTO_OK;
            if (has_slopes) slopes.slopes(row[0], position, v, Lv, Lq);
            double value = 0, sizes = 0, rate = 0;
            const auto add = [&](std::size_t k, double coefficient, double x, double x_rate) {
                value += coefficient * momentum[k] * x;
                sizes += std::fabs(coefficient * momentum[k] * x);
                if (has_slopes) rate += coefficient * (Lq[k] * x + Lv[k] * x_rate);
            };
            for (std::size_t k = 0; k < n; ++k) {
                add(k, symmetry.d[k], 1, 0);
                for (std::size_t l = 0; l < n; ++l) add(k, symmetry.B[k * n + l], position[l], has_slopes ? v[l] : 0);
            }
            least = first ? value : std::fmin(least, value);
            most = first ? value : std::fmax(most, value);
            size = std::fmax(size, sizes);
            changed += std::fabs(step * rate);
            first = false;
        }
    };
    const TrajectoryResult run = integrate(kernel, request);
    return {run.steps_done, size > 0 ? (most - least) / size : 0.0, size > 0 ? changed / size : 0.0};
}

}  // namespace lobatto
