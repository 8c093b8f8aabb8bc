// SPDX-License-Identifier: GPL-2.0-or-later
// Where a scene truly is whose steps are cut, at walls or where formulas are not smooth.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "analysis/tradeoff/reference.hpp"

namespace lobatto {

namespace {

// Numbers with many divisors, as in reference.cpp.
constexpr int cut_samples = 360;
constexpr int most_halvings = 14;
constexpr double still_coarse = 0.1;  // of the amplitude: steps so far off are too long to converge yet

template <class real>
class CutReference {
public:
    CutReference(const Kernel& kernel, const ExactStart& start, const ReferenceRequest& request)
        : request_(request),
          began_(std::chrono::steady_clock::now()),
          stepper_(kernel),
          start_(start_in<real>(start, kernel, static_cast<real>(request.until / cut_samples))),
          n_(start_.q.size()) {
        result_.n = n_;
        result_.compared = request.has_walls ? n_ : 2 * n_;
        result_.until = request.until;
        result_.samples = cut_samples;
        result_.precision = kernel->real_kind == LOBATTO_FLOAT128 ? Precision::quadruple : Precision::extended;
    }

    Reference compute() {
        std::vector<real> before, states;
        result_.disagreement.assign(cut_samples + 1, std::numeric_limits<double>::infinity());
        double last = 0;
        std::int64_t ratio = 1;
        bool has_arrived = false;  // any run, at the end
        for (int halving = 0; halving <= most_halvings; ++halving, ratio *= 2) {
            result_.is_late = 2.2 * last > request_.seconds_limit - elapsed();
            if (result_.is_late) break;
            const double began = elapsed();
            states = run(ratio);
            last = elapsed() - began;
            if (states.empty()) {
                before.clear();
                continue;
            }
            has_arrived = true;
            set_scale(states);
            if (!before.empty()) {
                const std::vector<double> now = difference(before, states);
                const double was = result_.disagreement.back();
                if (now.back() < was) keep(states, now, ratio);
                if (now.back() <= request_.wanted || (was < still_coarse && now.back() > was / 4)) break;
            }
            before = states;
        }
        if (result_.first.empty() && result_.is_late && has_arrived)
            throw TooSlow(fmt::format("a reference to t = {:.6g} takes longer than the {:.3g} s that the budget leaves "
                                      "for it. Give more time with --budget, or an earlier --until",
                                      request_.until, request_.seconds_limit),
                          0);
        if (result_.first.empty())
            throw ComputationError(
                "the motion cannot be followed to the end by steps however short: lobatto run says where it stops");
        look_at_motion();
        result_.seconds = elapsed();
        return std::move(result_);
    }

private:
    double elapsed() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - began_).count(); }

    // The states at all samples, q then p, by so many steps between two of them; none where one fails.
    std::vector<real> run(std::int64_t ratio) {
        const real h = static_cast<real>(request_.until) / static_cast<real>(cut_samples * ratio);
        if (stepper_.prepare(start_.parameters, h) != LOBATTO_OK || stepper_.start(0, start_.q, start_.p) != LOBATTO_OK)
            return {};
        std::vector<real> states = start_.q, q, p;
        states.insert(states.end(), start_.p.begin(), start_.p.end());
        for (int i = 0; i < cut_samples; ++i) {
            if (request_.interrupted != nullptr && *request_.interrupted != 0) throw Interrupted();
            lobatto_advance call{};
            call.steps = ratio;
            if (stepper_.advance(call) != LOBATTO_OK || call.steps_done != ratio) return {};
            real time;
            stepper_.state(time, q, p);
            states.insert(states.end(), q.begin(), q.end());
            states.insert(states.end(), p.begin(), p.end());
        }
        return states;
    }

    void set_scale(const std::vector<real>& states) {
        std::vector<double> half(2 * n_);
        for (std::size_t k = 0; k < 2 * n_; ++k) {
            real least = states[k], most = states[k];
            for (std::size_t i = k; i < states.size(); i += 2 * n_) {
                least = std::min(least, states[i]);
                most = std::max(most, states[i]);
            }
            half[k] = static_cast<double>(most - least) / 2;
        }
        result_.scale.assign(2 * n_, 0);
        for (std::size_t k = 0; k < 2 * n_; ++k)
            for (std::size_t j = 0; j < n_; ++j)
                if (request_.groups[j] == request_.groups[k % n_])
                    result_.scale[k] = std::max(result_.scale[k], half[j + k / n_ * n_]);
        for (double& value : result_.scale)
            if (!(value > 0)) value = 1;
    }

    std::vector<double> difference(const std::vector<real>& a, const std::vector<real>& b) const {
        std::vector<double> largest(cut_samples + 1);
        for (std::size_t i = 0; i < largest.size(); ++i) {
            if (i > 0) largest[i] = largest[i - 1];
            for (std::size_t k = 0; k < result_.compared; ++k) {
                const real apart = a[i * 2 * n_ + k] - b[i * 2 * n_ + k];
                const double error = std::fabs(static_cast<double>(apart)) / result_.scale[k];
                if (!(error <= largest[i])) largest[i] = error;
            }
        }
        return largest;
    }

    void keep(const std::vector<real>& states, const std::vector<double>& disagreement, std::int64_t ratio) {
        result_.high.clear();
        result_.low.clear();
        for (const real value : states) {
            result_.high.push_back(static_cast<double>(value));
            result_.low.push_back(static_cast<double>(value - static_cast<real>(result_.high.back())));
        }
        result_.disagreement = disagreement;
        result_.steps = ratio * cut_samples;
        const auto text = [&](std::int64_t steps) {
            return fmt::format("{} with {} steps in {}", stepper_.kernel()->method, steps,
                               precision_name(result_.precision));
        };
        result_.first = text(result_.steps);
        result_.second = text(result_.steps / 2);
    }

    // How fast positions go over their amplitudes, and the energy of motion.
    void look_at_motion() {
        std::vector<real> q(n_), p(n_), v;
        for (std::size_t i = 0; i <= cut_samples; ++i) {
            double product = 0;
            for (std::size_t k = 0; k < 2 * n_; ++k)
                (k < n_ ? q[k] : p[k - n_]) = static_cast<real>(result_.high[i * 2 * n_ + k]);
            if (stepper_.velocity(static_cast<real>(result_.time(static_cast<int>(i))), q, p, v) != LOBATTO_OK)
                continue;
            for (std::size_t k = 0; k < n_; ++k) {
                const auto speed = static_cast<double>(v[k]);
                product += static_cast<double>(p[k]) * speed;
                result_.frequency = std::max(result_.frequency, std::fabs(speed) / result_.scale[k]);
            }
            result_.energy_scale = std::max(result_.energy_scale, std::fabs(product) / 2);
        }
    }

    const ReferenceRequest& request_;
    std::chrono::steady_clock::time_point began_;
    LoadedStepper<real> stepper_;
    StartIn<real> start_;
    std::size_t n_;
    Reference result_;
};

}  // namespace

Reference compute_cut_reference(const Kernel& kernel, const ExactStart& start, const ReferenceRequest& request) {
    return kernel->real_kind == LOBATTO_FLOAT128 ? CutReference<__float128>(kernel, start, request).compute()
                                                 : CutReference<long double>(kernel, start, request).compute();
}

}  // namespace lobatto
