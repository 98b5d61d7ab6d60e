#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# darb for Windows on amd64, built on Debian 12 (tools/setup.sh --with-windows installs what it takes).
#   tools/windows.sh [libraries | build | test | package]...      default: build package
#     libraries  the libraries that darb links, from Debian's source packages, in build-windows/libraries
#     build      build-windows/darb.exe, which needs no other file
#     test       runs it under Wine and Xvfb (docs/windows.md says what is looked at)
#     package    build-windows/out: a zip archive, and an installer where makensis is there
# A step makes what it needs first; what is there is not made again.
set -euo pipefail
case ${1:-} in -h | --help) sed -n '3,/^[^#]/s/^# \{0,1\}//p' "$0"; exit 0 ;; esac
cd "$(dirname "$0")/.."
# shellcheck source=tools/portable/debian_sources.sh
. tools/portable/debian_sources.sh

build=$PWD/build-windows
libraries=$build/libraries # the prefix of what is built here
jobs=${JOBS:-$(nproc)}
triple=x86_64-w64-mingw32

# Source package, and the SHA-256 of its upstream archive: another one is another library, to be looked at first.
# Debian's fixes come on top of it.
sources='
libzstd        8cf4bbb65e77ec348d052c8d6230eba66d435bddf64c8b5be2fcb16880c19953  libzstd_1.5.4+dfsg2.orig.tar.xz
fmtlib         84ce1c2d0be3a9863935137969dcec6970125caac032f82474640bfc81463583  fmtlib_9.1.0+ds1.orig.tar.gz
libpng1.6      a00e9d2f2f664186e4202db9299397f851aea71b36a35e74910b8820e380d441  libpng1.6_1.6.39.orig.tar.gz
libjpeg-turbo  254f3642b04e309fee775123133c6464181addc150499561020312ec61c1bf7c  libjpeg-turbo_2.1.5.orig.tar.gz
libwebp        7bf5a8a28cc69bcfa8cb214f2c3095703c6b73ac5fba4d5480c205331d9494df  libwebp_1.2.4.orig.tar.gz
libzip         a60473ffdb7b4260c08bfa19c2ccea0438edac11193c3afbbb1f17fbcf6c6132  libzip_1.7.3.orig.tar.xz
muparser       91d26d8274ae9cd9c776ee58250aeddc6b574f369eafd03b25045b858a2b8177  muparser_2.3.3.orig.tar.gz
glfw3          f30f42e05f11e5fc62483e513b0488d5bceeab7d9c5da0ffe2252ad81816c713  glfw3_3.3.8.orig.tar.gz
imgui          0dace0e8e57d298eb6e93af12dc19420cb96330832f6495c733b90aeeef11f64  imgui_1.86+ds.orig.tar.xz
googletest     81964fe578e9bd7c94dfdb09c8e4d6e6759e19967e397dbea48d1c10e45d0df2  googletest_1.12.1.orig.tar.gz
'

need() { # TOOL:PACKAGE...
    for tool in "$@"; do
        command -v "${tool%:*}" >/dev/null ||
            { echo "windows.sh: ${tool%:*} of the package ${tool#*:} is missing: tools/setup.sh --with-windows" >&2; exit 2; }
    done
}

# logged NAME COMMAND...: shows the end of what it printed where it fails.
logged() {
    local log=$libraries/$1.log
    "${@:2}" >>"$log" 2>&1 || { tail -30 "$log" >&2; echo "windows.sh: $1 cannot be built: $log" >&2; exit 1; }
}

source_of() { find "$libraries/source" -mindepth 1 -maxdepth 1 -type d -name "$1-[0-9]*"; }

# library NAME OPTIONS...: a source package's static library. FOLDER: where its CMakeLists.txt is, in the package.
library() {
    local name=$1 work=$libraries/made/$1
    shift
    logged "$name" cmake -S "$(source_of "$name")/${folder:-.}" -B "$work" -G Ninja -DCMAKE_BUILD_TYPE=Release \
        -DCMAKE_TOOLCHAIN_FILE="$PWD/cmake/mingw.cmake" -DDARB_WINDOWS_PREFIX="$libraries" -DBUILD_SHARED_LIBS=OFF \
        -DCMAKE_INSTALL_PREFIX="$libraries" -DCMAKE_INSTALL_LIBDIR=lib "$@"
    logged "$name" cmake --build "$work" -j "$jobs" --target install
}

