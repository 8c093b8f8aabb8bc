// SPDX-License-Identifier: GPL-2.0-or-later
// Formulas: what they mean exactly, and what is said of each mistake, word for word.
#include "generator/formula/expression.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <string>

using GiNaC::ex;
using GiNaC::numeric;
using GiNaC::Pi;

namespace {

const GiNaC::symbol m("m"), omega("omega"), q("q"), velocity("q'"), t("t");
const GiNaC::symbol x[] = {GiNaC::symbol("x_1"), GiNaC::symbol("x_2"), GiNaC::symbol("x_3")};
const GiNaC::symbol x_velocity[] = {GiNaC::symbol("x_1'"), GiNaC::symbol("x_2'"), GiNaC::symbol("x_3'")};
const GiNaC::symbol mass[] = {GiNaC::symbol("mass_1"), GiNaC::symbol("mass_2"), GiNaC::symbol("mass_3")};

// A Lagrangian with a parameter m and a coordinate q, ...
struct Language {
    lobatto::Names names;
    lobatto::Scope scope{&names, "the Lagrangian", true, {}};

    Language() {
        names.add_parameter("m", {m});
        names.add_parameter("omega", {omega});
        names.add_coordinate("q", {q}, {velocity});
    }
    Language(const Language&) = delete;

    // ... arrays of three, x and mass, constants n = 3 and half = 1/2, and the time.
    void add_arrays() {
        names.add_coordinate("x", {x[0], x[1], x[2]}, {x_velocity[0], x_velocity[1], x_velocity[2]}, true);
        names.add_parameter("mass", {mass[0], mass[1], mass[2]}, true);
        names.add_parameter("n", {3});
        names.add_parameter("half", {numeric(1, 2)});
        names.add_time("t", t);
    }
};

// A formula that is a whole file of one line.
lobatto::Text text_of(const std::string& formula) {
    lobatto::Text text{formula, {}};
    lobatto::Position here;
    for (std::size_t i = 0; i <= formula.size(); ++i) {
        const bool inside_character = i < formula.size() && (static_cast<unsigned char>(formula[i]) & 0xC0) == 0x80;
        if (inside_character) --here.column;
        text.at.push_back(here);
        ++here.column;
    }
    return text;
}

ex parse(const std::string& formula, const lobatto::Scope& scope) {
    return lobatto::parse_expression(lobatto::Source("formula", formula), text_of(formula), scope);
}
ex parse(const std::string& formula) {
    Language language;
    return parse(formula, language.scope);
}

std::string error_of(const std::string& formula, const lobatto::Scope& scope) {
    try {
        parse(formula, scope);
    } catch (const lobatto::InputError& error) {
        return error.what();
    }
    return "no error";
}
std::string error_of(const std::string& formula) {
    Language language;
    return error_of(formula, language.scope);
}

std::string layout(const std::string& formula, int column, const std::string& message) {
    return "formula:1:" + std::to_string(column) + ": " + message + "\n  1 | " + formula + "\n    | " +
           std::string(static_cast<std::size_t>(column - 1), ' ') + "^";
}

void check_error(const std::string& formula, int column, const std::string& message) {
    CHECK(error_of(formula) == layout(formula, column, message));
}

ex parse_with_arrays(const std::string& formula) {
    Language language;
    language.add_arrays();
    return parse(formula, language.scope);
}

void check_error_with_arrays(const std::string& formula, int column, const std::string& message) {
    Language language;
    language.add_arrays();
    CHECK(error_of(formula, language.scope) == layout(formula, column, message));
}

std::string repeated(const std::string& piece, int times) {
    std::string text;
    for (int i = 0; i < times; ++i) text += piece;
    return text;
}

}  // namespace

