// SPDX-License-Identifier: GPL-2.0-or-later
// A run that is killed at any moment and taken up again has the bytes of one that never stopped.
#include <doctest/doctest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>

#include <chrono>
#include <memory>
#include <random>
#include <regex>
#include <thread>

#include "runtime/error.hpp"
#include "runtime/files/checksum.hpp"
#include "runtime/run/checkpoint.hpp"
#include "tests/support.hpp"
#include "tests/trajectory_table.hpp"

using namespace lobatto;
using namespace lobatto::test;

namespace {

// Each form of kernel, events, states between steps: what a stepper has to remember.
struct Subject {
    const char* name;
    const char* text;
    std::vector<std::string> options;
};
const Subject subjects[] = {
    {"swept",
     "lagrangian = \"q'^2/2 + cos(q)\"\n[coordinates]\nq = { position = 1, velocity = 0 }\n[method]\npoints = 6\n"
     "[run]\nstep = 0.1\nuntil = 200000\n[output]\nevery = 37\nevents = [\"q = 0 rising\"]\n",
     {}},
    {"general",
     "lagrangian = \"a'^2 + b'^2/2 + a'*b'*cos(a - b) + 2*cos(a) + cos(b)\"\n[coordinates]\n"
     "a = { position = 1, velocity = 0 }\nb = { position = 2, velocity = 0 }\n[run]\nstep = 0.05\nuntil = "
     "20000\nbeyond_horizon = true\n"
     "[output]\nevery = 10\n",
     {}},
    {"linear",
     "lagrangian = \"q'^2/2 - 2*q^2\"\n[coordinates]\nq = { position = 1, velocity = 0 }\n[run]\nstep = 0.1\n"
     "until = 750000\n[output]\nevery = 100\n",
     {}},
    {"dense",
     "lagrangian = \"x'^2/2 + y'^2/2 + 1/sqrt(x^2 + y^2)\"\n[coordinates]\nx = { position = 0.7, velocity = 0 }\n"
     "y = { position = 0, velocity = 1.3627 }\n[run]\nstep = 0.05\nuntil = 5000\n[output]\ndense = 1\n"
     "events = [\"y = 0\"]\n",
     {"--tolerance", "1e-9"}},
    {"clean",
     "lagrangian = \"q'^2/2 + cos(q)\"\n[coordinates]\nq = { position = 1, velocity = 0 }\n[method]\npoints = 6\n"
     "[run]\nstep = 0.1\nuntil = 100000\n[output]\nevery = 37\nevents = [\"q = 0 rising\"]\n",
     {"--arithmetic", "clean"}},
    {"double-double",
     "lagrangian = \"q'^2/2 + cos(q)\"\n[coordinates]\nq = { position = 1, velocity = 0 }\n[method]\npoints = 6\n"
     "numbers = \"double-double\"\n[run]\nstep = 0.1\nuntil = 20000\n[output]\nevery = 37\n"
     "events = [\"q = 0 rising\"]\n",
     {}},
    {"splitting",
     "lagrangian = \"\"\"sum(i = 1 .. 40, (1 + i/8)*x[i]'^2/2) - sum(i = 2 .. 40, (x[i] - x[i-1])^2/2 + (x[i] - "
     "x[i-1])^4/8)\"\"\"\n[coordinates]\nx = { count = 40, position = \"sin(i)\", velocity = 0 }\n[run]\nstep = 0.2\n"
     "until = 2000\n[output]\ndense = 1\nevents = [\"x[3] = 0\"]\n",
     {"--splitting", "11"}}};

std::vector<std::string> command(const Subject& subject, const std::filesystem::path& scene, const std::string& out,
                                 bool resume) {
    std::vector<std::string> words{LOBATTO_PROGRAM, "run", scene.string(), "-o", out};
    words.insert(words.end(), subject.options.begin(), subject.options.end());
    if (resume) words.push_back("--resume");
    return words;
}

// What the program says of the run, without what it measured of the time, and of the error: the companion of a resumed
// run rounds otherwise.
std::string report_of(const std::string& out) {
    const std::regex own("  (time per step|resumed|trajectory|measured error) .*\n|, in .*");
    return std::regex_replace(out.substr(out.find('\n')), own, "");
}

// Runs until the end, or to SIGKILL after that time; whether it came to the end.
bool run_at_most(const std::vector<std::string>& words, std::chrono::microseconds time, const std::string& log) {
    const pid_t pid = ::fork();
    if (pid == 0) {
        std::vector<std::string> texts = words;
        std::vector<char*> pointers;
        for (std::string& text : texts) pointers.push_back(text.data());
        pointers.push_back(nullptr);
        ::dup2(::open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600), 1);
        ::execv(pointers[0], pointers.data());
        ::_exit(127);
    }
    std::this_thread::sleep_for(time);
    ::kill(pid, SIGKILL);
    int status = 0;
    ::waitpid(pid, &status, 0);
    if (WIFEXITED(status)) CHECK(WEXITSTATUS(status) == 0);
    return WIFEXITED(status);
}

