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

    // Each number is set before it is read: g++ 13 has an internal compiler error at elements that {} alone has set.
    constexpr StageCoefficients() {
        for (int i = 0; i <= m; ++i) {
            real total = real(0), of_before[s]{};
            for (int l = 0; l < s; ++l) of_before[l] = real(0);
            for (int j = 0; j < m; ++j) {
                const real entry = i < m ? K::A[i * m + j] : K::b[j + 1] * (real(1) - K::c[j + 1]);
                map[i][j] = entry;
                total = total + entry;
                for (int l = 0; l < s; ++l) of_before[l] = of_before[l] + entry * K::E[j * s + l];
            }
            sum[i] = total;
            for (int l = 0; l < s; ++l) before[i][l] = of_before[l];
        }
    }
};
template <class K, bool computed_at_start = is_many_digits<typename K::real>>
constexpr StageCoefficients<K> stage_coefficients{};
template <class K>
inline const StageCoefficients<K> stage_coefficients<K, true>{};  // MPFR is no part of the compiler

}  // namespace lobatto

#endif
