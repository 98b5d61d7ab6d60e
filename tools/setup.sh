#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Installs the distribution packages that darb is built and tested with (Debian 12, Ubuntu 24.04).
# Needs root or sudo only when something is missing; a second run returns at once.
set -euo pipefail

usage() {
    cat <<'TEXT'
usage: tools/setup.sh [options]
  --dry-run             only say what would be installed
  --no-tests            leave out what only the tests and the quality checks need
  --with-python         what the Python module is built and used with, with --no-tests too
  --with-torch          PyTorch too, for the tests of LPIPS and of darb.torch: 0.6 GB on disk
  --with-packaging      what tools/package.sh and tools/package_test.sh run
  --with-colmap         COLMAP too: training from photos without cameras runs it
  --with-mpi            Open MPI: training on several machines, docs/scale.md
  --with-windows        Debian 12: what tools/windows.sh builds darb for Windows with, and tries it with
  --with-mesa-backport  Debian 12: Mesa 25 from bookworm-backports; on the CPU it blends 1.5-1.7
                        times as fast as Mesa 22.3
TEXT
}

# group  package              what for; the names are the same on both systems, but for pages
packages='
build    g++                  compiler
build    cmake                build system
build    ninja-build          build system
build    ccache               quick rebuilds
build    glslang-tools        GLSL to SPIR-V
build    libvulkan-dev        Vulkan headers and loader
build    libglm-dev           vectors and matrices
build    libnanoflann-dev     nearest neighbours
build    libfmt-dev           text
build    libcli11-dev         command line
build    nlohmann-json3-dev   JSON
build    libjpeg-dev          JPEG photos
build    libpng-dev           PNG photos
build    libstb-dev           writing PNG and JPEG
build    zlib1g-dev           checksums and compression
build    libzstd-dev          SPZ files
build    libzip-dev           SOG files
build    libwebp-dev          SOG files
build    libeigen3-dev        matrix products of LPIPS
build    libmuparser-dev      kernels as expressions
build    libmeshoptimizer-dev simplification of meshes
build    libglfw3-dev         window of the viewer
build    libimgui-dev         panels of the viewer
build    fonts-roboto-unhinted  their letters
run      mesa-vulkan-drivers  lavapipe, the CPU device, and the GPU drivers of Mesa
tests    libgtest-dev         tests
tests    vulkan-validationlayers  synchronization validation
tests    clang                second compiler, sanitizer build
tests    libclang-rt-dev      ASan and UBSan run time
tests    clang-format-14      layout check; one version, so one answer
tests    xvfb                 a display for the tests of the window
tests    xdotool              mouse and keys in them
tests    spirv-tools          spirv-opt and spirv-dis, for the proof that effects that are off cost nothing
tests    spirv-cross          shaders in the language of Metal
tests    python3              style script (standard library only)
tests    universal-ctags      sizes of functions and classes, tools/lab/structure.py
tests    assimp-utils         a second reader of the meshes that are written
tests    ffmpeg               the video of a camera path
tests    python3-dev          the Python module, which every build of the tests loads
tests    pybind11-dev         the Python module
tests    python3-numpy        its arrays
pages    chromium             opens the reports; Debian alone: that of Ubuntu is no package
pages    fonts-dejavu-core    their letters
python   python3-dev          the Python module where no tests are built; optional
python   pybind11-dev         the Python module; optional
python   python3-numpy        its arrays; optional
torch    python3-torch        tests of LPIPS and of darb.torch, which skip without it; optional
packaging dpkg-dev           tools/package.sh: libraries of packages, sources of Debian
packaging file               tools/package.sh: which files are programs
packaging fakeroot           tools/package.sh: owners of files
packaging python3            tools/package.sh: man pages and completion
packaging xz-utils           tools/package.sh: the archive
packaging patchelf           tools/wheel.sh: names of libraries
packaging libxrandr-dev      tools/package.sh: GLFW 3.4
packaging libxinerama-dev    tools/package.sh: GLFW 3.4
packaging libxcursor-dev     tools/package.sh: GLFW 3.4
packaging libxi-dev          tools/package.sh: GLFW 3.4
packaging debootstrap        tools/package_test.sh: bare systems
colmap   colmap               cameras from photos; optional
mpi      libopenmpi-dev       several machines; optional
mpi      openmpi-bin          mpirun; optional
windows  g++-mingw-w64-x86-64-posix  compiler for Windows; optional
windows  libz-mingw-w64-dev   zlib for Windows; optional
windows  nasm                 tools/windows.sh: decoding of JPEG
windows  dpkg-dev             tools/windows.sh: sources of Debian
windows  nsis                 tools/windows.sh: the installer
windows  wine                 tools/windows.sh: runs what was built
windows  wine64               tools/windows.sh: its programs
windows  xvfb                 tools/windows.sh: a display for Wine
'

