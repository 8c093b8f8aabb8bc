// SPDX-License-Identifier: GPL-2.0-or-later
// The trade of speed for accuracy: its parts by themselves, `lobatto tradeoff` and `lobatto tune` from the outside.
#include <doctest/doctest.h>
#include <fmt/format.h>
#include <signal.h>

#include <chrono>
#include <cmath>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <numeric>
#include <regex>
#include <set>
#include <thread>

#include "analysis/kernel/kernel_of.hpp"
#include "analysis/stability/limit.hpp"
#include "analysis/tradeoff/experiment.hpp"
#include "analysis/tradeoff/measurement_json.hpp"
#include "analysis/tradeoff/measurement_store.hpp"
#include "analysis/tradeoff/method_text.hpp"
#include "cli/options/budget.hpp"
#include "generator/pipeline.hpp"
#include "runtime/measure/extrapolation.hpp"
#include "runtime/measure/frequency.hpp"
#include "runtime/measure/reference.hpp"
#include "tests/support.hpp"

using namespace lobatto;

namespace {

const std::string pendulum = LOBATTO_SOURCE_DIR "/scenes/pendulum.toml";
const std::string duffing = LOBATTO_SOURCE_DIR "/scenes/duffing.toml";

// A folder for results; the kernels of all tests here share one cache.
struct Place {
    static const std::string& cache() {
        static const test::TemporaryFolder folder;
        static const std::string path = folder.string();
        return path;
    }
    test::EnvironmentVariable variable{"LOBATTO_CACHE_DIR", cache()};
    test::TemporaryFolder folder;

