// SPDX-License-Identifier: GPL-2.0-or-later
#include "bench/problems.hpp"

#include <numbers>

namespace lobatto::bench {

namespace {

// From pericentre, semi-major axis 1.
Problem eccentric(const std::string& name, double eccentricity, double revolutions) {
    Problem problem;
    problem.name = name;
    problem.title = "Kepler, e = " + std::string(eccentricity == 0.9 ? "0.9" : "0.99");
    problem.scene = "p4_kepler.toml";
    problem.type = Kepler();
    problem.until = 2 * std::numbers::pi * revolutions;
    problem.q = {1 - eccentricity, 0};
    problem.p = {0, std::sqrt((1 + eccentricity) / (1 - eccentricity))};
    problem.reference = Reference::closed;
    problem.positions_only = true;
    problem.revolutions = revolutions;
    problem.clocks = {"auto"};
    return problem;
}

}  // namespace

const std::vector<Problem>& problems() {
    static const std::vector<Problem> all = [] {
        const double pi = std::numbers::pi;
        std::vector<double> first_mode(32);
        for (int i = 1; i <= 32; ++i) first_mode[i - 1] = std::sin(pi * i / 33);
        std::vector<Problem> list = {
            {"P1", "pendulum", "p1_pendulum.toml", Pendulum(), 1000, {2}, {0}, 4, 1, Reference::quadruple_for_one, 0.5},
            {"P2",
             "Henon-Heiles",
             "p2_henon_heiles.toml",
             HenonHeiles(),
             1000,
             {0.18, 0.18},
             {0.18, 0.18},
             4,
             1,
             Reference::quadruple_for_one,
             0.5},
            {"P3",
             "double pendulum",
             "p3_double_pendulum.toml",
             DoublePendulum(),
             100,
             {0.5, 0.3},
             {0, 0},
             0.7,
             5.79,
             Reference::quadruple_for_one,
             0.05},
            {"P4",
             "Kepler, e = 0.3",
             "p4_kepler.toml",
             Kepler(),
             200 * pi,
             {0.7, 0},
             {0, std::sqrt(13.0 / 7)},
             2,
             1.71,
             Reference::closed},
            {"P5", "FPUT chain, 32 masses", "p5_fput.toml", Chain(), 1000, first_mode, std::vector<double>(32, 0), 8,
             2.04, Reference::quadruple_for_one, 1}};
        Problem p6 = eccentric("P6", 0.9, 100);
        p6.longest_step = 0.1;
        p6.frequency = 31.6;          // of the circle at pericentre
        p6.fewest_chain_steps = 400;  // 4 a revolution: 2.1 radians of that circle, below every limit of stability
        Problem p7 = eccentric("P7", 0.99, 10);
        p7.longest_step = 0.01;
        p7.frequency = 1000;
        p7.fewest_chain_steps = 60;
        p7.spread = 1e-5;  // 5e-3 would escape
        const std::vector<double> corners = {1, 3, -2, -1, 1, -1};
        Problem p8{"P8",
                   "Pythagorean, to 10",
                   "p8_pythagorean.toml",
                   Pythagorean(),
                   10,
                   corners,
                   std::vector<double>(6, 0),
                   0.002,
                   1e4,
                   Reference::quadruple,
                   0.1};
        p8.positions_only = true;
        p8.clocks = {"auto"};
        p8.fewest_chain_steps = 30;
        Problem p8b = p8;
        p8b.name = "P8b";
        p8b.title = "Pythagorean, to 20";
        p8b.until = 20;
        p8b.fewest_chain_steps = 60;
        Problem p8c = p8;
        p8c.name = "P8c";
        p8c.title = "Pythagorean, to 40";
        p8c.until = 40;
        p8c.fewest_chain_steps = 120;
        // Two stars, e = 0.6, at apocentre, and a third one around them.
        Problem p9{"P9",
                   "hierarchical triple",
                   "p9_hierarchical.toml",
                   Hierarchical(),
                   20'000 * pi,
                   {-0.7, 0, -2.3, 0, 12, 0},
                   {0, 0.225, 0, -0.275, 0, 0.2},
                   0.4,
                   4,
                   Reference::extended,
                   0.1};
        p9.positions_only = true;
        p9.revolutions = 10'000;
        p9.most_steps = 5'000'000;
        p9.clocks = {"auto"};
        p9.fewest_chain_steps = 40'000;
        for (Problem& problem : {std::ref(p6), std::ref(p7), std::ref(p8), std::ref(p8b), std::ref(p8c), std::ref(p9)})
            list.push_back(problem);
        return list;
    }();
    return all;
}

}  // namespace lobatto::bench
