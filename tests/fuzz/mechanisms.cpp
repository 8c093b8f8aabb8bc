// SPDX-License-Identifier: GPL-2.0-or-later
// Random mechanisms with constraints and joints against the same systems in minimal coordinates.
//
//     mechanisms FIRST LAST
//
// Case i is the mechanism i mod 60, with parameters and a start that are drawn of i. Both scenes are run until steps
// half as long change nothing more, or as far as that goes. Then
//   - the curves of both agree, to what the last halving changed, and rounding, which is measured by a neighbour;
//   - halvings change what the order of the method says;
//   - each step keeps the constraints and their rates of change, to rounding;
//   - both have one energy, and keep it.
// A run that stops must stand near a place where the constraints depend on one another. Prints each case that fails
// with its scenes; the last line is the sum. Exit code 1 when one failed.
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <map>
#include <memory>
#include <optional>

#include "analysis/exact_start.hpp"
#include "analysis/kernel/kernel_of.hpp"
#include "analysis/overrides.hpp"
#include "analysis/tape.hpp"
#include "generator/pipeline.hpp"
#include "runtime/error.hpp"
#include "tests/fuzz/mechanism_bodies.hpp"

using namespace lobatto;
using namespace lobatto::test;

namespace {

constexpr int mechanisms = 60, moments = 8, most_steps = 8192;
constexpr double epsilon = 0x1p-52;

Mechanism mechanism(int shape) {
    const auto seed = static_cast<std::uint64_t>(shape) * 7919 + 1;
    switch (shape % 6) {
        case 0:
            return ChartAuthor(seed).rods();
        case 1:
            return ChartAuthor(seed).curve();
        case 2:
            return ChartAuthor(seed).surface();
        case 3:
            return ChartAuthor(seed).loop();
        case 4:
            return PlaneAuthor(seed).make();
        default:
            return BodyAuthor(seed).make();
    }
}

// A scene of a mechanism with those parameters that it holds, derived and compiled.
struct Side {
    std::string text;
    Scene scene;
    Kernel kernel;
    std::vector<Tape> curves, constraints;
    int order = 0;
};

Side side_of(const Mechanism& mechanism, const std::string& body, const std::string& method) {
    std::string parameters;
    for (const Range& range : mechanism.ranges)
        if (std::regex_search(body, std::regex("\\b" + range.name + "\\b")))
            parameters += fmt::format("{} = {:.17g}\n", range.name, (range.low + 2 * range.high) / 3);
    const std::string text = body + table_of("parameters", parameters) + "[method]\n" + method +
                             "\n[run]\nstep = 0.01\nuntil = 1\n[output]\ntangent = false\n";
    try {
        Scene scene = read_scene(Source("mechanism.toml", text));
        Kernel kernel = kernel_of(emit(derive(scene)), Precision::double_);
        std::vector<GiNaC::symbol> variables;  // parameters, t, positions, velocities
        for (const Parameter& parameter : scene.parameters) variables.push_back(parameter.symbol);
        variables.push_back(scene.time);
        for (const Coordinate& coordinate : scene.coordinates) variables.push_back(coordinate.position);
        for (const Coordinate& coordinate : scene.coordinates) variables.push_back(coordinate.velocity);
        Side side{text, scene, kernel, {}, {}, kernel->order};
        for (const Plot& plot : scene.plots) side.curves.push_back(Tape::of(plot.value, variables).value());
        for (const Constraint& held : scene.constraints)
            side.constraints.push_back(Tape::of(held.value, variables).value());
        return side;
    } catch (const std::exception&) {
        std::cerr << text;
        throw;
    }
}

// Both scenes of a mechanism; the constrained one by Lobatto's methods in turn.
struct Pair {
    Mechanism mechanism;
    Side constrained, minimal;
};
const Pair& pair_of(int shape) {
    static std::map<int, std::unique_ptr<Pair>> made;
    std::unique_ptr<Pair>& pair = made[shape];
    if (!pair) {
        const Mechanism drawn = mechanism(shape);
        const std::string points = fmt::format("points = {}", 2 + (shape / 6 + shape) % 11);
        pair = std::make_unique<Pair>(Pair{drawn, side_of(drawn, drawn.constrained, points),
                                           side_of(drawn, drawn.minimal, "family = \"gauss\"\nstages = 5")});
    }
    return *pair;
}

using Row = std::vector<double>;

struct Followed {
    lobatto_status status = LOBATTO_OK;
    std::vector<Row> curves{};            // at each moment
    double off = 0, rate = 0;             // phi and dphi/dt, in roundings
    double energy = 0, energy_error = 0;  // at the start; the largest
    double independence = 1;              // of the constraints: the least sine between one and the others
    double size = 0;                      // of the largest of all curves
    Row reach{};                          // the largest of each coordinate
};

// The least sine of the angle between a row of G and the others.
double independence_of(const std::vector<double>& G, std::size_t n) {
    const std::size_t count = G.size() / n;
    double least = 1;
    for (std::size_t last = 0; last < count; ++last) {
        std::vector<Row> basis;
        for (std::size_t i = 0; i <= count; ++i) {  // the row `last` comes last
            if (i == last) continue;
            const std::size_t row = i == count ? last : i;
            Row x(G.begin() + static_cast<std::ptrdiff_t>(row * n),
                  G.begin() + static_cast<std::ptrdiff_t>((row + 1) * n));
            const auto length = [&] {
                double sum = 0;
                for (const double value : x) sum += value * value;
                return std::sqrt(sum);
            };
            const double whole = length();
            for (int twice = 0; twice < 2; ++twice)
                for (const Row& direction : basis) {
                    double along = 0;
                    for (std::size_t k = 0; k < n; ++k) along += direction[k] * x[k];
                    for (std::size_t k = 0; k < n; ++k) x[k] -= along * direction[k];
                }
            const double rest = length();
            if (i == count || count == 1) least = std::fmin(least, rest / whole);
            for (double& value : x) value /= rest;
            basis.push_back(x);
        }
    }
    return least;
}

// A run of one side with drawn parameters.
class Run {
public:
    Run(const Side& side, const std::vector<std::string>& values) : side_(side) {
        Scene scene = side.scene;
        Overrides overrides;
        for (const Parameter& parameter : scene.parameters)
            for (const std::string& value : values)
                if (value.starts_with(parameter.name + "=")) overrides.set.push_back(value);
        apply(overrides, scene);
        start_ = start_in<double>(ExactStart(scene), side.kernel, 0.01);
    }