TEST_CASE("numbers are exact") {
    CHECK(parse("0.1").is_equal(numeric(1, 10)));
    CHECK(parse("1.5e-3").is_equal(numeric(3, 2000)));
    CHECK(parse("2E2").is_equal(200));
    CHECK_THROWS_WITH_AS(parse(".5"), doctest::Contains("write 0.5, not .5"), lobatto::InputError);
    CHECK(parse("007").is_equal(7));
    CHECK(parse("1/3 + 1/6").is_equal(numeric(1, 2)));
    CHECK(parse("sqrt(5)^2").is_equal(5));
    CHECK(parse("sin(pi/6)").is_equal(numeric(1, 2)));
    CHECK(parse("2*pi").is_equal(2 * Pi));
}

TEST_CASE("operators bind as in mathematics") {
    CHECK(parse("-q^2").is_equal(-pow(q, 2)));
    CHECK(parse("2^-1").is_equal(numeric(1, 2)));
    CHECK(parse("2^3^2").is_equal(512));
    CHECK(parse("2^-2^2").is_equal(numeric(1, 16)));
    CHECK(parse("1 - 2 - 3").is_equal(-4));
    CHECK(parse("12/2/3").is_equal(2));
    CHECK(parse("12/2*3").is_equal(18));
    CHECK(parse("2*-q").is_equal(-2 * q));
    CHECK(parse("--q - +q").is_zero());
    CHECK(parse("(q + 1)*2").is_equal(2 * q + 2));
    CHECK(parse("m*q'^2/2 - m*omega^2*(1 - cos(q))")
              .is_equal(m * pow(velocity, 2) / 2 - m * pow(omega, 2) * (1 - cos(q))));
}

TEST_CASE("every function of the grammar means GiNaC's function of that name") {
    CHECK(parse("sqrt(q)").is_equal(sqrt(q)));
    CHECK(parse("sin(q)").is_equal(sin(q)));
    CHECK(parse("cos(q)").is_equal(cos(q)));
    CHECK(parse("tan(q)").is_equal(tan(q)));
    CHECK(parse("exp(q)").is_equal(exp(q)));
    CHECK(parse("log(q)").is_equal(log(q)));
    CHECK(parse("sinh(q)").is_equal(sinh(q)));
    CHECK(parse("cosh(q)").is_equal(cosh(q)));
    CHECK(parse("tanh(q)").is_equal(tanh(q)));
    CHECK(parse("asin(q)").is_equal(asin(q)));
    CHECK(parse("acos(q)").is_equal(acos(q)));
    CHECK(parse("atan(q)").is_equal(atan(q)));
}

TEST_CASE("atan2 is the angle of a point, first y, then x") {
    CHECK(parse("atan2(q', q + 1)").is_equal(GiNaC::atan2(velocity, q + 1)));
    CHECK(parse("atan2(1, 1)").is_equal(GiNaC::Pi / 4));
    CHECK(parse("atan2(1, -1)").is_equal(3 * GiNaC::Pi / 4));
    CHECK(parse("atan2(-2, 0)").is_equal(-GiNaC::Pi / 2));
    CHECK(parse("atan2(0, -3)").is_equal(GiNaC::Pi));
    CHECK(lobatto::real_value(parse("atan2(-sqrt(2), -1)")).to_double() ==
          doctest::Approx(std::atan2(-std::sqrt(2.0), -1)));
    // Derivatives, against those of sine and cosine of the angle: r^2 dphi = x dy - y dx.
    const GiNaC::ex angle = parse("atan2(omega*q, m + q)");
    const GiNaC::ex rate = (angle.diff(q) * (pow(omega * q, 2) + pow(m + q, 2))).normal();
    CHECK((rate - (omega * (m + q) - omega * q)).expand().is_zero());
    check_error("atan2(0, 0)", 1, "atan2(0, 0) is no angle");
    check_error("atan2(q)", 8, "atan2 is written atan2(y, x)");
    check_error("atan2 q", 1, "atan2 needs parentheses: write atan2(y, x)");
}

