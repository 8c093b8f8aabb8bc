// SPDX-License-Identifier: GPL-2.0-or-later
// The kernels in generated/: byte for byte what `lobatto emit` writes, accepted by both compilers, and right.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "generated/harmonic_oscillator.hpp"
#include "generated/pendulum.hpp"
#include "tests/handwritten/pendulum.hpp"
#include "tests/support.hpp"

using namespace lobatto;

namespace {

const std::string tree = LOBATTO_SOURCE_DIR;
const std::vector<std::string> scenes = {"pendulum", "harmonic_oscillator"};

test::Finished emit_scene(const std::string& scene, const std::string& folder, std::vector<std::string> options) {
    std::vector<std::string> arguments = {LOBATTO_PROGRAM, "emit", tree + "/scenes/" + scene + ".toml", "-o", folder};
    arguments.insert(arguments.end(), options.begin(), options.end());
    return test::run(arguments);
}

std::string unit_of(const std::string& scene) {
    return fmt::format("#include \"{0}.hpp\"\ntemplate struct lobatto::Stepper<lobatto::kernels::{0}>;\n", scene);
}

double relative(double x, double y) {
    return std::fabs(x - y) / std::max({std::fabs(x), std::fabs(y), 1e-300});
}

}  // namespace

TEST_CASE("three fresh processes emit the bytes of generated/") {
    for (const std::string& scene : scenes) {
        const std::string golden = test::read_file(tree + "/generated/" + scene + ".hpp");
        for (int process = 0; process < 3; ++process) {
            const test::TemporaryFolder folder;
            const test::Finished emitted = emit_scene(scene, folder.string(), {"--no-support"});
            INFO(emitted.err);
            REQUIRE(emitted.exit_code == 0);
            CHECK(test::read_file(folder / (scene + ".hpp")) == golden);
            CHECK_FALSE(std::filesystem::exists(folder / "kernel.hpp"));
        }
    }
}

TEST_CASE("g++ and clang++ take the kernels of generated/ without a warning" * doctest::test_suite("slow")) {
    for (const std::string compiler : {"g++", "clang++"}) {
        // A missing clang++ fails here: `./lobatto test` installs it.
        INFO(compiler);
        REQUIRE(test::run({compiler, "--version"}).exit_code == 0);
        for (const std::string& scene : scenes) {
            const test::TemporaryFolder folder;
            test::write_text(folder / "unit.cpp", unit_of(scene));
            const test::Finished compiled = test::run(
                {compiler, "-std=c++17", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-I", tree + "/generated", "-I",
                 tree + "/runtime/kernel", "-c", folder / "unit.cpp", "-o", folder / "unit.o"});
            INFO(compiled.err);
            CHECK(compiled.exit_code == 0);
        }
    }
}

TEST_CASE("a standalone pendulum carries what it stands on, at most 3000 lines, and nothing of other forms") {
    const test::TemporaryFolder folder;
    REQUIRE(emit_scene("pendulum", folder.string(), {"--standalone"}).exit_code == 0);
    const std::string text = test::read_file(folder / "pendulum.hpp");
    CHECK(std::count(text.begin(), text.end(), '\n') <= 3000);
    for (const char* other :
         {"Composition", "GalerkinFixedPoint", "CleanFixedPoint", "NeighbourFixedPoint", "struct Ensemble"}) {
        INFO(other);
        CHECK(text.find(other) == std::string::npos);
    }
}