# Dear ImGui has no build of its own: the library and the two backends that the viewer uses.
make_imgui() {
    local from part
    from=$(source_of imgui)
    mkdir -p "$libraries/made/imgui" "$libraries/include/imgui/backends"
    cp "$from"/*.h "$libraries/include/imgui/"
    cp "$from"/backends/imgui_impl_{glfw,vulkan}.h "$libraries/include/imgui/backends/"
    for part in imgui imgui_draw imgui_tables imgui_widgets backends/imgui_impl_glfw backends/imgui_impl_vulkan; do
        logged imgui $triple-g++-posix -O2 -DNDEBUG -D_WIN32_WINNT=0x0A00 -I"$from" -I"$libraries/include" -c "$from/$part.cpp" \
            -o "$libraries/made/imgui/${part##*/}.o"
    done
    logged imgui $triple-ar rcs "$libraries/lib/libimgui.a" "$libraries"/made/imgui/*.o
}

# The import library of Vulkan's loader, which comes with the driver of the graphics card. The functions are looked up
# when the first of them is called, so that what needs no device runs where there is no driver.
make_vulkan() {
    local definition=$libraries/made/vulkan-1.def
    { echo "LIBRARY vulkan-1.dll"; echo EXPORTS
      sed -n 's/^VKAPI_ATTR .* VKAPI_CALL \(vk[A-Za-z0-9]*\)(.*/\1/p' /usr/include/vulkan/vulkan_core.h |
          grep -v '\(KHR\|EXT\|[A-Z][A-Z]\)$'
      printf 'vk%sKHR\n' DestroySurface GetPhysicalDeviceSurface{Support,Capabilities,Formats,PresentModes} \
          {Create,Destroy}Swapchain GetSwapchainImages AcquireNextImage QueuePresent; } >"$definition"
    logged vulkan $triple-dlltool --def "$definition" --output-delaylib "$libraries/lib/libvulkan-1.a"
}

# Headers alone: those that Linux has, as none of them depends on the system.
make_headers() {
    local include=$libraries/include name
    mkdir -p "$include" "$libraries/share/cmake"
    for name in glm nanoflann.hpp stb CLI nlohmann eigen3 vulkan vk_video; do
        cp -r "/usr/include/$name" "$include/"
    done
    cp -r /usr/share/cmake/nlohmann_json "$libraries/share/cmake/"
    mkdir -p "$libraries/share/eigen3"
    cp -r /usr/share/eigen3/cmake "$libraries/share/eigen3/"
}

make_libraries() {
    [[ ! -e $libraries/done ]] || return 0
    need $triple-g++-posix:g++-mingw-w64-x86-64-posix dpkg-source:dpkg-dev nasm:nasm
    rm -rf "$libraries"
    mkdir -p "$libraries"/{source,work,lib}
    # shellcheck disable=SC2046
    debian_sources "$libraries" $(awk 'NF { print $1 "/bookworm" }' <<<"$sources")
    (cd "$libraries/source" && awk 'NF { print $2 "  " $3 }' <<<"$sources" | sha256sum --check --quiet) ||
        { echo "windows.sh: Debian has other sources now; look at them and change the table in this script" >&2; exit 1; }
    make_headers
    folder=build/cmake library libzstd -DZSTD_BUILD_{PROGRAMS,SHARED,TESTS}=OFF
    library fmtlib -DFMT_TEST=OFF -DFMT_DOC=OFF
    library libpng1.6 -DPNG_SHARED=OFF -DPNG_TESTS=OFF
    library libjpeg-turbo -DENABLE_SHARED=OFF -DWITH_TURBOJPEG=OFF -DCMAKE_INSTALL_LIBDIR="$libraries/lib"
    library libwebp -DWEBP_BUILD_{ANIM_UTILS,CWEBP,DWEBP,GIF2WEBP,IMG2WEBP,VWEBP,WEBPINFO,WEBPMUX,EXTRAS}=OFF
    library libzip -DENABLE_{COMMONCRYPTO,GNUTLS,MBEDTLS,OPENSSL,WINDOWS_CRYPTO,BZIP2,LZMA,ZSTD}=OFF -DBUILD_{TOOLS,REGRESS,EXAMPLES,DOC}=OFF
    library muparser -DENABLE_{SAMPLES,OPENMP,WIDE_CHAR}=OFF
    library glfw3 -DGLFW_BUILD_{EXAMPLES,TESTS,DOCS}=OFF
    library googletest -DBUILD_GMOCK=OFF
    make_imgui
    make_vulkan
    touch "$libraries/done"
}

