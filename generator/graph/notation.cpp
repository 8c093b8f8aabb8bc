// SPDX-License-Identifier: GPL-2.0-or-later
// The graph as written formulas: for people, for LaTeX and for C++.
#include "generator/graph/notation.hpp"

#include <fmt/format.h>

#include <cln/cln.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdlib>
#include <sstream>

#include "generator/formula/spline.hpp"

namespace lobatto {

namespace {

// Binding strength of what was printed last.
enum Strength { sum = 1, product = 2, sign = 3, power = 4, atom = 5 };

// Of a float, in what people read: enough to recognise it, and more than double has.
constexpr int shown_digits = 25;

struct Printed {
    std::string text;
    Strength strength = atom;
};

std::string integer_text(const cln::cl_I& value) {
    std::ostringstream out;
    out << value;
    return out.str();
}

std::string_view function_name(Op op) {
    switch (op) {
        case Op::sqrt:
            return "sqrt";
        case Op::sin:
        case Op::pair_sine:
            return "sin";
        case Op::cos:
        case Op::pair_cosine:
            return "cos";
        case Op::tan:
            return "tan";
        case Op::exp:
            return "exp";
        case Op::log:
            return "log";
        case Op::sinh:
            return "sinh";
        case Op::cosh:
            return "cosh";
        case Op::tanh:
            return "tanh";
        case Op::asin:
            return "asin";
        case Op::acos:
            return "acos";
        case Op::atan:
            return "atan";
        case Op::atan2:
            return "atan2";
        case Op::positive_part:
            return "positive_part";
        default:
            return "";
    }
}

class Printer {
public:
    Printer(const Graph& graph, Notation notation, const Naming& naming, Precision precision, bool fuses,
            bool in_template)
        : graph_(graph),
          notation_(notation),
          naming_(naming),
          precision_(precision),
          fuses_(fuses),
          in_template_(in_template) {}

    Printed print(Id id, bool at_root = false) const {
        if (naming_ && !at_root) {
            const std::string name = naming_(id);
            if (!name.empty()) return {name, atom};
        }
        const Node& node = graph_[id];
        switch (node.op) {
            case Op::constant:
                return constant(id);
            case Op::input: {
                const Input& input = graph_.input_of(id);
                return {is_cpp()                       ? input.code
                        : notation_ == Notation::latex ? latex_name(input.name)
                                                       : input.name,
                        atom};
            }
            case Op::add:
                return addition(node);
            case Op::multiply:
                return fraction(node.operands);
            case Op::power:
                if (node.index < 0) return fraction({id});
                if (is_cpp()) throw std::logic_error("C++ has no power operator: expand powers first");
                return raised(node.operands[0], std::to_string(node.index));
            case Op::raise:
                if (is_cpp()) return {call("pow", node.operands), atom};
                return raised(node.operands[0], print(node.operands[1]).text);
            case Op::sqrt:
                if (notation_ == Notation::latex) return {"\\sqrt{" + print(node.operands[0]).text + "}", atom};
                return {call("sqrt", node.operands), atom};
            case Op::sincos_pair:
                return print(node.operands[0]);
            case Op::pair_sine:
            case Op::pair_cosine:
                return {call(function_name(node.op), graph_[node.operands[0]].operands), atom};
            case Op::table:
                return {table_text(node), atom};
            case Op::positive_part: {
                if (is_cpp()) return {call(function_name(node.op), node.operands), atom};
                const auto [begin, end] =
                    notation_ == Notation::latex ? std::pair("\\max\\left(", ", 0\\right)") : std::pair("max(", ", 0)");
                return {begin + print(node.operands[0]).text + end, atom};
            }
            default:
                return {call(function_name(node.op), node.operands), atom};
        }
    }

private:
    bool is_cpp() const { return notation_ == Notation::cpp || notation_ == Notation::plain; }

