// SPDX-License-Identifier: GPL-2.0-or-later
// Hostile scenes: nothing of their text reaches a shell, a compiler or a drawing program as anything but text, and what
// costs too much ends with an error.
#include <doctest/doctest.h>
#include <sys/stat.h>

#include <string>
#include <vector>

#include "tests/support.hpp"
#include "tests/trajectory_table.hpp"

using namespace lobatto::test;

namespace {

// A scene with one piece of it replaced by the attacker's.
struct Pieces {
    std::string title = "\"Harmless\"", unit = "'`touch pwned`;$(touch pwned)*/%n'", name = "x", number = "1",
                event = "\"x = 0\"", key = "k";

    std::string text() const {
        return "title = " + title + "\nlagrangian = \"" + name + "'^2/2 - " + key + "*" + name +
               "^2/2 - x0*x0\"\n[definitions]\nx0 = \"" + name + "\"\n[coordinates]\n" + name + " = { unit = " + unit +
               ", position = 1, velocity = 0 }\n[parameters]\n" + key + " = " + number +
               "\n[run]\nstep = 0.1\nuntil = 1\n[output]\nevents = [" + event + "]\n";
    }
};

// Runs the program on the scene in a folder of its own. Whatever the scene says, no file `pwned` may appear.
Finished attack(const std::string& command, const Pieces& pieces, const std::vector<std::string>& options = {}) {
    const TemporaryFolder folder;
    write_text(folder / "scene.toml", pieces.text());
    std::string words = "cd '" + folder.string() + "' && exec '" LOBATTO_PROGRAM "' " + command + " scene.toml";
    for (const std::string& option : options) words += " " + option;
    const Finished finished = run({"sh", "-c", words});
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder.string()))
        CHECK_MESSAGE(!contains(entry.path().filename(), "pwned"), pieces.text());
    CHECK(finished.exit_code < 5);
    return finished;
}

}  // namespace

TEST_CASE("titles, units and events that a shell, C++, gnuplot or LaTeX would take for commands stay text" *
          doctest::test_suite("slow")) {
    const std::vector<std::string> texts = {
        "\"`touch pwned` $(touch pwned) ; touch pwned | touch pwned\"",
        "'''Its '; touch pwned; system('touch pwned')'''",
        "\"%s%n {} {0} @touch pwned@ */ #include ?\?/ #line 1 R'(\"",
        "'''{`touch pwned`} #{system} <<EOF'''",
    };
    for (const std::string& text : texts) {
        CAPTURE(text);
        Pieces pieces;
        pieces.title = text;
        const Finished done = attack("run", pieces);
        CHECK_MESSAGE(done.exit_code == 0, done.err);
        CHECK(attack("derive", pieces, {"--latex"}).exit_code == 0);
        CHECK(attack("gallery", pieces, {"-o", "drawings"}).exit_code == 0);
    }
}

TEST_CASE("quotes, backslashes, line ends and control characters in titles and units are refused") {
    for (const char* text : {"\"a\\nint main() {}\"", "\"a\\\\\"", "'a\"b'", "\"a\\u0007\"", "\"a\\u202eb\"",
                             "\"a\\u2028b\"", "\"a\\u001b[31m\"", "'''two\nlines'''"}) {
        CAPTURE(text);
        Pieces titled, united;
        titled.title = united.unit = text;
        CHECK(attack("run", titled).exit_code == 2);
        CHECK(attack("run", united).exit_code == 2);
    }
}

TEST_CASE("an event's text keeps the file of events one comment a line") {
    const TemporaryFolder folder;
    Pieces pieces;
    pieces.event = "\"\"\"x # not; touch pwned\n = 0\"\"\"";
    write_text(folder / "scene.toml", pieces.text());
    const Finished done = run({LOBATTO_PROGRAM, "run", folder / "scene.toml", "-o", folder / "a.csv"});
    REQUIRE_MESSAGE(done.exit_code == 0, done.err);
    const TrajectoryTable table = read_trajectory(folder / "a.events.csv");
    CHECK(table.columns.front() == "event");
    pieces.event = "\"x = 0 # \\u001b[31m\"";
    const Finished coloured = attack("run", pieces);
    CHECK_FALSE(contains(coloured.out, "\x1b"));
}

TEST_CASE("names and numbers that are none are refused where they stand") {
    for (const char* name : {"\"x; touch pwned\"", "\"x y\"", "\"x()\"", "\"$(touch pwned)\"", "\"x\\ny\"", "\"\"",
                             "\"__x\"", "\"x\\u0000\"", "\"\xc3\xa9\""}) {
        CAPTURE(name);
        Pieces pieces;
        pieces.key = name;
        CHECK(attack("run", pieces).exit_code == 2);
    }
    for (const char* number : {"\"system('touch pwned')\"", "\"1; touch pwned\"", "nan", "inf", "1e999",
                               "\"1e99999999\"", "\"9^9^9^9\"", "\"1/0\"", "\"`id`\"", "0x10p5", "\"exp(1e9)\""}) {
        CAPTURE(number);
        Pieces pieces;
        pieces.number = number;
        CHECK(attack("run", pieces).exit_code == 2);
    }
}

TEST_CASE("options are text too: they reach no shell, and a file's name no compiler") {
    CHECK(attack("run", {}, {"--set", "'k=`touch pwned`'"}).exit_code == 2);
    CHECK(attack("run", {}, {"--step", "'0.1; touch pwned'"}).exit_code == 2);
    const TemporaryFolder folder;
    const std::string name = folder / "-x $(touch pwned) ';.toml";
    write_text(name, Pieces().text());
    const Finished done = run({LOBATTO_PROGRAM, "run", name, "-o", folder / "`touch pwned`.csv"});
    CHECK_MESSAGE(done.exit_code == 0, done.err);
    CHECK(std::filesystem::exists(folder / "`touch pwned`.csv"));
    CHECK_FALSE(std::filesystem::exists(folder / "pwned"));
}

