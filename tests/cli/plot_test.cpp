// SPDX-License-Identifier: GPL-2.0-or-later
// lobatto plot: curves of trajectories and tables.
#include "cli/plot/plot_script.hpp"

#include <doctest/doctest.h>

#include <fmt/format.h>

#include <cmath>

#include "cli/print/drawing.hpp"
#include "cli/table/hdf5_file.hpp"
#include "generator/formula/text/source.hpp"
#include "tests/support.hpp"

using namespace lobatto;

namespace {

const std::string tree = LOBATTO_SOURCE_DIR;

test::Finished plot(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {LOBATTO_PROGRAM, "plot"});
    return test::run(arguments);
}

std::string ran(const test::TemporaryFolder& folder, const std::string& scene) {
    const std::string path = folder / (scene + ".csv");
    REQUIRE(test::run({LOBATTO_PROGRAM, "run", tree + "/scenes/" + scene + ".toml", "-o", path, "--quiet"}).exit_code ==
            0);
    return path;
}

// How many numbers stand in the first block of a script.
std::ptrdiff_t points_in(const std::string& script) {
    const std::size_t begin = script.find("<< EOD\n") + 7;
    const std::string block = script.substr(begin, script.find("EOD\n", begin) - begin);
    return std::count(block.begin(), block.end(), '\n');
}

}  // namespace

TEST_CASE("a trajectory becomes a picture: SVG, PNG, characters") {
    const test::TemporaryFolder folder;
    const std::string run = ran(folder, "kepler"), svg = folder / "k.svg", png = folder / "k.png";
    CHECK(plot({run, "--x", "x", "--y", "y", "-o", svg}).exit_code == 0);
    CHECK(test::read_file(svg).find("A planet around the sun") != std::string::npos);
    CHECK(plot({run, "-o", svg}).exit_code == 0);  // again, with a panel each
    CHECK(plot({run, "--y", "x,y", "--y", "H", "-o", png}).exit_code == 0);
    CHECK(test::read_file(png).starts_with("\x89PNG"));
    const test::Finished characters = plot({run, "--x", "x", "--y", "y", "--terminal"});
    CHECK(characters.exit_code == 0);
    CHECK(std::count(characters.out.begin(), characters.out.end(), '*') > 50);
}

TEST_CASE("a column that says again what the time says has no panel unless it is asked for") {
    const test::TemporaryFolder folder;
    const std::string table = folder / "clocked.csv", svg = folder / "clocked.svg";
    test::write_text(table, "t,time,angle,p_time\n0,0,1,3\n1,1,2,3\n2,2.0000000000000004,5,3\n");
    CHECK(plot({table, "-o", svg}).exit_code == 0);
    CHECK(test::read_file(svg).find(">angle<") != std::string::npos);
    CHECK(test::read_file(svg).find(">time<") == std::string::npos);
    CHECK(plot({table, "--y", "time", "-o", svg}).exit_code == 0);
    CHECK(test::read_file(svg).find(">time<") != std::string::npos);
}

TEST_CASE("events are marked, and several files stand in one picture") {
    const test::TemporaryFolder folder;
    const std::string run = ran(folder, "bouncing_ball");
    CHECK(plot({run, "--y", "y", "--events", "-o", folder / "e.svg"}).exit_code == 0);
    const NumberTable table = read_number_table(run), events = read_number_table(folder / "bouncing_ball.events.csv");
    CHECK(table.column("y").unit == "m");
    CHECK(table.title == "A bouncing ball");
    const std::string marked = plot_script({table}, {events}, {"t", {{"y"}}}, true);
    CHECK(marked.find("points pt 6") != std::string::npos);
    CHECK(plot_script({table}, {}, {"t", {{"y"}}}, true).find("points pt 6") == std::string::npos);
    CHECK(plot_script({table, table}, {}, {"t", {{"y"}}}, true).find("title 'bouncing_ball'") != std::string::npos);
    CHECK(plot({ran(folder, "kepler"), "--events"}).exit_code == 2);
    std::filesystem::copy(folder / "bouncing_ball.events.csv", folder / "kepler.events.csv");
    const test::Finished others = plot({folder / "kepler.csv", "--events"});
    CHECK(others.exit_code == 2);
    CHECK_MESSAGE(test::contains(others.err, "kepler.events.csv is of another run than"), others.err);
}

