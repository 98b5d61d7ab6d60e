#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Makes wheels of the Python package for pip, with the command darb in them. Run it on Debian 12, because a wheel runs
# with the glibc of the system that it was made on, and later ones.
#   tools/wheel.sh [OUT] [PYTHON]...    default: OUT is build-wheel/out; 3.11 and 3.13, those of Debian 12 and 13
# PYTHON is one of these versions, or the path of an interpreter that has its headers beside it. Each gives
# OUT/darb-VERSION-cpXY-cpXY-manylinux_2_36_x86_64.whl: pybind11 does not support Python's stable ABI. None of the
# interpreters is run, because the headers say all. tools/package_test.sh installs the wheels in bare systems.
set -euo pipefail
case ${1:-} in -h | --help) sed -n '3,/^[^#]/s/^# \{0,1\}//p' "$0"; exit 0 ;; esac
cd "$(dirname "$0")/.."

build=build-wheel out=build-wheel/out
[[ $# == 0 || $1 =~ ^3\.[0-9]+$ || -x $1 && ! -d $1 ]] || { out=$1; shift; }
[[ $# != 0 ]] || set -- 3.11 3.13
for tool in patchelf dpkg-source:dpkg-dev readelf:binutils; do
    command -v "${tool%:*}" >/dev/null || { echo "wheel.sh: ${tool%:*} is missing (apt install ${tool#*:})" >&2; exit 2; }
done
# shellcheck source=tools/portable/static_libraries.sh
. tools/portable/static_libraries.sh

# headers_of PYTHON: prints the folder pythonX.Y with its headers. pybind11 of Debian 13 knows numpy 2 and Python 3.13.
headers=$PWD/$build/headers
headers_of() {
    local version=$1 suite folder
    case $version in
        3.11) suite=bookworm ;;
        3.13) suite=trixie ;;
        *)
            [[ -x $version ]] || { echo "wheel.sh: $version: neither 3.11 nor 3.13, nor an interpreter" >&2; return 2; }
            folder=$("$version" -c 'import sysconfig; print(sysconfig.get_path("include"))')
            [[ -e $folder/Python.h ]] || { echo "wheel.sh: $version has no headers in $folder" >&2; return 2; }
            echo "$folder"
            return
            ;;
    esac
    [[ -e $headers/usr/include/python$version/Python.h ]] || debian_files "$headers" "libpython$version-dev/$suite" >&2 || return
    echo "$headers/usr/include/python$version"
}

[[ -e $headers/usr/include/pybind11/pybind11.h ]] || debian_files "$headers" pybind11-dev/trixie
folders="" targets=(darb)
for python in "$@"; do
    folder=$(headers_of "$python")
    folders+=${folders:+;}$folder
    version=${folder##*/python}
    targets+=("darb_python_${version//./}")
done
options=()
static_libraries "$PWD/$build/libraries" options
cmake -S . -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_CXX_COMPILER=g++ -DCMAKE_UNITY_BUILD=ON -DDARB_TESTS=OFF \
    -DDARB_MPI=OFF -DDARB_PYTHON=OFF -DDARB_PYTHON_HEADERS="$folders" -DDARB_PYBIND11_HEADERS="$headers/usr/include" \
    "${options[@]}" >/dev/null
cmake --build "$build" -j "${JOBS:-$(nproc)}" --target "${targets[@]}"
mkdir -p "$out"
for target in "${targets[@]:1}"; do
    python3 tools/portable/make_wheel.py "$build" "${target##*_}" "$out" --copyrights "$headers/usr/share/doc"
done
ls -l "$out"