TEST_CASE("the names that occur are collected, even where they cancel") {
    Language language;
    parse("0*m + q'^2", language.scope);
    CHECK(language.names.all.at("m").used);
    CHECK(language.names.all.at("q").used);
    CHECK_FALSE(language.names.all.at("omega").used);
}

TEST_CASE("missing operators and parentheses are named with their mend") {
    check_error("2q", 2, "missing operator: write 2*q");
    check_error("q omega", 3, "missing operator: write q*omega");
    check_error("4 N", 3, "numbers have no units: leave 'N' out, or write 4*N for a parameter N");
    check_error("30 deg", 4, "angles are in radians: write 30*pi/180");
    check_error("4 m", 3, "missing operator: write 4*m");  // a parameter
    check_error("2 min(q, 1)", 3, "missing operator: write 2*min");
    check_error("m(q + 1)", 2, "missing operator: write m*(");
    check_error("(q)(q)", 4, "missing operator: write )*(");
    check_error("2e", 2, "missing operator: write 2*e");
    check_error("if(q >= 1, q, 1)", 7, "there is no >=: write if(a < b, d, c) in place of if(a >= b, c, d)");
    check_error("if(q > 1 and q < 2, q, 1)", 10, "there is no 'and' in formulas: write one if inside another");
    check_error("sin q", 1, "sin needs parentheses: write sin(q)");
    check_error("2*cos", 3, "cos needs parentheses: write cos(...)");
    check_error("sin^2(q)", 4, "write sin(...)^2 instead of sin^2(...)");
    check_error("m*(q + 1", 3, "this ( is not closed: add a )");
    check_error("(q + 1))", 8, "this ) closes nothing: remove it, or add a ( before it");
    check_error("()", 2, "nothing stands between ( and )");
}

TEST_CASE("incomplete formulas are named where they break off") {
    check_error("", 1, "the Lagrangian is empty");
    check_error("  ", 3, "the Lagrangian is empty");
    check_error("q +", 4, "the Lagrangian ends after '+': a number, a name or ( is missing");
    check_error("q*/m", 3, "a number, a name or ( is missing before '/'");
    check_error("*q", 1, "a number, a name or ( is missing before '*'");
    check_error("1.2.3", 1, "'1.2.3' is not a number: it has too many points");
    check_error("q**2", 2, "'**' is not an operator: write ^ for powers");
}

TEST_CASE("unknown names come with the declared ones and the nearest") {
    check_error("omgea^2", 1,
                "unknown name 'omgea' in the Lagrangian; declared: m, omega, q, q'. Did you mean 'omega'?");
    check_error("ome*q", 1, "unknown name 'ome' in the Lagrangian; declared: m, omega, q, q'. Did you mean 'omega'?");
    check_error("xyz", 1, "unknown name 'xyz' in the Lagrangian; declared: m, omega, q, q'.");
    check_error("ln(q)", 1,
                "unknown function 'ln' in the Lagrangian; there are sqrt, sin, cos, tan, exp, log, sinh, cosh, tanh, "
                "asin, acos, atan, sum, mod, table, abs, sign, min, max, hypot, atan2, if. Write log.");
    check_error("coss(q)", 1,
                "unknown function 'coss' in the Lagrangian; there are sqrt, sin, cos, tan, exp, log, sinh, cosh, "
                "tanh, asin, acos, atan, sum, mod, table, abs, sign, min, max, hypot, atan2, if. Did you mean 'cos'?");
}

TEST_CASE("primes belong to coordinates, one each") {
    check_error("m*q''", 5, "q'' is an acceleration; formulas have positions and velocities only");
    check_error("m'", 1, "m is a parameter and has no velocity; only coordinates have one");
    check_error("2'", 2, "a prime ' belongs directly after the name of a coordinate");
    check_error("q '", 3, "a prime ' belongs directly after the name of a coordinate");
}

