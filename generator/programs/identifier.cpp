// SPDX-License-Identifier: GPL-2.0-or-later
// A name of the scene as a C++ identifier that no keyword, macro or emitted name takes away.
#include "generator/programs/identifier.hpp"

#include <algorithm>
#include <set>
#include <sstream>

namespace lobatto {

namespace {

std::set<std::string> words_of(const char* text) {
    std::istringstream stream(text);
    std::set<std::string> words;
    for (std::string word; stream >> word;) words.insert(word);
    return words;
}

}  // namespace

std::string identifier(const std::string& name) {
    static const std::set<std::string> keywords = words_of(
        "alignas alignof and and_eq asm auto bitand bitor bool break case catch char char8_t char16_t "
        "char32_t class compl concept const consteval constexpr constinit const_cast continue co_await "
        "co_return co_yield I decltype default delete do double dynamic_cast else enum explicit export "
        "extern false float for friend goto if inline int long mutable namespace new noexcept not not_eq "
        "nullptr operator or or_eq private protected public real register reinterpret_cast requires "
        "return short signed sizeof static static_assert static_cast struct switch template this "
        "thread_local throw true try typedef typeid typename union unsigned using virtual void volatile "
        "wchar_t while xor xor_eq lobatto std linux unix Parameters Status math_errhandling errno signgam "
        "Coefficients CoefficientsOf Angles number given");
    // Names in capitals may be macros of the standard headers (NAN, M_PI). What already ends in underscores gets one
    // more, so that different names stay different.
    const std::string stem = name.substr(0, name.find_last_not_of('_') + 1);
    const bool capitals = stem.size() > 2 && std::all_of(stem.begin(), stem.end(), [](char c) {
                              return c == '_' || (c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z');
                          });
    return capitals || keywords.contains(stem) ? name + "_" : name;
}

}  // namespace lobatto
