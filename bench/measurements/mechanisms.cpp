// SPDX-License-Identifier: GPL-2.0-or-later
// What constraints and rigid bodies cost beside the same motion in minimal coordinates, at the same error, and how the
// cost of a chain of rods grows: tables in Markdown (docs/measurements/mechanisms.md).
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "analysis/kernel/kernel_of.hpp"
#include "analysis/motion.hpp"
#include "generator/pipeline.hpp"

using namespace lobatto;

namespace {

using Numbers = std::vector<double>;

struct Contestant {
    std::string scene;                               // a name in scenes/, or the text of one
    std::function<Numbers(const Numbers& q)> place;  // which all contestants of a contest have
};

struct Contest {
    std::string name;
    double until, longest_step;
    Contestant ours, by_hand;
    double bound;  // of the ratio of their times
};

struct Measured {
    Numbers place;
    double seconds = 0;
};

Scene bare_scene(const std::string& name, int points) {
    const bool is_text = name.find('\n') != std::string::npos;
    Scene scene = is_text ? read_scene(Source("scene.toml", name))
                          : read_scene(std::string(LOBATTO_SOURCE_DIR "/scenes/") + name + ".toml");
    scene.method.points = points;
    scene.outputs.energy = scene.outputs.tangent = false;
    scene.outputs.events.clear();
    return scene;
}

// The least of a few repetitions; nothing where a step is not solved.
std::optional<Measured> measure(Scene scene, const Kernel& kernel, std::int64_t steps, double until,
                                const Contestant& contestant, int repetitions) {
    scene.run.step = GiNaC::numeric(until) / GiNaC::numeric(static_cast<long>(steps));
    LoadedStepper<double> stepper(kernel);
    const TrajectoryRequest request = request_of(scene, steps, stepper);
    Measured measured;
    measured.seconds = 1e300;
    for (int repetition = 0; repetition < repetitions; ++repetition) {
        stepper.prepare(request.parameters, request.step);
        stepper.start(0, request.q, request.p);
        lobatto_advance call{};
        call.steps = steps;
        const auto begin = std::chrono::steady_clock::now();
        if (stepper.advance(call) != LOBATTO_OK) return std::nullopt;
        const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - begin;
        measured.seconds = std::min(measured.seconds, taken.count());
    }
    double time = 0;
    Numbers q(request.q.size()), p(request.q.size());
    stepper.state(time, q, p);
    measured.place = contestant.place(q);
    return measured;
}

double apart(const Numbers& a, const Numbers& b) {
    double sum = 0;
    for (std::size_t k = 0; k < a.size(); ++k) sum += (a[k] - b[k]) * (a[k] - b[k]);
    return std::sqrt(sum);
}

// The seconds that the best method takes for an error, between two steps of which one errs more and one less.
struct Best {
    double seconds = 1e300;
    int points = 0;
};
std::vector<Best> best_for(const Contest& contest, const Contestant& contestant, const Numbers& exact,
                           const Numbers& errors) {
    std::vector<Best> best(errors.size());
    for (int points = 3; points <= 9; ++points) {
        const Scene scene = bare_scene(contestant.scene, points);
        const Kernel kernel = kernel_of(emit(derive(scene)), Precision::double_);
        double error_before = 0, seconds_before = 0;
        for (double step = contest.longest_step; step > contest.longest_step / 600; step /= std::sqrt(2)) {
            const auto steps = static_cast<std::int64_t>(std::ceil(contest.until / step));
            const std::optional<Measured> measured = measure(scene, kernel, steps, contest.until, contestant, 7);
            const double error = measured ? apart(measured->place, exact) : 0;
            for (std::size_t e = 0; e < errors.size() && measured; ++e) {
                if (!(error < errors[e] && error_before > errors[e])) continue;
                const double share = std::log(errors[e] / error_before) / std::log(error / error_before),
                             seconds = seconds_before * std::pow(measured->seconds / seconds_before, share);
                if (seconds < best[e].seconds) best[e] = {seconds, points};
            }
            error_before = error;
            seconds_before = measured ? measured->seconds : 0;
        }
    }
    return best;
}

void print(const Contest& contest) {
    const Numbers errors{1e-6, 1e-9};
    const Scene finest = bare_scene(contest.by_hand.scene, 10);
    const auto exact = measure(finest, kernel_of(emit(derive(finest)), Precision::double_),
                               static_cast<std::int64_t>(contest.until / contest.longest_step * 40), contest.until,
                               contest.by_hand, 1);
    const std::vector<Best> ours = best_for(contest, contest.ours, exact->place, errors),
                            by_hand = best_for(contest, contest.by_hand, exact->place, errors);
    for (std::size_t e = 0; e < errors.size(); ++e)
        fmt::print("| {} | {:.0e} | {:.0f} µs, {} points | {:.0f} µs, {} points | {:.2f} | {:g} |\n", contest.name,
                   errors[e], ours[e].seconds * 1e6, ours[e].points, by_hand[e].seconds * 1e6, by_hand[e].points,
                   ours[e].seconds / by_hand[e].seconds, contest.bound);
}

Numbers axis_of_angles(const Numbers& q) {
    return {std::sin(q[0]) * std::sin(q[1]), -std::sin(q[0]) * std::cos(q[1]), std::cos(q[0])};
}
Numbers axis_of_quaternion(const Numbers& q) {
    const double n = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
    return {2 * (q[1] * q[3] + q[0] * q[2]) / n, 2 * (q[2] * q[3] - q[0] * q[1]) / n,
            (q[0] * q[0] - q[1] * q[1] - q[2] * q[2] + q[3] * q[3]) / n};
}

// A top with three moments, on a ball joint and in Euler's angles: one of these is cyclic, of Lagrange's top two are.
const std::string three_moments_body =
    "lagrangian = \"-2*top.z\"\n[bodies]\ntop = { mass = 1, inertia = [0.75, 1.05, 0.5], position = [0, "
    "\"-sin(1)/2\", \"cos(1)/2\"], orientation = [\"cos(1/2)\", \"sin(1/2)\", 0, 0], angular_velocity = [0.3, "
    "\"0.4*sin(1)\", \"0.4*cos(1) + 2\"] }\n[joints]\ntip = { type = \"ball\", bodies = [\"ground\", \"top\"], point = "
    "[0, 0, 0] }\n[run]\nstep = 0.1\nuntil = 20\n";
const std::string three_moments_angles =
    "lagrangian = \"(w1^2 + 1.3*w2^2 + 0.5*w3^2)/2 - cos(theta)\"\n[definitions]\n"
    "w1 = \"phi'*sin(theta)*sin(psi) + theta'*cos(psi)\"\nw2 = \"phi'*sin(theta)*cos(psi) - theta'*sin(psi)\"\n"
    "w3 = \"phi'*cos(theta) + psi'\"\n[coordinates]\ntheta = { position = 1, velocity = 0.3 }\n"
    "phi = { position = 0, velocity = 0.4 }\npsi = { position = 0, velocity = 2 }\n[run]\nstep = 0.1\nuntil = 20\n";

// Beads on rods in a row, let go at an angle.
void print_chain(int n) {
    const std::string text = fmt::format(
        "lagrangian = \"sum(i = 1 .. n, (x[i]'^2 + y[i]'^2)/2 - y[i])\"\n[parameters]\nn = {{ value = {}, constant = "
        "true }}\n"
        "[coordinates]\nx = {{ count = \"n\", position = \"i*3/5\", velocity = 0 }}\n"
        "y = {{ count = \"n\", position = \"-i*4/5\", velocity = 0 }}\n[constraints]\nfirst = \"x[1]^2 + y[1]^2 = 1\"\n"
        "\"rod[i]\" = {{ equation = \"(x[i+1] - x[i])^2 + (y[i+1] - y[i])^2 = 1\", count = \"n - 1\" }}\n[method]\n"
        "points = 4\n[run]\nstep = 0.02\nuntil = 1\n[output]\nenergy = false\n",
        n);
    const Scene scene = read_scene(Source("chain.toml", text));
    const Kernel kernel = kernel_of(emit(derive(scene)), Precision::double_);
    const auto measured = measure(scene, kernel, 50, 1, {"", [](const Numbers& q) { return q; }}, 5);
    if (!measured) return fmt::print("| {} | a step is not solved | |\n", n);
    fmt::print("| {} | {:.1f} | {:.0f} |\n", n, measured->seconds / 50 * 1e6, measured->seconds / 50 / n * 1e9);
}

}  // namespace

int main() {
    const std::vector<Contest> contests{
        {"double pendulum to t = 10: rods, angles",
         10,
         0.2,
         {"rod_double_pendulum",
          [](const Numbers& q) {
              return Numbers{q[1], q[3]};
          }},
         {"double_pendulum",
          [](const Numbers& q) {
              return Numbers{2 * std::sin(q[0]) + 3 * std::sin(q[1]), -2 * std::cos(q[0]) - 3 * std::cos(q[1])};
          }},
         4},
        {"Lagrange's top to t = 50: body, Euler's angles",
         50,
         1.6,
         {"rigid_top", axis_of_quaternion},
         {"lagrange_top", axis_of_angles},
         2},
        {"top with three moments to t = 20: body, Euler's angles",
         20,
         0.8,
         {three_moments_body, axis_of_quaternion},
         {three_moments_angles, axis_of_angles},
         2},
    };
    fmt::print("| motion | error at the end | ours | by hand | ratio | wanted, at most |\n|---|---|---|---|---|---|\n");
    for (const Contest& contest : contests) print(contest);
    fmt::print("\n| rods | µs a step | ns a step and rod |\n|---|---|---|\n");
    for (const int n : {25, 50, 100, 200, 400}) print_chain(n);
}
