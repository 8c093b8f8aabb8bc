// SPDX-License-Identifier: GPL-2.0-or-later
// Data and gnuplot scripts of the figures; the same bytes on every run.
#include "cli/paper/figures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "cli/paper/tables.hpp"
#include "cli/print/drawing.hpp"
#include "runtime/files/partial_file.hpp"

namespace lobatto {

namespace {

constexpr double angular_frequency = 2 * std::numbers::pi;
const char* const without_figures = "leave the figures out with --no-figures";
constexpr double steps_of_growth[3] = {0.1, 0.05, 0.025};

void write_data(const std::string& folder, const std::string& name, const std::string& data) {
    write_whole(folder + "/" + name + ".csv", "the figure's data", data, without_figures);
}

void draw_figure(const std::string& folder, const std::string& name, const std::string& script, int height) {
    draw(folder, name, script, 900, height, without_figures);
}

// Figures 1 and 3: exact curve at `fine` points a step, states of the three schemes at the steps; p divided by m omega.
std::string motion_data(PaperSystem system, double step, int steps, int fine) {
    const auto lobatto = kernel_states(system, 4, step, steps), simpson = kernel_states(system, 3, step, steps),
               midpoint = midpoint_states(system, step, steps);
    std::string text = "t,q exact,p exact,q Lobatto,p Lobatto,q Simpson,p Simpson,q midpoint,p midpoint\n";
    for (int i = 0; i <= steps * fine; ++i) {
        const double t = step * i / fine;
        const PaperState exact = exact_state(system, t);
        text += fmt::format("{:.6f},{:.6f},{:.6f}", t, static_cast<double>(exact.q),
                            static_cast<double>(exact.p) / angular_frequency);
        for (const auto* states : {&lobatto, &simpson, &midpoint}) {
            if (i % fine != 0) {
                text += ",,";
                continue;
            }
            const PaperState& state = (*states)[static_cast<std::size_t>(i / fine)];
            text += fmt::format(",{:.6f},{:.6f}", static_cast<double>(state.q),
                                static_cast<double>(state.p) / angular_frequency);
        }
        text += '\n';
    }
    return text;
}

std::string motion_script(const std::string& name, const std::string& time_label, const std::string& end,
                          const std::string& q_range, const std::string& p_range) {
    std::string script = fmt::format(
        "set multiplot layout 2,1 margins 0.10,0.97,0.11,0.92 spacing 0,0.07\nset ytics 1\nset xrange [0:{}]\n", end);
    const auto panel = [&](int q_column, const std::string& label, const std::string& range) {
        return fmt::format(
            "set ylabel \"{0}\"\nset yrange [{1}]\nplot \"{2}.csv\" skip 1 using 1:{3} with lines ls 1 title "
            "\"exact\", "
            "\"\" skip 1 using 1:{6} with points ls 4 title \"midpoint\", \"\" skip 1 using 1:{5} with points "
            "ls 3 title \"Simpson\", "
            "\"\" skip 1 using 1:{4} with points ls 2 title \"Lobatto\"\n",
            label, range, name, q_column, q_column + 2, q_column + 4, q_column + 6);
    };
    script += "set format x \"\"\n" + panel(2, "state q", q_range) + "unset key\nset format x \"%g\"\nset xlabel \"" +
              time_label + "\"\n" + panel(3, "momentum p/(mω)", p_range) + "unset multiplot\n";
    return script;
}

// One curve of figures 2 and 4: running maxima at logarithmically spaced periods, and the slope.
struct Curve {
    std::vector<double> energy, discrete, rounding;  // at the sampled periods
    double slope = 0;
};

std::vector<double> sampled_periods(double last) {
    std::vector<double> periods;
    for (int i = 0; periods.empty() || periods.back() < last; ++i) {
        const double period = std::min(last, std::round(std::pow(10.0, i / 24.0)));
        if (periods.empty() || period > periods.back()) periods.push_back(period);
    }
    return periods;
}

// `unrounded`: the energies of the same steps without rounding, to see what it does; null for nothing.
Curve energy_curve(PaperSystem system, const Kernel& kernel, double step, double last_period, long double unit,
                   const std::vector<long double>* unrounded = nullptr) {
    const double period = exact_period(system);
    const std::vector<double> samples = sampled_periods(last_period);
    std::function<long double(const PaperState&)> H_d;
    if (system == PaperSystem::oscillator) H_d = discrete_energy_of(paper_kernel(system, 4), step);
    Curve curve;
    long double H0 = 0, H_d0 = 0, largest = 0, largest_discrete = 0, largest_rounding = 0;
    std::size_t count = 0;
    long double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;  // of the least-squares line
    run_kernel(kernel, step, std::lround(last_period * period / step), [&](const PaperState& state) {
        if (n == 0) {
            H0 = exact_energy(system, state);
            if (H_d) H_d0 = H_d(state);
        }
        const long double H = exact_energy(system, state);
        largest = std::max(largest, std::fabs(H - H0) / unit);
        if (unrounded != nullptr)
            largest_rounding = std::max(largest_rounding, std::fabs(H - (*unrounded)[count++]) / unit);
        if (H_d) largest_discrete = std::max(largest_discrete, std::fabs(H_d(state) / H_d0 - 1));
        const long double x = state.t / period;
        if (x + step / 2 >= samples[std::min(curve.energy.size(), samples.size() - 1)] &&
            curve.energy.size() < samples.size()) {
            curve.energy.push_back(static_cast<double>(largest));
            curve.discrete.push_back(static_cast<double>(largest_discrete));
            curve.rounding.push_back(static_cast<double>(largest_rounding));
        }
        n += 1;
        sx += x;
        sy += largest;
        sxx += x * x;
        sxy += x * largest;
    });
    curve.slope = static_cast<double>((n * sxy - sx * sy) / (n * sxx - sx * sx));
    return curve;
}

struct Evolution {
    std::vector<Growth> growth;
    std::string data;
};

Evolution evolution(PaperSystem system, double last_period, long double unit, const double (&printed)[3]) {
    const bool oscillates = system == PaperSystem::oscillator;
    const Kernel in_double = paper_kernel(system, 4), in_extended = paper_kernel(system, 4, Precision::extended),
                 clean_kernel = paper_kernel(system, 4, Precision::double_, StepArithmetic::clean),
                 clean_extended = paper_kernel(system, 4, Precision::extended, StepArithmetic::clean);
    std::vector<Curve> curves, extended, clean;
    Evolution result;
    for (int k = 0; k < 3; ++k) {
        // The oscillator's H_d shows rounding by itself; the pendulum's energies need some without.
        std::vector<long double> unrounded;
        if (!oscillates)
            run_kernel(clean_extended, steps_of_growth[k],
                       std::lround(last_period * exact_period(system) / steps_of_growth[k]),
                       [&](const PaperState& state) { unrounded.push_back(exact_energy(system, state)); });
        const auto curve = [&](const Kernel& kernel) {
            return energy_curve(system, kernel, steps_of_growth[k], last_period, unit,
                                unrounded.empty() ? nullptr : &unrounded);
        };
        curves.push_back(curve(in_double));
        extended.push_back(curve(in_extended));
        clean.push_back(curve(clean_kernel));
        result.growth.push_back({steps_of_growth[k], printed[k], curves[k].slope, extended[k].slope,
                                 curves[k].energy.back(),
                                 oscillates ? curves[k].discrete.back() : curves[k].rounding.back(),
                                 oscillates ? clean[k].discrete.back() : clean[k].rounding.back()});
    }
    std::vector<const std::vector<double>*> columns;
    result.data = "periods";
    const auto add = [&](const std::string& quantity, const std::vector<Curve>& of,
                         std::vector<double> Curve::*values) {
        for (std::size_t k = 0; k < of.size(); ++k) {
            result.data += fmt::format(",{} h={}", quantity, steps_of_growth[k]);
            columns.push_back(&(of[k].*values));
        }
    };
    add("H double", curves, &Curve::energy);
    const std::string what = oscillates ? "H_d" : "rounding of H";
    const auto values = oscillates ? &Curve::discrete : &Curve::rounding;
    add(what + " double", curves, values);
    add(what + " extended", extended, values);
    add(what + " clean", clean, values);
    result.data += '\n';
    const std::vector<double> samples = sampled_periods(last_period);
    for (std::size_t i = 0; i < samples.size(); ++i) {
        result.data += fmt::format("{}", samples[i]);
        for (const auto* column : columns)
            result.data += (*column)[i] > 0 ? fmt::format(",{:.6e}", (*column)[i]) : std::string(",");
        result.data += '\n';
    }
    return result;
}

// Three curves, one a step, from this column on; drawn with styles from `first_style` on.
std::string curves_of(const std::string& name, int first_column, int first_style, bool titled) {
    std::string curves;
    for (int k = 0; k < 3; ++k)
        curves +=
            fmt::format("{}\"{}.csv\" skip 1 using 1:{} with lines ls {} {}", k > 0 ? ", " : "", name, first_column + k,
                        first_style + k, titled ? fmt::format("title \"h = {}\"", steps_of_growth[k]) : "notitle");
    return curves;
}

const char* const logarithmic = "set logscale xy\nset format y \"10^{%L}\"\n";

// The axis of values: what they are, and from where to where.
struct ValueAxis {
    std::string label, range;
};

// Energy errors over the periods, above, and what rounding does, below.
std::string growth_script(const std::string& name, const std::string& periods, const ValueAxis& above,
                          const ValueAxis& below) {
    return fmt::format(
               "set multiplot layout 2,1 margins 0.12,0.97,0.11,0.92 spacing 0,0.06\nset xrange [1:{}]\n{}set format x "
               "\"\"\nset ylabel \"{}\"\nset yrange [{}]\nplot {}\n",
               periods, logarithmic, above.label, above.range, curves_of(name, 2, 2, true)) +
           fmt::format(
               "unset key\nset format x \"10^{{%L}}\"\nset xlabel \"periods\"\nset ylabel \"{}\"\nset yrange "
               "[{}]\nplot {}, {}\nunset multiplot\n",
               below.label, below.range, curves_of(name, 5, 2, false), curves_of(name, 11, 12, false));
}

}  // namespace

std::vector<Figure> draw_figures(const std::string& folder,
                                 const std::function<void(const std::string&, double)>& say) {
    std::vector<Figure> figures;
    figures.push_back({"figure1",
                       "Figure 1: harmonic oscillator, N = 3 meshes",
                       "State and momentum over one period, with three steps only. Lobatto's points lie on the exact "
                       "curve to 0.2 % of the amplitude at worst; the momentum is "
                       "divided by mω.",
                       {},
                       ""});
    write_data(folder, "figure1", motion_data(PaperSystem::oscillator, 1.0 / 3, 3, 60));
    draw_figure(folder, "figure1",
                motion_script("figure1", "time t (one period T = 1)", "1.02", "-2.1:2.1", "-2.1:2.1"), 640);

    say("figure 2: the oscillator over 1e5 periods", 0.05);
    Evolution oscillator = evolution(PaperSystem::oscillator, 1e5, 1, {2.50e-11, 5.45e-14, 1.35e-13});
    figures.push_back(
        {"figure2", "Figure 2: harmonic oscillator, energy error over 1e5 periods",
         "Running maxima. Above: |H − H(0)|, which is bounded. "
         "Below: the discrete energy H_d, which the exact scheme preserves; what grows is rounding (full lines: plain "
         "arithmetic in double; dotted: clean).",
         oscillator.growth,
         "Since H − H(0) is proportional to p², ten steps a period (h = 0.1) miss its maximum: the nearest fall 18° "
         "away from it. The phase "
         "error slowly moves them nearer, and the rate in the caption, 2.50e−11, is the speed of that; it ends when a "
         "step meets the maximum. With 20 "
         "and 40 steps a period one of them is there from the beginning, and the true slope is some 1e−16. The "
         "caption's rates for these "
         "steps, like ours in double arithmetic, are rounding and depend on the order of the operations."});
    write_data(folder, "figure2", oscillator.data);
    draw_figure(
        folder, "figure2",
        growth_script("figure2", "1e5", {"max |H − H(0)|", "1e-9:1e-3"}, {"max |H_d/H_d(0) − 1|", "1e-17:1e-8"}), 700);

    const double period = exact_period(PaperSystem::pendulum);
    figures.push_back({"figure3",
                       "Figure 3: nonlinear pendulum, N = 5 meshes a period, five periods",
                       "State and momentum from rest at 90°. The implicit midpoint rule and Simpson's scheme fall out "
                       "of phase; Lobatto's points stay on the exact curve. The "
                       "momentum is divided by mω.",
                       {},
                       ""});
    write_data(folder, "figure3", motion_data(PaperSystem::pendulum, period / 5, 25, 20));
    draw_figure(folder, "figure3",
                motion_script("figure3", "time t (one period 1.180)", fmt::format("{:.3f}", 5.05 * period), "-2.1:2.1",
                              "-1.9:1.9"),
                640);

    say("figure 4: the pendulum over 5000 periods", 0.5);
    Evolution pendulum =
        evolution(PaperSystem::pendulum, 5e3, 4 * std::numbers::pi_v<long double> * std::numbers::pi_v<long double>,
                  {7.99e-13, 5.39e-11, 5.33e-15});
    figures.push_back(
        {"figure4", "Figure 4: nonlinear pendulum, energy error over 5e3 periods",
         "Running maxima. Above: |H − H(0)|/(mω²): it reaches its bound within some hundred periods, once "
         "every phase of the motion has been sampled. Below: |H − H without rounding|/(mω²), beside clean "
         "steps in extended arithmetic (full lines: plain arithmetic in double; dotted: clean).",
         pendulum.growth,
         "The slope is that of a curve which has long been flat, and falls with h. The caption's rates "
         "are of another kind or unit, which the text does not give: they do not fall with h, though "
         "they would if the first two were exchanged."});
    write_data(folder, "figure4", pendulum.data);
    draw_figure(folder, "figure4",
                growth_script("figure4", "5000", {"max |H − H(0)|/(mω^2)", "1e-10:1e-4"},
                              {"rounding of H/(mω^2)", "1e-18:1e-12"}),
                700);
    return figures;
}

}  // namespace lobatto
