// SPDX-License-Identifier: GPL-2.0-or-later
// Random systems, chosen to be hard, against an integrator that is not ours: is the error that `lobatto run` prints the
// true one?
//
//     attack SEED CASES [CLASS]
//
// Case i is made of SEED + i; the classes take turns. The truth is Boost.odeint's Runge-Kutta-Fehlberg 7(8) in long
// double, on equations of motion that come from the Lagrangian by numbers with derivatives: nothing of the generator
// is used. A silent miss is a run that ends with exit code 0, and whose error at the end is more than ten times the
// printed one, the doubt about the truth and rounding together. Prints each with its scene, and the ratios of true to
// printed errors; exit code 1 when there was a miss.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <boost/numeric/odeint.hpp>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <map>
#include <memory>
#include <mutex>
#include <numbers>
#include <optional>
#include <random>
#include <thread>

#include "tests/support.hpp"
#include "tests/trajectory_table.hpp"

using namespace lobatto;

namespace {

using real = long double;
namespace odeint = boost::numeric::odeint;

// ---------------------------------------------------------------------------------------------------------------------
// Lagrangians
// ---------------------------------------------------------------------------------------------------------------------

// A number with its derivatives along two directions, and the mixed second one.
struct Jet {
    real f = 0, a = 0, b = 0, ab = 0;
};
Jet operator+(const Jet& x, const Jet& y) {
    return {x.f + y.f, x.a + y.a, x.b + y.b, x.ab + y.ab};
}
Jet operator-(const Jet& x, const Jet& y) {
    return {x.f - y.f, x.a - y.a, x.b - y.b, x.ab - y.ab};
}
Jet operator*(const Jet& x, const Jet& y) {
    return {x.f * y.f, x.a * y.f + x.f * y.a, x.b * y.f + x.f * y.b, x.ab * y.f + x.a * y.b + x.b * y.a + x.f * y.ab};
}
// g(x) with g, g' and g'' at x.
Jet chain(const Jet& x, real g, real first, real second) {
    return {g, first * x.a, first * x.b, first * x.ab + second * x.a * x.b};
}

struct Node;
using Formula = std::shared_ptr<const Node>;
struct Node {
    std::string operation;  // "" for a number or a variable
    double number = 0;
    std::string name;
    std::size_t variable = 0;  // q[0], v[0], q[1], v[1], ..., t
    Formula left, right;
};

Formula number(double x) {
    return std::make_shared<Node>(Node{"", x, "", 0, nullptr, nullptr});
}
Formula binary(const std::string& operation, const Formula& x, const Formula& y) {
    return std::make_shared<Node>(Node{operation, 0, "", 0, x, y});
}
Formula operator+(const Formula& x, const Formula& y) {
    return binary("+", x, y);
}
Formula operator-(const Formula& x, const Formula& y) {
    return binary("-", x, y);
}
Formula operator*(const Formula& x, const Formula& y) {
    return binary("*", x, y);
}
Formula operator/(const Formula& x, const Formula& y) {
    return binary("/", x, y);
}
Formula operator*(double x, const Formula& y) {
    return number(x) * y;
}
Formula power(const Formula& x, double exponent) {
    return binary("^", x, number(exponent));
}
Formula call(const std::string& function, const Formula& x) {
    return binary(function, x, nullptr);
}

std::string text(const Formula& x) {
    if (x->operation.empty()) return x->name.empty() ? fmt::format("({:.17g})", x->number) : x->name;
    if (!x->right) return fmt::format("{}({})", x->operation, text(x->left));
    return fmt::format("({} {} {})", text(x->left), x->operation, text(x->right));
}

Jet value(const Formula& x, const std::vector<Jet>& variables) {
    const std::string& operation = x->operation;
    if (operation.empty()) return x->name.empty() ? Jet{static_cast<real>(x->number), 0, 0, 0} : variables[x->variable];
    const Jet left = value(x->left, variables);
    const real f = left.f;
    if (operation == "sin") return chain(left, std::sin(f), std::cos(f), -std::sin(f));
    if (operation == "cos") return chain(left, std::cos(f), -std::sin(f), -std::cos(f));
    if (operation == "exp") return chain(left, std::exp(f), std::exp(f), std::exp(f));
    if (operation == "sqrt") return chain(left, std::sqrt(f), 1 / (2 * std::sqrt(f)), -1 / (4 * f * std::sqrt(f)));
    if (operation == "tanh") {
        const real tangent = std::tanh(f), slope = 1 - tangent * tangent;
        return chain(left, tangent, slope, -2 * tangent * slope);
    }
    if (operation == "^") {
        const real e = x->right->number;
        return chain(left, std::pow(f, e), e * std::pow(f, e - 1), e * (e - 1) * std::pow(f, e - 2));
    }
    const Jet right = value(x->right, variables);
    if (operation == "+") return left + right;
    if (operation == "-") return left - right;
    if (operation == "*") return left * right;
    if (operation == "/")
        return left * chain(right, 1 / right.f, -1 / (right.f * right.f), 2 / (right.f * right.f * right.f));
    throw std::logic_error("unknown operation " + operation);
}

// ---------------------------------------------------------------------------------------------------------------------
// Cases
// ---------------------------------------------------------------------------------------------------------------------

struct Pulse {
    double time, width;
};

struct Case {
    Formula lagrangian;
    std::vector<double> q, v;
    std::string method;
    double step = 0;
    int steps = 0;
    double longest = 0.5;         // steps of the reference
    std::vector<Pulse> pulses{};  // it takes short ones there

