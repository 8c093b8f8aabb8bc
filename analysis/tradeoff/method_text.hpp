// SPDX-License-Identifier: GPL-2.0-or-later
// A choice as lines of a scene file, and into one.
#pragma once

#include <string>

#include "analysis/tradeoff/choice.hpp"

namespace lobatto {

// The lines of [method] and [run] that differ from the scene's.
std::string method_text(const Choice& choice);
// "h omega = 2.4 of at most 3.112"
std::string stability_text(const Choice& choice);

// The text of a scene file with the choice in it; everything else stays as it is. `until`: the end of the choice too.
// InputError when the text does not read back as meant.
std::string with_choice(const std::string& text, const Choice& choice, double error, bool until);
void write_method(const Choice& choice, const Scene& scene, double error, bool until);

}  // namespace lobatto
