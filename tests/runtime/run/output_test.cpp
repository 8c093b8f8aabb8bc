// SPDX-License-Identifier: GPL-2.0-or-later
// The trajectory file: bytes, round trip, what a crash leaves, what a refusing machine says.
#include "runtime/run/output.hpp"

#include <doctest/doctest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>

#include "runtime/error.hpp"
#include "tests/trajectory_table.hpp"

using namespace lobatto;

namespace {

// A folder of its own, removed at the end.
struct Folder {
    Folder() {
        char name[] = "/tmp/lobatto_output_XXXXXX";
        path = mkdtemp(name);
    }
    ~Folder() { std::filesystem::remove_all(path); }
    std::string operator/(const std::string& name) const { return path + "/" + name; }
    std::string path;
};

std::string content(const std::string& path) {
    std::ostringstream text;
    text << std::ifstream(path).rdbuf();
    return text.str();
}

TrajectoryHeader pendulum_header() {
    return {"A pendulum",
            "Lobatto, 4 points, h = 0.1",
            "0123456789abcdef",
            {{"m", "1"}, {"omega", "6.283185307179586"}},
            {{"t", ""}, {"q", "rad"}, {"p_q", ""}, {"H", ""}},
            true,
            {}};
}

const double two_rows[] = {0, 0.1, -2, 0.25, 1.0 / 3, 1e-300};
const double two_energies[] = {5, -0.0};
const Records two_records{two_rows, two_energies, 2, 3};

std::string error_of(const std::string& path) {
    try {
        TrajectoryFile file(path, pendulum_header());
        file.write(two_records);
        file.finish();
    } catch (const MachineError& error) {
        return error.what();
    }
    return "no error";
}

}  // namespace

TEST_CASE("a trajectory file says what it holds, and nothing of when and where") {
    const Folder folder;
    TrajectoryFile file(folder / "a.csv", pendulum_header());
    file.write(two_records);
    file.finish();
    CHECK(content(folder / "a.csv") ==
          "# lobatto trajectory\n"
          "# scene: A pendulum\n"
          "# method: Lobatto, 4 points, h = 0.1\n"
          "# kernel: 0123456789abcdef\n"
          "# parameters: m = 1, omega = 6.283185307179586\n"
          "# columns: t, q [rad], p_q, H\n"
          "t,q,p_q,H\n"
          "0,0.1,-2,5\n"
          "0.25,0.3333333333333333,1e-300,-0\n");
}

TEST_CASE("every double reads back to the same bits") {
    const Folder folder;
    std::vector<double> row{0.1,
                            1.0 / 3,
                            -1e-300,
                            std::numeric_limits<double>::denorm_min(),
                            std::numeric_limits<double>::max(),
                            6.283185307179586};
    for (double x = 1; x < 1e17; x *= 3.7) row.push_back(std::sqrt(x));
    row.resize(41, 2.0);  // t, q[20], p[20]
    TrajectoryHeader header;
    header.energy = false;
    for (std::size_t k = 0; k < row.size(); ++k) header.columns.emplace_back("x" + std::to_string(k), "");
    TrajectoryFile file(folder / "a.csv", header);
    file.write({row.data(), nullptr, 1, 41});
    file.finish();
    const test::TrajectoryTable table = test::read_trajectory(folder / "a.csv");
    CHECK(table.columns.size() == 41);
    REQUIRE(table.rows.size() == 1);
    CHECK(table.rows[0] == row);
}

TEST_CASE("until it is finished a trajectory stands beside its name, in whole lines, and the file of before stays") {
    const Folder folder;
    std::ofstream(folder / "a.csv") << "of before\n";
    {
        TrajectoryFile file(folder / "a.csv", pendulum_header());
        file.write(two_records);
        CHECK(content(folder / "a.csv") == "of before\n");
        CHECK(test::read_trajectory(folder / "a.csv.partial").rows.size() == 2);
        file.write(two_records);
        file.finish();
        CHECK(test::read_trajectory(folder / "a.csv").rows.size() == 4);
        CHECK(!std::filesystem::exists(folder / "a.csv.partial"));
    }
    { TrajectoryFile unfinished(folder / "a.csv", pendulum_header()); }
    CHECK(test::read_trajectory(folder / "a.csv").rows.size() == 4);
    CHECK(test::read_trajectory(folder / "a.csv.partial").rows.empty());
}

TEST_CASE("a torn last line is left out when a file is read") {
    const Folder folder;
    std::ofstream(folder / "a.csv") << "# lobatto trajectory\nt,q\n0,1\n0.1,2";
    const test::TrajectoryTable table = test::read_trajectory(folder / "a.csv");
    CHECK(table.comments == std::vector<std::string>{"lobatto trajectory"});
    CHECK(table.columns == std::vector<std::string>{"t", "q"});
    CHECK(table.rows == std::vector<std::vector<double>>{{0, 1}});
}

TEST_CASE("a symbolic link keeps pointing at what it pointed at") {
    const Folder folder;
    std::ofstream(folder / "target.csv") << "of before\n";
    std::filesystem::create_symlink("target.csv", folder / "link.csv");
    CHECK(error_of(folder / "link.csv") == "no error");
    CHECK(std::filesystem::is_symlink(folder / "link.csv"));
    CHECK(test::read_trajectory(folder / "target.csv").rows.size() == 2);
    // Also at what is not there yet.
    std::filesystem::create_symlink("new.csv", folder / "to_new.csv");
    CHECK(error_of(folder / "to_new.csv") == "no error");
    CHECK(std::filesystem::is_symlink(folder / "to_new.csv"));
    CHECK(test::read_trajectory(folder / "new.csv").rows.size() == 2);
}

