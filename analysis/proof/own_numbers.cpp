// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/proof/own_numbers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "runtime/build/number_stepper.hpp"
#include "runtime/error.hpp"
#include "runtime/measure/diagnostics.hpp"
#include "runtime/run/parts.hpp"

namespace lobatto {

namespace {

using Parts = NumberStepper::Parts;

constexpr std::int64_t steps_there = 20;
constexpr double roundings = 64;           // of a step, as in runtime/measure/promises.cpp
constexpr double disturbance = 1e-20;      // of a start, relative: far above the rounding of quadruple
constexpr double most_growth = 1e8;        // of a disturbance: beyond, a comparison shows little
constexpr double of_energy = 0x1p19;       // roundings: 1e-10 in double
constexpr double of_tangent_map = 0x1p13;  // roundings in a symplectic defect: 5e3 in quadruple's bound

struct State {
    Parts time, q, p;
};

State start_of(const NumberStepper& stepper, const ExactStart& start) {
    State state{as_parts({0}, stepper.parts()), parts_of(start.q, stepper.parts()),
                parts_of(start.rate, stepper.parts())};
    if (start.from_velocity) state.p = stepper.momentum(state.time, state.q, state.p);
    return state;
}

// Moves the state; false where a step fails.
bool take_steps(NumberStepper& stepper, State& state) {
    Parts records, events;
    lobatto_advance call{};
    call.steps = steps_there;
    if (stepper.start(state.time, state.q, state.p) != LOBATTO_OK ||
        stepper.advance(call, records, events) != LOBATTO_OK)
        return false;
    stepper.state(state.time, state.q, state.p);
    return true;
}

// The largest difference of positions, or of momenta, each relative to the largest of them.
double distance(const Parts& x, std::size_t parts_of_x, const Parts& y, std::size_t parts_of_y) {
    const std::size_t parts = std::max(parts_of_x, parts_of_y), count = x.size() / parts_of_x;
    double apart = 0, size = 0;
    for (std::size_t k = 0; k < count; ++k) {
        Parts a(parts, 0.0), b(parts, 0.0);
        std::copy_n(x.begin() + static_cast<std::ptrdiff_t>(k * parts_of_x), parts_of_x, a.begin());
        std::copy_n(y.begin() + static_cast<std::ptrdiff_t>(k * parts_of_y), parts_of_y, b.begin());
        apart = std::fmax(apart, std::fabs(difference(a.data(), b.data(), parts)));
        size = std::fmax(size, std::fabs(a[0]));
    }
    return size > 0 ? apart / size : apart;
}

double distance(const State& x, std::size_t parts_of_x, const State& y, std::size_t parts_of_y) {
    return std::fmax(distance(x.q, parts_of_x, y.q, parts_of_y), distance(x.p, parts_of_x, y.p, parts_of_y));
}

}  // namespace

std::vector<ProofRow> prove_numbers(Precision numbers, const Kernel& kernel, const Kernel& quadruple,
                                    const ExactStart& start, const GiNaC::numeric& step, bool is_symplectic) {
    const std::string name = precision_name(numbers);
    std::vector<ProofRow> rows;
    NumberStepper own(kernel), reference(quadruple);
    const auto prepare = [&](NumberStepper& stepper, const GiNaC::numeric& h) {
        if (stepper.prepare(parts_of(start.parameters, stepper.parts()), parts_of({h}, stepper.parts())) != LOBATTO_OK)
            throw ComputationError("the kernel in " + name + " refuses the scene's parameters or step");
    };
    prepare(own, step);
    prepare(reference, step);
    const State begin = start_of(own, start), exact_begin = start_of(reference, start);
    State there = begin, exact = exact_begin, disturbed = exact_begin;
    for (Parts* numbers_of : {&disturbed.q, &disturbed.p})
        for (std::size_t k = 0; k < numbers_of->size(); k += reference.parts())
            (*numbers_of)[k + 1] += disturbance * (*numbers_of)[k];

    const std::string against = fmt::format("{} steps against quadruple, {}", steps_there, name),
                      back = fmt::format("{} steps and back, {}", steps_there, name);
    if (!take_steps(own, there) || !take_steps(reference, exact) || !take_steps(reference, disturbed)) {
        rows.push_back(not_decided(against, "a step fails on the way"));
        return rows;
    }
    const double growth = std::fmax(1, distance(disturbed, reference.parts(), exact, reference.parts()) / disturbance);
    if (!(growth < most_growth)) {
        rows.push_back(not_decided(against, "rounding grows too fast for even 20 steps"));
        return rows;
    }
    const double of_steps = roundings * steps_there * growth;
    rows.push_back(at_most(against, distance(there, own.parts(), exact, reference.parts()),
                           of_steps * (kernel->epsilon + quadruple->epsilon),
                           "the kernel in " + name + " does not take the steps that the one in quadruple takes"));
    if (kernel->has_energy != 0 && quadruple->has_energy != 0) {
        Parts H(own.parts()), exact_H(reference.parts());
        const bool has_both = own.energy(begin.time.data(), begin.q.data(), begin.p.data(), H.data()) == LOBATTO_OK &&
                              reference.energy(exact_begin.time.data(), exact_begin.q.data(), exact_begin.p.data(),
                                               exact_H.data()) == LOBATTO_OK;
        const std::string claim = "H at the start, " + name + " against quadruple";
        if (has_both)
            rows.push_back(at_most(claim, distance(H, own.parts(), exact_H, reference.parts()),
                                   of_energy * (kernel->epsilon + quadruple->epsilon),
                                   "terms of the energy cancel and take its digits with them"));
    }
    State home = there;
    prepare(own, -step);
    if (take_steps(own, home))
        rows.push_back(at_most(back, distance(begin, own.parts(), home, own.parts()), 2 * of_steps * kernel->epsilon,
                               "the step is not its own inverse with -h"));
    else
        rows.push_back(not_decided(back, "a step fails on the way"));
    if (!is_symplectic || kernel->has_tangent == 0) return rows;
    prepare(own, step);
    double defect = 0;
    for (const State* state : {&begin, static_cast<const State*>(&there)})
        defect = std::fmax(defect, symplectic_defect(own, state->q, state->p));
    rows.push_back(at_most("symplectic defect, " + name, defect, of_tangent_map * kernel->epsilon,
                           "the step does not preserve phase-space areas"));
    return rows;
}

}  // namespace lobatto
