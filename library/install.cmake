# What `cmake --install` writes, and the Debian package made of it.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

set(LOBATTO_CMAKE_DIR ${CMAKE_INSTALL_LIBDIR}/cmake/Lobatto)
install(TARGETS lobatto liblobatto lobatto_kernel_flags EXPORT LobattoTargets)
set_target_properties(lobatto PROPERTIES EXPORT_NAME program)
install(DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR}/include/lobatto DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(EXPORT LobattoTargets NAMESPACE Lobatto:: DESTINATION ${LOBATTO_CMAKE_DIR})
configure_package_config_file(${CMAKE_CURRENT_SOURCE_DIR}/cmake/LobattoConfig.cmake.in ${PROJECT_BINARY_DIR}/LobattoConfig.cmake
    INSTALL_DESTINATION ${LOBATTO_CMAKE_DIR} PATH_VARS CMAKE_INSTALL_BINDIR)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/LobattoConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/LobattoConfig.cmake ${PROJECT_BINARY_DIR}/LobattoConfigVersion.cmake
    ${CMAKE_CURRENT_SOURCE_DIR}/cmake/LobattoAddKernel.cmake DESTINATION ${LOBATTO_CMAKE_DIR})

# A folder that was moved finds itself again.
file(RELATIVE_PATH PKGCONFIG_TO_PREFIX /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)
string(REGEX REPLACE "/$" "" PKGCONFIG_TO_PREFIX "${PKGCONFIG_TO_PREFIX}")
configure_file(${CMAKE_CURRENT_SOURCE_DIR}/cmake/lobatto.pc.in ${PROJECT_BINARY_DIR}/lobatto.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/lobatto.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)

install(DIRECTORY ${PROJECT_SOURCE_DIR}/scenes ${PROJECT_SOURCE_DIR}/examples ${PROJECT_SOURCE_DIR}/LICENSES DESTINATION ${CMAKE_INSTALL_DATADIR}/lobatto)
install(FILES ${PROJECT_SOURCE_DIR}/README.md ${PROJECT_SOURCE_DIR}/CHANGELOG.md DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE.md DESTINATION ${CMAKE_INSTALL_DOCDIR} RENAME copyright)

# Manual pages, completions and the schema of scenes come from the program itself.
set(MANUAL_DIR ${PROJECT_BINARY_DIR}/manual)
cmake_policy(SET CMP0087 NEW)
install(CODE "
    set(lobatto [[$<TARGET_FILE:lobatto>]])
    set(folder [[${MANUAL_DIR}]])
    file(MAKE_DIRECTORY \"\${folder}\")
    execute_process(COMMAND \"\${lobatto}\" manual -o \"\${folder}/man1\" OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
    execute_process(COMMAND \"\${lobatto}\" schema -o \"\${folder}/scene.schema.json\" COMMAND_ERROR_IS_FATAL ANY)
    foreach(shell bash zsh fish)
        execute_process(COMMAND \"\${lobatto}\" manual --completions \${shell}
            OUTPUT_FILE \"\${folder}/lobatto.\${shell}\" COMMAND_ERROR_IS_FATAL ANY)
    endforeach()")
install(DIRECTORY ${MANUAL_DIR}/man1 DESTINATION ${CMAKE_INSTALL_MANDIR})
install(FILES ${MANUAL_DIR}/lobatto.bash DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions RENAME lobatto)
install(FILES ${MANUAL_DIR}/lobatto.zsh DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/site-functions RENAME _lobatto)
install(FILES ${MANUAL_DIR}/lobatto.fish DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d)
install(FILES ${MANUAL_DIR}/scene.schema.json DESTINATION ${CMAKE_INSTALL_DATADIR}/lobatto)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/docs/schemas DESTINATION ${CMAKE_INSTALL_DATADIR}/lobatto)

# The package of a project that takes this one in is that project's own.
if(NOT PROJECT_IS_TOP_LEVEL)
    return()
endif()
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME lobatto)
set(CPACK_PACKAGE_CONTACT "The Lobatto authors <lobatto@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "compiler for mechanics: from a Lagrangian to its variational integrator")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_DEPENDS "g++ | clang")
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS gnuplot-nox)
if(LOBATTO_PYTHON)
    string(APPEND CPACK_DEBIAN_PACKAGE_RECOMMENDS ", python3-numpy")
endif()
include(CPack)
