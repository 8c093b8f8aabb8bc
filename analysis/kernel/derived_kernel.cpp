// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/kernel/derived_kernel.hpp"

#include <cln/real_io.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <nlohmann/json.hpp>
#include <sstream>

#include "generator/formula/spline.hpp"
#include "generator/pipeline.hpp"
#include "runtime/build/build_id.hpp"
#include "runtime/build/cache.hpp"

namespace lobatto {

namespace {

using Json = nlohmann::json;

// Everything that the kernel's text depends on. The text of the file is not enough: the method and the outputs may have
// been changed after it was read.
std::string key_of(const Scene& scene, const std::vector<Parameter>& values, const KernelWish& wish) {
    std::string key =
        fmt::format("program: {}\nname: {}\nnumbers: {}, general: {}, wants energy: {}\n", build_id(), scene.name,
                    precision_name(wish.precision), wish.shortcuts == Shortcuts::none, wish.wants_energy != nullptr);
    const Method& method = scene.method;
    key += fmt::format("method: {} {} {:a} {} {}\n", static_cast<int>(method.family), method.points, method.tolerance,
                       static_cast<int>(method.arithmetic), static_cast<int>(method.numbers));
    const Outputs& outputs = scene.outputs;
    key += fmt::format("outputs: energy {}, tangent {}, dense {}\n", outputs.energy, outputs.tangent, outputs.dense);
    for (const Event& event : scene.watched()) key += fmt::format("watched: {} {}\n", event.text, event.direction);
    for (const Reduction& reduction : outputs.kept) key += fmt::format("kept: {}\n", reduction.text);
    if (scene.clock) key += fmt::format("clock: {} {}\n", scene.clock->text, scene.clock->is_automatic);
    std::ostringstream step;
    step << scene.evaluate(scene.run.step, "the step");
    key += fmt::format("step: {}\n", step.str());
    // With all digits: the name of a spline knows those of double.
    for (const TableUse& table : scene.tables) {
        const Spline& spline = spline_of(table.spline);
        std::ostringstream digits;
        for (std::size_t i = 0; i < spline.x().size(); ++i) {
            digits << ' ' << spline.x()[i];
            if (i < spline.coefficients().size())
                for (const cln::cl_R& c : spline.coefficients()[i]) digits << ',' << c;
        }
        key += fmt::format("table: {}{}\n", spline_name(table.spline), digits.str());
    }
    for (const Parameter& parameter : values) {
        std::ostringstream value;
        value << parameter.value;
        key += fmt::format("value: {} = {}\n", parameter.name, value.str());
    }
    return key + "scene:\n" + scene.source.content();
}

std::string hexadecimal(const std::string& bytes) {
    return fmt::format("{:02x}", fmt::join(reinterpret_cast<const unsigned char*>(bytes.data()),
                                           reinterpret_cast<const unsigned char*>(bytes.data()) + bytes.size(), ""));
}
std::string bytes_of(const std::string& digits) {
    std::string bytes;
    for (std::size_t i = 0; i + 1 < digits.size(); i += 2)
        bytes += static_cast<char>(std::stoi(digits.substr(i, 2), nullptr, 16));
    return bytes;
}

Json kept_json(const ClosedSolution& solution) {
    std::ostringstream bytes;
    bytes << GiNaC::archive(solution.omega_squared, "omega_squared");
    return {{"kind", static_cast<int>(solution.kind)}, {"omega_squared", hexadecimal(bytes.str())}};
}
ClosedSolution kept_solution(const Json& json, const Scene& scene) {
    std::istringstream bytes(bytes_of(json.at("omega_squared").get<std::string>()));
    GiNaC::archive archive;
    bytes >> archive;
    GiNaC::lst symbols;
    for (const Parameter& parameter : scene.parameters) symbols.append(parameter.symbol);
    return {static_cast<ClosedSolution::Kind>(json.at("kind").get<int>()),
            archive.unarchive_ex(symbols, "omega_squared")};
}

std::string kept_text(const SystemFacts& facts, const KernelSource& source) {
    Json json{{"autonomous", facts.autonomous},
              {"linear", facts.linear},
              {"drops_time", facts.drops_time},
              {"form", static_cast<int>(source.form)},
              {"name", source.name},
              {"formulas", source.formulas},
              {"support", source.support},
              {"digest", source.digest}};
    if (facts.closed_solution) json["closed_solution"] = kept_json(*facts.closed_solution);
    return json.dump();
}

void wish_for_energy(Outline& outline, const KernelWish& wish) {
    if (wish.wants_energy != nullptr && wish.wants_energy(outline)) outline.scene.outputs.energy = true;
}

DerivedKernel from_text(const std::string& text, const Scene& scene, const KernelWish& wish) {
    const Json json = Json::parse(text);
    SystemFacts facts{json.at("autonomous"), json.at("linear"), json.at("drops_time"), std::nullopt};
    if (json.contains("closed_solution")) facts.closed_solution = kept_solution(json["closed_solution"], scene);
    DerivedKernel kernel{Outline(scene, facts), {}, true, nullptr};
    kernel.source.form = static_cast<StepForm>(json.at("form").get<int>());
    kernel.source.name = json.at("name");
    kernel.source.formulas = json.at("formulas");
    kernel.source.support = json.at("support").get<std::vector<std::string>>();
    kernel.source.digest = json.at("digest");
    wish_for_energy(kernel.outline, wish);
    return kernel;
}

DerivedKernel derived(const Scene& scene, const KernelWish& wish, const Derivation* known) {
    const auto derivation =
        std::make_shared<Derivation>(known != nullptr ? *known : derive_kernel(scene, wish.shortcuts));
    DerivedKernel kernel{Outline(*derivation), {}, false, derivation};
    wish_for_energy(kernel.outline, wish);
    derivation->scene.outputs.energy = kernel.outline.scene.outputs.energy;
    kernel.source = emit(*derivation, {wish.precision, {}});
    return kernel;
}

DerivedKernel kept_or_derived(const Scene& scene, const KernelWish& wish, const Derivation* known) {
    if (build_id().empty()) return derived(scene, wish, known);
    const std::vector<Parameter>& values = known != nullptr ? known->scene.parameters : scene.parameters;
    const CacheEntry entry(scene.name, key_of(scene, values, wish), ".derived");
    if (const auto text = entry.valid_object()) return from_text(*text, scene, wish);
    const CacheEntry::Lock lock(entry);
    if (const auto text = entry.valid_object()) return from_text(*text, scene, wish);  // derived while we waited
    DerivedKernel kernel = derived(scene, wish, known);
    write_file(entry.building_path() + "/derived", kept_text(facts_of(*kernel.derivation), kernel.source));
    entry.publish("derived");
    return kernel;
}

}  // namespace

DerivedKernel derived_kernel(const Scene& scene, const KernelWish& wish, const Derivation* known,
                             const std::function<Scene()>& with_values) {
    try {
        return kept_or_derived(scene, wish, known);
    } catch (const InputError&) {
        if (!with_values) throw;
    }
    return kept_or_derived(with_values(), wish, nullptr);
}

}  // namespace lobatto
