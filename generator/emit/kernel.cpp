// SPDX-License-Identifier: GPL-2.0-or-later
// Graph to the C++ text of a kernel.
#include "generator/emit/kernel.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <map>
#include <set>

#include "generator/emit/angles.hpp"
#include "generator/emit/declarations.hpp"
#include "generator/emit/function_text.hpp"
#include "generator/emit/header.hpp"
#include "generator/emit/looped.hpp"
#include "generator/emit/measured.hpp"
#include "generator/emit/support.hpp"
#include "generator/emit/tables.hpp"
#include "generator/formula/spline.hpp"
#include "generator/mechanics/derivation.hpp"
#include "generator/programs/identifier.hpp"
#include "generator/programs/programs.hpp"

namespace lobatto {

namespace {

std::string digest_of(const std::string& text) {
    std::uint64_t hash = 14695981039346656037u;  // FNV-1a
    for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211u;
    return fmt::format("{:016x}", hash);
}

class Emitter {
public:
    Emitter(const Derivation& derivation, const OptimisedPrograms& optimised, const EmitOptions& options)
        : d_(derivation),
          optimised_(optimised),
          p_(optimised.programs),
          options_(options),
          hoisted_(optimised.programs),
          looped_(derivation, optimised.programs, options.precision, [this](Id id) { return name_of(id); }),
          n_(derivation.system.n) {
        for (const Program& program : p_.programs)
            if (program.name == "stage" && has_near_angles()) angles_ = angles_of(p_.graph, program);
    }

    std::string formulas(const std::string& name) const {
        std::string text =
            fmt::format("\nnamespace lobatto::kernels {{\n\nstruct {} : lobatto::KernelDefaults {{\n", name);
        text += shapes(d_, options_.precision, name) + costs() + near_angles() + tables(d_, options_.precision) +
                measured_values(p_, options_.precision) + (d_.structure.looped ? looped_.tables() : "") +
                parameters(d_.scene, options_.precision, Values::left_out) + coefficients() + prepare(name) +
                set_inputs();
        for (const RowFunction& row : looped_.row_functions()) text += row_function(row);
        for (const Declaration& declaration : declarations(d_.structure.form())) text += function(declaration);
        if (is_map() && n_ > 1)
            text +=
                "\n    // (D20) The whole step: (q1, p1) = Phi (q, p) + shift.\n"
                "    template <class given, class number>\n"
                "    static void propagate(const CoefficientsOf<given>& k, const number* q, const number* p, number* "
                "q1, "
                "number* p1) {\n"
                "        lobatto::apply_map<coordinates>(k.Phi_minus_I, q, p, q1, p1);\n    }\n";
        if (is_map() && !d_.system.has_forces())
            text +=
                "\n    // (D21) The energy that the steps conserve exactly, nearly h times H(q, p); q, p: n.\n"
                "    template <class given, class number>\n"
                "    static number discrete_energy(const CoefficientsOf<given>& k, const number* q, const number* p) "
                "{\n"
                "        return lobatto::discrete_energy<coordinates>(k.Phi_minus_I, q, p);\n    }\n";
        text += "};\n\n}  // namespace lobatto::kernels\n";
        return text;
    }

private:
    // Accelerations of few operations are put where they are used: a call would cost as much. So is a stage that gives
    // angles near: at the start of a step nothing else is asked of it.
    bool is_put_in_place(const Declaration& declaration) const {
        const std::string name = declaration.program;
        if (name == "stage") return takes_angles(declaration);
        return d_.structure.form() == StepForm::separable && !d_.structure.looped &&
               (name == "node" || name == "minus_acceleration") && optimised_.cost_of_node <= 200;
    }

    std::string costs() const {
        if (d_.structure.form() != StepForm::separable) return "";
        const bool uses_hessian = optimised_.uses_hessian;
        return fmt::format("    {:<42}  // {}\n", fmt::format("static constexpr bool uses_hessian = {};", uses_hessian),
                           uses_hessian ? "forces are evaluated less often for having second derivatives"
                                        : "second derivatives would cost more than the evaluations they save");
    }

