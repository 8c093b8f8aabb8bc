// SPDX-License-Identifier: GPL-2.0-or-later
// Random Lagrangians: the emitted kernel against the graph interpreted in 60-digit numbers, and against an integrator
// that knows nothing of variational integrators.
//
//     differential SEED CASES [EVERY]
//
// Case i is made of SEED + i. In each the optimised programs are interpreted in CLN and compared with derivatives of L;
// every EVERY-th (default: each) is compiled too: its slopes, momenta and energies are compared with CLN's, and its
// motion with Gragg, Bulirsch and Stoer's extrapolation of the equations of motion in long double. Prints each
// disagreement with its scene; exit code 1 when there was one.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iostream>
#include <random>

#include "analysis/kernel/kernel_of.hpp"
#include "generator/check/check.hpp"
#include "generator/graph/optimise.hpp"
#include "generator/pipeline.hpp"
#include "runtime/error.hpp"
#include "tests/support.hpp"

using namespace lobatto;

namespace {

using real = long double;
using Reals = std::vector<real>;

// A scene of one to three coordinates, smooth near its start.
class Author {
public:
    explicit Author(std::uint64_t seed) : random_(seed) {}

    std::string scene() {
        const int n = whole(1, 3), kind = whole(0, 6);
        names_.assign({"a", "b", "c"});
        names_.resize(static_cast<std::size_t>(n));
        const bool driven = whole(0, 5) == 0, damped = whole(0, 5) == 0;
        const bool is_bare = n > 1 && whole(0, 9) == 0;  // a has no mass of its own
        std::string lagrangian, coordinates, forces;
        // What a kernel models must not depend on the numbers of its scene: they may be of any size.
        const double size = whole(0, 2) == 0 ? magnitude() : 1, k = whole(0, 2) == 0 ? magnitude() : 1.3;
        for (const std::string& name : names_) {
            if (!is_bare || name != "a") lagrangian += kinetic(kind, name);
            coordinates += fmt::format("{} = {{ position = {:.4g}, velocity = {:.4g} }}\n", name,
                                       size * uniform(-0.8, 0.8), std::min(size, 1.0) * uniform(-0.5, 0.5));
            if (damped) forces += fmt::format("{} = \"-{:.3f}*{}'\"\n", name, uniform(0, 0.3), name);
        }
        if (is_bare)
            lagrangian += fmt::format(" + {:.3f}*a'*(b' + {})", uniform(0.5, 1.5), formula(2));
        else if (n > 1 && whole(0, 1) == 0)
            lagrangian +=
                fmt::format(" + {:.3f}*a'*b'{}", uniform(-0.4, 0.4), kind >= 3 ? "*cos(" + formula(1) + ")" : "");
        for (const std::string& name : names_)
            if (whole(0, 3) > 0) lagrangian += fmt::format(" - {:.3f}*{}^2/2", uniform(0.2, 3), name);
        if (whole(0, 5) > 0) lagrangian += fmt::format(" - {:.3f}*({})", uniform(-1, 1), formula(3));
        if (driven) lagrangian += fmt::format(" + {:.3f}*sin({:.3f}*t)*a", uniform(0, 1), uniform(0.5, 3));
        const std::string method = whole(0, 1) == 0 ? fmt::format("points = {}", whole(2, 8))
                                                    : fmt::format("family = \"gauss\"\nstages = {}", whole(1, 6));
        const bool has_k = lagrangian.find('k') != std::string::npos;
        return fmt::format(
            "{}lagrangian = \"{}\"\n[coordinates]\n{}{}{}[method]\n{}\n[run]\nstep = {:.3f}\nuntil = 1\n[output]\n"
            "tangent = false\n",
            driven ? "time = \"t\"\n" : "", lagrangian, coordinates,
            has_k ? fmt::format("[parameters]\nk = {:.4g}\n", k) : "", forces.empty() ? "" : "[forces]\n" + forces,
            method, uniform(0.02, 0.1));
    }

