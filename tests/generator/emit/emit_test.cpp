// SPDX-License-Identifier: GPL-2.0-or-later
// The passes and the emitted text: what is saved, what is hoisted, and that any scene becomes C++ that compiles.
#include "generator/emit/kernel.hpp"

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <regex>

#include "analysis/kernel/support_text.hpp"
#include "generator/emit/declarations.hpp"
#include "generator/emit/function_text.hpp"
#include "generator/pipeline.hpp"
#include "generator/programs/programs.hpp"
#include "tests/support.hpp"

using namespace lobatto;

namespace {

struct SceneText {
    std::string name, lagrangian;
    std::vector<std::string> coordinates, parameters;
    std::string title = "a test";
    std::string unit = "";
};

Derivation derivation_of(const SceneText& scene, int points) {
    std::string text = "title = '" + scene.title + "'\nlagrangian = \"" + scene.lagrangian + "\"\n[coordinates]\n";
    for (const std::string& name : scene.coordinates)
        text += name + " = { position = 1, velocity = 0, unit = '" + scene.unit + "' }\n";
    text += "[parameters]\n";
    int value = 0;
    for (const std::string& name : scene.parameters)
        text += fmt::format("{} = 1.{}\n", name, ++value);  // 1.1, 1.2, ...
    text += fmt::format("[method]\nfamily = \"lobatto\"\npoints = {}\n[run]\nstep = 0.01\nuntil = 1\n", points);
    return derive(read_scene(Source(scene.name + ".toml", text)));
}

KernelSource kernel(const SceneText& scene, int points = 4) {
    return emit(derivation_of(scene, points));
}

// The text of one function of the kernel, from its signature to its closing brace.
std::string body(const std::string& header, const std::string& function) {
    const std::size_t begin = header.find(" " + function + "(");
    if (begin == std::string::npos) return "";
    return header.substr(begin, header.find("\n    }\n", begin) - begin);
}

std::size_t count_of(const std::string& text, const std::string& part) {
    std::size_t count = 0;
    for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
    return count;
}

// Compiles the header and ten steps with every warning an error; runs them; the compiler's complaints, or "".
std::string complaints(const KernelSource& source) {
    const test::TemporaryFolder folder;
    test::write_text(folder / "kernel.hpp", support_text());
    test::write_text(folder / (source.name + ".hpp"), source.header);
    test::write_text(folder / "program.cpp",
                     fmt::format("#include \"{0}.hpp\"\n"
                                 "using K = lobatto::kernels::{0};\n"
                                 "template struct lobatto::Stepper<K>;\n"
                                 "int main() {{\n"
                                 "    lobatto::Stepper<K> stepper;\n"
                                 "    double q[K::coordinates], p[K::coordinates] = {{}};\n"
                                 "    for (double& x : q) x = 1;\n"
                                 "    if (stepper.prepare({{}}, 0.01) != lobatto::Status::ok) return 2;\n"
                                 "    if (stepper.start(0, q, p) != lobatto::Status::ok) return 3;\n"
                                 "    for (int i = 0; i < 10; ++i)\n"
                                 "        if (stepper.step() != lobatto::Status::ok) return 4;\n"
                                 "    return K::energy(stepper.coefficients, stepper.q, p) == 12345 ? 5 : 0;\n"
                                 "}}\n",
                                 source.name));
    const std::string program = folder / "program";
    const test::Finished compiled =
        test::run({"g++", "-std=c++17", "-Wall", "-Wextra", "-Wpedantic", "-Wshadow", "-Werror", "-I", folder.string(),
                   folder / "program.cpp", "-o", program});
    if (compiled.exit_code != 0) return compiled.err;
    const int code = test::run({program}).exit_code;
    return code == 0 ? "" : fmt::format("the program ended with {}", code);
}

void check_compiles(const SceneText& scene, const std::vector<int>& all_points = {2, 3, 4, 5}) {
    for (const int points : all_points) {
        INFO(scene.name << " with " << points << " points");
        CHECK(complaints(kernel(scene, points)) == "");
    }
}

const SceneText pendulum{"pendulum", "m*q'^2/2 - m*omega^2*(1 - cos(q))", {"q"}, {"m", "omega"}};
const SceneText coupled{
    "coupled", "m*x'^2/2 + x'*y'/3 + y'^2/2 - k*x^4 - x*y^3 - sin(x)*cos(x)", {"x", "y"}, {"m", "k"}};

}  // namespace

