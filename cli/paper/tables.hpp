// SPDX-License-Identifier: GPL-2.0-or-later
// The paper's two systems run by our kernels and by the implicit midpoint rule, and its Tables 1 and 2.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "generator/emit/kernel.hpp"
#include "generator/scene/scene.hpp"
#include "runtime/build/library.hpp"

namespace lobatto {

enum class PaperSystem { oscillator, pendulum };  // m = 1, omega = 2 pi, q(0) = pi/2, p(0) = 0

struct PaperState {
    long double t = 0, q = 0, p = 0;
};

// Exact motion, energy and period.
PaperState exact_state(PaperSystem system, long double time);
long double exact_energy(PaperSystem system, const PaperState& state);
double exact_period(PaperSystem system);

// The kernel of a system for Lobatto's quadrature with these points (3: Simpson).
Kernel paper_kernel(PaperSystem system, int points, Precision precision = Precision::double_,
                    StepArithmetic arithmetic = StepArithmetic::plain);

// The discrete energy of the oscillator's kernel at this step (eq:discreteEnergy).
std::function<long double(const PaperState&)> discrete_energy_of(const Kernel& kernel, double step);

// Every state of a run in the kernel's own arithmetic (double or extended; a clean kernel's states are the sums of both
// their numbers), the first included, in order.
void run_kernel(const Kernel& kernel, double step, long steps, const std::function<void(const PaperState&)>& observe);
std::vector<PaperState> kernel_states(PaperSystem system, int points, double step, int steps);
std::vector<PaperState> midpoint_states(PaperSystem system, double step, int steps);

struct TableRow {
    std::string quantity;
    double printed[3];
    double lobatto[3], simpson[3], midpoint[3];
    bool rounding = false;  // errors of rounding only: no order, nothing to reproduce
    // log2 of successive errors.
    static double order(double coarse, double fine);
    // |ours/printed - 1| <= 1 % wherever the printed figure is above 1e-12 (and 10 % below it, to the last digit a
    // double can keep).
    bool reproduced() const;
};

struct PaperTable {
    std::string title;
    int meshes[3];
    std::vector<TableRow> rows;
    bool reproduced() const;
};

PaperTable table_1();
PaperTable table_2();

}  // namespace lobatto
