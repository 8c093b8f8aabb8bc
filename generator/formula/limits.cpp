// SPDX-License-Identifier: GPL-2.0-or-later
// A thread looks at the clock and at /proc/self/statm twenty times a second.
#include "generator/formula/limits.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <charconv>
#include <chrono>
#include <cstdlib>
#include <fstream>

#include "generator/formula/text/source.hpp"

namespace lobatto {

namespace {

constexpr int exit_code = 3;
constexpr double most_seconds = 600, bytes_of_megabyte = 1e6;

double positive(const char* variable, double otherwise) {
    const char* text = std::getenv(variable);
    if (text == nullptr || *text == '\0') return otherwise;
    const std::string_view digits = text;
    double value = 0;
    const auto read = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (read.ec != std::errc() || read.ptr != digits.data() + digits.size() || !(value > 0))
        throw InputError(fmt::format("the environment variable {} must be a number above 0, but is '{}'", variable,
                                     printable(text)));
    return value;
}

double page_megabytes() {
    return static_cast<double>(::sysconf(_SC_PAGESIZE)) / bytes_of_megabyte;
}

double resident_megabytes() {
    std::ifstream pages("/proc/self/statm");
    double all = 0, resident = 0;
    pages >> all >> resident;
    return resident * page_megabytes();
}

}  // namespace

DerivationLimits::DerivationLimits(const std::string& scene, const std::string& task)
    : scene_(printable(scene)),
      task_(task),
      seconds_(positive("LOBATTO_DERIVATION_SECONDS", most_seconds)),
      megabytes_(positive("LOBATTO_DERIVATION_MEGABYTES",
                          static_cast<double>(::sysconf(_SC_PHYS_PAGES)) * page_megabytes() / 2)),
      watcher_([this] { watch(); }) {}

DerivationLimits::~DerivationLimits() {
    {
        const std::lock_guard lock(mutex_);
        has_ended_ = true;
    }
    ended_.notify_one();
    watcher_.join();
}

void DerivationLimits::watch() {
    const auto start = std::chrono::steady_clock::now();
    std::unique_lock lock(mutex_);
    while (!ended_.wait_for(lock, std::chrono::milliseconds(50), [this] { return has_ended_; })) {
        const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
        std::string reached;
        if (elapsed.count() > seconds_)
            reached = fmt::format("takes more than {:.6g} s (LOBATTO_DERIVATION_SECONDS)", seconds_);
        else if (resident_megabytes() > megabytes_)
            reached = fmt::format("needs more than {:.6g} MB of memory (LOBATTO_DERIVATION_MEGABYTES)", megabytes_);
        if (reached.empty()) continue;
        const std::string message = fmt::format(
            "lobatto: {}: {} {}. Its cost grows with the size of the Lagrangian, faster than in "
            "proportion: write products out less, leave terms away, or raise the environment variable\n",
            scene_, task_, reached);
        [[maybe_unused]] const ssize_t written = ::write(STDERR_FILENO, message.data(), message.size());
        ::_exit(exit_code);  // without destructors: the other thread still computes
    }
}

}  // namespace lobatto
