// SPDX-License-Identifier: MIT
#include "runtime/files/decimal.hpp"

#include <gmpxx.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <vector>

namespace lobatto {

namespace {

long bits_of(const mpz_class& whole) {
    return whole == 0 ? 0 : static_cast<long>(mpz_sizeinbase(whole.get_mpz_t(), 2));
}

mpz_class power_of_ten(long exponent) {
    mpz_class power;
    mpz_ui_pow_ui(power.get_mpz_t(), 10, static_cast<unsigned long>(exponent));
    return power;
}

// a/b, not negative, to the nearest whole number; ties to even.
mpz_class nearest_quotient(const mpz_class& a, const mpz_class& b) {
    mpz_class quotient, twice;
    mpz_fdiv_qr(quotient.get_mpz_t(), twice.get_mpz_t(), a.get_mpz_t(), b.get_mpz_t());
    twice *= 2;
    if (twice > b || (twice == b && mpz_odd_p(quotient.get_mpz_t()) != 0)) ++quotient;
    return quotient;
}

// whole * 2^exponent
struct Binary {
    mpz_class whole;
    long exponent = 0;

    Binary(mpz_class of_whole, long of_two) : whole(std::move(of_whole)), exponent(of_two) {}
    // The sum of the parts.
    Binary(const double* parts, int count) : exponent(2000) {
        for (int i = 0; i < count; ++i)
            if (parts[i] != 0) exponent = std::min(exponent, lowest_bit(parts[i]));
        for (int i = 0; i < count; ++i) {
            if (parts[i] == 0) continue;
            const long here = lowest_bit(parts[i]);
            const mpz_class part(std::ldexp(parts[i], static_cast<int>(-here)));
            whole += part << static_cast<unsigned long>(here - exponent);
        }
    }

    // Its nearest double, which is taken away.
    double take() {
        if (whole == 0) return 0;
        const long lowest = std::max(exponent + bits_of(whole) - 53, -1074L), dropped = std::max(lowest - exponent, 0L);
        const mpz_class unit = mpz_class(1) << static_cast<unsigned long>(dropped);
        const mpz_class kept = sgn(whole) * nearest_quotient(abs(whole), unit);
        whole -= kept * unit;
        return std::ldexp(kept.get_d(), static_cast<int>(exponent + dropped));
    }

private:
    static long lowest_bit(double part) { return std::max(std::ilogb(part) - 52L, -1074L); }
};

// `digits` significant digits of a value that is not zero, rounded, and the exponent of ten of the first.
std::string digits_of(const Binary& value, int digits, long& exponent) {
    const auto power_of_two = [](long of) -> mpz_class {
        return mpz_class(1) << static_cast<unsigned long>(std::max(of, 0L));
    };
    exponent =
        static_cast<long>(std::floor(static_cast<double>(bits_of(value.whole) - 1 + value.exponent) * std::log10(2.0)));
    while (true) {
        const long scale = digits - 1 - exponent;
        const mpz_class above = abs(value.whole) * power_of_two(value.exponent) * power_of_ten(std::max(scale, 0L)),
                        below = power_of_two(-value.exponent) * power_of_ten(std::max(-scale, 0L));
        std::string text = nearest_quotient(above, below).get_str();
        if (std::ssize(text) == digits) return text;
        exponent += std::ssize(text) - digits;
    }
}

std::string written(bool negative, std::string digits, long exponent) {
    digits.erase(digits.find_last_not_of('0') + 1);
    const long count = std::ssize(digits);
    std::string text = negative ? "-" : "";
    if (exponent < -5 || exponent >= 21) {
        text += digits.substr(0, 1) + (count > 1 ? "." + digits.substr(1) : "") + "e" + (exponent < 0 ? "-" : "+");
        const std::string number = std::to_string(std::labs(exponent));
        return text + (number.size() < 2 ? "0" : "") + number;
    }
    if (exponent < 0) return text + "0." + std::string(static_cast<std::size_t>(-exponent - 1), '0') + digits;
    if (count <= exponent + 1) return text + digits + std::string(static_cast<std::size_t>(exponent + 1 - count), '0');
    return text + digits.insert(static_cast<std::size_t>(exponent + 1), ".");
}

}  // namespace

std::string decimal_text(const double* parts, int count) {
    const bool has_rest = std::any_of(parts + 1, parts + count, [](double part) { return part != 0; });
    if (count == 1 || !std::isfinite(parts[0]) || (parts[0] == 0 && !has_rest)) {
        char digits[32];
        return {digits, std::to_chars(digits, digits + sizeof digits, parts[0]).ptr};
    }
    const Binary value(parts, count);
    std::vector<double> read(static_cast<std::size_t>(count));
    constexpr int most = 1200;  // more than sums of doubles have
    for (int digits = 16 * count; digits < most; digits += digits < 16 * count + 4 ? 1 : digits / 4) {
        long exponent = 0;
        const std::string figures = digits_of(value, digits, exponent);
        std::string text = written(sgn(value.whole) < 0, figures, exponent);
        if (read_decimal(text, read.data(), count) && std::equal(read.begin(), read.end(), parts)) return text;
    }
    long exponent = 0;
    return written(sgn(value.whole) < 0, digits_of(value, most, exponent), exponent);
}

bool read_decimal(std::string_view text, double* parts, int count) {
    std::fill(parts, parts + count, 0.0);
    const auto read = std::from_chars(text.data(), text.data() + text.size(), parts[0]);
    const bool is_number = read.ec == std::errc() && read.ptr == text.data() + text.size();
    if (!is_number || count == 1 || parts[0] == 0 || !std::isfinite(parts[0])) return is_number;
    std::string digits;
    long exponent = 0;
    bool after_point = false;
    std::size_t at = 0;
    for (; at < text.size() && text[at] != 'e' && text[at] != 'E'; ++at) {
        if (text[at] == '.')
            after_point = true;
        else
            digits += text[at];
        if (text[at] != '.' && after_point) --exponent;
    }
    if (at < text.size()) {
        long given = 0;
        const std::size_t sign = text[at + 1] == '+' ? 1 : 0;
        std::from_chars(text.data() + at + 1 + sign, text.data() + text.size(), given);
        exponent += given;
    }
    const mpz_class whole(digits, 10);
    Binary rest(whole * power_of_ten(std::max(exponent, 0L)), 0);
    if (exponent < 0) {
        rest.exponent = -(static_cast<long>(std::ceil(static_cast<double>(-exponent) * 3.33)) + 53L * count + 128);
        rest.whole = (whole << static_cast<unsigned long>(-rest.exponent)) / power_of_ten(-exponent);
    }
    for (int i = 0; i < count; ++i) parts[i] = rest.take();
    return true;
}

}  // namespace lobatto
