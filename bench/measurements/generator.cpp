// SPDX-License-Identifier: GPL-2.0-or-later
// How fast the generator itself is: from scene text to kernel text, and to a compiled kernel, as a table in Markdown.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "analysis/kernel/kernel_of.hpp"
#include "generator/pipeline.hpp"

using namespace lobatto;

namespace {

struct Measured {
    double derive = 0, compile = 0;              // seconds
    long bytes = 0, operations = 0, memory = 0;  // of the header; written; kilobytes at most
};

double seconds_since(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// In a process of its own, for its memory: the best of some derivations, one cold compilation.
Measured measure(const Source& source) {
    int pipe_ends[2];
    if (pipe(pipe_ends) != 0) std::abort();
    const pid_t child = fork();
    if (child == 0) {
        Measured result{1e9, 1e9, 0, 0, 0};
        KernelSource kernel;
        for (int repetition = 0; repetition < 5; ++repetition) {
            const auto start = std::chrono::steady_clock::now();
            kernel = emit(derive_kernel(read_scene(source)));
            result.derive = std::min(result.derive, seconds_since(start));
        }
        rusage usage{};
        getrusage(RUSAGE_SELF, &usage);
        result.memory = usage.ru_maxrss;
        result.bytes = static_cast<long>(kernel.header.size());
        result.operations = kernel.report.back().after.total();
        for (int repetition = 0; repetition < 3; ++repetition) {
            std::string folder = (std::filesystem::temp_directory_path() / "lobatto-bench-XXXXXX").string();
            if (mkdtemp(folder.data()) == nullptr) std::abort();
            setenv("LOBATTO_CACHE_DIR", folder.c_str(), 1);
            result.compile = std::min(result.compile, compile(translation_of(kernel, Precision::double_)).seconds);
            std::filesystem::remove_all(folder);
        }
        const bool written = write(pipe_ends[1], &result, sizeof result) == sizeof result;
        std::_Exit(written ? 0 : 1);
    }
    close(pipe_ends[1]);
    Measured result;
    const bool known = read(pipe_ends[0], &result, sizeof result) == sizeof result;
    close(pipe_ends[0]);
    int status = 0;
    waitpid(child, &status, 0);
    if (!known || status != 0) {
        fmt::print(stderr, "{}: failed\n", source.path());
        std::exit(1);
    }
    return result;
}

void print_row(const std::string& name, std::size_t coordinates, const Measured& m, const std::string& target) {
    fmt::print("| {} | {} | {:.3f} | {} | {:.1f} | {:.0f} | {} | {:.2f} |\n", name, coordinates, m.derive, target,
               static_cast<double>(m.memory) / 1024, static_cast<double>(m.bytes) / 1024, m.operations, m.compile);
    std::fflush(stdout);
}

// A chain with fixed ends: the outer springs by themselves.
Source fixed_chain(int n) {
    return Source("chain.toml", fmt::format("lagrangian = \"sum(i=1..n, x[i]'^2/2) - sum(i=1..n-1, (x[i+1]-x[i])^2/2 + "
                                            "beta*(x[i+1]-x[i])^4/4) - x[1]^2/2 - x[n]^2/2\"\n[coordinates]\n"
                                            "x = {{ count = \"n\", position = \"sin(pi*i/(n+1))\", velocity = 0 }}\n"
                                            "[parameters]\nn = {{ value = {}, constant = true }}\nbeta = 0.3\n"
                                            "[run]\nstep = 0.1\nuntil = 1\n",
                                            n));
}

// Bodies in space, each of which pulls on all others.
Source bodies(int n) {
    return Source("bodies.toml",
                  fmt::format("lagrangian = \"sum(i=1..n, m[i]*(x[i]'^2 + y[i]'^2 + z[i]'^2)/2) + sum(i=2..n, "
                              "sum(j=1..i-1, m[i]*m[j]/sqrt((x[i]-x[j])^2 + (y[i]-y[j])^2 + (z[i]-z[j])^2)))\"\n"
                              "[coordinates]\nx = {{ count = {0}, position = \"cos(i)\", velocity = 0 }}\n"
                              "y = {{ count = {0}, position = \"sin(i)\", velocity = 0 }}\n"
                              "z = {{ count = {0}, position = \"i/4\", velocity = 0 }}\n"
                              "[parameters]\nn = {{ value = {0}, constant = true }}\nm = [{1}]\n"
                              "[run]\nstep = 0.1\nuntil = 1\n",
                              n, fmt::join(std::vector<int>(static_cast<std::size_t>(n), 1), ", ")));
}

// The processor's name, for the reader of the table.
std::string processor() {
    std::ifstream file("/proc/cpuinfo");
    for (std::string line; std::getline(file, line);)
        if (line.rfind("model name", 0) == 0) return line.substr(line.find(':') + 2);
    return "an unknown processor";
}

}  // namespace

int main() {
    const std::string head =
        "| scene | coordinates | scene to kernel text, s | target, s | memory, MB | text, kB | operations written | "
        "cold "
        "compile, s |\n|---|---|---|---|---|---|---|---|\n";
    fmt::print(
        "# How fast the generator is\n\nWritten by `cmake --build build/release --target bench_generator && "
        "build/release/bench_generator > docs/measurements/generator_speed.md` on {}, {} cores; best of five "
        "derivations, best "
        "of three cold compilations. A kernel is compiled once; then it comes from the cache.\n\n{}",
        processor(), sysconf(_SC_NPROCESSORS_ONLN), head);
    const std::vector<std::pair<std::string, std::string>> scenes = {
        {"pendulum", ""},           {"kepler", ""},       {"henon_heiles", ""},        {"double_pendulum", "0.05"},
        {"triple_pendulum", "0.2"}, {"lagrange_top", ""}, {"outer_solar_system", "1"}, {"wave_chain", "1"},
        {"fput_beta", ""},          {"pleiades", ""},     {"ten_link_pendulum", "5"}};
    for (const auto& [name, target] : scenes) {
        const Source source = Source::read(std::string(LOBATTO_SOURCE_DIR) + "/scenes/" + name + ".toml");
        print_row(name, read_scene(source).coordinates.size(), measure(source), target);
    }
    fmt::print("\nFPUT chains of growing length:\n\n{}", head);
    for (const int n : {32, 64, 128, 256, 512, 1024})
        print_row(fmt::format("chain of {}", n), static_cast<std::size_t>(n), measure(fixed_chain(n)),
                  n == 256 ? "1" : "");
    fmt::print("\nBodies that all pull on each other:\n\n{}", head);
    for (const int n : {10, 20, 40, 200})
        print_row(fmt::format("{} bodies", n), static_cast<std::size_t>(3 * n), measure(bodies(n)),
                  n == 40    ? "1"
                  : n == 200 ? "10"
                             : "");
}
