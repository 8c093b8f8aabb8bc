// SPDX-License-Identifier: MIT
// Many trajectories side by side in vector registers, from a kernel alone: eight pendulums and their starts.
//   g++ -std=c++17 -O3 -march=native -ffp-contract=off -I generated -I runtime/kernel examples/ensemble.cpp -o ensemble
#include <cstdint>
#include <cstdio>

#include "pendulum.hpp"

int main() {
    using Pendulum = lobatto::kernels::pendulum;
    constexpr int width = 8, n = Pendulum::coordinates, parameters = Pendulum::parameter_count;
    lobatto::Ensemble<Pendulum, width> pendulums;
    double values[width * parameters], q[width * n], p[width * n];  // one trajectory after another
    lobatto::Status status[width];                                  // of each; one that fails lets the others go on
    std::int64_t done[width], iterations[width];                    // steps taken, and iterations in them
    for (int i = 0; i < width; ++i) {
        Pendulum::Parameters given;  // those of the scene
        for (int k = 0; k < parameters; ++k) values[i * parameters + k] = Pendulum::parameter(given, k);
        q[i] = 0.25 * (i + 1);
        p[i] = 0;
    }
    pendulums.prepare(values, 0.05, status);             // h
    pendulums.start(0, q, p, status);                    // t
    pendulums.advance(24, 0, status, done, iterations);  // steps; 0: each to rounding
    pendulums.state(q, p);
    for (int i = 0; i < width; ++i) {
        if (status[i] != lobatto::Status::ok) return 1;
        std::printf("%.2f %.12f\n", 0.25 * (i + 1), q[i]);
    }
}