    std::string scene() const {
        std::string coordinates;
        for (std::size_t k = 0; k < q.size(); ++k)
            coordinates += fmt::format("{} = {{ position = {:.17g}, velocity = {:.17g} }}\n", "xyz"[k], q[k], v[k]);
        return fmt::format(
            "time = \"t\"\nlagrangian = \"{}\"\n[coordinates]\n{}[method]\n{}\n[run]\nstep = {:.17g}\nuntil = "
            "{:.17g}\n",
            text(lagrangian), coordinates, method, step, step * steps);
    }
};

class Author {
public:
    explicit Author(std::uint64_t seed) : random_(seed) {}

    static inline const std::vector<std::string> classes = {"ordinary", "separatrix", "pulse",  "scales", "singular",
                                                            "unstable", "saturated",  "narrow", "sampled"};

    Case make(const std::string& kind) {
        Case made;
        made.method = method();
        if (kind == "ordinary") ordinary(made);
        if (kind == "separatrix") separatrix(made);
        if (kind == "pulse") pulse(made);
        if (kind == "scales") scales(made);
        if (kind == "singular") singular(made);
        if (kind == "unstable") unstable(made);
        if (kind == "saturated") saturated(made);
        if (kind == "narrow") narrow(made);
        if (kind == "sampled") sampled(made);
        return made;
    }

private:
    int whole(int low, int high) { return std::uniform_int_distribution<int>(low, high)(random_); }
    double uniform(double low, double high) {
        return std::round(std::uniform_real_distribution<double>(low, high)(random_) * 1e4) / 1e4;
    }
    double magnitude(double low, double high) { return std::pow(10, uniform(low, high)); }
    bool one_in(int count) { return whole(1, count) == 1; }

    static Formula q(std::size_t k) { return std::make_shared<Node>(Node{"", 0, {"xyz"[k]}, 2 * k, {}, {}}); }
    static Formula v(std::size_t k) {
        return std::make_shared<Node>(Node{"", 0, std::string{"xyz"[k]} + "'", 2 * k + 1, {}, {}});
    }
    static Formula time(const Case& made) {
        return std::make_shared<Node>(Node{"", 0, "t", 2 * made.q.size(), {}, {}});
    }
    static Formula squared(const Formula& x) { return power(x, 2); }

    std::string method() {
        switch (whole(0, 5)) {
            case 0:
                return fmt::format("family = \"gauss\"\nstages = {}", whole(1, 6));
            case 1:
                return "points = 2";
            default:
                return fmt::format("points = {}", whole(3, 10));
        }
    }
    void start(Case& made, int coordinates, double size = 1) {
        for (int k = 0; k < coordinates; ++k) {
            made.q.push_back(size * uniform(-1, 1));
            made.v.push_back(size * uniform(-1, 1));
        }
    }
    void times(Case& made, double step, int most = 400) {
        made.step = step;
        made.steps = whole(most / 20, most);
        made.longest = std::fmin(0.5, 2 * step);
    }
    static Formula kinetic(const Case& made) {
        Formula sum = 0.5 * squared(v(0));
        for (std::size_t k = 1; k < made.q.size(); ++k) sum = sum + 0.5 * squared(v(k));
        return sum;
    }
    static Formula springs(const Case& made, double stiffness = 1) {
        Formula sum = (0.5 * stiffness) * squared(q(0));
        for (std::size_t k = 1; k < made.q.size(); ++k) sum = sum + (0.5 * stiffness) * squared(q(k));
        return sum;
    }

