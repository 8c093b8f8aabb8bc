// SPDX-License-Identifier: GPL-2.0-or-later
// The program's front door: what a newcomer sees first, and what a shell gets back. Each command's own tests are
// elsewhere.
#include <doctest/doctest.h>
#include <sys/wait.h>

#include <cctype>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

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

// As the help lists them.
std::vector<std::string> commands() {
    std::istringstream help(shell(program + " --help").text);
    std::vector<std::string> names;
    bool is_list = false;
    for (std::string line; std::getline(help, line);) {
        if (is_list && !line.starts_with("  ")) break;
        if (is_list) names.push_back(line.substr(2, line.find(' ', 2) - 2));
        is_list = is_list || line == "Commands:";
    }
    return names;
}

TEST_CASE("the help names every command, an example, the exit codes, and is what no arguments show") {
    const Answer help = shell(program + " --help");
    CHECK(help.code == 0);
    CHECK(commands().size() >= 17);
    for (const char* words : {"lobatto run scenes/pendulum.toml", "Exit codes: 0 done, 2 wrong input"})
        CHECK(help.text.find(words) != std::string::npos);
    CHECK(shell(program).text == help.text);
    CHECK(shell(program).code == 0);
}

TEST_CASE("the helps speak with one voice: values have names, sentences begin large, the end is an example") {
    for (const std::string& command : commands()) {
        CAPTURE(command);
        const Answer help = shell(program + " " + command + " --help");
        CHECK(help.code == 0);
        CHECK(help.text.find("\n  lobatto " + command, help.text.find("Example:")) != std::string::npos);
        for (const char* word : {" TEXT", " INT", " FLOAT", "Excludes", "REQUIRED", "Positionals", "OPTION "})
            CHECK_MESSAGE(help.text.find(word) == std::string::npos, word);
        std::istringstream lines(help.text);
        for (std::string line; std::getline(lines, line);) {
            if (!line.starts_with("  ") || line.find("lobatto ") != std::string::npos || line.find("#:") == 2) continue;
            const std::size_t text =
                line.find_last_not_of(' ') < 30 ? std::string::npos : line.find_first_not_of(' ', 30);
            if (text == 30) CHECK_MESSAGE(std::islower(static_cast<unsigned char>(line[30])) == 0, line);
        }
    }
}

TEST_SUITE("slow") {
    TEST_CASE("the example at the end of every help runs" * doctest::test_suite("slowest")) {
        const test::TemporaryFolder folder;
        std::filesystem::create_directory_symlink(LOBATTO_SOURCE_DIR "/scenes", folder / "scenes");
        std::filesystem::create_directory(folder / "bin");
        std::filesystem::create_symlink(LOBATTO_PROGRAM, folder / "bin/lobatto");
        for (const std::string& command : commands()) {
            const std::string help = shell(program + " " + command + " --help").text;
            std::istringstream lines(help.substr(help.find("Example:\n") + 9));
            for (std::string line; std::getline(lines, line);) {
                if (!line.starts_with("  lobatto ")) continue;
                CAPTURE(line);
                const Answer ran = shell("cd '" + folder.string() + "' && PATH=\"$PWD/bin:$PATH\" &&" + line);
                CAPTURE(ran.text);
                CHECK(ran.code == 0);
            }
        }
    }
}

TEST_CASE("a word that is no command is refused with exit code 2, the commands, and what was probably meant") {
    const Answer unknown = shell(program + " nonsense");
    CHECK(unknown.code == 2);
    CHECK(unknown.text.starts_with("lobatto: unknown command 'nonsense'; the commands are: new, check, derive, emit"));
    CHECK(unknown.text.ends_with("gallery, paper.\n"));
    CHECK(shell(program + " swep").text.ends_with(" Did you mean 'sweep'?\n"));
    const Answer scene = shell(program + " scenes/pendulum.toml");
    CHECK(scene.code == 2);
    CHECK(scene.text.ends_with(" Did you mean `lobatto run scenes/pendulum.toml`?\n"));
}