TEST_CASE("an emitted kernel with walls, switches and events takes the steps of the run, with all that they meet") {
    struct Case {
        std::string scene, start;
        int steps;
        double h;
    };
    for (const Case& tried :
         {Case{"bouncing_ball", "{1}, p[] = {0}", 150, 0.02}, Case{"rubbing", "{1.5}, p[] = {0}", 60, 0.05}}) {
        CAPTURE(tried.scene);
        const test::TemporaryFolder folder;
        std::string file = tree + "/scenes/" + tried.scene + ".toml";
        if (tried.scene == "rubbing") {  // dry friction: a switch where the velocity is 0
            file = folder / "rubbing.toml";
            test::write_text(file,
                             "lagrangian = \"x'^2/2 - x^2/2\"\n[coordinates]\nx = { position = 1.5, velocity = 0 }\n"
                             "[forces]\nx = \"-0.05*sign(x')\"\n[output]\nevents = [\"x = 0\"]\n"
                             "[method]\npoints = 3\n[run]\nstep = 0.05\nuntil = 3\n");
        }
        const test::Finished emitted =
            test::run({LOBATTO_PROGRAM, "emit", file, "--standalone", "-o", folder.string()});
        REQUIRE_MESSAGE(emitted.exit_code == 0, emitted.err);
        CHECK(emitted.out.find("lobatto::HybridStepper<lobatto::kernels::" + tried.scene) != std::string::npos);
        test::write_text(folder / "program.cpp",
                         fmt::format("#include \"{}.hpp\"\n#include <cstdio>\n"
                                     "int main() {{\n"
                                     "    lobatto::HybridStepper<lobatto::kernels::{}> stepper;\n"
                                     "    const double q[] = {};\n"
                                     "    if (stepper.prepare({{}}, {}) != lobatto::Status::ok) return 1;\n"
                                     "    if (stepper.step() != lobatto::Status::unsupported) return 4;\n"  // no start
                                     "    if (stepper.start(0, q, p) != lobatto::Status::ok) return 2;\n"
                                     "    long met = 0;\n"
                                     "    for (int i = 0; i < {}; ++i) {{\n"
                                     "        if (stepper.step() != lobatto::Status::ok) return 3;\n"
                                     "        met += stepper.events();\n"
                                     "    }}\n"
                                     "    double momentum;\n"
                                     "    stepper.momentum(&momentum);\n"
                                     "    std::printf(\"%.17g %.17g %ld\\n\", stepper.q()[0], momentum, met);\n"
                                     // Backwards it would fall through walls.
                                     "    if (stepper.prepare({{}}, -0.01) != lobatto::Status::ok) return 5;\n"
                                     "    if (stepper.start(0, q, p) != lobatto::Status::unsupported) return 6;\n"
                                     "    if (stepper.step() != lobatto::Status::unsupported) return 7;\n"
                                     "}}\n",
                                     tried.scene, tried.scene, tried.start, tried.h, tried.steps));
        const test::Finished compiled =
            test::run({"g++", "-std=c++17", "-O2", "-march=native", "-ffp-contract=off", "-Wall", "-Wextra",
                       "-Wpedantic", "-Werror", "-o", folder / "program", folder / "program.cpp"});
        REQUIRE_MESSAGE(compiled.exit_code == 0, compiled.err);
        // Options with which it would compute something else.
        for (const char* option :
             {"-ffast-math", "-Ofast", "-fassociative-math -fno-signed-zeros -fno-trapping-math"}) {
            const test::Finished refused = test::run(
                {"sh", "-c",
                 fmt::format("g++ -std=c++17 -O2 {} -fsyntax-only '{}'", option, std::string(folder / "program.cpp"))});
            CHECK(refused.exit_code != 0);
            CHECK_MESSAGE(refused.err.find("-ffast-math give wrong motions") != std::string::npos, option);
        }
        const test::Finished ran = test::run({folder / "program"});
        REQUIRE(ran.exit_code == 0);
        const test::Finished whole =
            test::run({LOBATTO_PROGRAM, "run", file, "--until", fmt::format("{}", tried.steps * tried.h), "-o",
                       folder / "run.csv", "--json", "--unmeasured"});
        const std::string rows = test::read_file(folder / "run.csv"),
                          events = test::read_file(folder / "run.events.csv");
        const std::string last = rows.substr(rows.rfind('\n', rows.size() - 2) + 1);
        double t = 0, x = 0, p = 0, emitted_x = 0, emitted_p = 0;
        long met = 0;
        REQUIRE(std::sscanf(last.c_str(), "%lf,%lf,%lf", &t, &x, &p) == 3);
        REQUIRE(std::sscanf(ran.out.c_str(), "%lf %lf %ld", &emitted_x, &emitted_p, &met) == 3);
        CHECK(emitted_x == x);
        CHECK(emitted_p == p);
        const long lines = std::count(events.begin(), events.end(), '\n'),
                   comments = std::count(events.begin(), events.end(), '#');
        CHECK(met == lines - comments - 1);
        CHECK(met > 0);
    }
}

