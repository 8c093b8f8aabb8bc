// SPDX-License-Identifier: GPL-2.0-or-later
// Sweeps in parts: shards and their merging, sweeps that were killed and go on. All end with the bytes of one process.
#include <doctest/doctest.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>
#include <nlohmann/json.hpp>

#include <chrono>
#include <random>
#include <thread>

#include "cli/table/hdf5_file.hpp"
#include "tests/cli/sweep/tables.hpp"

using namespace lobatto;
using test::pendulum_file;

namespace {

std::vector<std::string> endings() {
    if (has_hdf5()) return {".csv", ".npy", ".h5"};
    return {".csv", ".npy"};
}

// Rows that depend on everything: settings, files, draws, several rows each.
std::vector<std::string> varied(const test::SweepFolder& place, const std::vector<std::string>& more = {}) {
    test::write_text(place.file("starts.csv"), "q\n1\n2\n0.5\n");
    std::vector<std::string> words{"--starts", place.file("starts.csv"),
                                   "--random", "7",
                                   "--seed",   "3",
                                   "--draw",   "q' ~ normal(0, 0.1)",
                                   "--vary",   "m=1,2",
                                   "--vary",   "step=0.1,0.05",
                                   "--until",  "3",
                                   "--every",  "7"};
    words.insert(words.end(), more.begin(), more.end());
    return words;
}

void check_beside(const test::SweepFolder& place, const std::string& one, const std::string& other) {
    if (one.ends_with(".npy"))
        CHECK(test::read_file(place.file(one + ".json")) == test::read_file(place.file(other + ".json")));
}

// Starts a sweep and kills it after so many bytes have been written; whether it came to its end.
bool kill_after(const test::SweepFolder& place, const std::string& name, std::vector<std::string> words,
                std::uintmax_t bytes, int signal, const std::string& scene = pendulum_file) {
    words.insert(words.begin(), {LOBATTO_PROGRAM, "sweep", scene, "--resume", "-o", place.file(name)});
    const pid_t pid = ::fork();
    if (pid == 0) {
        std::vector<char*> pointers;
        for (std::string& word : words) pointers.push_back(word.data());
        pointers.push_back(nullptr);
        ::dup2(::open("/dev/null", O_WRONLY), 1);
        ::dup2(::open("/dev/null", O_WRONLY), 2);
        ::execv(pointers[0], pointers.data());
        ::_exit(127);
    }
    const std::string partial = place.file(name + ".partial");
    std::error_code none;
    int status = 0;
    for (int tries = 0; tries < 60000; ++tries) {
        if (::waitpid(pid, &status, WNOHANG) == pid) {
            CHECK((WIFEXITED(status) && WEXITSTATUS(status) == 0));
            return true;
        }
        if (std::filesystem::exists(partial, none) && std::filesystem::file_size(partial, none) >= bytes) break;
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    ::kill(pid, signal);
    ::waitpid(pid, &status, 0);
    return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

}  // namespace

TEST_CASE("shards, merged in any order, are the table of one process, byte for byte") {
    const test::SweepFolder place;
    for (const std::string& ending : endings()) {
        CAPTURE(ending);
        const std::string whole = place.bytes("whole" + ending, varied(place));
        for (const int of : {1, 3, 100}) {  // 84 trajectories: some shards of 100 are empty
            std::vector<std::string> words{"merge", "-o", place.file("merged" + ending)};
            for (int number = of; number > 0; --number) {
                const std::string name = fmt::format("part{}{}", number, ending);
                place.bytes(name, varied(place, {"--shard", fmt::format("{}/{}", number, of), "--quiet"}));
                words.push_back(place.file(name));
            }
            if (of == 1) {  // which is the whole sweep
                CHECK(test::read_file(place.file("part1" + ending)) == whole);
                continue;
            }
            const test::Finished merged = place.lobatto(words);
            CHECK_MESSAGE(merged.exit_code == 0, merged.err);
            CHECK(merged.out.find("  trajectories            84\n") != std::string::npos);
            CHECK(test::read_file(place.file("merged" + ending)) == whole);
            check_beside(place, "merged" + ending, "whole" + ending);
        }
    }
}

TEST_CASE("a scene may have the names of the table's own columns, and units with commas") {
    const test::SweepFolder place;
    test::write_text(place.file("scene.toml"),
                     "lagrangian = \"points'^2/2 + steps'^2/2 - points*steps\"\n[coordinates]\n"
                     "points = { position = 0.5, velocity = 0, unit = \"m, steps\" }\n"
                     "steps = { position = 0.25, velocity = 0, unit = \"a] b\" }\n[run]\nstep = 0.1\nuntil = 1\n");
    const auto sweep = [&](const std::string& name, const std::vector<std::string>& more = {}) {
        std::vector<std::string> words{
            "sweep", place.file("scene.toml"), "--vary", "points=0:0.5:7", "--vary", "stages=1,2",
            "-o",    place.file(name)};
        words.insert(words.end(), more.begin(), more.end());
        const test::Finished done = place.lobatto(words);
        CHECK_MESSAGE(done.exit_code == 0, done.err);
        return test::read_file(place.file(name));
    };
    for (const std::string& ending : endings()) {
        CAPTURE(ending);
        const std::string whole = sweep("whole" + ending);
        sweep("1" + ending, {"--shard", "1/2"});
        sweep("2" + ending, {"--shard", "2/2"});
        const test::Finished merged = place.lobatto(
            {"merge", place.file("2" + ending), place.file("1" + ending), "-o", place.file("m" + ending)});
        CHECK_MESSAGE(merged.exit_code == 0, merged.err);
        CHECK(test::read_file(place.file("m" + ending)) == whole);
        CHECK(sweep("whole" + ending, {"--resume"}) == whole);
    }
}

TEST_CASE("parts that do not belong together are told apart, and missing ones are named") {
    const test::SweepFolder place;
    const auto part = [&](const std::string& name, const std::string& shard, const std::string& vary = "q=0:1:10") {
        place.bytes(name, {"--vary", vary, "--until", "1", "--shard", shard});
        return place.file(name);
    };
    const std::string out = place.file("all.csv");
    const auto refusal = [&](std::vector<std::string> parts, const std::string& to) {
        parts.insert(parts.begin(), {"merge", "-o", to});
        const test::Finished done = place.lobatto(parts);
        CHECK(done.exit_code == 2);
        CHECK_FALSE(std::filesystem::exists(place.file("all.csv.partial")));
        return done.err;
    };
    const std::string one = part("1.csv", "1/4"), two = part("2.csv", "2/4"), three = part("3.csv", "3/4"),
                      four = part("4.csv", "4/4"), again = part("again.csv", "2/4"), other = part("o.csv", "2/5"),
                      stranger = part("s.csv", "2/4", "q=0:2:10");
    CHECK(refusal({one, three}, out) ==
          "2 of 4 shards are missing: 2, 4. Compute them with --shard 2/4 --resume and so on\n");
    CHECK(refusal({one, three, four}, out) == "1 of 4 shards is missing: 2. Compute it with --shard 2/4 --resume\n");
    CHECK(refusal({one, two, three, four, again}, out) ==
          two + " and " + again + " are both shard 2/4; leave one of both out\n");
    CHECK(refusal({one, other}, out) ==
          one + " and " + other + " are of different sweeps: shards of 4 there, of 5 here\n");
    CHECK(refusal({one, stranger}, out) ==
          one + " and " + stranger + " are of different sweeps: 'vary: q = 0:1:10' there, 'vary: q = 0:2:10' here\n");
    place.bytes("whole.csv", {"--vary", "q=0:1:10", "--until", "1"});
    CHECK(refusal({place.file("whole.csv")}, out) ==
          place.file("whole.csv") + " is no part of a sweep: it was not written with --shard\n");
    CHECK(refusal({one, two}, place.file("all.npy")) ==
          one + ": parts and the table that is made of them have the same ending\n");
    CHECK(refusal({one, two, three, four}, one) ==
          one + ": the table would overwrite this part; give it another name\n");
    // One that was interrupted.
    const std::string text = test::read_file(two);
    const std::size_t last_row = text.rfind('\n', text.rfind("# rows: ") - 2) + 1;
    test::write_text(two, text.substr(0, last_row));
    CHECK(refusal({one, two, three, four}, out) ==
          two + " is not complete: it has 2 of 3 trajectories. Continue it with --resume\n");
    std::filesystem::rename(two, two + ".partial");
    for (const std::string& named : {two, two + ".partial"})
        CHECK(refusal({one, named, three, four}, out) ==
              two + ".partial is of a sweep that goes on or was stopped; --resume continues it, and ends with " + two +
                  "\n");
    std::filesystem::remove(two + ".partial");
    // One of another processor.
    test::write_text(two, text);
    const std::string label = ", compiled kernel ";
    std::string elsewhere = text;
    char& letter = elsewhere[elsewhere.find(label) + label.size()];
    letter = letter == '0' ? '1' : '0';
    test::write_text(two, elsewhere);
    const test::Finished mixed = place.lobatto({"merge", one, two, three, four, "-o", out});
    CHECK(mixed.exit_code == 0);
    CHECK(mixed.err == "lobatto: warning: " + two +
                           " was computed on another kind of processor, or by another compiler, than the first of the "
                           "parts; last digits may differ from those of one process.\n");
    CHECK(test::read_file(out) == test::read_file(place.file("whole.csv")));
    CHECK(place.refusal("2.csv", {"--vary", "q=0:1:10", "--until", "1", "--shard", "2/4", "--resume"})
              .find("it was computed on another kind of processor or by another compiler, which rounds otherwise") !=
          std::string::npos);
    // Only the scene's text differs: nothing in the heads but what stands for all of it.
    test::write_text(place.file("pendulum.toml"), test::read_file(pendulum_file) + "# another text\n");
    place.lobatto(
        {"sweep", place.file("pendulum.toml"), "--vary", "q=0:1:10", "--until", "1", "--shard", "2/4", "-o", two});
    CHECK(refusal({one, two}, out).find("are of different sweeps: 'sweep: ") != std::string::npos);
    for (const char* shard : {"0/4", "5/4", "3", "1/0", "a/b", "1/2/3", "-1/4", "1/10000000"})
        CHECK(place.refusal("no.csv", {"--vary", "q=1", "--shard", shard})
                  .starts_with(std::string("--shard: '") + shard + "' is no part of a sweep; 3/64 is the third of 64"));
}

TEST_CASE("a part that has lost or doubled a row is not merged") {
    const test::SweepFolder place;
    for (const std::string ending : {".csv", ".npy"}) {
        CAPTURE(ending);
        const auto merged = [&] {
            return place.lobatto(
                {"merge", place.file("1" + ending), place.file("2" + ending), "-o", place.file("m" + ending)});
        };
        for (const std::string part : {"1", "2"})
            REQUIRE(
                place.sweep(part + ending, {"--vary", "q=1,2", "--until", "1", "--every", "5", "--shard", part + "/2"})
                    .exit_code == 0);
        CHECK(merged().exit_code == 0);
        std::filesystem::remove(place.file("m" + ending));
        const std::string whole = test::read_file(place.file("2" + ending));
        std::vector<std::string> damaged;
        if (ending == ".csv") {
            const std::size_t end = whole.rfind("# rows: "), last = whole.rfind('\n', end - 2) + 1,
                              before = whole.rfind('\n', last - 2) + 1;
            damaged = {whole.substr(0, end), whole.substr(0, last) + whole.substr(end),
                       whole.substr(0, before) + whole.substr(last), whole.substr(0, end) + whole.substr(last)};
        } else {
            damaged = {whole.substr(0, whole.size() - 8), whole + whole.substr(whole.size() - 72)};
        }
        for (const std::string& text : damaged) {
            test::write_text(place.file("2" + ending), text);
            const test::Finished done = merged();
            INFO(done.err);
            CHECK(done.exit_code == 2);
            CHECK(done.err.find("2" + ending + " is damaged: it") != std::string::npos);
            CHECK(!std::filesystem::exists(place.file("m" + ending)));
        }
    }
}

TEST_CASE("a sweep that is killed again and again and resumed has the bytes of one that was never stopped" *
          doctest::test_suite("slowest")) {
    const test::SweepFolder place;
    std::mt19937 random(1);
    for (const std::string& ending : endings()) {
        for (const char* every : {"1000000", "100"}) {
            CAPTURE(ending);
            CAPTURE(every);
            const std::vector<std::string> words{"--vary",  "q=0:3:3000", "--vary",  "m=1,2",
                                                 "--every", every,        "--until", "20"};
            const std::string whole = place.bytes("whole" + ending, words);
            std::error_code none;
            std::filesystem::remove(place.file("torn" + ending), none);
            int kills = 0;
            std::uintmax_t bytes = 0;
            for (bool ended = false; !ended;) {
                bytes += 1 + random() % (whole.size() / 4);
                ended = kill_after(place, "torn" + ending, words, bytes, SIGKILL);
                if (!ended) ++kills;
            }
            CHECK(kills >= 2);
            CHECK(test::read_file(place.file("torn" + ending)) == whole);
            check_beside(place, "torn" + ending, "whole" + ending);
            CHECK_FALSE(std::filesystem::exists(place.file("torn" + ending + ".partial")));
            CHECK_FALSE(std::filesystem::exists(place.file("torn" + ending + ".partial.json")));
        }
    }
}

TEST_CASE("a sweep that is killed between its last two renamings goes on") {
    const test::SweepFolder place;
    const std::vector<std::string> words{"--vary", "q=1,2", "--until", "1"};
    const std::string whole = place.bytes("whole.npy", words);
    std::filesystem::rename(place.file("whole.npy"), place.file("whole.npy.partial"));
    const std::string said = test::read_file(place.file("whole.npy.json"));
    CHECK(place.bytes("whole.npy", {"--vary", "q=1,2", "--until", "1", "--resume"}) == whole);
    CHECK(test::read_file(place.file("whole.npy.json")) == said);
    CHECK_FALSE(std::filesystem::exists(place.file("whole.npy.partial")));
    CHECK_FALSE(std::filesystem::exists(place.file("whole.npy.partial.json")));
}

// Its trajectories end at times of their own, so that those that stand side by side are others in each of these ways.
TEST_CASE("a sweep with stops and with what is kept has the same bytes by threads, in parts, and resumed") {
    const test::SweepFolder place;
    const std::string scene = LOBATTO_SOURCE_DIR "/scenes/flips.toml";
    for (const char* keep : {"last(a), max(H), mean(b^2), count(a' = 0), first(b = a)", ""}) {
        CAPTURE(keep);
        std::vector<std::string> words{"--vary",  "a=-3:3:40", "--vary",          "b=-3:3:31",
                                       "--until", "20",        "--beyond-horizon"};
        if (*keep != 0) words.insert(words.end(), {"--keep", keep});
        const auto bytes = [&](const std::string& name, const std::vector<std::string>& more) {
            std::vector<std::string> all{"sweep", scene, "-o", place.file(name)};
            all.insert(all.end(), words.begin(), words.end());
            all.insert(all.end(), more.begin(), more.end());
            const test::Finished done = place.lobatto(all);
            CHECK_MESSAGE(done.err == "", done.err);
            CHECK(done.exit_code == 0);
            return test::read_file(place.file(name));
        };
        const std::string whole = bytes("whole.csv", {"--threads", "1"});
        const std::vector<double> stops = test::column_of(test::read_trajectory(place.file("whole.csv")), "stop");
        CHECK(std::count(stops.begin(), stops.end(), 0) > 200);
        CHECK(std::count(stops.begin(), stops.end(), 0) < 1000);
        for (const char* threads : {"2", "5"}) CHECK(bytes("more.csv", {"--threads", threads}) == whole);
        std::vector<std::string> merge{"merge", "-o", place.file("merged.csv")};
        for (const char* part : {"1", "2", "3"}) {
            bytes(std::string(part) + ".csv", {"--shard", std::string(part) + "/3"});
            merge.push_back(place.file(std::string(part) + ".csv"));
        }
        CHECK(place.lobatto(merge).exit_code == 0);
        CHECK(test::read_file(place.file("merged.csv")) == whole);
        std::error_code none;
        std::filesystem::remove(place.file("torn.csv"), none);
        if (!kill_after(place, "torn.csv", words, whole.size() / 4, SIGKILL, scene))
            kill_after(place, "torn.csv", words, whole.size() / 2, SIGKILL, scene);
        CHECK(bytes("torn.csv", {"--resume"}) == whole);
    }
}

TEST_CASE("where rows do not tell the states, a sweep that goes on says that it speaks of those computed now") {
    const test::SweepFolder place;
    std::vector<std::string> words{"--vary", "q=0.5:2:5", "--until", "5", "--keep", "max(H)"};
    const std::string whole = place.sweep("kept.csv", words).out;
    CHECK(whole.find("computed now") == std::string::npos);
    words.push_back("--resume");
    const std::string resumed = place.sweep("kept.csv", words).out;
    for (const char* label : {"  energy error ", "    at the end ", "  q at the end ", "  p_q at the end "}) {
        const std::size_t at = resumed.find(label);
        CAPTURE(label);
        REQUIRE(at != std::string::npos);
        CHECK(resumed.substr(at, resumed.find('\n', at) - at).ends_with("; of those computed now"));
    }
    words.push_back("--json");
    CHECK(nlohmann::json::parse(place.sweep("kept.csv", words).out)["read_back"] ==
          4);  // the last row is computed anew
}

TEST_CASE("an interrupted sweep goes on from its table, and says of all what a whole one says") {
    const test::SweepFolder place;
    for (const std::string& ending : endings()) {
        CAPTURE(ending);
        const std::vector<std::string> words{"--vary", "q=0:3.3:4000", "--vary", "m=1,2", "--until", "20"};
        const test::Finished whole = place.sweep("whole" + ending, words);
        kill_after(place, "torn" + ending, words, 60000, SIGINT);
        REQUIRE(std::filesystem::exists(place.file("torn" + ending)));
        CHECK(test::read_file(place.file("torn" + ending)).size() <
              test::read_file(place.file("whole" + ending)).size());
        std::vector<std::string> again = words;
        again.push_back("--resume");
        const test::Finished resumed = place.sweep("torn" + ending, again);
        CHECK(resumed.exit_code == whole.exit_code);
        CHECK(resumed.out.find("  resumed                 after ") != std::string::npos);
        CHECK(test::read_file(place.file("torn" + ending)) == test::read_file(place.file("whole" + ending)));
        const auto from = [](const std::string& text, const std::string& label) {
            const std::size_t at = text.find(label);
            return text.substr(at, text.find('\n', at) - at);
        };
        for (const char* label :
             {"  trajectories ", "  measured error ", "    at the end ", "  q at the end ", "  p_q at the end "})
            CHECK(from(resumed.out, label) == from(whole.out, label));
        // Another sweep is not continued.
        again[1] = "q=0:3.2:4000";
        const test::Finished other = place.sweep("torn" + ending, again);
        CHECK(other.exit_code == 2);
        CHECK(other.err == place.file("torn" + ending) +
                               " belongs to another sweep: 'vary: q = 0:3.3:4000' there, 'vary: q = 0:3.2:4000' here. "
                               "Give that sweep's "
                               "options, or run without --resume to start again\n");
        again = words;
        again.insert(again.end(), {"--resume", "--shard", "1/2"});
        CHECK(place.refusal("torn" + ending, again).find("a whole sweep there, shard 1/2 here") != std::string::npos);
    }
    CHECK(place.sweep("new.csv", {"--vary", "q=1,2", "--until", "1", "--resume"})
              .out.find("  resumed                 nothing was left: from the start\n") != std::string::npos);
    std::string text = test::read_file(place.file("new.csv"));
    text[text.size() - 3] = 'x';
    test::write_text(place.file("new.csv"), text);
    const std::string said = place.refusal("new.csv", {"--vary", "q=1,2", "--until", "1", "--resume"});
    CHECK(said.find("it is damaged: '") != std::string::npos);
}
