// SPDX-License-Identifier: GPL-2.0-or-later
// Every operation runs at the working digits and passes through `checked`.
#include "generator/formula/real.hpp"

#include <cln/float.h>
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>

#include "generator/formula/spline.hpp"
#include "generator/formula/switch.hpp"

namespace lobatto {
namespace {

using GiNaC::ex;
using GiNaC::ex_to;
using GiNaC::is_a;
using GiNaC::numeric;

std::atomic<int> digits{60};
// exp(-728) becomes 0 where it becomes a double, as in every other program; CLN would throw.
[[maybe_unused]] const bool underflows_to_zero = cln::cl_inhibit_floating_point_underflow = true;
// |value| <= 2^4096, about 1e1233; beyond it sin() would need millions of digits of pi.
constexpr int largest_magnitude = 4096;

// GiNaC keeps the number of digits in one global.
class Precision {
public:
    Precision() : before_(GiNaC::Digits) { GiNaC::Digits = working_digits(); }
    ~Precision() { GiNaC::Digits = before_; }
    Precision(const Precision&) = delete;
    Precision& operator=(const Precision&) = delete;

private:
    long before_;
};

std::string shown(const numeric& number) {
    return number.is_zero() ? "0" : fmt::format("{:.6g}", number.to_double());
}

[[noreturn]] void fail_beyond_bound() {
    throw NoValue(fmt::format("a number beyond 2^{} occurs", largest_magnitude));
}

numeric bounded(const numeric& number) {
    static const numeric bound = GiNaC::pow(numeric(2), numeric(largest_magnitude));
    if (abs(number) > bound) fail_beyond_bound();
    return number;
}

// Runs one numeric operation; whatever CLN or GiNaC throws, or a complex result, is a NoValue.
template <typename Operation>
numeric checked(const Operation& operation, const std::string& description) {
    const Precision precision;
    numeric result;
    try {
        result = operation();
    } catch (const NoValue&) {
        throw;
    } catch (const std::exception&) {  // a pole, an overflow in CLN, a division by zero
        throw NoValue(description + " is not finite");
    }
    if (!result.is_real()) throw NoValue(description + " is not a real number");
    return bounded(result);
}

template <typename Visit>
std::vector<numeric> each_operand(const ex& expression, const Visit& visit) {
    std::vector<numeric> values;
    for (const ex& operand : expression) values.push_back(visit(operand));
    return values;
}

}  // namespace

int working_digits() {
    return digits;
}

void need_digits(int more) {
    int now = digits;
    while (now < more && !digits.compare_exchange_weak(now, more)) {
    }
}

const std::vector<Function>& functions() {
    // clang-format off
#define LOBATTO_FUNCTION(name) \
    Function{#name, \
             [](const ex& x) -> ex { return GiNaC::name(x); }, \
             [](const numeric& x) -> numeric { return GiNaC::name(x); }}
    // clang-format on
    static const std::vector<Function> all = {LOBATTO_FUNCTION(sqrt), LOBATTO_FUNCTION(sin),  LOBATTO_FUNCTION(cos),
                                              LOBATTO_FUNCTION(tan),  LOBATTO_FUNCTION(exp),  LOBATTO_FUNCTION(log),
                                              LOBATTO_FUNCTION(sinh), LOBATTO_FUNCTION(cosh), LOBATTO_FUNCTION(tanh),
                                              LOBATTO_FUNCTION(asin), LOBATTO_FUNCTION(acos), LOBATTO_FUNCTION(atan)};
#undef LOBATTO_FUNCTION
    return all;
}

const Function* find_function(const std::string& name) {
    const auto found =
        std::find_if(functions().begin(), functions().end(), [&](const Function& f) { return f.name == name; });
    return found == functions().end() ? nullptr : &*found;
}

const std::vector<std::pair<std::string, std::string>>& pieced_functions() {
    static const std::vector<std::pair<std::string, std::string>> all = {
        {"abs", "abs(a)"},        {"sign", "sign(a)"},      {"min", "min(a, b)"},     {"max", "max(a, b)"},
        {"hypot", "hypot(a, b)"}, {"atan2", "atan2(y, x)"}, {"if", "if(a > b, c, d)"}};
    return all;
}

bool is_function_name(const std::string& name) {
    const auto is_named = [&](const auto& function) { return function.first == name; };
    return name == "sum" || name == "mod" || name == "table" || find_function(name) != nullptr ||
           std::any_of(pieced_functions().begin(), pieced_functions().end(), is_named);
}

numeric real_value(const numeric& exact) {
    return checked([&] { return exact.is_zero() ? exact : ex_to<numeric>(exact.evalf()); }, "the number");
}

numeric real_sum(const std::vector<numeric>& terms) {
    return checked(
        [&] {
            const numeric rounding = GiNaC::pow(numeric(10), numeric(10 - working_digits()));
            numeric sum = 0, size = 0;
            for (const numeric& term : terms) {
                sum += term;
                size += abs(term);
            }
            return abs(sum) <= size * rounding ? numeric(0) : sum;
        },
        "a sum");
}

numeric real_product(const std::vector<numeric>& factors) {
    return checked(
        [&] {
            numeric product = 1;
            for (const numeric& factor : factors) product = bounded(product * factor);
            return product;
        },
        "a product");
}

numeric real_power(const numeric& base, const numeric& exponent) {
    if (base.is_zero()) {
        if (exponent.is_negative()) throw NoValue("it divides by zero");
        if (exponent.is_zero()) throw NoValue("0 to the power 0 is not defined");
        return 0;
    }
    return checked(
        [&] {
            // An exponent that happens to be whole is taken as such: (-2)^n is real for n = 3.
            const bool small = abs(exponent) < numeric(1'000'000'000);
            const numeric whole = small ? numeric(std::lround(exponent.to_double())) : exponent;
            return GiNaC::pow(base, whole == exponent ? whole : exponent);
        },
        fmt::format("{} to the power {}", shown(base), shown(exponent)));
}

numeric real_function(const Function& function, const numeric& argument) {
    // Far out CLN throws, or even answers tanh(cosh(373)) = 0; but there these functions are 0, 1, -1 or too large.
    static const numeric far = 1'000'000;
    if (abs(argument) > far) {
        if (function.name == "tanh") return argument.csgn();
        if (function.name == "exp" && argument.is_negative()) return 0;
        if (function.name == "exp" || function.name == "sinh" || function.name == "cosh") fail_beyond_bound();
    }
    const std::string description = fmt::format("{} of {}", function.name, shown(argument));
    const numeric result = checked([&] { return function.value(argument); }, description);
    // Next to a pole of tan, the digits of the argument give a large number instead of none.
    if (function.name == "tan" && abs(result) > GiNaC::pow(numeric(10), numeric(working_digits() - 10)))
        throw NoValue(description + " is not finite");
    return result;
}

numeric real_angle(const numeric& y, const numeric& x) {
    if (y.is_zero() && x.is_zero()) throw NoValue("atan2(0, 0) is no angle");
    return checked([&] { return GiNaC::atan(y, x); }, fmt::format("atan2 of {} and {}", shown(y), shown(x)));
}

bool is_angle(const ex& expression) {
    return is_a<GiNaC::function>(expression) && ex_to<GiNaC::function>(expression).get_name() == "atan2";
}

bool is_pieced(const ex& expression) {
    return is_table_value(expression) || is_angle(expression) ||
           (is_a<GiNaC::power>(expression) && !expression.op(1).info(GiNaC::info_flags::integer));
}

numeric real_table(int number, int order, const numeric& u) {
    const Spline& spline = spline_of(number);
    const cln::cl_R place = cln::the<cln::cl_R>(u.to_cl_N());
    if (!spline.covers(place)) {
        const auto end = [](const cln::cl_R& x) { return cln::double_approx(x); };
        throw NoValue(fmt::format("{} lies outside of the table {}, which goes from {:.6g} to {:.6g}", shown(u),
                                  spline.file(), end(spline.x().front()), end(spline.x().back())));
    }
    return checked([&] { return numeric(spline(order, place)); }, "a value of the table " + spline.file());
}

numeric real_value(const ex& expression, const GiNaC::exmap& symbols) {
    const auto visit = [&](const ex& operand) { return real_value(operand, symbols); };
    if (is_a<numeric>(expression)) return real_value(ex_to<numeric>(expression));
    if (is_a<GiNaC::constant>(expression)) return checked([&] { return ex_to<numeric>(expression.evalf()); }, "pi");
    if (is_a<GiNaC::symbol>(expression)) {
        const auto found = symbols.find(expression);
        if (found == symbols.end())
            throw NoValue(fmt::format("'{}' has no value", ex_to<GiNaC::symbol>(expression).get_name()));
        return visit(found->second);
    }
    if (is_a<GiNaC::add>(expression)) return real_sum(each_operand(expression, visit));
    if (is_a<GiNaC::mul>(expression)) return real_product(each_operand(expression, visit));
    if (is_a<GiNaC::power>(expression)) return real_power(visit(expression.op(0)), visit(expression.op(1)));
    if (is_table_value(expression))
        return real_table(ex_to<numeric>(expression.op(0)).to_int(), ex_to<numeric>(expression.op(1)).to_int(),
                          visit(expression.op(2)));
    if (is_positive_part(expression)) {
        const numeric u = visit(expression.op(0));
        return u.is_negative() ? numeric(0) : u;
    }
    if (is_angle(expression)) return real_angle(visit(expression.op(0)), visit(expression.op(1)));
    const Function* function =
        is_a<GiNaC::function>(expression) ? find_function(ex_to<GiNaC::function>(expression).get_name()) : nullptr;
    if (function == nullptr) throw NoValue("it is not a formula of known functions");
    return real_function(*function, visit(expression.op(0)));
}

}  // namespace lobatto