TEST_CASE("standalone kernels of every precision compile with nothing else, run, and agree" *
          doctest::test_suite("slow")) {
    // q after ten steps of 0.05 from q = 1, p = 0: what each precision may differ by, in its own epsilon, is below
    // 2e-6.
    struct Case {
        const char *name, *standard;
    };
    for (const std::string& scene : scenes) {
        std::vector<double> ends;
        for (const Case& precision : {Case{"float", "c++17"}, Case{"double", "c++17"}, Case{"long double", "c++17"},
                                      Case{"double-double", "c++17"}, Case{"quadruple", "gnu++17"}}) {
            INFO(scene << " " << precision.name);
            const test::TemporaryFolder folder;
            const test::Finished emitted =
                emit_scene(scene, folder.string(), {"--standalone", "--numbers", precision.name});
            INFO(emitted.err);
            REQUIRE(emitted.exit_code == 0);
            test::write_text(
                folder / "program.cpp",
                unit_of(scene) +
                    fmt::format("#include <cstdio>\n"
                                "int main() {{\n"
                                "    using K = lobatto::kernels::{};\n"
                                "    lobatto::Stepper<K> stepper;\n"
                                "    const K::real q = 1, p = 0;\n"
                                "    if (stepper.prepare({{}}, K::real(1) / 20) != lobatto::Status::ok) return 1;\n"
                                "    if (stepper.start(0, &q, &p) != lobatto::Status::ok) return 2;\n"
                                "    for (int i = 0; i < 10; ++i)\n"
                                "        if (stepper.step() != lobatto::Status::ok) return 3;\n"
                                "    std::printf(\"%.17g\\n\", double(stepper.q[0]));\n"
                                "}}\n",
                                scene));
            const bool quadruple = std::string(precision.name) == "quadruple";
            std::vector<std::string> command = {"g++",
                                                std::string("-std=") + precision.standard,
                                                "-Wall",
                                                "-Wextra",
                                                "-Werror",
                                                "-o",
                                                folder / "program",
                                                folder / "program.cpp"};
            // The literals of __float128 are an extension, which -Wpedantic exists to refuse.
            command.push_back(quadruple ? "-lquadmath" : "-Wpedantic");
            const test::Finished compiled = test::run(command);
            INFO(compiled.err);
            REQUIRE(compiled.exit_code == 0);
            const test::Finished ran = test::run({folder / "program"});
            REQUIRE(ran.exit_code == 0);
            ends.push_back(std::stod(ran.out));
        }
        CHECK(std::fabs(ends[1]) > 0.5);
        CHECK(std::fabs(ends[0] - ends[1]) < 2e-6);   // measured: 1.7e-7 and 1.8e-7
        CHECK(ends[0] != ends[1]);                    // float is float
        CHECK(std::fabs(ends[1] - ends[2]) < 1e-14);  // measured: 1.1e-16 and 0
        CHECK(std::fabs(ends[2] - ends[3]) < 3e-16);  // both rounded to double
    }
}

