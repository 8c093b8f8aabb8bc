// SPDX-License-Identifier: GPL-2.0-or-later
// A scene's equations about a state: its linear system, the equilibria, their frequencies.
#pragma once

#include <Eigen/Dense>
#include <optional>
#include <string>
#include <vector>

#include "generator/sample.hpp"
#include "generator/system.hpp"

namespace lobatto {

// M x'' + D x' + S x = 0 for small departures x, n x n each: M = dp/dv, D = dp/dq - df/dv, S = -df/dq.
struct LinearSystem {
    Eigen::MatrixXd mass, drag, stiffness;

    // Why it does not fall into independent oscillators, a clause; "" when it does: D = 0, S is symmetric, and M or -M
    // is positive definite.
    std::string obstacle() const;
    // Squares of the frequencies, ascending, negative where the motion runs away; nothing where there is an obstacle.
    std::optional<Eigen::VectorXd> squared_frequencies() const;
    // The largest real part of the exponents mu of x = exp(mu t).
    double rate() const;
};

// The formulas of a system with the scene's values of the parameters. Evaluated to 60 digits; scene and system outlive
// it.
class Linearisation {
public:
    Linearisation(const Scene& scene, const System& system);

    // DomainError where a formula has no real value.
    LinearSystem at(double time, const Eigen::VectorXd& q, const Eigen::VectorXd& v);
    Eigen::VectorXd force(const Eigen::VectorXd& q);  // at rest: dL/dq + F, n

    // Where the system can rest: Newton's method from each of these positions. Equilibria with the same frequencies
    // count once.
    std::vector<Eigen::VectorXd> equilibria(const std::vector<Eigen::VectorXd>& starts);

private:
    void set(double time, const Eigen::VectorXd& q, const Eigen::VectorXd& v);
    std::optional<Eigen::VectorXd> equilibrium_from(Eigen::VectorXd q);

    const System& system_;
    Formulas formulas_;
    std::vector<Id> force_;
    struct Entries {
        std::vector<std::pair<int, int>> places;
        std::vector<Id> values;
    };
    Entries momentum_v_, momentum_q_, force_v_, force_q_;
};

}  // namespace lobatto
