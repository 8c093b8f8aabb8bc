// SPDX-License-Identifier: MIT
#include "runtime/measure/polynomial_estimate.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace lobatto {

template <class real>
double polynomial_defect(LoadedStepper<real>& stepper, real time, const std::vector<real>& q,
                         const std::vector<real>& p, const std::vector<double>& scale) {
    static constexpr std::array places = {0.25, 0.5, 0.75};
    const double none = std::nan("");
    lobatto_advance one{};
    one.steps = 1;
    std::array<std::vector<real>, places.size()> carried;
    std::vector<real> velocity, here;
    if (stepper.start(time, q, p) != LOBATTO_OK || stepper.advance(one) != LOBATTO_OK) return none;
    for (std::size_t i = 0; i < places.size(); ++i)
        if (stepper.dense(static_cast<real>(1 + places[i]), carried[i], velocity) != LOBATTO_OK) return none;
    if (stepper.advance(one) != LOBATTO_OK) return none;
    double largest = 0;
    for (std::size_t i = 0; i < places.size(); ++i) {
        if (stepper.dense(static_cast<real>(places[i]), here, velocity) != LOBATTO_OK) return none;
        for (std::size_t k = 0; k < here.size(); ++k)
            largest = std::max(largest, std::fabs(static_cast<double>(carried[i][k] - here[k])) / scale[k]);
    }
    return largest;
}

template double polynomial_defect(LoadedStepper<float>&, float, const std::vector<float>&, const std::vector<float>&,
                                  const std::vector<double>&);
template double polynomial_defect(LoadedStepper<double>&, double, const std::vector<double>&,
                                  const std::vector<double>&, const std::vector<double>&);
template double polynomial_defect(LoadedStepper<long double>&, long double, const std::vector<long double>&,
                                  const std::vector<long double>&, const std::vector<double>&);
template double polynomial_defect(LoadedStepper<__float128>&, __float128, const std::vector<__float128>&,
                                  const std::vector<__float128>&, const std::vector<double>&);

}  // namespace lobatto
