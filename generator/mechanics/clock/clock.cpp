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
#include "generator/scene/time_coordinate.hpp"

namespace lobatto {

namespace {

using GiNaC::ex;
using Symbols = std::vector<GiNaC::symbol>;

// Terms longer than this are not expanded to find their degree.
constexpr std::size_t longest_term = 2000;

bool is_broken_power(const ex& factor) {
    return GiNaC::is_a<GiNaC::power>(factor) && factor.op(1).info(GiNaC::info_flags::rational) &&
           !factor.op(1).info(GiNaC::info_flags::integer);
}
// A positive g as a product: its broken powers, and the product of the rest, which is positive like them.
struct Factors {
    std::vector<ex> broken_powers;
    ex rest = 1;
};
Factors factors_of(const ex& g) {
    Factors factors;
    const auto look = [&](const ex& factor) {
        if (is_broken_power(factor))
            factors.broken_powers.push_back(factor);
        else
            factors.rest *= factor;
    };
    if (GiNaC::is_a<GiNaC::mul>(g))
        for (const ex& factor : g) look(factor);
    else
        look(g);
    return factors;
}
// The power of a positive g; of one that holds a power itself, such as r^(3/2), one power and not two.
ex power_of(const ex& g, const ex& exponent) {
    const Factors factors = factors_of(g);
    ex result = GiNaC::pow(factors.rest, exponent);
    for (const ex& inner : factors.broken_powers) result *= GiNaC::pow(inner.op(0), inner.op(1) * exponent);
    return result;
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
        const Coordinate& last = scene.coordinates.back();
        if (scene.has_time_coordinate()) {
            moment_ = {{scene.time, last.position}};
            g_ = g_.subs(moment_);
        }
        pace_ = scene.has_time_coordinate() ? ex(last.velocity) : g_;
        slower_ = moment_;
        for (const Coordinate& coordinate : scene.coordinates) {
            if (scene.has_time_coordinate() && &coordinate == &last) continue;
            q_.push_back(coordinate.position);
            v_.push_back(coordinate.velocity);
            slower_[coordinate.velocity] = coordinate.velocity / pace_;
        }
        motion_ = q_;
        motion_.insert(motion_.end(), v_.begin(), v_.end());
        motion_.push_back(scene.time);
        set_rates();
    }