    // Whether `stage` is written out, in packs of double: where angles may be near others.
    bool has_near_angles() const {
        return d_.structure.form() == StepForm::general && !d_.structure.looped &&
               options_.precision == Precision::double_;
    }
    std::string near_angles() const {
        if (angles_.empty()) return "";
        return fmt::format("    {:<42}  // {}\n", fmt::format("static constexpr int angles = {};", angles_.size()),
                           "whose sines and cosines stage is given, anew or from those of angles near");
    }
    bool takes_angles(const Declaration& declaration) const {
        return !angles_.empty() && std::string(declaration.program) == "stage";
    }

    std::string coefficients() const {
        std::string text =
            "\n    // What depends on parameters and step size only, computed once by prepare().\n    template <class "
            "number>\n    struct CoefficientsOf {\n";
        std::size_t widest = 0;
        for (const Id id : hoisted_.order) widest = std::max(widest, hoisted_.names.at(id).size());
        widest = std::min<std::size_t>(widest, 20);
        for (const Id id : hoisted_.order) {
            const std::string line = fmt::format("        {:<{}}", "number " + hoisted_.names.at(id) + ";", widest + 8);
            const Op op = p_.graph[id].op;
            text +=
                op == Op::input
                    ? line.substr(0, line.find(';') + 1) + "\n"
                    : wrapped(line + "  // " +
                                  formula(p_.graph, id, Notation::text, [&](Id other) { return field_name(other); }),
                              "        //     ");
        }
        if (d_.structure.looped) text += looped_.fields();
        if (is_map())
            text +=
                fmt::format("        number Phi_minus_I[{}];  // what a step adds: rows q1, p1; columns q, p, shift\n",
                            2 * n_ * (2 * n_ + 1));
        return text + "    };\n    using Coefficients = CoefficientsOf<real>;\n";
    }

    std::string field_name(Id id) const {
        const auto field = hoisted_.names.find(id);
        return field == hoisted_.names.end() ? "" : field->second;
    }

    std::string prepare(const std::string& name) const {
        std::vector<Output> statements;
        std::string pivots, finite, determinant;
        for (const Id id : hoisted_.order) {
            statements.push_back({"k." + hoisted_.names.at(id), id});
            finite += (finite.empty() ? "k." : ", k.") + hoisted_.names.at(id);
        }
        for (const Program& program : p_.programs) {
            if (program.name == "prepare") {
                int index = 0;
                for (const Output& output : program.outputs) {
                    const std::string pivot = fmt::format("pivot_{}", ++index);
                    statements.push_back({pivot, output.value, Effect::declare});
                    pivots += (pivots.empty() ? "" : " || ") + pivot + " == real(0)";
                }
            } else if (program.name == "prepare_map") {
                for (const Output& output : program.outputs) {
                    statements.push_back(output);
                    if (output.target.starts_with("delta") && !p_.graph.is_constant(output.value))
                        determinant = output.target;
                    if (output.effect == Effect::assign) finite += (finite.empty() ? "" : ", ") + output.target;
                }
            }
        }
        if (d_.structure.looped)
            for (const Output& statement : looped_.prepared()) statements.push_back(statement);
        const auto names = [&](Id id) -> std::string {
            const Node& node = p_.graph[id];
            if (node.op != Op::input) return "";
            return node.phase == Phase::parameter ? "p." + p_.graph.input_of(id).code : p_.graph.input_of(id).code;
        };
        FunctionText body(p_, statements, names,
                          {options_.precision, Phase::constant, false, false, Notation::cpp, {}});
        std::string text = body.lines();
        if (d_.structure.looped) text += looped_.after_prepare();
        if (!pivots.empty())
            text += wrapped("        if (" + pivots + ") return Status::singular_mass;", "            ");
        if (!determinant.empty())
            text += fmt::format("        if ({} == real(0)) return Status::singular_jacobian;\n", determinant);
        text += wrapped(
            "        if (!lobatto::is_finite(" + (finite.empty() ? "h" : finite) + ")) return Status::not_finite;",
            "            ");
        // NOTE: sums of double-double are not exact, which the choice of entries stands on; and what it takes away from
        // many digits nobody sees.
        if (is_map() && n_ == 1 && options_.precision != Precision::double_double &&
            !has_many_digits(options_.precision))
            text += "        lobatto::round_to_unit_determinant(k.Phi_minus_I);\n";
        if (is_map() && n_ > 1)
            // A scene may be named like a variable here.
            text += fmt::format("        return lobatto::linear_map<struct {}>(k, h);\n", name);
        else
            text += "        return Status::ok;\n";
        return "\n    // The coefficients of these parameters and this step size.\n" +
               signature("Status", "prepare", {{"const Parameters&", "p"}, {"real", "h"}, {"Coefficients&", "k"}},
                         text) +
               text + "    }\n";
    }

