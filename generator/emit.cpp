// SPDX-License-Identifier: GPL-2.0-or-later
// Graph to C++ text: the only file that prints C++.
#include "generator/emit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <map>
#include <set>

#include "generator/function_text.hpp"
#include "generator/identifier.hpp"
#include "generator/pipeline.hpp"
#include "generator/programs.hpp"

namespace lobatto {

namespace {

// A function of the kernel: how it is declared and what its comment says. The parameters are named as the programs'
// inputs are.
struct Declaration {
    const char* program;
    const char* comment;
    const char* result;
    std::vector<std::pair<const char*, const char*>> parameters;  // type, name
};

const char* const in = "const real*";
const char* const out = "real*";

const std::vector<Declaration>& declarations() {
    static const std::vector<Declaration> table = {
        {"energy", "(D3) Hamiltonian H(q, p) = p^T M^-1 p / 2 + V(q); q, p: n.", "real", {{in, "q"}, {in, "p"}}},
        {"momentum", "(D2) p = dL/dq' = M q'; n each.", "void", {{in, "velocity"}, {out, "p"}}},
        {"velocity", "(D2) q' = M^-1 p; n each.", "void", {{in, "p"}, {out, "velocity"}}},
        {"node",
         "(D1) At one node: W = M^-1 grad V(q), n, and S = the entries of M^-1 V''(q) listed in entry_row, "
         "entry_column.",
         "void",
         {{in, "q"}, {out, "W"}, {out, "S"}}},
        {"acceleration", "(D1) W = M^-1 grad V(q) alone; n.", "void", {{in, "q"}, {out, "W"}}},
        {"drift",
         "(D11) v = u - h b_1 W0 and base_i = q + h c_i v, i = 2 ... s, node-major.",
         "void",
         {{in, "q"}, {in, "u"}, {in, "W0"}, {out, "v"}, {out, "base"}}},
        {"simple_start",
         "(D14) First guess with constant acceleration: Q_i = base_i - h^2 (sum_j A_ij) W0.",
         "void",
         {{in, "base"}, {in, "W0"}, {out, "Q"}}},
        {"extrapolated_start",
         "(D15) First guess from the polynomial through the accelerations of the step before (s nodes): Q_i = base_i - "
         "h^2 sum_j (A E)_ij W_before_j.",
         "void",
         {{in, "base"}, {in, "W_before"}, {out, "Q"}}},
        {"residual",
         "(D12) Interior discrete Euler-Lagrange equations, solved form: F_i = Q_i - base_i + h^2 sum_j A_ij W_j; N.",
         "void",
         {{in, "base"}, {in, "Q"}, {in, "W"}, {out, "F"}}},
        {"jacobian", "(D13) J = dF/dQ = I + h^2 A (x) S; N x N, row-major.", "void", {{in, "S"}, {out, "J"}}},
        {"correction",
         "(D14) Newton's correction delta = -J^-1 F; false when J is singular.",
         "bool",
         {{in, "base"}, {in, "Q"}, {in, "W"}, {in, "S"}, {out, "delta"}}},
        {"carry",
         "The accelerations at Q + delta, to first order: W_j += S_j delta_j.",
         "void",
         {{in, "S"}, {in, "delta"}, {out, "W"}}},
        {"arrive", "(D16) q1 = base_s - h^2 sum_j b_j (1 - c_j) W_j.", "void", {{in, "base"}, {in, "W"}, {out, "q1"}}},
        {"finish",
         "(D17) u1 = v - h sum_j b_j W_j - h b_s W1, with u = M^-1 p.",
         "void",
         {{in, "v"}, {in, "W"}, {in, "W1"}, {out, "u1"}}},
        {"propagate",
         "(D20) The whole step: (q1, p1) = Phi (q, p) + shift, as (q, p) + (Phi - I) (q, p) + shift.",
         "void",
         {{in, "q"}, {in, "p"}, {out, "q1"}, {out, "p1"}}},
    };
    return table;
}

std::string digest_of(const std::string& text) {
    std::uint64_t hash = 14695981039346656037u;  // FNV-1a
    for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211u;
    return fmt::format("{:016x}", hash);
}

const char* type_name(Precision precision) {
    switch (precision) {
        case Precision::single:
            return "float";
        case Precision::double_:
            return "double";
        case Precision::extended:
            return "long double";
        default:
            return "__float128";
    }
}

// Text that may stand in a // comment: one line, printable.
std::string comment_safe(const std::string& text) {
    std::string safe;
    for (const char c : text) safe += static_cast<unsigned char>(c) < 32 || c == 127 ? ' ' : c;
    while (!safe.empty() && (safe.back() == '\\' || safe.back() == ' ')) safe.pop_back();
    return safe;
}

class Emitter {
public:
    Emitter(const Derivation& derivation, const Programs& programs, const EmitOptions& options)
        : d_(derivation),
          p_(programs),
          options_(options),
          hoisted_(programs),
          n_(derivation.system.n),
          s_(derivation.quadrature.points) {}