    int whole(int low, int high) { return std::uniform_int_distribution<int>(low, high)(random_); }
    double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }

private:
    double magnitude() { return std::pow(10, uniform(-80, 10)); }
    std::string kinetic(int kind, const std::string& name) {
        const std::string sign = name == "a" ? "" : whole(0, 5) == 0 ? " - " : " + ";
        switch (kind) {
            case 3:
                return fmt::format("{}(2 + sin({}))*{}'^2/2", sign, formula(1), name);
            case 4:
                return fmt::format("{}{}'^2/2 + ({})*{}'", sign, name, formula(2), name);
            case 5:
                return fmt::format("{}10 - 10*sqrt(1 - {}'^2/10)", sign, name);
            case 6:
                return fmt::format("{}{}'^2/2 + {:.3f}*{}'^4", sign, name, uniform(0, 0.1), name);
            default:
                return fmt::format("{}{:.3f}*{}'^2/2", sign, uniform(0.5, 3), name);
        }
    }
    std::string formula(int depth) {
        if (depth == 0) {
            switch (whole(0, 4)) {
                case 0:
                    return fmt::format("{:.3f}", uniform(0.1, 2));
                case 1:
                    return "k";
                default:
                    return names_[static_cast<std::size_t>(whole(0, static_cast<int>(names_.size()) - 1))];
            }
        }
        const std::string x = formula(depth - 1);
        switch (whole(0, 16)) {
            case 0:
            case 1:
                return fmt::format("({} + {})", x, formula(depth - 1));
            case 2:
                return fmt::format("({} - {})", x, formula(depth - 1));
            case 3:
            case 4:
                return fmt::format("{}*{}", x, formula(depth - 1));
            case 5:
                return fmt::format("({})^{}", x, whole(2, 4));
            case 6:
                return fmt::format("sin({})", x);
            case 7:
                return fmt::format("cos({})", x);
            case 8:
                return fmt::format("exp(-({})^2)", x);
            case 9:
                return fmt::format("tanh({})", x);
            case 10:
                return fmt::format("atan({})", x);
            case 11:
                return fmt::format("sqrt(1 + ({})^2)", x);
            case 12:
                return fmt::format("log(2 + ({})^2)", x);
            case 13:
                return fmt::format("1/(1 + ({})^2)", x);
            case 14:
                return fmt::format("sinh(tanh({}))*cosh({:.3f})", x, uniform(0, 1));
            case 15:
                return fmt::format("atan2({}, 2 + sin({}))", x, formula(depth - 1));
            default:
                return fmt::format("(2 + cos({}))^({}/3)", x, whole(1, 5));
        }
    }

    std::mt19937_64 random_;
    std::vector<std::string> names_;
};

// L's derivatives as a graph of their own, interpreted in CLN's numbers or in long double.
class Mechanics {
public:
    explicit Mechanics(const Derivation& derivation) : n_(static_cast<std::size_t>(derivation.system.n)) {
        const System& s = derivation.system;
        GiNaC::exmap inputs;
        const auto declare = [&](const GiNaC::symbol& symbol, const std::string& code) {
            inputs[symbol] = graph_.input({code, code, Phase::iterate, 0.5});
        };
        for (std::size_t i = 0; i < s.parameters.size(); ++i) declare(s.parameters[i], fmt::format("p{}", i));
        for (std::size_t i = 0; i < n_; ++i) declare(s.q[i], fmt::format("q{}", i));
        for (std::size_t i = 0; i < n_; ++i) declare(s.v[i], fmt::format("v{}", i));
        declare(s.t, "t");
        const auto root = [&](const GiNaC::ex& expression) { roots_.push_back(graph_.from(expression, inputs)); };
        GiNaC::ex energy = -s.lagrangian;
        for (std::size_t i = 0; i < n_; ++i) energy += s.v[i] * s.lagrangian.diff(s.v[i]);
        root(energy);
        for (std::size_t i = 0; i < n_; ++i) root(s.lagrangian.diff(s.v[i]));
        for (std::size_t i = 0; i < n_; ++i) root(s.lagrangian.diff(s.q[i]) + s.outer_force[i]);
        for (std::size_t i = 0; i < n_; ++i)
            for (std::size_t j = 0; j < n_; ++j) root(s.lagrangian.diff(s.v[i]).diff(s.v[j]));
        // L_q + F - (L_vq v + L_vt), what M a equals
        for (std::size_t i = 0; i < n_; ++i) {
            GiNaC::ex rest = s.lagrangian.diff(s.q[i]) + s.outer_force[i] - s.lagrangian.diff(s.v[i]).diff(s.t);
            for (std::size_t j = 0; j < n_; ++j) rest -= s.lagrangian.diff(s.v[i]).diff(s.q[j]) * s.v[j];
            root(rest);
        }
        order_ = graph_.topological(roots_);
        for (const Id id : order_)
            if (graph_.is_constant(id)) {
                const cln::cl_R value = graph_.constant_of(id).value;
                const double high = cln::double_approx(value);
                constants_.push_back(static_cast<real>(high) +
                                     static_cast<real>(cln::double_approx(value - cln::cl_R(high))));
            } else {
                constants_.push_back(0);
            }
        values_.resize(static_cast<std::size_t>(graph_.size()));
    }

