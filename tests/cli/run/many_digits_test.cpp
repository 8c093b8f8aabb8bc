// SPDX-License-Identifier: GPL-2.0-or-later
// Numbers of as many digits as are asked for: how far errors go down, what files keep, what is refused. Where there is
// no MPFR (libmpfr-dev, which `./lobatto test --all` installs) only what is said then is tested.
#include <cln/cln.h>
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>
#include <sstream>

#include "runtime/files/decimal.hpp"
#include "runtime/run/parts.hpp"
#include "tests/built_and_run.hpp"
#include "tests/support.hpp"

using namespace lobatto;

namespace {

const std::string oscillators = LOBATTO_SOURCE_DIR "/scenes/henon_heiles.toml";
const std::string planet = LOBATTO_SOURCE_DIR "/scenes/kepler.toml";
constexpr int parts = 4;  // of 50 digits

bool has_mpfr() {
    const test::TemporaryFolder folder;
    test::write_text(folder / "has.cpp", "#include <mpfr.h>\nint main() { return 0; }\n");
    return test::run({"g++", "-fsyntax-only", folder / "has.cpp"}).exit_code == 0;
}

struct Digits {
    test::TemporaryFolder folder;
    std::string file(const std::string& name) const { return folder / name; }
    test::Finished lobatto(std::vector<std::string> words) const {
        words.insert(words.begin(), LOBATTO_PROGRAM);
        return test::run(words);
    }
    // The last line of a run's file.
    std::vector<std::string> end_of(std::vector<std::string> words) const {
        words.insert(words.begin(), "run");
        words.insert(words.end(), {"-o", file("run.csv")});
        const test::Finished done = lobatto(words);
        REQUIRE_MESSAGE(done.exit_code == 0, done.err);
        std::string text = test::read_file(file("run.csv"));
        text.pop_back();
        std::stringstream line(text.substr(text.rfind('\n') + 1));
        std::vector<std::string> cells;
        for (std::string cell; std::getline(line, cell, ',');) cells.push_back(cell);
        return cells;
    }
};

// The largest difference of two lines.
double apart(const std::vector<std::string>& a, const std::vector<std::string>& b) {
    double most = 0;
    REQUIRE(a.size() == b.size());
    for (std::size_t i = 0; i < a.size(); ++i) {
        double x[parts], y[parts];
        REQUIRE(read_decimal(a[i], x, parts));
        REQUIRE(read_decimal(b[i], y, parts));
        const double here = std::fabs(difference(x, y, parts));
        REQUIRE(std::isfinite(here));
        most = std::fmax(most, here);
    }
    return most;
}

}  // namespace

TEST_CASE("a run in 50 digits converges with the order of its method far beyond quadruple, and keeps its energy" *
          doctest::test_suite("slow")) {
    if (!has_mpfr()) return;
    const Digits place;
    const auto end_with = [&](const std::string& step) {
        return place.end_of({planet, "--points", "10", "--until", "0.5", "--step", step, "--numbers", "50 digits"});
    };
    const auto coarse = end_with("1/32"), fine = end_with("1/64"), finest = end_with("1/128");
    const double first = apart(coarse, fine), second = apart(fine, finest);
    CHECK(std::log2(first / second) > 17.5);
    CHECK(std::log2(first / second) < 18.5);
    CHECK(second < 1e-33);
    // 12 points: order 22.
    const test::Finished tight = place.lobatto({"run", oscillators, "--points", "12", "--until", "1/4", "--step",
                                                "1/256", "--numbers", "50 digits", "-o", place.file("tight.csv")});
    REQUIRE_MESSAGE(tight.exit_code == 0, tight.err);
    const std::size_t at = tight.out.find("energy error");
    REQUIRE(at != std::string::npos);
    CHECK(std::strtod(tight.out.c_str() + tight.out.find_first_of("0123456789", at), nullptr) < 1e-50);
    const std::size_t defect = tight.out.find("symplectic defect");
    REQUIRE(defect != std::string::npos);
    CHECK(std::strtod(tight.out.c_str() + tight.out.find_first_of("0123456789", defect), nullptr) < 1e-58);
}

