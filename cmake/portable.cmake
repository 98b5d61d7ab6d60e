# SPDX-License-Identifier: MIT
# -DDARB_PORTABLE=ON: the command for any Linux on amd64 with glibc 2.31 or later. tools/package.sh passes static
# libraries for everything but the Vulkan loader, which it puts into lib/darb beside bin.
set(old_glibc ${PROJECT_SOURCE_DIR}/tools/portable/old_glibc.c)
add_library(darb_old_glibc OBJECT ${old_glibc})
set_target_properties(darb_old_glibc PROPERTIES POSITION_INDEPENDENT_CODE ON UNITY_BUILD OFF)
target_sources(darb PRIVATE $<TARGET_OBJECTS:darb_old_glibc>)
file(READ ${old_glibc} text)
string(REGEX MATCHALL "\nOLD\\([a-z_0-9]+|HIDDEN (int|unsigned|void) __wrap_[a-z_0-9]+|globl __wrap_[a-z_0-9]+" places "${text}")
foreach(place ${places})
  string(REGEX REPLACE "^\nOLD\\(|^.* __wrap_" "" name "${place}")
  target_link_options(darb PRIVATE -Wl,--wrap=${name})
endforeach()
# Before glibc 2.34, threads and dlopen were separate libraries.
target_link_options(darb PRIVATE -static-libstdc++ -static-libgcc -Wl,--exclude-libs,ALL
  -Wl,--push-state,--no-as-needed -l:libpthread.so.0 -l:libdl.so.2 -l:libm.so.6 -Wl,--pop-state)
set_target_properties(darb PROPERTIES INSTALL_RPATH "$ORIGIN/../lib/darb")