    Formula term(const Case& made, int depth) {
        const std::size_t k = static_cast<std::size_t>(whole(0, static_cast<int>(made.q.size()) - 1));
        if (depth == 0) return one_in(6) ? number(uniform(0.2, 2)) : q(k);
        const Formula x = term(made, depth - 1);
        switch (whole(0, 8)) {
            case 0:
                return call("sin", x);
            case 1:
                return call("cos", uniform(0.5, 3) * x);
            case 2:
                return call("exp", number(-1) * squared(x));
            case 3:
                return call("sqrt", number(1) + squared(x));
            case 4:
                return call("tanh", x);
            case 5:
                return number(1) / (number(uniform(1, 2)) + squared(x));
            case 6:
                return squared(x);
            default:
                return x * term(made, depth - 1);
        }
    }

    void ordinary(Case& made) {
        start(made, whole(1, 3));
        Formula lagrangian = kinetic(made) - springs(made, uniform(0.5, 2)) - uniform(-1, 1) * term(made, whole(1, 3));
        if (one_in(3)) lagrangian = lagrangian + uniform(0.1, 0.5) * squared(v(0)) * (number(1) + squared(q(0)));
        if (made.q.size() > 1 && one_in(3)) lagrangian = lagrangian + uniform(-2, 2) * q(0) * v(1);
        if (made.q.size() > 1 && one_in(3))
            lagrangian = lagrangian + uniform(-0.4, 0.4) * v(0) * v(1) * call("cos", q(0) - q(1));
        if (one_in(4)) lagrangian = lagrangian + q(0) * call("cos", uniform(0.3, 5) * time(made));
        made.lagrangian = lagrangian;
        times(made, magnitude(-2, 0.2));
    }

    // From very near to the top of a barrier, or at it.
    void separatrix(Case& made) {
        const double beside = one_in(5) ? 0 : magnitude(-16, -2);
        made.q = {beside};
        made.v = {one_in(3) ? magnitude(-16, -2) : 0};
        switch (whole(0, 3)) {
            case 0:
                made.q[0] += std::numbers::pi;
                made.lagrangian = 0.5 * squared(v(0)) + call("cos", q(0));
                break;
            case 1:
                made.lagrangian = 0.5 * squared(v(0)) + 0.5 * squared(q(0)) - 0.25 * power(q(0), 4);
                break;
            case 2:
                made.q[0] += 1;
                made.lagrangian =
                    0.5 * squared(v(0)) - 0.5 * squared(q(0)) + 0.25 * power(q(0), 4) - 0.025 * power(q(0), 6);
                break;
            default:
                made.q.push_back(magnitude(-10, -1));
                made.v.push_back(0);
                made.lagrangian = kinetic(made) + call("cos", q(0)) - 0.5 * squared(q(1)) - 0.3 * q(0) * q(1);
        }
        times(made, magnitude(-1.5, 0), 1000);
    }

    // Short pulses in time: of most of the shapes that one writes.
    void pulse(Case& made) {
        start(made, whole(1, 2));
        times(made, magnitude(-1.5, 0));
        const int count = whole(1, 3);
        Formula force = number(0);
        for (int i = 0; i < count; ++i) {
            const double width = made.step * magnitude(-3, 1), at = made.step * made.steps * uniform(0.05, 0.95);
            made.pulses.push_back({at, width});
            const Formula u = (time(made) - number(at)) / number(width);
            Formula shape;
            switch (whole(0, 4)) {
                case 0:
                    shape = call("exp", number(-1) * squared(u));
                    break;
                case 1:
                    shape = number(1) / (number(1) + squared(u));
                    break;
                case 2:
                    shape = number(1) - squared(call("tanh", u));
                    break;
                case 3:
                    shape = call("tanh", u);
                    break;
                default:
                    shape = power(number(1) + squared(u), -1.5);
            }
            force = force + (uniform(0.2, 1) / std::fmin(1, width)) * shape;
        }
        made.lagrangian = kinetic(made) - springs(made, uniform(0.5, 2)) + q(0) * force;
        if (one_in(2)) made.lagrangian = made.lagrangian - 0.1 * power(q(0), 4);
    }