    std::string call(std::string_view name, const std::vector<Id>& operands) const {
        std::string arguments = print(operands[0]).text;
        for (std::size_t i = 1; i < operands.size(); ++i) arguments += ", " + print(operands[i]).text;
        if (notation_ == Notation::latex)
            return "\\" +
                   std::string(name == "asin"    ? "arcsin"
                               : name == "acos"  ? "arccos"
                               : name == "atan"  ? "arctan"
                               : name == "atan2" ? "operatorname{atan2}"
                                                 : name) +
                   "\\left(" + arguments + "\\right)";
        std::string text(name);
        if (is_cpp()) text.insert(0, notation_ == Notation::plain ? "std::" : "lobatto::");
        return text + "(" + arguments + ")";
    }

    // table("torque.csv", t), table'("torque.csv", t); in code the piece of a cubic that holds the argument.
    std::string table_text(const Node& node) const {
        const int number = node.index / 4, order = node.index % 4;
        const std::string argument = print(node.operands[0]).text;
        if (is_cpp()) return fmt::format("lobatto::spline<{}, {}>({})", spline_name(number), order, argument);
        const std::string primes(static_cast<std::size_t>(order), '\'');
        if (notation_ == Notation::latex)
            return fmt::format("\\operatorname{{table}}{}\\left(\\text{{{}}}, {}\\right)", primes,
                               latex_text(spline_of(number).file()), argument);
        return fmt::format("table{}(\"{}\", {})", primes, spline_of(number).file(), argument);
    }
    static std::string latex_text(const std::string& text) {
        std::string safe;
        for (const char c : text) {
            if (std::string_view("#$%&_{}").find(c) != std::string_view::npos) safe += '\\';
            safe += c == '~' || c == '^' ? '-' : c;
        }
        return safe;
    }

    std::string enclosed(const Printed& printed, Strength needed) const {
        if (printed.strength >= needed) return printed.text;
        return notation_ == Notation::latex ? "\\left(" + printed.text + "\\right)" : "(" + printed.text + ")";
    }

    Printed raised(Id base, const std::string& exponent) const {
        const std::string below = enclosed(print(base), atom);
        if (notation_ == Notation::latex) return {"{" + below + "}^{" + exponent + "}", power};
        const bool simple = exponent.find_first_not_of("0123456789") == std::string::npos;
        return {below + "^" + (simple ? exponent : "(" + exponent + ")"), power};
    }

    static long exponent_of(const cln::cl_R& value) {
        return cln::zerop(value) ? 0
                                 : cln::cl_I_to_long(cln::float_exponent(cln::cl_float(value, cln::float_format(20))));
    }
    bool is_too_small(const cln::cl_R& value) const { return exponent_of(value) < smallest_exponent_of(precision_); }

    static double nearest_double(const cln::cl_R& value) {
        return exponent_of(value) < smallest_exponent_of(Precision::double_)
                   ? std::strtod(decimal(value, 40).c_str(), nullptr)
                   : cln::double_approx(value);
    }
    static std::string double_literal(double value) {
        std::array<char, 40> buffer{};
        const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value).ptr;
        std::string text(buffer.data(), end);
        return text.find_first_of(".e") == std::string::npos ? text + ".0" : text;
    }

    // The number nearest to a value; what rounds to zero is zero.
    std::string literal(const cln::cl_R& value) const {
        const long largest = largest_exponent_of(precision_), exponent = exponent_of(value);
        if (exponent < 3 - largest - bits_of(precision_)) return literal(cln::cl_float(0, cln::float_format(20)));
        if (exponent > largest)
            throw DomainError("the formulas derived from it contain the number " + decimal(value, 3) +
                              ", beyond the range of the kernel's number type; choose other units");
        if (precision_ == Precision::double_) return double_literal(nearest_double(value));
        if (precision_ == Precision::double_double) {
            const double high = nearest_double(value);
            const double low = nearest_double(value - cln::rational(cln::cl_float(high)));
            return low == 0 ? double_literal(high)
                            : fmt::format("{}({}, {})", in_template_ ? "lobatto::literal<number>" : "DoubleDouble",
                                          double_literal(high), double_literal(low));
        }
        if (has_many_digits(precision_)) return literal_of_words(value);
        const int digits = precision_ == Precision::single ? 9 : precision_ == Precision::extended ? 21 : 36;
        const char* suffix = precision_ == Precision::single ? "f" : precision_ == Precision::extended ? "L" : "Q";
        std::string text = decimal(value, digits);
        if (text.find_first_of(".e") == std::string::npos) text += ".0";
        return text + suffix;
    }

