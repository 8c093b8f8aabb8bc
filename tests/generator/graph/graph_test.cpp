// SPDX-License-Identifier: GPL-2.0-or-later
// The graph: one node for one value, one order for every process, numbers of 60 digits; and the passes over it.
#include "generator/graph/graph.hpp"

#include <cln/cln.h>
#include <doctest/doctest.h>

#include <cmath>

#include "generator/graph/notation.hpp"
#include "generator/graph/optimise.hpp"
#include "tests/support.hpp"

using namespace lobatto;

namespace {

struct Inputs {
    Graph graph;
    Id x = graph.input({"x", "x", Phase::iterate}), y = graph.input({"y", "y", Phase::iterate}),
       z = graph.input({"z", "z", Phase::iterate});
    std::string text(Id id) const { return formula(graph, id, Notation::text); }
    cln::cl_R value(Id id, const cln::cl_R& at_x, const cln::cl_R& at_y = 0) const {
        return graph.evaluate({at_x, at_y, 0}, {id})[static_cast<std::size_t>(id)];
    }
    Programs program(std::vector<Id> outputs) const {
        Programs programs;
        programs.graph = graph;
        Program all{"all", {}};
        for (const Id id : outputs) all.outputs.push_back({"out[" + std::to_string(all.outputs.size()) + "]", id});
        programs.programs.push_back(all);
        return programs;
    }
};

double near(const cln::cl_R& value, const char* digits) {
    return cln::double_approx(cln::abs(value - cln::cl_R(digits)));
}

Operations operations_after(const std::string& pass, const std::vector<PassReport>& reports) {
    for (const PassReport& report : reports)
        if (report.pass == pass) return report.after;
    FAIL("no such pass: " << pass);
    return {};
}

}  // namespace

TEST_CASE("equal expressions are one node, in whatever order they were built") {
    Inputs g;
    const Id a = g.graph.add({g.x, g.graph.multiply({g.y, g.z}), g.graph.number(2)});
    const Id b = g.graph.add({g.graph.number(2), g.graph.multiply({g.z, g.y}), g.x});
    CHECK(a == b);
    CHECK(g.graph.subtract(a, b) == g.graph.number(0));
    CHECK(g.graph.function(Op::sin, a) == g.graph.function(Op::sin, b));
    CHECK(g.graph.function(Op::sin, a) != g.graph.function(Op::cos, b));
}

TEST_CASE("high powers of sums with decimals hold no number that a double cannot") {
    const GiNaC::symbol x("x");
    const auto decimal = [](long digits, long one) { return GiNaC::numeric(digits, one); };
    for (const GiNaC::ex& e : std::vector<GiNaC::ex>{
             GiNaC::pow(1 - x * x / GiNaC::pow(decimal(1234567, 1000000), 2), 30),
             GiNaC::pow(1 + x * x / GiNaC::pow(decimal(123456789, 100000000), 2), -20),
             GiNaC::pow(x * decimal(1, 100000000) - decimal(1, 700000000), 47) * GiNaC::pow(10, 8 * 47),
             GiNaC::pow(decimal(1234567, 10000000) - x, 47) * (1 + x),
             GiNaC::pow(x * x + GiNaC::pow(GiNaC::ex(10), -20), -3),
             GiNaC::pow(1 - x * x / GiNaC::pow(decimal(1234567, 1000000), 2), 30) /
                 GiNaC::pow(1 + x * x / GiNaC::pow(decimal(1234567, 1000000), 2), 30)}) {
        Inputs g;
        const Id id = g.graph.from(e, {{x, g.x}});
        for (const Id node : g.graph.topological({id})) {
            if (!g.graph.is_constant(node)) continue;
            const double size = std::fabs(cln::double_approx(g.graph.constant_of(node).value));
            CHECK(size < 1e25);
            CHECK(size > 1e-25);
        }
        const GiNaC::ex value = e.subs(x == decimal(3, 10)).evalf();
        CHECK(cln::double_approx(g.value(id, cln::cl_RA(3) / 10)) ==
              doctest::Approx(GiNaC::ex_to<GiNaC::numeric>(value).to_double()).epsilon(1e-14));
    }
}

TEST_CASE("a number of many digits that is a simple fraction is this fraction") {
    Graph graph;
    const cln::cl_F third = cln::cl_float(cln::cl_RA(1) / 3, cln::float_format(number_digits));
    CHECK(graph.from(GiNaC::numeric(cln::cl_N(third)), {}) == graph.number(1, 3));
    CHECK(graph.from(GiNaC::numeric(cln::cl_N(6 * third)), {}) == graph.number(2));
    CHECK(graph.from(GiNaC::numeric(cln::cl_N(cln::sqrt(third))), {}) != graph.number(1, 3));
}

