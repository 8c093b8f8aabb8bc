// SPDX-License-Identifier: GPL-2.0-or-later
#include "bench/growth.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "analysis/kernel/kernel_of.hpp"
#include "generator/pipeline.hpp"

namespace lobatto::bench {

namespace {

// The least time of a few repetitions, in nanoseconds.
template <class Work>
double least_time(Work&& work) {
    double least = 1e300;
    for (int repetition = 0; repetition < 9; ++repetition) {
        const auto start = std::chrono::steady_clock::now();
        work();
        least =
            std::min(least, std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - start).count());
    }
    return least;
}

// P5's springs and its first mode, of n masses; or springs that are linear.
KernelSource chain(int n, bool linear) {
    const std::string spring = linear ? "" : " + 0.3*(x[i] - x[i-1])^4/4", wall = linear ? "" : " - 0.3*x[1]^4/4";
    const std::string sum =
        n > 1 ? fmt::format(" - sum(i = 2 .. {}, (x[i] - x[i-1])^2/2{}) - x[{}]^2/2", n, spring, n) : "";
    const std::string text = fmt::format(
        "title = \"Chain of {0}\"\nlagrangian = \"sum(i = 1 .. {0}, x[i]'^2/2) - x[1]^2/2{1}{2}\"\n[coordinates]\n"
        "x = {{ count = {0}, position = \"sin(pi*i/({0}+1))\", momentum = 0 }}\n[method]\npoints = 5\n[run]\nstep = "
        "0.5\n"
        "until = 1\n[output]\nenergy = false\ntangent = false\n",
        n, wall, sum);
    return emit(derive(read_scene(Source(fmt::format("chain_{}.toml", n), text))));
}

double ns_a_step(const Kernel& kernel, int n, std::int64_t steps, double& iterations) {
    LoadedStepper<double> stepper(kernel);
    std::vector<double> q, p(static_cast<std::size_t>(n), 0.0);
    for (int i = 1; i <= n; ++i) q.push_back(std::sin(std::numbers::pi * i / (n + 1)));
    stepper.prepare({}, 0.5);
    const double time = least_time([&] {
        stepper.start(0, q, p);
        lobatto_advance call{};
        call.steps = steps;
        stepper.advance(call);
        iterations = static_cast<double>(call.iterations) / static_cast<double>(steps);
    });
    return time / static_cast<double>(steps);
}

// x <- x + E x + shift, column by column, which is how a careful person writes it: the inner loop runs along the
// registers.
double ns_a_product(int n, std::int64_t steps) {
    const std::size_t rows = 2 * static_cast<std::size_t>(n);
    std::vector<double> E(rows * rows), x(rows, 1.0), sum(rows), shift(rows, 1e-9);
    for (std::size_t i = 0; i < E.size(); ++i) E[i] = 1e-3 * std::sin(static_cast<double>(i));
    const double time = least_time([&] {
        double* const __restrict y = sum.data();
        double* const __restrict state = x.data();
        for (std::int64_t step = 0; step < steps; ++step) {
            for (std::size_t r = 0; r < rows; ++r) y[r] = shift[r];
            for (std::size_t c = 0; c < rows; ++c) {
                const double* const __restrict column = E.data() + c * rows;
                const double factor = state[c];
                for (std::size_t r = 0; r < rows; ++r) y[r] += column[r] * factor;
            }
            for (std::size_t r = 0; r < rows; ++r) state[r] += y[r];
            if (!(std::fabs(state[0]) < 1e100)) std::fill(x.begin(), x.end(), 1.0);
        }
    });
    return time / static_cast<double>(steps);
}

}  // namespace

void print_growth() {
    fmt::print("\n| masses | ns a step | iterations | ns a mass, step and iteration |\n|---|---|---|---|\n");
    for (const int n : {8, 16, 32, 64, 128, 256, 512, 1024, 2048, 4096}) {
        double iterations = 0;
        const double time = ns_a_step(kernel_of(chain(n, false), Precision::double_), n, 200'000 / n, iterations);
        fmt::print("| {} | {:.0f} | {:.2f} | {:.2f} |\n", n, time, iterations, time / n / iterations);
    }
    fmt::print("\n| coordinates, linear | ns a step | ns a matrix times a vector | ratio |\n|---|---|---|---|\n");
    for (const int n : {1, 2, 4, 8, 16}) {
        double iterations = 0;
        const double ours = ns_a_step(kernel_of(chain(n, true), Precision::double_), n, 20'000, iterations);
        const double theirs = ns_a_product(n, 20'000);
        fmt::print("| {} | {:.1f} | {:.1f} | {:.2f} |\n", n, ours, theirs, ours / theirs);
    }
}

}  // namespace lobatto::bench
