#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Installs the packages of darb in bare systems and trains 50 iterations there; needs root and debootstrap.
#   tools/package_test.sh PACKAGES [KIND]...    PACKAGES: what tools/package.sh wrote; default: its kinds, which are
#     deb       darb_*.deb by apt in a bare Debian 12
#     dev       libdarb-dev_*.deb there, with the program of docs/library.md
#     portable  the archive in a bare Debian 12
#     new       the archive in a bare Debian 13
#     old       the archive in a bare Debian 11, glibc 2.31: it starts, computes and says that there is no device. It does not
#               train there, as Debian 11's Mesa has no Vulkan 1.3
# and of what tools/wheel.sh wrote, with Debian's own Python, first without PyTorch and then with it:
#     wheel     the wheel for 3.11 by pip in a bare Debian 12
#     wheel_new the wheel for 3.13 by pip in a bare Debian 13
set -euo pipefail
case ${1:-} in -h | --help | "") sed -n '3,/^[^#]/s/^# \{0,1\}//p' "$0"; exit 0 ;; esac
packages=$(cd "$1" && pwd)
shift
source=$(cd "$(dirname "$0")/.." && pwd)
kinds=${*:-deb dev portable new old}
mirror=$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' 2>/dev/null | grep -m 1 '/debian/*$' || true)
[[ -n $mirror ]] || { echo "package_test.sh: this machine's apt has no source of Debian" >&2; exit 2; }
work=$(mktemp -d "${TMPDIR:-/var/tmp}/darb_packages.XXXXXX")
finish() {
    for root in "$work"/*/; do
        for folder in dev proc; do mountpoint -q "$root$folder" && umount -l "$root$folder"; done
    done
    rm -rf --one-file-system "$work"
}
trap finish EXIT

# bare SUITE NAME: a minimal Debian, with the packages, the shipped scene and the library's page in it.
bare() {
    local base=${TMPDIR:-/var/tmp}/darb_bare_$1.tar root=$work/$2
    if [[ ! -s $base ]]; then
        debootstrap --variant=minbase "$1" "$work/base" "$mirror" >"$work/debootstrap.log" 2>&1 || { tail -5 "$work/debootstrap.log" >&2; exit 1; }
        tar -C "$work/base" -cf "$base.part" . && mv "$base.part" "$base"
        rm -rf "$work/base"
    fi
    mkdir "$root"
    tar -C "$root" -xf "$base"
    cp /etc/resolv.conf "$root/etc/"
    mkdir -p "$root/packages" "$root/scene"
    cp "$packages"/* "$root/packages/"
    cp -r "$source/assets/scene/." "$root/scene/"
    cp "$source/docs/library.md" "$root/"
    echo force-unsafe-io >"$root/etc/dpkg/dpkg.cfg.d/quick" # the system is thrown away
    mount -t proc proc "$root/proc"
    mount --bind /dev "$root/dev"
}

inside() { # NAME COMMANDS
    env -i HOME=/root PATH=/usr/sbin:/usr/bin:/sbin:/bin LANG=C.UTF-8 DEBIAN_FRONTEND=noninteractive \
        chroot "$work/$1" /bin/bash -euo pipefail -c "$2"
}

# What a user does first, with the command at $darb.
try_it='$darb --version
$darb devices
$darb train /scene -o /out --iterations 50 -r 4
test -s /out/point_cloud/iteration_50/point_cloud.ply -a -s /out/report.html
$darb info /out'

test_deb() {
    bare bookworm deb
    inside deb "apt-get update -q >/dev/null; apt-get install -y -q /packages/darb_*.deb >/tmp/apt; darb=darb; $try_it
dpkg -s mesa-vulkan-drivers | grep -q 'ok installed' && echo 'the CPU driver came with it'
test -s /usr/share/man/man1/darb-train.1.gz -a -s /usr/share/bash-completion/completions/darb
test -s /usr/share/applications/darb.desktop -a -s /usr/share/icons/hicolor/scalable/apps/darb.svg
apt-get remove -y -q darb >/dev/null; ! test -e /usr/bin/darb"
}

test_dev() {
    bare bookworm dev
    inside dev "apt-get update -q >/dev/null; apt-get install -y -q /packages/libdarb-dev_*.deb g++ cmake ninja-build mesa-vulkan-drivers >/tmp/apt
mkdir /program; cd /program
sed -n '/^\`\`\`cmake\$/,/^\`\`\`\$/p' /library.md | sed '1d;\$d' >CMakeLists.txt
sed -n '/^\`\`\`cpp\$/,/^\`\`\`\$/p' /library.md | sed '1d;\$d' >reconstruct.cpp
cmake -G Ninja -S . -B out -DCMAKE_BUILD_TYPE=Release >/dev/null; cmake --build out >/dev/null
out/reconstruct /scene 50; test -s scene.ply -a -s view.png"
}

unpack='apt-get update -q >/dev/null; apt-get install -y -q xz-utils >/tmp/apt; mkdir /opt/darb; tar -C /opt/darb --strip-components 1 -xJf /packages/darb-*-linux-amd64.tar.xz; darb=/opt/darb/bin/darb'

test_portable() {
    bare bookworm portable
    inside portable "$unpack; apt-get install -y -q --no-install-recommends mesa-vulkan-drivers >/tmp/apt; $try_it"
}

test_old() {
    bare bullseye old
    inside old "$unpack; ldd --version | sed -n 1p; \$darb --version
\$darb psi --kernel raised_cosine -q --json /tmp/psi.json; test -s /tmp/psi.json
\$darb info /scene | sed -n 1,4p; code=0; \$darb devices 2>/tmp/devices || code=\$?
test \$code = 2; grep 'no Vulkan device' /tmp/devices"
}

test_new() {
    bare trixie new
    inside new "$unpack; apt-get install -y -q --no-install-recommends mesa-vulkan-drivers >/tmp/apt; ldd --version | sed -n 1p; $try_it"
}

# try_wheel SUITE: the command, a picture and some iterations, without compilers; then darb.torch and darb.gsplat.
try_wheel() {
    bare "$1" "wheel_$1"
    local root=$work/wheel_$1
    mkdir -p "$root/darb/"{tests,tools/python,assets}
    cp -r "$source/tests/python" "$root/darb/tests/"
    cp -r "$source/tools/python/examples" "$root/darb/tools/python/"
    ln -s /scene "$root/darb/assets/scene"
    inside "wheel_$1" "apt-get update -q >/dev/null
apt-get install -y -q --no-install-recommends python3-venv python3-numpy mesa-vulkan-drivers >/tmp/apt
! command -v cc >/dev/null
python3 -m venv --system-site-packages /venv; /venv/bin/pip install -q --no-index --find-links /packages darb
cd /; /venv/bin/pip show -f darb | sed -n '1,/^License/p'; darb=/venv/bin/darb; $try_it
test=/darb/tests/python; export DARB_COMMAND=/venv/bin/darb
/venv/bin/python -B \$test/module_test.py
code=0; /venv/bin/python -B \$test/gsplat_test.py || code=\$?; test \$code = 77
apt-get install -y -q --no-install-recommends python3-torch >/tmp/apt
for name in torch gsplat; do /venv/bin/python -B \$test/\${name}_test.py; done
/venv/bin/python -B /darb/tools/python/examples/fit_gsplat.py -o /out --steps 30 --size 64
/venv/bin/pip uninstall -q -y darb; ! test -e /venv/bin/darb"
}

test_wheel() { try_wheel bookworm; }

test_wheel_new() { try_wheel trixie; }

for kind in $kinds; do
    echo "== $kind"
    "test_$kind"
    echo "== $kind: passed"
done
