// SPDX-License-Identifier: MIT
#include "runtime/build/compiler.hpp"

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>

#include "runtime/error.hpp"

namespace lobatto {
namespace {

std::string environment_variable(const char* name) {
    const char* value = std::getenv(name);
    return value == nullptr ? "" : value;
}

bool is_program(const std::string& path) {
    struct stat status;
    return ::stat(path.c_str(), &status) == 0 && S_ISREG(status.st_mode) && ::access(path.c_str(), X_OK) == 0;
}

bool is_clang(const std::string& path) {
    std::error_code ignored;
    const std::string file = std::filesystem::canonical(path, ignored).filename();
    return (std::filesystem::path(path).filename().string() + " " + file).find("clang") != std::string::npos;
}

[[noreturn]] void fail_without_compiler(bool quadruple) {
    const std::string wanted = quadruple ? "g++ (quadruple precision needs it)" : "g++ and clang++";
    throw MachineError(
        fmt::format("no C++ compiler: looked for {} in PATH ({}); install one (apt-get install g++) or "
                    "name one in the environment variable CXX",
                    wanted, environment_variable("PATH")));
}

}  // namespace

std::optional<std::string> find_program(const std::string& name) {
    if (name.find('/') != std::string::npos) {
        return is_program(name) ? std::optional(std::filesystem::absolute(name).string()) : std::nullopt;
    }
    std::istringstream folders(environment_variable("PATH"));
    for (std::string folder; std::getline(folders, folder, ':');) {
        const std::string path = std::filesystem::absolute(folder.empty() ? "." : folder) / name;
        if (is_program(path)) return path;
    }
    return std::nullopt;
}

std::string identity_of(const std::string& path) {
    std::error_code ignored;
    const std::string file = std::filesystem::canonical(path, ignored);
    struct stat status {};
    ::stat(path.c_str(), &status);
    return fmt::format("{} = {}, {} bytes, changed {}.{:09}\n", path, file, status.st_size, status.st_mtim.tv_sec,
                       status.st_mtim.tv_nsec);
}

Compiler find_compiler(bool quadruple) {
    Compiler compiler;
    std::istringstream words(environment_variable("CXX"));
    for (std::string word; words >> word;) compiler.words.push_back(word);

    if (compiler.words.empty()) {
        auto program = find_program("g++");
        if (!program && !quadruple) program = find_program("clang++");
        if (!program) fail_without_compiler(quadruple);
        compiler.words = {*program};
    } else {
        const auto program = find_program(compiler.words[0]);
        if (!program) {
            throw MachineError(
                fmt::format("the C++ compiler '{}' that the environment variable CXX names is not a program in PATH "
                            "({}); correct CXX, "
                            "or unset it to use g++ or clang++",
                            compiler.words[0], environment_variable("PATH")));
        }
        compiler.words[0] = *program;
    }
    for (const char* inexact :
         {"-ffast-math", "-funsafe-math-optimizations", "-ffinite-math-only", "-fassociative-math", "-freciprocal-math",
          "-fsingle-precision-constant", "-mpc32", "-mpc64"})
        if (std::find(compiler.words.begin(), compiler.words.end(), inexact) != compiler.words.end())
            throw MachineError(
                fmt::format("the environment variable CXX asks for {}, which changes the results of "
                            "kernels; leave it out",
                            inexact));
    for (const std::string& word : compiler.words) {
        const auto program = word[0] == '-' ? std::nullopt : find_program(word);
        if (!program) {
            compiler.identity += word + "\n";
            continue;
        }
        if (quadruple && is_clang(*program)) {
            throw MachineError(
                fmt::format("quadruple precision needs g++ and its libquadmath, but the environment variable CXX names "
                            "{}; set CXX=g++",
                            *program));
        }
        compiler.identity += identity_of(*program);
    }
    return compiler;
}

std::vector<std::string> compile_arguments(const Compiler& compiler, const std::string& source,
                                           const std::string& object, const Translation& translation) {
    std::vector<std::string> arguments = compiler.words;
    // -ffp-contract=off: products and sums are fused where the text says so (`fused`), nowhere else; so g++ and clang++
    // give the same bits on one kind of processor, and the error-free sums of a kernel keep their proof (adr/0002).
    // -ffast-math is never among the flags, and refused in CXX: it would let the compiler simplify x - x, and so the
    // checks for finite numbers, away.
    //
    // -fpeel-loops: loops over the nodes and coordinates of small systems are written out, as with -O3, which takes
    // half as long again. clang++ does so anyway. The general form (steppers/general.hpp) compiles in a sixth less
    // time, to the same speed, where only loops of up to 60 instructions are, not 200.
    //
    // A level of optimisation among the words of CXX takes the place of these; not -Ofast, which is -ffast-math.
    const bool has_level = std::any_of(arguments.begin(), arguments.end(), [](const std::string& word) {
        return word.starts_with("-O") && word != "-Ofast";
    });
    if (!has_level) {
        arguments.push_back("-O2");
        if (!is_clang(*find_program(compiler.words.front()))) {
            arguments.push_back("-fpeel-loops");
            if (translation.short_loops)
                arguments.insert(arguments.end(), {"--param", "max-completely-peeled-insns=60"});
        }
    }
    for (const char* flag :
         {"-march=native", "-fno-math-errno", "-ffp-contract=off", "-fPIC", "-shared", "-fvisibility=hidden"})
        arguments.push_back(flag);
    if (translation.quadruple) {
        for (const char* flag : {"-std=gnu++17", "-fext-numeric-literals", "-DLOBATTO_USE_FLOAT128="})
            arguments.push_back(flag);
    } else {
        arguments.push_back("-std=c++17");
    }
    for (const std::string& word : {source, std::string("-o"), object}) arguments.push_back(word);
    if (translation.quadruple) arguments.push_back("-lquadmath");
    if (translation.many_digits > 0) arguments.push_back("-lmpfr");
    return arguments;
}

std::string shell_word(const std::string& word) {
    const bool is_plain = word.find_first_not_of(
                              "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789"
                              "_-+=./:,") == std::string::npos;
    if (is_plain && !word.empty()) return word;
    std::string quoted = "'";
    for (const char c : word) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return quoted + "'";
}

std::string processor_identity() {
    // The file has one paragraph a processor; the first is enough. The other lines (frequency, numbers) change.
    std::ifstream file("/proc/cpuinfo");
    std::string identity;
    for (std::string line; std::getline(file, line) && !line.empty();) {
        for (const char* key : {"vendor_id", "cpu family", "model", "stepping", "flags", "CPU implementer",
                                "CPU variant", "CPU part", "Features"}) {
            if (line.starts_with(key)) {
                identity += line + "\n";
                break;
            }
        }
    }
    return identity;
}

}  // namespace lobatto
