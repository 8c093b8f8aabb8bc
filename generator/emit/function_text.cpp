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
    return names.contains(program.name) || (program.part && program.part->of == LoopPart::Of::coefficients);
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

namespace {

constexpr const char* deeper = "            ";  // of continuation lines

// One body under way: what it computes, under which names, and its lines so far.
class BodyWriter {
public:
    BodyWriter(const Programs& programs, const std::vector<Output>& statements, const Naming& external,
               const FunctionStyle& style)
        : graph_(programs.graph), statements_(statements), external_(external), style_(style) {
        for (const Output& statement : statements) collect(statement.value);
        for (const Id id : computed_)
            if (graph_[id].op == Op::pair_sine || graph_[id].op == Op::pair_cosine)
                pairs_[graph_[id].operands[0]].push_back(id);
        for (const auto& [id, name] : programs.names) suggested_.emplace(id, name);
        reserve_names();
        name_inputs();
    }

    std::string text() {
        for (const Output& statement : statements_) {
            // The root itself is printed in its assignment, unless others use it too.
            if (is_field(statement) && !local_.contains(statement.value)) {
                for (const Id operand : graph_[statement.value].operands) compute(operand);
                emitted_.insert(statement.value);
            } else {
                compute(statement.value);
            }
            assign(statement);
        }
        return aliases_ + text_;
    }

private:
    const char* type() const { return style_.any_number ? "auto" : "real"; }
    static bool is_field(const Output& statement) { return statement.target.starts_with("k."); }

    // What this function computes: everything below the roots that is not given.
    void collect(Id id) {
        ++uses_[id];
        if (!seen_.insert(id).second) return;
        if (graph_.is_constant(id) || graph_[id].op == Op::input ||
            (graph_[id].phase <= style_.given && !external_(id).empty()))
            return;
        for (const Id operand : graph_[id].operands) collect(operand);
        computed_.push_back(id);
        here_.insert(id);
    }

    // Names that have a meaning in the function already: its inputs, the parameters of all functions, and what
    // prepare() and the loops call their own.
    void reserve_names() {
        for (const Input& input : graph_.inputs()) taken_.insert(input.code.substr(0, input.code.find('[')));
        for (const StepForm form : {StepForm::separable, StepForm::general})
            for (const Declaration& declaration : declarations(form))
                for (const auto& [type, name] : declaration.parameters) taken_.insert(name);
        taken_.insert({"k", "p", "h", "time", "rows", "how", "Status"});
        if (!style_.angles.empty()) taken_.insert("angle");
    }
    bool take(const std::string& name) {  // false when it has another meaning
        return !is_member_name(name) && taken_.insert(name).second;
    }
    std::string fresh(const std::string& wish) {
        std::string name = wish;
        while (name.empty() || !take(name)) name = fmt::format("t{}", ++counter_);
        return name;
    }
    // Inputs such as q[0] under the names of the scene.
    void name_inputs() {
        for (const auto& [id, count] : uses_) {
            if (graph_[id].op != Op::input || graph_[id].phase <= Phase::step_size) continue;
            const Input& input = graph_.input_of(id);
            if (input.name == input.code || !is_identifier(input.name)) continue;
            const std::string name = identifier(input.name);
            if (!take(name)) continue;
            local_[id] = name;
            aliases_ += fmt::format("        const {} {} = {};\n", type(), name, input.code);
        }
    }

    std::string name_of(Id id) const {
        if (const auto known = local_.find(id); known != local_.end()) return known->second;
        return graph_.is_constant(id) ? "" : external_(id);
    }
    std::string print(Id id) const {
        return formula(
            graph_, id, style_.notation, [this](Id other) { return name_of(other); }, style_.precision, style_.fuses,
            style_.any_number);
    }
    std::string text_of(Id id) const {
        const std::string name = name_of(id);
        return name.empty() ? print(id) : name;
    }
    void line(const std::string& statement) { text_ += wrapped("        " + statement, deeper); }

