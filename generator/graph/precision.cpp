// SPDX-License-Identifier: GPL-2.0-or-later
#include "generator/graph/precision.hpp"

#include <cmath>

namespace lobatto {

namespace {

struct NumberType {
    const char* name;
    int bits;
    int epsilon;  // power of two
    long largest, smallest;
};

const NumberType& numbers_of(Precision precision) {
    static constexpr NumberType all[] = {{"float", 24, -23, 128, -124},
                                         {"double", 53, -52, 1024, -1020},
                                         {"long double", 64, -63, 16384, -16380},
                                         {"double-double", 106, -104, 1024, -914},
                                         {"quadruple", 113, -112, 16384, -16380}};
    return all[static_cast<int>(precision)];
}

}  // namespace

std::string precision_name(Precision precision) {
    return numbers_of(precision).name;
}

std::optional<Precision> precision_of(const std::string& name) {
    for (const Precision precision : all_precisions)
        if (name == precision_name(precision)) return precision;
    return std::nullopt;
}

std::string precision_list() {
    std::string text;
    for (const Precision precision : all_precisions)
        text += std::string(text.empty()                        ? ""
                            : precision == Precision::quadruple ? " and "
                                                                : ", ") +
                '"' + precision_name(precision) + '"';
    return text;
}

double rounding_of(Precision precision) {
    return std::ldexp(1.0, numbers_of(precision).epsilon);
}

int bits_of(Precision precision) {
    return numbers_of(precision).bits;
}

int decimals_of(Precision precision) {
    return static_cast<int>(std::floor((numbers_of(precision).bits - 1) * std::log10(2.0)));
}

long largest_exponent_of(Precision precision) {
    return numbers_of(precision).largest;
}

long smallest_exponent_of(Precision precision) {
    return numbers_of(precision).smallest;
}

}  // namespace lobatto
