// SPDX-License-Identifier: MIT
// How large the numbers of a motion are, how far they move, and whether that is more than rounding.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace lobatto {

template <class real>
struct Extent {
    std::vector<real> largest, range;  // 2n, of q then p: the largest magnitude; the farthest from the start

    explicit Extent(std::size_t n) : largest(2 * n, real(0)), range(2 * n, real(0)) {}

    void take(std::size_t i, real start, real value) {
        largest[i] = std::max({largest[i], size(start), size(value)});
        range[i] = std::max(range[i], size(value - start));
    }

    // Whether one of the positions (block 0) or of the momenta (block n) moves by more than 1e-10 of what the action
    // of the motion would move it by: the radial momentum of a circular orbit does not, it is rounding.
    bool moves(std::size_t block) const {
        const std::size_t n = largest.size() / 2;
        long double action = 0;
        for (std::size_t k = 0; k < n; ++k) action = std::max(action, wide(largest[n + k]) * wide(range[k]));
        for (std::size_t k = 0; k < n; ++k) {
            const long double conjugate = wide(largest[n - block + k]);
            if (wide(range[block + k]) > (conjugate > 0 ? 1e-10L * action / conjugate : 0)) return true;
        }
        return false;
    }

private:
    static real size(real x) { return x < 0 ? -x : x; }
    static long double wide(real x) { return static_cast<long double>(x); }
};

}  // namespace lobatto
