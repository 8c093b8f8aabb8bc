// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/tradeoff/reference.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "runtime/measure/extrapolation.hpp"
#include "runtime/measure/frequency.hpp"
#include "runtime/stopwatch.hpp"

namespace lobatto {

namespace {

// Numbers with many divisors, so that many numbers of steps meet many of the samples.
constexpr int sample_counts[] = {2520, 840, 360, 120, 60};
constexpr double rough = 1e-6;            // tolerance of the first look
constexpr double fine = 1e-15;            // likewise, where something hardly moves
constexpr double held = 1000;             // tolerances: as much is left to what rests
constexpr double precise_factor = 6;      // what the precise way takes longer, at most, about
constexpr double half = 0.5;              // of the seconds, for a first way; the rest is for finer steps
constexpr double overtime = 1.25;         // of the seconds: then it is given up
constexpr double radians_of_step = 0.75;  // h omega of the family's first run
constexpr int most_refinements = 12;
constexpr double near = 0.1;       // of the amplitude: steps so far off are too long to converge yet
constexpr double far_dearer = 2;   // times the seconds of an extrapolation: steps of the family take too long
constexpr double loosest = 1e-10;  // where they still agree in all digits, nothing moves
constexpr double looser = 100;     // tolerance of the second extrapolation, of the first's
// At how many places, after the first, the frequency is looked at.
int frequency_looks(std::size_t n) {
    return n <= 8 ? 120 : n <= 64 ? 24 : 2;
}

// Below what is wanted by more than the macro steps add up to; in quadruple precision down to its rounding.
double tolerance_for(Precision precision, double wanted) {
    return precision == Precision::quadruple ? std::clamp(1e-4 * wanted, 1e-32, 1e-22) : 3e-17;
}

template <class real>
class Computation {
public:
    Computation(const Kernel& kernel, const ExactStart& start, const ReferenceRequest& request)
        : kernel_(kernel), request_(request), stepper_(kernel) {
        n_ = static_cast<std::size_t>(kernel->coordinates);
        const auto step = static_cast<real>(request.until / 1000);
        start_ = start_in<real>(start, kernel, step);
        stepper_.prepare(start_.parameters, step);
        reference_.n = n_;
        reference_.compared = 2 * n_;
        reference_.until = request.until;
        reference_.precision = kernel->real_kind == LOBATTO_FLOAT128 ? Precision::quadruple : Precision::extended;
    }

    Reference compute() {
        observe();
        const double tolerance = tolerance_for(reference_.precision, request_.wanted);
        reference_.tolerance = tolerance;
        const Stopwatch watch;
        const auto states = extrapolate(reference_.samples, static_cast<real>(tolerance), false);
        if (!states) throw ComputationError("the reference fails: its steps become too short");
        const double took = watch.seconds();
        keep(*states);
        reference_.disagreement.assign(static_cast<std::size_t>(reference_.samples) + 1,
                                       std::numeric_limits<double>::infinity());
        compare(*states, took);
        if (reference_.disagreement.back() > request_.wanted) compare_with_looser(*states, looser * tolerance, took);
        if (reference_.first.empty() && reference_.is_late) fail_slow(covered_);
        if (reference_.first.empty())
            throw ComputationError("the reference fails: the steps of " + std::string(kernel_->method) +
                                   " do not converge on this motion, however short");
        reference_.seconds = watch_.seconds();
        return std::move(reference_);
    }

private:
    using States = std::vector<real>;  // (samples + 1) x 2n

    void check_interruption() const {
        if (request_.interrupted != nullptr && *request_.interrupted != 0) throw Interrupted();
    }

    // For every group of coordinates one value, spread over its members.
    template <class Value>
    void spread(const Value& value, std::vector<real>& all) const {
        for (const std::size_t part : {std::size_t(0), n_}) {
            for (std::size_t k = 0; k < n_; ++k) {
                real largest = 0;
                for (std::size_t j = 0; j < n_; ++j)
                    if (request_.groups[j] == request_.groups[k]) largest = std::max(largest, value(part + j));
                all[part + k] = largest;
            }
        }
    }

