// SPDX-License-Identifier: MIT
// The numbers of the stage map that do not depend on the step size, from a kernel's tables c, b, A and E: what all
// iterations of systems with constant mass are made of. Formula numbers (D..) refer to docs/derivation.md.
#ifndef LOBATTO_KERNEL_STAGE_COEFFICIENTS_HPP
#define LOBATTO_KERNEL_STAGE_COEFFICIENTS_HPP

#include "../base/numbers.hpp"

namespace lobatto {

// Rows: the inner nodes, for the stages (D12), then the end of the step (D16). Columns: of `map` and its row sums the
// inner nodes, of `before` the nodes of the step before, whose accelerations are extrapolated (D15).
template <class K>
struct StageCoefficients {
    using real = typename K::real;
    static constexpr int s = K::points, m = s - 2, columns = m > 0 ? m : 1;
    real map[m + 1][columns]{}, before[m + 1][s]{}, sum[m + 1]{};

    constexpr StageCoefficients() {
        for (int i = 0; i <= m; ++i)
            for (int j = 0; j < m; ++j) {
                map[i][j] = i < m ? K::A[i * m + j] : K::b[j + 1] * (real(1) - K::c[j + 1]);
                sum[i] += map[i][j];
                for (int l = 0; l < s; ++l) before[i][l] += map[i][j] * K::E[j * s + l];
            }
    }
};
template <class K, bool computed_at_start = is_many_digits<typename K::real>>
constexpr StageCoefficients<K> stage_coefficients{};
template <class K>
inline const StageCoefficients<K> stage_coefficients<K, true>{};  // MPFR is no part of the compiler

}  // namespace lobatto

#endif