    // `shift`: of the first coordinate.
    Followed follow(double until, int steps, double shift = 0) const {
        LoadedStepper<double> stepper(side_.kernel);
        Followed followed;
        std::vector<double> q = start_.q, p = start_.p;
        q[0] += shift;
        const double h = until / steps;
        followed.status = stepper.prepare(start_.parameters, h);
        if (followed.status == LOBATTO_OK) followed.status = stepper.start(0, q, p);
        double t = 0;
        for (int i = 0; followed.status == LOBATTO_OK && look(stepper, t, q, p, i * moments % steps == 0, followed);
             ++i) {
            if (i == steps) return followed;
            lobatto_advance call{};
            call.steps = 1;
            followed.status = stepper.advance(call);
            if (followed.status == LOBATTO_OK) stepper.state(t, q, p);
        }
        return followed;
    }

private:
    bool look(const LoadedStepper<double>& stepper, double t, const Row& q, const Row& p, bool is_moment,
              Followed& followed) const {
        Row v(q.size());
        followed.status = stepper.velocity(t, q, p, v);
        if (followed.status != LOBATTO_OK) return false;
        Row frame = start_.parameters;
        frame.push_back(t);
        frame.insert(frame.end(), q.begin(), q.end());
        frame.insert(frame.end(), v.begin(), v.end());
        double energy = 0;
        if (stepper.energy(t, q, p, energy) == LOBATTO_OK) {
            if (t == 0) followed.energy = energy;
            followed.energy_error = std::fmax(followed.energy_error, std::fabs(energy - followed.energy));
        }
        if (!side_.constraints.empty()) look_at_constraints(stepper, t, q, v, frame, followed);
        if (!is_moment) return true;
        followed.curves.emplace_back();
        for (const Tape& curve : side_.curves) {
            followed.curves.back().push_back(curve(frame));
            followed.size = std::fmax(followed.size, std::fabs(followed.curves.back().back()));
        }
        return true;
    }
    void look_at_constraints(const LoadedStepper<double>& stepper, double t, const Row& q, const Row& v,
                             const Row& frame, Followed& followed) const {
        const std::size_t n = q.size(), count = side_.constraints.size();
        Row phi(count), phi_t(count), G(count * n);
        followed.reach.resize(n);
        for (std::size_t k = 0; k < n; ++k) followed.reach[k] = std::fmax(followed.reach[k], std::fabs(q[k]));
        stepper.constraint(t, q, phi, phi_t, G);
        for (std::size_t c = 0; c < count; ++c) {
            const Tape::Value value = side_.constraints[c].sized(frame);
            double size = value.size, along = phi_t[c], speed = std::fabs(phi_t[c]);
            for (std::size_t k = 0; k < n; ++k) {
                const double slope = G[c * n + k];
                size += std::fabs(slope * followed.reach[k]);
                along += slope * v[k];
                speed += std::fabs(slope * v[k]);
            }
            followed.off = std::fmax(followed.off, std::fabs(value.value) / (epsilon * size));
            if (speed > 0) followed.rate = std::fmax(followed.rate, std::fabs(along) / (epsilon * speed));
        }
        followed.independence = std::fmin(followed.independence, independence_of(G, n));
    }

