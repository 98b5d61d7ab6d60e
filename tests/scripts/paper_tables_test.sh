#!/usr/bin/env bash
# tools/paper_tables.sh on a made-up ROOT: which scenes and sizes it hands to darb compare.
set -uo pipefail
script=$(cd "$(dirname "$0")/../../tools" && pwd)/paper_tables.sh
fake=$(mktemp -d)
trap 'rm -rf "$fake"' EXIT
failed=0
check() { # NAME PATTERN TEXT
    if grep -qE -- "$2" <<<"$3"; then echo "ok      $1"; else
        printf 'FAILED  %s: expected /%s/ in\n%s\n' "$1" "$2" "$3"
        failed=1
    fi
}

mkdir -p "$fake"/root/360_v2/{bicycle/images_4,room/images_2,garden/images} "$fake"/root/tandt/Truck/images
mkdir -p "$fake"/root/lego/train/images "$fake"/links/scenes # a folder of photos is no scene
for scene in 360_v2/bicycle 360_v2/room 360_v2/garden tandt/Truck; do mkdir "$fake/root/$scene/sparse"; done
ln -s "$fake"/root/360_v2/room "$fake"/links/scenes/room
printf '#!/bin/sh\necho "$@"\n' >"$fake/darb"
chmod +x "$fake/darb"
export DARB=$fake/darb
output=$("$script" "$fake/root" "$fake/out" --seeds 2 2>&1)
check "sizes of 3DGS" "bicycle@images_4 .*room@images_2 .*Truck@images " "$output"
check "iterations and options" "--iterations 7000,30000 .*--seeds 2" "$output"
check "the paper's schedule" "--train-options=--schedule 3dgs" "$output"
check "another schedule" "--lpips-as-3dgs --train-options=--schedule darb --seeds 2$" \
    "$("$script" "$fake/root" "$fake/out" --train-options "--schedule darb" --seeds 2 2>/dev/null)"
check "other options keep the schedule" "--train-options=--schedule 3dgs --opacity-lr 0.01$" \
    "$("$script" "$fake/root" "$fake/out" --train-options="--opacity-lr 0.01" 2>/dev/null)"
check "missing scenes are named" "left out, not found: .*garden.*playroom" "$output"
check "photos that are called train" "left out, not found: .*train" "$output"
check "links" "room@images_2" "$("$script" "$fake/links" "$fake/out" 2>/dev/null)"
"$script" "$fake/nowhere" "$fake/out" 2>/dev/null
check "no folder" '^2$' "$?"
"$script" 2>/dev/null
check "no arguments" '^2$' "$?"
exit "$failed"