// A subject's run that is never stopped: its files, what it says, how long it takes.
struct Whole {
    TemporaryFolder folder;
    std::string scene = folder / "scene.toml", file = folder / "whole.csv", bytes, events, said;
    std::chrono::microseconds length{};

    explicit Whole(const Subject& subject) {
        write_text(scene, subject.text);
        const auto go = [&] { return run(command(subject, scene, file, false)); };
        go();  // compiles
        const auto start = std::chrono::steady_clock::now();
        const Finished done = go();
        length = std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::steady_clock::now() - start);
        REQUIRE_MESSAGE(done.exit_code == 0, done.err);
        bytes = read_file(file);
        said = report_of(done.out);
        if (std::filesystem::exists(folder / "whole.events.csv")) events = read_file(folder / "whole.events.csv");
    }
};

// Kills each subject again and again at random moments, taking it up each time, until `kills` of them; whenever one
// comes to its end its files are compared with those of a run that was never stopped.
void check_kills(int kills, unsigned seed) {
    std::mt19937 random(seed);
    int done = 0, ends = 0, resumed = 0;
    std::vector<std::unique_ptr<Whole>> wholes;
    for (const Subject& subject : subjects) wholes.push_back(std::make_unique<Whole>(subject));
    for (std::size_t turn = 0; done < kills; ++turn) {
        const Subject& subject = subjects[turn % std::size(subjects)];
        const Whole& whole = *wholes[turn % std::size(subjects)];
        INFO(subject.name);
        const TemporaryFolder folder;
        const std::string torn = folder / "torn.csv", log = folder / "log";
        // A run that were always killed before its first checkpoint would never end.
        std::uniform_int_distribution<std::int64_t> moment(0, std::max<std::int64_t>(whole.length.count(), 400000));
        bool ended = false;
        std::int64_t kept = 0;
        while (!ended) {
            ended =
                run_at_most(command(subject, whole.scene, torn, true), std::chrono::microseconds(moment(random)), log);
            if (ended) break;
            ++done;
            if (!std::filesystem::exists(torn + ".partial")) {  // not begun, or whole and only its report cut off
                kept = 0;
                continue;
            }
            // What is there is the beginning of the whole, and readable; and no checkpoint says more than is there.
            const std::string partial = read_file(torn + ".partial");
            CHECK(whole.bytes.compare(0, partial.size(), partial) == 0);
            read_trajectory(torn + ".partial");
            if (const auto checkpoint = read_checkpoint(torn + ".checkpoint")) {
                CHECK(checkpoint->files[0].size <= std::ssize(partial));
                CHECK(checkpoint->files[0].size >= kept);  // nothing that was once safe is lost
                resumed += checkpoint->files[0].size > kept;
                kept = checkpoint->files[0].size;
            }
        }
        ++ends;
        CHECK(read_file(torn) == whole.bytes);
        CHECK(report_of(read_file(log)) == whole.said);
        if (!whole.events.empty()) CHECK(read_file(folder / "torn.events.csv") == whole.events);
        CHECK_FALSE(std::filesystem::exists(torn + ".checkpoint"));
        CHECK_FALSE(std::filesystem::exists(torn + ".partial"));
    }
    MESSAGE(done << " kills, " << resumed << " after a new checkpoint, " << ends << " runs brought to their end");
    CHECK(resumed > 0);
}