TEST_CASE("every pass keeps operations to count, and the report begins with the programs as derived") {
    const KernelSource source = kernel(coupled);
    REQUIRE(source.report.size() == 8);
    CHECK(source.report.front().pass == "as derived");
    for (const PassReport& row : source.report) {
        INFO(row.pass);
        CHECK(row.after.additions > 10);
        CHECK(row.after.multiplications > 10);
        CHECK(row.after.divisions > 0);
        CHECK(row.after.functions > 0);
        CHECK(row.disagreement < 1e-40);
    }
    CHECK(source.report.back().after.total() < source.report.front().after.total());
}

TEST_CASE("powers are multiplications: no pow and no power operator is emitted") {
    const std::string header = kernel({"powers", "q'^2/2 - q^7/7 - a^5*q^12*cos(q)^3", {"q"}, {"a"}}).header;
    CHECK(header.find("pow(") == std::string::npos);
    CHECK(body(header, "node").find('^') == std::string::npos);
    const std::string real_exponent = kernel({"real_exponent", "q'^2/2 - (1 + q^2)^(1/3)", {"q"}, {}}).header;
    CHECK(real_exponent.find("lobatto::pow(") != std::string::npos);  // and a real exponent still is one
}

TEST_CASE("Horner's scheme saves operations on a quartic") {
    const KernelSource source =
        kernel({"quartic", "q'^2/2 - (a*q^4 + b*q^3 + c*q^2 + d*q)", {"q"}, {"a", "b", "c", "d"}});
    REQUIRE(source.report[2].pass == "factor sums (Horner)");
    CHECK(source.report[2].after.total() < source.report[1].after.total());
    // 4 a q^3 + 3 b q^2 + 2 c q + d: three multiplications by q and three additions.
    const std::string acceleration = body(source.header, "minus_acceleration");
    CHECK(count_of(acceleration, " * ") == 3);
    CHECK(count_of(acceleration, " + ") == 3);
}

TEST_CASE("sine and cosine of one argument become one call, and a lone sine stays alone") {
    const KernelSource source = kernel(pendulum);
    CHECK(count_of(body(source.header, "node"), "sincos(") == 1);
    CHECK(body(source.header, "node").find("::sin(") == std::string::npos);
    CHECK(count_of(body(source.header, "minus_acceleration"), "::sin(") == 1);
    CHECK(body(source.header, "minus_acceleration").find("sincos(") == std::string::npos);
}