TEST_CASE("kernels in double-double stand before others in one file, and keep their digits there") {
    const test::TemporaryFolder folder;
    const std::string scene = test::read_file(tree + "/scenes/henon_heiles.toml");
    for (const auto& [name, numbers] :
         {std::pair{"first", "double-double"}, {"second", "double"}, {"third", "quadruple"}}) {
        test::write_text(folder / (std::string(name) + ".toml"), scene);
        const test::Finished emitted = test::run({LOBATTO_PROGRAM, "emit", folder / (std::string(name) + ".toml"), "-o",
                                                  folder.string(), "--standalone", "--numbers", numbers});
        INFO(emitted.err);
        REQUIRE(emitted.exit_code == 0);
    }
    const std::string main_text =
        "#include <cstdio>\n"
        "template <class K>\ntypename K::real end() {\n"
        "    using R = typename K::real;\n"
        "    lobatto::Stepper<K> stepper;\n"
        "    const R q[2] = {R(1) / R(10), R(1) / R(3)}, p[2] = {R(3) / R(10), R(1) / R(10)};\n"
        "    stepper.prepare({}, R(1) / R(10));\n"
        "    stepper.start(R(0), q, p);\n"
        "    for (int i = 0; i < 300; ++i) stepper.step();\n"
        "    return stepper.q[0];\n}\n"
        "int main() {\n"
        "    const auto a = end<lobatto::kernels::first>();\n"
        "    const auto b = end<lobatto::kernels::third>();\n"
        "    std::printf(\"%.3g %.3g\\n\", double(__float128(a.high) - b + __float128(a.low)),\n"
        "                double(end<lobatto::kernels::second>() - b));\n}\n";
    const auto compiled = [&](const std::vector<std::string>& order) {
        std::string text = "#define LOBATTO_USE_FLOAT128\n";
        for (const std::string& name : order) text += "#include \"" + name + ".hpp\"\n";
        test::write_text(folder / "program.cpp", text + main_text);
        return test::run(
            {"g++", "-std=gnu++17", "-O2", "-o", folder / "program", folder / "program.cpp", "-lquadmath"});
    };
    const test::Finished good = compiled({"first", "second", "third"});
    INFO(good.err);
    REQUIRE(good.exit_code == 0);
    std::istringstream errors(test::run({folder / "program"}).out);
    double of_double_double = 1, of_double = 0;
    errors >> of_double_double >> of_double;
    CHECK(std::fabs(of_double_double) < 1e-28);
    CHECK(std::fabs(of_double) > 1e-18);
    const test::Finished refused = compiled({"second", "first", "third"});
    CHECK(refused.exit_code != 0);
    CHECK(test::contains(refused.err, "include this kernel before those in other numbers"));
}

TEST_CASE("the emitted pendulum follows the hand-written one over 1000 steps to round-off") {
    using Emitted = kernels::pendulum;
    Stepper<Emitted> emitted;
    Stepper<HandwrittenPendulum> written;
    const double m = 1.3, omega = 2.1, h = 0.1, q = 2.0, p = 0.4;
    Emitted::Parameters parameters;
    parameters.m = m;
    parameters.omega = omega;
    REQUIRE(emitted.prepare(parameters, h) == Status::ok);
    REQUIRE(written.prepare({m, omega}, h) == Status::ok);
    REQUIRE(emitted.start(0, &q, &p) == Status::ok);
    REQUIRE(written.start(0, &q, &p) == Status::ok);
    double worst = 0, travelled = 0;
    for (int step = 0; step < 1000; ++step) {
        const double before = emitted.q[0];
        REQUIRE(emitted.step() == Status::ok);
        REQUIRE(written.step() == Status::ok);
        worst = std::max({worst, std::fabs(emitted.q[0] - written.q[0]), std::fabs(emitted.u[0] - written.u[0])});
        travelled += std::fabs(emitted.q[0] - before);
    }
    CHECK(travelled > 100);
    CHECK(worst < 2e-12);  // measured 1.4e-13
}