// A longer run of the first subject, stopped by Ctrl-C when it has written some states.
struct Interrupted {
    TemporaryFolder folder;
    std::string out = folder / "run.csv";
    std::string scene = folder / "scene.toml";
    Finished ended;

    explicit Interrupted(const std::vector<std::string>& options = {}) {
        std::string text = subjects[0].text;
        text.replace(text.find("200000"), 6, "600000");
        write_text(scene, text);
        const std::string err = folder / "err";
        std::vector<std::string> words{LOBATTO_PROGRAM, "run", scene, "-o", out};
        words.insert(words.end(), options.begin(), options.end());
        std::vector<char*> arguments;
        for (std::string& word : words) arguments.push_back(word.data());
        arguments.push_back(nullptr);
        const pid_t pid = ::fork();
        if (pid == 0) {
            ::dup2(::open("/dev/null", O_WRONLY), 1);
            ::dup2(::open(err.c_str(), O_WRONLY | O_CREAT, 0600), 2);
            ::execv(LOBATTO_PROGRAM, arguments.data());
            ::_exit(127);
        }
        for (int tries = 0; tries < 6000; ++tries) {
            if (std::filesystem::exists(out + ".partial") && std::filesystem::file_size(out + ".partial") > 10000)
                break;
            std::this_thread::sleep_for(std::chrono::milliseconds(5));
        }
        ::kill(pid, SIGINT);
        int status = 0;
        ::waitpid(pid, &status, 0);
        ended = {"", read_file(err), WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status)};
    }
    Finished resume(const std::vector<std::string>& more = {}) const {
        std::vector<std::string> words{LOBATTO_PROGRAM, "run", scene, "-o", out, "--resume"};
        words.insert(words.end(), more.begin(), more.end());
        return run(words);
    }
};

}  // namespace

TEST_CASE("a run killed at random moments and resumed has the bytes of one that was never stopped" *
          doctest::test_suite("slowest")) {
    check_kills(10, 1);
}

// Some minutes: build/release/lobatto_tests --no-skip -tc="*200 kills*"
TEST_CASE("and so it is after 200 kills" * doctest::test_suite("slow") * doctest::skip()) {
    check_kills(200, 2);
}

TEST_CASE("an interrupted run keeps its file under its name, and goes on from there") {
    const Interrupted stopped;
    CHECK(stopped.ended.exit_code == 130);
    CHECK(contains(stopped.ended.err, " The same command with --resume continues from there.\n"));
    CHECK(std::filesystem::exists(stopped.out));
    const std::size_t before = read_trajectory(stopped.out).rows.size();
    const Finished done = stopped.resume();
    CHECK(done.exit_code == 0);
    CHECK(contains(done.out, "  resumed                 at t = "));
    CHECK(read_trajectory(stopped.out).rows.size() > before);
    const Finished whole = run({LOBATTO_PROGRAM, "run", stopped.scene, "-o", stopped.folder / "whole.csv"});
    CHECK(read_file(stopped.out) == read_file(stopped.folder / "whole.csv"));
    CHECK(read_file(stopped.folder / "run.events.csv") == read_file(stopped.folder / "whole.events.csv"));
    CHECK(report_of(done.out) == report_of(whole.out));
}

TEST_CASE("a run whose beginning was not measured goes on without a measured error, and says so") {
    const Interrupted stopped({"--unmeasured"});
    const Finished done = stopped.resume();
    CHECK(done.exit_code == 0);
    CHECK(contains(done.err, "the error is not measured, because an earlier part of the run had no companion"));
    CHECK(!contains(done.out, "measured error"));
}

