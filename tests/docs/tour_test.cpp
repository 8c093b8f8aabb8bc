// SPDX-License-Identifier: GPL-2.0-or-later
// docs/tour.md is what the program says today: its excerpts are made here, and compared. With LOBATTO_WRITE_TOUR=1 in
// the environment the test writes the file instead.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <regex>
#include <sstream>

#include "tests/support.hpp"

using namespace lobatto;

namespace {

const std::filesystem::path tree = LOBATTO_SOURCE_DIR;

std::string output_of(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), LOBATTO_PROGRAM);
    const test::Finished done = test::run(arguments);
    INFO(done.err);
    REQUIRE(done.exit_code == 0);
    return done.out;
}

std::vector<std::string> lines_of(const std::string& text) {
    std::vector<std::string> lines;
    std::istringstream stream(text);
    for (std::string line; std::getline(stream, line);) lines.push_back(line);
    return lines;
}

// The lines from the first that begins with `from` to before the next one that begins with `to`; blanks at the end are
// left out.
std::string excerpt(const std::string& text, const std::string& from, const std::string& to) {
    std::string part;
    bool inside = false;
    for (const std::string& line : lines_of(text)) {
        if (inside && line.starts_with(to)) break;
        inside = inside || line.starts_with(from);
        if (inside) part += line + "\n";
    }
    INFO(from);
    REQUIRE(!part.empty());
    while (part.ends_with("\n\n")) part.pop_back();
    return part;
}

// Times differ from machine to machine, and so does the last digit of what rounding leaves.
std::string without_times(const std::string& text) {
    std::string kept;
    for (const std::string& line : lines_of(text))
        if (!std::regex_search(line, std::regex("time per step|derived in|derived and|symplectic defect")))
            kept += line + "\n";
    return kept;
}

std::string block(const std::string& language, const std::string& text) {
    return "```" + language + "\n" + text + "```\n";
}

std::string tour() {
    const test::TemporaryFolder folder;
    const std::string scene = tree / "scenes/pendulum.toml";
    std::string text =
        "# A tour: the pendulum from its Lagrangian to its motion\n\n"
        "Every excerpt below is real output. `tests/docs/tour_test.cpp` compares this page with what the program "
        "says today.\n\n"
        "## 1. The scene\n\nA person writes the Lagrangian and where the motion starts (`scenes/pendulum.toml`). "
        "`generator/scene/` reads it.\n\n";
    text += block("toml", test::read_file(scene));
    const std::string derived = output_of({"derive", scene});
    text +=
        "\n## 2. The derivation\n\n`generator/mechanics/` takes the Lagrangian apart and derives the discrete "
        "equations. "
        "`lobatto derive` prints them; this is the discrete Lagrangian and its equations.\n\n";
    text += block("", excerpt(derived, "The discrete Lagrangian", "The full system"));
    text +=
        "\n## 3. What the scene needs\n\n`generator/mechanics/structure/structure.cpp` looks for what the kernel may "
        "leave out. "
        "`lobatto check` says what it found.\n\n";
    text += block("", excerpt(output_of({"check", scene}), "Found and used", "The kernel"));
    const std::string emitted = output_of({"emit", scene, "--no-support", "-o", folder.string()});
    text +=
        "\n## 4. The graph and its passes\n\n`generator/programs/` writes down what the kernel computes, as one graph. "
        "`generator/graph/` rewrites it pass by pass. After each pass all values must be the same to 40 digits.\n\n";
    text += block("", excerpt(emitted, "pass", "Wrote"));
    const std::string header = test::read_file(folder / "pendulum.hpp");
    text +=
        "\n## 5. The kernel\n\n`generator/emit/` prints the graph as C++. This function is evaluated at every node of "
        "a step.\n\n";
    text += block("cpp", excerpt(header, "    // (D1) At one node", "    // (D1) W = M^-1"));
    text +=
        "\n## 6. The step\n\nThe support headers solve the equations of a step with that function. The equations stand "
        "in "
        "`runtime/kernel/iteration/stage_equations.hpp`:\n\n";
    text += block("cpp", excerpt(test::read_file(tree / "runtime/kernel/iteration/stage_equations.hpp"), "    // (D12)",
                                 "    // (D13)"));
    text +=
        "\nA textbook would print the whole integrator like "
        "[generated/plain/pendulum.hpp](../generated/plain/pendulum.hpp), which `lobatto emit --plain` writes.\n";
    text +=
        "\n## 7. The run\n\n`runtime/build/` compiles the kernel and loads it; `runtime/run/` takes the steps; "
        "`analysis/accuracy/` says how good they are.\n\n";
    text += block("", without_times(output_of({"run", scene, "-o", folder / "pendulum.csv"})));
    text += "\nThe first rows of the trajectory:\n\n";
    // Last digits differ between processors with and without fused operations.
    std::string rows;
    int count = 0;
    for (const std::string& line : lines_of(test::read_file(folder / "pendulum.csv"))) {
        if (line.starts_with("#") || count++ == 4) continue;
        std::istringstream fields(line);
        std::string row;
        for (std::string field; std::getline(fields, field, ',');)
            row += (row.empty() ? "" : ",") + (count == 1 ? field : fmt::format("{:.9g}", std::stod(field)));
        rows += row + "\n";
        if (count == 4) break;
    }
    text += block("", rows);
    text +=
        "\n## 8. The proof\n\n`lobatto verify` derives everything a second time and puts the steps that were taken "
        "into "
        "the equations they must solve (`generator/check/`, `analysis/accuracy/taken_steps.cpp`).\n\n";
    std::string claims;
    for (const std::string& line : lines_of(output_of({"verify", scene})))
        if (line.find("exact  ok") != std::string::npos) claims += line + "\n";
    text += block("", claims);
    return std::regex_replace(text, std::regex("(" + folder.string() + "|" + tree.string() + ")/"), "");
}

}  // namespace

TEST_CASE("docs/tour.md is what the program says of the pendulum") {
    const std::string today = tour();
    if (std::getenv("LOBATTO_WRITE_TOUR") != nullptr) std::ofstream(tree / "docs/tour.md") << today;
    CHECK(test::read_file(tree / "docs/tour.md") == today);
}
