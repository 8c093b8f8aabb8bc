# Writes the texts of the kernel support headers into one C++ file, so that the program needs no source tree to compile kernels.
# The parts of kernel.hpp are joined in this order, each without its includes of the others.
set(parts kernel_numbers.hpp kernel_pack.hpp kernel_functions.hpp kernel_angles.hpp kernel_contract.hpp kernel_solve.hpp kernel_linear.hpp kernel_rows.hpp kernel_neighbours.hpp kernel_stage_map.hpp
    kernel_sweeps.hpp kernel_separable.hpp kernel_clean.hpp kernel_explicit.hpp kernel_galerkin.hpp kernel_general.hpp kernel_ensemble_sweeps.hpp kernel_ensemble.hpp kernel_events.hpp)
set(kernel_hpp)
foreach(name ${parts})
    file(READ ${SOURCE_DIR}/runtime/${name} content)
    string(REGEX REPLACE "#include \"kernel_[a-z_]+.hpp\"\n" "" content "${content}")
    string(APPEND kernel_hpp "${content}")
endforeach()
file(READ ${SOURCE_DIR}/runtime/kernel_abi.h kernel_abi_h)
file(READ ${SOURCE_DIR}/runtime/kernel_export.hpp kernel_export_hpp)

set(text "// Written by embed_support.cmake. The texts of runtime/kernel.hpp with its parts, kernel_abi.h and kernel_export.hpp.\n")
string(APPEND text "#include \"cli/support_text.hpp\"\n\nnamespace lobatto {\n\n")
foreach(identifier kernel_hpp kernel_abi_h kernel_export_hpp)
    # A string literal may hold 65,536 characters at least; pieces of 8,000 stay below every compiler's limit.
    string(LENGTH "${${identifier}}" length)
    string(APPEND text "const std::string ${identifier}_text = std::string()")
    set(begin 0)
    while(begin LESS length)
        string(SUBSTRING "${${identifier}}" ${begin} 8000 piece)
        string(APPEND text " + R\"~~~(${piece})~~~\"")
        math(EXPR begin "${begin} + 8000")
    endwhile()
    string(APPEND text ";\n\n")
endforeach()
string(APPEND text "}  // namespace lobatto\n")
file(WRITE ${OUTPUT} "${text}")
