// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/wide.hpp"

#include <Eigen/Dense>

namespace lobatto {

std::optional<Eigen::VectorXd> generalised_eigenvalues(const WideMatrix& S, const WideMatrix& M) {
    const Eigen::GeneralizedSelfAdjointEigenSolver<WideMatrix> solver(S, M, Eigen::EigenvaluesOnly);
    if (solver.info() != Eigen::Success) return std::nullopt;
    return solver.eigenvalues().cast<double>();
}

std::optional<Eigen::VectorXcd> eigenvalues(const WideMatrix& A) {
    const Eigen::EigenSolver<WideMatrix> solver(A, false);
    if (solver.info() != Eigen::Success) return std::nullopt;
    Eigen::VectorXcd values(A.rows());
    for (Eigen::Index k = 0; k < A.rows(); ++k) {
        const std::complex<Wide> value = solver.eigenvalues()(k);
        values(k) = {static_cast<double>(value.real()), static_cast<double>(value.imag())};
    }
    return values;
}

std::optional<WideMatrix> solution(const WideMatrix& A, const WideMatrix& B, double threshold) {
    Eigen::FullPivLU<WideMatrix> elimination(A);
    elimination.setThreshold(Wide(threshold));
    if (!elimination.isInvertible()) return std::nullopt;
    return WideMatrix(elimination.solve(B));
}

int dimension_of_kernel(const WideMatrix& A, double threshold) {
    Eigen::FullPivLU<WideMatrix> elimination(A);
    elimination.setThreshold(Wide(threshold));
    return static_cast<int>(elimination.dimensionOfKernel());
}

}  // namespace lobatto