    // A parameter that the body does not use is left without a name; a default follows the name.
    static std::string signature(const std::string& result, const std::string& name,
                                 const std::vector<std::pair<std::string, const char*>>& parameters,
                                 const std::string& body) {
        std::string text;
        for (const auto& [type, parameter] : parameters) {
            text += (text.empty() ? "" : ", ") + type;
            const std::string name_and_default = parameter;
            if (mentions(body, name_and_default.substr(0, name_and_default.find(' ')))) text += " " + name_and_default;
        }
        return wrapped(fmt::format("    static {} {}({}) {{", result, name, text),
                       std::string(name.size() + result.size() + 13, ' '));
    }

    // Whether a value changes with the inputs of the scene.
    bool holds_input(Id id) const {
        const std::vector<Id> below = p_.graph.topological({id});
        return std::any_of(below.begin(), below.end(), [&](Id one) {
            if (p_.graph[one].op != Op::input || p_.graph[one].phase != Phase::parameter) return false;
            const auto& all = d_.scene.parameters;
            return std::any_of(all.begin(), all.end(), [&](const Parameter& parameter) {
                return parameter.is_input && identifier(parameter.name) == p_.graph.input_of(one).code;
            });
        });
    }

    // (D60) What prepare() gives, as far as it changes with inputs.
    std::string set_inputs() const {
        if (d_.system.inputs.empty()) return "";
        std::vector<Output> statements, all;
        std::string finite;
        for (const Id id : hoisted_.order) all.push_back({"k." + hoisted_.names.at(id), id});
        if (d_.structure.looped)
            for (const Output& statement : looped_.prepared()) all.push_back(statement);
        for (const Output& statement : all) {
            if (!holds_input(statement.value)) continue;
            statements.push_back(statement);
            finite += (finite.empty() ? "" : ", ") + statement.target;
        }
        const auto names = [&](Id id) -> std::string {
            if (holds_input(id)) return p_.graph[id].op == Op::input ? "p." + p_.graph.input_of(id).code : "";
            if (const std::string field = field_name(id); !field.empty()) return "k." + field;
            if (p_.graph[id].op != Op::input) return "";
            return p_.graph[id].phase == Phase::parameter ? "p." + p_.graph.input_of(id).code
                                                          : p_.graph.input_of(id).code;
        };
        std::string text =
            FunctionText(p_, statements, names, {options_.precision, Phase::step_size, false, false, Notation::cpp, {}})
                .lines();
        if (!finite.empty())
            text +=
                wrapped("        if (!lobatto::is_finite(" + finite + ")) return Status::not_finite;", "            ");
        text += "        return Status::ok;\n";
        return "\n    // (D60) The same after other values of inputs alone.\n" +
               signature("Status", "set_inputs", {{"const Parameters&", "p"}, {"real", "h"}, {"Coefficients&", "k"}},
                         text) +
               text + "    }\n";
    }

    // How a function reaches a value that it does not compute.
    std::string name_of(Id id) const {
        const std::string field = field_name(id);
        if (!field.empty()) return "k." + field;
        return p_.graph[id].op == Op::input ? p_.graph.input_of(id).code : "";
    }

    std::string body(const Declaration& declaration) const {
        const std::string name = declaration.program;
        if (d_.structure.looped && name != "event" && name != "impact" && name != "reset" && name != "refraction")
            return looped_.body(name);
        const auto program =
            std::find_if(p_.programs.begin(), p_.programs.end(), [&](const Program& p) { return p.name == name; });
        if (program == p_.programs.end()) return "";
        const FunctionStyle style{options_.precision,     Phase::step_size,
                                  declaration.any_number, false,
                                  Notation::cpp,          takes_angles(declaration) ? angles_ : std::map<Id, int>()};
        return FunctionText(
                   p_, program->outputs, [this](Id id) { return name_of(id); }, style)
            .lines();
    }

