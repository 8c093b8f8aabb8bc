// SPDX-License-Identifier: GPL-2.0-or-later
// The test program's main: several files of tests at a time, and the notes by which the launcher counts tests even when
// one of them takes the program down.
#define DOCTEST_CONFIG_IMPLEMENT
#include <doctest/doctest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <iostream>
#include <map>
#include <sstream>

#include "tests/support.hpp"

namespace {

using lobatto::test::EnvironmentVariable;

std::map<std::string, bool> files_asked_for;  // by the last query: whether they have one of the slowest tests

// A listener that need not say what it does not listen to.
class Listener : public doctest::IReporter {
    void report_query(const doctest::QueryData&) override {}
    void test_run_start() override {}
    void test_run_end(const doctest::TestRunStats&) override {}
    void test_case_start(const doctest::TestCaseData&) override {}
    void test_case_reenter(const doctest::TestCaseData&) override {}
    void test_case_end(const doctest::CurrentTestCaseStats&) override {}
    void test_case_exception(const doctest::TestCaseException&) override {}
    void subcase_start(const doctest::SubcaseSignature&) override {}
    void subcase_end() override {}
    void log_assert(const doctest::AssertData&) override {}
    void log_message(const doctest::MessageData&) override {}
    void test_case_skipped(const doctest::TestCaseData&) override {}
};

// Keeps one line in the file $LOBATTO_TEST_NOTES: tests passed, tests failed, the test that is running (nothing between
// tests).
class Notes : public Listener {
public:
    explicit Notes(const doctest::ContextOptions&) {
        if (const char* path = std::getenv("LOBATTO_TEST_NOTES")) path_ = path;
    }

    void test_case_start(const doctest::TestCaseData& test) override { write(test.m_name); }
    void test_case_end(const doctest::CurrentTestCaseStats& test) override {
        ++(test.testCaseSuccess ? passed_ : failed_);
        write("");
    }
    void report_query(const doctest::QueryData& query) override {
        for (unsigned i = 0; i < query.num_data; ++i) {
            const doctest::TestCaseData& test = *query.data[i];
            bool& is_slow = files_asked_for[test.m_file.c_str()];
            is_slow = is_slow || std::strcmp(test.m_test_suite, "slowest") == 0;
        }
    }

private:
    void write(const char* running) const {
        if (!path_.empty()) std::ofstream(path_) << passed_ << ' ' << failed_ << ' ' << running << '\n';
    }

    std::string path_;
    int passed_ = 0;
    int failed_ = 0;
};

// Files whose time is that of compilers: their kernels are compiled with -Og, which takes half of it. Nothing is fused
// or reordered (runtime/build/compiler.cpp), so they have the same bits; machines_test checks that. All other tests
// have the flags of users. A compiler that $CXX names stays as it is.
constexpr const char* compiled_quickly[] = {
    "/analysis/amplitude_test.cpp",
    "/analysis/at_rest_test.cpp",
    "/analysis/bodies_test.cpp",
    "/analysis/clock_test.cpp",
    "/analysis/companion_test.cpp",
    "/analysis/constraints_test.cpp",
    "/analysis/eliminated_test.cpp",
    "/analysis/hardest_steps_test.cpp",
    "/analysis/impacts_test.cpp",
    "/analysis/refraction_test.cpp",
    "/analysis/measured_test.cpp",
    "/analysis/near_cuts_test.cpp",
    "/analysis/pulses_test.cpp",
    "/analysis/taken_steps_test.cpp",
    "/analysis/tradeoff_kinds_test.cpp",
    "/analysis/tradeoff_test.cpp",
    "/analysis/time_coordinate_test.cpp",
    "/analysis/verdicts_test.cpp",
    "/analysis/where_it_began_test.cpp",
    "/cli/mistakes_test.cpp",
    "/cli/new_test.cpp",
    "/cli/run/columns_test.cpp",
    "/cli/run/many_digits_test.cpp",
    "/cli/run/numbers_test.cpp",
    "/cli/run/roundoff_test.cpp",
    "/cli/run/run_test.cpp",
    "/cli/stability_command_test.cpp",
    "/cli/sweep/device_test.cpp",
    "/cli/sweep/starts_test.cpp",
    "/cli/sweep/sweep_test.cpp",
    "/cli/verify_test.cpp",
    "/docs/coming_from_test.cpp",
    "/docs/scenes_test.cpp",
    "/extremes/stops_test.cpp",
    "/extremes/systems_test.cpp",
    "/extremes/walls_test.cpp",
    "/generator/mechanics/repeated/all_pairs_test.cpp",
    "/generator/mechanics/structure/hamiltonian_test.cpp",
    "/generator/mechanics/structure/shortcut_test.cpp",
    "/generator/method/splitting_test.cpp",
    "/library/comments_test.cpp",
    "/library/inputs_test.cpp",
    "/library/library_test.cpp",
    "/library/other_velocity_test.cpp",
    "/library/switches_test.cpp",
    "/runtime/kernel/clocked_lanes_test.cpp",
    "/runtime/kernel/fixed_point_test.cpp",
    "/runtime/kernel/refilled_test.cpp",
    "/runtime/measure/order_test.cpp",
    "/runtime/measure/symmetry_test.cpp",
    "/runtime/run/events_test.cpp",
    "/scenes/scenes_test.cpp",
};

class Flags : public Listener {
public:
    explicit Flags(const doctest::ContextOptions&) {}

