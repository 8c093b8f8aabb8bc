// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/accuracy/watch/exact_energy.hpp"

namespace lobatto {

namespace {

// L of the velocities dq/dt, also where the system is one in the time of a clock.
GiNaC::ex in_time(const Outline& outline) {
    const std::optional<Clock>& clock = outline.scene.clock;
    if (!clock) return outline.system.lagrangian;
    GiNaC::exmap of_clock;
    for (const GiNaC::symbol& v : outline.system.v) of_clock[v] = v * clock->rate;
    return clock->lagrangian.subs(of_clock, GiNaC::subs_options::no_pattern);
}

}  // namespace

ExactEnergy::ExactEnergy(const Outline& outline, const std::vector<double>& parameters) : system_(outline.system) {
    for (std::size_t i = 0; i < parameters.size(); ++i)
        formulas_.set(system_.parameters[i], float_of(GiNaC::numeric(parameters[i])));
    const GiNaC::ex lagrangian = in_time(outline);
    const std::vector<GiNaC::ex> momentum =
        outline.scene.clock ? gradient_of(terms_of(lagrangian, system_.motion()), system_.v) : system_.momentum;
    GiNaC::ex energy = -lagrangian;
    for (std::size_t k = 0; k < system_.q.size(); ++k) {
        energy += system_.v[k] * momentum[k];
        for (const GiNaC::symbol& symbol : {system_.q[k], system_.v[k]}) formulas_.set(symbol, 0);
    }
    energy_ = formulas_.convert({energy});
    std::vector<GiNaC::ex> switched;
    for (const Switch& one : outline.scene.switches) {
        sides_.push_back(one.side);
        switched.push_back(one.value);
    }
    switched_ = formulas_.convert(switched);
}

std::optional<ExactEnergy::Energy> ExactEnergy::at(const std::vector<double>& q, const std::vector<double>& velocity,
                                                   bool same_sides) {
    const auto energy_with = [&](bool moving) -> std::optional<Sized> {
        for (std::size_t k = 0; k < q.size(); ++k) {
            formulas_.set(system_.q[k], float_of(GiNaC::numeric(q[k])));
            formulas_.set(system_.v[k], float_of(GiNaC::numeric(moving ? velocity[k] : 0.0)));
        }
        try {
            if (moving && !same_sides)  // at rest they are where the motion is
                for (std::size_t i = 0; i < sides_.size(); ++i)
                    formulas_.set(sides_[i], cln::plusp(formulas_.evaluate({switched_[i]}).front()) ? 1 : -1);
            return formulas_.evaluate_sized(energy_).front();
        } catch (const DomainError&) {
            return std::nullopt;
        }
    };
    const auto whole = energy_with(true), resting = energy_with(false);
    if (!whole) return std::nullopt;
    Energy energy{whole->value, std::nullopt, whole->size};
    if (resting) energy.moving = whole->value - resting->value;
    return energy;
}

}  // namespace lobatto
