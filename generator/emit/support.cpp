// SPDX-License-Identifier: GPL-2.0-or-later
// Which parts of runtime/kernel/kernel.hpp a kernel stands on.
#include "generator/emit/support.hpp"

#include <fmt/format.h>

#include <set>

#include "generator/mechanics/derivation.hpp"
#include "generator/programs/looped.hpp"

namespace lobatto {

namespace {

// Where the Stepper of a kernel is; as stepping_of in runtime/kernel/base/contract.hpp.
std::string stepper_of(const Scene& scene, const Structure& structure) {
    if (scene.clock) return "steppers/clocked.hpp";
    if (structure.form() == StepForm::linear_map) return "steppers/linear.hpp";
    if (structure.form() == StepForm::general) return "steppers/general.hpp";
    return structure.clean()         ? "steppers/clean.hpp"
           : structure.is_explicit() ? "steppers/splitting.hpp"
                                     : "steppers/separable.hpp";
}

// As is_one_dense_group in runtime/kernel/base/dense.hpp.
bool is_one_dense_group(const std::vector<Group>& groups) {
    return groups.size() == 1 && 3 * (groups[0].bandwidth + 1) >= static_cast<int>(groups[0].coordinates.size());
}

}  // namespace

std::vector<std::string> support_of(const Derivation& derivation, const Graph& graph) {
    std::set<std::string> parts = {stepper_of(derivation.scene, derivation.structure)};
    if (derivation.structure.neighbours()) parts.insert("iteration/neighbours.hpp");
    if (!is_one_dense_group(derivation.structure.groups)) parts.insert("base/grouped.hpp");
    if (has_full_matrix(derivation)) parts.insert("base/full_matrix.hpp");
    if (!derivation.scene.watched().empty()) parts.insert("steppers/hybrid_stepper.hpp");
    if (!derivation.system.inputs.empty()) parts.insert("steppers/inputs.hpp");
    for (Id id = 0; id < graph.size(); ++id) switch (graph[id].op) {
            case Op::sin:
            case Op::cos:
            case Op::tan:
            case Op::sincos_pair:
                parts.insert("base/trigonometry.hpp");
                break;
            case Op::exp:
            case Op::log:
            case Op::sinh:
            case Op::cosh:
            case Op::tanh:
            case Op::raise:
                parts.insert("base/exponential.hpp");
                break;
            case Op::table:
                parts.insert("base/spline.hpp");
                break;
            case Op::positive_part:
                parts.insert("base/positive_part.hpp");
                break;
            case Op::asin:
            case Op::acos:
            case Op::atan:
            case Op::atan2:
                parts.insert("base/arc.hpp");
                break;
            default:
                break;
        }
    return {parts.begin(), parts.end()};
}

namespace {

// The headers that are included once must know of it.
std::string with_numbers(const std::string& macro, const std::string& otherwise) {
    return fmt::format(
        "#ifndef {0}\n"
        "#ifdef LOBATTO_KERNEL_NUMBERS_HPP\n"
        "#error \"include this kernel before those in other numbers{1}\"\n"
        "#endif\n"
        "#define {0}\n"
        "#endif\n",
        macro, otherwise);
}

}  // namespace

std::string before_support(Precision precision) {
    if (precision == Precision::quadruple)
        return with_numbers("LOBATTO_USE_FLOAT128", ", or define LOBATTO_USE_FLOAT128 before all of them");
    if (has_many_digits(precision)) return with_numbers("LOBATTO_USE_MPFR", "");
    if (precision == Precision::double_double)
        return with_numbers("LOBATTO_IN_DOUBLE_DOUBLE", "") +
               "#if defined(__GNUC__) && !defined(__clang__)\n"
               "#pragma GCC optimize(\"no-tree-slp-vectorize\")  // with which g++ 12 loses the low parts of sums\n"
               "#endif\n";
    return "";
}

}  // namespace lobatto
