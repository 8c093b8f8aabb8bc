// SPDX-License-Identifier: GPL-2.0-or-later
// Names of a scene with many values each: NAME=FROM:TO:COUNT, NAME=FROM:TO:COUNT:log, NAME=a,b,c.
#include "analysis/sweep/axis.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "analysis/initial_value.hpp"
#include "analysis/overrides.hpp"
#include "generator/formula/expression.hpp"
#include "generator/formula/text/suggest.hpp"
#include "generator/method/splitting.hpp"

namespace lobatto {

namespace {

constexpr long most_values = 10'000'000;  // of a name: those that were asked for are kept

std::size_t place_of(std::int64_t index) {
    return static_cast<std::size_t>(index);
}

class AxisReader {
public:
    AxisReader(const Scene& scene, const std::string& argument)
        : scene_(scene), argument_(argument), source_("--vary", argument) {}

    Axis run() {
        const std::size_t equals = argument_.find('=');
        if (equals == std::string::npos || equals == 0)
            source_.fail({1, 1}, "expected NAME=FROM:TO:COUNT or NAME=a,b,c, such as --vary q=0:3:1000");
        axis_.of = varied_name(scene_, argument_.substr(0, equals), "name", [&](const std::string& message) {
            source_.fail({1, 1}, message);
        });
        axis_.written = argument_.substr(equals + 1);
        for (char& c : axis_.written)
            if (static_cast<unsigned char>(c) < 0x20) c = ' ';  // it becomes a line of the table's head
        read_values(equals + 1);
        check_settings(equals + 1);
        return std::move(axis_);
    }

private:
    // Where the parts between separators outside parentheses begin, and one past the end.
    std::vector<std::size_t> parts(std::size_t begin, char separator) const {
        std::vector<std::size_t> begins{begin};
        int depth = 0;
        for (std::size_t i = begin; i < argument_.size(); ++i) {
            if (argument_[i] == '(') ++depth;
            if (argument_[i] == ')') --depth;
            if (argument_[i] == separator && depth <= 0) begins.push_back(i + 1);
        }
        begins.push_back(argument_.size() + 1);
        return begins;
    }

    Text part(const std::vector<std::size_t>& begins, std::size_t i) const {
        return text_of(argument_, begins[i], begins[i + 1] - 1);
    }

    GiNaC::numeric number(const Text& text, const std::string& what) const {
        const Scope scope{nullptr, what, false, {}};
        return value_in_range(source_, text.at.front(), parse_expression(source_, text, scope), what);
    }

    void read_values(std::size_t begin) {
        const std::vector<std::size_t> range = parts(begin, ':');
        if (range.size() == 2) return read_list(parts(begin, ','));
        if (range.size() != 4 && range.size() != 5)
            source_.fail(part(range, 0).at.front(),
                         "expected FROM:TO:COUNT, FROM:TO:COUNT:log or values with commas, such as 0:3:1000");
        axis_.given = {number(part(range, 0), "the first value of " + axis_.of.name),
                       number(part(range, 1), "the last value of " + axis_.of.name)};
        axis_.spacing = Axis::Spacing::linear;
        if (range.size() == 5) {
            const Text word = part(range, 3);
            if (word.value != "log")
                source_.fail(word.at.front(),
                             fmt::format("'{}' is no spacing; there is log, or none for equal distances", word.value));
            if (!(axis_.given[0] * axis_.given[1]).is_positive())
                source_.fail(part(range, 0).at.front(),
                             fmt::format("equal ratios lead from {:.6g} to {:.6g} only when both have the same sign "
                                         "and neither is 0; leave :log out",
                                         axis_.given[0].to_double(), axis_.given[1].to_double()));
            axis_.spacing = Axis::Spacing::logarithmic;
        }
        const Text text = part(range, 2);
        const GiNaC::numeric count = number(text, "the number of values of " + axis_.of.name);
        const double nearest = std::round(count.to_double());
        if (count.to_double() != nearest || nearest < 1 || nearest > most_values)
            source_.fail(text.at.front(), fmt::format("the number of values is {:.10g}; it must be a whole number from "
                                                      "1 to {}",
                                                      count.to_double(), most_values));
        if (nearest == 1 && axis_.given[0] != axis_.given[1])
            source_.fail(text.at.front(),
                         fmt::format("one value does not lead from {:.6g} to {:.6g}: give a count of 2 or "
                                     "more, or {}={:.6g}",
                                     axis_.given[0].to_double(), axis_.given[1].to_double(), axis_.of.name,
                                     axis_.given[0].to_double()));
        axis_.count = static_cast<std::int64_t>(nearest);
    }

    void read_list(const std::vector<std::size_t>& list) {
        for (std::size_t i = 0; i + 1 < list.size(); ++i)
            axis_.given.push_back(number(part(list, i), "the value of " + axis_.of.name));
        axis_.count = std::ssize(axis_.given);
    }

