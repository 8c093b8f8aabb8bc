// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/tradeoff/search.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <thread>

namespace lobatto {

namespace {

constexpr double fine_ratio = 1.06;  // of the steps in the end
constexpr double hopeless = 1.6;     // times the best: a crossing that polishing will not save
constexpr double beaten = 4;         // times the best: a run that is not waited for
constexpr std::size_t most_finalists = 4;
constexpr double more_of_stagnating = 0.2;  // of the steps, after each time that more of them brought nothing
constexpr double share_of_crossing =
    0.3;                               // of the budget: a crossing that took so much more is left, once it has an error
constexpr double far_fewer = 10;       // steps with a clock: those without can wait
constexpr int enough_of_rounding = 4;  // members that rounding keeps from the goal
constexpr double converging = 1e-3;    // errors below go with the order of the method, until they are rounding
constexpr double close = 1.08;         // two numbers of steps between which nothing is looked for

// Of an iteration that ends so many digits beyond the goal.
double fitting_tolerance(double goal, double digits, Precision numbers) {
    const double least = std::floor(std::log10(rounding_of(numbers))) + 2;
    return std::pow(10.0, std::clamp(std::floor(std::log10(goal)) - digits, least, -3.0));
}

// Whether more steps than before bring nothing.
bool is_rounding(const Measurement& m, const std::optional<Measurement>& before, double least_before) {
    if (!m.complete || !before || !before->complete || !(m.error > 0.7 * std::fmin(before->error, least_before)))
        return false;
    const auto steps = static_cast<double>(m.candidate.steps), more = steps / double(before->candidate.steps);
    return m.error < 1e3 * rounding_of(m.candidate.member.precision) * std::sqrt(steps) ||
           (m.error < converging && std::pow(more, m.candidate.member.order()) > 2);
}

}  // namespace

Attempt cross(Experiment& experiment, const Member& member, double goal, double limit) {
    const StepLadder ladder = experiment.ladder(fine_ratio);
    const double order = member.order(), fewest = experiment.fewest_steps(member.clock);
    const std::int64_t fewest_stable = ladder.at_least(experiment.fewest_stable_steps(member));
    Attempt result{{}, infinity, false, infinity};
    const auto run = [&](std::int64_t steps) {
        const Measurement m = experiment.measure({member, steps, 0}, false, limit);
        if (m.complete) result.least_error = std::min(result.least_error, m.error);
        return m;
    };
    std::optional<Measurement> good, bad;
    std::int64_t steps = std::max(ladder.at_least(fewest * 1.5), fewest_stable);
    int stagnating = 0;
    const double began = experiment.elapsed();
    for (int tries = 0; tries < 40; ++tries) {
        const double least_before = result.least_error;
        const Measurement m = run(steps);
        if (m.complete && m.error <= goal) {
            good = m;
        } else {
            stagnating = is_rounding(m, bad, least_before) ? stagnating + 1 : 0;
            bad = m;
            result.is_rounding = stagnating >= 3;
            if (stagnating >= 3 || m.seconds >= limit) break;
        }
        const double too_long = share_of_crossing * experiment.request().seconds;
        if ((experiment.elapsed() - began > too_long || experiment.left() < -too_long) &&
            std::isfinite(result.least_error))
            break;
        double next = 0;
        if (good && bad && good->candidate.steps > bad->candidate.steps) {
            if (static_cast<double>(good->candidate.steps) <= static_cast<double>(bad->candidate.steps) * close) break;
            const double a = static_cast<double>(bad->candidate.steps), b = static_cast<double>(good->candidate.steps);
            next = std::sqrt(a * b);
            if (bad->complete) {  // by the slope between the two
                const double slope = std::log(bad->error / good->error) / std::log(b / a);
                const double told = b * std::pow(good->error / goal, 1 / std::max(slope, 1.0));
                if (told > a * 1.01 && told < b * 0.99) next = told;
            }
            const std::int64_t between = ladder.at_least(next);
            const std::int64_t other = ladder.at_most(next);
            if (between > bad->candidate.steps && between < good->candidate.steps)
                steps = between;
            else if (other > bad->candidate.steps && other < good->candidate.steps)
                steps = other;
            else
                break;
            continue;
        }
        if (good) {
            if (good->candidate.steps <= fewest_stable) break;
            const double factor = std::clamp(std::pow(good->error / goal, 1 / order), 0.5, 0.94);
            steps = std::max(ladder.at_most(static_cast<double>(good->candidate.steps) * factor), fewest_stable);
            if (steps >= good->candidate.steps) break;
        } else {
            const double factor = m.complete ? std::clamp(1.03 * std::pow(m.error / goal, 1 / order), 1.05, 4.0) +
                                                   more_of_stagnating * stagnating
                                             : 1.5;
            const double more = static_cast<double>(steps) * factor;
            if (more > most_steps) break;
            // A run that would take more than is left.
            if (m.complete && m.seconds * factor > std::max(0.5, experiment.left())) break;
            steps = ladder.at_least(std::max(more, static_cast<double>(steps) + 1));
        }
    }
    if (good) {
        result.measurement = experiment.time_again(*good, 1);
        result.seconds = result.measurement->seconds;
        if (experiment.heeds_tolerance(member)) {
            const Measurement looser = experiment.measure(
                {member, good->candidate.steps, fitting_tolerance(goal, 2, member.precision)}, false);
            if (looser.complete && looser.error < 2 * goal)
                result.seconds = std::min(result.seconds, experiment.time_again(looser, 1).seconds);
        }
    }
    return result;
}

Measurement polish(Experiment& experiment, const Measurement& crossing, double goal) {
    const Member& member = crossing.candidate.member;
    Measurement best = experiment.time_again(crossing, 3);
    const double share = 0.15 * std::max(0.0, experiment.left());
    const double began = experiment.elapsed();
    const auto try_one = [&](std::int64_t steps, double tolerance) {
        const Measurement m = experiment.measure({member, steps, tolerance}, false);
        if (!m.complete || m.error > goal) return infinity;
        const Measurement timed = m.seconds < 1.3 * best.seconds ? experiment.time_again(m, 2) : m;
        if (timed.seconds < best.seconds) best = timed;
        return timed.seconds;
    };
    const StepLadder ladder = experiment.ladder(fine_ratio);
    const auto is_late = [&] { return experiment.elapsed() - began > share; };
    // Longer steps, until twice in a row they are far beyond the goal: errors do not always grow evenly, near rounding
    // least of all.
    std::vector<std::int64_t> starts = {crossing.candidate.steps};
    int far_beyond = 0;
    const double fewest_stable = experiment.fewest_stable_steps(member);
    for (std::int64_t steps = starts.front(); steps > 1 && far_beyond < 2 && !is_late();) {
        steps = ladder.at_most(static_cast<double>(steps) / fine_ratio);
        if (static_cast<double>(steps) < fewest_stable) break;
        const Measurement m = experiment.measure({member, steps, 0}, false);
        far_beyond = m.complete && m.error < 100 * goal ? 0 : far_beyond + 1;
        if (m.complete && m.error <= goal) starts.push_back(steps);
    }
    if (starts.size() > 2) starts = {starts.front(), starts.back()};
    std::vector<double> tolerances = {0};
    for (const double digits : {0.0, 1.0, 2.0, 3.0, 4.0})
        if (experiment.heeds_tolerance(member) &&
            tolerances.back() != fitting_tolerance(goal, digits, member.precision))
            tolerances.push_back(fitting_tolerance(goal, digits, member.precision));
    for (const double tolerance : tolerances)
        for (const std::int64_t start : starts) {
            std::int64_t steps = start;
            double last = infinity;
            int worse = 0;
            for (int i = 0; i < 10 && worse < 3 && !is_late(); ++i, steps = ladder.next(steps)) {
                const double now = try_one(steps, tolerance);
                worse = now < infinity && now >= last ? worse + 1 : 0;
                last = std::min(last, now);
            }
        }
    return best;
}

namespace {

// What the members that came nearest to a goal below their rounding would be in clean arithmetic.
std::vector<Member> cleaner(const std::map<Member, Attempt>& tried) {
    std::vector<std::pair<double, Member>> nearest;
    for (const auto& [member, crossing] : tried)
        if (member.arithmetic == StepArithmetic::plain && member.family != Family::splitting &&
            member.clock == StepClock::none)
            nearest.emplace_back(crossing.least_error, member);
    std::sort(nearest.begin(), nearest.end());
    std::vector<Member> members;
    for (auto& [error, member] : nearest) {
        member.arithmetic = StepArithmetic::clean;
        if (members.size() < 3 && tried.count(member) == 0) members.push_back(member);
    }
    return members;
}

}  // namespace

std::vector<Member> first_guess(double goal, std::size_t count, Precision numbers) {
    // Higher orders for smaller errors: about half the digits, and some more.
    const int points = std::clamp(static_cast<int>(std::lround(4.5 - 0.45 * std::log10(goal))), 4, 11);
    const std::vector<Member> guesses = {{Family::lobatto, points, numbers},
                                         {Family::gauss, std::clamp(points - 2, 1, 10), numbers},
                                         {Family::lobatto, std::clamp(points + 2, 2, 12), numbers},
                                         {Family::lobatto, std::clamp(points - 2, 2, 12), numbers}};
    return {guesses.begin(), guesses.begin() + static_cast<std::ptrdiff_t>(std::min(count, guesses.size()))};
}

namespace {

// The numbers of points whose nodes fill vector registers of 4 or 8; they may win though both their neighbours lose.
std::vector<int> full_registers(Family family, bool is_separable) {
    if (family == Family::gauss) return {4, 8};
    if (family == Family::splitting) return {};
    return is_separable ? std::vector{6, 10} : std::vector{4, 8, 12};  // the inner nodes, or all
}

using Tried = std::map<Member, Attempt>;

// With one clock, members next to the best of one family that were not tried, each with the cost that speaks for it.
void add_neighbours(const Tried& tried, Family family, StepClock clock, bool is_separable, double best_cost,
                    Precision numbers, std::vector<std::pair<double, Member>>& wishes) {
    const std::vector<int>& sizes = sizes_of(family);
    const int last = static_cast<int>(sizes.size()) - 1;
    std::optional<Member> top;
    double top_cost = infinity;
    int tried_here = 0;
    for (const auto& [member, crossing] : tried) {
        if (member.family != family || member.clock != clock) continue;
        ++tried_here;
        if (crossing.seconds < top_cost) top = member, top_cost = crossing.seconds;
    }
    const auto size_at = [&](int place) { return sizes[static_cast<std::size_t>(place)]; };
    if (top_cost > hopeless * best_cost && tried_here >= 3) return;
    if (!top) {  // none reaches the goal: orders between
        for (const int place : {last, last / 2, last - 2})
            if (const Member next{family, size_at(place), numbers, StepArithmetic::plain, clock};
                tried.count(next) == 0)
                wishes.push_back({1e3, next});
        return;
    }
    const int here = static_cast<int>(std::find(sizes.begin(), sizes.end(), top->points) - sizes.begin());
    for (const int distance : {1, 2})
        for (const int place : {here + distance, here - distance}) {
            if (place < 0 || place > last) continue;
            Member next = *top;  // in its arithmetic
            next.points = size_at(place);
            if (tried.count(next) != 0) continue;
            // Beyond a neighbour that is clearly slower nothing is expected.
            if (distance == 2) {
                Member middle = *top;
                middle.points = size_at((place + here) / 2);
                const auto between = tried.find(middle);
                if (between == tried.end() || between->second.seconds > 1.15 * top_cost) continue;
            }
            wishes.push_back({top_cost * distance, next});
        }
    for (const int points : full_registers(family, is_separable && clock == StepClock::none)) {
        Member next = *top;
        next.points = points;
        if (std::abs(points - top->points) <= 4 && tried.count(next) == 0) wishes.push_back({top_cost * 3, next});
    }
}

// Several members of different orders come to the same end: others would, too. Clean arithmetic may do a bit better.
bool rounding_stands_in_the_way(const Tried& tried, double goal) {
    return std::count_if(tried.begin(), tried.end(),
                         [](const auto& of) {
                             return of.second.is_rounding && of.first.arithmetic == StepArithmetic::plain;
                         }) >= enough_of_rounding &&
           std::none_of(tried.begin(), tried.end(), [&](const auto& of) {
               return of.first.arithmetic == StepArithmetic::plain && of.second.least_error < 2 * goal;
           });
}

// Those of all families and clocks that the scene allows; the nearest to the best first.
std::vector<Member> neighbours(const Tried& tried, double best_cost, Experiment& experiment, Precision numbers) {
    const KernelBuilder& kernel_builder = experiment.kernel_builder();
    std::vector<std::pair<double, Member>> wishes;
    for (const StepClock clock : {StepClock::none, StepClock::automatic, StepClock::of_scene})
        for (const Family family : {Family::lobatto, Family::gauss, Family::splitting})
            add_neighbours(tried, family, clock, experiment.derivation().system.separable, best_cost, numbers, wishes);
    std::stable_sort(wishes.begin(), wishes.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    std::vector<Member> members;
    for (const auto& [wish, member] : wishes)
        if (kernel_builder.allows(member)) members.push_back(member);
    return members;
}

// With clocks first: where time scales vary, runs in equal steps need not be waited for then.
std::vector<Member> first_queue(Experiment& experiment, double goal, Precision numbers) {
    const KernelBuilder& kernel_builder = experiment.kernel_builder();
    std::vector<Member> queue;
    const auto add = [&](const Member& member) {
        if (kernel_builder.allows(member)) queue.push_back(member);
    };
    for (const StepClock clock : kernel_builder.clocks())
        for (Member member : first_guess(goal, 3, numbers)) {
            member.clock = clock;
            add(member);
        }
    for (const Member& member : first_guess(goal, 4, numbers)) add(member);
    add({Family::splitting, goal > 1e-4 ? 6 : goal > 1e-9 ? 11 : goal > 1e-11 ? 17 : 35, numbers});
    return queue;
}

// The fastest of those that came near to it, each at its best.
void choose_among(Experiment& experiment, const Tried& tried, double goal, Search& result) {
    std::vector<Attempt> crossings;
    for (const auto& [member, crossing] : tried)
        if (crossing.measurement) crossings.push_back(crossing);
    std::sort(crossings.begin(), crossings.end(),
              [](const Attempt& a, const Attempt& b) { return a.seconds < b.seconds; });
    std::vector<Measurement> finalists;
    for (const Attempt& crossing : crossings) {
        if (crossing.seconds > hopeless * crossings.front().seconds || finalists.size() >= most_finalists) break;
        experiment.request().say(fmt::format("refining {}", crossing.measurement->candidate.name()));
        finalists.push_back(polish(experiment, *crossing.measurement, goal));
    }
    // In turn, so that what disturbs one disturbs all.
    for (int round = 0; round < 3; ++round)
        for (Measurement& finalist : finalists)
            if (finalist.seconds < 1.5 * finalists.front().seconds) finalist = experiment.time_again(finalist, 1);
    for (const Measurement& finalist : finalists)
        if (!result.best || finalist.seconds < result.best->seconds) result.best = finalist;
}

}  // namespace

Search search(Experiment& experiment, double goal, Precision numbers) {
    KernelBuilder& kernel_builder = experiment.kernel_builder();
    Search result;
    result.least_error = infinity;
    Tried tried;
    const auto has_clock = [](const Member& member) { return member.clock != StepClock::none; };
    std::vector<Member> queue = first_queue(experiment, goal, numbers);
    const double reserve = 0.2 * experiment.request().seconds;  // for polishing
    bool tried_clean = false;                                   // only where rounding stands in the way
    for (const Member& member : queue) kernel_builder.order(member);
    const auto best_cost = [&] {
        double best = infinity;
        for (const auto& [member, crossing] : tried) best = std::min(best, crossing.seconds);
        return best;
    };
    while (true) {
        experiment.check_interruption();
        // What is ready is measured; else the compilers are waited for.
        const bool waits_for_clock =
            best_cost() == infinity && experiment.left() > reserve &&
            std::any_of(queue.begin(), queue.end(), [&](const Member& m) {
                return experiment.fewest_steps(StepClock::none) > far_fewer * experiment.fewest_steps(m.clock);
            });
        const auto ready = std::find_if(queue.begin(), queue.end(), [&](const Member& m) {
            return kernel_builder.is_ready(m) && (has_clock(m) || !waits_for_clock);
        });
        if (ready != queue.end()) {
            const Member member = *ready;
            queue.erase(ready);
            const Candidate shown{member, 0, 0};
            experiment.request().say(fmt::format("measuring {}", shown.name()));
            const double longest = std::isfinite(result.least_error) ? share_of_crossing : infinity;
            tried[member] =
                cross(experiment, member, goal, std::min(beaten * best_cost(), longest * experiment.request().seconds));
            if (tried[member].least_error < result.least_error) {
                result.least_error = tried[member].least_error;
                result.is_rounding = tried[member].is_rounding;
            }
        } else if (!queue.empty()) {
            if (experiment.left() < reserve && best_cost() < infinity) break;
            if (experiment.left() < -reserve && !tried.empty()) break;
            std::this_thread::sleep_for(std::chrono::milliseconds(5));
            continue;
        }
        const bool is_hopeless = rounding_stands_in_the_way(tried, goal);
        if (is_hopeless && !tried_clean) queue.clear();
        const bool has_time = !is_hopeless && (experiment.left() > reserve || best_cost() == infinity);
        if (has_time && experiment.left() > -reserve && queue.size() < 2) {
            for (const Member& member : neighbours(tried, best_cost(), experiment, numbers)) {
                if (std::find(queue.begin(), queue.end(), member) != queue.end()) continue;
                kernel_builder.order(member);
                queue.push_back(member);
                if (queue.size() >= std::max(2u, kernel_builder.threads())) break;
            }
        }
        if (queue.empty() && !tried_clean && numbers == Precision::double_ && best_cost() == infinity &&
            experiment.left() > 0) {
            tried_clean = true;
            queue = cleaner(tried);
            std::erase_if(queue, [&](const Member& member) { return !kernel_builder.allows(member); });
            for (const Member& member : queue) kernel_builder.order(member);
        }
        if (queue.empty()) {
            result.complete = true;
            break;
        }
    }
    kernel_builder.cancel();
    result.members = static_cast<int>(tried.size());
    choose_among(experiment, tried, goal, result);
    return result;
}

}  // namespace lobatto
