// SPDX-License-Identifier: GPL-2.0-or-later
// The command line is written on the library: what one refuses or warns of, the other does, in the same words.
#include <doctest/doctest.h>

#include <lobatto/lobatto.hpp>

#include "tests/support.hpp"

namespace {

namespace lob = lobatto::api;

const std::string pendulum = LOBATTO_SOURCE_DIR "/scenes/pendulum.toml";

// What the library says, with the exit code that it promises.
template <class Work>
std::pair<int, std::string> refusal_of(const Work& work) {
    try {
        work();
    } catch (const lob::Error& error) {
        return {error.exit_code(), error.what()};
    }
    return {0, "nothing was thrown"};
}

// What the command says on standard error, without the program's name and the end of the line.
std::pair<int, std::string> refusal_of_command(std::vector<std::string> words) {
    words.insert(words.begin(), LOBATTO_PROGRAM);
    const lobatto::test::Finished finished = lobatto::test::run(words);
    std::string said = finished.err;
    if (said.starts_with("lobatto: ")) said.erase(0, 9);
    if (said.ends_with("\n")) said.pop_back();
    return {finished.exit_code, said};
}

template <class Change>
lob::Settings settings(const Change& change) {
    lob::Settings all;
    change(all);
    return all;
}

}  // namespace

TEST_CASE("the command line and the library refuse the same with the same words and the same exit code" *
          doctest::test_suite("slow")) {
    const lob::Scene scene(pendulum);
    const lobatto::test::TemporaryFolder folder;
    const std::string csv = folder / "x.csv";
    lob::SweepOptions twice;
    twice.until = "1";
    twice.set = {{"omega", "6"}};
    lob::SweepOptions counted;
    counted.steps = -1;
    const lob::Starts starts{2, {{"omega", {6, 7}}}};
    const auto missing_equals = settings([](lob::Settings& all) { all.set = {{"omga", "6"}}; });
    const auto long_step = settings([](lob::Settings& all) { all.step = "0"; });
    const std::vector<std::pair<std::function<void()>, std::vector<std::string>>> both{
        {[&] { lob::sweep(scene, starts, twice); },
         {"sweep", pendulum, "--vary", "omega=6,7", "--until", "1", "--set", "omega=6", "-o", csv}},
        {[&] { lob::sweep(scene, starts, counted); },
         {"sweep", pendulum, "--vary", "omega=6,7", "--steps", "-1", "-o", csv}},
        {[&] { lob::tune(scene, 0.5); }, {"tune", pendulum, "--error", "0.5"}},
        {[&] { lob::tune(scene, 1e-3, {}, 0.5); }, {"tune", pendulum, "--error", "1e-3", "--budget", "0.5s"}},
        {[&] { lob::tune(scene, 1e-3, {}, 1e5); }, {"tune", pendulum, "--error", "1e-3", "--budget", "100000s"}},
        {[&] { lob::tune(scene, 1e-28, {}, 600); }, {"tune", pendulum, "--error", "1e-28", "--budget", "600s"}},
        {[&] {
             lob::RunOptions options;
             static_cast<lob::Settings&>(options) = missing_equals;
             lob::run(scene, options);
         },
         {"run", pendulum, "--set", "omga=6", "-o", csv}},
        {[&] {
             lob::RunOptions options;
             static_cast<lob::Settings&>(options) = long_step;
             lob::run(scene, options);
         },
         {"run", pendulum, "--step", "0", "-o", csv}},
        {[&] {
             lob::RunOptions options;
             options.clock = "auto";
             lob::run(scene, options);
         },
         {"run", pendulum, "--clock", "auto", "-o", csv}},
        {[&] { static_cast<void>(scene.stability_json(settings([](lob::Settings& all) { all.splitting = 6; }))); },
         {"stability", pendulum, "--splitting", "6"}},
    };
    for (const auto& [call, words] : both) {
        const auto of_library = refusal_of(call), of_command = refusal_of_command(words);
        const std::string command = words[0] + " ... " + words.back();
        INFO(command);
        CHECK(of_library.first == of_command.first);
        CHECK(of_library.first >= 2);
        CHECK(of_library.second == of_command.second);
    }
}

