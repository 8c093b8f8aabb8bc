// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/accuracy/formulas/pulses.hpp"

#include <ginac/ginac.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <optional>
#include <set>
#include <string>

#include "analysis/accuracy/formulas/bends.hpp"
#include "analysis/tape.hpp"

namespace lobatto {

namespace {

using GiNaC::ex;

constexpr std::size_t most_pulses = 1000;
constexpr int rounds = 200;            // of the simultaneous iteration for roots
constexpr std::size_t samples = 8192;  // of what is no polynomial in time
constexpr double real = 1e-9;          // |Im| of a real root, relative
constexpr double multiple = 1e-3;      // the same of a multiple one, as rounding splits it
constexpr double tiny = 0x1p-40;
constexpr double high_power = 4;  // the least one that is a pulse

// All roots of c_0 + c_1 x + ... by the iteration of Durand and Kerner.
std::vector<std::complex<double>> roots_of(std::vector<double> c) {
    while (!c.empty() && c.back() == 0) c.pop_back();
    if (c.size() < 2) return {};
    const std::size_t degree = c.size() - 1;
    double radius = 0;
    for (std::size_t i = 0; i < degree; ++i)
        radius = std::fmax(radius, std::pow(std::fabs(c[i] / c[degree]), 1.0 / static_cast<double>(degree - i)));
    std::vector<std::complex<double>> x;
    for (std::size_t i = 0; i < degree; ++i)
        x.push_back(
            std::polar(2 * radius, 0.4 + 6.283185307179586 * static_cast<double>(i) / static_cast<double>(degree)));
    for (int round = 0; round < rounds; ++round)
        for (std::size_t i = 0; i < degree; ++i) {
            std::complex<double> value = c[degree], product = c[degree];
            for (std::size_t j = degree; j-- > 0;) value = value * x[i] + c[j];
            for (std::size_t j = 0; j < degree; ++j)
                if (j != i) product *= x[i] - x[j];
            if (product != 0.0) x[i] -= value / product;
        }
    return x;
}

class PulseFinder {
public:
    PulseFinder(const SystemOutline& system, const std::vector<double>& parameters, double begin, double end,
                double widest)
        : t_(system.t), begin_(std::fmin(begin, end)), end_(std::fmax(begin, end)), widest_(widest) {
        for (std::size_t i = 0; i < parameters.size(); ++i)
            values_[system.parameters[i]] = GiNaC::numeric(parameters[i]);
        for (const auto& list : {system.q, system.v})
            for (const GiNaC::symbol& symbol : list) motion_.insert(symbol);
    }

    void look_at(const ex& formula) {
        each_in_time(formula, [this](const ex& part, const ex& u) {
            const bool is_function = GiNaC::is_a<GiNaC::function>(part);
            const ex power = is_function ? ex(0) : part.op(1).subs(values_);
            const std::string name = is_function     ? GiNaC::ex_to<GiNaC::function>(part).get_name()
                                     : power.has(t_) ? "exp"
                                                     : "";
            const double exponent =
                GiNaC::is_a<GiNaC::numeric>(power) ? GiNaC::ex_to<GiNaC::numeric>(power).to_double() : 0;
            if (is_table_value(part))
                of_table(spline_in(part), u);
            else if (u.is_polynomial(t_))
                of_polynomial(u.expand(), name, exponent);
            else
                of_samples(u, name, exponent);
        });
    }

    void look_at_tables(const ex& formula) {
        each_in_time(formula, [this](const ex& part, const ex& u) {
            const std::vector<double> c = is_table_value(part) ? of_first_degree(u) : std::vector<double>();
            if (c.empty()) return;
            const std::vector<cln::cl_R>& x = spline_in(part).x();
            for (std::size_t i = 2; i + 2 < x.size(); ++i) {  // the second and the last but one are no knots
                const double time = (cln::double_approx(x[i]) - c[0]) / c[1];
                if (time > begin_ && time < end_) knots_.push_back(time);
            }
        });
    }

    // Of a formula that changes sides where u(t) passes zero: two passages that are near each other.
    void look_at_side(const ex& value) {
        if (!value.has(t_) || holds_motion(value)) return;
        const ex u = value.subs(values_);
        std::vector<double> passages;
        if (u.is_polynomial(t_)) {
            for (const auto& root : roots_of(coefficients_of(u.expand())))
                if (std::fabs(root.imag()) <= real * std::abs(root)) passages.push_back(root.real());
        } else {
            const std::vector<double> values = samples_of(u);
            for (std::size_t i = 1; i < values.size(); ++i)
                if ((values[i - 1] < 0) != (values[i] < 0)) passages.push_back(time_of_sample(i));
        }
        std::sort(passages.begin(), passages.end());
        for (std::size_t i = 1; i < passages.size() && pulses_.size() < most_pulses; ++i)
            add((passages[i - 1] + passages[i]) / 2, passages[i] - passages[i - 1]);
    }