TEST_CASE("powers of sums keep the size that they are written with") {
    // At x = 1e-6 a smaller sum would underflow.
    const GiNaC::symbol x("x");
    Inputs g;
    const Id id = g.graph.from(3 * GiNaC::pow(1 + 1000000 * x, 64), {{x, g.x}});
    CHECK(g.text(id) == "3*(1000000*x + 1)^64");
    // Nor does the number in front become one that no double holds, where it is 1 without that.
    const GiNaC::numeric small(1, 100000000000000);
    CHECK(g.text(g.graph.from(small * GiNaC::pow(1234567 + 2345678 * x, 60), {{x, g.x}})).find("e+3") ==
          std::string::npos);
}

TEST_CASE("the order of terms is that of the inputs, not of construction") {
    Graph forwards, backwards;
    const auto build = [](Graph& graph, bool reverse) {
        const Id x = graph.input({"x", "x", Phase::iterate}), y = graph.input({"y", "y", Phase::iterate});
        std::vector<Id> terms;
        if (reverse) {
            terms = {graph.function(Op::sin, y), graph.power(y, 3), graph.multiply({y, x}), graph.power(x, 2), x};
        } else {
            terms = {x, graph.power(x, 2), graph.multiply({x, y}), graph.power(y, 3), graph.function(Op::sin, y)};
        }
        return formula(graph, graph.add(terms), Notation::text);
    };
    CHECK(build(forwards, false) == build(backwards, true));
}

TEST_CASE("a GiNaC expression reads the same whatever the addresses of its symbols") {
    std::string first;
    for (int trial = 0; trial < 20; ++trial) {
        std::vector<GiNaC::symbol> unused(static_cast<std::size_t>(trial));
        const GiNaC::symbol b("b"), a("a");
        const std::string text = canonical_text(GiNaC::pow(a + b, 2) + GiNaC::sin(a * b) - 3 * b / a);
        if (first.empty()) first = text;
        CHECK(text == first);
    }
}

TEST_CASE("equal terms and factors are collected") {
    Inputs g;
    CHECK(g.graph.add({g.x, g.x, g.x}) == g.graph.multiply({g.graph.number(3), g.x}));
    CHECK(g.graph.multiply({g.x, g.graph.power(g.x, 2), g.y}) == g.graph.multiply({g.y, g.graph.power(g.x, 3)}));
    CHECK(g.graph.divide(g.x, g.x) == g.graph.number(1));
    CHECK(g.graph.multiply({g.graph.number(2), g.graph.add({g.x, g.y})}) ==
          g.graph.add({g.graph.add({g.x, g.y}), g.graph.add({g.x, g.y})}));
    const Id root = g.graph.function(Op::sqrt, g.graph.number(5));
    CHECK(g.graph.multiply({root, root}) == g.graph.number(5));
    CHECK(g.graph.multiply({g.x, g.graph.number(0)}) == g.graph.number(0));
}

TEST_CASE("values have 60 digits") {
    Inputs g;
    const cln::cl_R one = cln::cl_float(1, cln::float_format(number_digits));
    CHECK(near(g.value(g.graph.function(Op::sin, g.x), one),
               "0.841470984807896506652502321630298999622563060798371065672752_70") < 1e-58);
    CHECK(near(g.value(g.graph.function(Op::exp, g.x), one),
               "2.718281828459045235360287471352662497757247093699959574966968_70") < 1e-58);
    CHECK(near(g.value(g.graph.function(Op::log, g.graph.number(2)), one),
               "0.693147180559945309417232121458176568075500134360255254120680_70") < 1e-58);
    CHECK(g.value(g.graph.power(g.x, -3), 2) == cln::cl_RA("1/8"));
    CHECK(g.value(g.graph.raise(g.x, g.graph.number(3)), -2) == -8);
    CHECK(g.value(g.graph.function(Op::sqrt, g.x), cln::cl_RA("9/4")) == cln::cl_RA("3/2"));
    // atan2(1, -1) = 3 pi/4
    CHECK(near(g.value(g.graph.raw(Op::atan2, {g.x, g.graph.number(-1)}), one),
               "2.356194490192344928846982537459627163147877049531329365731208_70") < 1e-58);
    CHECK(g.value(g.graph.raw(Op::atan2, {g.graph.number(0), g.x}), 3) == 0);
}