    void test_case_start(const doctest::TestCaseData& test) override {
        if (is_chosen_) return;
        const std::string file = test.m_file.c_str();
        if (std::any_of(std::begin(compiled_quickly), std::end(compiled_quickly),
                        [&](const char* ending) { return file.ends_with(ending); }))
            ::setenv("CXX", "g++ -Og", 1);
        else
            ::unsetenv("CXX");
    }

private:
    const bool is_chosen_ = std::getenv("CXX") != nullptr;
};

// One file's tests in a process of their own, their output in `log`.
struct Worker {
    std::string file, notes, log;
};

constexpr unsigned most_seconds = 900;  // of a file: then it hangs, and is ended inside the test that does

class Workers {
public:
    Workers(int argc, char** argv, int at_once) : argc_(argc), argv_(argv), at_once_(at_once) {}

    int run() {
        // Those with the slowest tests first, then the longest texts: they tend to run longest.
        std::vector<std::string> files = asked_for();
        const auto weight = [](const std::string& file) {
            std::error_code unknown;
            return std::pair(files_asked_for.at(file), std::filesystem::file_size(file, unknown));
        };
        std::stable_sort(files.begin(), files.end(),
                         [&](const std::string& a, const std::string& b) { return weight(a) > weight(b); });
        for (const std::string& file : files) {
            if (std::ssize(running_) == at_once_) wait_for_one();
            start(file);
        }
        while (!running_.empty()) wait_for_one();
        return failed_ > 0;
    }

private:
    std::vector<std::string> asked_for() const {
        std::vector<const char*> arguments(argv_, argv_ + argc_);
        arguments.push_back("--list-test-cases");
        doctest::Context query(static_cast<int>(arguments.size()), arguments.data());
        std::ostringstream nowhere;
        query.setCout(&nowhere);
        query.run();
        std::vector<std::string> files;
        for (const auto& [file, is_slow] : files_asked_for) files.push_back(file);
        return files;
    }

    void start(const std::string& file) {
        const std::string folder = "/tests/";  // the compiler may have been given a relative path
        const std::string name =
            std::filesystem::path(file.substr(file.rfind(folder) + folder.size())).replace_extension();
        std::string flat = name;
        std::replace(flat.begin(), flat.end(), '/', '.');
        const Worker worker{name, folder_ / (flat + ".notes"), folder_ / (flat + ".log")};
        const pid_t pid = ::fork();
        if (pid < 0) throw std::runtime_error("cannot fork");
        if (pid == 0) {
            const int log = ::open(worker.log.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0600);
            ::dup2(log, 1);
            ::dup2(log, 2);
            ::close(log);
            ::setenv("LOBATTO_TEST_NOTES", worker.notes.c_str(), 1);
            ::alarm(most_seconds);
            doctest::Context context(argc_, argv_);
            context.addFilter("source-file", file.c_str());
            context.setOption("minimal", true);
            std::exit(context.run());
        }
        running_[pid] = worker;
    }

    void wait_for_one() {
        int status = 0;
        struct rusage used {};
        const pid_t pid = ::wait4(-1, &status, 0, &used);
        const Worker worker = running_.at(pid);
        running_.erase(pid);
        std::fputs(lobatto::test::read_file(worker.log).c_str(), stdout);
        int passed = 0, failed = 0;
        std::string test;
        std::ifstream notes(worker.notes);
        notes >> passed >> failed;
        std::getline(notes >> std::ws, test);
        const bool crashed = !test.empty() || (status != 0 && failed == 0);
        if (crashed) {
            ++failed;
            std::printf("%s ended with %s %s\n", worker.file.c_str(),
                        WIFSIGNALED(status) ? ::strsignal(WTERMSIG(status)) : "an exit code",
                        test.empty() ? "outside any test" : ("inside the test \"" + test + "\"").c_str());
        }
        passed_ += passed;
        failed_ += failed;
        const auto seconds = [](const timeval& time) { return double(time.tv_sec) + 1e-6 * double(time.tv_usec); };
        std::printf("%-44s %3d passed, %d failed %7.1f s of processor time\n", worker.file.c_str(), passed, failed,
                    seconds(used.ru_utime) + seconds(used.ru_stime));
        std::fflush(stdout);
        if (const char* path = std::getenv("LOBATTO_TEST_NOTES"))
            std::ofstream(path) << passed_ << ' ' << failed_ << " \n";
    }

    int argc_;
    char** argv_;
    std::ptrdiff_t at_once_;
    lobatto::test::TemporaryFolder folder_;
    std::map<pid_t, Worker> running_;
    int passed_ = 0, failed_ = 0;
};

}  // namespace

DOCTEST_REGISTER_LISTENER("notes", 1, Notes);
DOCTEST_REGISTER_LISTENER("flags", 1, Flags);

// $LOBATTO_TEST_WORKERS: how many files' tests run at a time, each file in a process of its own. Kernels that no test
// keeps to itself go to one cache of all processes, $LOBATTO_TEST_CACHE, or a folder that goes away with the run.
int main(int argc, char** argv) {
    const lobatto::test::TemporaryFolder own;
    const char* const given = std::getenv("LOBATTO_TEST_CACHE");
    const std::string cache = given != nullptr ? given : own.string();
    const EnvironmentVariable of_processes("LOBATTO_TEST_CACHE", cache), shared("LOBATTO_CACHE_DIR", cache);
    const char* const workers = std::getenv("LOBATTO_TEST_WORKERS");
    if (workers != nullptr && std::atoi(workers) > 1) return Workers(argc, argv, std::atoi(workers)).run();
    return doctest::Context(argc, argv).run();
}
