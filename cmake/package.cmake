# Packages (./run package): a .deb by CPack, and what the tarball is packed from (cmake/package/tarball.sh).
# The shell completions and the manual page are printed by the program itself, where it can run.
set(CPACK_PACKAGE_NAME restage)
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGE_CONTACT "Restage developers")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "${PROJECT_DESCRIPTION}")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_GENERATOR DEB)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
# The module for Python; what a program that links the library needs, as in restageConfig.cmake.
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "python3, python3-numpy")
set(CPACK_DEBIAN_PACKAGE_SUGGESTS "bash-completion, g++, cmake, ninja-build, pkg-config, libeigen3-dev, libtbb-dev, libhdf5-dev, libyaml-cpp-dev, libspdlog-dev, liblzma-dev, zlib1g-dev, libzip-dev, libssl-dev, libcurl4-openssl-dev, libhwy-dev, libtinygltf-dev, libassimp-dev, liblo-dev, libwebsockets-dev, libwebp-dev, libgif-dev")
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
include(CPack)

set(extras ${PROJECT_BINARY_DIR}/package-extras)
install(CODE "
  set(extras \"${extras}\")
  execute_process(COMMAND \"$<TARGET_FILE:restage_cli>\" --version OUTPUT_QUIET ERROR_QUIET RESULT_VARIABLE code)
  if(code EQUAL 0)
    file(MAKE_DIRECTORY \"\${extras}\")
    foreach(shell bash zsh fish)
      execute_process(COMMAND \"$<TARGET_FILE:restage_cli>\" completion \${shell} OUTPUT_FILE \"\${extras}/\${shell}\"
        COMMAND_ERROR_IS_FATAL ANY)
    endforeach()
    find_program(HELP2MAN help2man)
    if(HELP2MAN)
      execute_process(COMMAND \${HELP2MAN} --no-info --name \"${PROJECT_DESCRIPTION}\" --output \"\${extras}/restage.1\"
        \"$<TARGET_FILE:restage_cli>\" COMMAND_ERROR_IS_FATAL ANY)
    endif()
  endif()")
install(FILES ${extras}/bash DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions RENAME restage OPTIONAL)
install(FILES ${extras}/zsh DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/vendor-completions RENAME _restage OPTIONAL)
install(FILES ${extras}/fish DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d RENAME restage.fish OPTIONAL)
install(FILES ${extras}/restage.1 DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 OPTIONAL)