TEST_CASE("what is not real is a domain error") {
    Inputs g;
    const auto error_of = [&](Id id, const cln::cl_R& at_x) {
        return test::message_of<DomainError>([&] { g.value(id, at_x); });
    };
    CHECK(error_of(g.graph.power(g.x, -1), 0) == "division by zero");
    CHECK(error_of(g.graph.function(Op::sqrt, g.x), -1) == "square root of a negative number");
    CHECK(error_of(g.graph.function(Op::log, g.x), 0) == "logarithm of a number that is not positive");
    CHECK(error_of(g.graph.function(Op::asin, g.x), 2) == "asin of a value outside its domain");
    CHECK(error_of(g.graph.raw(Op::atan2, {g.x, g.x}), 0) == "atan2 of 0 and 0");
    CHECK(error_of(g.graph.raise(g.x, g.graph.number(1, 2)), -2) == "real power of a number that is not positive");
}

TEST_CASE("the passes keep every value to 40 digits and lose operations") {
    Inputs g;
    const Id s = g.graph.function(Op::sin, g.x), c = g.graph.function(Op::cos, g.x);
    std::vector<Id> terms;
    for (int k = 1; k <= 8; ++k) terms.push_back(g.graph.multiply({g.graph.number(k + 1, 7), g.graph.power(g.y, k)}));
    terms.push_back(g.graph.multiply({s, g.y, g.z}));
    Programs programs = g.program({g.graph.add(terms), g.graph.multiply({c, g.y, g.z}), g.graph.raise(g.y, s)});
    const auto values = [](const Programs& p) {
        std::vector<Id> roots;
        for (const Output& output : p.programs[0].outputs) roots.push_back(output.value);
        const cln::float_format_t format = cln::float_format(number_digits);
        const auto all = p.graph.evaluate({cln::cl_float(cln::cl_RA("1/3"), format),
                                           cln::cl_float(cln::cl_RA("5/7"), format), cln::cl_float(2, format)},
                                          roots);
        std::vector<cln::cl_R> result;
        for (const Id root : roots) result.push_back(all[static_cast<std::size_t>(root)]);
        return result;
    };
    const auto before = values(programs);
    const auto reports = optimise(programs);
    const auto after = values(programs);
    for (std::size_t i = 0; i < before.size(); ++i) CHECK(cln::double_approx(cln::abs(before[i] - after[i])) < 1e-40);
    CHECK(reports.size() == 8);
    CHECK(reports.back().after.total() < reports.front().after.total());
}

TEST_CASE("a polynomial of degree 8 costs 8 multiplications and 7 additions by Horner's rule") {
    Inputs g;
    std::vector<Id> terms;
    for (int k = 1; k <= 8; ++k) terms.push_back(g.graph.multiply({g.graph.number(k + 1, 7), g.graph.power(g.x, k)}));
    Programs programs = g.program({g.graph.add(terms)});
    const Operations operations = operations_after("factor sums (Horner)", optimise(programs));
    CHECK(operations.multiplications == 8);
    CHECK(operations.additions == 7);
}

TEST_CASE("x^20 costs 5 multiplications: squares of squares") {
    Inputs g;
    Programs programs = g.program({g.graph.power(g.x, 20)});
    CHECK(operations_after("powers by multiplication", optimise(programs)).multiplications == 5);
}

TEST_CASE("all powers of a base with quarters as exponents cost its roots and one division") {
    // The powers of r^2 in the equations of a clock r^(3/2) (D42), and those of equal steps.
    const auto cost = [](const std::vector<std::pair<int, int>>& exponents) {
        Inputs g;
        std::vector<Id> outputs;
        for (const auto& [numerator, denominator] : exponents)
            outputs.push_back(denominator == 1   ? g.graph.power(g.x, numerator)
                              : denominator == 2 ? g.graph.power(g.graph.function(Op::sqrt, g.x), numerator)
                                                 : g.graph.raise(g.x, g.graph.number(numerator, denominator)));
        Programs programs = g.program(outputs);
        const auto reports = optimise(programs);
        for (const PassReport& report : reports) CHECK(report.disagreement < 1e-40);
        const Operations operations = operations_after("powers by multiplication", reports);
        return std::pair(operations.functions, operations.divisions);
    };
    CHECK(cost({{-1, 4}, {-1, 2}, {-3, 4}, {-7, 4}, {3, 4}}) == std::pair(2L, 1L));
    CHECK(cost({{-1, 4}, {-3, 4}, {1, 2}}) == std::pair(2L, 1L));
    CHECK(cost({{-1, 4}, {-7, 4}}) == std::pair(2L, 1L));
    CHECK(cost({{-3, 2}, {-1, 2}}) == std::pair(1L, 1L));
    CHECK(cost({{-1, 2}, {1, 2}, {-1, 1}}) == std::pair(1L, 1L));
    CHECK(cost({{-1, 2}}) == std::pair(1L, 1L));
}

