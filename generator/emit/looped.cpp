// SPDX-License-Identifier: GPL-2.0-or-later
// Kernels with loops over repeated terms: their tables and the bodies of their functions.
#include <fmt/format.h>

#include <algorithm>

#include "generator/emit/looped.hpp"
#include "generator/emit/tables.hpp"
#include "generator/mechanics/repeated/all_pairs.hpp"

namespace lobatto {

namespace {

std::string indented(const std::string& lines) {
    std::string text;
    std::size_t begin = 0;
    while (begin < lines.size()) {
        const std::size_t end = lines.find('\n', begin) + 1;
        text += "    " + lines.substr(begin, end - begin);
        begin = end;
    }
    return text;
}

const char* const over_coordinates = "        for (int i = 0; i < coordinates; ++i) ";

}  // namespace

LoopedText::LoopedText(const Derivation& derivation, const Programs& programs, Precision precision, Naming names)
    : d_(derivation),
      p_(programs),
      precision_(precision),
      style_{precision, Phase::step_size, true, false, Notation::cpp, {}},
      names_(std::move(names)),
      general_(derivation.structure.form() == StepForm::general),
      neighbours_(derivation.structure.neighbours() && has_lanes(precision)),
      elements_(static_cast<int>(derivation.structure.elements.repeated.size())) {}

const Program& LoopedText::program(const std::string& name) const {
    return *std::find_if(p_.programs.begin(), p_.programs.end(), [&](const Program& p) { return p.name == name; });
}

std::string LoopedText::tables() const {
    std::string text;
    std::map<std::pair<int, int>, int> place;
    if (general_) {
        for (const auto& [entry, value] : d_.structure.routhian().second.entries())
            place.emplace(entry, static_cast<int>(place.size()));
    } else {
        for (const auto& entry : d_.structure.constant_mass().entries)
            place.emplace(entry, static_cast<int>(place.size()));
    }
    const bool full = has_full_matrix(d_);
    for (int number = 0; number < elements_; ++number) {
        const Element& element = element_of(number);
        const std::string name = element_text(number);
        const std::optional<AllPairs> pairs = all_pairs(element);
        std::vector<int> variables, positions;
        const auto entries = full ? std::vector<std::pair<std::size_t, std::size_t>>() : pairs_of(element);
        for (const auto& row : pairs ? rows_of(*pairs) : element.rows) {
            if (!pairs) variables.insert(variables.end(), row.begin(), row.end());
            for (const auto& [i, j] : entries) positions.push_back(place.at({row[i], row[j]}));
        }
        const std::string formula = fmt::format("    // {} = {} for ", name, canonical_text(element.term));
        text += wrapped(
            pairs ? formula + fmt::format("all pairs of {} bodies.", pairs->bodies)
                  : formula + fmt::format("{} rows of x (numbers in {}): which ones{}.", element.rows.size(),
                                          general_ ? "z" : "q",
                                          full ? "" : ", and which entries of the second derivatives they add to"),
            "    //     ");
        if (!pairs) text += integer_table(name + "_x", variables);
        if (!full) text += integer_table(name + "_entry", positions);
        if (neighbours_) {
            std::vector<int> runs;
            for (const RowRun& run : runs_of(element)) runs.insert(runs.end(), {run.begin, run.count});
            text +=
                "    // Runs of rows, (first, how many), in which each variable is the one of the row before plus "
                "one.\n" +
                integer_table(name + "_run", runs);
        }
        if (!element.a.empty() && !has_parameters(element)) {
            std::vector<GiNaC::ex> values;
            for (const std::vector<GiNaC::ex>& table : coefficient_tables(element))
                values.insert(values.end(), table.begin(), table.end());
            text += number_table(name + "_a", values, precision_);
        }
    }
    if (general_) {
        std::vector<int> from;
        for (const auto& [entry, value] : d_.system.momentum_v.entries()) from.push_back(place.at(entry));
        text += "    // Where in H the entries of M stand.\n" + integer_table("mass_from", from);
    }
    return text;
}

std::string LoopedText::fields() const {
    std::string text;
    if (!general_) text += "        number mass[coordinates], inverse_mass[coordinates];\n";
    for (int number = 0; number < elements_; ++number) {
        const Element& element = element_of(number);
        if (!element.a.empty() && has_parameters(element))
            text += fmt::format("        number {}_a[{}];\n", element_text(number),
                                element.a.size() * coefficient_tables(element).front().size());
    }
    return text;
}

std::vector<Output> LoopedText::prepared() const {
    std::vector<Output> result;
    const auto append = [&](const std::string& name) {
        const std::vector<Output>& outputs = program(name).outputs;
        const bool one = outputs.size() == 1 && d_.system.n > 1;
        for (std::size_t i = 0; i < outputs.size(); ++i)
            if (one)
                result.push_back({"every_" + name, outputs[i].value, Effect::declare});
            else
                result.push_back({fmt::format("k.{}[{}]", name, i), outputs[i].value});
    };
    if (!general_) {
        append("mass");
        append("inverse_mass");
    }
    for (int number = 0; number < elements_; ++number) append(name_of({number, LoopPart::Of::coefficients}));
    return result;
}

std::string LoopedText::after_prepare() const {
    std::string text;
    if (general_) return text;
    for (const char* name : {"mass", "inverse_mass"})
        if (program(name).outputs.size() == 1 && d_.system.n > 1)
            text += fmt::format("{}k.{}[i] = every_{};\n", over_coordinates, name, name);
    return text +
           "        for (const real& inverse : k.inverse_mass)\n"
           "            if (!lobatto::is_finite(inverse)) return Status::singular_mass;\n";
}

std::string LoopedText::statements(const std::string& name, const std::string& indent) const {
    const std::string lines = FunctionText(p_, program(name).outputs, names_, style_).lines();
    return indent.empty() ? lines : indented(lines);
}

// The rows of all elements, for their programs of one part.
std::string LoopedText::loops(LoopPart::Of part, const char* variables) const {
    std::string text;
    for (int number = 0; number < elements_; ++number) {
        const Element& element = element_of(number);
        const std::string name = element_text(number);
        const LoopPart wanted{number, part};
        const bool exists =
            std::any_of(p_.programs.begin(), p_.programs.end(), [&](const Program& p) { return p.part == wanted; });
        if (!exists || program(name_of(wanted)).outputs.empty()) continue;
        const std::optional<AllPairs> pairs = all_pairs(element);
        const std::size_t values = pairs ? static_cast<std::size_t>(pairs->bodies - 1) : element.rows.size();
        const std::string inside = statements(name_of(wanted), "    ");
        std::string begin;
        for (std::size_t j = 0; j < element.x.size(); ++j) {
            const std::string index = fmt::format("i{}", j), value = fmt::format("x{}", j);
            std::string place = fmt::format("{}_x[r * {} + {}]", name, element.x.size(), j);
            if (pairs) {
                const auto& [first, of_second] = pairs->variables[j];
                place = (first == 0 ? "" : fmt::format("{} + ", first)) + (of_second ? "other" : "body");
            }
            if (mentions(inside, index)) begin += fmt::format("            const int {} = {};\n", index, place);
            if (mentions(inside, value))
                begin += fmt::format("            const auto {} = {}[{}];\n", value, variables,
                                     mentions(inside, index) ? index : place);
        }
        // Constants in the numbers of the function, which may be coarser than those of the steps.
        const std::string cast = has_parameters(element)           ? ""
                                 : part == LoopPart::Of::quadratic ? "real("
                                                                   : "static_cast<given>(";
        for (std::size_t j = 0; j < element.a.size(); ++j) {
            const std::string value = fmt::format("a{}", j);
            if (mentions(inside, value))
                begin += fmt::format("            const auto {} = {}{}_a[{} + {}]{};\n", value,
                                     has_parameters(element) ? "k." : cast, name, j * values,
                                     !pairs                             ? "r"
                                     : pairs->coefficients[j].of_second ? "other - 1"
                                                                        : "body",
                                     cast.empty() ? "" : ")");
        }
        const bool counts = mentions(inside, "r");  // the rows
        const std::string loop =
            pairs ? fmt::format(
                        "        for (int body = 0{0}; body < {1}; ++body)\n"
                        "        for (int other = body + 1; other < {2}; ++other{3})",
                        counts ? ", r = 0" : "", pairs->bodies - 1, pairs->bodies, counts ? ", ++r" : "")
                  : fmt::format("        for (int r = 0; r < {}; ++r)", element.rows.size());
        text += fmt::format("{} {{  // {}\n{}{}        }}\n", loop, name, begin, inside);
    }
    return text;
}

// Of an element's program the outputs stand in W[i0], W[i1], ...
static std::size_t variable_of(const Output& output) {
    return std::stoul(output.target.substr(output.target.find("[i") + 2));
}

std::vector<RowFunction> LoopedText::row_functions() const {
    std::vector<RowFunction> result;
    for (int number = 0; neighbours_ && number < elements_; ++number) {
        const Element& element = element_of(number);
        if (element.x.empty()) continue;
        const std::string name = element_text(number);
        std::vector<Output> list;
        std::string takes;
        for (const Output& output : program(name_of({number, LoopPart::Of::slope})).outputs) {
            list.push_back({fmt::format("rows.result[{}]", variable_of(output)), output.value});
            if (output.effect == Effect::subtract)
                takes += fmt::format("        rows.takes[{}] = true;\n", variable_of(output));
        }
        FunctionStyle fusing = style_;
        fusing.fuses = true;
        const std::string inside = FunctionText(p_, list, names_, fusing).lines() + takes;
        std::string begin;
        for (std::size_t j = 0; j < element.x.size(); ++j)
            if (const std::string value = fmt::format("x{}", j); mentions(inside, value))
                begin += fmt::format("        const auto {} = rows.x[{}];\n", value, j);
        for (std::size_t j = 0; j < element.a.size(); ++j)
            if (const std::string value = fmt::format("a{}", j); mentions(inside, value))
                begin += fmt::format("        const auto {} = rows.of({}{}_a + {});\n", value,
                                     has_parameters(element) ? "k." : "", name, j * element.rows.size());
        result.push_back({name, static_cast<int>(element.x.size()), begin + inside});
    }
    return result;
}

// W = M^-1 grad V along the rows, in the way `how`.
std::string LoopedText::along_rows() const {
    const std::string time = d_.system.autonomous ? "" : "time, ";
    const FixedEnds& fixed_ends = d_.structure.separable().fixed_ends;
    std::string text;
    bool is_first = true;
    for (int number = 0; number < elements_; ++number) {
        const Element& element = element_of(number);
        if (element.x.empty()) continue;  // a constant that repeats: of the energy, not of the forces
        const std::string name = element_text(number);
        const bool sets = is_first && covers(element, d_.system.n);
        std::string hung;
        if (static_cast<std::size_t>(number) == fixed_ends.element) {
            if (fixed_ends.before) hung = ", lobatto::fixed_before";
            if (fixed_ends.behind) hung += hung.empty() ? ", lobatto::fixed_behind" : " | lobatto::fixed_behind";
        }
        if (is_first && !sets) text += "        how::template clear<coordinates>(W);\n";
        is_first = false;
        text += wrapped(fmt::format("        how::template {}<coordinates, {}, {}_x, {}_run{}>(q, W, [&](auto& rows) "
                                    "LOBATTO_FORMULA {{ {}(k, {}rows); }});",
                                    sets ? "set_rows" : "add_rows", element.x.size(), name, name, hung, name, time),
                        "            ");
    }
    std::vector<Output> list;
    for (const Output& output :
         program(
             name_of({fixed_ends.before || fixed_ends.behind ? LoopPart::inside : LoopPart::rest, LoopPart::Of::slope}))
             .outputs)
        list.push_back({"how::template at<" + output.target.substr(2, output.target.find(']') - 2) + ">(W)",
                        output.value, Effect::add});
    text += FunctionText(p_, list, names_, style_).lines();
    return has_unit_masses(d_.system) ? text : text + "        how::template scale<coordinates>(W, k.inverse_mass);\n";
}

std::string LoopedText::body(const std::string& function) const {
    const std::string coordinates = over_coordinates;
    const std::string clear_entries = "        for (int e = 0; e < entries; ++e) ";
    const std::string time = d_.system.autonomous ? "" : "time, ";
    if (!general_) {
        const std::string clear = coordinates + "W[i] = number(0);\n",
                          scale = coordinates + "W[i] *= k.inverse_mass[i];\n";
        if (function == "node")
            return clear + clear_entries + "S[e] = number(0);\n" + loops(LoopPart::Of::node, "q") +
                   statements(name_of({LoopPart::rest, LoopPart::Of::node}), "") + scale + clear_entries +
                   "S[e] *= k.inverse_mass[entry_row[e]];\n";
        if (function == "minus_acceleration" && neighbours_) return along_rows();
        if (function == "minus_acceleration")
            return clear + loops(LoopPart::Of::slope, "q") +
                   statements(name_of({LoopPart::rest, LoopPart::Of::slope}), "") + scale;
        if (function == "quadratic_part")
            return !d_.structure.absorbed() && !d_.structure.diagonal_part()
                       ? ""
                       : clear_entries + "S0[e] = real(0);\n" + loops(LoopPart::Of::quadratic, "q") +
                             statements(name_of({LoopPart::rest, LoopPart::Of::quadratic}), "") + clear_entries +
                             "S0[e] *= k.inverse_mass[entry_row[e]];\n";
        if (function == "energy" && d_.scene.has_energy())
            return "        number sum = number(0);\n" + coordinates +
                   "sum += p[i] * (real(0.5) * k.inverse_mass[i] * p[i]);\n" + loops(LoopPart::Of::energy, "q") +
                   statements(name_of({LoopPart::rest, LoopPart::Of::energy}), "") + "        return sum;\n";
        if (function == "momentum") return coordinates + "p[i] = k.mass[i] * velocity[i];\n";
        if (function == "velocity") return coordinates + "velocity[i] = k.inverse_mass[i] * p[i];\n";
        return "";
    }
    const std::string clear = "        for (int i = 0; i < 2 * coordinates; ++i) g[i] = number(0);\n";
    const std::string join = "        number z[2 * coordinates];\n" + coordinates + "z[i] = velocity[i];\n" +
                             coordinates + "z[coordinates + i] = q[i];\n";
    const std::string slope = join + "        number g[2 * coordinates];\n        slope(k, " + time + "z, g);\n";
    if (function == "node")
        return clear + clear_entries + "H[e] = number(0);\n" + loops(LoopPart::Of::node, "z") +
               statements(name_of({LoopPart::rest, LoopPart::Of::node}), "");
    if (function == "slope")
        return clear + loops(LoopPart::Of::slope, "z") + statements(name_of({LoopPart::rest, LoopPart::Of::slope}), "");
    if (function == "slopes")
        return slope + coordinates + "Lv[i] = g[i];\n" + coordinates + "Lq[i] = g[coordinates + i];\n";
    if (function == "momentum") return slope + coordinates + "p[i] = g[i];\n";
    if (function == "legendre")
        return join + "        number g[2 * coordinates], H[entries];\n        node(k, " + time + "z, g, H);\n" +
               coordinates + "p[i] = g[i];\n        for (int e = 0; e < mass_entries; ++e) M[e] = H[mass_from[e]];\n";
    if (function == "stage")
        return join + "        number g[2 * coordinates], H[entries];\n        node(k, " + time + "z, g, H);\n" +
               coordinates + "Lv[i] = g[i];\n" + coordinates +
               "Lq[i] = g[coordinates + i];\n        for (int e = 0; e < mass_entries; ++e) M[e] = H[mass_from[e]];\n";
    if (function == "energy" && d_.scene.has_energy())
        return join + "        number sum = number(0);\n" + loops(LoopPart::Of::energy, "z") +
               statements(name_of({LoopPart::rest, LoopPart::Of::energy}), "") + "        return sum;\n";
    return "";
}

}  // namespace lobatto