    std::string header(const std::string& name, const std::string& digest,
                       const std::vector<PassReport>& report) const {
        std::string text = preamble(name, report);
        text += "#pragma once\n\n";
        if (options_.precision == Precision::quadruple) text += "#define LOBATTO_USE_FLOAT128\n";
        text += options_.standalone_support.empty() ? "#include \"kernel.hpp\"\n" : options_.standalone_support;
        text += fmt::format("\nnamespace lobatto::kernels {{\n\nstruct {} {{\n", name);
        text += shapes(name, digest) + tables() + parameters() + coefficients() + prepare(name);
        for (const Declaration& declaration : declarations()) text += function(declaration);
        if (d_.structure.linear && n_ > 1)
            text +=
                "\n    // (D20) The whole step: (q1, p1) = Phi (q, p) + shift.\n"
                "    static void propagate(const Coefficients& k, const real* q, const real* p, real* q1, real* p1) {\n"
                "        lobatto::apply_map<coordinates>(k.Phi_minus_I, q, p, q1, p1);\n    }\n";
        text += "};\n\n}  // namespace lobatto::kernels\n";
        return text;
    }

private:
    std::string preamble(const std::string& name, const std::vector<PassReport>& report) const {
        const Operations& now = report.back().after;
        std::string text = "// SPDX-License-Identifier: MIT\n";
        text += fmt::format("// {}: {}.\n", name, comment_safe(d_.scene.title));
        text +=
            "// Written by Lobatto from a scene file; edit the scene, not this file. Formula numbers (D..): "
            "docs/derivation.md.\n//\n";
        text += wrapped("// Lagrangian   L = " + comment_safe(d_.scene.lagrangian_text), "//                  ");
        text += fmt::format("// Method       Lobatto, {} points: order {}, symplectic, symmetric\n", s_,
                            d_.quadrature.order());
        text += "// Coordinates  ";
        for (int k = 0; k < n_; ++k) {
            const Coordinate& coordinate = d_.scene.coordinates[static_cast<std::size_t>(k)];
            text += fmt::format("{}q[{}] = {}{}", k > 0 ? ", " : "", k, coordinate.name,
                                coordinate.unit.empty() ? "" : " [" + comment_safe(coordinate.unit) + "]");
        }
        text += "\n";
        for (const Finding& finding : d_.structure.findings)
            if (finding.holds)
                text += wrapped(fmt::format("// Structure    {}: {}", finding.name, comment_safe(finding.reason)),
                                "//              ");
        text += fmt::format(
            "// Operations   {} in all, {} as derived: {} additions, {} multiplications, {} divisions, {} functions\n",
            now.total(), report.front().after.total(), now.additions, now.multiplications, now.divisions,
            now.functions);
        return text;
    }

