// SPDX-License-Identifier: MIT
// The control loop of control.cpp with the kernel alone: the torque is an input of the scene.
#include <cstdio>

#include "arm.hpp"

int main() {
    lobatto::Stepper<lobatto::kernels::arm> arm;
    lobatto::kernels::arm::Parameters values;
    const double q[] = {0.3, 0.3}, p[] = {0, 0};
    arm.prepare(values, 0.02);
    arm.start(0, q, p);
    while (arm.time() < 4 - 1e-9) {
        double momentum[2], velocity[2];
        arm.momentum(momentum);
        if (arm.velocity(arm.time(), arm.q, momentum, velocity) != lobatto::Status::ok) return 3;
        values.torque = -2 * velocity[0];
        if (lobatto::set_inputs(arm, values) != lobatto::Status::ok || arm.step() != lobatto::Status::ok) return 3;
    }
    std::printf("t = %.2f s: a = %.6f rad, b = %.6f rad\n", arm.time(), arm.q[0], arm.q[1]);
}
