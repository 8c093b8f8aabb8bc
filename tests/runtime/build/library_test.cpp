// SPDX-License-Identifier: GPL-2.0-or-later
// Loaded kernels: what is accepted, what is refused and with which words, and that the wrapper passes everything
// through.
#include <doctest/doctest.h>

#include <cmath>

#include "runtime/build/library.hpp"
#include "runtime/error.hpp"
#include "tests/support.hpp"

using namespace lobatto;
using namespace lobatto::test;

namespace {

// Compiled in a cache of its own; the headers are found in the source tree.
struct KernelBuilder {
    TemporaryFolder folder;
    EnvironmentVariable cache{"LOBATTO_CACHE_DIR", folder.string()};
    EnvironmentVariable headers{"CPATH", LOBATTO_SOURCE_DIR};

    std::string build(const std::string& name, const std::string& text) const { return compile({name, text}).object; }
    std::string build_pendulum() const {
        return build("pendulum",
                     "#include \"tests/handwritten/pendulum.hpp\"\n#include \"runtime/kernel/export/export.hpp\"\n"
                     "LOBATTO_EXPORT_KERNEL(lobatto::HandwrittenPendulum)\n");
    }
    std::string build_double_pendulum(const std::string& number) const {
        const bool quadruple = number == "__float128";
        return compile({"double_pendulum",
                        std::string(quadruple ? "#define LOBATTO_USE_FLOAT128\n" : "") +
                            "#include \"tests/handwritten/double_pendulum.hpp\"\n"
                            "#include \"runtime/kernel/export/export.hpp\"\n"
                            "using K = lobatto::HandwrittenDoublePendulum<" +
                            number + ", lobatto::LobattoFour<" + number + ">>;\nLOBATTO_EXPORT_KERNEL(K)\n",
                        quadruple})
            .object;
    }
    // A table with these first two members and nothing behind them.
    std::string build_stub(const std::string& version, const std::string& bytes) const {
        return build(
            "stub",
            "#include \"runtime/kernel/abi.h\"\n"
            "extern \"C\" __attribute__((visibility(\"default\"))) const lobatto_kernel* lobatto_kernel_table() {\n"
            "    static const lobatto_kernel table = {" +
                version + ", " + bytes + "};\n    return &table;\n}\n");
    }
};

const std::string digest = "0123456789abcdef";

std::string refusal(const std::string& object, const std::string& expected_digest = digest) {
    const std::string message = message_of<MachineError>([&] { Kernel::load(object, expected_digest); });
    const std::string begin = "cannot use the compiled kernel " + object + ": ";
    const std::string end = "; delete this file, and it is compiled again";
    REQUIRE(message.starts_with(begin));
    REQUIRE(message.ends_with(end));
    return message.substr(begin.size(), message.size() - begin.size() - end.size());
}

LoadedStepper<double> pendulum_stepper(const KernelBuilder& kernel_builder, double h) {
    LoadedStepper<double> stepper(Kernel::load(kernel_builder.build_pendulum(), digest));
    REQUIRE(stepper.prepare({2.0, 3.0}, h) == LOBATTO_OK);
    return stepper;
}

}  // namespace

TEST_CASE("a loaded kernel says what it is") {
    const KernelBuilder kernel_builder;
    const Kernel kernel = Kernel::load(kernel_builder.build_pendulum(), digest);
    CHECK(std::string(kernel->name) == "handwritten_pendulum");
    CHECK(kernel->real_kind == LOBATTO_DOUBLE);
    CHECK(kernel->real_bytes == 8);
    CHECK(kernel->coordinates == 1);
    CHECK(kernel->parameters == 2);
    CHECK(kernel->nodes == 4);
    CHECK(kernel->order == 6);
    CHECK(kernel->unknowns == 2);
    CHECK(kernel->linear == 0);
    CHECK(std::string(kernel->method) == "Lobatto, 4 points");
    CHECK(kernel->form == LOBATTO_SEPARABLE);
    CHECK(kernel->autonomous == 1);
    CHECK(kernel->has_dense == 1);
    CHECK(kernel->events == 0);
}

