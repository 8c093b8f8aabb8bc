// SPDX-License-Identifier: GPL-2.0-or-later
// Splines: the conditions that determine them, their derivatives, and what is wrong with a file.
#include <doctest/doctest.h>

#include <cln/cln.h>

#include <cmath>
#include <string>

#include "generator/formula/expression.hpp"
#include "generator/formula/real.hpp"
#include "generator/formula/spline.hpp"
#include "tests/support.hpp"

using namespace lobatto;

namespace {

Spline spline_from(const std::string& text) {
    return read_spline(Source("m.csv", text), "m.csv");
}
std::string error_of(const std::string& text) {
    const std::string message = test::message_of<InputError>([&] { spline_from(text); });
    return message.substr(0, message.find('\n'));
}
double at(const Spline& spline, int order, const char* u) {
    return cln::double_approx(spline(order, cln::cl_float(cln::cl_RA(u), cln::float_format(60))));
}

}  // namespace

TEST_CASE("a spline goes through its points and is smooth but for the third derivative at inner knots") {
    const Spline spline = spline_from("0 1\n1, 3\n1.5;-2\n3\t0.25\n 3.5 , 7e-1\n5,-1\n");
    const double x[] = {0, 1, 1.5, 3, 3.5, 5}, y[] = {1, 3, -2, 0.25, 0.7, -1};
    const auto& pieces = spline.coefficients();
    REQUIRE(pieces.size() == 5);
    for (std::size_t i = 0; i < 6; ++i) CHECK(spline(0, x[i]) == doctest::Approx(y[i]).epsilon(1e-14));
    const auto value = [&](std::size_t i, int order, double d) {  // of piece i, by hand
        double c[4];
        for (std::size_t k = 0; k < 4; ++k) c[k] = cln::double_approx(pieces[i][k]);
        for (int n = 0; n < order; ++n)
            for (std::size_t k = 0; k < 4; ++k) c[k] = k < 3 ? static_cast<double>(k + 1) * c[k + 1] : 0;
        return c[0] + d * (c[1] + d * (c[2] + d * c[3]));
    };
    for (std::size_t i = 0; i + 1 < 5; ++i) {
        const double h = x[i + 1] - x[i];
        for (int order = 0; order < 3; ++order)
            CHECK(value(i, order, h) == doctest::Approx(value(i + 1, order, 0)).epsilon(1e-12));
        const bool is_knot = i > 0 && i + 2 < 5;  // the first and the last inner point are none
        CHECK((std::fabs(value(i, 3, h) - value(i + 1, 3, 0)) > 1e-3) == is_knot);
        for (int order = 0; order < 4; ++order)
            CHECK(spline(order, x[i] + 0.3 * h) == doctest::Approx(value(i, order, 0.3 * h)).epsilon(1e-12));
    }
    CHECK(std::isnan(spline(0, -0.001)));
    CHECK(std::isnan(spline(0, 5.001)));
    CHECK_FALSE(spline.covers(-1));
}

TEST_CASE("two points are a line, three a parabola, four a cubic polynomial") {
    const Spline line = spline_from("1, 2\n3, 6\n"), parabola = spline_from("0, 0\n1, 1\n3, 9\n"),
                 cube = spline_from("0, 0\n1, 1\n3, 27\n4, 64\n");
    CHECK(at(line, 0, "5/2") == 5);
    CHECK(at(line, 1, "5/2") == 2);
    CHECK(at(line, 2, "5/2") == 0);
    CHECK(at(parabola, 0, "5/2") == doctest::Approx(6.25).epsilon(1e-15));
    CHECK(at(parabola, 2, "1/2") == doctest::Approx(2).epsilon(1e-15));
    CHECK(at(cube, 0, "1/2") == doctest::Approx(0.125).epsilon(1e-15));
    CHECK(at(cube, 1, "7/2") == doctest::Approx(36.75).epsilon(1e-15));
    CHECK(at(cube, 3, "2") == doctest::Approx(6).epsilon(1e-15));
}

TEST_CASE("expressions of tables are differentiated order by order, with the chain rule") {
    const int number = number_of(spline_from("0, 0\n1, 1\n3, 27\n4, 64\n"));
    CHECK(number == number_of(spline_from("0, 0\n1, 1\n3, 27\n4, 64\n")));
    CHECK(number != number_of(spline_from("0, 0\n1, 1\n3, 27\n4, 65\n")));
    const GiNaC::symbol q("q");
    const GiNaC::ex value = table_value(number, 0, GiNaC::ex(2 * q));
    CHECK(value.diff(q).is_equal(2 * table_value(number, 1, GiNaC::ex(2 * q))));
    CHECK(value.diff(q, 3).is_equal(8 * table_value(number, 3, GiNaC::ex(2 * q))));
    CHECK(value.diff(q, 4).is_zero());
    // (2 q)^3 has the derivative 24 q^2.
    CHECK(real_value(value.diff(q), {{q, GiNaC::numeric(3, 4)}}).to_double() == doctest::Approx(13.5).epsilon(1e-15));
    CHECK(test::message_of<NoValue>([&] {
              static_cast<void>(real_value(value, {{q, GiNaC::numeric(3)}}));
          }) == "6 lies outside of the table m.csv, which goes from 0 to 4");
}