TEST_CASE("a run in 50 digits is that in quadruple to all digits of that, and its file reads back" *
          doctest::test_suite("slow")) {
    if (!has_mpfr()) return;
    const Digits place;
    const std::vector<std::string> words{oscillators, "--points", "12", "--until", "2", "--numbers"};
    const auto in = [&](const std::string& numbers) {
        std::vector<std::string> all = words;
        all.push_back(numbers);
        return place.end_of(all);
    };
    const auto fifty = in("50 digits"), quadruple = in("quadruple"), hundred = in("100 digits");
    CHECK(apart(fifty, quadruple) < 1e-32);
    CHECK(apart(fifty, quadruple) > 1e-36);
    CHECK(apart(fifty, hundred) < 1e-60);  // of some 0.3, with 63 digits
    for (const std::string& cell : fifty) {
        double number[parts];
        REQUIRE(read_decimal(cell, number, parts));
        CHECK(decimal_text(number, parts) == cell);
    }
}

TEST_CASE("parameters, nodes and functions are exact to all digits that are asked for") {
    if (!has_mpfr()) return;
    const Digits place;
    // q'' = -q from sqrt(2): q(1) = sqrt(2) cos(1), and a force that holds every kind of function.
    test::write_text(place.folder / "free.toml",
                     "lagrangian = \"x'^2/2 + a*x*(1 - sin(b)^2 - cos(b)^2)\"\n"
                     "[coordinates]\nx = { position = \"sqrt(2)\", velocity = \"exp(1/3)*pi\" }\n"
                     "[parameters]\na = \"1/3\"\nb = 0.1\n"
                     "[method]\npoints = 7\nnumbers = \"140 digits\"\n[run]\nstep = \"1/4\"\nuntil = 1\n");
    const auto end = place.end_of({place.file("free.toml")});
    const cln::float_format_t format = cln::float_format(170);
    const cln::cl_F want =
        cln::sqrt(cln::cl_float(2, format)) + cln::exp(cln::cl_float(cln::cl_RA("1/3"), format)) * cln::pi(format);
    double whole[9];
    REQUIRE(read_decimal(end[1], whole, 9));
    cln::cl_R sum = 0;
    for (const double part : whole) sum = sum + cln::rational(cln::cl_float(part));
    const double error = cln::double_approx(cln::abs(sum - cln::rational(want)));
    CHECK(error < 1e-139);
}

TEST_CASE("a kernel in 30 digits knows all functions, in all forms" * doctest::test_suite("slowest")) {
    if (!has_mpfr()) return;
    const Digits place;
    for (const std::string kinetic : {"", "*(1 + x^2/9)"}) {
        test::write_text(
            place.folder / "all.toml",
            "lagrangian = \"(x'^2 + y'^2)" + kinetic +
                "/2 + atan2(y, 3 + x)*atan2(x, y + 4) + asin(x/4) + acos(y/4) + atan(x) - tanh(y) + "
                "cosh(x/3)^0.3 + sinh(y) - log(5 + x) + exp(x) + sin(x)*cos(y) + tan(y/3) + sqrt(2 + x)\"\n"
                "[coordinates]\nx = { position = 1, velocity = 0.1 }\n"
                "y = { position = 0.5, velocity = 0.2 }\n"
                "[method]\npoints = 5\n[run]\nstep = 0.05\nuntil = 0.25\n[output]\nevents = [\"x = 1.01\"]\n");
        const auto in = [&](const std::string& numbers) {
            return place.end_of({place.file("all.toml"), "--numbers", numbers});
        };
        CHECK(apart(in("30 digits"), in("quadruple")) < 1e-30);
    }
}

TEST_CASE("mechanisms, impacts and splitting methods know many digits, where their coefficients do" *
          doctest::test_suite("slow")) {
    if (!has_mpfr()) return;
    const Digits place;
    test::write_text(place.folder / "rod.toml",
                     "lagrangian = \"(x'^2 + y'^2)/2 - 9.81*y\"\n[coordinates]\n"
                     "x = { position = 0.6, velocity = 0 }\ny = { position = -0.8, velocity = 0 }\n"
                     "[constraints]\nrod = \"x^2 + y^2 = 1\"\n"
                     "[method]\npoints = 6\n[run]\nstep = 0.01\nuntil = 0.1\n");
    const auto rod = place.end_of({place.file("rod.toml"), "--numbers", "80 digits"});
    double x[6], y[6];
    REQUIRE(read_decimal(rod[1], x, 6));
    REQUIRE(read_decimal(rod[2], y, 6));
    cln::cl_R length = -1;
    for (const double* numbers : {x, y}) {
        cln::cl_R sum = 0;
        for (int i = 0; i < 6; ++i) sum = sum + cln::rational(cln::cl_float(numbers[i]));
        length = length + sum * sum;
    }
    CHECK(std::fabs(cln::double_approx(length)) < 1e-78);
    test::write_text(place.folder / "table.csv", "0,0\n1,1\n2,0\n");
    test::write_text(
        place.folder / "table.toml",
        "lagrangian = '''q'^2/2 - table(\"table.csv\", q)'''\n[coordinates]\nq = { position = 1, velocity = 0 }\n"
        "[run]\nstep = 0.1\nuntil = 0.2\n");
    const test::Finished measured =
        place.lobatto({"run", place.file("table.toml"), "--numbers", "50 digits", "-o", place.file("x.csv")});
    CHECK(measured.exit_code == 2);
    CHECK_MESSAGE(
        measured.err.find("measured values have too few digits for numbers in 50 digits; choose \"47 digits\" "
                          "at most") != std::string::npos,
        measured.err);
    const test::Finished splitting =
        place.lobatto({"run", oscillators, "--splitting", "35", "--numbers", "50 digits", "-o", place.file("x.csv")});
    CHECK(splitting.exit_code == 2);
    CHECK(splitting.err.find("too few for numbers in 50 digits") != std::string::npos);
}