TEST_CASE("a file that is not a kernel, or not the expected one, is refused with the reason") {
    const KernelBuilder kernel_builder;
    const std::string missing = (kernel_builder.folder / "missing.so").string();
    CHECK(refusal(missing) == missing + ": cannot open shared object file: No such file or directory");
    const std::string text = (kernel_builder.folder / "text.so").string();
    write_text(
        text, "not an object, but long enough to be read as the header of one, had it begun with the right four bytes");
    CHECK(refusal(text) == text + ": invalid ELF header");
    CHECK(refusal(kernel_builder.build("library", "int nothing;\n")) ==
          "it has no function lobatto_kernel_table, so it is not such a kernel");
    CHECK(refusal(kernel_builder.build_stub("3", "sizeof(lobatto_kernel)")) ==
          "it speaks version 3 of the kernel interface, this program version 14");
    CHECK(refusal(kernel_builder.build_stub("LOBATTO_ABI_VERSION", "8")) ==
          "its function table has 8 bytes instead of " + std::to_string(sizeof(lobatto_kernel)));
    CHECK(refusal(kernel_builder.build_pendulum(), "fedcba9876543210") ==
          "its formulas have the digest 0123456789abcdef instead of fedcba9876543210");
}

TEST_CASE("a kernel computes in its own number type only") {
    const KernelBuilder kernel_builder;
    const Kernel kernel = Kernel::load(kernel_builder.build_pendulum(), digest);
    const auto message = [&](auto zero) {
        return message_of<MachineError>([&] { LoadedStepper<decltype(zero)>{kernel}; });
    };
    const std::string begin = "the kernel handwritten_pendulum computes in double, but was asked to compute in ";
    CHECK(message(0.0F) == begin + "float");
    CHECK(message(0.0L) == begin + "long double");
    CHECK(message(__float128(0)) == begin + "__float128");
    CHECK(message(0.0) == "");
}

TEST_CASE("the wrapper passes every function of the kernel through") {
    const KernelBuilder kernel_builder;
    const double m = 2, omega2 = 9, h = 0.1, q = 0.7, p = 0.4, xi = 0.5 - std::sqrt(0.05);
    LoadedStepper<double> stepper = pendulum_stepper(kernel_builder, h);
    double energy = 0;
    REQUIRE(stepper.energy(0, {q}, {p}, energy) == LOBATTO_OK);
    CHECK(energy == doctest::Approx(p * p / (2 * m) + m * omega2 * (1 - std::cos(q))).epsilon(1e-15));
    CHECK(stepper.momentum(0, {q}, {0.25}) == std::vector<double>{0.5});
    std::vector<double> velocity, Lv, Lq, F, J;
    REQUIRE(stepper.velocity(0, {q}, {0.5}, velocity) == LOBATTO_OK);
    CHECK(velocity == std::vector<double>{0.25});
    stepper.slopes(0, {q}, {0.25}, Lv, Lq);
    CHECK(Lv == std::vector<double>{0.5});
    CHECK(Lq.at(0) == doctest::Approx(-m * omega2 * std::sin(q)).epsilon(1e-15));
    // With both nodes at 0 the accelerations vanish: F = -base = -(q + h c_i v), J = 1 + h^2 omega^2 A.
    const double v = p / m - h / 12 * omega2 * std::sin(q);
    REQUIRE(stepper.residual(0, {q}, {p}, {0, 0}, F) == LOBATTO_OK);
    CHECK(F.at(0) == doctest::Approx(-(q + h * xi * v)).epsilon(1e-15));
    CHECK(F.at(1) == doctest::Approx(-(q + h * (1 - xi) * v)).epsilon(1e-15));
    REQUIRE(stepper.jacobian(0, {q}, {p}, {0, 0}, J) == LOBATTO_OK);
    REQUIRE(J.size() == 4);
    const double z = h * h * omega2;
    CHECK(J[0] == doctest::Approx(1 + z / 60).epsilon(1e-15));
    CHECK(J[1] == doctest::Approx(z * (11 - 5 * std::sqrt(5.0)) / 120).epsilon(1e-13));
    CHECK(J[2] == doctest::Approx(z * (11 + 5 * std::sqrt(5.0)) / 120).epsilon(1e-15));
    CHECK(J[3] == doctest::Approx(1 + z / 60).epsilon(1e-15));
}