    // The exponent and the words of ManyDigits (base/many_digits.hpp), rounded once, ties to even.
    std::string literal_of_words(const cln::cl_R& value) const {
        if (const double near = nearest_double(value); cln::rational(cln::cl_float(near)) == cln::rational(value))
            return double_literal(near);
        constexpr int word = 64;
        const int bits = bits_of(precision_), words = (bits + word - 1) / word;
        const auto length = static_cast<std::uintptr_t>(bits);
        const cln::cl_RA exact = cln::rational(cln::abs(value));
        long exponent = exponent_of(value) + 1;  // what it is of, in [1/2, 1), or one more
        cln::cl_I whole;
        do {
            --exponent;
            whole = cln::round1(exact * cln::expt(cln::cl_RA(2), static_cast<int>(bits - exponent)));
        } while (cln::integer_length(whole) < length);
        if (cln::integer_length(whole) > length) {
            whole = cln::ash(whole, -1);
            ++exponent;
        }
        whole = cln::ash(whole, words * word - bits);
        std::string text;
        for (int i = words - 1; i >= 0; --i)
            text += fmt::format(", {:#x}u", cln::cl_I_to_UQ(cln::ldb(
                                                whole, cln::cl_byte(word, static_cast<std::uintptr_t>(i * word)))));
        return fmt::format("{}real::of({}{})", cln::minusp(value) ? "-" : "", exponent, text);
    }

    Printed constant(Id id) const {
        const Constant& c = graph_.constant_of(id);
        if (is_cpp()) return {literal(c.value), cln::minusp(c.value) ? sign : atom};
        if (is_plain(c)) return fraction({id});
        if (c.label == "pi") return {notation_ == Notation::latex ? "\\pi" : "pi", atom};
        return {c.label, c.label.find_first_of("+- ") == std::string::npos ? power : sum};
    }

    // A constant factor: numbers whose product it is. Other factors go between them, so that what is too small by
    // itself, such as exp(-900) beside exp(q), keeps its digits.
    std::vector<std::string> literals(cln::cl_R value) const {
        constexpr std::size_t most = 4;
        const long part = largest_exponent_of(precision_) - bits_of(precision_);
        std::vector<std::string> result;
        for (; is_too_small(value) && result.size() + 1 < most;
             value = cln::scale_float(cln::cl_float(value, cln::float_format(60)), part))
            result.push_back(literal(cln::scale_float(cln::cl_float(1, cln::float_format(20)), -part)));
        result.insert(result.begin(), literal(value));
        return result;
    }

    // Whether a sum can take in this product with one rounding: two factors or more, no quotient, no number in several
    // parts, and no change of sign, which would be an operation of its own.
    bool can_fuse(Id term) const {
        const Node& node = graph_[term];
        return fuses_ && node.op == Op::multiply && (!naming_ || naming_(term).empty()) &&
               std::none_of(node.operands.begin(), node.operands.end(), [this](Id factor) {
                   return graph_.is_number(factor, -1) ||
                          (graph_[factor].op == Op::power && graph_[factor].index < 0) ||
                          (graph_[factor].op == Op::constant && is_too_small(graph_.constant_of(factor).value));
               });
    }