TEST_CASE("a bad file is told with line and column") {
    CHECK(error_of("0, 1\n1 2 3\n") == "m.csv:2:5: a line has two numbers, an argument and its value, and no more");
    CHECK(error_of("0, 1\n1\n") ==
          "m.csv:2:2: the value is missing, or is not a finite number such as 1.25 or 1e-3: a line has two of them");
    CHECK(error_of("0, 1\nx, 2\n") ==
          "m.csv:2:1: the argument is missing, or is not a finite number such as 1.25 or 1e-3: a line has two of them");
    CHECK(error_of("t, M\nalso a heading\n1, 2\n") ==
          "m.csv:2:1: the argument is missing, or is not a finite number such as 1.25 or 1e-3: a line has two of them");
    CHECK(error_of("0, 1\n0.0, 2\n") ==
          "m.csv:2:1: arguments must ascend: this one is not above that of the line before");
    CHECK(error_of("0, 1e999\n1, 1\n") == "m.csv:1:4: this number is beyond 1e-300 to 1e300");
    CHECK(error_of("0, 1e9999\n1, 1\n").starts_with("m.csv:1:4: the value is missing"));
    CHECK(error_of("0, nan\n1, 1\n").starts_with("m.csv:1:4: the value is missing"));
    for (const char* first : {"nan, 2", "O.5, 1", "\"0\", 1", "x; 1e3"})  // neither a heading nor two numbers
        CHECK(error_of(std::string(first) + "\n1, 2\n2, 3\n").starts_with("m.csv:1:1: the argument is missing"));
    for (const char* first : {"time, 2nd torque", "t M", "\"time (s)\"\t\"torque\""})
        CHECK(spline_from(std::string(first) + "\n1, 2\n2, 3\n").x().size() == 2);
    CHECK(error_of("t, M\n1, 2\n") == "m.csv:2:1: a table needs two points or more, one a line: 0.5, 1.25");
    CHECK(error_of("") == "m.csv:1:1: a table needs two points or more, one a line: 0.5, 1.25");
    std::string many;
    for (int i = 0; i <= 10000; ++i) many += std::to_string(i) + ", 0\n";
    CHECK(error_of(many) == "m.csv:10001:1: more than 10000 points; leave some out");
}

TEST_CASE("a table is a file beside its scene, of the right form") {
    const test::TemporaryFolder folder;
    test::write_text(folder / "m.csv", "0, 1\n1, 2\n");
    test::write_text(folder / "bad.csv", "0, 1\n1\n");
    const std::string path = folder / "scene.toml";
    const auto error_with = [&](const std::string& formula) {
        Names names;
        names.add_time("t", GiNaC::symbol("t"));
        const Source source(path, formula);
        Text text{formula, {}};
        for (int column = 1; std::ssize(text.at) <= std::ssize(formula); ++column) text.at.push_back({1, column});
        const std::string message = test::message_of<InputError>([&] {
            parse_expression(source, text, {&names, "the force", true, {}});
        });
        return message.substr(0, message.find('\n'));
    };
    const std::string begin = path + ":1:";
    CHECK(error_with("table(\"none.csv\", t)") ==
          begin + "8: there is no file " + (folder / "none.csv").string() + " for this table");
    CHECK(error_with("table(\"../m.csv\", t)").starts_with(begin + "8: a table lies in the folder of its scene"));
    CHECK(error_with("table(\"/etc/passwd\", t)").starts_with(begin + "8: a table lies in the folder of its scene"));
    CHECK(error_with("table(\"a/../../m.csv\", t)").starts_with(begin + "8: a table lies in the folder of its scene"));
    CHECK(error_with("table(\".\", t)").find("is no file that a table can be read from") != std::string::npos);
    std::filesystem::create_symlink("/etc/passwd", folder / "link.csv");
    CHECK(error_with("table(\"link.csv\", t)").find("is a link to a file outside of the folder of the scene") !=
          std::string::npos);
    std::filesystem::create_symlink("m.csv", folder / "near.csv");
    CHECK(error_with("table(\"near.csv\", t)") == "");
    CHECK(error_with("table(\"\", t)") == begin + "8: the file of a table has no name");
    CHECK(error_with("table(\"a\\\\b\", t)") ==
          begin + "8: the name of a table holds no control characters and no backslashes");
    CHECK(
        error_with("table(\"bad.csv\", t)").starts_with((folder / "bad.csv").string() + ":2:2: the value is missing"));
    CHECK(error_with("table(\"m.csv, t)") == begin + "7: these quotes are not closed: add a \"");
    CHECK(error_with("table(m, t)") ==
          begin + "7: measured values are written table(\"file.csv\", a), with the name of a file in quotes");
    CHECK(error_with("table(\"m.csv\")") == begin + "14: measured values are written table(\"file.csv\", a)");
    CHECK(error_with("table(\"m.csv\", 2)") ==
          begin +
              "1: the force has no finite real value here: 2 lies outside of the table m.csv, which goes from 0 to 1");
    CHECK(error_with("t + \"m.csv\"").find("unexpected character '\"'") != std::string::npos);
}
