#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# The paper's Tables 1 and 2: its 13 scenes, 5 kernels, 7,000 and 30,000 iterations, at the sizes of 3DGS:
# outdoor scenes of Mip-NeRF 360 from images_4, indoor ones from images_2, the others at most 1,600 px wide.
#   tools/lab/paper_tables.sh ROOT OUT [options of darb compare...]
# ROOT holds the scenes' folders, at any depth up to three: bicycle flowers garden stump treehill room counter
# kitchen bonsai truck train drjohnson playroom. Missing ones are named and left out. Runs again go on. The schedule is
# that of 3DGS, as the paper's, unless --train-options names another --schedule.
set -euo pipefail
case ${1:-} in -h | --help) sed -n '3,/^[^#]/s/^# \{0,1\}//p' "$0"; exit 0 ;; esac

if [[ $# -lt 2 ]]; then
    sed -n '3,9s/^# \{0,1\}//p' "$0" >&2
    exit 2
fi
root=$1 out=$2
shift 2
[[ -d $root ]] || { echo "paper_tables.sh: $root is no folder" >&2; exit 2; }
darb=${DARB:-$(cd "$(dirname "$0")/../.." && pwd)/build/darb}
[[ -x $darb ]] || { echo "paper_tables.sh: $darb is not built; name another with DARB=" >&2; exit 2; }

datasets=() missing=()
add() { # IMAGES SCENE...
    local images=$1 scene folder
    shift
    for scene in "$@"; do
        folder=$(find -L "$root" -maxdepth 3 -type d -iname "$scene" -exec test -d '{}/sparse' \; -print -quit)
        if [[ -z $folder ]]; then
            missing+=("$scene")
        elif [[ -d $folder/$images ]]; then
            datasets+=("$folder@$images")
        else
            echo "paper_tables.sh: $folder has no $images" >&2
            missing+=("$scene")
        fi
    done
}
add images_4 bicycle flowers garden stump treehill
add images_2 room counter kitchen bonsai
add images truck train drjohnson playroom

[[ ${#missing[@]} == 0 ]] || echo "paper_tables.sh: left out, not found: ${missing[*]}" >&2
[[ ${#datasets[@]} -gt 0 ]] || exit 2
training="" rest=()
while [[ $# -gt 0 ]]; do
    case $1 in
        --train[-_]options=*) training=${1#*=} ;;
        --train[-_]options) training=${2?--train-options has no value} && shift ;;
        *) rest+=("$1") ;;
    esac
    shift
done
[[ $training == *--schedule* ]] || training="--schedule 3dgs${training:+ $training}"
exec "$darb" compare "${datasets[@]}" -o "$out" --kernels paper --iterations 7000,30000 --lpips-as-3dgs \
    --train-options="$training" ${rest[@]+"${rest[@]}"}
