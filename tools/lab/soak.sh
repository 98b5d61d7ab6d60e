#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Trains ITERATIONS (default 10,000) on the shipped scene, with density control to the end under a cap of splats, and an
# evaluation, a checkpoint and a scene every tenth; samples the process's memory every second, and fails unless the last
# fifth of the run holds at most 2 % more than the fifth before it.
#   tools/lab/soak.sh [ITERATIONS]
set -euo pipefail
case ${1:-} in -h | --help) sed -n '3,/^[^#]/s/^# \{0,1\}//p' "$0"; exit 0 ;; esac
cd "$(dirname "$0")/../.."

darb=${DARB:-build/darb} # the command under test
iterations=${1:-10000}
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT
tenths=$(seq $((iterations / 10)) $((iterations / 10)) "$iterations")
# shellcheck disable=SC2086 # a word each
"$darb" train assets/scene -o "$out" -r 4 --eval --iterations "$iterations" --densify-until-iter "$iterations" \
    --max-splats 6000 --test-iterations $tenths --save-iterations $tenths --checkpoint-iterations $tenths -q &
run=$!
while kill -0 $run 2>/dev/null; do
    awk '/VmRSS/ { print $2 }' "/proc/$run/status" 2>/dev/null || true
    sleep 1
done >"$out/rss"
wait $run
python3 - "$out/rss" "$iterations" <<'TEXT'
import statistics
import sys

samples = [int(line) for line in open(sys.argv[1], encoding="ascii")]
n = len(samples)
if n < 20:
    sys.exit(f"{n} samples are too few to judge: ask for more iterations")
before, last = samples[n * 3 // 5 : n * 4 // 5], samples[n * 4 // 5 : n - 2]
a, b = statistics.median(before), statistics.median(last)
print(f"{sys.argv[2]} iterations, {n} s: {a / 1024:.1f} MiB, then {b / 1024:.1f} MiB, most {max(samples) / 1024:.1f} MiB")
sys.exit(0 if b <= 1.02 * a else "memory grows")
TEXT