    std::string shapes(const std::string& name, const std::string& digest) const {
        const int N = d_.structure.linear ? 0 : n_ * (s_ - 2);
        std::string text = fmt::format("    using real = {};\n\n", type_name(options_.precision));
        text += fmt::format(
            "    static constexpr const char* name = \"{}\";\n    static constexpr const char* digest = \"{}\";\n"
            "    static constexpr const char* method = \"Lobatto, {} points\";\n",
            name, digest, s_);
        const auto line = [&text](const std::string& declaration, const std::string& comment) {
            text += fmt::format("    {:<42}  // {}\n", "static constexpr " + declaration + ";", comment);
        };
        const auto& entries = d_.structure.entries;
        line(fmt::format("int coordinates = {}", n_), "n");
        line(fmt::format("int points = {}", s_), "s, nodes of a step, both ends included");
        line(fmt::format("int order = {}", d_.quadrature.order()), "of accuracy in h");
        line(fmt::format("int unknowns = {}", N), "N = n (s - 2) of the stage equations; 0: none to solve");
        line(fmt::format("Form form = Form::{}", d_.structure.linear ? "linear_map" : "separable"),
             d_.structure.linear ? "the step is an affine map" : "only interior nodes are implicit");
        line("bool autonomous = true", "no formula depends on time");
        line(fmt::format("bool linear = {}", d_.structure.linear), "the second derivatives are constant");
        line("bool has_energy = true", "energy() is compiled");
        line("bool has_tangent = true", "tangent maps are compiled");
        if (!d_.structure.linear) line("bool unrolled = true", "the stage functions are written out below");
        line("int events = 0", "event functions");
        line(fmt::format("int parameter_count = {}", d_.scene.parameters.size()), "in the order of the scene");
        line(fmt::format("int entries = {}", entries.size()), "of M^-1 V'' that are not identically zero");
        std::string rows, columns;
        for (const auto& [row, column] : entries) {
            rows += (rows.empty() ? "" : ", ") + std::to_string(row);
            columns += (columns.empty() ? "" : ", ") + std::to_string(column);
        }
        const std::size_t room = std::max<std::size_t>(entries.size(), 1);
        text += wrapped(fmt::format("    static constexpr int entry_row[{}] = {{{}}};", room, rows), "        ");
        text += wrapped(fmt::format("    static constexpr int entry_column[{}] = {{{}}};", room, columns), "        ");
        return text;
    }

    std::string table(const char* name, const std::vector<GiNaC::ex>& values, const std::string& comment) const {
        Graph graph;
        std::string numbers, exact;
        for (const GiNaC::ex& value : values) {
            const Id id = graph.from(value, {});
            const cln::cl_R number = graph.evaluate({}, {id})[static_cast<std::size_t>(id)];
            numbers += (numbers.empty() ? "" : ", ") +
                       formula(graph, graph.constant(number), Notation::cpp, {}, options_.precision);
            exact += (exact.empty() ? "" : "; ") + formula(graph, id, Notation::text);
        }
        return wrapped(fmt::format("    // {}: {}", comment, exact), "    //     ") +
               wrapped(fmt::format("    static constexpr real {}[{}] = {{{}}};", name,
                                   std::max<std::size_t>(values.size(), 1), numbers),
                       "        ");
    }

    std::string tables() const {
        std::vector<GiNaC::ex> A;
        for (unsigned i = 0; i + 2 < static_cast<unsigned>(s_); ++i)
            for (unsigned j = 0; j + 2 < static_cast<unsigned>(s_); ++j) A.push_back(d_.quadrature.A(i, j));
        return "\n" + table("c", d_.quadrature.c, "nodes c_1 ... c_s on [0, 1]") +
               table("b", d_.quadrature.b, "weights b_1 ... b_s") +
               table("A", A, "stage map A_ij over the interior nodes, row-major");
    }

