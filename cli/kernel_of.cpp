// SPDX-License-Identifier: GPL-2.0-or-later
#include "cli/kernel_of.hpp"

#include <sstream>

#include "cli/support_text.hpp"

namespace lobatto {

namespace {

// In one translation unit a header's guard is a warning and its include of another part is a missing file.
void append_part(std::string& whole, const std::string& text) {
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
        const bool joins_parts = line == "#pragma once" || line.starts_with("#include \"");
        if (!joins_parts) whole += line + '\n';
    }
}

}  // namespace

Translation translation_of(const KernelSource& source, Precision precision) {
    Translation translation;
    translation.name = source.name;
    translation.optimisation = source.unrolled ? 3 : 2;
    translation.quadruple = precision == Precision::quadruple;
    if (translation.quadruple) translation.text = "#define LOBATTO_USE_FLOAT128\n";
    for (const std::string& part : {kernel_abi_h_text, kernel_hpp_text, source.header, kernel_export_hpp_text})
        append_part(translation.text, part);
    translation.text += "\nLOBATTO_EXPORT_KERNEL(lobatto::kernels::" + source.name + ")\n";
    return translation;
}

Kernel kernel_of(const KernelSource& source, Precision precision, Compiled* compiled) {
    const Compiled built = compile(translation_of(source, precision));
    if (compiled != nullptr) *compiled = built;
    return Kernel::load(built.object, source.digest);
}

}  // namespace lobatto