TEST_CASE("with nothing left to resume a run starts again, and says so") {
    const TemporaryFolder folder;
    const Finished done =
        run({LOBATTO_PROGRAM, "run", LOBATTO_SOURCE_DIR "/scenes/pendulum.toml", "-o", folder / "a.csv", "--resume"});
    CHECK(done.exit_code == 0);
    CHECK(contains(done.out, "  resumed                 nothing was left: from the start\n"));
    CHECK(read_trajectory(folder / "a.csv").rows.size() == 2401);
}

TEST_CASE("another run's checkpoint, a damaged one, a missing or altered file are refused by name") {
    const Interrupted stopped;
    const std::string checkpoint = stopped.out + ".checkpoint", bytes = read_file(checkpoint);

    const Finished other = stopped.resume({"--step", "0.2"});
    CHECK(other.exit_code == 2);
    CHECK(contains(other.err, checkpoint + " belongs to another run: '# method: Lobatto, 6 points, h = 0.1' there, "
                                           "'# method: Lobatto, 6 points, h = 0.2' here."));

    for (const std::size_t at : {std::size_t{3}, bytes.size() / 2, bytes.size() - 1}) {
        std::string altered = bytes;
        altered[at] = static_cast<char>(altered[at] ^ 1);
        write_text(checkpoint, altered);
        const Finished damaged = stopped.resume();
        CHECK(damaged.exit_code == 4);
        CHECK(damaged.err ==
              "lobatto: cannot continue from " + checkpoint + ": it is damaged. Run without --resume to start again\n");
    }
    write_text(checkpoint, bytes.substr(0, 40));
    CHECK(stopped.resume().exit_code == 4);
    write_text(checkpoint, bytes);
    std::filesystem::permissions(checkpoint, std::filesystem::perms(0666));
    CHECK(contains(stopped.resume().err, "it is no file of yours that only you can write"));
    std::filesystem::permissions(checkpoint, std::filesystem::perms(0600));

    const std::string text = read_file(stopped.out);
    write_text(stopped.out, text.substr(0, text.size() / 2));
    CHECK(contains(stopped.resume().err, stopped.out + ": it is shorter than the run had written it. Run without"));
    CHECK(!std::filesystem::exists(stopped.out + ".partial"));
    write_text(stopped.out, text);
    // Rows that stand in NAME.partial alone are not written over.
    write_text(stopped.out + ".partial", text.substr(0, text.size() / 2));
    CHECK(contains(stopped.resume().err, stopped.out + ".partial: it is shorter than the run had written it."));
    CHECK(read_file(stopped.out + ".partial") == text.substr(0, text.size() / 2));
    std::filesystem::remove(stopped.out + ".partial");
    // One byte, anywhere, in the trajectory or in the events.
    const std::string event_file = stopped.folder / "run.events.csv", event_text = read_file(event_file);
    const auto refuse_altered = [&](const std::string& file, const std::string& whole, std::size_t at) {
        CAPTURE(file);
        CAPTURE(at);
        std::string altered = whole;
        altered[at] = altered[at] == '1' ? '2' : '1';
        write_text(file, altered);
        const Finished refused = stopped.resume();
        CHECK(refused.exit_code == 4);
        CHECK(refused.err == "lobatto: cannot continue with the trajectory in " + file +
                                 ": it is not what the run had written. Run without --resume to start again\n");
        write_text(file, whole);
    };
    const auto kept = static_cast<std::size_t>(read_checkpoint(checkpoint)->files[0].size);
    for (const std::size_t at : {std::size_t{30}, kept / 3, kept / 2, kept - 2}) refuse_altered(stopped.out, text, at);
    refuse_altered(event_file, event_text, event_text.size() / 2);
    CHECK(stopped.resume().exit_code == 0);
}