    // Energy, L_v, L_q + F, in 60 digits, rounded.
    Reals exact(const Reals& parameters, const Reals& q, const Reals& v, real t) const {
        std::vector<cln::cl_R> inputs;
        for (const real x : joined(parameters, q, v, t)) inputs.push_back(cln::cl_R(static_cast<double>(x)));
        const std::vector<Id> roots(roots_.begin(), roots_.begin() + 1 + 2 * static_cast<std::ptrdiff_t>(n_));
        const auto values = graph_.evaluate(inputs, roots);
        Reals result;
        for (const Id id : roots)
            result.push_back(static_cast<real>(cln::double_approx(values[static_cast<std::size_t>(id)])));
        return result;
    }

    // The acceleration; false when the mass matrix is singular or something is not a number.
    bool minus_acceleration(const Reals& parameters, const real* q, const real* v, real t, real* a) {
        const Reals inputs = joined(parameters, Reals(q, q + n_), Reals(v, v + n_), t);
        for (std::size_t k = 0; k < order_.size(); ++k) at(order_[k]) = value(order_[k], constants_[k], inputs);
        std::vector<Reals> M(n_, Reals(n_ + 1));
        const std::size_t first = 1 + 2 * n_;
        for (std::size_t i = 0; i < n_; ++i) {
            for (std::size_t j = 0; j < n_; ++j) M[i][j] = at(roots_[first + i * n_ + j]);
            M[i][n_] = at(roots_[first + n_ * n_ + i]);
        }
        for (std::size_t i = 0; i < n_; ++i) {
            std::size_t pivot = i;
            for (std::size_t r = i + 1; r < n_; ++r)
                if (std::fabs(M[r][i]) > std::fabs(M[pivot][i])) pivot = r;
            std::swap(M[i], M[pivot]);
            if (!(std::fabs(M[i][i]) > 1e-6L)) return false;
            for (std::size_t r = 0; r < n_; ++r) {
                if (r == i) continue;
                const real factor = M[r][i] / M[i][i];
                for (std::size_t c = i; c <= n_; ++c) M[r][c] -= factor * M[i][c];
            }
        }
        for (std::size_t i = 0; i < n_; ++i) {
            a[i] = M[i][n_] / M[i][i];
            if (!std::isfinite(a[i])) return false;
        }
        return true;
    }

    std::size_t n() const { return n_; }

private:
    real& at(Id id) { return values_[static_cast<std::size_t>(id)]; }
    static Reals joined(const Reals& parameters, const Reals& q, const Reals& v, real t) {
        Reals all = parameters;
        all.insert(all.end(), q.begin(), q.end());
        all.insert(all.end(), v.begin(), v.end());
        all.push_back(t);
        return all;
    }

