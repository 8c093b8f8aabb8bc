// SPDX-License-Identifier: GPL-2.0-or-later
#include "cli/tradeoff/search.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <thread>

namespace lobatto {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double longest_radians = 4;  // h omega of the coarsest steps tried; Lobatto's limits are near pi
constexpr double fine_ratio = 1.06;    // of the steps in the end
constexpr double hopeless = 1.6;       // times the best: a crossing that polishing will not save
constexpr double most_steps = 1e9;
constexpr double close = 1.08;  // two numbers of steps between which nothing is looked for

StepLadder ladder_of(const Laboratory& laboratory, double ratio) {
    return {laboratory.reference().samples, ratio};
}

double fewest_steps(const Laboratory& laboratory) {
    return std::max(1.0, laboratory.until() * laboratory.reference().frequency / longest_radians);
}

double cost(const std::optional<Measurement>& measurement) {
    return measurement ? measurement->seconds : infinity;
}

}  // namespace

std::vector<Measurement> pareto_front(const Laboratory& laboratory) {
    std::vector<Measurement> complete, front;
    for (const auto& [key, m] : laboratory.notebook().all())
        if (m.complete) complete.push_back(m);
    std::sort(complete.begin(), complete.end(), [&](const Measurement& a, const Measurement& b) {
        return std::tuple(a.seconds, laboratory.figure(a), a.candidate.key()) <
               std::tuple(b.seconds, laboratory.figure(b), b.candidate.key());
    });
    for (const Measurement& m : complete)
        if (front.empty() || laboratory.figure(m) < laboratory.figure(front.back())) front.push_back(m);
    return front;
}

Crossing cross(Laboratory& laboratory, const Member& member, double goal) {
    const StepLadder ladder = ladder_of(laboratory, fine_ratio);
    const double order = member.order(), fewest = fewest_steps(laboratory);
    Crossing result{{}, infinity};
    const auto run = [&](std::int64_t steps) {
        const Measurement m = laboratory.measure({member, steps, 0}, false);
        if (m.complete) result.least_error = std::min(result.least_error, m.error);
        return m;
    };
    std::optional<Measurement> good, bad;
    std::int64_t steps = ladder.at_least(fewest * 1.5);
    int stagnating = 0;
    for (int tries = 0; tries < 40; ++tries) {
        const Measurement m = run(steps);
        if (m.complete && m.error <= goal) {
            good = m;
        } else {
            // Rounding: more steps bring nothing.
            const bool no_better = bad && bad->complete && m.complete && m.error > 0.7 * bad->error &&
                                   m.error < 1e3 * rounding_of(member.precision) * std::sqrt(double(m.candidate.steps));
            stagnating = no_better ? stagnating + 1 : 0;
            bad = m;
            if (stagnating >= 3) break;
        }
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
            if (good->candidate.steps <= 1) break;
            const double factor = std::clamp(std::pow(good->error / goal, 1 / order), 0.5, 0.94);
            steps = ladder.at_most(static_cast<double>(good->candidate.steps) * factor);
            if (steps >= good->candidate.steps) break;
        } else {
            const double factor = m.complete ? std::clamp(1.03 * std::pow(m.error / goal, 1 / order), 1.05, 4.0) : 1.5;
            const double more = static_cast<double>(steps) * factor;
            if (more > most_steps) break;
            // A run that would take more than is left.
            if (m.complete && m.seconds * factor > std::max(0.5, laboratory.left())) break;
            steps = ladder.at_least(std::max(more, static_cast<double>(steps) + 1));
        }
    }
    result.measurement = good;
    return result;
}

Measurement polish(Laboratory& laboratory, const Measurement& crossing, double goal) {
    const Member& member = crossing.candidate.member;
    Measurement best = laboratory.time_again(crossing, 3);
    const double share = 0.15 * std::max(0.0, laboratory.left());
    const double began = laboratory.elapsed();
    const auto try_one = [&](std::int64_t steps, double tolerance) {
        const Measurement m = laboratory.measure({member, steps, tolerance}, false);
        if (!m.complete || m.error > goal) return infinity;
        const Measurement timed = m.seconds < 1.3 * best.seconds ? laboratory.time_again(m, 2) : m;
        if (timed.seconds < best.seconds) best = timed;
        return timed.seconds;
    };
    const StepLadder ladder = ladder_of(laboratory, fine_ratio);
    std::vector<double> tolerances = {0};
    const double exponent = std::floor(std::log10(goal));
    const bool iterates = laboratory.workshop().kernel(member)->linear == 0;
    for (const double below : {0.0, 1.0, 2.0, 3.0, 4.0}) {
        if (!iterates || member.arithmetic == StepArithmetic::clean) break;
        const double tolerance = std::pow(10.0, std::clamp(exponent - below, -14.0, -3.0));
        if (tolerances.back() != tolerance) tolerances.push_back(tolerance);
    }
    for (const double tolerance : tolerances) {
        std::int64_t steps = crossing.candidate.steps;
        double last = infinity;
        int worse = 0;
        for (int i = 0; i < 10 && worse < 3; ++i, steps = ladder.next(steps)) {
            const double now = try_one(steps, tolerance);
            worse = now < infinity && now >= last ? worse + 1 : 0;
            last = std::min(last, now);
            if (laboratory.elapsed() - began > share) return best;
        }
    }
    return best;
}

