// SPDX-License-Identifier: GPL-2.0-or-later
// Sweeps by several processes: the table of one, byte for byte; errors once; what a lost process leaves.
#include <doctest/doctest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <thread>

#include "tests/cli/sweep/tables.hpp"

using namespace lobatto;
using test::pendulum_file;

TEST_CASE("the program without MPI says so where mpirun starts it, and computes nothing") {
    const test::SweepFolder place;
    const test::EnvironmentVariable size("OMPI_COMM_WORLD_SIZE", "4");
    const std::string said = place.refusal("a.csv", {"--vary", "q=1,2"}, 4);
    CHECK(
        said.starts_with("lobatto: this program was started 4 times by mpirun, but cannot share the work: it was "
                         "built without MPI. Install libopenmpi-dev, build the target lobatto_mpi"));
    CHECK_FALSE(std::filesystem::exists(place.file("a.csv")));
}

#ifdef LOBATTO_MPI_PROGRAM

namespace {

std::vector<std::string> mpi_command(const std::string& output, const std::vector<std::string>& words,
                                     const std::string& scene = pendulum_file) {
    std::vector<std::string> all{
        "mpirun", "--allow-run-as-root", "--oversubscribe", "-n", "4", LOBATTO_MPI_PROGRAM, "sweep", scene, "-o",
        output};
    all.insert(all.end(), words.begin(), words.end());
    return all;
}

// The process ids of the ranks that write this file.
std::vector<pid_t> ranks_of(const std::string& output) {
    std::vector<pid_t> found;
    for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
        std::error_code none;
        const std::string name = entry.path().filename();
        if (name.find_first_not_of("0123456789") != std::string::npos) continue;
        std::ifstream file(entry.path() / "cmdline", std::ios::binary);
        const std::string words{std::istreambuf_iterator<char>(file), {}};
        if (words.starts_with(LOBATTO_MPI_PROGRAM) && words.find(output) != std::string::npos)
            found.push_back(static_cast<pid_t>(std::stol(name)));
    }
    return found;
}

}  // namespace

TEST_CASE("four processes write the table of one, in every format, with all that can vary") {
    const test::SweepFolder place;
    for (const char* name : {"a.csv", "a.npy"}) {
        const std::vector<std::string> words{"--random", "700",
                                             "--seed",   "3",
                                             "--draw",   "q ~ uniform(0, 3.2)",
                                             "--vary",   "m=1,2",
                                             "--vary",   "step=0.1,0.05",
                                             "--until",  "3",
                                             "--every",  "7"};
        place.sweep(name, words);
        const test::Finished done = test::run(mpi_command(place.file(std::string("mpi_") + name), words));
        CHECK_MESSAGE((done.exit_code == 0 || done.exit_code == 3), done.err);
        CHECK(test::read_file(place.file(std::string("mpi_") + name)) == test::read_file(place.file(name)));
        CHECK(done.out.find("  trajectories            2800") != std::string::npos);
    }
}

TEST_CASE("what all processes warn of is told once") {
    const test::SweepFolder place;
    // Each process knows that end times differ; some also have a trajectory whose step is too long.
    test::write_text(place.file("driven.toml"),
                     "time = \"t\"\nlagrangian = \"q'^2/2 + 100*cos(q) + 5*q*sin(t)\"\n[coordinates]\n"
                     "q = { position = 0.1, velocity = 0 }\n[run]\nstep = 0.32\nuntil = 40\n");
    const test::Finished done = test::run(mpi_command(
        place.file("a.csv"), {"--vary", "step=0.32,0.31", "--vary", "q=0.1:0.2:40", "--beyond-horizon", "--quiet"},
        place.file("driven.toml")));
    CHECK(done.exit_code == 0);
    CHECK(done.err.find("the step is beyond the linear stability limit") != std::string::npos);
    const std::string what = "the end time is not a multiple of every step";
    const std::size_t first = done.err.find(what);
    CHECK(first != std::string::npos);
    CHECK(done.err.find(what, first + 1) == std::string::npos);
}

TEST_CASE("an error is told once, with its exit code") {
    const test::SweepFolder place;
    const test::Finished done = test::run(mpi_command(place.file("a.csv"), {"--vary", "r=1"}));
    CHECK(done.exit_code == 2);
    const std::string what = "unknown name 'r'";
    const std::size_t first = done.err.find(what);
    CHECK(first != std::string::npos);
    CHECK(done.err.find(what, first + 1) == std::string::npos);
}

TEST_CASE("what a lost process leaves goes on, alone or together, to the same bytes") {
    const test::SweepFolder place;
    const std::vector<std::string> words{"--vary", "q=0:3:40000", "--until", "19"};
    const std::string whole = place.bytes("whole.csv", words);
    for (const bool together : {true, false}) {
        const std::string output = place.file(together ? "a.csv" : "b.csv"), partial = output + ".partial";
        std::vector<std::string> command = mpi_command(output, words);
        const pid_t pid = ::fork();
        if (pid == 0) {
            std::vector<char*> pointers;
            for (std::string& word : command) pointers.push_back(word.data());
            pointers.push_back(nullptr);
            ::dup2(::open("/dev/null", O_WRONLY), 1);
            ::dup2(::open("/dev/null", O_WRONLY), 2);
            ::execvp(pointers[0], pointers.data());
            ::_exit(127);
        }
        std::error_code none;
        for (int tries = 0; tries < 60000; ++tries) {
            if (std::filesystem::exists(partial, none) && std::filesystem::file_size(partial, none) > 30000) break;
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
        }
        const std::vector<pid_t> ranks = ranks_of(output);
        REQUIRE(ranks.size() == 4);
        ::kill(ranks.back(), SIGKILL);  // any of them, the one that writes too
        int status = 0;
        ::waitpid(pid, &status, 0);
        CHECK_FALSE((WIFEXITED(status) && WEXITSTATUS(status) == 0));
        for (int tries = 0; tries < 5000 && !ranks_of(output).empty(); ++tries)
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
        const bool is_finished = std::filesystem::exists(output, none);  // those that end in order name their table
        CHECK(std::filesystem::file_size(is_finished ? output : partial) < whole.size());
        std::vector<std::string> again = words;
        again.push_back("--resume");
        const test::Finished done = together ? test::run(mpi_command(output, again)) : place.sweep("b.csv", again);
        CHECK_MESSAGE(done.exit_code == 0, done.err);
        CHECK(done.out.find("  resumed                 after ") != std::string::npos);
        CHECK(test::read_file(output) == whole);
    }
}

#endif