    // Fast and slow, stiff and soft, large and small.
    void scales(Case& made) {
        const double fast = magnitude(0.5, 3), large = one_in(2) ? magnitude(-6, 6) : 1;
        made.q = {uniform(0.2, 1), large * uniform(0.2, 1)};
        made.v = {0, large * uniform(-1, 1)};
        switch (whole(0, 2)) {
            case 0:
                made.lagrangian = kinetic(made) + (fast * fast) * call("cos", q(0)) - 0.5 * squared(q(1)) -
                                  0.1 * call("sin", q(0)) * call("sin", (1 / large) * q(1));
                break;
            case 1:
                made.lagrangian = kinetic(made) - (0.5 * fast * fast) * squared(q(0)) - 0.5 * squared(q(1)) -
                                  (0.1 / large) * squared(q(0)) * q(1);
                made.q[0] /= fast;
                break;
            default:
                made.lagrangian = 0.5 * squared(v(0)) + (0.5 / fast) * squared(v(1)) - 0.5 * squared(q(0)) -
                                  0.5 * squared(q(1)) - (0.25 / large) * q(0) * q(1);
        }
        times(made, magnitude(-2, 0));
        made.longest = std::fmin(made.longest, 1 / fast);
    }

    // Close encounters and masses that nearly vanish.
    void singular(Case& made) {
        const double near = magnitude(-3, -0.3);
        switch (whole(0, 3)) {
            case 0: {  // Kepler, from the far end
                const double e = 1 - near;
                made.q = {1 + e, 0};
                made.v = {0, std::sqrt((1 - e) / (1 + e))};
                made.lagrangian = kinetic(made) + number(1) / call("sqrt", squared(q(0)) + squared(q(1)));
                break;
            }
            case 1:  // a softened centre
                made.q = {1, 0};
                made.v = {0, near};
                made.lagrangian =
                    kinetic(made) + number(1) / call("sqrt", squared(q(0)) + squared(q(1)) + number(near * near));
                break;
            case 2:  // a mass that nearly vanishes
                made.q = {1};
                made.v = {0};
                made.lagrangian = 0.5 * squared(v(0)) * (number(1 + near) - call("cos", q(0))) - squared(q(0));
                break;
            default:  // a hard wall
                made.q = {1};
                made.v = {-0.5};
                made.lagrangian = kinetic(made) - near * near * power(q(0), -2) - 0.5 * squared(q(0));
        }
        times(made, magnitude(-2.5, -0.5));
        made.longest = std::fmin(made.longest, 0.1);
    }

    // Steps as long as the period, resonances, steps beyond the stable range.
    void unstable(Case& made) {
        const double rate = magnitude(-0.5, 1.5),
                     phase = std::numbers::pi * (whole(1, 4) + (one_in(2) ? 0 : uniform(-0.2, 0.2)));
        start(made, 1);
        made.lagrangian = kinetic(made) - (0.5 * rate * rate) * squared(q(0));
        if (one_in(2)) made.lagrangian = made.lagrangian - magnitude(-6, 0) * power(q(0), 4);
        if (one_in(4)) made.lagrangian = made.lagrangian + q(0) * call("cos", uniform(1, 3) * rate * time(made));
        times(made, phase / rate);
        made.longest = 0.5 / rate;
    }

    // Errors that have grown to the size of the motion long before the end.
    void saturated(Case& made) {
        switch (whole(0, 2)) {
            case 0:
                made.q = {uniform(0.1, 0.5), uniform(0.1, 0.5)};
                made.v = {uniform(-0.3, 0.3), uniform(-0.3, 0.3)};
                made.lagrangian = kinetic(made) - springs(made) - squared(q(0)) * q(1) + (1.0 / 3) * power(q(1), 3);
                break;
            case 1:
                made.q = {uniform(0, 3)};
                made.v = {uniform(-1, 1)};
                made.lagrangian =
                    kinetic(made) + (number(1) + uniform(0, 1) * call("cos", time(made))) * call("cos", q(0));
                break;
            default:
                made.q = {uniform(1, 3), uniform(1, 3)};
                made.v = {0, 0};
                made.lagrangian = squared(v(0)) + 0.5 * squared(v(1)) + v(0) * v(1) * call("cos", q(0) - q(1)) +
                                  2 * call("cos", q(0)) + call("cos", q(1));
        }
        times(made, magnitude(-1.5, -0.3), 4000);
    }