TEST_CASE("both axes have one scale where they are lengths of one body, and nowhere else") {
    NumberTable table{
        "x.csv", "title", {{"t", "", {0, 1}}, {"x", "", {0, 1}}, {"y", "", {2, 3}}, {"theta", "rad", {1, 2}}}};
    CHECK(plot_script({table}, {}, {"x", {{"y"}}}, true).find("ratio -1") != std::string::npos);
    CHECK(plot_script({table}, {}, {"t", {{"y"}}}, true).find("ratio -1") == std::string::npos);
    CHECK(plot_script({table}, {}, {"theta", {{"theta"}}}, true).find("ratio -1") == std::string::npos);
}

TEST_CASE("an energy that hardly changes is drawn as its change") {
    NumberTable table{"x.csv", "title", {{"t", "", {0, 1, 2}}, {"H", "", {14.5, 14.5 + 1e-9, 14.5}}}};
    const std::string script = plot_script({table}, {}, {"t", {{"H"}}}, true);
    CHECK(script.find("H - H(0)") != std::string::npos);
    CHECK(script.find("0,0\n") != std::string::npos);
}

TEST_CASE("of a long curve the outline is kept") {
    NumberTable table{"x.csv", "", {{"t", "", {}}, {"y", "", {}}}};
    for (int i = 0; i < 300000; ++i) {
        table.columns[0].values.push_back(i);
        table.columns[1].values.push_back(i == 123457 ? 9 : std::sin(i));
    }
    const std::string script = plot_script({table}, {}, {"t", {{"y"}}}, true);
    CHECK(points_in(script) <= 20001);
    CHECK(script.find("123457,9\n") != std::string::npos);
}

TEST_CASE("tables of NumPy are read: records, and rows of columns") {
    const test::TemporaryFolder folder;
    const std::string table = folder / "t.npy";
    REQUIRE(test::run({LOBATTO_PROGRAM, "sweep", tree + "/scenes/pendulum.toml", "--vary", "q=0.5:1:7", "--until", "1",
                       "-o", table, "--quiet"})
                .exit_code == 0);
    const NumberTable read = read_number_table(table);
    CHECK(read.column("q").values.size() == 7);
    CHECK(plot({table, "--x", "q", "--y", "p_q", "-o", folder / "t.svg"}).exit_code == 0);
    // numpy.save of [[1, 2], [3, 4.5]]: format 1.0, a head of 118 bytes.
    std::string dictionary = "{'descr': '<f8', 'fortran_order': False, 'shape': (2, 2), }";
    dictionary.resize(117, ' ');
    std::string bytes = std::string("\x93NUMPY\x01\x00\x76\x00", 10) + dictionary + "\n";
    for (const double value : {1.0, 2.0, 3.0, 4.5}) bytes.append(reinterpret_cast<const char*>(&value), 8);
    test::write_text(folder / "a.npy", bytes);
    CHECK(read_number_table(folder / "a.npy").column("1").values == std::vector<double>{2, 4.5});
}

TEST_CASE("tables of HDF5 are read, where the program has its library") {
    if (!has_hdf5()) return;
    const test::TemporaryFolder folder;
    const std::string path = folder / "k.h5";
    REQUIRE(test::run({LOBATTO_PROGRAM, "run", tree + "/scenes/kepler.toml", "--until", "1", "-o", path, "--quiet"})
                .exit_code == 0);
    const NumberTable table = read_number_table(path);
    CHECK(table.title == "A planet around the sun");
    CHECK(table.column("x").values.front() == 0.4);
    CHECK(table.column("t").values.size() == 51);
    CHECK(plot({path, "--x", "x", "--y", "y", "-o", folder / "k.svg"}).exit_code == 0);
    test::write_text(folder / "torn.h5", test::read_file(path).substr(0, 700));
    CHECK(plot({folder / "torn.h5"}).exit_code == 2);
}