    void assign(const Output& statement) {
        static const std::map<Effect, const char*> forms = {{Effect::assign, "{} = {};"},
                                                            {Effect::add, "{} += {};"},
                                                            {Effect::subtract, "{} -= {};"},
                                                            {Effect::declare, "const real {} = {};"},
                                                            {Effect::give_back, "{}return {};"}};
        line(fmt::format(fmt::runtime(forms.at(statement.effect)), statement.target, text_of(statement.value)));
        // A field of k may serve as the value's name from here on.
        if (is_field(statement) && !local_.contains(statement.value) && graph_[statement.value].op != Op::input)
            local_[statement.value] = statement.target;
    }

    // The lines of a value and of what it is computed from, where they are used more than once.
    void compute(Id id) {
        if (!emitted_.insert(id).second || !here_.contains(id) || local_.contains(id)) return;
        for (const Id operand : graph_[id].operands) compute(operand);
        const Node& node = graph_[id];
        const bool is_half = node.op == Op::pair_sine || node.op == Op::pair_cosine;
        if (is_half && pairs_[node.operands[0]].size() == 2) {
            if (!local_.contains(id)) compute_pair(node.operands[0]);
            return;
        }
        if (node.op == Op::sincos_pair || uses_[id] <= 1) return;
        const auto wish = suggested_.find(id);
        const std::string name = fresh(wish == suggested_.end() ? "" : wish->second);
        line(fmt::format("const {} {} = {};", type(), name, print(id)));
        local_[id] = name;
    }

    // Sine and cosine of one argument together.
    void compute_pair(Id pair) {
        const std::vector<Id>& both = pairs_[pair];
        const Id argument = graph_[pair].operands[0];
        const std::string text = text_of(argument);
        const std::string suffix = is_identifier(text)                ? text
                                   : graph_[argument].op == Op::input ? graph_.input_of(argument).name
                                                                      : "";
        for (const Id half : both) {
            const bool sine = graph_[half].op == Op::pair_sine;
            local_[half] = fresh(is_identifier(suffix) ? (sine ? "sin_" : "cos_") + suffix : "");
        }
        const bool sine_first = graph_[both[0]].op == Op::pair_sine;
        const std::string &sine = local_[both[sine_first ? 0 : 1]], &cosine = local_[both[sine_first ? 1 : 0]];
        if (style_.notation == Notation::plain) {
            line(fmt::format("const real {} = std::sin({});", sine, text));
            line(fmt::format("const real {} = std::cos({});", cosine, text));
            return;
        }
        line(fmt::format("{} {}, {};", style_.any_number ? "number" : "real", sine, cosine));
        const auto angle = style_.angles.find(pair);
        line(fmt::format(
            "{}{}, {}, {});",
            angle == style_.angles.end() ? "lobatto::sincos(" : fmt::format("angle.sincos({}, ", angle->second), text,
            sine, cosine));
    }

    const Graph& graph_;
    const std::vector<Output>& statements_;
    const Naming& external_;
    const FunctionStyle& style_;
    std::vector<Id> computed_;            // operands before users
    std::set<Id> seen_, here_, emitted_;  // visited; computed here; printed
    std::map<Id, int> uses_;
    std::map<Id, std::vector<Id>> pairs_;  // of sine and cosine, by their pair
    std::map<Id, std::string> suggested_, local_;
    std::set<std::string> taken_;
    int counter_ = 0;
    std::string aliases_, text_;
};

}  // namespace

FunctionText::FunctionText(const Programs& programs, const std::vector<Output>& statements, const Naming& external,
                           const FunctionStyle& style)
    : text_(BodyWriter(programs, statements, external, style).text()) {}

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

std::string comment_safe(const std::string& text) {
    std::string safe;
    for (const char c : text) safe += static_cast<unsigned char>(c) < 32 || c == 127 ? ' ' : c;
    while (!safe.empty() && (safe.back() == '\\' || safe.back() == ' ')) safe.pop_back();
    return safe;
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
