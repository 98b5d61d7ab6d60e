#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Every shader in Metal's language, as MoltenVK translates it: SPIRV-Cross takes each, and none needs more than 28 of
# Metal's 31 places for buffers, of which MoltenVK takes some itself. Skips (77) where SPIRV-Cross is not installed.
#   metal.sh ROOT
set -uo pipefail
cd "${1:?the source tree}" || exit 1
for tool in glslangValidator spirv-cross; do
    command -v $tool >/dev/null || { echo "skipped: no $tool"; exit 77; }
done
folder=$(mktemp -d) && trap 'rm -rf "$folder"' EXIT
failed=0 most=0
for source in shaders/*/*.comp; do
    name=$(basename "$source" .comp)
    glslangValidator -V --quiet --target-env vulkan1.3 --target-env spirv1.5 -Ishaders -I. -o "$folder/spv" "$source" || { failed=1; continue; }
    if ! spirv-cross --msl --msl-version 20300 --msl-decoration-binding "$folder/spv" >"$folder/metal" 2>"$folder/error"; then
        echo "FAILED  $name: $(head -1 "$folder/error")"
        failed=1
        continue
    fi
    # Push constants get a place of their own from MoltenVK; here they lie at 0.
    places=$(grep -oE '[A-Za-z0-9_]+[&*] [A-Za-z0-9_]+ \[\[buffer\([0-9]+\)\]\]' "$folder/metal" | grep -v '^Push&' | grep -oE '[0-9]+\)' | sort)
    twice=$(uniq -d <<<"$places")
    [[ -z $twice ]] || { echo "FAILED  $name: two buffers in one place: $twice"; failed=1; }
    count=$(wc -l <<<"$places")
    ((count <= 28)) || { echo "FAILED  $name: needs $count buffers, MoltenVK has room for 28"; failed=1; }
    ((count <= most)) || { most=$count largest=$name; }
done
echo "$largest needs the most places: $most"
((most > 0)) && exit $failed
