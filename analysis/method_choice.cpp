// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/method_choice.hpp"

#include "generator/formula/source.hpp"

namespace lobatto {

void MethodChoice::apply(Scene& scene) const {
    Method& method = scene.method;
    if (const std::optional<Method> named = member()) method.family = named->family, method.points = named->points;
    if (numbers) method.numbers = *precision_of(*numbers);
    need_digits_for(method.numbers);
    if (arithmetic) method.arithmetic = *arithmetic == "clean" ? StepArithmetic::clean : StepArithmetic::plain;
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