TEST_CASE("the formulas of the emitted pendulum equal the hand-written ones") {
    using K = kernels::pendulum;
    using H = HandwrittenPendulum;
    const double h = 0.17;
    K::Parameters parameters;
    parameters.m = 0.7;
    parameters.omega = 1.9;
    K::Coefficients k{};
    H::Coefficients w{};
    REQUIRE(K::prepare(parameters, h, k) == Status::ok);
    REQUIRE(H::prepare({0.7, 1.9}, h, w) == Status::ok);
    const double q[] = {0.8}, p[] = {-1.1}, v[] = {0.9};
    std::vector<double> ours, theirs;
    const auto collect = [](std::vector<double>& all, const auto& values) {
        all.insert(all.end(), std::begin(values), std::end(values));
    };
    const auto evaluate = [&](auto kernel, const auto& c, std::vector<double>& all) {
        using Kernel = decltype(kernel);
        double one[1], s[1];
        all.push_back(Kernel::energy(c, q, p));
        Kernel::momentum(c, v, one), collect(all, one);
        Kernel::velocity(c, p, one), collect(all, one);
        Kernel::minus_acceleration(c, q, one), collect(all, one);
        Kernel::node(c, q, one, s), collect(all, one), collect(all, s);
    };
    evaluate(K{}, k, ours);
    evaluate(H{}, w, theirs);
    REQUIRE(ours.size() == theirs.size());
    REQUIRE(ours.size() == 6);
    for (std::size_t i = 0; i < ours.size(); ++i) {
        INFO("value " << i << ": " << ours[i] << ", by hand " << theirs[i]);
        CHECK(relative(ours[i], theirs[i]) < 1e-14);  // measured: at most 3.0e-15
        CHECK(ours[i] != 0);
    }
}

TEST_CASE("the emitted oscillator is the paper's Phi, with determinant 1") {
    using K = kernels::harmonic_oscillator;
    for (const double h : {0.0001, 0.01, 0.1, 0.3, 0.45}) {
        INFO("h = " << h);
        K::Parameters parameters;
        parameters.m = 1.7;
        K::Coefficients k{};
        REQUIRE(K::prepare(parameters, h, k) == Status::ok);
        // eq:symplecticCoeffs, rows and columns (p, q) there, (q, p) here.
        const long double m = 1.7L, w = parameters.omega, x = h * h * w * w;
        const long double delta = 1 + x / 30 + x * x / 1800;
        const long double a = 1 - 7 * x / 15 + 23 * x * x / 900 - x * x * x / 3600;
        const long double b = m * h * w * w / 43200 * (x - 60) * (x * x - 84 * x + 720);
        const long double c = h / m * (1 - 2 * x / 15 + x * x / 300);
        CHECK(static_cast<double>(std::fabs((a * a - b * c) / (delta * delta) - 1)) <
              1e-16);  // measured 3.4e-17: no misprint in these four
        const long double diagonal = (-x / 2 + x * x / 40 - x * x * x / 3600) / delta;  // (a - delta)/delta
        const long double expected[] = {diagonal, c / delta, 0, b / delta, diagonal, 0};
        CHECK(static_cast<double>(std::fabs(a - delta - diagonal * delta)) < 1e-17);
        const double* const E = k.Phi_minus_I;
        for (int i = 0; i < 6; ++i) {
            INFO("entry " << i);
            CHECK(std::fabs(static_cast<double>(E[i] - expected[i])) <=
                  2e-15 * std::fabs(static_cast<double>(expected[i])));  // measured 6e-16
        }
        const auto defect = [](const auto* entry) {
            const __float128 determinant = __float128(entry[0]) * entry[4] - __float128(entry[1]) * entry[3];
            return std::fabs(static_cast<double>(__float128(entry[0]) + entry[4] + determinant));
        };
        double nearest[6];
        for (int i = 0; i < 6; ++i) nearest[i] = static_cast<double>(expected[i]);
        INFO("det - 1: " << defect(E) << ", with entries rounded one by one " << defect(nearest));
        // Measured 4e-25 ... 7.8e-18; entries rounded one by one exceed the bound at h = 0.3 and 0.45.
        CHECK(defect(E) < 1e-19 + 3e-18 * static_cast<double>(x));
    }
}

