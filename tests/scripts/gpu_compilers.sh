#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# tools/lab/gpu_compilers.py: AMD's compiler takes every pass within the tracked table, and a worse pass is found.
# Unpacks Mesa's drivers first, where they are missing; skips (77) where they cannot be had.
#   gpu_compilers.sh BUILD
set -euo pipefail
cd "$(dirname "$0")/../.."
build=$1 dir=${DARB_GPU_COMPILERS:-$1/gpu_compilers}
known=$dir/bookworm-backports-radeon.json
[[ -e $known ]] || timeout 120 tools/lab/gpu_compilers.py fetch "$dir" || true
if [[ ! -e $known ]]; then
    echo "skipped: no AMD driver below $dir; get it with: tools/lab/gpu_compilers.py fetch $dir"
    exit 77
fi
tools/lab/gpu_compilers.py check "$dir" --darb "$build/darb"
worse=$(mktemp -d)
trap 'rm -rf "$worse"' EXIT
mkdir -p "$worse/tools/lab" "$worse/assets/results"
cp tools/lab/gpu_compilers.py "$worse/tools/lab"
sed 's/"registers": 48.0/"registers": 47.0/' assets/results/gpu_passes.json >"$worse/assets/results/gpu_passes.json"
if "$worse/tools/lab/gpu_compilers.py" check "$dir" navi31 --again --darb "$build/darb" >"$worse/out"; then
    echo "a pass that takes a register more than the table was not found"
    exit 1
fi
grep -q 'takes 48 registers, the table says 47' "$worse/out"
