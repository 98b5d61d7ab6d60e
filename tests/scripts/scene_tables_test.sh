#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# tools/lab/scene_tables.py on a made-up report: what it keeps and writes, kernels that failed included.
set -uo pipefail
# shellcheck source=check.sh
source "$(dirname "$0")/check.sh"
mkdir -p "$folder/tools/lab" "$folder/docs/experiments" "$folder/assets/results"
cp "$(cd "$(dirname "$0")/../../tools/lab" && pwd)"/{scene_tables,results}.py "$folder/tools/lab"
page=$folder/docs/experiments/kernels_on_photos.md figures=$folder/assets/results/scenes_lavapipe.json

python3 - "$folder/compare.json" <<'TEXT'
import json, sys
NAMES = ("psnr_db", "ssim", "lpips", "model_mb", "splats", "peak_mb", "training_s")

def medians(kernel, iteration, known):
    values = dict(zip(NAMES, known)) if known else {}
    return {"kernel": kernel, "iteration": iteration} | {
        name: {"median": values[name], "low": values[name], "high": values[name], "runs": 1}
        if values.get(name) is not None else None for name in NAMES}

def run(kernel, failure, blending):
    return {"kernel": kernel, "seed": 0, "failure": failure} | ({"blending": blending} if blending else {})

blending = {"blended_per_pixel": 30.48, "pairs_per_splat": 2.542, "ns_per_splat_pixel": 4.619, "blend_ms": 10.02,
            "frame_ms": 21.46}
json.dump({"device": "cpu", "settings": "Made up.", "datasets": [{
    "name": "set",
    "medians": [medians("gaussian", 1000, (20.5, 0.5, None, 1, 100, 36.66, 9)),
                medians("gaussian", 7000, (25.25, 0.75, None, 1, 12345, 36.66, 60)),
                medians("sinc", 1000, (21.5, 0.5, None, 1, 100, None, 9)), medians("sinc", 7000, None),
                medians("cosine", 1000, None), medians("cosine", 7000, None)],
    "runs": [run("gaussian", "", blending), run("sinc", "device lost", None), run("cosine", "diverged", None)],
}]}, open(sys.argv[1], "w"))
TEXT
marks=("<!-- the tables of blending -->" "<!-- end of the tables of blending -->" between
    "<!-- the tables of the data sets -->" "<!-- end of the tables of the data sets -->" after)
printf '%s\n' "${marks[@]}" >"$page"
check "runs" '^0$' "$("$folder/tools/lab/scene_tables.py" "Title.=$folder/compare.json" 2>&1; echo $?)"
text=$(cat "$page")
check "best in bold" '^\| set \| gaussian \| 20\.50, 0\.5000 \| \*\*25\.25\*\*, 0\.7500 \| 12,345 \| 60 \|$' "$text"
check "an iteration that failed" '^\|  \| sinc \| \*\*21\.50\*\*, 0\.5000 \| - \| - \| - \|$' "$text"
check "a kernel that failed" '^\|  \| cosine \| - \| - \| - \| - \|$' "$text"
check "why it failed" '^set, cosine, seed 0: diverged$' "$text"
check "blending" '^\| gaussian \| 30\.5, 2\.54, 10\.0 \|$' "$text"
check "text between the tables" '^between$' "$text"
check "memory and blending are kept" '"peak_mb": \[36\.7, 36\.7, 36\.7\].*"ns_per_splat_pixel": 4\.62' \
    "$(tr '\n' ' ' <"$figures")"
check "again without a report" '^0$' "$("$folder/tools/lab/scene_tables.py" 2>&1; echo $?)"
check "which writes the same page" "^same$" "$([[ $text == "$(cat "$page")" ]] && echo same)"
before=$(cat "$figures")
echo "no marks" >"$page"
check "a page without marks" "has no <!-- the tables of blending -->" \
    "$("$folder/tools/lab/scene_tables.py" "Other.=$folder/compare.json" 2>&1)"
check "which changes nothing" "^same$" "$([[ $before == "$(cat "$figures")" ]] && echo same)"
exit "$failed"