dry_run=0 backport=0 groups="build run tests"
for option in "$@"; do
    case $option in
        --dry-run) dry_run=1 ;;
        --no-tests) groups=${groups/tests/} ;;
        --with-python) groups+=" python" ;;
        --with-torch) groups+=" torch" ;;
        --with-packaging) groups+=" packaging" ;;
        --with-colmap) groups+=" colmap" ;;
        --with-mpi) groups+=" mpi" ;;
        --with-windows) groups+=" windows" ;;
        --with-mesa-backport) backport=1 ;;
        -h | --help) usage; exit 0 ;;
        *) echo "setup.sh: unknown option $option" >&2; usage >&2; exit 2 ;;
    esac
done

# DARB_OS_RELEASE names another os-release file, so that --dry-run can be tested for any system.
# shellcheck disable=SC1090
distribution=$(. "${DARB_OS_RELEASE:-/etc/os-release}" && echo "${ID:-} ${VERSION_ID:-}")
case $distribution in
    "debian 12"* | "ubuntu 24.04"*) ;;
    debian* | ubuntu*) echo "setup.sh: tested on Debian 12 and Ubuntu 24.04, not on $distribution" >&2 ;;
    *)
        echo "setup.sh: '$distribution' is neither Debian nor Ubuntu; what to install by hand:" >&2
        awk 'NF { printf "  %-24s ", $2; $1 = $2 = ""; print }' <<<"$packages" >&2
        exit 2
        ;;
esac
if [[ $backport == 1 && $distribution != "debian 12"* ]]; then
    echo "setup.sh: --with-mesa-backport is for Debian 12; this is $distribution" >&2
    exit 2
fi

is_installed() {
    [[ $(dpkg-query -W -f='${db:Status-Status}' "$1" 2>/dev/null) == installed ]]
}

[[ $distribution == debian* && " $groups " == *" tests "* ]] && groups+=" pages"
missing=()
while read -r group package _; do
    [[ -n $group && " $groups " == *" $group "* ]] || continue
    [[ " ${missing[*]-} " == *" $package "* ]] || is_installed "$package" || missing+=("$package")
done <<<"$packages"

mesa_version() { dpkg-query -W -f='${Version}' mesa-vulkan-drivers 2>/dev/null || echo 0; }
backport_missing=0
if [[ $backport == 1 ]] && dpkg --compare-versions "$(mesa_version)" lt 25; then
    backport_missing=1
fi

if [[ ${#missing[@]} == 0 && $backport_missing == 0 ]]; then
    echo "setup.sh: everything is installed"
    exit 0
fi
echo "setup.sh: to install: ${missing[*]:-}$([[ $backport_missing == 1 ]] &&
    echo " mesa-vulkan-drivers/bookworm-backports")"
[[ $dry_run == 1 ]] && exit 0

if [[ $(id -u) == 0 ]]; then
    as_root=(env DEBIAN_FRONTEND=noninteractive)
elif command -v sudo >/dev/null; then
    as_root=(sudo env DEBIAN_FRONTEND=noninteractive)
else
    echo "setup.sh: installing needs root; run it as root, or install sudo" >&2
    exit 1
fi

# The backports suite lives beside bookworm on the mirror that this machine already uses.
# shellcheck disable=SC2016
add_backports() {
    [[ $(apt-get indextargets --format '$(RELEASE)') == *bookworm-backports* ]] && return
    local mirror keyring=/usr/share/keyrings/debian-archive-keyring.gpg options=""
    mirror=$(apt-get indextargets --format '$(RELEASE) $(REPO_URI)' 'Created-By: Packages' |
        awk '$1 == "bookworm" && !seen++ { print $2 }')
    if [[ -z $mirror ]]; then
        echo "setup.sh: no apt source for bookworm found, so none for its backports" >&2
        exit 1
    fi
    [[ -f $keyring ]] && options="[signed-by=$keyring] "
    echo "deb ${options}$mirror bookworm-backports main" |
        "${as_root[@]}" tee /etc/apt/sources.list.d/bookworm-backports.list >/dev/null
}

if [[ $backport_missing == 1 ]]; then
    add_backports
fi
"${as_root[@]}" apt-get update -q
if [[ ${#missing[@]} != 0 ]]; then
    "${as_root[@]}" apt-get install -y -q --no-install-recommends "${missing[@]}"
fi
if [[ $backport_missing == 1 ]]; then
    "${as_root[@]}" apt-get install -y -q --no-install-recommends -t bookworm-backports \
        mesa-vulkan-drivers
fi
echo "setup.sh: done"
