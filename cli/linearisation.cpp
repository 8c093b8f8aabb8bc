// SPDX-License-Identifier: GPL-2.0-or-later
// A scene's equations about a state: its linear system, the equilibria, their frequencies.
#include "cli/linearisation.hpp"

#include <algorithm>
#include <cmath>

namespace lobatto {

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double rounding = 1e-12;  // of matrices evaluated to 60 digits at a state of double precision

bool is_small(const MatrixXd& difference, const MatrixXd& matrix) {
    return difference.norm() <= rounding * matrix.norm();
}

}  // namespace

std::string LinearSystem::obstacle() const {
    if (!drag.isZero(0) && !is_small(drag, mass * std::sqrt(stiffness.norm() / mass.norm())))
        return is_small(drag + drag.transpose(), drag) ? "its velocities couple the coordinates"
                                                       : "its forces depend on the velocities";
    if (!is_small(stiffness - stiffness.transpose(), stiffness)) return "its forces have no potential";
    if (mass.llt().info() != Eigen::Success && (-mass).llt().info() != Eigen::Success)
        return "its masses have both signs";
    return "";
}

std::optional<VectorXd> LinearSystem::squared_frequencies() const {
    if (!obstacle().empty()) return std::nullopt;
    const double sign = mass(0, 0) > 0 ? 1 : -1;
    // Coordinates in units in which each has mass 1.
    const VectorXd unit = mass.diagonal().cwiseAbs().cwiseSqrt().cwiseInverse();
    const MatrixXd M = sign * (unit.asDiagonal() * mass * unit.asDiagonal()),
                   S = sign * (unit.asDiagonal() * stiffness * unit.asDiagonal());
    if (!M.allFinite() || !S.allFinite()) return std::nullopt;
    const Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd> solver(S, M, Eigen::EigenvaluesOnly);
    if (solver.info() != Eigen::Success) return std::nullopt;
    VectorXd values = solver.eigenvalues();
    const double noise = 1e-14 * static_cast<double>(values.size()) * values.cwiseAbs().maxCoeff();
    for (double& value : values)  // a free direction
        if (std::fabs(value) <= noise) value = 0;
    return values;
}

double LinearSystem::rate() const {
    const Eigen::Index n = mass.rows();
    MatrixXd flow = MatrixXd::Zero(2 * n, 2 * n);
    const Eigen::PartialPivLU<MatrixXd> solver(mass);
    // Time in a unit in which both blocks are alike.
    const double unit = std::sqrt(std::fmax(solver.solve(stiffness).norm(), 1e-300));
    flow.topRightCorner(n, n) = MatrixXd::Identity(n, n) * unit;
    flow.bottomLeftCorner(n, n) = -solver.solve(stiffness) / unit;
    flow.bottomRightCorner(n, n) = -solver.solve(drag);
    return Eigen::EigenSolver<MatrixXd>(flow, false).eigenvalues().real().maxCoeff();
}

Linearisation::Linearisation(const Scene& scene, const System& system) : system_(system) {
    for (const Parameter& parameter : scene.parameters)
        formulas_.set(parameter.symbol, float_of(scene.evaluate(parameter.value, "the parameter " + parameter.name)));
    set(0, VectorXd::Zero(system.n), VectorXd::Zero(system.n));
    force_ = formulas_.convert(system.force);
    const auto entries_of = [&](const SparseMatrix& matrix) {
        Entries entries;
        std::vector<GiNaC::ex> values;
        for (const auto& [place, value] : matrix.entries()) {
            entries.places.push_back(place);
            values.push_back(value);
        }
        entries.values = formulas_.convert(values);
        return entries;
    };
    momentum_v_ = entries_of(system.momentum_v);
    momentum_q_ = entries_of(system.momentum_q);
    force_v_ = entries_of(system.force_v);
    force_q_ = entries_of(system.force_q);
}

