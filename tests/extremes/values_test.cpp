// SPDX-License-Identifier: GPL-2.0-or-later
// Infinities, not-a-numbers, denormal numbers and vanishing masses as initial values and parameters, alone and beside
// others.
#include <limits>

#include "tests/extremes/extremes.hpp"

using namespace lobatto;
using namespace lobatto::test;

namespace {

using TestMotion = lobatto::test::Motion;

const double nan = std::nan("");
const double denormal = std::numeric_limits<double>::denorm_min();

// One of every form of kernel.
const std::vector<TestMotion>& motions() {
    static const std::vector<TestMotion> all{
        pendulum,        chain(), harmonic_oscillator, coupled_oscillators, double_pendulum, spherical_pendulum,
        driven_pendulum, kepler};
    return all;
}

lobatto_status status_of(const TestMotion& motion, double time = 0) {
    const State<double> start{LOBATTO_OK, 0, time, motion.q, motion.v};
    return follow(kernel_for(motion.body), motion.parameters, start, motion.step, 20).status;
}

// The status of all forms when one number is bad; another than any expected when they differ.
template <class Spoil>
lobatto_status with_each(const Spoil& spoil) {
    lobatto_status common = LOBATTO_OK;
    bool first = true;
    for (TestMotion motion : motions()) {
        const std::size_t count = spoil(motion).size();
        for (std::size_t i = 0; i < count; ++i) {
            TestMotion spoilt = motion;
            spoil(spoilt)[i] = spoil.bad;
            const lobatto_status status = status_of(spoilt);
            if (!first && status != common) {
                MESSAGE(motion.body << " number " << i << ": " << name_of(status));
                return LOBATTO_UNSUPPORTED;
            }
            common = status;
            first = false;
        }
    }
    return common;
}

struct Positions {
    double bad;
    std::vector<double>& operator()(TestMotion& motion) const { return motion.q; }
};
struct Momenta {
    double bad;
    std::vector<double>& operator()(TestMotion& motion) const { return motion.v; }
};
struct Parameters {
    double bad;
    std::vector<double>& operator()(TestMotion& motion) const { return motion.parameters; }
};

TestMotion with(TestMotion motion, std::vector<double> parameters) {
    motion.parameters = std::move(parameters);
    return motion;
}

// A denormal number added to a start changes nothing but by rounding.
double change_by_denormals() {
    double largest = 0;
    for (const TestMotion& motion : motions()) {
        TestMotion moved = motion;
        for (double& q : moved.q) q = q == 0 ? denormal : q;
        for (double& v : moved.v) v = v == 0 ? -denormal : v;
        const auto end = [](const TestMotion& of) {
            const State<double> start{LOBATTO_OK, 0, 0, of.q, of.v};
            return follow(kernel_for(of.body), of.parameters, start, of.step, 20);
        };
        const State<double> a = end(motion), b = end(moved);
        if (a.status != LOBATTO_OK || b.status != LOBATTO_OK) return HUGE_VAL;
        largest = std::fmax(largest, std::fmax(distance_of(a.q, b.q), distance_of(a.p, b.p)));
    }
    return largest;
}

bool refused(const std::vector<std::string>& options) {
    std::vector<std::string> command{LOBATTO_PROGRAM, "run", LOBATTO_SOURCE_DIR "/scenes/pendulum.toml"};
    command.insert(command.end(), options.begin(), options.end());
    const Finished done = test::run(command);
    if (done.exit_code != 2 || done.err.empty()) MESSAGE(options.back() << ": " << done.exit_code << ' ' << done.err);
    return done.exit_code == 2 && !done.err.empty();
}

bool refused_in_scene(const std::string& number) {
    const TemporaryFolder folder;
    write_text(folder / "scene.toml",
               "title = \"T\"\nlagrangian = \"q'^2/2 - q^2/2\"\n[coordinates]\nq = { position = " + number +
                   ", velocity = 0 }\n[run]\nstep = 0.1\nuntil = 1\n");
    const Finished done = test::run({LOBATTO_PROGRAM, "run", folder / "scene.toml", "-o", folder / "o.csv"});
    return done.exit_code == 2 && done.err.find("scene.toml:4:") != std::string::npos;
}

const Extremes table(
    6, "Values",
    {
        stops(LOBATTO_NOT_FINITE, "a position that is not a number, each, every form of kernel",
              [] { return with_each(Positions{nan}); }),
        stops(LOBATTO_NOT_FINITE, "an infinite position, likewise", [] { return with_each(Positions{-HUGE_VAL}); }),
        stops(LOBATTO_NOT_FINITE, "a momentum that is not a number, likewise", [] { return with_each(Momenta{nan}); }),
        stops(LOBATTO_NOT_FINITE, "an infinite momentum, likewise", [] { return with_each(Momenta{HUGE_VAL}); }),
        stops(LOBATTO_NOT_FINITE, "a parameter that is not a number, likewise",
              [] { return with_each(Parameters{nan}); }),
        stops(LOBATTO_NOT_FINITE, "a start time that is not a number or infinite, likewise",
              [] {
                  for (const TestMotion& motion : motions())
                      for (const double time : {nan, HUGE_VAL})
                          if (const auto status = status_of(motion, time); status != LOBATTO_NOT_FINITE) return status;
                  return LOBATTO_NOT_FINITE;
              }),
        stops(LOBATTO_NOT_FINITE, "an infinite frequency, stiffness or mass",
              [] {
                  for (const TestMotion& motion :
                       {with(pendulum, {1, HUGE_VAL}), with(pendulum, {HUGE_VAL, 1}),
                        with(harmonic_oscillator, {1, HUGE_VAL}), with(harmonic_oscillator, {HUGE_VAL, 1}),
                        with(coupled_oscillators, {HUGE_VAL}), with(double_pendulum, {1, HUGE_VAL}),
                        with(double_pendulum, {HUGE_VAL, 1})})
                      if (const auto status = status_of(motion); status != LOBATTO_NOT_FINITE) {
                          MESSAGE(motion.body << ' ' << name_of(status));
                          return status;
                      }
                  return LOBATTO_NOT_FINITE;
              }),
        stops(LOBATTO_SINGULAR_MASS, "no mass",
              [] {
                  for (const TestMotion& motion :
                       {with(pendulum, {0, 1}), with(harmonic_oscillator, {0, 1}), with(double_pendulum, {0, 1})})
                      if (const auto status = status_of(motion); status != LOBATTO_SINGULAR_MASS) {
                          MESSAGE(motion.body << ' ' << name_of(status));
                          return status;
                      }
                  return LOBATTO_SINGULAR_MASS;
              }),
        stops(LOBATTO_NOT_FINITE, "a mass of 5e-324: its reciprocal is no number",
              [] {
                  const lobatto_status status = status_of(with(pendulum, {denormal, 1}));
                  return status == LOBATTO_NOT_FINITE ? status_of(with(harmonic_oscillator, {denormal, 1})) : status;
              }),
        right_to(1e-13, "of the same with zeros", "denormal numbers for the zeros of a start, every form of kernel",
                 [] { return change_by_denormals(); }),
        says("refused, exit code 2", "--set omega=nan, inf, 1e999, 1/0, -1e301, log(0), no value",
             [] {
                 for (const std::string value : {"nan", "inf", "1e999", "1/0", "-1e301", "log(0)", ""})
                     if (!refused({"--set", "omega=" + value})) return false;
                 return true;
             }),
        says("refused, exit code 2", "--step 0, -0.1, nan, 1e-301, 1e-200, 1e200; --until -1, inf",
             [] {
                 for (const std::string value : {"0", "-0.1", "nan", "1e-301", "1e-200", "1e200"})
                     if (!refused({"--step", value})) return false;
                 return refused({"--until", "-1"}) && refused({"--until", "inf"});
             }),
        says("refused with line and column, exit code 2", "a scene with position = nan, inf, 1e301, 1e-301, 5e-324",
             [] {
                 for (const std::string value : {"nan", "inf", "1e301", "1e-301", "5e-324"})
                     if (!refused_in_scene(value)) return false;
                 return true;
             }),
    });

}  // namespace

TEST_CASE("values that are no numbers, or hardly any, end in a stop or change nothing") {
    table.check();
}
