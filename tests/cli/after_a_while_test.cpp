// SPDX-License-Identifier: GPL-2.0-or-later
// A message on standard error appears if its scope lasts long, and only then.
#include "cli/print/after_a_while.hpp"

#include <doctest/doctest.h>
#include <fcntl.h>
#include <unistd.h>

#include "tests/support.hpp"

using namespace lobatto;

TEST_CASE("what takes long is remarked upon, what does not is not") {
    const test::TemporaryFolder folder;
    const std::string path = folder / "said";
    const int before = ::dup(2);
    ::dup2(::open(path.c_str(), O_WRONLY | O_CREAT, 0600), 2);
    { const AfterAWhile never("quick", std::chrono::hours(1)); }
    {
        const AfterAWhile nothing("", std::chrono::milliseconds(0));
        const AfterAWhile once("slow", std::chrono::milliseconds(0));
        while (test::read_file(path).empty()) std::this_thread::yield();
    }
    ::dup2(before, 2);
    CHECK(test::read_file(path) == "slow\n");
}