    Printed addition(const Node& node) const {
        std::vector<Id> terms = node.operands;
        if (!is_cpp()) {  // for people: a positive term first
            const auto first =
                std::find_if(terms.begin(), terms.end(), [this](Id term) { return !graph_.is_negative(term); });
            if (first != terms.end()) std::rotate(terms.begin(), first, first + 1);
        }
        std::vector<Id> fused;
        if (const auto plain = std::find_if(terms.begin(), terms.end(), [this](Id term) { return !can_fuse(term); });
            fuses_ && terms.size() > 1) {
            std::rotate(terms.begin(), plain == terms.end() ? terms.begin() : plain, terms.end());
            const auto first =
                std::stable_partition(terms.begin() + 1, terms.end(), [this](Id term) { return !can_fuse(term); });
            fused.assign(first, terms.end());
            terms.erase(first, terms.end());
        }
        std::string text;
        for (const Id term : terms) {
            const bool named = naming_ && !naming_(term).empty();
            const std::string printed = enclosed(print(term), product);
            if (!text.empty() && !named && printed.front() == '-')
                text += " - " + printed.substr(1);
            else
                text += (text.empty() ? "" : " + ") + printed;
        }
        for (const Id term : fused) {
            std::vector<Id> factors = graph_[term].operands;
            const std::string last = print(factors.back()).text;
            factors.pop_back();
            text = "lobatto::fused_sum(" + fraction(factors).text + ", " + last + ", " + text + ")";
        }
        return {text, fused.empty() ? sum : atom};
    }

    // Factors as numerator over denominator, with the sign in front.
    Printed fraction(const std::vector<Id>& factors) const {
        bool negative = false;
        std::vector<std::string> above, below, last;
        for (const Id factor : factors) {
            const Node& node = graph_[factor];
            const bool named = naming_ && factors.size() > 1 && !naming_(factor).empty();
            if (!named && node.op == Op::constant && (is_cpp() || is_plain(graph_.constant_of(factor)))) {
                cln::cl_R value = graph_.constant_of(factor).value;
                if (cln::minusp(value)) {
                    negative = !negative;
                    value = -value;
                }
                if (is_cpp()) {
                    if (factors.size() == 1) {
                        above.push_back(literal(value));
                    } else if (value != 1) {
                        last = literals(value);
                        above.push_back(last.front());
                        last.erase(last.begin());
                    }
                } else if (!is_rational(value)) {
                    above.push_back(decimal(value, shown_digits));
                } else {
                    const cln::cl_RA rational = cln::the<cln::cl_RA>(value);
                    if (cln::numerator(rational) != 1 || factors.size() == 1)
                        above.push_back(integer_text(cln::numerator(rational)));
                    if (cln::denominator(rational) != 1) below.push_back(integer_text(cln::denominator(rational)));
                }
            } else if (!named && node.op == Op::power && node.index < 0) {
                if (is_cpp())
                    below.push_back(enclosed(print(node.operands[0]), atom));
                else
                    below.push_back(node.index == -1 ? enclosed(print(node.operands[0]), power)
                                                     : raised(node.operands[0], std::to_string(-node.index)).text);
            } else {
                above.push_back(enclosed(print(factor), factors.size() == 1 ? sum : power));
            }
        }
        above.insert(above.end(), last.begin(), last.end());
        if (above.size() == 1 && above.front() == "1" && !below.empty()) above.clear();
        const std::string minus = negative ? "-" : "";
        if (below.empty())
            return {minus + joined(above), negative                          ? (above.size() > 1 ? product : sign)
                                           : above.size() > 1                ? product
                                           : is_cpp() || factors.size() == 1 ? atom
                                                                             : power};
        const std::string one = is_cpp() ? literal(1) : "1";
        if (notation_ == Notation::latex)
            return {minus + "\\frac{" + (above.empty() ? one : joined(above)) + "}{" + joined(below) + "}", product};
        return {minus + (above.empty() ? one : joined(above)) + (is_cpp() ? " / " : "/") +
                    (below.size() == 1 ? below.front() : "(" + joined(below) + ")"),
                product};
    }