    // With a rough tolerance: how far the motion goes, how fast it changes, how long a reference takes.
    void observe() {
        std::vector<real> v, Lv, Lq;
        if (stepper_.velocity(0, start_.q, start_.p, v) != LOBATTO_OK)
            throw ComputationError("the formulas have no value at the start");
        stepper_.slopes(0, start_.q, v, Lv, Lq);
        scale_.assign(2 * n_, real(1));
        const auto way = static_cast<real>(request_.until);
        spread(
            [&](std::size_t i) {
                const real at_start = i < n_ ? start_.q[i] : start_.p[i - n_], rate = i < n_ ? v[i] : Lq[i - n_];
                const real position = at_start < 0 ? -at_start : at_start, move = (rate < 0 ? -rate : rate) * way;
                return std::max(position, std::min(move, real(1)));
            },
            scale_);
        for (real& value : scale_)
            if (!(value > real(1e-6))) value = real(1);
        const int samples = sample_counts[std::size(sample_counts) - 2];
        const Stopwatch watch;
        auto states = extrapolate(samples, static_cast<real>(rough), true);
        if (states && hardly_moves_) states = extrapolate(samples, static_cast<real>(fine), true);
        if (!states)
            throw ComputationError(
                "the motion cannot be followed to the end: it runs into a singularity, or away to infinity");
        const double seconds = watch.seconds();
        set_frequency(*states, samples);
        // At least one macro step of some twenty slopes a sample.
        const double at_least = 40 * seconds / static_cast<double>(std::max<std::int64_t>(evaluations_, 1));
        const double step = step_seconds(), fewest = request_.until / static_cast<double>(step_of_family());
        double least = 0;
        // By steps of the family; or, where these resolve a close encounter and so are far too many, by extrapolation.
        for (const bool is_by_steps : {true, false})
            for (const int count : sample_counts) {
                const double way = std::max(precise_factor * seconds, at_least * count);
                least = way + (is_by_steps ? step * std::max(fewest, double(count)) : way);
                reference_.samples = count;
                if (least < half * request_.seconds_limit) return;
            }
        if (least > 1.5 * request_.seconds_limit) fail_slow(request_.until * request_.seconds_limit / least);
    }

    [[noreturn]] void fail_slow(double reached) const {
        throw TooSlow(
            fmt::format("a reference to t = {:.6g} takes longer than the {:.3g} s that the budget leaves for it; "
                        "it would do to about t = {:.2g}. Give more time with --budget, or an earlier --until",
                        request_.until, request_.seconds_limit, reached),
            reached);
    }

    // Of one step of the kernel.
    double step_seconds() {
        if (stepper_.prepare(start_.parameters, step_of_family()) != LOBATTO_OK ||
            stepper_.start(0, start_.q, start_.p) != LOBATTO_OK)
            return 0;
        lobatto_advance call{};
        call.steps = 2;
        const Stopwatch watch;
        stepper_.advance(call);
        return watch.seconds() / static_cast<double>(call.steps);
    }

    real step_of_family() const {
        const double h = reference_.frequency > 0 ? radians_of_step / reference_.frequency : request_.until;
        return static_cast<real>(std::min(h, request_.until));
    }

    std::optional<States> extrapolate(int samples, real tolerance, bool quick) {
        Extrapolation<real> way(stepper_, scale_, tolerance);
        way.start(0, start_.q, start_.p);
        States states = way.state();
        states.reserve(static_cast<std::size_t>(samples + 1) * 2 * n_);
        way.set_watch([&] {
            check_interruption();
            if (watch_.seconds() > (quick ? half : overtime) * request_.seconds_limit)
                fail_slow(static_cast<double>(way.time()) / (quick ? precise_factor : 1));
        });
        for (int i = 1; i <= samples; ++i) {
            if (!way.advance_to(static_cast<real>(request_.until) * real(i) / real(samples))) return std::nullopt;
            states.insert(states.end(), way.state().begin(), way.state().end());
        }
        evaluations_ = way.evaluations();
        if (quick) set_scale(way.least(), way.most(), tolerance);
        return states;
    }