    Scene transform() {
        require_positive_rate();
        Scene result = scene_;
        Clock& clock = *result.clock;
        clock.is_applied = true;
        clock.rate = g_;
        // Terms of one degree stay together: their sum is differentiated as one factor, beside the power of the pace.
        std::map<int, ex> of_degree;
        ex action = 0;
        clock.lagrangian = 0;
        for (const ex& term : terms_of(scene_.lagrangian, motion_)) {
            const std::optional<int> degree = degree_of(term);
            const ex slow = degree ? term.subs(moment_) * GiNaC::pow(pace_, -*degree) : in_clock_time(term);
            clock.lagrangian += slow;
            if (degree)
                of_degree[*degree] += term.subs(moment_);
            else
                action += pace_ * slow;
        }
        if (!scene_.has_time_coordinate()) of_degree[0] += clock.energy;
        for (const auto& [degree, sum] : of_degree) action += sum * GiNaC::pow(pace_, 1 - degree);
        if (scene_.has_time_coordinate()) {
            action += kept_pace(clock.energy);
            transform_forces(result);
        }
        result.lagrangian = action;
        result.outputs.energy = true;  // kernels take E from it
        for (DomainCondition& condition : result.conditions)
            for (ex* formula : {&condition.expression, &condition.argument}) *formula = in_clock_time(*formula);
        for (Eliminated& x : result.eliminated) {
            x.position = x.position.subs(moment_);
            x.velocity = in_clock_time(x.velocity);
        }
        const std::string name = clock.energy.get_name();
        result.parameters.push_back({name, "", number_of_start(), clock.energy, name});
        if (scene_.has_time_coordinate()) result.start = Start::velocity;
        if (result.start == Start::velocity)
            for (std::size_t k = 0; k < rates_.size(); ++k) result.initial_rate[k] = rates_[k] * at_start(g_);
        return result;
    }

private:
    // A momentum is no velocity: at rest, for want of better; kernels know the energy when they start. Where the time
    // is a coordinate, that of the start has to be known.
    void set_rates() {
        if (scene_.start == Start::velocity) {
            rates_ = scene_.initial_rate;
        } else if (scene_.has_time_coordinate()) {
            rates_.assign(v_.size(), 0);
            rates_.emplace_back(1);
            find_velocities();
        } else {
            rates_.assign(scene_.coordinates.size(), 0);
        }
    }
    // Of velocities: what is missing to the momenta of the start, and the sum of its squares; nothing where they have
    // none.
    struct Missing {
        std::vector<GiNaC::numeric> momentum;
        GiNaC::numeric squares = 0;
    };
    std::optional<Missing> missing(const std::vector<ex>& momentum, const std::vector<ex>& rates) const {
        Missing result;
        try {
            for (std::size_t k = 0; k < v_.size(); ++k) {
                result.momentum.push_back(scene_.value_of(scene_.initial_rate[k]) -
                                          scene_.value_at_start(momentum[k], rates));
                result.squares += result.momentum[k] * result.momentum[k];
            }
        } catch (const std::domain_error&) {
            return std::nullopt;
        }
        return result;
    }
    // Newton's method for dL/dv = p, its steps halved while they lead away; from rest, or from a multiple of the
    // momentum.
    void find_velocities() {
        const std::vector<ex> momentum = gradient_of(terms_of(scene_.lagrangian, motion_), v_);
        const SparseMatrix slopes = derivative_of(momentum, v_);
        std::optional<bool> is_singular;  // from rest
        for (int exponent = 20; exponent >= -20; --exponent) {
            if (approach(momentum, slopes)) return;
            if (!is_singular) is_singular = is_singular_;
            for (std::size_t k = 0; k < v_.size(); ++k)
                rates_[k] = scene_.value_of(scene_.initial_rate[k]) * GiNaC::numeric(2).power(exponent);
        }
        if (*is_singular)
            scene_.source.fail(scene_.lagrangian_at,
                               "the mass matrix is singular where velocities were sought that have the momenta of the "
                               "start; give velocities, start elsewhere, or give every direction a kinetic energy");
        scene_.source.fail(scene_.coordinates[0].rate_at,
                           "no velocity was found that has the momenta of the start; give velocities");
    }
    bool approach(const std::vector<ex>& momentum, const SparseMatrix& slopes) {
        constexpr int most_iterations = 60, most_halvings = 30;
        const GiNaC::numeric rounding = GiNaC::numeric(10).power(-30);  // of 60 digits half, and then all
        const auto n = static_cast<unsigned>(v_.size());
        std::optional<Missing> here = missing(momentum, rates_);
        GiNaC::numeric wanted = 0;
        for (std::size_t k = 0; k < v_.size(); ++k) wanted += scene_.value_of(scene_.initial_rate[k]).power(2);
        for (int iteration = 0; here && iteration < most_iterations; ++iteration) {
            GiNaC::matrix mass(n, n), unknown(n, 1), right(n, 1), step;
            try {
                for (const auto& [place, value] : slopes.entries())
                    mass(static_cast<unsigned>(place.first), static_cast<unsigned>(place.second)) = at_start(value);
                for (unsigned k = 0; k < n; ++k) {
                    unknown(k, 0) = v_[k];
                    right(k, 0) = here->momentum[k];
                }
                step = mass.solve(unknown, right);
            } catch (const std::domain_error&) {  // the matrix has no value
                return false;
            } catch (const std::runtime_error&) {  // singular, and no step leads there
                is_singular_ = iteration == 0;
                return false;
            }
            for (unsigned k = 0; k < n; ++k) {
                if (GiNaC::is_a<GiNaC::numeric>(step(k, 0))) continue;
                is_singular_ = iteration == 0;
                return false;
            }
            GiNaC::numeric length = 0, size = 0;
            for (unsigned k = 0; k < n; ++k) {
                length += GiNaC::abs(GiNaC::ex_to<GiNaC::numeric>(step(k, 0)));
                size += GiNaC::abs(GiNaC::ex_to<GiNaC::numeric>(rates_[k]));
            }
            if (length <= rounding * size) return true;
            std::optional<Missing> there;
            std::vector<ex> trial;
            for (int halving = 0; halving < most_halvings; ++halving) {
                trial = rates_;
                for (unsigned k = 0; k < n; ++k) trial[k] += step(k, 0) * GiNaC::numeric(2).power(-halving);
                there = missing(momentum, trial);
                if (there && (there->squares < here->squares || here->squares.is_zero())) break;
                there.reset();
            }
            if (!there) return here->squares <= rounding * rounding * wanted;
            rates_ = trial;
            here = there;
        }
        return false;
    }