void Linearisation::set(double time, const VectorXd& q, const VectorXd& v) {
    formulas_.set(system_.t, float_of(GiNaC::numeric(time)));
    for (Eigen::Index k = 0; k < system_.n; ++k) {
        formulas_.set(system_.q[static_cast<std::size_t>(k)], float_of(GiNaC::numeric(q(k))));
        formulas_.set(system_.v[static_cast<std::size_t>(k)], float_of(GiNaC::numeric(v(k))));
    }
}

LinearSystem Linearisation::at(double time, const VectorXd& q, const VectorXd& v) {
    set(time, q, v);
    const auto matrix = [&](const Entries& entries) {
        MatrixXd result = MatrixXd::Zero(system_.n, system_.n);
        const std::vector<cln::cl_R> values = formulas_.evaluate(entries.values);
        for (std::size_t i = 0; i < values.size(); ++i)
            result(entries.places[i].first, entries.places[i].second) = cln::double_approx(values[i]);
        return result;
    };
    return {matrix(momentum_v_), matrix(momentum_q_) - matrix(force_v_), -matrix(force_q_)};
}

VectorXd Linearisation::force(const VectorXd& q) {
    set(0, q, VectorXd::Zero(system_.n));
    VectorXd result(system_.n);
    const std::vector<cln::cl_R> values = formulas_.evaluate(force_);
    for (Eigen::Index k = 0; k < system_.n; ++k) result(k) = cln::double_approx(values[static_cast<std::size_t>(k)]);
    return result;
}

std::optional<VectorXd> Linearisation::equilibrium_from(VectorXd q) {
    const double extent = std::fmax(1.0, q.cwiseAbs().maxCoeff());
    try {
        for (int iteration = 0; iteration < 200; ++iteration) {  // slow where the stiffness vanishes too
            const VectorXd f = force(q);
            const MatrixXd S = at(0, q, VectorXd::Zero(system_.n)).stiffness;
            VectorXd step = S.completeOrthogonalDecomposition().solve(f);
            const double length = step.cwiseAbs().maxCoeff();
            if (!std::isfinite(length)) return std::nullopt;
            // The step may be zero because the force is, or because no direction resists it.
            if (length <= 1e-15 * extent) {
                if (!(f.norm() <= 1e-9 * extent * S.norm() || f.isZero(0))) return std::nullopt;
                VectorXd rounded = q.unaryExpr([&](double x) { return std::fabs(x) < 1e-6 * extent ? 0 : x; });
                return force(rounded).norm() <= f.norm() ? rounded : q;
            }
            if (length > extent / 2) step *= extent / 2 / length;
            // Half as far as long as the force grows much: towards a pole, or over a top.
            for (int halving = 0; halving < 8 && !(force(q + step).norm() <= 2 * f.norm()); ++halving) step /= 2;
            q += step;
        }
    } catch (const DomainError&) {
    }
    return std::nullopt;
}

std::vector<VectorXd> Linearisation::equilibria(const std::vector<VectorXd>& starts) {
    std::vector<VectorXd> found;
    std::vector<VectorXd> spectra;
    for (const VectorXd& start : starts) {
        const auto q = equilibrium_from(start);
        if (!q) continue;
        const LinearSystem system = at(0, *q, VectorXd::Zero(system_.n));
        // Where the mass matrix has no inverse the coordinates are singular, as angles at a pole.
        Eigen::FullPivLU<MatrixXd> mass(system.mass);
        mass.setThreshold(1e-10);
        if (!mass.isInvertible()) continue;
        const MatrixXd pull = mass.solve(system.stiffness);
        VectorXd spectrum(2);
        spectrum << pull.trace(), (pull * pull).trace();
        const bool known = std::any_of(spectra.begin(), spectra.end(), [&](const VectorXd& other) {
            return (other - spectrum).norm() <= 1e-7 * (other.norm() + spectrum.norm());
        });
        if (known) continue;
        found.push_back(*q);
        spectra.push_back(spectrum);
    }
    return found;
}

}  // namespace lobatto