    // On all of the way: samples may miss a close encounter. What moves by no more than the tolerance leaves to a
    // number of its size, or to what constraints hold, may rest: a finer look tells. Then its size counts.
    void set_scale(const std::vector<real>& least, const std::vector<real>& most, real tolerance) {
        spread([&](std::size_t i) { return (most[i] - least[i]) / 2; }, scale_);
        hardly_moves_ = false;
        std::vector<real> places(2 * n_, real(0)), sizes(2 * n_);
        if (!request_.places.empty())
            spread([&](std::size_t i) { return static_cast<real>(request_.places[i]); }, places);
        spread([&](std::size_t i) { return std::max(-least[i], most[i]); }, sizes);
        const real small = static_cast<real>(held) * tolerance;
        for (std::size_t i = 0; i < 2 * n_; ++i) {
            const real size = std::max(i < n_ ? places[i] : real(0), sizes[i]);
            if (!(size > 0 && scale_[i] <= small * size)) continue;
            hardly_moves_ = true;
            scale_[i] = size;
            if (i < n_ && places[i] > 0) scale_[n_ + i] = 1;
        }
        for (real& value : scale_)
            if (!(value > 0)) value = 1;
    }

    void set_frequency(const States& states, int samples) {
        const std::vector<double> scale(scale_.begin(), scale_.end());
        std::vector<double> met;
        const int looks = frequency_looks(n_);
        for (int look = 0; look <= looks; ++look) {
            const int i = samples * look / looks;
            const real* const row = states.data() + static_cast<std::size_t>(i) * 2 * n_;
            const std::vector<real> q(row, row + n_), p(row + n_, row + 2 * n_);
            const auto time = static_cast<real>(request_.until * i / samples);
            const double frequency = largest_frequency(stepper_, time, q, p, scale);
            if (frequency > reference_.frequency) reference_.frequency = frequency;
            met.push_back(frequency >= 0 ? frequency : 0);  // else none is known
            if (look == 0 && frequency > 0) reference_.frequency_at_start = frequency;
            std::vector<real> v;
            if (stepper_.velocity(time, q, p, v) != LOBATTO_OK) continue;
            // With constraints: what moves over its amplitude so fast.
            for (std::size_t k = 0; k < n_ && kernel_->constraints > 0; ++k)
                reference_.frequency = std::max(reference_.frequency, std::fabs(static_cast<double>(v[k])) / scale[k]);
            real product = 0;
            for (std::size_t k = 0; k < n_; ++k) product += p[k] * v[k];
            reference_.energy_scale = std::max(reference_.energy_scale, std::fabs(static_cast<double>(product)) / 2);
        }
        const auto middle = met.begin() + static_cast<std::ptrdiff_t>(met.size() / 2);
        std::nth_element(met.begin(), middle, met.end());
        reference_.usual_frequency = *middle;
    }

    void keep(const States& states) {
        for (const real value : states) {
            reference_.high.push_back(static_cast<double>(value));
            reference_.low.push_back(static_cast<double>(value - static_cast<real>(reference_.high.back())));
        }
        for (const real value : scale_) reference_.scale.push_back(static_cast<double>(value));
    }

    // The largest difference up to each sample, of states that `at(i)` gives; nothing when it gives none.
    template <class At>
    std::optional<std::vector<double>> largest_differences(const States& states, const At& at) const {
        std::vector<double> largest{0};
        for (int i = 1; i <= reference_.samples; ++i) {
            const std::vector<real>* const there = at(i);
            if (there == nullptr) return std::nullopt;
            double worst = largest.back();
            for (std::size_t k = 0; k < 2 * n_; ++k) {
                const real difference = (*there)[k] - states[static_cast<std::size_t>(i) * 2 * n_ + k];
                const double error = std::fabs(static_cast<double>(difference / scale_[k]));
                if (!(error <= worst)) worst = error;
            }
            largest.push_back(worst);
        }
        return largest;
    }

    // The family's own way with `ratio` steps between two samples; nothing when a step fails, or after `limit` seconds,
    // which is told by is_late.
    std::optional<std::vector<double>> disagreement_with(const States& states, std::int64_t ratio, double limit) {
        const int samples = reference_.samples;
        const real h = static_cast<real>(request_.until) / static_cast<real>(samples * ratio);
        if (stepper_.prepare(start_.parameters, h) != LOBATTO_OK || stepper_.start(0, start_.q, start_.p) != LOBATTO_OK)
            return std::nullopt;
        const Stopwatch watch;
        std::vector<real> row, p;
        return largest_differences(states, [&](int) -> const std::vector<real>* {
            check_interruption();
            lobatto_advance call{};
            call.steps = ratio;
            if (stepper_.advance(call) != LOBATTO_OK) return nullptr;
            real time;
            stepper_.state(time, row, p);
            covered_ = static_cast<double>(time);
            reference_.is_late = watch.seconds() > limit;
            if (reference_.is_late) return nullptr;
            row.insert(row.end(), p.begin(), p.end());
            return &row;
        });
    }

