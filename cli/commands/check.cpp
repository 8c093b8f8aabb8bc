// SPDX-License-Identifier: GPL-2.0-or-later
// lobatto check: what the generator found in a scene, what it did with it, and what that saved.
#include <fmt/format.h>
#include <fmt/ostream.h>

#include <chrono>
#include <iostream>
#include <nlohmann/json.hpp>

#include "cli/commands/commands.hpp"
#include "cli/options/method.hpp"
#include "generator/describe/explain.hpp"
#include "generator/pipeline.hpp"

namespace lobatto {

namespace {

struct CheckCommand {
    std::string scene;
    MethodOption method;
    bool general = false;
    bool json = false;
};

// What a kernel gives beside the motion: whether it was asked for, in words, and its operations.
struct Output {
    std::string name;
    bool asked = false;
    std::string text;
    long operations = 0;
};

struct Checked {
    Derivation derivation, without;  // without shortcuts
    long operations = 0, operations_without = 0;
    std::vector<Output> outputs;
    double seconds = 0;  // to derive and write the kernel
};

long operations_of(const KernelSource& source) {
    return source.report.back().after.total();
}

std::vector<Output> outputs_of(const Derivation& derivation, long operations) {
    const Outputs& asked = derivation.scene.outputs;
    const auto cost = [&](bool present, auto remove) -> long {
        if (!present) return 0;
        Derivation less = derivation;
        remove(less.scene.outputs);
        return operations - operations_of(emit(less));
    };
    std::string events, stops, impacts;
    for (const Event& stop : derivation.scene.run.stops) stops += (stops.empty() ? "" : ", ") + stop.text;
    for (const Impact& impact : derivation.scene.impacts) impacts += (impacts.empty() ? "" : ", ") + impact.when.text;
    for (const Event& event : asked.events) events += (events.empty() ? "" : ", ") + event.text;
    std::vector<Output> all{
        {"energy", asked.energy, "H at every kept state",
         cost(asked.energy, [](Outputs& outputs) { outputs.energy = false; })},
        {"momenta", asked.momenta, "columns p_... of the trajectory", 0},
        {"tangent", asked.tangent,
         derivation.structure.is_explicit() ? "the derivative of a step, kick by kick and drift by drift"
                                            : "the derivative of a step, from the matrix of its equations",
         cost(asked.tangent, [](Outputs& outputs) { outputs.tangent = false; })},
        {"dense", asked.dense > 0, fmt::format("{} states between two steps, on the step's polynomial", asked.dense),
         0},
        {"events", !asked.events.empty(), events,
         cost(!asked.events.empty(), [](Outputs& outputs) { outputs.events.clear(); })},
    };
    if (!stops.empty()) all.push_back({"stops", true, stops, 0});
    if (!impacts.empty()) all.push_back({"impacts", true, impacts, 0});
    std::string switches;
    for (const Switch& one : derivation.scene.switches) switches += (switches.empty() ? "" : ", ") + one.text;
    if (!switches.empty())
        all.push_back(
            {"not smooth", true, switches + ": steps are cut where it changes, so that the order is kept", 0});
    return all;
}

Checked check(const CheckCommand& options) {
    Scene scene = read_scene(options.scene);
    options.method.apply(scene);
    Checked result;
    const auto begin = std::chrono::steady_clock::now();
    result.derivation = derive(scene, options.general);
    result.operations = operations_of(emit(result.derivation));
    result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    scene.method.arithmetic = StepArithmetic::plain;  // which the general path has alone
    const bool alone = options.general || result.derivation.structure.is_explicit();  // which have no other path
    result.without = alone ? result.derivation : derive(scene, true);
    result.operations_without = alone ? result.operations : operations_of(emit(result.without));
    result.outputs = outputs_of(result.derivation, result.operations);
    return result;
}

// A label and a text, the text broken at blanks.
void print_row(const std::string& label, const std::string& text) {
    constexpr std::size_t left = 28, width = 82;
    std::string line;
    std::string head = label;
    const auto flush = [&] {
        fmt::print(std::cout, "  {:<{}}{}\n", head, left, line);
        head.clear();
        line.clear();
    };
    for (std::size_t begin = 0; begin < text.size();) {
        const std::size_t end = std::min(text.find(' ', begin), text.size());
        if (!line.empty() && line.size() + 1 + end - begin > width) flush();
        line += (line.empty() ? "" : " ") + text.substr(begin, end - begin);
        begin = end + 1;
    }
    flush();
}

void print_findings(const std::string& heading, const std::vector<Finding>& findings, bool holds) {
    if (std::none_of(findings.begin(), findings.end(), [&](const Finding& f) { return f.holds == holds; })) return;
    fmt::print(std::cout, "\n{}\n", heading);
    for (const Finding& finding : findings)
        if (finding.holds == holds) print_row(finding.name, finding.reason);
}

void print(const Checked& checked) {
    const Derivation& derivation = checked.derivation;
    const Scene& scene = derivation.scene;
    fmt::print(std::cout, "{} ({})\n\n", scene.title, scene.path);
    print_row("Lagrangian", scene.lagrangian_text.size() <= 400
                                ? scene.lagrangian_text
                                : fmt::format("a formula of {} characters", scene.lagrangian_text.size()));
    print_row("its kind", kind_of(derivation));
    print_findings("Found, and put to use", derivation.findings, true);
    print_findings("Looked for, not found", derivation.findings, false);

    fmt::print(std::cout, "\nA step of {} (order {})\n", scene.method.name(), scene.method.order());
    print_row("its form", form_of(derivation));
    const auto compared = [](long here, long without) {
        return here == without ? std::string() : fmt::format("; {} without what was found", without);
    };
    const int unknowns = unknowns_of(derivation);
    print_row("unknowns",
              (unknowns == 0 ? "none" : std::to_string(unknowns)) + compared(unknowns, unknowns_of(checked.without)));
    if (const std::string solver = solver_text(derivation); !solver.empty()) print_row("solved", solver);
    const long elimination = elimination_of(derivation);
    if (!derivation.structure.is_explicit())
        print_row("elimination", fmt::format("some {} multiplications{}", elimination,
                                             compared(elimination, elimination_of(checked.without))));

    fmt::print(std::cout, "\nThe kernel\n");
    for (const Output& output : checked.outputs)
        print_row(output.name, !output.asked ? "not asked for, left out"
                               : output.operations == 0
                                   ? output.text
                                   : fmt::format("{}: {} operations", output.text, output.operations));
    // One function serves all points of a step.
    print_row("operations", fmt::format("{} in all its formulas, each counted once{}", checked.operations,
                                        compared(checked.operations, checked.operations_without)));
    print_row("derived and written in", fmt::format("{:.2f} s", checked.seconds));
}

nlohmann::ordered_json json_of(const Checked& checked) {
    using Json = nlohmann::ordered_json;
    const Derivation& derivation = checked.derivation;
    const Scene& scene = derivation.scene;
    Json findings = Json::array(), groups = Json::array(), outputs = Json::array();
    for (const Finding& finding : derivation.findings)
        findings.push_back({{"name", finding.name}, {"holds", finding.holds}, {"reason", finding.reason}});
    for (const GroupSolve& solve : solves_of(derivation)) {
        Json names = Json::array();
        for (const int k : solve.coordinates) names.push_back(scene.coordinates[static_cast<std::size_t>(k)].written);
        groups.push_back(
            {{"coordinates", names}, {"unknowns", solve.unknowns}, {"band", solve.band}, {"method", solve.method}});
    }
    for (const Output& output : checked.outputs)
        outputs.push_back({{"name", output.name}, {"asked", output.asked}, {"operations", output.operations}});
    return {{"name", scene.name},
            {"title", scene.title},
            {"lagrangian", scene.lagrangian_text},
            {"kind", kind_of(derivation)},
            {"findings", findings},
            {"step",
             {{"method", scene.method.name()},
              {"order", scene.method.order()},
              {"form", form_of(derivation)},
              {"unknowns", unknowns_of(derivation)},
              {"unknowns_without", unknowns_of(checked.without)},
              {"multiplications", elimination_of(derivation)},
              {"multiplications_without", elimination_of(checked.without)},
              {"groups", groups}}},
            {"outputs", outputs},
            {"operations", checked.operations},
            {"operations_without", checked.operations_without},
            {"seconds", checked.seconds}};
}

}  // namespace

void add_check(CommandLine& program) {
    const auto options = std::make_shared<CheckCommand>();
    Command command =
        program.command("check", "Say in plain words what was found in a scene, and what its kernel leaves out");
    command.option("scene", options->scene, "the scene file").required();
    options->method.add_to(command);
    command.flag("--general", options->general, "use nothing of what the scene's structure allows, for comparison");
    command.flag("--json", options->json, "for machines");
    command.footer("Example:\n  lobatto check scenes/two_pendulums.toml");
    command.does([options] {
        const Checked checked = check(*options);
        if (options->json)
            std::cout << json_of(checked).dump(2) << '\n';
        else
            print(checked);
    });
}

}  // namespace lobatto
