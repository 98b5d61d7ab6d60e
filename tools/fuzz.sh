#!/usr/bin/env bash
# Fuzzes every reader of files with libFuzzer (clang): splat scenes, COLMAP, transforms.json, checkpoints; and, where
# the tests are built, the pipeline with random scenes that hold poison (tests/pipeline/scene_fuzz_test.cpp).
#   tools/fuzz.sh [MINUTES]      of each (default 10; fractions are legal); 0.02 is what the test gate does
# Seeds: the shipped scene and what darb writes. What is learned stays in build-asan/corpus, findings in
# build-asan/crashes.
set -euo pipefail
cd "$(dirname "$0")/.."

readers="ply compressed_ply dot_splat spz sog splat_file colmap transforms checkpoint"
minutes=${1:-10}
seconds=$(awk -v m="$minutes" 'BEGIN { s = m * 60; print (s < 1 ? 1 : int(s)) }')
build=build-asan
configured=$(cmake --preset asan 2>&1) || { echo "$configured"; exit 1; }
cmake --build $build --target fuzzers -j "$(nproc)"

# COLMAP inputs begin with a byte that says which file they are; see tests/fuzz/colmap_fuzz.cpp.
seed() { mkdir -p "$build/corpus/$1"; }
for reader in $readers; do seed $reader; done
cp assets/scene/*.json $build/corpus/transforms/
which=0
for file in cameras images points3D; do
    { printf "\\x0$which"; head -c 20000 assets/scene/sparse/0/$file.bin; } >$build/corpus/colmap/$file
    which=$((which + 1))
done
printf '\x03# c\n1 OPENCV 200 150 235 235 100 75 0.1 0.01 0 0\n' >$build/corpus/colmap/cameras_text
printf '\x041 1 0 0 0 0 0 1 1 a b.png\n\n' >$build/corpus/colmap/images_text
printf '\x051 0.1 0.2 0.3 255 128 0 0.5 1 2\n' >$build/corpus/colmap/points_text
if [[ -x build/darb ]]; then # what darb itself writes: a splat scene and a checkpoint
    out=$(mktemp -d)
    build/darb train assets/scene -o "$out" -r 8 --iterations 2 --sh-degree 1 -q >/dev/null
    scene=$out/point_cloud/iteration_2/point_cloud.ply
    head -c 60000 "$scene" >$build/corpus/ply/scene
    for format in compressed_ply:compressed.ply dot_splat:splat spz:spz; do # SOG is read alone
        to=$out/scene.${format#*:}
        build/darb convert "$scene" "$to" >/dev/null && head -c 60000 "$to" >"$build/corpus/${format%%:*}/scene"
        cp "$build/corpus/${format%%:*}/scene" "$build/corpus/splat_file/${format%%:*}"
    done
    head -c 200000 "$out"/checkpoint.darb >$build/corpus/checkpoint/cut
    rm -rf "$out"
fi
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
scenes=build/tests/scene_fuzz_test
if [[ -x $scenes ]]; then
    if DARB_FUZZ_SEED=$((RANDOM * 32768 + RANDOM)) DARB_FUZZ_SECONDS=$seconds $scenes >$build/scenes.log 2>&1; then
        echo "scenes: $seconds s, $(sed -nE 's/^([0-9]+) scenes, .*/\1/p' $build/scenes.log) executions, no finding"
    else
        tail -30 $build/scenes.log
        echo "scenes: FAILED, see $build/scenes.log"
        failed=1
    fi
fi
exit $failed
