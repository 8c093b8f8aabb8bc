// SPDX-License-Identifier: MIT
// The kernel that lobatto_add_kernel() wrote: the same bits as `lobatto run arm.toml --points 6`.
#include <cstdio>

#include "arm.hpp"

int main() {
    lobatto::Stepper<lobatto::kernels::arm> arm;
    const double q[] = {0.3, 0.3}, p[] = {0, 0};
    arm.prepare({}, 0.02);
    arm.start(0, q, p);
    for (int i = 0; i < 100; ++i)
        if (arm.step() != lobatto::Status::ok) return 3;
    std::printf("%.17g,%.17g,%.17g\n", arm.time(), arm.q[0], arm.q[1]);
}