    real value(Id id, real constant, const Reals& inputs) {
        const Node& node = graph_[id];
        const auto x = [&](std::size_t i) { return at(node.operands[i]); };
        switch (node.op) {
            case Op::constant:
                return constant;
            case Op::input:
                return inputs[static_cast<std::size_t>(node.index)];
            case Op::power:
                return std::pow(x(0), static_cast<real>(node.index));
            case Op::sqrt:
                return std::sqrt(x(0));
            case Op::sin:
                return std::sin(x(0));
            case Op::cos:
                return std::cos(x(0));
            case Op::tan:
                return std::tan(x(0));
            case Op::exp:
                return std::exp(x(0));
            case Op::log:
                return std::log(x(0));
            case Op::sinh:
                return std::sinh(x(0));
            case Op::cosh:
                return std::cosh(x(0));
            case Op::tanh:
                return std::tanh(x(0));
            case Op::asin:
                return std::asin(x(0));
            case Op::acos:
                return std::acos(x(0));
            case Op::atan:
                return std::atan(x(0));
            case Op::atan2:
                return std::atan2(x(0), x(1));
            case Op::side:
                return x(0) > 0 ? real(1) : real(-1);
            case Op::positive_part:
                return std::fmax(x(0), real(0));
            case Op::raise:
                return std::pow(x(0), x(1));
            case Op::multiply: {
                real product = 1;
                for (std::size_t i = 0; i < node.operands.size(); ++i) product *= x(i);
                return product;
            }
            case Op::add: {
                real sum = 0;
                for (std::size_t i = 0; i < node.operands.size(); ++i) sum += x(i);
                return sum;
            }
            case Op::sincos_pair:
            case Op::pair_sine:
            case Op::pair_cosine:  // made by a pass only
            case Op::table:        // no formula here has one
                break;
        }
        return std::nanl("");
    }

    std::size_t n_;
    Graph graph_;
    std::vector<Id> roots_, order_;
    Reals constants_, values_;
};

// Gragg's midpoint rule with 2, 4, ..., 20 steps, extrapolated (E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary
// Differential Equations I, II.9); intervals are halved until two columns agree.
class Extrapolation {
public:
    Extrapolation(Mechanics& mechanics, Reals parameters)
        : mechanics_(mechanics), parameters_(std::move(parameters)), n_(mechanics.n()) {}

    // (q, v) from t0 to t1; false where it cannot follow.
    bool go(Reals& y, real t0, real t1, int depth = 0) {
        constexpr int columns = 10;
        std::array<Reals, columns> row;
        real error = 0;
        for (int j = 0; j < columns; ++j) {
            const int steps = 2 * (j + 1);
            Reals next = midpoint(y, t0, t1, steps);
            if (next.empty()) return halves(y, t0, t1, depth);
            for (int k = 0; k < j; ++k) {
                const real ratio = static_cast<real>(steps) / (2 * (j - k));
                Reals finer = next;
                for (std::size_t i = 0; i < y.size(); ++i)
                    finer[i] += (next[i] - row[static_cast<std::size_t>(k)][i]) / (ratio * ratio - 1);
                row[static_cast<std::size_t>(k)] = next;
                next = finer;
            }
            if (j > 0) {
                error = 0;
                for (std::size_t i = 0; i < y.size(); ++i)
                    error = std::max(error, std::fabs(next[i] - row[static_cast<std::size_t>(j) - 1][i]));
            }
            row[static_cast<std::size_t>(j)] = next;
        }
        if (!(error < 1e-15L)) return halves(y, t0, t1, depth);
        y = row[columns - 1];
        return true;
    }

private:
    bool halves(Reals& y, real t0, real t1, int depth) {
        const real middle = (t0 + t1) / 2;
        return depth < 8 && go(y, t0, middle, depth + 1) && go(y, middle, t1, depth + 1);
    }
    bool slope(const Reals& y, real t, Reals& f) {
        std::copy_n(y.begin() + static_cast<std::ptrdiff_t>(n_), n_, f.begin());
        return mechanics_.minus_acceleration(parameters_, y.data(), y.data() + n_, t, f.data() + n_);
    }
    Reals midpoint(const Reals& y, real t0, real t1, int steps) {
        const real h = (t1 - t0) / steps;
        Reals f(y.size()), before = y, now = y;
        if (!slope(y, t0, f)) return {};
        for (std::size_t i = 0; i < y.size(); ++i) now[i] += h * f[i];
        for (int k = 1; k < steps; ++k) {
            if (!slope(now, t0 + k * h, f)) return {};
            for (std::size_t i = 0; i < y.size(); ++i) {
                const real next = before[i] + 2 * h * f[i];
                before[i] = now[i];
                now[i] = next;
            }
        }
        return now;
    }

