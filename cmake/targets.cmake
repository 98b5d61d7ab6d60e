# SPDX-License-Identifier: MIT
# darb_linked_anywhere(TARGETS...): marks static libraries that a shared library, such as the Python module, may
# contain. Their functions cannot be replaced from outside, so they are called as in a program. Without the module they
# are compiled as for programs.
function(darb_linked_anywhere)
  if(DARB_WITH_PYTHON)
    set_target_properties(${ARGN} PROPERTIES POSITION_INDEPENDENT_CODE ON CXX_VISIBILITY_PRESET hidden
      VISIBILITY_INLINES_HIDDEN ON)
  endif()
endfunction()

# darb_library(NAME DEPENDS...): the static library darb_NAME from engine/NAME/*.cpp. A folder with headers alone
# becomes a library, too, so that the arrows in CMakeLists.txt hold.
function(darb_library name)
  file(GLOB sources CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/engine/${name}/*.cpp)
  # What needs the system is written once for each (engine/core).
  if(WIN32)
    list(FILTER sources EXCLUDE REGEX "_posix\\.cpp$")
  else()
    list(FILTER sources EXCLUDE REGEX "_windows\\.cpp$")
  endif()
  if(NOT sources)
    set(sources ${PROJECT_BINARY_DIR}/generated/headers_only.cpp)
    file(CONFIGURE OUTPUT ${sources} CONTENT "")
  endif()
  list(TRANSFORM ARGN PREPEND darb_ OUTPUT_VARIABLE depends)
  add_library(darb_${name} STATIC ${sources})
  target_link_libraries(darb_${name} PUBLIC darb_options ${depends})
  target_precompile_headers(darb_${name} REUSE_FROM darb_precompiled)
  darb_linked_anywhere(darb_${name})
endfunction()

# Headers that most files parse and that are slow to parse, which are parsed once. The clang preset does without them,
# so that a forgotten include is an error there (CMAKE_DISABLE_PRECOMPILE_HEADERS in CMakePresets.json).
set(darb_slow_headers <algorithm> <cmath> <filesystem> <functional> <optional> <string> <vector>
  <fmt/format.h> <glm/glm.hpp> <nlohmann/json.hpp>)
file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/generated/precompiled.cpp CONTENT "")
add_library(darb_precompiled STATIC ${PROJECT_BINARY_DIR}/generated/precompiled.cpp)
target_link_libraries(darb_precompiled PRIVATE darb_options nlohmann_json::nlohmann_json)
target_precompile_headers(darb_precompiled PRIVATE ${darb_slow_headers})
darb_linked_anywhere(darb_precompiled)