    // With shorter and shorter steps of the family, in the seconds that are left beside those of a second
    // extrapolation.
    void compare(const States& states, double extrapolation_seconds) {
        const double interval = request_.until / reference_.samples;
        auto ratio = static_cast<std::int64_t>(std::ceil(interval / static_cast<double>(step_of_family())));
        double last = 0;
        const double expected = step_seconds() * static_cast<double>(ratio * reference_.samples);
        reference_.is_late = expected > far_dearer * std::fmax(extrapolation_seconds, request_.seconds_limit / 4);
        if (reference_.is_late) return;
        for (int refinement = 0; refinement <= most_refinements; ++refinement, ratio *= 2) {
            const double left = request_.seconds_limit - watch_.seconds() - extrapolation_seconds;
            reference_.is_late = refinement > 0 && 2 * last > left;
            if (reference_.is_late) break;
            const Stopwatch watch;
            const auto measured =
                disagreement_with(states, ratio, std::fmax(left, request_.seconds_limit * (overtime - 1)));
            last = watch.seconds();
            const double before = reference_.disagreement.back();
            if (!measured && reference_.is_late) break;
            const double now = measured ? measured->back() : std::numeric_limits<double>::infinity();
            if (now < before)
                agree(*measured, fmt::format("{} with {} steps in {}", kernel_->method, ratio * reference_.samples,
                                             precision_name(reference_.precision)));
            if (now <= request_.wanted || (before < near && now > before / 4)) break;
        }
    }

    // Equal steps of the family that resolve a close encounter may take too long: the same extrapolation, less precise,
    // until it is another one.
    void compare_with_looser(const States& states, double tolerance, double extrapolation_seconds) {
        if (watch_.seconds() + extrapolation_seconds > overtime * request_.seconds_limit) return;
        std::optional<States> others;
        try {
            others = extrapolate(reference_.samples, static_cast<real>(tolerance), false);
        } catch (const TooSlow&) {
        }
        if (!others) return;
        std::vector<real> row(2 * n_);
        const auto measured = largest_differences(states, [&](int i) {
            const auto begin = others->begin() + static_cast<std::ptrdiff_t>(static_cast<std::size_t>(i) * 2 * n_);
            std::copy(begin, begin + std::ssize(row), row.begin());
            return &row;
        });
        if (measured && measured->back() == 0 && tolerance < loosest)
            return compare_with_looser(states, looser * tolerance, extrapolation_seconds);
        reference_.is_late = false;
        if (measured && measured->back() < reference_.disagreement.back())
            agree(*measured, fmt::format("explicit extrapolation to {:.0e} a step in {}", tolerance,
                                         precision_name(reference_.precision)));
    }

    void agree(std::vector<double> disagreement, std::string way) {
        reference_.disagreement = std::move(disagreement);
        reference_.first = std::move(way);
        reference_.second = "explicit extrapolation in " + precision_name(reference_.precision);
    }

    Kernel kernel_;
    const ReferenceRequest& request_;
    Stopwatch watch_;
    LoadedStepper<real> stepper_;
    std::size_t n_ = 0;
    StartIn<real> start_;
    std::vector<real> scale_;
    bool hardly_moves_ = false;
    std::int64_t evaluations_ = 0;
    double covered_ = 0;  // the time that the family's last way came to
    Reference reference_;
};

}  // namespace

double Reference::trusted_until(double error) const {
    for (int i = samples; i > 0; --i)
        if (disagreement[static_cast<std::size_t>(i)] < error) return time(i);
    return 0;
}

Reference compute_reference(const Kernel& kernel, const ExactStart& start, const ReferenceRequest& request) {
    if (request.is_cut) return compute_cut_reference(kernel, start, request);
    return kernel->real_kind == LOBATTO_FLOAT128 ? Computation<__float128>(kernel, start, request).compute()
                                                 : Computation<long double>(kernel, start, request).compute();
}

}  // namespace lobatto
