#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Makes the Debian package python3-darb from a build with the Python module.
#   tools/package_python.sh BUILD OUT      writes OUT/python3-darb_VERSION_ARCH.deb
# It holds what `cmake --install BUILD --component python` installs below /usr; it is compiled when it is installed.
set -euo pipefail
case ${1:-} in
    -h | --help | "") sed -n '3,/^[^#]/s/^# \{0,1\}//p' "$0"; exit 0 ;;
esac
build=$1 out=$2
for tool in dpkg-deb dpkg-shlibdeps; do
    command -v "$tool" >/dev/null || { echo "package_python.sh: $tool is missing (apt install dpkg-dev)" >&2; exit 2; }
done
[[ -n $(find "$build/python/darb" -name '_darb.*.so' 2>/dev/null) ]] || {
    echo "package_python.sh: $build holds no Python module: build the target darb_python" >&2
    exit 2
}

mkdir -p "$out"
out=$(cd "$out" && pwd)
stage=$(mktemp -d)
trap 'rm -rf "$stage"' EXIT
root=$stage/root
cmake --install "$build" --component python --prefix "$root/usr" --strip >/dev/null
version=$(sed -n 's/^CMAKE_PROJECT_VERSION:STATIC=//p' "$build/CMakeCache.txt")
arch=$(dpkg --print-architecture)
python=$(/usr/bin/python3 -c 'import sys; print("%d.%d" % sys.version_info[:2])')
next=${python%.*}.$((${python#*.} + 1))
module=$(find "$root" -name '_darb.*.so')
mkdir -p "$stage/debian" && : >"$stage/debian/control"
libraries=$(cd "$stage" && dpkg-shlibdeps -O --ignore-missing-info "$module" 2>/dev/null | sed 's/^shlibs:Depends=//')
documents=$root/usr/share/doc/python3-darb
mkdir -p "$root/DEBIAN" "$documents"
cp "$(dirname "$0")/../LICENSE" "$documents/copyright"
cp -r "$(dirname "$0")/python/examples" "$documents/"
find "$documents" -name __pycache__ -prune -exec rm -rf {} +
cat >"$root/DEBIAN/control" <<CONTROL
Package: python3-darb
Version: $version
Architecture: $arch
Section: python
Priority: optional
Maintainer: The darb authors <darb@localhost>
Installed-Size: $(du -sk "$root/usr" | cut -f1)
Depends: python3 (>= $python), python3 (<< $next), python3-numpy, libvulkan1, $libraries
Recommends: mesa-vulkan-drivers, python3-torch
Description: 3D splats with a choice of kernel, on any Vulkan device
 Pictures of splats and their gradients as numpy arrays and for PyTorch; splat
 files, data sets, training step by step. No CUDA is needed.
CONTROL
cat >"$root/DEBIAN/postinst" <<'SCRIPT'
#!/bin/sh
set -e
if [ "$1" = configure ] && command -v py3compile >/dev/null; then py3compile -p python3-darb; fi
SCRIPT
cat >"$root/DEBIAN/prerm" <<'SCRIPT'
#!/bin/sh
set -e
if command -v py3clean >/dev/null; then py3clean -p python3-darb; fi
SCRIPT
chmod 755 "$root/DEBIAN/postinst" "$root/DEBIAN/prerm"
package=$out/python3-darb_${version}_$arch.deb
dpkg-deb --root-owner-group --build "$root" "$package" >/dev/null
echo "$package"