TEST_CASE("numbers that MPFR computes are made, rounded and compared as those of the machine") {
    if (!has_mpfr()) return;
    const test::TemporaryFolder folder;
    test::write_text(folder / "numbers.cpp", R"(
#define LOBATTO_USE_MPFR
#include "kernel.hpp"
using real = lobatto::ManyDigits<212>;
static_assert(static_cast<double>(lobatto::Limits<real>::epsilon) == 0x1p-211);
static_assert(static_cast<double>(real(64) * lobatto::Limits<real>::epsilon) == 0x1p-205);
static constexpr real literal[] = {-real::of(1, 0xc000000000000000u), 0.5};
// What is no power of two is no constant, but computed when the program starts.
struct Products {
    real value[2]{};
    constexpr Products() {
        for (int i = 0; i < 2; ++i) value[i] = literal[i] * literal[0] / real(3);
    }
};
inline const Products products{};
int wrong = 0;
void check(bool holds, int line) {
    if (!holds) __builtin_printf("line %d\n", line), ++wrong;
}
#define CHECK(...) check(__VA_ARGS__, __LINE__)
int main() {
    for (const double x : {0.0, 1.0, -0.1, 1e-300, -1.7e308, 3e22, 0x1p-1074})
        CHECK(static_cast<double>(real(x)) == x);
    CHECK(static_cast<long long>(real(123456789012345678LL)) == 123456789012345678LL);
    CHECK(literal[0] == real(-1.5) && literal[1] + literal[1] == real(1));
    CHECK(products.value[0] == 0.75 && products.value[1] == -0.25);
    CHECK(real(2) < real(3) && !(real(3) < real(2)) && real(-1) <= 0.0 && real(1) != 2.0);
    CHECK(lobatto::fabs(real(-2)) == 2.0 && -real(0) == 0.0);
    const real infinite = real(1) / real(0), none = infinite - infinite;
    CHECK(!lobatto::is_finite(infinite) && !lobatto::is_finite(none) && !(none == none) && !(none < none));
    CHECK(static_cast<double>(-infinite) == -__builtin_inf());
    const real third = real(1) / real(3);
    CHECK(lobatto::fused(third, real(3), real(-1)) == third * 3.0 - 1.0);
    CHECK(lobatto::sqrt(real(2)) * lobatto::sqrt(real(2)) - 2.0 < lobatto::Limits<real>::epsilon * 4.0);
    CHECK(lobatto::fabs(lobatto::sin(lobatto::asin(third)) - third) < lobatto::Limits<real>::epsilon);
    CHECK(lobatto::fabs(lobatto::exp(lobatto::log(real(7))) - 7.0) < lobatto::Limits<real>::epsilon * 32.0);
    CHECK(lobatto::fabs(lobatto::pow(real(2), real(0.5)) - lobatto::sqrt(real(2))) < lobatto::Limits<real>::epsilon);
    real copy;
    __builtin_memcpy(&copy, &third, sizeof copy);
    CHECK(copy == third);
    return wrong;
}
)");
    const auto done =
        test::built_and_run(folder, "numbers", {"-O1", "-Wall", "-Wextra", "-Werror", "-Wl,--no-as-needed", "-lmpfr"});
    REQUIRE(done);
    CHECK_MESSAGE(done->exit_code == 0, done->out);
}

