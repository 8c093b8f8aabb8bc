// SPDX-License-Identifier: GPL-2.0-or-later
#include "generator/method/splitting.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>
#include <string>

namespace lobatto {

namespace {

using GiNaC::numeric;
using Numbers = std::vector<numeric>;
using Decimals = std::vector<std::string>;

enum class Kind { kick_first, drift_first, composition };

struct Published {
    int stages, order;
    Kind kind;
    Decimals kicks, drifts;  // up to the middle, as listed; of a composition the lengths of its steps, and nothing
};

// S. Blanes, P. C. Moan, Practical symplectic partitioned Runge-Kutta and Runge-Kutta-Nystroem methods, J. Comput.
// Appl. Math. 142 (2002) 313-330, table 3: SRKN_6^b (order 4), SRKN_11^b and SRKN_14^a (order 6).
// W. Kahan, R.-C. Li, Composition constants for raising the orders of unconventional schemes for ordinary differential
// equations, Math. Comp. 66 (1997) 1089-1099: 17 steps of Stoermer and Verlet, order 8.
// M. Sofroniou, G. Spaletta, Derivation of symmetric composition constants for symmetric integrators, Optim. Methods
// Softw. 20 (2005) 597-613: 35 such steps, order 10.
const std::vector<Published>& published() {
    static const std::vector<Published> list = {
        {6,
         4,
         Kind::kick_first,
         {"0.0829844064174052", "0.396309801498368", "-0.0390563049223486"},
         {"0.245298957184271", "0.604872665711080"}},
        {11,
         6,
         Kind::kick_first,
         {"0.0414649985182624", "0.198128671918067", "-0.0400061921041533", "0.0752539843015807",
          "-0.0115113874206879"},
         {"0.123229775946271", "0.290553797799558", "-0.127049212625417", "-0.246331761062075", "0.357208872795928"}},
        {14,
         6,
         Kind::drift_first,
         {"0.09171915262446165", "0.183983170005006", "-0.05653436583288827", "0.004914688774712854",
          "0.143761127168358", "0.328567693746804"},
         {"0.0378593198406116", "0.102635633102435", "-0.0258678882665587", "0.314241403071447", "-0.130144459517415",
          "0.106417700369543", "-0.00879424312851058"}},
        {17,
         8,
         Kind::composition,
         {"0.13020248308889008087881763", "0.56116298177510838456196441", "-0.38947496264484728640807860",
          "0.15884190655515560089621075", "-0.39590389413323757733623154", "0.18453964097831570709183254",
          "0.25837438768632204729397911", "0.29501172360931029887096624"},
         {}},
        {35,
         10,
         Kind::composition,
         {"0.078795722521686419263907679337684", "0.31309610341510852776481247192647",
          "0.027918383235078066109520273275299", "-0.22959284159390709415121339679655",
          "0.13096206107716486317465685927961", "-0.26973340565451071434460973222411",
          "0.074973343155891435666137105641410", "0.11199342399981020488957508073640",
          "0.36613344954622675119314812353150", "-0.39910563013603589787862981058340",
          "0.10308739852747107731580277001372", "0.41143087395589023782070411897608",
          "-0.0048663605831352617621956593099771", "-0.39203335370863990644808193642610",
          "0.051942502962449647037182904015976", "0.050665090759924496335874344156866",
          "0.049674370639729879054568800279461"},
         {}}};
    return list;
}

const Published& published(int stages) {
    for (const Published& method : published())
        if (method.stages == stages) return method;
    throw std::invalid_argument(
        fmt::format("Splitting, {} stages: there are {}", stages, fmt::join(splitting_stages(), ", ")));
}

// "-0.25" is -1/4.
numeric exact(std::string decimal) {
    const std::size_t point = decimal.find('.');
    const auto places = static_cast<long>(decimal.size() - point - 1);
    decimal.erase(point, 1);
    const std::size_t first = decimal.find_first_of("123456789");
    const numeric digits(decimal.substr(first).c_str());
    return (decimal[0] == '-' ? -digits : digits) / GiNaC::pow(numeric(10), numeric(places));
}

// A list of `length` that reads the same from both ends and sums to 1, from what is listed up to the middle.
Numbers palindrome(const Decimals& listed, std::size_t length) {
    Numbers all(length);
    numeric rest = 1;
    for (std::size_t i = 0; i < listed.size(); ++i) {
        all[i] = all[length - 1 - i] = exact(listed[i]);
        rest -= 2 * all[i];
    }
    const std::size_t middle = listed.size();
    all[middle] = all[length - 1 - middle] = length % 2 == 1 ? rest : rest / 2;
    return all;
}

}  // namespace

const std::vector<int>& splitting_stages() {
    static const std::vector<int> stages = [] {
        std::vector<int> list;
        for (const Published& method : published()) list.push_back(method.stages);
        return list;
    }();
    return stages;
}

int splitting_order(int stages) {
    return published(stages).order;
}

Splitting splitting_of(int stages) {
    const Published& source = published(stages);
    const auto r = static_cast<std::size_t>(stages);
    Splitting method{source.stages, source.order, 60, {}, {}};
    for (const Decimals& list : {source.kicks, source.drifts})
        for (const std::string& decimal : list)
            method.digits = std::min(method.digits, static_cast<int>(decimal.size() - decimal.find('.')) - 1);
    switch (source.kind) {
        case Kind::kick_first:
            method.kicks = palindrome(source.kicks, r + 1);
            method.drifts = palindrome(source.drifts, r);
            break;
        case Kind::drift_first:
            method.kicks = palindrome(source.kicks, r);
            method.drifts = palindrome(source.drifts, r + 1);
            method.kicks.insert(method.kicks.begin(), 0);
            method.kicks.emplace_back(0);
            break;
        case Kind::composition:  // of steps kick, drift, kick, neighbouring kicks in one
            method.drifts = palindrome(source.kicks, r);
            method.kicks.assign(r + 1, 0);
            for (std::size_t i = 0; i < r; ++i) {
                method.kicks[i] += method.drifts[i] / 2;
                method.kicks[i + 1] += method.drifts[i] / 2;
            }
            break;
    }
    return method;
}

}  // namespace lobatto