    std::vector<double> knots() {
        std::sort(knots_.begin(), knots_.end());
        knots_.erase(std::unique(knots_.begin(), knots_.end()), knots_.end());
        return std::move(knots_);
    }

    std::vector<Pulse> pulses() {
        std::sort(pulses_.begin(), pulses_.end(), [](const Pulse& a, const Pulse& b) { return a.time < b.time; });
        if (pulses_.size() > most_pulses) pulses_.resize(most_pulses);
        return std::move(pulses_);
    }

private:
    // The functions and powers in a formula, each once, of a u that holds the time and parameters alone; u with the
    // values of these.
    template <class Visit>
    void each_in_time(const ex& formula, const Visit& visit) {
        for (auto part = formula.preorder_begin(); part != formula.preorder_end(); ++part) {
            if (!GiNaC::is_a<GiNaC::function>(*part) && !GiNaC::is_a<GiNaC::power>(*part)) continue;
            const ex inner = is_table_value(*part)                    ? part->op(2)
                             : is_exponential(*part, std::vector{t_}) ? natural_exponent(*part)
                                                                      : part->op(0);
            if (!inner.has(t_) || holds_motion(*part) || !known_.insert(*part).second) continue;
            try {
                visit(*part, inner.subs(values_));
            } catch (const std::exception&) {  // no value with these parameters, as a power of 0 has no logarithm
            }
        }
    }
    bool holds_motion(const ex& part) const {
        for (auto inner = part.preorder_begin(); inner != part.preorder_end(); ++inner)
            if (GiNaC::is_a<GiNaC::symbol>(*inner) && motion_.contains(*inner)) return true;
        return false;
    }
    static bool is_switch(const std::string& name) {
        return name == "tanh" || name == "atan" || name == "sinh" || name == "cosh";
    }
    void add(double time, double width) {
        if (time >= begin_ - width && time <= end_ + width && width < widest_ && width > 0)
            pulses_.push_back({time, width});
    }

    // Of powers of t; empty: they are no numbers.
    std::vector<double> coefficients_of(const ex& u) const {
        std::vector<double> c;
        for (int i = 0; i <= u.degree(t_); ++i) {
            const ex value = u.coeff(t_, i).evalf();
            if (!GiNaC::is_a<GiNaC::numeric>(value)) return {};
            c.push_back(GiNaC::ex_to<GiNaC::numeric>(value).to_double());
        }
        return c;
    }

    // Of |u|^k where |u| is largest: on this width it falls to 1/e of it.
    void add_power(double time, double u, double curvature, double exponent) {
        if (u * curvature < 0) add(time, std::sqrt(-2 * u / (exponent * curvature)));
    }

    void of_polynomial(const ex& u, const std::string& name, double exponent) {
        const std::vector<double> c = coefficients_of(u);
        if (c.empty()) return;
        const auto slope = [](const std::vector<double>& of) {
            std::vector<double> result;
            for (std::size_t i = 1; i < of.size(); ++i) result.push_back(static_cast<double>(i) * of[i]);
            return result;
        };
        const auto at = [](const std::vector<double>& of, double x) {
            double value = 0;
            for (std::size_t j = of.size(); j-- > 0;) value = value * x + of[j];
            return value;
        };
        const std::vector<double> first = slope(c);
        if (name == "exp" && c.size() > 2)
            for (const auto& root : roots_of(first)) {
                if (std::fabs(root.imag()) > multiple * std::abs(root)) continue;
                const double middle = root.real(), most = at(c, middle);
                double width = 2 * widest_;  // on which u falls by 1
                while (width > widest_ * tiny &&
                       std::fmin(most - at(c, middle - width / 2), most - at(c, middle + width / 2)) >= 1)
                    width /= 2;
                add(middle, width);
            }
        if (is_switch(name) || (name == "exp" && c.size() == 2))
            for (const auto& root : roots_of(c))
                if (std::fabs(root.imag()) <= real * std::abs(root))
                    add(root.real(), 1 / std::fabs(at(first, root.real())));
        if (exponent < 0)
            for (const auto& root : roots_of(c))
                if (root.imag() > 0) add(root.real(), root.imag());
        if (exponent >= high_power)
            for (const auto& root : roots_of(first))
                if (std::fabs(root.imag()) <= multiple * std::abs(root))
                    add_power(root.real(), at(c, root.real()), at(slope(first), root.real()), exponent);
    }

    static const Spline& spline_in(const ex& table) {
        return spline_of(GiNaC::ex_to<GiNaC::numeric>(table.op(0)).to_int());
    }
    // Both coefficients of a linear u(t); empty: it is not one.
    std::vector<double> of_first_degree(const ex& u) const {
        const std::vector<double> c = u.is_polynomial(t_) ? coefficients_of(u.expand()) : std::vector<double>();
        return c.size() == 2 ? c : std::vector<double>();
    }
    void of_table(const Spline& spline, const ex& u) {
        const std::vector<double> c = of_first_degree(u);
        if (c.empty()) return;
        for (const Bend& bend : bends_of(spline))
            if (pulses_.size() < most_pulses) add((bend.place - c[0]) / c[1], bend.width / std::fabs(c[1]));
    }

