// SPDX-License-Identifier: GPL-2.0-or-later
// "Did you mean ...?": the nearest of some names to a misspelt one.
#pragma once

#include <string>
#include <vector>

namespace lobatto {

// " Did you mean 'length'?" when a candidate is near (a third of its letters wrong or swapped at most), else "".
std::string suggestion(const std::string& word, const std::vector<std::string>& candidates);

// "a, b, c", at most a dozen of them.
std::string listing(const std::vector<std::string>& names);

}  // namespace lobatto