TEST_CASE("the emitted discrete energy of the oscillator is the paper's form, and steps keep it") {
    using K = lobatto::kernels::harmonic_oscillator;
    lobatto::Stepper<K> stepper;
    const double h = 0.05, omega = 6.283185307179586, z = h * h * omega * omega, q = 1.25, p = -3;
    REQUIRE(stepper.prepare({}, h) == lobatto::Status::ok);
    REQUIRE(stepper.start(0, &q, &p) == lobatto::Status::ok);
    const auto H_d = [&](const double* position, const double* momentum) {
        return K::discrete_energy(stepper.coefficients, position, momentum);
    };
    const double delta = 1 + z / 30 + z * z / 1800, b = -z + 2 * z * z / 15 - z * z * z / 300 + z * z * z * z / 43200,
                 c = 1 - 2 * z / 15 + z * z / 300;
    const double first = H_d(&q, &p);
    CHECK(relative(first, (h * c * p * p - b / h * q * q) / (2 * delta)) < 1e-15);
    double worst = 0;
    for (int i = 0; i < 100000; ++i) {
        REQUIRE(stepper.step() == lobatto::Status::ok);
        worst = std::fmax(worst, relative(H_d(stepper.q, stepper.p), first));
    }
    CHECK(worst < 1e-12);
    CHECK(worst > 0);
}

TEST_CASE("emit says how a program asks for the tolerance of the scene; the plain text has none") {
    const test::TemporaryFolder folder;
    const std::string scene = tree + "/scenes/pendulum.toml", bouncing = tree + "/scenes/bouncing_ball.toml";
    const auto emitted = [&](const std::vector<std::string>& more) {
        std::vector<std::string> words{LOBATTO_PROGRAM, "emit", "-o", folder.string()};
        words.insert(words.end(), more.begin(), more.end());
        return test::run(words);
    };
    CHECK(test::contains(emitted({scene, "--tolerance", "1e-6"}).out, "  stepper.tolerance = 1e-06;\n"));
    CHECK(test::contains(test::read_file(folder / "pendulum.hpp"),
                         "// Tolerance    1e-06, once it is set: "
                         "stepper.tolerance = 1e-06;"));
    CHECK(test::contains(emitted({bouncing, "--tolerance", "1e-6"}).out, "  stepper.set_tolerance(1e-06);\n"));
    CHECK_FALSE(test::contains(emitted({scene}).out, "tolerance"));
    const std::string linear = tree + "/scenes/harmonic_oscillator.toml";  // one matrix: nothing is iterated
    CHECK_FALSE(test::contains(emitted({linear, "--tolerance", "1e-6"}).out, "tolerance"));
    const test::Finished plain = emitted({scene, "--plain", "--tolerance", "1e-6"});
    CHECK(plain.exit_code == 2);
    CHECK(test::contains(plain.err, "--tolerance: the plain integrator iterates to rounding"));
}

TEST_CASE("kernels of the general form make no warning where they are optimised" * doctest::test_suite("slow")) {
    for (const std::string name : {"kapitza_pendulum", "lagrange_top", "relativistic_oscillator"}) {
        const test::TemporaryFolder folder;
        const test::Finished emitted = test::run(
            {LOBATTO_PROGRAM, "emit", tree + "/scenes/" + name + ".toml", "--standalone", "-o", folder.string()});
        REQUIRE_MESSAGE(emitted.exit_code == 0, emitted.err);
        test::write_text(folder / "program.cpp", fmt::format("#include \"{0}.hpp\"\nint main() {{\n"
                                                             "    lobatto::Stepper<lobatto::kernels::{0}> stepper;\n"
                                                             "    const double q[8] = {{1, 1}}, p[8] = {{}};\n"
                                                             "    stepper.prepare({{}}, 0.01);\n"
                                                             "    stepper.start(0, q, p);\n    stepper.step();\n}}\n",
                                                             name));
        const test::Finished compiled = test::run({"g++", "-std=c++17", "-O2", "-Wall", "-Wextra", "-Werror", "-c",
                                                   folder / "program.cpp", "-o", folder / "program.o"});
        CHECK_MESSAGE(compiled.exit_code == 0, compiled.err);
    }
}
