#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Makes the packages of darb for amd64. Run it on Debian 12, because the portable archive takes its libraries from
# there.
#   tools/package.sh [OUT] [deb | portable]...      default: OUT is build-portable/out; both
#     deb        OUT/darb_VERSION_amd64.deb and OUT/libdarb-dev_VERSION_amd64.deb
#     portable   OUT/darb-VERSION-linux-amd64.tar.xz: any Linux with glibc 2.31 or later and a Vulkan 1.3 driver
# The archive's libraries are linked statically. Where Debian has only shared ones, they are built from its source
# packages; the Vulkan loader lies beside the command. tools/package_test.sh installs both in bare systems.
set -euo pipefail
case ${1:-} in -h | --help) sed -n '3,/^[^#]/s/^# \{0,1\}//p' "$0"; exit 0 ;; esac
cd "$(dirname "$0")/.."

out=build-portable/out
[[ $# == 0 || $1 == deb || $1 == portable ]] || { out=$1; shift; }
mkdir -p "$out"
out=$(cd "$out" && pwd)
kinds=${*:-deb portable}
for kind in $kinds; do
    [[ $kind == deb || $kind == portable ]] || { echo "package.sh: no such package: $kind (deb, portable)" >&2; exit 2; }
done
for tool in dpkg-source:dpkg-dev python3:python3 fakeroot:fakeroot file:file; do
    command -v "${tool%:*}" >/dev/null || { echo "package.sh: ${tool%:*} is missing (apt install ${tool#*:})" >&2; exit 2; }
done
jobs=${JOBS:-$(nproc)}
common=(-G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_CXX_COMPILER=g++ -DCMAKE_UNITY_BUILD=ON -DDARB_TESTS=OFF -DCMAKE_INSTALL_PREFIX=/usr)

# Both share a build folder, so that they are linked from the same objects. What one found of the libraries that differ
# is forgotten before the other.
build=build-portable
configure() {
    local forgotten=(-U'*_LIBRARY' -U'*_LIBRARY_RELEASE' -U'*_LIBRARY_DEBUG')
    cmake -S . -B "$build" -DDARB_MPI=OFF "${common[@]}" "${forgotten[@]}" "$@" >/dev/null
}

make_deb() {
    configure -DDARB_PORTABLE=OFF
    cmake --build "$build" -j "$jobs"
    rm -rf "$build/cpack"
    (cd "$build" && cpack -G DEB -B cpack >/dev/null)
    cp "$build"/cpack/*.deb "$out/"
}

libraries=$PWD/$build/libraries # the prefix of what is built here
system=/usr/lib/x86_64-linux-gnu

# shellcheck source=tools/portable/static_libraries.sh
. tools/portable/static_libraries.sh

# newest_glibc FILE: prints the newest version of glibc that the file needs.
newest_glibc() { objdump -T "$1" | grep -o 'GLIBC_[0-9.]*' | sort -Vu | tail -1; }

make_portable() {
    local options
    static_libraries "$libraries" options
    configure -DDARB_PORTABLE=ON "${options[@]}" -DZSTD_LIBRARY=$system/libzstd.a -DWEBP_LIBRARY=$system/libwebp.a \
        -DZLIB_LIBRARY=$system/libz.a -DPNG_LIBRARY=$system/libpng16.a -DJPEG_LIBRARY=$system/libjpeg.a
    cmake --build "$build" -j "$jobs" --target darb darb_pages
    local version name stage documents
    version=$(sed -n 's/^CMAKE_PROJECT_VERSION:STATIC=//p' "$build/CMakeCache.txt")
    name=darb-$version-linux-amd64
    stage=$(mktemp -d)
    cmake --install "$build" --component darb --strip --prefix "$stage/$name" >/dev/null
    mkdir -p "$stage/$name/lib/darb"
    cp $system/libvulkan.so.1 "$stage/$name/lib/darb/"
    chmod u+w "$stage/$name/lib/darb/libvulkan.so.1"
    tools/portable/lower_versions.py "$stage/$name/lib/darb/libvulkan.so.1"
    documents=$stage/$name/share/doc/darb
    for package in libfmt-dev libzip-dev libmuparser-dev libmeshoptimizer-dev libglfw3-dev libimgui-dev libstb-dev libzstd-dev libwebp-dev zlib1g-dev \
        libpng-dev libjpeg62-turbo libvulkan1 gcc-12-base; do
        cp "/usr/share/doc/$package/copyright" "$documents/copyright.$package"
    done
    for file in "$stage/$name/bin/darb" "$stage/$name/lib/darb/libvulkan.so.1"; do
        local newest
        newest=$(newest_glibc "$file")
        if [[ $(printf '%s\n' GLIBC_2.31 "$newest" | sort -V | tail -1) != GLIBC_2.31 ]]; then
            echo "package.sh: ${file#"$stage"/} needs $newest:" >&2
            objdump -T "$file" | grep -E "GLIBC_2\.(3[2-9]|[4-9][0-9])" >&2
            exit 1
        fi
        local needed foreign
        needed=$(objdump -p "$file" | awk '/NEEDED/ { printf "%s ", $2 }')
        foreign=$(tr ' ' '\n' <<<"$needed" | grep -vE '^(lib(c|m|dl|pthread|vulkan|rt)\.so\.[0-9]+|ld-linux-x86-64\.so\.2|)$' || true)
        [[ -z $foreign ]] || { echo "package.sh: ${file#"$stage"/} needs $foreign, which not every Linux has" >&2; exit 1; }
        echo "${file#"$stage"/}: needs $newest and $needed"
    done
    tar -C "$stage" --owner=0 --group=0 --sort=name -cJf "$out/$name.tar.xz" "$name"
    rm -rf "$stage"
}

for kind in $kinds; do "make_$kind"; done
ls -l "$out"
