// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/tradeoff/exploration.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <thread>

namespace lobatto {

std::vector<Measurement> pareto_front(const Experiment& experiment) {
    std::vector<Measurement> complete, front;
    for (const auto& [key, m] : experiment.store().all())
        if (m.complete) complete.push_back(m);
    std::sort(complete.begin(), complete.end(), [&](const Measurement& a, const Measurement& b) {
        return std::tuple(a.seconds, experiment.figure(a), a.candidate.key()) <
               std::tuple(b.seconds, experiment.figure(b), b.candidate.key());
    });
    for (const Measurement& m : complete)
        if (front.empty() || experiment.figure(m) < experiment.figure(front.back())) front.push_back(m);
    return front;
}

namespace {

// Members in the order in which they are looked at: first those far apart, then between them.
std::vector<Member> tour() {
    std::vector<Member> members;
    const auto add_clocked = [&](Family family, int points) {
        for (const StepClock clock : {StepClock::automatic, StepClock::of_scene})
            members.push_back({family, points, Precision::double_, StepArithmetic::plain, clock});
    };
    const auto add = [&](Family family, Precision precision, std::initializer_list<int> points) {
        for (const int count : points) members.push_back({family, count, precision});
    };
    add(Family::lobatto, Precision::double_, {8, 4});
    add_clocked(Family::lobatto, 8);
    add(Family::gauss, Precision::double_, {6});
    add(Family::lobatto, Precision::double_, {12, 2});
    add_clocked(Family::lobatto, 12);
    add(Family::gauss, Precision::double_, {10});
    add(Family::lobatto, Precision::double_, {6, 10});
    add_clocked(Family::lobatto, 10);
    add_clocked(Family::gauss, 8);
    add_clocked(Family::lobatto, 5);
    add(Family::lobatto, Precision::single, {6});
    add(Family::gauss, Precision::double_, {3, 1});
    add(Family::lobatto, Precision::double_double, {12});
    add(Family::lobatto, Precision::quadruple, {12});  // the reference's own kernel
    add(Family::lobatto, Precision::extended, {12});
    add(Family::splitting, Precision::double_, {11, 17});
    for (const int count : {8, 12})
        members.push_back({Family::lobatto, count, Precision::double_, StepArithmetic::clean});
    add(Family::lobatto, Precision::double_, {5, 3, 9, 7, 11});
    add(Family::gauss, Precision::double_, {8, 4, 2, 5, 7, 9});
    add(Family::splitting, Precision::double_, {6, 14, 35});
    add(Family::lobatto, Precision::single, {4, 8});
    add(Family::lobatto, Precision::extended, {9});
    add(Family::lobatto, Precision::double_double, {10});
    return members;
}

// The least time of what is as accurate or better.
double fastest_within(const Experiment& experiment, double figure) {
    double seconds = infinity;
    for (const auto& [key, m] : experiment.store().all())
        if (m.complete && experiment.figure(m) <= figure) seconds = std::min(seconds, m.seconds);
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
void work_on(Experiment& experiment, const Scan& scan, double reserve) {
    const StepLadder ladder = experiment.ladder(scan.ratio);
    const double longest_run = experiment.request().seconds / 40;
    double least = infinity;
    int no_better = 0, dominated = 0;
    for (std::int64_t steps = ladder.at_least(
             std::max(experiment.fewest_steps(scan.member.clock), experiment.fewest_stable_steps(scan.member)));
         static_cast<double>(steps) < most_steps && (experiment.left() > reserve || !std::isfinite(least));
         steps = ladder.next(steps)) {
        const Measurement m = experiment.measure({scan.member, steps, scan.tolerance}, true, longest_run);
        if (m.seconds >= longest_run) return;
        if (!m.complete) continue;
        const double figure = experiment.figure(m);
        no_better = figure > 0.7 * least ? no_better + 1 : 0;
        least = std::min(least, figure);
        const double rounding =
            1e4 * rounding_of(scan.member.precision) * std::sqrt(static_cast<double>(steps)) + scan.tolerance;
        if (no_better >= 3 && least < rounding) return;
        // Another is as accurate in a fraction of the time; four times in a row, because the coarsest steps may be
        // slow.
        const double lead = scan.ratio < 1.5 ? 2 : 4;
        dominated = figure < 0.1 && m.seconds > lead * fastest_within(experiment, figure) ? dominated + 1 : 0;
        if (dominated >= 4) return;
    }
}

// What would tell more about the members that are best at present; none is done twice.
std::optional<Scan> refinement(const Experiment& experiment, const std::set<Scan>& done) {
    std::vector<Member> winners;
    for (const Measurement& m : pareto_front(experiment))
        if (m.error < 0.1 && std::find(winners.begin(), winners.end(), m.candidate.member) == winners.end())
            winners.push_back(m.candidate.member);
    for (const double ratio : {1.2, 1.08})
        for (const double tolerance : {0.0, 1e-12, 1e-9, 1e-6})
            for (const Member& member : winners) {
                if (member.precision == Precision::quadruple) continue;
                if (tolerance > 0 &&
                    (!experiment.heeds_tolerance(member) || tolerance < 4 * rounding_of(member.precision)))
                    continue;
                if (const Scan scan{member, ratio, tolerance}; done.count(scan) == 0) return scan;
            }
    return std::nullopt;
}

}  // namespace

std::vector<Member> first_of_tour() {
    const std::vector<Member> members = tour();
    return {members.begin(), members.begin() + 6};
}

std::vector<Member> explore(Experiment& experiment) {
    KernelBuilder& kernel_builder = experiment.kernel_builder();
    const double all = experiment.request().seconds, reserve = 0.12 * all;
    double last_order = 0.25 * all;  // what is ordered later would not be used
    std::vector<Member> waiting = tour();
    std::erase_if(waiting, [&](const Member& member) { return !kernel_builder.allows(member); });
    std::set<Scan> done;
    const auto name = [](const Member& member) {
        return fmt::format("{} in {}", Candidate{member, 0, 0}.name(), precision_name(member.precision));
    };
    // However long the reference took: something is measured.
    const auto has_time = [&] { return experiment.left() > reserve || experiment.store().all().empty(); };
    while (has_time()) {
        experiment.check_interruption();
        std::size_t at_work = 0;
        for (const Member& member : waiting)
            at_work += kernel_builder.is_ordered(member) && !kernel_builder.is_ready(member) ? 1 : 0;
        const auto next = std::find_if(waiting.begin(), waiting.end(),
                                       [&](const Member& m) { return !kernel_builder.is_ordered(m); });
        if (at_work <= kernel_builder.threads() && next != waiting.end() && experiment.left() > last_order)
            kernel_builder.order(*next);
        const auto ready =
            std::find_if(waiting.begin(), waiting.end(), [&](const Member& m) { return kernel_builder.is_ready(m); });
        if (ready != waiting.end()) {
            const Member member = *ready;
            waiting.erase(ready);
            last_order = std::max(last_order, reserve + 1.5 * kernel_builder.compile_seconds(member));
            experiment.request().say("measuring " + name(member));
            work_on(experiment, {member, member.precision == Precision::quadruple ? 2.0 : 1.5, 0}, reserve);
        } else if (const auto scan = refinement(experiment, done)) {
            experiment.request().say(fmt::format("finer steps of {}", name(scan->member)));
            done.insert(*scan);
            work_on(experiment, *scan, reserve);
        } else if (at_work == 0 && next == waiting.end()) {
            break;
        } else {
            std::this_thread::sleep_for(std::chrono::milliseconds(5));
        }
    }
    kernel_builder.cancel();
    return waiting;
}

}  // namespace lobatto
