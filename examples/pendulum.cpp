// SPDX-License-Identifier: MIT
// From Lagrangian to kernel to your own program. Written by `lobatto emit scenes/pendulum.toml`: pendulum.hpp.
//   g++ -std=c++17 -O2 -I generated -I runtime/kernel examples/pendulum.cpp -o pendulum && ./pendulum
#include <cstdio>

#include "pendulum.hpp"

int main() {
    lobatto::Stepper<lobatto::kernels::pendulum> pendulum;
    const double q = 1.5707963267948966, p = 0;  // 90 degrees, at rest
    pendulum.prepare({}, 0.05);                  // the scene's parameters, h = 0.05 s
    pendulum.start(0, &q, &p);
    while (pendulum.steps < 24) {
        if (pendulum.step() != lobatto::Status::ok) return 1;
        std::printf("%.2f %.12f\n", pendulum.time(), pendulum.q[0]);
    }
}
