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
constexpr std::size_t most_finalists = 4;
constexpr double too_long = 0.3;  // of the budget: a crossing that took so much more is left, once it has an error
constexpr double close = 1.08;    // two numbers of steps between which nothing is looked for

// Of an iteration that ends so many digits beyond the goal.
double fitting_tolerance(double goal, double digits, Precision numbers) {
    const double least = std::floor(std::log10(rounding_of(numbers))) + 2;
    return std::pow(10.0, std::clamp(std::floor(std::log10(goal)) - digits, least, -3.0));
}

bool has_tolerance(Experiment& experiment, const Member& member) {
    return member.iterates() && experiment.kernel_builder().kernel(member)->linear == 0;
}

}  // namespace

Attempt cross(Experiment& experiment, const Member& member, double goal) {
    const StepLadder ladder = experiment.ladder(fine_ratio);
    const double order = member.order(), fewest = experiment.fewest_steps();
    Attempt result{{}, infinity, infinity};
    const auto run = [&](std::int64_t steps) {
        const Measurement m = experiment.measure({member, steps, 0}, false);
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
        if (experiment.left() < -too_long * experiment.request().seconds && std::isfinite(result.least_error)) break;
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
            if (m.complete && m.seconds * factor > std::max(0.5, experiment.left())) break;
            steps = ladder.at_least(std::max(more, static_cast<double>(steps) + 1));
        }
    }
    if (good) {
        result.measurement = experiment.time_again(*good, 1);
        result.seconds = result.measurement->seconds;
        if (has_tolerance(experiment, member)) {
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
    for (std::int64_t steps = starts.front(); steps > 1 && far_beyond < 2 && !is_late();) {
        steps = ladder.at_most(static_cast<double>(steps) / fine_ratio);
        const Measurement m = experiment.measure({member, steps, 0}, false);
        far_beyond = m.complete && m.error < 100 * goal ? 0 : far_beyond + 1;
        if (m.complete && m.error <= goal) starts.push_back(steps);
    }
    if (starts.size() > 2) starts = {starts.front(), starts.back()};
    std::vector<double> tolerances = {0};
    for (const double digits : {0.0, 1.0, 2.0, 3.0, 4.0})
        if (has_tolerance(experiment, member) && tolerances.back() != fitting_tolerance(goal, digits, member.precision))
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
        if (member.arithmetic == StepArithmetic::plain && member.family != Family::splitting)
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

// Members next to the best of each family that were not tried; the nearest to the best first.
std::vector<Member> neighbours(const std::map<Member, Attempt>& tried, double best_cost, bool is_separable,
                               Precision numbers) {
    std::vector<std::pair<double, Member>> wishes;
    for (const Family family : {Family::lobatto, Family::gauss, Family::splitting}) {
        if (family == Family::splitting && !is_separable) continue;
        const std::vector<int>& sizes = sizes_of(family);
        const int last = static_cast<int>(sizes.size()) - 1;
        std::optional<Member> top;
        double top_cost = infinity;
        int tried_here = 0;
        for (const auto& [member, crossing] : tried) {
            if (member.family != family) continue;
            ++tried_here;
            if (crossing.seconds < top_cost) top = member, top_cost = crossing.seconds;
        }
        const auto size_at = [&](int place) { return sizes[static_cast<std::size_t>(place)]; };
        if (!top) {  // none reaches the goal: orders between
            for (const int place : {last, last / 2, last - 2})
                if (const Member next{family, size_at(place), numbers}; tried.count(next) == 0)
                    wishes.push_back({1e3, next});
            continue;
        }
        const int here = static_cast<int>(std::find(sizes.begin(), sizes.end(), top->points) - sizes.begin());
        if (top_cost > hopeless * best_cost && tried_here >= 3) continue;
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
        for (const int points : full_registers(family, is_separable)) {
            Member next = *top;
            next.points = points;
            if (std::abs(points - top->points) <= 4 && tried.count(next) == 0) wishes.push_back({top_cost * 3, next});
        }
    }
    std::stable_sort(wishes.begin(), wishes.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    std::vector<Member> members;
    for (const auto& [wish, member] : wishes)
        if (reason_against_numbers(member.method()).empty()) members.push_back(member);
    return members;
}

}  // namespace

Search search(Experiment& experiment, double goal, Precision numbers) {
    KernelBuilder& kernel_builder = experiment.kernel_builder();
    const bool is_separable = experiment.derivation().system.separable;
    Search result;
    result.least_error = infinity;
    std::map<Member, Attempt> tried;
    std::vector<Member> queue = first_guess(goal, 4, numbers);
    const Member splitting{Family::splitting, goal > 1e-4 ? 6 : goal > 1e-9 ? 11 : goal > 1e-11 ? 17 : 35, numbers};
    if (is_separable && reason_against_numbers(splitting.method()).empty()) queue.push_back(splitting);
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
        const auto ready =
            std::find_if(queue.begin(), queue.end(), [&](const Member& m) { return kernel_builder.is_ready(m); });
        if (ready != queue.end()) {
            const Member member = *ready;
            queue.erase(ready);
            const Candidate shown{member, 0, 0};
            experiment.request().say(fmt::format("measuring {}", shown.name()));
            tried[member] = cross(experiment, member, goal);
            result.least_error = std::min(result.least_error, tried[member].least_error);
        } else if (!queue.empty()) {
            if (experiment.left() < reserve && best_cost() < infinity) break;
            if (experiment.left() < -reserve && !tried.empty()) break;
            std::this_thread::sleep_for(std::chrono::milliseconds(5));
            continue;
        }
        const bool has_time = experiment.left() > reserve || best_cost() == infinity;
        if (has_time && experiment.left() > -reserve && queue.size() < 2) {
            for (const Member& member : neighbours(tried, best_cost(), is_separable, numbers)) {
                if (std::find(queue.begin(), queue.end(), member) != queue.end()) continue;
                kernel_builder.order(member);
                queue.push_back(member);
                if (queue.size() >= std::max(2u, kernel_builder.threads())) break;
            }
        }
        if (queue.empty() && !tried_clean && is_separable && numbers == Precision::double_ && best_cost() == infinity &&
            experiment.left() > 0) {
            tried_clean = true;
            queue = cleaner(tried);
            for (const Member& member : queue) kernel_builder.order(member);
        }
        if (queue.empty()) {
            result.complete = true;
            break;
        }
    }
    kernel_builder.cancel();
    result.members = static_cast<int>(tried.size());

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
    result.by_member = finalists;
    return result;
}

}  // namespace lobatto
