// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/sweep/draw.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "analysis/overrides.hpp"
#include "generator/formula/expression.hpp"

namespace lobatto {

namespace {

// FNV-1a: which stream of random numbers a name has.
std::uint64_t stream_of(const std::string& name) {
    std::uint64_t hash = 0xcbf29ce484222325;
    for (const char c : name) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3;
    return hash;
}

// log x by its series in (m - 1)/(m + 1), x = m 2^e with m near 1: below two units in the last place.
double logarithm_of(double x) {
    int exponent = 0;
    double m = std::frexp(x, &exponent);
    if (m < 0.70710678118654752) m *= 2, --exponent;
    const double s = (m - 1) / (m + 1), square = s * s;
    double sum = 0;
    for (int k = 23; k >= 1; k -= 2) sum = sum * square + 1.0 / k;
    constexpr double log_2 = 0.69314718055994530942;
    return 2 * s * sum + exponent * log_2;
}

template <std::size_t count>
double polynomial(const double (&coefficients)[count], double x) {
    double sum = 0;
    for (std::size_t k = count; k-- > 0;) sum = sum * x + coefficients[k];
    return sum;
}

// NAME ~ DISTRIBUTION(NUMBER, NUMBER)
class DrawReader {
public:
    DrawReader(const Scene& scene, const std::string& argument)
        : scene_(scene), argument_(argument), source_("--draw", argument) {}

    Draw run() {
        const std::string form = "NAME ~ normal(MEAN, SD) or NAME ~ uniform(FROM, TO), such as \"q ~ normal(0, 0.1)\"";
        const std::size_t tilde = argument_.find('~');
        if (tilde == std::string::npos) source_.fail({1, 1}, "expected " + form);
        Draw draw;
        const auto first = word(0, tilde);
        const std::string& name = first.first;
        const Position name_at = position(first.second);
        if (name.empty()) source_.fail({1, 1}, "expected " + form);
        draw.of =
            varied_name(scene_, name, "name", [&](const std::string& message) { source_.fail(name_at, message); });
        if (draw.of.is_setting())
            source_.fail(name_at, fmt::format("'{}' is a setting of the method and cannot be drawn; give its "
                                              "values with --vary",
                                              name));
        const std::size_t open = argument_.find('(', tilde);
        const std::size_t close = argument_.find_last_not_of(" \t");
        const auto [distribution, at] = word(tilde + 1, std::min(open, argument_.size()));
        if (distribution == "normal")
            draw.distribution = Draw::Distribution::normal;
        else if (distribution != "uniform")
            source_.fail(position(at),
                         fmt::format("'{}' is no distribution; there are normal and uniform", distribution));
        if (open == std::string::npos || argument_[close] != ')')
            source_.fail(position(at), "expected two numbers in parentheses, such as " + distribution + "(0, 1)");
        const std::size_t comma = comma_between(open + 1, close);
        if (comma == close) source_.fail(position(open), "expected two numbers, such as " + distribution + "(0, 1)");
        const bool is_normal = draw.distribution == Draw::Distribution::normal;
        draw.first = number(open + 1, comma, is_normal ? "the mean of " : "the least value of ", name);
        draw.second =
            number(comma + 1, close, is_normal ? "the standard deviation of " : "the largest value of ", name);
        if (is_normal ? !(draw.second > 0) : !(draw.second > draw.first))
            source_.fail(position(comma + 1),
                         is_normal
                             ? fmt::format("the standard deviation is {:.6g}; it must be positive", draw.second)
                             : fmt::format("uniform({:.6g}, {:.6g}) has nothing between its ends; the second must be "
                                           "larger than the first",
                                           draw.first, draw.second));
        draw.written = argument_.substr(at, close + 1 - at);
        for (char& c : draw.written)
            if (static_cast<unsigned char>(c) < 0x20) c = ' ';  // it becomes a line of the table's head
        return draw;
    }

private:
    Position position(std::size_t at) const { return text_of(argument_, at).at.front(); }

    // Without blanks, and where it begins.
    std::pair<std::string, std::size_t> word(std::size_t begin, std::size_t end) const {
        while (begin < end && argument_[begin] == ' ') ++begin;
        while (end > begin && argument_[end - 1] == ' ') --end;
        return {argument_.substr(begin, end - begin), begin};
    }

    // The first outside parentheses; `end` where there is none.
    std::size_t comma_between(std::size_t begin, std::size_t end) const {
        int depth = 0;
        for (std::size_t i = begin; i < end; ++i) {
            if (argument_[i] == '(') ++depth;
            if (argument_[i] == ')') --depth;
            if (argument_[i] == ',' && depth == 0) return i;
        }
        return end;
    }

