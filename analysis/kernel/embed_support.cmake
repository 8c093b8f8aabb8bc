# Writes the texts of the kernel support headers into one C++ file, so that the program needs no source tree to compile kernels.
# The parts of kernel.hpp stand in an order in which each follows those that it includes.
set(parts base/numbers.hpp base/many_digits.hpp base/registers.hpp base/pack.hpp base/functions.hpp base/trigonometry.hpp base/exponential.hpp base/arc.hpp base/positive_part.hpp base/spline.hpp base/double_double.hpp base/double_double_functions.hpp base/angles.hpp base/full_matrix.hpp base/contract.hpp base/dense.hpp base/grouped.hpp base/shifts.hpp base/rows.hpp
    iteration/lane_state.hpp iteration/tangent.hpp iteration/convergence.hpp iteration/stage_coefficients.hpp iteration/stage_equations.hpp iteration/newton.hpp iteration/stage_map.hpp iteration/fixed_point.hpp iteration/refinement.hpp
    iteration/neighbours.hpp iteration/extrapolation.hpp iteration/constraint_rounding.hpp iteration/node_mass.hpp iteration/constrained_fixed_point.hpp iteration/hamilton.hpp iteration/galerkin_tables.hpp iteration/galerkin.hpp iteration/galerkin_equations.hpp iteration/galerkin_newton.hpp iteration/constraint_checks.hpp iteration/velocity_of_momentum.hpp iteration/ensemble_tables.hpp iteration/ensemble_fixed_point.hpp steppers/linear.hpp steppers/separable.hpp
    steppers/clean.hpp steppers/splitting.hpp steppers/general.hpp steppers/shortened.hpp steppers/clocked.hpp steppers/ensemble.hpp steppers/clocked_lanes.hpp steppers/watched_stepper.hpp steppers/sampled_function.hpp steppers/events.hpp steppers/walls.hpp steppers/refraction.hpp steppers/sides.hpp steppers/watch.hpp steppers/hybrid_stepper.hpp steppers/refilled.hpp steppers/inputs.hpp)

# The text of a file of runtime/kernel/ as a C++ literal, for which every compiler has 65,536 characters.
function(literal name result)
    file(READ ${SOURCE_DIR}/runtime/kernel/${name} content)
    string(LENGTH "${content}" length)
    if(length GREATER 65000)
        message(FATAL_ERROR "runtime/kernel/${name} is too long for one string literal")
    endif()
    set(${result} "R\"~~~(${content})~~~\"" PARENT_SCOPE)
endfunction()

set(text "// Written by embed_support.cmake. The texts of the parts of runtime/kernel/kernel.hpp, and of what stands beside it.\n")
string(APPEND text "#include \"analysis/kernel/support_text.hpp\"\n\nnamespace lobatto {\n\nconst std::vector<SupportPart> support_parts = {\n")
foreach(name ${parts})
    literal(${name} quoted)
    string(APPEND text "    {\"${name}\", ${quoted}},\n")
endforeach()
string(APPEND text "};\n\n")
foreach(name abi.h export/lanes.hpp export/advance.hpp export/export.hpp kept.hpp device_lanes.hpp device_host.hpp)
    literal(${name} quoted)
    string(REGEX REPLACE "[./]" "_" identifier ${name})
    string(APPEND text "const std::string_view kernel_${identifier}_text = ${quoted};\n\n")
endforeach()
string(APPEND text "}  // namespace lobatto\n")
file(WRITE ${OUTPUT} "${text}")
