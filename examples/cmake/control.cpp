// SPDX-License-Identifier: GPL-2.0-or-later
// A control loop: every 20 ms a torque that damps the upper arm, computed from where the arm is.
#include <cstdio>

#include <lobatto/lobatto.hpp>

int main(int argc, char** argv) {
    namespace lob = lobatto::api;
    try {
        const lob::Scene scene(argc > 1 ? argv[1] : "arm.toml");
        lob::Stepper arm(lob::compile(scene));
        while (arm.t() < 4 - 1e-9) {
            arm.set("torque", -2 * arm.velocity()[0]);
            arm.step();
        }
        std::printf("t = %.2f s: a = %.6f rad, b = %.6f rad\n", arm.t(), arm.q()[0], arm.q()[1]);
    } catch (const lob::Error& error) {
        std::fprintf(stderr, "%s\n", error.what());
        return error.exit_code();
    }
}
