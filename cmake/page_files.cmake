# SPDX-License-Identifier: MIT
# The page's own sources, and the shaders that it shares with darb.
file(GLOB page_files CONFIGURE_DEPENDS RELATIVE ${PROJECT_SOURCE_DIR}
  ${PROJECT_SOURCE_DIR}/engine/publish/page/* ${PROJECT_SOURCE_DIR}/shaders/shared/*.h
  ${PROJECT_SOURCE_DIR}/shaders/kernels/*.glsl ${PROJECT_SOURCE_DIR}/shaders/effects/*.glsl
  ${PROJECT_SOURCE_DIR}/shaders/lib/covariance.glsl ${PROJECT_SOURCE_DIR}/shaders/lib/finite.glsl
  ${PROJECT_SOURCE_DIR}/shaders/lib/half.glsl ${PROJECT_SOURCE_DIR}/shaders/lib/sh.glsl)
list(JOIN page_files "," names)
list(TRANSFORM page_files PREPEND ${PROJECT_SOURCE_DIR}/ OUTPUT_VARIABLE page_paths)
set(page_source ${PROJECT_BINARY_DIR}/generated/page_files.cpp)
add_custom_command(OUTPUT ${page_source} COMMAND ${CMAKE_COMMAND} -DOUT=${page_source} -DROOT=${PROJECT_SOURCE_DIR}
  -DFILES=${names} -P ${PROJECT_SOURCE_DIR}/cmake/embed.cmake
  DEPENDS ${page_paths} ${PROJECT_SOURCE_DIR}/cmake/embed.cmake VERBATIM)
target_sources(darb_publish PRIVATE ${page_source})
