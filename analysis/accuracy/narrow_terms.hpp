// SPDX-License-Identifier: GPL-2.0-or-later
// Terms of the Lagrangian and of forces that may be narrower than a step along the motion: exp(u), tanh(u), powers of
// u, where u is smooth and holds the time, positions or velocities. Steps may jump over them and see nothing.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "analysis/accuracy/pulses.hpp"
#include "generator/mechanics/system.hpp"

namespace lobatto {

class NarrowTerms {
public:
    NarrowTerms(const System& system, const std::vector<double>& parameters);

    bool empty() const { return terms_.empty(); }

    struct State {
        double time;
        std::vector<double> q, v;
    };
    // The narrowest that is met on the cubic way between two states, if it is narrower than half of that.
    std::optional<Pulse> on_the_way(const State& from, const State& to) const;

private:
    enum class Kind { peak, step, tail, pole };  // exp; tanh, sinh, cosh; atan; negative and broken powers, logarithms
    enum class Operation { number, variable, sum, product, power, call };
    struct Instruction {
        Operation operation;
        double number = 0;         // or the exponent, if it is one
        std::size_t variable = 0;  // t, q, v
        int operands = 0;
        double (*function)(double) = nullptr;
    };
    using Tape = std::vector<Instruction>;  // operands come before what is done with them
    struct Term {
        Kind kind;
        Tape tape;
    };
    struct Found {
        double place, width;  // of the way
    };

    static bool compile(const GiNaC::ex& formula, const std::vector<GiNaC::symbol>& variables, Tape& tape);
    static double value(const Tape& tape, const std::vector<double>& variables);
    template <class U>
    static std::optional<Found> narrow_place(Kind kind, const U& u);

    std::vector<Term> terms_;
};

}  // namespace lobatto
