# SPDX-License-Identifier: MIT
# Sourced by tests of scripts: `folder`, which goes with the test, and `check`, which sets `failed`.
# shellcheck shell=bash disable=SC2034 # who sources it ends with $failed
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
failed=0
check() { # NAME PATTERN TEXT
    if grep -qE -- "$2" <<<"$3"; then echo "ok      $1"; else
        printf 'FAILED  %s: expected /%s/ in\n%s\n' "$1" "$2" "$3"
        failed=1
    fi
}