    std::string joined(const std::vector<std::string>& factors) const {
        std::string text;
        for (const auto& factor : factors) {
            if (!text.empty()) text += is_cpp() ? " * " : notation_ == Notation::latex ? " \\, " : "*";
            text += factor;
        }
        return text.empty() ? "1" : text;
    }

    const Graph& graph_;
    Notation notation_;
    const Naming& naming_;
    Precision precision_;
    bool fuses_, in_template_;
};

// By name; a formula of repeated terms may hold two symbols of one name, its own and a parameter.
void collect_symbols(const GiNaC::ex& e, std::map<std::string, GiNaC::exset>& symbols) {
    for (auto part = e.preorder_begin(); part != e.preorder_end(); ++part)
        if (GiNaC::is_a<GiNaC::symbol>(*part)) symbols[GiNaC::ex_to<GiNaC::symbol>(*part).get_name()].insert(*part);
}

}  // namespace

std::string formula(const Graph& graph, Id id, Notation notation, const Naming& naming, Precision precision, bool fuses,
                    bool in_template) {
    return Printer(graph, notation, naming, precision, fuses, in_template).print(id, true).text;
}

std::string decimal(const cln::cl_R& value, int digits) {
    if (cln::zerop(value)) return "0";
    const cln::cl_RA magnitude = cln::rational(cln::abs(value));
    // value = integer * 10^scale with `digits` digits: the exponent is guessed from the logarithm, then corrected.
    int scale =
        static_cast<int>(cln::cl_I_to_long(cln::floor1(cln::ln(cln::cl_float(magnitude, cln::float_format(20))) /
                                                       cln::ln(cln::cl_float(10, cln::float_format(20)))))) -
        digits + 1;
    cln::cl_I integer = cln::round1(magnitude * cln::expt(cln::cl_RA(10), -scale));
    while (integer >= cln::expt_pos(cln::cl_I(10), digits))
        integer = cln::round1(magnitude * cln::expt(cln::cl_RA(10), -(++scale)));
    while (integer < cln::expt_pos(cln::cl_I(10), digits - 1))
        integer = cln::round1(magnitude * cln::expt(cln::cl_RA(10), -(--scale)));
    std::string text = integer_text(integer);
    const int exponent = scale + digits - 1;
    text.erase(text.find_last_not_of('0') + 1);
    const int count = static_cast<int>(text.size());
    if (exponent >= -4 && exponent < digits) {
        if (exponent < 0)
            text = "0." + std::string(static_cast<std::size_t>(-exponent - 1), '0') + text;
        else if (count <= exponent + 1)
            text += std::string(static_cast<std::size_t>(exponent + 1 - count), '0');
        else
            text.insert(static_cast<std::size_t>(exponent) + 1, ".");
    } else {
        if (count > 1) text.insert(1, ".");
        text += "e" + std::to_string(exponent);
    }
    return (cln::minusp(value) ? "-" : "") + text;
}

std::string canonical_text(const GiNaC::ex& expression, Notation notation) {
    std::map<std::string, GiNaC::exset> symbols;
    collect_symbols(expression, symbols);
    Graph graph;
    GiNaC::exmap inputs;
    for (const auto& [name, same] : symbols)
        for (const GiNaC::ex& symbol : same)
            inputs[symbol] = graph.input({name + std::to_string(inputs.size()), name, Phase::iterate});
    return formula(graph, graph.from(expression, inputs), notation);
}

std::string short_text(const GiNaC::ex& expression) {
    constexpr std::size_t longest = 120;
    const std::string text = canonical_text(expression);
    return text.size() <= longest ? text : fmt::format("a formula of {} characters", text.size());
}

}  // namespace lobatto
