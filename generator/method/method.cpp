// SPDX-License-Identifier: GPL-2.0-or-later
#include "generator/method/method.hpp"

#include <fmt/format.h>

#include <stdexcept>

#include "generator/method/splitting.hpp"

namespace lobatto {

const char* word_of(Family family) {
    return family == Family::lobatto ? "lobatto" : family == Family::gauss ? "gauss" : "splitting";
}

Family family_of(const std::string& word) {
    for (const Family family : {Family::lobatto, Family::gauss, Family::splitting})
        if (word == word_of(family)) return family;
    throw std::invalid_argument(word + " is no family of methods");
}

const std::vector<int>& sizes_of(Family family) {
    static const std::vector<int> lobatto = {2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12},
                                  gauss = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10};
    return family == Family::lobatto ? lobatto : family == Family::gauss ? gauss : splitting_stages();
}

int Method::order() const {
    switch (family) {
        case Family::lobatto:
            return 2 * points - 2;
        case Family::gauss:
            return 2 * points;
        default:
            return splitting_order(points);
    }
}

std::string Method::name() const {
    const std::string suffix = arithmetic == StepArithmetic::clean ? ", clean" : "";
    switch (family) {
        case Family::lobatto:
            return fmt::format("Lobatto, {} points{}", points, suffix);
        case Family::gauss:
            return fmt::format("Gauss, {} {}{}", points, points == 1 ? "stage" : "stages", suffix);
        default:
            return fmt::format("splitting, {} stages{}", points, suffix);
    }
}

bool heeds_tolerance(const Method& method, bool is_linear, bool has_constant_masses) {
    return method.family != Family::splitting && method.arithmetic == StepArithmetic::plain && !is_linear &&
           !(has_constant_masses && method.numbers == Precision::double_double);
}

std::string reason_against_numbers(const Method& method) {
    const bool is_one_word = method.numbers != Precision::double_double && !has_many_digits(method.numbers);
    if (!is_one_word && method.arithmetic == StepArithmetic::clean)
        return "clean arithmetic is for numbers of one machine word; leave it out, since numbers in " +
               precision_name(method.numbers) + " have digits to spare";
    const bool is_wider = method.numbers != Precision::single && method.numbers != Precision::double_;
    if (method.family != Family::splitting || !is_wider) return "";
    const int known = splitting_of(method.points).digits;
    if (known >= decimals_of(method.numbers) - 1) return "";  // the last digit is that of rounding
    return fmt::format(
        "the coefficients of {} are known to {} digits, too few for numbers in {}; choose double, or Lobatto",
        method.name(), known, precision_name(method.numbers));
}

}  // namespace lobatto
