// SPDX-License-Identifier: GPL-2.0-or-later
// The paper's notation and the exact arithmetic of its formulas.
#include "generator/paper/symbols.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <map>
#include <stdexcept>

namespace lobatto::paper {

using GiNaC::ex;
using GiNaC::exmap;
using GiNaC::numeric;

namespace {

struct Notation {
    const char* name;
    const char* spelling;
    long sample[2];  // in hundredths, at the first and the second point
};

// Sample values avoid symmetry: no two are equal, none is 0 or 1.
constexpr Notation notation[] = {
    {"theta", "θ", {37, 71}},
    {"alpha", "α", {19, -43}},
    {"beta", "β", {31, 67}},
    {"xi", "ξ", {29, 41}},
    {"h", "h", {20, 35}},
    {"m", "m", {130, 270}},
    {"omega", "ω", {170, 230}},
    {"r", "r", {53, -87}},
    {"unit", "1", {11, 13}},
    {"q_l", "q_ℓ", {80, -33}},
    {"q_xi", "q_ξ", {91, 47}},
    {"q_1xi", "q_{1−ξ}", {57, -61}},
    {"q_r", "q_r", {23, 101}},
    {"q_jm", "q_{j−1}", {77, -59}},
    {"q_j", "q_j", {113, 17}},
    {"q_jp", "q_{j+1}", {139, 149}},
    {"p_j", "p_j", {-73, 103}},
    {"p_jp", "p_{j+1}", {127, -83}},
    {"q_jxi", "q_{j+ξ}", {63, 79}},
    {"q_j1xi", "q_{j+1−ξ}", {69, 97}},
    {"q_jmxi", "q_{j−1+ξ}", {52, 58}},
    {"q_jm1xi", "q_{j−ξ}", {64, 74}},
    {"p", "p", {151, -51}},
    {"q", "q", {163, 39}},
    {"a0", "f_0", {21, 34}},
    {"a1", "f_ξ", {55, -89}},
    {"a2", "f_{1−ξ}", {44, 33}},
    {"a3", "f_1", {-62, 13}},
    {"V_l", "V_ℓ", {81, 94}},
    {"V_xi", "V_ξ", {72, -95}},
    {"V_1xi", "V_{1−ξ}", {62, 96}},
    {"V_r", "V_r", {-84, 97}},
    {"dV_l", "V′_ℓ", {121, -98}},
    {"dV_xi", "V′_ξ", {132, 99}},
    {"dV_1xi", "V′_{1−ξ}", {143, 88}},
    {"dV_r", "V′_r", {154, 86}},
    {"dV_j", "V′_j", {123, -98}},
    {"dV_jp", "V′_{j+1}", {134, 99}},
    {"dV_jxi", "V′_{j+ξ}", {145, 82}},
    {"dV_j1xi", "V′_{j+1−ξ}", {156, 81}},
    {"dV_jmxi", "V′_{j−1+ξ}", {167, -78}},
    {"dV_jm1xi", "V′_{j−ξ}", {178, 76}},
    {"ddV_xi", "V″_ξ", {211, -98}},
    {"ddV_1xi", "V″_{1−ξ}", {322, 199}},
    {"ddV", "V″", {243, 188}},
    {"ddV_j", "V″_j", {124, 166}},
    {"ddV_jp", "V″_{j+1}", {224, 177}},
    {"ddV_jxi", "V″_{j+ξ}", {234, -65}},
    {"ddV_j1xi", "V″_{j+1−ξ}", {244, 155}},
    {"delta_q_j", "δq_j", {31, 28}},
    {"delta_q_jp", "δq_{j+1}", {-49, 27}},
    {"dq", "q̇", {46, 36}},
    {"q1", "q′", {46, 36}},
    {"q2", "q″", {47, 37}},
    {"q3", "q‴", {48, 38}},
    {"q4", "q⁗", {49, 39}},
    {"q5", "q⁽⁵⁾", {57, 42}},
    {"q6", "q⁽⁶⁾", {58, 43}},
    {"phi_0", "φ_0", {61, 66}},
    {"phi_xi", "φ_ξ", {62, 67}},
    {"phi_1xi", "φ_{1−ξ}", {64, 68}},
    {"phi_1", "φ_1", {65, 69}},
    {"dphi_0", "φ′_0", {62, 66}},
    {"dphi_xi", "φ′_ξ", {63, 67}},
    {"dphi_1xi", "φ′_{1−ξ}", {64, 68}},
    {"dphi_1", "φ′_1", {65, 69}},
    {"dphi_r", "φ′_r", {66, 70}},
    {"delta", "δ", {83, 59}},
    {"delta_tilde", "δ̃", {84, 61}},
    {"a", "a", {85, 62}},
    {"b", "b", {-86, 63}},
    {"c", "c", {87, 64}},
    {"Delta", "Δ", {88, 65}},
};

// Words that only occur before an equals sign, and functions.
constexpr std::pair<const char*, const char*> words[] = {
    {"Phi", "Φ"},    {"pi", "π"}, {"sum", "Σ"}, {"integral", "∫"}, {"q_jxi_d", "δq_{j+ξ}"}, {"q_j1xi_d", "δq_{j+1−ξ}"},
    {"partial", "∂"}};

const std::map<std::string, GiNaC::symbol>& table() {
    static const std::map<std::string, GiNaC::symbol> symbols = [] {
        std::map<std::string, GiNaC::symbol> result;
        for (const Notation& entry : notation) result.emplace(entry.name, GiNaC::symbol(entry.name));
        return result;
    }();
    return symbols;
}

exmap sample(int point) {
    exmap values;
    for (const Notation& entry : notation) values[symbol(entry.name)] = numeric(entry.sample[point], 100);
    return values;
}

// GiNaC's precision is global: raise it for one evaluation, then put it back.
class Precision {
public:
    explicit Precision(int digits) : before_(static_cast<long>(GiNaC::Digits)) { GiNaC::Digits = digits; }
    ~Precision() { GiNaC::Digits = before_; }
    Precision(const Precision&) = delete;
    Precision& operator=(const Precision&) = delete;

private:
    long before_;
};

bool is_identifier(char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_';
}

std::string spell_word(const std::string& word) {
    for (const Notation& entry : notation)
        if (word == entry.name) return entry.spelling;
    for (const auto& [from, to] : words)
        if (word == from) return to;
    return word;
}

}  // namespace

ex symbol(const std::string& name) {
    const auto found = table().find(name);
    if (found == table().end()) throw std::logic_error("paper: no symbol " + name);
    return found->second;
}

ex read(const std::string& text) {
    GiNaC::symtab names;
    for (const auto& [name, symbol] : table()) names[name] = symbol;
    GiNaC::parser parse(names, true);
    return parse(text);
}

std::vector<ex> elements(const ex& expression) {
    if (GiNaC::is_a<GiNaC::matrix>(expression)) return {expression.begin(), expression.end()};
    if (!GiNaC::is_a<GiNaC::lst>(expression)) return {expression};
    std::vector<ex> flat;
    for (const ex& part : expression)
        for (const ex& element : elements(part)) flat.push_back(element);
    return flat;
}

numeric at(const ex& expression, const exmap& values, int digits) {
    const Precision precision(digits);
    const ex value = expression.subs(values).evalf();
    if (!GiNaC::is_a<numeric>(value)) throw std::logic_error("paper: a formula has no value at the sample point");
    return GiNaC::ex_to<numeric>(value);
}

numeric at_sample(const ex& expression, int point, int digits) {
    return at(expression, sample(point), digits);
}

bool equal(const ex& a, const ex& b) {
    const bool exactly = (a - b).normal().numer().expand().is_zero();
    bool numerically = true;
    for (int point : {0, 1}) {
        const numeric left = at_sample(a, point), right = at_sample(b, point);
        const numeric scale = 1 + GiNaC::abs(left) + GiNaC::abs(right);
        numerically = numerically && GiNaC::abs(left - right) < scale * GiNaC::pow(numeric(10), numeric(-50));
    }
    if (exactly != numerically) throw std::logic_error("paper: normal form and 50 digits disagree");
    return exactly;
}

std::string decimal(const numeric& value, int digits) {
    return fmt::format("{:.{}g}", value.to_double(), digits);
}

std::string sample_text(const ex& expression) {
    std::string text;
    for (const Notation& entry : notation)
        if (std::string(entry.name) != "unit" && expression.has(symbol(entry.name)))
            text += (text.empty() ? "" : ", ") + std::string(entry.spelling) + " = " +
                    decimal(at_sample(symbol(entry.name), 0));
    return text;
}

std::string spell(const std::string& text) {
    static const char* superscript[] = {"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
    std::string result;
    for (size_t i = 0; i < text.size();) {
        if (is_identifier(text[i])) {
            const size_t begin = i;
            while (i < text.size() && is_identifier(text[i])) ++i;
            const std::string word = text.substr(begin, i - begin);
            if (word == "sqrt" && text.compare(i, 3, "(5)") == 0) {
                result += "√5";
                i += 3;
            } else {
                result += word == "sqrt" ? "√" : spell_word(word);
            }
        } else if (text[i] == '^' && i + 1 < text.size() &&
                   std::isdigit(static_cast<unsigned char>(text[i + 1])) != 0) {
            for (++i; i < text.size() && std::isdigit(static_cast<unsigned char>(text[i])) != 0; ++i)
                result += superscript[text[i] - '0'];
        } else if (text[i] == '*') {
            result += "·";
            ++i;
        } else if (text[i] == '-') {
            result += "−";
            ++i;
        } else {
            result += text[i] == '{' ? '[' : text[i] == '}' ? ']' : text[i];
            ++i;
        }
    }
    return result;
}

ex integrate_polynomial(const ex& polynomial) {
    const ex theta = symbol("theta"), expanded = polynomial.expand();
    ex sum = 0;
    for (int k = 0; k <= expanded.degree(theta); ++k) sum += expanded.coeff(theta, k) / (k + 1);
    return sum.expand();
}

ex node() {
    return ex(1) / 2 - GiNaC::sqrt(ex(5)) / 10;
}

std::vector<ex> nodes() {
    return {0, node(), 1 - node(), 1};
}

// The weights that integrate 1, t, t^2, t^3 exactly: the integrals of the Lagrange polynomials.
std::vector<ex> weights() {
    std::vector<ex> result;
    for (const ex& polynomial : lagrange_basis()) result.push_back(integrate_polynomial(polynomial));
    return result;
}

// l_j(theta) = prod_{k != j} (theta - c_k)/(c_j - c_k), denominators made rational.
std::vector<ex> lagrange_basis() {
    const ex theta = symbol("theta"), root = GiNaC::sqrt(ex(5));
    const std::vector<ex> c = nodes();
    std::vector<ex> basis;
    for (size_t j = 0; j < c.size(); ++j) {
        ex numerator = 1, denominator = 1;
        for (size_t k = 0; k < c.size(); ++k) {
            if (k == j) continue;
            numerator *= theta - c[k];
            denominator *= c[j] - c[k];
        }
        denominator = denominator.expand();  // a + b sqrt(5): 1/(a + b sqrt(5)) = (a - b sqrt(5))/(a^2 - 5 b^2)
        const ex conjugate = denominator.subs(root == -root);
        basis.push_back((numerator * conjugate / (denominator * conjugate).expand()).expand());
    }
    return basis;
}

}  // namespace lobatto::paper
