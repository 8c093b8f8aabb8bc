// SPDX-License-Identifier: GPL-2.0-or-later
// Files of the source tree that the program carries inside (cli/embed_texts.cmake).
#pragma once

#include <string_view>
#include <vector>

namespace lobatto {

struct EmbeddedText {
    std::string_view name;  // of the file, without its folder
    std::string_view text;
};
extern const std::vector<EmbeddedText> page_texts;       // cli/view/page/
extern const std::vector<EmbeddedText> scene_templates;  // cli/new/, sorted by name

}  // namespace lobatto
