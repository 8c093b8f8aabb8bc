// SPDX-License-Identifier: MIT
#include "runtime/run/decimal.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <vector>

namespace lobatto {

namespace {

// A whole number, in words of 32 bits, the lowest first; the highest is not zero.
class Natural {
public:
    Natural() = default;
    explicit Natural(std::uint64_t x) : words_{static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(x >> 32)} {
        trim();
    }

    bool is_zero() const { return words_.empty(); }
    long bits() const { return is_zero() ? 0 : 32 * std::ssize(words_) - __builtin_clz(words_.back()); }
    bool bit(long i) const {
        const auto word = static_cast<std::size_t>(i / 32);
        return word < words_.size() && ((words_[word] >> (i % 32)) & 1) != 0;
    }
    bool any_below(long i) const {
        for (long j = 0; j < i; ++j)
            if (bit(j)) return true;
        return false;
    }

    // *this = *this * factor + summand
    void multiply(std::uint32_t factor, std::uint32_t summand = 0) {
        std::uint64_t carry = summand;
        for (std::uint32_t& word : words_) {
            carry += static_cast<std::uint64_t>(word) * factor;
            word = static_cast<std::uint32_t>(carry);
            carry >>= 32;
        }
        if (carry != 0) words_.push_back(static_cast<std::uint32_t>(carry));
    }
    std::uint32_t divide(std::uint32_t divisor) {  // the remainder
        std::uint64_t rest = 0;
        for (auto word = words_.rbegin(); word != words_.rend(); ++word) {
            rest = (rest << 32) | *word;
            *word = static_cast<std::uint32_t>(rest / divisor);
            rest %= divisor;
        }
        trim();
        return static_cast<std::uint32_t>(rest);
    }
    void shift_left(long places) {
        if (is_zero()) return;
        const auto whole = static_cast<std::size_t>(places / 32);
        if (places % 32 != 0) multiply(std::uint32_t(1) << (places % 32));
        words_.insert(words_.begin(), whole, 0);
    }
    // Rounded to nearest, ties to even; `sticky`: something below was lost before.
    void shift_right(long places, bool sticky) {
        if (places <= 0) return;
        const bool half = bit(places - 1), rest = sticky || any_below(places - 1);
        Natural shifted;
        for (long i = places; i < bits(); i += 32) {
            std::uint32_t word = 0;
            for (int j = 0; j < 32; ++j) word |= static_cast<std::uint32_t>(bit(i + j)) << j;
            shifted.words_.push_back(word);
        }
        shifted.trim();
        if (half && (rest || shifted.bit(0))) shifted.add(Natural(1));
        *this = shifted;
    }
    void add(const Natural& other) {
        words_.resize(std::max(words_.size(), other.words_.size()) + 1);
        std::uint64_t carry = 0;
        for (std::size_t i = 0; i < words_.size(); ++i) {
            carry += static_cast<std::uint64_t>(words_[i]) + (i < other.words_.size() ? other.words_[i] : 0);
            words_[i] = static_cast<std::uint32_t>(carry);
            carry >>= 32;
        }
        trim();
    }
    // |*this - other|; true where other was larger.
    bool subtract(const Natural& other) {
        const bool larger = *this < other;
        const Natural &a = larger ? other : *this, &b = larger ? *this : other;
        std::vector<std::uint32_t> result(a.words_.size());
        std::int64_t borrow = 0;
        for (std::size_t i = 0; i < a.words_.size(); ++i) {
            borrow += static_cast<std::int64_t>(a.words_[i]) - (i < b.words_.size() ? b.words_[i] : 0);
            result[i] = static_cast<std::uint32_t>(borrow);
            borrow >>= 32;
        }
        words_ = std::move(result);
        trim();
        return larger;
    }
    friend bool operator<(const Natural& a, const Natural& b) {
        if (a.words_.size() != b.words_.size()) return a.words_.size() < b.words_.size();
        return std::lexicographical_compare(a.words_.rbegin(), a.words_.rend(), b.words_.rbegin(), b.words_.rend());
    }
    std::string text() const {
        Natural rest = *this;
        std::string digits;
        while (!rest.is_zero()) digits += static_cast<char>('0' + rest.divide(10));
        std::reverse(digits.begin(), digits.end());
        return digits.empty() ? "0" : digits;
    }
    double top(long count) const {  // of the highest `count` <= 64 bits, as a whole number
        std::uint64_t value = 0;
        for (long i = bits() - 1; i >= std::max(bits() - count, 0L); --i) value = 2 * value + (bit(i) ? 1 : 0);
        return static_cast<double>(value);
    }

private:
    void trim() {
        while (!words_.empty() && words_.back() == 0) words_.pop_back();
    }
    std::vector<std::uint32_t> words_;
};

void multiply_by_power_of_ten(Natural& x, long exponent) {
    for (; exponent >= 9; exponent -= 9) x.multiply(1000000000);
    for (; exponent > 0; --exponent) x.multiply(10);
}
bool divide_by_power_of_ten(Natural& x, long exponent) {  // whether something was lost
    bool lost = false;
    for (; exponent >= 9; exponent -= 9) lost = x.divide(1000000000) != 0 || lost;
    for (; exponent > 0; --exponent) lost = x.divide(10) != 0 || lost;
    return lost;
}

// sign * magnitude * 2^exponent
struct Binary {
    bool negative = false;
    Natural magnitude;
    long exponent = 0;

