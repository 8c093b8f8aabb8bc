// SPDX-License-Identifier: GPL-2.0-or-later
// The coefficients of a spline, its values, and the file that it comes from.
#include "generator/formula/spline.hpp"

#include <fmt/format.h>

#include <cln/cln.h>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <string_view>
#include <utility>

#include "generator/formula/text/source.hpp"

namespace lobatto {
namespace {

using cln::cl_R;
using GiNaC::ex;

constexpr double slack = 1e-9;  // of the width of a table: as much beyond its ends is rounding

// Second derivatives M at the knots (D61), by elimination along the three diagonals.
std::vector<cl_R> second_derivatives(const std::vector<cl_R>& x, const std::vector<cl_R>& y) {
    const std::size_t n = x.size();
    std::vector<cl_R> M(n, 0), h, slope;
    for (std::size_t i = 0; i + 1 < n; ++i) {
        h.push_back(x[i + 1] - x[i]);
        slope.push_back((y[i + 1] - y[i]) / h[i]);
    }
    if (n == 2) return M;
    if (n == 3) return std::vector<cl_R>(3, 2 * (slope[1] - slope[0]) / (h[0] + h[1]));
    std::vector<cl_R> diagonal(n), above(n), right(n);
    for (std::size_t i = 1; i + 1 < n; ++i) {
        cl_R below = h[i - 1];
        diagonal[i] = 2 * (h[i - 1] + h[i]);
        above[i] = h[i];
        right[i] = 6 * (slope[i] - slope[i - 1]);
        if (i == 1) {  // M_0 = (1 + r) M_1 - r M_2
            const cl_R r = h[0] / h[1];
            diagonal[i] = diagonal[i] + h[0] * (1 + r);
            above[i] = above[i] - h[0] * r;
        }
        if (i + 2 == n) {  // M_n-1 = (1 + r) M_n-2 - r M_n-3
            const cl_R r = h[n - 2] / h[n - 3];
            diagonal[i] = diagonal[i] + h[n - 2] * (1 + r);
            below = below - h[n - 2] * r;
        }
        if (i > 1) {
            const cl_R factor = below / diagonal[i - 1];
            diagonal[i] = diagonal[i] - factor * above[i - 1];
            right[i] = right[i] - factor * right[i - 1];
        }
    }
    for (std::size_t i = n - 2; i > 0; --i)
        M[i] = (right[i] - (i + 2 < n ? cl_R(above[i] * M[i + 1]) : cl_R(0))) / diagonal[i];
    M[0] = M[1] + h[0] / h[1] * (M[1] - M[2]);
    M[n - 1] = M[n - 2] + h[n - 2] / h[n - 3] * (M[n - 2] - M[n - 3]);
    return M;
}

template <class Number>
std::size_t piece_at(const std::vector<Number>& x, const Number& u) {
    const auto after = std::upper_bound(x.begin() + 1, x.end() - 1, u);
    return static_cast<std::size_t>(after - x.begin()) - 1;
}

template <class Number>
Number derivative_at(const std::array<Number, 4>& c, int order, const Number& d) {
    switch (order) {
        case 0:
            return ((c[3] * d + c[2]) * d + c[1]) * d + c[0];
        case 1:
            return (3 * c[3] * d + 2 * c[2]) * d + c[1];
        case 2:
            return 6 * c[3] * d + 2 * c[2];
        default:
            return 6 * c[3];
    }
}

std::map<int, Spline>& all_splines() {
    static std::map<int, Spline> all;
    return all;
}

ex differentiate(const ex& number, const ex& order, const ex& u, unsigned) {
    return order.is_equal(3) ? ex(0) : ex(table_value(number, order + 1, u));
}

// One line of a file: two numbers, apart by a comma, a semicolon or blanks.
class Line {
public:
    Line(const Source& source, std::string_view text, int number) : source_(source), text_(text), number_(number) {}

