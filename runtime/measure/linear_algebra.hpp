// SPDX-License-Identifier: MIT
// Decompositions of dense matrices of doubles: Eigen's, compiled once.
#pragma once

#include <Eigen/Core>
#include <optional>

namespace lobatto {

// The x of least norm that makes |A x - b| least.
Eigen::VectorXd least_squares(const Eigen::MatrixXd& A, const Eigen::VectorXd& b);

// Nothing where the iteration does not converge.
std::optional<Eigen::VectorXcd> eigenvalues(const Eigen::MatrixXd& A);

// The x of S v = x M v, ascending; S and M symmetric, M positive definite. Nothing where the iteration does not
// converge.
std::optional<Eigen::VectorXd> generalised_eigenvalues(const Eigen::MatrixXd& S, const Eigen::MatrixXd& M);

bool is_positive_definite(const Eigen::MatrixXd& A);

Eigen::MatrixXd inverse(const Eigen::MatrixXd& A);

// A^-1 B; nothing where a pivot of A is at most `threshold` of the largest.
std::optional<Eigen::MatrixXd> solution(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B, double threshold);

// A = U diag(values) V^T, values descending. V is square.
struct SingularValues {
    Eigen::VectorXd values;
    Eigen::MatrixXd V;
};
SingularValues singular_values(const Eigen::MatrixXd& A);

}  // namespace lobatto
