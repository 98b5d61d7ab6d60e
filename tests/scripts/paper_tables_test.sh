#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# tools/lab/paper_tables.sh on a made-up ROOT: which scenes and sizes it hands to darb compare.
set -uo pipefail
script=$(cd "$(dirname "$0")/../../tools/lab" && pwd)/paper_tables.sh
# shellcheck source=check.sh
source "$(dirname "$0")/check.sh"

mkdir -p "$folder"/root/360_v2/{bicycle/images_4,room/images_2,garden/images} "$folder"/root/tandt/Truck/images
mkdir -p "$folder"/root/lego/train/images "$folder"/links/scenes # a folder of photos is no scene
for scene in 360_v2/bicycle 360_v2/room 360_v2/garden tandt/Truck; do mkdir "$folder/root/$scene/sparse"; done
ln -s "$folder"/root/360_v2/room "$folder"/links/scenes/room
printf '#!/bin/sh\necho "$@"\n' >"$folder/darb"
chmod +x "$folder/darb"
export DARB=$folder/darb
output=$("$script" "$folder/root" "$folder/out" --seeds 2 2>&1)
check "sizes of 3DGS" "bicycle@images_4 .*room@images_2 .*Truck@images " "$output"
check "iterations and options" "--iterations 7000,30000 .*--seeds 2" "$output"
check "the paper's schedule" "--train-options=--schedule 3dgs" "$output"
check "another schedule" "--lpips-as-3dgs --train-options=--schedule darb --seeds 2$" \
    "$("$script" "$folder/root" "$folder/out" --train-options "--schedule darb" --seeds 2 2>/dev/null)"
check "other options keep the schedule" "--train-options=--schedule 3dgs --opacity-lr 0.01$" \
    "$("$script" "$folder/root" "$folder/out" --train-options="--opacity-lr 0.01" 2>/dev/null)"
check "missing scenes are named" "left out, not found: .*garden.*playroom" "$output"
check "photos that are called train" "left out, not found: .*train" "$output"
check "links" "room@images_2" "$("$script" "$folder/links" "$folder/out" 2>/dev/null)"
"$script" "$folder/nowhere" "$folder/out" 2>/dev/null
check "no folder" '^2$' "$?"
"$script" 2>/dev/null
check "no arguments" '^2$' "$?"
exit "$failed"
