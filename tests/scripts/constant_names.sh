#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# A specialization constant whose name no shader declares does not compile, and the compiler names the reason.
#   constant_names.sh COMPILER BUILD
set -euo pipefail
compiler=${1:?the compiler of C++} build=${2:?the folder of the build}
cd "$(dirname "$0")/../.."
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

compiles() { # NAME: a table with this constant
    printf '#include "engine/gpu/pipeline.h"\nconstexpr darb::ConstantName kName = "%s";\n' "$1" >"$folder/name.cpp"
    "$compiler" -std=c++20 -fsyntax-only -I. -I"$build/generated/constants" "$folder/name.cpp" 2>"$folder/said"
}

compiles THREADS || { echo "FAILED  THREADS, which shaders declare, does not compile:"; cat "$folder/said"; exit 1; }
if compiles THREDS; then echo "FAILED  THREDS, which no shader declares, compiles"; exit 1; fi
grep -q "no shader declares a specialization constant of this name" "$folder/said" ||
    { echo "FAILED  the compiler does not say why it refuses THREDS:"; cat "$folder/said"; exit 1; }
echo "ok      THREADS compiles, THREDS does not"
