// SPDX-License-Identifier: MIT
// A function of the motion, sampled over a step: whether it comes near zero between its samples, where |g| is least,
// and where its sign changes.
#ifndef LOBATTO_KERNEL_SAMPLED_FUNCTION_HPP
#define LOBATTO_KERNEL_SAMPLED_FUNCTION_HPP

#include "../base/contract.hpp"
#include "../base/numbers.hpp"
#include "../base/pack.hpp"

namespace lobatto {

// Of |g| at equal distances, y[0] ... y[pieces], least around place i: whether g is zero nowhere near. It is so where
// all of y is of one size, and second differences vary by less than a factor of two, so that nothing narrow is there:
// a parabola falls between its samples by an eighth of what these differ by. For numbers, or Packs of them.
template <int pieces, class T>
LOBATTO_DEVICE inline auto is_no_dip(const T* y, int i, const T& largest) {
    using real = real_of<T>;
    const int middle = i < 2 ? 2 : i > pieces - 2 ? pieces - 2 : i;
    const auto bend = [&](int j) { return y[j - 1] - T(real(2)) * y[j] + y[j + 1]; };
    const T here = bend(middle), before = bend(middle - 1), after = bend(middle + 1), half = T(real(0.5)) * here;
    const auto is_large = y[i] >= T(real(0.5)) * largest, above_before = half < before, above_after = half < after,
               below_before = before < here + here, below_after = after < here + here;
    return is_large & above_before & above_after & below_before & below_after;
}

// One function of the motion, sampled over a step.
template <class real>
struct SampledFunction {
    static constexpr real rounding = real(2) * Limits<real>::epsilon;

    struct Sample {
        real theta, value;
        bool is_exact;
    };

    static bool has_sign(real value) { return is_finite(value) && value != real(0); }
    static bool changes(real a, real b) { return has_sign(a) && has_sign(b) && (a > real(0)) != (b > real(0)); }

    // From a sample where g is defined towards a place where it is not: the last sample before its domain ends, or one
    // where its sign has changed.
    template <class G>
    static Sample last_defined(Sample inside, real outside, const G& g) {
        const real start = inside.value;
        while (fabs(outside - inside.theta) > rounding && !changes(inside.value, start)) {
            const real middle = real(0.5) * (inside.theta + outside), value = g(middle);
            if (is_finite(value))
                inside = {middle, value, inside.is_exact};
            else
                outside = middle;
        }
        return inside;
    }

    // The least |g| between a and b by golden sections, or the first place found where the sign is another.
    template <class G>
    static Sample least_between(const Sample& a, Sample middle, const Sample& b, const G& g) {
        real low = a.theta, high = b.theta;
        for (int i = 0; i < 48 && !changes(middle.value, a.value) && high - low > Limits<real>::root_epsilon; ++i) {
            const bool is_above = high - middle.theta > middle.theta - low;
            const real theta = middle.theta + real(0.381966) * (is_above ? high - middle.theta : low - middle.theta);
            const real value = g(theta);
            if (changes(value, a.value) || fabs(value) < fabs(middle.value)) {
                (is_above ? low : high) = middle.theta;
                middle = {theta, value, middle.is_exact};
            } else {
                (is_above ? high : low) = theta;
            }
        }
        return middle;
    }

    // The root between a and b, to the rounding of theta: secants, with the value of an end that stays halved (the
    // Illinois method), and every third time the middle. Where g grows, or changes at once, its sign changes at a pole,
    // or where it jumps: that is a root if it `may_jump`, beyond the jump.
    template <class G>
    static real root_between(Sample a, Sample b, bool may_jump, bool& is_root, const G& g) {
        const real largest = maximum(fabs(b.value), fabs(a.value));
        const real change = fabs(b.value - a.value);
        const bool may_tell = b.theta - a.theta > real(16) * rounding;
        Sample nearest = fabs(a.value) < fabs(b.value) ? a : b;
        real weight_a = real(1), weight_b = real(1);
        int stays = 0;  // the end that the last secant left in place: -1 is a, 1 is b
        for (int iteration = 1; b.theta - a.theta > rounding; ++iteration) {
            const real left = weight_a * a.value, right = weight_b * b.value;
            const real middle = a.theta + real(0.5) * (b.theta - a.theta);
            real theta = iteration % 3 == 0 ? middle : b.theta - right * ((b.theta - a.theta) / (right - left));
            if (theta < a.theta + rounding) theta = a.theta + rounding;
            if (theta > b.theta - rounding) theta = b.theta - rounding;
            if (!(theta > a.theta && theta < b.theta)) theta = middle;
            const Sample there{theta, g(theta), true};
            if (!is_finite(there.value)) break;
            nearest = there;
            if (there.value == real(0)) break;
            if (changes(there.value, a.value)) {
                b = there;
                weight_b = real(1);
                weight_a = stays == -1 ? real(0.5) * weight_a : real(1);
                stays = -1;
            } else {
                a = there;
                weight_a = real(1);
                weight_b = stays == 1 ? real(0.5) * weight_b : real(1);
                stays = 1;
            }
        }
        const bool jumps = may_tell && nearest.value != real(0) && fabs(b.value - a.value) > real(0.5) * change;
        is_root = is_finite(nearest.value) && ((fabs(nearest.value) <= largest && !jumps) || may_jump);
        const bool is_before = nearest.value != real(0) && !changes(nearest.value, a.value);
        return may_jump && (jumps || is_before) ? b.theta : nearest.theta;
    }
};

}  // namespace lobatto

#endif
