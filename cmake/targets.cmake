# darb_library(NAME DEPENDS...): static library darb_NAME from engine/NAME/*.cpp. A folder that has
# only headers so far still becomes a library, so that the arrows in CMakeLists.txt hold.
function(darb_library name)
  file(GLOB sources CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/engine/${name}/*.cpp)
  if(NOT sources)
    set(sources ${CMAKE_BINARY_DIR}/generated/headers_only.cpp)
    file(CONFIGURE OUTPUT ${sources} CONTENT "")
  endif()
  list(TRANSFORM ARGN PREPEND darb_ OUTPUT_VARIABLE depends)
  add_library(darb_${name} STATIC ${sources})
  target_link_libraries(darb_${name} PUBLIC darb_options ${depends})
endfunction()
