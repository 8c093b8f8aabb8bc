// SPDX-License-Identifier: GPL-2.0-or-later
#include "generator/scene/file/declarations.hpp"

#include <fmt/format.h>

#include "generator/formula/text/token.hpp"

namespace lobatto {
namespace {

constexpr std::size_t longest_name = 64;
constexpr std::pair<std::string_view, std::string_view> reserved_names[] = {
    {"pi", "the number 3.14159..."}, {"h", "the time step"}, {"t", "the time"}, {"H", "the energy"}};

std::string with_article(const std::string& what) {
    return (std::string_view("aeiou").find(what.front()) == std::string_view::npos ? "a " : "an ") + what;
}

}  // namespace

std::string element_name(const std::string& array, std::size_t k) {
    return fmt::format("{}_{}", array, k);
}

void Declarations::declare(const std::string& name, Position at, const std::string& what) {
    if (!is_identifier(name) || name.find("__") != std::string::npos) {
        const bool is_ascii = name.find('?') == std::string::npos;  // others become question marks
        fail(at, fmt::format("{} cannot be the name of {}: names are letters, digits and single underscores, and begin "
                             "with a letter{}",
                             is_ascii ? fmt::format("'{}'", name.substr(0, 40)) : "this", with_article(what),
                             is_ascii ? "" : "; of Greek letters write the names, such as theta"));
    }
    if (name.size() > longest_name)
        fail(at, fmt::format("a name of {} letters; at most {}", name.size(), longest_name));
    if (is_function_name(name))
        fail(at, fmt::format("'{}' is the name of a function; give the {} another name", name, what));
    for (const auto& [reserved, meaning] : reserved_names)
        if (name == reserved && !(what == "time" && name == "t"))
            fail(at, fmt::format("'{}' is {}; give the {} another name", name, meaning, what));
    const auto [found, added] = taken_.insert({name, {what, false}});
    if (added) return;
    if (found->second.element)
        fail(at, fmt::format("'{}' is {} in the trajectory; rename one", name, found->second.what));
    if (found->second.what == what) fail(at, fmt::format("'{}' is declared twice", name));
    fail(at,
         fmt::format("'{}' is both {} and {}; rename one", name, with_article(found->second.what), with_article(what)));
}

void Declarations::declare_elements(const std::string& array, Position at, std::size_t count) {
    for (std::size_t k = 1; k <= count; ++k) {
        const std::string name = element_name(array, k);
        const auto [found, added] = taken_.insert({name, {fmt::format("element {} of {}", k, array), true}});
        if (!added)
            fail(at, fmt::format("element {} of {} would be called {} in the trajectory, and that is {}; rename one", k,
                                 array, name, with_article(found->second.what)));
    }
}

}  // namespace lobatto
