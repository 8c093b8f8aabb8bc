// SPDX-License-Identifier: GPL-2.0-or-later
#include "bench/race.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <limits>
#include <map>

#include "bench/contestants/clocked_kernels.hpp"
#include "bench/contestants/kernels.hpp"
#include "bench/reference.hpp"

namespace lobatto::bench {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

struct Course {
    const Problem& problem;
    std::vector<Trajectory> starts, ends;
};

// Trajectory i of an ensemble: the first coordinate times 1 + i spread.
Course course_of(const Problem& problem, int trajectories) {
    Course course{problem, {}, {}};
    for (int i = 0; i < trajectories; ++i) {
        Trajectory start{problem.q, problem.p};
        start.q[0] *= 1 + problem.spread * i;
        course.starts.push_back(start);
        course.ends.push_back(i == 0 ? reference_end(problem, start) : quick_reference_end(problem, start));
    }
    return course;
}

double distance(const Problem& problem, const Trajectory& a, const Trajectory& b) {
    double largest = 0;
    const auto compare = [&](double x, double y) {
        largest = std::isfinite(x - y) ? std::max(largest, std::fabs(x - y)) : infinity;
    };
    for (std::size_t k = 0; k < a.q.size(); ++k) {
        compare(a.q[k], b.q[k]);
        if (!problem.positions_only) compare(a.p[k], b.p[k]);
    }
    return largest;
}

// Of this thread: others may use the machine at the same time.
double processor_seconds() {
    std::timespec now;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

Measurement measure(const Course& course, const Contestant& contestant, double setting) {
    std::vector<Trajectory> trajectories = course.starts;
    const double start = processor_seconds();
    const Effort effort = contestant.run(setting, trajectories);
    const double elapsed = processor_seconds() - start;
    const double count = static_cast<double>(trajectories.size());
    Measurement result{setting, elapsed / count, 0, 0, effort.steps, effort.evaluations};
    result.steps /= static_cast<long>(trajectories.size());
    result.evaluations /= static_cast<long>(trajectories.size());
    for (std::size_t i = 0; i < trajectories.size(); ++i) {
        result.error = std::max(result.error, distance(course.problem, trajectories[i], course.ends[i]));
        const double H0 = energy_of(course.problem, course.starts[i]), H = energy_of(course.problem, trajectories[i]);
        result.energy_error = std::max(result.energy_error, std::fabs(H / H0 - 1));
    }
    if (!effort.good) result.error = infinity;
    return result;
}

// Numbers of steps in ratios of about 2^(1/4); tolerances in the contestant's ratio; quick ones in larger ratios.
std::vector<double> ladder_of(const Problem& problem, const Contestant& contestant, bool quick) {
    std::vector<double> settings;
    if (contestant.ladder == Ladder::tolerance) {
        const double ratio = quick ? std::max(contestant.ratio, 10.0) : contestant.ratio;
        // In a long race coarse ones lose so much energy that the inner orbit shrinks, and they take steps without end.
        const double coarsest = problem.is_long() ? 1e-4 * contestant.coarsest : contestant.coarsest;
        for (double tolerance = coarsest; tolerance > 0.9 * contestant.finest; tolerance /= ratio)
            settings.push_back(tolerance);
        return settings;
    }
    const double ratio = quick ? std::sqrt(2) : std::sqrt(std::sqrt(2)), longest = 1e8;
    const double fewest = contestant.fewest_steps > 0 ? contestant.fewest_steps : problem.until / problem.longest_step;
    for (double steps = fewest; steps < longest; steps *= ratio)
        if (settings.empty() || std::round(steps) > settings.back()) settings.push_back(std::round(steps));
    return settings;
}

// From coarse to fine until it is too slow, or a few settings beyond the first that reaches the finest target. Implicit
// methods may be slowest at the coarsest steps, so one slow setting is not the end.
void scan(const Course& course, Lane& lane, bool quick, double time_limit) {
    const int beyond = 4;
    const double trajectories = static_cast<double>(course.starts.size()), most_preparation = 60;
    double preparation = 0;
    int fine = 0, slow = 0;
    for (const double setting : ladder_of(course.problem, lane.contestant, quick || course.problem.is_long())) {
        if (preparation > most_preparation) break;
        const double prepared = lane.contestant.prepare ? lane.contestant.prepare(setting, course.starts.size()) : 0;
        preparation += prepared;
        Measurement best = measure(course, lane.contestant, setting);
        // Short runs are repeated, and so are those that seem too slow: another program may have been in the way.
        const auto doubtful = [&] {
            const double all = best.seconds * trajectories;
            return all < 2e-3 || (best.seconds > time_limit && all < 0.1);
        };
        for (int repetition = 0; repetition < 2 && doubtful(); ++repetition)
            best.seconds = std::min(best.seconds, measure(course, lane.contestant, setting).seconds);
        best.compile_seconds = prepared;
        lane.scan.push_back(best);
        if (best.error < targets.back()) ++fine;
        slow = best.seconds > time_limit ? slow + 1 : 0;
        if (fine > beyond || slow > (lane.contestant.ours ? 8 : 0)) break;
    }
}

double fastest(const Lane& lane, double target) {
    double seconds = infinity;
    for (const Measurement& m : lane.scan)
        if (m.error < target) seconds = std::min(seconds, m.seconds);
    return seconds;
}

// Eight times what the best so far needs for the finest target that anyone reached, in long races three times.
double time_limit_of(const Problem& problem, const std::vector<Lane>& lanes) {
    for (std::size_t i = targets.size(); i-- > 0;) {
        double best = infinity;
        for (const Lane& lane : lanes) best = std::min(best, fastest(lane, targets[i]));
        if (best < infinity) return (problem.is_long() ? 3 : 8) * best;
    }
    return 5;
}

// The few settings of a lane that may be its fastest for a target.
std::vector<Measurement*> candidates(Lane& lane, double target) {
    std::vector<Measurement*> reaching;
    for (Measurement& m : lane.scan)
        if (m.error < target) reaching.push_back(&m);
    std::sort(reaching.begin(), reaching.end(), [](const auto* a, const auto* b) { return a->seconds < b->seconds; });
    if (reaching.size() > 3) reaching.resize(3);
    return reaching;
}

// Progress, on the standard error.
void say(const Race& race, const std::string& what) {
    fmt::print(stderr, "{}{}: {}\n", race.problem->name, race.trajectories > 1 ? ", ensemble" : "", what);
}

}  // namespace

Race run_race(const Problem& problem, int trajectories, const RaceOptions& options) {
    Race race{&problem, trajectories, {}};
    say(race, "reference");
    const Course course = course_of(problem, trajectories);
    Contestants contestants;
    const auto enter = [&](Contestants more) { std::move(more.begin(), more.end(), std::back_inserter(contestants)); };
    enter(own_peers(problem));
    enter(taylor_peer(problem));
#ifdef LOBATTO_BENCH_CLANG
    enter(taylor_peer_by_clang(problem));
#endif
    enter(odeint_peers(problem));
    enter(gsl_peers(problem));
    enter(sundials_peers(problem));
#ifdef LOBATTO_BENCH_HEYOKA
    enter(heyoka_peers(problem, trajectories));
#endif
    if (!options.peers_only) {
        say(race, "kernels");
        const int together = trajectories > 1 ? trajectories : 0;
        enter(clocked_contestants(problem, options.quick, together));
        enter(kernel_contestants(problem, options.quick, together));
    }
    const auto is_wanted = [&](const Contestant& contestant) {
        const auto holds = [&](const std::string& word) { return contestant.method.find(word) != std::string::npos; };
        return options.methods.empty() || std::any_of(options.methods.begin(), options.methods.end(), holds);
    };
    for (Contestant& contestant : contestants) {
        if (!is_wanted(contestant)) continue;
        say(race, contestant.method);
        Lane lane{std::move(contestant), {}, {}};
        scan(course, lane, options.quick, time_limit_of(problem, race.lanes));
        race.lanes.push_back(std::move(lane));
    }

    say(race, "all in turn");
    std::vector<std::pair<const Contestant*, Measurement*>> finalists;
    for (Lane& lane : race.lanes)
        for (const double target : targets)
            for (Measurement* m : candidates(lane, target)) {
                const auto known = [&](const auto& finalist) { return finalist.second == m; };
                if (std::none_of(finalists.begin(), finalists.end(), known)) finalists.push_back({&lane.contestant, m});
            }
    const int repetitions = problem.is_long() ? 3 : options.quick || trajectories > 1 ? 5 : 9;
    for (int repetition = 0; repetition < repetitions; ++repetition)
        for (auto& [contestant, m] : finalists) {
            // Of short runs the first one waits for its program to come from memory, which none is asked for here.
            const int at_once = m->seconds * trajectories < 1e-3 ? 3 : 1;
            for (int i = 0; i < at_once; ++i)
                m->seconds = std::min(m->seconds, measure(course, *contestant, m->setting).seconds);
        }
    for (Lane& lane : race.lanes)
        for (std::size_t i = 0; i < targets.size(); ++i)
            if (const auto reaching = candidates(lane, targets[i]); !reaching.empty()) lane.best[i] = *reaching.front();
    return race;
}

double seconds(const Lane& lane, std::size_t target) {
    return lane.best[target] ? lane.best[target]->seconds : infinity;
}

void fill_cold_starts(std::vector<Race>& races) {
    std::map<std::pair<std::string, std::string>, double> known;  // by problem and method
    for (Race& race : races)
        for (Lane& lane : race.lanes)
            for (std::size_t i = 0; i < targets.size(); ++i) {
                const auto is_ours = [](const Lane& other) { return other.contestant.ours; };
                if (!lane.contestant.ours || fastest_of(race, i, is_ours) != &lane) continue;
                const auto [place, is_new] = known.try_emplace({race.problem->name, lane.contestant.method}, 0);
                if (is_new) {
                    say(race, "cold start of " + lane.contestant.method);
                    place->second = lane.contestant.cold_start();
                }
                lane.best[i]->compile_seconds = place->second;
            }
}

std::string setting_text(const Problem& problem, const Contestant& contestant, double setting) {
    if (contestant.ladder == Ladder::tolerance) return fmt::format("tolerance = {:.2g}", setting);
    const char* const mean = contestant.fewest_steps > 0 ? "mean " : "";  // of steps in the time of a clock
    return fmt::format("{}h = {:.4g}", mean, problem.until / setting);
}

}  // namespace lobatto::bench