TEST_CASE("a stage is given sine and cosine of what moves, in packs of double, and of nothing else") {
    const auto has = [](const KernelSource& source, const std::string& text) {
        return source.header.find(text) != std::string::npos;
    };
    const KernelSource two = kernel({"two", "a'^2 + b'^2 + a'*b'*cos(a - b) + cos(a) + cos(b)", {"a", "b"}, {}});
    CHECK(has(two, "int angles = 2;"));
    CHECK(count_of(two.header, "class Angles = lobatto::AnglesAnew") == 1);
    CHECK(count_of(body(two.header, "stage"), "angle.sincos(") == 2);
    CHECK(body(two.header, "stage").find("lobatto::sincos(") == std::string::npos);
    CHECK(count_of(two.header, "angle.sincos(") == 2);
    // A lone sine; beside a quotient that needs its digits; time; other precisions.
    EmitOptions single;
    single.precision = Precision::single;
    for (const KernelSource& none :
         {kernel({"lone", "q'^2/2*(1 + q^2) + cos(q)", {"q"}, {}}),
          kernel({"quotient", "(1 + q^2)*q'^2/2 + p'^2/2 + sin(sqrt(p^2 + q^2))/sqrt(p^2 + q^2)", {"q", "p"}, {}}),
          emit(
              derive(read_scene(Source("time.toml",
                                       "title = 'time'\nlagrangian = \"q'^2*(1 + q^2) + q*sin(t)*cos(t)\"\ntime = 't'\n"
                                       "[coordinates]\nq = { position = 1, velocity = 0 }\n[method]\nfamily = "
                                       "\"lobatto\"\npoints = 4\n[run]\nstep = 0.01\nuntil = 1\n")))),
          emit(derivation_of({"rod", "q'^2*(1 + q^2) + sin(q)*cos(q)", {"q"}, {}}, 4), single)}) {
        CHECK_FALSE(has(none, "int angles"));
        CHECK_FALSE(has(none, "angle.sincos"));
        CHECK_FALSE(has(none, "class Angles"));
    }
}

TEST_CASE("a broken power of a negative product keeps all its factors") {
    // (-x)^(3/2) is (-x) sqrt(-x). Defect once: a pass lost x, which its own check found, and no kernel was written.
    for (const char* power : {"(-x)^(3/2)", "(-2*x)^(5/2)", "(-x*x^2)^2.5"}) {
        CAPTURE(power);
        const Scene scene = read_scene(Source(
            "minus.toml", fmt::format("lagrangian = \"x'^2/2 - {}\"\n[coordinates]\nx = {{ position = -0.5, velocity = "
                                      "0 }}\n[run]\nstep = 0.01\nuntil = 1\n",
                                      power)));
        CHECK_NOTHROW(emit(derive(scene)));
    }
}

TEST_CASE("what the acceleration and its derivative have in common is computed once in node") {
    const std::string node = body(kernel({"shared", "q'^2/2 - exp(a*sin(q)^2)", {"q"}, {"a"}}).header, "node");
    CHECK(count_of(node, "exp(") == 1);
    CHECK(count_of(node, "sincos(") == 1);
}

TEST_CASE("node computes nothing that depends on parameters and step size only") {
    const SceneText scene{
        "hoisting", "m*q'^2/2 - sqrt(a)*b*cos(q)/(a + b) - exp(a*b)*q^4/m - (a + b)^3*q^3", {"q"}, {"m", "a", "b"}};
    const Programs programs = optimised_programs(derivation_of(scene, 4)).programs;
    std::vector<Id> roots;
    for (const Program& program : programs.programs)
        if (program.name == "node")
            for (const Output& output : program.outputs) roots.push_back(output.value);
    REQUIRE(roots.size() == 2);
    const Hoisted hoisted(programs);
    long early = 0;
    for (const Id id : programs.graph.topological(roots)) {
        if (programs.graph[id].phase <= Phase::step_size) continue;
        for (const Id operand : programs.graph[id].operands) {
            const Phase stage = programs.graph[operand].phase;
            if (stage != Phase::parameter && stage != Phase::step_size) continue;
            ++early;
            CHECK(hoisted.names.count(operand) == 1);
        }
    }
    CHECK(early >= 3);
    const std::string node = body(kernel(scene).header, "node");
    CHECK(node.find("exp(") == std::string::npos);
    CHECK(node.find("sqrt(") == std::string::npos);
    CHECK(node.find(" / ") == std::string::npos);
    // At most one operand of any multiplication is a coefficient.
    CHECK_FALSE(std::regex_search(node, std::regex(R"(k\.\w+ [*/] k\.\w+)")));
}

TEST_CASE("names that are C++ keywords compile" * doctest::test_suite("slow")) {
    check_compiles({"keywords",
                    "double*new'^2/2 - struct*cos(new) - operator*new^4 - real*new^3/(1 + new^2)",
                    {"new"},
                    {"double", "struct", "operator", "real"}},
                   {3, 4});
}

