// SPDX-License-Identifier: GPL-2.0-or-later
#include "bench/problems.hpp"

#include <numbers>

namespace lobatto::bench {

const std::vector<Problem>& problems() {
    static const std::vector<Problem> all = [] {
        const double pi = std::numbers::pi;
        std::vector<double> first_mode(32);
        for (int i = 1; i <= 32; ++i) first_mode[i - 1] = std::sin(pi * i / 33);
        return std::vector<Problem>{
            {"P1", "pendulum", "p1_pendulum.toml", 1000, {2}, {0}, 4, 1, 2000},
            {"P2", "Henon-Heiles", "p2_henon_heiles.toml", 1000, {0.18, 0.18}, {0.18, 0.18}, 4, 1, 2000},
            {"P3", "double pendulum", "p3_double_pendulum.toml", 100, {0.5, 0.3}, {0, 0}, 0.7, 5.79, 2000},
            {"P4", "Kepler, e = 0.3", "p4_kepler.toml", 200 * pi, {0.7, 0}, {0, std::sqrt(13.0 / 7)}, 2, 1.71, 4000},
            {"P5", "FPUT chain, 32 masses", "p5_fput.toml", 1000, first_mode, std::vector<double>(32, 0), 8, 2.04,
             1000}};
    }();
    return all;
}

}  // namespace lobatto::bench
