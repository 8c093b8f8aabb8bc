// SPDX-License-Identifier: GPL-2.0-or-later
// Terms that are not written out: the kernel is the same text, byte for byte, as where they are.
#include "generator/mechanics/repeated/unwritten.hpp"

#include <doctest/doctest.h>
#include <fmt/format.h>

#include "generator/pipeline.hpp"
#include "tests/scenes/scenes.hpp"

using namespace lobatto;

namespace {

constexpr int bodies = 14;  // 91 pairs

const char* const pair_of = "(x[i] - x[j])^2 + (y[i] - y[j])^2";

Scene scene_with(const std::string& terms) {
    std::string masses;
    for (int i = 1; i <= bodies; ++i) masses += fmt::format("{}{}", i == 1 ? "" : ", ", i * i);
    const std::string of_coordinate =
        fmt::format("= {{ count = {}, position = \"i^2/7\", velocity = \"cos(i)\" }}\n", bodies);
    const auto holds = [&](const char* name) { return terms.find(name) != std::string::npos; };
    return read_scene(Source(
        "test.toml",
        fmt::format("lagrangian = \"sum(i = 1 .. {}, m[i]*(x[i]'^2 + y[i]'^2)/2) + {}\"\n{}[coordinates]\nx {}y {}"
                    "[parameters]\nm = [{}]\n{}[run]\nstep = 0.1\nuntil = 1\n",
                    bodies, terms, holds("(t)") || holds("k*t") ? "time = \"t\"\n" : "", of_coordinate, of_coordinate,
                    masses, holds("k*") ? "k = 2\n" : "")));
}

std::string pairs(const std::string& term) {
    return fmt::format("sum(i = 2 .. {}, sum(j = 1 .. i - 1, {}))", bodies, fmt::format(fmt::runtime(term), pair_of));
}

bool same_findings(const Derivation& a, const Derivation& b) {
    bool same = a.findings.size() == b.findings.size();
    for (std::size_t i = 0; same && i < a.findings.size(); ++i)
        same = a.findings[i].name == b.findings[i].name && a.findings[i].holds == b.findings[i].holds &&
               a.findings[i].reason == b.findings[i].reason;
    return same;
}

}  // namespace

TEST_CASE("kernels and findings are the same whether terms are written out or not" * doctest::test_suite("slow")) {
    const std::string attraction = pairs("m[i]*m[j]/sqrt({})");
    for (const std::string& terms :
         {attraction, attraction + fmt::format(" - sum(i = 1 .. {}, k*x[i]^2)", bodies),      // a trap
          attraction + fmt::format(" - sum(i = 1 .. {}, k*m[i]*y[i])", bodies),               // a field
          attraction + " - k*x[3]*cos(t)", pairs("(x[i] - x[j])^4"), pairs("-k*exp(-({}))"),  // numbers; no root
          attraction + fmt::format(" - sum(i = 1 .. {}, x[i]*x[i+1]*y[i])", bodies - 1)}) {
        const Scene scene = scene_with(terms);
        const Derivation whole = derive(scene), shortened = derive_kernel(scene);
        INFO(terms);
        CHECK(whole.system.unwritten.empty());
        CHECK_FALSE(shortened.system.unwritten.empty());
        CHECK(shortened.system.hessian.entries().size() < whole.system.hessian.entries().size());
        CHECK(emit(shortened).header == emit(whole).header);
        CHECK(same_findings(shortened, whole));
    }
}

TEST_CASE("terms are written out where their formula does not tell what all of them depend on" *
          doctest::test_suite("slow")) {
    const std::string attraction = pairs("m[i]*m[j]/sqrt({})");
    for (const std::string& terms :
         {pairs("-k*(x[i] - x[j])^2"),                                         // constant second derivatives
          pairs("(x[i] - x[j])^4") + " - (" + pairs("(x[i] - x[j])^4") + ")",  // nothing is left
          pairs("m[i]*x[i]'*x[j]'*cos(x[i] - x[j])"),                          // velocities
          pairs("sin(t)/(1 + {})"),                                            // the time
          pairs("((x[i] - x[j])^2 + k*t)/(1 + {})") + " + x[1]'*y[2]^2"}) {
        const Scene scene = scene_with(terms);
        INFO(terms);
        const Derivation shortened = derive_kernel(scene);
        CHECK(shortened.system.unwritten.empty());
        CHECK(emit(shortened).header == emit(derive(scene)).header);
    }
    // Written terms that hold what others change with, and one that takes part of the others away.
    const Scene beside = scene_with(attraction + " - x[1]^4*y[2]^2 + x[1]*x[2]");
    CHECK(emit(derive_kernel(beside)).header == emit(derive(beside)).header);
    const Scene less = scene_with(pairs("(x[i] - x[j])^4") + " - (x[1] - x[2])^4");
    CHECK(emit(derive_kernel(less)).header == emit(derive(less)).header);
    // Beside velocities in forces, the general form writes all terms out.
    const Scene general = scene_with(attraction + " + x[1]'^4");
    CHECK(derive_kernel(general).system.unwritten.empty());
    CHECK(emit(derive_kernel(general)).header == emit(derive(general)).header);
}

TEST_CASE("other methods of terms that are not written out are those of all terms" * doctest::test_suite("slow")) {
    const Scene scene = scene_with(pairs("m[i]*m[j]/sqrt({})"));
    const Derivation shortened = derive_kernel(scene);
    REQUIRE_FALSE(shortened.system.unwritten.empty());
    for (const char* family : {"lobatto", "gauss", "splitting"}) {
        Method method = scene.method;
        method.family = family == std::string("lobatto") ? Family::lobatto
                        : family == std::string("gauss") ? Family::gauss
                                                         : Family::splitting;
        method.points = 6;
        Scene other = scene;
        other.method = method;
        INFO(family);
        CHECK(emit(with_method(shortened, method)).header == emit(derive(other)).header);
    }
}

TEST_CASE("a term without a value at the start is named though it is not written out") {
    const auto message_of = [](const Scene& scene) {
        try {
            derive_kernel(scene);
        } catch (const InputError& error) {
            return std::string(error.what());
        }
        return std::string("none");
    };
    Scene met = scene_with(pairs("m[i]*m[j]/sqrt({})"));
    met.initial_position[1] = met.initial_position[0];
    met.initial_position[bodies + 1] = met.initial_position[bodies];
    INFO(message_of(met));
    CHECK(message_of(met).find("m_1*m_2") != std::string::npos);
    // The term is 0 there; its second derivatives are infinite.
    Scene flat = scene_with(pairs("-sqrt({0})^3/(1 + {0})"));
    flat.initial_position[1] = flat.initial_position[0];
    flat.initial_position[bodies + 1] = flat.initial_position[bodies];
    INFO(message_of(flat));
    CHECK(message_of(flat).find("has derivatives without a value") != std::string::npos);
}