TEST_CASE("characters of word processors come with what to type instead") {
    check_error("q − 1", 3, "unexpected character '−' in the Lagrangian: write - instead");
    check_error("m × q", 3, "unexpected character '×' in the Lagrangian: write * instead");
    check_error("m·q", 2, "unexpected character '·' in the Lagrangian: write * instead");
    check_error("q²", 2, "unexpected character '²' in the Lagrangian: write ^2 instead");
    check_error("2*π", 3, "unexpected character 'π' in the Lagrangian: write pi instead");
    check_error("q′", 2, "unexpected character '′' in the Lagrangian: write ' instead");
    check_error(
        "0,5", 2,
        "unexpected character ',' in the Lagrangian: decimals have a point, and functions have no more arguments");
    check_error(
        "q & m", 3,
        "unexpected character '&' in the Lagrangian: there is no 'and' in formulas: write one if inside another");
    CHECK(error_of("é + \x1b[31m") == layout("é + \uFFFD[31m", 1, "unexpected character 'é' in the Lagrangian"));
    CHECK(error_of("\xff") == layout("\uFFFD", 1, "unexpected character '\uFFFD' in the Lagrangian"));
}

TEST_CASE("what has no finite real value is refused where it stands") {
    check_error("q/0", 2, "division by zero in the Lagrangian");
    check_error("1/(q - q)", 2, "division by zero in the Lagrangian");
    check_error("1/(sqrt(2)*sqrt(3) - sqrt(6))", 2, "division by zero in the Lagrangian");
    check_error("1/(sin(1)^2 + cos(1)^2 - 1)", 2, "division by zero in the Lagrangian");
    check_error("0^-1", 2, "division by zero in the Lagrangian");
    check_error("m*log(0)", 3, "the Lagrangian has no finite real value here: log of 0 is not finite");
    check_error("sqrt(-1)", 1, "the Lagrangian has no finite real value here: sqrt of -1 is not a real number");
    check_error("(-8)^(1/3)", 5,
                "the Lagrangian has no finite real value here: -8 to the power 0.333333 is not a real number");
    check_error("acos(2)", 1, "the Lagrangian has no finite real value here: acos of 2 is not a real number");
    check_error("tan(pi/2)", 1, "the Lagrangian has no finite real value here: tan of 1.5708 is not finite");
    check_error("(q - q)^0", 8, "the Lagrangian has no finite real value here: 0 to the power 0 is not defined");
    check_error("0^q", 2, "0 to a power that is not a number");
    check_error("0^(-(2^(1/3)))", 2, "division by zero in the Lagrangian");
    check_error("(-2)^q", 5, "a negative number to a power that is not a number; it is real for whole powers only");
    check_error("(-q^0)^q", 7, "a negative number to a power that is not a number; it is real for whole powers only");
    check_error("sin(exp(exp(20)))", 5, "the Lagrangian has no finite real value here: a number beyond 2^4096 occurs");
}

TEST_CASE("functions keep their value far out") {
    CHECK(parse("1/tanh(cosh(373))").is_equal(1 / tanh(cosh(ex(373)))));  // CLN answers 0 for this tanh
    CHECK(parse("1/tanh(-10^100)").is_equal(1 / tanh(-pow(ex(10), 100))));
    CHECK(parse("1 + exp(-10^30)").is_equal(1 + exp(-pow(ex(10), 30))));
    check_error("cosh(-10^30)", 1, "the Lagrangian has no finite real value here: a number beyond 2^4096 occurs");
}