    Mechanics& mechanics_;
    Reals parameters_;
    std::size_t n_;
};

struct Outcome {
    std::string disagreement;  // empty: none
    bool stopped = false;      // the kernel gave a status, or the reference gave up
};

Reals wide(const std::vector<double>& values) {
    return {values.begin(), values.end()};
}

// Slopes, momenta, velocities and energies at points around (q, v).
Outcome compare_pieces(LoadedStepper<double>& stepper, Mechanics& mechanics, const std::vector<double>& parameters,
                       const std::vector<double>& q, const std::vector<double>& v, Author& author) {
    const std::size_t n = mechanics.n();
    for (int point = 0; point < 4; ++point) {
        std::vector<double> at = q, rate = v, Lv, Lq;
        for (std::size_t k = 0; k < n; ++k) {
            at[k] += author.uniform(-0.2, 0.2);
            rate[k] += author.uniform(-0.2, 0.2);
        }
        const double t = author.uniform(0, 1);
        const Reals exact = mechanics.exact(wide(parameters), wide(at), wide(rate), static_cast<real>(t));
        stepper.slopes(t, at, rate, Lv, Lq);
        const std::vector<double> p = stepper.momentum(t, at, rate);
        std::vector<double> back;
        double energy = 0;
        const bool inverts = stepper.velocity(t, at, p, back) == LOBATTO_OK;
        const bool has_energy = stepper.energy(t, at, p, energy) == LOBATTO_OK;
        const auto far = [](double got, real want) {
            return !(std::fabs(static_cast<real>(got) - want) <= 1e-11L * (1 + std::fabs(want)));
        };
        for (std::size_t k = 0; k < n; ++k) {
            if (far(Lv[k], exact[1 + k]))
                return {fmt::format("dL/dv_{} is {} instead of {}", k, Lv[k], exact[1 + k]), false};
            if (far(p[k], exact[1 + k])) return {fmt::format("p_{} is {} instead of {}", k, p[k], exact[1 + k]), false};
            if (far(Lq[k], exact[1 + n + k]))
                return {fmt::format("dL/dq_{} is {} instead of {}", k, Lq[k], exact[1 + n + k]), false};
            if (inverts && std::fabs(back[k] - rate[k]) > 1e-9)
                return {fmt::format("the velocity of p_{} is {} instead of {}", k, back[k], rate[k]), false};
        }
        if (has_energy && far(energy, exact[0])) return {fmt::format("H is {} instead of {}", energy, exact[0]), false};
    }
    return {};
}

