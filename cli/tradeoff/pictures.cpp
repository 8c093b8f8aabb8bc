// SPDX-License-Identifier: GPL-2.0-or-later
#include "cli/tradeoff/pictures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "analysis/tradeoff/exploration.hpp"
#include "cli/print/drawing.hpp"

namespace lobatto {

namespace {

const char* const colours[] = {"#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9"};  // Okabe and Ito
constexpr int most_curves = 12;                                                                    // of members
constexpr double targets[] = {1e-3, 1e-6, 1e-9, 1e-12};                                            // of courses

std::string name_of(const Member& member) {
    const std::string name = Candidate{member, 0, 0}.name();
    return member.precision == Precision::double_ ? name : name + ", " + precision_name(member.precision);
}

// What is on the axis of errors.
std::string figure_name(const Experiment& experiment) {
    if (!experiment.is_chaotic()) return "largest error, relative to the amplitude of the motion";
    return experiment.conserves() ? "largest energy error, relative" : "1 / time until which the motion is followed";
}

// Where rounding ends what more steps bring: the least error in each kind of numbers, as a line across the picture.
std::string floors_of(const Experiment& experiment) {
    std::map<Precision, const Measurement*> least;
    for (const auto& [key, m] : experiment.store().all()) {
        const double figure = experiment.figure(m);
        const Measurement*& best = least[m.candidate.member.precision];
        if (m.complete && figure > 0 && (best == nullptr || figure < experiment.figure(*best))) best = &m;
    }
    std::string text;
    for (const auto& [precision, m] : least) {
        if (m == nullptr) continue;
        const double figure = experiment.figure(*m), steps = static_cast<double>(m->candidate.steps);
        if (figure > 1e4 * rounding_of(precision) * std::sqrt(steps)) continue;
        text += fmt::format(
            "set arrow from {0:.3e},graph 0 to {0:.3e},graph 1 nohead dt 3 lc rgb \"#888888\"\n"
            "set label \"{1}\" at {0:.3e},graph 0.98 rotate by 90 right offset -0.6,0 tc rgb \"#555555\"\n",
            figure, precision_name(precision));
    }
    return text;
}

bool draw_work_precision(const Experiment& experiment, const std::string& folder) {
    std::map<Member, std::vector<const Measurement*>> members;
    for (const auto& [key, m] : experiment.store().all())
        if (m.complete && m.candidate.tolerance == 0 && experiment.figure(m) < 0.3 && experiment.figure(m) > 0)
            members[m.candidate.member].push_back(&m);
    const std::vector<Measurement> front = pareto_front(experiment);
    // Those that are most often the best, then those of which most is known.
    const auto merit = [&](const Member& member) {
        return std::pair(std::count_if(front.begin(), front.end(),
                                       [&](const Measurement& m) { return m.candidate.member == member; }),
                         members.at(member).size());
    };
    std::vector<const Member*> shown;
    for (const auto& [member, list] : members) shown.push_back(&member);
    std::stable_sort(shown.begin(), shown.end(),
                     [&](const Member* a, const Member* b) { return merit(*a) > merit(*b); });
    if (shown.size() > most_curves) shown.resize(most_curves);
    std::sort(shown.begin(), shown.end(), [](const Member* a, const Member* b) { return *a < *b; });
    const double until = experiment.until();
    std::string data, curves;
    const auto add = [&](std::vector<const Measurement*> list, const std::string& style, const std::string& title) {
        std::sort(list.begin(), list.end(),
                  [](const auto* a, const auto* b) { return a->candidate.steps < b->candidate.steps; });
        const std::string name = fmt::format("$m{}", std::count(data.begin(), data.end(), '$'));
        data += name + " << END\n";
        for (const Measurement* m : list)
            data += fmt::format("{:.4e},{:.4e}\n", experiment.figure(*m), m->seconds / until * 1e9);
        data += "END\n";
        curves +=
            fmt::format("{}{} using 1:2 {} title \"{}\"", curves.empty() ? "plot " : ", \\\n     ", name, style, title);
    };
    std::vector<const Measurement*> best;
    for (const Measurement& m : front)
        if (experiment.figure(m) < 0.3 && experiment.figure(m) > 0) best.push_back(&m);
    if (best.empty()) return false;
    std::sort(best.begin(), best.end(), [](const auto* a, const auto* b) { return a->seconds < b->seconds; });
    int number = 0;
    for (const Member* member : shown) {
        const int dashes = member->family == Family::lobatto ? 1 : member->family == Family::gauss ? 2 : 3;
        add(members.at(*member),
            fmt::format("with linespoints lc rgb \"{}\" lw 1.5 dt {} pt {} ps 0.6", colours[number % 6], dashes,
                        4 + (number + number / 6) % 6),  // no colour has the same points twice
            name_of(*member));
        ++number;
    }
    data += "$front << END\n";
    for (const Measurement* m : best)
        data += fmt::format("{:.4e},{:.4e}\n", experiment.figure(*m), m->seconds / until * 1e9);
    data += "END\n";
    curves += ", \\\n     $front using 1:2 with lines lc rgb \"#000000\" lw 4 title \"the best of all\"";
    draw(folder, "work_precision",
         fmt::format("{}set logscale xy\nset xrange [*:*] reverse\nset format \"10^{{%T}}\"\n"
                     "set key outside right center vertical maxrows 20 Left reverse samplen 2 noenhanced\n"
                     "set title {} noenhanced\nset xlabel \"{}\"\nset ylabel \"nanoseconds per unit of time\"\n{}{}\n",
                     data, gnuplot_text(experiment.scene().title), figure_name(experiment), floors_of(experiment),
                     curves),
         960, 560);
    return true;
}

// For some decades the cheapest way.
std::vector<Measurement> representatives(const Experiment& experiment) {
    std::vector<Measurement> chosen;
    for (const double target : targets)
        for (const Measurement& m : pareto_front(experiment))
            if (experiment.figure(m) <= target) {
                if (m.candidate.member.precision == Precision::double_ &&
                    (chosen.empty() || chosen.back().candidate.key() != m.candidate.key()))
                    chosen.push_back(m);
                break;
            }
    return chosen;
}

// False: there is no error to draw.
bool draw_course(const std::string& folder, const std::string& name, const std::string& label,
                 const std::vector<std::string>& titles, const std::vector<std::vector<double>>& times,
                 const std::vector<std::vector<double>>& values) {
    std::string data, curves;
    for (std::size_t i = 0; i < titles.size(); ++i) {
        if (std::all_of(values[i].begin(), values[i].end(), [](double value) { return !(std::fabs(value) > 0); }))
            continue;
        data += fmt::format("$c{} << END\n", i);
        for (std::size_t j = 0; j < values[i].size(); ++j)
            if (std::fabs(values[i][j]) > 0)
                data += fmt::format("{:.6g},{:.4e}\n", times[i][j], std::fabs(values[i][j]));
        data += "END\n";
        curves += fmt::format("{}$c{} using 1:2 with lines lc rgb \"{}\" lw 1.5 title \"{}\"",
                              curves.empty() ? "plot " : ", \\\n     ", i, colours[i % 6], titles[i]);
    }
    if (curves.empty()) return false;
    draw(folder, name,
         fmt::format("{}set logscale y\nset format y \"10^{{%T}}\"\n"
                     "set key outside right center vertical maxrows 20 Left reverse samplen 2 noenhanced\n"
                     "set xlabel \"time\"\nset ylabel \"{}\"\n{}\n",
                     data, label, curves),
         960, 400);
    return true;
}

}  // namespace

std::vector<std::string> draw_pictures(Experiment& experiment, const std::string& folder) {
    std::vector<std::string> names, titles;
    if (draw_work_precision(experiment, folder)) names.emplace_back("work_precision");
    std::vector<std::vector<double>> times, errors, energies;
    for (const Measurement& m : representatives(experiment)) {
        const Measurer::Course course =
            experiment.measurer().course(experiment.kernel_builder().kernel(m.candidate.member), m.candidate);
        titles.push_back(fmt::format("{}, h = {:.3g}", m.candidate.name(), m.step));
        times.push_back(course.time);
        errors.push_back(course.error);
        energies.push_back(course.energy);
    }
    if (titles.empty()) return names;
    if (draw_course(folder, "error", "error", titles, times, errors)) names.emplace_back("error");
    if (experiment.conserves() && !energies.front().empty() &&
        draw_course(folder, "energy", "energy error", titles, times, energies))
        names.emplace_back("energy");
    return names;
}

}  // namespace lobatto