    // Walls, wells and steps in the way that are narrower than what a step moves, and pulses that move with the motion.
    void narrow(Case& made) {
        start(made, 1);
        made.v[0] += 1;
        times(made, magnitude(-1.5, -0.5), 60);
        const double width = made.step * magnitude(-1.5, 0), strength = uniform(-1, 1);
        const Formula u = (q(0) - number(uniform(-0.4, 0.4))) / number(width);
        Formula term;
        switch (whole(0, 4)) {
            case 0:
                term = strength * call("exp", number(-1) * squared(u));
                break;
            case 1:
                term = number(strength) / (number(1) + squared(u));
                break;
            case 2:
                term = (0.2 * strength) * call("tanh", u);
                break;
            case 3:
                term = strength * call("exp", number(-1) * power(u, 4));
                break;
            default: {
                const double at = made.step * made.steps * uniform(0.05, 0.95);
                const Formula moving = (time(made) - number(at) - 0.1 * call("sin", q(0))) / number(width);
                made.pulses.push_back({at, width});
                term = (strength / std::fmin(1, width)) * q(0) *
                       call("exp", number(-1) * power(moving, one_in(2) ? 2 : 4));
            }
        }
        made.lagrangian = kinetic(made) - springs(made) + term;
        made.longest = std::fmin(made.longest, width / 8);
    }

    // Oscillations that look constant at equal steps.
    void sampled(Case& made) {
        start(made, whole(1, 2));
        times(made, magnitude(-1.5, -0.3), 200);
        if (one_in(2)) made.method = "points = 2";
        const double whole_turns = whole(1, 8), rate = std::numbers::pi * whole_turns / made.step;
        made.lagrangian =
            kinetic(made) - springs(made, uniform(0.5, 2)) + uniform(0.2, 2) * q(0) * call("cos", rate * time(made));
        if (one_in(2)) made.lagrangian = made.lagrangian - 0.1 * power(q(0), 4);
        made.longest = 1 / rate;
    }

