// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/method_choice.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "generator/formula/text/source.hpp"
#include "generator/mechanics/clock/automatic_clock.hpp"

namespace lobatto {

namespace {

// The command line refuses most of this one option at a time; settings of the library come as they are.
void check_choice(const MethodChoice& choice) {
    if (choice.points.has_value() + choice.stages.has_value() + choice.splitting.has_value() > 1)
        throw InputError("points, stages and splitting name different methods; give one of them");
    if (const std::optional<Method> named = choice.member()) {
        const std::vector<int>& sizes = sizes_of(named->family);
        if (std::find(sizes.begin(), sizes.end(), named->points) == sizes.end())
            throw InputError(fmt::format("there is no method {} with {}; there are {}", word_of(named->family),
                                         named->points, fmt::join(sizes, ", ")));
    }
    if (!choice.numbers.empty() && !precision_of(choice.numbers))
        throw InputError("unknown numbers; there are " + precision_list());
    if (!choice.arithmetic.empty() && choice.arithmetic != "clean" && choice.arithmetic != "plain")
        throw InputError(fmt::format("unknown arithmetic '{}'; there are \"plain\" and \"clean\"", choice.arithmetic));
    if (!choice.clock.empty() && choice.clock != "none" && choice.clock != "auto")
        throw InputError(
            fmt::format("unknown clock '{}'; there are \"none\", which means equal steps, and \"auto\"; a formula is "
                        "written into the scene, as `clock` under [method]",
                        choice.clock));
    if (!choice.tolerance) return;
    const std::string complaint = tolerance_complaint(*choice.tolerance, fmt::format("{}", *choice.tolerance));
    if (!complaint.empty()) throw InputError(complaint);
}

Scene with_clock(const std::string& word, Scene scene) {
    if (word == "none") return with_equal_steps(std::move(scene));
    const bool has_own = scene.clock && scene.clock->is_automatic;
    if (!has_own && !has_automatic_clock(scene))
        throw InputError(scene.path +
                         ": there is no clock \"auto\": it needs a motion without constraints, impacts and inputs, and "
                         "a term of the Lagrangian that grows without bound, such as 1/r");
    return with_automatic_clock(std::move(scene));
}

}  // namespace

std::string tolerance_complaint(double tolerance, const std::string& written) {
    if (tolerance > 0 && tolerance <= 1e-3) return "";
    return "the tolerance is " + written +
           "; it must be above 0 and at most 0.001; leave it out to iterate to rounding";
}

void MethodChoice::apply(Scene& scene) const {
    check_choice(*this);
    Method& method = scene.method;
    if (const std::optional<Method> named = member()) method.family = named->family, method.points = named->points;
    if (!numbers.empty()) method.numbers = *precision_of(numbers);
    need_digits_for(method.numbers);
    if (!clock.empty()) scene = with_clock(clock, std::move(scene));
    if (!arithmetic.empty()) method.arithmetic = arithmetic == "clean" ? StepArithmetic::clean : StepArithmetic::plain;
    if (tolerance) {
        if (method.arithmetic == StepArithmetic::clean)
            throw InputError(scene.path +
                             ": clean arithmetic iterates until nothing changes, so a tolerance has no meaning; leave "
                             "out --tolerance, or add --arithmetic plain");
        if (method.family == Family::splitting)
            throw InputError(scene.path + ": splitting methods iterate nothing; leave out --tolerance");
        method.tolerance = *tolerance;
    }
    // The scene's has no meaning with --arithmetic clean or --splitting.
    if (method.arithmetic == StepArithmetic::clean || method.family == Family::splitting) method.tolerance = 0;
    if (const std::string why = reason_against_numbers(method); !why.empty()) throw InputError(scene.path + ": " + why);
}

void MethodChoice::require_double(const Scene& scene, const std::string& command) {
    if (scene.method.numbers != Precision::double_)
        throw InputError(scene.path + ": `lobatto " + command + "` computes in double, but numbers are \"" +
                         precision_name(scene.method.numbers) +
                         "\"; give --numbers double, or leave `numbers` out under [method]");
}

std::optional<Method> MethodChoice::member() const {
    if (points) return Method{Family::lobatto, *points};
    if (stages) return Method{Family::gauss, *stages};
    if (splitting) return Method{Family::splitting, *splitting};
    return std::nullopt;
}

}  // namespace lobatto
