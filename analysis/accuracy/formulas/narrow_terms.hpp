// SPDX-License-Identifier: GPL-2.0-or-later
// Terms of the Lagrangian, of forces and of constraints that may be narrower than a step along the motion: exp(u),
// tanh(u), powers of u, tables, where u is smooth and holds the time, positions or velocities. Steps may jump over them
// and see nothing.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "analysis/accuracy/formulas/pulses.hpp"
#include "analysis/tape.hpp"
#include "generator/mechanics/system/system.hpp"

namespace lobatto {

class NarrowTerms {
public:
    explicit NarrowTerms(const SystemOutline& system);

    bool empty() const { return terms_.empty(); }
    std::size_t count() const { return terms_.size(); }
    void set_parameters(const std::vector<double>& parameters) { parameters_ = parameters; }

    struct State {
        double time;
        std::vector<double> q, v;
    };
    // The narrowest that is met on the cubic way between two states, if it is narrower than half of that. Adds to
    // `evaluations` those of terms.
    std::optional<Pulse> on_the_way(const State& from, const State& to, std::int64_t& evaluations) const;
    // Whether steps of this length may be too long for a term, as it looks from a state: on the straight line through
    // it, `reach` steps to both sides.
    bool may_be_met(const State& at, double step, double reach) const;

private:
    enum class Kind { peak, step, tail, pole };  // exp; tanh, sinh, cosh; atan; negative and broken powers, logarithms
    struct Term {
        Kind kind;
        Tape tape;
        std::vector<std::size_t> coordinates;  // that it holds, or their velocities
    };
    struct Found {
        double place, width;  // of the way
    };

    template <class U>
    static std::optional<Found> narrow_place(Kind kind, const U& u);

    std::vector<double> parameters_;
    std::vector<Term> terms_;
};

}  // namespace lobatto
