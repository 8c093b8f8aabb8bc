// SPDX-License-Identifier: GPL-2.0-or-later
// One way to integrate a scene to its end, and what is known of it once it has been tried.
#pragma once

#include <cstdint>
#include <string>
#include <tuple>
#include <vector>

#include "generator/graph/notation.hpp"
#include "generator/scene/scene.hpp"
#include "runtime/kernel/base/double_double.hpp"

namespace lobatto {

// The time in which steps are equally long.
enum class StepClock { none, automatic, of_scene };
const char* word_of(StepClock clock);              // "none", "auto", "scene"
StepClock step_clock_of(const std::string& word);  // std::invalid_argument where it is none of these

// A kernel: a member of the family in a number type.
struct Member {
    Family family = Family::lobatto;
    int points = 4;
    Precision precision = Precision::double_;
    StepArithmetic arithmetic = StepArithmetic::plain;
    StepClock clock = StepClock::none;

    Method method(double tolerance = 0) const { return {family, points, tolerance, arithmetic, precision}; }
    int order() const { return method().order(); }
    auto key() const { return std::tuple(family, points, precision, arithmetic, clock); }
    friend bool operator==(const Member& a, const Member& b) { return a.key() == b.key(); }
    friend bool operator<(const Member& a, const Member& b) { return a.key() < b.key(); }
};

// call(real()) with the number type of the precision.
template <class Call>
auto with_type_of(Precision precision, const Call& call) {
    switch (precision) {
        case Precision::single:
            return call(float());
        case Precision::extended:
            return call(static_cast<long double>(0));
        case Precision::double_double:
            return call(DoubleDouble());
        case Precision::quadruple:
            return call(__float128());
        default:
            return call(double());
    }
}

// All of Lobatto 2 to 12 and Gauss 1 to 10 in one number type; and of splitting methods, which separable systems have.
std::vector<Member> family_in(Precision precision, bool is_separable);

struct Candidate {
    Member member;
    std::int64_t steps = 0;  // equal ones, to the end; with a clock about so many (Experiment::span)
    double tolerance = 0;    // of the iteration; 0: to stagnation

    auto key() const { return std::tuple(member.key(), steps, tolerance); }
    std::string name() const;  // "Lobatto 8", "Gauss 6 clean", "Lobatto 8 clock auto"
};

// Errors of states are relative to the amplitudes of the motion (Reference::scale), those of energies to its energy.
struct Measurement {
    Candidate candidate;
    double step = 0;             // in t, or the time of the clock
    bool complete = false;       // it reached the end
    double error_end = 0;        // of the state at the end
    double error = 0;            // the largest at the times that are compared
    double reaches = 0;          // until when its error was below 0.01
    double energy_error = 0;     // the largest; not a number where energy is not conserved
    double drift = 0;            // the slope of a straight line through it, per unit of time
    double momentum_error = 0;   // the largest change of a conserved momentum; not a number where none is known
    double defect = 0;           // symplectic, of the first step; not a number where it is not promised or left out
    double seconds = 0;          // of processor time, for the whole motion
    double iterations = 0;       // a step
    double gradients = 0;        // of V, or of L, for the whole motion
    double compile_seconds = 0;  // 0: it was in the cache
};

// Numbers of steps near the terms of a geometric series, among them those that meet the `samples` times of a reference
// often: the greatest common divisor with `samples` is at least min(steps, often).
class StepLadder {
public:
    StepLadder(int samples, double ratio) : samples_(samples), ratio_(ratio) {}
    std::int64_t at_least(double steps) const;  // the first good number from `steps` on, within some per cent the best
    std::int64_t at_most(double steps) const;   // likewise downward; 1 at least
    std::int64_t next(std::int64_t steps) const { return at_least(static_cast<double>(steps) * ratio_); }

private:
    bool good(std::int64_t steps) const;
    int samples_;
    double ratio_;
};

}  // namespace lobatto