TEST_CASE("the name of a chart is no command and no option of the program that draws it" *
          doctest::test_suite("slow")) {
    const TemporaryFolder folder;
    write_text(folder / "scene.toml", Pieces().text());
    for (const std::string name :
         {"`touch pwned`.svg", "$(touch pwned).svg", "\"; system(\"touch pwned\"); #.svg", "'; !touch pwned; '.svg",
          "a\n!touch pwned\n.svg", "\".svg", "-e.svg", "-.svg", "--version.svg", "%d.svg", "@touch.svg"}) {
        CAPTURE(name);
        const Finished done = run({"sh", "-c", "cd \"$0\" && exec \"$@\"", folder.string(), LOBATTO_PROGRAM,
                                   "stability", "scene.toml", "--chart=" + name});
        CHECK_MESSAGE(done.exit_code == 0, done.err);
        CHECK(read_file(folder / name).ends_with("</svg>\n\n"));
        std::filesystem::remove(folder / name);
        // Nothing else is left.
        CHECK(std::distance(std::filesystem::directory_iterator(folder.string()), {}) == 1);
    }
}

TEST_CASE("the title in the pictures of tradeoff is no command") {
    Pieces pieces;
    pieces.title = "\"`touch pwned` it's $(touch pwned)\"";
    const Finished done = with_enough_time([&](const std::string& budget) {
        return attack("tradeoff", pieces, {"--budget", budget, "-o", "drawings"});
    });
    CHECK_MESSAGE(done.exit_code == 0, done.err);
}

TEST_CASE("a result does not take the place of its scene") {
    const TemporaryFolder folder;
    const std::string text = Pieces().text();
    const auto refuse = [&](const std::string& scene, std::vector<std::string> arguments, const std::string& result) {
        CAPTURE(result);
        write_text(folder / scene, text);
        arguments.insert(arguments.begin(), {"sh", "-c", "cd \"$0\" && exec \"$@\"", folder.string(), LOBATTO_PROGRAM});
        const Finished refused = run(arguments);
        CHECK(refused.exit_code == 2);
        CHECK(refused.err == result + ": the result would overwrite the scene " + scene + "; give it another name\n");
        CHECK(read_file(folder / scene) == text);
        CHECK_FALSE(std::filesystem::exists(folder / (scene + ".partial")));
    };
    write_text(folder / "s.toml", text);
    std::filesystem::create_symlink("s.toml", folder / "link.csv");
    refuse("s.toml", {"run", "s.toml", "-o", "./s.toml"}, "./s.toml");
    refuse("s.toml", {"run", "s.toml", "-o", "link.csv"}, "link.csv");
    refuse("s.toml", {"run", "s.toml", "-o", "s.toml", "--resume"}, "s.toml");
    refuse("a.csv.partial", {"run", "a.csv.partial", "-o", "a.csv"}, "a.csv");
    refuse("a.events.csv", {"run", "a.events.csv", "-o", "a.csv"}, "a.events.csv");
    refuse("s.toml", {"sweep", "s.toml", "--vary", "x=1,2", "-o", "s.toml"}, "s.toml");
    refuse("s.svg", {"stability", "s.svg", "--chart", "s.svg"}, "s.svg");
    refuse("s.hpp", {"emit", "s.hpp", "-o", "."}, "./s.hpp");
    refuse("roundoff.csv", {"roundoff", "roundoff.csv", "-o", "."}, "./roundoff.csv");
}

TEST_CASE("a derivation that takes too long or too much memory ends with an error that says what to do") {
    const TemporaryFolder folder;
    std::string product = "(q + r + 1)";
    for (int k = 2; k <= 28; ++k) product += "*(q + r + " + std::to_string(k) + ")";
    const std::string scene = folder / "huge.toml";
    write_text(scene, "lagrangian = \"q'^2/2 + r'^2/2 - " + product +
                          "\"\n[coordinates]\nq = { position = 1, velocity = 0 }\nr = { position = 0, velocity = 0 }\n"
                          "[run]\nstep = 0.1\nuntil = 1\n");
    const auto emit = [&] { return run({LOBATTO_PROGRAM, "emit", scene, "-o", folder / "out"}); };
    const std::string advice =
        ". Its cost grows with the size of the Lagrangian, faster than in proportion: write products out less, leave "
        "terms away, or raise the environment variable\n";
    {
        const EnvironmentVariable limit("LOBATTO_DERIVATION_SECONDS", "0.01");
        const Finished slow = emit();
        CHECK(slow.exit_code == 3);
        CHECK(slow.err == "lobatto: " + scene +
                              ": deriving the integrator takes more than 0.01 s (LOBATTO_DERIVATION_SECONDS)" + advice);
    }
    {
        const EnvironmentVariable limit("LOBATTO_DERIVATION_MEGABYTES", "5");
        const Finished large = emit();
        CHECK(large.exit_code == 3);
        CHECK(large.err ==
              "lobatto: " + scene +
                  ": deriving the integrator needs more than 5 MB of memory (LOBATTO_DERIVATION_MEGABYTES)" + advice);
    }
    {
        const EnvironmentVariable limit("LOBATTO_DERIVATION_SECONDS", "soon");
        const Finished wrong = emit();
        CHECK(wrong.exit_code == 2);
        CHECK(wrong.err ==
              "the environment variable LOBATTO_DERIVATION_SECONDS must be a number above 0, but is 'soon'\n");
    }
    CHECK_FALSE(std::filesystem::exists(folder / "out/huge.hpp"));
}