TEST_CASE("a misspelt option is told with the nearest one") {
    const Answer run = shell(program + " run scenes/pendulum.toml --untl 3");
    CHECK(run.code == 2);
    CHECK(run.text.find(". Did you mean '--until'?") != std::string::npos);
    CHECK(shell(program + " stability scenes/pendulum.toml --untl 0").text.find("not expected: --untl 0") !=
          std::string::npos);
}

TEST_CASE("completions know commands, options and words; manual pages say what the helps say") {
    const test::TemporaryFolder folder;
    const std::string pages = folder / "man";
    REQUIRE(shell(program + " manual -o '" + pages + "'").code == 0);
    for (const std::string& command : commands()) {
        const std::string page = test::read_file(pages + "/lobatto-" + command + ".1");
        CHECK(page.starts_with(".TH lobatto\\-" + command + " 1 "));
        CHECK(page.find(".SH EXAMPLES") != std::string::npos);
    }
    CHECK(test::read_file(pages + "/lobatto-run.1").find("\\fB\\-\\-until\\fR \\fITIME\\fR") != std::string::npos);
    CHECK(test::read_file(pages + "/lobatto.1").find("130 interrupted") != std::string::npos);
    const std::string bash = folder / "lobatto.bash";
    test::write_text(bash, shell(program + " manual --completions bash").text);
    const auto completed = [&](const std::string& words, int at) {
        return shell("bash -c 'source " + bash + "; COMP_WORDS=(" + words + "); COMP_CWORD=" + std::to_string(at) +
                     "; _lobatto; echo ${COMPREPLY[@]}'")
            .text;
    };
    CHECK(completed("lobatto swe", 1) == "sweep\n");
    CHECK(completed("lobatto run --unt", 2) == "--until\n");
    CHECK(completed("lobatto run --arithmetic c", 3) == "clean\n");
    CHECK(shell(program + " manual --completions zsh").text.starts_with("#compdef lobatto\n"));
    CHECK(shell(program + " manual --completions fish").text.find("-l until") != std::string::npos);
    CHECK(shell(program + " manual --completions csh").code == 2);
    CHECK(shell(program + " manual").code == 2);
}

TEST_CASE("check --watch prints again after every save, and errors do not end it") {
    const test::TemporaryFolder folder;
    const std::string scene = folder / "w.toml", seen = folder / "seen";
    const auto scene_of = [](const std::string& potential) {
        return "lagrangian = \"q'^2/2 - " + potential +
               "\"\n[coordinates]\nq = { position = 1, velocity = 0 }\n[run]\nstep = 0.1\nuntil = 1\n";
    };
    test::write_text(scene, scene_of("q^2/2"));
    shell("(" + program + " check --watch '" + scene + "' > '" + seen + "' 2>&1 & echo $! > '" +
          (folder / "pid").string() + "')");
    const auto wait_for = [&](const std::string& text) {
        for (int i = 0; i < 200; ++i) {
            if (test::read_file(seen).find(text) != std::string::npos) return true;
            std::this_thread::sleep_for(std::chrono::milliseconds(50));
        }
        return false;
    };
    CHECK(wait_for("waiting for"));
    test::write_text(scene, scene_of("q^2/2 - k*q"));
    CHECK(wait_for("unknown name 'k'"));
    test::write_text(scene, scene_of("q^4/4"));
    CHECK(wait_for("q^4/4"));
    CHECK(shell("kill $(cat '" + (folder / "pid").string() + "')").code == 0);
}

TEST_CASE("bench --help needs no build, and names every option of the race") {
    const std::string help = test::read_file(LOBATTO_SOURCE_DIR "/bench/help.txt"),
                      source = test::read_file(LOBATTO_SOURCE_DIR "/bench/main.cpp");
    for (std::size_t at = source.find("(\"--"); at != std::string::npos; at = source.find("(\"--", at + 1)) {
        const std::string option = source.substr(at + 2, source.find('"', at + 2) - at - 2);
        CHECK_MESSAGE(help.find("  " + option + " ") != std::string::npos, option);
    }
    CHECK(shell("'" LOBATTO_SOURCE_DIR "/lobatto' bench --help").text == help);
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
    CHECK(much.text == "lobatto: cannot write to standard output: No space left on device. Is the disk full?\n");
}
