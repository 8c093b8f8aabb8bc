// SPDX-License-Identifier: GPL-2.0-or-later
// Systems in which each body pulls on all others: one formula, loops over the pairs, and a text that does not grow with
// their number.
#include "generator/mechanics/repeated/all_pairs.hpp"

#include <doctest/doctest.h>
#include <fmt/format.h>

#include "analysis/accuracy/taken_steps.hpp"
#include "analysis/exact_start.hpp"
#include "tests/scenes/scenes.hpp"

using namespace lobatto;

namespace {

// Bodies on a helix, all of different masses, which are parameters.
Scene bodies_scene(int bodies, const std::string& constant = "") {
    std::string masses;
    for (int i = 1; i <= bodies; ++i) masses += fmt::format("{}{}", i == 1 ? "" : ", ", 0.1 + 0.01 * i * i);
    const auto coordinate = [&](const char* name, const char* position) {
        return fmt::format("{} = {{ count = {}, position = \"{}\", velocity = \"cos(3*i)/5\" }}\n", name, bodies,
                           position);
    };
    const std::string n = std::to_string(bodies);
    return test::scene_of("sum(i = 1 .. " + n + ", m[i]*(x[i]'^2 + y[i]'^2 + z[i]'^2)/2) + sum(i = 2 .. " + n +
                              ", sum(j = 1 .. i - 1, m[i]*m[j]/sqrt((x[i] - x[j])^2 + (y[i] - y[j])^2 + "
                              "(z[i] - z[j])^2)))",
                          coordinate("x", "cos(i)") + coordinate("y", "sin(i)") + coordinate("z", "i/4"), 4,
                          "m = { value = [" + masses + "]" + constant + " }");
}

Element element_of(const std::vector<std::vector<int>>& rows) {
    Element element;
    for (std::size_t j = 0; j < rows.front().size(); ++j) element.x.emplace_back("x" + std::to_string(j));
    element.rows = rows;
    element.coefficients.resize(rows.size());
    return element;
}

std::vector<std::vector<int>> pairs_among(int bodies) {
    std::vector<std::vector<int>> rows;
    for (int apart = 1; apart < bodies; ++apart)
        for (int i = 0; i + apart < bodies; ++i) rows.push_back({i, i + apart, bodies + i + apart, bodies + i});
    return rows;
}

}  // namespace

TEST_CASE("all pairs are told, whatever the order of rows and variables") {
    const auto pairs = all_pairs(element_of(pairs_among(9)));
    REQUIRE(pairs);
    CHECK(pairs->bodies == 9);
    const bool of_second[] = {false, true, true, false};
    for (std::size_t j = 0; j < 4; ++j) {
        CHECK(pairs->variables[j].begin == (j < 2 ? 0 : 9));
        CHECK(pairs->variables[j].of_second == of_second[j]);
    }
    std::vector<std::vector<int>> reversed = pairs_among(9);
    for (std::vector<int>& row : reversed) row = {row[1], row[0], row[3], row[2]};
    REQUIRE(all_pairs(element_of(reversed)));
    CHECK(all_pairs(element_of(reversed))->variables[0].of_second);
}

TEST_CASE("rows that are not all pairs are not taken for them") {
    CHECK_FALSE(all_pairs(element_of(pairs_among(fewest_bodies - 1))));
    std::vector<std::vector<int>> one_twice = pairs_among(9);
    one_twice.back() = one_twice.front();
    CHECK_FALSE(all_pairs(element_of(one_twice)));
    std::vector<std::vector<int>> elsewhere = pairs_among(9);
    elsewhere[5][2] += 1;
    CHECK_FALSE(all_pairs(element_of(elsewhere)));
    std::vector<std::vector<int>> one_missing = pairs_among(9);
    one_missing.pop_back();
    CHECK_FALSE(all_pairs(element_of(one_missing)));
    Element of_pairs = element_of(pairs_among(9));  // a number that belongs to no body
    of_pairs.a.emplace_back("a0");
    for (std::size_t r = 0; r < of_pairs.rows.size(); ++r) of_pairs.coefficients[r].push_back(GiNaC::numeric(long(r)));
    CHECK_FALSE(all_pairs(of_pairs));
}

