// SPDX-License-Identifier: MIT
#include "runtime/measure/extrapolation.hpp"

#include <algorithm>
#include <cmath>

namespace lobatto {

namespace {

constexpr int most_columns = 14, few_columns = 7;
constexpr double shortest = 1e-9;  // macro step, relative to the way asked for

template <class real>
real size(real x) {
    return x < 0 ? -x : x;
}

}  // namespace

template <class real>
Extrapolation<real>::Extrapolation(LoadedStepper<real> stepper, std::vector<real> scale, real tolerance)
    : stepper_(std::move(stepper)),
      scale_(std::move(scale)),
      tolerance_(tolerance),
      n_(scale_.size() / 2),
      f0_(2 * n_),
      table_(most_columns, std::vector<real>(2 * n_)) {}

template <class real>
void Extrapolation<real>::start(real time, const std::vector<real>& q, const std::vector<real>& p) {
    time_ = time;
    y_ = q;
    y_.insert(y_.end(), p.begin(), p.end());
    longest_ = 0;
    least_ = most_ = y_;
}

template <class real>
bool Extrapolation<real>::slope(real time, const std::vector<real>& y, std::vector<real>& f) {
    const auto middle = y.begin() + static_cast<std::ptrdiff_t>(n_);
    q_.assign(y.begin(), middle);
    p_.assign(middle, y.end());
    ++evaluations_;
    if (stepper_.velocity(time, q_, p_, v_) != LOBATTO_OK) return false;
    stepper_.slopes(time, q_, v_, Lv_, Lq_);
    if (stepper_.kernel()->constraints > 0) {
        if (stepper_.multipliers(time, q_, p_, lambda_) != LOBATTO_OK) return false;
        stepper_.constraint(time, q_, phi_, phi_t_, G_);
        for (std::size_t c = 0; c < lambda_.size(); ++c)
            for (std::size_t k = 0; k < n_; ++k) Lq_[k] += lambda_[c] * G_[c * n_ + k];
    }
    std::copy(v_.begin(), v_.end(), f.begin());
    std::copy(Lq_.begin(), Lq_.end(), f.begin() + static_cast<std::ptrdiff_t>(n_));
    return true;
}

// y_{i+1} = y_{i-1} + 2 h f(y_i), begun by Euler's step.
template <class real>
bool Extrapolation<real>::midpoint(real H, int substeps, std::vector<real>& end) {
    const real h = H / real(substeps);
    std::vector<real> before = y_, f = f0_;
    end = y_;
    for (std::size_t k = 0; k < end.size(); ++k) end[k] += h * f[k];
    for (int i = 1; i < substeps; ++i) {
        if (!slope(time_ + real(i) * h, end, f)) return false;
        for (std::size_t k = 0; k < end.size(); ++k) before[k] += 2 * h * f[k];
        std::swap(before, end);
    }
    return true;
}

// Row j of the table by Aitken and Neville, in place: table[j - k] becomes T_{j, k}.
template <class real>
bool Extrapolation<real>::macro_step(real H) {
    if (!slope(time_, y_, f0_)) return false;
    real best = -1;
    for (int j = 0; j < most_columns; ++j) {
        const int substeps = 2 * (j + 1);
        if (!midpoint(H, substeps, table_[static_cast<std::size_t>(j)])) return false;
        real change = 0;
        for (int k = 1; k <= j; ++k) {
            const real ratio = real(substeps) / real(2 * (j - k + 1)), denominator = ratio * ratio - 1;
            std::vector<real>& lower = table_[static_cast<std::size_t>(j - k)];
            const std::vector<real>& upper = table_[static_cast<std::size_t>(j - k + 1)];
            change = 0;
            for (std::size_t i = 0; i < lower.size(); ++i) {
                const real next = upper[i] + (upper[i] - lower[i]) / denominator;
                change = std::max(change, size(next - upper[i]) / scale_[i]);
                if (!(size(next) < real(1e300))) return false;
                lower[i] = next;
            }
        }
        if (j < 2) continue;
        if (change <= tolerance_) {
            y_ = table_.front();
            time_ += H;
            columns_ = j + 1;
            return true;
        }
        // Columns that bring nothing: the step is far too long, or all is rounding.
        if (j > few_columns && best >= 0 && change > best) return false;
        if (best < 0 || change < best) best = change;
    }
    return false;
}

template <class real>
bool Extrapolation<real>::advance_to(real time) {
    const real way = time - time_;
    if (longest_ == real(0)) longest_ = way;
    while (time_ < time) {
        if (watch_) watch_();
        const real left = time - time_;
        // Equal parts of what is left.
        const auto parts = std::max<std::int64_t>(
            1, static_cast<std::int64_t>(std::ceil(static_cast<double>(left / longest_) * (1 - 1e-12))));
        const real H = left / real(parts);
        if (macro_step(H)) {
            if (parts == 1) time_ = time;
            for (std::size_t i = 0; i < y_.size(); ++i) {
                least_[i] = std::min(least_[i], y_[i]);
                most_[i] = std::max(most_[i], y_[i]);
            }
            if (columns_ <= few_columns) longest_ = 2 * H;
        } else {
            longest_ = H / 2;
            if (!(longest_ > way * real(shortest))) return false;
        }
    }
    return true;
}

template class Extrapolation<double>;
template class Extrapolation<long double>;
template class Extrapolation<__float128>;

}  // namespace lobatto
