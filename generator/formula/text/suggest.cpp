// SPDX-License-Identifier: GPL-2.0-or-later
// The nearest of some names, by the letters to change.
#include "generator/formula/text/suggest.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

namespace lobatto {
namespace {

// The least number of letters to insert, delete, replace or swap with their neighbour to turn one word into the other.
std::size_t distance(const std::string& a, const std::string& b) {
    std::vector<std::vector<std::size_t>> d(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
    for (std::size_t i = 0; i <= a.size(); ++i) d[i][0] = i;
    for (std::size_t j = 0; j <= b.size(); ++j) d[0][j] = j;
    for (std::size_t i = 1; i <= a.size(); ++i) {
        for (std::size_t j = 1; j <= b.size(); ++j) {
            d[i][j] = std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, d[i - 1][j - 1] + (a[i - 1] != b[j - 1])});
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
                d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
        }
    }
    return d[a.size()][b.size()];
}

std::string lower_case(std::string word) {
    std::transform(word.begin(), word.end(), word.begin(), [](unsigned char c) { return std::tolower(c); });
    return word;
}

}  // namespace

std::string suggestion(const std::string& word, const std::vector<std::string>& candidates) {
    constexpr std::size_t longest = 64;
    if (word.size() > longest) return "";
    const std::string* nearest = nullptr;
    std::size_t least = 0;
    for (const std::string& candidate : candidates) {
        if (candidate.size() > longest) continue;
        const std::size_t letters = distance(lower_case(word), lower_case(candidate));
        const bool abbreviation = word.size() < candidate.size() && candidate.starts_with(word);  // l for length
        if (!abbreviation && 3 * letters > std::max(word.size(), candidate.size())) continue;
        if (nearest == nullptr || letters < least) {
            nearest = &candidate;
            least = letters;
        }
    }
    return nearest == nullptr ? "" : fmt::format(" Did you mean '{}'?", *nearest);
}

std::string listing(const std::vector<std::string>& names) {
    constexpr std::size_t most = 12;
    const auto end = names.begin() + static_cast<std::ptrdiff_t>(std::min(names.size(), most));
    return fmt::format("{}{}", fmt::join(names.begin(), end, ", "), names.size() > most ? ", ..." : "");
}

}  // namespace lobatto
