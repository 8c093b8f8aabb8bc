// SPDX-License-Identifier: GPL-2.0-or-later
#include "bench/instructions.hpp"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <regex>
#include <sstream>

#include "analysis/kernel/kernel_of.hpp"
#include "bench/contestants/kernels.hpp"
#include "runtime/build/cache.hpp"
#include "runtime/build/compiler.hpp"
#include "runtime/build/process.hpp"
#include "runtime/error.hpp"

namespace lobatto::bench {

namespace {

const std::string stored_path = std::string(LOBATTO_SOURCE_DIR) + "/bench/instructions.csv";
const std::string head = "problem,method,step,instructions_per_step,iterations_per_step,compiler";
constexpr double largest_change = 0.02;

struct Counted {
    std::string problem, method;
    double step, instructions, iterations;  // a step
    std::string compiler;
};

struct Case {
    Method method;
    double step;
    long steps;  // enough that the start vanishes in the difference of two runs
};

// One kernel a problem, of the kind that wins the race there.
Case case_of(const Problem& problem) {
    if (problem.name == "P3") return {{Family::lobatto, 8}, 0.1, 200};
    if (problem.name == "P5") return {{Family::lobatto, 6}, 0.8, 100};
    return {{Family::lobatto, 8}, problem.name == "P4" ? 0.2 : 0.7, 500};
}

std::string run_or_fail(const std::vector<std::string>& arguments, const std::string& folder) {
    ProcessRequest request;
    request.arguments = arguments;
    request.folder = folder;
    const ProcessResult result = run_process(request);
    if (!result.succeeded()) throw MachineError(fmt::format("{} failed: {}", arguments.front(), result.output));
    return result.output;
}

std::string first_line(const std::string& text) {
    return text.substr(0, text.find('\n'));
}

// As `lobatto run` compiles, but for a processor with AVX2 and without AVX-512, which valgrind 3.19 does not know.
std::vector<std::string> portable_arguments(const Compiler& compiler, const Translation& translation) {
    auto arguments = compile_arguments(compiler, "kernel.cpp", "kernel.so", translation);
    for (std::string& argument : arguments)
        if (argument == "-march=native") argument = "-march=haswell";
    return arguments;
}

// Instructions and iterations of a run of so many steps.
std::pair<double, double> count(const Problem& problem, double step, long steps, const std::string& folder) {
    std::vector<std::string> arguments = {
        "/usr/bin/env",     "valgrind",    "--tool=callgrind",    "--callgrind-out-file=/dev/null",
        LOBATTO_RUN_KERNEL, "./kernel.so", std::to_string(steps), fmt::format("{}", step)};
    for (const auto* values : {&problem.q, &problem.p})
        for (const double value : *values) arguments.push_back(fmt::format("{}", value));
    const std::string output = run_or_fail(arguments, folder);
    std::smatch collected, iterations;
    if (!std::regex_search(output, collected, std::regex(R"(Collected : (\d+))")) ||
        !std::regex_search(output, iterations, std::regex(R"((^|\n)(\d+)\n)")))
        throw MachineError("cannot read what valgrind said: " + output);
    return {std::stod(collected[1]), std::stod(iterations[2])};
}

Counted count_case(const Problem& problem) {
    const Case chosen = case_of(problem);
    const Translation translation = translation_of(source_of(problem, chosen.method), Precision::double_);
    const Compiler compiler = find_compiler(false);
    std::string folder = (std::filesystem::temp_directory_path() / "lobatto-bench-XXXXXX").string();
    if (mkdtemp(folder.data()) == nullptr) throw MachineError("cannot create a folder in the temporary folder");
    write_file(folder + "/kernel.cpp", translation.text);
    run_or_fail(portable_arguments(compiler, translation), folder);
    const auto [once, once_iterations] = count(problem, chosen.step, chosen.steps, folder);
    const auto [twice, twice_iterations] = count(problem, chosen.step, 2 * chosen.steps, folder);
    std::filesystem::remove_all(folder);
    const double steps = static_cast<double>(chosen.steps);
    return {problem.name,
            chosen.method.name(),
            chosen.step,
            (twice - once) / steps,
            (twice_iterations - once_iterations) / steps,
            first_line(run_or_fail({compiler.words.front(), "--version"}, "/"))};
}

std::vector<Counted> read_stored() {
    std::ifstream file(stored_path);
    std::vector<Counted> all;
    std::string line;
    std::getline(file, line);
    while (std::getline(file, line)) {
        std::smatch m;
        if (std::regex_match(line, m, std::regex(R"re((P\d),"([^"]*)",([^,]*),([^,]*),([^,]*),"([^"]*)")re")))
            all.push_back({m[1], m[2], std::stod(m[3]), std::stod(m[4]), std::stod(m[5]), m[6]});
    }
    return all;
}

double change(double now, double before) {
    return now / before - 1;
}

// What changed against the stored count; true when it matters.
bool explain(const Counted& now, const std::vector<Counted>& stored) {
    for (const Counted& before : stored) {
        if (before.problem != now.problem) continue;
        if (before.method != now.method || before.step != now.step) {
            fmt::print("    stored for another kernel ({}, h = {}): store anew\n", before.method, before.step);
            return true;
        }
        const double by = change(now.instructions, before.instructions);
        if (std::fabs(by) <= largest_change) return false;
        const double by_iterations = change(now.iterations, before.iterations);
        const double by_code = change(now.instructions / now.iterations, before.instructions / before.iterations);
        fmt::print("    {:+.1f} % against {:.1f}: iterations a step {:+.1f} %, instructions an iteration {:+.1f} %\n",
                   100 * by, before.instructions, 100 * by_iterations, 100 * by_code);
        if (before.compiler != now.compiler) {
            fmt::print("    but that was counted with {}: not comparable\n", before.compiler);
            return false;
        }
        return true;
    }
    fmt::print("    nothing is stored for it\n");
    return true;
}

}  // namespace

int check_instructions(bool store) {
    const std::vector<Counted> stored = read_stored();
    bool changed = false;
    std::string text = head + "\n";
    for (const Problem& problem : problems()) {
        if (problem.positions_only) continue;
        const Counted now = count_case(problem);
        fmt::print("{} {}, h = {}: {:.1f} instructions a step, {:.2f} iterations\n", now.problem, now.method, now.step,
                   now.instructions, now.iterations);
        if (!store) changed = explain(now, stored) || changed;
        text += fmt::format("{},\"{}\",{},{:.1f},{:.3f},\"{}\"\n", now.problem, now.method, now.step, now.instructions,
                            now.iterations, now.compiler);
    }
    if (store) write_file(stored_path, text);
    if (changed)
        fmt::print(
            "If the change is meant, `lobatto bench --instructions --store` writes bench/instructions.csv anew.\n");
    return changed ? 1 : 0;
}

}  // namespace lobatto::bench
