// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/accuracy/force_rounding.hpp"

#include <algorithm>
#include <cmath>

#include "generator/mechanics/algebra/sample.hpp"

namespace lobatto {

namespace {

constexpr double vanishing = 0x1p-40;  // of the largest force on an array: on the node of a wave there is none

// dL/dq + F in 60 digits, of which differences of L leave some 20.
class ExactForce {
public:
    ExactForce(const Outline& outline, const std::vector<double>& parameters) : system_(outline.system) {
        for (std::size_t i = 0; i < parameters.size(); ++i)
            formulas_.set(system_.parameters[i], exactly(parameters[i]));
        formulas_.set(system_.t, exactly(0));
        for (const auto* symbols : {&system_.q, &system_.v})
            for (const GiNaC::symbol& symbol : *symbols) formulas_.set(symbol, exactly(0));
        lagrangian_ = formulas_.convert({system_.lagrangian});
        outer_ = formulas_.convert(system_.outer_force);
    }

    // DomainError where it is no real number.
    std::vector<cln::cl_R> at(double time, const std::vector<double>& q, const std::vector<double>& v) {
        formulas_.set(system_.t, exactly(time));
        for (std::size_t k = 0; k < q.size(); ++k) {
            formulas_.set(system_.q[k], exactly(q[k]));
            formulas_.set(system_.v[k], exactly(v[k]));
        }
        std::vector<cln::cl_R> force = formulas_.evaluate(outer_);
        for (std::size_t k = 0; k < q.size(); ++k) {
            const cln::cl_R here = exactly(q[k]), apart = exactly(q[k] == 0 ? 1e-22 : std::fabs(q[k]) * 1e-22);
            const auto lagrangian_at = [&](const cln::cl_R& place) {
                formulas_.set(system_.q[k], place);
                return formulas_.evaluate(lagrangian_).front();
            };
            force[k] = force[k] + (lagrangian_at(here + apart) - lagrangian_at(here - apart)) / (2 * apart);
            formulas_.set(system_.q[k], here);
        }
        return force;
    }

private:
    static cln::cl_R exactly(double x) { return float_of(GiNaC::numeric(x)); }

    const SystemOutline& system_;
    Formulas formulas_;
    std::vector<Id> lagrangian_, outer_;
};

}  // namespace

double force_rounding(const Outline& outline, const LoadedStepper<double>& stepper,
                      const std::vector<double>& parameters, const std::vector<std::vector<double>>& rows,
                      const std::vector<bool>& moves, const std::vector<int>& groups) {
    const std::size_t n = outline.system.q.size();
    if (n > most_looked_at || rows.empty()) return 0;
    ExactForce exact(outline, parameters);
    std::vector<std::vector<cln::cl_R>> forces;
    std::vector<double> errors(n, 0.0);
    for (const std::vector<double>& row : rows) {
        const auto middle = row.begin() + 1 + static_cast<std::ptrdiff_t>(n);
        const std::vector<double> q(row.begin() + 1, middle), p(middle, row.end());
        std::vector<double> v, Lv, Lq;
        if (stepper.velocity(row[0], q, p, v) != LOBATTO_OK) continue;
        stepper.slopes(row[0], q, v, Lv, Lq);
        if (!std::all_of(Lq.begin(), Lq.end(), [](double x) { return std::isfinite(x); })) continue;
        try {
            forces.push_back(exact.at(row[0], q, v));
        } catch (const DomainError&) {
            continue;
        }
        for (std::size_t k = 0; k < n; ++k)
            errors[k] =
                std::fmax(errors[k], std::fabs(cln::double_approx(forces.back()[k] - float_of(GiNaC::numeric(Lq[k])))));
    }
    double worst = 0;
    for (std::size_t k = 0; k < n; ++k) {
        if (!moves[k]) continue;
        // All of them together change no momentum beyond its own rounding.
        double latest = 0, momentum = 0, largest = 0, of_array = 0;
        for (const std::vector<double>& row : rows) {
            latest = std::fmax(latest, std::fabs(row[0]));
            momentum = std::fmax(momentum, std::fabs(row[1 + n + k]));
        }
        if (errors[k] * latest <= 0x1p-53 * momentum) continue;
        for (const std::vector<cln::cl_R>& force : forces)
            for (std::size_t other = 0; other < n; ++other) {
                const double size = std::fabs(cln::double_approx(force[other]));
                if (other == k) largest = std::fmax(largest, size);
                if (groups[other] == groups[k]) of_array = std::fmax(of_array, size);
            }
        if (largest < vanishing * of_array) largest = of_array;
        if (largest > 0) worst = std::fmax(worst, errors[k] / largest);
    }
    return worst;
}

}  // namespace lobatto