namespace {

// What the members that came nearest to a goal below their rounding would be in clean arithmetic.
std::vector<Member> cleaner(const std::map<Member, Crossing>& tried) {
    std::vector<std::pair<double, Member>> nearest;
    for (const auto& [member, crossing] : tried)
        if (member.arithmetic == StepArithmetic::plain) nearest.emplace_back(crossing.least_error, member);
    std::sort(nearest.begin(), nearest.end());
    std::vector<Member> members;
    for (auto& [error, member] : nearest) {
        member.arithmetic = StepArithmetic::clean;
        if (members.size() < 3 && tried.count(member) == 0) members.push_back(member);
    }
    return members;
}

}  // namespace

std::vector<Member> first_guess(double goal, std::size_t count) {
    // Higher orders for smaller errors: about half the digits, and some more.
    const int points = std::clamp(static_cast<int>(std::lround(4.5 - 0.45 * std::log10(goal))), 4, 11);
    const std::vector<Member> guesses = {{Family::lobatto, points},
                                         {Family::gauss, std::clamp(points - 2, 1, 10)},
                                         {Family::lobatto, std::clamp(points + 2, 2, 12)},
                                         {Family::lobatto, std::clamp(points - 2, 2, 12)}};
    return {guesses.begin(), guesses.begin() + static_cast<std::ptrdiff_t>(std::min(count, guesses.size()))};
}