TEST_CASE("a product that two outputs need is computed once") {
    Inputs g;
    Programs programs =
        g.program({g.graph.multiply({g.x, g.y, g.z}), g.graph.multiply({g.x, g.y, g.graph.number(7, 3)})});
    const auto reports = optimise(programs);
    CHECK(operations_after("group by phase", reports).multiplications == 4);
    CHECK(operations_after("share common parts", reports).multiplications == 3);
}

TEST_CASE("sine and cosine of one argument are one evaluation") {
    Inputs g;
    const Id argument = g.graph.add({g.x, g.y});
    Programs programs = g.program({g.graph.function(Op::sin, argument), g.graph.function(Op::cos, argument)});
    const auto reports = optimise(programs);
    CHECK(reports.front().after.functions == 2);
    CHECK(reports.back().after.functions == 1);
}

TEST_CASE("sines and cosines of a sum of two angles come from those of both, in programs that take these anyway") {
    Inputs g;
    const auto sum = [&](bool minus_x, bool minus_y) {
        return g.graph.add({minus_x ? g.graph.negate(g.x) : g.x, minus_y ? g.graph.negate(g.y) : g.y});
    };
    const auto sine = [&](Id angle) { return g.graph.function(Op::sin, angle); };
    const auto cosine = [&](Id angle) { return g.graph.function(Op::cos, angle); };
    const auto functions_of = [](Programs programs) {
        const auto reports = optimise(programs);  // which compares all values
        return std::pair(reports.front().after.functions, reports.back().after.functions);
    };
    // All signs: of both angles and of their sums two functions remain.
    std::vector<Id> all{sine(g.x), cosine(g.y)};
    for (const bool minus_x : {false, true})
        for (const bool minus_y : {false, true})
            all.insert(all.end(), {sine(sum(minus_x, minus_y)), cosine(sum(minus_x, minus_y))});
    CHECK(functions_of(g.program(all)) == std::pair(10L, 2L));
    // One angle missing, or a sum of three: nothing to gain.
    CHECK(functions_of(g.program({sine(sum(false, true)), sine(g.x)})) == std::pair(2L, 2L));
    CHECK(functions_of(g.program({sine(g.graph.add({g.x, g.y, g.z})), sine(g.x), sine(g.y), sine(g.z)})) ==
          std::pair(4L, 4L));
    // What is divided by keeps its digits near zero.
    const Id known = g.graph.multiply({sine(g.x), cosine(g.y)});
    CHECK(functions_of(g.program({g.graph.power(sine(sum(false, true)), -1), known})) == std::pair(3L, 3L));
    CHECK(functions_of(g.program({g.graph.power(sine(sum(false, true)), 3), known})) == std::pair(3L, 2L));
    // Another program that takes the sum's sine alone keeps it.
    Programs two = g.program({sine(sum(false, true)), sine(g.x), cosine(g.y)});
    two.programs.push_back({"alone", {{"out[0]", sine(sum(false, true))}}});
    CHECK(functions_of(two) == std::pair(4L, 3L));
}

TEST_CASE("a value that is real only near the scene's start is checked there; one that is real nowhere is refused") {
    Graph graph;
    const Id x = graph.input({"x", "x", Phase::iterate, 5});
    Programs programs;
    programs.programs.push_back({"all", {{"out", graph.function(Op::log, graph.add({x, graph.number(-3)}))}}});
    programs.graph = graph;
    CHECK_NOTHROW(optimise(programs));
    programs.programs[0].outputs[0].value =
        graph.function(Op::log, graph.add({graph.negate(graph.power(x, 2)), graph.number(-3)}));
    programs.graph = graph;
    CHECK(
        test::message_of<DomainError>([&] { optimise(programs); }) ==
        "the formulas of this scene have no real value at any of 180 sample points, the nearest 2^-40 from its start");
}

TEST_CASE("exponentials of huge constants are folded to their limits or refused, never to a wrong number") {
    Graph graph;
    const auto value = [&graph](Op op, const cln::cl_R& x) {
        const Id id = graph.function(op, graph.constant(x));
        return cln::double_approx(graph.evaluate({}, {id})[static_cast<std::size_t>(id)]);
    };
    const cln::cl_R huge = cln::expt(cln::cl_I(10), 161);
    CHECK(value(Op::tanh, huge) == 1);
    CHECK(value(Op::tanh, -huge) == -1);
    CHECK(value(Op::exp, -huge) == 0);
    CHECK_THROWS_AS(value(Op::exp, huge), DomainError);
    CHECK_THROWS_AS(value(Op::cosh, -huge), DomainError);
}