    std::string parameters() const {
        std::string text = "\n    // Values of the scene; change them before prepare().\n    struct Parameters {\n";
        std::vector<std::string> lines;
        std::size_t widest = 0;
        for (const Parameter& parameter : d_.scene.parameters) {
            Graph graph;
            const Id value =
                graph.constant(cln::the<cln::cl_R>(d_.scene.evaluate(parameter.value, parameter.name).to_cl_N()));
            lines.push_back(fmt::format("real {} = {};", identifier(parameter.name),
                                        formula(graph, value, Notation::cpp, {}, options_.precision)));
            widest = std::max(widest, lines.back().size());
        }
        for (std::size_t i = 0; i < lines.size(); ++i) {
            const std::string unit = comment_safe(d_.scene.parameters[i].unit);
            text += unit.empty()
                        ? fmt::format("        {}\n", lines[i])
                        : fmt::format("        {:<{}}  // [{}]\n", lines[i], std::min<std::size_t>(widest, 60), unit);
        }
        text += "    };\n    static real& parameter(Parameters& p, int index) {\n";
        if (d_.scene.parameters.empty()) {
            text +=
                "        (void)p;\n        (void)index;\n        static real none = 0;\n        return none;\n    }\n";
            return text;
        }
        text += "        switch (index) {\n";
        for (std::size_t i = 0; i + 1 < d_.scene.parameters.size(); ++i)
            text += fmt::format("            case {}: return p.{};\n", i, identifier(d_.scene.parameters[i].name));
        text += fmt::format("            default: return p.{};\n        }}\n    }}\n",
                            identifier(d_.scene.parameters.back().name));
        return text;
    }

    std::string coefficients() const {
        std::string text =
            "\n    // What depends on parameters and step size only, computed once by prepare().\n    struct "
            "Coefficients {\n";
        std::size_t widest = 0;
        for (const Id id : hoisted_.order) widest = std::max(widest, hoisted_.names.at(id).size());
        widest = std::min<std::size_t>(widest, 20);
        for (const Id id : hoisted_.order) {
            const std::string line = fmt::format("        {:<{}}", "real " + hoisted_.names.at(id) + ";", widest + 6);
            const Op op = p_.graph[id].op;
            text +=
                op == Op::input
                    ? line.substr(0, line.find(';') + 1) + "\n"
                    : wrapped(line + "  // " +
                                  formula(p_.graph, id, Notation::text, [&](Id other) { return field_name(other); }),
                              "        //     ");
        }
        if (d_.structure.linear)
            text +=
                fmt::format("        real Phi_minus_I[{}];  // what a step adds: rows q1, p1; columns q, p, shift\n",
                            2 * n_ * (2 * n_ + 1));
        return text + "    };\n";
    }

    std::string field_name(Id id) const {
        const auto field = hoisted_.names.find(id);
        return field == hoisted_.names.end() ? "" : field->second;
    }

    std::string prepare(const std::string& name) const {
        std::vector<Statement> statements;
        std::string pivots, finite;
        for (const Id id : hoisted_.order) {
            statements.push_back({"k." + hoisted_.names.at(id), id});
            finite += (finite.empty() ? "k." : ", k.") + hoisted_.names.at(id);
        }
        for (const Program& program : p_.programs) {
            if (program.name == "prepare") {
                int index = 0;
                for (const Output& output : program.outputs) {
                    const std::string pivot = fmt::format("pivot_{}", ++index);
                    statements.push_back({"const real " + pivot, output.value});
                    pivots += (pivots.empty() ? "" : " || ") + pivot + " == real(0)";
                }
            } else if (program.name == "prepare_map") {
                for (const Output& output : program.outputs) {
                    statements.push_back({output.target, output.value});
                    if (output.target.rfind("k.", 0) == 0) finite += (finite.empty() ? "" : ", ") + output.target;
                }
            }
        }
        const auto names = [&](Id id) -> std::string {
            const Node& node = p_.graph[id];
            if (node.op != Op::input) return "";
            return node.stage == Stage::parameter ? "p." + p_.graph.input_of(id).code : p_.graph.input_of(id).code;
        };
        FunctionText body(p_, statements, names, options_.precision, Stage::constant);
        std::string text = body.lines();
        if (!pivots.empty())
            text += wrapped("        if (" + pivots + ") return Status::singular_mass;", "            ");
        text += wrapped(
            "        if (!lobatto::is_finite(" + (finite.empty() ? "h" : finite) + ")) return Status::not_finite;",
            "            ");
        if (d_.structure.linear && n_ == 1) text += "        lobatto::round_to_unit_determinant(k.Phi_minus_I);\n";
        if (d_.structure.linear && n_ > 1)
            text += fmt::format("        return lobatto::linear_map<{}>(k, h);\n", name);
        else
            text += "        return Status::ok;\n";
        return "\n    // Values of stage parameter and step size.\n" +
               signature("Status", "prepare", {{"const Parameters&", "p"}, {"real", "h"}, {"Coefficients&", "k"}},
                         text) +
               text + "    }\n";
    }