    std::string function(const Declaration& declaration) const {
        const std::string text = body(declaration);
        if (text.empty()) return "";
        const bool any = declaration.any_number;
        const auto type = [any](const std::string& of) {
            return any && of.find("real") != std::string::npos
                       ? of.substr(0, of.find("real")) + "number" + of.substr(of.find("real") + 4)
                       : of;
        };
        std::vector<std::pair<std::string, const char*>> parameters{
            {any ? "const CoefficientsOf<given>&" : "const Coefficients&", "k"}};
        if (declaration.takes_time && !d_.system.autonomous) parameters.emplace_back(type("real"), "time");
        if (takes_how(declaration)) {
            parameters.emplace_back("const Position", "q");
            parameters.emplace_back("const Slope", "W");
        } else {
            for (const auto& [of, parameter] : declaration.parameters) parameters.emplace_back(type(of), parameter);
        }
        if (takes_angles(declaration)) parameters.emplace_back("Angles", "angle = {}");
        return "\n" + wrapped(std::string("    // ") + declaration.comment, "    //     ") +
               (takes_how(declaration)
                    ? "    template <class how = lobatto::OneByOne, class given, class Position, "
                      "class Slope,\n              class number = lobatto::element_of<Position>>\n    LOBATTO_INLINE\n"
                : takes_angles(declaration)
                    ? "    template <class given, class number, class Angles = lobatto::AnglesAnew>\n"
                : any ? "    template <class given, class number>\n"
                      : "") +
               (is_put_in_place(declaration) ? "    LOBATTO_INLINE\n" : "") +
               signature(type(declaration.result), declaration.program, parameters, text) + text + "    }\n";
    }

    std::string row_function(const RowFunction& row) const {
        std::vector<std::pair<std::string, const char*>> parameters{{"const CoefficientsOf<given>&", "k"}};
        if (!d_.system.autonomous) parameters.emplace_back("clock", "time");
        parameters.emplace_back(fmt::format("lobatto::FormulaRows<number, {}, in_lanes>&", row.variables), "rows");
        return fmt::format(
                   "\n    // What {} gives for a row, or for rows side by side.\n"
                   "    template <class given, {}class number, bool in_lanes>\n",
                   row.name, d_.system.autonomous ? "" : "class clock, ") +
               "    LOBATTO_INLINE\n" + signature("void", row.name, parameters, row.body) + row.body + "    }\n";
    }

    bool takes_how(const Declaration& declaration) const {
        return d_.structure.neighbours() && has_lanes(options_.precision) &&
               std::string(declaration.program) == "minus_acceleration";
    }
    bool is_map() const { return d_.structure.form() == StepForm::linear_map; }

    const Derivation& d_;
    const OptimisedPrograms& optimised_;
    const Programs& p_;
    const EmitOptions& options_;
    Hoisted hoisted_;
    LoopedText looped_;
    int n_;
    std::map<Id, int>
        angles_;  // of the function that the fixed-point iteration evaluates, where they may be near others
};

}  // namespace

KernelSource emit_kernel(const Derivation& derivation, const OptimisedPrograms& optimised, const EmitOptions& options) {
    KernelSource source;
    source.form = derivation.structure.form();
    source.support = support_of(derivation, optimised.programs.graph);
    if (has_many_digits(options.precision)) source.support.emplace_back("base/many_digits.hpp");
    if (options.precision == Precision::double_double)
        for (const char* part : {"base/double_double_functions.hpp", "iteration/refinement.hpp"})
            source.support.emplace_back(part);
    source.name =
        is_member_name(derivation.scene.name) ? derivation.scene.name + "_" : identifier(derivation.scene.name);
    source.report = optimised.report;
    const Emitter emitter(derivation, optimised, options);
    // Of the text without a digest, which is put in its place.
    source.formulas = emitter.formulas(source.name);
    source.digest = digest_of(source.formulas);
    const std::string empty = "digest = \"\"";
    source.formulas.replace(source.formulas.find(empty), empty.size(), "digest = \"" + source.digest + "\"");
    // Two kernels of one name are two types of a program, not one that the linker chooses.
    const std::string outer = "namespace lobatto::kernels {", end = "}  // namespace lobatto::kernels";
    source.formulas.replace(source.formulas.find(outer), outer.size(),
                            fmt::format("{} inline namespace of_{} {{", outer, source.digest));
    source.formulas.replace(source.formulas.rfind(end), end.size(), "}" + end);
    source.header = header(derivation, source, options);
    return source;
}

}  // namespace lobatto
