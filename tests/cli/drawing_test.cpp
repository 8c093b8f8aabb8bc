// SPDX-License-Identifier: GPL-2.0-or-later
// Drawings: whole under their names, or nothing and the reason.
#include "cli/print/drawing.hpp"

#include <doctest/doctest.h>

#include "runtime/error.hpp"
#include "tests/support.hpp"

using namespace lobatto;
using namespace lobatto::test;

namespace {

// A folder with a picture of before, and a gnuplot of our own.
struct Studio {
    TemporaryFolder folder, programs;
    EnvironmentVariable path{"PATH", programs.string()};

    Studio() { write_text(folder / "a.svg", "of before"); }
    std::string error(const std::string& without = "") const {
        return message_of<MachineError>([&] { draw(folder.string(), "a", "plot x\n", 300, 200, without); });
    }
    std::string error_of(const std::string& gnuplot) const {
        write_script(programs / "gnuplot", gnuplot);
        const std::string error = this->error();
        CHECK(read_file(folder / "a.svg") == "of before");
        CHECK(std::distance(std::filesystem::directory_iterator(folder.string()), {}) == 1);  // nothing is left
        return error;
    }
};

}  // namespace

TEST_CASE("without gnuplot the error says what to install, and how to do without a picture where one can") {
    const Studio studio;
    const std::string missing = "cannot draw " + (studio.folder / "a.svg").string() +
                                ": gnuplot is missing. Install it (apt install gnuplot-nox)";
    CHECK(studio.error() == missing);
    CHECK(studio.error("leave --chart out") == missing + ", or leave --chart out");
}

TEST_CASE("a gnuplot that fails is quoted, and half a picture is none") {
    const Studio studio;
    const std::string picture = (studio.folder / "a.svg").string();
    CHECK(studio.error_of("echo 'line 3: no such style' >&2; exit 1\n") ==
          "gnuplot could not draw " + picture + ": line 3: no such style\n");
    CHECK(studio.error_of("exit 1\n") == "gnuplot could not draw " + picture + ": no message");
    CHECK(studio.error_of("exit 0\n") ==
          "gnuplot could not draw " + picture + ": the picture is not whole. Is the disk full?");
    CHECK(studio.error_of("echo '<svg>' > \"${1%script}picture\"\n") ==
          "gnuplot could not draw " + picture + ": the picture is not whole. Is the disk full?");
}

TEST_CASE("a folder that refuses a picture is named, and nothing about gnuplot is said") {
    const TemporaryFolder folder;
    CHECK(message_of<MachineError>([&] { draw(folder / "none", "a", "plot x\n", 300, 200); }) ==
          "cannot write the picture to " + (folder / "none/a.svg").string() +
              ": No such file or directory. Create its folder first, or choose another place with -o");
    std::filesystem::create_directory(folder / "a.svg");
    CHECK(message_of<MachineError>([&] { draw(folder.string(), "a", "plot x\n", 300, 200, "leave it out"); }) ==
          "cannot write the picture to " + (folder / "a.svg").string() + ": Is a directory. Leave it out");
}

TEST_CASE("a text between quotes stays one") {
    CHECK(gnuplot_text("it's `touch pwned`") == "'it''s `touch pwned`'");
}
