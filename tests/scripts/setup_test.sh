#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# tools/setup.sh --dry-run on machines described by made-up os-release and dpkg-query answers.
set -uo pipefail
setup=$(cd "$(dirname "$0")/../../tools" && pwd)/setup.sh
fake=$(mktemp -d)
trap 'rm -rf "$fake"' EXIT
failed=0

# machine "ID VERSION" PACKAGE=VERSION...: what the next calls of setup.sh see.
machine() {
    read -r id version <<<"$1"
    shift
    printf 'ID=%s\nVERSION_ID="%s"\n' "$id" "$version" >"$fake/os-release"
    printf '%s\n' "$@" >"$fake/installed"
    cat >"$fake/dpkg-query" <<SCRIPT
#!/usr/bin/env bash
row=\$(awk -F= -v p="\${!#}" '\$1 == p' "$fake/installed")
[[ -n \$row ]] || exit 1
case \$* in *Status*) echo -n installed ;; *Version*) echo -n "\${row#*=}" ;; esac
SCRIPT
    chmod +x "$fake/dpkg-query"
}

# expect NAME STATUS PATTERN OPTIONS...: setup.sh --dry-run ends with STATUS and prints a matching line.
expect() {
    local name=$1 wanted=$2 pattern=$3 output status
    shift 3
    output=$(PATH="$fake:$PATH" DARB_OS_RELEASE="$fake/os-release" "$setup" --dry-run "$@" 2>&1)
    status=$?
    if [[ $status == "$wanted" ]] && grep -qE -- "$pattern" <<<"$output"; then
        echo "ok      $name"
    else
        printf 'FAILED  %s: status %s, expected %s and /%s/\n%s\n' \
            "$name" "$status" "$wanted" "$pattern" "$output"
        failed=1
    fi
}

mapfile -t all < <(sed -n "/^packages='/,/^'/p" "$setup" | awk 'NF > 2 { print $2 "=22.3" }')
[[ ${#all[@]} -gt 10 ]] || { echo "FAILED  the package table was not found"; exit 1; }

machine "debian 12" none=1
expect "bare Debian lists every package" 0 "to install: g\+\+ cmake .*mesa-vulkan-drivers .*python3 .*chromium"
expect "--no-tests leaves the test packages out" 0 'libimgui-dev fonts-roboto-unhinted mesa-vulkan-drivers *$' --no-tests
expect "the tests take the Python module" 0 ' ffmpeg python3-dev pybind11-dev python3-numpy '
expect "--with-python names each package once" 0 ' ffmpeg python3-dev pybind11-dev python3-numpy chromium fonts-dejavu-core *$' \
    --with-python
expect "--with-python adds it without tests" 0 'mesa-vulkan-drivers python3-dev pybind11-dev python3-numpy *$' \
    --no-tests --with-python
expect "--with-mpi adds it" 0 'libopenmpi-dev openmpi-bin *$' --no-tests --with-mpi
expect "--with-windows adds a compiler and what runs its programs" 0 'g\+\+-mingw-w64-x86-64-posix .*nsis wine wine64 xvfb *$' \
    --no-tests --with-windows
expect "--with-colmap adds it" 0 'mesa-vulkan-drivers colmap *$' --no-tests --with-colmap
machine "ubuntu 24.04" none=1
expect "bare Ubuntu lists every package" 0 'to install: g\+\+ cmake .*python3'
machine "ubuntu 24.04" "${all[@]/chromium=22.3/nothing=1}"
expect "Chromium is for Debian" 0 "everything is installed"
expect "the backport is for Debian" 2 'is for Debian 12' --with-mesa-backport
machine "debian 12" "${all[@]}"
expect "complete machine" 0 'everything is installed'
expect "old Mesa and the backport" 0 'to install: +mesa-vulkan-drivers/bookworm-backports' \
    --with-mesa-backport
machine "debian 12" "${all[@]/mesa-vulkan-drivers=22.3/mesa-vulkan-drivers=25.0.7-2~bpo12+1}"
expect "backport already there" 0 'everything is installed' --with-mesa-backport
machine "debian 12" "${all[@]:1}"
expect "one package missing" 0 'to install: g\+\+$'
machine "fedora 40" none=1
expect "another system gets the list" 2 'neither Debian nor Ubuntu'
machine "debian 12" none=1
expect "unknown option" 2 'unknown option --frob' --frob

exit "$failed"