    test::Finished run(std::vector<std::string> arguments) const {
        arguments.insert(arguments.begin(), LOBATTO_PROGRAM);
        return test::run(arguments);
    }
};

double number_after(const std::string& text, const std::string& pattern) {
    std::smatch match;
    return std::regex_search(text, match, std::regex(pattern + "\\s*([-+.0-9e]+)")) ? std::stod(match[1])
                                                                                    : std::nan("");
}

Quadrature lobatto_with(int points) {
    return quadrature_of({Family::lobatto, points, 0});
}

std::size_t rows_of_front(const std::string& folder) {
    return std::filesystem::exists(folder + "/tradeoff.json")
               ? nlohmann::json::parse(test::read_file(folder + "/tradeoff.json")).at("front").size()
               : 0;
}

std::vector<std::string> lines_of(const std::string& path) {
    std::vector<std::string> lines;
    std::ifstream file(path);
    for (std::string line; std::getline(file, line) && !file.eof();) lines.push_back(line);
    return lines;
}

// Sends SIGINT to the program's process group, as a terminal does, once `when` holds; its exit code.
int interrupted_when(std::vector<std::string> words, const std::string& log, const std::function<bool()>& when) {
    sigset_t interruption, before;
    sigemptyset(&interruption);
    sigaddset(&interruption, SIGINT);
    ::sigprocmask(SIG_BLOCK, &interruption, &before);  // until the child is no test any more
    const pid_t pid = ::fork();
    if (pid == 0) {
        ::setpgid(0, 0);
        ::signal(SIGINT, SIG_DFL);
        ::sigprocmask(SIG_SETMASK, &before, nullptr);
        std::vector<char*> pointers;
        for (std::string& word : words) pointers.push_back(word.data());
        pointers.push_back(nullptr);
        const int file = ::open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
        ::dup2(file, 1);
        ::dup2(file, 2);
        ::execv(pointers[0], pointers.data());
        ::_exit(127);
    }
    ::sigprocmask(SIG_SETMASK, &before, nullptr);
    ::setpgid(pid, pid);
    int status = 0;
    while (!when() && ::waitpid(pid, &status, WNOHANG) == 0) std::this_thread::sleep_for(std::chrono::milliseconds(2));
    ::kill(-pid, SIGINT);
    ::waitpid(pid, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

Choice choice_of(Method method, std::int64_t steps, double until) {
    Choice choice;
    choice.measurement.candidate = {{method.family, method.points}, steps, method.tolerance};
    choice.measurement.error = 5e-9;
    choice.measurement.seconds = 1e-3;
    choice.measurement.step = until / static_cast<double>(steps);
    choice.until = until;
    return choice;
}

}  // namespace

TEST_CASE("the step that run warns beyond is the exact limit of the first resonance that any step would meet") {
    CHECK(stability_limit(lobatto_with(2)) == doctest::Approx(2).epsilon(1e-15));
    CHECK(stability_limit(lobatto_with(3)) == doctest::Approx(std::sqrt(8.0)).epsilon(1e-15));
    CHECK(stability_limit(lobatto_with(4)) == doctest::Approx(std::sqrt(42 - 6 * std::sqrt(29.0))).epsilon(1e-15));
    CHECK(stability_limit(lobatto_with(6)) == doctest::Approx(3.14156418108571680649).epsilon(1e-15));
    CHECK(stability_limit(lobatto_with(8)) == doctest::Approx(6.28305951162151320277).epsilon(1e-15));  // not pi
    CHECK(std::isinf(stability_limit(quadrature_of({Family::gauss, 2, 0}))));
    CHECK(std::isinf(stability_limit(lobatto_with(3), 2.2)));
    CHECK(stability_limit(lobatto_with(3), 2.9) == doctest::Approx(std::sqrt(8.0)).epsilon(1e-15));
}

TEST_CASE("numbers of steps meet the samples of a reference often") {
    const StepLadder ladder(2520, 1.1);
    for (std::int64_t steps = 1; steps < 100000; steps = ladder.next(steps)) {
        CAPTURE(steps);
        CHECK(std::gcd(steps, std::int64_t(2520)) >= std::min<std::int64_t>(steps, 36));
        CHECK(static_cast<double>(ladder.next(steps)) <= 1.35 * static_cast<double>(steps) + 1);
        CHECK(ladder.at_most(static_cast<double>(steps)) == steps);
    }
}

TEST_CASE("the frequency of two stiff masses with friction is found in any units of positions and momenta") {
    const Place place;
    const Kernel kernel = kernel_of(
        emit(derive(read_scene(Source("stiff.toml",
                                      "lagrangian = \"(x'^2 + y'^2)/2 - k*x^2/2 - k*(x - y)^2/2\"\n[parameters]\n"
                                      "k = 1\nc = 0\n[coordinates]\nx = { position = 1, velocity = 0 }\n"
                                      "y = { position = 0, velocity = 0 }\n"
                                      "[forces]\nx = \"-c*x'\"\ny = \"-c*y'\"\n[run]\nstep = 0.1\nuntil = 1\n")))),
        Precision::double_);
    LoadedStepper<double> stepper(kernel);
    const double golden = (1 + std::sqrt(5.0)) / 2;  // the frequencies are sqrt(k) times this and 1 over it
    for (const double k : {1.0, 1e4, 1e6, 1e8, 1e12}) {
        CAPTURE(k);
        const double omega = golden * std::sqrt(k);
        REQUIRE(stepper.prepare({k, 0.005 * omega}, 0.1 / omega) == LOBATTO_OK);
        CHECK(largest_frequency<double>(stepper, 0, {1, 0}, {0, 0}, {1, 1, 1, 1}) ==
              doctest::Approx(omega).epsilon(0.02));
        CHECK(largest_frequency<double>(stepper, 0, {1, 0}, {0, 0}, {1, 1, omega, omega}) ==
              doctest::Approx(omega).epsilon(1e-4));
    }
}

TEST_CASE("explicit extrapolation follows the pendulum to 1e-15, and its frequency at rest is that of small swings") {
    const Place place;
    Scene scene = read_scene(pendulum);
    EmitOptions options;
    options.precision = Precision::extended;
    const Kernel kernel = kernel_of(emit(derive(scene), options), options.precision);
    LoadedStepper<long double> stepper(kernel);
    const long double omega = 2 * 3.14159265358979323846264338327950288L;
    REQUIRE(stepper.prepare({1, omega}, 0.1L) == LOBATTO_OK);
    CHECK(largest_frequency<long double>(stepper, 0, {0}, {0}, {1, 1}) ==
          doctest::Approx(static_cast<double>(omega)).epsilon(1e-6));
    Extrapolation<long double> way(stepper, {1, 6}, 1e-18L);
    way.start(0, {omega / 4}, {0});
    double worst = 0;
    for (int i = 1; i <= 50; ++i) {
        REQUIRE(way.advance_to(0.1L * i));
        const PhasePoint exact = pendulum_solution(omega * omega, omega / 4, 0, 0.1L * i);
        worst = std::max(worst, static_cast<double>(std::fabs(way.state()[0] - exact.q)));
    }
    CHECK(worst < 1e-15);  // measured 2e-17
    CHECK(way.evaluations() > 0);
}

TEST_CASE("a choice written into a scene leaves everything else, and reads back") {
    const std::string text = test::read_file(pendulum);
    const Choice choice = choice_of({Family::gauss, 5, 1e-9}, 1000, 120);
    const std::string changed = with_choice(text, choice, 1e-8, false);
    const Scene scene = read_scene(Source("changed.toml", changed));
    CHECK(scene.method.family == Family::gauss);
    CHECK(scene.method.points == 5);
    CHECK(scene.method.tolerance == 1e-9);
    CHECK(scene.evaluate(scene.run.step, "step").to_double() == 0.12);
    CHECK(scene.evaluate(scene.run.until, "until").to_double() == 120);
    CHECK(scene.run.error == 1e-8);
    CHECK(test::contains(changed, "# lobatto tune --error 1e-08: 5e-09 to t = 120"));
    CHECK(test::contains(changed, "until = 120 # s: about 100 swings"));  // its own comment
    CHECK(test::contains(changed, "[output]\nevery = 1     # keep every step\n"));
    CHECK(with_choice(changed, choice, 1e-8, false) == changed);  // once is enough
    const std::string annotated = "[run]\nstep = \"1/10 # no\" # s, a tenth\nuntil = 120\n";
    CHECK(test::contains(with_choice(annotated, choice, 1e-8, false), "step = 0.12 # s, a tenth\n"));
    const auto of_windows = [](const std::string& lines) {
        return std::regex_replace(lines, std::regex("\n"), "\r\n");
    };
    CHECK(with_choice(of_windows(text), choice, 1e-8, false) == of_windows(changed));
    // Without [method], with a step from a period, and what looks like a table inside a text.
    const std::string other =
        "title = \"t\"\nlagrangian = \"\"\"\n  x'^2/2\n# [method]\n  - x^2/2\"\"\"\n[coordinates]\nx = { position = 1, "
        "velocity = 0 "
        "}\n[run]\nsteps_per_period = 10\nperiod = 6\nuntil = 12\n";
    const Scene second =
        read_scene(Source("other.toml", with_choice(other, choice_of({Family::lobatto, 7, 0}, 40, 20), 1e-3, true)));
    CHECK(second.method.points == 7);
    CHECK(second.evaluate(second.run.step, "step").to_double() == 0.5);
    CHECK(second.evaluate(second.run.until, "until").to_double() == 20);
    CHECK(test::contains(second.source.content(), "# [method]\n  - x^2/2\"\"\""));
    // In numbers of more digits the step is an exact part of the end.
    Choice wide = choice_of({Family::lobatto, 12, 1e-23}, 24, 20);
    wide.measurement.candidate.member.precision = Precision::double_double;
    const Scene third = read_scene(Source("wide.toml", with_choice(other, wide, 1e-20, true)));
    CHECK(third.method.numbers == Precision::double_double);
    CHECK(third.method.tolerance == 1e-23);
    CHECK(third.run.error == 1e-20);
    CHECK(abs(third.evaluate(third.run.step, "step") - GiNaC::numeric(20, 24)) < GiNaC::pow(10, -50));
}

TEST_CASE("a measurement store keeps measurements, and leaves out a torn line and another subject's") {
    const test::TemporaryFolder folder;
    const std::string path = folder / "m.jsonl";
    Measurement measurement;
    measurement.candidate = {{Family::gauss, 3, Precision::extended}, 77, 1e-9};
    measurement.candidate.member.clock = StepClock::of_scene;
    measurement.step = 0.1;
    measurement.complete = true;
    measurement.error = 1.25e-7;
    measurement.energy_error = std::nan("");
    {
        MeasurementStore store(path, "a subject");
        store.add(measurement);
    }
    test::write_text(path, test::read_file(path) + "{\"family\": \"lob");
    {
        MeasurementStore store(path, "a subject");
        REQUIRE(store.found() == 1);
        const Measurement* found = store.find(measurement.candidate);
        REQUIRE(found != nullptr);
        CHECK(found->error == 1.25e-7);
        CHECK(std::isnan(found->energy_error));
        CHECK(csv_row(*found) == csv_row(measurement));
    }
    const std::string line = test::read_file(path);
    test::write_text(path, std::regex_replace(line, std::regex("\"gauss\""), "\"euler\""));
    CHECK(MeasurementStore(path, "a subject").found() == 0);
    CHECK(MeasurementStore(path, "another").found() == 0);
}

TEST_CASE(
    "a reference is refined until it is sure, on eccentric orbits too, where long double does not do in quadruple" *
    doctest::test_suite("slow")) {
    const test::TemporaryFolder folder;
    for (const auto& orbit : std::map<std::string, Precision>{{"0.9", Precision::extended},  // 5e-11
                                                              {"0.99", Precision::quadruple}}) {
        const std::string e = orbit.first;
        const std::string path = folder / "orbit.toml";
        test::write_text(path, fmt::format("lagrangian = \"(x'^2 + y'^2)/2 + 1/sqrt(x^2 + y^2)\"\n"
                                           "[coordinates]\nx = {{ position = \"1 - {0}\", velocity = 0 }}\n"
                                           "y = {{ position = 0, velocity = \"sqrt((1 + {0})/(1 - {0}))\" }}\n"
                                           "[run]\nstep = 0.01\nuntil = \"4*pi\"\n",
                                           e));
        const Scene scene = read_scene(path);
        ExperimentRequest wish;
        wish.seconds = 36000;
        wish.wanted = 1e-11;
        const Experiment experiment(scene, scene, wish);
        const Reference& reference = experiment.reference();
        CAPTURE(e);
        CAPTURE(reference.first);
        CHECK(reference.precision == orbit.second);
        CHECK(reference.disagreement.back() < 1e-11);
        // A whole number of periods: back at the start.
        const std::size_t last = static_cast<std::size_t>(reference.samples) * 2 * reference.n;
        for (std::size_t k = 0; k < 2 * reference.n; ++k)
            CHECK(std::fabs(reference.high[last + k] - reference.high[k]) < 1e-11 * reference.scale[k]);
    }
}

TEST_CASE("what was measured for its error alone is measured again when everything is asked for") {
    const Scene scene = read_scene(pendulum);
    ExperimentRequest wish;
    wish.seconds = 36000;
    Experiment experiment(scene, scene, wish);
    const Candidate candidate{{Family::lobatto, 4}, 2400, 0};
    const Measurement error_only = experiment.measure(candidate, false), all = experiment.measure(candidate);
    CHECK(std::isnan(error_only.energy_error));
    CHECK(all.energy_error > 0);
    CHECK(all.error == error_only.error);
    CHECK(experiment.measure(candidate, false).energy_error == all.energy_error);
}

TEST_CASE("a budget is a time with a unit") {
    const auto seconds = [](const std::string& text) {
        BudgetOption option;
        option.text = text;
        return option.seconds();
    };
    CHECK(seconds("30s") == 30);
    CHECK(seconds("2.5min") == 150);
    CHECK(seconds("45") == 45);
    CHECK(test::message_of<InputError>([&] { seconds("soon"); }) ==
          "--budget: 'soon' is not a time; write 30s, 5min or 1h");
    CHECK(test::contains(test::message_of<InputError>([&] { seconds("10ms"); }), "is not a time"));
    CHECK(test::contains(test::message_of<InputError>([&] { seconds("0.1s"); }), "too little for one measurement"));
}

TEST_CASE("what cannot be promised or measured is refused with the reason") {
    const Place place;
    const auto refused = [&](std::vector<std::string> arguments, int code, const std::string& reason) {
        const test::Finished finished = place.run(arguments);
        CAPTURE(finished.err);
        CHECK(finished.exit_code == code);
        CHECK(test::contains(finished.err, reason));
    };
    refused({"tune", pendulum, "--error", "1e-30"}, 2, "at most 0.1 and at least 1e-28");
    refused({"tune", pendulum, "--error", "small"}, 2, "'small' is not a number");
    refused({"tune", pendulum, "--error", "1e-6", "--until", "0"}, 2, "there is nothing to measure");
    refused({"tradeoff", pendulum, "--until", "0", "-o", place.folder / "out"}, 2, "there is nothing to measure");
    refused({"tradeoff", pendulum, "--budget", "0.1s"}, 2, "too little for one measurement");
    const std::string endless = place.folder / "endless.toml";
    test::write_text(endless, std::regex_replace(test::read_file(pendulum), std::regex("\nuntil[^\n]*"), ""));
    refused({"tune", endless, "--error", "1e-6"}, 2, "until");
}

TEST_CASE("tune proposes no step that is unstable for an oscillation at rest, and none for a motion at rest") {
    const Place place;
    const std::string file = place.folder / "stiff.toml";
    const auto tuned = [&](const std::string& start) {
        test::write_text(file,
                         "lagrangian = \"(x'^2 + y'^2)/2 - x^2/2 - x^4/4 - 100^2*y^2/2\"\n[coordinates]\nx = { "
                         "velocity = 0, position = " +
                             start + " }\ny = { position = 0, velocity = 0 }\n[run]\nstep = 0.01\nuntil = 10\n");
        return test::with_enough_time([&](const std::string& budget) {
            return place.run({"tune", file, "--error", "1e-6", "--budget", budget});
        });
    };
    const test::Finished moving = tuned("1");
    CAPTURE(moving.out);
    CAPTURE(moving.err);
    REQUIRE(moving.exit_code == 0);
    CHECK(test::contains(moving.out, "h omega"));
    CHECK_FALSE(test::contains(moving.out, "only for moments"));
    const test::Finished resting = tuned("0");
    CHECK(resting.exit_code == 3);
    CHECK(test::contains(resting.err, "nothing moves to t = 10: every step is exact, and there is nothing to choose"));
}

TEST_CASE("tune keeps its promise on the pendulum, against the exact elliptic solution" * doctest::test_suite("slow")) {
    const Place place;
    const std::string scene = place.folder / "pendulum.toml";
    test::write_text(scene, test::read_file(pendulum));
    const test::Finished tuned =
        place.run({"tune", scene, "--error", "1e-6", "--until", "20", "--budget", "1h", "--write"});
    CAPTURE(tuned.out);
    CAPTURE(tuned.err);
    REQUIRE(tuned.exit_code == 0);
    CHECK(test::contains(tuned.out, "error at most 1e-06 to t = 20"));
    CHECK(number_after(tuned.out, "predicted error") <= 1e-6);
    CHECK(test::contains(tuned.out, "stability"));
    const test::Finished ran = place.run({"run", scene, "-o", place.folder / "run.csv"});
    CAPTURE(ran.out);
    REQUIRE(ran.exit_code == 0);
    CHECK(ran.err == "");                                          // nothing to warn of
    const double error = number_after(ran.out, "position error");  // of the angle; its amplitude is pi/2
    CHECK(error <= 1e-6 * 1.5708);
    CHECK(error > 1e-10);  // not far more than was asked for
}

TEST_CASE("tradeoff writes a table, CSV, JSON, pictures and a page that needs no other file, and goes on where it was" *
          doctest::test_suite("slowest")) {
    const Place place;
    const std::string out = place.folder / "out";
    const std::vector<std::string> command = {"tradeoff", pendulum, "--until", "10", "--budget", "7s", "-o", out};
    test::Finished first = place.run(command);
    // On a busy machine that may be one measurement. It goes on where it was.
    for (int more = 0; more < 8 && rows_of_front(out) < 4; ++more) first = place.run(command);
    CAPTURE(first.out);
    CAPTURE(first.err);
    REQUIRE(first.exit_code == 0);
    CHECK(test::contains(first.out, "ns/unit"));
    CHECK(test::contains(first.out, "explicit extrapolation in quadruple differs from it by"));
    const auto json = nlohmann::json::parse(test::read_file(out + "/tradeoff.json"));
    REQUIRE(json.at("front").size() > 2);
    CHECK(json.at("chaotic") == false);
    CHECK(json.at("reference").at("disagreement") < 1e-17);
    double error = 1e9, seconds = 0;
    for (const auto& row : json.at("front")) {  // each costs more and errs less
        CHECK(row.at("error") < error);
        CHECK(row.at("seconds") >= seconds);
        error = row.at("error");
        seconds = row.at("seconds");
    }
    const std::string csv = test::read_file(out + "/tradeoff.csv");
    CHECK(static_cast<std::size_t>(std::count(csv.begin(), csv.end(), '\n')) == json.at("measurements").size() + 1);
    const std::string page = test::read_file(out + "/report.html");
    CHECK(test::contains(page, "<script type=\"application/json\" id=\"data\">"));
    CHECK(test::contains(page, "data:image/svg+xml"));
    CHECK(test::contains(page, "lagrangian = "));
    CHECK_FALSE(std::regex_search(page, std::regex("(src|href)=\"(?!data:)")));
    const std::size_t begin = page.find("id=\"data\">") + 10, end = page.find("</script>", begin);
    CHECK(nlohmann::json::parse(page.substr(begin, end - begin)) == json);
    CHECK(test::contains(test::read_file(out + "/work_precision.svg"), "</svg>"));
    const test::Finished second = place.run(command);
    CHECK(test::contains(second.out, "of an earlier run)"));
}

TEST_CASE("Ctrl-C leaves the measurements of a tradeoff, and the next call measures only the rest") {
    const Place place;
    const std::string out = place.folder / "out", store = out + "/measurements.jsonl", log = place.folder / "log";
    const std::vector<std::string> command = {LOBATTO_PROGRAM, "tradeoff", pendulum, "--until", "10",
                                              "--budget",      "10min",    "-o",     out};
    std::vector<std::string> before;
    for (const std::size_t more : {4u, 3u, 3u}) {
        const auto has_more = [&] { return lines_of(store).size() >= before.size() + more; };
        CHECK(interrupted_when(command, log, has_more) == 130);
        const std::string said = test::read_file(log);
        CAPTURE(said);
        CHECK(test::contains(said, "interrupted; the measurements are kept, and the same command goes on from them."));
        if (!before.empty()) CHECK(test::contains(said, fmt::format("({} of an earlier run)", before.size() - 1)));
        const std::vector<std::string> now = lines_of(store);
        REQUIRE(now.size() >= before.size() + more);
        CHECK(std::equal(before.begin(), before.end(), now.begin()));
        before = now;
        CHECK(test::contains(test::read_file(out + "/tradeoff.csv"), "lobatto,8,double,"));
    }
    std::set<std::string> candidates;  // each once
    for (std::size_t i = 1; i < before.size(); ++i)
        CHECK(candidates.insert(before[i].substr(0, before[i].find("\"complete\""))).second);
    // Before anything is measured: what there was stays.
    CHECK(interrupted_when(command, log, [] { return true; }) == 130);
    CHECK(lines_of(store) == before);
}

TEST_CASE("run warns beyond the linear stability limit") {
    const Place place;
    const test::Finished ran =
        place.run({"run", pendulum, "--points", "2", "--step", "0.4", "--until", "4", "-o", place.folder / "run.csv"});
    CHECK(test::contains(ran.err, "beyond the linear stability limit: h omega = 2.513 is more than 2"));
    CHECK(
        place.run({"run", pendulum, "--points", "2", "--step", "0.01", "--until", "4", "-o", place.folder / "run.csv"})
            .err == "");
}

TEST_SUITE("slow") {
    TEST_CASE("a chaotic motion is not promised further than it is known" * doctest::test_suite("slowest")) {
        const Place place;
        test::Finished refused;
        for (const char* const budget : {"15s", "60s", "4min"}) {  // a busy machine needs more for the reference
            refused = place.run({"tune", duffing, "--error", "1e-9", "--budget", budget});
            if (!test::contains(refused.err, "the budget leaves")) break;
        }
        CAPTURE(refused.err);
        CHECK(refused.exit_code == 3);
        CHECK(test::contains(refused.err, "cannot be promised to t = 1256.64"));
        CHECK(test::contains(refused.err, "try --until"));
    }
}
