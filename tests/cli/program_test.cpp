// SPDX-License-Identifier: GPL-2.0-or-later
// The program's front door: what a newcomer sees first, and what a shell gets back. Each command's own tests are
// elsewhere.
#include <doctest/doctest.h>
#include <sys/wait.h>

#include <cstdio>
#include <string>

#include "tests/support.hpp"

using namespace lobatto;

namespace {

struct Answer {
    std::string text;  // standard output and standard error together
    int code = -1;     // the exit code, or 128 + the signal
};

Answer shell(const std::string& command) {
    Answer answer;
    FILE* pipe = popen(("{ " + command + "; } 2>&1").c_str(), "r");
    REQUIRE(pipe != nullptr);
    for (int c = std::fgetc(pipe); c != EOF; c = std::fgetc(pipe)) answer.text += static_cast<char>(c);
    const int status = pclose(pipe);
    answer.code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    return answer;
}

const std::string program = "'" LOBATTO_PROGRAM "'";

}  // namespace

TEST_CASE("the help names every command, an example, and is what no arguments show") {
    const Answer help = shell(program + " --help");
    CHECK(help.code == 0);
    for (const char* words : {"derive", "emit", "run", "sweep", "verify", "paper", "lobatto run scenes/pendulum.toml"})
        CHECK(help.text.find(words) != std::string::npos);
    CHECK(shell(program).text == help.text);
    CHECK(shell(program).code == 0);
}

TEST_CASE("the help of each command ends with an example of that command") {
    for (const std::string command : {"derive", "emit", "run", "sweep", "verify", "paper"}) {
        INFO(command);
        const Answer help = shell(program + " " + command + " --help");
        CHECK(help.code == 0);
        const std::size_t example = help.text.find("Example:\n  lobatto " + command);
        CHECK(example != std::string::npos);
    }
}

TEST_CASE("a word that is no command is refused with exit code 2, the commands, and what was probably meant") {
    const Answer unknown = shell(program + " nonsense");
    CHECK(unknown.code == 2);
    CHECK(unknown.text ==
          "lobatto: unknown command 'nonsense'; the commands are: check, derive, emit, run, stability, "
          "roundoff, sweep, merge, tradeoff, tune, verify, view, gallery, "
          "paper.\n");
    const Answer scene = shell(program + " scenes/pendulum.toml");
    CHECK(scene.code == 2);
    CHECK(scene.text ==
          "lobatto: unknown command 'scenes/pendulum.toml'; the commands are: check, derive, emit, run, "
          "stability, roundoff, sweep, merge, tradeoff, tune, verify, view, gallery, paper. "
          "Did you mean `lobatto run scenes/pendulum.toml`?\n");
}

TEST_CASE("an option that does not exist is refused with exit code 2 and the way to the help") {
    const Answer top = shell(program + " --nonsense");
    CHECK(top.code == 2);
    CHECK(top.text ==
          "lobatto: The following argument was not expected: --nonsense\n"
          "`lobatto --help` shows what can be given.\n");
    CHECK(shell(program + " run --nonsense").code == 2);
}

TEST_CASE("a full disk behind the standard output is exit code 4") {
    for (const char* arguments : {"", " --help", " run --help", " --version"}) {
        CAPTURE(arguments);
        const Answer full = shell(program + arguments + " > /dev/full");
        CHECK(full.code == 4);
        CHECK(full.text == "lobatto: cannot write to standard output: No space left on device. Is the disk full?\n");
    }
    // When some of it was written at once, too.
    const test::TemporaryFolder folder;
    const Answer much = shell(program + " paper --no-figures -o '" + folder.string() + "' > /dev/full");
    CHECK(much.code == 4);
    CHECK(much.text == "lobatto: cannot write to file: No space left on device\n");
}
