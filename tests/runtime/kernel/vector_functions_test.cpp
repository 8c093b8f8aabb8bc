// SPDX-License-Identifier: GPL-2.0-or-later
// The elementary functions of packs, in programs of their own: accuracy, special values, and bits that depend on
// neither the width nor the compiler, for every kind of target that this machine can run.
#include <doctest/doctest.h>

#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support.hpp"

using namespace lobatto;

namespace {

// Prints a line for each function: its name, its worst error in units of the last place and a hash of its values' bits;
// for each disagreement a line that begins with "wrong".
const std::string program = R"~~~(
#include <algorithm>
#include <cstdio>
#include <cstring>
#include <random>
#include <vector>
#include "kernel.hpp"

using lobatto::Pack;

double ulps(double got, long double want) {
    int exponent = 0;
    std::frexp(static_cast<double>(want), &exponent);
    return static_cast<double>(std::fabs(got - want) / std::ldexp(1.0L, std::max(exponent - 53, -1074)));
}
bool same(double a, double b) {
    return (a != a && b != b) || std::memcmp(&a, &b, sizeof a) == 0;
}

using Values = std::vector<double>;

template <int width, class Function>
Values values_of(Function function, const Values& x) {
    Values y(x.size());
    for (std::size_t i = 0; i < x.size(); i += width) function(Pack<double, width>::load(&x[i])).store(&y[i]);
    return y;
}
// The same with the arguments rounded to float. Conversions have loops of their own: g++ 12 forgets the rounding when it
// sees both ways at once.
[[gnu::noinline]] std::vector<float> rounded(const Values& x) {
    std::vector<float> result;
    for (double value : x) result.push_back(static_cast<float>(value));
    return result;
}
template <int width, class Function>
[[gnu::noinline]] Values floats_of(Function function, const Values& x) {
    std::vector<float> y = rounded(x);
    for (std::size_t i = 0; i < y.size(); i += width) function(Pack<float, width>::load(&y[i])).store(&y[i]);
    return Values(y.begin(), y.end());
}

template <int width, class Function>
void compare(const char* name, Function function, const Values& x, const Values& y, const Values& floats) {
    const Values wide = values_of<width>(function, x), wide_floats = floats_of<width>(function, x);
    for (std::size_t i = 0; i < x.size(); ++i) {
        if (!same(wide[i], y[i])) std::printf("wrong: %s(%a) is %a, at width %d %a\n", name, x[i], y[i], width, wide[i]);
        if (!same(wide_floats[i], floats[i])) std::printf("wrong: float %s(%a) at width %d\n", name, x[i], width);
    }
}

template <class Function, class Exact>
void check(const char* name, const Values& ranges, Function function, Exact exact) {
    std::mt19937_64 random(1);
    Values x;
    for (std::size_t r = 0; r < ranges.size(); r += 2) {
        std::uniform_real_distribution<double> within(ranges[r], ranges[r + 1]);
        for (int i = 0; i < 16384; ++i) x.push_back(within(random));
    }
    const std::size_t ordinary = x.size();
    const double infinity = std::numeric_limits<double>::infinity();
    for (double special :
         {0.0, 5e-324, 1e-310, 2.2250738585072014e-308, 1e-300, 1e-20, 1e-8, 0.25, 0.5, 0.6875, 0.75, 1.0, 1.5, 2.0, 3.0,
          0x1.fffffffffffffp-1, 0x1.0000000000001p+0, 20.0, 22.5, 31.9, 36.7, 40.0, 500.0, 708.0, 709.78271289338397, 709.8,
          710.47586007394, 710.5, 711.0, 745.0, 745.2, 746.0, 1e4, 823548.9, 823549.1, 1e6, 1e22, 0x1p+1023, 1.7e308,
          infinity, infinity - infinity})
        for (double sign : {1.0, -1.0}) x.push_back(sign * special);
    while (x.size() % 32 != 0) x.push_back(0.1);
    const Values y = values_of<1>(function, x), floats = floats_of<1>(function, x);
    double worst = 0, worst_float = 0;
    unsigned long long hash = 1469598103934665603ull;
    for (std::size_t i = 0; i < x.size(); ++i) {
        const long double want = exact(static_cast<long double>(x[i]));
        const double rounded = static_cast<double>(want);
        if (rounded != rounded || std::fabs(rounded) > 1.7976931348623157e308 || rounded == 0) {
            if (!same(y[i], rounded)) std::printf("wrong: %s(%a) is %a, not %a\n", name, x[i], y[i], rounded);
        } else if (i < ordinary || std::fabs(rounded) > 1e-307) {
            worst = std::max(worst, ulps(y[i], want));
        } else if (std::fabs(y[i] - rounded) > 1e-323) {
            std::printf("wrong: %s(%a) is %a, not %a\n", name, x[i], y[i], rounded);
        }
        const long double want_float = exact(static_cast<long double>(static_cast<float>(x[i])));
        const double size = static_cast<double>(std::fabs(want_float));
        if (size > 1e-37 && size < 3e38) worst_float = std::max(worst_float, ulps(floats[i], want_float) * 0x1p-29);
        std::uint64_t bits = 0;
        if (y[i] == y[i]) std::memcpy(&bits, &y[i], sizeof bits);
        hash = (hash ^ bits) * 1099511628211ull;
    }
    compare<2>(name, function, x, y, floats);
#ifdef EVERY_WIDTH
    compare<4>(name, function, x, y, floats);
#endif
    compare<8>(name, function, x, y, floats);
#ifdef EVERY_WIDTH
    compare<16>(name, function, x, y, floats);
    compare<32>(name, function, x, y, floats);
#endif
    std::printf("%s %.4f %.4f %llx\n", name, worst, worst_float, hash);
}

template <class P>
P sine_of_pair(const P& x) {
    P sine, cosine;
    sincos(x, sine, cosine);
    return sine;
}
template <class P>
P cosine_of_pair(const P& x) {
    P sine, cosine;
    sincos(x, sine, cosine);
    return cosine;
}

// Sines, then cosines, of x from those of x0.
template <int width>
Values near_values(const Values& x0, const Values& x) {
    Values y(2 * x.size());
    for (std::size_t i = 0; i < x.size(); i += width) {
        using P = Pack<double, width>;
        lobatto::Angle<P> angle;
        P sine, cosine;
        lobatto::AnglesKept<P>{&angle}.sincos(0, P::load(&x0[i]), sine, cosine);
        lobatto::AnglesNear<P>{&angle}.sincos(0, P::load(&x[i]), sine, cosine);
        sine.store(&y[i]);
        cosine.store(&y[x.size() + i]);
    }
    return y;
}
template <int width>
void compare_near(const Values& x0, const Values& x, const Values& y) {
    const Values wide = near_values<width>(x0, x);
    for (std::size_t i = 0; i < y.size(); ++i)
        if (!same(wide[i], y[i])) {
            const std::size_t at = i % x.size();
            std::printf("wrong: %a near %a is %a, at width %d %a\n", x[at], x0[at], y[i], width, wide[i]);
        }
}
// Centres of many sizes; most angles within pi/4 of them, others anywhere: those are as if by sincos.
void check_near() {
    std::mt19937_64 random(1);
    const double quarter = 0.7853981633974483, infinity = std::numeric_limits<double>::infinity();
    const auto within = [&random](double size) { return std::uniform_real_distribution<double>(-size, size)(random); };
    Values x0, x;
    for (double size : {1e-8, 1.0, 4.0, 100.0, 1e6, 1e15})
        for (int i = 0; i < 16384; ++i) {
            x0.push_back(within(size));
            x.push_back(x0.back() + within(i % 16 == 0 ? 10 : quarter));
        }
    const std::size_t ordinary = x.size();
    for (double special : {0.0, 1.0, 1e15, 1e300, infinity, infinity - infinity})
        for (double centre : {0.0, 0.5, infinity, infinity - infinity}) {
            x0.push_back(centre);
            x.push_back(special);
        }
    while (x.size() % 32 != 0) {
        x0.push_back(quarter);
        x.push_back(0);
    }
    const Values y = near_values<1>(x0, x);
    double worst = 0;
    unsigned long long hash = 1469598103934665603ull;
    for (std::size_t i = 0; i < x.size(); ++i) {
        const double sine = y[i], cosine = y[x.size() + i];
        const Pack<double, 1> alone = x[i];
        const bool is_same = same(sine, sine_of_pair(alone)[0]) && same(cosine, cosine_of_pair(alone)[0]);
        if (std::fabs(x[i] - x0[i]) > quarter && !is_same) std::printf("wrong: %a far from %a\n", x[i], x0[i]);
        if (i < ordinary) {
            const long double exact = x[i];
            worst = std::max(worst, static_cast<double>(std::fabs(sine - std::sin(exact)) * 0x1p53L));
            worst = std::max(worst, static_cast<double>(std::fabs(cosine - std::cos(exact)) * 0x1p53L));
            std::uint64_t bits[2];
            std::memcpy(bits, &sine, sizeof sine);
            std::memcpy(bits + 1, &cosine, sizeof cosine);
            hash = ((hash ^ bits[0]) * 1099511628211ull ^ bits[1]) * 1099511628211ull;
        } else if (!(std::fabs(x[i]) < infinity) && (sine == sine || cosine == cosine)) {
            std::printf("wrong: %a near %a is a number\n", x[i], x0[i]);
        }
    }
    compare_near<2>(x0, x, y);
#ifdef EVERY_WIDTH
    compare_near<4>(x0, x, y);
#endif
    compare_near<8>(x0, x, y);
#ifdef EVERY_WIDTH
    compare_near<16>(x0, x, y);
    compare_near<32>(x0, x, y);
#endif
    std::printf("near angles %.4f 0 %llx\n", worst, hash);
}

#define CHECK(name, ...) \
    check(#name, {__VA_ARGS__}, [](const auto& x) { return lobatto::name(x); }, [](long double x) { return std::name(x); })

template <int width>
void check_pow_specials() {
    const double infinity = std::numeric_limits<double>::infinity();
    for (double x : {0.0, 1.0, 2.0, 3.0, 0.5, 1e-310, 1e-300, 1e300, 0.99, infinity, infinity - infinity})
        for (double y : {0.0, 1.0, 2.0, 3.0, 0.5, 2.5, 1e-300, 700.0, 1e15 + 1, 1e17, 1e300, infinity, infinity - infinity})
            for (double sign_x : {1.0, -1.0})
                for (double sign_y : {1.0, -1.0}) {
                    const double a = sign_x * x, b = sign_y * y, want = std::pow(a, b);
                    Pack<double, width> base = 1.5, exponent = 2.5;
                    base.set(width - 1, a);
                    exponent.set(width - 1, b);
                    const double got = pow(base, exponent)[width - 1];
                    if (!same(got, want) && !(std::fabs(got - want) <= 3e-16 * std::fabs(want)))
                        std::printf("wrong: pow(%a, %a) is %a, not %a\n", a, b, got, want);
                }
}

int main() {
    const double far = 823548;
    CHECK(sin, -0.5, 0.5, -4, 4, -100, 100, -1e4, 1e4, -far, far);
    CHECK(cos, -0.5, 0.5, -4, 4, -100, 100, -1e4, 1e4, -far, far);
    check("sine of sincos", {-4, 4, -far, far}, [](const auto& x) { return sine_of_pair(x); }, [](long double x) { return std::sin(x); });
    check("cosine of sincos", {-4, 4, -far, far}, [](const auto& x) { return cosine_of_pair(x); }, [](long double x) { return std::cos(x); });
    CHECK(tan, -0.5, 0.5, -4, 4, -100, 100, -far, far);
    CHECK(exp, -0.4, 0.4, -50, 50, -708, 709);
    CHECK(log, 0.5, 2, 0.99, 1.01, 1e-300, 1e-290, 0, 1e3, 1e200, 1e300);
    CHECK(sinh, -0.4, 0.4, -5, 5, -40, 40, -710, 710);
    CHECK(cosh, -0.4, 0.4, -5, 5, -40, 40, -710, 710);
    CHECK(tanh, -0.4, 0.4, -5, 5, -40, 40);
    CHECK(asin, -0.5, 0.5, -1, 1, 0.99, 1);
    CHECK(acos, -0.5, 0.5, -1, 1, 0.99, 1);
    CHECK(atan, -0.5, 0.5, -3, 3, -1e3, 1e3, -1e10, 1e10);
    check("pow 2.5", {0.5, 2, 0, 1e3, 0, 1e120}, [](const auto& x) { return pow(x, 2.5f); }, [](long double x) { return std::pow(x, 2.5L); });
    check("pow -60.5", {0.5, 2, 0.01, 100}, [](const auto& x) { return pow(x, -60.5f); }, [](long double x) { return std::pow(x, -60.5L); });
    check("pow of 3", {-1, 1, -600, 600}, [](const auto& x) { return pow(3.0f, x); }, [](long double x) { return std::pow(3.0L, x); });
    check("atan2 ahead", {-0.5, 0.5, -3, 3, -1e3, 1e3, -1e10, 1e10}, [](const auto& y) { return atan2(y, 1.5f); }, [](long double y) { return std::atan2(y, 1.5L); });
    check("atan2 behind", {-0.5, 0.5, -3, 3, -1e3, 1e3, -1e10, 1e10}, [](const auto& y) { return atan2(y, -1.5f); }, [](long double y) { return std::atan2(y, -1.5L); });
    check("atan2 above", {-0.5, 0.5, -3, 3, -1e3, 1e3, -1e10, 1e10}, [](const auto& x) { return atan2(2.5f, x); }, [](long double x) { return std::atan2(2.5L, x); });
    check_pow_specials<1>();
    check_pow_specials<4>();
    check_pow_specials<8>();
    // The doubles nearest the multiples of pi/2, and between them; the 263,260th is the nearest of all.
    const long double half_pi = 2 * std::atan(1.0L);
    double worst = 0;
    for (int k = -524284; k <= 524284; k += 1 + (std::abs(k) > 2000) * 52) {
        const double x = static_cast<double>(k * half_pi);
        const double around[4] = {x, std::nextafter(x, 1e9), k == 48 ? 0x1.93c05c9ed3cbcp+18 : x * (1 + 1e-9),
                                  static_cast<double>((k + 0.5) * half_pi)};
        Pack<double, 4> sine, cosine;
        sincos(Pack<double, 4>::load(around), sine, cosine);
        for (int i = 0; i < 4; ++i) {
            worst = std::max(worst, ulps(sine[i], std::sin(static_cast<long double>(around[i]))));
            worst = std::max(worst, ulps(cosine[i], std::cos(static_cast<long double>(around[i]))));
        }
    }
    std::printf("sincos near multiples of pi/2 %.4f 0 0\n", worst);
    check_near();
}
)~~~";

bool exists(const std::string& compiler) {
    return test::run({compiler, "--version"}).exit_code == 0;
}

// What the program prints, compiled so; nothing of it may begin with "wrong".
std::string output_of(const std::string& compiler, const std::string& target, const std::vector<std::string>& flags,
                      bool runs = true) {
    const test::TemporaryFolder folder;
    test::write_text(folder / "check.cpp", program);
    std::vector<std::string> command = {compiler, "-std=c++17", "-march=" + target, "-fno-math-errno",
                                        "-ffp-contract=off"};
    command.insert(command.end(), flags.begin(), flags.end());
    for (const std::string& word : {std::string("-I" LOBATTO_SOURCE_DIR "/runtime/kernel"),
                                    (folder / "check.cpp").string(), std::string("-o"), (folder / "check").string()})
        command.push_back(word);
    const auto compiled = test::run(command);
    REQUIRE_MESSAGE(compiled.exit_code == 0, compiled.err);
    if (!runs) return "";
    const auto finished = test::run({folder / "check"});
    REQUIRE(finished.exit_code == 0);
    CHECK_MESSAGE(finished.out.find("wrong") == std::string::npos, finished.out.substr(0, 2000));
    return finished.out;
}

// The greatest errors seen, with FMA or without: double, in units of the last place.
const std::map<std::string, double> bounds = {
    {"sin", 0.76},                            // 0.743
    {"cos", 0.78},                            // 0.763
    {"sine of sincos", 0.76},                 // 0.739
    {"cosine of sincos", 0.76},               // 0.745
    {"sincos near multiples of pi/2", 1.07},  // 1.063 without FMA, 0.769 with it
    {"near angles", 2.1},                     // 2.077 without FMA, 1.804 with it, in units of 2^-53
    {"tan", 2.1},                             // 2.039
    {"exp", 0.86},                            // 0.842
    {"log", 0.76},                            // 0.738
    {"sinh", 1.95},                           // 1.932
    {"cosh", 1.26},                           // 1.240
    {"tanh", 2.2},                            // 2.186
    {"asin", 0.77},                           // 0.755
    {"acos", 0.85},                           // 0.834
    {"atan", 0.78},                           // 0.762
    {"atan2 ahead", 1.6},                     // 1.546
    {"atan2 behind", 1.4},                    // less
    {"atan2 above", 1.45},                    // 1.405
    {"pow 2.5", 0.88},                        // 0.866
    {"pow -60.5", 0.86},                      // 0.844
    {"pow of 3", 0.87},                       // 0.855
};

void check_errors(const std::string& output) {
    std::istringstream lines(output);
    std::size_t found = 0;
    for (std::string line; std::getline(lines, line);) {
        CAPTURE(line);
        for (const auto& [name, bound] : bounds) {
            if (line.rfind(name + " ", 0) != 0) continue;
            std::istringstream rest(line.substr(name.size()));
            double error = -1, float_error = -1;
            if (!(rest >> error >> float_error)) continue;  // "sin" in "sine"
            ++found;
            CHECK(error < bound);
            CHECK(error > 0);
            CHECK(float_error < 0.501);
        }
    }
    CHECK(found == bounds.size());
}

}  // namespace