    Binary(const double* parts, int count) {
        exponent = 2000;
        for (int i = 0; i < count; ++i)
            if (parts[i] != 0) exponent = std::min(exponent, std::max(std::ilogb(parts[i]) - 52L, -1074L));
        Natural above, below;
        for (int i = 0; i < count; ++i) {
            if (parts[i] == 0) continue;
            const long here = std::max(std::ilogb(parts[i]) - 52L, -1074L);
            Natural whole(static_cast<std::uint64_t>(std::ldexp(std::fabs(parts[i]), static_cast<int>(-here))));
            whole.shift_left(here - exponent);
            (parts[i] < 0 ? below : above).add(whole);
        }
        negative = above.subtract(below);
        magnitude = above;
    }
    Binary(bool is_negative, Natural whole, long of_two)
        : negative(is_negative), magnitude(std::move(whole)), exponent(of_two) {}

    // Its nearest double, which is taken away.
    double take() {
        if (magnitude.is_zero()) return 0;
        const long bits = magnitude.bits(), lowest = std::max(exponent + bits - 53, -1074L),
                   dropped = lowest - exponent;
        Natural rounded = magnitude;
        if (dropped > 0) rounded.shift_right(dropped, false);
        const double value = std::ldexp(rounded.top(64), static_cast<int>(std::max(lowest, exponent)));
        if (dropped > 0) rounded.shift_left(dropped);
        const bool sign = negative;
        if (magnitude.subtract(rounded)) negative = !negative;
        return sign ? -value : value;
    }
};

// `digits` significant digits of a value that is not zero, rounded, and the exponent of ten of the first.
std::string digits_of(const Binary& value, int digits, long& exponent) {
    exponent = static_cast<long>(
        std::floor((static_cast<double>(value.magnitude.bits() - 1 + value.exponent)) * 0.30102999566398120));
    while (true) {
        const long scale = digits - 1 - exponent;
        Natural whole = value.magnitude;
        bool lost = false;
        long shift = value.exponent - 2;
        whole.shift_left(2);
        if (scale >= 0) multiply_by_power_of_ten(whole, scale);
        if (shift > 0) whole.shift_left(shift);
        if (scale < 0) {
            if (shift > 0) whole.shift_left(2), shift = -2;
            lost = divide_by_power_of_ten(whole, -scale);
        }
        if (shift < 0) whole.shift_right(-shift, lost);
        std::string text = whole.text();
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
    if (!has_rest && (count == 1 || parts[0] == 0 || !std::isfinite(parts[0]))) {
        char digits[32];
        return {digits, std::to_chars(digits, digits + sizeof digits, parts[0]).ptr};
    }
    const Binary value(parts, count);
    std::vector<double> read(static_cast<std::size_t>(count));
    constexpr int most = 1200;  // more than sums of doubles have
    for (int digits = 16 * count; digits < most; digits += digits < 16 * count + 4 ? 1 : digits / 4) {
        long exponent = 0;
        const std::string figures = digits_of(value, digits, exponent);
        std::string text = written(value.negative, figures, exponent);
        if (read_decimal(text, read.data(), count) && std::equal(read.begin(), read.end(), parts)) return text;
    }
    long exponent = 0;
    return written(value.negative, digits_of(value, most, exponent), exponent);
}

bool read_decimal(std::string_view text, double* parts, int count) {
    std::fill(parts, parts + count, 0.0);
    const auto read = std::from_chars(text.data(), text.data() + text.size(), parts[0]);
    const bool is_number = read.ec == std::errc() && read.ptr == text.data() + text.size();
    if (!is_number || count == 1 || parts[0] == 0 || !std::isfinite(parts[0])) return is_number;
    const bool negative = text.front() == '-';
    Natural whole;
    long exponent = 0;
    bool after_point = false;
    std::size_t at = negative ? 1 : 0;
    for (; at < text.size() && text[at] != 'e' && text[at] != 'E'; ++at) {
        if (text[at] == '.') {
            after_point = true;
        } else if (whole.is_zero()) {
            whole = Natural(static_cast<std::uint64_t>(text[at] - '0'));
            exponent -= after_point ? 1 : 0;
        } else {
            whole.multiply(10, static_cast<std::uint32_t>(text[at] - '0'));
            exponent -= after_point ? 1 : 0;
        }
    }
    if (at < text.size()) {
        long given = 0;
        const std::size_t sign = text[at + 1] == '+' ? 1 : 0;
        std::from_chars(text.data() + at + 1 + sign, text.data() + text.size(), given);
        exponent += given;
    }
    long of_two = 0;
    if (exponent >= 0) {
        multiply_by_power_of_ten(whole, exponent);
    } else {
        of_two = -(static_cast<long>(std::ceil(static_cast<double>(-exponent) * 3.33)) + 53L * count + 128);
        whole.shift_left(-of_two);
        divide_by_power_of_ten(whole, -exponent);
    }
    Binary rest(negative, whole, of_two);
    for (int i = 0; i < count; ++i) parts[i] = rest.take();
    return true;
}

}  // namespace lobatto