TEST_CASE("steps and Jacobians of bodies in loops, or in tables, are those of the equations" *
          doctest::test_suite("slow")) {
    for (const char* constant : {"", ", constant = true"}) {
        const Derivation derivation = derive(bodies_scene(12, constant));
        const KernelSource source = emit(derivation);
        CHECK(source.header.find("for (int other = body + 1; other < 12; ++other)") != std::string::npos);
        CHECK(source.header.find("RowOfFull<36>") != std::string::npos);
        const Kernel kernel = test::kernel_in_own_cache(derivation, Precision::double_);
        const StartIn<double> start = start_in<double>(ExactStart(derivation.scene), kernel, 0.02);
        CHECK(trajectory_leaves<double>(derivation, kernel, start.parameters, start.q, start.p, 0.02) < 4);
        if (*constant) continue;
        const Kernel exact = test::kernel_in_own_cache(derivation, Precision::quadruple);
        const StartIn<__float128> at = start_in<__float128>(ExactStart(derivation.scene), exact, 0.02);
        CHECK(jacobian_defect(derivation, exact, at.parameters, at.q, at.p, 0.02) < 1e-12);
    }
}

TEST_CASE("bodies in loops beside coordinates of their own, whose matrix has zeros") {
    const std::string pairs =
        "sum(i = 1 .. 9, m*x[i]'^2/2) + a'^2/2 - a^4 - sum(i = 2 .. 9, sum(j = 1 .. i - 1, m^2*sqrt(1 + (x[i] - "
        "x[j])^2)))";
    const Derivation derivation = derive(test::scene_of(
        pairs, "a = { position = 1, velocity = 0 }\nx = { count = 9, position = \"i^2/9\", velocity = 0 }", 4,
        "m = 0.3"));
    const std::string header = emit(derivation).header;
    CHECK(header.find("other < 9; ++other, ++r)") != std::string::npos);
    const Kernel kernel = test::kernel_in_own_cache(derivation, Precision::double_),
                 exact = test::kernel_in_own_cache(derivation, Precision::quadruple);
    const StartIn<double> start = start_in<double>(ExactStart(derivation.scene), kernel, 0.05);
    CHECK(trajectory_leaves<double>(derivation, kernel, start.parameters, start.q, start.p, 0.05) < 4);
    const StartIn<__float128> at = start_in<__float128>(ExactStart(derivation.scene), exact, 0.05);
    CHECK(jacobian_defect(derivation, exact, at.parameters, at.q, at.p, 0.05) < 1e-12);
}

TEST_CASE("second derivatives that cancel between formulas are in no loop") {
    const Scene scene = test::scene_of(
        "sum(i = 1 .. 9, x[i]'^2/2) - sum(i = 1 .. 8, (x[i] - x[i+1])^4) + sum(i = 1 .. 8, x[i]^4 - 4*x[i]^3*x[i+1] + "
        "6*x[i]^2*x[i+1]^2 - 4*x[i]*x[i+1]^3)",
        "x = { count = 9, position = \"i/10\", velocity = 0 }", 4);
    const Derivation derivation = derive(scene);
    CHECK_FALSE(derivation.structure.looped);
    const Kernel kernel = test::kernel_in_own_cache(derivation, Precision::double_);
    const StartIn<double> start = start_in<double>(ExactStart(scene), kernel, 0.01);
    CHECK(trajectory_leaves<double>(derivation, kernel, start.parameters, start.q, start.p, 0.01) < 4);
}

TEST_CASE("parameters may have the names that loops give to what varies") {
    const Scene scene = test::scene_of("sum(i = 1 .. 9, m[i]*x[i]'^2/2 - m[i]*a0*x0*x[i]^4)",
                                       "x = { count = 9, position = \"i\", velocity = 0 }", 4,
                                       "a0 = 2\nx0 = 3\nm = [1, 2, 3, 4, 5, 6, 7, 8, 9]");
    const Kernel kernel = test::kernel_in_own_cache(derive(scene), Precision::double_);
    const StartIn<double> start = start_in<double>(ExactStart(scene), kernel, 0.001);
    CHECK(trajectory_leaves<double>(derive(scene), kernel, start.parameters, start.q, start.p, 0.001) < 4);
}

TEST_CASE("the text of a kernel does not grow with the number of pairs" * doctest::test_suite("slow")) {
    const auto size = [](int bodies) { return static_cast<double>(emit(derive(bodies_scene(bodies))).header.size()); };
    const double of_11 = size(11), of_14 = size(14), of_17 = size(17);
    CHECK(of_17 - of_14 < 1.2 * (of_14 - of_11));
}