TEST_CASE("two runs cannot write one file at the same time") {
    const Folder folder;
    TrajectoryFile file(folder / "a.csv", pendulum_header());
    const std::string path = folder / "a.csv.partial";
    CHECK(error_of(folder / "a.csv") ==
          "cannot write the trajectory to " + path +
              ": another run is writing it. Wait for it, or choose another place with -o");
    file.finish();
    CHECK(error_of(folder / "a.csv") == "no error");
}

TEST_CASE("a full disk, a missing folder and a folder in the way are named") {
    const Folder folder;
    CHECK(error_of("/dev/full") ==
          "cannot write the trajectory to /dev/full: No space left on device. Free some space, or choose another place "
          "with -o");
    CHECK(error_of(folder / "none/a.csv") ==
          "cannot write the trajectory to " + folder / "none/a.csv.partial" +
              ": No such file or directory. Create its folder first, or choose another place with -o");
    CHECK(error_of(folder.path) ==
          "cannot write the trajectory to " + folder.path + ": Is a directory. Choose another place with -o");
}

TEST_CASE("a folder that may only be read is named") {
    const Folder folder;
    ::chmod(folder.path.c_str(), 0555);
    const pid_t pid = ::fork();
    if (pid == 0) {
        if (::geteuid() == 0 && ::seteuid(65534) != 0) ::_exit(2);  // root may write everywhere
        ::_exit(error_of(folder / "a.csv") == "cannot write the trajectory to " + folder / "a.csv.partial" +
                                                  ": Permission denied. Choose another place with -o"
                    ? 0
                    : 1);
    }
    int status = 0;
    ::waitpid(pid, &status, 0);
    ::chmod(folder.path.c_str(), 0755);
    CHECK(status == 0);
    CHECK(std::filesystem::is_empty(folder.path));
}

TEST_CASE("a file that is written at once is there as a whole, or not at all with the advice of its writer") {
    const Folder folder;
    write_whole(folder / "a.csv", "the table", "1,2\n");
    CHECK(content(folder / "a.csv") == "1,2\n");
    std::filesystem::create_hard_link(folder / "a.csv", folder / "before");
    write_whole(folder / "a.csv", "the table", "3,4\n");
    CHECK(content(folder / "a.csv") == "3,4\n");
    CHECK(content(folder / "before") == "1,2\n");  // was not touched, but replaced

    const auto error = [](const std::string& path, const std::string& text) {
        try {
            write_whole(path, "the table", text, "leave it out");
        } catch (const MachineError& failure) {
            return std::string(failure.what());
        }
        return std::string("no error");
    };
    CHECK(error("/dev/full", "1") ==
          "cannot write the table to /dev/full: No space left on device. Free some space, or leave it out");
    CHECK(error(folder.path, "1") == "cannot write the table to " + folder.path + ": Is a directory. Leave it out");
    rlimit before{};
    ::getrlimit(RLIMIT_FSIZE, &before);
    const rlimit small{1000, before.rlim_max};
    const auto handler = std::signal(SIGXFSZ, SIG_IGN);
    ::setrlimit(RLIMIT_FSIZE, &small);
    const std::string large = error(folder / "a.csv", std::string(2000, '1'));
    ::setrlimit(RLIMIT_FSIZE, &before);
    std::signal(SIGXFSZ, handler);
    CHECK(large == "cannot write the table to " + folder / "a.csv.partial" +
                       ": File too large. Files may not be larger than `ulimit -f` says; raise it, or leave it out");
    CHECK(content(folder / "a.csv") == "3,4\n");
    CHECK_FALSE(std::filesystem::exists(folder / "a.csv.partial"));
}

TEST_CASE("a file without momenta and energy keeps the beginning of each row") {
    const Folder folder;
    TrajectoryHeader header = pendulum_header();
    header.columns = {{"t", ""}, {"q", "rad"}};
    header.energy = false;
    TrajectoryFile file(folder / "a.csv", header);
    file.write(two_records);
    file.finish();
    CHECK(content(folder / "a.csv").ends_with("# columns: t, q [rad]\nt,q\n0,0.1\n0.25,0.3333333333333333\n"));
}

TEST_CASE("a file of events counts them from one and says what they are") {
    const Folder folder;
    TrajectoryHeader header = pendulum_header();
    header.columns = {{"event", ""}, {"t", ""}, {"q", "rad"}, {"p_q", ""}};
    header.energy = false;
    header.events = {"q = 0 rising", "q' = 0"};
    const double rows[] = {1, 0.5, -2, 0, 0, 1, 0, 3.5};
    TrajectoryFile file(folder / "a.csv", header);
    file.write(EventRecords{rows, 2, 4});
    file.finish();
    CHECK(content(folder / "a.csv") ==
          "# lobatto events\n"
          "# scene: A pendulum\n"
          "# method: Lobatto, 4 points, h = 0.1\n"
          "# kernel: 0123456789abcdef\n"
          "# parameters: m = 1, omega = 6.283185307179586\n"
          "# event 1: q = 0 rising\n"
          "# event 2: q' = 0\n"
          "# columns: event, t, q [rad], p_q\n"
          "event,t,q,p_q\n2,0.5,-2,0\n1,1,0,3.5\n");
}