TEST_CASE("names of macros compile, and names that differ by an underscore stay apart" * doctest::test_suite("slow")) {
    check_compiles({"NAN",
                    "M_PI*q'^2/2 - INFINITY*q^4 - INT64_MAX*cos(q) - real*q^6 - real_*sin(q)",
                    {"q"},
                    {"M_PI", "INFINITY", "INT64_MAX", "real", "real_"}},
                   {4});
    check_compiles({"Status", "q'^2/2 - HUGE_VAL*q^2/2", {"q"}, {"HUGE_VAL"}}, {4});
}

TEST_CASE("a derivative that cancels to nothing is no disagreement between passes") {
    check_compiles(
        {"nothing", "x'^2/2 + y'^2/2 - sqrt(x^2) - tan(y)*cos(y) + sin(y) - acos(cos(x - 2*y)) - y^4", {"x", "y"}, {}},
        {4});
}

TEST_CASE("two standalone headers can be included in one program" * doctest::test_suite("slow")) {
    const test::TemporaryFolder folder;
    EmitOptions options;
    options.support_text = [](const auto& parts) { return support_text(parts); };
    SceneText other = pendulum;
    other.name = "other";
    for (const SceneText& scene : {pendulum, other})
        test::write_text(folder / (scene.name + ".hpp"), emit(derivation_of(scene, 4), options).header);
    test::write_text(folder / "program.cpp",
                     "#include \"pendulum.hpp\"\n#include \"other.hpp\"\n"
                     "template struct lobatto::Stepper<lobatto::kernels::pendulum>;\n"
                     "template struct lobatto::Stepper<lobatto::kernels::other>;\nint main() {}\n");
    CHECK(
        test::run({"g++", "-std=c++17", "-Wall", "-Wextra", "-Werror", "-fsyntax-only", folder / "program.cpp"}).err ==
        "");
}

TEST_CASE("kernels of one name in two files of a program stay two, in both forms, without optimisation") {
    const test::TemporaryFolder folder;
    EmitOptions options;
    options.support_text = [](const auto& parts) { return support_text(parts); };
    const SceneText arm{"arm", "x'^2/2 + cos(x)", {"x"}, {}};
    std::string declarations;
    std::vector<std::string> command{"g++", "-std=c++17", "-O0", "-o", folder / "program", folder / "program.cpp"};
    for (const auto& [points, letter] : {std::pair{2, 'a'}, std::pair{5, 'b'}}) {
        const Derivation derivation = derivation_of(arm, points);
        const std::string kernel_file = fmt::format("kernel_{}", letter), plain_file = fmt::format("plain_{}", letter);
        test::write_text(folder / (kernel_file + ".hpp"), emit(derivation, options).header);
        test::write_text(folder / (plain_file + ".hpp"), emit_plain(derivation.scene, Precision::double_).header);
        test::write_text(folder / (kernel_file + ".cpp"),
                         fmt::format("#include \"{0}.hpp\"\n"
                                     "double {0}() {{\n    lobatto::Stepper<lobatto::kernels::arm> stepper;\n"
                                     "    const double q = 1, p = 0;\n    stepper.prepare({{}}, 0.5);\n"
                                     "    stepper.start(0, &q, &p);\n    stepper.step();\n"
                                     "    return stepper.q[0];\n}}\n",
                                     kernel_file));
        test::write_text(folder / (plain_file + ".cpp"),
                         fmt::format("#include \"{0}.hpp\"\n"
                                     "double {0}() {{\n    namespace motion = lobatto::plain::arm;\n"
                                     "    const motion::Parameters parameters;\n"
                                     "    motion::State x = motion::start(parameters);\n"
                                     "    motion::step(parameters, 0.5, x);\n    return x.q[0];\n}}\n",
                                     plain_file));
        for (const std::string& file : {kernel_file, plain_file}) {
            declarations += fmt::format("double {}();\n", file);
            command.push_back(folder / (file + ".cpp"));
        }
    }
    test::write_text(
        folder / "program.cpp",
        "#include <cmath>\n" + declarations +
            "int main() {\n    const auto same = [](double x, double y) { return std::fabs(x - y) < 1e-12; };\n"
            "    return (same(kernel_a(), kernel_b()) ? 1 : 0) + (same(plain_a(), plain_b()) ? 2 : 0) +\n"
            "           (same(kernel_a(), plain_a()) && same(kernel_b(), plain_b()) ? 0 : 4);\n}\n");
    REQUIRE(test::run(command).err == "");
    CHECK(test::run({folder / "program"}).exit_code == 0);
    std::reverse(command.begin() + 6, command.end());
    REQUIRE(test::run(command).err == "");
    CHECK(test::run({folder / "program"}).exit_code == 0);
}

