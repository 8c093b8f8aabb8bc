// SPDX-License-Identifier: GPL-2.0-or-later
// What programs read: every --json by its schema in docs/schemas/.
#include <doctest/doctest.h>

#include "tests/json_schema.hpp"
#include "tests/support.hpp"

using namespace lobatto;

namespace {

const std::string tree = LOBATTO_SOURCE_DIR;

std::string scene(const std::string& name) {
    return tree + "/scenes/" + name + ".toml";
}

// The answer of a command, by its schema.
nlohmann::json answer_in(const test::Finished& finished, const std::string& schema, int exit_code = 0) {
    CAPTURE(schema);
    CAPTURE(finished.err);
    CHECK(finished.exit_code == exit_code);
    const nlohmann::json answer = nlohmann::json::parse(finished.out);
    const test::JsonSchema rules(nlohmann::json::parse(test::read_file(tree + "/docs/schemas/" + schema + ".json")));
    CHECK(rules.complaint(answer) == "");
    if (schema != "derive" && schema.find("stability") == std::string::npos) CHECK(answer["command"] == schema);
    CHECK(answer["format"] == 1);
    return answer;
}

test::Finished asked(std::vector<std::string> command) {
    command.insert(command.begin(), LOBATTO_PROGRAM);
    command.emplace_back("--json");
    return test::run(command);
}

nlohmann::json answer_of(const std::string& schema, const std::vector<std::string>& command, int exit_code = 0) {
    return answer_in(asked(command), schema, exit_code);
}

}  // namespace

TEST_CASE("run --json: numbers for everything that run prints, also of a run that fails or stops" *
          doctest::test_suite("slow")) {
    const test::TemporaryFolder folder;
    const std::string output = folder / "run.csv";
    const auto pendulum = answer_of("run", {"run", scene("pendulum"), "-o", output});
    CHECK(pendulum["ending"] == "done");
    CHECK(pendulum["steps"] == 2400);
    CHECK(pendulum["energy_error_relative"].get<double>() < 1e-7);
    CHECK(pendulum["measured_error"]["at_end"].get<double>() > 0);
    CHECK(pendulum["position_error"].get<double>() < 1e-7);
    CHECK(pendulum["files"]["trajectory"] == output);
    const auto lost = answer_of("run", {"run", scene("double_pendulum"), "--until", "1000", "-o", output}, 3);
    CHECK(lost["ending"] == "failed");
    CHECK(lost["failure"].get<std::string>().find("no longer accurate") != std::string::npos);
    CHECK(lost["measured_error"]["lost_after"].is_number());
    const auto ball = answer_of("run", {"run", scene("bouncing_ball"), "-o", output});
    CHECK(ball["events"].size() >= 1);
    CHECK(ball["events"][0]["count"].get<double>() > 1);
    const auto rod = answer_of("run", {"run", scene("rod_pendulum"), "-o", output});
    CHECK(rod["state"]["q"].size() == 2);
    answer_of("run", {"run", scene("driven_damped_pendulum"), "-o", output});
    answer_of("run", {"run", scene("pythagorean"), "-o", output});
}

TEST_CASE("sweep --json tells of every setting, and why trajectories failed") {
    const test::TemporaryFolder folder;
    const std::string table = folder / "t.csv";
    const auto swept = answer_of("sweep", {"sweep", scene("pendulum"), "--vary", "q=0.5:1:3", "--vary", "step=0.1,0.05",
                                           "--until", "5", "-o", table});
    CHECK(swept["settings"].size() == 2);
    CHECK(swept["rows"] == 6);
    CHECK(swept["settings"][1]["measured_error"]["value"].get<double>() < 1e-6);
    const auto failed = answer_of("sweep",
                                  {"sweep", scene("kepler"), "--vary", "y'=0.01,2", "--step", "0.3", "--points", "2",
                                   "--until", "20", "-o", table},
                                  3);
    CHECK(failed["ending"] == "failed");
    CHECK(failed["failures"].size() >= 1);
    // Where rows are read back it is JSON all the same.
    answer_of("sweep", {"sweep", scene("pendulum"), "--vary", "q=0.5:1:3", "--until", "5", "--resume", "-o",
                        folder / "again.csv"});
    answer_of("sweep", {"sweep", scene("pendulum"), "--vary", "q=0.5:1:3", "--until", "5", "--resume", "-o",
                        folder / "again.csv"});
    CHECK(test::run({LOBATTO_PROGRAM, "run", scene("pendulum"), "--json", "-o", "-"}).exit_code == 2);
    CHECK(test::run({LOBATTO_PROGRAM, "sweep", scene("pendulum"), "--vary", "q=1,2", "--json", "-o", "-"}).exit_code ==
          2);
}

