# SPDX-License-Identifier: MIT
# cpack: the Debian packages darb (the command) and libdarb-dev (the library); tools/package.sh runs it.
# tools/package_python.sh makes python3-darb.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME darb)
set(CPACK_PACKAGE_CONTACT "The darb authors <darb@localhost>")
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_COMPONENTS_ALL darb dev)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_COMPONENT_DARB_DESCRIPTION "Train, render and measure 3D splat scenes
 Turns photos into 3D splat scenes, and shows, measures and converts them, with
 a choice of kernel. Runs on any Vulkan 1.3 device; with Mesa's driver lavapipe
 that is any CPU.")
set(CPACK_COMPONENT_DEV_DESCRIPTION "Library of darb: 3D splats on any Vulkan device
 Headers, static libraries and the CMake package darb: find_package(darb) gives
 the target darb::darb.")
set(CPACK_DEBIAN_DARB_PACKAGE_NAME darb)
set(CPACK_DEBIAN_DARB_PACKAGE_SECTION graphics)
set(CPACK_DEBIAN_DARB_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_DARB_PACKAGE_RECOMMENDS mesa-vulkan-drivers)
set(CPACK_DEBIAN_DARB_PACKAGE_SUGGESTS "colmap, ffmpeg")
set(CPACK_DEBIAN_DEV_PACKAGE_NAME libdarb-dev)
set(CPACK_DEBIAN_DEV_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEV_PACKAGE_DEPENDS "libvulkan-dev, libfmt-dev, nlohmann-json3-dev, libglm-dev, libjpeg-dev, \
libpng-dev, zlib1g-dev, libzip-dev, libzstd-dev, libwebp-dev")
if(MUPARSER_LIBRARY)
  string(APPEND CPACK_DEBIAN_DEV_PACKAGE_DEPENDS ", libmuparser-dev")
endif()
if(MESHOPTIMIZER_LIBRARY)
  string(APPEND CPACK_DEBIAN_DEV_PACKAGE_DEPENDS ", libmeshoptimizer-dev")
endif()
include(CPack)
