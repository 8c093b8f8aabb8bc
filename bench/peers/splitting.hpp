// SPDX-License-Identifier: GPL-2.0-or-later
// Explicit symplectic methods for q'' = a(q): alternate drifts q += h a_i p and kicks p += h b_i a(q), symmetric.
#pragma once

#include <array>

#include "bench/problems.hpp"

namespace lobatto::bench {

// `stages` kicks a step once the last map of a step is joined with the first of the next. `outer` are the coefficients
// of the map that begins and ends a step (stages + 1), `inner` those of the other (stages).
template <int stages>
struct SplittingTable {
    int order;
    bool kick_first;
    std::array<__float128, stages + 1> outer;
    std::array<__float128, stages> inner;
};

// A palindrome from its first half, as the papers list it; the middle completes the sum to 1.
template <std::size_t length, std::size_t half>
constexpr std::array<__float128, length> palindrome(const std::array<const char*, half>& listed) {
    static_assert(2 * half + 1 == length || 2 * half + 2 == length);
    std::array<__float128, length> all{};
    __float128 rest = 1;
    for (std::size_t i = 0; i < half; ++i) {
        all[i] = all[length - 1 - i] = exact(listed[i]);
        rest -= 2 * all[i];
    }
    const bool odd = length % 2 == 1;
    all[half] = odd ? rest : rest / 2;
    all[length - 1 - half] = all[half];
    return all;
}

// Composition of Verlet steps (drift, kick, drift) of lengths g_1 h ... g_m h.
template <std::size_t stages>
constexpr SplittingTable<stages> composed(int order, const std::array<__float128, stages>& lengths) {
    SplittingTable<stages> table{order, false, {}, lengths};
    for (std::size_t i = 0; i < stages; ++i) {
        table.outer[i] += lengths[i] / 2;
        table.outer[i + 1] += lengths[i] / 2;
    }
    return table;
}

inline constexpr SplittingTable<1> stoermer_verlet = composed<1>(2, {1});

// S. Blanes, P. C. Moan, Practical symplectic partitioned Runge-Kutta and Runge-Kutta-Nystroem methods, J. Comput.
// Appl. Math. 142 (2002) 313-330, table 3: SRKN_11^b and SRKN_14^a, order 6.
inline constexpr SplittingTable<11> blanes_moan_11{
    6, true,
    palindrome<12>(std::array{"0.0414649985182624", "0.198128671918067", "-0.0400061921041533", "0.0752539843015807",
                              "-0.0115113874206879"}),
    palindrome<11>(std::array{"0.123229775946271", "0.290553797799558", "-0.127049212625417", "-0.246331761062075",
                              "0.357208872795928"})};
inline constexpr SplittingTable<14> blanes_moan_14{
    6, false,
    palindrome<15>(std::array{"0.0378593198406116", "0.102635633102435", "-0.0258678882665587", "0.314241403071447",
                              "-0.130144459517415", "0.106417700369543", "-0.00879424312851058"}),
    palindrome<14>(std::array{"0.09171915262446165", "0.183983170005006", "-0.05653436583288827",
                              "0.004914688774712854", "0.143761127168358", "0.328567693746804"})};

// W. Kahan, R.-C. Li, Composition constants for raising the orders of unconventional schemes for ordinary differential
// equations, Math. Comp. 66 (1997) 1089-1099: 17 stages, order 8.
inline constexpr SplittingTable<17> kahan_li_8 =
    composed(8, palindrome<17>(std::array{"0.13020248308889008087881763", "0.56116298177510838456196441",
                                          "-0.38947496264484728640807860", "0.15884190655515560089621075",
                                          "-0.39590389413323757733623154", "0.18453964097831570709183254",
                                          "0.25837438768632204729397911", "0.29501172360931029887096624"}));

// M. Sofroniou, G. Spaletta, Derivation of symmetric composition constants for symmetric integrators, Optim. Methods
// Softw. 20 (2005) 597-613: 35 stages, order 10.
inline constexpr SplittingTable<35> sofroniou_spaletta_10 = composed(
    10, palindrome<35>(std::array{"0.078795722521686419263907679337684", "0.31309610341510852776481247192647",
                                  "0.027918383235078066109520273275299", "-0.22959284159390709415121339679655",
                                  "0.13096206107716486317465685927961", "-0.26973340565451071434460973222411",
                                  "0.074973343155891435666137105641410", "0.11199342399981020488957508073640",
                                  "0.36613344954622675119314812353150", "-0.39910563013603589787862981058340",
                                  "0.10308739852747107731580277001372", "0.41143087395589023782070411897608",
                                  "-0.0048663605831352617621956593099771", "-0.39203335370863990644808193642610",
                                  "0.051942502962449647037182904015976", "0.050665090759924496335874344156866",
                                  "0.049674370639729879054568800279461"}));

// `steps` steps of length h; the state holds the end. Evaluations of the acceleration are returned.
template <const auto& table, class Problem, class real>
long integrate_splitting(State<real, Problem::coordinates>& state, real h, long steps) {
    constexpr int n = Problem::coordinates, stages = static_cast<int>(table.inner.size());
    constexpr bool kick_first = table.kick_first;
    std::array<real, stages + 1> outer;
    std::array<real, stages> inner;
    for (int i = 0; i <= stages; ++i) outer[i] = h * static_cast<real>(table.outer[i]);
    for (int i = 0; i < stages; ++i) inner[i] = h * static_cast<real>(table.inner[i]);
    real q[n], p[n], a[n];
    for (int k = 0; k < n; ++k) q[k] = state.q[k], p[k] = state.p[k];
    const auto drift = [&](real length) {
        for (int k = 0; k < n; ++k) q[k] += length * p[k];
    };
    const auto kick = [&](real length) {
        for (int k = 0; k < n; ++k) p[k] += length * a[k];
    };
    if constexpr (kick_first) Problem::acceleration(q, a);
    const real joined = outer[stages] + outer[0];
    real first = outer[0];
    for (long step = 0; step < steps; ++step) {
        for (int i = 0; i < stages; ++i) {
            const real length = i == 0 ? first : outer[i];
            if constexpr (kick_first) {
                kick(length);
                drift(inner[i]);
                Problem::acceleration(q, a);
            } else {
                drift(length);
                Problem::acceleration(q, a);
                kick(inner[i]);
            }
        }
        first = joined;
    }
    if constexpr (kick_first)
        kick(outer[stages]);
    else
        drift(outer[stages]);
    for (int k = 0; k < n; ++k) state.q[k] = q[k], state.p[k] = p[k];
    return steps * stages + (kick_first ? 1 : 0);
}

}  // namespace lobatto::bench