TEST_CASE("a checksum is that of the bytes, however they come, and of no others") {
    const auto checksum_of = [](const std::string& text, std::size_t part) {
        Checksum checksum;
        for (std::size_t at = 0; at < text.size(); at += part) checksum.add(text.substr(at, part));
        return checksum.written();
    };
    std::string text;
    for (int i = 0; i < 300; ++i) text += std::to_string(i);
    const Written whole = checksum_of(text, text.size());
    CHECK(whole.size == std::ssize(text));
    for (const std::size_t part : {1, 3, 8, 13}) CHECK(checksum_of(text, part) == whole);
    std::string altered = text;
    for (char& byte : altered) {
        const char before = byte;
        for (int bit = 0; bit < 8; ++bit) {
            byte = static_cast<char>(before ^ 1 << bit);
            CHECK(checksum_of(altered, altered.size()) != whole);
        }
        byte = before;
    }
    for (const char* more : {"0", "\n"}) CHECK(checksum_of(text + more, 64) != whole);
    CHECK(checksum_of(text + '\0', 64).checksum != whole.checksum);
    CHECK(checksum_of(text.substr(1), 64) != whole);
}

TEST_CASE("a run that starts again takes the checkpoint of the one before away") {
    const Interrupted stopped;
    CHECK(std::filesystem::exists(stopped.out + ".checkpoint"));
    run({LOBATTO_PROGRAM, "run", LOBATTO_SOURCE_DIR "/scenes/pendulum.toml", "-o", stopped.out});
    CHECK_FALSE(std::filesystem::exists(stopped.out + ".checkpoint"));
}

TEST_CASE("a file that may not grow further ends a run with whole lines, and with room again the run goes on") {
    const TemporaryFolder folder;
    const std::string scene = folder / "scene.toml", out = folder / "run.csv", whole = folder / "whole.csv";
    std::string text = subjects[1].text;
    write_text(scene, text);
    REQUIRE(run({LOBATTO_PROGRAM, "run", scene, "-o", whole}).exit_code == 0);
    const std::string bytes = read_file(whole);
    const auto limit = static_cast<rlim_t>(bytes.size() / 2);
    rlimit before{};
    ::getrlimit(RLIMIT_FSIZE, &before);
    const test::EnvironmentVariable no_counters("LLVM_PROFILE_FILE", "/dev/null");  // files, where coverage is read
    const rlimit small{limit, before.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &small);
    const Finished full = run({LOBATTO_PROGRAM, "run", scene, "-o", out});
    ::setrlimit(RLIMIT_FSIZE, &before);
    CHECK(full.exit_code == 4);
    CHECK(full.err ==
          "lobatto: cannot write the trajectory to " + out +
              ".partial: File too large. Files may not be larger than `ulimit -f` says; raise it, or choose "
              "another place with -o\n");
    const std::string partial = read_file(out + ".partial");
    CHECK(partial.ends_with('\n'));
    CHECK(partial.size() > bytes.size() / 4);
    CHECK(bytes.starts_with(partial));
    CHECK_FALSE(std::filesystem::exists(out));
    CHECK(run({LOBATTO_PROGRAM, "run", scene, "-o", out, "--resume"}).exit_code == 0);
    CHECK(read_file(out) == bytes);
}

TEST_CASE("a pipe whose reader has gone is an error that says so") {
    const TemporaryFolder folder;
    const std::string fifo = folder / "fifo";
    REQUIRE(run({"mkfifo", fifo}).exit_code == 0);
    const Finished head = run({"sh", "-c",
                               std::string("head -c 2000 < '") + fifo +
                                   "' > /dev/null & '" LOBATTO_PROGRAM "' run '" LOBATTO_SOURCE_DIR
                                   "/scenes/pendulum.toml' --until 10000 -o '" +
                                   fifo + "'"});
    CHECK(head.exit_code == 4);
    CHECK(head.err == "lobatto: cannot write the trajectory to " + fifo + ": Broken pipe. Its reader has gone\n");
}
