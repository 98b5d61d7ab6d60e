# SPDX-License-Identifier: MIT
# cmake --install: installs the command, and the library as the CMake package darb. find_package(darb) gives darb::darb,
# which is all of engine/ and trainer/; so does add_subdirectory. docs/library.md shows how to use it.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

add_library(darb_library INTERFACE)
target_link_libraries(darb_library INTERFACE darb_trainer darb_mesh darb_publish darb_check)
set_target_properties(darb_library PROPERTIES EXPORT_NAME darb)
add_library(darb::darb ALIAS darb_library)

set(package ${CMAKE_INSTALL_LIBDIR}/cmake/darb)
# a folder of its own, because the includes begin with engine/, trainer/ and shaders/
set(headers ${CMAKE_INSTALL_INCLUDEDIR}/darb)
target_include_directories(darb_options INTERFACE $<INSTALL_INTERFACE:${headers}>)
install(TARGETS darb RUNTIME COMPONENT darb)
install(TARGETS darb_library darb_options darb_shaders darb_core darb_ranks darb_kernels darb_scene darb_reference darb_data darb_stereo
  darb_gpu darb_primitives darb_raster darb_plan darb_render darb_report darb_mesh darb_publish darb_check darb_trainer EXPORT darb ARCHIVE COMPONENT dev)
install(EXPORT darb NAMESPACE darb:: FILE darb-targets.cmake DESTINATION ${package} COMPONENT dev)
install(DIRECTORY engine trainer DESTINATION ${headers} COMPONENT dev FILES_MATCHING PATTERN "*.h")
install(DIRECTORY shaders/shared DESTINATION ${headers}/shaders COMPONENT dev FILES_MATCHING PATTERN "*.h")
install(FILES ${PROJECT_BINARY_DIR}/generated/constants/darb_constant_names.h DESTINATION ${headers} COMPONENT dev)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/generated/darb-config-version.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES cmake/darb-config.cmake ${PROJECT_BINARY_DIR}/generated/darb-config-version.cmake
  DESTINATION ${package} COMPONENT dev)

# What desktops and shells need to know about the command. The command that was built makes the pages.
find_program(PYTHON3_PROGRAM python3)
if(PYTHON3_PROGRAM AND NOT DARB_SANITIZE)
  set(pages ${PROJECT_BINARY_DIR}/pages)
  set(pages_script ${PROJECT_SOURCE_DIR}/tools/command_pages.py)
  add_custom_command(OUTPUT ${pages}/made DEPENDS darb ${pages_script}
    COMMAND ${PYTHON3_PROGRAM} -B ${pages_script} $<TARGET_FILE:darb> ${pages}
    COMMAND ${CMAKE_COMMAND} -E touch ${pages}/made)
  add_custom_target(darb_pages ALL DEPENDS ${pages}/made)
  install(DIRECTORY ${pages}/man1 DESTINATION ${CMAKE_INSTALL_MANDIR} COMPONENT darb OPTIONAL)
  install(FILES ${pages}/bash/darb DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions COMPONENT darb OPTIONAL)
  install(FILES ${pages}/zsh/_darb DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/vendor-completions COMPONENT darb OPTIONAL)
  install(FILES ${pages}/fish/darb.fish DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d COMPONENT darb OPTIONAL)
endif()
install(FILES assets/desktop/darb.desktop DESTINATION ${CMAKE_INSTALL_DATADIR}/applications COMPONENT darb)
install(FILES assets/desktop/darb.xml DESTINATION ${CMAKE_INSTALL_DATADIR}/mime/packages COMPONENT darb)
install(FILES assets/desktop/darb.svg DESTINATION ${CMAKE_INSTALL_DATADIR}/icons/hicolor/scalable/apps COMPONENT darb)
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/darb RENAME copyright COMPONENT darb)
if(GUI_FONT)  # the command contains it
  install(FILES /usr/share/doc/fonts-roboto-unhinted/copyright DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/darb
    RENAME copyright.fonts-roboto-unhinted COMPONENT darb)
endif()
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/libdarb-dev RENAME copyright COMPONENT dev)
