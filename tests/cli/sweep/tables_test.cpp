// SPDX-License-Identifier: GPL-2.0-or-later
// Files of results: what their names say, what they say of themselves, where they are not written.
#include <doctest/doctest.h>

#include <chrono>
#include <nlohmann/json.hpp>
#include <thread>

#include "cli/table/hdf5_file.hpp"
#include "cli/table/table_reader.hpp"
#include "runtime/files/decimal.hpp"
#include "tests/cli/sweep/tables.hpp"

using namespace lobatto;
using test::pendulum_file;

TEST_CASE("the ending of a name says what is written; one that is not known is an error and no CSV") {
    const test::SweepFolder place;
    for (const char* name : {"table.txt", "table", "table.CSV", "table.hdf5", "csv"}) {
        const std::string said = "-o: " + place.file(name) +
                                 " has an ending that is not known; it says what is written: .csv, .npy (NumPy) or .h5 "
                                 "(HDF5)\n";
        CHECK(place.refusal(name, {"--vary", "q=1,2", "--until", "1"}) == said);
        const test::Finished run = place.lobatto({"run", pendulum_file, "--until", "1", "-o", place.file(name)});
        CHECK(run.exit_code == 2);
        CHECK(run.err == said);
        CHECK_FALSE(std::filesystem::exists(place.file(name)));
    }
}

TEST_CASE("standard output gets the table alone, the same as a file") {
    const test::SweepFolder place;
    const std::string table = place.bytes("a.csv", {"--vary", "q=1,2", "--until", "1"});
    const test::Finished sweep = place.lobatto({"sweep", pendulum_file, "--vary", "q=1,2", "--until", "1", "-o", "-"});
    CHECK(sweep.exit_code == 0);
    CHECK(sweep.out == table);
    REQUIRE(place.lobatto({"run", pendulum_file, "--until", "1", "-o", place.file("r.csv")}).exit_code == 0);
    const test::Finished run = place.lobatto({"run", pendulum_file, "--until", "1", "-o", "-"});
    CHECK(run.out == test::read_file(place.file("r.csv")));
    CHECK(run.err == "");
    for (const char* command : {"run", "sweep"}) {
        std::vector<std::string> words{command, pendulum_file, "--until", "1", "-o", "-", "--resume"};
        if (words[0] == "sweep") words.insert(words.end(), {"--vary", "q=1"});
        const test::Finished resumed = place.lobatto(words);
        CHECK(resumed.exit_code == 2);
        CHECK(resumed.err.starts_with("--resume: standard output "));
    }
}

TEST_CASE("a .npy has beside it what it is: columns, units, scene, method, version") {
    const test::SweepFolder place;
    place.bytes("a.npy", {"--vary", "q=1,2", "--until", "1"});
    const auto json = nlohmann::json::parse(test::read_file(place.file("a.npy.json")));
    CHECK(json["kind"] == "sweep");
    CHECK(json["scene"] == "A plane pendulum");
    CHECK(json["method"] == "Lobatto, 4 points, h = 0.05");
    CHECK(json["vary"] == nlohmann::json{"q = 1,2"});
    CHECK(json["scene_text"] == test::read_file(pendulum_file));
    CHECK(json["lobatto"].get<std::string>().find('.') != std::string::npos);
    CHECK(json["columns"][1] == nlohmann::json{{"name", "q(0)"}, {"unit", "rad"}, {"type", "float64"}});
    CHECK(json["columns"][2]["type"] == "int64");
}

