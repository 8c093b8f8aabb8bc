// SPDX-License-Identifier: GPL-2.0-or-later
#include "generator/graph/precision.hpp"

#include <cmath>

#include "generator/formula/real.hpp"

namespace lobatto {

namespace {

struct NumberType {
    int bits;
    int epsilon;  // power of two
    long largest, smallest;
};

constexpr int first_of_digits = 1000;  // in_digits(50) is 1050

// Those of many digits are sums of doubles to the last bit: whole multiples of 53 bits, in the range of double.
NumberType numbers_of(Precision precision) {
    static constexpr NumberType all[] = {{24, -23, 128, -124},
                                         {53, -52, 1024, -1020},
                                         {64, -63, 16384, -16380},
                                         {106, -104, 1024, -914},
                                         {113, -112, 16384, -16380}};
    if (!has_many_digits(precision)) return all[static_cast<int>(precision)];
    const double bits = std::ceil(asked_digits(precision) / std::log10(2.0)) + 1;
    const int parts = static_cast<int>(std::ceil(bits / 53)), all_bits = 53 * parts;
    return {all_bits, 1 - all_bits, 1024, all_bits - 1073};
}

}  // namespace

Precision in_digits(int decimals) {
    return static_cast<Precision>(first_of_digits + decimals);
}

int asked_digits(Precision precision) {
    return static_cast<int>(precision) - first_of_digits;
}

bool has_many_digits(Precision precision) {
    return static_cast<int>(precision) >= first_of_digits;
}

std::string precision_name(Precision precision) {
    static constexpr const char* names[] = {"float", "double", "long double", "double-double", "quadruple"};
    if (has_many_digits(precision)) return std::to_string(asked_digits(precision)) + " digits";
    return names[static_cast<int>(precision)];
}

std::optional<Precision> precision_of(const std::string& name) {
    for (const Precision precision : all_precisions)
        if (name == precision_name(precision)) return precision;
    for (int decimals = fewest_digits; decimals <= most_digits; ++decimals)
        if (name == precision_name(in_digits(decimals))) return in_digits(decimals);
    return std::nullopt;
}

std::string precision_list() {
    std::string text;
    for (const Precision precision : all_precisions)
        text += (text.empty() ? "" : ", ") + ('"' + precision_name(precision) + '"');
    return text + " and \"" + std::to_string(fewest_digits) + " digits\" to \"" + std::to_string(most_digits) +
           " digits\"";
}

double rounding_of(Precision precision) {
    return std::ldexp(1.0, numbers_of(precision).epsilon);
}

void need_digits_for(Precision precision) {
    constexpr int to_spare = 20;
    need_digits(decimals_of(precision) + to_spare);
}

int bits_of(Precision precision) {
    return numbers_of(precision).bits;
}

int parts_of(Precision precision) {
    constexpr int bits_of_double = 53;
    return (bits_of(precision) + bits_of_double - 1) / bits_of_double;
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
