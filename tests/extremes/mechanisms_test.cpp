// SPDX-License-Identifier: GPL-2.0-or-later
// Mechanisms at the edge: millions of steps, lengths and masses of all sizes, constraints that nearly depend on one
// another, dead points, starts beside the constraints; against closed forms and the same systems in angles.
#include "tests/extremes/extremes.hpp"

using namespace lobatto;
using namespace lobatto::test;

namespace {

using Numbers = std::vector<double>;

// Parameters m, g, l, c.
const std::string rod =
    "lagrangian = \"m*(x'^2 + y'^2)/2 - m*g*y\"\n[coordinates]\nx = { position = 0.6, velocity = 0 }\n"
    "y = { position = -0.8, velocity = 0 }\n[parameters]\nm = 1\ng = 1\nl = 1\nc = 1\n[constraints]\n"
    "rod = \"c*(x^2 + y^2) = c*l^2\"\n";

struct Kept {
    double position = 0, rate = 0;  // |phi| and |dphi/dt|, the largest
    double drift = 0;               // of the mean energy, between the first and the last tenth, in its own size
    double energy = 0;              // its largest error
};

// The rod pendulum of length 1 in 1000 parts; looks between them.
Kept keep(std::int64_t steps) {
    LoadedStepper<double> stepper(kernel_for(rod));
    Kept kept;
    REQUIRE(stepper.prepare({1, 1, 1, 1}, 0.1) == LOBATTO_OK);
    Numbers q{0.6, -0.8}, p{0.4, 0.3}, phi, phi_t, G;
    REQUIRE(stepper.start(0, q, p) == LOBATTO_OK);
    double start = 0, first = 0, last = 0, t = 0;
    REQUIRE(stepper.energy(0, q, p, start) == LOBATTO_OK);
    for (int part = 0; part < 1000; ++part) {
        lobatto_advance call{};
        call.steps = steps / 1000;
        REQUIRE(stepper.advance(call) == LOBATTO_OK);
        stepper.state(t, q, p);
        stepper.constraint(t, q, phi, phi_t, G);
        kept.position = std::fmax(kept.position, std::fabs(phi[0]));
        kept.rate = std::fmax(kept.rate, std::fabs(G[0] * p[0] + G[1] * p[1]));
        double energy = 0;
        REQUIRE(stepper.energy(t, q, p, energy) == LOBATTO_OK);
        kept.energy = std::fmax(kept.energy, std::fabs(energy - start));
        if (part < 100) first += energy / 100;
        if (part >= 900) last += energy / 100;
    }
    kept.drift = std::fabs(last - first);
    return kept;
}

// 200 steps, in units of length, mass and of the constraint that are 2^length, ... as large: whether the motion is the
// same, to the last bit.
bool scales(int length, int mass, int constraint) {
    const double l = std::ldexp(1, length), m = std::ldexp(1, mass), c = std::ldexp(1, constraint);
    const auto end = [](double size, double weight, double factor) {
        return travel<double>(kernel_for(rod), {weight, size, size, factor}, {0.6 * size, -0.8 * size},
                              {0.4 * size, 0.3 * size}, 0.1, 200);
    };
    const State<double> one = end(1, 1, 1), other = end(l, m, c);
    return one.status == LOBATTO_OK && other.status == LOBATTO_OK && other.q == Numbers{l * one.q[0], l * one.q[1]} &&
           other.p == Numbers{l * (m * one.p[0]), l * (m * one.p[1])};
}

// Two rods from the angles 1 and 2, in points and in angles; parameters m1, m2, l1, l2.
const std::string numbers = "[parameters]\nm1 = 1\nm2 = 1\nl1 = 1\nl2 = 1\n";
const std::string points =
    "lagrangian = \"m1*(x1'^2 + y1'^2)/2 + m2*(x2'^2 + y2'^2)/2 - m1*y1 - m2*y2\"\n[coordinates]\n"
    "x1 = { position = 0, velocity = 0 }\ny1 = { position = -1, velocity = 0 }\nx2 = { position = 0, velocity = 0 }\n"
    "y2 = { position = -2, velocity = 0 }\n[constraints]\nfirst = \"x1^2 + y1^2 = l1^2\"\n"
    "second = \"(x2 - x1)^2 + (y2 - y1)^2 = l2^2\"\n" +
    numbers;
const std::string angles =
    "lagrangian = \"m1*(x1'^2 + y1'^2)/2 + m2*(x2'^2 + y2'^2)/2 - m1*y1 - m2*y2\"\n[definitions]\n"
    "x1 = \"l1*sin(a)\"\ny1 = \"-l1*cos(a)\"\nx2 = \"x1 + l2*sin(b)\"\ny2 = \"y1 - l2*cos(b)\"\n[coordinates]\n"
    "a = { position = 1, velocity = 0 }\nb = { position = 2, velocity = 0 }\n" +
    numbers;

double rods_error(double m1, double m2, double l1, double l2, double step, std::int64_t steps) {
    const double x = l1 * std::sin(1), y = -l1 * std::cos(1);
    const State<double> rods = travel<double>(kernel_for(points, "points = 8"), {m1, m2, l1, l2},
                                              {x, y, x + l2 * std::sin(2), y - l2 * std::cos(2)}, {0, 0, 0, 0}, step,
                                              steps),
                        turns = travel<double>(kernel_for(angles, "points = 8"), {m1, m2, l1, l2}, {1, 2}, {0, 0}, step,
                                               steps);
    if (rods.status != LOBATTO_OK || turns.status != LOBATTO_OK) return HUGE_VAL;
    const double a = turns.q[0], b = turns.q[1];
    return distance_of(rods.q, Numbers{l1 * std::sin(a), -l1 * std::cos(a), l1 * std::sin(a) + l2 * std::sin(b),
                                       -l1 * std::cos(a) - l2 * std::cos(b)});
}

// A bead on y = x^2, z = 0, the first as z = e (y - x^2): both slopes are nearly z.
double redundant_error(double e) {
    const std::string bead =
        "lagrangian = \"(x'^2 + y'^2 + z'^2)/2 - y\"\n[coordinates]\nx = { position = 1, velocity = 0 }\n"
        "y = { position = 1, velocity = 0 }\nz = { position = 0, velocity = 0 }\n[parameters]\ne = 1\n[constraints]\n"
        "flat = \"z = 0\"\ncurve = \"z = e*(y - x^2)\"\n";
    const std::string one =
        "lagrangian = \"(1 + 4*x^2)*x'^2/2 - x^2\"\n[coordinates]\nx = { position = 1, velocity = 0 }\n";
    const State<double> two = travel<double>(kernel_for(bead, "points = 8"), {e}, {1, 1, 0}, {0, 0, 0}, 0.02, 100),
                        exact = travel<double>(kernel_for(one, "points = 8"), {}, {1}, {0}, 0.02, 100);
    if (two.status != LOBATTO_OK || exact.status != LOBATTO_OK) return HUGE_VAL;
    return distance_of(two.q, Numbers{exact.q[0], exact.q[0] * exact.q[0], 0});
}

// A parallelogram whose cranks turn with the velocity 1, from `angle` before its dead point.
State<double> parallelogram(double angle, std::int64_t steps) {
    const std::string bars =
        "lagrangian = \"(x1'^2 + y1'^2)/2 + (x2'^2 + y2'^2)/2\"\n[coordinates]\nx1 = { position = 0, velocity = 0 }\n"
        "y1 = { position = 1, velocity = 0 }\nx2 = { position = 2, velocity = 0 }\ny2 = { position = 1, velocity = 0 "
        "}\n"
        "[constraints]\na = \"x1^2 + y1^2 = 1\"\nb = \"(x2 - 2)^2 + y2^2 = 1\"\nc = \"(x2 - x1)^2 + (y2 - y1)^2 = "
        "4\"\n";
    const double c = std::cos(angle), s = std::sin(angle);
    return travel<double>(kernel_for(bars), {}, {c, s, 2 + c, s}, {s, -c, s, -c}, 0.1, steps);
}
double passing_error() {
    double worst = 0;
    for (const double angle : {0.43, 0.77, 0.98}) {  // 0.03, 0.07 and 0.08 beside a step's end
        const State<double> end = parallelogram(angle, 20);
        const double c = std::cos(angle - 2), s = std::sin(angle - 2);
        worst = std::fmax(worst, end.status == LOBATTO_OK ? distance_of(end.q, Numbers{c, s, 2 + c, s}) : HUGE_VAL);
    }
    return worst;
}

// A body that turns about its middle axis, nearly: errors of the moment of momentum in space, and of the length of its
// quaternion.
std::pair<double, double> tumbling_errors(double speed, std::int64_t steps) {
    const std::string body = "[bodies]\ntop = { mass = 1, inertia = [1, 2, 2.5] }\n";
    const Kernel& kernel = kernel_for(body, "points = 6");
    LoadedStepper<double> stepper(kernel);
    REQUIRE(stepper.prepare({}, 0.02 / speed) == LOBATTO_OK);
    Numbers q{0, 0, 0, 1, 0, 0, 0}, p = stepper.momentum(0, q, {0, 0, 0, 0, 0.001 * speed / 2, speed / 2, 0});
    REQUIRE(stepper.start(0, q, p) == LOBATTO_OK);
    // K = Im(p conj(q)) / 2 of a quaternion's momentum.
    const auto moment = [](const Numbers& x, const Numbers& r) {
        const double *a = x.data() + 3, *b = r.data() + 3;
        return Numbers{(a[0] * b[1] - a[1] * b[0] + a[2] * b[3] - a[3] * b[2]) / 2,
                       (a[0] * b[2] - a[2] * b[0] + a[3] * b[1] - a[1] * b[3]) / 2,
                       (a[0] * b[3] - a[3] * b[0] + a[1] * b[2] - a[2] * b[1]) / 2};
    };
    const Numbers before = moment(q, p);
    double worst = 0, longest = 0, t = 0;
    for (int part = 0; part < 100; ++part) {
        lobatto_advance call{};
        call.steps = steps / 100;
        REQUIRE(stepper.advance(call) == LOBATTO_OK);
        stepper.state(t, q, p);
        const double length = q[3] * q[3] + q[4] * q[4] + q[5] * q[5] + q[6] * q[6];
        worst = std::fmax(worst, distance_of(moment(q, p), before) / (2 * speed));
        longest = std::fmax(longest, std::fabs(length - 1));
    }
    return {worst, longest};
}

// `lobatto run` of a rod that starts so far off.
bool refuses_start(const std::string& x, const std::string& word) {
    const TemporaryFolder folder;
    std::string text = rod;
    text.replace(text.find("0.6"), 3, "\"" + x + "\"");
    write_text(folder / "rod.toml", text + "[run]\nstep = 0.1\nuntil = 1\n");
    const Finished done = test::run({LOBATTO_PROGRAM, "run", folder / "rod.toml", "-o", folder / "o.csv"});
    return word.empty()
               ? done.exit_code == 0
               : done.exit_code == 2 && done.err.find(word) != std::string::npos &&
                     done.err.find("the nearest start that keeps all constraints has x = ") != std::string::npos;
}

const Extremes table(
    10, "Mechanisms",
    {
        right_to(1e-15, "of the length", "point on a rod, h = 0.1, 1,000,000 steps: the rod",
                 [] { return keep(1000000).position; }),
        right_to(1e-15, "of the speed", "the same: the velocity along the rod", [] { return keep(1000000).rate; }),
        right_to(1e-12, "of m g l", "the same: the drift of the mean energy", [] { return keep(1000000).drift; }),
        says("the same motion, to the last bit",
             "the same, lengths 2^-200 to 2^200 (1e-60 to 1e60), masses 2^-200 to 2^200, the constraint times 2^-100 "
             "to 2^100",
             [] {
                 bool all = true;
                 for (const int length : {-200, -3, 200})
                     for (const int mass : {-200, 7, 200})
                         for (const int constraint : {-100, 5, 100}) all = all && scales(length, mass, constraint);
                 return all;
             }),
        right_to(1e-11, "of the length, against angles", "two rods, masses 1 and 1e-8",
                 [] { return rods_error(1, 1e-8, 1, 1, 0.02, 100); }),
        right_to(1e-11, "of the length, against angles", "two rods, masses 1e-8 and 1, 10,000 steps of 1e-5",
                 [] { return rods_error(1e-8, 1, 1, 1, 1e-5, 10000); }),
        right_to(1e-11, "of the longer one, against angles", "two rods, lengths 1 and 1e-4",
                 [] { return rods_error(1, 1, 1, 1e-4, 0.0005, 2000); }),
        right_to(1e-11, "of the longer one, against angles", "two rods, lengths 1e-4 and 1",
                 [] { return rods_error(1, 1, 1e-4, 1, 0.0005, 2000); }),
        right_to(1e-12, "of the amplitude", "two constraints whose slopes are 1e-3 apart",
                 [] { return redundant_error(1e-3); }),
        right_to(1e-12, "of the amplitude", "two constraints whose slopes are 1e-9 apart",
                 [] { return redundant_error(1e-9); }),
        stops(LOBATTO_SINGULAR_JACOBIAN, "parallelogram that meets its dead point at the end of a step",
              [] { return parallelogram(0.5, 20).status; }),
        right_to(1e-10, "of the crank", "parallelogram whose dead point is within a step, to the other side",
                 [] { return passing_error(); }),
        right_to(1e-12, "of the moment of momentum", "a body that tumbles at 1e6 rad/s, 100,000 steps, 6 points",
                 [] { return tumbling_errors(1e6, 100000).first; }),
        right_to(2e-8, "of its length, which drifts and moves nothing", "the same: its quaternion",
                 [] { return tumbling_errors(1e6, 100000).second; }),
        says("refused, exit code 2, with how much and the nearest start", "a start off its rod by 1e-9",
             [] { return refuses_start("0.6 + 1e-9", "1.2e-9"); }),
        says("taken", "a start off its rod by 1e-17", [] { return refuses_start("0.6 + 1e-17", ""); }),
    });

const Extremes long_table(11, "Mechanisms, ten million steps",
                          {
                              right_to(1e-15, "of the length", "point on a rod, h = 0.1, 10,000,000 steps: the rod",
                                       [] { return keep(10000000).position; }),
                          });

}  // namespace

TEST_CASE("mechanisms at the edge end in the right answer or in a stop") {
    table.check();
}

TEST_CASE("constraints are kept over ten million steps" * doctest::test_suite("slow")) {
    long_table.check();
}