TEST_CASE("advance records every k-th state, stops when the room is full, and state agrees with the last record") {
    const KernelBuilder kernel_builder;
    LoadedStepper<double> stepper = pendulum_stepper(kernel_builder, 0.125);
    REQUIRE(stepper.start(1.0, {0.7}, {0.4}) == LOBATTO_OK);
    std::vector<double> records(3 * 4);
    lobatto_advance call{};
    call.steps = 100;
    call.record_every = 5;
    call.records = records.data();
    call.capacity = 4;
    REQUIRE(stepper.advance(call) == LOBATTO_OK);
    CHECK(call.records_written == 4);
    CHECK(call.steps_done == 24);  // the step that would write a fifth row is not taken
    CHECK(records[0] == 1.0 + 5 * 0.125);
    CHECK(records[9] == 1.0 + 20 * 0.125);
    call.capacity = 1;
    call.steps = 1;
    REQUIRE(stepper.advance(call) == LOBATTO_OK);
    double time = 0;
    std::vector<double> q, p;
    stepper.state(time, q, p);
    CHECK(std::vector<double>{time, q.at(0), p.at(0)} == std::vector<double>(records.begin(), records.begin() + 3));
    CHECK(time == 1.0 + 25 * 0.125);
}

TEST_CASE("a copied stepper goes its own way, and the way of the original") {
    const KernelBuilder kernel_builder;
    LoadedStepper<double> original = pendulum_stepper(kernel_builder, 0.1);
    REQUIRE(original.start(0.0, {2.0}, {0.0}) == LOBATTO_OK);
    lobatto_advance call{};
    call.steps = 10;
    original.advance(call);
    LoadedStepper<double> copy = original;
    const auto position = [](const LoadedStepper<double>& stepper) {
        double time = 0;
        std::vector<double> q, p;
        stepper.state(time, q, p);
        return q.at(0);
    };
    const double before = position(original);
    copy.advance(call);
    CHECK(position(original) == before);
    CHECK(position(copy) != before);
    original.advance(call);
    CHECK(position(original) == position(copy));
    copy.advance(call);
    original = copy;
    CHECK(position(original) == position(copy));
}

TEST_CASE("a kernel stays loaded as long as a stepper uses it") {
    const KernelBuilder kernel_builder;
    auto stepper = std::make_unique<LoadedStepper<double>>(Kernel::load(kernel_builder.build_pendulum(), digest));
    LoadedStepper<double> moved = std::move(*stepper);
    stepper.reset();
    REQUIRE(moved.prepare({1.0, 1.0}, 0.1) == LOBATTO_OK);
    CHECK(moved.start(0.0, {0.5}, {0.0}) == LOBATTO_OK);
}