    const Side& side_;
    StartIn<double> start_;
};

double apart(const Followed& a, const Followed& b) {
    double most = 0;
    for (std::size_t i = 0; i < a.curves.size() && i < b.curves.size(); ++i)
        for (std::size_t k = 0; k < a.curves[i].size(); ++k) {
            const double here = std::fabs(a.curves[i][k] - b.curves[i][k]);
            if (!(here <= most)) most = here;
        }
    return most;
}

// A run in steps so short that their halves change nothing but rounding, or the shortest tried.
struct Converged {
    bool ok = false;
    lobatto_status status = LOBATTO_OK;  // of the last that failed
    double independence = 1;             // there
    int steps = 0;
    double before = 0, change = 0;  // of the last two halvings; before: 0, there was none
    Followed coarse{}, fine{};
};
// `growth`: of what changes at the start.
double rounding_of(int steps, double growth) {
    return epsilon * (1 + growth) * std::sqrt(steps);
}
Converged converge(const Run& run, double until, double growth) {
    Converged found;
    int good = 0;  // in a row
    for (int steps = moments; steps <= most_steps; steps *= 2) {
        Followed next = run.follow(until, steps);
        if (next.status != LOBATTO_OK) {
            found.status = next.status;
            found.independence = next.independence;
            good = 0;
            found.ok = false;
            continue;
        }
        found.coarse = std::move(found.fine);
        found.fine = std::move(next);
        found.steps = steps;
        ++good;
        found.before = good > 2 ? found.change : 0;
        if (good > 1) found.change = apart(found.coarse, found.fine);
        found.ok = good > 1;
        if (good > 1 && found.change <= 8 * rounding_of(steps, growth) * found.fine.size) break;
    }
    return found;
}

struct Verdict {
    enum class Of { agreed, told, failed } of = Of::agreed;
    std::string why{};
};

class Case {
public:
    explicit Case(int number) : number_(number), dice_(static_cast<std::uint64_t>(number) + 1) {}

