// SPDX-License-Identifier: GPL-2.0-or-later
// The body of one emitted function: which values get a name, in which order, on which line.
#include "generator/emit/function_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <set>

#include "generator/emit/declarations.hpp"
#include "generator/programs/identifier.hpp"
#include "generator/programs/programs.hpp"

namespace lobatto {

namespace {

bool is_identifier(const std::string& text) {
    return !text.empty() && (std::isalpha(static_cast<unsigned char>(text[0])) != 0 || text[0] == '_') &&
           std::all_of(text.begin(), text.end(),
                       [](char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; });
}

// inverse_m for 1/m, omega_squared for omega^2; other values have no plain name.
std::string plain_name(const Graph& graph, Id id) {
    const Node& node = graph[id];
    const auto input = [&graph](Id operand) {
        return graph[operand].op == Op::input ? graph.input_of(operand).code : "";
    };
    if (node.op == Op::power && !input(node.operands[0]).empty()) return "inverse_" + input(node.operands[0]);
    if (node.op == Op::multiply && node.operands.size() == 2 && node.operands[0] == node.operands[1] &&
        !input(node.operands[0]).empty())
        return input(node.operands[0]) + "_squared";
    return "";
}

// Programs whose values prepare() stores itself.
bool is_prepared(const Program& program) {
    static const std::set<std::string> names = {"prepare", "prepare_map", "mass", "inverse_mass"};
    return names.contains(program.name) || program.name.ends_with("_a");
}

}  // namespace

Hoisted::Hoisted(const Programs& programs) {
    const Graph& graph = programs.graph;
    const auto is_early = [&graph](Id id) {
        return graph[id].phase == Phase::parameter || graph[id].phase == Phase::step_size;
    };
    std::set<Id> wanted;
    std::vector<Id> roots;
    for (const Program& program : programs.programs) {
        if (is_prepared(program)) continue;
        for (const Output& output : program.outputs) {
            roots.push_back(output.value);
            if (is_early(output.value)) wanted.insert(output.value);
        }
    }
    for (const Id id : graph.topological(roots))
        if (graph[id].phase > Phase::step_size)
            for (const Id operand : graph[id].operands)
                if (is_early(operand)) wanted.insert(operand);
    std::vector<Id> all = graph.topological(roots);
    std::stable_partition(all.begin(), all.end(), [&graph](Id id) { return graph[id].op == Op::input; });
    std::set<std::string> taken{"Phi_minus_I"};
    for (const Program& program : programs.programs)
        if (is_prepared(program)) taken.insert(program.name);  // arrays among the fields
    std::map<Id, std::string> suggested;
    for (const auto& [id, name] : programs.names) suggested.emplace(id, name);
    int counter = 0;
    for (const Id id : all) {
        if (!wanted.contains(id)) continue;
        std::string name;
        if (graph[id].op == Op::input)
            name = graph.input_of(id).code;
        else if (const auto known = suggested.find(id); known != suggested.end())
            name = known->second;
        else
            name = plain_name(graph, id);
        while (name.empty() || taken.contains(name)) name = fmt::format("k{}", ++counter);
        taken.insert(name);
        names[id] = name;
        order.push_back(id);
    }
}

FunctionText::FunctionText(const Programs& programs, const std::vector<Output>& statements, const Naming& external,
                           const FunctionStyle& style) {
    const Graph& graph = programs.graph;
    const char* const type = style.any_number ? "auto" : "real";
    std::vector<Id> roots;
    for (const Output& statement : statements) roots.push_back(statement.value);
    // What this function computes: everything below the roots that is not given.
    std::vector<Id> computed;
    std::set<Id> here;
    std::map<Id, int> uses;
    {
        std::set<Id> seen;
        const std::function<void(Id)> visit = [&](Id id) {
            ++uses[id];
            if (!seen.insert(id).second) return;
            if (graph.is_constant(id) || graph[id].op == Op::input ||
                (graph[id].phase <= style.given && !external(id).empty()))
                return;
            for (const Id operand : graph[id].operands) visit(operand);
            computed.push_back(id);
            here.insert(id);
        };
        for (const Id root : roots) visit(root);
    }
    std::map<Id, std::vector<Id>> pairs;
    for (const Id id : computed)
        if (graph[id].op == Op::pair_sine || graph[id].op == Op::pair_cosine)
            pairs[graph[id].operands[0]].push_back(id);

    // Local names: scene names for inputs such as q[0], then temporaries.
    std::set<std::string> taken;
    for (const Input& input : graph.inputs()) taken.insert(input.code.substr(0, input.code.find('[')));
    for (const char* name :
         {"k",     "p",    "h",   "q",  "u",        "v",    "W",     "S",        "Q",          "F",     "J", "W0",
          "W1",    "q1",   "p1",  "u1", "W_before", "base", "delta", "velocity", "z",          "g",     "R", "H",
          "value", "rows", "how", "Lv", "Lq",       "M",    "S0",    "time",     "not_finite", "Status"})
        taken.insert(name);
    if (!style.angles.empty()) taken.insert("angle");
    const auto take = [&taken](const std::string& name) {  // false when it has another meaning
        return !is_member_name(name) && taken.insert(name).second;
    };
    std::map<Id, std::string> local;
    std::string aliases;
    for (const auto& [id, count] : uses) {
        if (graph[id].op != Op::input || graph[id].phase <= Phase::step_size) continue;
        const Input& input = graph.input_of(id);
        if (input.name == input.code || !is_identifier(input.name)) continue;
        const std::string name = identifier(input.name);
        if (!take(name)) continue;
        local[id] = name;
        aliases += fmt::format("        const {} {} = {};\n", type, name, input.code);
    }
    std::map<Id, std::string> suggested;
    for (const auto& [id, name] : programs.names) suggested.emplace(id, name);
    int counter = 0;
    const auto fresh = [&](const std::string& wish) {
        std::string name = wish;
        while (name.empty() || !take(name)) name = fmt::format("t{}", ++counter);
        return name;
    };
    const Naming naming = [&](Id id) -> std::string {
        if (const auto known = local.find(id); known != local.end()) return known->second;
        return graph.is_constant(id) ? "" : external(id);
    };
    const auto print = [&](Id id) { return formula(graph, id, style.notation, naming, style.precision, style.fuses); };
    const auto text_of = [&](Id id) {
        const std::string name = naming(id);
        return name.empty() ? print(id) : name;
    };

    const auto assign = [&](const Output& statement) {
        static const std::map<Effect, const char*> forms = {{Effect::assign, "{} = {};"},
                                                            {Effect::add, "{} += {};"},
                                                            {Effect::subtract, "{} -= {};"},
                                                            {Effect::declare, "const real {} = {};"},
                                                            {Effect::give_back, "{}return {};"}};
        text_ += wrapped("        " + fmt::format(fmt::runtime(forms.at(statement.effect)), statement.target,
                                                  text_of(statement.value)),
                         "            ");
        // A field of k or a local constant may serve as the value's name from here on.
        if (statement.target.rfind("k.", 0) == 0 && !local.contains(statement.value) &&
            graph[statement.value].op != Op::input)
            local[statement.value] = statement.target;
    };
    std::set<Id> emitted;
    const std::function<void(Id)> compute = [&](Id id) {
        if (!emitted.insert(id).second || !here.contains(id)) return;
        if (local.contains(id)) return;
        for (const Id operand : graph[id].operands) compute(operand);
        const Node& node = graph[id];
        if (node.op == Op::pair_sine || node.op == Op::pair_cosine) {
            const auto& both = pairs[node.operands[0]];
            if (both.size() == 2) {
                if (local.contains(id)) return;
                const Id argument = graph[node.operands[0]].operands[0];
                const std::string text = text_of(argument);
                const std::string suffix = is_identifier(text)               ? text
                                           : graph[argument].op == Op::input ? graph.input_of(argument).name
                                                                             : "";
                for (const Id half : both) {
                    const bool sine = graph[half].op == Op::pair_sine;
                    local[half] = fresh(is_identifier(suffix) ? (sine ? "sin_" : "cos_") + suffix : "");
                }
                const Id sine = graph[both[0]].op == Op::pair_sine ? both[0] : both[1];
                const Id cosine = graph[both[0]].op == Op::pair_sine ? both[1] : both[0];
                if (style.notation == Notation::plain) {
                    for (const Id half : {sine, cosine})
                        text_ += wrapped(fmt::format("        const real {} = std::{}({});", local[half],
                                                     half == sine ? "sin" : "cos", text),
                                         "            ");
                    return;
                }
                text_ += fmt::format("        {} {}, {};\n", style.any_number ? "number" : "real", local[sine],
                                     local[cosine]);
                const auto angle = style.angles.find(node.operands[0]);
                const std::string function =
                    angle == style.angles.end() ? "lobatto::sincos(" : fmt::format("angle.sincos({}, ", angle->second);
                text_ += wrapped(fmt::format("        {}{}, {}, {});", function, text, local[sine], local[cosine]),
                                 "            ");
                return;
            }
        }
        if (node.op == Op::sincos_pair) return;
        if (uses[id] > 1) {
            const auto wish = suggested.find(id);
            const std::string name = fresh(wish == suggested.end() ? "" : wish->second);
            text_ += wrapped(fmt::format("        const {} {} = {};", type, name, print(id)), "            ");
            local[id] = name;
        }
    };
    for (const Output& statement : statements) {
        // The root itself is printed in its assignment, unless others use it too.
        const bool is_field = statement.target.rfind("k.", 0) == 0;
        if (is_field && !local.contains(statement.value)) {
            for (const Id operand : graph[statement.value].operands) compute(operand);
            emitted.insert(statement.value);
        } else {
            compute(statement.value);
        }
        assign(statement);
    }
    text_ = aliases + text_;
}

std::string wrapped(const std::string& line, const std::string& indent) {
    constexpr std::size_t limit = 120;
    std::string rest = line, text;
    while (rest.size() > limit) {
        std::size_t cut = rest.rfind(' ', limit);
        if (cut == std::string::npos || cut <= indent.size()) break;
        text += rest.substr(0, cut) + "\n";
        rest = indent + rest.substr(cut + 1);
    }
    return text + rest + "\n";
}

bool mentions(const std::string& text, const std::string& identifier) {
    const auto is_word = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; };
    for (std::size_t at = text.find(identifier); at != std::string::npos; at = text.find(identifier, at + 1)) {
        const bool starts = at == 0 || !is_word(text[at - 1]);
        const std::size_t end = at + identifier.size();
        if (starts && (end == text.size() || !is_word(text[end]))) return true;
    }
    return false;
}

}  // namespace lobatto