TEST_CASE("sizes are bounded before anything large is computed") {
    const std::string number = "an exact number of more than 4096 bits (about 1228 digits) occurs here";
    check_error("9^9^9", 2, number);
    check_error("2^99999", 2, number);
    check_error("(-2)^99999", 5, number);
    check_error("1e999999", 1, number);
    check_error("1e99999999999999999999", 1, number);
    check_error("(3^2000*q)^64", 11, number);
    check_error("1/(2^4000+1) + 1/(2^4000+3)", 14, number);
    check_error("(q + 1)^64^2", 8, "the exponent is beyond 64; write the formula with smaller powers");
    check_error("(q^64)^64", 7, "an exponent beyond 64; write the formula with smaller powers");
    CHECK(parse("2^4000").is_equal(pow(numeric(2), numeric(4000))));
    CHECK(parse("q^-64").is_equal(pow(q, -64)));
    CHECK(parse("q^(3/2)").is_equal(pow(q, numeric(3, 2))));
    CHECK(parse("(-1)^99999").is_equal(-1));
}

TEST_CASE("nesting of 200 is read, of 201 and of 200,000 refused") {
    const std::string message =
        "the Lagrangian is nested more than 200 deep; write it with fewer parentheses and powers";
    CHECK(parse(repeated("(", 199) + "q" + repeated(")", 199)).is_equal(q));
    CHECK(error_of(repeated("(", 200) + "q" + repeated(")", 200)).find(message) != std::string::npos);
    CHECK(error_of(repeated("(", 90000)).find(message) != std::string::npos);
    CHECK(error_of(repeated("q^", 40000)).find(message) != std::string::npos);
    CHECK(error_of("-" + repeated("(", 20000)).find(message) != std::string::npos);
    CHECK(parse(repeated("-", 90000) + "q").is_equal(q));
    CHECK(error_of(repeated("(", 200000))
              .starts_with("formula:1:1: the Lagrangian has 200000 characters; at most 100000 are read\n"));
}

TEST_CASE("functions stand 16 deep in one another, not 17, and any number beside one another") {
    const std::string message = "functions of functions in the Lagrangian are more than 16 deep; write it with fewer";
    CHECK_NOTHROW(parse(repeated("sin(", 16) + "q" + repeated(")", 16)));
    const std::string deep = repeated("sin(", 17) + "q" + repeated(")", 17);
    CHECK(error_of(deep) == layout(deep, 65, message));
    CHECK(error_of(repeated("sin(", 20000)).find(message) != std::string::npos);
    CHECK_NOTHROW(parse("q" + repeated("+sin(cos(q))", 40)));
}

TEST_CASE("an initial value is made of parameters and numbers") {
    Language language;
    lobatto::Scope& scope = language.scope;
    scope.formula = "the initial position of q";
    scope.motion_allowed = false;
    CHECK(parse("2*m", scope).is_equal(2 * m));
    CHECK(error_of("2*q", scope) ==
          layout("2*q", 3,
                 "the coordinate q cannot occur in the initial position of q: write it with numbers and parameters"));
    CHECK(error_of("q'", scope) ==
          layout("q'", 1,
                 "the velocity q' cannot occur in the initial position of q: write it with numbers and parameters"));
    CHECK(error_of("k", scope) == layout("k", 1, "unknown name 'k' in the initial position of q; declared: m, omega."));
}

TEST_CASE("a long line is shown as a window around the caret") {
    const std::string text = repeated("q+", 300) + "?" + repeated("+q", 300);
    CHECK(error_of(text) == "formula:1:601: unexpected character '?' in the Lagrangian\n  1 | ..." +
                                repeated("q+", 50) + "?" + repeated("+q", 49) + "+...\n    | " + repeated(" ", 103) +
                                "^");
}

