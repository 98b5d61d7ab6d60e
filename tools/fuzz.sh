#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Fuzzes every reader of files with libFuzzer (clang): splat scenes, meshes, photos, COLMAP, transforms.json, checkpoints, projects; and, where
# the tests are built, the pipeline with random scenes that hold poison (tests/pipeline/scene_fuzz_test.cpp).
#   tools/fuzz.sh [MINUTES]      for each reader (default 10; fractions work); the test gate runs 0.02
# Seeds are small whole files of every format and version (tests/fuzz/make_seeds.cpp). What was learned stays in
# build-asan/corpus, and findings in build-asan/crashes.
set -euo pipefail
case ${1:-} in -h | --help) sed -n '3,/^[^#]/s/^# \{0,1\}//p' "$0"; exit 0 ;; esac
cd "$(dirname "$0")/.."

readers="ply compressed_ply dot_splat spz sog streamed_sog gltf ksplat lcc usda las splat_file mesh photo colmap transforms checkpoint kernel project"
minutes=${1:-10}
seconds=$(awk -v m="$minutes" 'BEGIN { s = m * 60; print (s < 1 ? 1 : int(s)) }')
build=build-asan
configured=$(cmake --preset asan 2>&1) || { echo "$configured"; exit 1; }
cmake --build $build --target fuzzers make_seeds -j "$(nproc)"

for reader in $readers; do mkdir -p "$build/corpus/$reader"; done
cp assets/scene/*.json $build/corpus/transforms/
ASAN_OPTIONS=detect_leaks=0 $build/tests/fuzz/make_seeds $build/corpus
printf 'ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n1 2 3\n' \
    >$build/corpus/ply/points

mkdir -p $build/crashes
failed=0
for reader in $readers; do
    log=$build/$reader.log
    if ASAN_OPTIONS=detect_leaks=0 $build/tests/fuzz/${reader}_fuzz -max_total_time="$seconds" \
        -rss_limit_mb=2048 -timeout=20 -print_final_stats=1 \
        -artifact_prefix=$build/crashes/${reader}_ $build/corpus/$reader >"$log" 2>&1; then
        runs=$(sed -n 's/.*number_of_executed_units: *//p' "$log")
        echo "$reader: $seconds s, $runs executions, no finding"
    else
        tail -30 "$log"
        echo "$reader: FAILED, see $log and $build/crashes"
        failed=1
    fi
done
scenes=build/tests/pipeline_tests
if [[ -x $scenes ]]; then
    if DARB_VALIDATION=1 DARB_FUZZ_SEED=$((RANDOM * 32768 + RANDOM)) DARB_FUZZ_SECONDS=$seconds \
        $scenes --gtest_filter=SceneFuzz.* >$build/scenes.log 2>&1 && ! grep -q 'vulkan validation:' $build/scenes.log; then
        echo "scenes: $seconds s, $(sed -nE 's/^([0-9]+) scenes, .*/\1/p' $build/scenes.log) executions, no finding"
    else
        tail -30 $build/scenes.log
        echo "scenes: FAILED, see $build/scenes.log"
        failed=1
    fi
fi
exit $failed