    bool is_empty() {
        skip_blanks();
        return next_ == text_.size() || text_[next_] == '#';
    }
    // Words only: it begins with none of a number's signs, and no field between commas, semicolons or tabs is a number.
    bool is_heading() const {
        if (is_digit(text_[next_]) || std::string_view("+-.").find(text_[next_]) != std::string_view::npos)
            return false;
        for (std::size_t begin = next_; begin < text_.size();) {
            const std::size_t end = std::min(text_.find_first_of(",;\t", begin), text_.size());
            const std::size_t first = std::min(text_.find_first_not_of(" \r", begin), end),
                              last = text_.find_last_not_of(" \r", end - 1) + 1;
            double ignored = 0;
            if (first < last &&
                std::from_chars(text_.data() + first, text_.data() + last, ignored).ptr == text_.data() + last)
                return false;
            begin = end + 1;
        }
        return true;
    }
    // Exact; "1e-3" too.
    cl_R number(const char* what) {
        const std::size_t begin = next_;
        const auto skip_digits = [&] {
            std::size_t count = 0;
            for (; next_ < text_.size() && is_digit(text_[next_]); ++next_) ++count;
            return count;
        };
        const auto skip_sign = [&] { next_ += next_ < text_.size() && (text_[next_] == '+' || text_[next_] == '-'); };
        skip_sign();
        std::size_t digits = skip_digits();
        if (next_ < text_.size() && text_[next_] == '.') {
            ++next_;
            digits += skip_digits();
        }
        bool good = digits > 0 && digits <= most_digits;
        int exponent = 0;
        if (good && next_ < text_.size() && (text_[next_] == 'e' || text_[next_] == 'E')) {
            const std::size_t from = ++next_;
            skip_sign();
            const std::size_t first = next_;
            good = skip_digits() > 0 && next_ - first <= 3;
            if (good) exponent = std::stoi(std::string(text_.substr(from, next_ - from)));
        }
        if (!good)
            fail(begin,
                 fmt::format("{} is missing, or is not a finite number such as 1.25 or 1e-3: a line has two of them",
                             what));
        return value(text_.substr(begin, next_ - begin), exponent, begin);
    }
    void separator() {
        skip_blanks();
        if (next_ < text_.size() && (text_[next_] == ',' || text_[next_] == ';')) ++next_;
        skip_blanks();
    }
    [[noreturn]] void fail(std::size_t byte, const std::string& message) const {
        source_.fail({number_, static_cast<int>(byte) + 1}, message);
    }
    std::size_t place() const { return next_; }

private:
    static constexpr std::size_t most_digits = 100;
    static bool is_digit(char c) { return c >= '0' && c <= '9'; }
    void skip_blanks() {
        while (next_ < text_.size() && (text_[next_] == ' ' || text_[next_] == '\t' || text_[next_] == '\r')) ++next_;
    }
    cl_R value(std::string_view written, int exponent, std::size_t begin) const {
        cln::cl_I digits = 0;
        bool negative = false, after_point = false;
        for (const char c : written) {
            if (c == 'e' || c == 'E') break;
            negative = negative || c == '-';
            if (c == '.') after_point = true;
            if (!is_digit(c)) continue;
            digits = 10 * digits + (c - '0');
            exponent -= after_point ? 1 : 0;
        }
        if (exponent > 300 || exponent < -400) fail(begin, "this number is beyond 1e-300 to 1e300");
        const cln::cl_RA exact = (negative ? -digits : digits) * cln::expt(cln::cl_RA(10), exponent);
        if (exact != 0 &&
            (cln::abs(exact) > cln::expt(cln::cl_RA(10), 300) || cln::abs(exact) < cln::expt(cln::cl_RA(10), -300)))
            fail(begin, "this number is beyond 1e-300 to 1e300");
        return exact;
    }

