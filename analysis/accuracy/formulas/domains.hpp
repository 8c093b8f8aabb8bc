// SPDX-License-Identifier: GPL-2.0-or-later
// Where formulas as written have no value though kernels, whose formulas are simplified, go on: sqrt(q)^2, exp(log(q)).
// The start of a scene is looked at exactly (check_start); here, in double, those of a sweep, and motions on their way.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "analysis/tape.hpp"
#include "generator/mechanics/system/system.hpp"
#include "runtime/run/trajectory.hpp"

namespace lobatto {

class Domains {
public:
    Domains(const Scene& scene, const SystemOutline& system);

    // Whether all formulas have values at a start.
    bool hold_at_start(double time, const std::vector<double>& parameters, const std::vector<double>& q,
                       const std::vector<double>& rate) const;

    // The first of these states at which a formula of the motion has no value; -1: all have.
    std::int64_t left_at(const std::vector<double>& parameters, const Records& records) const;

    // What has no value at a state that was left: "a square root, line 3 column 12, is of q - 3 = -0.1".
    std::string text(const std::vector<double>& parameters, const double* row) const;

    // The same of a state that a kernel could not come to: of formulas too at which it stops by itself.
    struct NoValue {
        std::string text;
        bool is_table = false;
    };
    std::optional<NoValue> no_value_at(const std::vector<double>& parameters, const std::vector<double>& row) const;

private:
    struct Condition {
        DomainCondition written;
        Tape tape;
        std::optional<Tape> exponent;  // of a power
        std::optional<Tape> argument;  // of a table
        bool has_velocity, of_way;     // of_way: kernels pass where it does not hold
        bool ends_way;                 // they do not
    };
    bool holds(const Condition& condition, const std::vector<double>& variables) const;
    static std::string text(const Condition& condition, const std::vector<double>& variables);
    std::vector<double> variables_of(const std::vector<double>& parameters, const double* row) const;

    std::vector<Condition> conditions_;
    std::size_t n_;
    bool knows_velocities_, watches_ = false;
};

}  // namespace lobatto
