// SPDX-License-Identifier: MIT
#include "runtime/build/compile.hpp"

#include <fmt/format.h>

#include <cstring>
#include <filesystem>

#include "runtime/build/cache.hpp"
#include "runtime/build/compiler.hpp"
#include "runtime/build/process.hpp"
#include "runtime/build/recipe.hpp"
#include "runtime/error.hpp"
#include "runtime/kernel/abi.h"
#include "runtime/stopwatch.hpp"

namespace lobatto {
namespace {

constexpr int shown_lines = 40;

std::string shell_text(const std::vector<std::string>& arguments) {
    std::string text;
    for (const std::string& argument : arguments) text += (text.empty() ? "" : " ") + shell_word(argument);
    return text;
}

std::string first_lines(const std::string& output) {
    std::size_t end = 0;
    for (int line = 0; line < shown_lines && end < output.size(); ++line) {
        const std::size_t newline = output.find('\n', end);
        end = newline == std::string::npos ? output.size() : newline + 1;
    }
    std::string lines = output.substr(0, end);
    if (!lines.empty() && lines.back() != '\n') lines += '\n';
    return lines + (end < output.size() ? "[...]\n" : "");
}

// By the words of g++, then of clang++.
bool lacks_mpfr(const std::string& output) {
    for (const char* text : {"mpfr.h: No such file", "'mpfr.h' file not found"})
        if (output.find(text) != std::string::npos) return true;
    return false;
}

std::string how_it_ended(const ProcessResult& result, double seconds_limit) {
    if (result.timed_out) return fmt::format("did not finish within {} s", seconds_limit);
    if (result.signal != 0) {
        return fmt::format("was ended by signal {} ({}); a common cause is too little memory", result.signal,
                           ::strsignal(result.signal));
    }
    return fmt::format("failed with exit code {}", result.exit_code);
}

}  // namespace

Compiled build(const Recipe& recipe, const std::atomic<bool>* abandoned) {
    ProcessRequest request;
    request.arguments = recipe.arguments;
    const std::string command = shell_text(request.arguments);

    const CacheEntry entry(recipe.name,
                           fmt::format("interface: {}\ncommand: {}\ncompiler: {}processor:\n{}source:\n{}",
                                       LOBATTO_ABI_VERSION, command, recipe.identity, recipe.processor, recipe.text),
                           recipe.ending);
    if (entry.is_valid()) return {entry.object_path(), command, true, 0};

    const CacheEntry::Lock lock(entry);
    if (entry.is_valid()) return {entry.object_path(), command, true, 0};  // built by another while we waited
    const bool was_altered = entry.is_there();

    request.folder = entry.building_path();
    request.abandoned = abandoned;
    request.environment = {{"TMPDIR", request.folder}};  // what a killed compiler leaves is removed with the folder
    write_file(request.folder + "/" + recipe.source, recipe.text);
    const Stopwatch watch;
    const ProcessResult result = run_process(request);
    const double seconds = watch.seconds();
    if (result.abandoned) {
        std::error_code ignored;
        std::filesystem::remove_all(request.folder, ignored);
        throw MachineError(recipe.compiler + " was ended, since nobody waited for it");
    }
    const bool has_object = std::filesystem::exists(request.folder + "/" + recipe.object);
    if (!result.succeeded() || !has_object) {
        if (recipe.explain) recipe.explain(result.output);
        std::string kept = "Source, command and whole output are kept in " + entry.failed_path();
        try {
            write_file(request.folder + "/command", command + "\n");
            write_file(request.folder + "/output", result.output);
            entry.keep_failure();
        } catch (const MachineError& error) {
            kept = std::string("Nothing of this could be kept: ") + error.what();
        }
        const std::string how = result.succeeded() ? fmt::format("{} ended well but wrote no {}; {}",
                                                                 recipe.arguments[0], recipe.object, recipe.mend)
                                                   : how_it_ended(result, request.seconds_limit);
        throw MachineError(fmt::format("{} {}.\nCommand: {}\nIts output:\n{}{}", recipe.compiler, how, command,
                                       first_lines(result.output), kept));
    }
    entry.publish(recipe.object);
    return {entry.object_path(), command, false, seconds, was_altered};
}

Compiled compile(const Translation& translation, const std::atomic<bool>* abandoned) {
    const Compiler compiler = find_compiler(translation.quadruple);
    Recipe recipe;
    recipe.name = translation.name;
    recipe.source = translation.name + ".cpp";
    recipe.object = translation.name + ".so";
    recipe.text = translation.text;
    recipe.arguments = compile_arguments(compiler, recipe.source, recipe.object, translation);
    recipe.identity = compiler.identity;
    recipe.processor = processor_identity();
    recipe.mend = "correct the environment variable CXX, or unset it to use g++ or clang++";
    recipe.explain = [&](const std::string& output) {
        if (translation.many_digits > 0 && lacks_mpfr(output))
            throw MachineError(fmt::format(
                "numbers = \"{} digits\" needs MPFR, and {} does not find its header mpfr.h; install Debian's package "
                "libmpfr-dev (apt-get install libmpfr-dev), or choose \"double-double\" or \"quadruple\"",
                translation.many_digits, compiler.words[0]));
    };
    return build(recipe, abandoned);
}

}  // namespace lobatto