TEST_CASE("names that the emitted code uses itself compile" * doctest::test_suite("slow")) {
    check_compiles({"collide",
                    "q1*t1'^2/2 + k1'^2/2 - V*sin(t1)*cos(t1)*z^2 - inverse_m*m*k1^3*t1^2 - p*k*S*h2_A22*exp(k1) - "
                    "Phi_minus_I*W*delta*k1",
                    {"t1", "k1"},
                    {"q1", "V", "z", "inverse_m", "m", "p", "k", "S", "h2_A22", "Phi_minus_I", "W", "delta"}},
                   {3, 4});
    check_compiles(
        {"functions",
         "m*theta'^2/2 - energy*cos(theta) - node*theta^4 - prepare*residual*momentum*exp(theta)*name*order"
         "*points*lobatto*std*parameter*entries*drift*velocity*digest*coordinates*Status*Parameters",
         {"theta"},
         {"m", "energy", "node", "prepare", "residual", "momentum", "name", "order", "points", "lobatto", "std",
          "parameter", "entries", "drift", "velocity", "digest", "coordinates", "Status", "Parameters"}},
        {4});
    check_compiles({"coordinates",
                    "m*(real'^2 + W'^2 + sin_x'^2 + x'^2)/2 - sin(x)*cos(x)*W^4 - real^3*sin(W)*cos(W) - sin_x^4",
                    {"real", "W", "sin_x", "x"},
                    {"m"}},
                   {3});
    check_compiles({"angles",
                    "m*(angles'^2 + Angles'^2 + angle'^2)/2 - near*sin(angles)*cos(angles)*cos(Angles - angle)",
                    {"angles", "Angles", "angle"},
                    {"m", "near"}},
                   {3});
    // A linear map of the name of an argument of `prepare`, and of a parameter.
    for (const char* name : {"k", "stiffness"})
        check_compiles({name, "(x'^2 + y'^2)/2 - stiffness*(x - y)^2/2", {"x", "y"}, {"stiffness"}}, {4});
    // Costly as derived, not so after the passes.
    check_compiles({"eighth", "x'^2/2 - x^2/2 - x^3/3 - x^4/4 - x^5/5 - x^6/6 - x^7/7 - x^8/8", {"x"}, {}}, {5});
}

TEST_CASE("a parameter named as a local of prepare does not take the local's place") {
    // Defect once: with a parameter z the propagation used it instead of z = h^2 k/m.
    const SceneText plain{"plain", "q'^2/2 - u*q^2/2", {"q"}, {"u"}}, clash{"plain", "q'^2/2 - z*q^2/2", {"q"}, {"z"}};
    std::string expected = body(kernel(plain).header, "prepare");
    expected = std::regex_replace(expected, std::regex(R"(\bz\b)"), "z_");
    expected = std::regex_replace(expected, std::regex(R"(\bu\b)"), "z");
    CHECK(body(kernel(clash).header, "prepare") == expected);
    check_compiles({"locals",
                    "m*q'^2/2 - delta*q^2/2*a*b*c*z*t1*pivot_1 - index*q",
                    {"q"},
                    {"m", "delta", "a", "b", "c", "z", "t1", "pivot_1", "index"}},
                   {4, 5});
}