    std::mt19937_64 random_;
};

// ---------------------------------------------------------------------------------------------------------------------
// The truth
// ---------------------------------------------------------------------------------------------------------------------

using State = std::vector<real>;  // q, v

// d/dt (dL/dv) = dL/dq solved for the accelerations.
void slope_of(const Case& problem, const State& y, State& dy, real t) {
    const std::size_t n = problem.q.size();
    std::vector<Jet> at(2 * n + 1);
    const auto reset = [&] {
        for (std::size_t k = 0; k < n; ++k) at[2 * k] = {y[k], 0, 0, 0}, at[2 * k + 1] = {y[n + k], 0, 0, 0};
        at[2 * n] = {t, 0, 0, 0};
    };
    std::array<std::array<real, 4>, 3> matrix{};
    for (std::size_t i = 0; i < n; ++i) {
        reset();
        at[2 * i].a = 1;
        const real force = value(problem.lagrangian, at).a;
        reset();
        at[2 * i + 1].a = 1;
        for (std::size_t k = 0; k < n; ++k) at[2 * k].b = y[n + k];
        at[2 * n].b = 1;
        matrix[i][n] = force - value(problem.lagrangian, at).ab;
        for (std::size_t j = 0; j <= i; ++j) {
            reset();
            at[2 * i + 1].a = 1;
            at[2 * j + 1].b = 1;
            matrix[i][j] = matrix[j][i] = value(problem.lagrangian, at).ab;
        }
    }
    for (std::size_t i = 0; i < n; ++i) {
        std::size_t pivot = i;
        for (std::size_t r = i + 1; r < n; ++r)
            if (std::fabs(matrix[r][i]) > std::fabs(matrix[pivot][i])) pivot = r;
        std::swap(matrix[i], matrix[pivot]);
        for (std::size_t r = 0; r < n; ++r) {
            if (r == i) continue;
            const real factor = matrix[r][i] / matrix[i][i];
            for (std::size_t c = i; c <= n; ++c) matrix[r][c] -= factor * matrix[i][c];
        }
    }
    for (std::size_t i = 0; i < n; ++i) {
        dy[i] = y[n + i];
        dy[n + i] = matrix[i][n] / matrix[i][i];
    }
}

struct Truth {
    State end;
    std::vector<real> least, most;  // of the positions
};

std::optional<Truth> truth_of(const Case& problem, real tolerance, real longest) {
    constexpr long most_steps = 400000;
    State y(problem.q.begin(), problem.q.end());
    y.insert(y.end(), problem.v.begin(), problem.v.end());
    Truth truth{y, y, y};
    real size = 1;  // of what moves least
    for (const auto* numbers : {&problem.q, &problem.v})
        for (const double x : *numbers)
            if (x != 0) size = std::fmin(size, std::fabs(static_cast<real>(x)));
    auto stepper = odeint::make_controlled(tolerance * size, tolerance, odeint::runge_kutta_fehlberg78<State, real>());
    const auto slope = [&](const State& at, State& dy, real t) { slope_of(problem, at, dy, t); };
    const real until = static_cast<real>(problem.step) * problem.steps;
    real t = 0, step = longest / 16;
    for (long count = 0; t < until; ++count) {
        if (count == most_steps) return std::nullopt;
        real limit = longest;
        for (const Pulse& pulse : problem.pulses)
            limit = std::min<real>(limit, std::fmax(static_cast<real>(pulse.width) / 8, std::fabs(t - pulse.time) / 8));
        const bool is_last = t + std::min(step, limit) >= until;
        real trial = is_last ? until - t : std::min(step, limit);
        if (stepper.try_step(slope, y, t, trial) == odeint::success) {
            if (is_last) t = until;
            for (std::size_t k = 0; k < y.size(); ++k) {
                if (!std::isfinite(y[k])) return std::nullopt;
                truth.least[k] = std::min(truth.least[k], y[k]);
                truth.most[k] = std::max(truth.most[k], y[k]);
            }
        }
        step = trial;
        if (!(step > 1e-18L * (1 + t))) return std::nullopt;
    }
    truth.end = y;
    return truth;
}

// ---------------------------------------------------------------------------------------------------------------------
// Comparison
// ---------------------------------------------------------------------------------------------------------------------

// reported: exit code 3. false_alarm: that, though the motion is known to 1 % where the file ends.
enum class Outcome { measured, reported, false_alarm, refused, no_truth, miss };

struct Report {
    Outcome outcome = Outcome::refused;
    double truth = 0, printed = 0, doubt = 0;
    std::string said;
};

// The figure before "of the amplitude" that the table gives for the end; nothing: none is given.
std::optional<double> printed_error(const std::string& table) {
    const std::size_t row = table.find("  measured error");
    if (row == std::string::npos) return std::nullopt;
    const std::string line = table.substr(row, table.find('\n', row) - row);
    const auto number_after = [&](const std::string& words) -> std::optional<double> {
        const std::size_t place = line.find(words);
        if (place == std::string::npos) return std::nullopt;
        return std::strtod(line.c_str() + place + words.size(), nullptr);
    };
    if (const auto guess = number_after("perhaps ")) return guess;
    if (const auto end = number_after("; at the end ")) return end;
    return number_after("  measured error");
}

Report look_at(const Case& problem) {
    Report report;
    const test::TemporaryFolder folder;
    test::write_text(folder / "scene.toml", problem.scene());
    const test::Finished done =
        test::run({"timeout", "60", LOBATTO_PROGRAM, "run", folder / "scene.toml", "-o", folder / "run.csv"});
    report.said = done.out + done.err;
    const bool is_reported = done.exit_code == 3;
    const std::optional<double> printed = printed_error(done.out);
    if (!is_reported && (done.exit_code != 0 || !printed)) return report;
    report.outcome = is_reported ? Outcome::reported : Outcome::no_truth;
    report.printed = printed.value_or(1);
    const auto rows = test::read_trajectory(folder / "run.csv").rows;
    if (std::fabs(rows.back()[0] - problem.step * problem.steps) > problem.step / 2) return report;  // it stopped
    const auto truth = truth_of(problem, 1e-17L, problem.longest),
               rough = truth_of(problem, 1e-14L, 2 * problem.longest);
    if (!truth || !rough) return report;
    double rounding = 0;
    for (std::size_t k = 0; k < problem.q.size(); ++k) {
        double least = static_cast<double>(truth->least[k]), most = static_cast<double>(truth->most[k]);
        for (const auto& row : rows) {
            least = std::fmin(least, row[1 + k]);
            most = std::fmax(most, row[1 + k]);
        }
        const double amplitude = (most - least) / 2, size = std::fmax(std::fabs(least), std::fabs(most));
        if (!(amplitude > 1e-12 * size)) continue;
        report.truth =
            std::fmax(report.truth, static_cast<double>(std::fabs(rows.back()[1 + k] - truth->end[k])) / amplitude);
        report.doubt =
            std::fmax(report.doubt, static_cast<double>(std::fabs(rough->end[k] - truth->end[k])) / amplitude);
        rounding = std::fmax(rounding, 1e-14 * size / amplitude);
    }
    const bool is_missed = report.truth > 10 * (report.printed + report.doubt + rounding);
    if (is_reported)
        report.outcome = report.truth + report.doubt < 0.01 ? Outcome::false_alarm : Outcome::reported;
    else
        report.outcome = is_missed ? Outcome::miss : Outcome::measured;
    return report;
}

struct Tally {
    std::map<Outcome, int> count;
    std::vector<double> ratios;  // of true to printed errors above rounding
};

}  // namespace