TEST_CASE("words that settings do not know, and settings that a call has no use for, are refused") {
    const lob::Scene scene(pendulum);
    const auto run_with = [&](const lob::Settings& given) {
        lob::RunOptions options;
        static_cast<lob::Settings&>(options) = given;
        return refusal_of([&] { lob::run(scene, options); }).second;
    };
    CHECK(
        run_with(settings([](lob::Settings& all) { all.numbers = "half"; })).starts_with("unknown numbers; there are"));
    CHECK(run_with(settings([](lob::Settings& all) { all.arithmetic = "cleann"; })) ==
          "unknown arithmetic 'cleann'; there are \"plain\" and \"clean\"");
    CHECK(run_with(settings([](lob::Settings& all) { all.clock = "r"; })).starts_with("unknown clock 'r'; there are"));
    CHECK(run_with(settings([](lob::Settings& all) { all.points = 13; })) ==
          "there is no method lobatto with 13; there are 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12");
    CHECK(run_with(settings([](lob::Settings& all) { all.points = 4, all.stages = 2; })) ==
          "points, stages and splitting name different methods; give one of them");
    CHECK(
        run_with(settings([](lob::Settings& all) { all.tolerance = -1; })).starts_with("the tolerance is -1; it must"));
    const auto longer = settings([](lob::Settings& all) { all.step = "0.1"; });
    CHECK(refusal_of([&] { lob::verify(scene, settings([](lob::Settings& all) { all.until = "5"; })); }).second ==
          "verify takes the scene's own values; leave out 'until', or write it into the scene");
    CHECK(refusal_of([&] { static_cast<void>(scene.emit(longer)); }).second.starts_with("emit takes the scene's own"));
    CHECK(refusal_of([&] { lob::tune(scene, 1e-4, longer); }).second ==
          "tune chooses the method, its numbers, the clock and the step; leave them out of the settings");
}

TEST_CASE("a sweep of the library warns as the command line does, and of lost trajectories where they are lost") {
    const lobatto::test::TemporaryFolder folder;
    const lob::Scene scene(pendulum);
    lob::SweepOptions options;
    options.step = "0.6";
    options.until = "12";
    options.measure = false;
    const lob::Sweep sweep = lob::sweep(scene, {2, {{"q", {0.01, 0.02}}}}, options);
    const lobatto::test::Finished finished =
        lobatto::test::run({LOBATTO_PROGRAM, "sweep", pendulum, "--vary", "q=0.01,0.02", "--step", "0.6", "--until",
                            "12", "--unmeasured", "--quiet", "-o", folder / "x.csv"});
    REQUIRE(sweep.warnings.size() == 1);
    CHECK(finished.err.starts_with("lobatto: warning: " + sweep.warnings[0] + ".\n"));

    const lob::Scene chaotic(LOBATTO_SOURCE_DIR "/scenes/double_pendulum.toml");
    lob::SweepOptions measured;
    measured.until = "60";
    measured.step = "0.1";
    const lob::Starts starts{1, {{chaotic.coordinates()[0].name, {3}}}};
    const int lost = lob::sweep(chaotic, starts, measured).status[0];
    measured.beyond_horizon = true;
    CHECK(lost == 8);
    CHECK(lob::sweep(chaotic, starts, measured).status[0] == 0);
    measured.until.clear();
    measured.steps = 7;
    CHECK(lob::sweep(chaotic, starts, measured).steps[0] == 7);
}

TEST_CASE("a run says that its end is no multiple of the step") {
    lob::RunOptions options;
    options.step = "0.3";
    options.until = "1";
    const lob::Scene scene(pendulum);
    CHECK_FALSE(lob::run(scene, options).reaches_end);
    options.until = "1.2";
    CHECK(lob::run(scene, options).reaches_end);
}
