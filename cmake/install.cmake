# cmake --install: the command, and the library as the CMake package darb. find_package(darb) gives darb::darb, all of
# engine/ and trainer/; add_subdirectory gives the same. docs/library.md shows how it is used.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

add_library(darb_library INTERFACE)
target_link_libraries(darb_library INTERFACE darb_trainer darb_publish darb_check)
set_target_properties(darb_library PROPERTIES EXPORT_NAME darb)
add_library(darb::darb ALIAS darb_library)

set(package ${CMAKE_INSTALL_LIBDIR}/cmake/darb)
set(headers ${CMAKE_INSTALL_INCLUDEDIR}/darb)  # of its own: the includes begin with engine/, trainer/ and shaders/
target_include_directories(darb_options INTERFACE $<INSTALL_INTERFACE:${headers}>)
install(TARGETS darb RUNTIME)
install(TARGETS darb_library darb_options darb_shaders darb_core darb_kernels darb_scene darb_reference darb_data
  darb_gpu darb_primitives darb_raster darb_plan darb_render darb_report darb_publish darb_check darb_trainer EXPORT darb ARCHIVE)
install(EXPORT darb NAMESPACE darb:: FILE darb-targets.cmake DESTINATION ${package})
install(DIRECTORY engine trainer DESTINATION ${headers} FILES_MATCHING PATTERN "*.h")
install(DIRECTORY shaders/shared DESTINATION ${headers}/shaders FILES_MATCHING PATTERN "*.h")
write_basic_package_version_file(${PROJECT_BINARY_DIR}/generated/darb-config-version.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES cmake/darb-config.cmake ${PROJECT_BINARY_DIR}/generated/darb-config-version.cmake
  DESTINATION ${package})