int main(int argc, char** argv) {
    if (argc < 3) {
        std::cerr << "attack SEED CASES [CLASS]\n";
        return 2;
    }
    std::setvbuf(stdout, nullptr, _IOLBF, 0);  // what was found stands there, whatever ends the program
    const std::uint64_t seed = std::strtoull(argv[1], nullptr, 10);
    const int cases = std::atoi(argv[2]);
    const std::vector<std::string> classes = argc > 3 ? std::vector<std::string>{argv[3]} : Author::classes;
    std::map<std::string, Tally> tallies;
    std::mutex mutex;
    std::atomic<int> next{0};
    const auto work = [&] {
        for (int i = next++; i < cases; i = next++) {
            const std::string& kind = classes[static_cast<std::size_t>(i) % classes.size()];
            const Case problem = Author(seed + static_cast<std::uint64_t>(i)).make(kind);
            const Report report = look_at(problem);
            const std::lock_guard lock(mutex);
            Tally& tally = tallies[kind];
            ++tally.count[report.outcome];
            if (report.outcome == Outcome::measured && report.truth > 1e-11 && report.truth > 10 * report.doubt)
                tally.ratios.push_back(report.truth / report.printed);
            const std::map<Outcome, std::string> seen{{Outcome::miss, "SILENT MISS"},
                                                      {Outcome::refused, "refused"},
                                                      {Outcome::false_alarm, "exit code 3, but right at the end"}};
            if (seen.contains(report.outcome))
                fmt::print("{} {}, {}: true {:.2e}, printed {:.2e}, doubt {:.1e}\n{}{}\n",
                           seed + static_cast<std::uint64_t>(i), kind, seen.at(report.outcome), report.truth,
                           report.printed, report.doubt, problem.scene(), report.said);
        }
    };
    std::vector<std::thread> threads;
    for (unsigned i = 0; i < std::max(1U, std::thread::hardware_concurrency()); ++i) threads.emplace_back(work);
    for (std::thread& thread : threads) thread.join();

    fmt::print("{:12} {:>9} {:>8} {:>12} {:>8} {:>9} {:>7}   true/printed: 5 %, median, 95 %, largest\n", "class",
               "measured", "reported", "false alarms", "refused", "no truth", "misses");
    int misses = 0;
    for (auto& [kind, tally] : tallies) {
        std::sort(tally.ratios.begin(), tally.ratios.end());
        const auto part = [&, &ratios = tally.ratios](double share) {
            return ratios.empty() ? 0.0
                                  : ratios[static_cast<std::size_t>(share * static_cast<double>(ratios.size() - 1))];
        };
        misses += tally.count[Outcome::miss];
        fmt::print("{:12} {:9} {:8} {:12} {:8} {:9} {:7}   {:.2g} {:.2g} {:.2g} {:.2g}\n", kind,
                   tally.count[Outcome::measured], tally.count[Outcome::reported], tally.count[Outcome::false_alarm],
                   tally.count[Outcome::refused], tally.count[Outcome::no_truth], tally.count[Outcome::miss],
                   part(0.05), part(0.5), part(0.95), part(1));
    }
    fmt::print("{} cases, {} silent misses\n", cases, misses);
    return misses > 0 ? 1 : 0;
}