namespace {

// Members next to the best of each family that were not tried; the nearest to the best first.
std::vector<Member> neighbours(const std::map<Member, Crossing>& tried, double best_cost) {
    std::vector<std::pair<double, Member>> wishes;
    for (const Family family : {Family::lobatto, Family::gauss}) {
        std::optional<Member> top;
        double top_cost = infinity;
        int tried_here = 0;
        for (const auto& [member, crossing] : tried) {
            if (member.family != family) continue;
            ++tried_here;
            if (cost(crossing.measurement) < top_cost) top = member, top_cost = cost(crossing.measurement);
        }
        const int least = family == Family::lobatto ? 2 : 1, most = family == Family::lobatto ? 12 : 10;
        if (!top) {  // none reaches the goal: orders between
            for (const int points : {most, (least + most) / 2, most - 2})
                if (tried.count({family, points}) == 0) wishes.push_back({1e3, {family, points}});
            continue;
        }
        if (top_cost > hopeless * best_cost && tried_here >= 3) continue;
        for (const int distance : {1, 2})
            for (const int points : {top->points + distance, top->points - distance}) {
                Member next = *top;  // in its arithmetic
                next.points = points;
                if (points < least || points > most || tried.count(next) != 0) continue;
                // Beyond a neighbour that is clearly slower nothing is expected.
                if (distance == 2) {
                    Member middle = *top;
                    middle.points = (points + top->points) / 2;
                    const auto between = tried.find(middle);
                    if (between == tried.end() || cost(between->second.measurement) > 1.15 * top_cost) continue;
                }
                wishes.push_back({top_cost * distance, next});
            }
    }
    std::stable_sort(wishes.begin(), wishes.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    std::vector<Member> members;
    for (const auto& [wish, member] : wishes) members.push_back(member);
    return members;
}

}  // namespace

Search search(Laboratory& laboratory, double goal) {
    Workshop& workshop = laboratory.workshop();
    Search result;
    result.least_error = infinity;
    std::map<Member, Crossing> tried;
    std::vector<Member> queue = first_guess(goal, 4);
    const double reserve = 0.2 * laboratory.request().seconds;  // for polishing
    bool tried_clean = false;                                   // only where rounding stands in the way
    for (const Member& member : queue) workshop.order(member);
    const auto best_cost = [&] {
        double best = infinity;
        for (const auto& [member, crossing] : tried) best = std::min(best, cost(crossing.measurement));
        return best;
    };
    while (true) {
        laboratory.check_interruption();
        // What is ready is measured; else the compilers are waited for.
        const auto ready =
            std::find_if(queue.begin(), queue.end(), [&](const Member& m) { return workshop.is_ready(m); });
        if (ready != queue.end()) {
            const Member member = *ready;
            queue.erase(ready);
            const Candidate shown{member, 0, 0};
            laboratory.request().say(fmt::format("measuring {}", shown.name()));
            tried[member] = cross(laboratory, member, goal);
            result.least_error = std::min(result.least_error, tried[member].least_error);
        } else if (!queue.empty()) {
            if (laboratory.left() < reserve && best_cost() < infinity) break;
            if (laboratory.left() < -reserve) break;
            std::this_thread::sleep_for(std::chrono::milliseconds(5));
            continue;
        }
        const bool has_time = laboratory.left() > reserve || best_cost() == infinity;
        if (has_time && laboratory.left() > -reserve && queue.size() < 2) {
            for (const Member& member : neighbours(tried, best_cost())) {
                if (std::find(queue.begin(), queue.end(), member) != queue.end()) continue;
                workshop.order(member);
                queue.push_back(member);
                if (queue.size() >= std::max(2u, workshop.threads())) break;
            }
        }
        const bool is_separable = laboratory.derivation().system.separable;
        if (queue.empty() && !tried_clean && is_separable && best_cost() == infinity && laboratory.left() > 0) {
            tried_clean = true;
            queue = cleaner(tried);
            for (const Member& member : queue) workshop.order(member);
        }
        if (queue.empty()) {
            result.complete = true;
            break;
        }
    }
    workshop.cancel();
    result.members = static_cast<int>(tried.size());

    std::vector<Measurement> crossings;
    for (const auto& [member, crossing] : tried)
        if (crossing.measurement) crossings.push_back(*crossing.measurement);
    std::sort(crossings.begin(), crossings.end(),
              [](const Measurement& a, const Measurement& b) { return a.seconds < b.seconds; });
    std::vector<Measurement> finalists;
    for (const Measurement& crossing : crossings) {
        if (crossing.seconds > hopeless * crossings.front().seconds || finalists.size() >= 4) break;
        laboratory.request().say(fmt::format("refining {}", crossing.candidate.name()));
        finalists.push_back(polish(laboratory, crossing, goal));
    }
    // In turn, so that what disturbs one disturbs all.
    for (int round = 0; round < 3; ++round)
        for (Measurement& finalist : finalists)
            if (finalist.seconds < 1.5 * finalists.front().seconds) finalist = laboratory.time_again(finalist, 1);
    for (const Measurement& finalist : finalists)
        if (!result.best || finalist.seconds < result.best->seconds) result.best = finalist;
    result.by_member = finalists;
    return result;
}

namespace {

// Members in the order in which they are looked at: first those far apart, then between them.
std::vector<Member> tour(bool is_separable) {
    std::vector<Member> members;
    const auto add = [&](Family family, Precision precision, std::initializer_list<int> points) {
        for (const int count : points) members.push_back({family, count, precision});
    };
    add(Family::lobatto, Precision::double_, {8, 4});
    add(Family::gauss, Precision::double_, {6});
    add(Family::lobatto, Precision::double_, {12, 2});
    add(Family::gauss, Precision::double_, {10});
    add(Family::lobatto, Precision::double_, {6, 10});
    add(Family::lobatto, Precision::single, {6});
    add(Family::gauss, Precision::double_, {3, 1});
    add(Family::lobatto, Precision::quadruple, {12});  // the reference's own kernel
    add(Family::lobatto, Precision::extended, {12});
    if (is_separable)
        for (const int count : {8, 12})
            members.push_back({Family::lobatto, count, Precision::double_, StepArithmetic::clean});
    add(Family::lobatto, Precision::double_, {5, 3, 9, 7, 11});
    add(Family::gauss, Precision::double_, {8, 4, 2, 5, 7, 9});
    add(Family::lobatto, Precision::single, {4, 8});
    add(Family::lobatto, Precision::extended, {9});
    return members;
}

// The least time of what is as accurate or better.
double fastest_within(const Laboratory& laboratory, double figure) {
    double seconds = infinity;
    for (const auto& [key, m] : laboratory.notebook().all())
        if (m.complete && laboratory.figure(m) <= figure) seconds = std::min(seconds, m.seconds);
    return seconds;
}

// A ladder of steps of one member; finer ratios and looser iterations once it is known to be among the best.
struct Scan {
    Member member;
    double ratio = 1.5, tolerance = 0;
    auto key() const { return std::tuple(member, ratio, tolerance); }
    friend bool operator<(const Scan& a, const Scan& b) { return a.key() < b.key(); }
};

// From coarse to fine until it has lost, or rounding is reached.
void work_on(Laboratory& laboratory, const Scan& scan, double reserve) {
    const StepLadder ladder = ladder_of(laboratory, scan.ratio);
    const double longest_run = laboratory.request().seconds / 40;
    double least = infinity;
    int no_better = 0, dominated = 0;
    for (std::int64_t steps = ladder.at_least(fewest_steps(laboratory));
         static_cast<double>(steps) < most_steps && (laboratory.left() > reserve || !std::isfinite(least));
         steps = ladder.next(steps)) {
        const Measurement m = laboratory.measure({scan.member, steps, scan.tolerance});
        if (m.seconds > longest_run) return;
        if (!m.complete) continue;
        const double figure = laboratory.figure(m);
        no_better = figure > 0.7 * least ? no_better + 1 : 0;
        least = std::min(least, figure);
        const double rounding =
            1e4 * rounding_of(scan.member.precision) * std::sqrt(static_cast<double>(steps)) + scan.tolerance;
        if (no_better >= 3 && least < rounding) return;
        // Another is as accurate in a fraction of the time; four times in a row, because the coarsest steps may be
        // slow.
        const double lead = scan.ratio < 1.5 ? 2 : 4;
        dominated = figure < 0.1 && m.seconds > lead * fastest_within(laboratory, figure) ? dominated + 1 : 0;
        if (dominated >= 4) return;
    }
}

// What would tell more about the members that are best at present; none is done twice.
std::optional<Scan> refinement(const Laboratory& laboratory, const std::set<Scan>& done) {
    std::vector<Member> winners;
    for (const Measurement& m : pareto_front(laboratory))
        if (m.error < 0.1 && std::find(winners.begin(), winners.end(), m.candidate.member) == winners.end())
            winners.push_back(m.candidate.member);
    for (const double ratio : {1.2, 1.08})
        for (const double tolerance : {0.0, 1e-12, 1e-9, 1e-6})
            for (const Member& member : winners) {
                if (member.precision == Precision::quadruple) continue;
                const bool is_clean = member.arithmetic == StepArithmetic::clean;
                if (tolerance > 0 && (is_clean || tolerance < 4 * rounding_of(member.precision))) continue;
                if (const Scan scan{member, ratio, tolerance}; done.count(scan) == 0) return scan;
            }
    return std::nullopt;
}

}  // namespace

std::vector<Member> first_of_tour() {
    const std::vector<Member> members = tour(false);
    return {members.begin(), members.begin() + 4};
}

void explore(Laboratory& laboratory) {
    Workshop& workshop = laboratory.workshop();
    const double all = laboratory.request().seconds, reserve = 0.12 * all;
    double last_order = 0.25 * all;  // what is ordered later would not be used
    std::vector<Member> waiting = tour(laboratory.derivation().system.separable);
    std::set<Scan> done;
    const auto name = [](const Member& member) {
        return fmt::format("{} in {}", Candidate{member, 0, 0}.name(), precision_name(member.precision));
    };
    // However long the reference took: something is measured.
    const auto has_time = [&] { return laboratory.left() > reserve || laboratory.notebook().all().empty(); };
    while (has_time()) {
        laboratory.check_interruption();
        std::size_t at_work = 0;
        for (const Member& member : waiting)
            at_work += workshop.is_ordered(member) && !workshop.is_ready(member) ? 1 : 0;
        const auto next =
            std::find_if(waiting.begin(), waiting.end(), [&](const Member& m) { return !workshop.is_ordered(m); });
        if (at_work <= workshop.threads() && next != waiting.end() && laboratory.left() > last_order)
            workshop.order(*next);
        const auto ready =
            std::find_if(waiting.begin(), waiting.end(), [&](const Member& m) { return workshop.is_ready(m); });
        if (ready != waiting.end()) {
            const Member member = *ready;
            waiting.erase(ready);
            last_order = std::max(last_order, reserve + 1.5 * workshop.compile_seconds(member));
            laboratory.request().say("measuring " + name(member));
            work_on(laboratory, {member, member.precision == Precision::quadruple ? 2.0 : 1.5, 0}, reserve);
        } else if (const auto scan = refinement(laboratory, done)) {
            laboratory.request().say(fmt::format("finer steps of {}", name(scan->member)));
            done.insert(*scan);
            work_on(laboratory, *scan, reserve);
        } else if (at_work == 0 && next == waiting.end()) {
            break;
        } else {
            std::this_thread::sleep_for(std::chrono::milliseconds(5));
        }
    }
    workshop.cancel();
}

}  // namespace lobatto