Outcome compare_compiled(const Scene& scene, const Derivation& derivation, Author& author) {
    const test::TemporaryFolder folder;
    const test::EnvironmentVariable cache("LOBATTO_CACHE_DIR", folder.string());
    const Kernel kernel = kernel_of(emit(derivation), Precision::double_);
    LoadedStepper<double> stepper(kernel);
    Mechanics mechanics(derivation);
    const std::size_t n = mechanics.n();
    const std::vector<double> parameters(scene.parameters.size(), 1.3);  // not the scene's
    std::vector<double> q, v;
    for (std::size_t k = 0; k < n; ++k) {
        q.push_back(author.uniform(-0.8, 0.8));
        v.push_back(author.uniform(-0.5, 0.5));
    }
    const double h = scene.evaluate(scene.run.step, "step").to_double();
    if (stepper.prepare(parameters, h) != LOBATTO_OK) return {"", true};

    if (const Outcome pieces = compare_pieces(stepper, mechanics, parameters, q, v, author);
        !pieces.disagreement.empty())
        return pieces;

    // The motion, with h, h/2, h/4, to the same time.
    const auto steps = static_cast<std::int64_t>(std::ceil(1 / h));
    Reals reference = wide(q);
    for (const double rate : v) reference.push_back(static_cast<real>(rate));
    const double end = static_cast<double>(steps) * h;
    Extrapolation extrapolation(mechanics, wide(parameters));
    for (int part = 0; part < 8; ++part)
        if (!extrapolation.go(reference, static_cast<real>(end) * part / 8, static_cast<real>(end) * (part + 1) / 8))
            return {"", true};
    real size = 1;
    for (const real x : reference) size = std::max(size, std::fabs(x));
    real first = 0, last = 0;
    for (int halving = 0; halving < 3; ++halving) {
        LoadedStepper<double> run(kernel);
        if (run.prepare(parameters, std::ldexp(h, -halving)) != LOBATTO_OK ||
            run.start(0, q, run.momentum(0, q, v)) != LOBATTO_OK)
            return {"", true};
        lobatto_advance call{};
        call.steps = steps << halving;
        if (run.advance(call) != LOBATTO_OK || call.steps_done != call.steps) return {"", true};
        double t = 0;
        std::vector<double> x, p, rate;
        run.state(t, x, p);
        if (run.velocity(t, x, p, rate) != LOBATTO_OK) return {"", true};
        last = 0;
        for (std::size_t k = 0; k < n; ++k) {
            last = std::max(last, std::fabs(static_cast<real>(x[k]) - reference[k]));
            last = std::max(last, std::fabs(static_cast<real>(rate[k]) - reference[n + k]));
        }
        if (halving == 0) first = last;
    }
    // Order two at least: h/4 is 16 times better, but for rounding. Half of that is asked for.
    if (last <= std::max(1e-11L * size, first / 8)) return {};
    return {fmt::format("the motion is {:.3g} away from the reference with h, {:.3g} with h/4",
                        static_cast<double>(first), static_cast<double>(last)),
            false};
}

std::string compare_interpreted(const Derivation& derivation) {
    const Programs programs = optimised_programs(derivation).programs;
    for (const Check& check : check_programs(derivation, programs))
        if (!check.holds) return fmt::format("'{}' fails: {:.3g} > {:.3g}", check.claim, check.measured, check.bound);
    return "";
}

}  // namespace

int main(int argc, char** argv) {
    if (argc < 3) {
        std::cerr << "usage: differential SEED CASES [EVERY]\n";
        return 2;
    }
    const std::uint64_t seed = std::stoull(argv[1]);
    const int cases = std::stoi(argv[2]), every = argc > 3 ? std::stoi(argv[3]) : 1;
    int interpreted = 0, compiled = 0, refused = 0, stopped = 0, disagreements = 0;
    for (int i = 0; i < cases; ++i) {
        Author author(seed + static_cast<std::uint64_t>(i));
        const std::string text = author.scene();
        std::string disagreement;
        try {
            const Scene scene = read_scene(Source("random.toml", text));
            const Derivation derivation = derive(scene);
            ++interpreted;
            disagreement = compare_interpreted(derivation);
            if (disagreement.empty() && i % every == 0) {
                ++compiled;
                const Outcome outcome = compare_compiled(scene, derivation, author);
                stopped += outcome.stopped;
                disagreement = outcome.disagreement;
            }
        } catch (const InputError&) {
            ++refused;
        } catch (const std::exception& error) {
            disagreement = error.what();
        }
        if (!disagreement.empty()) {
            ++disagreements;
            fmt::print("case {}: {}\n{}\n", seed + static_cast<std::uint64_t>(i), disagreement, text);
            std::fflush(stdout);
        }
    }
    fmt::print("{} cases: {} interpreted, {} compiled ({} of them stopped), {} refused, {} disagreements\n", cases,
               interpreted, compiled, stopped, refused, disagreements);
    return disagreements > 0;
}
