#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Sets up, builds, trains the shipped scene and ends with the paths of a picture and a report.
#   tools/demo.sh [options of darb train]
set -euo pipefail
case ${1:-} in -h | --help) sed -n '3,/^[^#]/s/^# \{0,1\}//p' "$0"; exit 0 ;; esac
cd "$(dirname "$0")/.."

tools/setup.sh --no-tests
cmake --preset release -DDARB_TESTS=OFF >/dev/null
cmake --build --preset release --target darb
[[ " $*" == *" --iterations"* ]] || set -- --iterations 3000 "$@"
build/darb train assets/scene -o "$PWD/out/demo" --eval "$@"
