#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# What darb takes of glibc newer than 2.31 stands in tools/portable/old_glibc.c: else the portable archive can't be made.
#   portable_symbols.sh DARB
set -euo pipefail
darb=${1:?the command}
cd "$(dirname "$0")/../.."
case $(uname -m)-$(getconf GNU_LIBC_VERSION) in
    "x86_64-glibc 2.36") ;;
    *) echo "skipped: not the system that the archive is made on (amd64, glibc 2.36)"; exit 77 ;;
esac
command -v objdump >/dev/null || { echo "skipped: no objdump (apt install binutils)"; exit 77; }
newer=$(objdump -T "$darb" | sed -nE 's/.*GLIBC_2\.(3[2-9]|[4-9][0-9])\)? +([A-Za-z_0-9]+)$/\2/p' | sort -u)
[[ -n $newer ]] || { echo "FAILED  $darb: objdump lists no symbol of a newer glibc; it did"; exit 1; }
failed=0
for name in $newer; do
    grep -qE "^OLD\($name,|__wrap_$name\b|^char $name " tools/portable/old_glibc.c && continue
    echo "FAILED  $name: newer than glibc 2.31 and not in tools/portable/old_glibc.c"
    failed=1
done
exit "$failed"