// What is tested are programs of other compilers, so that the sanitisers would see nothing of it.
TEST_SUITE_BEGIN("slow");

TEST_CASE("vector functions without FMA keep their accuracy, at every width the same bits") {
    check_errors(output_of("g++", "x86-64", {"-O1"}));
}

// As kernels are compiled, and optimised less.
TEST_CASE(
    "vector functions of this machine keep their accuracy, with the same bits at every width, from g++ and clang++" *
    doctest::test_suite("slowest")) {
    const std::string one = output_of("g++", "native", {"-O2", "-fpeel-loops"});
    check_errors(one);
    CHECK(output_of("g++", "native", {"-O1", "-DEVERY_WIDTH"}) == one);
    if (exists("clang++")) CHECK(output_of("clang++", "native", {"-O1"}) == one);
}

TEST_CASE("vector functions compile for AVX2 and AVX-512, and there have the same bits" *
          doctest::test_suite("slowest")) {
    __builtin_cpu_init();
    const bool avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
    const bool avx512 = __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl");
    const std::string narrow = output_of("g++", "haswell", {"-O1"}, avx2);
    const std::string wide = output_of("g++", "skylake-avx512", {"-O1"}, avx512);
    if (avx2) check_errors(narrow);
    if (avx512) CHECK(wide == narrow);
}

TEST_SUITE_END();