TEST_SUITE("slow") {
    TEST_CASE("the reports of the other commands keep their schemas") {
        const test::TemporaryFolder folder;
        CHECK(answer_of("check", {"check", scene("two_pendulums")})["step"]["unknowns"] == 4);
        // The multipliers of constraints stand among what is solved for.
        const auto crank = answer_of("check", {"check", scene("slider_crank")});
        CHECK(crank["step"]["groups"][0]["coordinates"].dump().find("lambda_guide") != std::string::npos);
        answer_of("derive", {"derive", scene("pendulum")});
        answer_of("derive", {"derive", scene("rod_pendulum")});
        answer_of("stability_members", {"stability"});
        answer_of("stability", {"stability", scene("harmonic_oscillator")});
        answer_of("stability", {"stability", scene("henon_heiles")});
        answer_of("stability", {"stability", scene("lagrange_top")});  // without equilibria
        const auto proof = answer_of("verify", {"verify", scene("pendulum")});
        CHECK(proof["holds"] == true);
        CHECK(proof["claims"].size() > 10);
        const auto choice = answer_in(
            test::with_enough_time([&](const std::string& budget) {
                return asked({"tune", scene("pendulum"), "--error", "1e-3", "--until", "5", "--budget", budget});
            }),
            "tune");
        CHECK(choice["choice"]["error"].get<double>() <= 1e-3);
        const auto noise = answer_of("roundoff", {"roundoff", scene("kepler"), "--steps", "1000", "--trajectories", "2",
                                                  "--no-picture", "-o", folder / "roundoff"});
        CHECK(noise["plain"]["rows"].size() == noise["clean"]["rows"].size());
        const auto trade = answer_in(test::with_enough_time([&](const std::string& budget) {
                                         return asked({"tradeoff", scene("pendulum"), "--until", "5", "--budget",
                                                       budget, "-o", folder / "tradeoff"});
                                     }),
                                     "tradeoff");
        CHECK(trade == nlohmann::json::parse(test::read_file(folder / "tradeoff/tradeoff.json")));
        const auto emitted = answer_of("emit", {"emit", scene("pendulum"), "-o", folder / "kernels"});
        CHECK(emitted["files"].size() == 2);
        CHECK(emitted["passes"].size() > 3);
        answer_of("emit", {"emit", scene("pendulum"), "--plain", "-o", folder / "plain"});
        const auto page =
            answer_of("view", {"view", scene("pendulum"), "--beside", "points=2", "-o", folder / "v.html"});
        CHECK(page["drawn"].size() == 2);
        CHECK(page["drawn"][1]["title"] == "Lobatto, 2 points");
        const auto pictures = answer_of("gallery", {"gallery", scene("kepler"), "-o", folder / "gallery"});
        CHECK(std::filesystem::exists(pictures["drawn"][0]["file"].get<std::string>()));
    }

    TEST_CASE("the report of a search for equilibria in long formulas keeps its schema" *
              doctest::test_suite("slowest")) {
        answer_of("stability", {"stability", scene("gyroscopic_pendulum")});  // without modes
    }

    TEST_CASE("paper --json says of every statement how it was decided") {
        const test::TemporaryFolder folder;
        const auto paper = answer_of("paper", {"paper", "--no-figures", "-o", folder / "paper"});
        CHECK(paper["statements"].size() > 20);
        for (const auto& statement : paper["statements"]) CHECK(statement["resolved"] == true);
        for (const auto& table : paper["tables"]) CHECK(table["reproduced"] == true);
    }
}

TEST_CASE("view says that a motion on its page is wrong, as run does") {
    const test::TemporaryFolder folder;
    test::write_text(folder / "fall.toml",
                     "lagrangian = \"x'^2/2 + 1/x\"\n[coordinates]\nx = { position = 1, velocity = 0 }\n[run]\nstep = "
                     "0.1\nuntil = 10\n");
    const auto page = answer_of("view", {"view", folder / "fall.toml", "-o", folder / "fall.html"});
    CHECK(page["drawn"][0]["failure"].is_string());
    const auto good = answer_of("view", {"view", scene("pendulum"), "--until", "5", "-o", folder / "good.html"});
    CHECK(good["drawn"][0]["failure"].is_null());
}

TEST_CASE("a schema that is broken says where") {
    const test::JsonSchema rules(nlohmann::json::parse(test::read_file(tree + "/docs/schemas/emit.json")));
    CHECK(rules.complaint({{"format", 2}}) != "");
    CHECK(rules.complaint({{"format", 1}, {"command", "emit"}}) == "$ has no \"scene\"");
}