TEST_CASE("sums are written out") {
    CHECK(parse_with_arrays("sum(i = 1 .. 3, mass[i]*x[i]'^2)/2")
              .is_equal((mass[0] * pow(x_velocity[0], 2) + mass[1] * pow(x_velocity[1], 2) +
                         mass[2] * pow(x_velocity[2], 2)) /
                        2));
    CHECK(parse_with_arrays("sum(i=1..n-1, (x[i+1] - x[i])^i)").is_equal(x[1] - x[0] + pow(x[2] - x[1], 2)));
    CHECK(parse_with_arrays("sum(i = 1 .. n, sum(j = i + 1 .. n, x[i]*x[j]))")
              .is_equal(x[0] * x[1] + x[0] * x[2] + x[1] * x[2]));
    CHECK(parse_with_arrays("sum(i = 1 .. n, x[mod(i, n) + 1]*i)").is_equal(x[1] + 2 * x[2] + 3 * x[0]));
    CHECK(parse_with_arrays("sum(i = -2 .. 2, i^2)").is_equal(10));
    CHECK(parse_with_arrays("sum(i = 1 .. 20, 1/i)").is_equal(numeric(55835135, 15519504)));
    CHECK(parse_with_arrays("x[n] + x[4/2]*t").is_equal(x[2] + x[1] * t));
    CHECK(parse_with_arrays("mod(-1, 3) + mod(7, 3)").is_equal(3));
}

TEST_CASE("an empty sum is 0, and its formula is read all the same") {
    CHECK(parse_with_arrays("q + sum(i = 5 .. 3, x[i])").is_equal(q));
    check_error_with_arrays(
        "sum(i = 5 .. 3, y[i])", 17,
        "unknown name 'y' in the Lagrangian; declared: i, half, m, mass[i], n, omega, q, q', t, x[i], x[i]'.");
}

TEST_CASE("a comment ends with its line") {
    CHECK(parse("m # the mass, in kg\n + q # the [rest").is_equal(m + q));
    check_error("# nothing", 10, "the Lagrangian is empty");
}

TEST_CASE("errors in a sum say for which indices") {
    check_error_with_arrays("sum(i = 1 .. n, (x[i+1] - x[i])^2)", 18,
                            "there is no x[4]: the array has the elements x[1] to x[3] (i = 3)");
    check_error_with_arrays("sum(i = 1 .. n, sum(j = 1 .. n, 1/(x[i] - x[j])))", 34,
                            "division by zero in the Lagrangian (i = 1, j = 1)");
    check_error_with_arrays("x[0]", 1, "there is no x[0]: the array has the elements x[1] to x[3]");
    check_error_with_arrays("sum(i = 1 .. n, sqrt(1 - i))", 17,
                            "the Lagrangian has no finite real value here: sqrt of -1 is not a real number (i = 2)");
}

TEST_CASE("indices and bounds are whole numbers known when the kernel is written") {
    check_error_with_arrays("sum(i = 1 .. m, x[i])", 14,
                            "the last index of a sum must be known when the kernel is written: numbers, indices and "
                            "parameters declared constant, such as n = { value = 8, constant = true }");
    check_error_with_arrays("sum(i = half .. n, x[i])", 9, "the first index of a sum must be a whole number, not 0.5");
    check_error_with_arrays("x[n/2]", 3, "the index of x must be a whole number, not 1.5");
    check_error_with_arrays("x[q]", 3,
                            "the index of x must be known when the kernel is written: numbers, indices and parameters "
                            "declared constant, such as n = { value = 8, constant = true }");
    check_error_with_arrays("x[10^9 + 1]", 3, "the index of x is beyond 1000000000");
    check_error_with_arrays("mod(3, 0)", 8, "mod divides by 0; it must be positive");
    check_error_with_arrays("mod(3/2, 2)", 5, "what mod divides must be a whole number, not 1.5");
}

TEST_CASE("an index has a name of its own") {
    check_error_with_arrays("sum(m = 1 .. 3, x[m])", 5, "'m' is a parameter; give the index another name");
    check_error_with_arrays("sum(x = 1 .. 3, x)", 5, "'x' is a coordinate; give the index another name");
    check_error_with_arrays("sum(t = 1 .. 3, t)", 5, "'t' is the time; give the index another name");
    check_error_with_arrays("sum(i = 1 .. 3, sum(i = 1 .. 2, x[i]))", 21,
                            "'i' is an index already; give the index another name");
    check_error_with_arrays("sum(pi = 1 .. 3, x[pi])", 5, "'pi' is the number 3.14159...; give the index another name");
    check_error_with_arrays("sum(exp = 1 .. 3, 1)", 5, "'exp' is the name of a function; give the index another name");
    check_error_with_arrays("sum(i = 1 .. 3, i')", 17, "i is an index and has no velocity; only coordinates have one");
    check_error_with_arrays(
        "sum(i = 1 .. 3, x[i]) + x[i]", 27,
        "unknown name 'i' in the Lagrangian; declared: half, m, mass[i], n, omega, q, q', t, x[i], x[i]'.");
}