TEST_CASE("names of files and columns are no commands of gnuplot") {
    const test::TemporaryFolder folder;
    const std::string pwned = folder / "pwned", run = ran(folder, "kepler");
    const std::string name = folder / "a\nsystem(\"touch pwned\")\n#.csv";
    std::filesystem::copy_file(run, name);
    CHECK(plot({name, run, "--y", "x", "-o", folder / "o.svg"}).exit_code == 0);
    CHECK(gnuplot_text("a\nb'c") == "'a b''c'");
    CHECK(gnuplot_text("x]]>y") == "'x]] >y'");  // "]]>" may not stand in XML
    CHECK_FALSE(std::filesystem::exists(pwned));
    CHECK_FALSE(std::filesystem::exists("pwned"));
}

TEST_CASE("of a long curve with gaps every number between them counts") {
    NumberTable table{"x.csv", "", {{"t", "", {}}, {"y", "", {}}}};
    for (int i = 0; i < 60000; ++i) {
        table.columns[0].values.push_back(i);
        table.columns[1].values.push_back(i % 200 == 199 ? static_cast<double>(i) : std::nan(""));
    }
    const std::string script = plot_script({table}, {}, {"t", {{"y"}}}, true);
    for (int i = 199; i < 60000; i += 200) CHECK(script.find(fmt::format("\n{0},{0}\n", i)) != std::string::npos);
}

TEST_CASE("what cannot be drawn is told with its reason and the mend") {
    const test::TemporaryFolder folder;
    const std::string run = ran(folder, "pendulum");
    const auto refusal = [&](std::vector<std::string> arguments) {
        arguments.insert(arguments.begin(), run);
        const test::Finished finished = plot(arguments);
        CHECK(finished.exit_code == 2);
        return finished.err;
    };
    CHECK(refusal({"--y", "p_k"}).find("there are t, q, p_q, H. Did you mean 'p_q'?") != std::string::npos);
    CHECK(refusal({"--y", "H", "-o", folder / "x.pdf"}).find("neither a .svg nor a .png") != std::string::npos);
    CHECK(refusal({"--y", ","}).find("name a column") != std::string::npos);
    CHECK(refusal({"-o", run}).find("neither") != std::string::npos);
    CHECK(plot({folder / "none.csv"}).exit_code == 2);
    CHECK(plot({tree + "/scenes/pendulum.toml"}).err.find("`lobatto run") != std::string::npos);
    test::write_text(folder / "torn.csv", "a,b\n1,2\n3,4\n5");
    CHECK(read_number_table(folder / "torn.csv").column("b").values.size() == 2);
    test::write_text(folder / "uneven.csv", "a,b\n1,2,3\n4,5\n");
    CHECK(plot({folder / "uneven.csv"}).err.find("line 2 has 3 numbers, but there are 2 columns") != std::string::npos);
    test::write_text(folder / "empty.csv", "a,b\n");
    CHECK(plot({folder / "empty.csv"}).exit_code == 2);
    test::write_text(folder / "negative.csv", "a,b\n1,-2\n2,-3\n");
    CHECK(plot({folder / "negative.csv", "--y", "b", "--log", "y"}).err.find("above 0") != std::string::npos);
    test::write_text(folder / "some.csv", "a,b\n0,-1\n1,10\n2,0\n3,100\n4,-50\n");
    CHECK(plot({folder / "some.csv", "--log", "y", "--terminal"}).err ==
          "lobatto: warning: " + (folder / "some.csv").string() +
              ": 3 of 5 rows of b over a are not drawn: they are not above 0, and an axis is logarithmic.\n");
    test::write_text(folder / "nan.csv", "a,b\n1,nan\n2,inf\n");
    CHECK(plot({folder / "nan.csv"}).exit_code == 2);
    CHECK(plot({folder.string()}).err.find("Is a directory") != std::string::npos);
    test::write_text(folder / "theirs.svg", "<svg>a drawing</svg>");
    CHECK(plot({run, "-o", folder / "theirs.svg"}).err.find("Lobatto did not write it") != std::string::npos);
    test::write_text(folder / "torn.npy", "\x93NUMPY\x01");
    CHECK(plot({folder / "torn.npy"}).exit_code == 2);
    CHECK(plot({"--log", "z", run}).err.find("x,y,xy") != std::string::npos);
}