TEST_CASE("a header that carries its support computes in 50 digits") {
    if (!has_mpfr()) return;
    const test::TemporaryFolder folder;
    const test::Finished emitted = test::run({LOBATTO_PROGRAM, "emit", planet, "--points", "10", "--standalone",
                                              "--numbers", "50 digits", "-o", folder.string()});
    REQUIRE_MESSAGE(emitted.exit_code == 0, emitted.err);
    CHECK(emitted.out.find("-lmpfr") != std::string::npos);
    test::write_text(folder / "program.cpp",
                     "#include \"kepler.hpp\"\n#include <cstdio>\n"
                     "using Kernel = lobatto::kernels::kepler;\n"
                     "int main() {\n"
                     "    lobatto::Stepper<Kernel> stepper;\n"
                     "    const Kernel::real q[] = {0.5, 0.0}, p[] = {0.0, 1.5};\n"
                     "    Kernel::real before, after, now[2];\n"
                     "    stepper.prepare({}, Kernel::real(1) / 128);\n"
                     "    stepper.energy(0, q, p, &before);\n"
                     "    if (stepper.start(0, q, p) != lobatto::Status::ok) return 1;\n"
                     "    for (int i = 0; i < 8; ++i)\n"
                     "        if (stepper.step() != lobatto::Status::ok) return 2;\n"
                     "    stepper.momentum(now);\n"
                     "    stepper.energy(0, stepper.q, now, &after);\n"
                     "    std::printf(\"%.3e\\n\", static_cast<double>(after - before));\n"
                     "}\n");
    const auto done =
        test::built_and_run(folder, "program", {"-O1", "-I", folder.string(), "-Wl,--no-as-needed", "-lmpfr"});
    REQUIRE(done);
    CHECK(done->exit_code == 0);
    CHECK(std::fabs(std::strtod(done->out.c_str(), nullptr)) < 1e-34);
    CHECK(std::strtod(done->out.c_str(), nullptr) != 0);
}

TEST_CASE("where MPFR is missing the message names the package, and what there is instead") {
    const Digits place;
    test::write_text(
        place.folder / "bare",
        "#!/bin/sh\necho \"kernel.cpp:9:10: fatal error: mpfr.h: No such file or directory\" >&2\nexit 1\n");
    std::filesystem::permissions(place.folder / "bare", std::filesystem::perms::owner_all);
    const test::EnvironmentVariable compiler("CXX", place.file("bare"));
    const test::Finished done =
        place.lobatto({"run", oscillators, "--numbers", "50 digits", "-o", place.file("run.csv")});
    CHECK(done.exit_code == 4);
    CHECK(done.err.find("numbers = \"50 digits\" needs MPFR, and " + place.file("bare") +
                        " does not find its header mpfr.h; install Debian's package libmpfr-dev (apt-get install "
                        "libmpfr-dev), or choose \"double-double\" or \"quadruple\"") != std::string::npos);
}

TEST_CASE("what many digits cannot do is refused") {
    const Digits place;
    const auto refusal = [&](std::vector<std::string> words) {
        words.insert(words.end(), {"-o", place.file("run.csv")});
        const test::Finished done = place.lobatto(words);
        CHECK(done.exit_code == 2);
        return done.err;
    };
    for (const std::string numbers : {"19 digits", "141 digits", "digits", "50"})
        CHECK(refusal({"run", oscillators, "--numbers", numbers})
                  .find("\"quadruple\" and \"20 digits\" to \"140 digits\"") != std::string::npos);
    CHECK(refusal({"run", oscillators, "--numbers", "50 digits", "--arithmetic", "clean"})
              .find("clean arithmetic is for numbers of one machine word") != std::string::npos);
    CHECK(refusal({"emit", oscillators, "--numbers", "50 digits", "--plain"}).find("knows no numbers in 50 digits") !=
          std::string::npos);
}

TEST_CASE("powers of numbers and angles of numbers have as many digits") {
    if (!has_mpfr()) return;
    const Digits place;
    const auto end = [&](const std::string& term, const std::string& numbers) {
        test::write_text(place.file("scene.toml"),
                         fmt::format("lagrangian = \"x'^2/2 - x^2/2 - 0.1*{}\"\n[coordinates]\n"
                                     "x = {{ position = 1, velocity = 0 }}\n[method]\n"
                                     "points = 8\n[run]\nstep = 0.1\nuntil = 1\n",
                                     term));
        return std::stod(place.end_of({place.file("scene.toml"), "--numbers", numbers})[1]);
    };
    for (const char* term : {"2^x", "atan2(x, 2)", "atan2(2, x)"}) {
        CAPTURE(term);
        CHECK(std::fabs(end(term, "25 digits") - end(term, "double")) < 1e-13);
    }
}
