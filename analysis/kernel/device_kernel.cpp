// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/kernel/device_kernel.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <optional>
#include <sstream>

#include "analysis/kernel/kernel_of.hpp"
#include "analysis/kernel/support_text.hpp"
#include "generator/emit/support.hpp"
#include "generator/formula/text/source.hpp"
#include "generator/mechanics/structure/structure.hpp"
#include "runtime/error.hpp"
#include "runtime/files/partial_file.hpp"

namespace lobatto {

namespace {

const std::string export_lanes = "\nLOBATTO_EXPORT_DEVICE_LANES(lobatto::kernels::";

std::string stem_of(const Compiled& compiled) {
    return std::filesystem::path(compiled.object).stem().string();
}

std::string content_of(const std::string& path) {
    const std::optional<std::string> content = read_whole(path);
    if (!content) throw MachineError("cannot read " + path + "; delete it, and it is compiled again");
    return *content;
}

// Formulas are for the device too. In emitted text these lines are theirs alone.
std::string with_functions_of_device(const std::string& header) {
    std::istringstream lines(header);
    std::string text;
    for (std::string line; std::getline(lines, line);) {
        const bool is_formula = line.starts_with("    static void ") || line.starts_with("    static number ");
        text += (is_formula ? "    LOBATTO_DEVICE" + line.substr(3) : line) + '\n';
    }
    return text;
}

// Loops over nodes, coordinates and entries have names of one letter; those of iterations are longer. nvcc does not
// know the pragma of g++.
std::string with_loops_of_device(const std::string& text, bool written_out) {
    const std::string begin = "for (int ";
    std::istringstream lines(text);
    std::string result;
    for (std::string line; std::getline(lines, line);) {
        if (line.starts_with("#pragma GCC unroll")) continue;
        for (std::size_t at = line.find(begin); written_out && at != std::string::npos;) {
            const std::string pragma = "_Pragma(\"unroll\") ";
            if (line.compare(at + begin.size() + 1, 3, " = ") == 0) {
                line.insert(at, pragma);
                at += pragma.size();
            }
            at = line.find(begin, at + 1);
        }
        result += line + '\n';
    }
    return result;
}

// With LOBATTO_DEVICE_WATCHES where steps are looked at.
std::string support_of_lanes(const KernelSource& source, const WatchedLanes& watched) {
    if (!watched.any()) return support_text(with_ensemble(source.support));
    std::vector<std::string> names = source.support;
    names.push_back("steppers/watch.hpp");
    return "#define LOBATTO_DEVICE_WATCHES\n" + support_text(with_refilled_ensemble(names));
}

// The kernel and its lanes; `header`: of the kernel.
void append_lanes(std::string& text, const KernelSource& source, const std::string& header,
                  const WatchedLanes& watched) {
    append_part(text, std::string(kernel_abi_h_text));
    append_part(text, support_of_lanes(source, watched));
    append_part(text, header);
    append_part(text, std::string(kernel_kept_hpp_text));
    if (!watched.kept.empty()) text += "#define LOBATTO_DEVICE_KEPT\n" + watched.kept;
    append_part(text, std::string(kernel_device_lanes_hpp_text));
    append_part(text, std::string(kernel_device_host_hpp_text));  // empty to nvcc: one text for both
}

}  // namespace

std::string why_not_on_device(const Scene& scene) {
    const Precision numbers = scene.method.numbers;
    if (numbers != Precision::double_ && numbers != Precision::single && numbers != Precision::double_double)
        return fmt::format("a GPU has double, float and double-double, not {}", precision_name(numbers));
    if (scene.clock) return "steps by a clock are taken by the processor alone";
    if (scene.is_cut()) return "impacts and switches are found by the processor alone";
    if (!scene.tables.empty()) return "measured tables are read by the processor alone";
    if (scene.method.arithmetic == StepArithmetic::clean) return "clean arithmetic is for the processor alone";
    return "";
}

Translation host_side_of(const KernelSource& source, Precision precision, const WatchedLanes& watched) {
    Translation translation;
    translation.name = source.name;
    translation.short_loops = source.form == StepForm::general;
    translation.text = before_support(precision);
    append_lanes(translation.text, source, source.formulas, watched);
    translation.text += export_lanes + source.name + ")\n";
    return translation;
}

DeviceTranslation device_side_of(const KernelSource& source, const std::string& architecture, const DeviceLibrary& host,
                                 const WatchedLanes& watched) {
    constexpr int most_written_out = 256;  // words of a row
    DeviceTranslation translation{source.name, fmt::format("#define LOBATTO_DEVICE_BLOCK {}\n", DeviceKernel::block),
                                  architecture};
    append_lanes(translation.text, source, with_functions_of_device(source.formulas), watched);
    translation.text = with_loops_of_device(translation.text, host->words <= most_written_out);
    translation.text += fmt::format(
        "\nstatic_assert(lobatto::device_words<lobatto::kernels::{0}> == {1} &&\n"
        "              sizeof(lobatto::SharedByLanes<lobatto::kernels::{0}>) == {2}, \"rows of the host's "
        "library\");\n",
        source.name, host->words, host->shared_bytes);
    translation.text += export_lanes + source.name + ")\n";
    return translation;
}

std::shared_ptr<const DeviceKernel> device_kernel_of(const KernelSource& source, Precision precision,
                                                     const std::shared_ptr<const CudaDevice>& device,
                                                     std::string* compiled, const WatchedLanes& watched) {
    const Compiled host = compile(host_side_of(source, precision, watched));
    DeviceKernel kernel{DeviceLibrary::load(host.object, source.digest), nullptr, nullptr, nullptr};
    if (!kernel.host.has_lanes())
        throw InputError(
            "--device: this kernel has no lanes for a GPU: its coordinates are iterated along their neighbours, or a "
            "trajectory is too large for a thread; compute with --device cpu");
    const Compiled code = compile_for_device(device_side_of(source, device->architecture(), kernel.host, watched));
    const std::string cubin = content_of(code.object);
    kernel.lanes = std::make_shared<const CudaFunction>(device, cubin, DeviceKernel::name_of_lanes);
    kernel.alike = std::make_shared<const CudaFunction>(device, cubin, DeviceKernel::name_of_alike);
    kernel.move = std::make_shared<const CudaFunction>(device, cubin, DeviceKernel::name_of_move);
    if (compiled != nullptr) *compiled = stem_of(host) + "+" + stem_of(code);
    return std::make_shared<const DeviceKernel>(std::move(kernel));
}

}  // namespace lobatto