    // A parameter that the body does not use is left without a name.
    static std::string signature(const std::string& result, const std::string& name,
                                 const std::vector<std::pair<const char*, const char*>>& parameters,
                                 const std::string& body) {
        std::string text;
        for (const auto& [type, parameter] : parameters) {
            text += (text.empty() ? "" : ", ") + std::string(type);
            if (mentions(body, parameter)) text += std::string(" ") + parameter;
        }
        return wrapped(fmt::format("    static {} {}({}) {{", result, name, text),
                       std::string(name.size() + result.size() + 13, ' '));
    }

    std::string function(const Declaration& declaration) const {
        const auto program = std::find_if(p_.programs.begin(), p_.programs.end(),
                                          [&](const Program& p) { return p.name == declaration.program; });
        if (program == p_.programs.end()) return "";
        std::vector<Statement> statements;
        for (const Output& output : program->outputs) statements.push_back({output.target, output.value});
        const auto names = [&](Id id) -> std::string {
            const std::string field = field_name(id);
            if (!field.empty()) return "k." + field;
            return p_.graph[id].op == Op::input ? p_.graph.input_of(id).code : "";
        };
        FunctionText body(p_, statements, names, options_.precision, Stage::step_size);
        std::string text = body.lines();
        const int N = n_ * (s_ - 2);
        if (program->name == "correction" && N > closed_form_limit) {
            text = fmt::format("        real J[{}];\n", N * N) + text;
            text += fmt::format("        return lobatto::solve<{}, 1>(J, delta);\n", N);
        }
        std::vector<std::pair<const char*, const char*>> parameters{{"const Coefficients&", "k"}};
        parameters.insert(parameters.end(), declaration.parameters.begin(), declaration.parameters.end());
        return "\n" + wrapped(std::string("    // ") + declaration.comment, "    //     ") +
               signature(declaration.result, declaration.program, parameters, text) + text + "    }\n";
    }

    const Derivation& d_;
    const Programs& p_;
    const EmitOptions& options_;
    Hoisted hoisted_;
    int n_, s_;
};

// A struct cannot have the name of one of its members.
std::string struct_name(const std::string& scene) {
    static const std::set<std::string> members = {
        "method",   "form",      "autonomous",   "has_energy", "has_tangent",
        "unrolled", "events",    "name",         "digest",     "coordinates",
        "points",   "order",     "unknowns",     "linear",     "parameter_count",
        "entries",  "entry_row", "entry_column", "c",          "b",
        "A",        "parameter", "prepare"};
    const auto& functions = declarations();
    const bool is_function =
        std::any_of(functions.begin(), functions.end(), [&](const Declaration& d) { return d.program == scene; });
    return is_function || members.contains(scene) ? scene + "_" : identifier(scene);
}

}  // namespace

KernelSource emit_kernel(const Derivation& derivation, Programs programs, const EmitOptions& options) {
    KernelSource source;
    source.name = struct_name(derivation.scene.name);
    source.report = optimise(programs);
    const Emitter emitter(derivation, programs, options);
    // The digest of the text with the digest left out, put in its place.
    source.header = emitter.header(source.name, "", source.report);
    source.digest = digest_of(source.header);
    const std::string empty = "digest = \"\"";
    source.header.replace(source.header.find(empty), empty.size(), "digest = \"" + source.digest + "\"");
    return source;
}

}  // namespace lobatto
