#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# A small scene as a web page in headless Chromium against darb render: rounded and exact, mouse, keys and touch, hostile
# names, damage; and that a page too far from the truth is found. The same scene streamed, over slow and broken lines. Skips
# without Chromium.
set -uo pipefail
root=$(cd "$(dirname "$0")/../.." && pwd)
darb=${DARB:-$root/build/darb}
[[ -x $darb ]] || { echo "skipped: no $darb"; exit 77; }
command -v chromium chromium-browser google-chrome >/dev/null || { echo "skipped: no chromium (tools/setup.sh installs it)"; exit 77; }
# shellcheck source=check.sh
source "$(dirname "$0")/check.sh"

check help 'tools/page_check.py SCENE' "$("$root/tools/page_check.py" --help)"
text=$("$darb" train "$root/assets/scene" -r 8 -q --iterations 60 --html -o "$folder/run" 2>&1) || { echo "$text"; exit 1; }
check 'darb train --html' '^page +.*scene\.html: [0-9,]+ splats' "$text"
check 'the page of a run' '"name":' "$(cat "$folder/run/scene.html")"
text=$("$root/tools/page_check.py" "run=$folder/run" --darb "$darb" --kernels raised_cosine --views 2 --size 120x90 \
    --turn 0 --cuts 6 --least-exact 99 --least-merged 15 2>&1)
check 'all but one are near' '^2 pages, 1 failures' "$text"
check 'a page too far off is found' 'FAILED  run raised_cosine exact: (5[5-9]|[6-9][0-9])\.[0-9]+ dB at worst, 99\.0 are wanted' "$text"
text=$("$root/tools/stream_check.py" "$folder/run" --darb "$darb" --views 2 --size 120x90 --first 60 2>&1)
check 'a scene that is streamed' '^1 scenes, 0 failures' "$text"
exit "$failed"