    void require_positive_rate() const {
        const GiNaC::numeric rate = at_start(g_);
        if (!rate.is_positive())
            fail_at_clock(scene_,
                          fmt::format("the clock is {:.6g} at the start; it must be positive wherever the motion goes",
                                      rate.to_double()));
    }

    ex in_clock_time(const ex& expression) const { return expression.subs(slower_, GiNaC::subs_options::no_pattern); }
    // In numbers: exact formulas of starts with many digits have thousands of them.
    GiNaC::numeric at_start(const ex& expression) const { return scene_.value_at_start(expression, rates_); }

    // sigma g^a (w_t / g - 1)^2 / 2 of (D64), a power of the pace w_t at a time.
    ex kept_pace(const ex& sigma) const {
        const ex a = pace_exponent(g_);
        return sigma / 2 *
               (power_of(g_, a - 2) * GiNaC::pow(pace_, 2) - 2 * power_of(g_, a - 1) * pace_ + power_of(g_, a));
    }
    // F of the coordinates is w_t F in the time of the clock, and takes its power, F . w, from the momentum of the
    // time.
    void transform_forces(Scene& result) const {
        ex power = 0;
        for (std::size_t k = 0; k < v_.size(); ++k) {
            const ex force = in_clock_time(scene_.coordinates[k].force);
            result.coordinates[k].force = pace_ * force;
            power += force * v_[k];
        }
        result.coordinates.back().force = -power;
    }

    // E = v . dL/dv - L, or the sigma that makes the last term of (D64) as large as the terms of L.
    GiNaC::numeric number_of_start() const {
        GiNaC::numeric moving = 0;  // v . dL/dv
        const std::vector<ex> momentum = gradient_of(terms_of(scene_.lagrangian, motion_), v_);
        for (std::size_t k = 0; k < v_.size(); ++k) moving += at_start(v_[k] * momentum[k]);
        const GiNaC::numeric energy = moving - at_start(scene_.lagrangian);
        if (!scene_.has_time_coordinate()) return energy;
        const GiNaC::numeric size = GiNaC::abs(moving / 2) + GiNaC::abs(energy - moving / 2);
        return (size.is_zero() ? GiNaC::numeric(1) : size / 2) * at_start(power_of(g_, 1 - pace_exponent(g_)));
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
    ex g_, pace_;               // dt/dtau: g, or the velocity of the time
    Symbols q_, v_, motion_;    // without the time's
    std::vector<ex> rates_;     // dq/dt at the start
    bool is_singular_ = false;  // the mass matrix, where velocities were sought first
    GiNaC::exmap moment_;       // t -> its coordinate, where it has one
    GiNaC::exmap slower_;       // this, and v -> w / pace
};

}  // namespace

GiNaC::numeric pace_exponent(const ex& g) {
    const GiNaC::numeric third(1, 3);
    const std::vector<ex> powers = factors_of(g).broken_powers;
    const bool has_root = std::all_of(powers.begin(), powers.end(), [&](const ex& power) {
        return (4 * power.op(1) * third).info(GiNaC::info_flags::integer);
    });
    return !powers.empty() && has_root ? third : GiNaC::numeric(0);
}

ex clock_rate(const Scene& scene) {
    if (scene.clock->is_applied) return scene.clock->rate;
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
