// SPDX-License-Identifier: GPL-2.0-or-later
// Motions on which fast ways through a step are compared with slow ones: a scene, its numbers, a start, a step.
#pragma once

#include <doctest/doctest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "analysis/kernel/kernel_of.hpp"
#include "runtime/build/library.hpp"
#include "runtime/run/ensemble/ensemble.hpp"
#include "tests/scenes/scenes.hpp"

namespace lobatto::test {

struct Motion {
    std::string body;  // of the scene, up to its method
    std::vector<double> parameters, q, v;
    double step;
};

inline const Motion pendulum{
    "lagrangian = \"m*q'^2/2 - m*omega^2*(1 - cos(q))\"\n[coordinates]\nq = { position = 1.5, velocity = 0.25 }\n"
    "[parameters]\nm = 2\nomega = 1.5\n",
    {2, 1.5},
    {1.5},
    {0.25},
    0.2};
inline const Motion henon_heiles{
    "lagrangian = \"(x'^2 + y'^2)/2 - (x^2 + y^2)/2 - lambda*(x^2*y - y^3/3)\"\n[coordinates]\n"
    "x = { position = 0.1, velocity = 0.25 }\ny = { position = 0.3, velocity = 0.2 }\n[parameters]\nlambda = 1\n",
    {1},
    {0.1, 0.3},
    {0.25, 0.2},
    0.2};
inline const Motion kepler{
    "lagrangian = \"(x'^2 + y'^2)/2 + mu/sqrt(x^2 + y^2)\"\n[coordinates]\nx = { position = 0.7, velocity = 0 }\n"
    "y = { position = 0, velocity = 1.3627 }\n[parameters]\nmu = 1\n",
    {1},
    {0.7, 0},
    {0, 1.3627},
    0.05};
inline const Motion double_pendulum{
    "lagrangian = \"(1 + m)*a'^2/2 + m*b'^2/2 + m*a'*b'*cos(a - b) + (1 + m)*g*cos(a) + m*g*cos(b)\"\n[coordinates]\n"
    "a = { position = 0.5, velocity = 0 }\nb = { position = 0.75, velocity = 0.25 }\n[parameters]\nm = 2\ng = 1\n",
    {2, 1},
    {0.5, 0.75},
    {0, 0.25},
    0.1};
// Its longitude f is cyclic: with Lobatto's nodes the conserved momentum has a multiplier (D29).
inline const Motion spherical_pendulum{
    "lagrangian = \"l^2*(a'^2 + sin(a)^2*f'^2)/2 + cos(a)\"\n[coordinates]\na = { position = 1, velocity = 0.25 }\n"
    "f = { position = 0, velocity = 0.5 }\n[parameters]\nl = 1\n",
    {1},
    {1, 0},
    {0.25, 0.5},
    0.1};
inline const Motion driven_pendulum{
    "time = \"t\"\nlagrangian = \"q'^2/2 + cos(q) + a*q*cos(w*t)\"\n[coordinates]\nq = { position = 0.5, velocity = 0 "
    "}\n"
    "[parameters]\na = 0.25\nw = 1.25\n",
    {0.25, 1.25},
    {0.5},
    {0},
    0.1};
inline const Motion coupled_oscillators{
    "lagrangian = \"(x'^2 + y'^2 + z'^2)/2 - k*(x^2 + y^2 + z^2)/2 - (x - y)^2/4 - (y - z)^2/4\"\n[coordinates]\n"
    "x = { position = 1, velocity = 0 }\ny = { position = 0, velocity = 0.5 }\nz = { position = -0.5, velocity = 0.25 "
    "}\n"
    "[parameters]\nk = 1.5\n",
    {1.5},
    {1, 0, -0.5},
    {0, 0.5, 0.25},
    0.1};
inline const Motion harmonic_oscillator{
    "lagrangian = \"m*q'^2/2 - k*q^2/2\"\n[coordinates]\nq = { position = 1, velocity = 0.5 }\n[parameters]\nm = 2\n"
    "k = 3\n",
    {2, 3},
    {1},
    {0.5},
    0.1};
// Twelve masses between two walls, plucked: springs that are linear and cubic.
inline Motion chain() {
    Motion chain{
        "lagrangian = \"sum(i = 1 .. n, x[i]'^2/2) - sum(i = 2 .. n, s[i]) - k*x[1]^2/2 - x[1]^4/4 - k*x[n]^2/2 - "
        "x[n]^4/4\"\n[definitions]\n\"s[i]\" = \"k*(x[i] - x[i-1])^2/2 + (x[i] - x[i-1])^4/4\"\n[coordinates]\n"
        "x = { count = \"n\", position = \"i/20\", velocity = 0 }\n[parameters]\nn = { value = 12, constant = true }\n"
        "k = 1\n",
        {1},
        {},
        {},
        0.1};
    for (int i = 1; i <= 12; ++i) {
        chain.q.push_back(i * (13 - i) * 0.02);
        chain.v.push_back(i % 3 * 0.1);
    }
    return chain;
}

// A driven ring of pendulums in 5 rows of 9: each is coupled to the next, to the one after, and to the next row;
// lengths, masses and couplings differ. Rows of formulas in runs, runs that end, far and near neighbours.
inline Motion lattice() {
    Motion lattice{
        "time = \"t\"\nlagrangian = \"sum(i = 1 .. n, (1 + i/n)*x[i]'^2/2 + g*(1 + mod(i, 4))*(cos(x[i]) - 1)) - sum(i "
        "= 1 "
        ".. n, "
        "(k + i/50)*sin((x[i] - x[mod(i, n) + 1])/2)^2) - sum(i = 1 .. n - 2, (x[i] - x[i+2])^4/8) - sum(i = 1 .. n - "
        "9, "
        "k*(x[i] - x[i+9])^2/4 + x[i]*x[i+9]^3/30) + a*x[1]*cos(2*t) + a*sum(i = 2 .. n - 1, x[i]*sin(t))\"\n"
        "[coordinates]\nx = { count = \"n\", position = \"i/40\", velocity = 0 }\n[parameters]\n"
        "n = { value = 45, constant = true }\ng = 0.5\nk = 1.25\na = 0.2\n",
        {0.5, 1.25, 0.2},
        {},
        {},
        0.1};
    for (int i = 1; i <= 45; ++i) {
        lattice.q.push_back(i % 7 * 0.2 - 0.5);
        lattice.v.push_back(i % 3 * 0.1);
    }
    return lattice;
}

// `method`: the lines under [method]; `output`: those under [output].
inline Derivation derivation_of(const Motion& motion, const std::string& method, const std::string& output = "",
                                Shortcuts shortcuts = Shortcuts::all) {
    return derive(read_scene(Source("motion.toml", "title = \"Motion\"\n" + motion.body + "[method]\n" + method +
                                                       "\n[run]\nstep = 0.1\nuntil = 1\n[output]\n" + output + "\n")),
                  shortcuts);
}

// Without fixed-point iterations: each step by Newton's iteration alone.
inline Kernel newton_kernel(const Derivation& derivation, Precision precision) {
    EmitOptions options;
    options.precision = precision;
    KernelSource source = emit(derivation, options);
    const std::string claim = "bool any_number = true";
    const std::size_t at = source.formulas.find(claim);  // of a general derivation it is false
    if (at != std::string::npos) source.formulas.replace(at, claim.size(), "bool any_number = false");
    return kernel_of(source, precision);
}

inline Kernel ensemble_kernel_in_own_cache(const Derivation& derivation, std::int64_t together = 32) {
    return ensemble_kernel_of(emit(derivation), Precision::double_, together);
}

template <class real>
std::vector<real> converted(const std::vector<double>& numbers) {
    return {numbers.begin(), numbers.end()};
}

// At the start of the motion, from its velocities.
template <class real>
LoadedStepper<real> started(const Kernel& kernel, const Motion& motion, double step) {
    LoadedStepper<real> stepper(kernel);
    REQUIRE(stepper.prepare(converted<real>(motion.parameters), static_cast<real>(step)) == LOBATTO_OK);
    const auto q = converted<real>(motion.q);
    REQUIRE(stepper.start(0, q, stepper.momentum(0, q, converted<real>(motion.v))) == LOBATTO_OK);
    return stepper;
}

// The starts of an ensemble around one: parameters vary by 2 %, positions by of_q, velocities by of_rate at most.
inline EnsembleStart start_around(const std::vector<double>& parameters, const std::vector<double>& q,
                                  const std::vector<double>& v, std::int64_t index, double of_q, double of_rate) {
    const auto i = static_cast<double>(index);
    EnsembleStart start{parameters, q, v};
    for (std::size_t k = 0; k < parameters.size(); ++k) start.parameters[k] *= 1 + 0.02 * std::sin(i + double(k));
    for (std::size_t k = 0; k < q.size(); ++k) start.q[k] += of_q * std::cos(3 * i + double(k));
    for (std::size_t k = 0; k < q.size(); ++k) start.rate[k] += of_rate * std::sin(2 * i + double(k));
    return start;
}

// The largest difference relative to the largest number of b, in units of epsilon; of numbers `first` and after.
inline double distance_in_epsilon(const std::vector<double>& a, const std::vector<double>& b, std::size_t first = 0) {
    REQUIRE(a.size() == b.size());
    double most = 0, size = 0;
    for (std::size_t i = first; i < a.size(); ++i) {
        if (std::isnan(a[i] - b[i])) return HUGE_VAL;
        most = std::fmax(most, std::fabs(a[i] - b[i]));
        size = std::fmax(size, std::fabs(b[i]));
    }
    return most == 0 ? 0 : most / size / std::numeric_limits<double>::epsilon();
}

}  // namespace lobatto::test