    double number(std::size_t begin, std::size_t end, const std::string& what, const std::string& name) const {
        const Scope scope{nullptr, what + name, false, {}};
        const Text text = text_of(argument_, begin, end);
        return value_in_range(source_, text.at.front(), parse_expression(source_, text, scope), what + name)
            .to_double();
    }

    const Scene& scene_;
    const std::string& argument_;
    Source source_;
};

}  // namespace

std::array<std::uint32_t, 4> philox(std::array<std::uint32_t, 4> counter, std::array<std::uint32_t, 2> key) {
    for (int round = 0; round < 10; ++round) {
        const std::uint64_t first = std::uint64_t{0xd2511f53} * counter[0],
                            second = std::uint64_t{0xcd9e8d57} * counter[2];
        counter = {static_cast<std::uint32_t>(second >> 32) ^ counter[1] ^ key[0], static_cast<std::uint32_t>(second),
                   static_cast<std::uint32_t>(first >> 32) ^ counter[3] ^ key[1], static_cast<std::uint32_t>(first)};
        key[0] += 0x9e3779b9;
        key[1] += 0xbb67ae85;
    }
    return counter;
}

double normal_quantile(double p) {
    static constexpr double a[] = {3.3871328727963666080e0, 1.3314166789178437745e2, 1.9715909503065514427e3,
                                   1.3731693765509461125e4, 4.5921953931549871457e4, 6.7265770927008700853e4,
                                   3.3430575583588128105e4, 2.5090809287301226727e3},
                            b[] = {1,
                                   4.2313330701600911252e1,
                                   6.8718700749205790830e2,
                                   5.3941960214247511077e3,
                                   2.1213794301586595867e4,
                                   3.9307895800092710610e4,
                                   2.8729085735721942674e4,
                                   5.2264952788528545610e3},
                            c[] = {1.42343711074968357734e0,  4.63033784615654529590e0, 5.76949722146069140550e0,
                                   3.64784832476320460504e0,  1.27045825245236838258e0, 2.41780725177450611770e-1,
                                   2.27238449892691845833e-2, 7.74545014278341407640e-4},
                            d[] = {1,
                                   2.05319162663775882187e0,
                                   1.67638483018380384940e0,
                                   6.89767334985100004550e-1,
                                   1.48103976427480074590e-1,
                                   1.51986665636164571966e-2,
                                   5.47593808499534494600e-4,
                                   1.05075007164441684324e-9},
                            e[] = {6.65790464350110377720e0,  5.46378491116411436990e0,  1.78482653991729133580e0,
                                   2.96560571828504891230e-1, 2.65321895265761230930e-2, 1.24266094738807843860e-3,
                                   2.71155556874348757815e-5, 2.01033439929228813265e-7},
                            f[] = {1,
                                   5.99832206555887937690e-1,
                                   1.36929880922735805310e-1,
                                   1.48753612908506148525e-2,
                                   7.86869131145613259100e-4,
                                   1.84631831751005468180e-5,
                                   1.42151175831644588870e-7,
                                   2.04426310338993978564e-15};
    const double q = p - 0.5;
    if (std::fabs(q) <= 0.425) {
        const double r = 0.180625 - q * q;
        return q * polynomial(a, r) / polynomial(b, r);
    }
    const double r = std::sqrt(-logarithm_of(q < 0 ? p : 1 - p));
    const double size =
        r <= 5 ? polynomial(c, r - 1.6) / polynomial(d, r - 1.6) : polynomial(e, r - 5) / polynomial(f, r - 5);
    return q < 0 ? -size : size;
}

double Draw::value(std::uint64_t seed, std::int64_t row) const {
    const std::uint64_t stream = stream_of(of.name), number = static_cast<std::uint64_t>(row);
    const auto low = [](std::uint64_t x) { return static_cast<std::uint32_t>(x); };
    const std::array<std::uint32_t, 4> bits =
        philox({low(number), low(number >> 32), low(stream), low(stream >> 32)}, {low(seed), low(seed >> 32)});
    const std::uint64_t most = (static_cast<std::uint64_t>(bits[0]) << 32 | bits[1]) >> 11;  // 53 bits
    constexpr double unit = 1.0 / 9007199254740992.0;                                        // 2^-53
    if (distribution == Distribution::uniform) return first + (second - first) * (static_cast<double>(most) * unit);
    return first + second * normal_quantile((static_cast<double>(most >> 1) + 0.5) * (2 * unit));
}

Draw read_draw(const Scene& scene, const std::string& argument) {
    return DrawReader(scene, argument).run();
}

}  // namespace lobatto