    double time_of_sample(std::size_t i) const { return begin_ + static_cast<double>(i) * ((end_ - begin_) / samples); }
    std::vector<double> samples_of(const ex& u) const {
        std::vector<double> values;
        if (const std::optional<Tape> tape = Tape::of(u, std::vector{t_})) {
            for (std::size_t i = 0; i <= samples; ++i) values.push_back((*tape)({time_of_sample(i)}));
            return values;
        }
        for (std::size_t i = 0; i <= samples; ++i) {
            const ex value = u.subs(t_ == GiNaC::numeric(time_of_sample(i))).evalf();
            const bool is_number = GiNaC::is_a<GiNaC::numeric>(value) && GiNaC::ex_to<GiNaC::numeric>(value).is_real();
            values.push_back(is_number ? GiNaC::ex_to<GiNaC::numeric>(value).to_double() : std::nan(""));
        }
        return values;
    }

    // Of any u(t): from its values at many times.
    void of_samples(const ex& u, const std::string& name, double exponent) {
        const bool is_pole = exponent < 0, is_high = exponent >= high_power;
        const double distance = (end_ - begin_) / samples, sign = name == "exp" || is_high ? -1 : 1;
        if (name != "exp" && !is_pole && !is_high && !is_switch(name)) return;
        std::vector<double> values = samples_of(u);
        for (double& value : values) value = is_pole || is_high ? std::fabs(value) : value;
        for (std::size_t i = 1; i + 1 < values.size() && pulses_.size() < most_pulses; ++i) {
            const double time = time_of_sample(i);
            if (is_switch(name)) {
                if ((values[i - 1] < 0) != (values[i] < 0)) add(time, distance / std::fabs(values[i] - values[i - 1]));
                continue;
            }
            if (!(sign * values[i] <= sign * values[i - 1] && sign * values[i] < sign * values[i + 1])) continue;
            const double curvature = sign * (values[i - 1] - 2 * values[i] + values[i + 1]) / (distance * distance);
            if (is_high)
                add_power(time, values[i], -curvature, exponent);
            else if (curvature > 0)
                add(time, name == "exp" ? std::sqrt(2 / curvature) : std::sqrt(2 * values[i] / curvature));
        }
    }

    const GiNaC::symbol t_;
    const double begin_, end_, widest_;
    GiNaC::exmap values_;
    GiNaC::exset motion_, known_;
    std::vector<Pulse> pulses_;
    std::vector<double> knots_;
};

}  // namespace

std::vector<Pulse> find_pulses(const Outline& outline, const std::vector<double>& parameters, double begin, double end,
                               double widest) {
    const SystemOutline& system = outline.system;
    if (system.autonomous && outline.scene.switches.empty()) return {};
    PulseFinder finder(system, parameters, begin, end, widest);
    finder.look_at(system.lagrangian);
    for (const ex& force : system.outer_force) finder.look_at(force);
    for (const Constraint& constraint : system.constraints) finder.look_at(constraint.value);
    for (const Switch& one : outline.scene.switches) finder.look_at_side(one.value);
    return finder.pulses();
}

std::vector<double> find_knots(const Outline& outline, const std::vector<double>& parameters, double begin,
                               double end) {
    const SystemOutline& system = outline.system;
    if (system.autonomous || outline.scene.tables.empty()) return {};
    PulseFinder finder(system, parameters, begin, end, 0);
    finder.look_at_tables(system.lagrangian);
    for (const ex& force : system.outer_force) finder.look_at_tables(force);
    for (const Constraint& constraint : system.constraints) finder.look_at_tables(constraint.value);
    return finder.knots();
}

void insert_in_order(std::vector<Pulse>& pulses, const Pulse& one) {
    pulses.insert(std::upper_bound(pulses.begin(), pulses.end(), one,
                                   [](const Pulse& a, const Pulse& b) { return a.time < b.time; }),
                  one);
}

bool is_too_long(const std::vector<Pulse>& pulses, double grading, double from, double step) {
    const double begin = std::fmin(from, from + step), end = std::fmax(from, from + step), size = end - begin;
    const auto first = std::lower_bound(pulses.begin(), pulses.end(), begin - grading * size,
                                        [](const Pulse& pulse, double time) { return pulse.time < time; });
    for (auto pulse = first; pulse != pulses.end() && pulse->time < end + grading * size; ++pulse) {
        const double distance = std::fmax(0.0, std::fmax(begin - pulse->time, pulse->time - end));
        if (size > std::fmax(pulse->width / 2, distance / grading)) return true;
    }
    return false;
}

}  // namespace lobatto
