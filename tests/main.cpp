// SPDX-License-Identifier: GPL-2.0-or-later
// The test program's main, and the notes by which the launcher counts tests even when one of them takes the program
// down.
#define DOCTEST_CONFIG_IMPLEMENT_WITH_MAIN
#include <doctest/doctest.h>

#include <cstdlib>
#include <fstream>
#include <string>

namespace {

// Keeps one line in the file $LOBATTO_TEST_NOTES: tests passed, tests failed, the test that is running (nothing between
// tests).
class Notes : public doctest::IReporter {
public:
    explicit Notes(const doctest::ContextOptions&) {
        if (const char* path = std::getenv("LOBATTO_TEST_NOTES")) path_ = path;
    }

    void test_case_start(const doctest::TestCaseData& test) override { write(test.m_name); }
    void test_case_end(const doctest::CurrentTestCaseStats& test) override {
        ++(test.testCaseSuccess ? passed_ : failed_);
        write("");
    }

    void report_query(const doctest::QueryData&) override {}
    void test_run_start() override {}
    void test_run_end(const doctest::TestRunStats&) override {}
    void test_case_reenter(const doctest::TestCaseData&) override {}
    void test_case_exception(const doctest::TestCaseException&) override {}
    void subcase_start(const doctest::SubcaseSignature&) override {}
    void subcase_end() override {}
    void log_assert(const doctest::AssertData&) override {}
    void log_message(const doctest::MessageData&) override {}
    void test_case_skipped(const doctest::TestCaseData&) override {}

private:
    void write(const char* running) const {
        if (!path_.empty()) std::ofstream(path_) << passed_ << ' ' << failed_ << ' ' << running << '\n';
    }

    std::string path_;
    int passed_ = 0;
    int failed_ = 0;
};

}  // namespace

DOCTEST_REGISTER_LISTENER("notes", 1, Notes);
