// SPDX-License-Identifier: GPL-2.0-or-later
// The graph's two bridges: from GiNaC expressions, and to numbers of the working digits (CLN).
#include <cln/cln.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <optional>

#include "generator/formula/real.hpp"
#include "generator/formula/spline.hpp"
#include "generator/graph/graph.hpp"

namespace lobatto {

namespace {

cln::float_format_t format() {
    return cln::float_format(static_cast<std::uintptr_t>(working_digits()));
}

cln::cl_F real(const cln::cl_R& x) {
    return cln::cl_float(x, format());
}

cln::cl_R real_part_of(const cln::cl_N& z, const char* what) {
    if (!cln::zerop(cln::imagpart(z))) throw DomainError(std::string(what) + " of a value outside its domain");
    return cln::realpart(z);
}

std::optional<Op> function_op(const std::string& name) {
    static const std::map<std::string, Op> ops = {{"sin", Op::sin},      {"cos", Op::cos},
                                                  {"tan", Op::tan},      {"exp", Op::exp},
                                                  {"log", Op::log},      {"sinh", Op::sinh},
                                                  {"cosh", Op::cosh},    {"tanh", Op::tanh},
                                                  {"asin", Op::asin},    {"acos", Op::acos},
                                                  {"atan", Op::atan},    {"atan2", Op::atan2},
                                                  {"side_of", Op::side}, {"positive_part", Op::positive_part}};
    const auto found = ops.find(name);
    return found == ops.end() ? std::nullopt : std::optional<Op>(found->second);
}

const cln::cl_F largest_number =
    cln::cl_float(cln::expt_pos(cln::cl_I(10), 5000), format());  // __float128 ends at 1e4932

// Powers of exact numbers stay exact up to this size.
constexpr double most_bits = 100000;

double bits_of(const cln::cl_RA& x) {
    return static_cast<double>(
        std::max(cln::integer_length(cln::numerator(x)), cln::integer_length(cln::denominator(x))));
}

cln::cl_R value_of(Op op, int exponent, const std::vector<cln::cl_R>& x) {
    // Far out CLN throws, or even answers tanh(1e161) = 0; there these functions are 0, 1, -1 or too large.
    const bool exponential = op == Op::exp || op == Op::sinh || op == Op::cosh || op == Op::tanh;
    if (exponential && cln::abs(x[0]) > 1000000) {
        if (op == Op::tanh) return cln::signum(x[0]);
        if (op == Op::exp && cln::minusp(x[0])) return 0;
        throw DomainError("a value beyond all numbers of the kernel");
    }
    const bool angle = op == Op::sin || op == Op::pair_sine || op == Op::cos || op == Op::pair_cosine || op == Op::tan;
    if (angle && cln::abs(real(x[0])) > largest_number) throw DomainError("a value beyond all numbers of the kernel");
    switch (op) {
        case Op::add:
            return std::accumulate(x.begin(), x.end(), cln::cl_R(0));
        case Op::multiply:
            return std::accumulate(x.begin(), x.end(), cln::cl_R(1), std::multiplies<>());
        case Op::power:
            if (exponent < 0 && cln::zerop(x[0])) throw DomainError("division by zero");
            if (is_rational(x[0]) && bits_of(cln::the<cln::cl_RA>(x[0])) * std::abs(exponent) > most_bits)
                return cln::the<cln::cl_R>(cln::expt(real(x[0]), exponent));
            return cln::the<cln::cl_R>(cln::expt(x[0], exponent));
        case Op::sqrt: {
            if (cln::minusp(x[0])) throw DomainError("square root of a negative number");
            cln::cl_RA root;
            if (is_rational(x[0]) && cln::sqrtp(cln::the<cln::cl_RA>(x[0]), &root)) return root;
            return cln::sqrt(real(x[0]));
        }
        case Op::sin:
        case Op::pair_sine:
            return cln::zerop(x[0]) ? cln::cl_R(0) : cln::cl_R(cln::sin(real(x[0])));
        case Op::cos:
        case Op::pair_cosine:
            return cln::zerop(x[0]) ? cln::cl_R(1) : cln::cl_R(cln::cos(real(x[0])));
        case Op::sincos_pair:
            return x[0];  // carries its argument; the halves above evaluate it
        case Op::tan:
            return cln::zerop(x[0]) ? cln::cl_R(0) : cln::cl_R(cln::tan(real(x[0])));
        case Op::exp:
            return cln::zerop(x[0]) ? cln::cl_R(1) : cln::cl_R(cln::exp(real(x[0])));
        case Op::log:
            if (!cln::plusp(x[0])) throw DomainError("logarithm of a number that is not positive");
            return x[0] == 1 ? cln::cl_R(0) : cln::cl_R(cln::ln(real(x[0])));
        case Op::sinh:
            return cln::zerop(x[0]) ? cln::cl_R(0) : cln::cl_R(cln::sinh(real(x[0])));
        case Op::cosh:
            return cln::zerop(x[0]) ? cln::cl_R(1) : cln::cl_R(cln::cosh(real(x[0])));
        case Op::tanh:
            return cln::zerop(x[0]) ? cln::cl_R(0) : cln::cl_R(cln::tanh(real(x[0])));
        case Op::asin:
            return cln::zerop(x[0]) ? cln::cl_R(0) : real_part_of(cln::asin(real(x[0])), "asin");
        case Op::acos:
            return real_part_of(cln::acos(real(x[0])), "acos");
        case Op::atan:
            return cln::zerop(x[0]) ? cln::cl_R(0) : cln::cl_R(cln::atan(real(x[0])));
        case Op::atan2:
            if (!cln::zerop(x[0])) return cln::atan(real(x[1]), real(x[0]));
            if (cln::zerop(x[1])) throw DomainError("atan2 of 0 and 0");
            return cln::minusp(x[1]) ? cln::cl_R(cln::pi(format())) : cln::cl_R(0);
        case Op::side:
            return cln::plusp(x[0]) ? 1 : -1;
        case Op::positive_part:
            return cln::minusp(x[0]) ? cln::cl_R(0) : x[0];
        case Op::table: {  // a little beyond its ends as at them: a start may be there, and samples near it
            const Spline& spline = spline_of(exponent / 4);
            const cln::cl_R &begin = spline.x().front(), &end = spline.x().back();
            const cln::cl_R margin = (end - begin) / 10;
            if (x[0] < begin - margin || x[0] > end + margin) throw DomainError("a table far beyond its ends");
            return spline(exponent % 4, real(x[0]));
        }
        case Op::raise:
            if (cln::abs(x[1]) <= 4096 && cln::round1(x[1]) == x[1])
                return apply(Op::power, cln::cl_I_to_int(cln::round1(x[1])), {x[0]});  // real for a negative base too
            if (cln::zerop(x[0]) && cln::plusp(x[1])) return 0;
            if (!cln::plusp(x[0])) throw DomainError("real power of a number that is not positive");
            return apply(Op::exp, 0, {real(x[1]) * cln::ln(real(x[0]))});  // far out it is 0 or too large, too
        case Op::constant:
        case Op::input:
            break;
    }
    throw std::logic_error("apply: not an operation");
}

}  // namespace

cln::cl_R apply(Op op, int exponent, const std::vector<cln::cl_R>& operands) {
    try {
        return value_of(op, exponent, operands);
    } catch (const cln::floating_point_overflow_exception&) {
        throw DomainError("a value beyond all numbers of the kernel");
    }
}

std::vector<cln::cl_R> Graph::evaluate(const std::vector<cln::cl_R>& inputs, const std::vector<Id>& roots) const {
    std::vector<cln::cl_R> values(nodes_.size());
    for (const Id id : topological(roots)) {
        const Node& node = (*this)[id];
        cln::cl_R& value = values[static_cast<std::size_t>(id)];
        if (node.op == Op::constant) {
            value = constant_of(id).value;
        } else if (node.op == Op::input) {
            value = inputs[static_cast<std::size_t>(node.index)];
        } else {
            std::vector<cln::cl_R> operands;
            for (const Id operand : node.operands) operands.push_back(values[static_cast<std::size_t>(operand)]);
            value = apply(node.op, node.index, operands);
        }
    }
    return values;
}

// Whether a sum is the negative of its preferred form: the rational constant in it positive, else its first term.
bool Graph::leads_with_minus(Id id) const {
    const Node& node = (*this)[id];
    if (node.op != Op::add) return false;
    const Id last = node.operands.back();
    const bool has_constant = is_constant(last) && is_rational(constant_of(last).value);
    const Id leader = has_constant ? last : node.operands.front();
    const Node& term = (*this)[leader];
    const std::vector<Id> factors = term.op == Op::multiply ? term.operands : std::vector<Id>{leader};
    return std::count_if(factors.begin(), factors.end(),
                         [this](Id f) { return is_constant(f) && cln::minusp(constant_of(f).value); }) %
               2 !=
           0;
}

Id Graph::negate_terms(Id sum) {
    std::vector<Id> terms = (*this)[sum].operands;
    for (Id& term : terms) term = negate(term);
    return add(terms);
}

// GiNaC chooses between (a - b) (c - d) and (b - a) (d - c) by address; here each sum has a sign of its own.
void Graph::append_factor(std::vector<Id>& factors, Id base, int exponent) {
    if (leads_with_minus(base)) {
        base = negate_terms(base);
        if (exponent % 2 != 0) factors.push_back(number(-1));
    }
    factors.push_back(power(base, exponent));
}

namespace {

GiNaC::exvector parts_of(const GiNaC::ex& product) {
    if (!GiNaC::is_a<GiNaC::mul>(product)) return {product};
    return {product.begin(), product.end()};
}

std::pair<GiNaC::ex, GiNaC::ex> base_and_exponent(const GiNaC::ex& factor) {
    return GiNaC::is_a<GiNaC::power>(factor) ? std::pair(factor.op(0), factor.op(1)) : std::pair(factor, GiNaC::ex(1));
}

// GiNaC takes numbers in and out of sums in an order that differs from process to process, so that -2 may be -2.000...
cln::cl_R exact_where_it_is(const cln::cl_R& x) {
    if (is_rational(x)) return x;
    // A float longer than its digits is always whole, which says nothing.
    static const cln::cl_I longest = cln::expt_pos(cln::cl_I(10), 20);
    constexpr long largest = 1000000;
    const cln::cl_RA near = cln::rationalize(x);
    return cln::denominator(near) < largest && cln::abs(cln::numerator(near)) < longest ? near : x;
}

// About log2 |x|.
double bits_of(const GiNaC::ex& number) {
    const auto x = cln::the<cln::cl_R>(GiNaC::ex_to<GiNaC::numeric>(number).to_cl_N());
    return cln::zerop(x) ? 0 : static_cast<double>(cln::float_exponent(cln::cl_float(x, format())));
}
// That of the least and of the largest number in front of a term, at least 0.
std::pair<double, double> bits_of_terms(const GiNaC::ex& sum) {
    double least = std::numeric_limits<double>::infinity(), largest = 0;
    for (const GiNaC::ex& term : sum) {
        double bits = 0;
        for (const GiNaC::ex& part : parts_of(term))
            if (GiNaC::is_a<GiNaC::numeric>(part)) bits += bits_of(part);
        least = std::fmin(least, bits);
        largest = std::fmax(largest, bits);
    }
    return {std::fmax(least, 0), largest};
}

// GiNaC takes (1 - x^2/1.234567^2)^30 for (1524155677489 - 10^12 x^2)^30/1524155677489^30: numbers that no number type
// holds, though their product is of order 1. For each factor, the power of two by which its terms are multiplied, so
// that the number in front of the product comes near to 1, and the least one in the sum, unless that takes the one in
// front away from 1. That changes no rounding.
// Empty: nothing is so large.
std::vector<int> scales_of(const GiNaC::exvector& factors) {
    constexpr double large = 64;  // bits
    double front = 0, inside = 0, most = 0, least_inside = 0;
    std::vector<std::pair<double, double>> bits(factors.size());
    for (std::size_t i = 0; i < factors.size(); ++i) {
        const auto [base, exponent] = base_and_exponent(factors[i]);
        if (GiNaC::is_a<GiNaC::numeric>(factors[i])) {
            front += bits_of(factors[i]);
        } else if (GiNaC::is_a<GiNaC::add>(base) && exponent.info(GiNaC::info_flags::integer)) {
            const double n = GiNaC::ex_to<GiNaC::numeric>(exponent).to_double();
            bits[i] = bits_of_terms(base);
            inside += bits[i].second * n;
            least_inside += bits[i].first * n;
            most = std::fmax(most, bits[i].first * std::fabs(n));
        }
    }
    if (std::fabs(front) <= large && most <= large) return {};
    const double part = inside == 0 || std::fabs(front) <= large ? 0 : std::clamp(-front / inside, 0.0, 1.0);
    const bool takes_least = std::fabs(front + least_inside) <= std::fmax(std::fabs(front), large);
    if (!takes_least && part == 0) return {};
    std::vector<int> scales;
    for (const auto& [least, largest] : bits)
        scales.push_back(-static_cast<int>(std::lround(std::fmax(takes_least ? least : 0, part * largest))));
    return scales;
}

// Whether a product holds one over a factor of `base`: 1/x, where the base is x/a.
bool is_divided_by(const GiNaC::ex& product, const GiNaC::ex& base) {
    const GiNaC::exvector parts = parts_of(product), divisors = parts_of(GiNaC::pow(base, -1));
    return std::any_of(divisors.begin(), divisors.end(), [&](const GiNaC::ex& divisor) {
        const auto [of, exponent] = base_and_exponent(divisor);
        return exponent.info(GiNaC::info_flags::negative) &&
               std::any_of(parts.begin(), parts.end(), [&, of = of](const GiNaC::ex& part) {
                   const auto [other, power] = base_and_exponent(part);
                   return other.is_equal(of) && power.info(GiNaC::info_flags::negative);
               });
    });
}

// The factors of a product. B^n/B is B^(n - 1), which has a value where B is 0: GiNaC's derivative of B^n is n B^n
// B'/B.
GiNaC::exvector factors_of(const GiNaC::ex& product) {
    GiNaC::exvector factors = parts_of(product);
    for (std::size_t i = 0; i < factors.size(); ++i) {
        const auto [base, exponent] = base_and_exponent(factors[i]);
        if (GiNaC::is_a<GiNaC::numeric>(exponent)) continue;
        GiNaC::exvector others = factors;
        others.erase(others.begin() + static_cast<std::ptrdiff_t>(i));
        GiNaC::ex rest = GiNaC::mul(others), less = exponent;
        while (is_divided_by(rest, base)) {
            for (const GiNaC::ex& divisor : parts_of(GiNaC::pow(base, -1))) rest *= GiNaC::pow(divisor, -1);
            less -= 1;
        }
        if (less.is_equal(exponent)) continue;
        factors = parts_of(rest);
        factors.insert(factors.begin(), GiNaC::pow(base, less));
        i = 0;  // the one that is done; others may follow
    }
    return factors;
}

}  // namespace

Id Graph::from(const GiNaC::ex& expression, const GiNaC::exmap& inputs) {
    std::unordered_map<GiNaC::ex, Id> done;
    const auto convert = [&](const auto& self, const GiNaC::ex& e) -> Id {
        const auto known = done.find(e);
        if (known != done.end()) return known->second;
        Id id = 0;
        if (GiNaC::is_a<GiNaC::numeric>(e)) {
            const GiNaC::numeric& value = GiNaC::ex_to<GiNaC::numeric>(e);
            if (!value.is_real()) throw std::logic_error("a complex number in a real expression");
            id = constant(exact_where_it_is(cln::the<cln::cl_R>(value.to_cl_N())));
        } else if (GiNaC::is_a<GiNaC::symbol>(e)) {
            const auto place = inputs.find(e);
            if (place == inputs.end())
                throw std::logic_error("a symbol without input: " + GiNaC::ex_to<GiNaC::symbol>(e).get_name());
            id = static_cast<Id>(GiNaC::ex_to<GiNaC::numeric>(place->second).to_int());
        } else if (e.is_equal(GiNaC::Pi)) {
            id = constant(cln::pi(format()), "pi");
        } else if (GiNaC::is_a<GiNaC::add>(e)) {
            std::vector<Id> terms;
            for (const auto& term : e) terms.push_back(self(self, term));
            id = add(terms);
        } else if (GiNaC::is_a<GiNaC::mul>(e)) {
            std::vector<Id> factors;
            const GiNaC::exvector parts = factors_of(e);
            const std::vector<int> scales = scales_of(parts);
            for (std::size_t i = 0; i < parts.size(); ++i) {
                if (scales.empty() || scales[i] == 0) {
                    append_factor(factors, self(self, parts[i]), 1);
                    continue;
                }
                const auto [base, exponent] = base_and_exponent(parts[i]);
                const int n = GiNaC::ex_to<GiNaC::numeric>(exponent).to_int();
                const auto power_of_two = [&](int bits) { return constant(cln::expt(cln::cl_RA(2), bits)); };
                append_factor(factors, multiply({power_of_two(scales[i]), self(self, base)}), n);
                factors.push_back(power_of_two(-n * scales[i]));
            }
            id = multiply(factors);
        } else if (GiNaC::is_a<GiNaC::power>(e)) {
            const Id base = self(self, e.op(0));
            const GiNaC::ex exponent = e.op(1);
            if (exponent.info(GiNaC::info_flags::integer)) {
                std::vector<Id> factors;
                append_factor(factors, base, GiNaC::ex_to<GiNaC::numeric>(exponent).to_int());
                id = multiply(factors);
            } else if ((2 * exponent).info(GiNaC::info_flags::integer)) {
                // x^(k/2) with k odd is sqrt(x)^k: one root for all such powers.
                id = power(function(Op::sqrt, base), GiNaC::ex_to<GiNaC::numeric>(2 * exponent).to_int());
            } else {
                id = raise(base, self(self, exponent));
            }
        } else if (GiNaC::is_a<GiNaC::function>(e)) {
            const std::string name = GiNaC::ex_to<GiNaC::function>(e).get_name();
            if (is_table_value(e)) {
                const auto whole = [&](std::size_t i) { return GiNaC::ex_to<GiNaC::numeric>(e.op(i)).to_int(); };
                id = raw(Op::table, {self(self, e.op(2))}, 4 * whole(0) + whole(1));
                done.emplace(e, id);
                return id;
            }
            const auto op = function_op(name);
            if (!op) throw std::logic_error("a function the graph does not know: " + name);
            std::vector<Id> arguments;
            for (const auto& argument : e) arguments.push_back(self(self, argument));
            id = raw(*op, arguments);
        } else {
            throw std::logic_error("an expression the graph does not know");
        }
        done.emplace(e, id);
        return id;
    };
    return convert(convert, expression);
}

}  // namespace lobatto
