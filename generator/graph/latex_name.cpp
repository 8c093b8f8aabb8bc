// SPDX-License-Identifier: GPL-2.0-or-later
// Names of scenes as LaTeX: Greek letters, subscripts, dots of velocities.
#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "generator/graph/notation.hpp"

namespace lobatto {

namespace {

// x' and x'' have a dot or two on their x.
std::string with_dots(const std::string& stem, std::size_t primes) {
    return primes == 0 ? stem : (primes == 1 ? "\\dot{" : "\\ddot{") + stem + "}";
}

std::size_t primes_of(const std::string& name) {
    return name.size() - (name.find_last_not_of('\'') + 1);
}

}  // namespace

std::string latex_name(const std::string& name) {
    static const std::map<std::string, std::string> greek = [] {
        std::map<std::string, std::string> names;
        for (const char* letter :
             {"alpha", "beta",  "gamma",  "delta", "epsilon", "zeta",  "eta", "theta", "iota", "kappa", "lambda",
              "mu",    "nu",    "xi",     "rho",   "sigma",   "tau",   "phi", "chi",   "psi",  "omega", "Gamma",
              "Delta", "Theta", "Lambda", "Xi",    "Pi",      "Sigma", "Phi", "Psi",   "Omega"})
            names.emplace(letter, std::string("\\") + letter);
        return names;
    }();
    if (!name.empty() && name.front() == '\\') return name;
    if (const auto by = name.find("/d"); name.starts_with("d") && by != std::string::npos)  // dp/dq
        return "\\partial " + latex_name(name.substr(1, by - 1)) + "/\\partial " + latex_name(name.substr(by + 2));
    std::string stem = name, subscript;
    const std::size_t primes = primes_of(stem);
    stem.resize(stem.size() - primes);
    if (const auto underscore = stem.find('_'); underscore != std::string::npos && underscore > 0) {
        subscript = stem.substr(underscore + 1);
        stem.erase(underscore);
    }
    if (const std::size_t digits = stem.find_last_not_of("0123456789") + 1; digits > 0 && digits < stem.size()) {
        subscript = stem.substr(digits) + (subscript.empty() ? "" : "_" + subscript);
        stem.erase(digits);
    }
    if (const auto letter = greek.find(stem); letter != greek.end())
        stem = letter->second;
    else if (stem.size() > 1)
        stem = "\\mathrm{" + stem + "}";
    stem = with_dots(stem, primes);
    // Subscripts of subscripts stand side by side: p_theta_left becomes p_{\theta,\mathrm{left}}.
    std::string below;
    for (std::size_t begin = 0; begin < subscript.size();) {
        const std::size_t end = std::min(subscript.find('_', begin), subscript.size());
        const std::string part = subscript.substr(begin, end - begin);
        const auto letter = greek.find(part);
        const bool is_word = part.find_first_of("0123456789") == std::string::npos && part.size() > 1;
        if (!part.empty())
            below += (below.empty() ? "" : ",") + (letter != greek.end() ? letter->second
                                                   : is_word             ? "\\mathrm{" + part + "}"
                                                                         : part);
        begin = end + 1;
    }
    if (!below.empty()) stem += "_{" + below + "}";
    return stem;
}

std::map<std::string, std::string> latex_as_written(const std::set<std::string>& names) {
    std::map<std::string, std::vector<std::string>> alike;
    for (const std::string& name : names) alike[latex_name(name)].push_back(name);
    std::map<std::string, std::string> written;
    for (const auto& [latex, group] : alike) {
        const auto clarity = [](const std::string& name) {
            return std::make_tuple(name.back() == '_', name.find('_') == std::string::npos, name.size());
        };
        const auto clearest = std::min_element(group.begin(), group.end(),
                                               [&](const auto& a, const auto& b) { return clarity(a) < clarity(b); });
        for (const std::string& name : group) {
            if (name == *clearest) continue;
            std::string letters;
            for (const char c : name)
                if (c != '\'') letters += c == '_' ? std::string("\\_") : std::string(1, c);
            written[name] = with_dots("\\mathrm{" + letters + "}", primes_of(name));
        }
    }
    return written;
}

}  // namespace lobatto