configure() {
    make_libraries
    # Unity builds as in the preset release; the letters of the viewer's panels come from Linux's package.
    cmake -S . -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_TOOLCHAIN_FILE="$PWD/cmake/mingw.cmake" \
        -DDARB_WINDOWS_PREFIX="$libraries" -DCMAKE_PREFIX_PATH="$libraries" -DCMAKE_UNITY_BUILD=ON \
        -DCMAKE_UNITY_BUILD_BATCH_SIZE=12 -DDARB_MPI=OFF -DGUI_FONT=/usr/share/fonts/truetype/roboto/unhinted/RobotoTTF/Roboto-Regular.ttf -DDARB_EXAMPLES=OFF "$@" >"$build/configure.log" 2>&1 ||
        { cat "$build/configure.log" >&2; exit 1; }
}

make_build() {
    configure
    cmake --build "$build" -j "$jobs" --target darb -- -k 0
}

make_test() {
    [[ -e $build/darb.exe ]] || make_build
    tests/scripts/wine.sh "$build/darb.exe" build/darb "$build/window.png" || { [[ $? == 77 ]] || exit 1; }
}

# What is in darb.exe: each library's licence as Debian has it, by the package whose text is the same.
licences='libzstd-dev libfmt-dev libpng-dev libjpeg62-turbo-dev libwebp-dev libzip-dev libmuparser-dev libglfw3-dev libimgui-dev
    libglm-dev libnanoflann-dev libstb-dev libcli11-dev nlohmann-json3-dev libeigen3-dev zlib1g-dev libvulkan-dev
    fonts-roboto-unhinted gcc-12-base mingw-w64-x86-64-dev'

make_package() {
    [[ -e $build/darb.exe ]] || make_build
    local version name folder package
    version=$(sed -n 's/^CMAKE_PROJECT_VERSION:STATIC=//p' "$build/CMakeCache.txt")
    name=darb-$version-windows-amd64 folder=$build/out/$name
    rm -rf "$build/out"
    mkdir -p "$folder/licenses"
    $triple-strip -o "$folder/darb.exe" "$build/darb.exe"
    text() { sed 's/$/\r/' "$1" >"$2"; } # lines end as editors of old expect it
    text assets/windows/README.txt "$folder/README.txt"
    text LICENSE "$folder/LICENSE.txt"
    for package in $licences; do text "/usr/share/doc/$package/copyright" "$folder/licenses/$package.txt"; done
    (cd "$build/out" && cmake -E tar cf "$name.zip" --format=zip "$name")
    if command -v makensis >/dev/null; then
        makensis -V2 -DVERSION="$version" -DFOLDER="$folder" -DOUT="$build/out/$name-setup.exe" assets/windows/darb.nsi
    else
        echo "windows.sh: no installer: makensis is missing (tools/setup.sh --with-windows)"
    fi
    rm -r "$folder"
    # What it takes from Windows must be there on every one of them.
    $triple-objdump -p "$build/darb.exe" | sed -n 's/.*DLL Name: /darb.exe needs /p'
    ls -l "$build/out"
}

[[ $# != 0 ]] || set -- build package
for step in "$@"; do
    case $step in
        libraries | build | test | package) "make_$step" ;;
        *) echo "windows.sh: no such step: $step (libraries, build, test, package)" >&2; exit 2 ;;
    esac
done
