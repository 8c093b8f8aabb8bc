// SPDX-License-Identifier: GPL-2.0-or-later
// A scene in the time of its clock.
#include "generator/mechanics/clock/clock.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>
#include <stdexcept>

#include "generator/mechanics/clock/automatic_clock.hpp"
#include "generator/mechanics/system/system.hpp"

namespace lobatto {

namespace {

using GiNaC::ex;
using Symbols = std::vector<GiNaC::symbol>;

// Terms longer than this are not expanded to find their degree.
constexpr std::size_t longest_term = 2000;

void require_conservation(const Scene& scene) {
    for (const Coordinate& coordinate : scene.coordinates)
        if (!coordinate.force.is_zero())
            fail_at_clock(
                scene, fmt::format("a clock needs a motion that keeps its energy, but a force acts on {}; remove the "
                                   "clock, or the force",
                                   coordinate.written));
    if (scene.lagrangian.has(scene.time))
        fail_at_clock(
            scene,
            "a clock needs a motion that keeps its energy, but the Lagrangian depends on the time; remove the "
            "clock, or the time from the Lagrangian");
}

// What is computed from values at the start; InputError where one is not finite and real.
template <class Work>
auto with_value_at_start(const Scene& scene, const Work& work) {
    try {
        return work();
    } catch (const std::domain_error&) {
        fail_at_clock(
            scene,
            "the clock, or the Lagrangian, has no finite real value at the start; start elsewhere, or mend the "
            "formula");
    }
}

class Transformation {
public:
    explicit Transformation(const Scene& scene) : scene_(scene), g_(clock_rate(scene)) {
        for (const Coordinate& coordinate : scene.coordinates) {
            q_.push_back(coordinate.position);
            v_.push_back(coordinate.velocity);
            slower_[coordinate.velocity] = coordinate.velocity / g_;
        }
        motion_ = q_;
        motion_.insert(motion_.end(), v_.begin(), v_.end());
        motion_.push_back(scene.time);
    }

    Scene transform() {
        require_positive_rate();
        Scene result = scene_;
        Clock& clock = *result.clock;
        clock.is_applied = true;
        clock.rate = g_;
        // Terms of one degree stay together: their sum is differentiated as one factor, beside the power of g.
        std::map<int, ex> of_degree{{0, clock.energy}};
        ex action = 0;
        clock.lagrangian = 0;
        for (const ex& term : terms_of(scene_.lagrangian, motion_)) {
            const std::optional<int> degree = degree_of(term);
            const ex slow = degree ? term * GiNaC::pow(g_, -*degree) : in_clock_time(term);
            clock.lagrangian += slow;
            if (degree)
                of_degree[*degree] += term;
            else
                action += g_ * slow;
        }
        for (const auto& [degree, sum] : of_degree) action += sum * GiNaC::pow(g_, 1 - degree);
        result.lagrangian = action;
        result.outputs.energy = true;  // kernels take E from it
        for (DomainCondition& condition : result.conditions)
            for (ex* formula : {&condition.expression, &condition.argument}) *formula = in_clock_time(*formula);
        for (Eliminated& x : result.eliminated) x.velocity = in_clock_time(x.velocity);
        const std::string name = clock.energy.get_name();
        result.parameters.push_back(
            {name, "", scene_.evaluate(energy_at_start(), "the energy at the start"), clock.energy, name});
        if (scene_.start == Start::velocity)
            for (std::size_t k = 0; k < q_.size(); ++k) result.initial_rate[k] = scene_.initial_rate[k] * at_start(g_);
        return result;
    }

private:
    void require_positive_rate() const {
        const GiNaC::numeric rate = scene_.value_of(at_start(g_));
        if (!rate.is_positive())
            fail_at_clock(scene_,
                          fmt::format("the clock is {:.6g} at the start; it must be positive wherever the motion goes",
                                      rate.to_double()));
    }

    ex in_clock_time(const ex& expression) const { return expression.subs(slower_, GiNaC::subs_options::no_pattern); }
    ex at_start(const ex& expression) const {
        GiNaC::exmap values;
        for (std::size_t k = 0; k < q_.size(); ++k) {
            values[q_[k]] = scene_.initial_position[k];
            // A momentum is no velocity: at rest, for want of better; kernels know the energy when they start.
            values[v_[k]] = scene_.start == Start::velocity ? scene_.initial_rate[k] : ex(0);
        }
        return expression.subs(values, GiNaC::subs_options::no_pattern);
    }
    // v . dL/dv - L
    ex energy_at_start() const {
        ex sum = -at_start(scene_.lagrangian);
        const std::vector<ex> momentum = gradient_of(terms_of(scene_.lagrangian, motion_), v_);
        for (std::size_t k = 0; k < v_.size(); ++k) sum += at_start(v_[k] * momentum[k]);
        return sum;
    }

    // Of a term that is homogeneous in the velocities: so that g need not be divided by and multiplied with again.
    std::optional<int> degree_of(const ex& term) const {
        const bool moves = std::any_of(v_.begin(), v_.end(), [&](const auto& v) { return term.has(v); });
        if (!moves) return 0;
        const GiNaC::symbol scale("scale");
        GiNaC::exmap scaled;
        for (const auto& v : v_) scaled[v] = scale * v;
        const ex whole = term.subs(scaled, GiNaC::subs_options::no_pattern).expand();
        if (whole.nops() > longest_term || !whole.is_polynomial(scale)) return std::nullopt;
        if (whole.degree(scale) != whole.ldegree(scale)) return std::nullopt;
        return whole.degree(scale);
    }

    const Scene& scene_;
    const ex g_;
    Symbols q_, v_, motion_;
    GiNaC::exmap slower_;  // v -> w / g
};

}  // namespace

ex clock_rate(const Scene& scene) {
    if (scene.clock->is_applied) return scene.clock->rate;
    require_conservation(scene);
    return with_value_at_start(scene,
                               [&] { return scene.clock->is_automatic ? automatic_clock(scene) : scene.clock->rate; });
}

Scene in_clock_time(const Scene& scene) {
    if (!scene.clock || scene.clock->is_applied) return scene;
    return with_value_at_start(scene, [&] { return Transformation(scene).transform(); });
}

void refuse_clock(const Scene& scene, const std::string& what) {
    if (scene.clock)
        fail_at_clock(scene, what +
                                 " takes steps that are equal in time, and knows no clock; remove it, or use run, "
                                 "sweep, emit, verify, tune or tradeoff");
}

}  // namespace lobatto