TEST_CASE("scenes at the edge of what there is to emit compile, with every number of points" *
          doctest::test_suite("slow")) {
    check_compiles({"no_parameters", "q'^2/2 - q^4/4", {"q"}, {}});
    check_compiles({"free", "m*q'^2/2", {"q"}, {"m"}});
    check_compiles({"constant_force", "m*q'^2/2 - m*g*q", {"q"}, {"m", "g"}});
}

TEST_CASE("two coordinates with a coupled mass matrix compile, linear and not" * doctest::test_suite("slow")) {
    check_compiles(coupled);
    check_compiles({"springs", "m*x'^2/2 + x'*y'/3 + y'^2/2 - k*x^2 - x*y", {"x", "y"}, {"m", "k"}}, {2, 4});
}

TEST_CASE("every function a scene may use compiles" * doctest::test_suite("slow")) {
    check_compiles({"functions_all",
                    "q'^2/2 - sqrt(1 + q^2)*tan(q/4) - exp(q)*log(2 + q^2) - sinh(q)*cosh(q)*tanh(q) - "
                    "asin(q/9)*acos(q/9)*atan(q) - (2 + q)^(a/3) - atan2(q, a) - atan2(a, q)*atan2(q, 2 + q)",
                    {"q"},
                    {"a"}},
                   {4});
}

TEST_CASE("every double literal of a kernel reads back as itself, in the fewest digits") {
    const std::string header = kernel(coupled, 5).header;
    std::string code = std::regex_replace(header, std::regex("//[^\n]*|\"[^\"]*\""), "");  // a digest may look like one
    const std::regex literal(R"((^|[^\w.\[])(\d+\.\d+(e[+-]?\d+)?|\d+e[+-]?\d+))");
    long literals = 0, inexact = 0;
    for (auto match = std::sregex_iterator(code.begin(), code.end(), literal); match != std::sregex_iterator();
         ++match) {
        const std::string text = (*match)[2];
        const double value = std::strtod(text.c_str(), nullptr);
        std::string shortest = fmt::format("{}", value);
        if (shortest.find_first_of(".e") == std::string::npos) shortest += ".0";
        CHECK(std::strtod(shortest.c_str(), nullptr) == value);
        CHECK(text == shortest);
        ++literals;
        inexact += text.size() > 15;
    }
    CHECK(literals > 50);
    CHECK(inexact > 20);
}

TEST_CASE("the nodes and weights of s = 5 are emitted correctly rounded") {
    const std::string header = kernel(pendulum, 5).header;
    CHECK(header.find("c[5] = {0.0, 0.17267316464601143, 0.5, 0.8273268353539885, 1.0}") != std::string::npos);
    CHECK(header.find("b[5] = {0.05, 0.2722222222222222, 0.35555555555555557, 0.2722222222222222, 0.05}") !=
          std::string::npos);
}

TEST_CASE("the same scene gives the same bytes, and another formula another digest") {
    CHECK(kernel(coupled).header == kernel(coupled).header);
    CHECK(kernel(coupled).digest == kernel(coupled).digest);
    CHECK(kernel(coupled).digest != kernel(coupled, 5).digest);
    CHECK(std::regex_match(kernel(coupled).digest, std::regex("[0-9a-f]{16}")));
    SceneText other = pendulum;
    other.lagrangian = "m*q'^2/2 - m*omega^2*(1 - cos(2*q))";
    CHECK(kernel(other).digest != kernel(pendulum).digest);
}

