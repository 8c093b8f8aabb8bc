// SPDX-License-Identifier: MIT
#include "runtime/measure/linear_algebra.hpp"

#include <Eigen/Dense>

namespace lobatto {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// Each kind of decomposition takes seconds to compile: there is one of each.
VectorXd least_squares(const MatrixXd& A, const VectorXd& b) {
    return Eigen::JacobiSVD<MatrixXd>(A, Eigen::ComputeThinU | Eigen::ComputeThinV).solve(b);
}

std::optional<Eigen::VectorXcd> eigenvalues(const MatrixXd& A) {
    const Eigen::EigenSolver<MatrixXd> solver(A, false);
    if (solver.info() != Eigen::Success) return std::nullopt;
    return solver.eigenvalues();
}

std::optional<VectorXd> generalised_eigenvalues(const MatrixXd& S, const MatrixXd& M) {
    const Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd> solver(S, M, Eigen::EigenvaluesOnly);
    if (solver.info() != Eigen::Success) return std::nullopt;
    return solver.eigenvalues();
}

bool is_positive_definite(const MatrixXd& A) {
    return A.llt().info() == Eigen::Success;
}

MatrixXd inverse(const MatrixXd& A) {
    return Eigen::FullPivLU<MatrixXd>(A).inverse();
}

std::optional<MatrixXd> solution(const MatrixXd& A, const MatrixXd& B, double threshold) {
    Eigen::FullPivLU<MatrixXd> elimination(A);
    elimination.setThreshold(threshold);
    if (!elimination.isInvertible()) return std::nullopt;
    return elimination.solve(B);
}

SingularValues singular_values(const MatrixXd& A) {
    const Eigen::JacobiSVD<MatrixXd> decomposition(A, Eigen::ComputeFullV);
    return {decomposition.singularValues(), decomposition.matrixV()};
}

}  // namespace lobatto
