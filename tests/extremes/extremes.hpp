// SPDX-License-Identifier: GPL-2.0-or-later
// The table of extremes: rows that tests check and docs/extremes.md lists, each a claim and what comes of it.
#pragma once

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "runtime/build/library.hpp"
#include "tests/motions.hpp"

namespace lobatto::test {

struct Extreme {
    std::string claim, outcome;
    std::function<void()> check;  // with doctest's assertions
};

// `error` is at most the bound, which is relative to `of`.
inline Extreme right_to(double bound, const std::string& of, const std::string& claim,
                        const std::function<double()>& error) {
    const std::string outcome = bound == 0 ? "right: " + of : fmt::format("right to {:.0e} {}", bound, of);
    return {claim, outcome, [=] {
                const double measured = error();
                CHECK_MESSAGE(measured <= bound, claim, ": ", measured, " > ", bound);
                if (std::getenv("LOBATTO_EXTREMES") != nullptr)
                    fmt::print("{:<90} {:.2g} of {:.0e}\n", claim, measured, bound);
            }};
}

inline std::string name_of(lobatto_status status) {
    switch (status) {
        case LOBATTO_NOT_CONVERGED:
            return "not converged";
        case LOBATTO_NOT_FINITE:
            return "not finite";
        case LOBATTO_SINGULAR_JACOBIAN:
            return "singular Jacobian";
        case LOBATTO_SINGULAR_MASS:
            return "singular mass matrix";
        case LOBATTO_TIME_STANDS_STILL:
            return "the step is too small to move the time";
        case LOBATTO_OFF_CONSTRAINTS:
            return "the start is behind the wall";
        default:
            return "no stop";
    }
}

inline Extreme stops(lobatto_status expected, const std::string& claim, const std::function<lobatto_status()>& status) {
    return {claim, "stop: " + name_of(expected), [=] {
                const lobatto_status found = status();
                CHECK_MESSAGE(found == expected, claim, ": ", name_of(found));
            }};
}

// In other words than a bound or a status.
inline Extreme says(const std::string& outcome, const std::string& claim, const std::function<bool()>& holds) {
    return {claim, outcome, [=] { CHECK_MESSAGE(holds(), claim); }};
}

// A part of the table, in its order; tests/extremes/document_test.cpp writes them all down.
class Extremes {
public:
    Extremes(int number, std::string title, std::vector<Extreme> rows)
        : title_(std::move(title)), rows_(std::move(rows)) {
        parts()[number] = this;
    }
    Extremes(const Extremes&) = delete;
    Extremes& operator=(const Extremes&) = delete;
    ~Extremes() = default;

    void check() const {
        for (const Extreme& row : rows_) row.check();
    }
    std::string markdown() const {
        std::string text = "\n## " + title_ + "\n\n| what | what comes of it |\n|---|---|\n";
        for (const Extreme& row : rows_) text += "| " + row.claim + " | " + row.outcome + " |\n";
        return text;
    }
    static std::map<int, const Extremes*>& parts() {
        static std::map<int, const Extremes*> all;
        return all;
    }

private:
    std::string title_;
    std::vector<Extreme> rows_;
};

// The kernel of a scene's body, compiled once for all rows of a program.
inline const Kernel& kernel_for(const std::string& body, const std::string& method = "points = 4",
                                Precision precision = Precision::double_) {
    static std::map<std::tuple<std::string, std::string, Precision>, Kernel> made;
    const auto key = std::make_tuple(body, method, precision);
    if (const auto known = made.find(key); known != made.end()) return known->second;
    const Motion motion{body, {}, {}, {}, 0};
    return made.emplace(key, kernel_in_own_cache(derivation_of(motion, method), precision)).first->second;
}

template <class real>
struct State {
    lobatto_status status = LOBATTO_OK;
    std::int64_t steps = 0;
    real time = 0;
    std::vector<real> q, p;
};

// From positions and momenta: that many steps, or as many as there are.
template <class real>
State<real> follow(const Kernel& kernel, const std::vector<real>& parameters, const State<real>& from, real h,
                   std::int64_t steps) {
    LoadedStepper<real> stepper(kernel);
    State<real> end = from;
    end.steps = 0;
    end.status = stepper.prepare(parameters, h);
    if (end.status == LOBATTO_OK) end.status = stepper.start(from.time, from.q, from.p);
    if (end.status != LOBATTO_OK) return end;
    lobatto_advance call{};
    call.steps = steps;
    end.status = stepper.advance(call);
    end.steps = call.steps_done;
    stepper.state(end.time, end.q, end.p);
    return end;
}

// From velocities, at time 0.
template <class real>
State<real> begin(const Kernel& kernel, const std::vector<real>& parameters, const std::vector<real>& q,
                  const std::vector<real>& v, real h) {
    LoadedStepper<real> stepper(kernel);
    State<real> start;
    start.q = q;
    start.status = stepper.prepare(parameters, h);
    start.p = start.status == LOBATTO_OK ? stepper.momentum(real(0), q, v) : v;
    return start;
}
template <class real>
State<real> travel(const Kernel& kernel, const std::vector<real>& parameters, const std::vector<real>& q,
                   const std::vector<real>& v, real h, std::int64_t steps) {
    return follow(kernel, parameters, begin(kernel, parameters, q, v, h), h, steps);
}

// The largest |a - b|, not a number where one is none.
template <class real>
double distance_of(const std::vector<real>& a, const std::vector<real>& b) {
    double largest = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        const double here = std::fabs(static_cast<double>(a[i] - b[i]));
        if (!(here <= largest)) largest = here;
    }
    return largest;
}

}  // namespace lobatto::test