TEST_CASE("a run as .npy or .h5 has the numbers of its CSV" * doctest::test_suite("slow")) {
    const test::SweepFolder place;
    const auto run = [&](const std::string& name, const std::vector<std::string>& more = {}) {
        std::vector<std::string> words{"run", pendulum_file, "--until", "2", "-o", place.file(name)};
        words.insert(words.end(), more.begin(), more.end());
        return place.lobatto(words);
    };
    REQUIRE(run("a.csv").exit_code == 0);
    const test::TrajectoryTable text = test::read_trajectory(place.file("a.csv"));
    for (const TableFormat format : {TableFormat::npy, TableFormat::h5}) {
        if (format == TableFormat::h5 && !has_hdf5()) continue;
        const std::string name = std::string("a") + ending_of(format);
        const test::Finished done = run(name);
        CHECK_MESSAGE(done.exit_code == 0, done.err);
        TableReader reader(place.file(name), format, place.file(name + ".json"));
        CHECK(reader.head().kind == "trajectory");
        CHECK(reader.head().scene_text == test::read_file(pendulum_file));
        REQUIRE(reader.head().columns.size() == text.columns.size());
        for (std::size_t c = 0; c < text.columns.size(); ++c) CHECK(reader.head().columns[c].name == text.columns[c]);
        CHECK(reader.head().columns[1].unit == "rad");
        std::vector<TableCell> cells;
        REQUIRE(reader.read(cells, 1000) == text.rows.size());
        for (std::size_t i = 0; i < cells.size(); ++i)
            CHECK(real_in(cells[i]) == text.rows[i / text.columns.size()][i % text.columns.size()]);
        CHECK(run(name, {"--resume"}).err ==
              "--resume: " + place.file(name) + " cannot be continued, only a .csv can; leave --resume out\n");
        const test::Finished wide = run("wide" + std::string(ending_of(format)), {"--numbers", "quadruple"});
        REQUIRE_MESSAGE(wide.exit_code == 0, wide.err);
        TableReader wide_reader(place.file("wide" + std::string(ending_of(format))), format,
                                place.file("wide" + std::string(ending_of(format)) + ".json"));
        // Three columns for each number, of which it is the sum.
        REQUIRE(wide_reader.head().columns.size() == 3 * text.columns.size());
        CHECK(wide_reader.head().columns[3].name == "q");
        CHECK(wide_reader.head().columns[4].name == "q.rest");
        CHECK(wide_reader.head().columns[5].name == "q.rest2");
        REQUIRE(run("wide.csv", {"--numbers", "quadruple"}).exit_code == 0);
        const std::string line = test::read_file(place.file("wide.csv"));
        const std::size_t last = line.rfind('\n', line.size() - 2) + 1, first = line.find(',', last) + 1;
        double parts[3];
        REQUIRE(read_decimal(line.substr(first, line.find(',', first) - first), parts, 3));
        REQUIRE(wide_reader.read(cells, 1000) == text.rows.size());
        for (std::size_t part = 0; part < 3; ++part)
            CHECK(real_in(cells[cells.size() - 3 * text.columns.size() + 3 + part]) == parts[part]);
    }
}

TEST_CASE(
    "HDF5 is written where the program has it, the same bytes each time, and is an error of exit code 4 elsewhere") {
    const test::SweepFolder place;
    const std::vector<std::string> words{"--vary", "q=1,2", "--until", "1"};
    if (!has_hdf5()) {
        CHECK(place.refusal("a.h5", words, 4) ==
              "lobatto: " + place.file("a.h5") +
                  ": this program was built without HDF5. Install libhdf5-dev and build it again, or name a .csv or "
                  ".npy\n");
        return;
    }
    const std::string one = place.bytes("a.h5", words);
    CHECK(one.starts_with("\x89HDF\r\n"));
    std::this_thread::sleep_for(std::chrono::milliseconds(1100));  // HDF5's times are in seconds
    CHECK(place.bytes("b.h5", words) == one);
    CHECK_FALSE(std::filesystem::exists(place.file("a.h5.partial")));
    CHECK_FALSE(std::filesystem::exists(place.file("a.h5.partial.json")));
    // A disk without room for it.
    test::write_text(place.file("c.h5.new"), "of somebody else");
    CHECK(place.refusal("c.h5", words, 4).find("c.h5.new is there, and Lobatto did not write it") != std::string::npos);
    CHECK(test::read_file(place.file("c.h5.new")) == "of somebody else");
    CHECK_FALSE(std::filesystem::exists(place.file("c.h5")));
    test::write_text(place.file("d.h5"), "\x89HDF and nothing more");
    const test::Finished merged = place.lobatto({"merge", place.file("d.h5"), "-o", place.file("e.h5")});
    CHECK(merged.exit_code == 4);
    CHECK(merged.err.find("it is no table that Lobatto wrote as HDF5, or is damaged") != std::string::npos);
}
