// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/kernel/kernel_of.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <sstream>

#include "analysis/kernel/support_text.hpp"
#include "generator/emit/support.hpp"
#include "generator/mechanics/structure/structure.hpp"

namespace lobatto {

namespace {

// What a library of this kernel is compiled from.
std::string support_of(const KernelSource& source, bool is_ensemble, bool is_refilled) {
    if (source.support.empty()) return support_text();
    std::vector<std::string> names = source.support;
    names.push_back("steppers/watch.hpp");
    return support_text(is_refilled ? with_refilled_ensemble(names) : is_ensemble ? with_ensemble(names) : names);
}

Kernel built(const KernelSource& source, const Translation& translation, Compiled* compiled) {
    const Compiled object = compile(translation);
    if (compiled != nullptr) *compiled = object;
    if (object.was_altered)
        fmt::print(stderr,
                   "lobatto: the compiled kernel {} was not as it had been built: damaged, changed, or open to others. "
                   "It was compiled again.\n",
                   object.object);
    return Kernel::load(object.object, source.digest);
}

}  // namespace

void append_part(std::string& whole, const std::string& text) {
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
        const bool joins_parts = line == "#pragma once" || line.starts_with("#include \"");
        if (!joins_parts) whole += line + '\n';
    }
}

Translation translation_of(const KernelSource& source, Precision precision, std::int64_t together, bool refilled) {
    Translation translation;
    translation.name = source.name;
    translation.quadruple = precision == Precision::quadruple;
    translation.many_digits = has_many_digits(precision) ? asked_digits(precision) : 0;
    translation.short_loops = source.form == StepForm::general;
    translation.text = before_support(precision);
    if (together > 0) {  // a pair of registers holds 8 or 16 doubles, or twice as many floats; every text is compiled
        const int wide = precision == Precision::single ? 2 : 1;  // by itself
        translation.text += fmt::format("#define LOBATTO_ENSEMBLES {}\n", together < 8 * wide    ? 1
                                                                          : together < 16 * wide ? 8 * wide
                                                                                                 : 16 * wide);
    }
    if (refilled) translation.text += "#define LOBATTO_REFILLED\n";
    append_part(translation.text, std::string(kernel_abi_h_text));
    append_part(translation.text, support_of(source, together > 0, refilled));
    append_part(translation.text, source.formulas);
    for (const std::string_view text :
         {kernel_export_lanes_hpp_text, kernel_export_advance_hpp_text, kernel_export_export_hpp_text})
        append_part(translation.text, std::string(text));
    translation.text += "\nLOBATTO_EXPORT_KERNEL(lobatto::kernels::" + source.name + ")\n";
    return translation;
}

Kernel kernel_of(const KernelSource& source, Precision precision, Compiled* compiled) {
    return built(source, translation_of(source, precision), compiled);
}

Kernel ensemble_kernel_of(const KernelSource& source, Precision precision, std::int64_t together, Compiled* compiled,
                          bool refilled) {
    return built(source, translation_of(source, precision, std::max<std::int64_t>(together, 1), refilled), compiled);
}

}  // namespace lobatto
