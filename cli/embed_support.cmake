# Writes the texts of the kernel support headers into one C++ file, so that the program needs no source tree to compile kernels.
# The parts of kernel.hpp stand in an order in which each follows those that it includes.
set(parts kernel_numbers.hpp kernel_pack.hpp kernel_functions.hpp kernel_angles.hpp kernel_contract.hpp kernel_solve.hpp kernel_linear.hpp kernel_rows.hpp kernel_neighbours.hpp kernel_stage_map.hpp
    kernel_sweeps.hpp kernel_separable.hpp kernel_clean.hpp kernel_explicit.hpp kernel_galerkin.hpp kernel_general.hpp kernel_ensemble_sweeps.hpp kernel_ensemble.hpp kernel_events.hpp)

# The text of a file of runtime/ as a C++ literal, for which every compiler has 65,536 characters.
function(literal name result)
    file(READ ${SOURCE_DIR}/runtime/${name} content)
    string(LENGTH "${content}" length)
    if(length GREATER 65000)
        message(FATAL_ERROR "runtime/${name} is too long for one string literal")
    endif()
    set(${result} "R\"~~~(${content})~~~\"" PARENT_SCOPE)
endfunction()

set(text "// Written by embed_support.cmake. The texts of the parts of runtime/kernel.hpp, of kernel_abi.h and kernel_export.hpp.\n")
string(APPEND text "#include \"cli/support_text.hpp\"\n\nnamespace lobatto {\n\nconst std::vector<SupportPart> support_parts = {\n")
foreach(name ${parts})
    literal(${name} quoted)
    string(APPEND text "    {\"${name}\", ${quoted}},\n")
endforeach()
literal(kernel_abi.h kernel_abi_h)
literal(kernel_export.hpp kernel_export_hpp)
string(APPEND text "};\n\nconst std::string_view kernel_abi_h_text = ${kernel_abi_h};\n\nconst std::string_view kernel_export_hpp_text = ${kernel_export_hpp};\n\n}  // namespace lobatto\n")
file(WRITE ${OUTPUT} "${text}")
