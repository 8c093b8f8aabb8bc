// SPDX-License-Identifier: GPL-2.0-or-later
// The elementary functions of kernels: worst error and time per value, as a table in Markdown, beside the C library's.
#include <fmt/format.h>
#include <quadmath.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "runtime/kernel/kernel.hpp"

namespace {

using namespace lobatto;
__extension__ typedef __float128 Quadruple;

struct Arguments {
    double low, high;
};

constexpr int count = 1024;

std::vector<double> uniform(Arguments range, int values, unsigned seed) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> x(range.low, range.high);
    std::vector<double> result(static_cast<std::size_t>(values));
    for (double& value : result) value = x(random);
    return result;
}

// |got - want| in units of the last place of `want`.
double ulps(double got, Quadruple want) {
    int exponent = 0;
    frexpq(want, &exponent);
    return static_cast<double>(fabsq(got - want) / ldexpq(1, std::max(exponent - 53, -1074)));
}

// The least time of many repetitions, in nanoseconds.
template <class Work>
double least_time(Work work) {
    double least = 1e9;
    for (int repetition = 0; repetition < 400; ++repetition) {
        const auto start = std::chrono::steady_clock::now();
        work();
        least =
            std::min(least, std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - start).count());
    }
    return least;
}

// Nanoseconds per value of independent calls.
template <class T, class Function>
double throughput(Arguments range, Function function) {
    const std::vector<double> x = uniform(range, count, 1);
    std::vector<double> y(count);
    const double time = least_time([&] {
        for (std::size_t i = 0; i < count; i += lanes_of<T>) {
            if constexpr (std::is_same_v<T, double>)
                y[i] = function(x[i]);
            else
                function(T::load(&x[i])).store(&y[i]);
        }
        asm volatile("" : : "r"(y.data()) : "memory");
    });
    return time / count;
}

// Nanoseconds per call, each waiting for the one before.
template <class T, class Function>
double latency(Arguments range, Function function) {
    const double middle = 0.5 * (range.low + range.high) + 0.1 * (range.high - range.low);
    const auto chain = [&](auto step) {
        return least_time([&] {
            T x = middle;
            asm volatile("" : "+m"(x));  // so that nobody knows that the lanes agree
            for (int i = 0; i < count; ++i) x = fused(step(x), T(1e-40), T(middle));
            asm volatile("" : : "m"(x));
        });
    };
    return (chain(function) - chain([](T x) { return x; })) / count;
}

template <class T, class Function>
double worst_error(Arguments range, Function function, Quadruple (*exact)(Quadruple)) {
    double worst = 0;
    const std::vector<double> x = uniform(range, 40 * count, 2);
    std::vector<double> y(x.size());
    for (std::size_t i = 0; i < x.size(); i += lanes_of<T>) {
        if constexpr (std::is_same_v<T, double>)
            y[i] = function(x[i]);
        else
            function(T::load(&x[i])).store(&y[i]);
    }
    for (std::size_t i = 0; i < x.size(); ++i) worst = std::max(worst, ulps(y[i], exact(x[i])));
    return worst;
}

// Worst error, time of independent calls and of dependent ones.
template <class T, class Function>
std::string columns(Arguments range, Function function, Quadruple (*exact)(Quadruple)) {
    return fmt::format(" {:.2f} {:.2f} / {:.1f} |", worst_error<T>(range, function, exact),
                       throughput<T>(range, function), latency<T>(range, function));
}

#if defined(__AVX2__) && defined(__GLIBC__)
// The vector functions of the C library, four doubles at a time; it declares them only for -ffast-math.
using Four = Pack<double, 4>;
using Register4 = Four::Part;
extern "C" {
Register4 _ZGVdN4v_sin(Register4);
Register4 _ZGVdN4v_cos(Register4);
Register4 _ZGVdN4v_tan(Register4);
Register4 _ZGVdN4v_exp(Register4);
Register4 _ZGVdN4v_log(Register4);
Register4 _ZGVdN4v_sinh(Register4);
Register4 _ZGVdN4v_cosh(Register4);
Register4 _ZGVdN4v_tanh(Register4);
Register4 _ZGVdN4v_asin(Register4);
Register4 _ZGVdN4v_acos(Register4);
Register4 _ZGVdN4v_atan(Register4);
Register4 _ZGVdN4vv_pow(Register4, Register4);
}
#define LIBRARY4(name) [](Four v) { return Four::of([&](int) { return _ZGVdN4v_##name(v.part[0]); }); }
#define LIBRARY4_POW(y) [](Four v) { return Four::of([&](int) { return _ZGVdN4vv_pow(v.part[0], Four(y).part[0]); }); }
#else
using Four = double;
#define LIBRARY4(name) [](double x) { return std::name(x); }
#define LIBRARY4_POW(y) [](double x) { return std::pow(x, y); }
#endif

template <class Function, class Scalar, class Vector>
void row(const std::string& name, Arguments range, Function function, Scalar library, Vector library4,
         Quadruple (*exact)(Quadruple)) {
    fmt::print("| {} on [{}, {}] |{}{}{}{}{}{}{}\n", name, range.low, range.high,
               columns<double>(range, library, exact), columns<Four>(range, library4, exact),
               columns<Pack<double, 1>>(range, function, exact), columns<Pack<double, 2>>(range, function, exact),
               columns<Pack<double, 4>>(range, function, exact), columns<Pack<double, 8>>(range, function, exact),
               columns<Pack<double, 16>>(range, function, exact));
}

#define ROW(name, low, high)                                                                        \
    row(                                                                                            \
        #name, {low, high}, [](auto x) __attribute__((always_inline)) { return lobatto::name(x); }, \
        [](double x) { return std::name(x); }, LIBRARY4(name), name##q)

// The sum of both, so that both are computed.
Quadruple sum_of_both(Quadruple x) {
    return sinq(x) + cosq(x);
}
Quadruple power_of_five_halves(Quadruple x) {
    return powq(x, 2.5);
}

}  // namespace

int main() {
    fmt::print(
        "Worst error in units of the last place, ns per value of independent calls / ns per call of dependent ones.\n"
        "AVX: registers of {} bytes; fused multiply-add: {}.\n\n"
        "| function | C library | C library, 4 | 1 | 2 | 4 | 8 | 16 |\n|---|---|---|---|---|---|---|---|\n",
        register_bytes, has_fused);
    ROW(sin, -100, 100);
    ROW(cos, -100, 100);
    const auto both = [](auto x) __attribute__((always_inline)) {
        decltype(x) sine = x, cosine = x;
        lobatto::sincos(x, sine, cosine);
        return sine + cosine;
    };
    row(
        "sin + cos", {-100, 100}, both, [](double x) { return std::sin(x) + std::cos(x); },
        [](Four x) { return LIBRARY4(sin)(x) + LIBRARY4(cos)(x); }, sum_of_both);
    ROW(tan, -100, 100);
    ROW(exp, -50, 50);
    ROW(log, 0.01, 100);
    row(
        "x^2.5", {0.01, 100}, [](auto x) __attribute__((always_inline)) { return lobatto::pow(x, 2.5); },
        [](double x) { return std::pow(x, 2.5); }, LIBRARY4_POW(2.5), power_of_five_halves);
    ROW(sinh, -5, 5);
    ROW(cosh, -5, 5);
    ROW(tanh, -5, 5);
    ROW(asin, -1, 1);
    ROW(acos, -1, 1);
    ROW(atan, -5, 5);
}
