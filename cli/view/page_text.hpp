// SPDX-License-Identifier: GPL-2.0-or-later
// The texts of cli/view/page/, carried inside the program (cli/view/embed_page.cmake).
#pragma once

#include <string_view>

namespace lobatto {

extern const std::string_view page_html, page_css, page_js;

}  // namespace lobatto