    const Source& source_;
    std::string_view text_;
    int number_;
    std::size_t next_ = 0;
};

}  // namespace

Spline::Spline(std::string file, std::vector<cl_R> x, const std::vector<cl_R>& y)
    : file_(std::move(file)), x_(std::move(x)) {
    const auto format = cln::float_format(60);
    std::vector<cl_R> values;
    for (cl_R& place : x_) place = cln::cl_float(place, format);
    for (const cl_R& value : y) values.push_back(cln::cl_float(value, format));
    const std::vector<cl_R> M = second_derivatives(x_, values);
    for (std::size_t i = 0; i + 1 < x_.size(); ++i) {
        const cl_R h = x_[i + 1] - x_[i];
        const cl_R slope = (values[i + 1] - values[i]) / h - h * (2 * M[i] + M[i + 1]) / 6;
        coefficients_.push_back({values[i], slope, M[i] / 2, (M[i + 1] - M[i]) / (6 * h)});
        rounded_.emplace_back();
        for (std::size_t k = 0; k < 4; ++k) rounded_.back()[k] = cln::double_approx(coefficients_.back()[k]);
    }
    for (const cl_R& place : x_) rounded_x_.push_back(cln::double_approx(place));
}

bool Spline::covers(const cl_R& u) const {
    const cl_R beyond = cln::rational(cln::cl_float(slack)) * (x_.back() - x_.front());
    return u >= x_.front() - beyond && u <= x_.back() + beyond;
}

cl_R Spline::operator()(int order, const cl_R& u) const {
    const std::size_t i = piece_at(x_, u);
    return derivative_at<cl_R>(coefficients_[i], order, u - x_[i]);
}

double Spline::operator()(int order, double u) const {
    const double beyond = slack * (rounded_x_.back() - rounded_x_.front());
    if (!(u >= rounded_x_.front() - beyond && u <= rounded_x_.back() + beyond))
        return std::numeric_limits<double>::quiet_NaN();
    const std::size_t i = piece_at(rounded_x_, u);
    return derivative_at(rounded_[i], order, u - rounded_x_[i]);
}

int number_of(Spline spline) {
    std::string content = spline.file();
    for (std::size_t i = 0; i < spline.x().size(); ++i) {
        content += fmt::format("\n{}", cln::double_approx(spline.x()[i]));
        if (i < spline.coefficients().size())
            for (const cl_R& c : spline.coefficients()[i]) content += fmt::format(",{}", cln::double_approx(c));
    }
    std::uint32_t hash = 2166136261u;  // FNV-1a
    for (const char c : content) hash = (hash ^ static_cast<unsigned char>(c)) * 16777619u;
    const auto is_same = [&](const Spline& other) {
        return other.file() == spline.file() && other.x() == spline.x() &&
               other.coefficients() == spline.coefficients();
    };
    int number = static_cast<int>(hash % most_splines);
    for (; all_splines().contains(number); number = (number + 1) % most_splines)
        if (is_same(all_splines().at(number))) return number;
    all_splines().emplace(number, std::move(spline));
    return number;
}

const Spline& spline_of(int number) {
    return all_splines().at(number);
}

std::string spline_name(int number) {
    return fmt::format("table_{:07x}", number);
}

// The program and the library may both be in one process: two of this name.
REGISTER_FUNCTION(table_value, derivative_func(differentiate).overloaded(2))

bool is_table_value(const ex& expression) {
    return GiNaC::is_a<GiNaC::function>(expression) &&
           GiNaC::ex_to<GiNaC::function>(expression).get_serial() == table_value_SERIAL::serial;
}

Spline read_spline(const Source& file, const std::string& name) {
    std::vector<cl_R> x, y;
    const std::string& content = file.content();
    int number = 0;
    bool is_first = true;
    for (std::size_t begin = 0; begin < content.size();) {
        const std::size_t end = std::min(content.find('\n', begin), content.size());
        Line line(file, std::string_view(content).substr(begin, end - begin), ++number);
        begin = end + 1;
        if (line.is_empty()) continue;
        if (std::exchange(is_first, false) && line.is_heading()) continue;
        const std::size_t place = line.place();
        x.push_back(line.number("the argument"));
        line.separator();
        y.push_back(line.number("the value"));
        line.separator();
        if (!line.is_empty()) line.fail(line.place(), "a line has two numbers, an argument and its value, and no more");
        if (x.size() > 1 && x[x.size() - 2] >= x.back())
            line.fail(place, "arguments must ascend: this one is not above that of the line before");
        if (x.size() > Spline::most_points)
            line.fail(0, fmt::format("more than {} points; leave some out", Spline::most_points));
    }
    if (x.size() < 2) file.fail({std::max(number, 1), 1}, "a table needs two points or more, one a line: 0.5, 1.25");
    return Spline(name, std::move(x), y);
}

}  // namespace lobatto
