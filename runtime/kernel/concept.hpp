// SPDX-License-Identifier: MIT
// The contract of base/contract.hpp as a concept: static_assert(lobatto::Kernel<K>) tells what a kernel written by hand
// lacks. C++20; kernels and steppers themselves are C++17 and stand without it.
#ifndef LOBATTO_KERNEL_CONCEPT_HPP
#define LOBATTO_KERNEL_CONCEPT_HPP

#include <concepts>

#include "base/contract.hpp"

namespace lobatto {

// Every kernel.
template <class K>
concept KernelOfAnyForm = requires(const typename K::Parameters& values, typename K::Parameters& p,
                                   typename K::Coefficients& k, typename K::real h) {
    { K::prepare(values, h, k) } -> std::same_as<Status>;
    { K::parameter(p, 0) } -> std::same_as<typename K::real&>;
    { K::name } -> std::convertible_to<const char*>;
    { K::digest } -> std::convertible_to<const char*>;
    { K::method } -> std::convertible_to<const char*>;
    { K::form } -> std::convertible_to<Form>;
    { K::order } -> std::convertible_to<int>;
    { K::unknowns } -> std::convertible_to<int>;
    { K::parameter_count } -> std::convertible_to<int>;
    { K::any_number } -> std::convertible_to<bool>;
    { K::autonomous } -> std::convertible_to<bool>;
    { K::has_energy } -> std::convertible_to<bool>;
    { K::has_tangent } -> std::convertible_to<bool>;
}
&&(K::coordinates > 0) && std::derived_from<K, KernelDefaults>;

// The formulas of a constant mass matrix. `k`, then the time unless the kernel is autonomous, then arrays.
template <class K, class... Time>
concept ConstantMassFormulas = requires(const typename K::Coefficients& k, Time... t, const typename K::real* in,
                                        typename K::real* out) {
    K::minus_acceleration(k, t..., in, out);
    K::node(k, t..., in, out, out);
    K::momentum(k, in, out);
    K::velocity(k, in, out);
}
&&(!K::has_energy ||
   requires(const typename K::Coefficients& k, Time... t, const typename K::real* in) {
       { K::energy(k, t..., in, in) } -> std::convertible_to<typename K::real>;
   }) &&
    (K::events == 0 || requires(const typename K::Coefficients& k, Time... t, const typename K::real* in,
                                typename K::real* out) { K::event(k, t..., in, in, out); });

// The formulas of any Lagrangian.
template <class K, class... Time>
concept GeneralFormulas = requires(const typename K::Coefficients& k, Time... t, const typename K::real* in,
                                   typename K::real* out) {
    K::node(k, t..., in, out, out);
    K::slope(k, t..., in, out);
    K::momentum(k, t..., in, in, out);
    K::legendre(k, t..., in, in, out, out);
    K::slopes(k, t..., in, in, out, out);
}
&&(!K::any_number || K::hamiltonian ||
   requires(const typename K::Coefficients& k, Time... t, const typename K::real* in, typename K::real* out) {
       K::stage(k, t..., in, in, out, out, out);
   }) &&
    (!K::hamiltonian ||
     requires(const typename K::Coefficients& k, Time... t, const typename K::real* in, typename K::real* out) {
         K::velocity(k, t..., in, in, out);
         K::force(k, t..., in, in, in, out);
     }) &&
    (!K::has_energy ||
     requires(const typename K::Coefficients& k, Time... t, const typename K::real* in) {
         { K::energy(k, t..., in, in) } -> std::convertible_to<typename K::real>;
     }) &&
    (K::events == 0 || requires(const typename K::Coefficients& k, Time... t, const typename K::real* in,
                                typename K::real* out) { K::event(k, t..., in, in, out); });

// Where unknowns stand in the equations that are solved, and the groups that are solved by themselves.
template <class K>
concept OrderOfUnknowns = requires {
    K::position[0];
    K::group_first[K::group_count];
    K::group_bandwidth[K::group_count - 1];
};

template <class K>
concept LinearMapKernel = KernelOfAnyForm<K> && K::form ==
                          Form::linear_map&& K::autonomous&& ConstantMassFormulas<K>&& requires(
                              const typename K::Coefficients& k, const typename K::real* in, typename K::real* out) {
    K::propagate(k, in, in, out, out);
};

template <class K>
concept SeparableKernel = KernelOfAnyForm<K> && K::form == Form::separable &&
                          (K::autonomous ? ConstantMassFormulas<K>
                                         : ConstantMassFormulas<K, typename K::real>)&&requires {
    { K::uses_hessian } -> std::convertible_to<bool>;
    { K::entries } -> std::convertible_to<int>;
    K::entry_row[0];
    K::entry_column[0];
    K::c[K::points - 1];
    K::b[K::points - 1];
}
&&(K::is_explicit ? requires { K::drift_length[K::points - 2]; }
                  : (K::unknowns == K::coordinates * (K::points - 2) && OrderOfUnknowns<K> &&
                     requires {
                         K::A[0];
                         K::E[0];
                     })) &&
    (!(K::absorbed || K::diagonal_part) ||
     requires(const typename K::Coefficients& k, typename K::real* out) { K::quadratic_part(k, out); });

template <class K>
concept GeneralKernel = KernelOfAnyForm<K> && K::form == Form::general&& OrderOfUnknowns<K> &&
                        (K::autonomous ? GeneralFormulas<K> : GeneralFormulas<K, typename K::real>)&&K::active
                                + K::cyclic
                            == K::coordinates&& requires {
    K::active_index[0];
    K::cyclic_index[0];
    { K::entries } -> std::convertible_to<int>;
    K::entry_row[0];
    K::entry_column[0];
    { K::mass_entries } -> std::convertible_to<int>;
    K::mass_row[0];
    K::mass_column[0];
    K::c[K::nodes - 1];
    K::b[K::nodes - 1];
    K::control[K::controls - 1];
    K::B[K::nodes * K::controls - 1];
    K::D[K::nodes * K::controls - 1];
    K::extrapolation[K::controls * K::controls - 1];
    K::legendre_polynomial[0];
}
&&(!K::any_number || requires {
    K::integration[K::nodes * K::nodes - 1];
    K::reach[(K::controls - 1) * K::nodes - 1];
    K::ahead[K::nodes * K::nodes - 1];
});

template <class K>
concept Kernel = LinearMapKernel<K> || SeparableKernel<K> || GeneralKernel<K>;

}  // namespace lobatto

#endif
