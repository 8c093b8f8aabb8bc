// SPDX-License-Identifier: GPL-2.0-or-later
#include "generator/emit/header.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "generator/emit/function_text.hpp"
#include "generator/emit/support.hpp"
#include "generator/mechanics/derivation.hpp"
#include "generator/programs/identifier.hpp"

namespace lobatto {

namespace {

std::string remark_of(const Scene& scene, const Parameter& parameter) {
    if (scene.clock && parameter.symbol == scene.clock->energy) return "not of the scene: start() sets it";
    std::string remark = comment_safe(parameter.unit);
    if (!remark.empty()) remark = "[" + remark + "]";
    if (identifier(parameter.name) != parameter.name)  // C++ or <complex.h> has that name
        remark += (remark.empty() ? "" : " ") + ("the scene's " + parameter.name);
    if (parameter.is_input) remark += (remark.empty() ? "" : " ") + std::string("an input: set_inputs()");
    return remark;
}

std::string preamble(const Derivation& d, const KernelSource& source) {
    const Operations& now = source.report.back().after;
    std::string text = "// SPDX-License-Identifier: MIT\n";
    text += fmt::format("// {}: {}.\n", source.name, comment_safe(d.scene.title));
    text +=
        "// Written by Lobatto from a scene file; edit the scene, not this file. Formula numbers (D..): "
        "docs/derivation.md.\n//\n";
    text += wrapped("// Lagrangian   L = " + comment_safe(d.scene.lagrangian_text), "//                  ");
    if (d.scene.clock)
        text += wrapped("// Clock        dt = g dtau, g = " + (d.scene.clock->is_automatic
                                                                   ? "auto (D65), 1 at the start of the scene"
                                                                   : comment_safe(d.scene.clock->text)),
                        "//                  ");
    text +=
        fmt::format("// Method       {}: order {}, {}\n", d.quadrature.method.name(), d.quadrature.order(),
                    d.system.has_forces() ? "variational, with forces (Lagrange-d'Alembert)" : "symplectic, symmetric");
    if (const std::string setting = tolerance_setting(d.scene, source.form); !setting.empty())
        text += fmt::format("// Tolerance    {}, once it is set: stepper.{}; else steps are iterated to rounding\n",
                            d.scene.method.tolerance, setting);
    text += "// Coordinates  ";
    for (std::size_t k = 0; k < d.scene.coordinates.size(); ++k) {
        const Coordinate& coordinate = d.scene.coordinates[k];
        text += fmt::format("{}q[{}] = {}{}", k > 0 ? ", " : "", k, coordinate.name,
                            coordinate.unit.empty() ? "" : " [" + comment_safe(coordinate.unit) + "]");
    }
    text += "\n";
    for (const Finding& finding : d.findings)
        if (finding.holds)
            text += wrapped(fmt::format("// Structure    {}: {}", finding.name, comment_safe(finding.reason)),
                            "//              ");
    text += fmt::format(
        "// Operations   {} in all, {} as derived: {} additions, {} multiplications, {} divisions, {} functions\n",
        now.total(), source.report.front().after.total(), now.additions, now.multiplications, now.divisions,
        now.functions);
    return text;
}

}  // namespace

std::string parameters(const Scene& scene, Precision precision, Values values) {
    std::string text = "\n    // Values of the scene; change them before prepare().\n    struct Parameters {\n";
    std::vector<std::string> lines;
    std::size_t widest = 0;
    for (const Parameter& parameter : scene.parameters) {
        Graph graph;
        const Id value = graph.constant(
            values == Values::of_scene ? cln::the<cln::cl_R>(scene.evaluate(parameter.value, parameter.name).to_cl_N())
                                       : cln::cl_R(0));
        lines.push_back(fmt::format("real {} = {};", identifier(parameter.name),
                                    formula(graph, value, Notation::cpp, {}, precision)));
        widest = std::max(widest, lines.back().size());
    }
    for (std::size_t i = 0; i < lines.size(); ++i) {
        const std::string remark = values == Values::of_scene ? remark_of(scene, scene.parameters[i]) : "";
        text += remark.empty()
                    ? fmt::format("        {}\n", lines[i])
                    : fmt::format("        {:<{}}  // {}\n", lines[i], std::min<std::size_t>(widest, 60), remark);
    }
    text += "    };\n    static real& parameter(Parameters& p, int index) {\n";
    if (scene.parameters.empty()) {
        text += "        (void)p;\n        (void)index;\n        static real none = 0;\n        return none;\n    }\n";
        return text;
    }
    text += "        switch (index) {\n";
    for (std::size_t i = 0; i + 1 < scene.parameters.size(); ++i)
        text += fmt::format("            case {}: return p.{};\n", i, identifier(scene.parameters[i].name));
    text += fmt::format("            default: return p.{};\n        }}\n    }}\n",
                        identifier(scene.parameters.back().name));
    return text;
}

std::string header(const Derivation& derivation, const KernelSource& source, const EmitOptions& options) {
    std::string formulas = source.formulas;
    const std::string without = parameters(derivation.scene, options.precision, Values::left_out);
    formulas.replace(formulas.find(without), without.size(),
                     parameters(derivation.scene, options.precision, Values::of_scene));
    return preamble(derivation, source) + "#pragma once\n\n" + before_support(options.precision) +
           (options.support_text ? options.support_text(source.support) : "#include \"kernel.hpp\"\n") + formulas;
}

bool has_hybrid_stepper(const Scene& scene) {
    return !scene.watched().empty() && !scene.clock;
}

std::string tolerance_setting(const Scene& scene, StepForm form) {
    const double tolerance = scene.method.tolerance;
    if (tolerance == 0 || form == StepForm::linear_map) return "";
    return has_hybrid_stepper(scene) ? fmt::format("set_tolerance({})", tolerance)
                                     : fmt::format("tolerance = {}", tolerance);
}

}  // namespace lobatto