    Verdict judge() {
        try {
            return draw_and_compare();
        } catch (const std::exception& error) {
            return {Verdict::Of::failed, error.what()};
        }
    }
    std::string text() const {
        if (pair_ == nullptr) return "";
        std::string all = fmt::format("until {}\n", until_);
        for (const std::string& value : values_) all += value + " ";
        return all + "\n" + pair_->constrained.text + "---\n" + pair_->minimal.text;
    }
    std::string kind() const { return pair_ == nullptr ? "refused" : pair_->mechanism.kind; }
    std::string numbers{};

private:
    // Draws until the minimal coordinates give the motion to eight digits.
    Verdict draw_and_compare() {
        pair_ = &pair_of(number_ % mechanisms);
        for (int tries = 0; tries < 20; ++tries) {
            values_.clear();
            for (const Range& range : pair_->mechanism.ranges)
                values_.push_back(fmt::format("{}={:.17g}", range.name, dice_.uniform(range.low, range.high)));
            if (dice_.one_in(8)) values_.push_back(fmt::format("m1=1e{}", dice_.whole(-4, 4)));
            until_ = dice_.uniform(0.5, 4);
            std::optional<Run> minimal;
            try {
                minimal.emplace(pair_->minimal, values_);
            } catch (const std::runtime_error&) {  // a linkage that cannot close, a start behind a wall
                continue;
            }
            const Converged truth = converge(*minimal, until_, 1);
            if (!truth.ok || truth.change > 1e-8 * truth.fine.size) continue;
            const double shift = 1e-7;
            const Followed neighbour = minimal->follow(until_, truth.steps, shift);
            if (neighbour.status != LOBATTO_OK) continue;
            growth_ = apart(neighbour, truth.fine) / shift;
            if (growth_ > 1e4) continue;
            return compare(truth);
        }
        return {Verdict::Of::failed, "no draw has a motion"};
    }
    Verdict compare(const Converged& truth) {
        const Run run(pair_->constrained, values_);
        const Converged found = converge(run, until_, growth_);
        if (!found.ok) {
            const std::string told = fmt::format("status {} where the constraints are independent to {:.1e}",
                                                 static_cast<int>(found.status), found.independence);
            return {found.independence < 0.01 ? Verdict::Of::told : Verdict::Of::failed, told};
        }
        const double size = truth.fine.size,
                     floor = 8 * rounding_of(std::max(found.steps, truth.steps), growth_) * size /
                             std::fmin(found.fine.independence, found.coarse.independence),
                     error = apart(found.fine, truth.fine), bound = found.change + truth.change + floor,
                     order = std::log2(found.before / found.change);
        numbers = fmt::format(
            "steps {} {}, error {:.1e}, change {:.1e}, of the truth {:.1e}, floor {:.1e}, growth {:.1e}, "
            "order {:.2f} of {}, off {:.1f}, rate {:.1f}, independence {:.1e}, energy {:.1e} of {:.1e}",
            found.steps, truth.steps, error, found.change, truth.change, floor, growth_, order,
            pair_->constrained.order, found.fine.off, found.fine.rate, found.fine.independence, found.fine.energy_error,
            found.fine.energy);
        std::string why;
        if (!(error <= bound)) why += " apart";
        const bool is_asymptotic = found.before > 0 && found.before < 1e-3 * size && found.change > 8 * floor;
        if (is_asymptotic && order < pair_->constrained.order - 1) why += " order";
        if (!(found.fine.off < 32) || !(found.coarse.off < 32)) why += " off";
        if (!(found.fine.rate < 8) || !(found.coarse.rate < 8)) why += " rate";
        const double force = 100 * (1 + std::fabs(found.fine.energy)) * (1 + size);  // of the energy, at most
        if (pair_->mechanism.same_energy && !(std::fabs(found.fine.energy - truth.fine.energy) <= 64 * epsilon * force))
            why += " energies";
        if (pair_->mechanism.conserves && !(found.fine.energy_error <= force * (bound + floor))) why += " energy";
        return {why.empty() ? Verdict::Of::agreed : Verdict::Of::failed, why};
    }

    int number_;
    Dice dice_;
    const Pair* pair_ = nullptr;  // none where a scene was refused
    std::vector<std::string> values_;
    double until_ = 0, growth_ = 0;
};

}  // namespace

int main(int argc, char** argv) {
    if (argc != 3) {
        std::cerr << "mechanisms FIRST LAST\n";
        return 2;
    }
    std::setvbuf(stdout, nullptr, _IOLBF, 0);  // what was found stands there, whatever ends the program
    const bool tells_all = std::getenv("LOBATTO_MECHANISMS") != nullptr;
    std::map<std::string, std::array<int, 3>> tallies;
    int failed = 0, passed = 0;
    for (int number = std::atoi(argv[1]); number <= std::atoi(argv[2]); ++number) {
        Case drawn(number);
        const Verdict verdict = drawn.judge();
        const bool has_failed = verdict.of == Verdict::Of::failed;
        ++tallies[drawn.kind()][static_cast<std::size_t>(verdict.of)];
        ++(has_failed ? failed : passed);
        if (has_failed || tells_all)
            fmt::print("case {}, {}: {} {}\n", number, drawn.kind(), verdict.why, drawn.numbers);
        if (has_failed) fmt::print("{}\n", drawn.text());
    }
    fmt::print("{:20} {:>6} {:>6} {:>6}\n", "kind", "agreed", "told", "failed");
    for (const auto& [kind, tally] : tallies) fmt::print("{:20} {:6} {:6} {:6}\n", kind, tally[0], tally[1], tally[2]);
    fmt::print("{} passed, {} failed\n", passed, failed);
    return failed > 0 ? 1 : 0;
}