TEST_CASE("the tangent map of the pendulum's step agrees with differences, and is symplectic") {
    const KernelBuilder kernel_builder;
    const LoadedStepper<double> stepper = pendulum_stepper(kernel_builder, 0.2);
    const double q = 1.3, p = -0.8, d = 1e-5;
    std::vector<double> q1, p1, T, q_plus, p_plus, q_minus, p_minus, unused;
    REQUIRE(stepper.tangent(0, {q}, {p}, q1, p1, T) == LOBATTO_OK);
    CHECK(T[0] * T[3] - T[1] * T[2] == doctest::Approx(1.0).epsilon(1e-14));
    // Central differences err by d^2/6 of the third derivative: 6e-10 measured at most.
    stepper.tangent(0, {q + d}, {p}, q_plus, p_plus, unused);
    stepper.tangent(0, {q - d}, {p}, q_minus, p_minus, unused);
    CHECK(T[0] == doctest::Approx((q_plus[0] - q_minus[0]) / (2 * d)).epsilon(1e-8));
    CHECK(T[2] == doctest::Approx((p_plus[0] - p_minus[0]) / (2 * d)).epsilon(1e-8));
    stepper.tangent(0, {q}, {p + d}, q_plus, p_plus, unused);
    stepper.tangent(0, {q}, {p - d}, q_minus, p_minus, unused);
    CHECK(T[1] == doctest::Approx((q_plus[0] - q_minus[0]) / (2 * d)).epsilon(1e-8));
    CHECK(T[3] == doctest::Approx((p_plus[0] - p_minus[0]) / (2 * d)).epsilon(1e-8));
}

TEST_CASE("a kernel of the general form says what it is, and computes in every number type") {
    const KernelBuilder kernel_builder;
    const auto check = [&]<class real>(const std::string& number, real rounding) {
        INFO(number);
        const Kernel kernel = Kernel::load(kernel_builder.build_double_pendulum(number), digest);
        CHECK(kernel->form == LOBATTO_GENERAL);
        CHECK(kernel->nodes == 4);
        CHECK(kernel->unknowns == 6);
        CHECK(kernel->events == 2);
        CHECK(kernel->events_of_step >= 8);
        LoadedStepper<real> stepper(kernel);
        REQUIRE(stepper.prepare({}, real(1) / 16) == LOBATTO_OK);
        const std::vector<real> q = {1, 2}, p = {real(1) / 4, real(1) / 8};
        REQUIRE(stepper.start(0, q, p) == LOBATTO_OK);
        std::vector<real> v, q1, p1, T, q_end, p_end;
        REQUIRE(stepper.velocity(0, q, p, v) == LOBATTO_OK);
        const std::vector<real> back = stepper.momentum(0, q, v);
        for (int k = 0; k < 2; ++k) CHECK((back[k] - p[k]) * (back[k] - p[k]) <= 16 * rounding * rounding);
        // The step from the start is that of the tangent map, whose determinant of one is at rounding.
        REQUIRE(stepper.tangent(0, q, p, q1, p1, T) == LOBATTO_OK);
        lobatto_advance call{};
        call.steps = 1;
        REQUIRE(stepper.advance(call) == LOBATTO_OK);
        real time = 0;
        stepper.state(time, q_end, p_end);
        CHECK((q_end == q1 && p_end == p1));
        const real symplectic = T[0] * T[10] + T[4] * T[14] - T[8] * T[2] - T[12] * T[6] - 1;
        CHECK(symplectic * symplectic <= 400 * rounding * rounding);
        // Newton's iteration on the same equations: they hold to rounding, whatever the number type.
        std::vector<real> X(6), F, J;
        const real thirds[3] = {(1 - 1 / real(2.2360679774997896964L)) / 2, (1 + 1 / real(2.2360679774997896964L)) / 2,
                                1};
        std::vector<real> inside, ignored;
        for (int j = 0; j < 3; ++j) {
            REQUIRE(stepper.dense(thirds[j], inside, ignored) == LOBATTO_OK);
            for (int a = 0; a < 2; ++a) X[2 * j + a] = inside[a];
        }
        REQUIRE(stepper.residual(0, q, p, X, F) == LOBATTO_OK);
        REQUIRE(stepper.jacobian(0, q, p, X, J) == LOBATTO_OK);
        const real coarse = rounding > real(1e-20L) ? 1000 * rounding : real(1e-15L);  // sqrt(5) has 20 digits here
        for (const real f : F) CHECK(f * f <= coarse * coarse);
        CHECK(J.size() == 36);
    };
    check("float", 0x1p-23F);
    check("double", 0x1p-52);
    check("long double", 0x1p-63L);
    check("__float128", __float128(1) / (__float128(1ull << 56) * __float128(1ull << 56)));
}