TEST_CASE("titles and units cannot break out of the comments they stand in") {
    Derivation derivation = derivation_of(pendulum, 4);
    derivation.scene.title = "one\nint broken = ; // two \\";
    derivation.scene.coordinates[0].unit = "m*/\r\nint broken = ;";
    derivation.scene.parameters[0].unit = "kg \\";
    derivation.scene.lagrangian_text = "L \\";
    const KernelSource source = emit(derivation);
    CHECK(source.header.find("\nint broken") == std::string::npos);
    CHECK(complaints(source) == "");
}

TEST_CASE("the names that a scene may not take are those that kernels declare") {
    const Method lobatto_4, gauss_3{Family::gauss, 3}, splitting{Family::splitting, 11};
    const Method clean{Family::lobatto, 5, 0, StepArithmetic::clean};
    std::set<std::string> declared;
    for (const auto& [name, method] : std::vector<std::pair<std::string, Method>>{{"harmonic_oscillator", lobatto_4},
                                                                                  {"pendulum", splitting},
                                                                                  {"pendulum", clean},
                                                                                  {"double_pendulum", lobatto_4},
                                                                                  {"lagrange_top", gauss_3},
                                                                                  {"rod_pendulum", lobatto_4},
                                                                                  {"swinging_atwood", lobatto_4},
                                                                                  {"stiff_fput", lobatto_4},
                                                                                  {"fput_beta", lobatto_4},
                                                                                  {"gyroscopic_pendulum", lobatto_4},
                                                                                  {"mathews_lakshmanan", lobatto_4},
                                                                                  {"orbit", lobatto_4}}) {
        const std::string orbit =  // with the time of a clock
            "lagrangian = \"(x'^2 + y'^2)/2 + (1 + sin(t)/99)/sqrt(x^2 + y^2)\"\ntime = \"t\"\n[coordinates]\n"
            "x = { position = 1, velocity = 0 }\ny = { position = 0, velocity = 1 }\n[method]\nclock = \"x^2 + y^2\"\n"
            "[run]\nstep = 0.1\nuntil = 1\n";
        Scene scene = name == "orbit" ? read_scene(Source("orbit.toml", orbit))
                                      : read_scene(std::string(LOBATTO_SOURCE_DIR) + "/scenes/" + name + ".toml");
        if (name != "orbit") scene.method = method;
        if (name == "double_pendulum") {  // and one with all that a wall may have
            Impact wall{"wall"};
            wall.when = {"wall", scene.coordinates[0].position - 10, 1};
            for (const Coordinate& coordinate : scene.coordinates) {
                wall.reset_position.push_back(coordinate.position);
                wall.reset_velocity.push_back(-coordinate.velocity);
            }
            scene.impacts.push_back(wall);
            scene.run.stops.push_back({"stop", scene.coordinates[0].position - 20, 1});
            Switch step{scene.coordinates[0].position - 5, GiNaC::symbol("side_1"), "if", {}, true, true};
            scene.parameters.push_back({"side_1", "", -1, step.side, "side_1", false, true});
            scene.lagrangian += step.side;
            scene.switches.push_back(step);
        }
        if (name == "swinging_atwood") {  // and one whose momentum is a difference at rest
            const GiNaC::symbol& v = scene.coordinates[0].velocity;
            scene.lagrangian += GiNaC::exp(v) - v;
        }
        if (method.family == Family::splitting) scene.parameters.back().is_input = true;
        const std::string header = emit(derive(scene)).header;
        const std::regex declaration(
            R"(\n    (?:static constexpr [\w:* ]*?|using |struct |static [\w:]+&? )(\w+)(?:\[| =| \{|\())");
        for (auto match = std::sregex_iterator(header.begin(), header.end(), declaration);
             match != std::sregex_iterator(); ++match)
            declared.insert((*match)[1]);
    }
    for (const std::string& name : declared) {
        if (name.starts_with("element_")) continue;  // tables of repeated terms, numbered
        CHECK_MESSAGE(is_member_name(name), name << " is declared, but a scene may take it");
    }
    for (const std::string& name : member_names())
        CHECK_MESSAGE(declared.contains(name), name << " is reserved, but no kernel declares it");
}