    // Settings have values that a method can have.
    void check_settings(std::size_t begin) const {
        using Role = VariedName::Role;
        const Role role = axis_.of.role;
        if (!axis_.of.is_setting()) return;
        const auto fail = [&](double value, const std::string& what) {
            source_.fail(text_of(argument_, begin).at.front(),
                         fmt::format("{} = {:.10g}; {}", axis_.of.name, value, what));
        };
        for (std::int64_t i = 0; i < axis_.count; ++i) {
            const double value = axis_.exact(i).to_double();
            const auto check_size = [&](Family family, const std::string& there_are) {
                const std::vector<int>& sizes = sizes_of(family);
                if (std::find(sizes.begin(), sizes.end(), value) == sizes.end()) fail(value, there_are);
            };
            if (role == Role::step && !(value > 0)) fail(value, "a step must be positive");
            if (role == Role::tolerance && !(value > 0 && value <= 1e-3))
                fail(value, "a tolerance must be above 0 and at most 0.001");
            if (role == Role::points) check_size(Family::lobatto, "Lobatto has 2 to 12 points, a whole number");
            if (role == Role::stages) check_size(Family::gauss, "Gauss has 1 to 10 stages, a whole number");
            if (role == Role::splitting)
                check_size(Family::splitting, fmt::format("splitting methods have {} stages",
                                                          fmt::join(sizes_of(Family::splitting), ", ")));
        }
    }

    const Scene& scene_;
    const std::string& argument_;
    Source source_;
    Axis axis_;
};

}  // namespace

VariedName varied_name(const Scene& scene, const std::string& name, const std::string& what,
                       const std::function<void(const std::string&)>& fail) {
    using Role = VariedName::Role;
    std::vector<std::string> names;
    for (std::size_t i = 0; i < scene.parameters.size(); ++i) {
        if (scene.parameters[i].is_side) continue;
        names.push_back(scene.parameters[i].written);
        if (name == names.back() || name == scene.parameters[i].name) return {Role::parameter, i, name};
    }
    if (const auto found = initial_value(scene, name, "vary", fail))
        return {found->is_rate ? Role::rate : Role::position, found->index, name};
    for (const std::string& initial : initial_names(scene)) names.push_back(initial);
    static const std::pair<const char*, Role> settings[] = {{"step", Role::step},
                                                            {"points", Role::points},
                                                            {"stages", Role::stages},
                                                            {"splitting", Role::splitting},
                                                            {"tolerance", Role::tolerance}};
    for (const auto& [setting, role] : settings) {
        if (what == "name") names.push_back(setting);  // not of the columns of starts
        if (name == setting) return {role, 0, name};
    }
    for (const Parameter& constant : scene.constants)
        if (constant.written == name)
            fail(
                fmt::format("'{}' is declared constant in {}, so it is part of the kernel; only run-time parameters "
                            "can be varied",
                            name, scene.path));
    fail(
        fmt::format("unknown {} '{}'; what can be varied: {}.{}", what, name, listing(names), suggestion(name, names)));
    throw std::logic_error("an unknown name was let through");
}

Axis read_axis(const Scene& scene, const std::string& argument) {
    return AxisReader(scene, argument).run();
}

// Equal distances: from + (to - from) i/(count - 1), to 60 digits. Equal ratios: from (to/from)^(i/(count - 1)), to 64
// bits and then rounded.
GiNaC::numeric Axis::exact(std::int64_t i) const {
    if (spacing == Spacing::list) return given[place_of(i)];
    if (i == 0) return given[0];
    if (i == count - 1) return given[1];
    if (spacing == Spacing::linear)
        return given[0] + (given[1] - given[0]) * GiNaC::numeric(static_cast<long>(i), static_cast<long>(count - 1));
    const double from = given[0].to_double(), to = given[1].to_double();
    const long double share = static_cast<long double>(i) / static_cast<long double>(count - 1);
    const auto logarithm = [](double x) { return std::log(static_cast<long double>(std::fabs(x))); };
    const long double size = std::exp((1 - share) * logarithm(from) + share * logarithm(to));
    return GiNaC::numeric(std::copysign(static_cast<double>(size), from));
}

AxisValues::AxisValues(Axis axis)
    : axis_(std::move(axis)),
      blocks_(place_of((axis_.count + block_size - 1) / block_size)),
      ready_(std::make_unique<std::atomic<const double*>[]>(blocks_.size())) {}

double AxisValues::operator()(std::int64_t i, std::recursive_mutex& algebra) const {
    const std::size_t number = place_of(i / block_size);
    const double* block = ready_[number].load(std::memory_order_acquire);
    if (block == nullptr) {
        const std::lock_guard lock(algebra);
        if (blocks_[number] == nullptr) {
            const std::int64_t first = i / block_size * block_size, last = std::min(first + block_size, axis_.count);
            auto values = std::make_unique<double[]>(place_of(last - first));
            for (std::int64_t k = first; k < last; ++k) values[place_of(k - first)] = axis_.exact(k).to_double();
            blocks_[number] = std::move(values);
            ready_[number].store(blocks_[number].get(), std::memory_order_release);
        }
        block = blocks_[number].get();
    }
    return block[i % block_size];
}

}  // namespace lobatto
