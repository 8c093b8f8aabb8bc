// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/kernel/support_text.hpp"

#include <algorithm>
#include <filesystem>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string_view>

namespace lobatto {
namespace {

constexpr std::string_view include = "#include \"";

// The part that a line of another part includes; empty if none.
std::string included(const std::string& line, std::string_view from) {
    if (!line.starts_with(include)) return {};
    const std::string path = line.substr(include.size(), line.find('"', include.size()) - include.size());
    return (std::filesystem::path(from).parent_path() / path).lexically_normal();
}

void need(const std::string& name, std::set<std::string>& needed) {
    if (!needed.insert(name).second) return;
    const auto part = std::find_if(support_parts.begin(), support_parts.end(),
                                   [&](const SupportPart& candidate) { return candidate.name == name; });
    if (part == support_parts.end()) throw std::logic_error("there is no support header " + name);
    std::istringstream lines{std::string(part->text)};
    for (std::string line; std::getline(lines, line);)
        if (const std::string other = included(line, name); !other.empty()) need(other, needed);
}

}  // namespace

std::string support_text(const std::vector<std::string>& names) {
    std::set<std::string> needed;
    for (const std::string& name : names) need(name, needed);
    std::string whole;
    for (const SupportPart& part : support_parts) {
        if (!needed.contains(std::string(part.name))) continue;
        std::istringstream lines{std::string(part.text)};
        for (std::string line; std::getline(lines, line);) {
            const bool is_known = line.starts_with(include) || (line.starts_with("// SPDX") && !whole.empty()) ||
                                  (line.empty() && whole.ends_with("\n\n"));
            if (!is_known) whole += line + '\n';
        }
    }
    return whole;
}

std::vector<std::string> with_ensemble(std::vector<std::string> names) {
    std::set<std::string> needed;
    for (const std::string& name : names) need(name, needed);
    names.push_back("steppers/ensemble.hpp");
    if (needed.contains("steppers/separable.hpp") || needed.contains("steppers/splitting.hpp"))
        names.push_back("iteration/ensemble_fixed_point.hpp");
    if (needed.contains("steppers/clocked.hpp")) names.push_back("steppers/clocked_lanes.hpp");
    return names;
}

std::vector<std::string> with_refilled_ensemble(std::vector<std::string> names) {
    names = with_ensemble(std::move(names));
    names.push_back("steppers/refilled.hpp");
    return names;
}

std::string support_text() {
    std::vector<std::string> names;
    for (const SupportPart& part : support_parts) names.emplace_back(part.name);
    return support_text(names);
}

}  // namespace lobatto
