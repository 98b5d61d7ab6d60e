#!/bin/sh
# SPDX-License-Identifier: MIT
# tools/lab/view_times.sh OUT.json SCENE...: frame times of darb view at 1280x720 in a window, for each
# scene; on a virtual display where there is none. On a machine that does nothing else.
# The virtual display keeps its memory: else it takes fresh pages for each picture of 3.7 MB, which
# on some virtual machines costs 15 ms a frame.
set -eu
case ${1:-} in -h | --help) sed -n '3,/^[^#]/s/^# \{0,1\}//p' "$0"; exit 0 ;; esac
if [ $# -lt 2 ]; then
    echo "usage: tools/lab/view_times.sh OUT.json SCENE..." >&2
    exit 2
fi
darb=${DARB:-$(dirname "$0")/../../build/darb}
out=$1
shift
folder=$(mktemp -d)
xvfb=
trap 'rm -rf "$folder"; [ -z "$xvfb" ] || kill "$xvfb"' EXIT
if [ -z "${DISPLAY:-}" ]; then
    MALLOC_MMAP_THRESHOLD_=134217728 MALLOC_TRIM_THRESHOLD_=536870912 MALLOC_TOP_PAD_=16777216 \
        Xvfb -displayfd 3 -screen 0 1600x900x24 -nolisten tcp 3>"$folder/display" 2>"$folder/xvfb.log" &
    xvfb=$!
    while [ ! -s "$folder/display" ]; do
        kill -0 "$xvfb" || { cat "$folder/xvfb.log" >&2; exit 2; }
        sleep 0.1
    done
    DISPLAY=:$(cat "$folder/display")
    export DISPLAY
fi
n=0
for scene in "$@"; do
    n=$((n + 1))
    "$darb" view "$scene" --size 1280x720 --times "$folder/$n.json"
done
{
    echo "["
    for i in $(seq "$n"); do
        [ "$i" = 1 ] || echo ","
        cat "$folder/$i.json"
    done
    echo "]"
} >"$out"