TEST_CASE("sums and brackets that are not written as such come with their form") {
    const std::string form = "a sum is written sum(i = 1 .. n, formula)";
    check_error_with_arrays("sum(x[1])", 5, form);
    check_error_with_arrays("sum(i, 1, n, x[i])", 5, form);
    check_error_with_arrays("sum(i = 1, n, x[i])", 10, form);
    check_error_with_arrays("sum(i = 1 .. n)", 15, form);
    check_error_with_arrays("sum i", 1, "sum needs parentheses: write sum(i = 1 .. n, formula)");
    check_error_with_arrays("mod", 1, "mod needs parentheses: write mod(a, b)");
    check_error_with_arrays("mod(3)", 6, "a remainder is written mod(a, b)");
    check_error_with_arrays("sum(i = 1 .. n, x[i]", 4, "this ( is not closed: add a )");
    check_error_with_arrays("x[1", 2, "this [ is not closed: add a ]");
    check_error_with_arrays("(x[1)", 5, "this ) closes nothing: a ] is missing before it");
    check_error_with_arrays("x", 1, "x is an array: write x[1], or x[i] in a sum over i");
    check_error_with_arrays("x'[1]", 1, "the prime stands after the brackets: write x[...]'");
    check_error_with_arrays("x[1]''", 6, "x[...]'' is an acceleration; formulas have positions and velocities only");
    check_error_with_arrays("x[1] '", 6, "a prime ' belongs directly after the name of a coordinate");
    check_error_with_arrays("x[1, 2]", 2, "an array has one index: write x[i]");
    check_error_with_arrays("q[1]", 2, "q is a coordinate, not an array: write q without brackets");
    check_error_with_arrays("mass[1]'", 1, "mass is a parameter and has no velocity; only coordinates have one");
    check_error_with_arrays("t'", 1, "t is the time and has no velocity; only coordinates have one");
    check_error_with_arrays("x[1]q", 5, "missing operator: write ]*q");
    check_error("[q + 1]", 1, "unexpected character '[' in the Lagrangian: write ( instead");
    check_error("(q + 1]", 7, "unexpected character ']' in the Lagrangian: write ) instead");
    check_error("m = q", 3, "unexpected character '=' in the Lagrangian: a formula is one side only");
    check_error("1..q", 2,
                "unexpected character '..' in the Lagrangian: two points stand only in a sum, as in "
                "sum(i = 1 .. n, formula)");
    check_error(
        "sin(q, 1)", 6,
        "unexpected character ',' in the Lagrangian: decimals have a point, and functions have no more arguments");
}

TEST_CASE("the time needs a declaration") {
    check_error("q*cos(t)", 7, "the scene declares no time: add the line time = \"t\" before its first [table]");
    CHECK(parse_with_arrays("x[1]*cos(t)").is_equal(x[0] * cos(t)));
}

TEST_CASE("what sums write out is bounded" * doctest::test_suite("slow")) {
    const std::string message = "the formulas of the scene, their sums written out, have more than 2000000 operations";
    CHECK(error_of("sum(i = 1 .. 10^9, q)").find(message + " (i = ") != std::string::npos);
    CHECK(error_of("sum(i = 1 .. 9999, sum(j = 1 .. 9999, 0))").find(message) != std::string::npos);
    CHECK(parse("sum(i = 1 .. 100000, q)").is_equal(100000 * q));
}
