// SPDX-License-Identifier: GPL-2.0-or-later
// A scene's equations about a state: its linear system, the equilibria, their frequencies.
#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "generator/mechanics/algebra/sample.hpp"
#include "generator/mechanics/system/system.hpp"

namespace lobatto {

// M x'' + D x' + S x = 0 for small departures x, n x n each: M = dp/dv, D = dp/dq - df/dv, S = -df/dq.
struct LinearSystem {
    using Entries = std::map<std::pair<int, int>, Sized>;  // those that are not zero
    int n = 0;
    Entries mass, drag, stiffness;
    double rounding = 1e-45;  // of the stiffness: what is less, relative to its terms, cannot be told from 0

    // Coordinates that nothing couples move by themselves: the system falls into these.
    std::vector<LinearSystem> blocks() const;
    // Why it does not fall into independent oscillators, a clause; "" when it does: D = 0, S is symmetric, and in each
    // block M or -M is positive definite.
    std::string obstacle() const;
    // Squares of the frequencies, ascending, negative where the motion grows; nothing where there is an obstacle.
    // Computed to 60 digits, those of blocks of more than 100 coordinates in double precision.
    std::optional<Eigen::VectorXd> squared_frequencies() const;
    // The largest real part of the exponents mu of x = exp(mu t).
    double rate() const;
    // Their largest imaginary part, in double precision: 0 where nothing oscillates; nothing where it would take too
    // long.
    std::optional<double> largest_frequency() const;
};

struct Equilibrium {
    Eigen::VectorXd q;
    LinearSystem system;  // there, to 60 digits
};

// The formulas of a system with the scene's values of the parameters. Evaluated to 60 digits; scene and system outlive
// it.
class Linearisation {
public:
    Linearisation(const Scene& scene, const System& system);

    // DomainError where a formula has no real value.
    LinearSystem at(double time, const Eigen::VectorXd& q, const Eigen::VectorXd& v);

    // Where the system can rest: Newton's method from each of these positions, then from each equilibrium found with
    // one angle turned by half a turn. Equilibria with the same frequencies count once.
    std::vector<Equilibrium> equilibria(const std::vector<Eigen::VectorXd>& starts);

    // The dimension of the space of directions along which nothing pulls, wherever the system is: along them it moves
    // on steadily, as the centre of mass of what nothing holds. Looks near and far from q; 0 where the mass matrix is
    // not constant.
    int free_directions(const Eigen::VectorXd& q);

private:
    using Position = std::vector<cln::cl_R>;
    void set(double time, const Position& q, const Position& v);
    LinearSystem at(double time, const Position& q, const Position& v);
    LinearSystem at_rest(const Position& q) { return at(0, q, Position(q.size(), cln::cl_R(0))); }
    std::vector<Sized> force(const Position& q);  // at rest: dL/dq + F, n
    bool rests(const Position& q);
    bool fades(const Position& q);                        // a force is there, and too weak to have a slope
    std::vector<Eigen::Index> angles(const Position& q);  // coordinates of which a whole turn changes no force
    Eigen::VectorXd newton_step(const Position& q, const Eigen::VectorXd& force);
    // `is_multiple`: several equilibria meet there, so that its last digits are not known.
    std::optional<Position> equilibrium_from(const Eigen::VectorXd& start, bool& is_multiple);

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
